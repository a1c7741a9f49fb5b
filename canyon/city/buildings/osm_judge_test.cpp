// A real extract, counted by two independent readers: osmium-tool and GDAL's OSM driver.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "canyon/base/text.hpp"
#include "canyon/city/buildings/shapes/footprint.hpp"
#include "canyon/city/buildings/sources/osm_reader.hpp"
#include "canyon/city/buildings/sources/shape.hpp"
#include "tests/support/program.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon::buildings {
namespace {

double area(const MapRing& ring) {
  return std::abs(twice_area(ring)) / 2;
}

double area(const MapFeature& feature) {
  double sum = 0;
  for (const MapPolygon& polygon : feature.polygons) {
    sum += area(polygon.outer);
    for (const MapRing& inner : polygon.inners) sum -= area(inner);
  }
  return sum;
}

// 628 outlines (616 ways and 12 multipolygons), 42 parts; 12 of the extract's 640 objects tagged building are
// points. Three of the 619 tagged ways are outer rings of old-style multipolygons:
//   osmium tags-count moscow.osm.gz building building:part
//   osmium tags-filter -R -f opl moscow.osm.gz nwr/building | cut -c1 | sort | uniq -c
TEST(OsmOfMoscow, HoldsWhatOsmiumCounts) {
  CANYON_SHARED_DATA(path, "osm/moscow.osm.gz");
  const MapData map = read_osm({path});
  std::map<FeatureKind, std::size_t> kinds;
  std::size_t multipolygons = 0;
  double highest = 0;
  std::map<HeightSource, std::size_t> sources;
  std::vector<std::string> warnings;
  for (const MapFeature& feature : map.features) {
    ++kinds[feature.kind];
    if (feature.id[0] == 'r') ++multipolygons;
    const Shape shape = shape_from_tags(feature.tags, HeightDefaults{}, feature.id, warnings);
    ++sources[shape.height_source];
    highest = std::max(highest, shape.height_m);
  }
  EXPECT_EQ(kinds[FeatureKind::Building], 628U);
  EXPECT_EQ(kinds[FeatureKind::Part], 42U);
  EXPECT_EQ(multipolygons, 12U);
  EXPECT_EQ(highest, 540);  // the Ostankino tower
  EXPECT_TRUE(warnings.empty()) << warnings.front();
  ASSERT_EQ(map.notes.lines().size(), 1U);
  EXPECT_EQ(map.notes.lines()[0].rfind("12 points tagged building", 0), 0U) << map.notes.lines()[0];
  RecordProperty("heights_tagged", static_cast<int>(sources[HeightSource::Tag]));
  RecordProperty("heights_from_levels", static_cast<int>(sources[HeightSource::Levels]));
  RecordProperty("heights_default", static_cast<int>(sources[HeightSource::Default]));

  CANYON_NEEDS_PROGRAM("osmium");
  const test::ProgramResult count = test::run_program("osmium tags-count --no-progress '" + path.string() +
                                                      "' building building:part 2>/dev/null");
  ASSERT_EQ(count.status, 0);
  std::map<std::string, long long> counted;
  std::istringstream lines(count.output);
  for (std::string line; std::getline(lines, line);) {
    const auto pieces = split_blanks(line);
    if (pieces.size() == 2) counted[std::string(pieces[1])] = parse_integer(pieces[0]).value_or(-1);
  }
  EXPECT_EQ(counted["\"building\""], 640);
  EXPECT_EQ(counted["\"building:part\""], 42);
}

TEST(OsmOfMoscow, AgreesWithGdalOnEveryOutline) {
  CANYON_SHARED_DATA(path, "osm/moscow.osm.gz");
  CANYON_NEEDS_PROGRAM("ogr2ogr");
  const MapData map = read_osm({path});
  const test::ProgramResult gdal =
      test::run_program("OSM_USE_CUSTOM_INDEXING=NO ogr2ogr -f CSV /vsistdout/ '/vsigzip/" + path.string() +
                        "' -sql 'SELECT osm_id, osm_way_id, OGR_GEOM_AREA AS area FROM multipolygons WHERE "
                        "building IS NOT NULL' "
                        "2>/dev/null");
  ASSERT_EQ(gdal.status, 0);
  std::map<std::string, double> areas;
  std::istringstream lines(gdal.output);
  for (std::string line; std::getline(lines, line);) {
    line.erase(std::remove(line.begin(), line.end(), '"'), line.end());
    const auto cells = split(line, ',');
    if (cells.size() != 3 || !parse_double(cells[2])) continue;
    const std::string id =
        cells[0].empty() ? "way/" + std::string(cells[1]) : "relation/" + std::string(cells[0]);
    areas[id] = *parse_double(cells[2]);
  }
  std::size_t compared = 0;
  for (const MapFeature& feature : map.features) {
    if (feature.kind != FeatureKind::Building) continue;
    const auto found = areas.find(feature.id);
    ASSERT_NE(found, areas.end()) << feature.id;
    // GDAL writes 15 digits; coordinates of 1e-7 deg square to 1e-14.
    EXPECT_NEAR(area(feature), found->second, 1e-6 * found->second + 1e-13) << feature.id;
    ++compared;
  }
  EXPECT_EQ(compared, 628U);
  EXPECT_EQ(areas.size(), compared);
}

TEST(OsmOfMoscow, ABoxGivesASubsetOfWholeFeatures) {
  CANYON_SHARED_DATA(path, "osm/moscow.osm.gz");
  const MapData all = read_osm({path});
  OsmReadOptions options;
  options.box = LonLatBox{37.605, 55.815, 37.615, 55.822};
  const MapData some = read_osm({path}, options);
  EXPECT_GT(some.features.size(), 20U);
  EXPECT_LT(some.features.size(), all.features.size());
  std::set<std::string> ids;
  for (const MapFeature& feature : some.features) {
    const auto whole = std::find_if(all.features.begin(), all.features.end(),
                                    [&](const MapFeature& candidate) { return candidate.id == feature.id; });
    ASSERT_NE(whole, all.features.end());
    EXPECT_EQ(whole->tags, feature.tags);
    EXPECT_EQ(area(*whole), area(feature));
    ids.insert(feature.id);
  }
  // No object with a corner in the box is missing.
  for (const MapFeature& feature : all.features) {
    for (const MapPolygon& polygon : feature.polygons) {
      for (const LonLat& point : polygon.outer) {
        const bool in_box = point.x() >= options.box->west && point.x() <= options.box->east &&
                            point.y() >= options.box->south && point.y() <= options.box->north;
        EXPECT_TRUE(!in_box || ids.count(feature.id) == 1) << feature.id;
      }
    }
  }
}

}  // namespace
}  // namespace canyon::buildings
