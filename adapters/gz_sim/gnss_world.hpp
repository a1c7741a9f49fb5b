#pragma once

#include <gz/sim/Entity.hh>
#include <gz/sim/EntityComponentManager.hh>
#include <gz/sim/System.hh>
#include <memory>
#include <sdf/sdf.hh>

namespace canyon::adapters::gz_sim {

/// The GNSS receivers of one Gazebo Sim world: the sensors registered by systems. Systems of one world share
/// one object, since they run on their own threads but receivers share the world's scene. Does not throw:
/// errors are written to Gazebo's console and the simulation continues.
class GnssWorld {
 public:
  /// The object of this world.
  [[nodiscard]] static std::shared_ptr<GnssWorld> of(const gz::sim::EntityComponentManager& ecm);
  GnssWorld();
  ~GnssWorld();

  /// Serves sensors below `root`, the world or a model, from now on; `defaults` has settings missing in their
  /// own <canyon> elements.
  void serve(gz::sim::Entity root, const sdf::ElementPtr& defaults, gz::sim::EntityComponentManager& ecm);
  void leave(gz::sim::Entity root);

  /// Takes over new sensors: in Update, after all systems that make models in PreUpdate (UserCommands) at any
  /// position in the list, and before Gazebo's own NavSat system reads them in PostUpdate.
  void update(const gz::sim::UpdateInfo& info, gz::sim::EntityComponentManager& ecm);
  /// Begins the due epochs of the receivers; the first call in a step does it for all. They are computed in
  /// parallel with the simulation, with the world and the truth of this step, and published before the next
  /// epochs begin.
  void post_update(const gz::sim::UpdateInfo& info, const gz::sim::EntityComponentManager& ecm);
  /// The world was reset.
  void reset(gz::sim::EntityComponentManager& ecm);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::adapters::gz_sim
