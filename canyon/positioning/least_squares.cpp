#include "canyon/positioning/least_squares.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

namespace canyon::positioning {

std::string_view name(DopRating rating) {
  constexpr std::string_view kNames[]{"Ideal", "Excellent", "Good", "Moderate", "Fair", "Poor"};
  return kNames[static_cast<std::size_t>(rating)];
}

DopRating rate_dop(double dop) {
  if (dop < 1) return DopRating::Ideal;
  if (dop < 2) return DopRating::Excellent;
  if (dop < 5) return DopRating::Good;
  if (dop < 10) return DopRating::Moderate;
  if (dop < 20) return DopRating::Fair;
  return DopRating::Poor;
}

std::optional<Cofactor> cofactor(const Design& design, double threshold) {
  const Eigen::Index unknowns = design.cols();
  if (design.rows() < unknowns) return std::nullopt;
  const LeastSquares least_squares(design);
  if (least_squares.rank(threshold) < unknowns) return std::nullopt;
  return least_squares.cofactor();
}

Dop dop_from_cofactor(const Cofactor& cofactor_enu) {
  assert(cofactor_enu.rows() == cofactor_enu.cols() && cofactor_enu.rows() >= 4);
  const double horizontal = cofactor_enu(0, 0) + cofactor_enu(1, 1);
  const double vertical = cofactor_enu(2, 2);
  const double all = cofactor_enu.trace();
  Dop dop;
  dop.gdop = std::sqrt(all);
  dop.pdop = std::sqrt(horizontal + vertical);
  dop.hdop = std::sqrt(horizontal);
  dop.vdop = std::sqrt(vertical);
  dop.tdop = std::sqrt(cofactor_enu.diagonal().tail(cofactor_enu.rows() - 3).sum());
  return dop;
}

std::optional<Dop> dop_of_directions(std::span<const Eigen::Vector3d> directions) {
  Design design(static_cast<Eigen::Index>(directions.size()), 4);
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    design.row(row).head<3>() = -directions[i].transpose();
    design(row, 3) = 1;
  }
  const std::optional<Cofactor> q = cofactor(design);
  if (!q) return std::nullopt;
  return dop_from_cofactor(*q);
}

namespace {

/// Below this part of a residual the solution takes up whatever error there is.
constexpr double kUnchecked = 1e-6;

}  // namespace

std::optional<Eigen::Index> largest_normalised_residual(const Design& design,
                                                        const Eigen::VectorXd& residual) {
  const std::optional<Cofactor> covariance = cofactor(design, 1e-13);
  if (!covariance) return std::nullopt;
  std::optional<Eigen::Index> worst;
  double largest = 0;
  for (Eigen::Index i = 0; i < design.rows(); ++i) {
    double leverage = 0;
    for (Eigen::Index j = 0; j < design.cols(); ++j) {
      double along = 0;
      for (Eigen::Index k = 0; k < design.cols(); ++k) along += design(i, k) * (*covariance)(k, j);
      leverage += along * design(i, j);
    }
    const double q = 1 - leverage;
    if (q < kUnchecked) continue;
    const double squared = residual(i) * residual(i) / q;
    if (worst && !(squared > largest)) continue;
    worst = i;
    largest = squared;
  }
  return worst;
}

namespace {

using Eigen::Index;

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
/// Eigen solves triangles of several right sides in blocks of so many unknowns.
constexpr Index kPanel = 4;

/// a . b in Eigen's order: that of a sum with `alone`, else that of a product of a matrix and a vector.
double dot(const double* a, const double* b, Index n, bool alone) {
  double even = 0, odd = 0, next_even = 0, next_odd = 0;
  Index i = 0;
  if (alone) {
    for (; i + 4 <= n; i += 4) {
      even += a[i] * b[i];
      odd += a[i + 1] * b[i + 1];
      next_even += a[i + 2] * b[i + 2];
      next_odd += a[i + 3] * b[i + 3];
    }
    even += next_even;
    odd += next_odd;
  }
  for (; i + 2 <= n; i += 2) {
    even += a[i] * b[i];
    odd += a[i + 1] * b[i + 1];
  }
  double sum = even + odd;
  if (i < n) sum += a[i] * b[i];
  return sum;
}

double norm(const double* a, Index n) {
  return std::sqrt(dot(a, a, n, true));
}

/// Applies the reflection by `tau` and v = (1, below) to the n numbers at x.
void reflect(double tau, const double* below, double* x, Index n, bool alone) {
  if (tau == 0) return;
  const double along = dot(below, x + 1, n - 1, alone) + x[0];
  x[0] -= tau * along;
  for (Index i = 1; i < n; ++i) x[i] -= tau * below[i - 1] * along;
}

/// Makes v = (1, below) and tau of the n numbers x = (x[0], below) in place, and x[0] what is reflected
/// there.
double make_reflection(double* x, Index n) {
  const double rest = dot(x + 1, x + 1, n - 1, true);
  if (rest <= std::numeric_limits<double>::min()) {
    std::fill(x + 1, x + n, 0.0);
    return 0;
  }
  const double first = x[0];
  x[0] = std::sqrt(first * first + rest);
  if (first >= 0) x[0] = -x[0];
  for (Index i = 1; i < n; ++i) x[i] /= first - x[0];
  return (x[0] - first) / x[0];
}

}  // namespace

void LeastSquares::compute(const Design& a) {
  qr_ = a;
  const Index rows = a.rows(), columns = a.cols(), size = std::min(rows, columns);
  std::array<double, Design::MaxColsAtCompileTime> norms{}, exact_norms{};
  double largest = 0;
  for (Index k = 0; k < columns; ++k) {
    column_[k] = k;
    norms[k] = exact_norms[k] = norm(&qr_(0, k), rows);
    largest = std::max(largest, norms[k]);
  }
  const double rounding = largest * kEpsilon * (largest * kEpsilon) / static_cast<double>(rows);
  pivots_ = size;
  largest_pivot_ = 0;
  for (Index k = 0; k < size; ++k) {
    const Index pivot = std::max_element(norms.begin() + k, norms.begin() + columns) - norms.begin();
    if (pivots_ == size && norms[pivot] * norms[pivot] < rounding * static_cast<double>(rows - k))
      pivots_ = k;
    if (pivot != k) {
      std::swap_ranges(&qr_(0, k), &qr_(0, k) + rows, &qr_(0, pivot));
      std::swap(norms[k], norms[pivot]);
      std::swap(exact_norms[k], exact_norms[pivot]);
      std::swap(column_[k], column_[pivot]);
    }
    double* diagonal = &qr_(k, k);
    tau_[k] = make_reflection(diagonal, rows - k);
    largest_pivot_ = std::max(largest_pivot_, std::abs(*diagonal));
    for (Index j = k + 1; j < columns; ++j) {
      reflect(tau_[k], diagonal + 1, &qr_(k, j), rows - k, k + 2 == columns);
      if (norms[j] == 0) continue;
      const double ratio = std::abs(qr_(k, j)) / norms[j];
      const double left = std::max((1 + ratio) * (1 - ratio), 0.0);
      const double since_exact = norms[j] / exact_norms[j];
      if (left * (since_exact * since_exact) <= std::sqrt(kEpsilon)) {
        norms[j] = exact_norms[j] = norm(&qr_(k, j) + 1, rows - k - 1);
      } else {
        norms[j] *= std::sqrt(left);
      }
    }
  }
}

Eigen::Index LeastSquares::rank(double threshold) const {
  Index rank = 0;
  for (Index k = 0; k < pivots_; ++k) rank += std::abs(qr_(k, k)) > largest_pivot_ * threshold ? 1 : 0;
  return rank;
}

Eigen::VectorXd LeastSquares::transposed_q_times(Eigen::VectorXd b) const {
  const Index rows = qr_.rows();
  for (Index k = 0; k < pivots_; ++k) reflect(tau_[k], &qr_(k, k) + 1, &b(k), rows - k, true);
  return b;
}

LeastSquares::Unknowns LeastSquares::solve(const Eigen::VectorXd& b) const {
  Eigen::VectorXd c = transposed_q_times(b);
  Unknowns x = Unknowns::Zero(qr_.cols());
  for (Index k = pivots_ - 1; k >= 0; --k) {
    c(k) /= qr_(k, k);
    for (Index i = 0; i < k; ++i) c(i) -= c(k) * qr_(i, k);
    x(column_[k]) = c(k);
  }
  return x;
}

Cofactor LeastSquares::cofactor() const {
  const Index n = qr_.cols();
  Cofactor inverse = Cofactor::Identity(n, n);
  for (Index end = n; end > 0; end -= kPanel) {
    const Index begin = std::max<Index>(0, end - kPanel);
    for (Index j = 0; j < n; ++j) {
      for (Index k = end - 1; k >= begin; --k) {
        inverse(k, j) *= 1 / qr_(k, k);
        for (Index i = begin; i < k; ++i) inverse(i, j) -= inverse(k, j) * qr_(i, k);
      }
      for (Index i = 0; i < begin; ++i) {
        double sum = 0;
        for (Index k = begin; k < end; ++k) sum += qr_(i, k) * inverse(k, j);
        inverse(i, j) -= sum;
      }
    }
  }
  Cofactor result(n, n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) {
      double sum = 0;
      for (Index k = 0; k < n; ++k) sum += inverse(i, k) * inverse(j, k);
      result(column_[i], column_[j]) = sum;
    }
  }
  return result;
}

Cofactor LeastSquares::covariance(const Eigen::VectorXd& sigma) const {
  Cofactor result = Cofactor::Zero(qr_.cols(), qr_.cols());
  for (Index i = 0; i < sigma.size(); ++i) {
    const Unknowns x = solve(sigma(i) * Eigen::VectorXd::Unit(sigma.size(), i));
    for (Index j = 0; j < x.size(); ++j) result.col(j) += x(j) * x;
  }
  return result;
}

Eigen::VectorXd LeastSquares::leverages() const {
  const Index rows = qr_.rows();
  const Index in_image = rank(kEpsilon * static_cast<double>(std::min(rows, qr_.cols())));
  Eigen::VectorXd result(rows);
  for (Index i = 0; i < rows; ++i) {
    const Eigen::VectorXd along = transposed_q_times(Eigen::VectorXd::Unit(rows, i));
    result(i) = dot(along.data(), along.data(), in_image, true);
  }
  return result;
}

}  // namespace canyon::positioning
