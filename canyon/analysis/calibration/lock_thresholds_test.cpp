// Limits of lock, from synthetic recordings.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "canyon/analysis/calibration/direct_estimates.hpp"
#include "canyon/base/text.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::calibration {
namespace {

using ::testing::HasSubstr;
using Verdict = Estimate::Verdict;

/// A satellite that fades by a decibel a second from 40 dB-Hz to the weakest measured value, is lost for
/// `gap_s`, and comes back at `found`, repeatedly.
Observed fading(double weakest, double found, int gap_s, int rounds, bool clear) {
  Observed recorded;
  Series series;
  series.id = {gnss::System::GPS, 1};
  series.signal = gnss::signals_of(gnss::System::GPS).data();
  const auto add = [&](std::optional<double> cn0_dbhz) {
    const std::size_t epoch = recorded.times.size();
    recorded.times.push_back(geodesy::GpsTime::from_week(2000, static_cast<double>(epoch)));
    series.samples.push_back({epoch, clear, cn0_dbhz.has_value(), false, 0.5, cn0_dbhz});
  };
  for (int round = 0; round < rounds; ++round) {
    add(found);
    for (double cn0_dbhz = 40; cn0_dbhz >= weakest; --cn0_dbhz) add(cn0_dbhz);
    for (int s = 0; s < gap_s; ++s) add(std::nullopt);
  }
  recorded.series.push_back(series);
  return recorded;
}

Calibration thresholds_of(const Observed& recorded, double tracking = 10, double acquisition = 25) {
  simulation::ReceiverConfig receiver;
  receiver.options.signal.lock.tracking_threshold_dbhz = tracking;
  receiver.options.signal.lock.acquisition_threshold_dbhz = acquisition;
  const std::vector<std::vector<std::uint16_t>> sample_count(
      3, std::vector<std::uint16_t>(recorded.times.size(), 1));
  Calibration result;
  const std::vector<Observed> all{recorded};
  add_lock_thresholds(all, receiver, sample_count, result);
  return result;
}

TEST(LockThresholds, WeakestAndFirstFoundAreTheLimits) {
  const Calibration c = thresholds_of(fading(14, 21, 5, 30, false));
  ASSERT_EQ(c.estimates.size(), 2U);
  EXPECT_EQ(c.estimates[0].key, "signal.lock.tracking_threshold_dbhz");
  EXPECT_EQ(c.estimates[0].verdict, Verdict::Fitted);
  EXPECT_EQ(c.values.at("signal.lock.tracking_threshold_dbhz"), "14");
  EXPECT_EQ(c.estimates[0].interval, "13.5 to 14.5");
  EXPECT_THAT(c.estimates[0].basis, HasSubstr("30 losses"));
  EXPECT_EQ(c.values.at("signal.lock.acquisition_threshold_dbhz"), "21");
  EXPECT_THAT(c.estimates[1].basis, HasSubstr("29 gaps"));
}

TEST(LockThresholds, EqualOnesAgree) {
  const Calibration c = thresholds_of(fading(14, 21, 5, 30, false), 14, 21);
  EXPECT_EQ(c.estimates[0].verdict, Verdict::Agrees);
  EXPECT_EQ(c.estimates[1].verdict, Verdict::Agrees);
  EXPECT_TRUE(c.values.empty());
}

// Nine losses are too few, gaps of two seconds too short, and clear satellites show no weakest signal.
TEST(LockThresholds, TooLittleIsNotIdentified) {
  for (const Observed& recorded : {fading(14, 21, 5, 9, false), fading(14, 21, 5, 30, true)}) {
    const Calibration c = thresholds_of(recorded);
    EXPECT_EQ(c.estimates[0].verdict, Verdict::Unidentified);
    EXPECT_EQ(c.estimates[0].after(), "10");
    EXPECT_EQ(c.values.count("signal.lock.tracking_threshold_dbhz"), 0U);
  }
  const Calibration c = thresholds_of(fading(14, 21, 2, 30, false));
  EXPECT_EQ(c.estimates[1].verdict, Verdict::Unidentified);
  EXPECT_EQ(c.estimates[1].after(), "25");
}

// The hysteresis is never negative: that would be an invalid receiver.
TEST(LockThresholds, AcquisitionIsNoLowerThanTracking) {
  const Calibration found_weaker = thresholds_of(fading(14, 12, 5, 30, false));
  EXPECT_EQ(found_weaker.values.at("signal.lock.tracking_threshold_dbhz"), "12");
  EXPECT_EQ(found_weaker.values.at("signal.lock.acquisition_threshold_dbhz"), "12");
  const Calibration no_gaps = thresholds_of(fading(22, 30, 2, 30, false), 10, 20);
  EXPECT_EQ(no_gaps.values.at("signal.lock.acquisition_threshold_dbhz"), "22");
  EXPECT_THAT(no_gaps.estimates[1].basis, HasSubstr("no lower than"));
}

}  // namespace
}  // namespace canyon::calibration
