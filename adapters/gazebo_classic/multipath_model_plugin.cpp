// No header declares it: Gazebo loads it by name. The same receiver for a model without a sensor: <plugin>
// directly under <model>. Element <link> names the link with the antenna; default: the model's first.
#include <gazebo/common/Console.hh>
#include <gazebo/common/Plugin.hh>
#include <gazebo/physics/physics.hh>

#include "adapters/gazebo_classic/gnss_sensor.hpp"

namespace canyon::adapters::gazebo_classic {

class MultipathModelPlugin final : public gazebo::ModelPlugin {
 public:
  void Load(gazebo::physics::ModelPtr model, sdf::ElementPtr sdf) override {
    Attachment at;
    at.world = model->GetWorld();
    at.sdf = std::move(sdf);
    if (at.sdf->HasElement("link")) {
      const std::string name = at.sdf->Get<std::string>("link");
      at.link = model->GetLink(name);
      if (!at.link) {
        gzerr << "[canyon] model '" << model->GetName() << "' has no link '" << name
              << "' as <link> asks for; the receiver is switched off\n";
        return;
      }
    } else {
      const gazebo::physics::Link_V& links = model->GetLinks();
      if (links.empty()) {
        gzerr << "[canyon] model '" << model->GetName() << "' has no link; the receiver is switched off\n";
        return;
      }
      at.link = links.front();
    }
    receiver_ = load_gnss_sensor(at);
  }

 private:
  std::unique_ptr<GnssSensor> receiver_;
};

GZ_REGISTER_MODEL_PLUGIN(MultipathModelPlugin)

}  // namespace canyon::adapters::gazebo_classic
