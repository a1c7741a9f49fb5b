#include "canyon/analysis/validation/alignment.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "tests/support/simulated_recording.hpp"
#include "tests/support/simulation_support.hpp"

namespace canyon::validation {
namespace {

using canyon::test::SimulatedRecording;
using simulation::test::error_of;
using ::testing::HasSubstr;

const double kMask = geodesy::radians(10);

AlignOptions quick() {
  AlignOptions options;
  options.reach_m = 8;
  options.resamples = 50;
  return options;
}

// The city's true position is found, within the reported uncertainty of the alignment.
TEST(CityAlignment, FindsWhereTheCityStands) {
  Registration moved;
  moved.east_m = 3;
  moved.north_m = -2;
  const SimulatedRecording recorded(moved, canyon::test::with_strength);
  const Recording recording = recorded.read();
  const std::size_t all = recording.residuals.epochs.size();
  std::size_t last = 0, planned = 0;
  AlignOptions options = quick();
  options.progress = [&](std::size_t done, std::size_t total) {
    last = done;
    planned = total;
  };
  const CityAlignment a = align(recording, recorded.environment(), kMask, 0, all, options);
  std::printf("east %.2f +- %.2f, north %.2f +- %.2f m, score %.3f, unmoved %.3f\n", a.registration.east_m,
              a.sigma_east_m, a.registration.north_m, a.sigma_north_m, a.score, a.score_before);
  EXPECT_NEAR(a.registration.east_m, 3, std::min(2 * a.sigma_east_m, 0.75));
  EXPECT_NEAR(a.registration.north_m, -2, std::min(2 * a.sigma_north_m, 0.75));
  EXPECT_LT(a.sigma_east_m, 1);
  EXPECT_LT(a.sigma_north_m, 1);
  EXPECT_EQ(a.registration.heading_rad, 0);
  EXPECT_GT(a.score, a.score_before + 0.01);
  EXPECT_FALSE(a.at_border);
  EXPECT_EQ(a.first, 0U);
  EXPECT_EQ(a.count, all);
  EXPECT_EQ(last, planned);

  // The same on one thread; another part gives another result that agrees.
  options.threads = 1;
  const CityAlignment again = align(recording, recorded.environment(), kMask, 0, all, options);
  EXPECT_EQ(again.registration.east_m, a.registration.east_m);
  EXPECT_EQ(again.sigma_north_m, a.sigma_north_m);
  const CityAlignment half = align(recording, recorded.environment(), kMask, all / 2, all - all / 2, quick());
  EXPECT_EQ(half.first, all / 2);
  EXPECT_NEAR(half.registration.east_m, 3, 2);
  EXPECT_NEAR(half.registration.north_m, -2, 2);

  const nlohmann::json json = nlohmann::json::parse(to_json(a));
  EXPECT_EQ(json.at("east_m"), a.registration.east_m);
  EXPECT_EQ(json.at("at_border"), false);
}

TEST(CityAlignment, FindsTheHeading) {
  Registration moved;
  moved.east_m = 2;
  moved.heading_rad = geodesy::radians(1.5);
  const SimulatedRecording recorded(moved, canyon::test::with_strength);
  const Recording recording = recorded.read();
  AlignOptions options = quick();
  options.heading = true;
  const CityAlignment a =
      align(recording, recorded.environment(), kMask, 0, recording.residuals.epochs.size(), options);
  const double heading_deg = geodesy::degrees(a.registration.heading_rad);
  std::printf("heading %.3f +- %.3f deg, score %.3f, unmoved %.3f\n", heading_deg,
              geodesy::degrees(a.sigma_heading_rad), a.score, a.score_before);
  EXPECT_NEAR(heading_deg, 1.5, 0.3);
  EXPECT_GT(a.sigma_heading_rad, 0);
  // The middle of the drive in the true city and in the aligned one.
  const Eigen::Vector3d here(a.registration.pivot.x(), a.registration.pivot.y(), 0);
  EXPECT_LT((a.registration.point_in_map(here) - moved.point_in_map(here)).norm(), 1);
}

// A search that ends before the maximum reports it.
TEST(CityAlignment, SaysWhenTheSearchIsTooShort) {
  Registration moved;
  moved.east_m = 7;
  const SimulatedRecording recorded(moved, canyon::test::with_strength);
  const Recording recording = recorded.read();
  AlignOptions options = quick();
  options.reach_m = 4;
  const CityAlignment a =
      align(recording, recorded.environment(), kMask, 0, recording.residuals.epochs.size(), options);
  EXPECT_TRUE(a.at_border);
}

TEST(CityAlignment, RefusesWhatCannotBeAligned) {
  AlignOptions options;
  options.reach_m = 1;
  EXPECT_THAT(error_of([&] { options.validate(); }).what(), HasSubstr("reach_m"));
  options = {};
  options.resamples = 3;
  EXPECT_THAT(error_of([&] { options.validate(); }).what(), HasSubstr("resamples"));
  options = {};
  options.block_s = std::nan("");
  EXPECT_THAT(error_of([&] { options.validate(); }).what(), HasSubstr("block_s"));
  options = {};
  options.heading_reach_rad = 3;
  EXPECT_THAT(error_of([&] { options.validate(); }).what(), HasSubstr("heading_reach_rad"));

  // An open field hides no satellite.
  const SimulatedRecording recorded;
  const Recording recording = recorded.read();
  city::City field;
  field.name = "field";
  field.frame = recorded.environment().city().frame;
  const geodesy::GpsTime begin = recording.residuals.epochs.front().reception;
  const simulation::Environment open(
      field, simulation::build_sky(recorded.scenario().sky, begin, begin + 300, field.frame.origin()).sky);
  const std::size_t all = recording.residuals.epochs.size();
  EXPECT_THAT(error_of([&] { (void)align(recording, open, kMask, 0, all, quick()); }).what(),
              HasSubstr("LOS"));
  EXPECT_THAT(error_of([&] { (void)align(recording, open, 1.57, 0, all, quick()); }).what(),
              HasSubstr("mask"));
}

}  // namespace
}  // namespace canyon::validation
