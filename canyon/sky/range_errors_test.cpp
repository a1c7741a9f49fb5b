#include "canyon/sky/range_errors.hpp"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::sky {
namespace {

using geodesy::GpsTime;

const GpsTime kNoon = GpsTime::from_week(2051, 6 * 3600.0);
// Header of a Hong Kong navigation file of 2019-04-28 (GPSA, GPSB).
const std::map<gnss::System, gnss::Klobuchar> kKlobuchar{
    {gnss::System::GPS,
     {{9.3132e-9, 1.4901e-8, -5.9605e-8, -1.1921e-7}, {8.8064e4, 4.9152e4, -1.3107e5, -3.2768e5}}}};
const geodesy::LocalFrame kFrame(geodesy::Geodetic::from_degrees(22.298251, 114.178761, 20));

/// A satellite 20,000 km away.
orbit::LineOfSight line_of(gnss::SatelliteId id, const Eigen::Vector3d& receiver, double azimuth_deg,
                           double elevation_deg) {
  orbit::LineOfSight line;
  line.id = id;
  line.azimuth_rad = geodesy::radians(azimuth_deg);
  line.elevation_rad = geodesy::radians(elevation_deg);
  const double level = std::cos(line.elevation_rad);
  const Eigen::Vector3d enu(level * std::sin(line.azimuth_rad), level * std::cos(line.azimuth_rad),
                            std::sin(line.elevation_rad));
  line.direction_ecef = kFrame.ecef_from_local_rotation() * enu;
  line.range_m = 2e7;
  line.position_at_reception_m = receiver + line.range_m * line.direction_ecef;
  line.velocity_at_reception_mps =
      line.position_at_reception_m.cross(Eigen::Vector3d::UnitX()).normalized() * 3e3;
  return line;
}

RangeErrors delays_of(const RangeErrorModel& errors, const orbit::LineOfSight& line, GpsTime time,
                      const Eigen::Vector3d& point) {
  return errors.at(line, errors.reception(time, point));
}

double root_mean_square(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

TEST(RandomWaves, HaveTheirVarianceAndCorrelation) {
  double mean = 0, square = 0, later = 0, neighbour = 0, far = 0;
  const int n = 4000;
  for (int seed = 1; seed <= n; ++seed) {
    const RandomWaves waves(RandomStream(static_cast<std::uint64_t>(seed), "w"), 100, 1e3);
    const Eigen::Vector3d point(3e6, -2e6, 5e6);
    const double value = waves.at(kNoon, point);
    mean += value / n;
    square += value * value / n;
    later += value * waves.at(kNoon + 100.0, point) / n;
    neighbour += value * waves.at(kNoon, point + Eigen::Vector3d(0, 500, 0)) / n;
    far += value * waves.at(kNoon + 500.0, point) / n;
  }
  EXPECT_NEAR(mean, 0, 0.05);
  EXPECT_NEAR(square, 1, 0.07);
  EXPECT_NEAR(later, std::exp(-0.5), 0.07);
  EXPECT_NEAR(neighbour, std::exp(-0.125), 0.07);
  EXPECT_NEAR(far, 0, 0.05);
}

TEST(RandomWaves, AreTheSumOfTheirCosines) {
  const Eigen::Vector3d point(3e6, -2e6, 5e6);
  RandomStream stream(3, "w");
  double sum = 0;
  for (int k = 0; k < 24; ++k) {
    const double radps = stream.normal() / 3600;
    Eigen::Vector3d radpm;
    for (int axis = 0; axis < 3; ++axis) radpm[axis] = stream.normal() / 1e6;
    const double phase_rad = 2 * geodesy::kPi * stream.uniform();
    sum += std::cos(radps * (kNoon - GpsTime()) + radpm.dot(point) + phase_rad);
  }
  const RandomWaves waves(RandomStream(3, "w"), 3600, 1e6);
  EXPECT_NEAR(waves.at(kNoon, point), sum * std::sqrt(2.0 / 24), 1e-9);
}

// The published signal-in-space range errors are reproduced, system by system.
TEST(RangeErrorModel, OrbitsAndClocksHaveTheDeviationOfTheirSystem) {
  const Eigen::Vector3d point = kFrame.ecef_from_local({0, 0, 0});
  for (const auto& [id, sigma_m] :
       std::vector<std::pair<gnss::SatelliteId, double>>{{{gnss::System::GPS, 5}, 0.6},
                                                         {{gnss::System::Galileo, 5}, 0.2},
                                                         {{gnss::System::GLONASS, 5}, 2}}) {
    std::vector<double> values;
    for (std::uint64_t seed = 1; seed <= 1000; ++seed) {
      const RangeErrorModel errors({}, seed, std::vector{id}, {});
      values.push_back(delays_of(errors, line_of(id, point, 40, 50), kNoon, point).orbit_clock_m);
    }
    EXPECT_NEAR(root_mean_square(values) / sigma_m, 1, 0.2) << gnss::to_string(id);
  }
}

TEST(RangeErrorModel, AreTheSameForAllWhoAsk) {
  const gnss::SatelliteId id{gnss::System::GPS, 7};
  const RangeErrorModel a({}, 3, std::vector{id}, kKlobuchar);
  const RangeErrorModel b({}, 3, std::vector{gnss::SatelliteId{gnss::System::GPS, 2}, id}, kKlobuchar);
  const Eigen::Vector3d point = kFrame.ecef_from_local({0, 0, 0});
  const orbit::LineOfSight line = line_of(id, point, 120, 30);
  (void)delays_of(b, line, kNoon + 500.0, point);
  const RangeErrors first = delays_of(a, line, kNoon, point), second = delays_of(b, line, kNoon, point);
  EXPECT_EQ(first.orbit_clock_m, second.orbit_clock_m);
  EXPECT_EQ(first.ionosphere_m, second.ionosphere_m);
  EXPECT_EQ(first.troposphere_m, second.troposphere_m);
  EXPECT_NE(first.ionosphere_m,
            delays_of(RangeErrorModel({}, 4, std::vector{id}, kKlobuchar), line, kNoon, point).ionosphere_m);
}

// The errors of a base and a rover nearly cancel over 1 km, and do not over 50 km.
TEST(RangeErrorModel, CancelOverShortBaselines) {
  const gnss::SatelliteId id{gnss::System::GPS, 7};
  std::map<double, std::array<std::vector<double>, 3>> left;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    const RangeErrorModel errors({}, seed, std::vector{id}, kKlobuchar);
    const auto neighbour_model = [&](const Eigen::Vector3d& point) {
      const orbit::LineOfSight line = line_of(id, point, 120, 40);
      const geodesy::Geodetic at = geodesy::geodetic_from_ecef(point);
      RangeErrors delays = delays_of(errors, line, kNoon, point);
      delays.ionosphere_m -= klobuchar_delay_m(kKlobuchar.begin()->second, kNoon, at, line.azimuth_rad,
                                               line.elevation_rad, gnss::kL1_hz);
      delays.troposphere_m -= saastamoinen_delay_m(at, line.elevation_rad);
      return delays;
    };
    const RangeErrors here = neighbour_model(kFrame.ecef_from_local({0, 0, 0}));
    for (const double distance_m : {0.0, 1e3, 5e4}) {
      const RangeErrors there = neighbour_model(kFrame.ecef_from_local({distance_m, 0, 0}));
      const bool at_all = distance_m == 0;
      left[distance_m][0].push_back(at_all ? here.orbit_clock_m : there.orbit_clock_m - here.orbit_clock_m);
      left[distance_m][1].push_back(at_all ? here.ionosphere_m : there.ionosphere_m - here.ionosphere_m);
      left[distance_m][2].push_back(at_all ? here.troposphere_m : there.troposphere_m - here.troposphere_m);
    }
  }
  EXPECT_GT(root_mean_square(left[0][1]), 1);       // half of the model's delay
  EXPECT_LT(root_mean_square(left[1e3][1]), 0.01);  // mm/km
  EXPECT_GT(root_mean_square(left[5e4][1]), 0.05);
  EXPECT_LT(root_mean_square(left[5e4][1]), 0.5);
  EXPECT_LT(root_mean_square(left[5e4][0]), 0.02);  // 50 km of 20,000
  EXPECT_GT(root_mean_square(left[0][2]), 0.05);
  EXPECT_LT(root_mean_square(left[1e3][2]), 0.001);
}

TEST(RangeErrorModel, HaveNoIonosphereWithoutAModel) {
  const gnss::SatelliteId id{gnss::System::GPS, 7};
  const RangeErrorModel errors({}, 3, std::vector{id}, {});
  const Eigen::Vector3d point = kFrame.ecef_from_local({0, 0, 0});
  EXPECT_FALSE(errors.has_ionosphere());
  EXPECT_EQ(delays_of(errors, line_of(id, point, 120, 40), kNoon, point).ionosphere_m, 0);
  EXPECT_GT(delays_of(errors, line_of(id, point, 120, 40), kNoon, point).troposphere_m, 2);
}

TEST(RangeErrorModel, RefuseWhatIsOutOfRange) {
  RangeErrorOptions options;
  options.ionosphere_fraction = -1;
  EXPECT_THROW(RangeErrorModel(options, 1, {}, {}), InputError);
  options = {};
  options.orbit_clock_m = {{"Navic", 1}};
  EXPECT_THROW(RangeErrorModel(options, 1, {}, {}), InputError);
}

}  // namespace
}  // namespace canyon::sky
