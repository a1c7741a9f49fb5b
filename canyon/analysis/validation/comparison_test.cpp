#include "canyon/analysis/validation/comparison.hpp"

#include <gtest/gtest.h>

#include <gmock/gmock.h>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "canyon/analysis/validation/metrics.hpp"
#include "canyon/analysis/validation/statistics.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/sky/gnss/signals.hpp"
#include "tests/support/disturbances.hpp"
#include "tests/support/simulated_recording.hpp"
#include "tests/support/simulation_support.hpp"

namespace canyon::validation {
namespace {

using canyon::test::SimulatedRecording;
using simulation::test::error_of;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

Registration moved_by(double east_m, double north_m) {
  Registration r;
  r.east_m = east_m;
  r.north_m = north_m;
  return r;
}

// By hand: the map's (12, 0) is rotated by 90 degrees about (10, 0) to (10, 2) and moved by (3, -2) to (13,
// 0).
TEST(Registration, PlacesByHand) {
  Registration r = moved_by(3, -2);
  r.heading_rad = geodesy::kPi / 2;
  r.pivot = {10, 0};
  EXPECT_LT((r.point_in_map({13, 0, 5}) - Eigen::Vector3d(12, 0, 5)).norm(), 1e-12);
  // East in the map is north in the world.
  EXPECT_LT((r.direction_in_city({0, 1, 0}) - Eigen::Vector3d(1, 0, 0)).norm(), 1e-15);
  EXPECT_EQ(r.direction_in_city({0, 0, 1}), Eigen::Vector3d(0, 0, 1));
  // A direction is the difference of two points.
  const Eigen::Vector3d a(1, 2, 3), b(-4, 7, 9);
  EXPECT_LT((r.point_in_map(b) - r.point_in_map(a) - r.direction_in_city(b - a)).norm(), 1e-12);
  EXPECT_EQ(Registration{}.point_in_map(a), a);
}

// Moving the map twice: a point is transformed back through both moves, the second one first.
TEST(Registration, OneMoveAfterAnother) {
  Registration first = moved_by(3, -2);
  first.heading_rad = 0.3;
  first.pivot = {10, 4};
  Registration second = moved_by(-1, 5);
  second.heading_rad = -0.8;
  second.pivot = {-7, 20};
  const Registration both = first.then(-1, 5, -0.8, {-7, 20});
  for (const Eigen::Vector3d& p : {Eigen::Vector3d(0, 0, 2), Eigen::Vector3d(35, -12, 7)}) {
    EXPECT_LT((both.point_in_map(p) - first.point_in_map(second.point_in_map(p))).norm(), 1e-12);
  }
  EXPECT_LT((both.direction_in_city({1, 2, 3}) - first.direction_in_city(second.direction_in_city({1, 2, 3})))
                .norm(),
            1e-12);
}

TEST(Segments, FollowTheStreets) {
  EXPECT_TRUE(street_segments({}).empty());
  std::vector<Eigen::Vector3d> points;
  const auto go = [&points](double east, double north, int steps) {
    for (int i = 0; i < steps; ++i) points.push_back(points.back() + Eigen::Vector3d(east, north, 0));
  };
  points.push_back(Eigen::Vector3d::Zero());
  go(5, 0, 20);                                                  // 100 m east
  for (int i = 0; i < 30; ++i) points.push_back(points.back());  // stationary
  go(3.5, 3.5, 4);                                               // a curve of 20 m
  go(0, 5, 20);                                                  // 100 m north
  go(-0.5, 5, 20);                                               // bent by 6 degrees: the same street
  go(-5, 0, 4);  // 20 m west, then the drive ends: not a separate street
  const std::vector<StreetSegment> segments = street_segments(points);
  ASSERT_EQ(segments.size(), 2U);
  EXPECT_EQ(segments[0].first, 0U);
  EXPECT_EQ(segments[1].first, segments[0].count);
  EXPECT_EQ(segments[0].count + segments[1].count, points.size());
  // The curve at 45 degrees belongs to either; with it the street still has mostly one direction.
  EXPECT_NEAR(segments[0].heading_deg, 90, 10);
  EXPECT_NEAR(segments[1].heading_deg, 355, 10);
  EXPECT_NEAR(segments[0].length_m + segments[1].length_m,
              100 + 4 * std::hypot(3.5, 3.5) + 100 + 20 * std::hypot(5, 0.5) + 20, 1e-9);

  const std::vector<Eigen::Vector3d> is_stationary(7, Eigen::Vector3d(1, 2, 3));
  const auto one = street_segments(is_stationary);
  ASSERT_EQ(one.size(), 1U);
  EXPECT_EQ(one[0].count, 7U);
  EXPECT_EQ(one[0].length_m, 0);
}

/// Differences of measured and simulated, of satellites in both.
struct Agreement {
  std::size_t both = 0, only_one = 0, predictions = 0, nlos_measured = 0;
  std::vector<double> error_m, cn0_db, fix_m;
};
Agreement agreement(const Comparison& comparison) {
  Agreement a;
  for (const ComparedEpoch& epoch : comparison.epochs) {
    EXPECT_EQ(epoch.fix.measured.used, epoch.fix.simulated.used);
    if (epoch.fix.measured.solved && epoch.fix.simulated.solved) {
      a.fix_m.push_back((epoch.fix.measured.error_enu_m - epoch.fix.simulated.error_enu_m).norm());
    }
    for (std::size_t i = epoch.first; i < epoch.first + epoch.count; ++i) {
      const ComparedSatellite& s = comparison.satellites[i];
      if (s.measured.tracked != s.simulated.tracked) ++a.only_one;
      EXPECT_EQ(s.used.measured, s.used.simulated);
      if (!s.clear && s.measured.tracked) {
        ++a.nlos_measured;
        a.predictions += s.prediction ? 1 : 0;
      }
      if (!s.measured.tracked || !s.simulated.tracked || epoch.clock != ClockSource::Clear) continue;
      ++a.both;
      a.error_m.push_back(std::abs(*s.measured.error_m - *s.simulated.error_m));
      if (s.measured.cn0_dbhz) a.cn0_db.push_back(std::abs(*s.measured.cn0_dbhz - *s.simulated.cn0_dbhz));
    }
  }
  return a;
}

// The simulated receiver has its disturbances: one satellite is removed from it, the others do not change.
TEST(Comparison, HonoursDisturbances) {
  const SimulatedRecording recorded;
  const Recording recording = recorded.read();
  simulation::ReceiverConfig receiver = recorded.scenario().receivers.front();
  const auto compared = [&] { return compare(recording, receiver, recorded.environment(), {}, 1); };
  const Comparison plain = compared();
  const auto seen = std::find_if(plain.satellites.begin(), plain.satellites.end(),
                                 [](const ComparedSatellite& s) { return s.simulated.tracked; });
  ASSERT_NE(seen, plain.satellites.end());
  receiver.disturbances = {canyon::test::without(seen->id)};
  const Comparison disturbed = compared();
  std::size_t i = 0;
  for (const ComparedSatellite& before : plain.satellites) {
    if (before.id == seen->id) continue;
    ASSERT_LT(i, disturbed.satellites.size());
    const ComparedSatellite& after = disturbed.satellites[i++];
    ASSERT_EQ(after.id, before.id);
    ASSERT_EQ(after.simulated.error_m.has_value(), before.simulated.error_m.has_value());
    // Errors are relative to the clock from the other satellites.
    if (before.simulated.error_m) {
      ASSERT_NEAR(*after.simulated.error_m, *before.simulated.error_m, 1e-9);
    }
  }
  EXPECT_EQ(i, disturbed.satellites.size());
  EXPECT_LT(i, plain.satellites.size());
}

// Canyon's own receiver, recorded in a city 3 m east and 2 m south of its map and rotated by a degree:
// simulated in the map moved likewise, the result is the same.
TEST(Comparison, RecordedReceiverIsItsOwnSimulation) {
  Registration moved = moved_by(3, -2);
  moved.heading_rad = geodesy::radians(1);
  moved.pivot = {20, 30};
  const SimulatedRecording recorded(moved);
  const Recording recording = recorded.read();
  // Reception times are recovered within a microsecond: the first or last may be outside the truth's span.
  EXPECT_GE(recording.residuals.epochs.size() + 2, recorded.epochs().size());
  const simulation::ReceiverConfig& receiver = recorded.scenario().receivers.front();
  CompareOptions options;
  options.name = "itself";
  std::size_t reported = 0;
  options.progress = [&reported](std::size_t done, std::size_t) { reported = done; };
  const Comparison comparison = compare(recording, receiver, recorded.environment(), moved, 1, options);
  EXPECT_EQ(comparison.name, "itself");
  EXPECT_EQ(reported, comparison.epochs.size());
  const Agreement a = agreement(comparison);
  std::printf("%zu observations of both, %zu of one; errors differ by %.2g m at most, fixes by %.2g m\n",
              a.both, a.only_one, quantile(a.error_m, 1).value(), quantile(a.fix_m, 1).value());
  EXPECT_GT(a.both, 1500U);
  EXPECT_LE(a.only_one, 3U);  // rays within micrometres of an edge
  EXPECT_GT(a.nlos_measured, 100U);
  EXPECT_EQ(a.predictions, a.nlos_measured);
  // RINEX has millimetres, and one satellite may determine the clock; fixes have that error times their DOP.
  EXPECT_LT(quantile(a.error_m, 0.99).value(), 3e-3);
  EXPECT_LT(quantile(a.fix_m, 0.99).value(), 0.02);

  // Predictions without strength: the shortest path, which is the total error of an NLOS signal.
  std::vector<double> off;
  for (const ComparedSatellite& s : comparison.satellites) {
    if (s.prediction && s.measured.error_m)
      off.push_back(std::abs(*s.measured.error_m - s.prediction->excess_m));
  }
  EXPECT_LT(quantile(off, 0.99).value(), 3e-3);

  // With the unmoved map it is another city.
  const Comparison unmoved = compare(recording, receiver, recorded.environment(), {}, 1);
  std::size_t different = 0;
  for (std::size_t i = 0; i < unmoved.satellites.size(); ++i) {
    different += unmoved.satellites[i].clear != comparison.satellites[i].clear ? 1 : 0;
  }
  EXPECT_GT(different, 50U);

  // Segments cover the drive.
  std::size_t covered = 0;
  for (const StreetSegment& s : comparison.segments) covered += s.count;
  EXPECT_EQ(covered, comparison.epochs.size());
  EXPECT_EQ(comparison.segments.size(), 7U);  // seven legs of 76 m and more

  // The same on one thread.
  options.threads = 1;
  const Comparison again = compare(recording, receiver, recorded.environment(), moved, 1, options);
  ASSERT_EQ(again.satellites.size(), comparison.satellites.size());
  for (std::size_t i = 0; i < again.satellites.size(); ++i) {
    ASSERT_EQ(again.satellites[i].simulated.error_m, comparison.satellites[i].simulated.error_m);
  }
}

// Each epoch is a second. A satellite that was never recorded counts only if it was clear and above 15 deg
// for two minutes.
TEST(Comparison, NamesSatellitesThatWereNeverTracked) {
  Comparison comparison;
  const geodesy::GpsTime start = geodesy::GpsTime::from_week(2051, 45200);
  const gnss::Signal* other = &gnss::signals_of(gnss::System::GPS)[1];
  for (int e = 0; e < 200; ++e) {
    ComparedEpoch epoch;
    epoch.time = start + e;
    epoch.first = comparison.satellites.size();
    const auto add = [&](int prn, double elevation_deg, bool clear) -> ComparedSatellite& {
      ComparedSatellite s;
      s.id = {gnss::System::GPS, static_cast<std::uint8_t>(prn)};
      s.elevation_rad = geodesy::radians(elevation_deg);
      s.clear = clear;
      return comparison.satellites.emplace_back(s);
    };
    add(1, 45, true);
    add(2, 45, true).measured.tracked = e == 199;  // tracked once
    add(3, 14, true);                              // too low
    add(4, 45, e < 119);                           // clear for too short
    add(5, 16, e % 10 < 6);                        // 120 s in pieces
    add(6, 45, false);                             // never clear
    ComparedSignal further;
    further.signal = other;
    further.measured.tracked = true;
    add(7, 45, true).more.push_back(further);  // by another signal
    epoch.count = comparison.satellites.size() - epoch.first;
    comparison.epochs.push_back(epoch);
  }
  const std::vector<NeverTracked> never = never_tracked(comparison);
  ASSERT_EQ(never.size(), 2U);
  EXPECT_EQ(gnss::to_string(never[0].id), "G01");
  EXPECT_NEAR(never[0].clear_s, 200, 1e-6);
  EXPECT_EQ(gnss::to_string(never[1].id), "G05");
  EXPECT_NEAR(never[1].clear_s, 120, 1e-6);
  EXPECT_EQ(never_tracked(comparison, geodesy::radians(13)).size(), 3U);
  EXPECT_EQ(never_tracked(comparison, geodesy::radians(15), 119).size(), 3U);
}

// A satellite that is left out is missing everywhere, and the others do not change.
TEST(Comparison, LeavesSatellitesOut) {
  const SimulatedRecording recorded;
  const Recording recording = recorded.read();
  const simulation::ReceiverConfig& receiver = recorded.scenario().receivers.front();
  const Comparison plain = compare(recording, receiver, recorded.environment(), {}, 1);
  const auto used = std::find_if(plain.satellites.begin(), plain.satellites.end(),
                                 [](const ComparedSatellite& s) { return s.used.simulated; });
  ASSERT_NE(used, plain.satellites.end());
  CompareOptions options;
  options.leave_out = {used->id};
  const Comparison without = compare(recording, receiver, recorded.environment(), {}, 1, options);
  std::size_t i = 0;
  for (const ComparedSatellite& before : plain.satellites) {
    if (before.id == used->id) continue;
    ASSERT_LT(i, without.satellites.size());
    ASSERT_EQ(without.satellites[i].id, before.id);
    const ComparedSatellite& after = without.satellites[i++];
    ASSERT_EQ(after.simulated.error_m.has_value(), before.simulated.error_m.has_value());
    if (before.simulated.error_m) {
      ASSERT_NEAR(*after.simulated.error_m, *before.simulated.error_m, 1e-9);
    }
  }
  EXPECT_EQ(i, without.satellites.size());
  EXPECT_LT(i, plain.satellites.size());
}

// Rays that are traced once are used by several receivers, with the results of single ones.
TEST(Comparison, SeveralReceiversAreEachAsIfAlone) {
  const SimulatedRecording recorded({}, test::with_strength);
  const Recording recording = recorded.read();
  simulation::ReceiverConfig one = recorded.scenario().receivers.front(), other = one;
  one.options.signal.cn0_sigma_db = other.options.signal.cn0_sigma_db = 1;
  other.options.signal.link.above_minimum_db -= 6;
  const std::vector<SeededReceiver> receivers{{&one, 1}, {&one, 2}, {&other, 2}};
  const std::vector<Comparison> together = compare(recording, receivers, recorded.environment(), {});
  ASSERT_EQ(together.size(), receivers.size());
  const auto strengths = [](const Comparison& comparison) {
    std::vector<double> all;
    for (const ComparedSatellite& s : comparison.satellites) {
      all.push_back(s.simulated.cn0_dbhz.value_or(-1));
      all.push_back(s.simulated.error_m.value_or(-1));
    }
    return all;
  };
  for (std::size_t i = 0; i < receivers.size(); ++i) {
    const Comparison alone =
        compare(recording, *receivers[i].receiver, recorded.environment(), {}, receivers[i].seed);
    EXPECT_EQ(strengths(together[i]), strengths(alone)) << i;
  }
  EXPECT_NE(strengths(together[0]), strengths(together[1]));
  EXPECT_NE(strengths(together[1]), strengths(together[2]));
}

// Canyon's own receiver writes its fixes as NMEA; at the recorder's epochs they have the errors of its fixes
// (minutes of GGA to 1e-6, 2 mm, and times to 1 ms, 6 mm at 6 m/s).
TEST(Comparison, OwnFixesAndThePositionFilter) {
  const SimulatedRecording recorded;
  const Recording recording = recorded.read();
  std::size_t next = 0, compared = 0;
  for (const simulation::Epoch& epoch : recorded.epochs()) {
    if (!epoch.observed.fix.solved()) continue;
    while (next < recording.reported_fixes.size() &&
           recording.reported_fixes[next].time - epoch.observed.time < -0.1)
      ++next;
    if (next == recording.reported_fixes.size()) break;
    const Recording::ReportedFix& own = recording.reported_fixes[next];
    if (own.time - epoch.observed.time > 0.1) continue;  // the truth's first or last instant
    const Eigen::Vector3d error_enu_m =
        geodesy::enu_from_ecef_rotation(epoch.truth.position) *
        (epoch.observed.fix.position_ecef - geodesy::ecef_from_geodetic(epoch.truth.position));
    EXPECT_LT((own.error_enu_m - error_enu_m).head<2>().norm(), 0.01);
    ++compared;
  }
  EXPECT_GT(compared, recorded.epochs().size() / 2);

  // The filter over the recorded measurements equals that over the simulated ones, since these are equal, and
  // differs from fixes of single epochs.
  const simulation::ReceiverConfig& receiver = recorded.scenario().receivers.front();
  simulation::ReceiverConfig filtering = receiver;
  filtering.options.filter.enabled = true;
  const Comparison plain = compare(recording, receiver, recorded.environment(), {}, 1);
  const Comparison filtered = compare(recording, filtering, recorded.environment(), {}, 1);
  EXPECT_FALSE(plain.filtered);
  EXPECT_TRUE(filtered.filtered);
  std::vector<double> between_m, from_single_m;
  for (std::size_t e = 0; e < filtered.epochs.size(); ++e) {
    const ComparedEpoch& f = filtered.epochs[e];
    EXPECT_EQ(f.fix.measured.solved, plain.epochs[e].fix.measured.solved);
    EXPECT_EQ(f.fix.simulated.used, plain.epochs[e].fix.simulated.used);
    EXPECT_FALSE(plain.epochs[e].filter.measured.solved);
    if (!f.filter.measured.solved || !f.filter.simulated.solved || !f.fix.measured.solved) continue;
    between_m.push_back((f.filter.measured.error_enu_m - f.filter.simulated.error_enu_m).norm());
    from_single_m.push_back((f.filter.measured.error_enu_m - f.fix.measured.error_enu_m).norm());
  }
  ASSERT_GT(between_m.size(), 100U);
  EXPECT_LT(median(between_m).value(), 0.05);
  EXPECT_GT(median(from_single_m).value(), 0.1);

  const std::size_t count = plain.epochs.size() / 2;
  const PositionMetrics own = reported_fix_metrics(recording, plain, count, count);
  EXPECT_GT(own.fixes, count / 2);
  EXPECT_LE(own.fixes, count);
  EXPECT_FALSE(std::isfinite(own.mean_used));
  const ModelMetrics f = metrics(filtered, count, count, "second half");
  EXPECT_EQ(f.filtered.simulated.epochs, count);
  EXPECT_EQ(f.filtered.measured.reported, f.filtered.measured.fixes);
  EXPECT_GE(f.filtered.measured.horizontal_within[1], f.filtered.measured.horizontal_within[0]);
}

TEST(Comparison, SignalsWithStrengthComeBackToo) {
  const SimulatedRecording recorded({}, canyon::test::with_strength);
  const Recording recording = recorded.read();
  const Comparison comparison =
      compare(recording, recorded.scenario().receivers.front(), recorded.environment(), {}, 1);
  std::size_t differ = 0, all = 0, predicted = 0, blocked_tracked = 0;
  std::vector<double> fix_m, cn0_db;
  for (const ComparedEpoch& epoch : comparison.epochs) {
    if (epoch.fix.measured.solved && epoch.fix.simulated.solved) {
      fix_m.push_back((epoch.fix.measured.error_enu_m - epoch.fix.simulated.error_enu_m).norm());
    }
  }
  for (const ComparedSatellite& s : comparison.satellites) {
    ++all;
    differ += s.measured.tracked != s.simulated.tracked ? 1 : 0;
    if (s.measured.cn0_dbhz && s.simulated.cn0_dbhz) {
      cn0_db.push_back(std::abs(*s.measured.cn0_dbhz - *s.simulated.cn0_dbhz));
    }
    if (s.clear || !s.simulated.tracked) continue;
    ++blocked_tracked;
    predicted += s.prediction ? 1 : 0;
  }
  std::printf("%zu of %zu tracked by one only; C/N0 differs by %.2g dB in the median, fixes by %.2g m\n",
              differ, all, median(cn0_db).value_or(0), median(fix_m).value());
  EXPECT_LT(static_cast<double>(differ), 0.01 * static_cast<double>(all));
  EXPECT_GT(blocked_tracked, 100U);
  EXPECT_EQ(predicted, blocked_tracked);
  EXPECT_LT(median(fix_m).value(), 0.02);
  EXPECT_LT(median(cn0_db).value_or(0), 0.01);  // RINEX has three decimals
}

// A truth in another datum, at other heights or on another time scale would cause an error in all metrics.
TEST(Recording, SaysThatTheTruthIsElsewhere) {
  const SimulatedRecording recorded;
  const simulation::test::TemporaryFolder folder;
  const auto warnings = [&](const std::function<std::string(std::string)>& change) {
    std::ifstream in(recorded.truth_csv);
    std::string line, text;
    std::getline(in, line);
    text = line + "\n";
    while (std::getline(in, line)) text += change(line) + "\n";
    RecordingOptions options;
    options.ionosphere = options.troposphere = false;
    return read_recording(recorded.scenario(), recorded.environment(), recorded.obs,
                          folder.write("truth.csv", text), "csv", options)
        .warnings;
  };
  const auto added = [](std::size_t column, double value) {
    return [=](const std::string& line) {
      std::vector<std::string> fields;
      std::istringstream in(line);
      for (std::string field; std::getline(in, field, ',');) fields.push_back(field);
      fields.at(column) = std::to_string(std::stod(fields.at(column)) + value);
      return fields[0] + "," + fields[1] + "," + fields[2] + "," + fields[3];
    };
  };
  const auto logged = [](const std::string& what) { return testing::Contains(HasSubstr(what)); };
  EXPECT_THAT(warnings([](const std::string& line) { return line; }),
              testing::Not(logged("the pseudoranges put the antenna")));
  EXPECT_THAT(warnings(added(1, 0.002)), logged("-22"));
  EXPECT_THAT(warnings(added(1, 0.002)), logged("m north and"));
  EXPECT_THAT(warnings(added(3, 1000)), logged("m north and -99"));
  EXPECT_THAT(warnings([](std::string line) { return line.replace(line.find(" GPST"), 5, "Z"); }),
              AllOf(logged("where the truth is 1"), logged("s later")));
}

TEST(Recording, SaysWhatIsWrong) {
  const SimulatedRecording recorded;
  const simulation::test::TemporaryFolder folder;
  const auto read = [&](const std::filesystem::path& obs, const std::filesystem::path& truth,
                        const std::string& format, const simulation::Environment& environment) {
    RecordingOptions options;
    options.ionosphere = options.troposphere = false;
    return read_recording(recorded.scenario(), environment, obs, truth, format, options);
  };
  const simulation::Environment& environment = recorded.environment();

  // Truth of another day.
  const auto other_day = folder.write("other.csv",
                                      "time,latitude,longitude,height\n2025-01-01T00:00:00Z,22.3,114.17,"
                                      "5\n2025-01-01T00:01:00Z,22.3,114.17,5\n");
  const InputError outside = error_of([&] { (void)read(recorded.obs, other_day, "csv", environment); });
  EXPECT_THAT(outside.what(), AllOf(HasSubstr("car.obs"), HasSubstr("other.csv"), HasSubstr("2026-06-01"),
                                    HasSubstr("2025-01-01")));

  // A header without epochs.
  std::ifstream in(recorded.obs);
  std::string header, line;
  while (std::getline(in, line)) {
    header += line + "\n";
    if (line.find("END OF HEADER") != std::string::npos) break;
  }
  const auto empty = folder.write("empty.obs", header);
  EXPECT_THAT(error_of([&] { (void)read(empty, recorded.truth_csv, "csv", environment); }).what(),
              HasSubstr("empty.obs"));

  // No file, no RINEX, wrong format of the truth.
  EXPECT_THAT(error_of([&] {
                (void)read(folder.path() / "none.obs", recorded.truth_csv, "csv", environment);
              }).what(),
              HasSubstr("none.obs"));
  EXPECT_THAT(
      error_of([&] { (void)read(recorded.truth_csv, recorded.truth_csv, "csv", environment); }).what(),
      HasSubstr("truth.csv"));
  EXPECT_THAT(error_of([&] { (void)read(recorded.obs, recorded.truth_csv, "urbannav", environment); }).what(),
              HasSubstr("truth.csv"));

  // A sky without the recorded systems, and one of another day.
  simulation::SkyConfig glonass;
  glonass.nominal = true;
  glonass.systems = {gnss::System::GLONASS};
  const geodesy::GpsTime begin = recorded.epochs().front().observed.time;
  const simulation::Environment other = environment.under(
      simulation::build_sky(glonass, begin, begin + 300, environment.city().frame.origin()).sky);
  EXPECT_THAT(error_of([&] { (void)read(recorded.obs, recorded.truth_csv, "csv", other); }).what(),
              HasSubstr("car.obs"));
  simulation::SkyConfig gps = recorded.scenario().sky;
  const geodesy::GpsTime later = begin + 30 * 86400.0;
  const simulation::Environment late = environment.under(
      simulation::build_sky(gps, later, later + 300, environment.city().frame.origin()).sky);
  EXPECT_THAT(error_of([&] { (void)read(recorded.obs, recorded.truth_csv, "csv", late); }).what(),
              AllOf(HasSubstr("car.obs"), HasSubstr("ephemeris")));

  // Real recordings contain the ionosphere; the nominal sky has no coefficients for it.
  EXPECT_THROW(
      (void)read_recording(recorded.scenario(), environment, recorded.obs, recorded.truth_csv, "csv"),
      InputError);
}

TEST(Models, EachAddsToTheOneBefore) {
  const simulation::ReceiverConfig receiver;
  std::vector<std::string> keys;
  for (const Model& m : cumulative_models(receiver)) keys.push_back(m.key);
  EXPECT_THAT(keys, ElementsAre("mirror", "specular", "second", "tracking", "diffuse", "ground", "shadowing",
                                "diffraction"));
  for (const Model& m : cumulative_models(receiver)) EXPECT_NO_THROW(m.receiver.propagation.validate());
  const auto two = models_of(receiver, {"diffuse", "mirror"});
  ASSERT_EQ(two.size(), 2U);
  EXPECT_EQ(two[0].key, "mirror");
  EXPECT_EQ(two[0].receiver.propagation.model, propagation::Model::Mirror);
  EXPECT_TRUE(two[1].receiver.propagation.diffuse);
  EXPECT_FALSE(two[1].receiver.propagation.diffraction || two[1].receiver.options.signal.shadowing.enabled);
  EXPECT_FALSE(two[1].receiver.propagation.ground_reflection);
  EXPECT_TRUE(two[1].receiver.options.signal.enabled);
  EXPECT_THAT(error_of([&] { (void)models_of(receiver, {"difuse"}); }).what(),
              AllOf(HasSubstr("difuse"), HasSubstr("'diffuse'")));
}

}  // namespace
}  // namespace canyon::validation
