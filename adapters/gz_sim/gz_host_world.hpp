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

/// Empty where the world has no spherical_coordinates.
[[nodiscard]] std::optional<live::HostOrigin> origin_of(const gz::sim::EntityComponentManager& ecm);

/// The entities of a Gazebo Sim world as live::WorldScene reads them.
class GzHostWorld final : public live::HostWorld {
 public:
  /// @param visual visuals instead of collisions
  explicit GzHostWorld(bool visual) : visual_(visual) {}

  /// Call it in each step, with the world as it stands: it remembers which entities it must look at. `ecm` is
  /// asked until the next call.
  void look(const gz::sim::EntityComponentManager& ecm);

  bool went_on() override { return std::exchange(went_on_, false); }
  bool statics_may_have_moved() override { return std::exchange(changed_, false); }
  void models(std::vector<Id>& ids) override;
  std::string name(Id model) override;
  bool is_static(Id model) override;
  /// Nothing has a scale of its own here: shapes include it.
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
  bool changed_ = true;         // something beside poses that physics moves
  bool models_changed_ = true;  // an entity came or went
  std::vector<Id> models_;
  std::unordered_map<Id, std::vector<Id>>
      children_;  // of every entity, as they were when one last came or went
  struct Fingerprint {
    std::uint64_t sum = 0;
    unsigned age = 0;  // steps in which nothing was said to change
  };
  std::unordered_map<Id, Fingerprint> fingerprints_;
};

/// Folders in which Gazebo Sim looks for files that worlds name.
[[nodiscard]] inline ResourcePaths gazebos_paths() {
  ResourcePaths paths{{}, {}, "GZ_SIM_RESOURCE_PATH"};
  for (const std::string& path : gz::sim::resourcePaths()) {
    paths.models.emplace_back(path);
    paths.resources.emplace_back(path);
  }
  return paths;
}

}  // namespace canyon::adapters::gz_sim
