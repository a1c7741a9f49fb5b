#include "canyon/receiver/rtk/rtk_filter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/receiver/positioning/pseudorange_model.hpp"
#include "tests/support/circular_sky.hpp"

namespace canyon::rtk {
namespace {

using geodesy::GpsTime;
using geodesy::kSpeedOfLight;
using gnss::System;
using positioning::Fix;

constexpr GpsTime kTime = test::CircularSky::kEpoch + std::chrono::hours(5);
const geodesy::Geodetic kRoverPosition = geodesy::Geodetic::from_degrees(22.3, 114.18, 30);
const geodesy::Geodetic kBasePosition = geodesy::Geodetic::from_degrees(22.304, 114.18, 30);

const test::CircularSky& sky() {
  static const test::CircularSky circular({System::GPS, System::Galileo, System::BeiDou});
  return circular;
}

/// Measurements at L1 without errors, of an antenna at rest.
std::vector<SignalMeasurement> measure(const geodesy::Geodetic& position, GpsTime time) {
  const Eigen::Vector3d antenna = geodesy::ecef_from_geodetic(position);
  const auto metres = [&](gnss::SatelliteId id, GpsTime at) {
    const auto line = orbit::line_of_sight(sky(), id, at, antenna);
    return line->range_m - kSpeedOfLight * line->state.clock_bias_s;
  };
  std::vector<SignalMeasurement> result;
  for (const gnss::SatelliteId id : sky().satellites()) {
    const auto line = orbit::line_of_sight(sky(), id, time, antenna);
    if (!line || line->elevation_rad < geodesy::radians(10)) continue;
    SignalMeasurement seen{&gnss::signals_of(id.system).front(), {}};
    positioning::Measurement& m = seen.measurement;
    m.id = id;
    m.carrier_frequency_hz = line->state.carrier_frequency_hz;
    m.pseudorange_m = metres(id, time) + kSpeedOfLight * line->state.group_delay_s;
    const double wavelength_m = kSpeedOfLight / m.carrier_frequency_hz;
    m.carrier_phase_cycles = metres(id, time) / wavelength_m;
    m.phase_since = kTime;
    m.doppler_hz = (metres(id, time - 0.5) - metres(id, time + 0.5)) / wavelength_m;
    m.cn0_dbhz = 45;
    result.push_back(seen);
  }
  return result;
}

/// A filter with its base, an epoch a second.
class Rtk {
 public:
  Rtk() {
    fix_.correct_troposphere = false;
    filter_ = RtkFilter({}, fix_, 60);
  }
  /// @param spoil changes the rover's measurements @param change changes its fix without phases
  std::optional<Fix> next(
      const std::function<void(std::vector<SignalMeasurement>&)>& spoil,
      const std::function<void(Fix&)>& change = [](Fix&) {}) {
    const GpsTime time = kTime + static_cast<double>(++epoch_);
    Corrections base;
    base.station_ecef = geodesy::ecef_from_geodetic(kBasePosition);
    base.receiver_time = time;
    base.observations = measure(kBasePosition, time);
    filter_.take(base, sky());
    std::vector<SignalMeasurement> rover = measure(kRoverPosition, time);
    spoil(rover);
    std::vector<positioning::Measurement> codes;
    for (const SignalMeasurement& m : rover) codes.push_back(m.measurement);
    Fix alone = solve_fix(time, codes, sky(), fix_);
    change(alone);
    return filter_.update(time, rover, sky(), alone);
  }

 private:
  positioning::FixOptions fix_;
  RtkFilter filter_{{}, {}, 60};
  int epoch_ = 0;
};

double error_m(const Fix& fix) {
  return (fix.position_ecef - geodesy::ecef_from_geodetic(kRoverPosition)).norm();
}

// A position filter's fix whose accuracy exceeds its limit has no position; the epoch's velocity is known.
TEST(RtkFilter, TakesTheVelocityOfAFixWithoutAPlace) {
  Rtk rtk;
  const auto nothing = [](auto&) {};
  for (int epoch = 0; epoch < 5; ++epoch) (void)rtk.next(nothing);
  for (int epoch = 0; epoch < 5; ++epoch) {
    const auto fix = rtk.next(nothing, [](Fix& alone) {
      Fix none;
      none.status = positioning::FixStatus::WeakGeometry;
      none.velocity_enu_mps = alone.velocity_enu_mps;
      none.velocity_covariance_enu = alone.velocity_covariance_enu;
      alone = none;
    });
    ASSERT_TRUE(fix);
    EXPECT_TRUE(positioning::is_sound(*fix));
    EXPECT_LT(error_m(*fix), 0.01);
    EXPECT_LT(fix->velocity_enu_mps.value().norm(), 0.05);
  }
}

// It restarts after a value that is not a number, and is right again.
TEST(RtkFilter, StatesNoFixThatIsNotFinite) {
  Rtk rtk;
  const auto nothing = [](auto&) {};
  for (int epoch = 0; epoch < 5; ++epoch) (void)rtk.next(nothing);
  const auto fix = rtk.next(nothing, [](Fix& alone) { alone.velocity_enu_mps->x() = NAN; });
  EXPECT_FALSE(fix);
  for (int epoch = 0; epoch < 5; ++epoch) {
    const auto again = rtk.next(nothing);
    ASSERT_TRUE(again);
    EXPECT_TRUE(positioning::is_sound(*again));
    EXPECT_LT(error_m(*again), 1);
  }
}

// Before, a velocity of 8 m/s and more went into the filter at each epoch.
TEST(RtkFilter, StaysWhereOneDopplerIsWrong) {
  for (const double hz : {50.0, 1000.0}) {
    Rtk rtk;
    for (int epoch = 0; epoch < 20; ++epoch) {
      gnss::SatelliteId wrong;
      const auto fix = rtk.next([&](std::vector<SignalMeasurement>& rover) {
        *rover[3].measurement.doppler_hz += hz;
        wrong = rover[3].measurement.id;
      });
      ASSERT_TRUE(fix);
      EXPECT_LT(error_m(*fix), 1) << hz << ' ' << epoch;
      EXPECT_LT(fix->velocity_enu_mps.value().norm(), 0.05);
      EXPECT_EQ(fix->excluded, std::vector{wrong});
    }
  }
}

}  // namespace
}  // namespace canyon::rtk
