#pragma once

#include <gz/sim/EntityComponentManager.hh>
#include <gz/sim/Util.hh>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "adapters/common/resource_files.hpp"
#include "adapters/common/sdf/sdf_shapes.hpp"
#include "adapters/gz_sim/gz_shape_files.hpp"
#include "canyon/outputs/live/world_scene.hpp"

namespace canyon::adapters::gz_sim {

/// Empty if the world has no spherical_coordinates.
[[nodiscard]] std::optional<live::HostOrigin> origin_of(const gz::sim::EntityComponentManager& ecm);

/// The entities of a Gazebo Sim world for live::WorldScene.
class GzHostWorld final : public live::HostWorld {
 public:
  /// @param visual visuals instead of collisions
  explicit GzHostWorld(bool visual) : visual_(visual) {}

  /// Call it in each step: records the entities to be checked. `ecm` is read until the next call.
  void update_models(const gz::sim::EntityComponentManager& ecm);

  bool has_advanced() override { return std::exchange(went_on_, false); }
  bool statics_may_have_moved() override { return std::exchange(changed_, false); }
  void models(std::vector<Id>& ids) override;
  std::string name(Id model) override;
  bool is_static(Id model) override;
  /// There are no separate scales here: shapes include them.
  std::uint64_t structure(Id) override { return 0; }
  std::uint64_t shapes(Id model) override;
  void links(Id model, std::vector<Id>& ids) override;
  std::optional<simulation::RigidPose> pose(Id link) override;
  city::Mesh mesh(Id link, std::vector<std::string>& notes) override;

 private:
  [[nodiscard]] const std::vector<Id>& children(Id parent) const;
  /// Visits the collisions or visuals of a link.
  template <typename Visit>
  void for_each_shape(Id link, const Visit& visit) const;

  bool visual_;
  GzShapeFiles files_;
  const gz::sim::EntityComponentManager* ecm_ = nullptr;
  bool went_on_ = false;
  bool changed_ = true;         // a change other than poses moved by physics
  bool models_changed_ = true;  // an entity was added or removed
  std::vector<Id> models_;
  std::unordered_map<Id, std::vector<Id>> children_;  // of every entity, at the last change of entities
  struct Fingerprint {
    std::uint64_t sum = 0;
    unsigned age = 0;  // steps without a reported change
  };
  std::unordered_map<Id, Fingerprint> fingerprints_;
};

/// Folders in which Gazebo Sim searches files named in worlds.
[[nodiscard]] inline ResourcePaths gazebos_paths() {
  ResourcePaths paths{{}, {}, "GZ_SIM_RESOURCE_PATH"};
  for (const std::string& path : gz::sim::resourcePaths()) {
    paths.models.emplace_back(path);
    paths.resources.emplace_back(path);
  }
  return paths;
}

}  // namespace canyon::adapters::gz_sim
