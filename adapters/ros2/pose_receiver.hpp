#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "adapters/common/pose_motion.hpp"
#include "adapters/ros2/map_projection.hpp"
#include "adapters/ros2/node_settings.hpp"
#include "adapters/ros2/rtcm_topic.hpp"
#include "canyon/simulation/city_scene.hpp"
#include "canyon/simulation/live_receiver.hpp"

namespace canyon::adapters::ros2 {

/// A receiver in a city whose vehicle's poses come from outside, or that stands at its fixed place. Not
/// thread-safe.
class PoseReceiver {
 public:
  /// @param start GPS time of the host's time 0; @param own_name see live_config()
  /// Throws InputError as LiveReceiver does.
  PoseReceiver(const NodeSettings& settings, std::shared_ptr<simulation::CityScene> scene,
               geodesy::GpsTime start, std::string own_name);

  /// A pose of the vehicle in pose_frame, with the sender's stamp [s], that comes at `now_ns` of the host's
  /// time. False if it is not finite or its quaternion has no direction.
  bool add(const RigidPose& pose, double stamp_s, std::int64_t now_ns);
  /// A message of NodeSettings::corrections_topic(), which comes at `now_ns`.
  void receive_rtcm(std::string_view bytes, std::int64_t now_ns);
  /// The epoch at `now_ns`; empty, with `reason`, where no pose has come in time. Time that goes back begins
  /// anew. Throws InputError as LiveReceiver::observe() does.
  [[nodiscard]] std::optional<simulation::LiveReceiver::Step> observe(std::int64_t now_ns,
                                                                      std::string& reason);

  /// Other options from the next epoch on, as LiveReceiver::set_config(): it begins anew; sky, poses and city
  /// stay.
  void change(const NodeSettings& settings);
  [[nodiscard]] simulation::LiveReceiver& receiver() { return receiver_; }
  /// Warnings since the last call, one line each.
  [[nodiscard]] std::vector<std::string> take_warnings();

 private:
  [[nodiscard]] simulation::LiveConfig config_of(const NodeSettings& settings) const;
  void make_topic();
  [[nodiscard]] geodesy::GpsTime time_of(std::int64_t now_ns) const;
  [[nodiscard]] std::optional<simulation::AntennaState> antenna_at(std::int64_t now_ns, std::string& reason);

  NodeSettings settings_;
  std::string own_name_;
  std::shared_ptr<simulation::CityScene> scene_;
  std::optional<MapProjection> projection_;
  PoseTrack track_;
  simulation::LiveReceiver receiver_;
  std::optional<RtcmTopic> topic_;
};

}  // namespace canyon::adapters::ros2
