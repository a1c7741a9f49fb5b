#include "adapters/ros2/driver.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace canyon::adapters::ros2 {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(Driver, IsKnownByTheNameOfItsProgram) {
  EXPECT_EQ(role_of_program("/opt/ros/jazzy/lib/canyon_ros2/ublox_gps_node").driver, Driver::UbloxGps);
  EXPECT_EQ(role_of_program("nmea_serial_driver").driver, Driver::NmeaNavsat);
  EXPECT_EQ(role_of_program("/ublox_gps_node/receiver").driver, Driver::None);
  EXPECT_EQ(role_of_program("").driver, Driver::None);
  for (const DriverRole& role : driver_roles()) EXPECT_EQ(&role_of(role.driver), &role);
}

// Values as in ublox_gps' c94_m8p_rover.yaml. GPS is on where the file says nothing of it.
TEST(Driver, TakesItsParameters) {
  std::vector<std::string> unused;
  const Parameters own = own_parameters({{"driver", "ublox_gps"},
                                         {"device", "/dev/ttyACM0"},
                                         {"frame_id", "gps"},
                                         {"rate", 4.0},
                                         {"gnss.glonass", true},
                                         {"gnss.beidou", false},
                                         {"uart1.baudrate", std::int64_t{19200}},
                                         {"scenario", "street.yaml"}},
                                        unused);
  EXPECT_THAT(unused, ElementsAre("device", "uart1.baudrate"));
  EXPECT_EQ(own.at("rate_hz"), ParameterValue(4.0));
  EXPECT_EQ(own.at("sky.systems"), ParameterValue(std::vector<std::string>{"GPS", "GLONASS"}));
  EXPECT_EQ(own.at("scenario"), ParameterValue("street.yaml"));
  EXPECT_FALSE(own.contains("device"));
}

TEST(Driver, ItsPeriodsAreRates) {
  std::vector<std::string> unused;
  const Parameters septentrio = own_parameters(
      {{"driver", "septentrio_gnss_driver"}, {"polling_period.pvt", std::int64_t{200}}}, unused);
  EXPECT_EQ(septentrio.at("rate_hz"), ParameterValue(5.0));
  const Parameters novatel =
      own_parameters({{"driver", "novatel_gps_driver"}, {"polling_period", 0.05}}, unused);
  EXPECT_EQ(novatel.at("rate_hz"), ParameterValue(20.0));
  EXPECT_THAT(unused, IsEmpty());
}

TEST(Driver, TheNodesOwnParametersGoBefore) {
  std::vector<std::string> unused;
  const Parameters own = own_parameters({{"driver", "ublox_gps"}, {"rate", 4.0}, {"rate_hz", 10.0}}, unused);
  EXPECT_EQ(own.at("rate_hz"), ParameterValue(10.0));
  // Without a driver its names mean nothing.
  EXPECT_FALSE(own_parameters({{"rate", 4.0}}, unused).contains("rate_hz"));
  EXPECT_THAT(unused, ElementsAre("rate"));
}

TEST(Driver, SaysHowItsNodeStarts) {
  const Parameters world{{"city.open", true},
                         {"city.origin.latitude_deg", 22.3},
                         {"city.origin.longitude_deg", 114.17},
                         {"sky.nominal", true},
                         {"pose.source", "pose"},
                         {"profile", "ublox-f9p"}};
  EXPECT_EQ(read_settings(world).frame_id, "gnss");
  EXPECT_FALSE(read_settings(world).autostart);
  EXPECT_FALSE(read_settings(world).diagonal_covariance);
  Parameters driven = world;
  driven["driver"] = "ublox_gps";
  EXPECT_EQ(read_settings(driven).frame_id, "gps");
  EXPECT_TRUE(read_settings(driven).autostart);
  EXPECT_TRUE(read_settings(driven).diagonal_covariance);
  EXPECT_EQ(read_settings(driven).corrections_topic(), "");
  driven["rtk.enabled"] = true;
  EXPECT_EQ(read_settings(driven).corrections_topic(), "/rtcm");
  driven["corrections.from"] = "topic:/base";
  driven["frame_id"] = "antenna";
  EXPECT_EQ(read_settings(driven).corrections_topic(), "/base");
  EXPECT_EQ(read_settings(driven).frame_id, "antenna");
  driven["diagonal_covariance"] = false;
  EXPECT_FALSE(read_settings(driven).diagonal_covariance);
}

}  // namespace
}  // namespace canyon::adapters::ros2
