#include "canyon/city/buildings/footprints_geojson.hpp"
#include "canyon/city/buildings/city_builder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "canyon/base/input_error.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/program.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::buildings {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

/// Squares of about 10 m near Hong Kong, counter-clockwise from the south-west.
MapRing square(double west, double south, double size) {
  return {{west, south}, {west + size, south}, {west + size, south + size}, {west, south + size}};
}

MapRing reversed(MapRing ring) {
  std::reverse(ring.begin(), ring.end());
  return ring;
}

/// A tower with a court, clockwise as in some maps; two sheds as one part; one outline that failed; a
/// building from ready-made surfaces; a tree.
BuiltCity sample() {
  BuiltCity built;
  built.city.name = "sample \"city\"";
  city::Mesh& mesh = built.city.mesh;
  const auto box = [&mesh](const std::string& name, city::Surface surface, double low, double high) {
    canyon::test::append_box(mesh, name, surface, city::Material::Concrete, {0, 0, low}, {10, 10, high});
    return static_cast<std::uint32_t>(mesh.objects.size() - 1);
  };

  BuiltFeature tower;
  tower.id = "way/1";
  tower.built = true;
  tower.footprint = {{reversed(square(114.17, 22.3, 3e-4)), {square(114.1701, 22.3001, 1e-4)}}};
  tower.shape.height_m = 123.4567;
  tower.shape.roof = RoofShape::Gabled;
  tower.shape.roof_height_m = 3.5;
  tower.shape.facade = city::Material::Glass;
  tower.shape.roof_material = city::Material::Metal;
  tower.shape.height_source = HeightSource::Tag;
  tower.shape.roof_source = HeightSource::Levels;
  tower.ground_m = 4.25;
  tower.first_object = box("way/1", city::Surface::Building, 0, 123.4567);
  tower.object_count = 1;

  BuiltFeature sheds;
  sheds.id = "relation/2";
  sheds.built = true;
  sheds.part = true;
  sheds.reason = "self-crossing outline";
  sheds.footprint = {{square(114.171, 22.3, 1e-4), {}}, {square(114.172, 22.3, 1e-4), {}}};
  sheds.shape.height_m = 6;
  sheds.shape.min_height_m = 2;
  sheds.first_object = box("relation/2", city::Surface::Building, 2, 6);
  sheds.object_count = 1;

  BuiltFeature failed;
  failed.id = "way/3";
  failed.reason = "outline without area";

  BuiltFeature surveyed;
  surveyed.id = "GUID_\xC3\xA9_\xFF";  // one character of UTF-8, and an invalid byte
  surveyed.built = true;
  surveyed.first_object = box("GUID", city::Surface::Building, 1, 9);
  surveyed.object_count = 1;

  BuiltFeature tree;
  tree.id = "node/5";
  tree.built = true;
  tree.first_object = box("node/5", city::Surface::Foliage, 0, 8);
  tree.object_count = 1;

  BuiltFeature wood;
  wood.id = "way/6";
  wood.built = true;
  wood.footprint = {{square(114.173, 22.3, 1e-3), {}}};
  wood.shape.height_m = 12;
  wood.first_object = box("way/6", city::Surface::Foliage, 0, 12);
  wood.object_count = 1;

  built.features = {tower, sheds, failed, surveyed, tree, wood};
  return built;
}

double twice_area(const json& ring) {
  double sum = 0;
  const double x0 = ring[0][0], y0 = ring[0][1];
  for (std::size_t i = 0; i + 1 < ring.size(); ++i) {
    const double ax = ring[i][0], ay = ring[i][1], bx = ring[i + 1][0], by = ring[i + 1][1];
    sum += (ax - x0) * (by - y0) - (bx - x0) * (ay - y0);
  }
  return sum;
}

TEST(FootprintsGeojson, FeaturesAndProperties) {
  const json all = json::parse(format_footprints_geojson(sample()));
  EXPECT_EQ(all["type"], "FeatureCollection");
  EXPECT_EQ(all["name"], "sample \"city\"");
  ASSERT_EQ(all["features"].size(), 5U);  // all but the tree
  const json& tower = all["features"][0];
  EXPECT_EQ(tower["type"], "Feature");
  EXPECT_EQ(tower["id"], "way/1");
  EXPECT_EQ(tower["properties"], json::parse(R"({"id": "way/1", "kind": "building", "built": true,
      "reason": null, "height_m": 123.457, "min_height_m": 0.0, "height_source": "height",
      "roof_shape": "gabled", "roof_height_m": 3.5, "roof_source": "levels", "ground_m": 4.25,
      "facade": "glass", "roof": "metal"})"));
  const json& sheds = all["features"][1]["properties"];
  EXPECT_EQ(sheds["kind"], "part");
  EXPECT_EQ(sheds["reason"], "self-crossing outline");
  EXPECT_EQ(sheds["min_height_m"], 2);
  EXPECT_EQ(sheds["height_source"], "default");
  EXPECT_EQ(sheds["roof_shape"], "flat");
  EXPECT_TRUE(sheds["roof_source"].is_null());
  EXPECT_EQ(all["features"][4]["properties"]["kind"], "foliage");
}

TEST(FootprintsGeojson, RightHandRuleAndClosedRings) {
  const json all = json::parse(format_footprints_geojson(sample()));
  const json& tower = all["features"][0]["geometry"];
  EXPECT_EQ(tower["type"], "Polygon");
  ASSERT_EQ(tower["coordinates"].size(), 2U);
  const json& sheds = all["features"][1]["geometry"];
  EXPECT_EQ(sheds["type"], "MultiPolygon");
  ASSERT_EQ(sheds["coordinates"].size(), 2U);
  const auto check = [](const json& rings) {
    for (std::size_t i = 0; i < rings.size(); ++i) {
      ASSERT_EQ(rings[i].size(), 5U);
      EXPECT_EQ(rings[i].front(), rings[i].back());
      EXPECT_EQ(twice_area(rings[i]) > 0, i == 0);
    }
  };
  check(tower["coordinates"]);
  for (const json& polygon : sheds["coordinates"]) check(polygon);
  EXPECT_NEAR(twice_area(tower["coordinates"][0]), 2 * 9e-8, 1e-12);
  EXPECT_NEAR(twice_area(tower["coordinates"][1]), -2 * 1e-8, 1e-12);
}

// RFC 7946, 3.1.9 and 3.1.6; longitudes are within +-180 deg, as in footprints of canyon city build.
TEST(FootprintsGeojson, IsCutAtTheAntimeridian) {
  BuiltCity built;
  built.features.resize(3);
  const auto within = [](MapRing ring) {
    for (LonLat& p : ring) p.x() = longitude_near(p.x(), 0);
    return ring;
  };
  built.features[0].footprint = {{within(square(179.9, -17, 0.3)), {within(square(179.95, -16.9, 0.1))}}};
  built.features[1].footprint = {{within(square(-180, -17, 0.3)), {}}};
  built.features[2].footprint = {{within(square(-180.1, -17, 0.3)), {}}, {within(square(179, -17, 0.3)), {}}};
  const json all = json::parse(format_footprints_geojson(built))["features"];
  double area = 0;
  for (const json& feature : all) {
    for (const json& polygon : feature["geometry"]["type"] == "Polygon"
                                   ? json::array({feature["geometry"]["coordinates"]})
                                   : feature["geometry"]["coordinates"]) {
      for (const json& ring : polygon) {
        EXPECT_EQ(twice_area(ring) > 0, &ring == &polygon[0]);
        area += twice_area(ring) / 2;
        double west = 180, east = -180;
        for (const json& p : ring) west = std::min(west, double{p[0]}), east = std::max(east, double{p[0]});
        EXPECT_LT(east - west, 1);
        EXPECT_GE(west, -180);
        EXPECT_LE(east, 180);
      }
    }
  }
  EXPECT_EQ(all[0]["geometry"]["coordinates"].size(), 2U);
  EXPECT_EQ(all[1]["geometry"]["type"], "Polygon");
  EXPECT_EQ(all[2]["geometry"]["coordinates"].size(), 3U);
  EXPECT_NEAR(area, 4 * 0.3 * 0.3 - 0.1 * 0.1, 1e-9);
}

TEST(FootprintsGeojson, WhatHasNoFootprintIsUnlocatedAndSaysWhatIsKnown) {
  const json all = json::parse(format_footprints_geojson(sample()));
  const json& failed = all["features"][2];
  EXPECT_TRUE(failed["geometry"].is_null());
  EXPECT_EQ(failed["properties"]["built"], false);
  EXPECT_EQ(failed["properties"]["reason"], "outline without area");
  EXPECT_TRUE(failed["properties"]["height_m"].is_null());
  const json& surveyed = all["features"][3];
  EXPECT_TRUE(surveyed["geometry"].is_null());
  EXPECT_EQ(surveyed["properties"]["height_m"], 8);
  EXPECT_EQ(surveyed["properties"]["height_source"], "surfaces");
  EXPECT_TRUE(surveyed["properties"]["facade"].is_null());
  EXPECT_EQ(surveyed["id"], "GUID_\xC3\xA9_\xEF\xBF\xBD");  // U+FFFD for the stray byte
}

TEST(FootprintsGeojson, NumbersThatAreNoneAreNull) {
  BuiltCity built = sample();
  built.features[0].ground_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(
      json::parse(format_footprints_geojson(built))["features"][0]["properties"]["ground_m"].is_null());
}

TEST(FootprintsGeojson, NoFeatures) {
  const json all = json::parse(format_footprints_geojson({}));
  EXPECT_EQ(all["features"], json::array());
}

TEST(FootprintsGeojson, FileIsWholeOrNotThere) {
  const test::TemporaryFolder folder;
  write_footprints_geojson(folder / "a.geojson", sample());
  EXPECT_EQ(test::read_bytes(folder / "a.geojson"), format_footprints_geojson(sample()));
  EXPECT_THROW(write_footprints_geojson(folder / "missing/a.geojson", sample()), InputError);
}

/// GDAL's GeoJSON driver as the reference.
TEST(FootprintsGeojson, OgrinfoReadsIt) {
  CANYON_NEEDS_PROGRAM("ogrinfo");
  const test::TemporaryFolder folder;
  BuiltCity built = sample();
  built.city.name = "sample";
  write_footprints_geojson(folder / "a.geojson", built);
  const std::string file = "'" + (folder / "a.geojson").string() + "'";
  const auto summary = test::run_program("ogrinfo -ro -al -so " + file + " 2>&1");
  ASSERT_EQ(summary.status, 0) << summary.output;
  EXPECT_THAT(summary.output, HasSubstr("Layer name: sample"));
  EXPECT_THAT(summary.output, HasSubstr("Feature Count: 5"));
  EXPECT_THAT(summary.output, HasSubstr("height_m: Real"));
  EXPECT_THAT(summary.output, HasSubstr("Extent: (114.170000, 22.300000) - (114.174000, 22.301000)"));
  EXPECT_THAT(summary.output, ::testing::Not(HasSubstr("Warning")));
  const auto all = test::run_program("ogrinfo -ro -al " + file + " 2>&1");
  for (const char* line :
       {"id (String) = way/1", "kind (String) = building", "height_m (Real) = 123.457",
        "min_height_m (Real) = 2", "height_source (String) = height", "roof_source (String) = levels",
        "roof_shape (String) = gabled", "roof_height_m (Real) = 3.5", "ground_m (Real) = 4.25",
        "facade (String) = glass", "roof (String) = metal", "reason (String) = outline without area",
        "height_source (String) = surfaces", "kind (String) = foliage"}) {
    EXPECT_THAT(all.output, HasSubstr(line));
  }
  // The tower's (3e-4 deg)^2 minus its court's (1e-4 deg)^2; two sheds of (1e-4 deg)^2.
  const auto areas = test::run_program(
      "ogrinfo -ro " + file +
      " -sql \"SELECT CAST(OGR_GEOM_AREA * 1e9 + 0.5 AS integer) AS area FROM sample WHERE built = 1\" 2>&1");
  EXPECT_THAT(areas.output, HasSubstr("area (Integer) = 80"));
  EXPECT_THAT(areas.output, HasSubstr("area (Integer) = 20"));
}

}  // namespace
}  // namespace canyon::buildings
