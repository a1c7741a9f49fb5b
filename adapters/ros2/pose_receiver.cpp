#include "adapters/ros2/pose_receiver.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <iterator>
#include <utility>

namespace canyon::adapters::ros2 {
namespace {

const char* source_name(PoseSource source) {
  return source == PoseSource::Odometry ? "odom" : source == PoseSource::Tf ? "tf" : "pose";
}

std::optional<MapProjection> projection_of(const NodeSettings& settings, const city::City& city) {
  if (!settings.map_projector) return std::nullopt;
  return MapProjection(read_map_projector_info(*settings.map_projector), city.frame, city.geoid_undulation_m);
}

}  // namespace

PoseReceiver::PoseReceiver(const NodeSettings& settings, std::shared_ptr<simulation::CityScene> scene,
                           geodesy::GpsTime start, std::string own_name)
    : settings_(settings),
      own_name_(std::move(own_name)),
      scene_(std::move(scene)),
      projection_(projection_of(settings, scene_->city)),
      track_(source_name(settings.pose_source), {settings.pose_timeout_s}),
      receiver_(config_of(settings), scene_, start) {
  make_topic();
}

simulation::LiveConfig PoseReceiver::config_of(const NodeSettings& settings) const {
  simulation::LiveConfig config = live_config(settings, own_name_);
  if (config.receiver().fixed) config.receiver().fixed->settle(scene_->city.frame);
  return config;
}

void PoseReceiver::make_topic() {
  topic_.reset();
  if (!settings_.corrections_topic().empty()) {
    topic_.emplace(receiver_.config().receiver().options, settings_.live.seed);
  }
}

geodesy::GpsTime PoseReceiver::time_of(std::int64_t now_ns) const {
  return receiver_.start() + static_cast<double>(now_ns) * 1e-9;
}

void PoseReceiver::change(const NodeSettings& settings) {
  receiver_.set_config(config_of(settings));
  settings_ = settings;
  make_topic();
}

bool PoseReceiver::add(const RigidPose& pose, double stamp_s, std::int64_t now_ns) {
  const auto proper = simulation::proper_pose(pose);
  if (!proper) return false;
  const RigidPose in_city = projection_ ? projection_->in_city(*proper) : *proper;
  return track_.add({in_city, stamp_s, {}, {}}, now_ns) != PoseTrack::Taken::NoPose;
}

void PoseReceiver::receive_rtcm(std::string_view bytes, std::int64_t now_ns) {
  if (topic_) topic_->receive(bytes, time_of(now_ns));
}

std::optional<simulation::AntennaState> PoseReceiver::antenna_at(std::int64_t now_ns, std::string& reason) {
  if (settings_.pose_source == PoseSource::Fixed) {
    const geodesy::Geodetic& place = receiver_.config().receiver().fixed->place;
    return simulation::antenna_state({time_of(now_ns), place}, scene_->city.frame);
  }
  const auto truth = track_.at(now_ns, reason);
  if (!truth) return std::nullopt;
  return simulation::antenna_of(*truth, receiver_.config().receiver().lever_arm_m, settings_.pose_heading_rad,
                                settings_.pose_origin_enu_m);
}

std::optional<simulation::LiveReceiver::Step> PoseReceiver::observe(std::int64_t now_ns,
                                                                    std::string& reason) {
  const auto antenna = antenna_at(now_ns, reason);
  if (!antenna) return std::nullopt;
  const double seconds = static_cast<double>(now_ns) * 1e-9;
  return topic_ ? topic_->observe(receiver_, seconds, *antenna) : receiver_.observe(seconds, *antenna);
}

std::vector<std::string> PoseReceiver::take_warnings() {
  std::vector<std::string> lines = receiver_.take_warnings();
  if (topic_) {
    std::vector<std::string> more = topic_->take_warnings();
    std::move(more.begin(), more.end(), std::back_inserter(lines));
  }
  return lines;
}

}  // namespace canyon::adapters::ros2
