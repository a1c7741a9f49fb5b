#include "adapters/gz_sim/pose_topic.hpp"

#include <gz/common/Console.hh>

namespace canyon::adapters::gz_sim {

PoseTopic::PoseTopic(const PluginSettings& settings)
    : topic_(settings.pose_topic), track_(settings.pose_topic, settings.pose_timeout_s) {
  if (!node_.Subscribe(topic_, &PoseTopic::on_pose, this)) {
    gzerr << "[canyon] <pose_topic>: Gazebo does not let '" << topic_ << "' be subscribed to\n";
  }
}

std::optional<TruePose> PoseTopic::at(std::int64_t now_ns, std::string& reason) {
  now_ns_ = now_ns;
  return track_.at(now_ns, reason);
}

void PoseTopic::reset() {
  track_.reset();
  now_ns_ = 0;
}

// Comes in a thread of Gazebo transport.
void PoseTopic::on_pose(const gz::msgs::Pose& message) {
  const auto& p = message.position();
  const auto& q = message.orientation();
  const auto& stamp = message.header().stamp();
  const double stamp_s = static_cast<double>(stamp.sec()) + static_cast<double>(stamp.nsec()) * 1e-9;
  const RigidPose pose{{p.x(), p.y(), p.z()}, {q.w(), q.x(), q.y(), q.z()}};
  if (track_.add(pose, stamp_s, now_ns_) || complained_.exchange(true)) return;
  gzerr << "[canyon] poses on " << topic_
        << " are dropped where they are not finite or their quaternion is zero; this is the first\n";
}

}  // namespace canyon::adapters::gz_sim
