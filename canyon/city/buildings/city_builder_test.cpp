#include "canyon/city/buildings/city_builder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/buildings/shapes/solid.hpp"
#include "canyon/city/buildings/sources/osm_reader.hpp"
#include "tests/support/case_file.hpp"
#include "tests/support/program.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/solid_check.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::buildings {
namespace {

using geodesy::Geodetic;
using ::testing::Contains;
using ::testing::HasSubstr;

using Tags = std::map<std::string, std::string>;

// A map about a position, drawn in metres; lengths are accurate to 1e-5 within a few hundred metres.
class Sketch {
 public:
  explicit Sketch(double latitude_deg = 48, double longitude_deg = 11)
      : frame_(Geodetic::from_degrees(latitude_deg, longitude_deg, 0)) {
    map_.source = "sketch";
  }

  [[nodiscard]] LonLat at(double east, double north) const {
    const Geodetic position = frame_.geodetic_from_local({east, north, 0});
    return {geodesy::degrees(position.longitude_rad), geodesy::degrees(position.latitude_rad)};
  }
  [[nodiscard]] MapRing box(double west, double south, double east, double north) const {
    return {at(west, south), at(east, south), at(east, north), at(west, north)};
  }
  MapFeature& add(const std::string& id, FeatureKind kind, Tags tags, std::vector<MapPolygon> polygons) {
    MapFeature feature;
    feature.id = id;
    feature.kind = kind;
    feature.tags = std::move(tags);
    feature.polygons = std::move(polygons);
    map_.features.push_back(std::move(feature));
    return map_.features.back();
  }
  MapFeature& building(const std::string& id, Tags tags, const MapRing& ring) {
    return add(id, FeatureKind::Building, std::move(tags), {{ring, {}}});
  }
  MapFeature& part(const std::string& id, Tags tags, const MapRing& ring) {
    return add(id, FeatureKind::Part, std::move(tags), {{ring, {}}});
  }
  [[nodiscard]] const MapData& map() const { return map_; }
  // The origin in the middle of the sketch, at height 0.
  [[nodiscard]] BuiltCity build(BuildOptions options = {}) const {
    if (!options.origin) options.origin = frame_.origin();
    return build_city(map_, nullptr, options);
  }

 private:
  geodesy::LocalFrame frame_;
  MapData map_;
};

city::Box box_of(const city::Mesh& mesh, const city::Object& object) {
  city::Box box;
  for (std::uint32_t t = 0; t < object.triangle_count; ++t) {
    for (const std::uint32_t v : mesh.triangles[object.first_triangle + t]) {
      box.min = box.min.cwiseMin(mesh.vertices[v]);
      box.max = box.max.cwiseMax(mesh.vertices[v]);
    }
  }
  return box;
}

const city::Object* find(const BuiltCity& built, const std::string& name) {
  for (const city::Object& object : built.city.mesh.objects) {
    if (object.name == name) return &object;
  }
  return nullptr;
}

// Every building is a closed solid with outward normals; prisms have the volume of the footprint.
void expect_sound(const BuiltCity& built) {
  city::check_mesh(built.city.mesh, "built");
  for (const BuiltFeature& feature : built.features) {
    double volume = 0, expected = 0;
    for (std::uint32_t k = 0; k < feature.object_count; ++k) {
      const city::Object& object = built.city.mesh.objects.at(feature.first_object + k);
      const test::SolidCheck check = test::check_solid(built.city.mesh, object);
      EXPECT_TRUE(check.watertight) << object.name;
      EXPECT_GT(check.volume_m3, 0) << object.name;
      volume += check.volume_m3;
    }
    if (!feature.built || feature.shape.roof != RoofShape::Flat || feature.footprint.empty()) continue;
    std::vector<Polygon2> polygons;
    for (const MapPolygon& polygon : feature.footprint) {
      const auto ring = [&](const MapRing& positions) {
        std::vector<Point2> points;
        for (const LonLat& p : positions) {
          points.push_back(
              built.city.frame.local_from_geodetic(Geodetic::from_degrees(p.y(), p.x(), feature.ground_m))
                  .head<2>());
        }
        return points;
      };
      Polygon2 next;
      next.outer = ring(polygon.outer);
      for (const MapRing& inner : polygon.inners) next.holes.push_back(ring(inner));
      polygons.push_back(std::move(next));
    }
    for (const Polygon2& polygon : polygons) expected += area(polygon);
    expected *= feature.shape.height_m - feature.shape.min_height_m;
    EXPECT_NEAR(volume, expected, 1e-3 * expected) << feature.id;
  }
}

double volume_of(const BuiltCity& built, const std::string& name) {
  const city::Object* object = find(built, name);
  if (object == nullptr) return 0;
  return test::check_solid(built.city.mesh, *object).volume_m3;
}

TEST(CityBuilder, ObjectsHaveWhatTagsSayOfTheirFacades) {
  Sketch sketch;
  sketch.building("way/1", {{"building", "church"}, {"height", "12"}}, sketch.box(10, 20, 40, 35));
  sketch.building("way/2", {{"building", "yes"}, {"height", "12"}}, sketch.box(60, 20, 90, 35));
  const BuiltCity built = sketch.build();
  ASSERT_NE(find(built, "way/1"), nullptr);
  ASSERT_NE(find(built, "way/2"), nullptr);
  EXPECT_EQ(find(built, "way/1")->facades, city::FacadeMix::Traditional);
  EXPECT_EQ(find(built, "way/2")->facades, city::FacadeMix::ByBuilding);
}

TEST(CityBuilder, ABlockStandsWhereItIsDrawn) {
  Sketch sketch;
  sketch.building("way/1", {{"building", "yes"}, {"height", "12"}, {"building:material", "glass"}},
                  sketch.box(10, 20, 40, 35));
  const BuiltCity built = sketch.build();
  expect_sound(built);
  ASSERT_NE(find(built, "way/1"), nullptr);
  const city::Box box = box_of(built.city.mesh, *find(built, "way/1"));
  // 25 m from the origin the ground is lower by 0.05 mm.
  EXPECT_TRUE(box.min.isApprox(Eigen::Vector3d(10, 20, 0), 1e-4)) << box.min.transpose();
  EXPECT_TRUE(box.max.isApprox(Eigen::Vector3d(40, 35, 12), 1e-4)) << box.max.transpose();
  EXPECT_NEAR(volume_of(built, "way/1"), 30 * 15 * 12, 0.5);
  EXPECT_EQ(built.city.mesh.objects.front().name, "terrain");
  EXPECT_EQ(built.city.mesh.objects.front().surface, city::Surface::Terrain);
  const city::Object& object = *find(built, "way/1");
  EXPECT_EQ(std::count(built.city.mesh.materials.begin() + object.first_triangle,
                       built.city.mesh.materials.begin() + object.first_triangle + object.triangle_count,
                       city::Material::Glass),
            10);  // four walls and the floor, of two triangles each
  EXPECT_EQ(built.report.buildings, 1U);
  EXPECT_EQ(built.report.heights_tagged, 1U);
  EXPECT_EQ(built.report.materials_default, 0U);
}

TEST(CityBuilder, TheOriginIsTheMiddleUnlessGiven) {
  Sketch sketch;
  sketch.building("way/1", {{"building", "yes"}}, sketch.box(100, 100, 120, 140));
  const BuiltCity built = build_city(sketch.map(), nullptr, {});
  const city::Box box = box_of(built.city.mesh, *find(built, "way/1"));
  EXPECT_NEAR(box.min.x() + box.max.x(), 0, 1e-3);
  EXPECT_NEAR(box.min.y() + box.max.y(), 0, 1e-3);
  EXPECT_EQ(built.city.frame.origin().height_m, 0);
  EXPECT_EQ(built.report.heights_default, 1U);
  // Foliage does not move it.
  sketch.add("way/2", FeatureKind::Wood, {}, {{sketch.box(500, 0, 900, 300), {}}});
  BuildOptions options;
  options.foliage = true;
  const BuiltCity wooded = build_city(sketch.map(), nullptr, options);
  EXPECT_EQ(wooded.city.frame.origin().longitude_rad, built.city.frame.origin().longitude_rad);
}

TEST(CityBuilder, CourtyardsStayOpenAndSeveralOutersAreObjects) {
  Sketch sketch;
  sketch.add("relation/1", FeatureKind::Building, {{"building", "yes"}, {"height", "10"}},
             {{sketch.box(0, 0, 40, 40), {sketch.box(10, 10, 30, 30)}}, {sketch.box(60, 0, 70, 10), {}}});
  const BuiltCity built = sketch.build();
  expect_sound(built);
  EXPECT_NEAR(volume_of(built, "relation/1") + volume_of(built, "relation/1#2"), (1600 - 400 + 100) * 10, 1);
  EXPECT_EQ(built.features[0].object_count, 2U);
  EXPECT_EQ(built.report.buildings, 1U);
}

TEST(CityBuilder, PartsThatCoverTheirOutlineReplaceIt) {
  Sketch sketch;
  sketch.building("way/1", {{"building", "yes"}, {"height", "60"}}, sketch.box(0, 0, 40, 20));
  sketch.part("way/2", {{"building:part", "yes"}, {"height", "15"}}, sketch.box(0, 0, 20, 20));
  sketch.part("way/3", {{"building:part", "yes"}, {"height", "60"}}, sketch.box(20, 0, 40, 20));
  const BuiltCity built = sketch.build();
  expect_sound(built);
  EXPECT_EQ(find(built, "way/1"), nullptr);
  EXPECT_FALSE(built.features[0].built);
  EXPECT_THAT(built.features[0].reason, HasSubstr("replaced by 2 parts"));
  EXPECT_NEAR(volume_of(built, "way/2"), 400 * 15, 1);
  EXPECT_NEAR(volume_of(built, "way/3"), 400 * 60, 3);
  EXPECT_EQ(built.report.outlines_replaced, 1U);
  EXPECT_EQ(built.report.buildings, 0U);
  EXPECT_EQ(built.report.parts, 2U);
}

TEST(CityBuilder, WhatPartsLeaveUncoveredKeepsItsWalls) {
  Sketch sketch;
  sketch.building("way/1", {{"building", "yes"}, {"height", "30"}}, sketch.box(0, 0, 40, 20));
  sketch.part("way/2", {{"building:part", "yes"}, {"height", "20"}}, sketch.box(0, 0, 10, 20));
  const BuiltCity built = sketch.build();
  expect_sound(built);
  // 30 m is the whole building's; the rest is as high as the part next to it.
  EXPECT_NEAR(volume_of(built, "way/1"), 30 * 20 * 20, 1.5);
  EXPECT_EQ(built.report.outlines_cut, 1U);
  EXPECT_EQ(built.report.outlines_replaced, 0U);

  // A strip of 0.3 m between part and outline is a drawing inaccuracy.
  Sketch sloppy;
  sloppy.building("way/1", {{"building", "yes"}, {"height", "30"}}, sloppy.box(0, 0, 40, 20));
  sloppy.part("way/2", {{"building:part", "yes"}, {"height", "30"}}, sloppy.box(0.3, 0.3, 39.7, 19.7));
  const BuiltCity whole = sloppy.build();
  EXPECT_EQ(find(whole, "way/1"), nullptr);
  EXPECT_EQ(whole.report.outlines_replaced, 1U);
}

TEST(CityBuilder, AnArchwayBesidePartsOnTheGroundStaysFree) {
  Sketch sketch;
  sketch.building("way/1", {{"building", "yes"}, {"height", "20"}}, sketch.box(0, 0, 30, 10));
  sketch.part("way/2", {{"building:part", "yes"}, {"height", "20"}}, sketch.box(0, 0, 10, 10));
  sketch.part("way/3", {{"building:part", "yes"}, {"height", "20"}, {"min_height", "5"}},
              sketch.box(10, 0, 20, 10));
  sketch.part("way/4", {{"building:part", "yes"}, {"height", "20"}}, sketch.box(20, 0, 30, 10));
  const BuiltCity built = sketch.build();
  expect_sound(built);
  EXPECT_EQ(find(built, "way/1"), nullptr);
  EXPECT_NEAR(box_of(built.city.mesh, *find(built, "way/3")).min.z(), 5, 1e-3);
  EXPECT_NEAR(volume_of(built, "way/3"), 100 * 15, 0.5);
}

TEST(CityBuilder, WhereNoPartReachesTheGroundTheOutlineIsThePodium) {
  Sketch sketch;
  sketch.building("way/1", {{"building", "yes"}, {"height", "80"}}, sketch.box(0, 0, 40, 40));
  sketch.part("way/2", {{"building:part", "yes"}, {"height", "80"}, {"min_height", "12"}},
              sketch.box(10, 10, 30, 30));
  const BuiltCity built = sketch.build();
  expect_sound(built);
  EXPECT_NEAR(volume_of(built, "way/1"), 1600 * 12, 2);
  EXPECT_NEAR(volume_of(built, "way/2"), 400 * 68, 3);
  EXPECT_EQ(built.report.outlines_cut, 1U);
}

TEST(CityBuilder, PartsBelongByTheMapsWordThenByArea) {
  Sketch sketch;
  sketch.building("way/1", {{"building", "yes"}, {"height", "10"}}, sketch.box(0, 0, 20, 20)).belongs_to =
      "relation/7";
  sketch.building("way/2", {{"building", "yes"}, {"height", "10"}}, sketch.box(20, 0, 40, 20));
  // Mostly in way/2, but a relation assigns it to way/1.
  sketch.part("way/3", {{"building:part", "yes"}, {"height", "50"}}, sketch.box(18, 5, 30, 15)).belongs_to =
      "relation/7";
  // A third is outside way/2.
  sketch.part("way/4", {{"building:part", "yes"}, {"height", "30"}}, sketch.box(34, 0, 43, 20));
  // Mostly on the street: separate.
  sketch.part("way/5", {{"building:part", "yes"}, {"height", "5"}}, sketch.box(-10, 0, 4, 20));
  const BuiltCity built = sketch.build();
  expect_sound(built);
  EXPECT_NEAR(volume_of(built, "way/1"), (400 - 20) * 10, 1);   // without way/3's 2 m x 10 m
  EXPECT_NEAR(volume_of(built, "way/2"), (400 - 120) * 10, 1);  // without way/4's 6 m x 20 m
  EXPECT_NEAR(volume_of(built, "way/4"), 9 * 20 * 30, 1);
  EXPECT_NEAR(volume_of(built, "way/5"), 14 * 20 * 5, 1);
  EXPECT_EQ(built.report.parts_alone, 1U);
  EXPECT_EQ(built.report.parts_beyond, 2U);
  EXPECT_THAT(built.city.notes.lines(), Contains(HasSubstr("way/5")));
  EXPECT_THAT(built.city.notes.lines(), Contains(HasSubstr("extends beyond its outline: way/3, way/4")));
}

TEST(CityBuilder, PartsTakeHeightAndMaterialOfTheirBuildingWhereTheySayNone) {
  Sketch sketch;
  sketch.building("way/1", {{"building", "yes"}, {"height", "21"}, {"building:material", "brick"}},
                  sketch.box(0, 0, 20, 20));
  sketch.part("way/2", {{"building:part", "yes"}}, sketch.box(0, 0, 20, 20));
  const BuiltCity built = sketch.build();
  EXPECT_EQ(built.features[1].shape.height_m, 21);
  EXPECT_EQ(built.features[1].shape.facade, city::Material::Brick);
  EXPECT_EQ(built.report.heights_inherited, 1U);
}

TEST(CityBuilder, RoofsOnPillarsLeaveTheSpaceBelowFree) {
  Sketch sketch;
  sketch.building("way/1", {{"building", "roof"}, {"height", "6"}}, sketch.box(0, 0, 20, 10));
  const BuiltCity built = sketch.build();
  expect_sound(built);
  EXPECT_GT(box_of(built.city.mesh, *find(built, "way/1")).min.z(), 4);
}

TEST(CityBuilder, BrokenOutlinesAreRepairedOrSkippedWithTheirIds) {
  Sketch sketch;
  sketch.building("way/1", {{"building", "yes"}, {"height", "10"}},
                  {sketch.at(0, 0), sketch.at(0, 20), sketch.at(20, 20), sketch.at(20, 0)});  // clockwise
  sketch.building("way/2", {{"building", "yes"}}, {sketch.at(50, 0), sketch.at(60, 0), sketch.at(70, 0)});
  sketch.building("way/3", {{"building", "yes"}, {"height", "10"}}, sketch.box(0, 0, 20, 20));  // way/1 again
  sketch.building("way/4", {{"building", "yes"}}, {sketch.at(90, 0)});
  const BuiltCity built = sketch.build();
  expect_sound(built);
  EXPECT_NEAR(volume_of(built, "way/1"), 4000, 1);
  EXPECT_EQ(built.report.buildings, 1U);
  EXPECT_EQ(built.report.skipped, 3U);
  EXPECT_THAT(built.features[2].reason, HasSubstr("same outline as another building (way/1)"));
  EXPECT_THAT(built.city.notes.lines(), Contains(HasSubstr("way/2")));
  EXPECT_THAT(built.city.notes.lines(), Contains(HasSubstr("way/4")));
}

TEST(CityBuilder, SaysWhatIsGuessedAndWhichOptionsHaveNoEffect) {
  Sketch sketch;
  sketch.building("way/1", {{"building", "house"}}, sketch.box(0, 0, 10, 10));
  BuildOptions options;
  options.heights.by_type["hous"] = 7;
  const BuiltCity guessed = sketch.build(options);
  EXPECT_THAT(guessed.city.notes.lines(ReadReport::Level::Guess),
              testing::ElementsAre(HasSubstr("1 of 1 heights are guesses"),
                                   "heights: the map has no building of type 'hous'; did you mean 'house'?"));
  sketch.building("way/2", {{"building", "yes"}, {"height", "12"}}, sketch.box(30, 0, 40, 10));
  EXPECT_THAT(sketch.build().city.notes.lines(ReadReport::Level::Guess), testing::IsEmpty());
}

TEST(CityBuilder, FoliageIsOptional) {
  Sketch sketch;
  sketch.building("way/1", {{"building", "yes"}}, sketch.box(0, 0, 10, 10));
  MapFeature& tree = sketch.add("node/1", FeatureKind::Tree, {{"height", "14"}}, {});
  tree.line = {sketch.at(30, 0)};
  MapFeature& row = sketch.add("way/2", FeatureKind::TreeRow, {}, {});
  row.line = {sketch.at(0, 50), sketch.at(10, 50), sketch.at(30.5, 50)};
  sketch.add("way/3", FeatureKind::Wood, {}, {{sketch.box(50, 50, 90, 90), {}}});
  EXPECT_EQ(sketch.build().city.mesh.objects.size(), 2U);
  BuildOptions options;
  options.foliage = true;
  const BuiltCity built = sketch.build(options);
  EXPECT_EQ(built.report.trees, 1U + 4U);  // at 0, 8, 16 and 24 m of 30.5 m
  EXPECT_EQ(built.report.woods, 1U);
  ASSERT_NE(find(built, "node/1"), nullptr);
  EXPECT_EQ(find(built, "node/1")->surface, city::Surface::Foliage);
  EXPECT_NEAR(box_of(built.city.mesh, *find(built, "node/1")).max.z(), 14, 0.01);
  const city::Box last = box_of(built.city.mesh, *find(built, "way/2#4"));
  EXPECT_NEAR(0.5 * (last.min.x() + last.max.x()), 24, 0.05);
  ASSERT_NE(find(built, "way/3"), nullptr);
  EXPECT_EQ(find(built, "way/3")->surface, city::Surface::Foliage);
  EXPECT_NEAR(volume_of(built, "way/3"), 1600 * options.wood_height_m, 5);
}

TEST(CityBuilder, FarFromTheOriginTheGroundFallsOffAndBuildingsStayWhole) {
  // A frame's plane leaves the Earth by d^2 / (2 R): 31.4 m at 20 km.
  Sketch sketch;
  BuildOptions options;
  options.origin = Geodetic::from_degrees(48, 11, 100);
  sketch.building("way/1", {{"building", "yes"}, {"height", "50"}}, sketch.box(20000, -20, 20040, 20));
  const BuiltCity built = sketch.build(options);
  expect_sound(built);
  const city::Box box = box_of(built.city.mesh, *find(built, "way/1"));
  EXPECT_NEAR(box.max.z() - box.min.z(), 50, 1e-6);
  // Radius of curvature in the prime vertical at 48 deg: 6,389.9 km; lowest at its far end, 20,040 m.
  EXPECT_NEAR(box.min.z(), -20040.0 * 20040 / (2 * 6389.9e3), 0.01);
  // The ground's sheet is at the origin's height at all posts.
  const city::Object& ground = built.city.mesh.objects.front();
  for (std::uint32_t t = 0; t < ground.triangle_count; ++t) {
    for (const std::uint32_t v : built.city.mesh.triangles[t]) {
      ASSERT_NEAR(built.city.frame.geodetic_from_local(built.city.mesh.vertices[v]).height_m, 100, 0.001);
    }
  }
}

// An SRTM tile of 3" posts from 48 N, 11 E, whose ground rises eastwards by 1 m per post (about 62 m).
std::filesystem::path write_slope(const test::TemporaryFolder& folder) {
  constexpr int kPosts = 1201;
  std::string bytes;
  for (int row = 0; row < kPosts; ++row) {
    for (int column = 0; column < kPosts; ++column) {
      const int height = 500 + column;  // big-endian int16, rows from the north
      bytes += static_cast<char>(height >> 8);
      bytes += static_cast<char>(height & 0xff);
    }
  }
  std::filesystem::path path = folder / "N48E011.hgt";
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

TEST(CityBuilder, OnATerrainBuildingsStandOnTheLowestGroundAlongThem) {
  const test::TemporaryFolder folder;
  TerrainOptions ellipsoidal;
  ellipsoidal.geoid_undulation_m = 0;
  const Terrain terrain({write_slope(folder)}, ellipsoidal);
  Sketch sketch(48.5, 11.5);  // post 600: 1,100 m
  sketch.building("way/1", {{"building", "yes"}, {"height", "20"}}, sketch.box(-31, -10, 31, 10));
  sketch.part("way/2", {{"building:part", "yes"}, {"height", "8"}}, sketch.box(-31, -10, 0, 10));
  sketch.part("way/3", {{"building:part", "yes"}, {"height", "20"}, {"min_height", "5"}},
              sketch.box(0, -10, 31, 10));
  const BuiltCity built = build_city(sketch.map(), &terrain, {});
  EXPECT_NEAR(built.city.frame.origin().height_m, 1100, 0.01);
  // 62 m are 1.008 posts of 3" at this latitude (1" is 20.51 m): the ground under the west wall is 0.504 m
  // lower than in the middle.
  const double base = -31 / (3 * 20.51);
  const city::Box low = box_of(built.city.mesh, *find(built, "way/2"));
  const city::Box high = box_of(built.city.mesh, *find(built, "way/3"));
  EXPECT_NEAR(low.max.z(), base + 8, 0.01);
  EXPECT_NEAR(low.min.z(), base - 1, 0.01);   // 1 m into the ground
  EXPECT_NEAR(high.min.z(), base + 5, 0.01);  // parts share the outline's base
  EXPECT_NEAR(high.max.z(), base + 20, 0.01);
  const city::Object& ground = built.city.mesh.objects.front();
  EXPECT_EQ(ground.name, "terrain");
  const city::Box land = box_of(built.city.mesh, ground);
  EXPECT_NEAR(land.max.x(), 231, 0.1);
  EXPECT_NEAR(land.max.z() - land.min.z(), 462 / (3 * 20.51), 0.05);
  // The tile ends at 49 N.
  Sketch beyond(49.0, 11.5);
  beyond.building("way/1", {{"building", "yes"}}, beyond.box(-10, -30, 10, -20));
  EXPECT_THROW((void)build_city(beyond.map(), &terrain, {}), InputError);
}

TEST(CityBuilder, TheCityKnowsWhereTheMapsMeanSeaLevelIs) {
  const test::TemporaryFolder folder;
  TerrainOptions options;
  options.geoid_undulation_m = 46.5;
  const Terrain terrain({write_slope(folder)}, options);
  Sketch sketch(48.5, 11.5);
  sketch.building("way/1", {{"building", "yes"}}, sketch.box(-31, -10, 31, 10));
  MapData map = sketch.map();
  EXPECT_EQ(build_city(map, nullptr, {}).city.geoid_undulation_m, 0);
  EXPECT_EQ(build_city(map, &terrain, {}).city.geoid_undulation_m, 46.5);
  map.geoid_undulation_m = 46.75;  // CityJSON's
  EXPECT_EQ(build_city(map, nullptr, {}).city.geoid_undulation_m, 46.75);
  EXPECT_EQ(build_city(map, &terrain, {}).city.geoid_undulation_m, 46.5);
}

/// A building with six own surfaces over a ring of four corners, anticlockwise.
MapFeature& add_block(Sketch& sketch, const char* id, const MapRing& ring, double low, double high) {
  MapFeature& feature = sketch.add(id, FeatureKind::Building, {}, {});
  const auto at = [&](int k, double z) { return Eigen::Vector3d(ring[k].x(), ring[k].y(), z); };
  const auto surface = [&](std::vector<Eigen::Vector3d> outer, const char* semantic) {
    MapSurface s;
    s.outer = std::move(outer);
    s.semantic = semantic;
    feature.surfaces.push_back(std::move(s));
  };
  surface({at(0, low), at(3, low), at(2, low), at(1, low)}, "GroundSurface");
  surface({at(0, high), at(1, high), at(2, high), at(3, high)}, "RoofSurface");
  for (int k = 0; k < 4; ++k) {
    surface({at(k, low), at((k + 1) % 4, low), at((k + 1) % 4, high), at(k, high)}, "WallSurface");
  }
  return feature;
}

TEST(CityBuilder, SurfacesOfASlopeNeedATerrain) {
  Sketch slope, level;
  for (int i = 0; i < 3; ++i) {
    const std::string id = "GUID_" + std::to_string(i);
    add_block(slope, id.c_str(), slope.box(20 * i, 0, 20 * i + 10, 10), 40 + 4 * i, 60);
    add_block(level, id.c_str(), level.box(20 * i, 0, 20 * i + 10, 10), 40 + 2 * i, 60);
  }
  // Of 0, 4 and 8 m the range between 5 and 95 %: 0.9 of them.
  const BuiltCity built = build_city(slope.map(), nullptr, {});
  EXPECT_THAT(built.city.notes.lines(ReadReport::Level::Guess),
              testing::ElementsAre(
                  testing::AllOf(testing::HasSubstr("differ by 7 m"), testing::HasSubstr("terrain"))));
  EXPECT_THAT(build_city(level.map(), nullptr, {}).city.notes.lines(ReadReport::Level::Guess),
              testing::IsEmpty());
}

TEST(CityBuilder, AHouseBelowTheGroundIsTold) {
  Sketch sketch;
  for (int i = 0; i < 3; ++i)
    add_block(sketch, ("GUID_" + std::to_string(i)).c_str(), sketch.box(20 * i, 0, 20 * i + 10, 10),
              i == 2 ? 10 : 40, i == 2 ? 39 : 60);
  EXPECT_THAT(build_city(sketch.map(), nullptr, {}).city.notes.lines(ReadReport::Level::Guess),
              testing::Contains(testing::AllOf(testing::HasSubstr("1 buildings entirely below the ground"),
                                               testing::EndsWith(": GUID_2"))));
}

TEST(CityBuilder, SurfacesAreTakenAsTheyAre) {
  Sketch sketch;
  MapFeature& feature = add_block(sketch, "GUID_1", sketch.box(0, 0, 10, 10), 43, 53);
  const BuiltCity built = build_city(sketch.map(), nullptr, {});
  EXPECT_EQ(built.report.surveyed, 1U);
  EXPECT_EQ(built.report.buildings, 1U);
  EXPECT_NEAR(built.city.frame.origin().height_m, 43, 1e-9);  // the ground of the surveyed buildings
  const test::SolidCheck check = test::check_solid(built.city.mesh, *find(built, "GUID_1"));
  EXPECT_TRUE(check.watertight);
  EXPECT_NEAR(check.volume_m3, 1000, 0.2);
  EXPECT_NEAR(box_of(built.city.mesh, *find(built, "GUID_1")).min.z(), 0, 0.001);

  // Floor and four walls, of two triangles each; a roof of two. Untagged surfaces are concrete, or by the
  // options.
  const auto materials = [&](city::Material untagged) {
    BuildOptions options;
    options.untagged_facade = untagged;
    const BuiltCity again = build_city(sketch.map(), nullptr, options);
    const city::Object& object = *find(again, "GUID_1");
    std::map<city::Material, int> counts;
    for (std::uint32_t t = 0; t < object.triangle_count; ++t) {
      ++counts[again.city.mesh.materials[object.first_triangle + t]];
    }
    return counts;
  };
  using Counts = std::map<city::Material, int>;
  EXPECT_EQ(materials(city::Material::Concrete), (Counts{{city::Material::Concrete, 12}}));
  EXPECT_EQ(materials(city::Material::Unknown),
            (Counts{{city::Material::Unknown, 10}, {city::Material::Concrete, 2}}));
  feature.tags = {{"building:material", "brick"}, {"roof:material", "metal"}};
  EXPECT_EQ(materials(city::Material::Unknown),
            (Counts{{city::Material::Brick, 10}, {city::Material::Metal, 2}}));
}

TEST(CityBuilder, ProgressRunsToTheEnd) {
  Sketch sketch;
  for (int i = 0; i < 600; ++i) {
    const int east = 20 * (i % 30), north = 20 * (i / 30);
    sketch.building("way/" + std::to_string(i), {{"building", "yes"}},
                    sketch.box(east, north, east + 10, north + 10));
  }
  std::size_t last = 0;
  const BuiltCity built = build_city(sketch.map(), nullptr, {}, [&last](std::size_t done, std::size_t all) {
    EXPECT_EQ(all, 600U);
    EXPECT_GE(done, last);
    last = done;
  });
  EXPECT_EQ(last, 600U);
  EXPECT_EQ(built.report.buildings, 600U);
  EXPECT_EQ(built.city.notes.lines(ReadReport::Level::Loss).size(), 0U);
  const std::string text = format_report(built.report);
  EXPECT_THAT(text, HasSubstr("buildings   600\n"));
  EXPECT_THAT(text, HasSubstr("600 by default"));
}

std::string error_of(const MapData& map, const BuildOptions& options = {}) {
  return test::refusal([&] { (void)build_city(map, nullptr, options); });
}

TEST(CityBuilder, BadInputSaysWhy) {
  Sketch nothing;
  EXPECT_THAT(error_of(nothing.map()), HasSubstr("sketch: nothing to build"));
  Sketch line;
  line.building("way/1", {{"building", "yes"}}, {line.at(0, 0), line.at(5, 0)});
  EXPECT_THAT(error_of(line.map()), HasSubstr("way/1"));
  Sketch both_sides;
  both_sides.building("way/1", {{"building", "yes"}}, {{179.99, 1}, {179.991, 1}, {179.991, 1.001}});
  both_sides.building("way/2", {{"building", "yes"}}, {{-179.99, 1}, {-179.991, 1}, {-179.991, 1.001}});
  EXPECT_THAT(error_of(both_sides.map()), HasSubstr("from the origin"));
  Sketch wide;
  wide.building("way/1", {{"building", "yes"}}, wide.box(0, 0, 10, 10));
  wide.building("way/2", {{"building", "yes"}}, {{20, 48}, {20.001, 48}, {20.001, 48.001}});
  EXPECT_THAT(error_of(wide.map()), HasSubstr("--bbox"));
  Sketch good;
  good.building("way/1", {{"building", "yes"}}, good.box(0, 0, 10, 10));
  BuildOptions options;
  options.tree_crown_m = 0;
  EXPECT_THAT(error_of(good.map(), options), HasSubstr("tree_crown_m"));
  options = {};
  options.terrain_spacing_m = std::nan("");
  EXPECT_THAT(error_of(good.map(), options), HasSubstr("terrain_spacing_m"));
}

// --- real data -------------------------------------------------------------------------------------------

TEST(CityBuilderMoscow, AllBuildingsStandAndTheTowerIs540MetresHigh) {
  CANYON_SHARED_DATA(path, "osm/moscow.osm.gz");
  const MapData map = read_osm({path});
  const BuiltCity built = build_city(map, nullptr, {});
  expect_sound(built);
  std::printf("%s", format_report(built.report).c_str());
  for (const std::string& warning : built.city.notes.lines()) std::printf("  %s\n", warning.c_str());

  // All features from the reader are built, replaced by parts, or skipped with their id.
  EXPECT_EQ(
      built.report.buildings + built.report.parts + built.report.outlines_replaced + built.report.skipped,
      map.features.size());
  // The tower: 42 parts on an outline of 18 m, up to 540 m (tags of the extract).
  std::vector<city::Box> stack;
  for (const BuiltFeature& feature : built.features) {
    if (!feature.part) continue;
    for (std::uint32_t k = 0; k < feature.object_count; ++k) {
      stack.push_back(box_of(built.city.mesh, built.city.mesh.objects[feature.first_object + k]));
    }
  }
  ASSERT_NE(find(built, "way/42220517"), nullptr);
  stack.push_back(box_of(built.city.mesh, *find(built, "way/42220517")));
  EXPECT_GE(stack.size(), 43U);
  std::sort(stack.begin(), stack.end(),
            [](const city::Box& a, const city::Box& b) { return a.min.z() < b.min.z(); });
  const double base = stack.front().min.z();
  double reached = base;
  for (const city::Box& box : stack) {
    EXPECT_LE(box.min.z(), reached + 1e-6) << "a gap in the tower";
    reached = std::max(reached, box.max.z());
  }
  EXPECT_NEAR(reached - base, 540, 1e-6);
  EXPECT_NEAR(built.city.bounds().max.z(), 540, 0.5);  // and the ground's drop below the frame's plane
}

TEST(CityBuilderMoscow, GdalsOsmDriverSeesTheSameBuildings) {
  CANYON_SHARED_DATA(path, "osm/moscow.osm.gz");
  CANYON_NEEDS_PROGRAM("ogrinfo");
  const BuiltCity built = build_city(read_osm({path}), nullptr, {});
  std::set<std::string> ours;
  for (const BuiltFeature& feature : built.features) {
    if (!feature.part) ours.insert(feature.id);
  }
  // osm_way_id for closed ways, osm_id for relations.
  const test::ProgramResult result = test::run_program(
      // The extract's nodes are not sorted.
      "OSM_USE_CUSTOM_INDEXING=NO ogrinfo -q -ro /vsigzip/" + path.string() +
      " multipolygons -where \"building IS NOT NULL AND building <> 'no'\" -geom=NO 2>/dev/null");
  ASSERT_EQ(result.status, 0);
  std::set<std::string> theirs;
  const auto collect = [&](const std::string& key, const std::string& kind) {
    for (std::size_t at = 0;
         (at = result.output.find("  " + key + " (String) = ", at)) != std::string::npos;) {
      at += key.size() + 14;
      const std::string id = result.output.substr(at, result.output.find('\n', at) - at);
      if (!id.empty() && id != "(null)") theirs.insert(kind + id);
    }
  };
  collect("osm_way_id", "way/");
  collect("osm_id", "relation/");
  std::printf("GDAL: %zu buildings, Canyon: %zu\n", theirs.size(), ours.size());
  EXPECT_GT(theirs.size(), 600U);
  std::size_t missing = 0;
  for (const std::string& id : theirs) {
    if (ours.count(id) == 0) {
      ++missing;
      ADD_FAILURE() << id << " is missing";
    }
  }
  EXPECT_EQ(missing, 0U);
}

/// Value of a tag in GDAL's other_tags ("key"=>"value",...) as printed by it; empty if it is missing.
std::string other_tag(const std::string& tags, const std::string& key) {
  const std::string head = "\"" + key + "\"=>\"";
  const std::size_t at = tags.find(head);
  if (at == std::string::npos) return {};
  const std::size_t begin = at + head.size();
  return tags.substr(begin, tags.find('"', begin) - begin);
}

// Heights from GDAL's reading of the tags, independent of Canyon: height unchanged, else levels of 3 m; areas
// of GDAL's rings against those of the built footprints.
TEST(CityBuilderMoscow, GdalsOsmDriverSeesTheSameHeightsAndFootprints) {
  CANYON_SHARED_DATA(path, "osm/moscow.osm.gz");
  CANYON_NEEDS_PROGRAM("ogr2ogr");
  const BuiltCity built = build_city(read_osm({path}), nullptr, {});
  std::map<std::string, const BuiltFeature*> ours;
  for (const BuiltFeature& feature : built.features) ours[feature.id] = &feature;
  const test::ProgramResult result = test::run_program(
      "OSM_USE_CUSTOM_INDEXING=NO ogr2ogr -f GeoJSONSeq /vsistdout/ /vsigzip/" + path.string() +
      " multipolygons -where \"building IS NOT NULL AND building <> 'no'\" -lco COORDINATE_PRECISION=9 "
      "2>/dev/null");
  ASSERT_EQ(result.status, 0);
  std::size_t areas = 0, tagged = 0, levels = 0;
  double worst = 0;
  for (const std::string_view line : split(result.output, '\n')) {
    if (line.empty()) continue;
    const nlohmann::json feature = nlohmann::json::parse(line);
    const nlohmann::json& properties = feature.at("properties");
    const bool forward = properties.contains("osm_way_id") && properties.at("osm_way_id").is_string();
    const std::string id = forward ? "way/" + properties.at("osm_way_id").get<std::string>()
                                   : "relation/" + properties.at("osm_id").get<std::string>();
    ASSERT_EQ(ours.count(id), 1U) << id;
    const BuiltFeature& mine = *ours.at(id);
    if (!mine.built) continue;

    double theirs_deg2 = 0;
    for (const nlohmann::json& polygon : feature.at("geometry").at("coordinates")) {
      for (std::size_t ring = 0; ring < polygon.size(); ++ring) {
        double twice = 0;
        const nlohmann::json& points = polygon[ring];
        const double x0 = points[0][0], y0 = points[0][1];
        for (std::size_t i = 0; i + 1 < points.size(); ++i) {
          twice += (points[i][0].get<double>() - x0) * (points[i + 1][1].get<double>() - y0) -
                   (points[i + 1][0].get<double>() - x0) * (points[i][1].get<double>() - y0);
        }
        theirs_deg2 += (ring == 0 ? 1 : -1) * std::abs(twice) / 2;
      }
    }
    double mine_deg2 = 0;
    for (const MapPolygon& polygon : mine.footprint) {
      mine_deg2 += std::abs(twice_area(polygon.outer)) / 2;
      for (const MapRing& inner : polygon.inners) mine_deg2 -= std::abs(twice_area(inner)) / 2;
    }
    // Footprints are snapped to a grid of 1 mm: an area of 10 m2 may change by a thousandth.
    const double change = std::abs(mine_deg2 / theirs_deg2 - 1);
    worst = std::max(worst, change);
    EXPECT_LT(change, 2e-3) << id;
    ++areas;

    const std::string tags = properties.contains("other_tags") && properties.at("other_tags").is_string()
                                 ? properties.at("other_tags").get<std::string>()
                                 : "";
    if (const std::string height = other_tag(tags, "height"); !height.empty()) {
      EXPECT_NEAR(mine.shape.height_m, std::stod(height), 1e-9) << id;
      EXPECT_EQ(mine.shape.height_source, HeightSource::Tag) << id;
      ++tagged;
    } else if (const std::string storeys = other_tag(tags, "building:levels"); !storeys.empty()) {
      const std::string roof = other_tag(tags, "roof:levels");
      EXPECT_NEAR(mine.shape.height_m, 3 * (std::stod(storeys) + (roof.empty() ? 0 : std::stod(roof))), 1e-9)
          << id;
      EXPECT_EQ(mine.shape.height_source, HeightSource::Levels) << id;
      ++levels;
    }
  }
  std::printf("GDAL: %zu footprints compared, areas within %.1e; %zu heights tagged, %zu from levels agree\n",
              areas, worst, tagged, levels);
  EXPECT_GT(areas, 600U);
  EXPECT_GT(tagged + levels, 100U);
}

// tests/data/cases: the gable runs over the shorter side, 0.0002 deg of longitude at 48 N.
TEST(CityBuilder, RoofAnglesMakeHeights) {
  const MapData map = read_osm({test::case_file("osm-roof-angle/roof.osm")});
  const BuiltCity built = build_city(map, nullptr, {});
  const double width_m = 0.0002 * M_PI / 180 * 6'389'960 * std::cos(48 * M_PI / 180);  // N(48 deg) of WGS 84
  const Shape& shape = built.features.at(0).shape;
  EXPECT_NEAR(shape.roof_height_m, width_m / 2, 0.01);
  EXPECT_NEAR(shape.height_m, 15, 1e-9);
  EXPECT_EQ(shape.roof_source, HeightSource::Tag);
}

}  // namespace
}  // namespace canyon::buildings
