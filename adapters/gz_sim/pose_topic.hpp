#pragma once

#include <gz/msgs/pose.pb.h>
#include <atomic>
#include <cstdint>
#include <gz/transport/Node.hh>
#include <memory>
#include <optional>
#include <string>

#include "adapters/common/host_settings.hpp"
#include "adapters/common/pose_motion.hpp"

namespace canyon::adapters::gz_sim {

/// Truth from outside: gz.msgs.Pose on settings.pose_topic, in the world's frame. See PoseTrack.
class PoseTopic {
 public:
  explicit PoseTopic(const HostSettings& settings);
  [[nodiscard]] std::optional<TruePose> at(std::int64_t now_ns, std::string& reason);
  /// Takes the world's time in every step: age counts in simulated time, which messages of another program's
  /// clock do not carry.
  void tick(std::int64_t now_ns) { inbox_->now_ns = now_ns; }
  void reset();

 private:
  /// A call of the transport's may still be in progress when the node has ended.
  struct Inbox {
    explicit Inbox(const HostSettings& settings);
    void take(const gz::msgs::Pose& message);
    const std::string topic;
    PoseTrack track;
    std::atomic<std::int64_t> now_ns{0};
    std::atomic<bool> complained{false};
  };
  std::shared_ptr<Inbox> inbox_;
  gz::transport::Node node_;
};

}  // namespace canyon::adapters::gz_sim
