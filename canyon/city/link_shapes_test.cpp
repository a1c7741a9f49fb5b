#include "canyon/city/link_shapes.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>
#include <limits>

#include "canyon/city/mesh_marks.hpp"

namespace canyon::city::link_shapes_test {
namespace {

using Eigen::Affine3d;
using Eigen::Vector3d;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// Volume from the triangles: positive if front sides face outwards.
double volume_of(const Mesh& mesh) {
  double volume = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    volume += mesh.vertices[a].dot(mesh.vertices[b].cross(mesh.vertices[c])) / 6;
  }
  return volume;
}

Eigen::AlignedBox3d bounds_of(const Mesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Vector3d& v : mesh.vertices) box.extend(v);
  return box;
}

/// A tetrahedron with legs of 1 m along the axes; 1/6 m^3.
MeshNode corner(const std::string& name) {
  return {
      name, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}, {}};
}

class LinkShapesTest : public testing::Test {
 protected:
  std::vector<std::string> notes_;
  LinkShapes shapes_{notes_};
  LinkShapes::ShapePose position_{"house::link::wall", Affine3d::Identity(), Material::Brick};
};

TEST_F(LinkShapesTest, PrimitivesLieWhereTheyWerePut) {
  position_.link_from_shape = Eigen::Translation3d(10, 20, 30) *
                              Eigen::AngleAxisd(std::acos(-1) / 2, Vector3d::UnitX());  // z becomes -y
  const auto expect = [&](const Vector3d& half) {
    const Mesh mesh = shapes_.take();
    ASSERT_EQ(mesh.objects.size(), 1U);
    EXPECT_EQ(mesh.objects[0].name, "house::link::wall");
    EXPECT_EQ(mesh.objects[0].surface, Surface::Building);
    EXPECT_THAT(mesh.materials, testing::Each(Material::Brick));
    EXPECT_LT((bounds_of(mesh).min() - Vector3d(10, 20, 30) + half).norm(), 1e-12) << half.transpose();
    EXPECT_LT((bounds_of(mesh).max() - Vector3d(10, 20, 30) - half).norm(), 1e-12) << half.transpose();
  };
  shapes_.solid(position_, "a box", box_mesh({2, 4, 6}));
  expect({1, 3, 2});
  shapes_.solid(position_, "a cylinder", cylinder_mesh(2, 6));
  expect({2, 3, 2});
  shapes_.solid(position_, "a cone", cone_mesh(2, 6));
  expect({2, 3, 2});
  shapes_.solid(position_, "a capsule", capsule_mesh(2, 6));
  expect({2, 5, 2});
  shapes_.solid(position_, "a sphere", sphere_mesh(2));
  expect({2, 2, 2});
  shapes_.solid(position_, "an ellipsoid", ellipsoid_mesh({1, 2, 3}));
  expect({1, 3, 2});
  EXPECT_THAT(notes_, IsEmpty());
}

TEST_F(LinkShapesTest, WithoutExtentNothingIsTaken) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  shapes_.solid(position_, "a box", box_mesh({1, 0, 1}));
  shapes_.solid(position_, "a cylinder", cylinder_mesh(1, none));
  shapes_.solid(position_, "a cone", cone_mesh(-1, 1));
  shapes_.solid(position_, "a capsule", capsule_mesh(1, -1));
  shapes_.solid(position_, "a sphere", sphere_mesh(none));
  shapes_.solid(position_, "an ellipsoid", ellipsoid_mesh({1, 1, std::numeric_limits<double>::infinity()}));
  shapes_.plane(position_, {0, 0, 0}, {1, 1});
  shapes_.plane(position_, {0, 0, 1}, {1, 0});
  shapes_.mesh(position_, {{corner("a")}, false}, {{1, 0, 1}, "", false});
  shapes_.mesh(position_, {}, {});
  shapes_.polylines(position_, {{{0, 0}, {1, 0}}}, 2, {});
  shapes_.heights(position_, {});
  position_.link_from_shape = Eigen::Translation3d(1e5, 0, 0);
  shapes_.solid(position_, "a box", box_mesh({1, 1, 1}));
  EXPECT_THAT(notes_, testing::Each(HasSubstr("'house::link::wall' is left out: ")));
  EXPECT_EQ(notes_.size(), 13U);
  EXPECT_TRUE(shapes_.take().triangles.empty());
}

TEST_F(LinkShapesTest, PlanesAreCut) {
  shapes_.plane(position_, {0, 0, 5}, {1e6, 30});
  EXPECT_LT((bounds_of(shapes_.take()).sizes() - Vector3d(kMaxPlane_m, 30, 0)).norm(), 1e-9);
  EXPECT_THAT(notes_, ElementsAre("'house::link::wall' is a plane cut to 10 km about its origin"));
}

TEST_F(LinkShapesTest, TerrainByItsName) {
  position_.name = "terrain::link::wall";
  shapes_.solid(position_, "a box", box_mesh({1, 1, 1}));
  const Mesh mesh = shapes_.take();
  EXPECT_EQ(mesh.objects.at(0).surface, Surface::Terrain);
  EXPECT_THAT(mesh.materials, testing::Each(Material::Ground));
}

TEST_F(LinkShapesTest, MeshesLookOutwardsHoweverTheyAreScaled) {
  MeshFile file{{corner("wing"), corner("wing"), corner("roof")}, false};
  for (Vector3d& v : file.nodes[1].vertices) v.x() += 5;
  for (auto& triangle : file.nodes[1].triangles) std::swap(triangle[0], triangle[1]);  // flipped inside out
  file.nodes[2].triangles.push_back({0, 1, 4});                                        // there is no vertex 4
  shapes_.mesh(position_, file, {{-2, 3, 4}, "", false});
  const Mesh mesh = shapes_.take();
  ASSERT_EQ(mesh.objects.size(), 2U) << "a node of two materials is one object";
  EXPECT_EQ(mesh.objects[0].name, "house::link::wall::wing");
  EXPECT_EQ(mesh.objects[1].name, "house::link::wall::roof");
  EXPECT_NEAR(volume_of(mesh), 3 * 24.0 / 6, 1e-12);
  EXPECT_LT((bounds_of(mesh).min() - Vector3d(-12, 0, 0)).norm(), 1e-12);
  EXPECT_THAT(notes_, IsEmpty());
}

TEST_F(LinkShapesTest, ASubmeshAloneAndCentred) {
  MeshFile file{{corner("wing"), corner("roof"), {"lines", {{0, 0, 0}}, {}, {}}}, false};
  for (Vector3d& v : file.nodes[1].vertices) v += Vector3d(5, 6, 7);
  shapes_.mesh(position_, file, {Vector3d::Ones(), "roof", false});
  EXPECT_LT((bounds_of(shapes_.take()).min() - Vector3d(5, 6, 7)).norm(), 1e-12);
  shapes_.mesh(position_, file, {Vector3d(1, 1, 2), "roof", true});
  const auto centred = bounds_of(shapes_.take());
  EXPECT_LT((centred.min() - Vector3d(-0.5, -0.5, -1)).norm(), 1e-12);
  EXPECT_LT((centred.max() - Vector3d(0.5, 0.5, 1)).norm(), 1e-12);
  EXPECT_THAT(notes_, IsEmpty());
  shapes_.mesh(position_, file, {Vector3d::Ones(), "cellar", true});
  EXPECT_EQ(shapes_.take().objects.size(), 2U);
  EXPECT_THAT(notes_, ElementsAre(HasSubstr("names submesh 'cellar'"), HasSubstr("has 1 submeshes without")));
}

TEST_F(LinkShapesTest, CanyonsOwnFilesKeepWhatTheySay) {
  position_.name = "ground::link::mesh";
  MeshFile file{{corner("foliage:Oak 7"), corner("Tower")}, true};
  file.nodes[0].colour = material_colour(Material::Foliage);
  shapes_.mesh(position_, file, {});
  const Mesh mesh = shapes_.take();
  ASSERT_EQ(mesh.objects.size(), 2U);
  EXPECT_EQ(mesh.objects[0].name, "Oak 7");
  EXPECT_EQ(mesh.objects[0].surface, Surface::Foliage);
  EXPECT_EQ(mesh.materials.front(), Material::Foliage);
  EXPECT_EQ(mesh.objects[1].surface, Surface::Building);
  EXPECT_EQ(mesh.materials.back(), Material::Unknown);
}

TEST_F(LinkShapesTest, EqualPolylinesHaveOneName) {
  const std::vector<Polyline> yard{{{0, 0}, {4, 0}, {4, 4}}};
  std::vector<std::string> names;
  const Extrude extrude = [&](const std::string& name, const std::vector<Polyline>& polylines,
                              double height) {
    EXPECT_EQ(polylines, yard);
    names.push_back(name);
    MeshNode node = corner("");
    for (Vector3d& v : node.vertices) v.z() *= height;
    return std::optional(node);
  };
  shapes_.polylines(position_, yard, 9, extrude);
  shapes_.polylines(position_, yard, 9, extrude);
  shapes_.polylines(position_, yard, 8, extrude);
  EXPECT_NEAR(volume_of(shapes_.take()), (9 + 9 + 8) / 6.0, 1e-12);
  ASSERT_EQ(names.size(), 3U);
  EXPECT_EQ(names[0], names[1]);
  EXPECT_NE(names[0], names[2]);
  shapes_.polylines(position_, yard, 9, [](auto&&...) { return std::nullopt; });
  EXPECT_THAT(notes_, ElementsAre("'house::link::wall' is left out: its polyline cannot be extruded"));
}

TEST_F(LinkShapesTest, RowsOfHeightsRunAsTheHostSays) {
  HeightGrid grid;
  grid.columns = 3;
  grid.rows = 2;
  grid.size = {20, 10};
  grid.position = {100, 200, 300};
  grid.height = [](int column, int row) { return column + 10 * row; };
  for (const bool north_first : {true, false}) {
    grid.north_first = north_first;
    shapes_.heights(position_, grid);
    const Mesh mesh = shapes_.take();
    EXPECT_EQ(mesh.objects.at(0).surface, Surface::Terrain);
    ASSERT_EQ(mesh.triangles.size(), 4U);
    for (const auto& [a, b, c] : mesh.triangles) {
      EXPECT_GT((mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).z(), 0);
    }
    for (const Vector3d& v : mesh.vertices) {
      const double column = (v.x() - 90) / 10, from_south = (v.y() - 195) / 10;
      EXPECT_NEAR(v.z(), 300 + column + 10 * (north_first ? 1 - from_south : from_south), 1e-12);
    }
  }
  EXPECT_THAT(notes_, IsEmpty());
}

TEST_F(LinkShapesTest, FineHeightsAreThinned) {
  HeightGrid grid;
  grid.columns = 2 * (kFinestHeightmap - 1) + 1;
  grid.rows = 3;
  grid.size = {100, 100};
  grid.height = [](int column, int) { return column; };
  shapes_.heights(position_, grid);
  const Mesh mesh = shapes_.take();
  EXPECT_EQ(mesh.triangles.size(), 2U * (kFinestHeightmap - 1));
  EXPECT_EQ(bounds_of(mesh).max().z(), grid.columns - 1) << "the last column is kept";
  EXPECT_THAT(notes_, ElementsAre(HasSubstr("2049 x 3 heights, of which every 2th is used")));
}

TEST(MaterialByColour, OfEachMaterial) {
  EXPECT_EQ(material_by_colour(material_colour(Material::Glass)), Material::Glass);
  EXPECT_EQ(material_by_colour({0.123, 0.9, 0.001}), Material::Unknown);
}

}  // namespace
}  // namespace canyon::city::link_shapes_test
