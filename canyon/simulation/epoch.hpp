#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/receiver/observation.hpp"
#include "canyon/simulation/motion/pose.hpp"
#include "canyon/simulation/scenario/fwd.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"

namespace canyon::receiver {
struct ReceiverOptions;
}

namespace canyon::simulation {

struct SensorBatch;

/// One receiver at one instant: truth, observations and fix.
struct Epoch {
  std::size_t receiver = 0;  ///< index into Simulation::scenario().receivers
  Pose truth;                ///< of the antenna (lever arm and clamp applied)
  Eigen::Vector3d truth_ecef = Eigen::Vector3d::Zero();
  raytrace::Containment containment = raytrace::Containment::Free;
  receiver::ReceiverEpoch observed;
  /// Disturbed paths, in the city's ENU frame; null: none. Valid only during EpochSink::write().
  const propagation::Arrival* arrival = nullptr;
  /// Names of the active faults, in the order of the timeline.
  std::vector<std::string> faults;
  /// Navigation messages of the satellites; valid as `arrival`. Null or empty for skies without messages.
  const gnss::NavigationData* navigation = nullptr;
  /// Samples of the vehicle's sensors since the previous epoch; valid as `arrival`. Null: not used.
  const SensorBatch* sensors = nullptr;
  /// City and sky of the epoch, and the receiver's options; valid as `arrival`.
  const Environment* environment = nullptr;
  const receiver::ReceiverOptions* options = nullptr;
  /// Fix minus truth in ENU at the truth [m]; NaN without fix.
  Eigen::Vector3d error_enu_m = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  /// Height of mean sea level above the ellipsoid as the receiver uses it [m]; 0 if unknown.
  double geoid_undulation_m = 0;

  /// Height of the fix above mean sea level [m]. Precondition: observed.fix.solved().
  [[nodiscard]] double altitude_m() const { return observed.fix.position.height_m - geoid_undulation_m; }
};

/// Receives epochs in order: by time, then by receiver.
class EpochSink {
 public:
  virtual ~EpochSink() = default;
  virtual void write(const Epoch& epoch) = 0;
  /// Completes the files after the last epoch, also after an interruption.
  virtual void finish() = 0;
  /// Whether epochs need Epoch::sensors.
  [[nodiscard]] virtual bool uses_sensors() const { return false; }
  /// Warnings about the written files, one line each; valid after finish().
  [[nodiscard]] virtual std::vector<std::string> warnings() const { return {}; }
};

}  // namespace canyon::simulation
