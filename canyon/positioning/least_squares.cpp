#include "canyon/positioning/least_squares.hpp"

namespace canyon::positioning {

template <typename Matrix>
void LeastSquares<Matrix>::compute(const Matrix& a) {
  qr_.compute(a);
}

template <typename Matrix>
Eigen::Index LeastSquares<Matrix>::rank(double threshold) {
  qr_.setThreshold(threshold);
  return qr_.rank();
}

template <typename Matrix>
typename LeastSquares<Matrix>::Unknowns LeastSquares<Matrix>::solve(const Eigen::VectorXd& b) const {
  return qr_.solve(b);
}

template <typename Matrix>
typename LeastSquares<Matrix>::Square LeastSquares<Matrix>::cofactor() const {
  const Eigen::Index unknowns = qr_.cols();
  const Square r = qr_.matrixQR().topRows(unknowns);
  Square inverse = Square::Identity(unknowns, unknowns);
  r.template triangularView<Eigen::Upper>().solveInPlace(inverse);
  const Square permuted = qr_.colsPermutation() * inverse;
  return permuted * permuted.transpose();
}

template <typename Matrix>
Eigen::MatrixXd LeastSquares<Matrix>::solve_diagonal(const Eigen::VectorXd& diagonal) const {
  return qr_.solve(Eigen::MatrixXd(diagonal.asDiagonal()));
}

template <typename Matrix>
Eigen::VectorXd LeastSquares<Matrix>::leverages() const {
  const Eigen::MatrixXd basis = qr_.householderQ() * Eigen::MatrixXd::Identity(qr_.rows(), qr_.rank());
  return basis.rowwise().squaredNorm();
}

template void LeastSquares<Design>::compute(const Design&);
template Eigen::Index LeastSquares<Design>::rank(double);
template LeastSquares<Design>::Unknowns LeastSquares<Design>::solve(const Eigen::VectorXd&) const;
template Cofactor LeastSquares<Design>::cofactor() const;
template Eigen::MatrixXd LeastSquares<Design>::solve_diagonal(const Eigen::VectorXd&) const;
template Eigen::VectorXd LeastSquares<Design>::leverages() const;

using FourColumns = Eigen::Matrix<double, Eigen::Dynamic, 4>;
template void LeastSquares<FourColumns>::compute(const FourColumns&);
template Eigen::Index LeastSquares<FourColumns>::rank(double);
template Eigen::Vector4d LeastSquares<FourColumns>::solve(const Eigen::VectorXd&) const;
template Eigen::Matrix4d LeastSquares<FourColumns>::cofactor() const;

}  // namespace canyon::positioning
