#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "canyon/gnss/satellite_id.hpp"
#include "canyon/heatmap/cells/linear_fix.hpp"
#include "canyon/positioning/dop.hpp"
#include "canyon/positioning/pseudorange_model.hpp"

namespace canyon::heatmap {

/// A satellite as the fixes of a tile see it.
struct FixSatellite {
  gnss::System system = gnss::System::GPS;
  Eigen::Vector3d direction;  ///< unit, ENU of the tile's centre
};

/// A pseudorange of a fix.
struct CellRange {
  std::uint32_t satellite = 0;  ///< of a CellFix
  double error_m = 0;
  double weight = 1;       ///< 1 / sigma^2; of equal weights 1
  double variance_m2 = 1;  ///< that the measurement states
};
/// @param stated its sigma_m, and cn0_dbhz for weights by C/N0
[[nodiscard]] CellRange cell_range(std::size_t satellite, double error_m,
                                   const positioning::Measurement& stated, double elevation_rad,
                                   const positioning::WeightOptions& weights);

/// positioning::solve_fix() about the true place, where it is linear (LinearFix), with its rules for clocks,
/// satellites that are too few and PDOP. It leaves out the curvature of the ranges, 0.3 m for an error of
/// 3 km, and the effect of the place found on mask, weights and atmosphere: the troposphere's correction by
/// the height found is 0.1 % of the vertical error. Not thread-safe.
class CellFix {
 public:
  struct Answer {
    bool solved = false;
    int used = 0;
    Eigen::Vector3d error = Eigen::Vector3d::Zero();  ///< east, north, up [m]
    std::optional<positioning::Dop> dop;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< stated, ENU [m^2]; zero unless asked for
  };

  /// @param options must outlive it
  CellFix(std::vector<FixSatellite> satellites, const positioning::FixOptions& options)
      : satellites_(std::move(satellites)), options_(options) {}
  /// @param covariance whether Answer::covariance is asked for
  [[nodiscard]] Answer solve(std::span<const CellRange> ranges, bool covariance = false);
  /// The place's error for each metre of error of one of the ranges that gave the last fix.
  [[nodiscard]] Eigen::Vector3d gain(const CellRange& range) const;

 private:
  [[nodiscard]] int clock_of(const CellRange& range) const {
    return clocks_.column[static_cast<std::size_t>(satellites_[range.satellite].system)];
  }
  void state_covariance(std::span<const CellRange> ranges, const LinearFix::Unknowns& x,
                        Answer& answer) const;

  std::vector<FixSatellite> satellites_;
  const positioning::FixOptions& options_;
  /// The fix asked for last.
  positioning::Clocks clocks_;
  std::optional<LinearFix> fix_;
  /// The geometry asked for last: neighbours and draws mostly have the same.
  std::vector<std::uint32_t> geometry_, used_;
  std::optional<positioning::Dop> dop_;
};

}  // namespace canyon::heatmap
