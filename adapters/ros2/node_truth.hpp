#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "adapters/ros2/map_projection.hpp"
#include "adapters/ros2/node_settings.hpp"
#include "canyon/outputs/live/hosted_receiver.hpp"
#include "canyon/simulation/environment.hpp"

namespace canyon::adapters::ros2 {

/// A scenario's own drive.
using Drive = std::shared_ptr<const simulation::Simulation>;

/// A receiver in a city, moved by external poses or by `drive`, or at its fixed position.
/// @param start GPS time of the host's time 0, without a drive; @param receiver_name see driven_config()
[[nodiscard]] live::HostSetup setup_of(const NodeSettings& settings,
                                       std::shared_ptr<simulation::CityScene> scene, geodesy::GpsTime start,
                                       const std::string& receiver_name, live::LogFunction log,
                                       const Drive& drive = nullptr);

class NodeTruth {
 public:
  /// Throws InputError for an unreadable map_projector.
  NodeTruth(const NodeSettings& settings, const city::City& city, Drive drive = nullptr);

  /// A pose of the vehicle in pose_frame, with the sender's stamp [s], received at `now_ns` of the host's
  /// time. See PoseInbox::take().
  [[nodiscard]] std::string take(const simulation::RigidPose& pose, double stamp_s, std::int64_t now_ns);
  /// Empty, with `reason`, if no pose was received in time. @param now_ns with a drive: since its beginning
  [[nodiscard]] std::optional<live::HostedReceiver::Motion> at(std::int64_t now_ns, std::string& reason);

 private:
  Drive drive_;
  std::optional<simulation::Pose> fixed_;
  std::optional<MapProjection> projection_;
  simulation::PoseInbox poses_;
};

}  // namespace canyon::adapters::ros2
