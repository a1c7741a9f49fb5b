#include "canyon/heatmap/cells/steady_fix.hpp"

#include <algorithm>
#include <cmath>

#include "canyon/positioning/pseudorange_model.hpp"

namespace canyon::heatmap {
namespace {

using Eigen::Vector3d;

/// Of a pivot over its own diagonal element: solve_fix() compares pivots of the design matrix, whose squares
/// these are.
constexpr double kLeastPivot = positioning::kRankThreshold * positioning::kRankThreshold;

/// Cholesky in place of the upper part, as R^T R with R's diagonal inverted; false where it is singular.
template <typename Matrix>
bool factorise(Matrix& a, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    double pivot = a(i, i);
    const double whole = pivot;
    for (std::size_t k = 0; k < i; ++k) pivot -= a(k, i) * a(k, i);
    if (!(pivot > kLeastPivot * whole)) return false;
    const double inverse = 1 / std::sqrt(pivot);
    a(i, i) = inverse;
    for (std::size_t j = i + 1; j < n; ++j) {
      double sum = a(i, j);
      for (std::size_t k = 0; k < i; ++k) sum -= a(k, i) * a(k, j);
      a(i, j) = sum * inverse;
    }
  }
  return true;
}

template <typename Matrix, typename Vector>
void substitute(const Matrix& a, std::size_t n, Vector& b) {
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < i; ++k) b[i] -= a(k, i) * b[k];
    b[i] *= a(i, i);
  }
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t k = i + 1; k < n; ++k) b[i] -= a(i, k) * b[k];
    b[i] *= a(i, i);
  }
}

}  // namespace

SteadyFix::SteadyFix(const std::vector<SteadySatellite>& satellites, const positioning::FixOptions& options)
    : satellites_(satellites), options_(options) {}

SteadyFix::Answer SteadyFix::solve(std::span<const SteadyRange> ranges, bool covariance) {
  Answer answer;
  std::array<int, gnss::kSystemCount> count{};
  for (const SteadyRange& range : ranges) {
    ++count[static_cast<std::size_t>(satellites_[range.satellite].line.id.system)];
  }
  const positioning::Clocks clocks = positioning::clocks_of(count);
  used_.clear();
  Matrix normal, shape;
  const std::size_t unknowns = 3 + static_cast<std::size_t>(clocks.count);
  const auto n = static_cast<Eigen::Index>(unknowns);
  normal.topLeftCorner(n, n).setZero();
  shape.topLeftCorner(n, n).setZero();
  std::array<double, kMost> right{};
  for (const SteadyRange& range : ranges) {
    const SteadySatellite& s = satellites_[range.satellite];
    const int column = clocks.column[static_cast<std::size_t>(s.line.id.system)];
    if (column < 0) continue;
    used_.push_back(range.satellite);
    // -direction . dx + clock = error
    for (Eigen::Index i = 0; i < 3; ++i) {
      for (Eigen::Index j = i; j < 3; ++j) {
        const double product = s.local[i] * s.local[j];
        normal(i, j) += range.weight * product;
        shape(i, j) += product;
      }
      normal(i, column) -= range.weight * s.local[i];
      shape(i, column) -= s.local[i];
      right[static_cast<std::size_t>(i)] -= range.weight * s.local[i] * range.error_m;
    }
    normal(column, column) += range.weight;
    shape(column, column) += 1;
    right[static_cast<std::size_t>(column)] += range.weight * range.error_m;
  }
  if (!positioning::enough_satellites(static_cast<int>(used_.size()), clocks.count, options_)) return answer;
  if (used_.size() < unknowns || !factorise(normal, unknowns)) return answer;
  substitute(normal, unknowns, right);
  answer.error = Vector3d(right[0], right[1], right[2]);
  if (used_ != geometry_) {
    geometry_ = used_;
    dop_.reset();
    if (factorise(shape, unknowns)) {
      positioning::Cofactor cofactor(n, n);
      for (Eigen::Index j = 0; j < n; ++j) {
        std::array<double, kMost> unit{};
        unit[static_cast<std::size_t>(j)] = 1;
        substitute(shape, unknowns, unit);
        for (Eigen::Index i = 0; i < n; ++i) cofactor(i, j) = unit[static_cast<std::size_t>(i)];
      }
      dop_ = positioning::dop_from_cofactor(cofactor);
    }
  }
  if (!dop_ || !positioning::strong_enough(dop_, options_)) return answer;
  answer.dop = *dop_;
  answer.used = static_cast<int>(used_.size());
  answer.solved = true;
  if (!covariance) return answer;
  for (Eigen::Index j = 0; j < 3; ++j) {
    std::array<double, kMost> unit{};
    unit[static_cast<std::size_t>(j)] = 1;
    substitute(normal, unknowns, unit);
    for (Eigen::Index i = 0; i < 3; ++i) answer.covariance(i, j) = unit[static_cast<std::size_t>(i)];
  }
  // As positioning::solve_fix(): equal weights stand for the mean of the variances, and the residuals may say
  // that all are larger.
  double variances = 0, squares = 0;
  for (const SteadyRange& range : ranges) {
    const SteadySatellite& s = satellites_[range.satellite];
    const int column = clocks.column[static_cast<std::size_t>(s.line.id.system)];
    if (column < 0) continue;
    variances += range.variance_m2;
    const double residual =
        range.error_m + s.local.dot(answer.error) - right[static_cast<std::size_t>(column)];
    squares += range.weight * residual * residual;
  }
  const auto rows = static_cast<double>(used_.size());
  const bool equal = options_.weights.weighting == positioning::Weighting::Equal;
  if (equal) {
    answer.covariance *= variances / rows;
    squares *= rows / variances;
  }
  if (options_.covariance_by_residuals && used_.size() > unknowns) {
    answer.covariance *= std::max(1.0, squares / (rows - static_cast<double>(unknowns)));
  }
  return answer;
}

}  // namespace canyon::heatmap
