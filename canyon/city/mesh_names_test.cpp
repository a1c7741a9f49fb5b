#include "canyon/city/mesh_marks.hpp"

#include <gtest/gtest.h>

namespace canyon::city {
namespace {

TEST(HasWord, WholeWordsAndCamelCase) {
  for (const char* name :
       {"terrain", "TERRAIN", "Terrain.001", "city_terrain", "flatTerrain2", "TerrainMesh", "3Terrain"}) {
    EXPECT_TRUE(has_word(name, "terrain")) << name;
  }
  for (const char* name : {"subterrain", "terrains", "terra", "", "house"})
    EXPECT_FALSE(has_word(name, "terrain")) << name;
  EXPECT_FALSE(has_word("Academy", "dem"));
  EXPECT_TRUE(has_word("academy-DEM-10m", "dem"));
  EXPECT_FALSE(has_word("Underground", "ground"));
  EXPECT_FALSE(has_word("anything", ""));
}

TEST(MaterialFromName, WordsOfTheHongKongMesh) {
  EXPECT_EQ(material_from_name("b2b2a6_concrete_png-material"), Material::Concrete);
  EXPECT_EQ(material_from_name("cc0textures_bricks11_col_exp_jpg"), Material::Brick);
  EXPECT_EQ(material_from_name("_a5c4d_roof_tiles_png"), Material::Brick);
  EXPECT_EQ(material_from_name("duion_plaster_stucco_01_D_exp_png"), Material::Plaster);
  EXPECT_EQ(material_from_name("_e2a31_METAL_png"), Material::Metal);
  EXPECT_EQ(material_from_name("DefaultMaterial"), Material::Unknown);
  EXPECT_EQ(material_from_name(""), Material::Unknown);
}

}  // namespace
}  // namespace canyon::city
