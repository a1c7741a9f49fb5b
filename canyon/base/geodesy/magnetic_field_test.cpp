#include "canyon/base/geodesy/magnetic_field.hpp"

#include <gtest/gtest.h>

#include "canyon/base/geodesy/frames.hpp"

namespace canyon::geodesy {
namespace {

// Rows of the test values published by NOAA with the model: years since 2025.0, height [km], latitude,
// longitude [deg], the field to the north, to the east and downwards [nT].
TEST(MagneticField, IsThatOfTheTestValues) {
  constexpr double kRows[][7]{{0, 28, 89, -121, -255.388723, -1482.460628, 56194.288771},
                              {0, 18, 0, 21, 29274.811882, 659.800118, -14316.722540},
                              {0.5, 69, 38, -144, 22510.804524, 5167.636206, 35525.990264},
                              {1, 47, -72, -22, 18280.800055, -2024.105320, -33397.486160},
                              {1.5, 12, -79, 115, -9613.650418, -8785.714482, -58104.306533},
                              {2, 61, 59, -77, 10437.775689, -3087.391846, 54397.713552},
                              {3, 49, 20, 167, 30131.436134, 2689.876669, 15295.611788},
                              {4, 57, 34, -13, 28241.863242, -933.225495, 28997.458189},
                              {4.5, 18, 9, -172, 30520.999126, 4966.941695, 8779.472279}};
  const GpsTime begin = GpsTime::from_week(2347, 259200);
  for (const auto& [years, height_km, latitude_deg, longitude_deg, north, east, down] : kRows) {
    const Geodetic position = Geodetic::from_degrees(latitude_deg, longitude_deg, height_km * 1000);
    const Eigen::Vector3d enu_nt =
        enu_from_ecef_rotation(position) *
        magnetic_field_tesla(ecef_from_geodetic(position), begin + years * 365.25 * 86400) * 1e9;
    EXPECT_NEAR(enu_nt.x(), east, 2e-3) << latitude_deg;
    EXPECT_NEAR(enu_nt.y(), north, 2e-3) << latitude_deg;
    EXPECT_NEAR(enu_nt.z(), -down, 2e-3) << latitude_deg;
  }
}

TEST(MagneticField, IsMadeForFiveYears) {
  EXPECT_FALSE(magnetic_model_is_valid(GpsTime::from_week(2347, 0)));
  EXPECT_TRUE(magnetic_model_is_valid(GpsTime::from_week(2347, 260000)));
  EXPECT_TRUE(magnetic_model_is_valid(GpsTime::from_week(2600, 0)));
  EXPECT_FALSE(magnetic_model_is_valid(GpsTime::from_week(2610, 0)));
}

}  // namespace
}  // namespace canyon::geodesy
