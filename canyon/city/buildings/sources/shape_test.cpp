#include "canyon/city/buildings/sources/shape.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "canyon/base/geodesy/constants.hpp"
#include "tests/support/refusal.hpp"

namespace canyon::buildings {
namespace {

using city::Material;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

using Tags = std::map<std::string, std::string>;

Shape read(const Tags& tags, std::vector<std::string>* warnings = nullptr) {
  std::vector<std::string> own;
  const Shape shape = shape_from_tags(tags, HeightDefaults{}, "way/7", own);
  if (warnings != nullptr) {
    *warnings = own;
  } else {
    EXPECT_THAT(own, IsEmpty());
  }
  return shape;
}

TEST(ParseLength, ReadsTheUnitsOfTheMap) {
  // Foot 0.3048 m and inch 0.0254 m, exact by the international yard (1959).
  const std::vector<std::pair<std::string, double>> cases{{"12", 12},
                                                          {" 12 m ", 12},
                                                          {"12.5m", 12.5},
                                                          {"10,5", 10.5},
                                                          {"0", 0},
                                                          {".5", 0.5},
                                                          {"7.", 7},
                                                          {"+4 metres", 4},
                                                          {"12 mts", 12},
                                                          {"12 \xD0\xBC", 12},
                                                          {"12\xE7\xB1\xB3", 12},
                                                          {"ca 12 m", 12},
                                                          {"circa 12", 12},
                                                          {"-3", -3},
                                                          {"1 km", 1000},
                                                          {"250 cm", 2.5},
                                                          {"40 ft", 12.192},
                                                          {"40'", 12.192},
                                                          {"3'6\"", 1.0668},
                                                          {"3' 6\"", 1.0668},
                                                          {"3 ft 6 in", 1.0668},
                                                          {"3'6", 1.0668},
                                                          {"3'6.5\"", 1.0795},
                                                          {"-3'6\"", -1.0668},
                                                          {"6\"", 0.1524},
                                                          {"3\xE2\x80\xB2 6\xE2\x80\xB3", 1.0668},
                                                          {"540 M", 540},
                                                          {"~30", 30},
                                                          {"ca. 12'6\"", 3.81},
                                                          {"1 mi", 1609.344}};
  for (const auto& [text, metres] : cases) {
    const auto length = parse_length_m(text);
    ASSERT_TRUE(length) << text;
    EXPECT_NEAR(*length, metres, 1e-12) << text;
  }
}

TEST(ParseLength, RefusesWhatIsNoSingleLength) {
  for (const char* text :
       {"",    " ",   "m",    "high",   "12 storeys", "12-15",  "~", "12;15", "1,500", "1.2.3",    "nan",
        "inf", "1e3", "0x10", "3'13\"", "3'-6\"",     "3'6\"7", "'", "--3",   "3 6",   "12 m high"}) {
    EXPECT_FALSE(parse_length_m(text)) << text;
  }
  EXPECT_FALSE(parse_length_m(std::string(1000, '9')));
  EXPECT_FALSE(parse_length_m(std::string("12\0", 3)));
}

TEST(ParseDirection, ReadsDegreesAndWinds) {
  const std::vector<std::pair<std::string, double>> cases{
      {"0", 0},           {"135", 135}, {"360", 0},          {"-90", 270},  {"22,5", 22.5},
      {"90\xC2\xB0", 90}, {"N", 0},     {"nnw", 337.5},      {"SW", 225},   {"WSW", 247.5},
      {" e ", 90},        {"north", 0}, {"South-East", 135}, {"45 deg", 45}};
  for (const auto& [text, degrees] : cases) {
    const auto direction = parse_direction_rad(text);
    ASSERT_TRUE(direction) << text;
    EXPECT_NEAR(*direction, geodesy::radians(degrees), 1e-12) << text;
  }
  for (const char* text : {"", "up", "400", "NSEW", "12 m", "along", "90;270"}) {
    EXPECT_FALSE(parse_direction_rad(text)) << text;
  }
}

TEST(MaterialFromTag, KnowsTheCommonValues) {
  const std::vector<std::pair<std::string, Material>> cases{{"glass", Material::Glass},
                                                            {"mirror", Material::Glass},
                                                            {"reinforced_concrete", Material::Concrete},
                                                            {"cement_block", Material::Concrete},
                                                            {"brick", Material::Brick},
                                                            {"Red_Brick", Material::Brick},
                                                            {"roof_tiles", Material::Brick},
                                                            {"metal", Material::Metal},
                                                            {"steel", Material::Metal},
                                                            {"copper", Material::Metal},
                                                            {"metal_plates", Material::Metal},
                                                            {"sandstone", Material::Stone},
                                                            {"slate", Material::Stone},
                                                            {"timber_framing", Material::Wood},
                                                            {"wood", Material::Wood},
                                                            {"stucco", Material::Plaster},
                                                            {"glass;steel", Material::Glass},
                                                            {"", Material::Unknown},
                                                            {";", Material::Unknown},
                                                            {"thatch", Material::Unknown},
                                                            {"yes", Material::Unknown}};
  for (const auto& [text, material] : cases) EXPECT_EQ(material_from_tag(text), material) << text;
}

TEST(FacadesFromTags, GoByUseAndYear) {
  using city::FacadeMix;
  const auto of = [](const std::map<std::string, std::string>& tags) { return facades_from_tags(tags); };
  EXPECT_EQ(of({}), FacadeMix::ByBuilding);
  EXPECT_EQ(of({{"building", "yes"}}), FacadeMix::ByBuilding);
  EXPECT_EQ(of({{"building", "church"}}), FacadeMix::Traditional);
  EXPECT_EQ(of({{"building:part", "House"}}), FacadeMix::Traditional);
  EXPECT_EQ(of({{"building", "yes"}, {"building:part", "chapel"}}), FacadeMix::Traditional);
  EXPECT_EQ(of({{"building", "apartments"}}), FacadeMix::ByBuilding);
  EXPECT_EQ(of({{"building", "office"}}), FacadeMix::ByBuilding);
  EXPECT_EQ(of({{"building", "office"}, {"start_date", "1979"}}), FacadeMix::Traditional);
  EXPECT_EQ(of({{"building", "office"}, {"start_date", "1987"}}), FacadeMix::ByBuilding);
  EXPECT_EQ(of({{"building", "office"}, {"start_date", "2004-05-01"}}), FacadeMix::ThermallyEfficient);
  EXPECT_EQ(of({{"building", "yes"}, {"start_date", "2004"}}), FacadeMix::ByBuilding);
  EXPECT_EQ(of({{"start_date", "C19"}}), FacadeMix::ByBuilding);
  EXPECT_EQ(of({{"start_date", "5"}}), FacadeMix::ByBuilding);
  EXPECT_EQ(of({{"building", "yes"}, {"building:structure", "wood"}}), FacadeMix::Traditional);
  EXPECT_EQ(of({{"building", "yes"}, {"building:structure", "concrete"}}), FacadeMix::ByBuilding);
}

TEST(Names, AreTheMapsWords) {
  EXPECT_EQ(name(RoofShape::Flat), "flat");
  EXPECT_EQ(name(RoofShape::Mansard), "mansard");
  EXPECT_EQ(name(HeightSource::Tag), "height");
  EXPECT_EQ(name(HeightSource::Levels), "levels");
  EXPECT_EQ(name(HeightSource::Default), "default");
}

TEST(HeightDefaults, ValidateNamesTheField) {
  const auto problem = [](const HeightDefaults& defaults) -> std::string {
    return test::refusal([&] { defaults.validate(); });
  };
  EXPECT_EQ(problem({}), "");
  HeightDefaults level, building, type;
  level.level_m = 0;
  building.building_m = std::numeric_limits<double>::quiet_NaN();
  type.by_type["church"] = 1500;
  EXPECT_THAT(problem(level), HasSubstr("level_height_m is 0; it must be above 0 and at most 20 m"));
  EXPECT_THAT(problem(building),
              HasSubstr("default_height_m is nan; it must be at least 0.1 and at most 1000 m"));
  EXPECT_THAT(problem(type), HasSubstr("heights is church=1500; it must be at least 0.1 and at most 1000 m"));
}

// Simple 3D Buildings: height is the top of the roof.
TEST(ShapeFromTags, HeightIncludesTheRoof) {
  const Shape shape = read({{"building", "yes"},
                            {"height", "20 m"},
                            {"min_height", "4"},
                            {"roof:shape", "gabled"},
                            {"roof:height", "6"},
                            {"roof:direction", "S"},
                            {"roof:orientation", "across"},
                            {"building:material", "brick"},
                            {"roof:material", "copper"}});
  EXPECT_DOUBLE_EQ(shape.height_m, 20);
  EXPECT_DOUBLE_EQ(shape.min_height_m, 4);
  EXPECT_DOUBLE_EQ(shape.roof_height_m, 6);
  EXPECT_EQ(shape.roof, RoofShape::Gabled);
  EXPECT_EQ(shape.height_source, HeightSource::Tag);
  EXPECT_EQ(shape.roof_source, HeightSource::Tag);
  ASSERT_TRUE(shape.roof_direction_rad);
  EXPECT_DOUBLE_EQ(*shape.roof_direction_rad, geodesy::kPi);
  EXPECT_TRUE(shape.roof_across);
  EXPECT_EQ(shape.facade, Material::Brick);
  EXPECT_EQ(shape.roof_material, Material::Metal);
}

TEST(ShapeFromTags, LevelsStandUnderTheRoof) {
  const Shape flat = read({{"building", "yes"}, {"building:levels", "5"}});
  EXPECT_DOUBLE_EQ(flat.height_m, 15);
  EXPECT_EQ(flat.height_source, HeightSource::Levels);
  EXPECT_DOUBLE_EQ(flat.roof_height_m, 0);

  const Shape levels = read({{"building", "yes"},
                             {"building:levels", "4"},
                             {"building:min_level", "1"},
                             {"roof:levels", "2"},
                             {"roof:shape", "mansard"}});
  EXPECT_DOUBLE_EQ(levels.height_m, 18);  // (4 + 2) x 3
  EXPECT_DOUBLE_EQ(levels.roof_height_m, 6);
  EXPECT_DOUBLE_EQ(levels.min_height_m, 3);
  EXPECT_EQ(levels.roof_source, HeightSource::Levels);

  const Shape roof = read({{"building", "house"}, {"building:levels", "2"}, {"roof:shape", "hipped"}});
  EXPECT_DOUBLE_EQ(roof.height_m, 9);  // two storeys and a roof one storey high
  EXPECT_DOUBLE_EQ(roof.roof_height_m, 3);
  EXPECT_EQ(roof.roof_source, HeightSource::Default);

  const Shape hut = read({{"building", "yes"}, {"building:levels", "1"}, {"roof:shape", "gabled"}});
  EXPECT_DOUBLE_EQ(hut.roof_height_m, 1.5);  // at most a third of the whole
  EXPECT_DOUBLE_EQ(hut.height_m, 4.5);

  const Shape tent =
      read({{"building", "yes"}, {"building:levels", "0"}, {"roof:levels", "1"}, {"roof:shape", "gabled"}});
  EXPECT_DOUBLE_EQ(tent.height_m, 3);
  EXPECT_DOUBLE_EQ(tent.roof_height_m, 3);
  const Shape cone =
      read({{"building", "yes"}, {"building:levels", "0"}, {"roof:height", "4"}, {"roof:shape", "cone"}});
  EXPECT_DOUBLE_EQ(cone.height_m, 4);
  EXPECT_EQ(cone.height_source, HeightSource::Levels);
}

TEST(ShapeFromTags, StoreysLeaveTheRoofItsShareOfATaggedHeight) {
  const Shape shape =
      read({{"building", "yes"}, {"height", "13"}, {"building:levels", "3"}, {"roof:shape", "gabled"}});
  EXPECT_DOUBLE_EQ(shape.height_m, 13);
  EXPECT_DOUBLE_EQ(shape.roof_height_m, 4);  // 13 - 3 x 3
  EXPECT_EQ(shape.roof_source, HeightSource::Levels);
}

TEST(ShapeFromTags, MinLevelUsesTheStoreyHeightOfTheTags) {
  const Shape shape = read(
      {{"building:part", "yes"}, {"height", "40"}, {"building:levels", "10"}, {"building:min_level", "2"}});
  EXPECT_DOUBLE_EQ(shape.min_height_m, 8);
}

TEST(ShapeFromTags, DefaultsGoByType) {
  EXPECT_DOUBLE_EQ(read({{"building", "yes"}}).height_m, 9);
  EXPECT_DOUBLE_EQ(read({{"building", "apartments"}}).height_m, 15);
  EXPECT_EQ(read({{"building", "apartments"}}).height_source, HeightSource::Default);
  EXPECT_DOUBLE_EQ(read({{"building:part", "garage"}}).height_m, 3);
  const Shape pyramid = read({{"building", "kiosk"}, {"roof:shape", "pyramidal"}});
  EXPECT_DOUBLE_EQ(pyramid.height_m, 3);
  EXPECT_DOUBLE_EQ(pyramid.roof_height_m, 1);
  EXPECT_EQ(pyramid.facade, Material::Concrete);
}

TEST(ShapeFromTags, OnPillarsLeavesTheSpaceBelowFree) {
  const Shape roof = read({{"building", "roof"}, {"height", "6"}});
  EXPECT_NEAR(roof.min_height_m, 5.7, 1e-12);
  EXPECT_DOUBLE_EQ(read({{"building", "roof"}, {"height", "6"}, {"min_height", "0"}}).min_height_m, 0);
  EXPECT_DOUBLE_EQ(read({{"building", "bridge"}, {"height", "9"}}).min_height_m, 6);
  // A part in the air without a height has one storey.
  const Shape air = read({{"building:part", "yes"}, {"min_height", "30"}});
  EXPECT_DOUBLE_EQ(air.height_m, 33);
  EXPECT_EQ(air.height_source, HeightSource::Default);
}

TEST(ShapeFromTags, RoofShapesFallBackToTheirKin) {
  const auto roof = [](const char* text) {
    std::vector<std::string> ignored;
    return read({{"building", "yes"}, {"height", "12"}, {"roof:shape", text}}, &ignored).roof;
  };
  for (const RoofShape shape :
       {RoofShape::Flat, RoofShape::Gabled, RoofShape::Hipped, RoofShape::Pyramidal, RoofShape::Skillion,
        RoofShape::Dome, RoofShape::Onion, RoofShape::Round, RoofShape::Gambrel, RoofShape::Mansard}) {
    EXPECT_EQ(roof(std::string(name(shape)).c_str()), shape);
  }
  EXPECT_EQ(roof("half-hipped"), RoofShape::Hipped);
  EXPECT_EQ(roof("saltbox"), RoofShape::Gabled);
  EXPECT_EQ(roof("Conical"), RoofShape::Pyramidal);
  std::vector<std::string> warnings;
  EXPECT_EQ(read({{"building", "yes"}, {"roof:shape", "butterfly"}}, &warnings).roof, RoofShape::Flat);
  EXPECT_THAT(warnings, ElementsAre("way/7: roof:shape='butterfly' is unknown; built flat"));
  EXPECT_EQ(read({{"building", "yes"}, {"roof:shape", "gabled"}, {"roof:height", "0"}}).roof,
            RoofShape::Flat);
}

TEST(ShapeFromTags, LeavesAbsurdValuesOutWithAWarning) {
  struct Case {
    Tags tags;
    double height_m, min_height_m, roof_height_m;
    const char* warning;
  };
  const std::vector<Case> cases{
      {{{"building", "yes"}, {"height", "-5"}}, 9, 0, 0, "height='-5' is outside [0.1, 2000] m"},
      {{{"building", "yes"}, {"height", "5000"}}, 9, 0, 0, "height='5000' is outside"},
      {{{"building", "yes"}, {"height", "tall"}}, 9, 0, 0, "height='tall' is not a length"},
      {{{"building", "yes"}, {"height", "0"}}, 9, 0, 0, "height='0' is outside"},
      {{{"building", "yes"}, {"height", "0 m"}}, 9, 0, 0, "height='0 m' is outside"},
      {{{"building", "yes"}, {"building:levels", "0"}}, 9, 0, 0, "zero storeys give no height"},
      {{{"building", "yes"}, {"building:levels", "0"}, {"roof:levels", "0"}}, 9, 0, 0, "zero storeys"},
      {{{"building", "yes"}, {"height", "10"}, {"min_height", "12"}},
       10,
       0,
       0,
       "min_height='12' reaches height='10'"},
      {{{"building", "yes"}, {"height", "10"}, {"building:min_level", "9"}},
       10,
       0,
       0,
       "building:min_level=9 reaches"},
      {{{"building", "yes"}, {"building:levels", "-2"}},
       9,
       0,
       0,
       "building:levels='-2' is not a number of storeys"},
      {{{"building", "yes"}, {"building:levels", "2"}, {"building:min_level", "4"}},
       18,
       12,
       0,
       "read as the storeys above it"},
      {{{"building", "yes"}, {"height", "12"}, {"roof:shape", "dome"}, {"roof:height", "13"}},
       12,
       0,
       3,
       "roof:height='13' is higher than the building's 12 m"},
      {{{"building", "yes"}, {"height", "12"}, {"roof:shape", "dome"}, {"roof:levels", "9"}},
       12,
       0,
       3,
       "roof:levels=9 are higher than the building's 12 m"},
      {{{"building", "yes"}, {"building:levels", "199"}, {"roof:shape", "dome"}, {"roof:height", "1900"}},
       9,
       0,
       3,
       "storeys and roof add up to"},
      {{{"building", "yes"}, {"roof:direction", "down"}},
       9,
       0,
       0,
       "roof:direction='down' is not a direction"},
      {{{"building", "yes"}, {"roof:orientation", "up"}}, 9, 0, 0, "roof:orientation='up' is neither"}};
  for (const Case& expected : cases) {
    std::vector<std::string> warnings;
    const Shape shape = read(expected.tags, &warnings);
    EXPECT_DOUBLE_EQ(shape.height_m, expected.height_m) << expected.warning;
    EXPECT_DOUBLE_EQ(shape.min_height_m, expected.min_height_m) << expected.warning;
    EXPECT_DOUBLE_EQ(shape.roof_height_m, expected.roof_height_m) << expected.warning;
    ASSERT_FALSE(warnings.empty()) << expected.warning;
    EXPECT_THAT(warnings[0], StartsWith("way/7: "));
    EXPECT_THAT(warnings[0], HasSubstr(expected.warning));
  }
}

TEST(ShapeFromTags, StoreysAboveGroundAreStoreys) {
  EXPECT_DOUBLE_EQ(read({{"building", "yes"}, {"building:levels:aboveground", "11"}}).height_m, 33);
  EXPECT_DOUBLE_EQ(
      read({{"building", "yes"}, {"building:levels", "2"}, {"building:levels:aboveground", "11"}}).height_m,
      6);
}

TEST(ShapeFromTags, AFurtherTagHelpsWhereTheFirstIsWrong) {
  std::vector<std::string> warnings;
  const Shape shape = read({{"building", "yes"}, {"height", "?"}, {"est_height", "25"}}, &warnings);
  EXPECT_DOUBLE_EQ(shape.height_m, 25);
  EXPECT_EQ(warnings.size(), 1U);
}

// append_solid() relies on these bounds, for any tags.
TEST(ShapeFromTags, KeepsTheOrderOfHeightsForAnyTags) {
  std::mt19937 random(20240501);
  const std::vector<std::string> keys{"height",      "min_height",    "building:levels", "building:min_level",
                                      "roof:levels", "roof:height",   "roof:shape",      "est_height",
                                      "building",    "building:part", "roof:direction",  "building:material"};
  const std::vector<std::string> values{"0",      "1",       "2.5",   "3",      "9",      "10",     "10,1",
                                        "0.1",    "33.3 ft", "-1",    "1e9",    "2000",   "400",    "roof",
                                        "dome",   "gabled",  "flat",  "yes",    "no",     "bridge", "",
                                        "\n\"<>", "glass",   "onion", "hipped", "1999.99"};
  for (int i = 0; i < 50000; ++i) {
    Tags tags;
    for (const std::string& key : keys) {
      if (random() % 2 == 0) tags[key] = values[random() % values.size()];
    }
    std::vector<std::string> warnings;
    const Shape shape = shape_from_tags(tags, HeightDefaults{}, "way/1", warnings);
    ASSERT_GT(shape.height_m, shape.min_height_m + 0.01);
    ASSERT_GE(shape.min_height_m, 0);
    ASSERT_GE(shape.roof_height_m, 0);
    ASSERT_GE(shape.height_m - shape.roof_height_m, shape.min_height_m);
    ASSERT_LE(shape.height_m, 4000);
    ASSERT_EQ(shape.roof == RoofShape::Flat, shape.roof_height_m == 0);
  }
}

}  // namespace
}  // namespace canyon::buildings
