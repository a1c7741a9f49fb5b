#include "adapters/ros2/pose_receiver.hpp"

#include <Eigen/Geometry>
#include <utility>

namespace canyon::adapters::ros2 {
namespace {

const char* source_name(PoseSource source) {
  return source == PoseSource::Odometry ? "odom" : source == PoseSource::Tf ? "tf" : "pose";
}

}  // namespace

PoseReceiver::PoseReceiver(const NodeSettings& settings, std::shared_ptr<simulation::CityScene> scene,
                           geodesy::GpsTime start, std::string own_name)
    : settings_(settings),
      own_name_(std::move(own_name)),
      track_(source_name(settings.pose_source), {settings.pose_timeout_s}),
      receiver_(live_config(settings, own_name_), std::move(scene), start) {}

void PoseReceiver::change(const NodeSettings& settings) {
  receiver_.set_config(live_config(settings, own_name_));
  settings_ = settings;
}

std::optional<simulation::LiveReceiver::Step> PoseReceiver::observe(std::int64_t now_ns,
                                                                    std::string& reason) {
  const auto truth = track_.at(now_ns, reason);
  if (!truth) return std::nullopt;
  const simulation::AntennaState antenna =
      simulation::antenna_of(*truth, receiver_.config().receiver.lever_arm_m, settings_.pose_heading_rad,
                             settings_.pose_origin_enu_m);
  return receiver_.observe(static_cast<double>(now_ns) * 1e-9, antenna);
}

}  // namespace canyon::adapters::ros2
