#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "canyon/heatmap/cells/steady_sky.hpp"
#include "canyon/positioning/dop.hpp"
#include "canyon/positioning/pseudorange_model.hpp"

namespace canyon::heatmap {

/// A pseudorange of a fix.
struct SteadyRange {
  std::uint32_t satellite = 0;  ///< of SteadySky::satellites()
  double error_m = 0;
  double weight = 1;       ///< 1 / sigma^2; of equal weights 1
  double variance_m2 = 1;  ///< that the measurement states
};

/// positioning::solve_fix() about the true place, where it is linear (LinearFix), with its rules for clocks,
/// satellites that are too few and PDOP. It leaves out the curvature of the ranges, 0.3 m for an error of
/// 3 km, and the effect of the place found on mask, weights and atmosphere. Not thread-safe.
class SteadyFix {
 public:
  struct Answer {
    bool solved = false;
    int used = 0;
    Eigen::Vector3d error = Eigen::Vector3d::Zero();  ///< east, north, up [m]
    positioning::Dop dop;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< stated, ENU [m^2]; zero unless asked for
  };

  SteadyFix(const std::vector<SteadySatellite>& satellites, const positioning::FixOptions& options);
  /// @param covariance whether Answer::covariance is asked for
  [[nodiscard]] Answer solve(std::span<const SteadyRange> ranges, bool covariance = false);

 private:
  template <typename F>
  void for_each(std::span<const SteadyRange> ranges, const positioning::Clocks& clocks, const F& f);

  const std::vector<SteadySatellite>& satellites_;
  const positioning::FixOptions& options_;
  /// The geometry asked for last: neighbours and draws mostly have the same.
  std::vector<std::uint32_t> geometry_, used_;
  std::optional<positioning::Dop> dop_;
};

}  // namespace canyon::heatmap
