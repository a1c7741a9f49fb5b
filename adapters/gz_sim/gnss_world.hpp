#pragma once

#include <gz/sim/Entity.hh>
#include <gz/sim/EntityComponentManager.hh>
#include <gz/sim/System.hh>
#include <memory>
#include <sdf/sdf.hh>

namespace canyon::adapters::gz_sim {

/// The GNSS receivers of one Gazebo Sim world: those sensors that systems ask it to serve. Systems of one
/// world share one, since they run on threads of their own but receivers share the world's scene. Throws
/// nothing: errors are written to Gazebo's console and the simulation continues.
class GnssWorld {
 public:
  /// The one of this world.
  [[nodiscard]] static std::shared_ptr<GnssWorld> of(const gz::sim::EntityComponentManager& ecm);
  GnssWorld();
  ~GnssWorld();

  /// From now on sensors below `root`, the world or a model, are served; `defaults` has what their own
  /// <canyon> elements leave out.
  void serve(gz::sim::Entity root, const sdf::ElementPtr& defaults, gz::sim::EntityComponentManager& ecm);
  void leave(gz::sim::Entity root);

  /// Takes over sensors that are new: in Update, after all systems that make models in PreUpdate
  /// (UserCommands), wherever they stand in the list, and before Gazebo's own NavSat system sees them in
  /// PostUpdate.
  void update(const gz::sim::UpdateInfo& info, gz::sim::EntityComponentManager& ecm);
  /// Begins the epochs of the receivers that are due; the first call in a step does it for all. They are
  /// computed beside the simulation, with the world and the truth of this step, and published before the next
  /// ones begin.
  void post_update(const gz::sim::UpdateInfo& info, const gz::sim::EntityComponentManager& ecm);
  /// The world was reset.
  void reset(gz::sim::EntityComponentManager& ecm);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::adapters::gz_sim
