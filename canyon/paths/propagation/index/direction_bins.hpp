#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace canyon::propagation {

/// Directions sorted into slices along each axis, to find those in a box without testing all of them.
class DirectionBins {
 public:
  static constexpr int kSlices = 64;
  static constexpr int kGroup = 64;  ///< directions in a group

  /// @param directions unit
  void build(std::span<const Eigen::Vector3d> directions);
  [[nodiscard]] std::size_t groups() const { return groups_.size(); }
  /// The slice [0, kSlices) of a coordinate; coordinates outside -1 to 1 are in the outermost ones.
  [[nodiscard]] static int slice(float coordinate) {
    const float k = (coordinate + 1) * (0.5F * kSlices);
    return static_cast<int>(k < 0 ? 0 : k > kSlices - 1 ? kSlices - 1 : k);
  }
  /// The smallest z of the directions with low <= z <= high; 2 if there is none.
  [[nodiscard]] double least_z(double low, double high) const {
    const auto z = std::lower_bound(z_.begin(), z_.end(), low);
    return z != z_.end() && *z <= high ? *z : 2;
  }
  /// A bit for each direction of the group whose coordinates are in slices low[axis] to high[axis].
  [[nodiscard]] std::uint64_t within(std::size_t group, const std::array<int, 3>& low,
                                     const std::array<int, 3>& high) const {
    const Group& g = groups_[group];
    std::uint64_t found = ~std::uint64_t{0};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      found &= g.below[axis][static_cast<std::size_t>(high[axis]) + 1] &
               ~g.below[axis][static_cast<std::size_t>(low[axis])];
    }
    return found;
  }

 private:
  /// below[axis][k]: the directions in slices under k.
  struct Group {
    std::array<std::array<std::uint64_t, kSlices + 1>, 3> below;
  };
  std::vector<Group> groups_;
  std::vector<double> z_;  ///< of the directions, ascending
};

}  // namespace canyon::propagation
