#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/paths/propagation/paths.hpp"
#include "canyon/receiver/positioning/least_squares.hpp"
#include "canyon/receiver/positioning/pseudorange_model.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::heatmap {

/// Weighted least squares of a fix, linearised at a known position (Misra and Enge, Global Positioning
/// System, 2nd ed. 2011, section 6.1): each satellite gives a row -u . dx + clock = error of weight w, and
///   x = (H^T W H)^-1 H^T W m
/// by Cholesky of the normal equations. The position error agrees with that of an orthogonal decomposition of
/// H within 1e-10 of the pseudorange errors, up to PDOP 100.
class LinearFix {
 public:
  static constexpr int kMaxUnknowns = 3 + static_cast<int>(gnss::kSystemCount);
  /// East, north, up, then the clocks [m].
  using Unknowns = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxUnknowns, 1>;

  explicit LinearFix(int clocks)
      : matrix_(Matrix::Zero(3 + clocks, 3 + clocks)), right_(Unknowns::Zero(3 + clocks)) {}
  [[nodiscard]] std::size_t unknowns() const { return static_cast<std::size_t>(matrix_.rows()); }

  /// @param direction u, unit, ENU, from antenna to satellite @param clock its column,
  /// positioning::Clocks::column @param weight 1 / sigma^2 @param error_m of the pseudorange
  void add(const Eigen::Vector3d& direction, int clock, double weight, double error_m = 0) {
    for (Eigen::Index i = 0; i < 3; ++i) {
      for (Eigen::Index j = 0; j <= i; ++j) matrix_(i, j) += weight * (direction[i] * direction[j]);
      matrix_(clock, i) -= weight * direction[i];
    }
    matrix_(clock, clock) += weight;
    add_error(right_, direction, clock, weight, error_m);
  }
  /// Call it once, after the last row and before the functions below. False if the rows do not determine the
  /// unknowns: a pivot is below positioning::kRankThreshold squared of its own diagonal element
  /// (positioning::solve_fix() compares pivots of the design matrix, whose squares these are).
  [[nodiscard]] bool factorise();
  /// x for the errors of all rows.
  [[nodiscard]] Unknowns solve() const { return factors_.solve(right_); }
  /// The change of x per metre of error of a row.
  [[nodiscard]] Unknowns gain(const Eigen::Vector3d& direction, int clock, double weight) const {
    Unknowns right = Unknowns::Zero(matrix_.rows());
    add_error(right, direction, clock, weight, 1);
    return factors_.solve(right);
  }
  /// East, north and up of (H^T W H)^-1.
  [[nodiscard]] Eigen::Matrix3d covariance() const;
  /// For weights 1.
  [[nodiscard]] positioning::Dop dop() const;

 private:
  static void add_error(Unknowns& right, const Eigen::Vector3d& direction, int clock, double weight,
                        double error_m) {
    for (Eigen::Index i = 0; i < 3; ++i) right[i] -= weight * direction[i] * error_m;
    right[clock] += weight * error_m;
  }

  using Matrix =
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxUnknowns, kMaxUnknowns>;
  Matrix matrix_;  // H^T W H, the lower part
  Eigen::LLT<Matrix> factors_;
  Unknowns right_;
};

/// A satellite in the fixes of a tile.
struct FixSatellite {
  gnss::System system = gnss::System::GPS;
  Eigen::Vector3d direction;  ///< unit, ENU of the tile's centre
};

/// A pseudorange of a fix.
struct CellRange {
  std::uint32_t satellite = 0;  ///< of a CellFix
  double error_m = 0;
  double weight = 1;       ///< 1 / sigma^2; of equal weights 1
  double variance_m2 = 1;  ///< variance reported with the measurement
};
/// @param reported sigma_m and, for weights by C/N0, cn0_dbhz
[[nodiscard]] CellRange cell_range(std::size_t satellite, double error_m,
                                   const positioning::Measurement& reported, double elevation_rad,
                                   const positioning::WeightOptions& weights);

/// positioning::solve_fix() linearised at the true position (LinearFix), with its rules for clocks, too few
/// satellites and PDOP. It neglects the curvature of the ranges (0.3 m for an error of 3 km) and the effect
/// of the computed position on mask, weights and atmosphere: the effect of the computed height on the
/// troposphere's correction is 0.1 % of the vertical error. Not thread-safe.
class CellFix {
 public:
  struct CellSolution {
    bool solved = false;
    int used = 0;
    Eigen::Vector3d error = Eigen::Vector3d::Zero();  ///< east, north, up [m]
    std::optional<positioning::Dop> dop;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< reported, ENU [m^2]; zero unless requested
  };

  /// @param options must outlive it
  CellFix(std::vector<FixSatellite> satellites, const positioning::FixOptions& options)
      : satellites_(std::move(satellites)), options_(options) {}
  /// @param covariance compute CellSolution::covariance
  [[nodiscard]] CellSolution solve(std::span<const CellRange> ranges, bool covariance = false);
  /// Change of the position error per metre of error of a range of the last fix.
  [[nodiscard]] Eigen::Vector3d gain(const CellRange& range) const;

 private:
  [[nodiscard]] int clock_of(const CellRange& range) const {
    return clocks_.column[static_cast<std::size_t>(satellites_[range.satellite].system)];
  }
  void state_covariance(std::span<const CellRange> ranges, const LinearFix::Unknowns& x,
                        CellSolution& result) const;

  std::vector<FixSatellite> satellites_;
  const positioning::FixOptions& options_;
  /// The last fix.
  positioning::Clocks clocks_;
  std::optional<LinearFix> fix_;
  /// Geometry of the last fix, reused: neighbouring cells and samples mostly have the same.
  std::vector<std::uint32_t> geometry_, used_;
  std::optional<positioning::Dop> dop_;
};

/// Errors common to the pseudoranges of all cells of a tile: values at its centre.
struct TileErrors {
  const receiver::ReceiverOptions& options;
  const std::map<gnss::System, gnss::Klobuchar>& klobuchar;
  geodesy::GpsTime time;
  geodesy::Geodetic centre;

  /// The first signal of a satellite that the receiver measures; null: none.
  [[nodiscard]] const gnss::Signal* signal_of(gnss::SatelliteId id) const;
  /// Delays in a signal minus the corrections of the fix, plus the receiver's own without its drift [m].
  /// @param carrier_hz of the satellite's signal
  [[nodiscard]] double error_m(const propagation::SatelliteView& view, const gnss::Signal& signal,
                               double carrier_hz) const;
  /// FixInputOptions::sigma_factor of a signal.
  [[nodiscard]] double sigma_factor(gnss::SatelliteId id, const gnss::Signal& signal) const;
};

/// Antenna position of a line of sight.
[[nodiscard]] geodesy::Geodetic seen_from(const orbit::LineOfSight& line);
/// Satellites for a CellFix. @param lines from the tile's centre
[[nodiscard]] std::vector<FixSatellite> fix_satellites(const std::vector<orbit::LineOfSight>& lines,
                                                       const geodesy::Geodetic& centre);

}  // namespace canyon::heatmap
