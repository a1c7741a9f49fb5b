#include "canyon/receiver/positioning/least_squares.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "canyon/base/input_error.hpp"

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

void check_rows(std::size_t rows) {
  if (rows > static_cast<std::size_t>(kMaxRows))
    throw InputError(fmt::format("{} satellites at one epoch", rows),
                     fmt::format("give {} at most", kMaxRows));
}

std::optional<Dop> dop_of_directions(std::span<const Eigen::Vector3d> directions) {
  check_rows(directions.size());
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

/// Below this fraction of a residual the solution absorbs any error.
constexpr double kUnchecked = 1e-6;

}  // namespace

std::optional<Eigen::Index> largest_normalised_residual(const Design& design, const Rows& residual) {
  const std::optional<Cofactor> covariance = cofactor(design, 1e-13);
  if (!covariance) return std::nullopt;
  std::optional<Eigen::Index> worst;
  double largest = 0;
  for (Eigen::Index i = 0; i < design.rows(); ++i) {
    const double q = 1 - (design.row(i) * *covariance).dot(design.row(i));
    if (q < kUnchecked) continue;
    const double squared = residual(i) * residual(i) / q;
    if (worst && !(squared > largest)) continue;
    worst = i;
    largest = squared;
  }
  return worst;
}

Eigen::Index LeastSquares::rank(double threshold) const {
  const auto pivots = qr_.matrixQR().diagonal().head(qr_.nonzeroPivots()).array().abs();
  return (pivots > qr_.maxPivot() * threshold).count();
}

Cofactor LeastSquares::cofactor() const {
  const Eigen::Index n = qr_.cols();
  const Cofactor r = qr_.matrixQR().topRows(n);
  const Cofactor inverse =
      qr_.colsPermutation() * Cofactor(r.triangularView<Eigen::Upper>().solve(Cofactor::Identity(n, n)));
  return inverse.lazyProduct(inverse.transpose());
}

Cofactor LeastSquares::covariance(const Rows& sigma) const {
  Cofactor result = Cofactor::Zero(qr_.cols(), qr_.cols());
  for (Eigen::Index i = 0; i < sigma.size(); ++i) {
    const Unknowns x = solve(sigma(i) * Rows::Unit(sigma.size(), i));
    result += x.lazyProduct(x.transpose());
  }
  return result;
}

Rows LeastSquares::leverages() const {
  const double rounding = std::numeric_limits<double>::epsilon();
  const Eigen::Index in_image = rank(rounding * static_cast<double>(std::min(qr_.rows(), qr_.cols())));
  const Design image = qr_.householderQ() * Design::Identity(qr_.rows(), in_image);
  return image.rowwise().squaredNorm();
}

}  // namespace canyon::positioning
