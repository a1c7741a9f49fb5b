#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace canyon::validation {

/// A stretch of the drive along one street: it ends where the way turns by more than 30 degrees from its mean
/// heading; pieces shorter than 50 m (the curves between) belong to the neighbour of the nearer heading.
struct StreetSegment {
  std::size_t first = 0, count = 0;  ///< of Comparison::epochs
  double length_m = 0;
  double heading_deg = 0;  ///< from north, clockwise, [0, 360), from first to last; 0 where nothing moves
};

/// Cuts a drive into Segments, which follow each other without a gap from the first epoch to the last; none
/// for no epochs. @param places antenna, ENU [m], by epoch
[[nodiscard]] std::vector<StreetSegment> street_segments(std::span<const Eigen::Vector3d> places);

}  // namespace canyon::validation
