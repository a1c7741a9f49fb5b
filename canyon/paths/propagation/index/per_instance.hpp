#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <unordered_map>

#include "canyon/city/raytrace/ray_scene.hpp"

namespace canyon::propagation {

/// Caches data derived from the meshes of movable instances, each at its first use. Ids are never reused, so
/// an entry stays valid. Thread-safe.
template <typename Prepared>
class PerInstance {
 public:
  /// `make(mesh)` returns a std::unique_ptr<const Prepared>; called once for each instance.
  template <typename Make>
  const Prepared& of(const raytrace::PosedInstance& posed, const Make& make) const {
    {
      const std::shared_lock lock(mutex_);
      const auto found = prepared_.find(posed.id);
      if (found != prepared_.end()) return *found->second;
    }
    const std::unique_lock lock(mutex_);
    auto& entry = prepared_[posed.id];
    if (!entry) entry = make(*posed.mesh);
    return *entry;
  }

 private:
  mutable std::shared_mutex mutex_;
  mutable std::unordered_map<raytrace::InstanceId, std::unique_ptr<const Prepared>> prepared_;
};

/// Pose of a set of facets or edges: of a movable instance, or null for a set in its own frame, as the city.
/// Poses are rigid (RayScene ensures it).
class SetPose {
 public:
  SetPose(const Eigen::Isometry3d* enu_from_set = nullptr) : pose_(enu_from_set) {}

  [[nodiscard]] bool is_own() const { return pose_ == nullptr; }
  [[nodiscard]] const Eigen::Isometry3d* get() const { return pose_; }
  /// Rotates a direction of the set to ENU; rotated_to_local() is the inverse.
  [[nodiscard]] Eigen::Vector3d rotated(const Eigen::Vector3d& v) const {
    return is_own() ? v : Eigen::Vector3d(pose_->linear() * v);
  }
  [[nodiscard]] Eigen::Vector3d rotated_to_local(const Eigen::Vector3d& v) const {
    return is_own() ? v : Eigen::Vector3d(pose_->linear().transpose() * v);
  }
  /// Transforms a point of the set to ENU, and back.
  [[nodiscard]] Eigen::Vector3d moved(const Eigen::Vector3d& v) const {
    return is_own() ? v : Eigen::Vector3d(*pose_ * v);
  }
  [[nodiscard]] Eigen::Vector3d moved_back(const Eigen::Vector3d& v) const {
    return is_own() ? v : Eigen::Vector3d(pose_->linear().transpose() * (v - pose_->translation()));
  }

 private:
  const Eigen::Isometry3d* pose_;
};

}  // namespace canyon::propagation
