#pragma once

#include <cstdint>
#include <gazebo/common/Time.hh>
#include <ignition/math/Pose3.hh>
#include <string>
#include <vector>

#include "canyon/simulation/live_receiver.hpp"

namespace canyon::gazebo_classic {

/// Who a receiver is in its world; fixed once its plugin is loaded.
struct ReceiverIdentity {
  std::string world;   ///< Gazebo's world name
  std::string model;   ///< topmost model that carries it, "iris"
  std::string link;    ///< scoped without the world, "iris::gps0::link"
  std::string parent;  ///< the model right above the link, without scope: "gps0"
  std::string sensor;  ///< of the sensor it is attached to; empty for a model's plugin
  std::string plugin;  ///< name of the plugin element
};

/// What a receiver has to say at one update.
struct ReceiverReport {
  gazebo::common::Time sim_time;
  /// Null where the truth has not come (pose_topic silent or too old): there is no epoch, and `reason` says
  /// why.
  const simulation::LiveReceiver::Step* step = nullptr;
  std::string reason;
  ignition::math::Pose3d antenna_world;  ///< antenna's place and the link's attitude, in Gazebo's world frame
  double world_yaw_from_enu_rad = 0;     ///< yaw in the world frame = yaw in ENU + this
  /// One range [m] per ray, as the paper's ray sensor has them: direct and mirror ray of each satellite of
  /// step->arrival.views in turn; infinite for none. Empty where no scan is published.
  std::vector<double> scan_ranges_m;
  double scan_max_range_m = 0;
};

/// One way out of the plugin. Called from the simulation's thread: quick, and nothing here may throw.
class EpochPublisher {
 public:
  virtual ~EpochPublisher() = default;
  virtual void publish(const ReceiverReport& report) = 0;
  /// The world was reset or time jumped back.
  virtual void reset() {}
};

}  // namespace canyon::gazebo_classic
