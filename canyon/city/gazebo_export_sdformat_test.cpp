// Canyon's files for Gazebo, checked by SDFormat's own parser.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <random>
#include <sdf/sdf.hh>
#include <set>
#include <type_traits>

#include "canyon/city/city.hpp"
#include "canyon/city/gazebo_export.hpp"
#include "canyon/city/gazebo_import.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::city {
namespace {

using canyon::test::TemporaryFolder;

/// Loads a file; fails the test at every error and warning that SDFormat reports.
sdf::Root load(const std::filesystem::path& path) {
  sdf::Root root;
  for (const sdf::Error& error : root.Load(path.string())) {
    ADD_FAILURE() << path << ": " << error.Message();
  }
  return root;
}

/// Every mesh of a model exists, with the folder for the prefix of its URIs; returns their number.
int check_meshes(const sdf::Model& model, const std::filesystem::path& base, const std::string& prefix) {
  int meshes = 0;
  for (std::uint64_t l = 0; l < model.LinkCount(); ++l) {
    const sdf::Link& link = *model.LinkByIndex(l);
    EXPECT_EQ(link.CollisionCount(), 1U);
    EXPECT_EQ(link.VisualCount(), 1U);
    for (const sdf::Geometry* geometry : {link.CollisionByIndex(0)->Geom(), link.VisualByIndex(0)->Geom()}) {
      if (geometry->Type() != sdf::GeometryType::MESH) continue;
      const std::string uri = geometry->MeshShape()->Uri();
      EXPECT_EQ(uri.substr(0, prefix.size()), prefix);
      EXPECT_TRUE(std::filesystem::is_regular_file(base / uri.substr(prefix.size()))) << uri;
      ++meshes;
    }
  }
  return meshes;
}

TEST(GazeboSdformat, WorldLoadsWithoutError) {
  const TemporaryFolder folder;
  City city = synthetic_city({});
  GazeboOptions options;
  options.triangles_per_mesh = 200;
  options.gps_time = "2019-04-28T12:45:00";
  write_gazebo_world(folder / "town.world", city, options);
  const sdf::Root root = load(folder / "town.world");
  ASSERT_EQ(root.WorldCount(), 1U);
  const sdf::World& world = *root.WorldByIndex(0);
  EXPECT_EQ(world.Name(), "canyon_city");
  EXPECT_EQ(world.LightCount(), 1U);
  ASSERT_NE(world.SphericalCoordinates(), nullptr);
  EXPECT_NEAR(world.SphericalCoordinates()->LatitudeReference().Radian(), city.frame.origin().latitude_rad,
              1e-15);
  EXPECT_NEAR(world.SphericalCoordinates()->LongitudeReference().Radian(), city.frame.origin().longitude_rad,
              1e-15);
  ASSERT_EQ(world.ModelCount(), 1U);
  const sdf::Model& model = *world.ModelByIndex(0);
  EXPECT_TRUE(model.Static());
  EXPECT_GT(check_meshes(model, folder.path(), ""), 4);
}

TEST(GazeboSdformat, WorldWithoutTerrainStandsOnAPlane) {
  const TemporaryFolder folder;
  City city;
  canyon::test::append_box(city.mesh, "a", Surface::Building, Material::Brick, {0, 0, -3}, {9, 9, 9});
  write_gazebo_world(folder / "town.sdf", city);
  const sdf::Root root = load(folder / "town.sdf");
  ASSERT_EQ(root.WorldCount(), 1U);
  const sdf::World& world = *root.WorldByIndex(0);
  ASSERT_EQ(world.ModelCount(), 2U);
  EXPECT_EQ(world.ModelByIndex(0)->RawPose().Z(), -3);
  EXPECT_EQ(check_meshes(*world.ModelByIndex(1), folder.path(), ""), 2);
}

TEST(GazeboSdformat, ModelLoadsWithoutError) {
  const TemporaryFolder folder;
  write_gazebo_model(folder / "my town", synthetic_city({}));
  const sdf::Root root = load(folder / "my town" / "model.sdf");
  ASSERT_NE(root.Model(), nullptr);
  EXPECT_TRUE(root.Model()->Static());
  EXPECT_GE(check_meshes(*root.Model(), folder.path(), "model://"), 2);
}

// Links whose poses are relative to each other and to frames, at random: SDFormat resolves them.
TEST(GazeboSdformat, FramesOfPosesResolveAlike) {
  const TemporaryFolder folder;
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> coordinate(-50, 50), angle(-3, 3);
  std::string text = "<sdf version='1.9'><model name='m'><static>true</static>";
  constexpr int kCount = 20;
  for (int i = 0; i < kCount; ++i) {
    const std::string other =
        i == 0 ? "__model__"
               : (random() % 2 == 0 ? "l" : "f") + std::to_string(random() % static_cast<unsigned>(i));
    const auto pose = [&](const std::string& relative) {
      return fmt::format("<pose relative_to='{}'>{} {} {} {} {} {}</pose>", relative, coordinate(random),
                         coordinate(random), coordinate(random), angle(random), angle(random), angle(random));
    };
    const std::string name = std::to_string(i);
    text += "<link name='l" + name + "'>" + pose(other) + "<collision name='c'>" + pose("l" + name) +
            "<geometry><box><size>2 2 2</size></box></geometry></collision></link>";
    text += "<frame name='f" + name + "' attached_to='l" + name + "'>" + pose(other) + "</frame>";
  }
  std::ofstream(folder / "m.sdf") << text << "</model></sdf>";
  const City city = read_gazebo_world(folder / "m.sdf");
  const sdf::Root root = load(folder / "m.sdf");
  const sdf::Model& model = *root.Model();
  ASSERT_EQ(city.mesh.objects.size(), static_cast<std::size_t>(kCount));
  for (const Object& object : city.mesh.objects) {
    std::set<std::uint32_t> corners;
    for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t)
      corners.insert(city.mesh.triangles[t].begin(), city.mesh.triangles[t].end());
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const std::uint32_t v : corners)
      middle += city.mesh.vertices[v] / static_cast<double>(corners.size());
    const auto link = object.name.substr(3, object.name.rfind("::") - 3);
    std::decay_t<decltype(model.RawPose())> expected;
    ASSERT_TRUE(
        model.LinkByName(link)->CollisionByIndex(0)->SemanticPose().Resolve(expected, "__model__").empty());
    EXPECT_LT((middle - Eigen::Vector3d(expected.X(), expected.Y(), expected.Z())).norm(), 1e-6)
        << object.name;
  }
}

}  // namespace
}  // namespace canyon::city
