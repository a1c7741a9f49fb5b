#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "canyon/validation/comparison.hpp"

// Streets of a drive. Private to canyon/validation.

namespace canyon::validation {

/// Cuts a drive into Segments, that follow each other without a gap from the first epoch to the last; none
/// for no epochs. @param places antenna, ENU [m], by epoch
[[nodiscard]] std::vector<Segment> street_segments(std::span<const Eigen::Vector3d> places);

}  // namespace canyon::validation
