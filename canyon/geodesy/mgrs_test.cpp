#include "canyon/geodesy/mgrs.hpp"

#include <gtest/gtest.h>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"

namespace canyon::geodesy {
namespace {

// 35.65858 N, 139.74543 E is 386,440.29 m east and 3,946,805.90 m north in zone 54; 34.60374 S, 58.38159 W is
// 373,318.48 and 6,170,031.75 m in zone 21 (PROJ: cs2cs EPSG:4326 to EPSG:32654 and EPSG:32721).
TEST(Mgrs, FindsTheCornerOfASquare) {
  const Utm tokyo = utm_of_mgrs_square("54SUE");
  EXPECT_EQ(tokyo.zone, 54);
  EXPECT_TRUE(tokyo.north);
  const Utm tower = utm_from_geodetic(Geodetic::from_degrees(35.65858, 139.74543, 0)).utm;
  EXPECT_NEAR(tower.easting_m - tokyo.easting_m, 86440.29, 0.01);
  EXPECT_NEAR(tower.northing_m - tokyo.northing_m, 46805.90, 0.01);
  EXPECT_EQ(tokyo.easting_m, 300'000);
  EXPECT_EQ(tokyo.northing_m, 3'900'000);

  const Utm south = utm_of_mgrs_square("21hub");
  EXPECT_EQ(south.zone, 21);
  EXPECT_FALSE(south.north);
  EXPECT_EQ(south.easting_m, 300'000);
  EXPECT_EQ(south.northing_m, 6'100'000);
  const Utm obelisk = utm_from_geodetic(Geodetic::from_degrees(-34.60374, -58.38159, 0)).utm;
  EXPECT_NEAR(obelisk.northing_m - south.northing_m, 70031.75, 0.01);
}

TEST(Mgrs, RefusesWhatIsNotASquare) {
  for (const char* text : {"", "54", "54S", "54SU", "54SUE1234", "54SIE", "99SUE", "UAZ", "ZAH", "54 SUE",
                           "x", "54SUE\xC3\xA9"}) {
    EXPECT_THROW((void)utm_of_mgrs_square(text), InputError) << text;
  }
}

}  // namespace
}  // namespace canyon::geodesy
