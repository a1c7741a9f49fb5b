#include "canyon/city/buildings/sources/city_model.hpp"

#include <gtest/gtest.h>

namespace canyon::buildings {
namespace {

// Codes: AdV's list 31001; PLATEAU's code lists of Building_usage and of structure types.
TEST(CityAttributes, UsesOfBuildings) {
  EXPECT_EQ(building_use({{"function", "31001_2020"}}), "office");
  EXPECT_EQ(building_use({{"function", "3041"}}), "church");
  EXPECT_EQ(building_use({{"usage", "411"}}), "house");
  EXPECT_EQ(building_use({{"class", "3001"}, {"usage", "412"}}), "apartments");
  EXPECT_EQ(building_use({{"function", "Hotel"}}), "hotel");
  EXPECT_EQ(building_use({{"function", "31001_9998"}}), "yes");
  EXPECT_EQ(building_use({{"usage", "461"}}), "yes");
  EXPECT_EQ(building_use({{"function", "some sentence of words"}}), "yes");
  EXPECT_EQ(building_use({}), "yes");
}

TEST(CityAttributes, WhatIsGone) {
  EXPECT_TRUE(is_gone({{"yearOfDemolition", "2019"}}));
  EXPECT_TRUE(is_gone({{"terminationDate", "2019-04-28T00:00:00Z"}}));
  EXPECT_TRUE(is_gone({{"status", "Pand gesloopt"}}));
  EXPECT_FALSE(
      is_gone({{"yearOfDemolition", "9999"}, {"terminationDate", ""}, {"status", "Pand in gebruik"}}));
  EXPECT_FALSE(is_gone({}));
  for (const char* date : {"2045", "2099-12-31", "2026-12-31", "31.12.2026", "0001-01-01", "none"})
    EXPECT_FALSE(is_gone({{"dateOfDemolition", date}})) << date;
  for (const char* date : {"2026-06-30", "30.06.2026", "20260630", "2026-12-01"})
    EXPECT_TRUE(is_gone({{"terminationDate", date}})) << date;
}

TEST(CityAttributes, TagsOfAttributes) {
  CityAttributes tags{{"measuredHeight", "12.5"},
                      {"storeysAboveGround", "4"},
                      {"yearOfConstruction", "1968"},
                      {"roofMaterial", "slate"},
                      {"buildingStructureType", "601"}};
  add_tags_of_attributes(tags);
  EXPECT_EQ(tags.at("height"), "12.5");
  EXPECT_EQ(tags.at("building:levels"), "4");
  EXPECT_EQ(tags.at("start_date"), "1968");
  EXPECT_EQ(tags.at("roof:material"), "slate");
  EXPECT_EQ(tags.at("building:structure"), "wood");
  EXPECT_EQ(tags.at("building:material"), "wood");
}

TEST(CityAttributes, ValuesThatStandForNotKnownAreLeftOut) {
  CityAttributes tags{{"measuredHeight", "-9999"},
                      {"storeysAboveGround", "9999"},
                      {"yearOfConstruction", "0001"},
                      {"buildingStructureType", "611"}};
  add_tags_of_attributes(tags);
  for (const char* tag :
       {"height", "building:levels", "start_date", "building:structure", "building:material"})
    EXPECT_EQ(tags.count(tag), 0U) << tag;
  CityAttributes flat{{"storeysAboveGround", "0"}};
  add_tags_of_attributes(flat);
  EXPECT_EQ(flat.at("building:levels"), "0") << "ShapeReader warns of it";
  // A concrete or steel frame has facades of any material.
  CityAttributes framed{{"buildingStructureType", "604"}, {"height", "9"}, {"measuredHeight", "8"}};
  add_tags_of_attributes(framed);
  EXPECT_EQ(framed.at("building:structure"), "steel");
  EXPECT_EQ(framed.count("building:material"), 0U);
  EXPECT_EQ(framed.at("height"), "9");
}

}  // namespace
}  // namespace canyon::buildings
