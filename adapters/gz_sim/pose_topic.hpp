#pragma once

#include <gz/msgs/pose.pb.h>
#include <atomic>
#include <cstdint>
#include <gz/transport/Node.hh>
#include <optional>
#include <string>

#include "adapters/common/pose_motion.hpp"
#include "adapters/common/sdf/plugin_settings.hpp"

namespace canyon::adapters::gz_sim {

/// Truth from outside: gz.msgs.Pose on settings.pose_topic, in the world's frame. See PoseTrack.
class PoseTopic {
 public:
  explicit PoseTopic(const PluginSettings& settings);
  [[nodiscard]] std::optional<TruePose> at(std::int64_t now_ns, std::string& reason);
  /// Tells the world's time in every step: age counts in simulated time, which messages of another program's
  /// clock do not carry.
  void tick(std::int64_t now_ns) { now_ns_ = now_ns; }
  void reset();

 private:
  void on_pose(const gz::msgs::Pose& message);

  const std::string topic_;
  PoseTrack track_;
  std::atomic<std::int64_t> now_ns_{0};
  std::atomic<bool> complained_{false};
  gz::transport::Node node_;  // last: its destructor waits for the call in progress
};

}  // namespace canyon::adapters::gz_sim
