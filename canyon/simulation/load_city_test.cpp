#include "canyon/simulation/load_city.hpp"

#include <gtest/gtest.h>

#include "canyon/base/input_error.hpp"
#include "canyon/simulation/scenario.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon::simulation {
namespace {

TEST(LoadCity, OpenFieldAboutTheImportsOrigin) {
  CityConfig config;
  config.open = true;
  config.import.origin = geodesy::Geodetic::from_degrees(48, 11, 520);
  const city::City city = load_city(config);
  EXPECT_TRUE(city.mesh.triangles.empty());
  EXPECT_EQ(city.frame.origin().height_m, 520);
  EXPECT_EQ(city.name, "open field");
}

TEST(LoadCity, Synthetic) {
  CityConfig config;
  config.synthetic = city::SyntheticCityOptions{};
  config.synthetic->blocks_east = 2;
  config.synthetic->blocks_north = 2;
  EXPECT_GE(city::summarize(load_city(config)).buildings, 4U);
}

TEST(LoadCity, KindsOfFilesByTheirNames) {
  const auto origin = geodesy::Geodetic::from_degrees(48, 11, 520);
  EXPECT_EQ(city_config("a.obj", origin).mesh, "a.obj");
  EXPECT_EQ(city_config("a.obj", origin).import.origin.height_m, 520);
  EXPECT_EQ(city_config("a.osm.pbf").map->files.front(), "a.osm.pbf");
  EXPECT_FALSE(city_config("a.osm.pbf").map->build.origin);
  EXPECT_EQ(city_config("a.osm.pbf", origin).map->build.origin->height_m, 520);
  EXPECT_EQ(city_config("a.canyon").file, "a.canyon");
  EXPECT_EQ(city_config("a.world").file, "a.world");
  EXPECT_THROW((void)city_config("a.canyon", origin), InputError);
  EXPECT_THROW((void)city_config("a.xyz"), InputError);
}

TEST(LoadCity, MissingMesh) {
  CityConfig config;
  config.mesh = "/nowhere/city.dae";
  EXPECT_THROW(static_cast<void>(load_city(config)), InputError);
}

TEST(LoadCity, OriginOutOfRange) {
  CityConfig config;
  config.open = true;
  config.import.origin.latitude_rad = 48;  // degrees by mistake
  EXPECT_THROW(static_cast<void>(load_city(config)), InputError);
}

TEST(LoadCity, HongKong) {
  CANYON_SHARED_DATA(path, "hongkong/buildings.dae");
  CityConfig config;
  config.mesh = path;
  config.import.origin = geodesy::Geodetic::from_degrees(22.298251, 114.178761, 0);
  EXPECT_EQ(load_city(config).bounds().max.z(), 274);
}

}  // namespace
}  // namespace canyon::simulation
