#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "canyon/raytrace/ray_scene.hpp"
#include "canyon/validation/comparison.hpp"

// Private to canyon/validation.

namespace canyon::validation {

/// Where the antenna of an epoch lies in the unmoved map while the city is moved: where its rays start [m].
[[nodiscard]] Eigen::Vector3d place_in_moved_city(const Recording& recording, const raytrace::RayScene& scene,
                                                  const Registration& registration, std::size_t epoch);

}  // namespace canyon::validation
