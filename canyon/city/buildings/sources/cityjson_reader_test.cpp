#include "canyon/city/buildings/sources/city_files.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <fstream>
#include <functional>
#include <sstream>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/buildings/sources/reference_system.hpp"
#include "tests/support/cityjson_house.hpp"
#include "tests/support/corrupted_input.hpp"
#include "tests/support/program.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/utm.hpp"

namespace canyon::buildings {
namespace {

using test::cityjson;
using test::cityjson_building;
using test::kHouseSemantics;
using test::kHouseSolid;
using test::kHouseSurfaces;
using test::kHouseVertices;

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

bool any_contains(const std::vector<std::string>& lines, const std::string& part) {
  for (const std::string& line : lines) {
    if (contains(line, part)) return true;
  }
  return false;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::logic_error("'" + from + "' is not there");
  return text.replace(at, from.size(), to);
}

class CityJsonTest : public ::testing::Test {
 protected:
  std::filesystem::path write(const std::string& text, const std::string& name = "city.json") const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  MapData read(const std::string& text, std::optional<double> lod = {},
               std::optional<double> undulation = {}) const {
    CityReadOptions options;
    options.model.lod = lod;
    options.heights.geoid_undulation_m = undulation;
    return read_city_files({write(text)}, options);
  }
  std::string error_of(const std::string& text) const {
    try {
      (void)read(text);
    } catch (const InputError& e) {
      return e.what();
    }
    ADD_FAILURE() << "no InputError";
    return {};
  }
  test::TemporaryFolder folder_;
};

TEST_F(CityJsonTest, NamesOfReferenceSystems) {
  EXPECT_EQ(reference_name("https://www.opengis.net/def/crs/EPSG/0/7415"), "EPSG:7415");
  EXPECT_EQ(reference_name("http://www.opengis.net/def/crs/EPSG/9.9.1/28992"), "EPSG:28992");
  EXPECT_EQ(reference_name("urn:ogc:def:crs:EPSG::7415"), "EPSG:7415");
  EXPECT_EQ(reference_name("urn:ogc:def:crs:EPSG:6.12:25832"), "EPSG:25832");
  EXPECT_EQ(reference_name("EPSG:2263"), "EPSG:2263");
  EXPECT_EQ(reference_name("urn:ogc:def:crs,crs:EPSG::28992,crs:EPSG::5709"), "EPSG:28992+5709");
  EXPECT_EQ(
      reference_name("https://www.opengis.net/def/crs-compound?1=http://www.opengis.net/def/crs/EPSG/0/28992"
                     "&2=http://www.opengis.net/def/crs/EPSG/0/5709"),
      "EPSG:28992+5709");
  EXPECT_EQ(reference_name("https://www.opengis.net/def/crs/OGC/0/CRS84"), "EPSG:4326");
  EXPECT_EQ(reference_name("https://www.opengis.net/def/crs/OGC/0/CRS84h"), "EPSG:4979");
  for (const char* bad : {"", "EPSG", "EPSG::", "EPSG:abc", "RD New", "EPSG::12345678901", "EPSG:-1"}) {
    EXPECT_EQ(reference_name(bad), "") << bad;
  }
}

TEST_F(CityJsonTest, SolidInUtmStandsWhereItShould) {
  const MapData data = read(cityjson(cityjson_building("house", kHouseSolid)));
  ASSERT_EQ(data.features.size(), 1U);
  const MapFeature& house = data.features[0];
  EXPECT_EQ(house.id, "house");
  EXPECT_EQ(house.kind, FeatureKind::Building);
  EXPECT_EQ(house.tags.at("building"), "yes");
  ASSERT_EQ(house.surfaces.size(), 7U);
  EXPECT_TRUE(house.polygons.empty());
  const std::vector<std::string> expected{"GroundSurface", "WallSurface", "WallSurface", "WallSurface",
                                          "WallSurface",   "RoofSurface", "RoofSurface"};
  for (std::size_t i = 0; i < 7; ++i) EXPECT_EQ(house.surfaces[i].semantic, expected[i]);
  EXPECT_EQ(house.surfaces[2].outer.size(), 5U);
  // echo "691000 5334000 0" | gdaltransform -s_srs EPSG:25832 -t_srs EPSG:4326     (GDAL 3.6.2, PROJ 9.1.1)
  const Eigen::Vector3d corner = house.surfaces[0].outer[0];
  EXPECT_NEAR(corner.x(), 11.567052874164, 1e-9);
  EXPECT_NEAR(corner.y(), 48.1305704172875, 1e-9);
  EXPECT_NEAR(corner.z(), 500, 1e-6);
  // For PROJ, ETRS89 equals WGS 84: GeographicLib's UTM agrees.
  const auto utm = test::geodetic_from_utm({32, true, 691010, 5334004});
  const Eigen::Vector3d ridge = house.surfaces[6].outer[3];
  EXPECT_NEAR(ridge.x(), geodesy::degrees(utm.longitude_rad), 1e-8);
  EXPECT_NEAR(ridge.y(), geodesy::degrees(utm.latitude_rad), 1e-8);
  EXPECT_NEAR(ridge.z(), 509, 1e-6);
  // The grid is rotated by 1.9 deg: its corners are the westernmost and northernmost in this order.
  const auto north = test::geodetic_from_utm({32, true, 691000, 5334008});
  EXPECT_NEAR(data.bounds.min().x(), 11.567052874164, 1e-9);
  EXPECT_NEAR(data.bounds.max().y(), geodesy::degrees(north.latitude_rad), 1e-8);
  EXPECT_TRUE(any_contains(data.notes.lines(), "read as ellipsoidal"));
  EXPECT_EQ(data.source, "city.json");
}

TEST_F(CityJsonTest, DutchGridKeepsItsDatumShift) {
  // echo "155000 463000 0" | gdaltransform -s_srs EPSG:28992 -t_srs EPSG:4326  gives 5.38720350841377
  // 52.1551723011922 (PROJ 9.1.1 without RDNAPTRANS' grid, 0.3 m; the point's published position
  // is 5.38720621, 52.15517440). EPSG:7415 is the same with heights above NAP; transformed in one go without
  // NAP's grid, PROJ drops the datum shift: 100 m.
  for (const char* reference : {"EPSG/0/28992", "EPSG/0/7415"}) {
    const MapData data =
        read(cityjson(cityjson_building("house", kHouseSolid), reference, "155000,463000,2"), {}, 43.2);
    const Eigen::Vector3d corner = data.features.at(0).surfaces.at(0).outer.at(0);
    EXPECT_NEAR(corner.x(), 5.3872, 1e-5) << reference;
    EXPECT_NEAR(corner.y(), 52.15517, 1e-5) << reference;
    EXPECT_NEAR(corner.z(), 45.2, 1e-9) << reference;
    EXPECT_TRUE(any_contains(data.notes.lines(), "43.200 m added"));
    EXPECT_EQ(data.geoid_undulation_m, 43.2);
  }
  const MapData data =
      read(cityjson(cityjson_building("house", kHouseSolid), "EPSG/0/7415", "155000,463000,2"));
  EXPECT_TRUE(any_contains(data.notes.lines(), "NAP height (EPSG:5709)"));
  const double height = data.features.at(0).surfaces.at(0).outer.at(0).z();
  if (any_contains(data.notes.lines(), "no geoid grid")) {
    EXPECT_NEAR(height, 2, 1e-9);
    EXPECT_TRUE(any_contains(data.notes.lines(), "--geoid-undulation"));
    EXPECT_FALSE(data.geoid_undulation_m);
  } else {
    EXPECT_NEAR(height, 45.3, 1);  // NAP at Amersfoort is some 43 m above the ellipsoid
  }
}

TEST_F(CityJsonTest, GdaltransformAgrees) {
  CANYON_NEEDS_PROGRAM("gdaltransform");
  struct Located {
    const char *reference, *translate;
  };
  for (const Located& transform_to_wgs84 :
       {Located{"28992", "85000,446000,0"}, Located{"27700", "530000,180000,0"},
        Located{"2056", "2683000,1248000,0"}, Located{"4258", "11.5,48.1,0"}}) {
    const MapData data = read(cityjson(cityjson_building("house", kHouseSolid),
                                       std::string("EPSG/0/") + transform_to_wgs84.reference,
                                       transform_to_wgs84.translate, "2.0", "1e-9,1e-9,0.001"));
    std::string point = transform_to_wgs84.translate;
    std::replace(point.begin(), point.end(), ',', ' ');
    const auto checked = test::run_program(fmt::format(
        "echo '{}' | gdaltransform -s_srs EPSG:{} -t_srs EPSG:4326", point, transform_to_wgs84.reference));
    ASSERT_EQ(checked.status, 0);
    std::istringstream words(checked.output);
    double lon = 0;
    double lat = 0;
    ASSERT_TRUE(words >> lon >> lat) << checked.output;
    const Eigen::Vector3d corner = data.features.at(0).surfaces.at(0).outer.at(0);
    EXPECT_NEAR(corner.x(), lon, 1e-9) << transform_to_wgs84.reference;
    EXPECT_NEAR(corner.y(), lat, 1e-9) << transform_to_wgs84.reference;
  }
}

TEST_F(CityJsonTest, GeographicCoordinatesAreLongitudeFirst) {
  for (const char* reference : {"EPSG/0/4979", "OGC/0/CRS84h"}) {
    const MapData data = read(cityjson(cityjson_building("house", kHouseSolid), reference, "114.17,22.3,10",
                                       "2.0", "1e-8,1e-8,0.001"));
    const Eigen::Vector3d corner = data.features.at(0).surfaces.at(0).outer.at(1);
    EXPECT_NEAR(corner.x(), 114.1700000, 1e-12);
    EXPECT_NEAR(corner.y(), 22.3 + 8e-5, 1e-12);
    EXPECT_NEAR(corner.z(), 10, 1e-9);
  }
  EXPECT_TRUE(contains(error_of(cityjson(cityjson_building("house", kHouseSolid), "EPSG/0/4979",
                                         "22.3,114.17,10", "2.0", "1e-8,1e-8,0.001")),
                       "\"house\": vertex 0 is beyond the poles; CityJSON has longitude first"));
}

TEST_F(CityJsonTest, FeetOfAProjectedSystemAreFeetInHeight) {
  // echo "981000 199000" | gdaltransform -s_srs EPSG:2263 -t_srs EPSG:4326  gives
  // -74.0117232348781 40.7128851399118
  const MapData data =
      read(cityjson(cityjson_building("house", kHouseSolid), "EPSG/0/2263", "981000,199000,100"));
  const Eigen::Vector3d corner = data.features.at(0).surfaces.at(0).outer.at(0);
  EXPECT_NEAR(corner.x(), -74.0117232348781, 2e-5);  // NAD83's many transformations differ by a metre
  EXPECT_NEAR(corner.y(), 40.7128851399118, 2e-5);
  EXPECT_NEAR(corner.z(), 100 * 1200.0 / 3937.0, 1e-9);
  EXPECT_TRUE(any_contains(data.notes.lines(), "heights read in the unit"));
}

TEST_F(CityJsonTest, Versions) {
  // 1.0: numbers as LoD, urn, no transform.
  const std::string old = fmt::format(
      R"({{"type":"CityJSON","version":"1.0","metadata":{{"referenceSystem":"urn:ogc:def:crs:EPSG::25832"}},)"
      R"("CityObjects":{{"a":{{"type":"Building","geometry":[{{"type":"MultiSurface","lod":2,"boundaries":)"
      R"([[[0,1,2]]],"semantics":{{"surfaces":[{{"type":"RoofSurface"}}],"values":[0]}}}}]}}}},)"
      R"("vertices":[[691000,5334000,1],[691010,5334000,1],[691010,5334010,1.5]]}})");
  const MapData data = read(old);
  ASSERT_EQ(data.features.at(0).surfaces.size(), 1U);
  EXPECT_EQ(data.features[0].surfaces[0].semantic, "RoofSurface");
  EXPECT_NEAR(data.features[0].surfaces[0].outer.at(2).z(), 1.5, 1e-9);
  EXPECT_EQ(read(cityjson(cityjson_building("h", kHouseSolid), "EPSG/0/25832", "691000,5334000,500", "1.1"))
                .features.size(),
            1U);
  EXPECT_TRUE(contains(error_of(replaced(old, "\"1.0\"", "\"1.1\"")), "no transform"));
  EXPECT_TRUE(contains(error_of(replaced(old, "\"1.0\"", "\"3.0\"")), "version \"3.0\" is not known"));
  EXPECT_TRUE(contains(error_of(replaced(old, "\"version\":\"1.0\",", "")), "version (none) is not known"));
}

TEST_F(CityJsonTest, HighestLodUpToTheMaximum) {
  const auto geometry = [](const char* lod, int surfaces) {
    std::string list;
    for (int i = 0; i < surfaces; ++i) list += i == 0 ? "[[0,1,2]]" : ",[[0,1,2]]";
    return fmt::format(R"({{"type":"MultiSurface","lod":"{}","boundaries":[{}]}})", lod, list);
  };
  const std::string city =
      cityjson(cityjson_building("b", geometry("1.2", 2) + "," + geometry("3", 5) + "," + geometry("2.2", 4) +
                                          "," + geometry("0", 1) + "," + geometry("1.3", 3)));
  EXPECT_EQ(read(city).features.at(0).surfaces.size(), 5U);
  EXPECT_EQ(read(city, 2).features.at(0).surfaces.size(), 4U);
  EXPECT_EQ(read(city, 1.3).features.at(0).surfaces.size(), 3U);
  EXPECT_EQ(read(city, 1.25).features.at(0).surfaces.size(), 2U);
  EXPECT_EQ(read(city, 3).features.at(0).surfaces.size(), 5U);
  const MapData flat = read(city, 0.5);
  EXPECT_TRUE(flat.features.at(0).surfaces.empty());
  ASSERT_EQ(flat.features[0].polygons.size(), 1U);
  EXPECT_EQ(flat.features[0].polygons[0].outer.size(), 3U);
  EXPECT_THROW((void)read(city, -1), InputError);
}

TEST_F(CityJsonTest, MultiSolidCompositeAndInnerShells) {
  const std::string shell = kHouseSurfaces;
  const std::string multi = fmt::format(
      R"({{"type":"MultiSolid","lod":"2","boundaries":[[{0},{0}],[{0}]],)"
      R"("semantics":{{"surfaces":[{{"type":"RoofSurface"}}],"values":[null,[[null,null,null,null,null,null,0]]]}}}})",
      shell);
  const MapData data = read(cityjson(cityjson_building("m", multi)));
  ASSERT_EQ(data.features.at(0).surfaces.size(), 14U);  // the second shell of the first solid is a cavity
  EXPECT_EQ(data.features[0].surfaces[5].semantic, "");
  EXPECT_EQ(data.features[0].surfaces[13].semantic, "RoofSurface");
  const std::string composite =
      fmt::format(R"({{"type":"CompositeSurface","lod":"2","boundaries":{}}})", kHouseSurfaces);
  EXPECT_EQ(read(cityjson(cityjson_building("c", composite))).features.at(0).surfaces.size(), 7U);
}

TEST_F(CityJsonTest, PartsNameTheirBuildingAndReplaceItsOutline) {
  const std::string outline = R"({"type":"MultiSurface","lod":"0","boundaries":[[[0,1,2,3]]]})";
  const std::string objects =
      R"("B":{"type":"Building","children":["B-0"],"attributes":{"measuredHeight":9},"geometry":[)" +
      outline + R"(]},"B-0":{"type":"BuildingPart","parents":["B"],"geometry":[)" + kHouseSolid +
      R"(]},"C":{"type":"Building","attributes":{"measuredHeight":12.5,"storeysAboveGround":4,"roofMaterial":"metal",)"
      R"("note":null,"list":[1]},"geometry":[)" +
      outline +
      R"(]},"T":{"type":"SolitaryVegetationObject"},"L":{"type":"LandUse"},"E":{"type":"Building"},)" +
      R"("G":{"type":"Building","geometry":[{"type":"GeometryInstance","template":0,"boundaries":[0]}]})";
  const MapData data = read(cityjson(objects));
  ASSERT_EQ(data.features.size(), 2U);
  EXPECT_EQ(data.features[0].id, "B-0");
  EXPECT_EQ(data.features[0].kind, FeatureKind::Part);
  EXPECT_EQ(data.features[0].belongs_to, "B");
  EXPECT_EQ(data.features[0].surfaces.size(), 7U);
  const MapFeature& c = data.features[1];
  EXPECT_EQ(c.id, "C");
  EXPECT_EQ(c.polygons.size(), 1U);
  EXPECT_EQ(c.tags.at("height"), "12.5");
  EXPECT_EQ(c.tags.at("building:levels"), "4");
  EXPECT_EQ(c.tags.at("roof:material"), "metal");
  EXPECT_EQ(c.tags.count("note") + c.tags.count("list"), 0U);
  EXPECT_TRUE(any_contains(data.notes.lines(), "left out 1 city objects of type LandUse"));
  EXPECT_TRUE(any_contains(data.notes.lines(), "left out 1 trees without a position"));
  EXPECT_TRUE(any_contains(data.notes.lines(), "left out 2 buildings and parts without a geometry"));
}

TEST_F(CityJsonTest, UnitsBesideAttributes) {
  const auto height = [this](const std::string& attributes) {
    const MapData data = read(cityjson(R"("C":{"type":"Building","attributes":{)" + attributes +
                                       R"(},"geometry":[)" + kHouseSolid + "]}"));
    const auto& tags = data.features.at(0).tags;
    EXPECT_EQ(tags.count("height") == 0, any_contains(data.notes.lines(), "left out 1 attributes in units"));
    return tags.count("height") == 0 ? "" : tags.at("height");
  };
  EXPECT_EQ(height(R"("measuredHeight":100)"), "100");
  EXPECT_EQ(height(R"("measuredHeight":100,"+measuredHeight-uom":"m")"), "100");
  EXPECT_EQ(height(R"("measuredHeight":100,"+measuredHeight-uom":"ft")"), "30.48");
  EXPECT_EQ(height(R"("measuredHeight":{"value":100,"uom":"#ft"})"), "30.48");
  EXPECT_EQ(height(R"("measuredHeight":100,"measuredHeight_uom":"ell")"), "");
}

// A template of one triangle, twice as large, about a vertex; a bridge and a wood as separate objects.
TEST_F(CityJsonTest, TemplatesAndOtherObjects) {
  const std::string objects =
      R"("T":{"type":"SolitaryVegetationObject","attributes":{"crownDiameter":4},"geometry":[)"
      R"({"type":"GeometryInstance","template":0,"boundaries":[1],"transformationMatrix":)"
      R"([2,0,0,0,0,2,0,0,0,0,2,0,0,0,0,1]}]},)"
      R"("B":{"type":"Bridge","geometry":[)" +
      kHouseSolid + R"(]},"W":{"type":"PlantCover","geometry":[)" + kHouseSolid +
      R"(]},"R":{"type":"TINRelief","geometry":[{"type":"CompositeSurface","lod":"1","boundaries":[[[0,1,2]]]}]})";
  std::string text = cityjson(objects);
  text.insert(
      text.rfind('}'),
      R"(,"geometry-templates":{"templates":[{"type":"MultiSurface","lod":"2","boundaries":[[[0,1,2]]]}],)"
      R"("vertices-templates":[[0,0,0],[1,0,0],[0,1,3]]})");
  const MapData data = read(text);
  ASSERT_EQ(data.features.size(), 3U);
  EXPECT_EQ(data.features[0].kind, FeatureKind::Structure);
  EXPECT_EQ(data.features[0].surfaces.size(), 7U);
  EXPECT_EQ(data.features[1].kind, FeatureKind::Tree);
  EXPECT_EQ(data.features[1].tags.at("height"), "6.00");
  EXPECT_EQ(data.features[1].tags.at("diameter_crown"), "4");
  EXPECT_NEAR(*data.features[1].base_m, 500, 1e-6);
  EXPECT_EQ(data.features[2].kind, FeatureKind::Wood);
  EXPECT_EQ(data.features[2].tags.at("height"), "9.00");
  EXPECT_EQ(data.relief.size(), 1U);
}

TEST_F(CityJsonTest, RingsLoseRepeatedPointsAndKeepHoles) {
  const std::string geometry =
      R"({"type":"MultiSurface","lod":"2","boundaries":[[[0,1,1,2,3,0],[4,5,6]],[[0,1,0]],[]]})";
  const MapData data = read(cityjson(cityjson_building("r", geometry)));
  ASSERT_EQ(data.features.at(0).surfaces.size(), 1U);
  EXPECT_EQ(data.features[0].surfaces[0].outer.size(), 4U);
  ASSERT_EQ(data.features[0].surfaces[0].inners.size(), 1U);
  EXPECT_EQ(data.features[0].surfaces[0].inners[0].size(), 3U);
  EXPECT_TRUE(any_contains(data.notes.lines(), "left out 1 rings of fewer than three points"));
}

TEST_F(CityJsonTest, TextSequencesAndGzip) {
  const std::string header =
      R"({"type":"CityJSON","version":"2.0","transform":{"scale":[0.001,0.001,0.001],"translate":[691000,5334000,0]},)"
      R"("metadata":{"referenceSystem":"https://www.opengis.net/def/crs/EPSG/0/25832"},"CityObjects":{},"vertices":[]})";
  const auto feature = [](const std::string& key) {
    return fmt::format(R"({{"type":"CityJSONFeature","id":"{}","CityObjects":{{{}}},"vertices":{}}})", key,
                       cityjson_building(key, kHouseSolid), kHouseVertices);
  };
  const std::string sequence = header + "\n" + feature("b") + "\n" + feature("a") + "\n";
  const MapData data = read(sequence);
  ASSERT_EQ(data.features.size(), 2U);
  EXPECT_EQ(data.features[0].id, "a");
  EXPECT_TRUE(contains(error_of(header + "\n" + feature("b") + "\n{\"type\":\n"), "city.json:3: "));

  const std::string whole = cityjson(cityjson_building("z", kHouseSolid));
  gzFile out = gzopen((folder_ / "city.json.gz").c_str(), "wb");
  ASSERT_NE(out, nullptr);
  ASSERT_GT(gzwrite(out, whole.data(), static_cast<unsigned>(whole.size())), 0);
  ASSERT_EQ(gzclose(out), Z_OK);
  EXPECT_EQ(read_city_files({folder_ / "city.json.gz"}).features.size(), 1U);
}

TEST_F(CityJsonTest, OneBadObjectCostsOneObject) {
  std::string objects;
  for (const char* key : {"a", "b", "c"}) objects += cityjson_building(key, kHouseSolid) + ",";
  const auto with = [&](const std::string& solid) {
    return cityjson(objects + cityjson_building("d", solid));
  };
  EXPECT_EQ(read(with(kHouseSolid)).features.size(), 4U);
  for (const auto& [from, to] : {std::pair("[0,3,2,1]", "[0,3,2,10]"), std::pair("[0,3,2,1]", "[0,3,2,1.5]"),
                                 std::pair("\"boundaries\"", "\"bounds\"")}) {
    const MapData data = read(with(replaced(kHouseSolid, from, to)));
    EXPECT_EQ(data.features.size(), 3U) << to;
    EXPECT_TRUE(any_contains(data.notes.lines(), "city object \"d\": ")) << to;
  }
  // A vertex that only one object has, without a number or with a fill value.
  const std::string file = with(replaced(kHouseSolid, "[0,3,2,1]", "[0,3,2,10]"));
  for (const char* vertex : {"[null,0,0]", "[NaN,0,0]", "[0,0,-9999000]", "[0,0]"}) {
    const std::string last = "[10000,4000,9000]";
    const MapData data = read(replaced(file, last + "]", last + "," + vertex + "]"));
    EXPECT_EQ(data.features.size(), 3U) << vertex;
    EXPECT_TRUE(any_contains(data.notes.lines(), "\"d\": vertex 10 ")) << vertex;
  }
}

// Joined by cat.
TEST_F(CityJsonTest, JoinedSequencesAreRead) {
  const auto sequence = [](const std::string& key, int east_m) {
    return fmt::format(
        "{{\"type\":\"CityJSON\",\"version\":\"2.0\",\"transform\":{{\"scale\":[0.001,0.001,0.001],"
        "\"translate\":[{},5334000,500]"
        "}},\"metadata\":{{\"referenceSystem\":\"https://www.opengis.net/def/crs/EPSG/0/"
        "25832\"}},\"CityObjects\":{{}},\"vertices\":[]}}\n"
        "{{\"type\":\"CityJSONFeature\",\"id\":\"{}\",\"CityObjects\":{{{}}},\"vertices\":{}}}\n",
        east_m, key, cityjson_building(key, kHouseSolid), kHouseVertices);
  };
  const MapData data = read(sequence("a", 691000) + sequence("b", 691100));
  ASSERT_EQ(data.features.size(), 2U);
  EXPECT_NEAR((data.features[1].bounds().min().x() - data.features[0].bounds().min().x()) * 111'320 * 0.667,
              100, 1);
}

TEST_F(CityJsonTest, BadInputIsOneClearError) {
  const std::string good = cityjson(cityjson_building("house", kHouseSolid));
  EXPECT_THROW((void)read_city_files({folder_ / "none.json"}), InputError);
  EXPECT_TRUE(contains(error_of(good.substr(0, good.size() / 2)), "ends early"));
  EXPECT_TRUE(contains(error_of("<osm/>"), "city.json:1: not JSON"));
  EXPECT_TRUE(contains(error_of(""), "ends early"));
  EXPECT_TRUE(contains(error_of("[1,2]"), "not CityJSON"));
  EXPECT_TRUE(
      contains(error_of(R"({"type":"FeatureCollection"})"), "is GeoJSON, which is not read as a map"));
  EXPECT_TRUE(contains(error_of(replaced(good, "[0,3,2,1]", "[0,3,2,10]")),
                       "city object \"house\": vertex number 10 is out of range (there are 10 vertices)"));
  EXPECT_TRUE(contains(error_of(replaced(good, "[0,3,2,1]", "[0,3,2,-1]")), "vertex number -1"));
  EXPECT_TRUE(contains(error_of(replaced(good, "[0,3,2,1]", "[0,3,2,1.5]")), "\"house\": vertex number 1.5"));
  EXPECT_TRUE(
      contains(error_of(replaced(good, "[[0,3,2,1]]", "[0,3,2,1]")), "\"house\": a ring is not a list"));
  EXPECT_TRUE(contains(error_of(replaced(good, "[[0,1,1,1,1,2,2]]", "[[3,1,1,1,1,2,2]]")),
                       "\"house\": semantic number 3 is out of range"));
  EXPECT_TRUE(contains(error_of(replaced(good, "\"boundaries\"", "\"bounds\"")), "no boundaries"));
  EXPECT_TRUE(contains(error_of(replaced(good, "[0,0,0]", "[0,0]")), "vertex 0 is not three numbers"));
  EXPECT_TRUE(contains(error_of(replaced(good, "EPSG/0/25832", "EPSG/0/999999")), "does not know"));
  EXPECT_TRUE(
      contains(error_of(replaced(good, "EPSG/0/25832", "EPSG/0/4978")), "neither projected nor geographic"));
  EXPECT_TRUE(contains(error_of(replaced(good, "referenceSystem", "system")), "names no reference system"));
  EXPECT_TRUE(
      contains(error_of(replaced(good, "\"scale\":[0.001,", "\"scale\":[0,")), "scale must not be zero"));
  EXPECT_TRUE(contains(error_of(replaced(good, "\"scale\":[0.001,", "\"scale\":[")), "transform.scale"));
  EXPECT_TRUE(
      contains(error_of(replaced(good, "\"CityObjects\"", "\"Objects\"")), "\"CityObjects\" is missing"));
  EXPECT_TRUE(
      contains(error_of(replaced(good, "\"Building\"", "\"Road\"")), "has no building or other object"));
}

TEST_F(CityJsonTest, EveryTruncationAndManyDamagesAreErrorsOrRead) {
  // No damage may crash; only InputError may be thrown.
  const std::string good = cityjson(cityjson_building("house", kHouseSolid));
  test::read_damaged(good, 37, "0123456789[]{}\",:-e. nul",
                     [this](const std::string& text) { return read(text); });
}

}  // namespace
}  // namespace canyon::buildings
