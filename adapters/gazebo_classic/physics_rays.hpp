#pragma once

#include <Eigen/Core>
#include <gazebo/physics/PhysicsTypes.hh>
#include <gazebo/sensors/SensorTypes.hh>
#include <memory>
#include <span>
#include <string>

namespace canyon::gazebo_classic {

/// A ray in Gazebo's world frame. `direction` is unit length.
struct PhysicsRay {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;
  double max_range_m = 1e4;  ///< finite: the physics engine's rays have an end
};

/// Rays of Gazebo's physics engine, aimed anew at every call and cast before it returns: ranges always belong
/// to the rays just given, also when their number changes. For the simulation's thread only.
class PhysicsRays {
 public:
  /// Takes over the rays of `sensor` (its own updates stop aiming them), or makes a set of rays on `link`
  /// where `sensor` is null. Throws InputError where the physics engine has no rays.
  PhysicsRays(const gazebo::physics::LinkPtr& link, const gazebo::sensors::RaySensorPtr& sensor,
              const std::string& name);
  ~PhysicsRays();
  PhysicsRays(const PhysicsRays&) = delete;
  PhysicsRays& operator=(const PhysicsRays&) = delete;

  /// ranges[i] of rays[i] [m], infinite where it meets nothing; spans of one length. `left_out` (null: none):
  /// a topmost model through which rays go.
  void cast(std::span<const PhysicsRay> rays, const gazebo::physics::ModelPtr& left_out,
            std::span<double> ranges);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::gazebo_classic
