#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "canyon/city/fwd.hpp"

namespace canyon::propagation {

/// One reflection on the way.
struct Incidence {
  double incidence_rad = 0;  ///< between ray and normal, [0, pi/2]
  city::Material material = city::Material::Unknown;
  std::optional<double> thickness_m;  ///< of the slab; empty: the material's default
  double plane_turn_rad = 0;  ///< of the plane of incidence since the reflection before; 0 for the first
  /// Share [0, 1] of the smooth surface's amplitude that goes on in the mirror direction: sqrt(1 - S^2) of a
  /// wall that scatters with the coefficient S (DiffuseOptions), by the energy balance of the effective
  /// roughness model (V. Degli-Esposti, IEEE Trans. AP 49(7), 2001, pp. 1111-1113). An alternative to
  /// StrengthOptions::roughness_m; both multiply.
  double specular_factor = 1;
};

/// Geometry that decides a path's strength: any sequence of reflections, one edge, foliage. All empty: the
/// direct path.
struct PathGeometry {
  std::array<Incidence, 2> incidences;  ///< in the order from the satellite
  int incidence_count = 0;              ///< 0 to 2
  /// nu of the edge that the ray bends around (signed_knife_edge_nu()): > 0 where it blocks; < 0: the wave
  /// that an edge beside a clear path adds to it (edge_wave()).
  std::optional<double> edge_nu;
  /// Radius [m] that the edge is rounded with, >= 0 (rounded_edge_loss_db()); 0: a knife edge. With it count
  /// the angle that the ray is bent by [rad] and the way from antenna to edge [m].
  double edge_radius_m = 0;
  double edge_bending_rad = 0;
  double edge_leg_m = 0;
  double excess_m = 0;  ///< longer than the straight line by this much, all detours together, >= 0 on a way
  double arrival_elevation_rad = 0;  ///< of the direction that the ray comes from, [-pi/2, pi/2]
  double foliage_depth_m = 0;        ///< of vegetation along the ray, >= 0
};

/// Angle (-pi, pi] by which the plane of incidence turns between two reflections.
/// @param direction of propagation between the two, unit
/// @param first_normal, second_normal unit normals of the surfaces, to the side that reflects
/// 0 where a plane of incidence is undefined (normal incidence).
[[nodiscard]] double plane_turn_rad(const Eigen::Vector3d& direction, const Eigen::Vector3d& first_normal,
                                    const Eigen::Vector3d& second_normal);

}  // namespace canyon::propagation
