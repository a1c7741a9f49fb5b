#include "canyon/base/geodesy/magnetic_field.hpp"

#include <GeographicLib/SphericalHarmonic1.hpp>
#include <vector>

namespace canyon::geodesy {
namespace {

// The World Magnetic Model 2025 (NOAA NCEI and British Geological Survey, in the public domain): Gauss
// coefficients of 2025.0 [nT] and their rates [nT/year], Schmidt semi-normalised, in GeographicLib's order:
// by m, then by n.
constexpr int kDegree = 12;
constexpr double kReferenceRadius_m = 6371200;
using Coefficients = std::vector<double>;

const GeographicLib::SphericalHarmonic1& potential() {
  static const Coefficients c{
      0,       -29351.8, -2556.6, 1361,  895,   -233.2, 64.4,  79.5,  23.2, 4.6,   -1.3,  2.9,    -2,
      -1410.8, 2951.1,   -2404.1, 799.5, 368.9, 63.8,   -77,   10.8,  7.8,  -6.4,  -1.5,  -0.2,   1649.3,
      1243.8,  55.7,     187.2,   76.9,  -8.8,  -17.5,  3,     0.2,   -2.5, 0.3,   453.6, -281.1, -138.7,
      -115.7,  59.3,     2,       -0.2,  2,     2.4,    1.2,   12.1,  -142, -40.9, 15.8,  -21.7,  -2.5,
      -1,      -0.6,     -1.3,    20.9,  14.9,  2.5,    16.9,  -13.1, -0.6, -0.1,  0.6,   -60.7,  -11.1,
      15,      2.4,      -0.9,    -0.6,  0.6,   14.2,   -16.8, 8.6,   1.5,  -0.1,  0.5,   0.9,    -8.7,
      0.9,     1.1,      -0.1,    -12.9, -2.7,  -1,     -0.4,  -3.9,  -0.2, -0.2,  2.6,   -1.3,   -0.7};
  static const Coefficients s{
      4545.4, -3133.6, -56.6, 278.6, 45.4,  -18.4, -48.9, 7.1,    -24.8, 3.3,   0,      -1.3, -815.1,
      237.5,  -133.9,  220.2, 16.8,  -14.4, -12.6, 12.2,  0,      2.9,   0.7,   -549.5, 212,  -122.9,
      48.8,   -1,      11.4,  8.3,   2.4,   -0.6,  1,     -375.6, 43,    -59.8, 23.4,   -9.7, -3.3,
      5.3,    0.2,     -1.4,  106.1, 10.9,  -7.4,  12.7,  -5.2,   -9.1,  0.5,   0,      72.7, -25.1,
      0.7,    7.2,     0.4,   -0.3,  0.6,   -2.3,  -5.2,  -0.6,   -4.2,  -1.2,  -0.1,   3.9,  0.8,
      -3.8,   -1.7,    0.8,   10,    0.9,   -2.9,  0.1,   -9.1,   -1.8,  -1,    -2.3,   0.1,  0.2};
  static const Coefficients c_rate{
      0,    12,   -11.6, -1.3, -1.6,  0.6,  -0.2, 0,    -0.1, 0,    0.1, 0,   0,    9.7,  -5.2, -4.2,
      -2.4, 1.4,  -0.4,  -0.1, 0.2,   -0.1, 0,    0,    0,    -8,   0.4, -6,  0,    0.9,  -0.1, 0,
      0.1,  0.1,  0,     0,    -15.6, 5.6,  0.6,  1.2,  0.5,  0.5,  0.3, 0.1, 0,    0,    -7,   2.2,
      -0.9, -0.1, -0.1,  -0.3, 0,     0,    0,    0.9,  0.3,  -0.8, 0.3, 0,   -0.3, -0.1, 0,    0.9,
      -0.8, 0.2,  0.3,   0,    0,     0.1,  0.8,  0,    -0.1, -0.1, 0,   0,   0.2,  0.1,  -0.1, -0.1,
      0,    -0.1, 0,     -0.1, 0,     0,    -0.1, -0.1, -0.1, 0,    -0.1};
  static const Coefficients s_rate{
      -21.5, -27.7, 4,   -1.1, -0.5, 0.3,  0.6, -0.2, -0.3, 0,    0,    0,    -12.1, -0.3, 4.1,  2.2,
      -1.6,  0.5,   0.5, 0.3,  0,    0.1,  0,   -4.1, 1.6,  0.4,  -0.4, -0.8, -0.4,  -0.3, -0.2, 0,
      -0.1,  -4.4,  1.7, 0.9,  0,    0.4,  0.3, 0.1,  0.1,  0.1,  1.9,  0.7,  -1,    -0.5, 0.2,  -0.1,
      0,     0,     0.9, 0.6,  -0.6, -0.1, 0.1, 0,    0,    -0.2, 0.3,  -0.2, 0,     0.1,  0,    0.2,
      0.4,   -0.1,  0,   0,    0.1,  0.2,  0,   0,    0,    0,    0,    0,    0,     -0.1};
  static const GeographicLib::SphericalHarmonic1 harmonics(
      c, s, kDegree, c_rate, s_rate, kDegree, kReferenceRadius_m, GeographicLib::SphericalHarmonic1::SCHMIDT);
  return harmonics;
}

// 2025-01-01.
const GpsTime kEpoch = GpsTime::from_week(2347, 259200);
constexpr double kYear_s = 365.25 * 86400;

}  // namespace

Eigen::Vector3d magnetic_field_tesla(const Eigen::Vector3d& ecef_m, GpsTime t) {
  Eigen::Vector3d gradient;
  (void)potential()((t - kEpoch) / kYear_s, ecef_m.x(), ecef_m.y(), ecef_m.z(), gradient.x(), gradient.y(),
                    gradient.z());
  constexpr double kNano = 1e-9;
  return -kNano * kReferenceRadius_m * gradient;
}

bool magnetic_model_is_valid(GpsTime t) {
  constexpr double kYears = 5;
  return t >= kEpoch && t - kEpoch <= kYears * kYear_s;
}

}  // namespace canyon::geodesy
