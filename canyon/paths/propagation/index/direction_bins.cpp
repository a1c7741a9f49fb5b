#include "canyon/paths/propagation/index/direction_bins.hpp"

namespace canyon::propagation {

void DirectionBins::build(std::span<const Eigen::Vector3d> directions) {
  groups_.resize((directions.size() + kGroup - 1) / kGroup);
  for (Group& group : groups_)
    for (auto& below : group.below) below.fill(0);
  z_.clear();
  for (const Eigen::Vector3d& direction : directions) z_.push_back(direction.z());
  std::sort(z_.begin(), z_.end());
  for (std::size_t i = 0; i < directions.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const int slice_of = slice(static_cast<float>(directions[i][axis]));
      auto& below = groups_[i / kGroup].below[static_cast<std::size_t>(axis)];
      below[static_cast<std::size_t>(slice_of) + 1] |= std::uint64_t{1} << (i % kGroup);
    }
  }
  for (Group& group : groups_) {
    for (auto& below : group.below)
      for (std::size_t k = 1; k < below.size(); ++k) below[k] |= below[k - 1];
  }
}

}  // namespace canyon::propagation
