#include "canyon/analysis/bench/score.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <concepts>

#include "canyon/analysis/bench/drives.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/simulation_support.hpp"

namespace canyon::bench {
namespace {

namespace fs = std::filesystem;

using simulation::test::error_of;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const geodesy::LocalFrame kFrame(geodesy::Geodetic::from_degrees(48, 11, 500));

std::string position(double east_m, double north_m) {
  const geodesy::Geodetic at = kFrame.geodetic_from_local({east_m, north_m, 0});
  return fmt::format("{:.10f},{:.10f}", geodesy::degrees(at.latitude_rad),
                     geodesy::degrees(at.longitude_rad));
}

/// A minute east at 5 m/s, five times a second; fixes are 20 m too far north from 10 to 20 s.
class BenchScore : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string truth = "time_s,latitude_deg,longitude_deg,height_m,heading_deg\n", fixes = truth;
    for (int k = 0; k <= 300; ++k) {
      const double t = 0.2 * k;
      truth += fmt::format("{:.1f},{},500,90\n", t, position(5 * t, 0));
      fixes += fmt::format("{:.1f},{},500,\n", t, position(5 * t, t >= 10 && t <= 20 ? 20 : 0));
    }
    write_file(folder_.path() / "truth.csv", truth);
    write_file(folder_.path() / "fixes.csv", fixes);
    write_file(folder_.path() / "events.csv",
               "start_s,end_s,kind,bias_east_m,bias_north_m,bias_up_m,nlos,inputs\n"
               "10.0,20.0,outlier,0,20,0,,fixes\n");
    write_file(folder_.path() / "card.yaml", "bench: 1\nbegin_unix_s: 1780300800.000000000\n");
  }

  /// An estimate north of the truth by `north_m(t)`, with a covariance.
  template <std::invocable<double> North>
  Score scored(const North& north_m, double variance_m2 = 1) {
    std::string text = "time_s,latitude_deg,longitude_deg,heading_deg,cov_ee_m2,cov_en_m2,cov_nn_m2\n";
    for (int k = 0; k <= 300; ++k)
      text += fmt::format("{:.1f},{},{},{},0,{}\n", 0.2 * k, position(k, north_m(0.2 * k)), 95, variance_m2,
                          variance_m2);
    return scored(text);
  }
  Score scored(const std::string& text, const EstimateFacts& facts = {}) {
    write_file(folder_.path() / "mine.csv", text);
    const DriveFolder drive = read_drive(folder_.path());
    return score(drive, read_estimate(folder_.path() / "mine.csv", drive), 5, facts);
  }
  /// Rows at times `t(k)`, at the truth plus `north_m(k)`; no row if `t(k)` is negative.
  template <typename Time, typename North>
  static std::string rows(const Time& t, const North& north_m, int count) {
    std::string text = "time_s,latitude_deg,longitude_deg\n";
    for (int k = 0; k < count; ++k)
      if (t(k) >= 0) text += fmt::format("{:.4f},{}\n", t(k), position(5 * t(k), north_m(t(k))));
    return text;
  }
  std::string problem_of(const std::string& text) {
    return error_of([&] { (void)scored(text); }).what();
  }

  test::TemporaryFolder folder_;
};

TEST_F(BenchScore, FollowsOrRejectsAFault) {
  const Score half = scored([](double t) { return t >= 10 && t < 23 ? 10 : 0; });
  ASSERT_EQ(half.events.size(), 1U);
  EXPECT_NEAR(*half.events[0].followed, 0.5, 1e-3);
  EXPECT_NEAR(*half.events[0].largest_m, 10, 1e-3);
  EXPECT_NEAR(*half.events[0].recovery_s, 3, 0.21);
  EXPECT_NEAR(half.longest_divergence_s, 2.6, 0.3);  // fixes are good again from 20.2 s on
  const Score rejects = scored([](double) { return 0; });
  EXPECT_NEAR(*rejects.events[0].followed, 0, 1e-6);
  EXPECT_NEAR(*rejects.events[0].recovery_s, 0, 0.21);
  const Score lost = scored([](double t) { return t >= 10 ? 30 : 0; });
  EXPECT_FALSE(lost.events[0].recovery_s);
  EXPECT_NEAR(lost.longest_divergence_s, 39.8, 0.1);  // since the fixes are good again
}

TEST_F(BenchScore, HasTheFiguresOfTheField) {
  const Score s = scored([](double t) { return t < 30 ? 3 : 4; }, 4);
  EXPECT_NEAR(s.rmse_m, std::sqrt((150 * 9 + 151 * 16) / 301.), 1e-4);
  EXPECT_NEAR(s.p95_m, 4, 1e-4);
  EXPECT_NEAR(s.rpe_1s_m, std::sqrt(5 / 296.), 1e-4);  // five of 296 pairs contain the step of 1 m
  EXPECT_NEAR(s.rpe_10s_m, std::sqrt(50 / 251.), 1e-4);
  EXPECT_NEAR(*s.nees, (150 * 9 + 151 * 16) / 301. / 4, 1e-4);
  EXPECT_NEAR(*s.within_95, 1, 1e-12);  // 4^2 / 4 < 5.99
  EXPECT_NEAR(*s.heading_p95_deg, 5, 1e-9);
  EXPECT_EQ(s.availability, 1);
  EXPECT_NEAR(*scored([](double) { return 6; }, 1).misleading, 1, 1e-12);
}

TEST_F(BenchScore, TumAndUnixTimesAreTheSame) {
  std::string csv = "unix_s,latitude_deg,longitude_deg\n", tum;
  for (int k = 0; k <= 300; ++k) {
    csv += fmt::format("{:.3f},{}\n", 1780300800 + 0.2 * k, position(k, 2));
    tum += fmt::format("{:.3f} {} 2 0 0 0 0 1\n", 0.2 * k, k);
  }
  EXPECT_NEAR(scored(csv).rmse_m, 2, 1e-4);
  EXPECT_NEAR(scored(tum).rmse_m, 2, 1e-3);
  EXPECT_NEAR(*scored(tum).heading_p95_deg, 0, 1e-9);  // yaw 0 is east
}

// Rows from 20 to 39.8 s are missing; times farther than 0.75 s from the rows at 19.8 and 40 s are absent.
TEST_F(BenchScore, GapsCountAsAbsent) {
  const auto time = [](int k) { return k < 100 || k >= 200 ? 0.2 * k : -1; };
  EXPECT_NEAR(scored(rows(
                         time, [](double) { return 0; }, 301))
                  .availability,
              1 - 94 / 301., 1e-9);
}

// The truth itself at 1 Hz has no error, for any phase and jitter of its time stamps.
TEST_F(BenchScore, RatesOf1HzAreInterpolatedWhateverTheirStamps) {
  for (const double phase_s : {0., 0.2, 0.6})
    for (const double jitter_s : {0., 0.0004, 0.2}) {
      const Score s =
          scored(rows([&](int k) { return k + phase_s + k % 2 * jitter_s; }, [](double) { return 0; }, 59));
      EXPECT_LT(s.largest_m, 0.55) << phase_s << " "
                                   << jitter_s;  // 0.1 s before the first and after the last row
      EXPECT_LT(s.rmse_m, 0.05);
      EXPECT_GT(s.availability, 0.95);
    }
}

TEST_F(BenchScore, TimesOutsideTheRowsAreNotExtrapolated) {
  const Score late = scored(rows([](int k) { return 30 + 0.2 * k; }, [](double) { return 0; }, 151));
  EXPECT_NEAR(late.availability, 151 / 301., 1e-9);
}

// Neither an estimator that has not started nor a silent one diverges; the fix must be good at that time.
TEST_F(BenchScore, DivergesOnlyWhereFixAndEstimateAreThere) {
  const auto bad = [](double t) { return t < 3 ? 0 : 30; };
  EXPECT_NEAR(
      scored(rows([](int k) { return 5 + 0.2 * k; }, [](double) { return 0; }, 270)).longest_divergence_s, 0,
      1e-9);
  const auto silent = [](int k) { return k < 50 || k >= 200 ? 0.2 * k : -1; };
  // Bad from 3 s on, silent from 9.8 + 0.75 s on; fixes are bad from 10 s on, and the second interval is 40
  // to 60 s.
  EXPECT_NEAR(scored(rows(silent, bad, 301)).longest_divergence_s, 60 - 39.4, 1e-6);
}

TEST_F(BenchScore, HeadingCountsFromWhereTheVehicleMoved) {
  const auto with_rest = [](double t) { return t <= 2 ? 180.0 : 95.0; };  // 10 m are gone after 2 s
  std::string text = "time_s,latitude_deg,longitude_deg,heading_deg\n";
  for (int k = 0; k <= 300; ++k)
    text += fmt::format("{:.1f},{},{}\n", 0.2 * k, position(k, 0), with_rest(0.2 * k));
  EXPECT_NEAR(*scored(text).heading_p95_deg, 5, 1e-6);
}

TEST_F(BenchScore, FractionsCountAbsentTimes) {
  const auto time = [](int k) { return k < 150 ? 0.2 * k : -1; };
  const Score s = scored(rows(
      time, [](double t) { return t < 15 ? 1 : 4; }, 301));
  EXPECT_NEAR(s.within[0], 75 / 301., 1e-9);
  EXPECT_NEAR(s.within[1], 150 / 301., 1e-9);
  EXPECT_NEAR(s.within[2], 150 / 301., 1e-9);
}

TEST_F(BenchScore, EventsThatCannotBeScoredSayWhy) {
  std::vector<Limits> limits(1);
  limits[0].followed = 0.1;
  const auto always = [](int k) { return 0.2 * k; };
  const auto good = [](double) { return 0.; };
  const EventScore unread = scored(rows(always, good, 301), {{"raw", "imu"}, {}}).events[0];
  EXPECT_EQ(unread.state, EventState::NotRead);
  EXPECT_FALSE(unread.followed);
  EXPECT_FALSE(unread.recovery_s);
  EXPECT_EQ(scored(rows(always, good, 301), {{"fixes", "imu"}, {}}).events[0].state, EventState::Scored);
  const Score lost = scored(rows(
      always, [](double t) { return t > 3 ? 50 : 0; }, 301));
  EXPECT_EQ(lost.events[0].state, EventState::Lost);
  EXPECT_FALSE(lost.events[0].followed);
  EXPECT_THAT(violations("mine", lost, limits),
              ElementsAre("followed of 'outlier': the estimate is lost before it"));
  const Score absent = scored(rows([](int k) { return k < 45 || k > 130 ? 0.2 * k : -1; }, good, 301));
  EXPECT_EQ(absent.events[0].state, EventState::Absent);
  EXPECT_FALSE(absent.events[0].largest_m);
  EXPECT_THAT(to_json({{"a", "mine", 2, absent, {}}}), HasSubstr("\"largest_m\": null"));
  EXPECT_THAT(violations("mine", absent, limits),
              ElementsAre("followed of 'outlier': there is no estimate during it"));
}

// An estimate whose usual error is 8 m has recovered below that error, not below 5 m.
TEST_F(BenchScore, RecoveryComparesWithTheErrorWithoutTheFault) {
  const auto north_m = [](double t) { return t >= 10 && t < 23 ? 30. : 8.; };
  const auto always = [](int k) { return 0.2 * k; };
  EXPECT_FALSE(scored(rows(always, north_m, 301)).events[0].recovery_s);
  const EventScore event = scored(rows(always, north_m, 301), {{}, 8.5}).events[0];
  EXPECT_NEAR(event.bound_m, 8.5, 1e-12);
  EXPECT_NEAR(*event.recovery_s, 3, 0.21);
}

TEST_F(BenchScore, ImpossibleCovariancesAreRefusedAndSingularOnesCount) {
  const auto problem = [&](const std::string& head, const std::string& cells) {
    return problem_of("time_s,latitude_deg,longitude_deg," + head + "\n0,48,11," + cells + "\n");
  };
  EXPECT_THAT(problem("cov_ee_m2,cov_en_m2,cov_nn_m2", "-1,0,-1"),
              HasSubstr("mine.csv:2: the covariance is not positive semidefinite"));
  EXPECT_THAT(problem("cov_ee_m2,cov_en_m2,cov_nn_m2", "1,2,1"), HasSubstr("not positive semidefinite"));
  EXPECT_THAT(problem("cov_ee_m2", "1"), HasSubstr("mine.csv:2: one variance"));
  std::string text = "time_s,latitude_deg,longitude_deg,cov_ee_m2,cov_nn_m2\n";
  for (int k = 0; k <= 300; ++k)
    text += fmt::format("{:.1f},{},{}\n", 0.2 * k, position(k, 1), k % 10 == 0 ? "100,100" : "1e-9,0");
  const Score s = scored(text);
  EXPECT_NEAR(*s.within_95, 31 / 301., 1e-9);  // one in ten, without cov_en_m2
  EXPECT_NEAR(*s.nees, 1e6 * 270 / 301, 1e3);  // an error of 1 m over a deviation of 1 mm
}

TEST_F(BenchScore, BadEstimatesAreRefusedByLine) {
  EXPECT_THAT(problem_of("a,b\n1,2\n"), HasSubstr("mine.csv:1: there is no column 'time_s'"));
  EXPECT_THAT(problem_of("time_s,latitude_deg,longitude_deg,time_s\n"),
              HasSubstr("mine.csv:1: there are two columns 'time_s'"));
  EXPECT_THAT(problem_of("time_s,latitude_deg,longitude_deg\n1,48,11\n1,48,11\n"),
              HasSubstr("mine.csv:3: 1.000 s is not after"));
  EXPECT_THAT(problem_of("time_s,latitude_deg,longitude_deg\n1,480,11\n"),
              HasSubstr("mine.csv:2: this is not a latitude"));
  EXPECT_THAT(problem_of("time_s,latitude_deg,longitude_deg\n1,48\n"),
              HasSubstr("mine.csv:2: 2 fields under 3 names"));
  EXPECT_THAT(problem_of("0 1 2 3 0 0 0 1\n1 2 3\n"), HasSubstr("mine.csv:2: is not a line of TUM"));
  EXPECT_THAT(problem_of("time_s,latitude_deg,longitude_deg\n"), HasSubstr("has no rows"));
  // Positions are checked in each row and in both formats.
  EXPECT_THAT(problem_of("time_s,latitude_deg,longitude_deg\n1,48,11\n2,-20,300\n"),
              HasSubstr("mine.csv:3: the position is"));
  EXPECT_THAT(problem_of("time_s,latitude_deg,longitude_deg,height_m\n1,48,11,1e300\n"),
              HasSubstr("mine.csv:2: the position is"));
  EXPECT_THAT(problem_of("0 691000 5334000 500 0 0 0 1\n"), HasSubstr("mine.csv:1: the position is"));
  EXPECT_THAT(problem_of("time_s,latitude_deg,longitude_deg\n1,0.84,0.19\n"),
              HasSubstr("mine.csv:2: the position is 4726 km"));
  // The same for times.
  EXPECT_THAT(problem_of("time_s,latitude_deg,longitude_deg\n-5,48,11\n"),
              HasSubstr("the last is -5.000; give seconds since the drive's begin"));
  EXPECT_THAT(problem_of(rows([](int k) { return 200.0 * k; }, [](double) { return 0; }, 301)),
              HasSubstr("they seem to be milliseconds: give seconds"));
  EXPECT_THAT(problem_of("unix_s,latitude_deg,longitude_deg\n1780300801000000000,48,11\n"),
              HasSubstr("nanoseconds"));
  EXPECT_THAT(problem_of("unix_s,latitude_deg,longitude_deg\n1464336018,48,11\n"), HasSubstr("GPS seconds"));
  std::string dense = "time_s,latitude_deg,longitude_deg\n";
  for (int k = 0; k < 61'001; ++k) dense += fmt::format("{:.6f},48,11\n", 1e-5 * k);
  EXPECT_THAT(problem_of(dense), HasSubstr("mine.csv:61002: this is row 61001 of a drive of 60 s"));
}

TEST_F(BenchScore, CardsNeedTheirBegin) {
  write_file(folder_.path() / "card.yaml", "bench: 2\nbegin_unix_s: abc\n");
  EXPECT_THAT(problem_of("time_s,latitude_deg,longitude_deg\n1,48,11\n"),
              HasSubstr("card.yaml:2: begin_unix_s 'abc' is not a number"));
}

TEST(BenchFiles, NamesAreFilledInOnePass) {
  EXPECT_EQ(filled("{drive}/{estimate} {x}{", {{"drive", "b/{estimate}"}, {"estimate", "e"}}),
            "b/{estimate}/e {x}{");
  for (const char* bad : {"=x", "a b=x", "../a=x", ".=x", "x"})
    EXPECT_NE(std::string(error_of([&] { (void)named_file(bad, "--estimate"); }).what()), "");
  EXPECT_EQ(named_file("a-1=f=g", "--estimate").file, "f=g");
}

TEST_F(BenchScore, LimitsNameWhatTheyDoNotAllow) {
  const fs::path file = folder_.path() / "limits.yaml";
  write_file(file, "limits: [{p95_m: 3, followed: 0.2, within_5m: 0.99}, {drives: [other], p50_m: 0}]\n");
  const auto limits = read_limits(file, {"mine", "other"}).limits;
  const Score bad = scored([](double t) { return t >= 10 && t < 20 ? 20 : 0; });
  EXPECT_THAT(violations("mine", bad, limits),
              ElementsAre("p95_m is 20, limit 3", HasSubstr("within_5m is 0.8"),
                          HasSubstr("followed of 'outlier' is")));
  EXPECT_THAT(violations("mine", scored([](double) { return 0; }), limits), IsEmpty());
  const std::string junit =
      to_junit({{"a", "mine", 2, bad, violations("mine", bad, limits)}, {"b", "mine", 2, {}, {}}});
  EXPECT_THAT(junit, HasSubstr("tests=\"2\" failures=\"1\""));
  EXPECT_THAT(junit, HasSubstr("<failure message=\"p95_m is 20, limit 3; within_5m"));
  for (const char* name : {"other/", "./other"}) {
    write_file(file, fmt::format("limits: [{{drives: ['{}'], p50_m: 0}}]\n", name));
    EXPECT_THAT(error_of([&] {
                  (void)read_limits(file, {"mine", "other"});
                }).what(),
                HasSubstr("did you mean 'other'?"));
  }
}

// Every drive is a scenario that can be read, with every receiver; names are folders.
TEST(BenchDrives, AreScenarios) {
  for (int edition = 1; edition <= kEdition; ++edition) {
    const Catalogue& all = catalogue(edition);
    EXPECT_EQ(all.bench, edition);
    EXPECT_GE(all.drives.size(), 20U);
    for (const BenchDrive& drive : all.drives) {
      for (const char* base : {"", kTownBase}) {
        const auto scenario =
            simulation::parse_scenario(scenario_of(all, drive, {"r", "ublox-f9p", base}, 3), drive.name);
        EXPECT_EQ(scenario.receivers.size(), *base == 0 ? 1U : 2U);
        EXPECT_EQ(scenario.seed, 3U);
        EXPECT_EQ(first_fault_s(scenario).has_value(), drive.has_fault());
      }
      EXPECT_EQ(drive.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-"), std::string::npos);
    }
  }
  EXPECT_THAT(error_of([] { (void)catalogue(3); }).what(), HasSubstr("there is no edition 3"));
}

/// A drive's truth and sensors at 10 Hz; sky and receiver are not computed.
std::vector<simulation::Pose> poses_of(const std::string& name) {
  const Catalogue& all = catalogue();
  const auto drive =
      std::find_if(all.drives.begin(), all.drives.end(), [&](const BenchDrive& d) { return d.name == name; });
  const auto scenario = simulation::parse_scenario(scenario_of(all, *drive, {"r", "ublox-m10", ""}, 1), name);
  const simulation::Simulation simulation(
      scenario, std::make_shared<simulation::CityScene>(simulation::load_city(scenario)));
  std::vector<simulation::Pose> poses;
  for (std::size_t k = 0; k < 2 * simulation.epoch_count(); ++k)
    poses.push_back(simulation.vehicle_pose(simulation.begin() + 0.1 * static_cast<double>(k)));
  return poses;
}

// A car drives circles of at least 3 m: its speed over its yaw rate.
TEST(BenchDrives, CarsDoNotTurnAtRest) {
  const auto poses = poses_of("open");
  for (std::size_t k = 1; k < poses.size(); ++k) {
    const double rotation =
        std::abs(std::remainder(poses[k].yaw_rad - poses[k - 1].yaw_rad, 2 * geodesy::kPi));
    const double moved_m = 0.05 * (poses[k].velocity_enu_mps + poses[k - 1].velocity_enu_mps).norm();
    EXPECT_LT(rotation, moved_m / 3 + 1e-3) << 0.1 * static_cast<double>(k) << " s";
  }
}

TEST(BenchDrives, WheelsSlipWhileTheyTurn) {
  const auto poses = poses_of("wheel-slip");
  for (std::size_t k = 600; k <= 650; ++k) EXPECT_GT(poses[k].velocity_enu_mps.norm(), 5) << k;
}

}  // namespace
}  // namespace canyon::bench
