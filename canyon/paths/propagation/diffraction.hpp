#pragma once

#include <Eigen/Core>
#include <compare>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "canyon/city/fwd.hpp"
#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/paths/propagation/index/edges.hpp"
#include "canyon/paths/propagation/propagation_options.hpp"

namespace canyon::propagation {

/// One path from satellite to antenna around one edge. Points and directions are in the city's ENU frame.
struct DiffractedPath {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    ///< on the edge
  Eigen::Vector3d arrival = Eigen::Vector3d::Zero();  ///< unit, from the antenna towards the point
  double excess_m = 0;                                ///< excess over the straight line
  double bending_rad = 0;                             ///< between arrival and the direction to the satellite
  double leg_m = 0;                                   ///< from the antenna to the edge
  /// Fresnel-Kirchhoff parameter (P.526-15, 4.1): positive if the edge's own faces block the straight line,
  /// else negative. PathGeometry::edge_nu.
  double nu = 0;
  double loss_db = 0;      ///< see EdgeDiffraction::trace
  std::uint32_t edge = 0;  ///< of the instance's EdgeSet
  std::uint32_t instance = 0;
};

/// An edge of the city that diffracts a satellite's signal.
struct KnownEdge {
  std::uint32_t satellite = 0;  ///< index of its direction
  std::uint32_t edge = 0;       ///< of EdgeDiffraction::edges()
  [[nodiscard]] auto operator<=>(const KnownEdge&) const = default;
};

/// Finds the paths around single edges of a city and of the scene's movable instances (at the poses of their
/// last commit()). Const, thread-safe; edges are prepared once. The scene must outlive it. `city` is the mesh
/// that the scene was built from; it is not stored.
class EdgeDiffraction {
 public:
  /// Throws InputError for options that do not validate().
  EdgeDiffraction(const city::Mesh& city, const raytrace::RayScene& scene, DiffractionOptions options = {});

  [[nodiscard]] const DiffractionOptions& options() const;
  /// The city's edges; DiffractedPath::edge of instance 0 counts these.
  [[nodiscard]] const EdgeSet& edges() const;

  /// Paths of satellites in the given directions (unit, ENU, antenna to satellite) at one antenna, by excess
  /// path, at most options().max_paths each; result[i] belongs to directions[i]. `blocked[i]`:
  /// RayScene::occluded() of the straight line. Precondition: raytrace::check_position(antenna) passes.
  ///
  /// `loss_db` is the knife edge's J (approximate_knife_edge_loss_db()) at |nu| = 2 sqrt(excess / wavelength)
  /// (signed_knife_edge_nu()): within 0.13 dB of the copolar part behind a thin, perfectly conducting
  /// half-plane at any angle.
  /// - Straight line blocked: J(|nu|), the wave around the edge relative to free space. It holds for the edge
  ///   that blocks the line (nu > 0) and for others while something else blocks it (nu < 0): the wave
  ///   scattered by an edge depends on the distance from its shadow boundary, not on the side.
  /// - Straight line clear: J(-|nu|), 6 to 0 dB, of direct signal and edge together. It weakens the direct
  ///   signal and is no separate signal; that would be edge_wave(nu).
  ///
  /// Legs to the antenna and to the satellite are clear, cast from a point lifted off both faces by
  /// RayScene::surface_offset_m(); an antenna within twice that of a face's plane does not see that face. No
  /// other face begins within 5 cm of the point on these faces: seams between coplanar walls are no edges,
  /// and paths nearer than 5 cm to an edge's end may be missed. Duplicate edges give one path (points within
  /// 2 mm). Not modelled: scattering at ends of edges (corners), two edges, edges with reflections.
  void trace(const Eigen::Vector3d& antenna, std::span<const Eigen::Vector3d> directions,
             std::span<const bool> blocked, std::span<std::vector<DiffractedPath>> result) const;
  /// As trace(), but of the city's edges only those in `known`.
  void retrace(const Eigen::Vector3d& antenna, std::span<const Eigen::Vector3d> directions,
               std::span<const bool> blocked, std::span<const KnownEdge> known,
               std::span<std::vector<DiffractedPath>> result) const;

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

}  // namespace canyon::propagation
