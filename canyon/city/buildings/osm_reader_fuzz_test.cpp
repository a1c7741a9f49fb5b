#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>
#include <string>

#include "canyon/base/input_error.hpp"
#include "canyon/city/buildings/sources/osm_reader.hpp"
#include "canyon/city/buildings/sources/shape.hpp"
#include "tests/support/osm_text.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::buildings {
namespace {

std::string seed_document() {
  test::OsmText text;
  text.square(1, 10, 50, 0.001, {{"building", "yes"}, {"height", "12 m"}, {"roof:shape", "gabled"}});
  text.square(2, 10.002, 50, 0.003).square(3, 10.003, 50.001, 0.001, {{"building:part", "yes"}});
  text.node(1, 10, 50).node(2, 10.004, 50).node(3, 10.004, 50.004).node(4, 10, 50.004);
  text.osm_way(11, {1, 2, 3}).osm_way(12, {1, 4, 3}, {{"natural", "tree_row"}});
  text.node(5, 10.1, 50, {{"natural", "tree"}});
  text.relation(9, {{"way", 2, "outer"}, {"way", 3, "inner"}},
                {{"type", "multipolygon"}, {"building", "office"}});
  text.relation(8, {{"way", 11, "outer"}, {"way", 12, "outer"}},
                {{"type", "multipolygon"}, {"building", "yes"}});
  text.relation(7, {{"relation", 9, "outline"}, {"way", 3, "part"}}, {{"type", "building"}});
  return text.text();
}

// Any damage gives features or one InputError with the file's name; never a crash, never a position off the
// Earth.
TEST(OsmReaderFuzz, DamagedDocumentsNeverCrash) {
  const test::TemporaryFolder folder;
  const std::filesystem::path path = folder / "damaged.osm";
  const std::string seed = seed_document();
  const std::vector<std::string> pieces{
      "<",        ">",    "\"",    "/",      "0",   "9",         "-",
      ".",        "&",    "outer", "inner",  "1e9", "999999999", "<nd ref=\"1\"/>",
      "building", "\xff", "part",  "</way>", "50",  "91",        "-180.1"};
  std::mt19937 random(7);
  int read = 0, refused = 0;
  for (int round = 0; round < 1500; ++round) {
    std::string text = seed;
    const std::size_t edits = 1 + random() % 6;
    for (std::size_t i = 0; i < edits; ++i) {
      const std::size_t at = random() % text.size();
      switch (random() % 6) {
        case 0:
          text[at] = static_cast<char>(random() % 256);
          break;
        case 1:
          text.insert(at, pieces[random() % pieces.size()]);
          break;
        case 2:
          text.erase(at, 1 + random() % 30);
          break;
        case 3:
          text.insert(at, text.substr(random() % text.size(), random() % 200));
          break;
        default: {  // a digit for a digit: most edits stay well-formed
          const std::size_t digit = text.find_first_of("0123456789", at);
          if (digit != std::string::npos) text[digit] = static_cast<char>('0' + random() % 10);
        }
      }
      if (text.empty()) text = " ";
    }
    std::ofstream(path, std::ios::binary) << text;
    OsmReadOptions options;
    options.foliage = round % 2 == 0;
    if (round % 3 == 0) options.box = LonLatBox{9.999, 49.999, 10.002, 50.002};
    try {
      const MapData map = read_osm({path}, options);
      ++read;
      for (const MapFeature& feature : map.features) {
        for (const MapPolygon& polygon : feature.polygons) {
          EXPECT_GE(polygon.outer.size(), 3U);
          for (const LonLat& point : polygon.outer) {
            EXPECT_LE(std::abs(point.x()), 180);
            EXPECT_LE(std::abs(point.y()), 90);
          }
        }
        std::vector<std::string> warnings;
        const Shape shape = shape_from_tags(feature.tags, HeightDefaults{}, feature.id, warnings);
        EXPECT_GT(shape.height_m, shape.min_height_m);
      }
    } catch (const InputError& error) {
      ++refused;
      EXPECT_NE(std::string(error.what()).find("damaged.osm"), std::string::npos) << error.what();
    }
  }
  // Some damage is fatal, and some is harmless.
  EXPECT_GT(read, 100);
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace canyon::buildings
