#pragma once

#include <gazebo/common/Time.hh>
#include <gazebo/physics/PhysicsTypes.hh>
#include <gazebo/sensors/SensorTypes.hh>
#include <memory>
#include <sdf/sdf.hh>
#include <string>

namespace canyon::adapters::gazebo_classic {

/// The context of a receiver's plugin in a world.
struct Attachment {
  gazebo::physics::WorldPtr world;
  gazebo::physics::LinkPtr link;
  gazebo::sensors::SensorPtr sensor;  ///< null for a model's plugin
  sdf::ElementPtr sdf;                ///< the plugin's element
};

/// One GNSS receiver in a running Gazebo world: reads truth and geometry from the world, computes epochs with
/// the engine and passes them to the publishers. It is called at the end of every update of the world until
/// it is destroyed. All work is done in the simulation's thread.
class GnssSensor {
 public:
  /// Throws InputError for a wrong value in the plugin's element. Logs warnings on Gazebo's console.
  explicit GnssSensor(const Attachment& attachment);
  ~GnssSensor();
  GnssSensor(const GnssSensor&) = delete;
  GnssSensor& operator=(const GnssSensor&) = delete;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Makes a receiver for a plugin's Load(). Null after an error, which goes to Gazebo's console.
[[nodiscard]] std::unique_ptr<GnssSensor> load_gnss_sensor(const Attachment& attachment) noexcept;

}  // namespace canyon::adapters::gazebo_classic
