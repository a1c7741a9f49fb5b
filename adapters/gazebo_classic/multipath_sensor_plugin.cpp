// No header declares it: Gazebo loads it by name.
// The paper's plugin: a GNSS receiver on a sensor (ray, gps, any other) of a link.

#include <gazebo/common/Console.hh>
#include <gazebo/common/Plugin.hh>
#include <gazebo/physics/physics.hh>
#include <gazebo/sensors/Sensor.hh>

#include "adapters/gazebo_classic/gnss_sensor.hpp"

namespace canyon::adapters::gazebo_classic {

class MultipathSensorPlugin final : public gazebo::SensorPlugin {
 public:
  void Load(gazebo::sensors::SensorPtr sensor, sdf::ElementPtr sdf) override {
    Attachment at;
    at.world = gazebo::physics::get_world(sensor->WorldName());
    at.link =
        boost::dynamic_pointer_cast<gazebo::physics::Link>(at.world->EntityByName(sensor->ParentName()));
    at.sensor = std::move(sensor);
    at.sdf = std::move(sdf);
    if (!at.link) {
      gzerr << "[canyon] sensor '" << at.sensor->ScopedName()
            << "' belongs to no link; the receiver is switched off\n";
      return;
    }
    receiver_ = load_gnss_sensor(at);
  }

 private:
  std::unique_ptr<GnssSensor> receiver_;
};

GZ_REGISTER_SENSOR_PLUGIN(MultipathSensorPlugin)

}  // namespace canyon::adapters::gazebo_classic
