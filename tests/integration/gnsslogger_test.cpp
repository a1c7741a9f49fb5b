// Logs of Android's GnssLogger: what Canyon writes it reads back as the observations of the same run's RINEX
// file.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>
#include <string>

#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/frames.hpp"
#include "canyon/rinex/observation_reader.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "tests/integration/run_scenario.hpp"

namespace canyon {
namespace {

using geodesy::kSpeedOfLight;

using Key = std::pair<gnss::SatelliteId, const gnss::Signal*>;

class AndroidLogOfARun : public testing::Test {
 protected:
  static constexpr double kBias_s = 2e-4;

  static void SetUpTestSuite() {
    folder_ = std::make_unique<test::TemporaryFolder>();
    epochs_ = test::run_and_write(
        test::prepare(
            "city: {synthetic: {blocks_east: 3, blocks_north: 3, seed: 5}}\n"
            "sky: {nominal: true}\nstart: 2026-03-01T23:59:50Z\n"
            "trajectory: {waypoints: [{east_m: -76, north_m: 0}, {east_m: 76, north_m: 0}], speed_mps: 8, "
            "height_above_terrain_m: 1.5}\nrate_hz: 1\n"
            "receivers: [{name: phone, profile: phone, clock: {bias_s: 2e-4, drift: 1e-7}, tracks: [L1CA, "
            "L5, E1, E5a, B1I, B1C, B2a, G1]}]\n"
            "outputs: [gnsslogger, rinex_observation]\n",
            folder_->path()),
        folder_->path());
    rinex::ObservationOptions all;
    all.all_signals = true;
    log_ = rinex::read_observations(folder_->path() / "gnss_log.txt", all);
    rinex_ = rinex::read_observations(folder_->path() / "receiver.obs", all);
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static inline std::unique_ptr<test::TemporaryFolder> folder_;
  static inline std::vector<simulation::Epoch> epochs_;
  static inline rinex::RinexObservations log_, rinex_;
};

// A log's first epoch takes the clock's bias off; what the clock does afterwards is in both files. The
// satellites' times have whole nanoseconds, RINEX's tags 100 ns.
TEST_F(AndroidLogOfARun, HasTheObservationsOfItsRinexFile) {
  EXPECT_EQ(log_.report.notes.bad_count(), 0U);
  EXPECT_THAT(log_.report.warnings(), testing::IsEmpty());
  ASSERT_EQ(log_.epochs.size(), rinex_.epochs.size());
  ASSERT_GE(log_.epochs.size(), 15U);
  std::map<Key, double> cycles;  // of each arc, between both files
  std::set<gnss::System> systems;
  std::size_t ranges = 0, phases = 0;
  for (std::size_t i = 0; i < log_.epochs.size(); ++i) {
    const rinex::ObservationEpoch &ours = log_.epochs[i], &theirs = rinex_.epochs[i];
    EXPECT_NEAR(theirs.receiver_time - ours.receiver_time, kBias_s, 51e-9);
    EXPECT_FALSE(ours.power_failure);
    ASSERT_EQ(ours.signals.size(), theirs.signals.size()) << i;
    for (std::size_t k = 0; k < ours.signals.size(); ++k) {
      const rinex::ObservedSignal &a = ours.signals[k], &b = theirs.signals[k];
      ASSERT_EQ(a.id, b.id);
      ASSERT_EQ(a.signal, b.signal);
      ASSERT_EQ(std::string(a.code.data()), b.code.data());
      systems.insert(a.id.system);
      ASSERT_TRUE(a.pseudorange_m && b.pseudorange_m) << gnss::to_string(a.id);
      ++ranges;
      EXPECT_NEAR(*b.pseudorange_m - *a.pseudorange_m, kSpeedOfLight * kBias_s, 0.151)
          << gnss::to_string(a.id);
      EXPECT_NEAR(a.cn0_dbhz.value_or(0), b.cn0_dbhz.value_or(0), 0.00051);
      ASSERT_EQ(a.doppler_hz.has_value(), b.doppler_hz.has_value());
      if (a.doppler_hz) {
        EXPECT_NEAR(*a.doppler_hz, *b.doppler_hz, 0.00052);
      }
      ASSERT_EQ(a.carrier_phase_cycles.has_value(), b.carrier_phase_cycles.has_value());
      EXPECT_EQ(a.loss_of_lock & 2, b.loss_of_lock & 2);
      if (!a.carrier_phase_cycles) {
        cycles.erase({a.id, a.signal});
        continue;
      }
      const double apart = *b.carrier_phase_cycles - *a.carrier_phase_cycles;
      const auto [arc, begins] = cycles.try_emplace({a.id, a.signal}, std::round(apart));
      if (!begins && (a.loss_of_lock & 1) != 0) arc->second = std::round(apart);
      EXPECT_NEAR(apart, arc->second, 0.00052) << gnss::to_string(a.id) << ' ' << a.code.data() << ' ' << i;
      ++phases;
    }
  }
  EXPECT_GE(systems.size(), 4U);
  EXPECT_GT(ranges, 300U);
  EXPECT_GT(phases, 100U);
}

TEST_F(AndroidLogOfARun, HasItsFixesAsAPath) {
  const auto path = simulation::read_trajectory(folder_->path() / "gnss_log.txt", "gnsslogger", {});
  std::size_t fixes = 0;
  for (const simulation::Epoch& epoch : epochs_) {
    if (!epoch.observed.fix.solved()) continue;
    ++fixes;
    const auto at = geodesy::ecef_from_geodetic(path.at(epoch.observed.time).position);
    EXPECT_LT((at - epoch.observed.fix.position_ecef).norm(), 0.001);
  }
  EXPECT_GE(fixes, 5U);
}

}  // namespace
}  // namespace canyon
