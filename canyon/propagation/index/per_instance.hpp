#pragma once

#include <memory>
#include <mutex>
#include <shared_mutex>
#include <unordered_map>

#include "canyon/raytrace/ray_scene.hpp"

namespace canyon::propagation {

/// Caches what is made of the meshes of movable instances, each when it is first seen. Ids are never used
/// again, so an entry stays true. Thread-safe.
template <typename Prepared>
class PerInstance {
 public:
  /// `make(mesh)` gives a std::unique_ptr<const Prepared>; called once for each instance.
  template <typename Make>
  const Prepared& of(const raytrace::PlacedInstance& placed, const Make& make) const {
    {
      const std::shared_lock lock(mutex_);
      const auto found = prepared_.find(placed.id);
      if (found != prepared_.end()) return *found->second;
    }
    const std::unique_lock lock(mutex_);
    auto& entry = prepared_[placed.id];
    if (!entry) entry = make(*placed.mesh);
    return *entry;
  }

 private:
  mutable std::shared_mutex mutex_;
  mutable std::unordered_map<raytrace::InstanceId, std::unique_ptr<const Prepared>> prepared_;
};

}  // namespace canyon::propagation
