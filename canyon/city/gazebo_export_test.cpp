#include "canyon/city/gazebo_export.hpp"
#include "canyon/city/gazebo_import.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "canyon/base/input_error.hpp"
#include "canyon/city/mesh_file.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/city_comparison.hpp"
#include "tests/support/program.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::city {
namespace {

using canyon::test::by_name;
using canyon::test::difference_of;
using canyon::test::read_bytes;
using canyon::test::TemporaryFolder;
using ::testing::HasSubstr;

City odd_city() {
  City city;
  city.name = "odd & <city>";
  city.frame = geodesy::LocalFrame(geodesy::Geodetic::from_degrees(-33.85, 151.21, 12.5));
  for (int i = 0; i < 30; ++i) {
    canyon::test::append_box(city.mesh, "house " + std::to_string(i) + " \"&\xC3\xA9", Surface::Building,
                             i % 2 == 0 ? Material::Brick : Material::Glass, {100.0 * i, 50.0 * (i % 5), 0},
                             {100.0 * i + 20.123, 50.0 * (i % 5) + 10, 12.5 + i}, 0.1 * i);
  }
  canyon::test::append_box(city.mesh, "Ground floor", Surface::Building, Material::Metal, {-50, 0, 0},
                           {-40, 5, 4});
  canyon::test::append_box(city.mesh, "oak", Surface::Foliage, Material::Wood, {-80, 0, 2}, {-75, 5, 9});
  append_object(city.mesh, "slope", Surface::Terrain, Material::Stone,
                {{-500, -500, 0}, {4000, -500, -1}, {4000, 500, 3}, {-500, 500, 1}}, {{0, 1, 2}, {0, 2, 3}});
  return city;
}

TEST(GazeboExport, WorldRoundTripKeepsEverything) {
  const TemporaryFolder folder;
  const City city = odd_city();
  GazeboOptions options;
  options.triangles_per_mesh = 50;
  write_gazebo_world(folder / "odd town.world", city, options);
  const City read = read_gazebo_world(folder / "odd town.world");
  EXPECT_EQ(difference_of(by_name(city), by_name(read), 1e-4), "");
  EXPECT_NEAR(read.frame.origin().latitude_rad, city.frame.origin().latitude_rad, 1e-15);
  EXPECT_NEAR(read.frame.origin().longitude_rad, city.frame.origin().longitude_rad, 1e-15);
  EXPECT_EQ(read.frame.origin().height_m, 12.5);
  EXPECT_TRUE(std::filesystem::exists(folder / "odd_town_model"));
}

TEST(GazeboExport, ModelRoundTrip) {
  const TemporaryFolder folder;
  const City city = odd_city();
  write_gazebo_model(folder / "town", city);
  for (const auto& path : {folder / "town", folder / "town" / "model.sdf", folder.path() / "town" / ""}) {
    EXPECT_EQ(difference_of(by_name(city), by_name(read_gazebo_world(path)), 1e-4), "") << path;
  }
}

TEST(GazeboExport, WorldWithoutTerrainGetsAPlaneThatIsNotPartOfTheCity) {
  const TemporaryFolder folder;
  City city;
  canyon::test::append_box(city.mesh, "a", Surface::Building, Material::Brick, {0, 0, -3}, {9, 9, 9});
  write_gazebo_world(folder / "w.sdf", city);
  EXPECT_THAT(read_bytes(folder / "w.sdf"), HasSubstr("<plane>"));
  const City read = read_gazebo_world(folder / "w.sdf");
  EXPECT_EQ(difference_of(city, read, 1e-6), "");
  EXPECT_THAT(read.notes.lines(), ::testing::Contains(HasSubstr("ground plane")));
}

TEST(GazeboExport, HongKongIsSplitByPlace) {
  CANYON_SHARED_DATA(dae, "hongkong/buildings.dae");
  const TemporaryFolder folder;
  MeshImportOptions import;
  import.origin = geodesy::Geodetic::from_degrees(22.298251, 114.178761, 0);
  const City city = read_mesh_city(dae, import);
  GazeboOptions options;
  options.triangles_per_mesh = 5000;
  write_gazebo_world(folder / "hk.world", city, options);
  std::size_t meshes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "hk_model" / "meshes")) {
    ++meshes;
    EXPECT_LE(read_mesh_part(entry.path(), {}).mesh.triangles.size(), 5000U);
  }
  // Two meshes for each link; terrain has its own.
  const CitySummary summary = summarize(city);
  const std::size_t links = (summary.triangles - summary.terrain_triangles + 4999) / 5000;
  EXPECT_GE(meshes, 2 * (links + 1));
  EXPECT_LE(meshes, 2 * (4 * links + 1));
  EXPECT_EQ(difference_of(by_name(city), by_name(read_gazebo_world(folder / "hk.world")), 1e-3), "");
}

TEST(GazeboExport, IsWellFormedAndTheSameEachTime) {
  CANYON_NEEDS_PROGRAM("xmllint");
  const TemporaryFolder folder;
  write_gazebo_world(folder / "a.world", odd_city());
  const std::string world = read_bytes(folder / "a.world");
  const std::string mesh = read_bytes(folder / "a_model" / "meshes" / "buildings_001.dae");
  write_gazebo_world(folder / "a.world", odd_city());
  EXPECT_EQ(read_bytes(folder / "a.world"), world);
  EXPECT_EQ(read_bytes(folder / "a_model" / "meshes" / "buildings_001.dae"), mesh);
  for (const char* file : {"a.world", "a_model/model.sdf", "a_model/model.config",
                           "a_model/meshes/buildings_001_visual.dae", "a_model/meshes/terrain.dae"}) {
    const auto lint = canyon::test::run_program("xmllint --noout '" + (folder / file).string() + "' 2>&1");
    EXPECT_EQ(lint.status, 0) << lint.output;
  }
}

TEST(GazeboExport, ReplacesOnlyItsOwnModel) {
  const TemporaryFolder folder;
  write_gazebo_model(folder / "town", odd_city());
  std::ofstream(folder / "town" / "meshes" / "old.dae") << "old";
  write_gazebo_model(folder / "town", odd_city());
  EXPECT_FALSE(std::filesystem::exists(folder / "town" / "meshes" / "old.dae"));
  std::filesystem::create_directory(folder / "mine");
  std::ofstream(folder / "mine" / "thesis.tex") << "precious";
  EXPECT_THROW(write_gazebo_model(folder / "mine", odd_city()), InputError);
  EXPECT_EQ(read_bytes(folder / "mine" / "thesis.tex"), "precious");
  std::filesystem::create_directory(folder / "w_model");
  std::ofstream(folder / "w_model" / "thesis.tex") << "precious";
  EXPECT_THROW(write_gazebo_world(folder / "w.world", odd_city()), InputError);
  EXPECT_FALSE(std::filesystem::exists(folder / "w.world"));
  std::set<std::string> names;
  for (const auto& e : std::filesystem::directory_iterator(folder.path())) names.insert(e.path().filename());
  EXPECT_EQ(names, (std::set<std::string>{"town", "mine", "w_model"}));
}

TEST(GazeboExport, RefusesWhatCannotBeWritten) {
  const TemporaryFolder folder;
  const City city = odd_city();
  EXPECT_THAT(test::refusal([&] { write_gazebo_world(folder / "a.world", City{}); }),
              HasSubstr("no triangle"));
  EXPECT_THAT(test::refusal([&] { write_gazebo_model(folder / "a", City{}); }), HasSubstr("no triangle"));
  EXPECT_THAT(test::refusal([&] { write_gazebo_world(folder / "a.xml", city); }),
              HasSubstr(".world or .sdf"));
  EXPECT_THAT(test::refusal([&] { write_gazebo_world(folder / "no" / "a.world", city); }),
              HasSubstr("a.world"));
  EXPECT_THAT(test::refusal([&] { write_gazebo_model(folder / "no" / "a", city); }),
              HasSubstr("folder cannot be made"));
  std::ofstream(folder / "file") << "x";
  EXPECT_THAT(test::refusal([&] { write_gazebo_model(folder / "file", city); }), HasSubstr("is a file"));
  GazeboOptions options;
  options.name = "a city";
  EXPECT_THAT(test::refusal([&] { write_gazebo_model(folder / "a", city, options); }),
              HasSubstr("Gazebo name 'a city'"));
  options = {};
  options.triangles_per_mesh = 0;
  EXPECT_THAT(test::refusal([&] { write_gazebo_model(folder / "a", city, options); }),
              HasSubstr("triangles_per_mesh"));
  options = {};
  options.gps_time = "--> <evil/>";
  EXPECT_THAT(test::refusal([&] { write_gazebo_model(folder / "a", city, options); }), HasSubstr("GPS time"));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

}  // namespace
}  // namespace canyon::city
