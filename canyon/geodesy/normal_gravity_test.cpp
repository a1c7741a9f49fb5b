#include "canyon/geodesy/normal_gravity.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "canyon/geodesy/frames.hpp"

namespace canyon::geodesy {
namespace {

// NIMA TR8350.2, table 3.4: normal gravity on the ellipsoid at the equator and at the pole.
TEST(NormalGravity, IsThatOfTheStandard) {
  const auto at = [](double latitude_deg, double height_m) {
    return normal_gravity(ecef_from_geodetic(Geodetic::from_degrees(latitude_deg, 30, height_m)));
  };
  EXPECT_NEAR(at(0, 0).norm(), 9.7803253359, 1e-9);
  EXPECT_NEAR(at(90, 0).norm(), 9.8321849378, 1e-9);
  // Somigliana's formula with its constants, equation 4-1.
  const double s = std::pow(std::sin(22.3 * M_PI / 180), 2);
  EXPECT_NEAR(at(22.3, 0).norm(),
              9.7803253359 * (1 + 0.00193185265241 * s) / std::sqrt(1 - 0.00669437999014 * s), 1e-9);
  // Equation 4-3 with the height to the second order.
  const double a = 6378137, f = 1 / 298.257223563, m = 0.00344978650684, h = 1000;
  EXPECT_NEAR(at(22.3, h).norm(),
              at(22.3, 0).norm() * (1 - 2 / a * (1 + f + m - 2 * f * s) * h + 3 / (a * a) * h * h), 1e-7);
  // Downwards along the ellipsoid's normal on the ellipsoid.
  const Geodetic place = Geodetic::from_degrees(22.3, 30, 0);
  const Eigen::Vector3d enu = enu_from_ecef_rotation(place) * at(22.3, 0);
  EXPECT_NEAR(enu.x(), 0, 1e-12);
  EXPECT_NEAR(enu.y(), 0, 1e-9);
  EXPECT_LT(enu.z(), 0);
}

}  // namespace
}  // namespace canyon::geodesy
