#pragma once

#include <Eigen/Core>
#include <gazebo/physics/PhysicsTypes.hh>
#include <gazebo/sensors/SensorTypes.hh>
#include <memory>
#include <span>
#include <string>

namespace canyon::adapters::gazebo_classic {

/// A ray in Gazebo's world frame. `direction` is unit length to 1e-6.
struct PhysicsRay {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;
  double max_range_m = 1e4;  ///< > 0 and finite: the physics engine's rays have an end
};

/// Rays of Gazebo's physics engine (ODE), set at every call and cast before it returns: ranges always belong
/// to the given rays, also if their number changes. They hit the same geometry as the rays of a `ray` sensor:
/// collisions, also from inside, with any collide_bitmask. The rays are outside the world's collision space:
/// they have no mass, no contacts, and no entity. For the simulation's thread only.
class PhysicsRays {
 public:
  /// Casts in the world of `link`. A ray sensor's own thread sets and casts its rays without a lock, so their
  /// results are not used: `sensor` (null: none) is set inactive, and its rays show the cast rays, see
  /// cast(). `name` is for messages. Throws InputError if the physics engine is not ODE.
  PhysicsRays(const gazebo::physics::LinkPtr& link, const gazebo::sensors::RaySensorPtr& sensor,
              const std::string& name);
  /// Makes the sensor active again if it was so before.
  ~PhysicsRays();
  PhysicsRays(const PhysicsRays&) = delete;
  PhysicsRays& operator=(const PhysicsRays&) = delete;

  /// ranges[i] of rays[i] [m], infinite without a hit within its max_range_m; spans of one length. Error
  /// below 1e-6 m for primitive shapes and heightmaps; meshes are in single precision, about 1e-7 of their
  /// coordinates. `left_out` (null: none): a model that rays pass through, with its nested models.
  ///
  /// The first rays of the sensor are laid along the rays just cast, each with the length found, unless the
  /// sensor's Gazebo topic has a subscriber: then its own thread uses them.
  ///
  /// Throws InputError for spans of different lengths or a ray that is not finite, not of unit length, or has
  /// no range; then nothing is cast.
  void cast(std::span<const PhysicsRay> rays, const gazebo::physics::ModelPtr& left_out,
            std::span<double> ranges);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::adapters::gazebo_classic
