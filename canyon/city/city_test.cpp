#include "canyon/city/city.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>
#include <string>

#include "canyon/base/input_error.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/refusal.hpp"

namespace canyon::city {
namespace {

using ::testing::HasSubstr;

Mesh two_boxes_on_ground() {
  Mesh mesh;
  append_object(mesh, "terrain", Surface::Terrain, Material::Ground,
                {{-100, -100, 0}, {100, -100, 0}, {100, 100, 0}, {-100, 100, 0}}, {{0, 1, 2}, {0, 2, 3}});
  canyon::test::append_box(mesh, "low", Surface::Building, Material::Brick, {0, 0, 0}, {10, 20, 6});
  canyon::test::append_box(mesh, "tower", Surface::Building, Material::Glass, {30, 0, 0}, {40, 20, 60});
  return mesh;
}

std::string message_of(const Mesh& mesh) {
  return test::refusal([&] { check_mesh(mesh, "test mesh"); });
}

TEST(Mesh, SurfaceOfEveryTriangle) {
  const Mesh mesh = two_boxes_on_ground();
  ASSERT_EQ(mesh.triangles.size(), 2U + 12U + 12U);
  EXPECT_EQ(mesh.surface_of(0), Surface::Terrain);
  EXPECT_EQ(mesh.surface_of(1), Surface::Terrain);
  for (std::uint32_t t = 2; t < 26; ++t) EXPECT_EQ(mesh.surface_of(t), Surface::Building) << t;
}

TEST(City, BoundsOfTheTrianglesOnly) {
  City city;
  EXPECT_GT(city.bounds().min.x(), city.bounds().max.x()) << "an empty city has no bounds";
  city.mesh = two_boxes_on_ground();
  city.mesh.vertices.emplace_back(5000, 0, 0);  // belongs to no triangle
  EXPECT_EQ(city.bounds().min, Eigen::Vector3d(-100, -100, 0));
  EXPECT_EQ(city.bounds().max, Eigen::Vector3d(100, 100, 60));
}

TEST(City, Summary) {
  City city;
  city.mesh = two_boxes_on_ground();
  const CitySummary summary = summarize(city);
  EXPECT_EQ(summary.buildings, 2U);
  EXPECT_EQ(summary.triangles, 26U);
  EXPECT_EQ(summary.terrain_triangles, 2U);
  EXPECT_EQ(summary.highest_roof_m, 60);
  // Two roofs of 10 m x 20 m in the buildings' bounds of 40 m x 20 m; sampled in cells of 20 mm.
  EXPECT_NEAR(summary.built_area_fraction, 0.5, 0.002);
}

TEST(City, SummaryOfOpenField) {
  const CitySummary summary = summarize(City{});
  EXPECT_EQ(summary.buildings, 0U);
  EXPECT_EQ(summary.triangles, 0U);
  EXPECT_EQ(summary.built_area_fraction, 0);
}

// Volume by the divergence theorem and containment by the signs of all planes: closed forms of a box.
TEST(AppendBox, FrontSidesOutwardsAlsoTurned) {
  for (const double yaw : {0.0, 0.3, -2.0}) {
    Mesh mesh;
    canyon::test::append_box(mesh, "box", Surface::Vehicle, Material::Metal, {1, 2, 3}, {5, 5, 5}, yaw);
    ASSERT_EQ(mesh.triangles.size(), 12U);
    ASSERT_EQ(mesh.vertices.size(), 8U);
    const Eigen::Vector3d centre(3, 3.5, 4);
    double six_volumes = 0;
    for (const auto& t : mesh.triangles) {
      const Eigen::Vector3d a = mesh.vertices[t[0]];
      const Eigen::Vector3d b = mesh.vertices[t[1]];
      const Eigen::Vector3d c = mesh.vertices[t[2]];
      six_volumes += a.dot(b.cross(c));
      EXPECT_LT((b - a).cross(c - a).dot(centre - a), 0);
    }
    EXPECT_NEAR(six_volumes / 6, 4 * 3 * 2, 1e-12);
  }
}

TEST(AppendBox, YawTurnsCounterClockwise) {
  Mesh mesh;  // long towards east; a quarter turn rotates it to north
  canyon::test::append_box(mesh, "box", Surface::Building, Material::Unknown, {-10, -1, 0}, {10, 1, 1}, 0.1);
  // The east end's middle (10, 0) moves to (10 cos, 10 sin): north of the axis.
  double north_of_east_end = 0;
  for (const auto& v : mesh.vertices) {
    if (v.x() > 5) north_of_east_end += v.y() / 4;
  }
  EXPECT_NEAR(north_of_east_end, 10 * std::sin(0.1), 1e-12);
}

TEST(AppendObject, DropsDegenerateTrianglesAndTheirVertices) {
  Mesh mesh;
  const std::size_t dropped =
      append_object(mesh, "a", Surface::Building, Material::Concrete,
                    {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}, {0, 1e-9, 0}, {7, 7, 7}},
                    {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}, {5, 5, 5}});
  EXPECT_EQ(dropped, 3U) << "collinear, slimmer than 1e-8 m^2, and a point";
  EXPECT_EQ(mesh.triangles.size(), 1U);
  EXPECT_EQ(mesh.vertices.size(), 3U);
  EXPECT_EQ(mesh.materials.size(), 1U);
  EXPECT_NO_THROW(check_mesh(mesh, "a"));
}

TEST(AppendObject, NothingLeftMakesNoObject) {
  Mesh mesh;
  EXPECT_EQ(append_object(mesh, "a", Surface::Building, Material::Concrete, {{0, 0, 0}}, {{0, 0, 0}}), 1U);
  EXPECT_TRUE(mesh.objects.empty());
}

TEST(AppendObject, IndexOutOfRange) {
  Mesh mesh;
  EXPECT_THROW(append_object(mesh, "a", Surface::Building, Material::Concrete, {{0, 0, 0}}, {{0, 0, 1}}),
               InputError);
  EXPECT_TRUE(mesh.vertices.empty());
}

TEST(CheckMesh, AcceptsGoodOnes) {
  EXPECT_EQ(message_of(two_boxes_on_ground()), "");
  EXPECT_EQ(message_of(Mesh{}), "");
}

TEST(CheckMesh, NamesTheFault) {
  Mesh mesh = two_boxes_on_ground();
  mesh.triangles[5][1] = 999;
  EXPECT_THAT(message_of(mesh), HasSubstr("mesh 'test mesh': triangle 5 uses vertex 999"));

  mesh = two_boxes_on_ground();
  mesh.vertices[3].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(message_of(mesh), HasSubstr("vertex 3 is not finite"));

  mesh = two_boxes_on_ground();
  mesh.vertices[3].x() = 2e6;
  EXPECT_THAT(message_of(mesh), HasSubstr("vertex 3 is 2000 km from the origin"));

  mesh = two_boxes_on_ground();
  mesh.materials.pop_back();
  EXPECT_THAT(message_of(mesh), HasSubstr("25 materials for 26 triangles"));

  mesh = two_boxes_on_ground();
  mesh.objects.pop_back();
  EXPECT_THAT(message_of(mesh), HasSubstr("objects cover 14 of 26"));

  mesh = two_boxes_on_ground();
  mesh.objects[1].first_triangle = 3;
  EXPECT_THAT(message_of(mesh), HasSubstr("object 'low' begins at triangle 3, not 2"));
}

}  // namespace
}  // namespace canyon::city
