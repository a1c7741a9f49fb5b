#include "canyon/city/buildings/sources/osm_reader.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <osmium/io/any_compression.hpp>
#include <osmium/io/any_input.hpp>
#include <osmium/io/pbf_output.hpp>
#include <osmium/io/writer.hpp>
#include <osmium/io/xml_output.hpp>

#include "canyon/base/input_error.hpp"
#include "tests/support/case_file.hpp"
#include "tests/support/osm_text.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::buildings {
namespace {

using test::OsmText;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;
using ::testing::Not;
using ::testing::StartsWith;
using ::testing::UnorderedElementsAre;

const OsmText::Tags kBuilding{{"building", "yes"}};
const OsmText::Tags kMultipolygon{{"type", "multipolygon"}, {"building", "yes"}};

std::vector<std::string> ids(const MapData& map) {
  std::vector<std::string> out;
  for (const MapFeature& feature : map.features) out.push_back(feature.id);
  return out;
}

const MapFeature& feature(const MapData& map, const std::string& id) {
  const auto found = std::find_if(map.features.begin(), map.features.end(),
                                  [&](const MapFeature& candidate) { return candidate.id == id; });
  if (found == map.features.end()) throw std::runtime_error("no feature " + id);
  return *found;
}

/// Shoelace formula [deg^2].
double area(const MapRing& ring) {
  double twice = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const LonLat& a = ring[i];
    const LonLat& b = ring[(i + 1) % ring.size()];
    twice += a.x() * b.y() - b.x() * a.y();
  }
  return std::abs(twice) / 2;
}

class OsmReader : public ::testing::Test {
 protected:
  MapData read(const OsmText& text, const OsmReadOptions& options = {}) {
    return read_osm({text.write(folder_ / "map.osm")}, options);
  }
  std::string problem(const std::filesystem::path& path, const OsmReadOptions& options = {}) {
    return test::refusal([&] { const MapData map = read_osm({path}, options); });
  }
  std::string problem_of_text(const std::string& text, const std::string& name = "map.osm") {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return problem(folder_ / name);
  }

  test::TemporaryFolder folder_;
};

TEST_F(OsmReader, ReadsClosedWaysWithTheirTags) {
  const MapData map = read(OsmText()
                               .square(2, 114.1, 22.3, 0.001, {{"building", "house"}, {"height", "5"}})
                               .square(1, 114.2, 22.4, 0.002, {{"building:part", "yes"}})
                               .square(3, 114.3, 22.5, 0.001, {{"amenity", "school"}}));
  EXPECT_THAT(ids(map), ElementsAre("way/1", "way/2"));
  EXPECT_THAT(map.notes.lines(), IsEmpty());
  EXPECT_EQ(map.source, "map.osm");
  EXPECT_EQ(map.features[0].kind, FeatureKind::Part);
  const MapFeature& house = map.features[1];
  EXPECT_EQ(house.kind, FeatureKind::Building);
  EXPECT_EQ(house.tags.at("height"), "5");
  ASSERT_EQ(house.polygons.size(), 1U);
  ASSERT_EQ(house.polygons[0].outer.size(), 4U);  // without the repeated last point
  EXPECT_DOUBLE_EQ(house.polygons[0].outer[0].x(), 114.1);
  EXPECT_DOUBLE_EQ(house.polygons[0].outer[0].y(), 22.3);
  EXPECT_TRUE(map.bounds.min().isApprox(LonLat(114.1, 22.3), 1e-12));
  EXPECT_TRUE(map.bounds.max().isApprox(LonLat(114.202, 22.402), 1e-12));
}

TEST_F(OsmReader, JoinsMultipolygonsOfSeveralOutersAndInners) {
  OsmText text;
  // One outer ring of two open ways, with a hole; a second outer of one closed way.
  text.node(1, 10, 50).node(2, 10.004, 50).node(3, 10.004, 50.004).node(4, 10, 50.004);
  text.osm_way(11, {1, 2, 3}).osm_way(12, {1, 4, 3});
  text.square(13, 10.001, 50.001, 0.002).square(14, 10.01, 50, 0.001);
  text.relation(9,
                {{"way", 11, "outer"},
                 {"way", 12, "outer"},
                 {"way", 13, "inner"},
                 {"way", 14, ""},
                 {"node", 1, "entrance"}},
                kMultipolygon);
  const MapData map = read(text);
  ASSERT_THAT(ids(map), ElementsAre("relation/9"));
  EXPECT_THAT(map.notes.lines(), IsEmpty());
  const MapFeature& building = map.features[0];
  EXPECT_EQ(building.tags.count("type"), 0U);
  ASSERT_EQ(building.polygons.size(), 2U);
  const bool first = building.polygons[0].inners.size() == 1;
  const MapPolygon& pierced = building.polygons[first ? 0 : 1];
  const MapPolygon& plain = building.polygons[first ? 1 : 0];
  ASSERT_EQ(pierced.inners.size(), 1U);
  EXPECT_NEAR(area(pierced.outer), 0.004 * 0.004, 1e-12);
  EXPECT_NEAR(area(pierced.inners[0]), 0.002 * 0.002, 1e-12);
  EXPECT_THAT(plain.inners, IsEmpty());
  EXPECT_NEAR(area(plain.outer), 0.001 * 0.001, 1e-12);
}

TEST_F(OsmReader, AMultipolygonStandsForItsTaggedOuterWay) {
  const MapData map =
      read(OsmText()
               .square(1, 10, 50, 0.003, {{"building", "yes"}, {"height", "30"}, {"name", "way"}})
               .square(2, 10.001, 50.001, 0.001, {{"building", "hut"}})
               .relation(5, {{"way", 1, "outer"}, {"way", 2, "inner"}},
                         {{"type", "multipolygon"}, {"building", "office"}, {"name", "relation"}}));
  // The inner ring is a separate building in the courtyard.
  EXPECT_THAT(ids(map), ElementsAre("way/2", "relation/5"));
  const MapFeature& office = feature(map, "relation/5");
  EXPECT_EQ(office.tags.at("building"), "office");
  EXPECT_EQ(office.tags.at("name"), "relation");
  EXPECT_EQ(office.tags.at("height"), "30");
  EXPECT_EQ(office.polygons.at(0).inners.size(), 1U);
}

TEST_F(OsmReader, OldStyleMultipolygonsTakeTheTagsOfTheirOuterWays) {
  const MapData map =
      read(OsmText()
               .square(1, 10, 50, 0.003, {{"building", "school"}})
               .square(2, 10.001, 50.001, 0.001)
               .relation(5, {{"way", 1, "outer"}, {"way", 2, "inner"}}, {{"type", "multipolygon"}}));
  EXPECT_THAT(ids(map), ElementsAre("relation/5"));
  EXPECT_EQ(map.features[0].tags.at("building"), "school");
  EXPECT_EQ(map.features[0].polygons.at(0).inners.size(), 1U);
}

TEST_F(OsmReader, AMultipolygonOfWholeBuildingsIsReadAsThese) {
  const MapData map =
      read(OsmText()
               .square(1, 10, 50, 0.001, {{"building", "yes"}, {"height", "30"}})
               .square(2, 10.002, 50, 0.001, {{"building", "yes"}, {"height", "40"}})
               .relation(5, {{"way", 1, "outer"}, {"way", 2, "outer"}},
                         {{"type", "multipolygon"}, {"building", "office"}, {"roof:shape", "gabled"}}));
  EXPECT_THAT(ids(map), ElementsAre("way/1", "way/2"));
  EXPECT_EQ(map.features[1].tags.at("height"), "40");
  EXPECT_EQ(map.features[1].tags.at("roof:shape"), "gabled");
  EXPECT_THAT(map.notes.lines(),
              ElementsAre("1 multipolygons of whole buildings, read as these: relation/5"));
}

TEST_F(OsmReader, BuildingRelationsNameWhatBelongsTogether) {
  OsmText text;
  text.square(1, 10, 50, 0.004).square(2, 10, 50, 0.001, {{"building:part", "yes"}, {"height", "9"}});
  text.square(3, 10.002, 50, 0.001).square(4, 10.1, 50, 0.001, kBuilding);
  text.square(6, 10.002, 50.002, 0.001);
  text.relation(20, {{"way", 6, "outer"}}, {{"type", "multipolygon"}, {"building:part", "yes"}});
  text.relation(21,
                {{"way", 1, "outline"},
                 {"way", 2, "part"},
                 {"way", 3, "part"},
                 {"relation", 20, "part"},
                 {"way", 99, "part"}},
                {{"type", "building"}, {"name", "Tower"}, {"height", "50"}});
  const MapData map = read(text);
  EXPECT_THAT(ids(map), ElementsAre("way/1", "way/2", "way/3", "way/4", "relation/20"));
  EXPECT_EQ(feature(map, "way/1").kind, FeatureKind::Building);
  EXPECT_EQ(feature(map, "way/1").tags.at("height"), "50");
  EXPECT_EQ(feature(map, "way/1").belongs_to, "relation/21");
  EXPECT_EQ(feature(map, "way/2").kind, FeatureKind::Part);
  EXPECT_EQ(feature(map, "way/3").kind, FeatureKind::Part);  // only by its role
  EXPECT_EQ(feature(map, "way/3").belongs_to, "relation/21");
  EXPECT_EQ(feature(map, "relation/20").belongs_to, "relation/21");
  EXPECT_EQ(feature(map, "way/4").belongs_to, "");
  EXPECT_THAT(map.notes.lines(), ElementsAre(HasSubstr("relation/21 (without way/99)")));
}

TEST_F(OsmReader, LeavesOutAndCountsWhatDoesNotStandThere) {
  OsmText text;
  const std::vector<OsmText::Tags> gone{{{"building", "yes"}, {"location", "underground"}},
                                        {{"building", "yes"}, {"layer", "-1"}},
                                        {{"building", "garages"}, {"parking", "underground"}},
                                        {{"building", "demolished"}},
                                        {{"demolished:building", "yes"}},
                                        {{"abandoned:building", "house"}},
                                        {{"building", "yes"}, {"razed", "yes"}},
                                        {{"building", "no"}},
                                        {{"building:part", "yes"}, {"indoor", "room"}},
                                        {{"building", "ruins"}},
                                        {{"building", "construction"}, {"construction", "house"}},
                                        {{"building", "yes"}, {"end_date", "2011-05"}}};
  const std::vector<OsmText::Tags> there{{{"building", "yes"}, {"layer", "-1"}, {"height", "12"}},
                                         {{"building", "yes"}, {"layer", "-1"}, {"building:levels", "2"}},
                                         {{"building", "yes"}, {"layer", "1"}},
                                         {{"building", "new"}, {"demolished:building", "old"}},
                                         {{"building", "yes"}, {"indoor", "no"}},
                                         {{"disused:building", "factory"}},
                                         {{"building", "construction"}, {"height", "12"}}};
  std::int64_t id = 0;
  for (const auto* list : {&gone, &there}) {
    for (const OsmText::Tags& tags : *list) {
      ++id;
      text.square(id, 10 + 0.01 * static_cast<double>(id), 50, 0.001, tags);
    }
  }
  const MapData map = read(text);
  EXPECT_THAT(ids(map), testing::UnorderedElementsAre("way/13", "way/14", "way/15", "way/16", "way/17",
                                                      "way/18", "way/19"));
  EXPECT_THAT(
      map.notes.lines(),
      testing::UnorderedElementsAre(
          "1 left out, building=no: way/8", "4 left out, demolished or not built: way/4, way/5, way/6, way/7",
          "2 left out, in ruins or under construction, without a height: way/10, way/11",
          "1 left out, indoor: way/9", "3 left out, underground: way/1, way/2, way/3",
          "1 left out, with an end_date: way/12"));
}

TEST_F(OsmReader, MarksOfWhatIsGoneOrBelowInOtherWords) {
  const std::vector<OsmText::Tags> gone{{{"building", "No"}},
                                        {{"building", "false"}},
                                        {{"building", "yes"}, {"demolished", "2019"}},
                                        {{"building", "yes"}, {"razed", "1990s"}},
                                        {{"building", "yes"}, {"level", "-1"}},
                                        {{"building", "yes"}, {"level", "-2;-1"}},
                                        {{"building", "yes"}, {"level", "-3--1"}},
                                        {{"building", "yes"}, {"building:levels", "-2"}},
                                        {{"building", "yes"}, {"max_level", "-1"}},
                                        {{"building", "yes"}, {"underground", "yes"}},
                                        {{"building", "yes"}, {"location", "below_ground"}}};
  const std::vector<OsmText::Tags> there{{{"building", "yes"}, {"demolished", "no"}},
                                         {{"building", "yes"}, {"level", "-1;0"}},
                                         {{"building", "yes"}, {"level", "-1"}, {"height", "9"}},
                                         {{"building", "yes"}, {"planned", "solar roof"}}};
  OsmText text;
  std::int64_t id = 0;
  for (const auto* list : {&gone, &there}) {
    for (const OsmText::Tags& tags : *list) {
      ++id;
      text.square(id, 10 + 0.01 * static_cast<double>(id), 50, 0.001, tags);
    }
  }
  const MapData map = read(text);
  EXPECT_THAT(ids(map), ElementsAre("way/12", "way/13", "way/14", "way/15"));
  EXPECT_THAT(map.notes.lines(), IsSupersetOf({HasSubstr("2 left out, building=no"),
                                               HasSubstr("2 left out, demolished or not built: way/3, way/4"),
                                               HasSubstr("7 left out, underground")}));
}

TEST_F(OsmReader, StructuresWithoutTheKeyBuildingAreNamed) {
  const MapData map = read(OsmText()
                               .square(1, 114.1, 22.3, 0.001, kBuilding)
                               .square(2, 114.2, 22.3, 0.001, {{"man_made", "silo"}, {"height", "20"}})
                               .square(3, 114.3, 22.3, 0.001, {{"man_made", "tower"}, {"building", "yes"}})
                               .square(4, 114.4, 22.3, 0.001, {{"man_made", "pier"}}));
  EXPECT_THAT(ids(map), ElementsAre("way/1", "way/3"));
  EXPECT_THAT(map.notes.lines(), Contains(HasSubstr("without the key building: way/2")));
}

TEST_F(OsmReader, ReadsUtf16) {
  OsmText().square(1, 114.1, 22.3, 0.001, kBuilding).write(folder_ / "plain.osm");
  std::ifstream in(folder_ / "plain.osm");
  const std::string plain{std::istreambuf_iterator<char>(in), {}};
  std::string wide = "\xff\xfe";
  for (const char c : plain) wide += {c, '\0'};
  std::ofstream(folder_ / "wide.osm", std::ios::binary) << wide;
  EXPECT_THAT(ids(read_osm({folder_ / "wide.osm"}, {})), ElementsAre("way/1"));
}

TEST_F(OsmReader, AnUnfinishedAnswerOfOverpassIsRefused) {
  const std::string map = OsmText().square(1, 10, 50, 0.001, kBuilding).text();
  for (const char* remark :
       {"<remark> runtime error: Query timed out</remark>", "<remark>\nruntime error: out of memory"})
    EXPECT_THAT(problem_of_text(std::string(map).insert(map.find("<node"), remark)),
                HasSubstr("Overpass aborted"));
}

TEST_F(OsmReader, SkipsWhatIsIncompleteByName) {
  OsmText text;
  text.square(1, 10, 50, 0.001, kBuilding);
  text.osm_way(2, {10, 11, 12, 999, 10}, kBuilding);                                // a node is missing
  text.osm_way(3, {10, 11, 12, 13}, kBuilding);                                     // open
  text.osm_way(4, {10, 11, 11, 10}, kBuilding);                                     // two corners
  text.osm_way(5, {}, kBuilding);                                                   // nothing
  text.relation(6, {{"way", 1, "inner"}, {"way", 77, "outer"}}, kMultipolygon);     // a way is missing
  text.relation(7, {{"way", 2, "outer"}}, kMultipolygon);                           // its way is incomplete
  text.relation(8, {}, kMultipolygon);                                              // nothing
  text.osm_way(9, {10, 11, 12}).relation(9, {{"way", 9, "outer"}}, kMultipolygon);  // does not close
  text.node(500, 10, 50, kBuilding);                                                // a point
  const MapData map = read(text);
  EXPECT_THAT(ids(map), testing::UnorderedElementsAre("way/1"));
  EXPECT_THAT(
      map.notes.lines(),
      testing::UnorderedElementsAre(
          "1 multipolygons of rings that do not close or cross each other, left out: relation/9",
          "3 multipolygons of which the map has only a part, left out: relation/6, relation/7, relation/8",
          "1 points tagged building, left out: no outline: node/500",
          "1 ways, outline not closed, left out: way/3",
          "1 ways, outline of fewer than three corners, left out: way/4",
          "1 ways, with nodes that are not in the map, left out: way/2",
          "1 ways, without nodes, left out: way/5"));
}

TEST_F(OsmReader, NamesTwentyOfManyAndCountsTheRest) {
  OsmText text;
  text.square(1, 10, 50, 0.001, kBuilding);
  for (int i = 100; i < 150; ++i) text.osm_way(i, {10, 11, 12, 13}, kBuilding);
  const MapData map = read(text);
  ASSERT_EQ(map.notes.lines().size(), 1U);
  EXPECT_THAT(map.notes.lines()[0], StartsWith("50 ways, outline not closed, left out: way/100, way/101"));
  EXPECT_THAT(map.notes.lines()[0], HasSubstr("way/119 and 30 more"));
}

TEST_F(OsmReader, TakesCrossingRingsOneByOne) {
  // The inner ring extends beyond the outer one: no valid multipolygon, but the outline is certain.
  const MapData map = read(OsmText()
                               .square(1, 10, 50, 0.002)
                               .square(2, 10.001, 50.0005, 0.002)
                               .relation(3, {{"way", 1, "outer"}, {"way", 2, "inner"}}, kMultipolygon));
  ASSERT_THAT(ids(map), ElementsAre("relation/3"));
  EXPECT_EQ(map.features[0].polygons.at(0).outer.size(), 4U);
  EXPECT_EQ(map.features[0].polygons.at(0).inners.size(), 1U);
  EXPECT_THAT(map.notes.lines(), ElementsAre(HasSubstr("read one by one: relation/3")));
}

TEST_F(OsmReader, ABowTieIsLeftToTheRepair) {
  const MapData map = read(OsmText()
                               .node(1, 0, 0)
                               .node(2, 0.001, 0.001)
                               .node(3, 0.001, 0)
                               .node(4, 0, 0.001)
                               .osm_way(1, {1, 2, 3, 4, 1}, kBuilding));
  EXPECT_EQ(map.features.at(0).polygons.at(0).outer.size(), 4U);
}

TEST_F(OsmReader, ReadsFoliageOnlyWhenAsked) {
  OsmText text;
  text.square(1, 10, 50, 0.001, kBuilding).square(2, 10.01, 50, 0.001, {{"natural", "wood"}});
  text.square(3, 10.02, 50, 0.001)
      .relation(3, {{"way", 3, "outer"}}, {{"type", "multipolygon"}, {"landuse", "forest"}});
  text.node(100, 10.03, 50, {{"natural", "tree"}, {"height", "11"}});
  text.osm_way(4, {10, 11, 11, 12}, {{"natural", "tree_row"}});
  EXPECT_THAT(ids(read(text)), ElementsAre("way/1"));
  OsmReadOptions options;
  options.foliage = true;
  const MapData map = read(text, options);
  EXPECT_THAT(ids(map), ElementsAre("node/100", "way/1", "way/2", "way/4", "relation/3"));
  EXPECT_EQ(feature(map, "node/100").kind, FeatureKind::Tree);
  EXPECT_EQ(feature(map, "node/100").line.size(), 1U);
  EXPECT_EQ(feature(map, "node/100").tags.at("height"), "11");
  EXPECT_EQ(feature(map, "way/4").kind, FeatureKind::TreeRow);
  EXPECT_EQ(feature(map, "way/4").line.size(), 3U);
  EXPECT_EQ(feature(map, "relation/3").kind, FeatureKind::Wood);
}

TEST_F(OsmReader, ABoxTakesWholeFeaturesThatTouchIt) {
  OsmText text;
  text.square(1, 10.000, 50, 0.001, kBuilding);                                // inside
  text.square(2, 10.0095, 50, 0.001, kBuilding);                               // across the eastern edge
  text.square(3, 10.02, 50, 0.001, kBuilding);                                 // outside
  text.square(4, 9.99, 49.99, 0.025, {{"building", "yes"}, {"height", "3"}});  // around the box
  text.square(5, 10.0102, 50.0005, 0.0002, {{"building:part", "yes"}});        // part of 2, beyond the edge
  text.square(6, 10.012, 50, 0.001, {{"building:part", "yes"}});
  OsmReadOptions options;
  options.box = LonLatBox{9.999, 49.999, 10.010, 50.01};
  // 6 is within the bounds of 4, which extends beyond the box.
  EXPECT_THAT(ids(read(text, options)), ElementsAre("way/1", "way/2", "way/4", "way/5", "way/6"));
  options.box = LonLatBox{10.0005, 50.0002, 10.0006, 50.0003};  // within 1 and 4
  EXPECT_THAT(ids(read(text, options)), ElementsAre("way/1", "way/4", "way/5", "way/6"));
  options.box = LonLatBox{-10, -50, -9, -49};
  EXPECT_THAT(problem(text.write(folder_ / "map.osm"), options), HasSubstr("has no building in the box"));
}

TEST_F(OsmReader, ABoxKeepsRelationsWhole) {
  OsmText text;
  text.square(1, 10, 50, 0.001).square(2, 10.1, 50, 0.001);  // two wings, 7 km apart
  text.relation(3, {{"way", 1, "outer"}, {"way", 2, "outer"}}, kMultipolygon);
  text.square(4, 10.2, 50, 0.001, kBuilding);
  OsmReadOptions options;
  options.box = LonLatBox{9.999, 49.999, 10.002, 50.002};
  const MapData map = read(text, options);
  ASSERT_THAT(ids(map), ElementsAre("relation/3"));
  EXPECT_EQ(map.features[0].polygons.size(), 2U);
  EXPECT_THAT(map.notes.lines(), IsEmpty());
}

TEST_F(OsmReader, MergesFilesTakingEachObjectOnce) {
  OsmText a, b;
  a.square(1, 10, 50, 0.001, {{"building", "yes"}, {"height", "3"}}).square(2, 10.01, 50, 0.001);
  b.node(10, 10, 50).node(11, 10.001, 50).node(12, 10.001, 50.001);
  b.osm_way(1, {10, 11, 12, 10}, {{"building", "yes"}, {"height", "7"}}, 2);  // a newer version
  b.relation(3, {{"way", 2, "outer"}}, kMultipolygon);                        // of a way in the other file
  const auto path_a = a.write(folder_ / "a.osm");
  const auto path_b = b.write(folder_ / "b.osm");
  const MapData ab = read_osm({path_a, path_b});
  const MapData ba = read_osm({path_b, path_a});
  EXPECT_EQ(ab.source, "a.osm, b.osm");
  for (const MapData* map : {&ab, &ba}) {
    EXPECT_THAT(ids(*map), ElementsAre("way/1", "relation/3"));
    EXPECT_EQ(map->features[0].tags.at("height"), "7");
    EXPECT_EQ(map->features[0].polygons[0].outer.size(), 3U);
    EXPECT_THAT(map->notes.lines(), IsEmpty());
  }
}

// As osmium time-filter and osmium apply-changes leave them (osmcode/osmium-tool#197, #273).
TEST_F(OsmReader, TheNewestVersionCountsAlsoWhereItDoesNotMatterAnyMore) {
  const OsmText::Tags field{{"landuse", "brownfield"}}, tree{{"natural", "tree"}};
  OsmText positions, older, newer;
  // Nodes of a house that is unchanged, of one that is deleted or moves, and of its new position.
  positions.square(1, 10, 50, 0.001, kBuilding).square(2, 10.01, 50, 0.001).square(3, 10.01, 51, 0.001);
  older.osm_way(5, {20, 21, 22, 23, 20}, kBuilding).osm_way(6, {20, 21, 22, 23, 20}, kBuilding);
  older.relation(7, {{"way", 2, "outer"}}, kMultipolygon).node(8, 10.001, 50, tree);
  newer.osm_way(5, {20, 21, 22, 23, 20}, field, 2).osm_way(6, {30, 31, 32, 33, 30}, kBuilding, 2);
  newer.relation(7, {{"way", 2, "outer"}}, {{"type", "multipolygon"}, {"landuse", "brownfield"}}, 2);
  newer.node(8, 10.001, 51, tree, 2);
  OsmReadOptions options;
  options.box = LonLatBox{9.9, 49.9, 10.1, 50.1};
  options.foliage = true;
  const auto a = positions.write(folder_ / "places.osm"), b = older.write(folder_ / "older.osm"),
             c = newer.write(folder_ / "newer.osm");
  for (const auto& files : {std::vector{a, b, c}, std::vector{c, b, a}, std::vector{b, c, a}}) {
    EXPECT_THAT(ids(read_osm(files, options)), ElementsAre("way/1"));
    EXPECT_THAT(ids(read_osm(files)), ElementsAre("way/1", "way/6"));
  }
  EXPECT_THAT(ids(read_osm({a, b}, options)), ElementsAre("node/8", "way/1", "way/5", "way/6", "relation/7"));
  const OsmText history = OsmText(positions).append(older).append(newer);
  EXPECT_THAT(ids(read(history, options)), ElementsAre("way/1"));
  EXPECT_THAT(ids(read(OsmText(newer).append(older).append(positions), options)), ElementsAre("way/1"));
  // The newest position of a node, in any order.
  const auto moved = OsmText().node(10, 9.999, 50, {}, 2).write(folder_ / "moved.osm");
  for (const auto& files : {std::vector{a, moved}, std::vector{moved, a}})
    EXPECT_NEAR(read_osm(files).bounds.min().x(), 9.999, 1e-9);
}

TEST_F(OsmReader, StreetsAreThoseOfTheNewestVersion) {
  const OsmText::Tags street{{"highway", "residential"}}, path{{"highway", "footway"}};
  OsmText positions = OsmText().node(1, 10, 50).node(2, 10.001, 50).node(3, 10.002, 50);
  const auto a =
      OsmText(positions).osm_way(4, {1, 2}, street).osm_way(5, {2, 3}, street).write(folder_ / "a.osm");
  const auto b = OsmText().osm_way(4, {1, 2}, path, 2).osm_way(5, {2, 3}, street).write(folder_ / "b.osm");
  EXPECT_EQ(read_streets({a}).pieces.size(), 2U);
  EXPECT_EQ(read_streets({a, b}).pieces.size(), 1U);
  EXPECT_EQ(read_streets({b, a}).pieces.size(), 1U);
}

// JOSM numbers new objects by -1, -2, ... in each file.
TEST_F(OsmReader, NewObjectsAreThoseOfTheirFile) {
  OsmText a, b;
  a.square(-1, 10, 50, 0.001, kBuilding).square(-2, 10.01, 50, 0.001);
  a.relation(-3, {{"way", -2, "outer"}}, kMultipolygon);
  b.square(-1, 10.02, 50, 0.001, kBuilding).square(-2, 10.03, 50, 0.001);
  b.relation(-3, {{"way", -2, "outer"}}, kMultipolygon).osm_way(-4, {-10, -11, -99, -10}, kBuilding);
  const MapData map = read_osm({a.write(folder_ / "a.osm"), b.write(folder_ / "b.osm")});
  EXPECT_THAT(ids(map), UnorderedElementsAre("way/-1", "relation/-3", "way/-1@2", "relation/-3@2"));
  EXPECT_NEAR(feature(map, "way/-1@2").bounds().min().x(), 10.02, 1e-9);
  EXPECT_NEAR(feature(map, "relation/-3@2").bounds().min().x(), 10.03, 1e-9);
  EXPECT_THAT(map.notes.lines(),
              ElementsAre("1 ways, with nodes that are not in the map, left out: way/-4@2"));
}

TEST_F(OsmReader, BuildingsStandUntilTheirEnd) {
  OsmText text;
  std::int64_t id = 0;
  for (const char* date :
       {"2999", "2999-05", "~2999", "2999s", "31.12.2999", "29991231", "31.12.2026", "1999", "1999-05-01",
        "before 2999", "C21", "12.2011", "unknown", "1.11.2026", "20261101"}) {
    ++id;
    text.square(id, 10 + 0.01 * static_cast<double>(id), 50, 0.001,
                {{"building", "yes"}, {"end_date", date}});
  }
  text.square(id + 1, 11, 50, 0.001, {{"building", "yes"}, {"demolished", "2999"}});
  const MapData map = read(text);
  EXPECT_THAT(ids(map), ElementsAre("way/1", "way/2", "way/3", "way/4", "way/5", "way/6", "way/7", "way/16"));
  EXPECT_THAT(map.notes.warnings(), ElementsAre(HasSubstr("8 left out, with an end_date: way/8")));
}

// Simple 3D Buildings: building:levels has neither roof nor cellars.
TEST_F(OsmReader, ZeroStoreysDoNotMakeABuildingVanish) {
  const OsmText::Tags zero{{"building", "yes"}, {"building:levels", "0"}};
  OsmText text;
  std::int64_t id = 0;
  for (const char* more : {"", "roof:levels=1", "roof:height=4", "height=3", "building:levels:underground=0",
                           "building:levels:underground=2"}) {
    OsmText::Tags tags = zero;
    const std::string pair = more;
    if (!pair.empty()) {
      tags.emplace_back("building:levels:underground", "1");
      if (pair.starts_with("building")) tags.pop_back();
      tags.emplace_back(pair.substr(0, pair.find('=')), pair.substr(pair.find('=') + 1));
    }
    ++id;
    text.square(id, 10 + 0.01 * static_cast<double>(id), 50, 0.001, tags);
  }
  const MapData map = read(text);
  EXPECT_THAT(ids(map), ElementsAre("way/1", "way/2", "way/3", "way/4", "way/5"));
  EXPECT_THAT(map.notes.warnings(), ElementsAre(HasSubstr("1 left out, with zero storeys above the ground")));
}

// planetiler#1104, tilemaker#895.
TEST_F(OsmReader, AVariantOfPbfIsNotCalledDamaged) {
  const std::string logged = problem(test::case_file("osm-pbf-lz4/lz4.osm.pbf"));
  EXPECT_THAT(logged, AllOf(HasSubstr("lz4"), HasSubstr("osmium cat"), Not(HasSubstr("damaged"))));
}

TEST_F(OsmReader, OrderOfTheFileDoesNotMatter) {
  // Relations before ways before nodes, ids descending and negative (as editors number new objects).
  OsmText text;
  text.relation(-3, {{"way", -1, "outer"}}, kMultipolygon).osm_way(-1, {-1, -2, -3, -1});
  text.node(-3, 10, 50.001).node(-2, 10.001, 50).node(-1, 10, 50);
  EXPECT_THAT(ids(read(text)), ElementsAre("relation/-3"));
}

TEST_F(OsmReader, ReadsEveryCompressionByContent) {
  const auto xml = OsmText()
                       .square(1, 10, 50, 0.001, kBuilding)
                       .square(2, 10.01, 50, 0.001, kBuilding)
                       .write(folder_ / "map.osm");
  for (const char* format :
       {"osm.gz", "osm.bz2", "pbf", "pbf,pbf_dense_nodes=false", "pbf,pbf_compression=none"}) {
    const auto path = folder_ / "download";  // no suffix
    {
      osmium::io::Reader reader{xml.string()};
      osmium::io::Writer writer{osmium::io::File{path.string(), format}, osmium::io::overwrite::allow};
      while (osmium::memory::Buffer buffer = reader.read()) writer(std::move(buffer));
      writer.close();
    }
    EXPECT_THAT(ids(read_osm({path})), ElementsAre("way/1", "way/2")) << format;
    // A truncated file is rejected by name; a PBF truncated between two blobs lacks its ways.
    const std::string bytes = test::read_bytes(path);
    for (const std::size_t size : {bytes.size() - 3, bytes.size() / 2, std::size_t{20}}) {
      const std::string what = problem_of_text(bytes.substr(0, size), "cut");
      EXPECT_THAT(what, HasSubstr((folder_ / "cut").string())) << format << " " << size;
      EXPECT_THAT(what, Not(IsEmpty())) << format << " " << size;
    }
  }
}

// A blob header with only a length: libosmium would compare its type with a null pointer, and accept it.
TEST_F(OsmReader, PbfBlobsWithoutATypeAreRefused) {
  const auto path = folder_ / "map.pbf";
  {
    osmium::io::Reader reader{
        OsmText().square(1, 10, 50, 0.001, kBuilding).write(folder_ / "map.osm").string()};
    osmium::io::Writer writer{osmium::io::File{path.string(), "pbf"}, osmium::io::overwrite::allow};
    while (osmium::memory::Buffer buffer = reader.read()) writer(std::move(buffer));
    writer.close();
  }
  std::string bytes = test::read_bytes(path);
  EXPECT_THAT(ids(read_osm({path})), ElementsAre("way/1"));
  const std::size_t at = bytes.find("\n\x07OSMData");  // field 1, 7 bytes
  ASSERT_NE(at, std::string::npos);
  bytes[at - 1] = static_cast<char>(bytes[at - 1] - 9);  // the header's length
  bytes.erase(at, 9);
  EXPECT_THAT(problem_of_text(bytes, "untyped"), HasSubstr("a blob has no type"));
}

TEST_F(OsmReader, FoliageThatIsNotAskedForIsCounted) {
  OsmText text;
  text.square(1, 10, 50, 0.001, kBuilding);
  text.node(50, 10.002, 50, {{"natural", "tree"}}).node(51, 10.003, 50, {{"natural", "tree"}});
  text.osm_way(60, {50, 51}, {{"natural", "tree_row"}});
  EXPECT_EQ(read(text).foliage_left_out, 3U);
  OsmReadOptions options;
  options.foliage = true;
  EXPECT_EQ(read(text, options).foliage_left_out, 0U);
}

TEST_F(OsmReader, BadFilesGiveOneClearError) {
  EXPECT_THAT(problem(folder_ / "nowhere.osm"), HasSubstr("nowhere.osm: no such file"));
  EXPECT_THAT(problem(folder_.path()), HasSubstr("is a folder"));
  EXPECT_THAT(problem_of_text(""), HasSubstr("is empty"));
  EXPECT_THAT(problem_of_text("lat,lon\n1,2\n"), HasSubstr("is not an OpenStreetMap file"));
  EXPECT_THAT(problem_of_text("<?xml version='1.0'?><gpx version='1.1'></gpx>"),
              HasSubstr("is XML, but no OpenStreetMap data"));
  EXPECT_THAT(problem_of_text("<html><body>504</body></html>"), HasSubstr("is a web page"));
  EXPECT_THAT(problem_of_text("<osm version=\"0.6\"></osm>"), HasSubstr("map.osm: has no building"));
  EXPECT_THAT(problem_of_text(OsmText().square(1, 0, 0, 1, {{"building", "no"}}).text()),
              HasSubstr("has no building (1 left out, building=no: way/1)"));
  const std::string whole = OsmText().square(1, 10, 50, 0.001, kBuilding).text();
  EXPECT_THAT(problem_of_text(whole.substr(0, whole.size() / 2)), HasSubstr("is cut short or damaged"));
  EXPECT_THAT(problem_of_text("<osm version=\"0.5\"></osm>"), HasSubstr("map.osm"));
  EXPECT_THROW((void)read_osm({}), InputError);
  OsmReadOptions options;
  options.box = LonLatBox{10, 0, 9, 1};
  EXPECT_THAT(problem(folder_ / "map.osm", options), HasSubstr("west bound 10 of the box is east of"));
}

// Minimal inputs for faults reported by users of other programs; tests/data/cases has the sources.
TEST_F(OsmReader, DoesNotBuildWhatAnEditorDeleted) {
  EXPECT_THAT(ids(read_osm({test::case_file("osm-josm-delete/edited.osm")})), ElementsAre("way/1"));
  // A change file and a history mark it by visible or by a section; the latest version counts.
  const std::string whole =
      OsmText().square(1, 10, 50, 0.001, kBuilding).square(10, 11, 50, 0.001, kBuilding).text();
  std::ofstream(folder_ / "whole.osm") << whole;
  const MapData all = read_osm({folder_ / "whole.osm"});
  ASSERT_EQ(all.features.size(), 2U);
  std::ofstream(folder_ / "gone.osm") << "<osm version='0.6'><way id='" << all.features[0].id.substr(4)
                                      << "' version='7' visible='false'/></osm>";
  EXPECT_THAT(ids(read_osm({folder_ / "whole.osm", folder_ / "gone.osm"})), ElementsAre(all.features[1].id));
}

TEST_F(OsmReader, UsersDoNotMatter) {
  const MapData map = read_osm({test::case_file("osm-josm-uid/uid.osm")});
  ASSERT_EQ(map.features.size(), 1U);
  EXPECT_EQ(map.features[0].tags.at("height"), "20");
}

TEST_F(OsmReader, ReadsOverpassJson) {
  const MapData map = read_osm({test::case_file("overpass-json/overpass.json")});
  ASSERT_EQ(map.features.size(), 1U);
  EXPECT_EQ(map.features[0].tags.at("height"), "20");
  EXPECT_NEAR(area(map.features[0].polygons.at(0).outer), 4e-8, 1e-13);
  // out geom: positions in ways, and in members of relations; a quotation mark in a tag.
  const auto json = [&](const std::string& elements) {
    std::ofstream(folder_ / "o.json") << R"({"version": 0.6, "elements": [)" << elements << "]}";
    return folder_ / "o.json";
  };
  const std::string ring =
      R"("geometry": [{"lat":48,"lon":11},{"lat":48,"lon":11.001},{"lat":48.001,"lon":11.001},{"lat":48,"lon":11}])";
  const MapData geom =
      read_osm({json(R"({"type":"way","id":9,"tags":{"building":"yes","name":"a \"b\" & <c>"},)" + ring +
                     R"(},{"type":"relation","id":4,"tags":{"type":"multipolygon","building":"yes"},)" +
                     R"("members":[{"type":"way","ref":20,"role":"outer",)" + ring + "}]}")});
  ASSERT_THAT(ids(geom), ElementsAre("way/9", "relation/4"));
  EXPECT_EQ(geom.features[0].tags.at("name"), "a \"b\" & <c>");
  // "out geom" of a box: null for nodes outside it, in the ring, at its ends, and in a member.
  const std::string cut = ring.substr(0, ring.size() - 1) + ",null]";
  const std::string ends = R"("geometry": [null,{"lat":48,"lon":11},{"lat":48,"lon":11.001},)"
                           R"({"lat":48.001,"lon":11.001},{"lat":48.001,"lon":11},null])";
  std::string inside = ring;
  inside.insert(inside.find("{\"lat\":48,\"lon\":11.001}"), "null,null,");
  const auto building = [](const std::string& id, const std::string& geometry) {
    return R"({"type":"way","id":)" + id + R"(,"tags":{"building":"yes"},)" + geometry + "}";
  };
  const MapData clipped =
      read_osm({json(building("9", ring) + "," + building("10", cut) + "," + building("11", ends) + "," +
                     building("12", inside) +
                     R"(,{"type":"relation","id":4,"tags":{"type":"multipolygon","building":"yes"},)" +
                     R"("members":[{"type":"way","ref":20,"role":"outer",)" + inside + "}]}")});
  EXPECT_THAT(ids(clipped), ElementsAre("way/9"));
  EXPECT_THAT(clipped.notes.lines(),
              IsSupersetOf({HasSubstr("3 ways, with nodes that are not in the map, left out: way/10"),
                            HasSubstr("multipolygons of which the map has only a part, left out")}));
  EXPECT_THAT(
      problem(json(R"({"type":"way","id":9,"center":{"lat":48,"lon":11},"tags":{"building":"yes"}})")),
      HasSubstr("query Overpass with 'out geom'"));
  std::ofstream(folder_ / "o.json") << R"({"elements": [], "remark": "runtime error: Query timed out"})";
  EXPECT_THAT(problem(folder_ / "o.json"), HasSubstr("Overpass aborted: runtime error"));
  std::ofstream(folder_ / "o.json") << R"({"a": 1})";
  EXPECT_THAT(problem(folder_ / "o.json"), HasSubstr("neither CityJSON nor Overpass"));
}

TEST_F(OsmReader, OneWrongPlaceCostsOneBuilding) {
  OsmText text;
  text.node(1, 10, 89.9999).node(2, 10.001, 90.5).node(3, 10, 90.5).osm_way(4, {1, 2, 3, 1}, kBuilding);
  text.node(11, 10, 48).node(12, 10.001, 48).node(13, 10, 48.001).osm_way(14, {11, 12, 13, 11}, kBuilding);
  text.node(22, 0, 0).osm_way(24, {11, 12, 22, 11}, kBuilding);
  const MapData map = read_osm({text.write(folder_ / "map.osm")});
  ASSERT_EQ(map.features.size(), 1U);
  EXPECT_EQ(map.features[0].id, "way/14");
  EXPECT_THAT(
      map.notes.lines(),
      IsSupersetOf({HasSubstr("nodes beyond the poles or the antimeridian (longitude 180 deg), left out"),
                    HasSubstr("buildings of more than 20 km, left out: a corner is wrong: way/24")}));
  EXPECT_THAT(problem_of_text("<osm version=\"0.6\"><node id=\"1\" lat=\"north\" lon=\"1\"/></osm>"),
              HasSubstr("map.osm"));
}

// Two buildings, one of which crosses the antimeridian, a multipolygon across it with a courtyard, and one
// beyond.
OsmText across_the_antimeridian() {
  OsmText text;
  text.square(11, 179.99, -17, 0.001, kBuilding)
      .node(1, 179.9999, -17)
      .node(2, -179.9999, -17)
      .node(3, -179.9999, -16.9999)
      .osm_way(2, {1, 2, 3, 1}, kBuilding)
      .node(4, 179.999, -17.002)
      .node(5, -179.999, -17.002)
      .node(6, -179.999, -17.001)
      .node(7, 179.999, -17.001)
      .osm_way(3, {4, 5, 6, 7, 4})
      .node(8, 179.9995, -17.0018)
      .node(9, -179.9995, -17.0018)
      .node(10, -179.9995, -17.0012)
      .osm_way(4, {8, 9, 10, 8})
      .square(12, -179.98, -17, 0.001, kBuilding)
      .relation(9, {{"way", 3, "outer"}, {"way", 4, "inner"}},
                {{"type", "multipolygon"}, {"building", "yes"}});
  return text;
}

TEST_F(OsmReader, ReadsAcrossTheAntimeridian) {
  const MapData map = read(across_the_antimeridian());
  EXPECT_THAT(ids(map), ElementsAre("way/2", "way/11", "way/12", "relation/9"));
  EXPECT_THAT(map.notes.lines(), ElementsAre());
  EXPECT_NEAR(map.bounds.min().x(), 179.99, 1e-9);
  EXPECT_NEAR(map.bounds.max().x(), 180.021, 1e-9);
  ASSERT_EQ(map.features[3].polygons.size(), 1U);
  EXPECT_EQ(map.features[3].polygons[0].inners.size(), 1U);
  EXPECT_NEAR(map.features[3].bounds().sizes().x(), 0.002, 1e-9);
}

TEST_F(OsmReader, TakesABoxAcrossTheAntimeridian) {
  OsmReadOptions options;
  options.box = LonLatBox{179.9995, -17.1, -179.9, -16.9};
  const auto path = across_the_antimeridian().write(folder_ / "map.osm");
  EXPECT_THAT(ids(read_osm({path}, options)), ElementsAre("way/2", "way/12", "relation/9"));
  options.box = LonLatBox{-179.985, -17.1, -179.9, -16.9};
  EXPECT_THAT(ids(read_osm({path}, options)), ElementsAre("way/12"));
}

TEST_F(OsmReader, TakesPlacesWrittenInWays) {
  // Overpass's response to "out geom".
  const std::string text =
      "<osm version=\"0.6\"><way id=\"1\"><nd ref=\"1\" lat=\"50\" lon=\"10\"/><nd ref=\"2\" lat=\"50\" "
      "lon=\"10.001\"/><nd ref=\"3\" lat=\"50.001\" lon=\"10\"/><nd ref=\"1\" lat=\"50\" lon=\"10\"/>"
      "<tag k=\"building\" v=\"yes\"/></way></osm>";
  std::ofstream(folder_ / "geom.osm") << text;
  OsmReadOptions options;
  EXPECT_EQ(read_osm({folder_ / "geom.osm"}, options).features.at(0).polygons.at(0).outer.size(), 3U);
  options.box = LonLatBox{9.9, 49.9, 10.1, 50.1};
  EXPECT_EQ(read_osm({folder_ / "geom.osm"}, options).features.size(), 1U);
}

TEST_F(OsmReader, IgnoresDeletedObjects) {
  std::string text =
      OsmText().square(1, 10, 50, 0.001, kBuilding).square(2, 10.1, 50, 0.001, kBuilding).text();
  const std::string from = "<way id=\"2\" version=\"1\"";
  text.replace(text.find(from), from.size(), "<way id=\"2\" version=\"2\" visible=\"false\"");
  std::ofstream(folder_ / "map.osm") << text;
  EXPECT_THAT(ids(read_osm({folder_ / "map.osm"})), ElementsAre("way/1"));
}

}  // namespace
}  // namespace canyon::buildings
