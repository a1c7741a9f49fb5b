#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>

#include "canyon/analysis/heatmap/files/area_file.hpp"
#include "canyon/analysis/heatmap/kernels/grid.hpp"
#include "canyon/base/input_error.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::heatmap {
namespace {

using ::testing::HasSubstr;

const geodesy::LocalFrame kFrame(geodesy::Geodetic::from_degrees(22.3, 114.17, 0));

Area area_of(const std::string& json) {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "area.geojson") << json;
  return read_area(folder / "area.geojson", kFrame);
}

std::string problem(const std::string& json) {
  return test::refusal([&] { (void)area_of(json); });
}

std::string polygon(const std::string& rings) {
  return R"({"type": "Polygon", "coordinates": [)" + rings + "]}";
}
std::string feature(const std::string& geometry) {
  return R"({"type": "Feature", "properties": {}, "geometry": )" + geometry + "}";
}
std::string features(const std::string& list) {
  return R"({"type": "FeatureCollection", "features": [)" + list + "]}";
}
/// A box in thousandths of a degree about the frame's origin; 0.001 deg are 103.0 m east (N cos latitude, N =
/// 6381210 m) and 110.7 m north (M = 6344600 m; Snyder 1987, eq. 4-18 to 4-20).
std::string box(double west, double south, double east, double north) {
  const auto corner = [](double x, double y) {
    return "[" + std::to_string(114.17 + x / 1000) + "," + std::to_string(22.3 + y / 1000) + "]";
  };
  return "[" + corner(west, south) + "," + corner(east, south) + "," + corner(east, north) + "," +
         corner(west, north) + "," + corner(west, south) + "]";
}

TEST(ReadArea, CornersLieWhereTheyAre) {
  const Area area = area_of(polygon(box(-1, -2, 1, 2)));
  ASSERT_EQ(area.rings.size(), 1u);
  EXPECT_EQ(area.rings[0].size(), 4u) << "the closing corner once";
  const auto [low, high] = area.bounds();
  const double sine = std::sin(22.3 * M_PI / 180), e2 = 0.00669437999014;
  const double w = std::sqrt(1 - e2 * sine * sine);
  const double east = 6378137 / w * std::cos(22.3 * M_PI / 180) * 0.001 * M_PI / 180;
  const double north = 6378137 * (1 - e2) / (w * w * w) * 0.002 * M_PI / 180;
  EXPECT_NEAR(high.x(), east, 0.005);
  EXPECT_NEAR(low.x(), -east, 0.005);
  EXPECT_NEAR(high.y(), north, 0.005);
  EXPECT_NEAR(low.y(), -north, 0.005);
}

TEST(ReadArea, AcrossTheAntimeridian) {
  const geodesy::LocalFrame frame(geodesy::Geodetic::from_degrees(-16.8, 180, 0));
  const auto ring = [](double west, double east) {
    return fmt::format("[[{0},-16.85],[{1},-16.85],[{1},-16.75],[{0},-16.75],[{0},-16.85]]", west, east);
  };
  const std::string routes[] = {polygon(ring(179.95, 180.05)), polygon(ring(179.95, -179.95)),
                                polygon(ring(-180.05, -179.95)),
                                R"({"type": "MultiPolygon", "coordinates": [[)" + ring(179.95, 180) + "],[" +
                                    ring(-180, -179.95) + "]]}"};
  const test::TemporaryFolder folder;
  // 0.05 deg are 5.3 km east.
  for (const std::string& route : routes) {
    std::ofstream(folder / "area.geojson") << route;
    const Area area = read_area(folder / "area.geojson", frame);
    for (const double east : {-5200, -2600, -10, 10, 2600, 5200})
      EXPECT_TRUE(area.contains({east, 1000})) << route;
    for (const double east : {-5500, 5500}) EXPECT_FALSE(area.contains({east, 1000})) << route;
    EXPECT_FALSE(area.contains({0, 5700})) << route;
  }
}

TEST(ReadArea, HolesAreOutside) {
  const Area area = area_of(feature(polygon(box(-2, -2, 2, 2) + "," + box(-1, -1, 1, 1))));
  EXPECT_FALSE(area.contains({0, 0}));
  EXPECT_TRUE(area.contains({150, 0}));
  EXPECT_FALSE(area.contains({250, 0}));
}

TEST(ReadArea, OverlappingPolygonsAreOneArea) {
  const Area area =
      area_of(features(feature(polygon(box(-2, -1, 1, 1))) + "," + feature(polygon(box(-1, -1, 2, 1))) + "," +
                       feature(R"({"type": "MultiPolygon", "coordinates": [[)" + box(4, 0, 5, 1) + "],[" +
                               box(6, 0, 7, 1) + "]]}") +
                       "," + feature("null")));
  EXPECT_TRUE(area.contains({0, 0})) << "shared by two";
  EXPECT_TRUE(area.contains({-150, 0}));
  EXPECT_TRUE(area.contains({150, 0}));
  EXPECT_FALSE(area.contains({300, 50}));
  EXPECT_TRUE(area.contains({463, 50}));
  EXPECT_FALSE(area.contains({566, 50}));
  EXPECT_TRUE(area.contains({670, 50}));
}

TEST(ReadArea, HoleOfOnePolygonUnderAnother) {
  const Area area = area_of(features(feature(polygon(box(-3, -3, 3, 3) + "," + box(-2, -2, 2, 2))) + "," +
                                     feature(polygon(box(-1, -1, 1, 1)))));
  EXPECT_TRUE(area.contains({0, 0}));
  EXPECT_FALSE(area.contains({150, 0}));
  EXPECT_TRUE(area.contains({250, 0}));
}

TEST(ReadArea, LongSidesFollowTheParallel) {
  // 40 km along a parallel: its middle is (20 km)^2 / (2 R) tan(22.3 deg) = 12.9 m south of the chord.
  const Area area = area_of(polygon(box(-194.18, -10, 194.18, 0)));
  EXPECT_TRUE(area.contains({0, -0.05}));
  EXPECT_FALSE(area.contains({0, 0.05})) << "the chord's middle would be at 12.9 m";
  const auto [low, high] = area.bounds();
  EXPECT_NEAR(high.y(), 12.9, 0.1);
}

TEST(ReadArea, RefusesWithFileAndCure) {
  EXPECT_THAT(problem("{\"type\": "),
              HasSubstr("area.geojson: is not valid JSON: parse error at line 1, column 1"));
  EXPECT_THAT(problem("[1, 2]"), HasSubstr("is not a GeoJSON object"));
  EXPECT_THAT(problem("{}"), HasSubstr("a GeoJSON object has no \"type\""));
  EXPECT_THAT(problem(features("")), HasSubstr("has no polygon"));
  EXPECT_THAT(problem(feature(R"({"type": "Point", "coordinates": [114.17, 22.3]})")),
              HasSubstr("a Point has no area; give Polygon and MultiPolygon features only"));
  EXPECT_THAT(problem(polygon("[[114.17, 22.3], [114.18, 22.3], [114.17, 22.3]]")),
              HasSubstr("a ring of polygon 1 has 3 positions; give at least four"));
  EXPECT_THAT(problem(polygon("[[114.17, 22.3], [114.18, 22.3], [114.18, 22.4], [114.17, 22.4]]")),
              HasSubstr("does not end where it begins"));
  EXPECT_THAT(problem(polygon("[[22.3, 114.17], [22.3, 114.18], [22.4, 114.18], [22.3, 114.17]]")),
              HasSubstr("[22.3, 114.17] is not a longitude and latitude"));
  EXPECT_THAT(problem(polygon("[[836000, 818000], [836100, 818000], [836100, 818100], [836000, 818000]]")),
              HasSubstr("ogr2ogr -t_srs EPSG:4326"));
  EXPECT_THAT(problem(polygon("[[114.17, \"a\"], [1, 2], [3, 4], [1, 2]]")),
              HasSubstr("[longitude, latitude]"));
  EXPECT_THAT(problem(polygon("[[13.4, 52.5], [13.5, 52.5], [13.5, 52.6], [13.4, 52.5]]")),
              HasSubstr("km from the city"));
  EXPECT_THAT(problem(polygon("[[117.4, 22.5], [117.5, 22.5], [117.5, 22.6], [117.4, 22.5]]")),
              HasSubstr("the area is 333 km from the city"));
  EXPECT_THAT(problem(R"({"type": "FeatureCollection", "crs": {"type": "name", "properties": {"name":
                      "urn:ogc:def:crs:EPSG::2326"}}, "features": []})"),
              HasSubstr("its coordinates are not WGS 84"));
  EXPECT_THROW((void)read_area("/nowhere/area.geojson", kFrame), InputError);
}

}  // namespace
}  // namespace canyon::heatmap
