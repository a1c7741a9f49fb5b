#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "canyon/outputs/live/epoch_publisher.hpp"

namespace google::protobuf {
class Descriptor;
class Message;
}  // namespace google::protobuf

namespace canyon::adapters::gazebo_classic {

/// The fields of sensor_msgs.msgs.SITLGps read by PX4's bridge for Gazebo Classic.
struct SitlGps {
  std::uint64_t time_usec = 0;      ///< simulated time [us]
  std::uint64_t time_utc_usec = 0;  ///< time of reception, UTC, since 1970-01-01 [us]
  double latitude_deg = 0;
  double longitude_deg = 0;
  double altitude_m = 0;    ///< above mean sea level
  double eph_m = 0;         ///< horizontal: root of the summed variances of east and north
  double epv_m = 0;         ///< vertical: root of the variance
  double velocity_mps = 0;  ///< over ground
  double velocity_east_mps = 0;
  double velocity_north_mps = 0;
  double velocity_up_mps = 0;
};

/// Empty without truth, fix or velocity, since the bridge treats every message as a 3D fix with velocity.
[[nodiscard]] std::optional<SitlGps> sitl_gps_of(const live::ReceiverReport& report);

/// "sensor_msgs.msgs.SITLGps".
inline constexpr const char* kSitlGpsType = "sensor_msgs.msgs.SITLGps";

/// Makes messages of type kSitlGpsType without linking a class for it. PX4's plugins in the same process link
/// theirs; a second class of that name would end the process, and subscribers in the process get the object
/// itself, which must be of their class. So the class is PX4's if the process has it, loaded before or after,
/// else one made at run time. Not thread-safe.
class SitlGpsMessage {
 public:
  SitlGpsMessage();
  ~SitlGpsMessage();

  /// The message, until the next call; null if the process's class requires an unknown field (problem()).
  [[nodiscard]] const google::protobuf::Message* fill(const SitlGps& gps);
  [[nodiscard]] const std::string& problem() const { return problem_; }
  /// Whether the process's own class is in use.
  [[nodiscard]] bool generated() const { return generated_; }

 private:
  void choose_class();

  std::unique_ptr<google::protobuf::Message> message_;
  bool generated_ = false;
  std::string problem_;
};

}  // namespace canyon::adapters::gazebo_classic
