#include "adapters/ros/gps_fix.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "adapters/ros/testing/stand_ins.hpp"
#include "tests/support/sample_signals.hpp"

#ifdef CANYON_WITH_GPS_MSGS
#include <gps_msgs/msg/gps_fix.hpp>
#endif

namespace canyon::ros_messages {
namespace {

using positioning::FixKind;
using testing::Each;
using testing::IsNan;

#ifdef CANYON_WITH_GPS_MSGS
using GPSFix = gps_msgs::msg::GPSFix;
#else
using test::messages::Header;
struct GPSStatus {
  static constexpr std::int16_t STATUS_NO_FIX = -1, STATUS_FIX = 0, STATUS_SBAS_FIX = 1, STATUS_GBAS_FIX = 2,
                                STATUS_DGPS_FIX = 18, STATUS_RTK_FIX = 19, STATUS_RTK_FLOAT = 20;
  static constexpr std::uint16_t SOURCE_NONE = 0, SOURCE_GPS = 1, SOURCE_DOPPLER = 4, SOURCE_GYRO = 32,
                                 SOURCE_ACCEL = 64;
  Header header;
  std::uint16_t satellites_used = 7, satellites_visible = 7;
  std::vector<std::int32_t> satellite_used_prn, satellite_visible_prn, satellite_visible_z,
      satellite_visible_azimuth, satellite_visible_snr;
  std::int16_t status = 7;
  std::uint16_t motion_source = 7, orientation_source = 7, position_source = 7;
};
struct GPSFix {
  static constexpr std::uint8_t COVARIANCE_TYPE_UNKNOWN = 0, COVARIANCE_TYPE_KNOWN = 3;
  Header header;
  GPSStatus status;
  double latitude = 7, longitude = 7, altitude = 7, track = 7, speed = 7, climb = 7, pitch = 7, roll = 7,
         dip = 7, time = 7, gdop = 7, pdop = 7, hdop = 7, vdop = 7, tdop = 7, err = 7, err_horz = 7,
         err_vert = 7, err_track = 7, err_speed = 7, err_climb = 7, err_time = 7, err_pitch = 7, err_roll = 7,
         err_dip = 7;
  std::array<double, 9> position_covariance{};
  std::uint8_t position_covariance_type = 7;
};
#endif
using Status = std::remove_reference_t<decltype(std::declval<GPSFix&>().status)>;

Head head() {
  return {{1234, 567'000'089}, "antenna"};
}

simulation::Epoch epoch() {
  simulation::Epoch epoch = test::sample_epoch(test::sample_time(), test::sample_point(), {0, 0, 0});
  positioning::Fix& fix = epoch.observed.fix;
  fix.position = geodesy::Geodetic::from_degrees(22.25, -114.5, 33.75);
  fix.covariance_enu = Eigen::Vector3d(1, 3, 12).asDiagonal();
  fix.velocity_enu_mps = Eigen::Vector3d(3, 4, -0.5);
  fix.velocity_covariance_enu = Eigen::Matrix3d(Eigen::Vector3d(0.04, 0.04, 0.25).asDiagonal());
  fix.dop = positioning::Dop{5.5, 1.5, 2.5, 3.5, 4.5};  // GDOP, PDOP, HDOP, VDOP, TDOP
  return epoch;
}

TEST(GpsFix, CarriesPositionMotionAndTheirErrors) {
  const simulation::Epoch e = epoch();
  const auto m = gps_fix_message<GPSFix>(head(), &e);
  EXPECT_EQ(m.header.frame_id, "antenna");
  EXPECT_EQ(m.status.header.stamp.sec, 1234);
  EXPECT_NEAR(m.latitude, 22.25, 1e-12);
  EXPECT_NEAR(m.longitude, -114.5, 1e-12);
  EXPECT_EQ(m.altitude, 33.75);
  EXPECT_EQ(m.time, 2051 * 604800 + 46701);
  EXPECT_NEAR(m.track, 36.8698976, 1e-6);  // atan(3 / 4)
  EXPECT_DOUBLE_EQ(m.speed, 5);
  EXPECT_DOUBLE_EQ(m.climb, -0.5);
  EXPECT_DOUBLE_EQ(m.err, 8);       // 2 sqrt(1 + 3 + 12)
  EXPECT_DOUBLE_EQ(m.err_horz, 4);  // 2 sqrt(1 + 3)
  EXPECT_DOUBLE_EQ(m.err_vert, 2 * std::sqrt(12));
  EXPECT_DOUBLE_EQ(m.err_speed, 0.4);
  EXPECT_DOUBLE_EQ(m.err_climb, 1);
  EXPECT_NEAR(m.err_track, 4.5837, 1e-3);  // 2 * 0.2 m/s over 5 m/s, in degrees
  EXPECT_EQ(m.gdop, 5.5);
  EXPECT_EQ(m.hdop, 2.5);
  EXPECT_EQ(m.tdop, 4.5);
  EXPECT_EQ(m.position_covariance[8], 12);
  EXPECT_EQ(static_cast<int>(m.position_covariance_type), 3);
  EXPECT_TRUE(std::isnan(m.dip) && std::isnan(m.pitch) && std::isnan(m.roll) && std::isnan(m.err_time));
}

TEST(GpsFix, NamesTheSatellites) {
  simulation::Epoch e = epoch();
  e.observed.satellites.front().measurement->cn0_dbhz = 41.6;
  const auto m = gps_fix_message<GPSFix>(head(), &e);
  EXPECT_EQ(m.status.satellites_used, e.observed.fix.used.size());
  EXPECT_EQ(m.status.satellite_used_prn.front(), 5);  // G05
  // All that are measured: G24 is below the mask, G31 is blocked.
  EXPECT_EQ(m.status.satellites_visible, 10);
  EXPECT_EQ(m.status.satellite_visible_prn.size(), 10U);
  EXPECT_EQ(m.status.satellite_visible_snr.front(), 42);
  EXPECT_EQ(m.status.satellite_visible_prn[2], 17);
  EXPECT_EQ(m.status.satellite_visible_azimuth[2], 200);
  EXPECT_EQ(m.status.satellite_visible_z[2], 16);  // 15.5 deg
  EXPECT_EQ(m.status.position_source, Status::SOURCE_GPS);
  EXPECT_EQ(m.status.motion_source, Status::SOURCE_DOPPLER);
  EXPECT_EQ(m.status.orientation_source, Status::SOURCE_NONE);
}

// gps_msgs/GPSStatus: -1 no fix, 0 fix, 18 DGPS, 19 RTK with integer ambiguities, 20 with float ambiguities.
TEST(GpsFix, TellsTheKindsOfFixApart) {
  simulation::Epoch e = epoch();
  const auto status = [&] { return gps_fix_message<GPSFix>(head(), &e).status.status; };
  EXPECT_EQ(status(), 0);
  const std::pair<FixKind, int> kinds[]{
      {FixKind::Differential, 18}, {FixKind::Float, 20}, {FixKind::Fixed, 19}};
  for (const auto& [kind, code] : kinds) {
    e.observed.fix.solution = kind;
    EXPECT_EQ(status(), code);
  }
  e.observed.fix.used.clear();  // a prediction
  EXPECT_EQ(status(), -1);
  EXPECT_NEAR(gps_fix_message<GPSFix>(head(), &e).latitude, 22.25, 1e-12);
}

TEST(GpsFix, HasTheHeadingOfTwoAntennasOrOfTheVehiclesSensors) {
  simulation::Epoch e = epoch();
  positioning::Baseline baseline;
  baseline.kind = FixKind::Fixed;
  baseline.moving_base = true;
  baseline.vector_enu = {1, 0, 0};
  baseline.covariance_enu = Eigen::Matrix3d::Identity() * 1e-4;
  e.observed.fix.baseline = baseline;
  const auto antennas = gps_fix_message<GPSFix>(head(), &e);
  EXPECT_DOUBLE_EQ(antennas.dip, 90);
  EXPECT_NEAR(antennas.err_dip, 1.146, 1e-3);  // 2 * 0.01 rad
  EXPECT_EQ(antennas.status.orientation_source, Status::SOURCE_GPS);

  e.observed.fix.baseline.reset();
  positioning::Fusion fusion;
  fusion.phase = positioning::FusionPhase::Navigating;
  fusion.heading_rad = geodesy::radians(123);
  fusion.pitch_rad = geodesy::radians(-2);
  fusion.roll_rad = geodesy::radians(1);
  e.observed.fix.fusion = fusion;
  const auto fused = gps_fix_message<GPSFix>(head(), &e);
  EXPECT_DOUBLE_EQ(fused.dip, 123);
  EXPECT_NEAR(fused.pitch, -2, 1e-12);
  EXPECT_NEAR(fused.roll, 1, 1e-12);
  EXPECT_EQ(fused.status.status, 0);
  EXPECT_EQ(fused.status.position_source, Status::SOURCE_GPS | Status::SOURCE_GYRO | Status::SOURCE_ACCEL);
}

TEST(GpsFix, SaysNothingThatIsNotKnown) {
  const auto no_fix = test::sample_epoch(test::sample_time(), test::sample_point(), {0, 0, 0}, false);
  for (const simulation::Epoch* e : {static_cast<const simulation::Epoch*>(nullptr), &no_fix}) {
    const auto m = gps_fix_message<GPSFix>(head(), e);
    EXPECT_EQ(m.status.status, -1);
    EXPECT_EQ(m.status.satellites_used, 0);
    EXPECT_EQ(m.status.position_source, 0);
    EXPECT_TRUE(std::isnan(m.latitude) && std::isnan(m.speed) && std::isnan(m.err_horz));
    EXPECT_EQ(m.hdop, 0);
    EXPECT_THAT(m.position_covariance, Each(IsNan()));
    EXPECT_EQ(static_cast<int>(m.position_covariance_type), 0);
  }
  simulation::Epoch at_rest = epoch();
  at_rest.observed.fix.velocity_enu_mps = Eigen::Vector3d(1e-4, 0, 0);
  EXPECT_EQ(gps_fix_message<GPSFix>(head(), &at_rest).err_track, 180);
  at_rest.observed.fix.velocity_enu_mps.reset();
  EXPECT_TRUE(std::isnan(gps_fix_message<GPSFix>(head(), &at_rest).track));
}

}  // namespace
}  // namespace canyon::ros_messages
