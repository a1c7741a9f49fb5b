#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string_view>
#include <vector>

#include "canyon/orbit/sky.hpp"

namespace canyon::propagation {

enum class PathKind : std::uint8_t { Direct, Reflected };

/// One way from satellite to antenna. Directions and points are in the city's ENU frame.
struct Path {
  PathKind kind = PathKind::Direct;
  double excess_m = 0;  ///< longer than the straight line by this much; 0 for Direct
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    ///< reflection point (Reflected)
  Eigen::Vector3d arrival = Eigen::Vector3d::Zero();  ///< unit, from the antenna towards where it comes from
  double incidence_rad = 0;                           ///< between ray and facet normal, [0, pi/2)
  std::uint32_t triangle = 0;                         ///< that reflects, of `instance`
  std::uint32_t instance = 0;
};

enum class Visibility : std::uint8_t {
  LOS,           ///< direct path clear, nothing else arrives
  LOSMultipath,  ///< direct path clear, reflections arrive as well
  NLOS,          ///< direct path blocked, at least one other path arrives
  Blocked,       ///< nothing arrives
};
/// "LOS", "LOS+multipath", "NLOS", "blocked": the words of every output.
[[nodiscard]] std::string_view name(Visibility visibility);

/// All paths of one satellite, Direct first, then by excess path.
struct SatellitePaths {
  Visibility visibility = Visibility::Blocked;
  std::vector<Path> paths;

  [[nodiscard]] bool received() const { return visibility != Visibility::Blocked; }
  /// Excess path [m] of the signal that a receiver tracks: 0 with a direct path (the code error of LOS plus
  /// multipath is modelled in the receiver, later), else that of the shortest path; 0 when blocked.
  [[nodiscard]] double tracked_excess_m() const;
};

/// A satellite above the horizon as it arrives at an antenna: orbit and surroundings together.
struct SatelliteView {
  orbit::LineOfSight line;
  SatellitePaths paths;
};

}  // namespace canyon::propagation
