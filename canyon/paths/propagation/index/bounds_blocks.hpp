#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace canyon::propagation {

/// Axis-aligned bounds of blocks of items, and of blocks of blocks, to find the items within reach of a point
/// without testing most of them. Efficient if neighbours in the list are neighbours in space.
class BoundsBlocks {
 public:
  static constexpr std::size_t kBlock = 32;  ///< items in a block, blocks in a super-block

  /// Adds the bounds of the next item.
  void append(const Eigen::Vector3d& min, const Eigen::Vector3d& max) {
    if (size_ % kBlock == 0) blocks_.emplace_back();
    if (size_ % (kBlock * kBlock) == 0) super_blocks_.emplace_back();
    for (Eigen::AlignedBox3d* bounds : {&blocks_.back(), &super_blocks_.back()})
      bounds->extend(min).extend(max);
    ++size_;
  }

  /// Calls visit(i), ascending, for the items of every block with a point within sqrt(reach2) of `point`.
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

/// Orders `items` so that every block of `block` items is compact: median splits along the widest axis, at
/// multiples of `block`. Ties keep the order of the numbers, so the result is deterministic.
/// @param centre Vector3d of an item
template <typename Centre>
void order_compactly(std::uint32_t* begin, std::uint32_t* end, std::size_t block, const Centre& centre) {
  const auto count = static_cast<std::size_t>(end - begin);
  if (count <= block) {
    std::sort(begin, end);
    return;
  }
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e300), high = Eigen::Vector3d::Constant(-1e300);
  for (const std::uint32_t* i = begin; i != end; ++i) {
    low = low.cwiseMin(centre(*i));
    high = high.cwiseMax(centre(*i));
  }
  int axis = 0;
  (high - low).maxCoeff(&axis);
  std::uint32_t* middle = begin + (count / 2 + block - 1) / block * block;
  std::nth_element(begin, middle, end, [&](std::uint32_t a, std::uint32_t b) {
    const double ca = centre(a)[axis], cb = centre(b)[axis];
    return ca != cb ? ca < cb : a < b;
  });
  order_compactly(begin, middle, block, centre);
  order_compactly(middle, end, block, centre);
}

}  // namespace canyon::propagation
