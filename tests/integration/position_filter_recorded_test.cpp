// Weights, RAIM and position filter on a recorded drive through Tsim Sha Tsui (u-blox M8T, GPS and BeiDou).

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/receiver/positioning/position_filter.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon {
namespace {

using gnss::System;

struct Errors {
  std::vector<double> horizontal, vertical;
  std::vector<double> error_over_sigma,
      vertical_error_over_sigma;  ///< divided by their reported standard deviations
  int epochs = 0;
  int clock_jumps = 0;

  static double quantile(std::vector<double> values, double q) {
    std::sort(values.begin(), values.end());
    return values.at(static_cast<std::size_t>(q * static_cast<double>(values.size() - 1)));
  }
  void print(const char* what) const {
    std::printf("%-28s %zu of %d epochs, horizontal p50 %.1f p95 %.1f m, vertical p50 %.1f p95 %.1f m\n",
                what, horizontal.size(), epochs, quantile(horizontal, 0.5), quantile(horizontal, 0.95),
                quantile(vertical, 0.5), quantile(vertical, 0.95));
  }
};

struct Drive {
  rinex::RinexObservations recorded;
  gnss::NavigationData navigation;
  std::map<long, geodesy::Geodetic> truth;  ///< by whole seconds of the week
};

Drive read(const std::filesystem::path& folder) {
  rinex::ObservationOptions options;
  options.systems = {System::GPS, System::BeiDou};
  Drive drive{rinex::read_rinex_observations(folder / "COM3_190428_124409.obs", options),
              rinex::read_rinex_navigation({folder / "hksc1180.19n", folder / "hksc1180.19b"}),
              {}};
  std::ifstream file(folder / "groundTruth_TST.csv");
  for (std::string line; std::getline(file, line);) {
    int week = 0;
    long second = 0;
    double latitude = 0, longitude = 0, height = 0;
    if (std::sscanf(line.c_str(), "%d,%ld,%lf,%lf,%lf", &week, &second, &latitude, &longitude, &height) ==
        5) {
      drive.truth[second] = geodesy::Geodetic::from_degrees(latitude, longitude, height);
    }
  }
  return drive;
}

Errors errors(const Drive& drive, const orbit::Sky& sky, const positioning::FixOptions& options,
              bool filtered, double error_correlation_s = 0) {
  Errors errors;
  positioning::PositionFilterOptions filter_options;
  filter_options.error_correlation_s = error_correlation_s;
  positioning::PositionFilter filter(filter_options, options);
  Eigen::Vector3d start = Eigen::Vector3d::Zero();
  double last_clock_s = 0;
  for (const rinex::ObservationEpoch& epoch : drive.recorded.epochs) {
    const auto truth = drive.truth.find(std::lround(epoch.receiver_time.seconds_of_week()));
    if (truth == drive.truth.end()) continue;
    ++errors.epochs;
    std::vector<positioning::Measurement> measurements;
    for (const rinex::ObservedSignal& signal : epoch.signals) {
      if (!signal.pseudorange_m) continue;
      positioning::Measurement m;
      m.id = signal.id;
      m.pseudorange_m = *signal.pseudorange_m;
      m.sigma_m = 5;
      m.cn0_dbhz = signal.cn0_dbhz;
      m.carrier_frequency_hz = gnss::l1_frequency_hz(signal.id.system);
      m.doppler_hz = signal.doppler_hz;
      m.doppler_sigma_hz = 1;
      measurements.push_back(m);
    }
    positioning::Fix fix =
        solve_fix(epoch.receiver_time, measurements, sky, options, drive.navigation.klobuchar, start);
    if (fix.solved()) {
      start = fix.position_ecef;
      const double clock_s = fix.clock_bias_s.begin()->second;
      if (last_clock_s != 0 && std::abs(clock_s - last_clock_s) > 5e-4) ++errors.clock_jumps;
      last_clock_s = clock_s;
    }
    if (filtered) {
      fix = filter.update(epoch.receiver_time, measurements, sky, fix, drive.navigation.klobuchar);
    }
    if (!fix.solved()) continue;
    const Eigen::Vector3d enu = geodesy::enu_from_ecef_rotation(truth->second) *
                                (fix.position_ecef - geodesy::ecef_from_geodetic(truth->second));
    errors.horizontal.push_back(enu.head<2>().norm());
    errors.vertical.push_back(std::abs(enu.z()));
    errors.error_over_sigma.push_back(enu.head<2>().norm() /
                                      std::sqrt(fix.covariance_enu.topLeftCorner<2, 2>().trace()));
    errors.vertical_error_over_sigma.push_back(std::abs(enu.z()) / std::sqrt(fix.covariance_enu(2, 2)));
  }
  return errors;
}

TEST(RecordedDrive, FilterThroughClockJumpsAndDetours) {
  CANYON_SHARED_DATA(folder, "urbannav-tst-20190428");
  const Drive drive = read(folder);
  const orbit::BroadcastSky sky(drive.navigation);
  positioning::FixOptions options;
  options.correct_ionosphere = options.correct_troposphere = true;
  options.weights.weighting = positioning::Weighting::Equal;
  const Errors equal = errors(drive, sky, options, false);
  equal.print("equal weights");
  options.weights.weighting = positioning::Weighting::Elevation;
  errors(drive, sky, options, false).print("elevation weights");
  options.weights.weighting = positioning::Weighting::Cn0;
  const Errors cn0 = errors(drive, sky, options, false);
  cn0.print("C/N0 weights");
  const Errors filtered = errors(drive, sky, options, true);
  filtered.print("C/N0 weights, filter");
  options.raim.enabled = true;
  const Errors raim = errors(drive, sky, options, false);
  raim.print("C/N0 weights, RAIM");
  errors(drive, sky, options, true).print("C/N0 weights, RAIM, filter");

  EXPECT_EQ(equal.epochs, 485);
  EXPECT_GT(equal.clock_jumps, 5);  // the receiver steers its clock by milliseconds
  for (const Errors* each : {&equal, &cn0, &filtered, &raim}) EXPECT_EQ(each->horizontal.size(), 485U);
  EXPECT_LT(Errors::quantile(cn0.horizontal, 0.5), Errors::quantile(equal.horizontal, 0.5));
  EXPECT_LT(Errors::quantile(raim.horizontal, 0.5), Errors::quantile(cn0.horizontal, 0.5));
  EXPECT_LT(Errors::quantile(filtered.horizontal, 0.5), 0.75 * Errors::quantile(cn0.horizontal, 0.5));
  EXPECT_LT(Errors::quantile(filtered.horizontal, 0.95), 0.5 * Errors::quantile(cn0.horizontal, 0.95));
  EXPECT_LT(Errors::quantile(filtered.vertical, 0.95), 0.5 * Errors::quantile(cn0.vertical, 0.95));
}

// Most errors are within twice their reported deviation, and not all within half of it.
TEST(RecordedDrive, FilterStatesWhatItsErrorsAre) {
  CANYON_SHARED_DATA(folder, "urbannav-tst-20190428");
  const Drive drive = read(folder);
  const orbit::BroadcastSky sky(drive.navigation);
  positioning::FixOptions options;
  options.correct_ionosphere = options.correct_troposphere = true;
  options.weights.weighting = positioning::Weighting::Cn0;
  const Errors white = errors(drive, sky, options, true);
  options.covariance_by_residuals = true;
  const Errors lasting = errors(drive, sky, options, true, 20);
  EXPECT_GT(Errors::quantile(white.error_over_sigma, 0.95), 2.5);
  EXPECT_GT(Errors::quantile(white.vertical_error_over_sigma, 0.95), 4);
  for (const std::vector<double>* over : {&lasting.error_over_sigma, &lasting.vertical_error_over_sigma}) {
    EXPECT_LT(Errors::quantile(*over, 0.9), 2);
    EXPECT_GT(Errors::quantile(*over, 0.9), 0.5);
  }
}

}  // namespace
}  // namespace canyon
