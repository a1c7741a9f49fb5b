#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "canyon/simulation/live_receiver.hpp"

namespace canyon::adapters {

/// Names of a receiver in its world; fixed once its plugin is loaded.
struct ReceiverIdentity {
  std::string world;   ///< its name
  std::string model;   ///< topmost model that carries it, "iris"
  std::string link;    ///< scoped without the world, "iris::gps0::link"
  std::string parent;  ///< the model right above the link, without scope: "gps0"
  std::string sensor;  ///< name of its sensor; empty for a model's plugin
  std::string plugin;  ///< name of the plugin element
};

/// A receiver's report of one update.
struct ReceiverReport {
  std::int64_t sim_time_ns = 0;  ///< time of the host's clock
  /// Null if the truth has not come (pose_topic silent or too old): there is no epoch, for this `reason`.
  const simulation::LiveReceiver::Step* step = nullptr;
  std::string reason;
  Eigen::Vector3d antenna_world_m = Eigen::Vector3d::Zero();                ///< in the host's world frame
  Eigen::Quaterniond link_attitude_world = Eigen::Quaterniond::Identity();  ///< world from link
  double world_yaw_from_enu_rad = 0;  ///< yaw in the world frame = yaw in ENU + this
  /// One range [m] per ray, as the paper's ray sensor has them: direct and mirror ray of each satellite of
  /// step->arrival.views in turn; infinite for none. Empty where no scan is published.
  std::vector<double> scan_ranges_m;
  double scan_max_range_m = 0;
};

/// An output of a host. Called from one thread at a time, the simulation's or one that it waits for: quick,
/// and nothing here may throw.
class EpochPublisher {
 public:
  virtual ~EpochPublisher() = default;
  virtual void publish(const ReceiverReport& report) = 0;
  /// An update of the world without an epoch, at this time of the host's clock: a driver at the other end of
  /// a line gets its answers, and what is late in the line arrives.
  virtual void serve(std::int64_t /*sim_time_ns*/) {}
  /// The world was reset or time jumped back.
  virtual void reset() {}
  /// Notes since the last call, one line each.
  [[nodiscard]] virtual std::vector<std::string> take_notes() { return {}; }
};

}  // namespace canyon::adapters
