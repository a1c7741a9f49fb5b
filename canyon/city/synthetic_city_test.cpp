#include "canyon/city/synthetic_city.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <map>
#include <set>

#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"

namespace canyon::city {
namespace {

bool is_building(const Object& object) {
  return object.surface == Surface::Building;
}

double signed_volume(const Mesh& mesh, const Object& object) {
  double six_volumes = 0;
  for (std::uint32_t t = 0; t < object.triangle_count; ++t) {
    const auto& triangle = mesh.triangles[object.first_triangle + t];
    six_volumes +=
        mesh.vertices[triangle[0]].dot(mesh.vertices[triangle[1]].cross(mesh.vertices[triangle[2]]));
  }
  return six_volumes / 6;
}

/// Directed edges by exact position that lack exactly one opposite partner.
std::size_t unpaired_edges(const Mesh& mesh, const Object& object) {
  using Point = std::array<double, 3>;
  std::map<std::pair<Point, Point>, int> balance;
  std::map<std::pair<Point, Point>, int> uses;
  for (std::uint32_t t = 0; t < object.triangle_count; ++t) {
    const auto& triangle = mesh.triangles[object.first_triangle + t];
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d& from = mesh.vertices[triangle[k]];
      const Eigen::Vector3d& to = mesh.vertices[triangle[(k + 1) % 3]];
      const Point a{from.x(), from.y(), from.z()};
      const Point b{to.x(), to.y(), to.z()};
      ++uses[{a, b}];
      ++balance[{a, b}];
      --balance[{b, a}];
    }
  }
  std::size_t unpaired = 0;
  for (const auto& [edge, count] : balance) unpaired += count != 0 ? 1U : 0U;
  for (const auto& [edge, count] : uses) unpaired += count != 1 ? 1U : 0U;
  return unpaired;
}

Box footprint(const Mesh& mesh, const Object& object) {
  Box box;
  for (std::uint32_t t = 0; t < object.triangle_count; ++t) {
    for (const std::uint32_t v : mesh.triangles[object.first_triangle + t]) {
      box.min = box.min.cwiseMin(mesh.vertices[v]);
      box.max = box.max.cwiseMax(mesh.vertices[v]);
    }
  }
  return box;
}

TEST(SyntheticCity, EveryBuildingIsClosedAndFacesOutwards) {
  SyntheticCityOptions options;
  options.blocks_east = 12;
  options.blocks_north = 9;
  options.seed = 7;
  const City city = synthetic_city(options);
  EXPECT_NO_THROW(check_mesh(city.mesh, city.name));
  std::set<std::uint32_t> shapes;
  for (const Object& object : city.mesh.objects) {
    if (!is_building(object)) continue;
    EXPECT_EQ(unpaired_edges(city.mesh, object), 0U) << object.name;
    EXPECT_GT(signed_volume(city.mesh, object), 100) << object.name;
    shapes.insert(object.triangle_count);
  }
  // 12: box; 28: tower on a podium; 32: courtyard; 44: two setbacks.
  EXPECT_EQ(shapes, (std::set<std::uint32_t>{12, 28, 32, 44}));
}

TEST(SyntheticCity, BuildingsStayInTheirBlocksAndApart) {
  SyntheticCityOptions options;
  options.blocks_east = 5;
  options.blocks_north = 4;
  const City city = synthetic_city(options);
  std::vector<Box> boxes;
  for (const Object& object : city.mesh.objects) {
    if (is_building(object)) boxes.push_back(footprint(city.mesh, object));
  }
  ASSERT_GE(boxes.size(), 20U);
  for (std::size_t a = 0; a < boxes.size(); ++a) {
    EXPECT_GE(boxes[a].max.z(), options.min_height_m);
    EXPECT_LE(boxes[a].max.z(), options.max_height_m);
    EXPECT_EQ(boxes[a].min.z(), 0);
    for (std::size_t b = 0; b < a; ++b) {
      const bool apart = (boxes[a].min.array() > boxes[b].max.array()).head<2>().any() ||
                         (boxes[b].min.array() > boxes[a].max.array()).head<2>().any();
      EXPECT_TRUE(apart) << a << " and " << b;
    }
  }
}

// Streets run north-south and east-west through the origin, for even and odd numbers of blocks.
TEST(SyntheticCity, OriginIsOnACrossing) {
  for (const auto& [east, north] : {std::pair{8, 8}, {5, 3}, {1, 1}}) {
    SyntheticCityOptions options;
    options.blocks_east = east;
    options.blocks_north = north;
    const City city = synthetic_city(options);
    for (const Object& object : city.mesh.objects) {
      if (!is_building(object)) continue;
      const Box box = footprint(city.mesh, object);
      const double half = 0.5 * options.street_width_m;
      EXPECT_TRUE(box.min.x() > half || box.max.x() < -half) << object.name;
      EXPECT_TRUE(box.min.y() > half || box.max.y() < -half) << object.name;
    }
  }
}

TEST(SyntheticCity, TerrainReachesBeyondTheStreets) {
  const City city = synthetic_city({});
  ASSERT_EQ(city.mesh.objects.front().name, "terrain");
  ASSERT_EQ(city.mesh.objects.front().surface, Surface::Terrain);
  const Box ground = footprint(city.mesh, city.mesh.objects.front());
  for (std::size_t i = 1; i < city.mesh.objects.size(); ++i) {
    const Box box = footprint(city.mesh, city.mesh.objects[i]);
    EXPECT_TRUE(((box.min - ground.min).array().head<2>() > 400).all());
    EXPECT_TRUE(((ground.max - box.max).array().head<2>() > 400).all());
  }
}

TEST(SyntheticCity, SameSeedSameBytesOtherSeedOtherCity) {
  SyntheticCityOptions options;
  const City a = synthetic_city(options);
  const City b = synthetic_city(options);
  EXPECT_TRUE(a.mesh.vertices == b.mesh.vertices);
  EXPECT_TRUE(a.mesh.triangles == b.mesh.triangles);
  options.seed = 2;
  EXPECT_FALSE(synthetic_city(options).mesh.vertices == a.mesh.vertices);
}

// Pins the generator: seed 1's first building, as made by this version (a change here changes all users'
// results).
TEST(SyntheticCity, SeedOneStaysWhatItIs) {
  const City city = synthetic_city({});
  const Object& first = city.mesh.objects.at(1);
  const Box box = footprint(city.mesh, first);
  EXPECT_EQ(first.name, "block_0_0_b1");
  EXPECT_EQ(city.mesh.triangles.size(), 3454U);
  // Four blocks of 60 m and streets of 16 m west of the origin, half a street, 2.5 m of pavement.
  EXPECT_EQ(box.min, Eigen::Vector3d(-293.5, -293.5, 0));
  EXPECT_EQ(box.max, Eigen::Vector3d(-265.174, -268.64, 16.971));
}

TEST(SyntheticCity, TallerInTheMiddle) {
  SyntheticCityOptions options;
  options.blocks_east = options.blocks_north = 20;
  const City city = synthetic_city(options);
  double inner = 0;
  double outer = 0;
  int inner_count = 0;
  int outer_count = 0;
  for (const Object& object : city.mesh.objects) {
    if (!is_building(object)) continue;
    const Box box = footprint(city.mesh, object);
    const bool middle = (0.5 * (box.min + box.max)).head<2>().cwiseAbs().maxCoeff() < 250;
    (middle ? inner : outer) += box.max.z();
    ++(middle ? inner_count : outer_count);
  }
  EXPECT_GT(inner / inner_count, 1.3 * outer / outer_count);
}

TEST(SyntheticCity, ExtremesOfItsOptions) {
  SyntheticCityOptions options;
  options.blocks_east = options.blocks_north = 1;
  options.block_size_m = 10;
  options.street_width_m = 4;
  options.min_height_m = options.max_height_m = 1;
  const City small = synthetic_city(options);
  EXPECT_EQ(summarize(small).buildings, 1U);
  options.block_size_m = 500;
  options.street_width_m = 100;
  options.min_height_m = options.max_height_m = 1000;
  const City city = synthetic_city(options);
  for (const Object& object : city.mesh.objects) {
    if (is_building(object)) {
      EXPECT_EQ(unpaired_edges(city.mesh, object), 0U) << object.name;
    }
  }
}

TEST(SyntheticCity, RefusesOptionsOutsideTheirBounds) {
  const auto refused = [](auto change) {
    SyntheticCityOptions options;
    change(options);
    EXPECT_THROW(static_cast<void>(synthetic_city(options)), InputError);
  };
  refused([](SyntheticCityOptions& o) { o.blocks_east = 0; });
  refused([](SyntheticCityOptions& o) { o.blocks_north = 201; });
  refused([](SyntheticCityOptions& o) { o.block_size_m = 9; });
  refused([](SyntheticCityOptions& o) { o.street_width_m = std::numeric_limits<double>::quiet_NaN(); });
  refused([](SyntheticCityOptions& o) { o.min_height_m = 0; });
  refused([](SyntheticCityOptions& o) { o.max_height_m = 11; });
  refused([](SyntheticCityOptions& o) { o.origin.latitude_rad = 22.3; });
}

}  // namespace
}  // namespace canyon::city
