#pragma once

#include <memory>

#include "canyon/positioning/dop.hpp"

namespace canyon::positioning {

/// Least squares min |A x - b| by QR with column pivoting, A P = Q R. The factorization is compiled in
/// least_squares.cpp alone: its templates take seconds.
class LeastSquares {
 public:
  using Unknowns = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, Design::MaxColsAtCompileTime, 1>;

  LeastSquares();
  /// @param a rows x unknowns
  explicit LeastSquares(const Design& a);
  ~LeastSquares();
  /// @param a rows x unknowns
  void compute(const Design& a);
  /// Pivots above `threshold` of the largest.
  [[nodiscard]] Eigen::Index rank(double threshold);
  /// x of right side b, as long as A has rows; the shortest where A lacks rank.
  [[nodiscard]] Unknowns solve(const Eigen::VectorXd& b) const;
  /// (A^T A)^-1 = P R^-1 R^-T P^T. A has full rank and no fewer rows than columns.
  [[nodiscard]] Cofactor cofactor() const;
  /// A's pseudoinverse times a diagonal matrix, unknowns x rows.
  [[nodiscard]] Eigen::MatrixXd solve_diagonal(const Eigen::VectorXd& diagonal) const;
  /// The diagonal of the projection onto A's columns.
  [[nodiscard]] Eigen::VectorXd leverages() const;

 private:
  struct Factorization;
  std::unique_ptr<Factorization> factorization_;
};

}  // namespace canyon::positioning
