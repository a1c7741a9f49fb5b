#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "canyon/city/fwd.hpp"
#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/paths/propagation/diffraction.hpp"
#include "canyon/paths/propagation/diffuse.hpp"
#include "canyon/paths/propagation/paths.hpp"
#include "canyon/paths/propagation/propagation_options.hpp"

namespace canyon::propagation {

/// A path of the second order: expensive to find, but still valid for an antenna a metre away.
struct FarPath {
  std::uint32_t satellite = 0;  ///< index of its direction
  Path path;                    ///< at the point of the search
  /// Unit normals of the facets next to the antenna and next to the satellite.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero(), far_normal = Eigen::Vector3d::Zero();

  /// The path at another point and a little later, over the same planes. Its detour is exact for the
  /// satellite's old direction; the effect of the satellite's motion is of first order. Does not check that
  /// the path is still clear.
  /// @param antenna, direction of the satellite there, unit, ENU; @param from_antenna, from_direction those
  /// of the search. Empty: the antenna is behind the facet.
  [[nodiscard]] std::optional<Path> seen_from(const Eigen::Vector3d& antenna,
                                              const Eigen::Vector3d& direction,
                                              const Eigen::Vector3d& from_antenna,
                                              const Eigen::Vector3d& from_direction) const;
};

/// As FarPath, for a diffuse path from the same point of the facade; exact over one facade. Small, since an
/// antenna keeps some hundreds.
struct FarScatter {
  std::uint32_t satellite = 0;
  DiffusePath path;

  /// Empty: the antenna is at the point.
  [[nodiscard]] std::optional<DiffusePath> seen_from(const Eigen::Vector3d& antenna,
                                                     const Eigen::Vector3d& direction,
                                                     const Eigen::Vector3d& from_antenna,
                                                     const Eigen::Vector3d& from_direction) const;
};

/// Paths found at one point, for antennas near it (Propagator::retrace()).
struct TracedPoint {
  Eigen::Vector3d antenna = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> directions;  ///< of the satellites, unit, ENU; empty: nothing was traced
  std::vector<KnownEdge> edges;             ///< of the city that diffract signals here
  std::vector<FarPath> far;
  std::vector<FarScatter> scattered;
  std::vector<raytrace::PosedInstance> instances;  ///< in reach; their meshes are not used
};

/// Traces satellites at points in a city. Const, thread-safe; facets are prepared once, and copies share
/// them. The scene must outlive the propagator. Its movable instances block and (specular) reflect at the
/// poses of their last commit(). `city` is the mesh that the scene was built from; it is not stored.
class Propagator {
 public:
  /// Throws InputError if options do not validate(). @param seed of DiffuseScattering's random strengths
  Propagator(const city::Mesh& city, const raytrace::RayScene& scene, PropagationOptions options = {},
             std::uint64_t seed = 0);

  [[nodiscard]] const PropagationOptions& options() const;
  /// Whether other copies exist.
  [[nodiscard]] bool is_shared() const { return impl_.use_count() > 1; }

  /// Paths of satellites in the given directions (unit, ENU, antenna to satellite) at one antenna.
  /// result[i] belongs to directions[i]. The antenna must be finite (InputError).
  ///
  /// Specular: image method on planar facets. For facet normal n, satellite direction s and antenna height h
  /// over the facet's plane, the reflected direction is r = s - 2 (s.n) n, the excess path 2 h (n.s). A path
  /// is kept if r hits that facet's plane first, from its front, and the reflection point sees the satellite.
  /// A facet is a maximal group of adjacent triangles in one plane (to 0.5 mm); buildings and vehicles
  /// reflect, foliage only blocks. Facets in one plane that touch or coincide give one path. The reflection
  /// point and the excess path are exact to the facet's plane (1e-9 m in a city of 10 km). Paths whose
  /// reflection point is within RayScene::surface_offset_m() of an outer edge may be kept or missed; an
  /// antenna within twice that of a facet's plane gets none from it.
  ///
  /// Specular, second order (reflection_order 2; see SecondOrderSearch): satellite -> facet A -> facet B ->
  /// antenna by double images, excess = 2 h_B (n_B.s) + 2 h_A (n_A.s), h_B the antenna's height over B's
  /// plane and h_A that of its image in B over A's. A and B may be of the city or of instances, both limits
  /// hold for both reflections, all three legs are clear. Reflection points within twice surface_offset_m()
  /// of the other facet's plane (deep in a corner) give no path. Excess paths are exact to 1e-9 m and points
  /// to 1e-6 m for the facets' planes; as facets are within 0.5 mm of their triangles, points of a real city
  /// are exact to some millimetres. Paths of the lower orders do not change.
  ///
  /// Diffraction: EdgeDiffraction::trace(), excess_m the edge's own detour and edge_nu its nu (both are set;
  /// arriving_wave() counts them once). A blocked satellite with no other path is NLOS. Next to a direct path
  /// the edge's wave is a path, but the satellite stays LOS. A path through vegetation counts as clear here.
  ///
  /// Diffuse: DiffuseScattering::trace(), for satellites without a direct path. point and arrival are of the
  /// strongest path of a class.
  ///
  /// All: Direct comes first, then by excess path, of equal ones the lower order first. The lists belong to
  /// the caller. Once they and the caches of threads and antennas have grown, nothing is allocated.
  ///
  /// Mirror: the paper's algorithm 2 and equation 1, m = d (1 + sin(pi/2 - 2 theta)), d the range of the ray
  /// at azimuth + 180 deg and the same elevation theta, only for satellites whose direct ray is blocked. The
  /// direct ray has no limit: walls farther than max_range_m block too. Material and incidence are those of
  /// the facet that the mirror ray hits.
  /// @param traced gets the far paths and edges valid for nearby antennas (retrace()); null: not needed
  void trace(const Eigen::Vector3d& antenna, std::span<const Eigen::Vector3d> directions,
             std::span<SatellitePaths> result, TracedPoint* traced = nullptr) const;

  /// The paths of trace() that change from step to step: direct ones, reflections of the first order, and
  /// those around the edges in `edges` (nearby points mostly have the same edges). Each path is as in
  /// trace(). Omits reflections of the second order and diffuse paths, which cost most. Specular (asserted).
  void trace_first_order(const Eigen::Vector3d& antenna, std::span<const Eigen::Vector3d> directions,
                         std::span<const KnownEdge> edges, std::span<SatellitePaths> result) const;
  /// As trace_first_order(), plus the far paths of a nearby point (FarPath::seen_from()). Returns false and
  /// does nothing if its satellites differ, or an instance in reach has moved.
  [[nodiscard]] bool retrace(const Eigen::Vector3d& antenna, std::span<const Eigen::Vector3d> directions,
                             const TracedPoint& traced, std::span<SatellitePaths> result) const;
  /// Whether retrace() may be called and costs less than trace().
  [[nodiscard]] bool has_far_paths() const;

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

/// The paper's equation 1 [m]: additional path for a mirror ray of range `range_m` at elevation
/// `elevation_rad`, d (1 + sin(pi/2 - 2 theta)) = 2 d cos^2(theta).
[[nodiscard]] double mirror_excess_m(double range_m, double elevation_rad);

/// The paper's algorithm 2 on ranges of another ray caster: LOS if the direct ray is free, else NLOS by the
/// mirror ray, else blocked. The surface that the ray hit is unknown. So the path has the strength of a
/// reflection by concrete, with the incidence of a vertical wall that faces the arrival, and its elevation;
/// all reflectors have one id.
/// @param direction unit, ENU, antenna to satellite
/// @param mirror_range_m of the ray at azimuth + 180 deg and the same elevation; empty: no hit in reach
[[nodiscard]] SatellitePaths mirror_paths(const Eigen::Vector3d& antenna, const Eigen::Vector3d& direction,
                                          bool direct_blocked, std::optional<double> mirror_range_m);
/// Direction of the mirror ray of a satellite in `direction`.
[[nodiscard]] inline Eigen::Vector3d mirror_direction(const Eigen::Vector3d& direction) {
  return {-direction.x(), -direction.y(), direction.z()};
}

}  // namespace canyon::propagation
