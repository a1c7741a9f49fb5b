#include "adapters/ros2/node_truth.hpp"

#include <chrono>
#include <utility>

#include "canyon/simulation/environment.hpp"

namespace canyon::adapters::ros2 {
namespace {}  // namespace

live::HostSetup setup_of(const NodeSettings& settings, std::shared_ptr<simulation::CityScene> scene,
                         geodesy::GpsTime start, const std::string& receiver_name, live::LogFunction log,
                         const Drive& drive) {
  live::HostSetup setup;
  setup.options = settings;
  setup.options.live = driven_config(settings, receiver_name, drive.get());
  setup.frame = {scene->city.frame, settings.pose_heading_rad, settings.pose_origin_enu_m};
  setup.start = start;
  if (drive) {
    setup.frame = {scene->city.frame};
    setup.epochs = static_cast<std::int64_t>(drive->epoch_count());
    if (setup.options.live.with_sensors) setup.sensors = [drive] { return drive->sensors(); };
  }
  setup.log = std::move(log);
  setup.city = std::move(scene);
  return setup;
}

NodeTruth::NodeTruth(const NodeSettings& settings, const city::City& city, Drive drive)
    : drive_(std::move(drive)),
      poses_(settings.pose_source == PoseSource::Odometry ? "odom"
             : settings.pose_source == PoseSource::Tf     ? "tf"
                                                          : "pose",
             settings.pose_timeout_s) {
  if (settings.pose_source == PoseSource::Fixed) {
    simulation::FixedPosition position = *settings.live.receiver().fixed;
    position.resolve(city.frame);
    fixed_ = simulation::Pose{{}, position.position};
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
  using Antennas = live::HostedReceiver::Antennas;
  if (drive_) {
    const geodesy::GpsTime now = drive_->begin() + std::chrono::nanoseconds(now_ns);
    Antennas antennas{drive_->antenna_pose(0, now)};
    if (drive_->scenario().receivers.size() > 1) antennas.base = drive_->antenna_pose(1, now);
    return antennas;
  }
  if (fixed_) return Antennas{*fixed_};
  return poses_.at(now_ns, reason);
}

}  // namespace canyon::adapters::ros2
