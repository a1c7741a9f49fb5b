// Receivers with dead reckoning in whole runs: sensors of a scenario, receivers of profiles.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/refusal.hpp"

namespace canyon::simulation {
namespace {

using positioning::FixKind;
using positioning::FusionPhase;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

/// A drive of about 90 s in an open field: rest, 300 m to the east, a bend to the north.
Simulation drive(const std::string& receiver, const std::string& sensors, const std::string& more = "") {
  const Scenario scenario = parse_scenario(
      "city: {open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17, height_m: 5}}\n"
      "start: 2026-06-01T06:00:00Z\nrate_hz: 5\n"
      "trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2, hold_s: 10}, {east_m: 400, north_m: 0, "
      "up_m: "
      "2}, {east_m: 400, north_m: 300, up_m: 2}], acceleration_mps2: 2, speed_mps: 10}\n"
      "receivers: [{name: car, " +
          receiver + "}]\n" + (sensors.empty() ? "" : "sensors: {" + sensors + "}\n") + more,
      "s.yaml");
  city::City city;
  city.frame = geodesy::LocalFrame(geodesy::Geodetic::from_degrees(22.3, 114.17, 5));
  return Simulation(scenario, city);
}

class EpochRecorder final : public EpochSink {
 public:
  void write(const Epoch& epoch) override {
    epochs.push_back(epoch);
    epochs.back().arrival = nullptr;
  }
  void finish() override {}
  std::vector<Epoch> epochs;
};

TEST(DeadReckoningRun, CoastsThroughAnOutage) {
  const Simulation simulation =
      drive("profile: ublox-f9r, lever_arm: {forward_m: 0.3, left_m: 0, up_m: 1.4}",
            "imu: {profile: automotive, axes: frd, position: {forward_m: 0.8, left_m: -0.2, up_m: 0.4}}, "
            "wheels: {}",
            "faults: [{from_s: 55, until_s: 75, outage: {satellites: [GPS, GLONASS, Galileo, BeiDou]}}]\n");
  EpochRecorder kept;
  (void)simulation.run({&kept});
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  std::size_t coasting = 0;
  for (const Epoch& epoch : kept.epochs) {
    const positioning::Fix& fix = epoch.observed.fix;
    const double t_s = epoch.truth.time - simulation.begin();
    ASSERT_TRUE(fix.fusion) << t_s;
    if (t_s < 9) {
      EXPECT_EQ(fix.fusion->phase, FusionPhase::Initialising);
    }
    if (t_s < 25) continue;
    ASSERT_TRUE(fix.solved()) << t_s;
    if (t_s < 54.9) before = epoch.error_enu_m;
    if (fix.kind() != FixKind::DeadReckoning) continue;
    ++coasting;
    // After 200 m and a bend: less than half a percent.
    EXPECT_LT((epoch.error_enu_m - before).head<2>().norm(), 1) << t_s;
  }
  // Plus the two seconds until satellites are reacquired.
  EXPECT_NEAR(static_cast<double>(coasting), 110, 10);
  // The vehicle drives to the north, and back in the open its fix is a combined one.
  const positioning::Fix& last = kept.epochs[kept.epochs.size() - 30].observed.fix;
  EXPECT_EQ(last.kind(), FixKind::Combined);
  EXPECT_LT(std::abs(std::remainder(last.fusion->heading_rad, 2 * geodesy::kPi)), geodesy::radians(1));
  EXPECT_LT(last.fusion->heading_sigma_rad, geodesy::radians(1.5));
}

TEST(DeadReckoningRun, NeedsAnInertialSensor) {
  EXPECT_THAT(canyon::test::refusal([] { (void)drive("profile: ublox-f9r", ""); }),
              AllOf(HasSubstr("'car' uses dead reckoning"), HasSubstr("sensors: {imu:")));
  EXPECT_THAT(canyon::test::refusal([] { (void)drive("profile: ublox-f9r", "wheels: {}"); }),
              HasSubstr("no inertial sensor"));
  EXPECT_EQ(
      canyon::test::refusal([] { (void)drive("profile: ublox-f9r, dead_reckoning: {enabled: false}", ""); }),
      "");
}

TEST(DeadReckoningRun, WarnsOfALevelVehicleOnASlope) {
  const auto warnings = [](const std::string& attitude) {
    const Scenario scenario = parse_scenario(
        "city: {open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17, height_m: 5}}\n"
        "start: 2026-06-01T06:00:00Z\nreceivers: [{profile: ublox-f9r}]\nsensors: {imu: {}}\n"
        "trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2}, {east_m: 300, north_m: 0, up_m: 22}], "
        "acceleration_mps2: 2" +
            attitude + "}\n",
        "s.yaml");
    city::City city;
    city.frame = geodesy::LocalFrame(geodesy::Geodetic::from_degrees(22.3, 114.17, 5));
    return Simulation(scenario, city).warnings();
  };
  EXPECT_THAT(warnings(""), Contains(HasSubstr("attitude: car")));
  EXPECT_THAT(warnings(", attitude: car"), ::testing::Not(Contains(HasSubstr("attitude: car"))));
}

}  // namespace
}  // namespace canyon::simulation
