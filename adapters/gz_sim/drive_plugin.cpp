// No header declares it: Gazebo loads it by name. Moves its model along a path of simulated time, independent
// of physics: a vehicle on rails.
#include <Eigen/Geometry>
#include <exception>
#include <filesystem>
#include <gz/common/Console.hh>
#include <gz/plugin/Register.hh>
#include <gz/sim/Model.hh>
#include <gz/sim/System.hh>
#include <gz/sim/Util.hh>
#include <gz/sim/components/AngularVelocity.hh>
#include <gz/sim/components/LinearVelocity.hh>
#include <gz/sim/components/Model.hh>
#include <gz/sim/components/Pose.hh>
#include <optional>
#include <sdf/Model.hh>
#include <string>

#include "adapters/common/sdf/drive_settings.hpp"
#include "adapters/gz_sim/gz_host_world.hpp"

namespace canyon::adapters::gz_sim {
namespace {

namespace components = gz::sim::components;
using Ecm = gz::sim::EntityComponentManager;

gz::math::Vector3d gz_from(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

}  // namespace

class DriveSystem final : public gz::sim::System,
                          public gz::sim::ISystemConfigure,
                          public gz::sim::ISystemPreUpdate,
                          public gz::sim::ISystemUpdate {
 public:
  void Configure(const gz::sim::Entity& entity, const std::shared_ptr<const sdf::Element>& element, Ecm& ecm,
                 gz::sim::EventManager&) override {
    model_ = gz::sim::Model(entity);
    const std::string name = "plugin 'canyon::DriveSystem' of model '" + model_.Name(ecm) + "'";
    try {
      // The plugin's own element has no file name, and the world's SDF is available after its models.
      const auto* model_entry = ecm.Component<components::ModelSdf>(entity);
      const sdf::ElementPtr model = model_entry == nullptr ? nullptr : model_entry->Data().Element();
      const std::filesystem::path file(model ? model->FilePath() : element->FilePath());
      settings_ = read_drive_settings(element->Clone(), name, file.parent_path(), gazebos_paths(),
                                      origin_of(ecm).value_or(live::HostOrigin{}).frame());
    } catch (const std::exception& error) {
      gzerr << "[canyon] " << error.what() << "\n[canyon] the model does not move\n";
      return;
    }
    for (const std::string& warning : settings_->warnings)
      gzerr << "[canyon] warning: " << name << ": " << warning << "\n";
    given_attitude_ = gz::sim::worldPose(entity, ecm).Rot();
    for (const gz::sim::Entity link : model_.Links(ecm)) {
      gz::sim::enableComponent<components::WorldLinearVelocity>(ecm, link);
      gz::sim::enableComponent<components::WorldAngularVelocity>(ecm, link);
    }
  }

  void PreUpdate(const gz::sim::UpdateInfo& info, Ecm& ecm) override {
    if (!settings_ || info.paused) return;
    const simulation::DrivePose at = settings_->drive.at(std::chrono::duration<double>(info.simTime).count());
    const gz::math::Quaterniond attitude =
        settings_->heading ? gz::math::Quaterniond(0, 0, at.yaw_rad) : given_attitude_;
    angular_rate_ = {0, 0, settings_->heading ? at.yaw_rate_radps : 0};
    const gz::math::Vector3d offset = attitude.RotateVector(gz_from(settings_->offset_m));
    pose_ = {gz_from(at.position_m) + offset, attitude};
    velocity_ = gz_from(at.velocity_mps) + angular_rate_.Cross(offset);
    model_.SetWorldPoseCmd(ecm, pose_);
  }

  // Moves the model as one rigid body, after the physics, which gives a repositioned model no velocity.
  void Update(const gz::sim::UpdateInfo& info, Ecm& ecm) override {
    if (!settings_ || info.paused) return;
    for (const gz::sim::Entity link : model_.Links(ecm)) {
      const gz::math::Vector3d arm = gz::sim::worldPose(link, ecm).Pos() - pose_.Pos();
      ecm.SetComponentData<components::WorldLinearVelocity>(link, velocity_ + angular_rate_.Cross(arm));
      ecm.SetComponentData<components::WorldAngularVelocity>(link, angular_rate_);
    }
  }

 private:
  std::optional<DriveSettings> settings_;
  gz::sim::Model model_;
  gz::math::Quaterniond given_attitude_;
  gz::math::Pose3d pose_;
  gz::math::Vector3d velocity_, angular_rate_;
};

}  // namespace canyon::adapters::gz_sim

GZ_ADD_PLUGIN(canyon::adapters::gz_sim::DriveSystem, gz::sim::System,
              canyon::adapters::gz_sim::DriveSystem::ISystemConfigure,
              canyon::adapters::gz_sim::DriveSystem::ISystemPreUpdate,
              canyon::adapters::gz_sim::DriveSystem::ISystemUpdate)
GZ_ADD_PLUGIN_ALIAS(canyon::adapters::gz_sim::DriveSystem, "canyon::DriveSystem")
