#include "adapters/ros2/node_truth.hpp"

#include <utility>

namespace canyon::adapters::ros2 {
namespace {

const char* source_name(PoseSource source) {
  return source == PoseSource::Odometry ? "odom" : source == PoseSource::Tf ? "tf" : "pose";
}

}  // namespace

live::HostSetup setup_of(const NodeSettings& settings, std::shared_ptr<simulation::CityScene> scene,
                         geodesy::GpsTime start, const std::string& own_name, live::HostOutputs::Say say) {
  live::HostSetup setup;
  setup.options = settings;
  setup.options.live = driven_config(settings, own_name);
  setup.frame = {scene->city.frame, settings.pose_heading_rad, settings.pose_origin_enu_m};
  setup.start = start;
  setup.say = std::move(say);
  setup.city = std::move(scene);
  return setup;
}

NodeTruth::NodeTruth(const NodeSettings& settings, const city::City& city)
    : poses_(source_name(settings.pose_source), settings.pose_timeout_s) {
  if (settings.pose_source == PoseSource::Fixed) {
    simulation::FixedPlace place = *settings.live.receiver().fixed;
    place.settle(city.frame);
    fixed_ = simulation::antenna_state({{}, place.place}, city.frame);
  }
  if (settings.map_projector) {
    projection_.emplace(read_map_projector_info(*settings.map_projector), city.frame,
                        city.geoid_undulation_m);
  }
}

std::string NodeTruth::take(const simulation::RigidPose& pose, double stamp_s, std::int64_t now_ns) {
  poses_.step(now_ns);
  const auto proper = simulation::proper_pose(pose);
  return poses_.take(proper && projection_ ? projection_->in_city(*proper) : pose, stamp_s);
}

std::optional<live::HostedReceiver::Motion> NodeTruth::at(std::int64_t now_ns, std::string& reason) {
  if (fixed_) return *fixed_;
  return poses_.at(now_ns, reason);
}

}  // namespace canyon::adapters::ros2
