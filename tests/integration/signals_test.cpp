// Receivers that track several signals of each satellite: closed forms between bands, and RTKLIB as check.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/sky/gnss/signals.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"
#include "tests/integration/run_scenario.hpp"
#include "tests/support/program.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon {
namespace {

using receiver::SatelliteObservation;
using receiver::SignalObservation;

std::string open_sky(const std::string& sky, const std::string& receivers, int duration_s = 60) {
  return "city: {open: true, origin: {latitude_deg: 22.298, longitude_deg: 114.178, height_m: 10}}\n" + sky +
         "trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}\n"
         "receivers: [" +
         receivers +
         "]\n"
         "noise: {enabled: false}\n"
         "propagation: {ground_reflection: false, diffuse: {enabled: false}}\n"
         "rate_hz: 1\nduration_s: " +
         std::to_string(duration_s) + "\noutputs: {pictures: false, signals_csv: true}\n";
}
const std::string kNominal =
    "sky: {nominal: true, systems: [GPS, GLONASS, Galileo, BeiDou], errors: {enabled: false}}\nstart: "
    "2026-03-01T10:00:00Z\n";
const std::string kClean =
    "noise: {enabled: false}, signal: {loop_noise: false, cn0_sigma_db: 0, shadowing: {enabled: false}}, ";

double square(double x) {
  return x * x;
}

// I(f) = I(L1) (f_L1 / f)^2: the code is delayed, the phase advanced by it; everything else is equal.
TEST(Signals, DifferByTheIonosphereAndTheirGroupDelaysAlone) {
  const test::TemporaryFolder folder;
  const auto epochs = test::run_and_write(
      test::prepare(
          open_sky(kNominal,
                   "{name: rover, profile: survey, " + kClean +
                       "clock: {drift_walk: 0}, ionosphere: true, troposphere: true, tracks: [L1CA, "
                       "L2C, L5, E1, E5a, E5b, B1I, B2a, B3I, G1, G2]}"),
          folder.path()),
      folder.path());
  int pairs = 0;
  double largest_m = 0;
  for (std::size_t k = 1; k < epochs.size(); ++k) {
    for (const SatelliteObservation& now : epochs[k].observed.satellites) {
      if (!now.measurement) continue;
      const SatelliteObservation* before = nullptr;
      for (const SatelliteObservation& other : epochs[k - 1].observed.satellites) {
        if (other.id == now.id) before = &other;
      }
      for (std::size_t i = 0; i < now.more.size(); ++i) {
        const SignalObservation& far = now.more[i];
        if (!far.measurement) continue;
        ++pairs;
        const double ratio =
            square(now.measurement->carrier_frequency_hz / far.measurement->carrier_frequency_hz);
        EXPECT_NEAR(far.term_m(receiver::RangeTermId::Ionosphere),
                    ratio * now.term_m(receiver::RangeTermId::Ionosphere), 1e-6);
        EXPECT_NEAR(far.measurement->pseudorange_m - now.measurement->pseudorange_m,
                    (ratio - 1) * now.term_m(receiver::RangeTermId::Ionosphere), 1e-5)
            << gnss::to_string(now.id) << ' ' << far.signal->name;  // nominal satellites have no group delays
        largest_m = std::max(largest_m, far.term_m(receiver::RangeTermId::Ionosphere));
        // Code minus carrier changes by twice the ionosphere's rate.
        if (before == nullptr || before->more.size() != now.more.size() || !before->more[i].measurement)
          continue;
        const positioning::Measurement &a = *before->more[i].measurement, &b = *far.measurement;
        if (!a.carrier_phase_cycles || !b.carrier_phase_cycles || *a.phase_since != *b.phase_since) continue;
        const double wavelength = geodesy::kSpeedOfLight / b.carrier_frequency_hz;
        const double code_less_carrier_m = (b.pseudorange_m - a.pseudorange_m) -
                                           wavelength * (*b.carrier_phase_cycles - *a.carrier_phase_cycles);
        EXPECT_NEAR(code_less_carrier_m,
                    2 * (far.term_m(receiver::RangeTermId::Ionosphere) -
                         before->more[i].term_m(receiver::RangeTermId::Ionosphere)),
                    1e-5);
      }
    }
  }
  EXPECT_GT(pairs, 2000);
  EXPECT_GT(largest_m, 5);
}

// 2.98 of L1/L2: sqrt(g^2 + 1) / (g - 1), g = (77 / 60)^2; RTKLIB's and IS-GPS-200's combination.
TEST(Signals, IonosphereFreeFixesForgetTheIonosphereAndTripleTheNoise) {
  const test::TemporaryFolder folder;
  const auto epochs = test::run_and_write(
      test::prepare(open_sky("sky: {nominal: true, systems: [GPS, Galileo], errors: {enabled: "
                             "false}}\nstart: 2026-03-01T10:00:00Z\n",
                             "{name: both, profile: ideal, elevation_mask_deg: 10, noise: {enabled: false}, "
                             "ionosphere: true, tracks: [L1CA, L2C, E1, E5a], "
                             "combination: "
                             "ionosphere_free}, {name: one, profile: ideal, elevation_mask_deg: 10, noise: "
                             "{enabled: false}, ionosphere: true, tracks: [L1CA, E1]}, "
                             "{name: noisy, profile: ideal, elevation_mask_deg: 10, tracks: [L1CA, L2C], "
                             "combination: ionosphere_free, min_satellites: 4, "
                             "noise: {enabled: true, theta_per_s: 50}}, {name: plain, profile: ideal, "
                             "elevation_mask_deg: 10, tracks: [L1CA, L2C], noise: "
                             "{enabled: true, theta_per_s: 50}}",
                             400),
                    folder.path()),
      folder.path());
  double worst_both = 0, best_one = 1e9;
  for (const simulation::Epoch& epoch : epochs) {
    if (epoch.receiver == 0) {
      ASSERT_TRUE(epoch.observed.fix.solved());
      worst_both = std::max(worst_both, epoch.error_enu_m.norm());
    } else if (epoch.receiver == 1) {
      best_one = std::min(best_one, epoch.error_enu_m.norm());
    }
  }
  EXPECT_LT(worst_both, 1e-3);
  EXPECT_GT(best_one, 1);

  // The same noise of L1 and L2 in every epoch: white, since its correlation time is 20 ms.
  double combined = 0, single = 0;
  int count = 0;
  const double g = square(77.0 / 60);
  for (const simulation::Epoch& epoch : epochs) {
    if (epoch.receiver != 2) continue;
    for (const SatelliteObservation& s : epoch.observed.satellites) {
      if (!s.measurement || s.more.empty() || !s.more[0].measurement) continue;
      combined += square((g * s.noise_m - s.more[0].noise_m) / (g - 1));
      single += square(s.noise_m);
      ++count;
    }
  }
  EXPECT_GT(count, 1500);
  EXPECT_NEAR(std::sqrt(combined / single), 2.978, 0.1);
  EXPECT_NEAR(std::sqrt(g * g + 1) / (g - 1), 2.978, 5e-4);
}

// The measurements of one signal do not depend on other tracked signals.
TEST(Signals, LeaveTheFirstOneAsItIs) {
  const test::TemporaryFolder folder;
  const auto epochs = test::run_and_write(
      test::prepare(
          "city: {synthetic: {blocks_east: 4, blocks_north: 4, seed: 5}}\n" + kNominal +
              "trajectory: {waypoints: [{east_m: -76, north_m: 0}, {east_m: 76, north_m: 0}], speed_mps: 8, "
              "height_above_terrain_m: 1.5}\nrate_hz: 2\n"
              "receivers: [{name: one, independent_noise: false, profile: ublox-f9p, tracks: [L1CA, E1, B1I, "
              "G1]}, "
              "{name: many, independent_noise: false, "
              "profile: ublox-f9p, tracks: [L1CA, "
              "L2C, L5, E1, E5b, B1I, B2I, B3I, G1, G2]}]\noutputs: {pictures: false}\n",
          folder.path()),
      folder.path());
  std::size_t compared = 0, more = 0;
  for (std::size_t i = 0; i + 1 < epochs.size(); i += 2) {
    const receiver::ReceiverEpoch &one = epochs[i].observed, &many = epochs[i + 1].observed;
    ASSERT_EQ(one.satellites.size(), many.satellites.size());
    EXPECT_TRUE(one.fix.position_ecef == many.fix.position_ecef || !one.fix.solved());
    for (std::size_t k = 0; k < one.satellites.size(); ++k) {
      const SatelliteObservation &a = one.satellites[k], &b = many.satellites[k];
      EXPECT_EQ(a.excess_m, b.excess_m);
      EXPECT_EQ(a.cn0_dbhz, b.cn0_dbhz);
      EXPECT_EQ(a.noise_m, b.noise_m);
      compared += a.measurement.has_value();
      more += b.more.size();
    }
  }
  EXPECT_GT(compared, 500U);
  EXPECT_GT(more, 1000U);
}

// Observation files: every code in the header, every value read back by Canyon's reader, and RTKLIB's
// ionosphere-free fix, with its own group delays and (77 / 60)^2.
TEST(Signals, OfTwoBandsAreSolvedByRtklib) {
  CANYON_NEEDS_PROGRAM("rnx2rtkp");
  CANYON_SHARED_DATA(nav, "urbannav-tst-20190428/hksc1180.19n");
  const test::TemporaryFolder folder;
  const auto epochs = test::run_and_write(
      test::prepare(
          open_sky("sky: {navigation: [hksc1180.19n], systems: [GPS]}\nstart: 2019-04-28T12:58:03Z\n",
                   "{name: rover, profile: ideal, elevation_mask_deg: 10, noise: {enabled: false}, "
                   "ionosphere: true, tracks: [L1CA, L2C], combination: "
                   "ionosphere_free, clock: {bias_s: 2.0e-4, drift: 1.0e-7}}"),
          nav.parent_path()),
      folder.path());
  const std::string observations = test::read_bytes(folder.path() / "receiver.obs");
  EXPECT_THAT(observations, testing::HasSubstr("\nG    4 C1C D1C C2L D2L "));
  std::ofstream(folder.path() / "rtk.conf") << "pos1-posmode=single\npos1-frequency=l1+l2\npos1-elmask="
                                               "10\npos1-ionoopt=dual-freq\npos1-tropopt=off\n"
                                               "pos1-sateph=brdc\npos1-navsys=1\npos1-posopt5=off\npos2-"
                                               "rejgdop=10000\nstats-eratio1=10000\nstats-eratio2=10000\n"
                                               "stats-errphase=10\nstats-errphaseel=0\nout-solformat="
                                               "xyz\nout-outhead=off\nout-timesys=gpst\nout-timeform=tow\n"
                                               "out-timendec=3\nout-solstatic=all\n";
  const std::string command =
      "cd '" + folder.path().string() +
      "' && timeout 120 rnx2rtkp -k rtk.conf -o rtk.pos receiver.obs sky.nav >rtk.log 2>&1";
  ASSERT_EQ(std::system(command.c_str()), 0);
  std::istringstream lines(test::read_bytes(folder.path() / "rtk.pos"));
  int solved = 0;
  double worst = 0, worst_reported = 0;
  for (const simulation::Epoch& epoch : epochs) {
    ASSERT_TRUE(epoch.observed.fix.solved());
    worst_reported = std::max(worst_reported, epoch.error_enu_m.norm());
  }
  for (std::string line; std::getline(lines, line);) {
    const std::vector<std::string_view> cells = split_blanks(line);
    if (line.rfind('%', 0) == 0 || cells.size() < 7) continue;
    Eigen::Vector3d ecef;
    for (int i = 0; i < 3; ++i) ecef[i] = *parse_double(cells[static_cast<std::size_t>(2 + i)]);
    worst = std::max(worst, (ecef - epochs.front().truth_ecef).norm());
    ++solved;
  }
  std::cout << solved << " fixes of rnx2rtkp, within " << worst << " m; own within " << worst_reported
            << " m\n";
  EXPECT_GT(solved, 55);
  EXPECT_LT(worst_reported, 1e-3);
  EXPECT_LT(worst, 0.1);
}

/// Numbers of an observation file of version 3 as they are printed, by tag of the epoch, satellite and type:
/// columns by RINEX 3.04, table A3.
std::map<std::string, std::string> printed_numbers(const std::string& text) {
  std::map<std::string, std::string> numbers;
  std::map<char, std::vector<std::string>> types;
  std::istringstream lines(text);
  std::string epoch;
  char system = ' ';
  for (std::string line; std::getline(lines, line);) {
    if (line[0] == '>') {
      epoch = line.substr(2, 27);
    } else if (epoch.empty()) {
      if (line.substr(60, 19) != "SYS / # / OBS TYPES") continue;
      if (line[0] != ' ') system = line[0];
      const std::string listed = line.substr(6, 54);
      for (const std::string_view type : split_blanks(listed)) types[system].emplace_back(type);
    } else {
      for (std::size_t k = 0; k < types[line[0]].size() && 3 + 16 * k < line.size(); ++k) {
        const std::string number(trim(column(line, 3 + 16 * k, 14)));
        if (!number.empty()) numbers[epoch + line.substr(0, 3) + types[line[0]][k]] = number;
      }
    }
  }
  return numbers;
}

// Every number of a file with all bands is read back, and nothing else: a Doppler of zero is not missing.
TEST(Signals, ComeBackToThePrintedDigit) {
  const test::TemporaryFolder folder;
  (void)test::run_and_write(
      test::prepare(
          open_sky("sky: {nominal: true, systems: [GPS, GLONASS, Galileo, BeiDou]}\n"
                   "start: 2026-03-01T10:00:00Z\n",
                   "{name: rover, profile: survey, tracks: [L1CA, L1C, L2C, L5, E1, E5a, E5b, B1I, B1C, B2I, "
                   "B2a, B3I, G1, G2]}",
                   20),
          folder.path()),
      folder.path());
  auto printed = printed_numbers(test::read_bytes(folder.path() / "receiver.obs"));
  ASSERT_GT(printed.size(), 5000U);
  rinex::ObservationOptions all;
  all.all_signals = true;
  const auto file = rinex::read_rinex_observations(folder.path() / "receiver.obs", all);
  EXPECT_THAT(file.report.lines(), testing::IsEmpty());
  std::set<const gnss::Signal*> signals;
  for (const rinex::ObservationEpoch& epoch : file.epochs) {
    const geodesy::CalendarTime c = geodesy::calendar_from_gps(epoch.receiver_time);
    const std::string tag = fmt::format("{:04d} {:02d} {:02d} {:02d} {:02d} {:2d}.{:07d}", c.year, c.month,
                                        c.day, c.hour, c.minute, c.second, c.nanosecond / 100);
    for (const rinex::ObservedSignal& s : epoch.signals) {
      signals.insert(s.signal);
      const std::pair<char, std::optional<double>> values[] = {
          {'C', s.pseudorange_m}, {'L', s.carrier_phase_cycles}, {'D', s.doppler_hz}, {'S', s.cn0_dbhz}};
      for (const auto& [kind, value] : values) {
        const auto at = printed.find(tag + gnss::to_string(s.id) + kind + s.code.data());
        ASSERT_EQ(value.has_value(), at != printed.end())
            << tag << gnss::to_string(s.id) << kind << s.code.data();
        if (!value) continue;
        EXPECT_EQ(fmt::format("{:.3f}", *value), at->second);
        printed.erase(at);
      }
    }
  }
  EXPECT_THAT(printed, testing::IsEmpty());
  EXPECT_EQ(signals.size(), 13U) << "every one of these systems but B2I, which BeiDou-2 alone sends";
}

TEST(Signals, ThatAreNoneAreToldSo) {
  const test::TemporaryFolder folder;
  const auto fault = [&](const std::string& tracks) -> std::string {
    return test::refusal([&] {
      (void)test::prepare(
          open_sky(kNominal, "{name: rover, profile: ideal, elevation_mask_deg: 10, tracks: " + tracks + "}"),
          folder.path());
    });
  };
  EXPECT_THAT(fault("[L1CA, E6]"),
              testing::AllOf(testing::HasSubstr("tracks"), testing::HasSubstr("no receiver here tracks E6"),
                             testing::HasSubstr("E5a")));
  EXPECT_THAT(fault("[L1CA, L1CA]"), testing::HasSubstr("'L1CA' is given twice"));
  EXPECT_EQ(fault("[L5]"), "");
}

// A receiver's own delays: the part common to a system belongs to its clock, the parts of channels and bands
// do not.
TEST(Signals, BiasesOfTheReceiverGoWhereTheyBelong) {
  const test::TemporaryFolder folder;
  const auto epochs = test::run_and_write(
      test::prepare(open_sky(kNominal,
                             "{name: plain, profile: ideal, elevation_mask_deg: 10, tracks: [L1CA, L5, G1, "
                             "E1, B1I], noise: {enabled: false}}, "
                             "{name: systems, profile: ideal, elevation_mask_deg: 10, tracks: [L1CA, L5, G1, "
                             "E1, B1I], noise: {enabled: false}, biases: {code_m: "
                             "[GLONASS=30, E1=-7, L5=4]}}, "
                             "{name: channels, profile: ideal, elevation_mask_deg: 10, tracks: [L1CA, G1], "
                             "noise: {enabled: false}, biases: {glonass_channel_m: "
                             "0.5}}, "
                             "{name: drifts, profile: ideal, elevation_mask_deg: 10, tracks: [L1CA, G1, E1, "
                             "B1I], noise: {enabled: false}, biases: {drift_sigma_m: "
                             "2, drift_time_s: 1}}, "
                             "{name: choosy, profile: ideal, elevation_mask_deg: 10, exclude_signals: "
                             "[BeiDou-GEO, GPS-IIR], noise: {enabled: false}}",
                             300),
                    folder.path()),
      folder.path());
  double square_m2 = 0;
  int drifted = 0, geostationary = 0, old = 0, others = 0;
  for (std::size_t i = 0; i < epochs.size(); i += 5) {
    const receiver::ReceiverEpoch& plain = epochs[i].observed;
    const positioning::Fix &fix = plain.fix, &biased = epochs[i + 1].observed.fix;
    ASSERT_TRUE(fix.solved() && biased.solved());
    // The fix uses satellite positions by the biased pseudorange, 0.1 us off.
    EXPECT_LT((fix.position_ecef - biased.position_ecef).norm(), 1e-4);
    for (const auto& [system, bias_m] : {std::pair(gnss::System::GPS, 0.0),
                                         {gnss::System::GLONASS, 30.0},
                                         {gnss::System::Galileo, -7.0},
                                         {gnss::System::BeiDou, 0.0}}) {
      EXPECT_NEAR(geodesy::kSpeedOfLight * (biased.clock_bias_s.at(system) - fix.clock_bias_s.at(system)),
                  bias_m, 1e-4);
    }
    std::set<double> biases_m;  // of systems with drifting biases
    for (std::size_t k = 0; k < plain.satellites.size(); ++k) {
      const SatelliteObservation &a = plain.satellites[k], &b = epochs[i + 1].observed.satellites[k];
      if (!a.measurement) continue;
      EXPECT_EQ(b.pseudorange_error_m, a.pseudorange_error_m);
      if (!a.more.empty() && a.more[0].measurement) {
        EXPECT_NEAR(b.more[0].measurement->pseudorange_m - a.more[0].measurement->pseudorange_m, 4, 1e-6);
      }
      for (const SatelliteObservation& c : epochs[i + 2].observed.satellites) {
        if (c.id != a.id) continue;
        const double channel = a.id.system == gnss::System::GLONASS
                                   ? std::round((a.measurement->carrier_frequency_hz - 1602e6) / 0.5625e6)
                                   : 0;
        EXPECT_NEAR(c.measurement->pseudorange_m - a.measurement->pseudorange_m, 0.5 * channel, 1e-6);
      }
      for (const SatelliteObservation& d : epochs[i + 3].observed.satellites) {
        if (d.id != a.id) continue;
        EXPECT_NEAR(d.measurement->pseudorange_m - a.measurement->pseudorange_m,
                    d.term_m(receiver::RangeTermId::Bias), 1e-6);
        if (!biases_m.insert(d.term_m(receiver::RangeTermId::Bias)).second) continue;
        square_m2 += square(d.term_m(receiver::RangeTermId::Bias));
        ++drifted;
      }
    }
    EXPECT_EQ(biases_m.size(), 4U);
    for (const SatelliteObservation& s : epochs[i + 4].observed.satellites) {
      if (s.id.system == gnss::System::BeiDou && (s.id.number <= 5 || s.id.number >= 59)) ++geostationary;
      if (gnss::block_of(s.id, epochs[i].observed.time) == "GPS-IIR") ++old;
      ++others;
    }
  }
  EXPECT_EQ(drifted, 4 * 301);
  // At a time constant of one epoch (1 + e^-2) / (1 - e^-2) fewer samples are independent; five deviations.
  EXPECT_NEAR(square_m2 / drifted, 4, 5 * 4 * std::sqrt(2 * 1.313 / drifted));
  EXPECT_EQ(geostationary, 0);
  EXPECT_EQ(old, 0);
  EXPECT_GT(others, 5000);
}

// With an uncorrected ionosphere: L1 alone is off by metres, two carriers are not; smoothed codes are less
// noisy, and their reported accuracy is valid.
TEST(Signals, AreCombinedAndSmoothedInFixes) {
  const test::TemporaryFolder folder;
  const std::string noise =
      "ionosphere: true, noise: {enabled: true, theta_per_s: 20, sigma_m_per_sqrt_s: 6.3}, signal: {lock: "
      "{warm_start: "
      "true}, enabled: "
      "true, antenna: survey, loop_noise: false}, tracks: [L1CA, L2C, E1, E5a]";
  const std::string clean = "ionosphere: true, noise: {enabled: false}, tracks: [L1CA, L2C, E1, E5a]";
  const auto epochs = test::run_and_write(
      test::prepare(
          open_sky("sky: {nominal: true, systems: [GPS, Galileo], errors: {enabled: false}}\nstart: "
                   "2026-03-01T10:00:00Z\n",
                   "{name: one, profile: ideal, elevation_mask_deg: 10, " + clean +
                       "}, {name: all, profile: ideal, elevation_mask_deg: 10, " + clean +
                       ", combination: uncombined, ionosphere_sigma_m: 100}, {name: modelled, profile: "
                       "ideal, elevation_mask_deg: 10, " +
                       clean +
                       ", combination: uncombined, correct_ionosphere: true}, {name: raw, profile: ideal, "
                       "elevation_mask_deg: 10, " +
                       noise +
                       ", combination: uncombined}, {name: smooth, profile: ideal, elevation_mask_deg: 10, " +
                       noise +
                       ", combination: uncombined, smoothing: {method: divergence_free, window_s: 60}}",
                   300),
          folder.path()),
      folder.path());
  double raw = 0, smooth = 0, reported = 0, worst_all = 0, worst_modelled = 0, best_one = 1e9,
         worst_estimate = 0;
  int count = 0;
  for (const simulation::Epoch& epoch : epochs) {
    ASSERT_TRUE(epoch.observed.fix.solved());
    const double error_m = epoch.error_enu_m.norm();
    if (epoch.receiver == 0) best_one = std::min(best_one, error_m);
    if (epoch.receiver == 1) worst_all = std::max(worst_all, error_m);
    if (epoch.receiver == 2) worst_modelled = std::max(worst_modelled, error_m);
    for (const SatelliteObservation& s : epoch.observed.satellites) {
      if (epoch.receiver > 2 || epoch.receiver == 0 || !s.estimated_ionosphere_m) continue;
      const double l1_m =
          s.term_m(receiver::RangeTermId::Ionosphere) * square(s.signal->carrier_hz / gnss::kL1_hz);
      worst_estimate = std::max(worst_estimate, std::abs(*s.estimated_ionosphere_m - l1_m));
    }
    if (epoch.receiver < 3 || epoch.observed.time < epochs.front().observed.time + 120.0) continue;
    (epoch.receiver == 3 ? raw : smooth) += epoch.error_enu_m.squaredNorm();
    if (epoch.receiver == 4) reported += epoch.observed.fix.covariance_enu.trace();
    count += epoch.receiver == 4;
  }
  EXPECT_GT(best_one, 1);
  EXPECT_LT(worst_all, 0.05);  // the prior of 100 m leaves 0.1 %
  EXPECT_LT(worst_modelled, 1e-3);
  EXPECT_LT(worst_estimate, 0.05);
  EXPECT_LT(std::sqrt(smooth), 0.25 * std::sqrt(raw));
  EXPECT_GT(std::sqrt(smooth / reported), 0.3);
  EXPECT_LT(std::sqrt(smooth / reported), 2);
  EXPECT_EQ(count, 181);
}

TEST(Signals, WrongChoicesAreToldTheRightOnes) {
  const auto message = [](const std::string& receiver) {
    const test::TemporaryFolder folder;
    return test::refusal(
        [&] { static_cast<void>(test::prepare(open_sky(kNominal, receiver), folder.path())); });
  };
  using testing::AllOf;
  using testing::HasSubstr;
  EXPECT_EQ(message("{name: a, profile: ublox-m8t, tracks: [L1CA, E1]}"), "");
  EXPECT_THAT(message("{name: a, profile: ublox-m8t, tracks: [L1CA, L5]}"),
              AllOf(HasSubstr("L5"), HasSubstr("antenna 'patch'"), HasSubstr("dual_patch")));
  EXPECT_EQ(message("{name: a, profile: ublox-m8t, signal: {antenna: dual_patch}, tracks: [L1CA, L5]}"), "");
  EXPECT_THAT(message("{name: a, profile: ideal, elevation_mask_deg: 10, tracks: [L1CA, E7]}"),
              AllOf(HasSubstr("'E7'"), HasSubstr("E5a")));
  EXPECT_THAT(message("{name: a, profile: ideal, elevation_mask_deg: 10, uses: [L5]}"),
              AllOf(HasSubstr("uses L5"), HasSubstr("tracks")));
  EXPECT_EQ(message("{name: a, profile: ideal, elevation_mask_deg: 10, uses: [L1CA]}"), "");
  EXPECT_THAT(message("{name: a, profile: ideal, elevation_mask_deg: 10, exclude_signals: [GEO]}"),
              AllOf(HasSubstr("'GEO'"), HasSubstr("BeiDou-GEO")));
  EXPECT_THAT(message("{name: a, profile: ideal, elevation_mask_deg: 10, biases: {code_m: [Compass=3]}}"),
              HasSubstr("'Compass'"));
  EXPECT_THAT(message("{name: a, profile: ideal, elevation_mask_deg: 10, sigma_factor: [GPS=0]}"),
              HasSubstr("sigma_factor"));
}

}  // namespace
}  // namespace canyon
