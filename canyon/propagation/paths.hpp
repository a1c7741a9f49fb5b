#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "canyon/propagation/path_geometry.hpp"

namespace canyon::propagation {

enum class PathKind : std::uint8_t {
  Direct,
  Reflected,    ///< by one or two facets, as by mirrors
  Diffracted,   ///< around one edge
  Diffuse,      ///< scattered by a rough or structured facade: a bundle of waves with one mean detour
  Transmitted,  ///< not from the satellite: a copy of its signal from a transmitter (disturbance::Spoofing)
};
/// "direct", "reflected", "diffracted", "diffuse", "spoofed": the words of every output.
[[nodiscard]] std::string_view name(PathKind kind);

/// One path from satellite to antenna. Directions and points are in the city's ENU frame. `point` and what
/// belongs to it are of the interaction next to the antenna, `far_point` and its like of the one next to the
/// satellite, where there are two. Its geometry is what strength depends on; of Diffuse only the excess and
/// the arrival. A Direct path with foliage_depth_m > 0 comes through vegetation.
struct Path : PathGeometry {
  PathKind kind = PathKind::Direct;
  std::uint8_t order = 0;  ///< reflections on the way: 0 for Direct, 1 or 2 for Reflected
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    ///< of reflection, on the edge, on the facade
  Eigen::Vector3d arrival = Eigen::Vector3d::Zero();  ///< unit, from the antenna towards where it comes from
  std::uint32_t triangle = 0;  ///< that reflects or scatters, of `instance`; 0 for Diffracted
  std::uint32_t instance = 0;

  Eigen::Vector3d far_point = Eigen::Vector3d::Zero();  ///< reflection point next to the satellite (order 2)
  std::uint32_t far_triangle = 0;                       ///< that reflects there, of `far_instance`
  std::uint32_t far_instance = 0;
  double leg_m = 0;  ///< from the antenna to `point` (order 2)

  /// Stays the same while the signal comes over the same surfaces or edge: what random phases depend on
  /// (tracking::PathPhases). 0 for Direct.
  std::uint64_t reflector = 0;
  /// Mean power [1] over the unobstructed line of sight's at isotropic antennas (Diffuse only); the
  /// instantaneous one is Rayleigh fading about it.
  double scattered_power = 0;
  /// Multiplies the path's amplitude [1], >= 0: what its geometry does not know (disturbance::Disturbance).
  double amplitude_factor = 1;

  // Transmitted: amplitude_factor is over the satellite's clear line of sight in front of the antenna, for a
  // right-hand wave; excess_m may be of either sign and of any size.
  double range_rate_mps = 0;  ///< of range and excess together, as the carrier shows it [m/s]
  /// Part of excess_m that the code alone has, and its rate: the carrier is shorter by that.
  double code_ahead_m = 0, code_ahead_mps = 0;
  std::uint32_t signals = ~0U;  ///< that are sent: bit gnss::index_of(signal)

  /// Excess of the carrier [m].
  [[nodiscard]] double carrier_excess_m() const { return excess_m - code_ahead_m; }
  /// Between ray and facet normal, [0, pi/2): at `point`, and at `far_point`; 0 where nothing reflects.
  [[nodiscard]] double incidence_rad() const {
    return incidence_count > 0 ? incidences[static_cast<std::size_t>(incidence_count) - 1].incidence_rad : 0;
  }
  [[nodiscard]] double far_incidence_rad() const {
    return incidence_count > 1 ? incidences[0].incidence_rad : 0;
  }
};

/// The antenna as the satellite in direction `s` (unit, ENU) sees it in the mirrors of `path`: the antenna
/// itself for Direct, else on the line through the reflection point next to the satellite, as far behind it
/// as the way is long from there to the antenna. excess_m = s . (antenna - image), and while what the path
/// comes over stands still d(excess)/dt = s' . (antenna - image) + (s - arrival) . antenna'. For planes and,
/// because the point on the edge is where the way is stationary, for Diffracted as well (Keller's point moves
/// along, but that changes nothing in first order). Diffuse: over one facade, to a point
/// that stays where it is; the class's mean detour differs by its width, and by the way over further facades.
[[nodiscard]] Eigen::Vector3d antenna_image(const Path& path, const Eigen::Vector3d& antenna,
                                            const Eigen::Vector3d& s);

/// How a satellite is seen: by all paths, however weak (SatellitePaths), or as a receiver finds it
/// (receiver::SatelliteObservation).
enum class Visibility : std::uint8_t {
  LOS,           ///< direct path clear, nothing else arrives
  LOSMultipath,  ///< direct path clear, reflections arrive as well (an edge beside the path does not count)
  NLOS,          ///< direct path blocked, at least one other path arrives
  Blocked,       ///< nothing arrives
};
/// "LOS", "LOS+multipath", "NLOS", "blocked": the words of every output.
[[nodiscard]] std::string_view name(Visibility visibility);

/// Whether `a` stands before `b` in SatellitePaths.
[[nodiscard]] bool comes_before(const Path& a, const Path& b);

/// All paths of one satellite, Direct first, then by excess path, of equal ones the lower order first,
/// Transmitted ones last. Visibility is the satellite's own: these do not count.
struct SatellitePaths {
  Visibility visibility = Visibility::Blocked;
  std::vector<Path> paths;

  /// Puts the paths in order, and says the visibility that they make.
  void arrange();
  [[nodiscard]] bool received() const { return visibility != Visibility::Blocked; }
  /// Excess path [m] of the signal that an ideal receiver tracks, which receives every path and follows the
  /// first: 0 with a direct path (through leaves too), else that of the shortest path of any kind, around
  /// an edge or diffuse, however weak; 0 when blocked. Transmitted ones do not count. A real correlator,
  /// which weighs all paths by their strengths, is part of the receiver's signal model.
  [[nodiscard]] double tracked_excess_m() const;
};

}  // namespace canyon::propagation
