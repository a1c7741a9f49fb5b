#include "canyon/city/buildings/sources/city_files.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <sstream>

#include "canyon/base/input_error.hpp"
#include "tests/support/citygml_text.hpp"
#include "tests/support/corrupted_input.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::buildings {
namespace {

using test::citygml;
using test::citygml_member;
using test::gml_building;
using test::gml_house;
using test::gml_member;
using test::gml_polygon;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

std::string surfaces_of(const std::string& property, const std::string& members) {
  return fmt::format("<bldg:{0}><gml:MultiSurface>{1}</gml:MultiSurface></bldg:{0}>", property, members);
}

class CityGmlTest : public ::testing::Test {
 protected:
  MapData read(const std::string& text, const CityReadOptions& options = {}) const {
    std::ofstream(folder_ / "city.gml", std::ios::binary) << text;
    return read_city_files({folder_ / "city.gml"}, options);
  }
  MapData read_object(const std::string& object, const CityReadOptions& options = {}) const {
    return read(citygml(citygml_member(object)), options);
  }
  std::string error_of(const std::string& text, const CityReadOptions& options = {}) const {
    try {
      (void)read(text, options);
    } catch (const InputError& e) {
      return e.what();
    }
    ADD_FAILURE() << "no InputError";
    return {};
  }
  test::TemporaryFolder folder_;
};

TEST_F(CityGmlTest, HouseInUtmStandsWhereItShould) {
  const MapData data = read_object(gml_building("house"));
  ASSERT_EQ(data.features.size(), 1U);
  const MapFeature& house = data.features[0];
  EXPECT_EQ(house.id, "house");
  ASSERT_EQ(house.surfaces.size(), 7U);  // the solid's references are not built again
  EXPECT_EQ(house.surfaces[0].semantic, "GroundSurface");
  EXPECT_EQ(house.surfaces[5].semantic, "RoofSurface");
  EXPECT_EQ(house.surfaces[2].outer.size(), 5U);
  // echo "691000 5334000 0" | gdaltransform -s_srs EPSG:25832 -t_srs EPSG:4326     (GDAL 3.6.2, PROJ 9.1.1)
  EXPECT_NEAR(house.surfaces[0].outer[0].x(), 11.567052874164, 1e-9);
  EXPECT_NEAR(house.surfaces[0].outer[0].y(), 48.1305704172875, 1e-9);
  EXPECT_NEAR(house.surfaces[0].outer[0].z(), 500, 1e-6);
  EXPECT_THAT(data.notes.lines(), Contains(HasSubstr("1 Building LoD 2")));
  EXPECT_THAT(data.notes.lines(), Contains(HasSubstr("EPSG:25832 (ETRS89 / UTM zone 32N)")));
}

TEST_F(CityGmlTest, NamesOfReferenceSystems) {
  for (const char* name :
       {"urn:adv:crs:ETRS89_UTM32", "urn:ogc:def:crs:EPSG::25832",
        "http://www.opengis.net/def/crs/EPSG/0/25832", "http://www.opengis.net/gml/srs/epsg.xml#25832"}) {
    const MapData data = read(citygml(citygml_member(gml_building("house")), name));
    EXPECT_NEAR(data.features.at(0).surfaces.at(0).outer.at(0).x(), 11.567052874164, 1e-9) << name;
  }
  EXPECT_EQ(reference_name("urn:adv:crs:ETRS89_UTM33*DE_DHHN2016_NH*GCG2016"), "EPSG:25833+7837");
  EXPECT_EQ(reference_name("EPSG:25832+7837"), "EPSG:25832+7837");
  EXPECT_EQ(reference_name("EPSG:25832+"), "");
  EXPECT_EQ(reference_name("urn:adv:crs:XYZ"), "");
}

// EPSG:6697 has latitude first; in the plane PROJ has no difference between it and WGS 84.
TEST_F(CityGmlTest, LatitudeComesFirstWhereTheAuthoritySaysSo) {
  const std::string ring = "35.5 139.7 1 35.5 139.701 1 35.501 139.7 5 35.5 139.7 1";
  const std::string object = fmt::format("<bldg:Building gml:id=\"a\">{}</bldg:Building>",
                                         surfaces_of("lod2MultiSurface", gml_member(gml_polygon({ring}))));
  for (const char* name : {"http://www.opengis.net/def/crs/EPSG/0/6697", "EPSG:4979", "EPSG:4326"}) {
    const MapData data = read(citygml(citygml_member(object), name));
    const Eigen::Vector3d corner = data.features.at(0).surfaces.at(0).outer.at(1);
    EXPECT_NEAR(corner.x(), 139.701, 1e-9) << name;
    EXPECT_NEAR(corner.y(), 35.5, 1e-9) << name;
    EXPECT_THAT(data.notes.lines(), Not(Contains(HasSubstr("against the axis order"))));
  }
}

TEST_F(CityGmlTest, OtherOrderOfAxesIsReadWhereOnlyThatIsPlausible) {
  const std::string ring = "139.7 35.5 1 139.701 35.5 1 139.7 35.501 5 139.7 35.5 1";
  const std::string object = fmt::format("<bldg:Building gml:id=\"a\">{}</bldg:Building>",
                                         surfaces_of("lod2MultiSurface", gml_member(gml_polygon({ring}))));
  const MapData data = read(citygml(citygml_member(object), "EPSG:6697"));
  EXPECT_NEAR(data.features.at(0).surfaces.at(0).outer.at(1).x(), 139.701, 1e-9);
  EXPECT_THAT(data.notes.lines(),
              Contains(HasSubstr("east or longitude first, against the axis order of EPSG:6697")));
  // Gauss-Krueger: EPSG has north first, Germany's files have east first.
  const std::string plane = "3500000 5500000 1 3500010 5500000 1 3500000 5500010 5 3500000 5500000 1";
  const MapData german = read(
      citygml(citygml_member(fmt::format("<bldg:Building gml:id=\"a\">{}</bldg:Building>",
                                         surfaces_of("lod2MultiSurface", gml_member(gml_polygon({plane}))))),
              "EPSG:31467"));
  EXPECT_NEAR(german.features.at(0).surfaces.at(0).outer.at(0).x(), 9, 0.01);
  EXPECT_NEAR(german.features.at(0).surfaces.at(0).outer.at(0).y(), 49.6, 0.1);
}

// In Berlin's old plane system (EPSG:3068, north first) both orders are in the city.
TEST_F(CityGmlTest, HandednessTellsTheOrderOfAxesWherePlacesDoNot) {
  std::vector<std::string> swapped;
  for (const std::string& ring : gml_house(24000, 20000, 35)) {
    std::istringstream words(ring);
    std::string e, n, u, rotated;
    while (words >> e >> n >> u) rotated += n + " " + e + " " + u + " ";
    swapped.push_back(rotated);
  }
  const MapData east =
      read(citygml(citygml_member(gml_building("a", gml_house(24000, 20000, 35))), "EPSG:3068"));
  const MapData north = read(citygml(citygml_member(gml_building("a", swapped)), "EPSG:3068"));
  EXPECT_THAT(east.notes.lines(), Contains(HasSubstr("because roofs face up only in this order")));
  EXPECT_THAT(north.notes.lines(), Not(Contains(HasSubstr("roofs"))));
  for (const MapData& data : {east, north}) {
    const Eigen::Vector3d corner = data.features.at(0).surfaces.at(0).outer.at(0);
    // echo "24000 20000" | gdaltransform -s_srs EPSG:3068 -t_srs EPSG:4326
    EXPECT_NEAR(corner.x(), 13.391, 2e-3);
    EXPECT_NEAR(corner.y(), 52.507, 2e-3);
  }
}

TEST_F(CityGmlTest, SystemOfAGeometryOrAnObjectGoesBeforeTheDocuments) {
  std::string object = gml_building("house");
  object.replace(object.find("<gml:Solid>"), 11, "<gml:Solid srsName=\"EPSG:25832\">");
  std::string::size_type at = 0;
  while ((at = object.find("<gml:MultiSurface>", at)) != std::string::npos)
    object.replace(at, 18, "<gml:MultiSurface srsName=\"EPSG:25832\">");
  const MapData data = read(citygml(citygml_member(object), "EPSG:25833"));
  EXPECT_NEAR(data.features.at(0).surfaces.at(0).outer.at(0).x(), 11.567052874164, 1e-9);
  const std::string own = gml_building(
      "house", gml_house(),
      "<gml:boundedBy><gml:Envelope srsName=\"EPSG:25832\"><gml:lowerCorner>0 0 0</gml:lowerCorner>"
      "<gml:upperCorner>1 1 1</gml:upperCorner></gml:Envelope></gml:boundedBy>");
  EXPECT_NEAR(read(citygml(citygml_member(own), "")).features.at(0).surfaces.at(0).outer.at(0).x(),
              11.567052874164, 1e-9);
}

TEST_F(CityGmlTest, MissingSystemAsksForCrs) {
  const std::string text = citygml(citygml_member(gml_building("house")), "");
  EXPECT_THAT(error_of(text), HasSubstr("names no reference system"));
  EXPECT_THAT(error_of(text), HasSubstr("--crs"));
  EXPECT_THAT(error_of(citygml(citygml_member(gml_building("house")), "Local")),
              HasSubstr("\"Local\" is not"));
  CityReadOptions options;
  options.model.crs = "EPSG:25832";
  const MapData data = read(text, options);
  EXPECT_NEAR(data.features.at(0).surfaces.at(0).outer.at(0).x(), 11.567052874164, 1e-9);
  EXPECT_THAT(data.notes.lines(), Contains(HasSubstr("from crs")));
  options.model.crs = "Gauss";
  EXPECT_THAT(error_of(text, options), HasSubstr("crs 'Gauss'"));
}

TEST_F(CityGmlTest, BestLevelOfDetailUpToTheWantedOne) {
  const auto level = [](int lod, int surfaces) {
    std::string members;
    for (int i = 0; i < surfaces; ++i) members += gml_member(gml_polygon({gml_house(691000 + 20 * i)[0]}));
    return surfaces_of(fmt::format("lod{}MultiSurface", lod), members);
  };
  const std::string object =
      "<bldg:Building gml:id=\"a\">" + level(1, 1) + level(2, 2) + level(3, 3) + level(4, 4) +
      surfaces_of("lod0FootPrint", gml_member(gml_polygon({gml_house()[0]}))) + "</bldg:Building>";
  const auto count = [&](std::optional<double> lod) {
    CityReadOptions options;
    options.model.lod = lod;
    return read_object(object, options).features.at(0).surfaces.size();
  };
  EXPECT_EQ(count({}), 3U);
  EXPECT_EQ(count(4), 4U);
  EXPECT_EQ(count(2), 2U);
  EXPECT_EQ(count(1), 1U);
  CityReadOptions options;
  options.model.lod = 0;
  EXPECT_EQ(read_object(object, options).features.at(0).polygons.size(), 1U);
}

TEST_F(CityGmlTest, ReferencesBackwardsForwardsAndToOtherObjects) {
  const std::vector<std::string> rings = gml_house();
  const std::string borrower =
      "<bldg:Building gml:id=\"b\">" +
      surfaces_of("lod2MultiSurface",
                  "<gml:surfaceMember xlink:href=\"#house_1\"/><gml:surfaceMember><gml:"
                  "OrientableSurface orientation=\"-\"><gml:baseSurface "
                  "xlink:href=\"#house_2\"/></gml:OrientableSurface></gml:surfaceMember>"
                  "<gml:surfaceMember xlink:href=\"#nowhere\"/>") +
      "</bldg:Building>";
  for (const bool ahead : {true, false}) {
    const std::string house = citygml_member(gml_building("house")), other = citygml_member(borrower);
    const MapData data = read(citygml(ahead ? other + house : house + other));
    ASSERT_EQ(data.features.size(), 2U);
    const MapFeature& b = data.features[0];
    ASSERT_EQ(b.surfaces.size(), 2U);
    EXPECT_EQ(b.surfaces[0].outer, data.features[1].surfaces[1].outer);
    std::vector<Eigen::Vector3d> rotated = data.features[1].surfaces[2].outer;
    std::reverse(rotated.begin(), rotated.end());
    EXPECT_EQ(b.surfaces[1].outer, rotated);
    EXPECT_THAT(data.notes.lines(), Contains(HasSubstr("left out 1 references")));
  }
}

TEST_F(CityGmlTest, PartsInstallationsAndWhatTheyReplace) {
  const std::string part = "<bldg:consistsOfBuildingPart><bldg:BuildingPart gml:id=\"p\">" +
                           surfaces_of("lod2MultiSurface", gml_member(gml_polygon({gml_house()[1]}))) +
                           "</bldg:BuildingPart></bldg:consistsOfBuildingPart>";
  const std::string chimney = "<bldg:outerBuildingInstallation><bldg:BuildingInstallation gml:id=\"i\">" +
                              surfaces_of("lod2Geometry", gml_member(gml_polygon({gml_house()[5]}))) +
                              "</bldg:BuildingInstallation></bldg:outerBuildingInstallation>";
  const std::string block = surfaces_of("lod1MultiSurface", gml_member(gml_polygon({gml_house()[0]})));
  const MapData data = read_object(
      "<bldg:Building gml:id=\"a\"><bldg:function>31001_2020</bldg:function>"
      "<bldg:yearOfConstruction>1999</bldg:yearOfConstruction>" +
      block + chimney + part + "</bldg:Building>");
  ASSERT_EQ(data.features.size(), 2U);  // the block of LoD 1 duplicates the part
  EXPECT_EQ(data.features[0].id, "i");
  EXPECT_EQ(data.features[0].kind, FeatureKind::Structure);
  EXPECT_EQ(data.features[1].kind, FeatureKind::Part);
  EXPECT_EQ(data.features[1].belongs_to, "a");
  EXPECT_EQ(data.features[1].tags.at("building"), "office");
  EXPECT_EQ(data.features[1].tags.at("start_date"), "1999");
  EXPECT_THAT(data.notes.lines(), Contains(HasSubstr("replaced by its parts")));
}

TEST_F(CityGmlTest, SolidOfAWholeThatRefersToItsPartsIsBuiltOnce) {
  const std::string part =
      "<bldg:consistsOfBuildingPart><bldg:BuildingPart gml:id=\"p\">" +
      surfaces_of("lod2MultiSurface", gml_member(gml_polygon({gml_house()[1]}, "wall"))) +
      "</bldg:BuildingPart></bldg:consistsOfBuildingPart>";
  const MapData data =
      read_object("<bldg:Building gml:id=\"a\">" +
                  surfaces_of("lod2MultiSurface", "<gml:surfaceMember xlink:href=\"#wall\"/>") + part +
                  "</bldg:Building>");
  ASSERT_EQ(data.features.size(), 1U);
  EXPECT_EQ(data.features[0].id, "p");
}

TEST_F(CityGmlTest, WindowsOfWallsAndHolesAndTriangles) {
  const std::string wall =
      "<bldg:boundedBy><bldg:WallSurface>" +
      surfaces_of("lod3MultiSurface", gml_member(gml_polygon({gml_house()[1]}))) +
      "<bldg:opening><bldg:Window>" +
      surfaces_of("lod3MultiSurface",
                  gml_member(gml_polygon({"691002 5334000 502 691004 5334000 502 691004 5334000 "
                                          "503 691002 5334000 503 691002 5334000 502"}))) +
      "</bldg:Window></bldg:opening></bldg:WallSurface></bldg:boundedBy>";
  const std::string roof =
      "<bldg:lod3MultiSurface><gml:MultiSurface>" +
      gml_member(gml_polygon(
          {gml_house()[0], "691002 5334002 500 691004 5334002 500 691004 5334004 500 691002 5334002 500"})) +
      gml_member(
          "<gml:TriangulatedSurface><gml:trianglePatches><gml:Triangle><gml:exterior><gml:LinearRing>"
          "<gml:pos>691000 5334000 510</gml:pos><gml:pos>691010 5334000 510</gml:pos>"
          "<gml:pos>691000 5334008 510</gml:pos><gml:pos>691000 5334000 510</gml:pos></gml:LinearRing>"
          "</gml:exterior></gml:Triangle></gml:trianglePatches></gml:TriangulatedSurface>") +
      "</gml:MultiSurface></bldg:lod3MultiSurface>";
  std::string inside = wall;
  for (std::size_t at = 0; (at = inside.find("WallSurface", at)) != std::string::npos; at += 19)
    inside.replace(at, 11, "InteriorWallSurface");
  for (std::size_t at = 0; (at = inside.find("5334000", at)) != std::string::npos;)
    inside.replace(at, 7, "5334001");
  const MapData thematic = read_object("<bldg:Building gml:id=\"a\">" + wall + inside + "</bldg:Building>");
  ASSERT_EQ(thematic.features.at(0).surfaces.size(), 2U);
  EXPECT_EQ(thematic.features[0].surfaces[0].semantic, "WallSurface");
  EXPECT_EQ(thematic.features[0].surfaces[1].semantic, "Window");
  const MapData own = read_object("<bldg:Building gml:id=\"a\">" + roof + "</bldg:Building>");
  ASSERT_EQ(own.features.at(0).surfaces.size(), 2U);
  EXPECT_EQ(own.features[0].surfaces[0].inners.at(0).size(), 3U);
  EXPECT_EQ(own.features[0].surfaces[1].outer.size(), 3U);
}

// The halves of a square have the same box; the same half from another start corner is the same.
TEST_F(CityGmlTest, PolygonsThatAreThereTwiceAreTakenOnceAndHalvesAreNot) {
  const auto polygon = [](const char* ring) { return gml_member(gml_polygon({ring})); };
  const MapData data = read_object(
      "<bldg:Building gml:id=\"a\">" +
      surfaces_of("lod2MultiSurface",
                  polygon("691000 5334000 5 691010 5334000 5 691010 5334010 5 691000 5334000 5") +
                      polygon("691000 5334000 5 691010 5334010 5 691000 5334010 5 691000 5334000 5") +
                      polygon("691010 5334000 5 691000 5334000 5 691010 5334010 5 691010 5334000 5")) +
      "</bldg:Building>");
  EXPECT_EQ(data.features.at(0).surfaces.size(), 2U);
}

TEST_F(CityGmlTest, CavitiesOfSolidsAndMultiSolids) {
  const auto shell = [](const char* side, double e) {
    return fmt::format("<gml:{0}><gml:CompositeSurface>{1}</gml:CompositeSurface></gml:{0}>", side,
                       gml_member(gml_polygon({gml_house(e)[0]})));
  };
  const std::string solids =
      "<bldg:lod2Solid><gml:CompositeSolid><gml:solidMember><gml:Solid>" + shell("exterior", 691000) +
      shell("interior", 691001) + "</gml:Solid></gml:solidMember><gml:solidMember><gml:Solid>" +
      shell("exterior", 691020) + "</gml:Solid></gml:solidMember></gml:CompositeSolid></bldg:lod2Solid>";
  EXPECT_EQ(read_object("<bldg:Building gml:id=\"a\">" + solids + "</bldg:Building>")
                .features.at(0)
                .surfaces.size(),
            2U);
}

// A bench whose shape is in the object's file once: rotated by 90 deg and moved.
TEST_F(CityGmlTest, ImplicitGeometry) {
  const auto bench = [](const char* id, const char* shape, const char* position) {
    return citygml_member(fmt::format(
        "<frn:CityFurniture gml:id=\"{}\"><frn:lod2ImplicitRepresentation><core:ImplicitGeometry>"
        "<core:transformationMatrix>0 -1 0 0  1 0 0 0  0 0 1 0  0 0 0 1</core:transformationMatrix>"
        "<core:relativeGMLGeometry{}<core:referencePoint><gml:Point "
        "srsName=\"EPSG:25832\"><gml:pos>{}</gml:pos></gml:Point>"
        "</core:referencePoint></core:ImplicitGeometry></frn:lod2ImplicitRepresentation></frn:CityFurniture>",
        id, shape, position));
  };
  const std::string shape = "><gml:MultiSurface gml:id=\"shape\">" +
                            gml_member(gml_polygon({"0 0 0 2 0 0 2 1 1 0 0 0"})) +
                            "</gml:MultiSurface></core:relativeGMLGeometry>";
  const MapData data = read(citygml(bench("a", " xlink:href=\"#shape\"/>", "691050 5334000 500") +
                                    bench("b", shape.c_str(), "691000 5334000 500")));
  ASSERT_EQ(data.features.size(), 2U);
  EXPECT_EQ(data.features[0].kind, FeatureKind::Structure);
  ASSERT_EQ(data.features[1].surfaces.at(0).outer.size(), 3U);
  // (2, 1, 1) rotated is (-1, 2, 1).
  // echo "690999 5334002" | gdaltransform -s_srs EPSG:25832 -t_srs EPSG:4326
  EXPECT_NEAR(data.features[1].surfaces[0].outer[2].x(), 11.5670403446, 1e-8);
  EXPECT_NEAR(data.features[1].surfaces[0].outer[2].y(), 48.1305886932, 1e-8);
  EXPECT_NEAR(data.features[1].surfaces[0].outer[2].z(), 501, 1e-6);
  EXPECT_GT(data.features[0].surfaces.at(0).outer[2].x(), data.features[1].surfaces[0].outer[2].x());
}

TEST_F(CityGmlTest, VegetationAndRelief) {
  const std::string tree =
      "<veg:SolitaryVegetationObject gml:id=\"t\"><veg:height uom=\"m\">14</veg:height>"
      "<veg:crownDiameter "
      "uom=\"m\">6</veg:crownDiameter><veg:lod1ImplicitRepresentation><core:ImplicitGeometry>"
      "<core:referencePoint><gml:Point><gml:pos>691000 5334000 "
      "503</gml:pos></gml:Point></core:referencePoint>"
      "</core:ImplicitGeometry></veg:lod1ImplicitRepresentation></veg:SolitaryVegetationObject>";
  const std::string wood =
      "<veg:PlantCover gml:id=\"w\"><veg:averageHeight uom=\"m\">11</veg:averageHeight>"
      "<veg:lod1MultiSurface><gml:MultiSurface>" +
      gml_member(gml_polygon({gml_house()[0]})) +
      "</gml:MultiSurface></veg:lod1MultiSurface></veg:PlantCover>";
  std::string low = wood;
  low.replace(low.find(">11<"), 4, ">0.5<");
  const std::string relief =
      "<dem:ReliefFeature gml:id=\"r\"><dem:lod>2</dem:lod><dem:reliefComponent><dem:TINRelief "
      "gml:id=\"tin\">"
      "<dem:lod>2</"
      "dem:lod><dem:tin><gml:TriangulatedSurface><gml:trianglePatches><gml:Triangle><gml:exterior>"
      "<gml:LinearRing><gml:posList>691000 5334000 500 691100 5334000 500 691000 5334100 501 691000 5334000 "
      "500"
      "</gml:posList></gml:LinearRing></gml:exterior></gml:Triangle></gml:trianglePatches></"
      "gml:TriangulatedSurface>"
      "</dem:tin></dem:TINRelief></dem:reliefComponent></dem:ReliefFeature>";
  const MapData data = read(citygml(citygml_member(tree) + citygml_member(wood) + citygml_member(relief) +
                                    citygml_member("<tran:Road gml:id=\"x\"/>") + citygml_member(low)));
  EXPECT_THAT(data.notes.lines(), Contains(HasSubstr("left out 1 plants lower than 1 m")));
  ASSERT_EQ(data.features.size(), 2U);
  EXPECT_EQ(data.features[0].kind, FeatureKind::Tree);
  EXPECT_EQ(data.features[0].tags.at("height"), "14");
  EXPECT_EQ(data.features[0].tags.at("diameter_crown"), "6");
  EXPECT_NEAR(*data.features[0].base_m, 503, 1e-6);
  EXPECT_NEAR(data.features[0].line.at(0).x(), 11.567052874164, 1e-9);
  EXPECT_EQ(data.features[1].kind, FeatureKind::Wood);
  EXPECT_EQ(data.features[1].tags.at("height"), "11");
  EXPECT_EQ(data.features[1].polygons.size(), 1U);
  EXPECT_EQ(data.relief.size(), 1U);
  EXPECT_THAT(data.notes.lines(), Contains(HasSubstr("left out 1 city objects of type Road")));
}

// Extensions wrap their attributes (PLATEAU's uro), generic ones have names.
TEST_F(CityGmlTest, AttributesOfExtensionsAndGenericOnes) {
  const MapData data = read_object(gml_building(
      "a", gml_house(),
      "<bldg:usage>401</bldg:usage><bldg:measuredHeight uom=\"m\">-9999</bldg:measuredHeight>"
      "<gen:intAttribute name=\"yearOfConstruction\"><gen:value>1971</gen:value></gen:intAttribute>"
      "<uro:buildingDetailAttribute><uro:BuildingDetailAttribute><uro:buildingStructureType "
      "codeSpace=\"x.xml\">606</uro:buildingStructureType></uro:BuildingDetailAttribute></"
      "uro:buildingDetailAttribute>"));
  const auto& tags = data.features.at(0).tags;
  EXPECT_EQ(tags.at("building"), "office");
  EXPECT_EQ(tags.at("building:structure"), "masonry");
  EXPECT_EQ(tags.at("building:material"), "brick");
  EXPECT_EQ(tags.at("start_date"), "1971");
  EXPECT_EQ(tags.count("height"), 0U);
  EXPECT_THAT(
      data.notes.lines(),
      Contains(HasSubstr("of 1 buildings and parts 1 have a use, 1 a year, 1 a structure, 1 a material")));
}

// 98.4 ft are 98.4 x 0.3048 m = 29.99232 m.
TEST_F(CityGmlTest, UnitsOfAttributes) {
  const auto height = [this](const std::string& uom, const std::string& value) {
    const MapData data = read_object(gml_building(
        "a", gml_house(), "<bldg:measuredHeight uom=\"" + uom + "\">" + value + "</bldg:measuredHeight>"));
    const auto& tags = data.features.at(0).tags;
    EXPECT_EQ(tags.count("height") == 0,
              ::testing::Value(data.notes.lines(), Contains(HasSubstr("left out 1 attributes in units"))));
    return tags.count("height") == 0 ? "" : tags.at("height");
  };
  for (const char* metre : {"m", "#m", "urn:adv:uom:m", "urn:ogc:def:uom:EPSG::9001", " metre ", ""})
    EXPECT_EQ(height(metre, "98.4"), "98.4") << metre;
  for (const char* foot : {"ft", "#ft", "urn:ogc:def:uom:OGC::foot", "urn:ogc:def:uom:EPSG::9002", "[ft_i]"})
    EXPECT_EQ(height(foot, "98.4"), "29.99232") << foot;
  EXPECT_EQ(height("#km", "0.02"), "20");
  EXPECT_EQ(height("cm", "1234"), "12.34");
  EXPECT_EQ(height("storeys", "4"), "");
  const MapData generic = read_object(
      gml_building("a", gml_house(),
                   "<gen:measureAttribute name=\"height\"><gen:value uom=\"#ft\">100</gen:value>"
                   "</gen:measureAttribute><bldg:storeysAboveGround uom=\"x\">3</bldg:storeysAboveGround>"));
  EXPECT_EQ(generic.features.at(0).tags.at("height"), "30.48");
  EXPECT_EQ(generic.features.at(0).tags.at("building:levels"), "3");
  const MapData third = read_object(gml_building(
      "a", gml_house(),
      "<con:height><con:Height><con:value uom=\"ft\">100</con:value></con:Height></con:height>"));
  EXPECT_EQ(third.features.at(0).tags.at("height"), "30.48");
}

TEST_F(CityGmlTest, ObjectsThatAreThereTwiceAreTakenOnce) {
  const std::string house = citygml_member(gml_building("a"));
  const MapData data = read(citygml(house + house));
  EXPECT_EQ(data.features.size(), 1U);
  EXPECT_THAT(data.notes.lines(), Contains(HasSubstr("left out 1 objects that the file has twice")));
  std::string other = citygml_member(gml_building("b", gml_house(691100)));
  other.replace(other.find("Building gml:id=\"b\""), 19, "Building gml:id=\"a\"");
  const MapData both = read(citygml(house + other));
  EXPECT_EQ(both.features.size(), 2U);
  EXPECT_THAT(both.notes.lines(), Contains(HasSubstr("objects at different positions have the same id")));
}

TEST_F(CityGmlTest, Version3) {
  const std::string text =
      "<CityModel xmlns=\"http://www.opengis.net/citygml/3.0\" xmlns:gml=\"http://www.opengis.net/gml/3.2\">"
      "<cityObjectMember><bldg:Building gml:id=\"a\"><con:height><con:Height><con:value "
      "uom=\"m\">17.5</con:value>"
      "</con:Height></con:height><boundary><con:WallSurface><lod3MultiSurface><gml:MultiSurface "
      "srsName=\"EPSG:25832\">" +
      gml_member(gml_polygon({gml_house()[1]})) +
      "</gml:MultiSurface></lod3MultiSurface><con:fillingSurface><con:WindowSurface><lod3MultiSurface>"
      "<gml:MultiSurface srsName=\"EPSG:25832\">" +
      gml_member(gml_polygon({gml_house()[3]})) +
      "</gml:MultiSurface></lod3MultiSurface></con:WindowSurface></con:fillingSurface></con:WallSurface></"
      "boundary>"
      "<bldg:buildingPart><bldg:BuildingPart gml:id=\"b\"><lod3Solid><gml:Solid "
      "srsName=\"EPSG:25832\"><gml:exterior>"
      "<gml:Shell>" +
      gml_member(gml_polygon({gml_house()[2]})) +
      "</gml:Shell></gml:exterior></gml:Solid></lod3Solid></bldg:BuildingPart></bldg:buildingPart></"
      "bldg:Building>"
      "</cityObjectMember></CityModel>";
  const MapData data = read(text);
  ASSERT_EQ(data.features.size(), 2U);
  EXPECT_EQ(data.features[0].tags.at("height"), "17.5");
  EXPECT_EQ(data.features[0].surfaces.at(1).semantic, "Window");
  EXPECT_EQ(data.features[1].kind, FeatureKind::Part);
}

TEST_F(CityGmlTest, OnlyWhatTouchesTheBox) {
  CityReadOptions options;
  options.box = LonLatBox{11.5, 48.1, 11.5675, 48.2};
  const std::string both =
      citygml_member(gml_building("near")) + citygml_member(gml_building("far", gml_house(692000)));
  const MapData data = read(citygml(both, "EPSG:25832", "691000 5334000 500", "692010 5334008 509"), options);
  ASSERT_EQ(data.features.size(), 1U);
  EXPECT_EQ(data.features[0].id, "near");
  EXPECT_THAT(data.notes.lines(), Contains(HasSubstr("1 objects outside left out")));
}

TEST_F(CityGmlTest, OneBadRingCostsOneRing) {
  const std::string good = citygml(citygml_member(gml_building("house")));
  const std::size_t whole = read(good).features.at(0).surfaces.size();
  for (const char* wrong : {"NaN       ", "          ", "69101O.000", "-9999.0 0 "}) {
    std::string text = good;
    text.replace(text.find("691010.000"), 10, wrong);
    const MapData data = read(text);
    ASSERT_EQ(data.features.size(), 1U) << wrong;
    EXPECT_EQ(data.features[0].surfaces.size(), whole - 1) << wrong;
    EXPECT_THAT(data.notes.lines(), Contains(HasSubstr("left out 1 rings whose coordinates are not numbers")))
        << wrong;
  }
}

TEST_F(CityGmlTest, DemolishedBuildingsAreNotBuilt) {
  const std::string gone = "<bldg:yearOfDemolition>2019</bldg:yearOfDemolition>";
  std::string member = citygml_member(gml_building("gone"));
  member.insert(member.find('>', member.find("Building ")) + 1, gone);
  const MapData data = read(citygml(citygml_member(gml_building("house")) + member));
  EXPECT_EQ(data.features.size(), 1U);
  EXPECT_THAT(data.notes.warnings(), Contains(HasSubstr("left out 1 Building objects that are demolished")));
}

TEST_F(CityGmlTest, BadInputIsOneClearError) {
  const std::string good = citygml(citygml_member(gml_building("house")));
  EXPECT_THAT(error_of(good.substr(0, good.size() / 2)), HasSubstr("is cut short"));
  EXPECT_THAT(error_of(good.substr(0, good.size() / 2)), HasSubstr("city.gml:"));
  EXPECT_THAT(error_of(""), HasSubstr("is cut short"));
  EXPECT_THAT(error_of("<?xml version=\"1.0\" encoding=\"Shift_JIS\"?><CityModel/>"),
              HasSubstr("save it as UTF-8"));
  EXPECT_THAT(error_of("<osm/>"), HasSubstr("its first element is osm"));
  EXPECT_THAT(error_of("<!DOCTYPE a [<!ENTITY lol \"lol\">]><CityModel>&lol;</CityModel>"),
              HasSubstr("declares the entity 'lol'"));
  std::string deep;
  for (int i = 0; i < 1000; ++i) deep += "<a>";
  EXPECT_THAT(error_of("<CityModel><cityObjectMember>" + deep), HasSubstr("nested too deep"));
  // Eastings with their zone as prefix.
  std::string zone = good;
  for (std::size_t at = zone.find("691"); at != std::string::npos; at = zone.find("691", at + 6))
    zone.replace(at, 3, "32691");
  EXPECT_THAT(error_of(zone), HasSubstr("EPSG:4647"));
  EXPECT_THAT(error_of(citygml(citygml_member("<tran:Road/>"))),
              HasSubstr("has no building or other object"));
  EXPECT_THAT(error_of(citygml("")), HasSubstr("has no building or other object"));
}

// Surfaces with distant coordinates are dropped and counted; the rest is kept.
TEST_F(CityGmlTest, CoordinatesBeyondTheEarth) {
  std::vector<std::string> rings = gml_house();
  rings[6] = "1e9 1e9 500 1e9 2e9 500 2e9 1e9 500 1e9 1e9 500";
  const MapData data = read_object(gml_building("house", rings));
  EXPECT_EQ(data.features.at(0).surfaces.size(), 6U);
  EXPECT_THAT(data.notes.lines(),
              Contains(HasSubstr("left out 1 rings outside the area of their reference system")));
}

TEST_F(CityGmlTest, EveryTruncationAndManyDamagesAreErrorsOrRead) {
  const std::string good = citygml(citygml_member(gml_building("house")));
  test::read_damaged(good, 97, "0123456789<>/\"=:-e. #nul",
                     [this](const std::string& text) { return read(text); });
}

}  // namespace
}  // namespace canyon::buildings
