#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace canyon::validation {

/// A part of the drive along one street: it ends where the heading differs by more than 30 degrees from its
/// mean; pieces shorter than 50 m (the curves between) belong to the neighbour with the nearer heading.
struct StreetSegment {
  std::size_t first = 0, count = 0;  ///< of Comparison::epochs
  double length_m = 0;
  double heading_deg = 0;  ///< from north, clockwise, [0, 360), from first to last; 0 without motion
};

/// Divides a drive into segments without gaps from the first epoch to the last; none for no epochs. @param
/// places antenna, ENU [m], by epoch
[[nodiscard]] std::vector<StreetSegment> street_segments(std::span<const Eigen::Vector3d> points);

}  // namespace canyon::validation
