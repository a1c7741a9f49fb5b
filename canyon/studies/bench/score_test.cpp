#include "canyon/studies/bench/score.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/run/scenario/scenario.hpp"
#include "canyon/studies/bench/drives.hpp"
#include "tests/support/simulation_support.hpp"

namespace canyon::bench {
namespace {

using simulation::test::error_of;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const geodesy::LocalFrame kFrame(geodesy::Geodetic::from_degrees(48, 11, 500));

std::string place(double east_m, double north_m) {
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
      truth += fmt::format("{:.1f},{},500,90\n", t, place(5 * t, 0));
      fixes += fmt::format("{:.1f},{},500,\n", t, place(5 * t, t >= 10 && t <= 20 ? 20 : 0));
    }
    write_file(folder_.path() / "truth.csv", truth);
    write_file(folder_.path() / "fixes.csv", fixes);
    write_file(folder_.path() / "events.csv",
               "start_s,end_s,kind,bias_east_m,bias_north_m,bias_up_m,nlos\n10.0,20.0,outlier,0,20,0,\n");
    write_file(folder_.path() / "card.yaml", "bench: 1\nbegin_unix_s: 1780300800.000000000\n");
  }

  /// An estimate north of the truth by `north_m(t)`, with a covariance.
  template <typename North>
  Score scored(const North& north_m, double variance_m2 = 1) {
    std::string text = "time_s,latitude_deg,longitude_deg,heading_deg,cov_ee_m2,cov_en_m2,cov_nn_m2\n";
    for (int k = 0; k <= 300; ++k)
      text += fmt::format("{:.1f},{},{},{},0,{}\n", 0.2 * k, place(k, north_m(0.2 * k)), 95, variance_m2,
                          variance_m2);
    return scored(text);
  }
  Score scored(const std::string& text) {
    write_file(folder_.path() / "mine.csv", text);
    const DriveFolder drive = read_drive(folder_.path());
    return score(drive, read_estimate(folder_.path() / "mine.csv", drive), 5);
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
  EXPECT_NEAR(half.events[0].largest_m, 10, 1e-3);
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
  EXPECT_NEAR(s.rpe_1s_m, std::sqrt(5 / 296.), 1e-4);  // five pairs of 296 hold the step of 1 m
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
    csv += fmt::format("{:.3f},{}\n", 1780300800 + 0.2 * k, place(k, 2));
    tum += fmt::format("{:.3f} {} 2 0 0 0 0 1\n", 0.2 * k, k);
  }
  EXPECT_NEAR(scored(csv).rmse_m, 2, 1e-4);
  EXPECT_NEAR(scored(tum).rmse_m, 2, 1e-3);
  EXPECT_NEAR(*scored(tum).heading_p95_deg, 0, 1e-9);  // yaw 0 is east
}

TEST_F(BenchScore, GapsCountAsAbsent) {
  std::string text = "time_s,latitude_deg,longitude_deg\n";
  for (int k = 0; k <= 300; ++k)
    if (k < 100 || k >= 200) text += fmt::format("{:.1f},{}\n", 0.2 * k, place(k, 0));
  EXPECT_NEAR(scored(text).availability, 1 - 96 / 301., 0.01);
}

TEST_F(BenchScore, BadEstimatesAreRefusedByLine) {
  EXPECT_THAT(problem_of("a,b\n1,2\n"), HasSubstr("mine.csv:1: there is no column 'time_s'"));
  EXPECT_THAT(problem_of("time_s,latitude_deg,longitude_deg\n1,48,11\n1,48,11\n"),
              HasSubstr("mine.csv:3: 1.000 s does not come after"));
  EXPECT_THAT(problem_of("time_s,latitude_deg,longitude_deg\n1,480,11\n"),
              HasSubstr("mine.csv:2: this is no latitude"));
  EXPECT_THAT(problem_of("time_s,latitude_deg,longitude_deg\n1,48\n"),
              HasSubstr("mine.csv:2: 2 fields under 3 names"));
  EXPECT_THAT(problem_of("0 1 2 3 0 0 0 1\n1 2 3\n"), HasSubstr("mine.csv:2: is no line of TUM"));
  EXPECT_THAT(problem_of("time_s,latitude_deg,longitude_deg\n"), HasSubstr("has no rows"));
}

TEST_F(BenchScore, LimitsNameWhatTheyDoNotAllow) {
  write_file(folder_.path() / "limits.yaml",
             "limits: [{p95_m: 3, followed: 0.2}, {drives: [other], p50_m: 0}]\n");
  const auto limits = read_limits(folder_.path() / "limits.yaml").limits;
  const Score bad = scored([](double t) { return t >= 10 && t < 20 ? 20 : 0; });
  EXPECT_THAT(violations("mine", bad, limits),
              ElementsAre("p95_m is 20, limit 3", HasSubstr("followed of 'outlier' is")));
  EXPECT_THAT(violations("mine", scored([](double) { return 0; }), limits), IsEmpty());
  const std::string junit =
      to_junit({{"a", "mine", bad, violations("mine", bad, limits)}, {"b", "mine", {}, {}}});
  EXPECT_THAT(junit, HasSubstr("tests=\"2\" failures=\"1\""));
  EXPECT_THAT(junit, HasSubstr("<failure message=\"p95_m is 20, limit 3; followed of &apos;outlier"));
}

// Every drive is a scenario that can be read, by every receiver; names are folders.
TEST(BenchDrives, AreScenarios) {
  EXPECT_GE(catalogue().drives.size(), 20U);
  for (const BenchDrive& drive : catalogue().drives) {
    for (const char* profile : {"ublox-m10", "ublox-f9p"}) {
      const auto scenario = simulation::parse_scenario(scenario_of(drive, profile, 3), drive.name);
      EXPECT_EQ(scenario.receivers.size(), profile == std::string("ublox-f9p") ? 2U : 1U);
      EXPECT_EQ(scenario.seed, 3U);
    }
    EXPECT_EQ(drive.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-"), std::string::npos);
  }
}

}  // namespace
}  // namespace canyon::bench
