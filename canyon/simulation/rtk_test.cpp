// RTK of simulated receivers: solutions from base and rover.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/receiver_runner.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/simulation_support.hpp"

namespace canyon::simulation {
namespace {

using positioning::FixKind;
using ::testing::HasSubstr;

class Collector final : public EpochSink {
 public:
  void write(const Epoch& epoch) override { of[epoch.receiver].push_back(epoch); }
  void finish() override {}
  std::map<std::size_t, std::vector<Epoch>> of;
};

std::string field(const std::string& receivers, double duration_s = 60, const std::string& more = "") {
  return "city: {open: true, origin: {latitude_deg: 48, longitude_deg: 11, height_m: 500}}\n"
         "sky: {nominal: true, systems: [GPS, Galileo]}\n"
         "start: 2026-06-01T06:00:00Z\n"
         "rate_hz: 1\n"
         "duration_s: " +
         std::to_string(duration_s) +
         "\n"
         "trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 1.5}, {east_m: 900, north_m: 0, up_m: "
         "1.5}], "
         "speed_mps: 5}\n"
         "seed: 2\n" +
         more + "receivers:\n" + receivers;
}

std::map<std::size_t, std::vector<Epoch>> run(const std::string& text) {
  const Scenario scenario = parse_scenario(text, "scenario.yaml");
  city::City city;
  city.frame = geodesy::LocalFrame(*scenario.city.origin);
  const Simulation simulation(scenario, std::move(city));
  Collector sink;
  (void)simulation.run({&sink});
  return sink.of;
}

std::string rover(const std::string& corrections = "from: base", const std::string& keys = "rtk: true") {
  return "  - {name: rover, profile: ublox-f9p, " + keys + ", corrections: {" + corrections + "}}\n";
}
const std::string kBase = "  - {name: base, profile: survey, fixed: {east_m: 400, north_m: 300, up_m: 5}}\n";

double fraction_of(const std::vector<Epoch>& epochs, FixKind kind) {
  double count = 0;
  for (const Epoch& epoch : epochs) count += epoch.observed.fix.kind() == kind ? 1 : 0;
  return count / static_cast<double>(epochs.size());
}

TEST(Differential, StatesWhatCorrectionsLeave) {
  const auto epochs =
      run(field("  - {name: a, profile: survey, corrections: {from: base}}\n"
                "  - {name: b, profile: ublox-f9p, corrections: {from: base}}\n"
                "  - {name: c, profile: ublox-m10, corrections: {from: base}}\n"
                "  - {name: single, profile: survey}\n" +
                    kBase,
                180));
  // 12 to 25 with the range errors included. The base's pseudoranges count as 0.3 m, here they are better.
  constexpr double kMax = 6;
  for (std::size_t r = 0; r < 4; ++r) {
    double errors = 0, reported = 0;
    for (const Epoch& epoch : epochs.at(r)) {
      const positioning::Fix& fix = epoch.observed.fix;
      ASSERT_EQ(fix.kind(), r < 3 ? FixKind::Differential : FixKind::Single);
      errors += epoch.error_enu_m.head<2>().squaredNorm();
      reported += fix.covariance_enu.topLeftCorner<2, 2>().trace();
    }
    const double over = std::sqrt(reported / errors);
    if (r < 3) {
      EXPECT_GT(over, 0.7) << r;
      EXPECT_LT(over, kMax) << r;
    } else {
      // Range errors remain in a single fix.
      EXPECT_GT(std::sqrt(reported / static_cast<double>(epochs.at(r).size())), 0.7);
    }
  }
}

TEST(Rtk, FixesWithinCentimetres) {
  const auto epochs = run(field(rover() + kBase)).at(0);
  EXPECT_GT(fraction_of(epochs, FixKind::Fixed), 0.97);
  for (const Epoch& epoch : epochs) {
    const positioning::Fix& fix = epoch.observed.fix;
    if (fix.kind() != FixKind::Fixed) continue;
    EXPECT_LT(epoch.error_enu_m.norm(), 0.02);
    ASSERT_TRUE(fix.baseline);
    EXPECT_FALSE(fix.baseline->moving_base);
    EXPECT_NEAR(fix.baseline->length_m(), (fix.position_ecef - fix.baseline->base_ecef).norm(), 1e-6);
    EXPECT_EQ(fix.correction_age_s, 0);
    EXPECT_EQ(fix.correction_station, 0);
    EXPECT_LT(std::sqrt(fix.covariance_enu.trace()), 0.05);
  }
}

// Errors of pseudoranges are correlated: five epochs in a second are worth as much as one.
TEST(Rtk, FixesAgainAfterABridgeAtAnyRate) {
  const std::string bridge =
      "faults: [{from_s: 20, until_s: 24, receivers: [rover], antenna: {elevation_from_deg: 0, "
      "elevation_to_deg: 90, loss_db: 60}}]\n";
  const std::string base =
      "  - {name: base, profile: ublox-f9p, fixed: {east_m: 8000, north_m: 300, up_m: 5}}\n";
  for (const std::string rate : {"1", "5"}) {
    std::string text = field(rover() + base, 60, bridge);
    text.replace(text.find("rate_hz: 1"), 10, "rate_hz: " + rate);
    text.replace(text.find("[GPS, Galileo]"), 14, "[GPS, Galileo, BeiDou, GLONASS]");
    double lost = 0, fixed = 0, after = 0;
    const auto epochs = run(text).at(0);
    for (const Epoch& epoch : epochs) {
      const double t = epoch.observed.time - epochs.front().observed.time;
      const bool is_fixed = epoch.observed.fix.kind() == FixKind::Fixed;
      if (t > 20.5 && t < 24) lost += is_fixed ? 0 : 1;
      if (t >= 30) {
        ++after;
        fixed += is_fixed ? 1 : 0;
      }
    }
    EXPECT_GT(lost, 2) << rate << " Hz";
    EXPECT_GT(fixed / after, 0.9) << rate << " Hz";
  }
}

// Over 30 km the atmosphere keeps the rover float; a network moves the base to the rover's reported position.
TEST(Rtk, AVirtualStationMakesLongBaselinesShort) {
  const std::string far =
      "  - {name: base, profile: ublox-f9p, fixed: {east_m: 30000, north_m: 0, up_m: 5}}\n";
  const auto own = run(field(rover() + far)).at(0);
  EXPECT_LT(fraction_of(own, FixKind::Fixed), 0.2);
  const auto epochs = run(field(rover("from: base, virtual_station: true") + far)).at(0);
  EXPECT_GT(fraction_of(epochs, FixKind::Fixed), 0.9);
  EXPECT_NE(epochs.front().observed.fix.kind(), FixKind::Fixed);  // its position is not yet reported
  for (const Epoch& epoch : epochs) {
    const positioning::Fix& fix = epoch.observed.fix;
    if (fix.kind() != FixKind::Fixed) continue;
    EXPECT_LT(epoch.error_enu_m.norm(), 0.04);
    EXPECT_LT(fix.baseline->length_m(), 320);  // from where it was
  }
}

// A station that a rover leaves 5 km behind is moved, and the phases restart.
TEST(Rtk, AVirtualStationFollowsTheRover) {
  std::string text =
      field(rover("from: base, virtual_station: true") +
            "  - {name: base, profile: ublox-f9p, fixed: {east_m: 30000, north_m: 0, up_m: 5}}\n");
  text.replace(text.find("east_m: 900"), 11, "east_m: 9000");
  text.replace(text.find("speed_mps: 5"), 12, "speed_mps: 100");
  double moved = 0, longest_m = 0;
  std::optional<Eigen::Vector3d> before;
  const auto epochs = run(text).at(0);
  for (const Epoch& epoch : epochs) {
    const auto& baseline = epoch.observed.fix.baseline;
    if (!baseline) continue;
    longest_m = std::max(longest_m, baseline->length_m());
    moved += before && (baseline->base_ecef - *before).norm() > 1000 ? 1 : 0;
    before = baseline->base_ecef;
  }
  EXPECT_EQ(moved, 1);
  EXPECT_LT(longest_m, 5200);
}

TEST(Rtk, NothingChangesWithoutIt) {
  const auto epochs = run(field(rover("from: base", "rtk: false") + kBase)).at(0);
  EXPECT_EQ(fraction_of(epochs, FixKind::Differential), 1);
  for (const Epoch& epoch : epochs) EXPECT_FALSE(epoch.observed.fix.baseline);
}

// Effects of the link of corrections: age by latency and rate, and the kind of fix after an outage.
TEST(Rtk, AgeAndOutages) {
  const auto epochs =
      run(field(rover("from: base, rate_hz: 0.5, latency_s: 0.8, max_age_s: 10, outages_s: [20, 40]") + kBase,
                60))
          .at(0);
  std::size_t single = 0;
  for (std::size_t k = 0; k < epochs.size(); ++k) {
    const positioning::Fix& fix = epochs[k].observed.fix;
    if (k >= 30 && k <= 40) {
      EXPECT_EQ(fix.kind(), FixKind::Single) << k;
      ++single;
    }
    if ((k >= 2 && k < 28) || k > 42) {
      EXPECT_EQ(fix.kind(), FixKind::Fixed) << k;
      // Sent at even seconds, here 0.8 s later: used from the next epoch on.
      ASSERT_TRUE(fix.correction_age_s);
      if (k < 20 || k > 42) {
        EXPECT_NEAR(*fix.correction_age_s, k % 2 == 0 ? 2 : 1, 1e-4) << k;
      }
    }
  }
  EXPECT_EQ(single, 11U);
}

TEST(Rtk, LossesAndRange) {
  const auto lossy = run(field(rover("from: base, loss: 0.5, max_age_s: 1.5") + kBase, 120)).at(0);
  EXPECT_GT(fraction_of(lossy, FixKind::Fixed), 0.5);  // 1 - 0.5^2 of epochs have one of 1.5 s or less
  EXPECT_LT(fraction_of(lossy, FixKind::Fixed), 0.9);
  const auto never = run(field(rover("from: base, loss: 1") + kBase)).at(0);
  EXPECT_EQ(fraction_of(never, FixKind::Single), 1);
  // 500 m away at first, 300 m after 80 s, then farther again.
  const auto radio = run(field(rover("from: base, range_m: 350, max_age_s: 2") + kBase, 170)).at(0);
  EXPECT_EQ(radio[10].observed.fix.kind(), FixKind::Single);
  EXPECT_EQ(radio[80].observed.fix.kind(), FixKind::Fixed);
  EXPECT_EQ(radio[165].observed.fix.kind(), FixKind::Single);
}

// Two antennas one metre apart along the vehicle, which drives east.
TEST(Rtk, HeadingOfTwoAntennas) {
  const auto of =
      run(field("  - {name: front, profile: ublox-f9p, rtk: true, corrections: {from: rear}, lever_arm: "
                "{forward_m: 0.5}}\n"
                "  - {name: rear, profile: ublox-f9p, lever_arm: {forward_m: -0.5}}\n"));
  double squares = 0, reported = 0;
  int fixed = 0;
  for (const Epoch& epoch : of.at(0)) {
    const positioning::Fix& fix = epoch.observed.fix;
    EXPECT_EQ(fix.kind(), FixKind::Single);  // the baseline has no information on the position
    if (!fix.baseline || fix.baseline->kind != FixKind::Fixed) continue;
    EXPECT_TRUE(fix.baseline->moving_base);
    EXPECT_NEAR(fix.baseline->length_m(), 1, 0.02);
    EXPECT_NEAR(fix.baseline->pitch_rad(), 0, 0.03);
    squares += std::pow(fix.baseline->heading_rad() - geodesy::kPi / 2, 2);
    reported += std::pow(fix.baseline->heading_sigma_rad(), 2);
    ++fixed;
  }
  EXPECT_GT(fixed, 58);
  EXPECT_LT(geodesy::degrees(std::sqrt(squares / fixed)), 0.25);
  EXPECT_LT(geodesy::degrees(std::sqrt(reported / fixed)), 0.4);
}

/// A drive between walls along `waypoints`: the rover's epochs.
std::vector<Epoch> between_walls(const std::string& waypoints, const std::string& more) {
  city::SyntheticCityOptions blocks;
  blocks.blocks_east = blocks.blocks_north = 6;
  blocks.seed = 7;
  blocks.max_height_m = 60;
  blocks.min_height_m = 40;
  Scenario scenario = parse_scenario(
      "city: {synthetic: {blocks_east: 6, blocks_north: 6, min_height_m: 40, max_height_m: 60, seed: 7}, "
      "origin: {latitude_deg: 48, longitude_deg: 11, height_m: 500}}\n"
      "sky: {nominal: true}\nstart: 2026-06-01T06:00:00Z\nrate_hz: 1\n" +
          more + "trajectory: {waypoints: [" + waypoints + "], speed_mps: 8}\nreceivers:\n" + rover() + kBase,
      "scenario.yaml");
  scenario.receivers.back().fixed->local_m = Eigen::Vector3d(900, 300, 5);
  blocks.origin = *scenario.city.origin;
  const Simulation simulation(scenario, city::synthetic_city(blocks));
  Collector sink;
  (void)simulation.run({&sink});
  return sink.of.at(0);
}

double error_over_sigma(const Epoch& epoch) {
  return epoch.error_enu_m.head<2>().norm() /
         std::sqrt(epoch.observed.fix.covariance_enu.topLeftCorner<2, 2>().trace());
}

// Between walls fixes are lost, and found again. The reported deviations are about those of the errors.
TEST(Rtk, ACanyonTakesTheFix) {
  const std::vector<Epoch> epochs = between_walls(
      "{east_m: 700, north_m: 0, up_m: 1.5}, {east_m: -100, north_m: 0, up_m: 1.5}, "
      "{east_m: 700, north_m: 0, up_m: 1.5}",
      "seed: 2\n");
  EXPECT_EQ(epochs.at(10).observed.fix.kind(), FixKind::Fixed);
  EXPECT_EQ(epochs.back().observed.fix.kind(), FixKind::Fixed);
  EXPECT_LT(fraction_of(epochs, FixKind::Fixed), 0.9);
  EXPECT_GT(fraction_of(epochs, FixKind::Float), 0.1);
  std::vector<double> normalised;
  for (const Epoch& epoch : epochs) {
    if (epoch.observed.fix.kind() == FixKind::Float) normalised.push_back(error_over_sigma(epoch));
  }
  std::sort(normalised.begin(), normalised.end());
  EXPECT_LT(normalised[normalised.size() / 2], 2);
}

// Pseudoranges alone and with phases are both wrong under multipath. If they contradict each other, the
// accuracy shows it. Multipath moves all ambiguities at once, and the search takes this into account.
TEST(Rtk, EchoesMakeItUnsureInsteadOfWrong) {
  int wrong = 0, real = 0, fixed = 0, wrongly_fixed = 0;
  for (const char* seed : {"seed: 3\n", "seed: 4\n", "seed: 6\n"}) {
    for (const Epoch& epoch :
         between_walls("{east_m: -100, north_m: 0, up_m: 1.5}, {east_m: 700, north_m: 0, up_m: 1.5}",
                       seed + std::string("surroundings: dense\n"))) {
      const FixKind kind = epoch.observed.fix.kind();
      if (kind == FixKind::Fixed) {
        ++fixed;
        wrongly_fixed += epoch.error_enu_m.head<2>().norm() > 0.1 ? 1 : 0;
      }
      if (kind != FixKind::Float && kind != FixKind::Differential) continue;
      ++real;
      wrong += error_over_sigma(epoch) > 3 && epoch.error_enu_m.head<2>().norm() > 5 ? 1 : 0;
    }
  }
  EXPECT_GT(real, 60);
  EXPECT_LE(wrong, 5);
  EXPECT_GT(fixed, 100);
  EXPECT_LE(wrongly_fixed, 1);
}

TEST(Rtk, ABaseInsideABuildingGivesNothing) {
  city::SyntheticCityOptions blocks;
  Scenario scenario = parse_scenario(field(rover() + kBase, 20), "scenario.yaml");
  blocks.origin = *scenario.city.origin;
  const auto scene = std::make_shared<CityScene>(city::synthetic_city(blocks));
  // The middle of a building: the first point on a grid that is inside one.
  std::optional<Eigen::Vector3d> inside;
  for (double east = -100; east < 100 && !inside; east += 5) {
    const Eigen::Vector3d point(east, 33, 2);
    if (scene->scene.containment(point) == raytrace::Containment::InsideBuilding) inside = point;
  }
  ASSERT_TRUE(inside);
  scenario.receivers.back().fixed->local_m = *inside;
  const Simulation simulation(scenario, scene);
  Collector sink;
  (void)simulation.run({&sink});
  EXPECT_EQ(fraction_of(sink.of.at(0), FixKind::Fixed) + fraction_of(sink.of.at(0), FixKind::Float), 0);
}

TEST(Rtk, RefusesWhatCannotBe) {
  const auto fault = [](const std::string& receivers) {
    return std::string(test::error_of([&] { (void)run(field(receivers)); }).what());
  };
  EXPECT_THAT(fault("  - {name: rover, profile: ideal, independent_noise: true, rtk: true, corrections: "
                    "{from: base}}\n" +
                    kBase),
              HasSubstr("needs carrier phases, which need signal strengths"));
  EXPECT_THAT(fault(rover("from: base", "rtk: {ratio: 0.5}") + kBase), HasSubstr("ratio"));
  EXPECT_THAT(fault(rover("from: base", "rtk: perhaps") + kBase), HasSubstr("perhaps"));
  EXPECT_THAT(fault(rover("from: base, outages_s: [5, 2]") + kBase), HasSubstr("do not ascend"));
  EXPECT_THAT(
      fault("  - {name: front, profile: ublox-f9p, corrections: {from: rear}}\n  - {name: rear, profile: "
            "ublox-f9p}\n"),
      HasSubstr("rtk: true for the heading"));
  EXPECT_THAT(
      fault(rover() +
            "  - {name: base, profile: survey, tracks: [L2P], fixed: {east_m: 1, north_m: 1, up_m: 1}}\n"),
      HasSubstr("encrypted"));
}

}  // namespace
}  // namespace canyon::simulation
