#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace canyon::propagation {

/// Where a set of facets or edges stands: at the pose of a movable instance, or, as the city does, in its own
/// frame (null). Poses are rigid (RayScene sees to it).
class SetPose {
 public:
  SetPose(const Eigen::Isometry3d* enu_from_set = nullptr) : pose_(enu_from_set) {}

  [[nodiscard]] bool is_own() const { return pose_ == nullptr; }
  [[nodiscard]] const Eigen::Isometry3d* get() const { return pose_; }
  /// A direction of the set in ENU, and the other way.
  [[nodiscard]] Eigen::Vector3d turned(const Eigen::Vector3d& v) const {
    return is_own() ? v : Eigen::Vector3d(pose_->linear() * v);
  }
  [[nodiscard]] Eigen::Vector3d turned_back(const Eigen::Vector3d& v) const {
    return is_own() ? v : Eigen::Vector3d(pose_->linear().transpose() * v);
  }
  /// A point of the set in ENU, and the other way.
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
