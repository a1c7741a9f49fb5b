#include "adapters/gz_sim/pose_topic.hpp"

#include <gz/common/Console.hh>

namespace canyon::adapters::gz_sim {

PoseTopic::Inbox::Inbox(const HostSettings& settings)
    : topic(settings.pose_topic), track(settings.pose_topic, {settings.pose_timeout_s}) {}

// Called in a thread of Gazebo transport.
void PoseTopic::Inbox::take(const gz::msgs::Pose& message) {
  const auto& p = message.position();
  const auto& q = message.orientation();
  const auto& stamp = message.header().stamp();
  const double stamp_s = static_cast<double>(stamp.sec()) + static_cast<double>(stamp.nsec()) * 1e-9;
  const RigidPose pose{{p.x(), p.y(), p.z()}, {q.w(), q.x(), q.y(), q.z()}};
  if (track.add({pose, stamp_s, {}, {}}, now_ns) != PoseTrack::Taken::NoPose || complained.exchange(true))
    return;
  gzerr << "[canyon] poses on " << topic
        << " are dropped where they are not finite or their quaternion is zero; this is the first\n";
}

PoseTopic::PoseTopic(const HostSettings& settings) : inbox_(std::make_shared<Inbox>(settings)) {
  std::function<void(const gz::msgs::Pose&)> take = [inbox = inbox_](const gz::msgs::Pose& message) {
    inbox->take(message);
  };
  if (!node_.Subscribe(inbox_->topic, take)) {
    gzerr << "[canyon] <pose_topic>: Gazebo does not let '" << inbox_->topic << "' be subscribed to\n";
  }
}

std::optional<TruePose> PoseTopic::at(std::int64_t now_ns, std::string& reason) {
  inbox_->now_ns = now_ns;
  return inbox_->track.at(now_ns, reason);
}

void PoseTopic::reset() {
  inbox_->track.reset();
  inbox_->now_ns = 0;
}

}  // namespace canyon::adapters::gz_sim
