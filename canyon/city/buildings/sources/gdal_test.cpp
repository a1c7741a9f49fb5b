#include "canyon/city/buildings/sources/gdal.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "canyon/base/input_error.hpp"

namespace canyon::buildings {
namespace {

// This program also links GDAL, for the rasters made in its tests.
TEST(Gdal, IsTheLibraryOfTheHeaders) {
  EXPECT_STREQ(::GDALVersionInfo("RELEASE_NAME"), GDAL_RELEASE_NAME);
  EXPECT_EQ(gdal_function("GDALVersionInfo"), reinterpret_cast<void*>(&::GDALVersionInfo));
}

TEST(Gdal, SaysWhichFunctionIsMissing) {
  try {
    (void)gdal_function("canyon_absent");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("has no function canyon_absent"));
  }
}

}  // namespace
}  // namespace canyon::buildings
