#include "canyon/analysis/validation/pseudorange_errors.hpp"
#include "canyon/analysis/validation/receiver_clock.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "canyon/analysis/validation/statistics.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/receiver/tracking/noise.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/sky/range_errors.hpp"
#include "tests/support/circular_sky.hpp"
#include "tests/support/simulation_support.hpp"

namespace canyon::validation {
namespace {

using geodesy::GpsTime;
using geodesy::kSpeedOfLight;
using geodesy::radians;
using gnss::SatelliteId;
using gnss::System;
using simulation::test::error_of;
using testing::HasSubstr;
using testing::SizeIs;

const GpsTime kStart = GpsTime::from_week(2051, 46701);
const gnss::Klobuchar kModel{{9.3132e-9, 1.4901e-8, -5.9605e-8, -1.1921e-7}, {88064, 49152, -131070, -32768}};
const std::map<System, gnss::Klobuchar> kKlobuchar{{System::GPS, kModel}};

/// North-east through Hong Kong at 12.5 m/s.
simulation::Trajectory truth(double seconds = 300) {
  std::vector<std::pair<GpsTime, geodesy::Geodetic>> samples;
  for (int s = 0; s <= seconds; ++s) {
    samples.emplace_back(kStart + static_cast<double>(s),
                         geodesy::Geodetic::from_degrees(22.30 + 9e-5 * s, 114.17 + 7e-5 * s, 5 + 0.01 * s));
  }
  return simulation::Trajectory(samples);
}

/// The recording of a receiver on the truth, by the light-time solution of orbit::line_of_sight().
struct Recorder {
  const orbit::Sky& sky;
  simulation::Trajectory path = truth();
  Eigen::Vector3d lever_arm = Eigen::Vector3d::Zero();  ///< forward, left, up
  std::map<System, double> bias_m{};                    ///< inter-system
  std::function<double(SatelliteId, std::size_t)> error_m = [](SatelliteId, std::size_t) { return 0.0; };

  [[nodiscard]] rinex::ObservationEpoch at(GpsTime reception, double clock_s, std::size_t epoch) const {
    const auto pose = path.at(reception);
    const Eigen::Vector3d forward(std::cos(pose.yaw_rad), std::sin(pose.yaw_rad), 0);
    const Eigen::Vector3d left(-forward.y(), forward.x(), 0);
    const Eigen::Vector3d enu =
        lever_arm.x() * forward + lever_arm.y() * left + lever_arm.z() * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d antenna = geodesy::ecef_from_geodetic(pose.position) +
                                    geodesy::enu_from_ecef_rotation(pose.position).transpose() * enu;
    const auto point = geodesy::geodetic_from_ecef(antenna);
    rinex::ObservationEpoch result;
    result.receiver_time = reception + clock_s;
    for (const SatelliteId id : sky.satellites()) {
      const auto line = orbit::line_of_sight(sky, id, reception, antenna);
      if (!line || line->elevation_rad < radians(5)) continue;
      double range = line->range_m;
      range += kSpeedOfLight * (clock_s - (line->state.clock_bias_s - line->state.group_delay_s));
      range += sky::klobuchar_delay_m(kModel, reception, point, line->azimuth_rad, line->elevation_rad,
                                      line->state.carrier_frequency_hz);
      range += sky::saastamoinen_delay_m(point, line->elevation_rad);
      const auto bias = bias_m.find(id.system);
      if (bias != bias_m.end()) range += bias->second;
      rinex::ObservedSignal signal;
      signal.id = id;
      signal.code = {'1', 'C', 0};
      signal.pseudorange_m = range + error_m(id, epoch);
      signal.cn0_dbhz = 45;
      result.signals.push_back(signal);
    }
    return result;
  }
};

const auto kAllClear = [](const PseudorangeResidual&, const ResidualEpoch&) { return true; };

TEST(PseudorangeErrors, ClosedLoopIsExact) {
  const test::CircularSky sky({System::GPS, System::Galileo, System::BeiDou});
  Recorder recorder{sky};
  recorder.lever_arm = {0.5, -0.3, 1.5};
  recorder.bias_m = {{System::Galileo, 7.5}, {System::BeiDou, -31.25}};
  recorder.error_m = [](SatelliteId id, std::size_t e) {
    return id.number % 6 == 0 ? 40.0 + static_cast<double>(e % 7) : 0.0;
  };
  // A clock that drifts and is occasionally set back by a millisecond.
  std::vector<rinex::ObservationEpoch> epochs;
  std::vector<double> clock;
  for (std::size_t e = 0; e < 100; ++e) {
    clock.push_back(0.4e-3 + 3e-5 * static_cast<double>(e) - 1e-3 * static_cast<double>(e / 33));
    epochs.push_back(recorder.at(kStart + 10.0 + 2.0 * static_cast<double>(e), clock.back(), e));
  }
  ResidualOptions options;
  options.lever_arm_m = recorder.lever_arm;
  const auto residuals = pseudorange_residuals(epochs, recorder.path, sky, kKlobuchar, options);
  ASSERT_THAT(residuals.epochs, SizeIs(100));
  const auto errors = remove_receiver_clock(
      residuals, [](const PseudorangeResidual& o, const ResidualEpoch&) { return o.id.number % 6 != 0; });
  double largest = 0, largest_clock = 0;
  for (std::size_t i = 0; i < errors.observations.size(); ++i) {
    const auto& o = residuals.observations[i];
    largest = std::max(largest, std::abs(errors.observations[i].error_m - recorder.error_m(o.id, o.epoch)));
    EXPECT_EQ(errors.observations[i].clear, o.id.number % 6 != 0);
    EXPECT_GE(o.elevation_rad, radians(4.9));
  }
  const double reference = recorder.bias_m[errors.reference];
  for (std::size_t e = 0; e < 100; ++e) {
    largest_clock =
        std::max(largest_clock, std::abs(errors.clocks[e].bias_m - (kSpeedOfLight * clock[e] + reference)));
    EXPECT_LT(std::abs(residuals.epochs[e].reception - (epochs[e].receiver_time - clock[e])), 1e-6);
    EXPECT_EQ(errors.clocks[e].source, ClockSource::Clear);
  }
  std::printf("largest difference: errors %.2g m, clocks %.2g m\n", largest, largest_clock);
  // GpsTime's nanosecond shifts a tag by up to 0.15 m of clock, equally for all satellites: the clock's
  // fraction of it remains.
  EXPECT_LT(largest, 2e-3);
  EXPECT_LT(largest_clock, 0.16);
  for (const auto& [system, bias] : errors.inter_system_bias_m) {
    EXPECT_NEAR(bias, recorder.bias_m[system] - reference, 1e-3) << gnss::name(system);
  }
}

TEST(PseudorangeErrors, SingleClearSatelliteOfAnySystemGivesTheClock) {
  const test::CircularSky sky({System::GPS, System::BeiDou});
  Recorder recorder{sky};
  recorder.bias_m = {{System::BeiDou, 12}};
  std::vector<rinex::ObservationEpoch> epochs;
  for (std::size_t e = 0; e < 60; ++e) {
    epochs.push_back(recorder.at(kStart + 1.0 + static_cast<double>(e), 1e-6 * static_cast<double>(e), e));
  }
  // Every third epoch all satellites except the highest one of one system are blocked and 60 m late.
  const auto highest = [&](System system) {
    SatelliteId best{system, 0};
    double elevation = -1;
    const auto plain = pseudorange_residuals(epochs, recorder.path, sky, kKlobuchar);
    for (const auto& o : plain.of(plain.epochs[0])) {
      if (o.id.system != system || o.elevation_rad < elevation) continue;
      best = o.id;
      elevation = o.elevation_rad;
    }
    return best;
  };
  const SatelliteId lone[] = {highest(System::GPS), highest(System::BeiDou)};
  const auto is_clear = [&](SatelliteId id, std::size_t e) { return e % 3 != 0 || id == lone[e % 2]; };
  recorder.error_m = [&](SatelliteId id, std::size_t e) { return is_clear(id, e) ? 0.0 : 60.0; };
  for (std::size_t e = 0; e < 60; ++e) {
    epochs[e] = recorder.at(kStart + 1.0 + static_cast<double>(e), 1e-6 * static_cast<double>(e), e);
  }
  const auto residuals = pseudorange_residuals(epochs, recorder.path, sky, kKlobuchar);
  const auto clear_view = [&](const PseudorangeResidual& o, const ResidualEpoch&) {
    return is_clear(o.id, o.epoch);
  };
  const auto errors = remove_receiver_clock(residuals, clear_view);
  for (std::size_t i = 0; i < errors.observations.size(); ++i) {
    const auto& o = residuals.observations[i];
    ASSERT_NEAR(errors.observations[i].error_m, recorder.error_m(o.id, o.epoch), 2e-3)
        << gnss::to_string(o.id) << " " << o.epoch;
  }
  // If two are required, these epochs fall back to all satellites, which hides common errors, and report it.
  ReceiverClockOptions two;
  two.min_clear = 2;
  const auto fallen = remove_receiver_clock(residuals, clear_view, two);
  for (std::size_t e = 0; e < 60; ++e) {
    EXPECT_EQ(fallen.clocks[e].source, e % 3 == 0 ? ClockSource::All : ClockSource::Clear);
    EXPECT_EQ(fallen.clocks[e].clear == 1, e % 3 == 0);
  }
}

TEST(PseudorangeErrors, OutliersInClearViewHardlyMoveTheClock) {
  // Normal noise of 2 m; in each epoch one satellite that is clear in the city is 80 m late.
  const test::CircularSky sky({System::GPS, System::Galileo});
  Recorder recorder{sky};
  std::map<std::pair<SatelliteId, std::size_t>, double> given;
  RandomStream random(1, "noise");
  recorder.error_m = [&](SatelliteId id, std::size_t e) {
    const auto [at, fresh] = given.try_emplace({id, e}, 0);
    if (fresh) at->second = 2 * random.normal() + (id.number % 24 == e % 24 ? 80 : 0);
    return at->second;
  };
  std::vector<rinex::ObservationEpoch> epochs;
  for (std::size_t e = 0; e < 240; ++e) {
    epochs.push_back(recorder.at(kStart + 1.0 + static_cast<double>(e), 2e-4, e));
  }
  const auto residuals = pseudorange_residuals(epochs, recorder.path, sky, kKlobuchar);
  const auto errors = remove_receiver_clock(residuals, kAllClear);
  std::vector<double> off;
  for (const EpochClock& clock : errors.clocks) off.push_back(clock.bias_m - kSpeedOfLight * 2e-4);
  const auto ends = quantiles(off, std::array{0.05, 0.5, 0.95});
  std::printf("clock off by %.2f, %.2f, %.2f m (5, 50, 95 %%); scatter %.2f\n", ends[0], ends[1], ends[2],
              errors.scatter);
  // One of some 18 satellites 80 m late moves a mean by 4.4 m at times, Huber's estimate by 1.345 sigma / 18.
  EXPECT_LT(std::abs(ends[1]), 0.3);
  EXPECT_LT(ends[2] - ends[0], 4 * 2 / std::sqrt(12.0));
  // The weights' variance at 45 dB-Hz is 10 + 22500 / 10^4.5 = 10.71 m^2: scatter 2 / 3.27.
  EXPECT_NEAR(errors.scatter, 0.61, 0.05);
}

TEST(PseudorangeErrors, WrongMillisecondsAreGross) {
  const test::CircularSky sky({System::GPS});
  Recorder recorder{sky};
  recorder.error_m = [](SatelliteId id, std::size_t) { return id.number == 3 ? kSpeedOfLight * 1e-3 : 0.0; };
  std::vector<rinex::ObservationEpoch> epochs;
  for (std::size_t e = 0; e < 10; ++e)
    epochs.push_back(recorder.at(kStart + 1.0 + static_cast<double>(e), 0, e));
  // A satellite that is above the horizon all the time replaces number 3.
  const SatelliteId victim = epochs[0].signals[0].id;
  recorder.error_m = [&](SatelliteId id, std::size_t) { return id == victim ? kSpeedOfLight * 1e-3 : 0.0; };
  for (std::size_t e = 0; e < 10; ++e) epochs[e] = recorder.at(kStart + 1.0 + static_cast<double>(e), 0, e);
  const auto residuals = pseudorange_residuals(epochs, recorder.path, sky, kKlobuchar);
  const auto errors = remove_receiver_clock(residuals, kAllClear);
  std::size_t gross = 0;
  for (std::size_t i = 0; i < errors.observations.size(); ++i) {
    const bool wrong = residuals.observations[i].id == victim;
    EXPECT_EQ(errors.observations[i].gross, wrong);
    if (wrong) {
      ++gross;
      // Its position is that of a millisecond of flight earlier: up to 0.8 m of range.
      EXPECT_NEAR(errors.observations[i].error_m, kSpeedOfLight * 1e-3, 1);
    } else {
      EXPECT_NEAR(errors.observations[i].error_m, 0, 2e-3);
    }
  }
  EXPECT_EQ(gross, 10U);
}

TEST(PseudorangeErrors, SystemsThatAreNeverClearHaveABias) {
  const test::CircularSky sky({System::GPS, System::Galileo});
  Recorder recorder{sky};
  recorder.bias_m = {{System::Galileo, 5}};
  std::vector<rinex::ObservationEpoch> epochs;
  for (std::size_t e = 0; e < 20; ++e)
    epochs.push_back(recorder.at(kStart + 1.0 + static_cast<double>(e), 0, e));
  const auto residuals = pseudorange_residuals(epochs, recorder.path, sky, kKlobuchar);
  const auto gps_only = [](const PseudorangeResidual& o, const ResidualEpoch&) {
    return o.id.system == System::GPS;
  };
  const auto errors = remove_receiver_clock(residuals, gps_only);
  EXPECT_EQ(errors.reference, System::GPS);
  EXPECT_NEAR(errors.inter_system_bias_m.at(System::Galileo), 5, 2e-3);
  // No satellite in clear view: the run still has clocks, and reports their kind.
  const auto none = remove_receiver_clock(residuals, [](const auto&, const auto&) { return false; });
  for (const EpochClock& c : none.clocks) EXPECT_EQ(c.source, ClockSource::All);
  EXPECT_NEAR(none.inter_system_bias_m.at(System::Galileo) - none.inter_system_bias_m.at(System::GPS), 5,
              2e-3);
}

TEST(PseudorangeErrors, WhatIsLeftOutIsCounted) {
  const test::CircularSky sky({System::GPS});
  const Recorder recorder{sky};
  std::vector<rinex::ObservationEpoch> epochs{recorder.at(kStart + 1.0, 0, 0),
                                              recorder.at(kStart + 2.0, 0, 1)};
  rinex::ObservationEpoch outside = recorder.at(kStart + 1.0, 0, 0);
  outside.receiver_time = outside.receiver_time + 3600.0;
  epochs.push_back(outside);
  epochs[1].signals[0].pseudorange_m.reset();
  epochs[1].signals[1].id = {System::QZSS, 1};
  const auto residuals = pseudorange_residuals(epochs, recorder.path, sky, kKlobuchar);
  EXPECT_THAT(residuals.epochs, SizeIs(2));
  EXPECT_EQ(residuals.epochs_outside_truth, 1U);
  EXPECT_EQ(residuals.without_pseudorange, 1U);
  EXPECT_EQ(residuals.without_ephemeris.at({System::QZSS, 1}), 1U);
  EXPECT_EQ(residuals.observations.size() + residuals.below_horizon + 2,
            epochs[0].signals.size() + epochs[1].signals.size());
  EXPECT_THAT(residuals.warnings(), SizeIs(3));
  EXPECT_EQ(residuals.warnings().back(), "1 pseudoranges of J01 left out: no valid ephemeris");
}

TEST(PseudorangeErrors, NothingGivesNothing) {
  const test::CircularSky sky({System::GPS});
  const auto residuals = pseudorange_residuals({}, truth(), sky, kKlobuchar);
  EXPECT_THAT(residuals.epochs, SizeIs(0));
  EXPECT_THAT(residuals.warnings(), SizeIs(0));
  const auto errors = remove_receiver_clock(residuals, kAllClear);
  EXPECT_THAT(errors.clocks, SizeIs(0));
  EXPECT_TRUE(errors.inter_system_bias_m.empty());
}

TEST(PseudorangeErrors, NeedsTheIonospheresCoefficients) {
  const test::CircularSky sky({System::GPS});
  const Recorder recorder{sky};
  const std::vector<rinex::ObservationEpoch> epochs{recorder.at(kStart + 1.0, 0, 0)};
  EXPECT_THAT(error_of([&] { (void)pseudorange_residuals(epochs, recorder.path, sky, {}); }).what(),
              HasSubstr("no Klobuchar coefficients for GPS"));
}

}  // namespace
}  // namespace canyon::validation
