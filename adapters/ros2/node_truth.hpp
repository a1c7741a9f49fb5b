#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "adapters/ros2/map_projection.hpp"
#include "adapters/ros2/node_settings.hpp"
#include "canyon/outputs/live/hosted_receiver.hpp"
#include "canyon/run/environment.hpp"

namespace canyon::adapters::ros2 {

/// A scenario's own drive.
using Drive = std::shared_ptr<const simulation::Simulation>;

/// A receiver in a city that is moved by poses from outside or by `drive`, or stands at its fixed place.
/// @param start GPS time of the host's time 0, without a drive; @param own_name see driven_config()
[[nodiscard]] live::HostSetup setup_of(const NodeSettings& settings,
                                       std::shared_ptr<simulation::CityScene> scene, geodesy::GpsTime start,
                                       const std::string& own_name, live::Say say,
                                       const Drive& drive = nullptr);

/// Its truth.
class NodeTruth {
 public:
  /// Throws InputError for a map_projector that cannot be read.
  NodeTruth(const NodeSettings& settings, const city::City& city, Drive drive = nullptr);

  /// A pose of the vehicle in pose_frame, with the sender's stamp [s], that comes at `now_ns` of the host's
  /// time. As PoseInbox::take().
  [[nodiscard]] std::string take(const simulation::RigidPose& pose, double stamp_s, std::int64_t now_ns);
  /// Empty, with `reason`, where no pose has come in time. @param now_ns of the drive: since its begin
  [[nodiscard]] std::optional<live::HostedReceiver::Motion> at(std::int64_t now_ns, std::string& reason);

 private:
  Drive drive_;
  std::optional<simulation::Pose> fixed_;
  std::optional<MapProjection> projection_;
  simulation::PoseInbox poses_;
};

}  // namespace canyon::adapters::ros2
