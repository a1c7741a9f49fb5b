#include "canyon/simulation/load_city.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/city/city_file.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/citygml_text.hpp"
#include "tests/support/gltf_bytes.hpp"
#include "tests/support/loaded_city.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/simulation_support.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::simulation {
namespace {

using ::testing::HasSubstr;

TEST(LoadCity, OpenFieldAboutTheOrigin) {
  CityConfig config;
  config.origin = geodesy::Geodetic::from_degrees(48, 11, 520);
  const city::City city = canyon::test::loaded_city(config);
  EXPECT_TRUE(city.mesh.triangles.empty());
  EXPECT_EQ(city.frame.origin().height_m, 520);
  EXPECT_EQ(city.name, "open field");
}

TEST(LoadCity, Synthetic) {
  CityConfig config;
  auto& made_up = config.source.emplace<city::SyntheticCityOptions>();
  made_up.blocks_east = 2;
  made_up.blocks_north = 2;
  EXPECT_GE(city::summarize(canyon::test::loaded_city(config)).buildings, 4U);
}

TEST(LoadCity, KindsOfFilesByTheirNames) {
  const auto origin = geodesy::Geodetic::from_degrees(48, 11, 520);
  EXPECT_EQ(city_config("a.obj", origin).as<MeshCity>()->path, "a.obj");
  EXPECT_EQ(city_config("a.obj", origin).origin->height_m, 520);
  EXPECT_EQ(city_config("a.osm.pbf").as<MapCity>()->files.front(), "a.osm.pbf");
  EXPECT_FALSE(city_config("a.osm.pbf").origin);
  EXPECT_EQ(city_config("a.osm.pbf", origin).origin->height_m, 520);
  EXPECT_EQ(city_config("a.canyon").as<CityFile>()->path, "a.canyon");
  EXPECT_EQ(city_config("a.world").as<CityFile>()->path, "a.world");
  EXPECT_THROW((void)city_config("a.canyon", origin), InputError);
  EXPECT_THROW((void)city_config("a.xyz"), InputError);
}

// City models are detected by content, whatever their names; the scenario's keys reach the reader.
TEST(LoadCity, CityModelsByTheirContent) {
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder / "tile.dat";
  std::ofstream(file) << canyon::test::citygml(canyon::test::citygml_member(canyon::test::gml_building("a")),
                                               "");
  EXPECT_TRUE(is_file_of<MapCity>(file));
  CityConfig config = city_config(file);
  EXPECT_THROW((void)canyon::test::loaded_city(config), InputError);
  config.as<MapCity>()->model.crs = "EPSG:25832";
  const city::City city = canyon::test::loaded_city(config);
  EXPECT_EQ(city::summarize(city).buildings, 1U);
  EXPECT_NEAR(city::summarize(city).highest_roof_m, 9, 0.01);
  config.as<MapCity>()->model.lod = 1;
  EXPECT_THROW((void)canyon::test::loaded_city(config), InputError);
}

// A scenario reads the tiles of a folder near its trajectory, if its position on Earth is given.
TEST(LoadCity, TilesAboutTheTrajectory) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directory(folder / "tiles");
  const std::string here =
      canyon::test::citygml(canyon::test::citygml_member(canyon::test::gml_building("a")));
  std::string away = canyon::test::citygml(canyon::test::citygml_member(canyon::test::gml_building("b")));
  for (std::size_t at = 0; (at = away.find("6910", at)) != std::string::npos;) away.replace(at, 4, "6960");
  std::ofstream(folder / "tiles/a.gml") << here;
  std::ofstream(folder / "tiles/b.gml") << away;
  const auto buildings_of = [&](const std::string& city, const std::string& location) {
    const Scenario scenario = parse_scenario(
        "city: {osm: tiles/" + city +
            "}\nstart: 2026-06-01T06:00:00Z\nduration_s: 1\ntrajectory: {position: {" + location + "}}\n",
        folder / "s.yaml");
    return city::summarize(load_city(scenario)).buildings;
  };
  // 48.1306, 11.5671 is the first tile's position (cs2cs EPSG:25832 EPSG:4326).
  const std::string near = "latitude_deg: 48.13, longitude_deg: 11.567, height_m: 510";
  EXPECT_EQ(buildings_of("", near), 1U);
  EXPECT_EQ(buildings_of("", "east_m: 0, north_m: 0, up_m: 2"), 2U);
  EXPECT_EQ(buildings_of(", bbox: [11, 48, 12, 49]", near), 2U);
  const std::string far = canyon::test::refusal(
      [&] { (void)buildings_of("", "latitude_deg: 48.2, longitude_deg: 11.567, height_m: 510"); });
  EXPECT_NE(far.find("no building in the box"), std::string::npos) << far;
  EXPECT_NE(far.find("1 km around the trajectory"), std::string::npos) << far;
}

// The model's terrain is the ground if there is no raster; trees are on it, at their own height if given.
TEST(LoadCity, ReliefAndTreesOfACityModel) {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "c.gml") << canyon::test::citygml(
      canyon::test::citygml_member(canyon::test::gml_building("a")) +
      canyon::test::citygml_member(
          "<veg:SolitaryVegetationObject gml:id=\"t\"><veg:height>12</veg:height>"
          "<veg:lod1ImplicitRepresentation><core:ImplicitGeometry><core:referencePoint><gml:Point>"
          "<gml:pos>691030 5334000 500.5</gml:pos></gml:Point></core:referencePoint>"
          "</core:ImplicitGeometry></veg:lod1ImplicitRepresentation></veg:SolitaryVegetationObject>") +
      canyon::test::citygml_member(
          "<dem:TINRelief gml:id=\"r\"><dem:lod>1</dem:lod><dem:tin><gml:TriangulatedSurface>"
          "<gml:trianglePatches><gml:Triangle><gml:exterior><gml:LinearRing><gml:posList>"
          "690500 5333500 499 692000 5333500 499 690500 5335000 499 690500 5333500 499"
          "</gml:posList></gml:LinearRing></gml:exterior></gml:Triangle></gml:trianglePatches>"
          "</gml:TriangulatedSurface></dem:tin></dem:TINRelief>"));
  CityConfig config = city_config(folder / "c.gml");
  buildings::BuiltCity built = read_city(config);
  EXPECT_EQ(built.report.foliage_left_out, 1U);
  EXPECT_NEAR(built.city.frame.origin().height_m, 499, 0.01);
  EXPECT_EQ(city::summarize(built.city).terrain_triangles, 1U);
  config.as<MapCity>()->build.foliage = true;
  built = read_city(config);
  EXPECT_EQ(built.report.trees, 1U);
  double lowest = 1e9, highest = -1e9;
  const city::Mesh& mesh = built.city.mesh;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (mesh.materials[t] != city::Material::Foliage) continue;
    for (const std::uint32_t v : mesh.triangles[t]) {
      lowest = std::min<double>(lowest, mesh.vertices[v].z());
      highest = std::max<double>(highest, mesh.vertices[v].z());
    }
  }
  EXPECT_GE(lowest, 1.49);
  EXPECT_NEAR(highest, 13.5, 0.01);
}

// By the number, by the user's grid, by the city's own file; 0 if unknown.
TEST(LoadCity, MeanSeaLevelByTheConfigurationOrTheFile) {
  const test::TemporaryFolder folder;
  CityConfig config;
  config.origin = geodesy::Geodetic::from_degrees(22.3, 114.17, 5);
  EXPECT_EQ(canyon::test::loaded_city(config).geoid_undulation_m, 0);
  config.sea_level.geoid_undulation_m = 39.6;
  const city::City city = canyon::test::loaded_city(config);
  EXPECT_EQ(city.geoid_undulation_m, 39.6);
  EXPECT_EQ(city.frame.origin().height_m, 5);
  city::write_city_file(folder / "c.canyon", city);
  CityConfig file = city_config(folder / "c.canyon");
  EXPECT_EQ(canyon::test::loaded_city(file).geoid_undulation_m, 39.6);
  file.sea_level.geoid_undulation_m = -2.5;
  EXPECT_EQ(canyon::test::loaded_city(file).geoid_undulation_m, -2.5);
  config.sea_level.geoid_undulation_m = std::nan("");
  EXPECT_THROW((void)canyon::test::loaded_city(config), InputError);
}

// A geoid file of GeographicLib's: raw value 35,000 * 0.003 m - 108 m = -3 m everywhere.
TEST(LoadCity, MeanSeaLevelByAGeoidsGrid) {
  const test::TemporaryFolder folder;
  std::string grid = "P5\n# Offset -108\n# Scale 0.003\n36 19\n65535\n";
  for (int i = 0; i < 36 * 19; ++i) {
    grid += static_cast<char>(35000 >> 8);
    grid += static_cast<char>(35000 & 0xff);
  }
  (void)folder.write("egm84-15.pgm", grid);
  CityConfig config;
  config.origin = geodesy::Geodetic::from_degrees(22.3, 114.17, 5);
  config.sea_level.geoid = buildings::GeoidModel::EGM84;
  ASSERT_EQ(setenv("GEOGRAPHICLIB_GEOID_PATH", folder.path().c_str(), 1), 0);
  EXPECT_NEAR(canyon::test::loaded_city(config).geoid_undulation_m, -3, 1e-9);
  // It replaces the grid of a city model's datum, if that is not installed.
  (void)folder.write("c.gml",
                     canyon::test::citygml(canyon::test::citygml_member(canyon::test::gml_building("a")),
                                           "urn:adv:crs:ETRS89_UTM32*DE_DHHN92_NH"));
  CityConfig model = city_config(folder / "c.gml");
  model.sea_level.geoid = buildings::GeoidModel::EGM84;
  const city::City city = canyon::test::loaded_city(model);
  const auto reported = [&city](const char* text) {
    const std::vector<std::string> notes = city.notes.lines();
    return std::any_of(notes.begin(), notes.end(),
                       [text](const std::string& note) { return note.find(text) != std::string::npos; });
  };
  if (reported("geoid added by PROJ's grid")) {
    EXPECT_NEAR(city.frame.origin().height_m, 546, 2);  // the German geoid about Munich: 46 m
  } else {
    EXPECT_NEAR(city.frame.origin().height_m, 497, 1e-3);
    EXPECT_TRUE(reported("as given; geoid added by GeographicLib's egm84-15; the file's own, DHHN92 height"));
  }
  unsetenv("GEOGRAPHICLIB_GEOID_PATH");
  config.sea_level.geoid = buildings::GeoidModel::EGM96;
  try {
    // gdaltransform -s_srs EPSG:4326+5773 -t_srs EPSG:4979 (PROJ 9.1.1) gives -2.167 m for "114.17 22.3 0".
    EXPECT_NEAR(canyon::test::loaded_city(config).geoid_undulation_m, -2.167, 0.1);
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("no geoid grid for it is installed"));
    EXPECT_THAT(e.hint(), HasSubstr("geoid_undulation_m"));
  }
}

TEST(LoadCity, MissingMesh) {
  CityConfig config;
  config.source = MeshCity{"/nowhere/city.dae", {}};
  EXPECT_THROW(static_cast<void>(canyon::test::loaded_city(config)), InputError);
}

TEST(LoadCity, OriginOutOfRange) {
  CityConfig config;
  config.origin.emplace().latitude_rad = 48;  // degrees by mistake
  EXPECT_THROW(static_cast<void>(canyon::test::loaded_city(config)), InputError);
}

// Facades of the scenario's city, by its seed: a map's tags are kept, the rest is sampled; the same in
// load_city() of a city alone.
TEST(LoadCity, FacadesKeepTheTagsOfAMap) {
  const test::TemporaryFolder folder;
  std::string nodes, routes;
  for (int i = 0; i < 40; ++i) {
    for (int k = 0; k < 4; ++k) {
      nodes += fmt::format("<node id='{}' lat='{}' lon='{}' version='1'/>", 4 * i + k + 1,
                           48 + (k / 2) * 1e-4, 11 + 3e-4 * i + (k == 1 || k == 2) * 1e-4);
    }
    routes += fmt::format(
        "<way id='{}' version='1'><nd ref='{}'/><nd ref='{}'/><nd ref='{}'/><nd ref='{}'/><nd ref='{}'/><tag "
        "k='building' v='yes'/>{}</way>",
        i + 1, 4 * i + 1, 4 * i + 2, 4 * i + 3, 4 * i + 4, 4 * i + 1,
        i < 10 ? "<tag k='building:material' v='brick'/>" : "");
  }
  const auto file = folder.write(
      "m.osm", "<?xml version='1.0'?><osm version='0.6' generator='test'>" + nodes + routes + "</osm>");
  const auto load = [&](const std::string& facades) {
    const Scenario scenario =
        parse_scenario("city: {osm: m.osm" + facades +
                           "}\nseed: 5\ntrajectory: {position: {latitude_deg: 48, longitude_deg: 11, "
                           "height_m: 3}}\n",
                       folder / "s.yaml");
    return load_city(scenario);
  };
  const auto count = [](const city::City& city, city::Material material) {
    return std::count(city.mesh.materials.begin(), city.mesh.materials.end(), material);
  };
  const city::City plain = load(", facades: {mix: as_given}");
  EXPECT_THAT(plain.notes.warnings(),
              testing::ElementsAre(testing::HasSubstr("40 of 40 heights are guesses")));
  EXPECT_EQ(count(plain, city::Material::Unknown), 0);
  EXPECT_EQ(count(plain, city::Material::Brick), 10 * 10);  // 8 triangles of walls and 2 of the floor

  const city::City dressed = load(", facades: {shares: [metal=1]}");
  EXPECT_EQ(dressed.notes.lines().back(), "facades drawn: 30 metal; 10 of 40 buildings keep theirs");
  EXPECT_EQ(count(dressed, city::Material::Brick), 10 * 10);
  EXPECT_EQ(count(dressed, city::Material::Metal), 30 * 8);
  EXPECT_EQ(dressed.mesh.vertices, plain.mesh.vertices);

  const city::City redrawn = load(", facades: {shares: [metal=1], named: redraw}");
  EXPECT_EQ(redrawn.notes.lines().back(), "facades drawn: 40 metal");
  EXPECT_EQ(count(redrawn, city::Material::Metal), 40 * 8);

  CityConfig config = city_config(file);
  config.facades.mix = city::FacadeMix::UrbanStock;
  const city::City alone = canyon::test::loaded_city(config, 5);
  const city::City scenario_city = load(", facades: {mix: urban_stock}");
  EXPECT_EQ(alone.mesh.materials, scenario_city.mesh.materials);
  EXPECT_EQ(alone.notes.entries(), scenario_city.notes.entries());
  EXPECT_NE(alone.mesh.materials, canyon::test::loaded_city(config, 6).mesh.materials);
}

/// A tile of 100 m around a position, as a region of heights 0 to 99 m.
std::string region_tile(const std::string& uri, double latitude_deg, double longitude_deg) {
  const double south = geodesy::radians(latitude_deg), west = geodesy::radians(longitude_deg);
  return fmt::format(
      R"({{"boundingVolume":{{"region":[{},{},{},{},0,99]}},"geometricError":0,"content":{{"uri":"{}"}}}})",
      west, south, west + 2e-5, south + 2e-5, uri);
}

TEST(LoadCity, TilesAboutTheTrajectoryAlone) {
  const test::TemporaryFolder folder;
  const Eigen::Vector3d centre =
      geodesy::ecef_from_geodetic(geodesy::Geodetic::from_degrees(48.2003, 11.5003, 0));
  write_file(folder / "near.b3dm",
             canyon::test::b3dm(canyon::test::box_glb(10, 10, 10),
                                fmt::format(R"({{"BATCH_LENGTH":0,"RTC_CENTER":[{},{},{}]}})", centre.x(),
                                            centre.y(), centre.z())));
  // The other tile does not exist, and is not needed.
  write_file(folder / "tileset.json",
             canyon::test::tileset(
                 R"("boundingVolume":{"region":[0.2,0.84,0.202,0.85,0,99]},"geometricError":99,)"
                 R"("refine":"ADD","children":[)" +
                 region_tile("near.b3dm", 48.2, 11.5) + "," + region_tile("far.b3dm", 48.3, 11.5) + "]"));
  const auto scenario = [&](const std::string& location) {
    return parse_scenario(
        "city: {file: tileset.json}\nstart: 2026-06-01T12:00:00Z\nduration_s: 1\n"
        "trajectory: {position: {" +
            location + "}}\n",
        folder / "s.yaml");
  };
  const city::City city = load_city(scenario("latitude_deg: 48.2, longitude_deg: 11.5, height_m: 2"));
  EXPECT_THAT(city.notes.warnings(), ::testing::IsEmpty());
  EXPECT_EQ(city.mesh.triangles.size(), 12U);
  EXPECT_NEAR(geodesy::degrees(city.frame.origin().latitude_rad), 48.2003, 1e-4);
  // The same with a box.
  const Scenario far_away = scenario("latitude_deg: 48.3, longitude_deg: 11.5, height_m: 2");
  const CityConfig about_box = city_config(far_away, {11.5, 48.2, 11.5006, 48.2006});
  EXPECT_EQ(load_city(about_box).mesh.triangles.size(), 12U);
  // A position that is known only after reading the city: all tiles, and so a missing one.
  EXPECT_THAT(load_city(scenario("east_m: 0, north_m: 0, up_m: 2")).notes.warnings(),
              ::testing::Contains(HasSubstr("far.b3dm")));
  EXPECT_TRUE(is_file_of<tiles::TileOptions>(folder / "tileset.json"));
  EXPECT_TRUE(is_file_of<tiles::TileOptions>("https://example.org/x.json?key=1"));
  // A scenario that is written and read again is the same.
  const Scenario once = scenario("latitude_deg: 48.2, longitude_deg: 11.5, height_m: 2");
  EXPECT_EQ(scenario_yaml(parse_scenario(scenario_yaml(once), folder / "t.yaml")), scenario_yaml(once));
}

// 290 x 290 blocks of 12 triangles, 20 m apart: more than a million triangles. Within 1 km of the middle,
// west to east and south to north, there are 101 x 101.
TEST(LoadCity, OfALargeCityWhatIsAboutTheTrajectory) {
  constexpr int kBlocks = 290;
  const test::TemporaryFolder folder;
  city::City large;
  large.frame = geodesy::LocalFrame(geodesy::Geodetic::from_degrees(48, 11, 500));
  for (int i = 0; i < kBlocks * kBlocks; ++i) {
    const Eigen::Vector3d at(20 * (i % kBlocks - kBlocks / 2), 20 * (i / kBlocks - kBlocks / 2), 0);
    canyon::test::append_box(large.mesh, std::to_string(i), city::Surface::Building, city::Material::Concrete,
                             at - Eigen::Vector3d(4, 4, 0), at + Eigen::Vector3d(4, 4, 10));
  }
  city::write_city_file(folder / "large.canyon", large);
  const auto buildings_at = [&](const std::string& location) {
    const Scenario scenario = parse_scenario(
        "city: {file: large.canyon}\nstart: 2026-06-01T06:00:00Z\nduration_s: 1\ntrajectory: {position: {" +
            location + "}}\n",
        folder / "s.yaml");
    return city::summarize(load_city(scenario)).buildings;
  };
  EXPECT_EQ(buildings_at("latitude_deg: 48, longitude_deg: 11, height_m: 502"), 101U * 101U);
  EXPECT_EQ(buildings_at("east_m: 10, north_m: 10, up_m: 2"), std::size_t{kBlocks} * kBlocks);
}

TEST(LoadCity, HongKong) {
  CANYON_SHARED_DATA(path, "hongkong/buildings.dae");
  CityConfig config;
  config.source = MeshCity{path, {}};
  config.origin = geodesy::Geodetic::from_degrees(22.298251, 114.178761, 0);
  EXPECT_EQ(canyon::test::loaded_city(config).bounds().max.z(), 274);
}

}  // namespace
}  // namespace canyon::simulation
