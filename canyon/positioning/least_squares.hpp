#pragma once

#include <Eigen/Core>
#include <Eigen/QR>

#include "canyon/positioning/dop.hpp"

namespace canyon::positioning {

/// Least squares min |A x - b| by QR with column pivoting, A P = Q R. A is a Design or has four columns:
/// least_squares.cpp compiles the factorization for these two, because each costs seconds.
template <typename Matrix>
class LeastSquares {
 public:
  template <int columns>
  using Sized = Eigen::Matrix<double, Matrix::ColsAtCompileTime, columns, Eigen::ColMajor,
                              Matrix::MaxColsAtCompileTime, columns == 1 ? 1 : Matrix::MaxColsAtCompileTime>;
  using Unknowns = Sized<1>;
  using Square = Sized<Matrix::ColsAtCompileTime>;

  LeastSquares() = default;
  explicit LeastSquares(const Matrix& a) { compute(a); }
  /// @param a rows x unknowns
  void compute(const Matrix& a);
  /// Pivots above `threshold` of the largest.
  [[nodiscard]] Eigen::Index rank(double threshold);
  /// x of right side b, as long as A has rows; the shortest where A lacks rank.
  [[nodiscard]] Unknowns solve(const Eigen::VectorXd& b) const;
  /// (A^T A)^-1 = P R^-1 R^-T P^T. A has full rank and no fewer rows than columns.
  [[nodiscard]] Square cofactor() const;
  /// A's pseudoinverse times a diagonal matrix, unknowns x rows. A is a Design.
  [[nodiscard]] Eigen::MatrixXd solve_diagonal(const Eigen::VectorXd& diagonal) const;
  /// The diagonal of the projection onto A's columns. A is a Design.
  [[nodiscard]] Eigen::VectorXd leverages() const;

 private:
  Eigen::ColPivHouseholderQR<Matrix> qr_;
};

}  // namespace canyon::positioning
