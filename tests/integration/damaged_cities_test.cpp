#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "tests/support/cityjson_house.hpp"
#include "tests/support/damaged_city.hpp"
#include "tests/support/osm_text.hpp"

// Small maps and height grids as other programs write them, with a byte left out, or a line doubled
// or left out: they give the same city, a city within a metre, a remark or an error.
namespace canyon::damaged_cities_test {
namespace {

using test::DamageCounts;

constexpr std::size_t kEvery = 3;

struct House {
  double west, south, length, width, height;
};
const std::vector<House> kHouses{{12, 9, 14, 11, 12},
                                 {43, 11, 17, 13, 21},
                                 {74, 8, 12, 16, 15},
                                 {15, 47, 19, 12, 33},
                                 {52, 52, 21, 15, 18}};

constexpr double kLongitude = 11.57, kLatitude = 48.14, kDegree_m = 111'200;

std::array<double, 2> place(double east, double north) {
  return {kLongitude + east / (kDegree_m * 0.667), kLatitude + north / kDegree_m};
}

std::string osm() {
  test::OsmText text;
  int id = 100;
  for (const House& h : kHouses) {
    const std::int64_t n = 10 * ++id;
    std::int64_t k = n;
    for (const auto& [x, y] : {std::array{0.0, 0.0}, {1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}}) {
      const auto [lon, lat] = place(h.west + x * h.length, h.south + y * h.width);
      text.node(k++, lon, lat);
    }
    text.way(id, {n, n + 1, n + 2, n + 3, n},
             {{"building", "yes"}, {"height", fmt::format("{}", h.height)}, {"roof:shape", "flat"}});
  }
  return text.text();
}

std::string overpass() {
  std::string elements;
  int id = 100;
  for (const House& h : kHouses) {
    std::string geometry, nodes;
    const std::int64_t n = 10 * ++id;
    int k = 0;
    for (const auto& [x, y] : {std::array{0.0, 0.0}, {1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}, {0.0, 0.0}}) {
      const auto [lon, lat] = place(h.west + x * h.length, h.south + y * h.width);
      geometry += fmt::format("{}\n{{ \"lat\": {:.7f}, \"lon\": {:.7f} }}", k == 0 ? "" : ",", lat, lon);
      nodes += fmt::format("{}{}", k == 0 ? "" : ",\n", n + k % 4);
      ++k;
    }
    elements += fmt::format(
        "{}{{\n\"type\": \"way\",\n\"id\": {},\n\"nodes\": [{}],\n\"geometry\": [{}],\n\"tags\": "
        "{{\n\"building\": "
        "\"yes\",\n\"height\": \"{}\"\n}}\n}}",
        elements.empty() ? "" : ",\n", id, nodes, geometry, h.height);
  }
  return "{\n\"version\": 0.6,\n\"generator\": \"Overpass API\",\n\"elements\": [\n" + elements + "\n]\n}\n";
}

std::string city_json() {
  return test::cityjson(test::cityjson_building("house", test::kHouseSolid, R"({"measuredHeight":9.0})"));
}

std::string ascii_grid() {
  const auto [west, south] = place(-150, -150);
  std::string text = fmt::format(
      "ncols 12\nnrows 12\nxllcorner {:.7f}\nyllcorner {:.7f}\ncellsize 0.0005\nNODATA_value -9999\n", west,
      south);
  for (int row = 0; row < 12; ++row) {
    for (int column = 0; column < 12; ++column)
      text += fmt::format("{:.1f} ", 520 + 1.3 * column + 0.7 * row);
    text += "\n";
  }
  return text;
}

struct File {
  const char* name;
  std::string text;
  int silent;  ///< of every kEvery-th byte: what nobody can know: a digit within the plausible range, a
               ///< corner or tag left out, half of the ground
};

/// The map over the heights of a grid.
simulation::CityConfig over_heights(const std::filesystem::path& path) {
  const std::filesystem::path map = path.parent_path() / "map.osm";
  if (!std::filesystem::exists(map)) std::ofstream(map, std::ios::binary) << osm();
  std::ofstream(path.parent_path() / "heights.prj")
      << R"(GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]])";
  simulation::CityConfig config = simulation::city_config(map);
  config.as<simulation::MapCity>()->terrain = {path};
  config.as<simulation::MapCity>()->build.terrain_margin_m = 20;
  return config;
}

void check(const std::vector<File>& files, const test::DamagedCity::Settings& settings = {}) {
  for (const File& file : files) {
    const DamageCounts counts = test::DamagedCity(file.name, file.text, settings).run(kEvery);
    EXPECT_LE(counts.silent.size() * test::damage_stride(kEvery),
              static_cast<std::size_t>(file.silent) * kEvery)
        << testing::PrintToString(counts.silent);
    EXPECT_GT(counts.said + counts.refused, 100) << file.name;
  }
}

TEST(DamagedCities, MapsDoNotChangeSilently) {
  check({{"city.osm", osm(), 53}, {"overpass.json", overpass(), 27}, {"city.json", city_json(), 2}});
}

TEST(DamagedCities, HeightsDoNotChangeSilently) {
  check({{"heights.asc", ascii_grid(), 3}}, over_heights);
}

}  // namespace
}  // namespace canyon::damaged_cities_test
