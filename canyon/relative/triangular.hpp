#pragma once

#include <Eigen/Core>
#include <cstddef>

namespace canyon::relative {

// The dense matrices of RTK in plain loops: Eigen's products and factorizations take half a minute to
// compile.

/// Q = L^T D L with L unit lower triangular and D > 0.
struct Triangular {
  Eigen::MatrixXd l;
  Eigen::VectorXd d;
};
/// Factors of the last variables of a covariance, as many as are positive definite.
/// @param covariance [n, n], symmetric
[[nodiscard]] Triangular triangular(const Eigen::MatrixXd& covariance);

/// B Q^-1. Relative error below 1e-15 times n times the condition number of Q.
/// @param b [m, n]
[[nodiscard]] Eigen::MatrixXd times_inverse(Eigen::MatrixXd b, const Triangular& q);

/// to += factor from, of n numbers each.
void add_multiple(double factor, const double* from, std::ptrdiff_t n, double* to);
/// A B.
[[nodiscard]] Eigen::MatrixXd product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
/// P += A B^T in the lower triangle of P.
/// @param a, b [n, m] @param p [n, n]
void add_product_to_lower(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, Eigen::MatrixXd& p);

}  // namespace canyon::relative
