// No header declares it: Gazebo loads it by name.
#include <gz/plugin/Register.hh>
#include <gz/sim/System.hh>
#include <memory>

#include "adapters/gz_sim/gnss_world.hpp"

namespace canyon::adapters::gz_sim {

/// The system that Gazebo Sim loads; GnssWorld does its work.
class GnssSystem final : public gz::sim::System,
                         public gz::sim::ISystemConfigure,
                         public gz::sim::ISystemUpdate,
                         public gz::sim::ISystemPostUpdate,
                         public gz::sim::ISystemReset {
 public:
  ~GnssSystem() override {
    if (world_) world_->leave(root_);
  }
  void Configure(const gz::sim::Entity& entity, const std::shared_ptr<const sdf::Element>& sdf,
                 gz::sim::EntityComponentManager& ecm, gz::sim::EventManager&) override {
    root_ = entity;
    world_ = GnssWorld::of(ecm);
    world_->serve(root_, sdf ? sdf->Clone() : nullptr, ecm);
  }
  void Update(const gz::sim::UpdateInfo& info, gz::sim::EntityComponentManager& ecm) override {
    if (world_) world_->update(info, ecm);
  }
  void PostUpdate(const gz::sim::UpdateInfo& info, const gz::sim::EntityComponentManager& ecm) override {
    if (world_) world_->post_update(info, ecm);
  }
  void Reset(const gz::sim::UpdateInfo&, gz::sim::EntityComponentManager& ecm) override {
    if (world_) world_->reset(ecm);
  }

 private:
  gz::sim::Entity root_ = gz::sim::kNullEntity;
  std::shared_ptr<GnssWorld> world_;
};

}  // namespace canyon::adapters::gz_sim

GZ_ADD_PLUGIN(canyon::adapters::gz_sim::GnssSystem, gz::sim::System,
              canyon::adapters::gz_sim::GnssSystem::ISystemConfigure,
              canyon::adapters::gz_sim::GnssSystem::ISystemUpdate,
              canyon::adapters::gz_sim::GnssSystem::ISystemPostUpdate,
              canyon::adapters::gz_sim::GnssSystem::ISystemReset)
GZ_ADD_PLUGIN_ALIAS(canyon::adapters::gz_sim::GnssSystem, "canyon::GnssSystem")
