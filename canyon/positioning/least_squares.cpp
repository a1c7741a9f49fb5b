#include "canyon/positioning/least_squares.hpp"

#include <Eigen/QR>

namespace canyon::positioning {

struct LeastSquares::Factorization {
  Eigen::ColPivHouseholderQR<Design> qr;
};

LeastSquares::LeastSquares() : factorization_(std::make_unique<Factorization>()) {}

LeastSquares::LeastSquares(const Design& a) : LeastSquares() {
  compute(a);
}

LeastSquares::~LeastSquares() = default;

void LeastSquares::compute(const Design& a) {
  factorization_->qr.compute(a);
}

Eigen::Index LeastSquares::rank(double threshold) {
  factorization_->qr.setThreshold(threshold);
  return factorization_->qr.rank();
}

LeastSquares::Unknowns LeastSquares::solve(const Eigen::VectorXd& b) const {
  return factorization_->qr.solve(b);
}

Cofactor LeastSquares::cofactor() const {
  const auto& qr = factorization_->qr;
  const Eigen::Index unknowns = qr.cols();
  const Cofactor r = qr.matrixQR().topRows(unknowns);
  Cofactor inverse = Cofactor::Identity(unknowns, unknowns);
  r.triangularView<Eigen::Upper>().solveInPlace(inverse);
  const Cofactor permuted = qr.colsPermutation() * inverse;
  return permuted * permuted.transpose();
}

Eigen::MatrixXd LeastSquares::solve_diagonal(const Eigen::VectorXd& diagonal) const {
  return factorization_->qr.solve(Eigen::MatrixXd(diagonal.asDiagonal()));
}

Eigen::VectorXd LeastSquares::leverages() const {
  const auto& qr = factorization_->qr;
  const Eigen::MatrixXd basis = qr.householderQ() * Eigen::MatrixXd::Identity(qr.rows(), qr.rank());
  return basis.rowwise().squaredNorm();
}

}  // namespace canyon::positioning
