#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <vector>

namespace canyon::propagation {

/// Axis-aligned bounds of runs of items, and of runs of these: which items may lie within reach of a point is
/// found without looking at most of them. Useful where neighbours in the list are neighbours in space.
class BoundsBlocks {
 public:
  static constexpr std::size_t kBlock = 32;  ///< items in a block, blocks in a super-block

  /// Adds the bounds of the next item.
  void append(const Eigen::Vector3d& min, const Eigen::Vector3d& max) {
    if (size_ % kBlock == 0) blocks_.emplace_back();
    if (size_ % (kBlock * kBlock) == 0) super_blocks_.emplace_back();
    for (Eigen::AlignedBox3d* bounds : {&blocks_.back(), &super_blocks_.back()}) {
      bounds->extend(min).extend(max);
    }
    ++size_;
  }

  /// visit(i), ascending, for the items of every block that begins within sqrt(reach2) of the point.
  template <typename Visit>
  void for_each_near(const Eigen::Vector3d& point, double reach2, const Visit& visit) const {
    for (std::size_t s = 0; s < super_blocks_.size(); ++s) {
      if (squared_distance(point, super_blocks_[s].min(), super_blocks_[s].max()) > reach2) continue;
      for (std::size_t b = s * kBlock; b < std::min((s + 1) * kBlock, blocks_.size()); ++b) {
        if (squared_distance(point, blocks_[b].min(), blocks_[b].max()) > reach2) continue;
        for (std::size_t i = b * kBlock; i < std::min((b + 1) * kBlock, size_); ++i) visit(i);
      }
    }
  }

  /// Squared distance from a point to bounds; 0 inside.
  [[nodiscard]] static double squared_distance(const Eigen::Vector3d& point, const Eigen::Vector3d& min,
                                               const Eigen::Vector3d& max) {
    return (min - point).cwiseMax(point - max).cwiseMax(0).squaredNorm();
  }

 private:
  std::vector<Eigen::AlignedBox3d> blocks_, super_blocks_;
  std::size_t size_ = 0;
};

}  // namespace canyon::propagation
