#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "canyon/gnss/satellite_id.hpp"
#include "canyon/positioning/dop.hpp"

namespace canyon::heatmap {

/// Weighted least squares of a fix about a known place, where it is linear (Misra and Enge, Global
/// Positioning System, 2nd ed. 2011, section 6.1): each satellite gives a row -u . dx + clock = error of
/// weight w, and
///   x = (H^T W H)^-1 H^T W m
/// by Cholesky of the normal equations. The place's error is within 1e-10 of the pseudorange errors of what
/// an orthogonal decomposition of H gives, up to PDOP 100.
class LinearFix {
 public:
  static constexpr std::size_t kMostUnknowns = 3 + gnss::kSystemCount;
  /// East, north, up, then the clocks [m]; those beyond unknowns() are 0.
  using Unknowns = std::array<double, kMostUnknowns>;

  explicit LinearFix(int clocks) : unknowns_(3 + static_cast<std::size_t>(clocks)) {
    const auto n = static_cast<Eigen::Index>(unknowns_);
    matrix_.topLeftCorner(n, n).setZero();
  }
  [[nodiscard]] std::size_t unknowns() const { return unknowns_; }

  /// @param direction u, unit, ENU, from antenna to satellite @param clock its column,
  /// positioning::Clocks::column @param weight 1 / sigma^2 @param error_m of the pseudorange
  void add(const Eigen::Vector3d& direction, int clock, double weight, double error_m = 0) {
    for (Eigen::Index i = 0; i < 3; ++i) {
      for (Eigen::Index j = i; j < 3; ++j) matrix_(i, j) += weight * (direction[i] * direction[j]);
      matrix_(i, clock) -= weight * direction[i];
    }
    matrix_(clock, clock) += weight;
    add_error(right_, direction, clock, weight, error_m);
  }
  /// Once, behind the last row and before what follows. False where the rows do not determine the unknowns: a
  /// pivot is below positioning::kRankThreshold squared of its own diagonal element (positioning::solve_fix()
  /// compares pivots of the design matrix, whose squares these are).
  [[nodiscard]] bool factorise();
  /// x for the errors of all rows.
  [[nodiscard]] Unknowns solve() const { return substitute(right_); }
  /// The change of x for each metre of error of a row.
  [[nodiscard]] Unknowns gain(const Eigen::Vector3d& direction, int clock, double weight) const {
    Unknowns right{};
    add_error(right, direction, clock, weight, 1);
    return substitute(right);
  }
  /// East, north and up of (H^T W H)^-1.
  [[nodiscard]] Eigen::Matrix3d covariance() const;
  /// Where all weights are 1.
  [[nodiscard]] positioning::Dop dop() const;

 private:
  static void add_error(Unknowns& right, const Eigen::Vector3d& direction, int clock, double weight,
                        double error_m) {
    for (std::size_t i = 0; i < 3; ++i) {
      right[i] -= weight * direction[static_cast<Eigen::Index>(i)] * error_m;
    }
    right[static_cast<std::size_t>(clock)] += weight * error_m;
  }
  [[nodiscard]] Unknowns substitute(Unknowns right) const;
  [[nodiscard]] Unknowns inverse_column(std::size_t i) const {
    Unknowns unit{};
    unit[i] = 1;
    return substitute(unit);
  }

  std::size_t unknowns_;
  /// The upper part: H^T W H, then R of R^T R with its diagonal inverted.
  Eigen::Matrix<double, kMostUnknowns, kMostUnknowns> matrix_;
  Unknowns right_{};
};

}  // namespace canyon::heatmap
