// Recordings by Canyon itself with known options, which are found again within the reported intervals.
#include "canyon/analysis/calibration/calibrate.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "canyon/base/options/values.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/scenario/profile.hpp"
#include "tests/support/simulated_recording.hpp"

namespace canyon::calibration {
namespace {

using ::testing::HasSubstr;
using Verdict = Estimate::Verdict;

/// The recording receiver, except for a test's changes: a profile without shadows, so that only the tested
/// option differs.
void plain_receiver(simulation::ReceiverConfig& receiver) {
  const std::string name = receiver.options.name;
  receiver =
      simulation::parse_profile(std::string(simulation::built_in_profile("ublox-m8t").text), "m8t").receiver;
  receiver.options.name = name;
  receiver.options.fix.elevation_mask_rad = 0.17;
  receiver.options.signal.satellite_sigma_db = 0;
  receiver.options.signal.shadowing.enabled = false;
  receiver.propagation.diffuse = false;  // its fading looks like short shadows
  receiver.options.signal.offset_db.clear();
  receiver.options.signal.cn0_averaging_s = 0;  // a mean does not show the threshold
  receiver.options.independent_noise = false;
}

/// @param base the profile to calibrate
Drive drive_of(const test::SimulatedRecording& recorded, const test::SimulatedRecording::Change& base = {}) {
  Drive drive;
  drive.name = "car";
  drive.environment = &recorded.environment();
  drive.recording = recorded.read();
  drive.recording.reported_fixes.clear();  // of single epochs, no filter's
  drive.receiver = recorded.scenario().receivers.front();
  plain_receiver(drive.receiver);
  if (base) base(drive.receiver);
  drive.systems = {gnss::System::GPS, gnss::System::Galileo};
  drive.seed = 5;
  return drive;
}

const Estimate& of(const Calibration& c, const std::string& key) {
  const auto at = std::find_if(c.estimates.begin(), c.estimates.end(),
                               [&key](const Estimate& e) { return e.key == key; });
  EXPECT_NE(at, c.estimates.end()) << key;
  static const Estimate kNone;
  return at == c.estimates.end() ? kNone : *at;
}

void expect_known(const Calibration& c, const std::string& key, double known, double tolerance) {
  const Estimate& e = of(c, key);
  const std::size_t to = e.interval.find(" to ");
  ASSERT_NE(to, std::string::npos) << key << ": " << to_string(e.verdict) << ": " << e.basis;
  std::printf("%-45s known %6.3f, recorded %s (%s)\n", key.c_str(), known, e.recorded.c_str(),
              e.interval.c_str());
  EXPECT_NEAR(*parse_double(e.recorded), known, tolerance) << key;
  EXPECT_GE(known, *parse_double(e.interval.substr(0, to))) << key;
  EXPECT_LE(known, *parse_double(e.interval.substr(to + 4))) << key;
}

void print(const Calibration& c) {
  std::printf("%s", to_text(c.estimates).c_str());
  for (const std::string& note : c.notes) std::printf("- %s\n", note.c_str());
}

// Keys that differ by one deviation of the prior from the profile's: found again within the interval.
TEST(Calibrate, KnownReceiverComesBack) {
  const auto shadowed = [](simulation::ReceiverConfig& receiver) {
    plain_receiver(receiver);
    receiver.propagation.diffuse = true;  // weak signals, for the threshold
    receiver.options.signal.shadowing.enabled = true;
    receiver.options.signal.shadowing.environment = disturbance::ShadowingEnvironment::Urban;
  };
  const test::SimulatedRecording recorded({}, [&](simulation::ReceiverConfig& receiver) {
    shadowed(receiver);
    tracking::SignalOptions& signal = receiver.options.signal;
    signal.link.above_minimum_db -= 5;
    signal.shadowing.skyline.fraction = 0.3;
    signal.lock.tracking_threshold_dbhz = 16;
    signal.lock.acquisition_threshold_dbhz = 25;
    signal.cn0_step_db = 0.25;
  });
  Drive drive = drive_of(recorded, shadowed);
  drive.seed = 11;  // other random numbers than in the recording
  const Calibration c = calibrate({drive});
  print(c);
  expect_known(c, "signal.link.above_minimum_db", 1.5 - 5, 2.5);
  expect_known(c, "signal.shadowing.skyline.obstacle_fraction", 0.3, 0.25);
  expect_known(c, "signal.lock.tracking_threshold_dbhz", 16, 1);
  // The level has risen by the time a signal is measured again.
  EXPECT_NEAR(*parse_double(of(c, "signal.lock.acquisition_threshold_dbhz").recorded), 25, 2);
  EXPECT_EQ(of(c, "signal.cn0_step_db").after(), "0.25");
  EXPECT_EQ(of(c, "tracks").verdict, Verdict::Agrees);
  EXPECT_EQ(of(c, "exclude_signals").verdict, Verdict::Agrees);
}

// Coated glass on 70 % of the buildings, or on none: the fraction is found with other samples of each
// building's facade. If facades are known, they have no estimate.
TEST(Calibrate, FacadesOfThePlaceComeBack) {
  const auto scattering = [](simulation::ReceiverConfig& receiver) {
    plain_receiver(receiver);
    receiver.propagation.diffuse = true;
  };
  const auto fractions = [](double coated) -> test::SimulatedRecording::Facades {
    return {{"coated_glass", coated}, {"concrete", 1 - coated}};
  };
  CalibrateOptions options;
  options.seeds = 1;
  double found[2] = {};
  for (const bool coated : {false, true}) {
    const test::SimulatedRecording recorded({}, scattering, "min_height_m: 12, max_height_m: 90",
                                            fractions(coated ? 0.7 : 0));
    Drive drive = drive_of(recorded, scattering);
    EXPECT_FALSE(calibrate({drive}, options).coated_glass);
    for (const double fraction : {0.0, 0.35, 0.7}) {
      drive.facades.push_back(
          {fraction, [&, fraction] { return recorded.environment_with(fractions(fraction), 2); }});
    }
    const Calibration c = calibrate({drive}, options);
    ASSERT_TRUE(c.coated_glass);
    std::printf("coated glass %g: %s (%s)\n", coated ? 0.7 : 0, c.coated_glass->recorded.c_str(),
                c.coated_glass->interval.c_str());
    EXPECT_EQ(c.coated_glass->key, "city.facades.fractions.coated_glass");
    EXPECT_EQ(c.values.count(c.coated_glass->key), 0U);  // not a key of a profile
    found[coated ? 1 : 0] = *parse_double(c.coated_glass->recorded);
  }
  EXPECT_LT(found[0], 0.3);
  EXPECT_GT(found[1], 0.4);
}

// Above the roofs no signal is lost, and without shadows obstacles have no effect. The report contains that
// these keys are not identified.
TEST(Calibrate, WhatNothingTellsIsSaid) {
  const test::SimulatedRecording recorded({}, plain_receiver, "min_height_m: 1, max_height_m: 1.2");
  CalibrateOptions options;
  options.seeds = 1;
  const Calibration c = calibrate({drive_of(recorded)}, options);
  print(c);
  for (const char* key : {"signal.shadowing.skyline.obstacle_fraction", "signal.lock.tracking_threshold_dbhz",
                          "signal.lock.acquisition_threshold_dbhz", "signal.phase_threshold_dbhz"}) {
    EXPECT_EQ(of(c, key).verdict, Verdict::Unidentified) << key;
    EXPECT_FALSE(of(c, key).basis.empty()) << key;
    EXPECT_EQ(of(c, key).before, of(c, key).after()) << key;
    EXPECT_EQ(c.values.count(key), 0U) << key;
  }
  EXPECT_NEAR(*parse_double(of(c, "signal.link.above_minimum_db").after()), 1.5, 1);
}

// A block of satellites and a system that the receiver never tracks; gnss::block_of() has the table of
// blocks.
TEST(Calibrate, NeverTrackedGroupsAreLeftOut) {
  const test::SimulatedRecording recorded({}, [](simulation::ReceiverConfig& receiver) {
    plain_receiver(receiver);
    receiver.options.leaves_out = {"GPS-IIF"};
  });
  CalibrateOptions options;
  options.seeds = 1;
  Drive drive = drive_of(recorded);
  drive.systems.insert(gnss::System::GLONASS);  // requested, but never received
  const Calibration c = calibrate({drive}, options);
  print(c);
  EXPECT_EQ(of(c, "exclude_signals").after(), "[GPS-IIF, GLONASS]") << of(c, "exclude_signals").basis;
  EXPECT_THAT(of(c, "exclude_signals").basis, HasSubstr("GPS-IIF never tracked"));
  // The reverse: signals that the profile leaves out and the recording has.
  const Calibration back = calibrate({drive_of(recorded,
                                               [](simulation::ReceiverConfig& receiver) {
                                                 receiver.options.leaves_out = {"GPS-IIR", "GPS-IIF"};
                                               })},
                                     options);
  EXPECT_EQ(of(back, "exclude_signals").after(), "[GPS-IIF]") << of(back, "exclude_signals").basis;
}

// The second half may have any content.
TEST(Calibrate, HeldOutPartIsHeldOut) {
  const test::SimulatedRecording recorded({}, plain_receiver);
  Drive drive = drive_of(recorded);
  validation::Recording spoiled = drive.recording;
  const std::size_t half = spoiled.residuals.epochs.size() / 2;
  for (validation::PseudorangeResidual& o : spoiled.residuals.observations) {
    if (o.epoch < half) continue;
    o.residual_m += 300;
    o.cn0_dbhz = 60;
  }
  CalibrateOptions options;
  options.seeds = 1;
  Drive other = drive;
  drive.recording = part_of(drive.recording, 0, half);
  other.recording = part_of(spoiled, 0, half);
  EXPECT_EQ(to_text(calibrate({drive}, options).estimates), to_text(calibrate({other}, options).estimates));
  // A later part begins at its own first epoch.
  const validation::Recording rest = part_of(spoiled, half, 20);
  ASSERT_EQ(rest.residuals.epochs.size(), 20U);
  EXPECT_EQ(rest.residuals.epochs.front().first, 0U);
  EXPECT_EQ(rest.residuals.observations.front().epoch, 0U);
  EXPECT_EQ(rest.residuals.observations.back().epoch, 19U);
  EXPECT_EQ(rest.antennas.front().enu_m, spoiled.antennas[half].enu_m);
}

TEST(Calibrate, ReceiverWithoutStrengthIsRefused) {
  const test::SimulatedRecording recorded({}, plain_receiver);
  const Drive drive = drive_of(
      recorded, [](simulation::ReceiverConfig& receiver) { receiver.options.signal.enabled = false; });
  try {
    (void)calibrate({drive});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("car"));
    EXPECT_THAT(error.hint(), HasSubstr("--profile"));
  }
}

}  // namespace
}  // namespace canyon::calibration
