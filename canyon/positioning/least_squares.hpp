#pragma once

#include <array>

#include "canyon/positioning/dop.hpp"

namespace canyon::positioning {

/// Least squares min |A x - b| by Householder's QR with column pivoting, A P = Q R (Golub & Van Loan, Matrix
/// Computations, 4th ed., algorithm 5.4.1; norms of columns by LAPACK Working Note 176). Plain loops, because
/// Eigen's templates for the same take half a minute to compile. They sum in the order of Eigen 3.4's
/// ColPivHouseholderQR with packets of two doubles, so that rank(), solve() and cofactor() are equal to its
/// to the last bit there.
class LeastSquares {
 public:
  using Unknowns = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, Design::MaxColsAtCompileTime, 1>;

  LeastSquares() = default;
  /// @param a rows x unknowns
  explicit LeastSquares(const Design& a) { compute(a); }
  /// @param a rows x unknowns
  void compute(const Design& a);
  /// Number of pivots above `threshold` of the largest.
  [[nodiscard]] Eigen::Index rank(double threshold) const;
  /// x of right side b, as long as A has rows; a basic solution where A lacks rank.
  [[nodiscard]] Unknowns solve(const Eigen::VectorXd& b) const;
  /// (A^T A)^-1 = P R^-1 R^-T P^T. A has full rank and no fewer rows than columns.
  [[nodiscard]] Cofactor cofactor() const;
  /// Covariance of x where the elements of b are independent.
  /// @param sigma standard deviation of each element of b
  [[nodiscard]] Cofactor covariance(const Eigen::VectorXd& sigma) const;
  /// The diagonal of the projection onto A's columns.
  [[nodiscard]] Eigen::VectorXd leverages() const;

 private:
  [[nodiscard]] Eigen::VectorXd transposed_q_times(Eigen::VectorXd b) const;

  Design qr_;  // R; below its diagonal the reflections' vectors, each without its first element, 1
  std::array<double, Design::MaxColsAtCompileTime> tau_{};           // the reflections are I - tau v v^T
  std::array<Eigen::Index, Design::MaxColsAtCompileTime> column_{};  // column of A that each pivot is of
  Eigen::Index pivots_ = 0;                                          // before the first that is rounding
  double largest_pivot_ = 0;
};

}  // namespace canyon::positioning
