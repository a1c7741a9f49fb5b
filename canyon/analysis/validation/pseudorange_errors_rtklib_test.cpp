// RTKLIB 2.4.3 b34 computes the same residuals of the recorded drive from the same files: its reader, its
// choice of ephemerides, its orbits and clocks, its range with Sagnac's term, its atmosphere.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>

#include "canyon/analysis/validation/pseudorange_errors.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/range_errors.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "tests/support/rtklib_observations.hpp"
#include "tests/support/shared_data.hpp"

extern "C" {
void satposs(RtklibTime time, const canyon::test::RtklibObservation* observations, int n,
             const RtklibNavigation* navigation, int option, double* position_velocity, double* clock_drift,
             double* variance, int* health);
double geodist(const double* satellite, const double* receiver, double* direction);
void ecef2pos(const double* ecef, double* position);
double satazel(const double* position, const double* direction, double* azimuth_elevation);
}

namespace canyon::validation {
namespace {

using geodesy::kSpeedOfLight;
using gnss::System;

/// TGD or TGD1 of the record whose toe is closest [s].
double group_delay(const RtklibNavigation& navigation, int satellite, RtklibTime time) {
  double best = 1e300, delay = 0;
  for (int i = 0; i < navigation.n; ++i) {
    const RtklibEphemeris& e = navigation.eph[i];
    if (e.sat != satellite) continue;
    const double age = std::abs(static_cast<double>(e.toe.time - time.time));
    if (age >= best) continue;
    best = age;
    delay = e.tgd[0];
  }
  return delay;
}

TEST(PseudorangeErrorsAndRtklib, ResidualsOfTheRecordedDrive) {
  CANYON_SHARED_DATA(folder, "urbannav-tst-20190428");
  const auto observation_file = folder / "COM3_190428_124409.obs";
  const std::vector<std::filesystem::path> navigation_files{folder / "hksc1180.19n", folder / "hksc1180.19b"};
  const auto data = rinex::read_rinex_navigation(navigation_files);
  const orbit::BroadcastSky sky(data);
  const auto truth =
      simulation::read_trajectory_file(folder / "groundTruth_TST.csv", "urbannav", {}).trajectory;
  const auto recorded = rinex::read_rinex_observations(observation_file);
  // RTKLIB uses GPS's coefficients for every system.
  const gnss::Klobuchar gps = data.klobuchar.at(System::GPS);
  const auto ours = pseudorange_residuals(recorded.epochs, truth, sky, {{System::GPS, gps}});
  ASSERT_GT(ours.observations.size(), 7000U);

  test::RtklibObservations theirs{};
  auto navigation = std::make_unique<RtklibNavigation>();
  ASSERT_EQ(readrnx(observation_file.c_str(), 1, "", &theirs, nullptr, nullptr), 1);
  for (const auto& file : navigation_files) {
    ASSERT_EQ(readrnx(file.c_str(), 1, "", nullptr, navigation.get(), nullptr), 1);
  }
  std::map<std::pair<std::int64_t, int>, const test::RtklibObservation*> index;
  for (int i = 0; i < theirs.n; ++i) {
    index[{test::gps_time(theirs.data[i].time).nanoseconds(), theirs.data[i].sat}] = &theirs.data[i];
  }
  double alpha_beta[8];
  std::copy(gps.alpha.begin(), gps.alpha.end(), alpha_beta);
  std::copy(gps.beta.begin(), gps.beta.end(), alpha_beta + 4);

  std::map<System, double> largest;
  double largest_angle = 0;
  std::size_t compared = 0;
  for (const ResidualEpoch& epoch : ours.epochs) {
    const double antenna[3] = {epoch.antenna_ecef.x(), epoch.antenna_ecef.y(), epoch.antenna_ecef.z()};
    double position[3];
    ecef2pos(antenna, position);
    for (const PseudorangeResidual& o : ours.of(epoch)) {
      const int satellite = test::rtklib_satellite(o.id);
      const auto at = index.find({epoch.receiver_time.nanoseconds(), satellite});
      ASSERT_NE(at, index.end());
      const test::RtklibObservation& raw = *at->second;
      double state[6], clock[2], variance = 0, direction[3], azel[2];
      const double zenith[2] = {0, geodesy::kPi / 2};  // RTKLIB's own mapping is 1 / sin
      int health = 0;
      satposs(raw.time, &raw, 1, navigation.get(), 0, state, clock, &variance, &health);
      const double range = geodist(state, antenna, direction);
      ASSERT_GT(range, 0);
      satazel(position, direction, azel);
      const double ratio = gnss::l1_frequency_hz(System::GPS) / gnss::l1_frequency_hz(o.id.system);
      const double residual = raw.range[0] - range +
                              kSpeedOfLight * (clock[0] - group_delay(*navigation, satellite, raw.time)) -
                              ratio * ratio * ionmodel(raw.time, alpha_beta, position, azel) -
                              sky::slant_delay_m(tropmodel(raw.time, position, zenith, 0.7), azel[1]);
      double& worst = largest[o.id.system];
      worst = std::max(worst, std::abs(o.residual_m - residual));
      largest_angle = std::max({largest_angle, std::abs(o.elevation_rad - azel[1]),
                                std::abs(std::remainder(o.azimuth_rad - azel[0], 2 * geodesy::kPi))});
      ++compared;
    }
  }
  EXPECT_EQ(compared, ours.observations.size());
  std::printf("%zu residuals; largest differences: GPS %.2g m, BeiDou %.2g m, angles %.2g rad\n", compared,
              largest[System::GPS], largest[System::BeiDou], largest_angle);
  EXPECT_LT(largest[System::GPS], 1e-3);
  EXPECT_LT(largest[System::BeiDou], 1e-3);
  // RTKLIB's directions neglect Earth's rotation during the signal's travel: up to 1e-5 rad, more in azimuth
  // at high elevations.
  EXPECT_LT(largest_angle, 5e-5);
  for (void* rtklibs : {static_cast<void*>(theirs.data), static_cast<void*>(navigation->eph),
                        static_cast<void*>(navigation->geph), static_cast<void*>(navigation->seph)}) {
    std::free(rtklibs);
  }
}

}  // namespace
}  // namespace canyon::validation
