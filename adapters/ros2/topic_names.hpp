#pragma once

#include <string>

namespace canyon::adapters::ros2 {

/// Names of a receiver's topics; those that are empty are not published.
struct TopicNames {
  std::string fix = "fix";
  std::string fix_velocity = "fix_velocity";
  std::string gps_fix = "gpsfix";  ///< gps_msgs/GPSFix, in builds with it
  std::string orientation =
      "autoware_orientation";  ///< of receivers with an attitude, in builds with its message
  std::string gnss_multipath = "gnss_multipath";
  std::string satellites = "satellites";
  std::string raw_observations = "raw_observations";
  std::string diagnostics = "/diagnostics";
  std::string scan = {};
  std::string imu = {};
  std::string wheels = {};
  std::string magnetic_field = {};
  std::string air_pressure = {};
  std::string clock = {};
};

}  // namespace canyon::adapters::ros2
