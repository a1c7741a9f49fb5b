#include "canyon/city/buildings/shapes/solid.hpp"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <fstream>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/buildings/sources/city_files.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/mesh_topology.hpp"
#include "tests/support/cityjson_house.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::buildings {
namespace {

using city::Material;
using geodesy::Geodetic;

const geodesy::LocalFrame& frame() {
  static const geodesy::LocalFrame kFrame(Geodetic::from_degrees(48.13, 11.567, 500));
  return kFrame;
}

/// A surface whose corners are given in frame().
MapSurface surface(const std::vector<Eigen::Vector3d>& outer,
                   const std::vector<std::vector<Eigen::Vector3d>>& inners = {},
                   const std::string& semantic = "") {
  const auto point = [](const std::vector<Eigen::Vector3d>& ring) {
    std::vector<Eigen::Vector3d> result;
    for (const auto& p : ring) {
      const Geodetic g = frame().geodetic_from_local(p);
      result.emplace_back(geodesy::degrees(g.longitude_rad), geodesy::degrees(g.latitude_rad), g.height_m);
    }
    return result;
  };
  MapSurface made;
  made.outer = point(outer);
  for (const auto& inner : inners) made.inners.push_back(point(inner));
  made.semantic = semantic;
  return made;
}

/// Volume by the divergence theorem.
double volume(const city::Mesh& mesh) {
  double six = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    six += mesh.vertices[a].dot(mesh.vertices[b].cross(mesh.vertices[c]));
  }
  return six / 6;
}

/// The faces of a block, each seen counter-clockwise from outside.
std::vector<std::vector<Eigen::Vector3d>> block(double x0, double y0, double z0, double x1, double y1,
                                                double z1) {
  const Eigen::Vector3d a(x0, y0, z0), b(x1, y0, z0), c(x1, y1, z0), d(x0, y1, z0);
  const Eigen::Vector3d e(x0, y0, z1), f(x1, y0, z1), g(x1, y1, z1), h(x0, y1, z1);
  return {{a, d, c, b}, {e, f, g, h}, {a, b, f, e}, {b, c, g, f}, {c, d, h, g}, {d, a, e, h}};
}

double surface_area(const city::Mesh& mesh, Material material) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    if (mesh.materials[t] != material) continue;
    sum += 0.5 * (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).norm();
  }
  return sum;
}

// A window in the middle of a wall and a door on its lower edge, both on a wall without holes, and a window
// 20 cm behind it: the wall is built once, and the window behind it is not cut out.
TEST(CityJsonSolidTest, OpeningsAreCutOutOfTheirWalls) {
  std::vector<MapSurface> surfaces;
  for (const auto& face : block(0, 0, 0, 10, 8, 6)) surfaces.push_back(surface(face, {}, "WallSurface"));
  surfaces.push_back(surface({{4, 0, 2}, {6, 0, 2}, {6, 0, 4}, {4, 0, 4}}, {}, "Window"));
  surfaces.push_back(surface({{7, 0, 0}, {8, 0, 0}, {8, 0, 2}, {7, 0, 2}}, {}, "Door"));
  surfaces.push_back(surface({{1, 0.2, 2}, {2, 0.2, 2}, {2, 0.2, 4}, {1, 0.2, 4}}, {}, "Window"));
  city::Mesh mesh;
  std::vector<std::string> notes;
  ASSERT_TRUE(append_surfaces(mesh, "a", surfaces, frame(), notes, Material::Brick, Material::Metal));
  EXPECT_NEAR(surface_area(mesh, Material::Glass), 4 + 2, 0.02);
  EXPECT_NEAR(surface_area(mesh, Material::Brick), 2 * (80 + 60 + 48) - 4,
              0.02);  // the door is of the facade's material
}

// A hole that touches its ring along an edge, and one beyond it: the rest of the roof is built.
TEST(CityJsonSolidTest, HolesThatTouchOrLieOutsideAreRepaired) {
  const std::vector<std::vector<Eigen::Vector3d>> holes{{{5, 0, 6}, {7, 0, 6}, {6, 2, 6}},
                                                        {{20, 20, 6}, {21, 20, 6}, {21, 21, 6}}};
  for (std::size_t k = 0; k < holes.size(); ++k) {
    std::vector<MapSurface> surfaces;
    for (const auto& face : block(0, 0, 0, 10, 8, 6)) surfaces.push_back(surface(face));
    surfaces[1] = surface({{0, 0, 6}, {10, 0, 6}, {10, 8, 6}, {0, 8, 6}}, {holes[k]});
    city::Mesh mesh;
    std::vector<std::string> notes;
    ASSERT_TRUE(append_surfaces(mesh, "a", surfaces, frame(), notes, Material::Brick, Material::Metal));
    EXPECT_NEAR(surface_area(mesh, Material::Brick), 2 * (80 + 60 + 48) - (k == 0 ? 2 : 0), 0.02);
    EXPECT_EQ(notes.at(0), "a: repaired 1 of 6 surfaces whose rings cross or touch");
  }
}

TEST(CityJsonSolidTest, ClosureSurfacesAreOpen) {
  std::vector<MapSurface> surfaces;
  for (const auto& face : block(0, 0, 0, 10, 8, 6)) surfaces.push_back(surface(face));
  surfaces[2].semantic = "ClosureSurface";
  city::Mesh mesh;
  std::vector<std::string> notes;
  ASSERT_TRUE(append_surfaces(mesh, "a", surfaces, frame(), notes));
  EXPECT_EQ(mesh.triangles.size(), 10U);
  EXPECT_TRUE(notes.empty());  // the shell itself is closed
}

TEST(CityJsonSolidTest, GableHouseIsWatertightWithItsVolumeAndMaterials) {
  test::TemporaryFolder folder;
  std::ofstream(folder / "house.json") << test::cityjson(test::cityjson_building("house", test::kHouseSolid));
  const MapData data = read_city_files({folder / "house.json"});
  city::Mesh mesh;
  std::vector<std::string> notes;
  ASSERT_TRUE(append_surfaces(mesh, "house", data.features.at(0).surfaces, frame(), notes, Material::Brick,
                              Material::Metal));
  EXPECT_TRUE(notes.empty()) << notes[0];
  ASSERT_EQ(mesh.objects.size(), 1U);
  EXPECT_EQ(mesh.objects[0].name, "house");
  EXPECT_EQ(mesh.vertices.size(), 10U);
  EXPECT_EQ(mesh.triangles.size(), 16U);  // 5 quadrilaterals and 2 pentagons: 5 * 2 + 2 * 3
  EXPECT_NO_THROW(city::check_mesh(mesh, "house"));
  // 600 m^3 in the grid; the grid's scale at this position is 1.00005 (k = 0.9996 (1 + (191 km)^2 / 2 R^2))
  // in area.
  EXPECT_NEAR(volume(mesh), 600, 0.1);
  std::size_t roof = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const Eigen::Vector3d normal =
        (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).normalized();
    const bool slanted = normal.z() > 0.1 && normal.z() < 0.9;  // tan = 3 / 4
    EXPECT_EQ(mesh.materials[t], slanted ? Material::Metal : Material::Brick);
    if (slanted) {
      ++roof;
      EXPECT_NEAR(normal.z(), 0.8, 1e-3);
    }
  }
  EXPECT_EQ(roof, 4U);
}

TEST(CityJsonSolidTest, WrongSidesAreTurned) {
  for (const int rotated : {0b000000, 0b111111, 0b000100, 0b110110}) {
    std::vector<MapSurface> surfaces;
    auto faces = block(0, 0, 0, 10, 8, 6);
    for (std::size_t i = 0; i < faces.size(); ++i) {
      if ((rotated >> i & 1) != 0) std::reverse(faces[i].begin(), faces[i].end());
      surfaces.push_back(surface(faces[i]));
    }
    city::Mesh mesh;
    std::vector<std::string> notes;
    ASSERT_TRUE(append_surfaces(mesh, "block", surfaces, frame(), notes));
    EXPECT_NEAR(volume(mesh), 480, 1e-4) << rotated;
    EXPECT_TRUE(notes.empty()) << rotated;
  }
}

TEST(CityJsonSolidTest, CourtyardWithHolesInAnyOrientation) {
  // A block 20 x 20 x 10 m with a shaft 6 x 6 m: roof and floor with holes, volume (400 - 36) * 10.
  for (const bool reversed : {false, true}) {
    const auto outer = block(0, 0, 0, 20, 20, 10);
    const auto shaft = block(7, 7, 0, 13, 13, 10);
    std::vector<MapSurface> surfaces;
    for (std::size_t i = 0; i < 2; ++i) {
      auto hole = shaft[i];
      if (reversed) std::reverse(hole.begin(), hole.end());
      surfaces.push_back(surface(outer[i], {hole}, i == 1 ? "RoofSurface" : "GroundSurface"));
    }
    for (std::size_t i = 2; i < 6; ++i) {
      surfaces.push_back(surface(outer[i]));
      surfaces.push_back(surface({shaft[i].rbegin(), shaft[i].rend()}));
    }
    city::Mesh mesh;
    std::vector<std::string> notes;
    ASSERT_TRUE(append_surfaces(mesh, "court", surfaces, frame(), notes));
    EXPECT_TRUE(notes.empty()) << notes[0];
    EXPECT_NEAR(volume(mesh), 3640, 1e-3);
  }
}

TEST(CityJsonSolidTest, VerticesWithinAMillimetreAreOne) {
  std::vector<MapSurface> surfaces;
  int k = 0;
  for (const auto& face : block(0, 0, 0, 10, 8, 6)) {
    std::vector<Eigen::Vector3d> shaken = face;
    for (auto& p : shaken) {
      p += 3e-4 * Eigen::Vector3d(k % 2, (k / 2) % 2, (k / 3) % 2);
      ++k;
    }
    surfaces.push_back(surface(shaken));
  }
  city::Mesh mesh;
  std::vector<std::string> notes;
  ASSERT_TRUE(append_surfaces(mesh, "shaken", surfaces, frame(), notes));
  EXPECT_EQ(mesh.vertices.size(), 8U);
  EXPECT_TRUE(notes.empty()) << notes[0];
}

TEST(CityJsonSolidTest, OpenAndBrokenSurfacesAreSaid) {
  auto faces = block(0, 0, 0, 10, 8, 6);
  std::vector<MapSurface> surfaces;
  for (std::size_t i = 0; i < 5; ++i) surfaces.push_back(surface(faces[i]));
  surfaces.push_back(surface({{0, 0, 0}, {10, 0, 6}, {10, 0, 0}, {0, 0, 5}}));  // crosses itself
  surfaces.push_back(surface({{0, 0, 0}, {1e-4, 0, 0}, {2e-4, 0, 0}}));         // nothing
  surfaces.push_back(surface({{0, 0, 0}, {10, 0, 0}, {5, 0, 0}}));              // a line
  city::Mesh mesh;
  std::vector<std::string> notes;
  ASSERT_TRUE(append_surfaces(mesh, "open", surfaces, frame(), notes));
  ASSERT_EQ(notes.size(), 3U);
  EXPECT_EQ(notes[0], "open: repaired 1 of 8 surfaces whose rings cross or touch");
  EXPECT_EQ(notes[1], "open: left out 2 of 8 surfaces that are not polygons");
  EXPECT_EQ(notes[2], "open: its surfaces are not closed");
  EXPECT_EQ(mesh.triangles.size(), 12U);
  EXPECT_FALSE(append_surfaces(mesh, "nothing", {surfaces[6]}, frame(), notes));
  EXPECT_FALSE(append_surfaces(mesh, "none", {}, frame(), notes));
  EXPECT_EQ(mesh.objects.size(), 1U);
}

}  // namespace
}  // namespace canyon::buildings
