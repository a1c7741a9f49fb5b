#include "canyon/sky/orbit/faulty_sky.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/orbit/nominal_constellation.hpp"

namespace canyon::orbit::wrong_sky_test {
namespace {

using gnss::SatelliteId;
using gnss::System;

const geodesy::GpsTime kTime = geodesy::parse_time("2026-06-01T08:10:00Z");
const SatelliteId kOne{System::GPS, 5};

bool is_one(SatelliteId id) {
  return id == kOne;
}

gnss::NavigationData messages() {
  return nominal_constellation(kTime, kTime + 3600,
                               {System::GPS, System::GLONASS, System::Galileo, System::BeiDou});
}
std::shared_ptr<const Sky> truth() {
  static const auto sky = std::make_shared<BroadcastSky>(messages());
  return sky;
}

// The axes by their definition (radial, along, cross), and the velocity as the derivative of the position.
TEST(FaultySky, MovesOneSatelliteInTheAxesOfItsOrbit) {
  MessageError error;
  error.orbit_m = {100, -200, 300};
  error.orbit_rate_mps = {0.5, 0.25, -0.125};
  error.since = kTime - 60;
  const FaultySky sky(truth(), is_one, error);
  const SatelliteState right = *truth()->state(kOne, kTime), wrong = *sky.state(kOne, kTime);
  const Eigen::Vector3d inertial =
      right.velocity_mps + Eigen::Vector3d(0, 0, geodesy::kEarthRotationRate).cross(right.position_m);
  const Eigen::Vector3d radial = right.position_m.normalized();
  const Eigen::Vector3d cross = right.position_m.cross(inertial).normalized();
  const Eigen::Vector3d moved = wrong.position_m - right.position_m;
  EXPECT_NEAR(moved.dot(radial), 100 + 30, 1e-6);
  EXPECT_NEAR(moved.dot(cross.cross(radial)), -200 + 15, 1e-6);
  EXPECT_GT(inertial.dot(cross.cross(radial)), 3000) << "along is the way it flies";
  EXPECT_NEAR(moved.dot(cross), 300 - 7.5, 1e-6);
  const Eigen::Vector3d derived =
      (sky.state(kOne, kTime + 0.5)->position_m - sky.state(kOne, kTime - 0.5)->position_m);
  const Eigen::Vector3d true_derived =
      (truth()->state(kOne, kTime + 0.5)->position_m - truth()->state(kOne, kTime - 0.5)->position_m);
  EXPECT_LT(((wrong.velocity_mps - right.velocity_mps) - (derived - true_derived)).norm(), 1e-5);

  const SatelliteId other{System::GPS, 7};
  EXPECT_EQ(sky.state(other, kTime)->position_m, truth()->state(other, kTime)->position_m);
}

TEST(FaultySky, SaysAWrongClockAndWhoIsUnhealthy) {
  MessageError error;
  error.clock_s = 1e-7;
  error.clock_drift = 1e-11;
  error.since = kTime - 100;
  const FaultySky sky(truth(), is_one, error);
  EXPECT_NEAR(sky.state(kOne, kTime)->clock_bias_s - truth()->state(kOne, kTime)->clock_bias_s, 1.01e-7,
              1e-18);
  EXPECT_NEAR(sky.state(kOne, kTime)->clock_drift - truth()->state(kOne, kTime)->clock_drift, 1e-11, 1e-20);
  error.unhealthy = true;
  EXPECT_EQ(sky.health(kOne, kTime), SatelliteHealth::Healthy);
  EXPECT_FALSE(FaultySky(truth(), is_one, error).state(kOne, kTime));
  EXPECT_EQ(FaultySky(truth(), is_one, error).health(kOne, kTime), SatelliteHealth::Unhealthy);
}

// Messages agree with the sky: clocks and health exactly; orbits to first order in the eccentricity, 0.02 of
// the error at most for these orbits, and a tenth of it if velocities are extrapolated for 15 min.
TEST(WrongMessages, SayTheSame) {
  MessageError error;
  error.orbit_m = {100, 200, 0};
  error.orbit_rate_mps = {0, 0.1, 0};
  error.clock_s = 1e-7;
  error.clock_drift = 1e-11;
  error.since = kTime - 600;
  const auto all = [](SatelliteId) { return true; };
  const FaultySky sky(truth(), all, error);
  const BroadcastSky reported(wrong_messages(messages(), all, error));
  int compared = 0;
  for (const SatelliteId id : sky.satellites()) {
    const auto wrong = sky.state(id, kTime);
    if (!wrong) continue;
    const auto message = reported.state(id, kTime);
    ASSERT_TRUE(message) << gnss::to_string(id);
    const double limit_m = id.system == System::GLONASS ? 30 : 5;
    EXPECT_LT((message->position_m - wrong->position_m).norm(), limit_m) << gnss::to_string(id);
    EXPECT_NEAR(message->clock_bias_s, wrong->clock_bias_s, 1e-11) << gnss::to_string(id);
    ++compared;
  }
  EXPECT_GT(compared, 80);
  error.unhealthy = true;
  const gnss::NavigationData ill = wrong_messages(messages(), is_one, error);
  const gnss::NavigationData well = messages();
  for (std::size_t i = 0; i < ill.kepler.size(); ++i) {
    const gnss::KeplerEphemeris& e = ill.kepler[i];
    EXPECT_EQ(e.health != 0, e.id == kOne);
    EXPECT_EQ(e.iode != well.kepler[i].iode, e.id == kOne) << "readers keep what has the same issue";
    // IS-GPS-200 20.3.4.4: the IODE equals the low bits of the IODC.
    if (e.id.system != System::GPS) continue;
    EXPECT_EQ(e.iodc & 0xFF, e.iode);
  }
}

}  // namespace
}  // namespace canyon::orbit::wrong_sky_test
