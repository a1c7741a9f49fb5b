// No header declares it: Gazebo loads it by name. Moves its model along a path of simulated time, independent
// of physics: a vehicle on rails.
#include <Eigen/Geometry>
#include <exception>
#include <filesystem>
#include <gazebo/common/Console.hh>
#include <gazebo/common/Events.hh>
#include <gazebo/common/Plugin.hh>
#include <gazebo/physics/physics.hh>
#include <optional>
#include <string>

#include "adapters/common/sdf/drive_settings.hpp"
#include "adapters/gazebo_classic/ignition_types.hpp"
#include "adapters/gazebo_classic/world_geometry.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

using ignition::math::Pose3d;
using ignition::math::Quaterniond;
using Vector = ignition::math::Vector3d;

}  // namespace

class DrivePlugin final : public gazebo::ModelPlugin {
 public:
  void Load(gazebo::physics::ModelPtr model, sdf::ElementPtr sdf) override {
    const std::string name =
        "plugin '" + sdf->Get<std::string>("name") + "' of model '" + model->GetName() + "'";
    try {
      const auto folder = std::filesystem::path(sdf->FilePath()).parent_path();
      settings_ = read_drive_settings(sdf, name, folder, gazebos_paths(),
                                      origin_of(*model->GetWorld()).value_or(live::HostOrigin{}).frame());
    } catch (const std::exception& error) {
      gzerr << "[canyon] " << error.what() << "\n[canyon] the model does not move\n";
      return;
    }
    for (const std::string& warning : settings_->warnings)
      gzwarn << "[canyon] " << name << ": " << warning << "\n";
    if (model->IsStatic()) {
      gzwarn << "[canyon] " << name << ": a static model has no velocity; set <static>false</static>\n";
    }
    model_ = model.get();
    given_attitude_ = model->WorldPose().Rot();
    set_model_pose(model->GetWorld()->SimTime());
    begin_ = gazebo::event::Events::ConnectWorldUpdateBegin(
        [this](const gazebo::common::UpdateInfo& info) { set_model_pose(info.simTime); });
    // Physics moves it only in a step in which it hits a loose object; that is undone at once. Plugins of
    // sensors are loaded before those of models and were already called at that step's end.
    end_ = gazebo::event::Events::ConnectWorldUpdateEnd([this] {
      if (model_->WorldPose() != pose_) set_model_pose(model_->GetWorld()->SimTime());
    });
  }

  // A paused world after a reset shows the beginning of the path.
  void Reset() override {
    if (model_ != nullptr) set_model_pose(model_->GetWorld()->SimTime());
  }

 private:
  void set_model_pose(const gazebo::common::Time& now) {
    const simulation::DrivePose at = settings_->drive.at(now.Double());
    const Quaterniond attitude = settings_->heading ? Quaterniond(0, 0, at.yaw_rad) : given_attitude_;
    const Vector rotation_rate(0, 0, settings_->heading ? at.yaw_rate_radps : 0);
    const Vector offset = attitude * ignition_from(settings_->offset_m);
    pose_ = Pose3d(ignition_from(at.position_m) + offset, attitude);
    model_->SetWorldPose(pose_);
    move_links(*model_, ignition_from(at.velocity_mps) + rotation_rate.Cross(offset), rotation_rate);
  }

  // Moves the links as one rigid body with the model's origin.
  void move_links(const gazebo::physics::Model& model, const Vector& velocity, const Vector& rotation_rate) {
    for (const auto& link : model.GetLinks()) {
      const Vector arm = link->WorldPose().Pos() - pose_.Pos();
      link->SetLinearVel(velocity + rotation_rate.Cross(arm));
      link->SetAngularVel(rotation_rate);
      // Physics does not move a disabled link, which keeps its velocity.
      link->SetEnabled(false);
    }
    for (const auto& nested : model.NestedModels()) move_links(*nested, velocity, rotation_rate);
  }

  std::optional<DriveSettings> settings_;
  gazebo::physics::Model* model_ = nullptr;  // owns this plugin
  Quaterniond given_attitude_;
  Pose3d pose_;
  gazebo::event::ConnectionPtr begin_;
  gazebo::event::ConnectionPtr end_;
};

GZ_REGISTER_MODEL_PLUGIN(DrivePlugin)

}  // namespace canyon::adapters::gazebo_classic
