#include "canyon/relative/triangular.hpp"

#include <cmath>

#include "canyon/base/simd_clones.hpp"

namespace canyon::relative {

using Eigen::Index;
using Eigen::MatrixXd;

CANYON_CLONES void add_multiple(double factor, const double* __restrict from, std::ptrdiff_t n,
                                double* __restrict to) {
  for (std::ptrdiff_t i = 0; i < n; ++i) to[i] += factor * from[i];
}

Triangular triangular(const MatrixXd& covariance) {
  const Index n = covariance.rows();
  MatrixXd rest = covariance;
  Triangular f{MatrixXd::Identity(n, n), Eigen::VectorXd(n)};
  for (Index i = n - 1; i >= 0; --i) {
    const double d = rest(i, i);
    // Rounding leaves this much of a variance that others explain.
    if (!(d > 1e-14 * covariance(i, i)) || !std::isfinite(d)) {
      return {f.l.bottomRightCorner(n - 1 - i, n - 1 - i), f.d.tail(n - 1 - i)};
    }
    f.d(i) = d;
    for (Index j = 0; j < i; ++j) f.l(i, j) = rest(j, i) / d;
    for (Index j = 0; j < i; ++j) add_multiple(-f.l(i, j), &rest(0, i), j + 1, &rest(0, j));
  }
  return f;
}

MatrixXd times_inverse(MatrixXd b, const Triangular& q) {
  const Index m = b.rows(), n = b.cols();
  const auto take = [&](Index from, double factor, Index to) {
    add_multiple(-factor, &b(0, from), m, &b(0, to));
  };
  for (Index j = n - 1; j >= 0; --j) {
    for (Index k = j + 1; k < n; ++k) take(k, q.l(k, j), j);
  }
  for (Index j = 0; j < n; ++j) b.col(j) /= q.d(j);
  for (Index j = 0; j < n; ++j) {
    for (Index k = 0; k < j; ++k) take(k, q.l(j, k), j);
  }
  return b;
}

MatrixXd product(const MatrixXd& a, const MatrixXd& b) {
  MatrixXd result = MatrixXd::Zero(a.rows(), b.cols());
  for (Index j = 0; j < b.cols(); ++j) {
    for (Index k = 0; k < a.cols(); ++k) add_multiple(b(k, j), &a(0, k), a.rows(), &result(0, j));
  }
  return result;
}

void add_product_to_lower(const MatrixXd& a, const MatrixXd& b, MatrixXd& p) {
  for (Index j = 0; j < p.cols(); ++j) {
    for (Index k = 0; k < a.cols(); ++k) add_multiple(b(j, k), &a(j, k), p.rows() - j, &p(j, j));
  }
}

}  // namespace canyon::relative
