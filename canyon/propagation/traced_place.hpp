#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <vector>

#include "canyon/propagation/diffraction.hpp"
#include "canyon/propagation/paths.hpp"
#include "canyon/raytrace/ray_scene.hpp"

namespace canyon::propagation {

/// A path that costs much to find, and that an antenna a metre farther has as well: of the second order, or
/// diffuse.
struct FarPath {
  std::uint32_t satellite = 0;  ///< index of its direction
  Path path;                    ///< at the place where it was found
  /// Of the second order: unit normals of the facets next to the antenna and next to the satellite.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero(), far_normal = Eigen::Vector3d::Zero();

  /// The path at another place and a little later: over the same planes, or from the same point of a facade.
  /// Its detour is exact over planes for the satellite's old direction, and for a point over one facade; what
  /// the satellite's way adds is of first order. Whether the way is still clear is not asked.
  /// @param antenna, direction of the satellite there, unit, ENU; @param from_antenna, from_direction where
  /// the path was found. Empty: the antenna is behind the facet.
  [[nodiscard]] std::optional<Path> seen_from(const Eigen::Vector3d& antenna,
                                              const Eigen::Vector3d& direction,
                                              const Eigen::Vector3d& from_antenna,
                                              const Eigen::Vector3d& from_direction) const;
};

/// A movable instance that stood about an antenna.
struct StandingInstance {
  raytrace::InstanceId id = 0;
  Eigen::Isometry3d enu_from_instance = Eigen::Isometry3d::Identity();
  Eigen::AlignedBox3d bounds;  ///< of the mesh, in its own frame

  /// Whether it is the same, within a centimetre and 2e-3 rad.
  [[nodiscard]] bool is_like(const StandingInstance& other) const;
};

/// The instances of a scene, by id, that are nearer to `antenna` than `reach_m`.
[[nodiscard]] std::vector<StandingInstance> instances_about(const raytrace::RayScene& scene,
                                                            const Eigen::Vector3d& antenna, double reach_m);

/// What was found at one place, for antennas near it (Propagator::retrace()).
struct TracedPlace {
  Eigen::Vector3d antenna = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> directions;  ///< of the satellites, unit, ENU; empty: nothing was traced
  std::vector<KnownEdge> edges;             ///< of the city that bend signals here
  std::vector<FarPath> far;                 ///< by kind, satellite
  std::vector<StandingInstance> instances;  ///< in reach
};

}  // namespace canyon::propagation
