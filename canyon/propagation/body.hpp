#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string_view>

#include "canyon/raytrace/ray_scene.hpp"

namespace canyon::propagation {

/// A body that no map has: it stands or moves in a street, or is a host's moving model. An upright box, or
/// the crown of a tree. Places in metres, east, north, up.
struct Body {
  enum class Kind : std::uint8_t { Vehicle, Structure, Crown };
  Kind kind = Kind::Vehicle;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Vector2d ahead = Eigen::Vector2d::UnitX();  ///< unit: of its length
  double half_length_m = 0, half_width_m = 0;        ///< Crown: the radius of the sphere, both
  double bottom_m = 0, top_m = 0;
  bool grounded = true;    ///< nothing passes below it
  double sill_m = 0;       ///< height over the ground up to which it is metal; glass above
  std::uint64_t name = 0;  ///< stays the same while it lives

  /// Whether a point lies in it or within `margin_m` of it.
  [[nodiscard]] bool holds(const Eigen::Vector3d& point, double margin_m) const;
};

/// The upright box about a movable mesh, turned with it.
[[nodiscard]] Body body_of(const raytrace::PlacedInstance& instance);

/// "vehicle", "structure", "crown".
[[nodiscard]] std::string_view name(Body::Kind kind);

}  // namespace canyon::propagation
