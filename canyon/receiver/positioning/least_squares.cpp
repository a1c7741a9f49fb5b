#include "canyon/receiver/positioning/least_squares.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <cassert>
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

namespace {

template <int MaxRows>
std::optional<Cofactor> full_rank_cofactor(const typename BasicLeastSquares<MaxRows>::Matrix& design,
                                           double threshold) {
  const Eigen::Index unknowns = design.cols();
  if (design.rows() < unknowns) return std::nullopt;
  const BasicLeastSquares<MaxRows> least_squares(design);
  if (least_squares.rank(threshold) < unknowns) return std::nullopt;
  return least_squares.cofactor();
}

}  // namespace

std::optional<Cofactor> cofactor(const Design& design, double threshold) {
  return full_rank_cofactor<kMaxRows>(design, threshold);
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
  LeastSquaresOfAnySize::Matrix design(static_cast<Eigen::Index>(directions.size()), 4);
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    design.row(row).head<3>() = -directions[i].transpose();
    design(row, 3) = 1;
  }
  const std::optional<Cofactor> q = full_rank_cofactor<Eigen::Dynamic>(design, kRankThreshold);
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

template <int MaxRows>
void BasicLeastSquares<MaxRows>::compute(const Matrix& a) {
  Eigen::ColPivHouseholderQR<Matrix> qr(a);
  qr_ = qr.matrixQR();
  reflections_ = qr.hCoeffs();
  for (Eigen::Index i = 0; i < a.cols(); ++i)
    columns_[static_cast<std::size_t>(i)] = qr.colsPermutation().indices()(i);
  nonzero_pivots_ = qr.nonzeroPivots();
  max_pivot_ = qr.maxPivot();
}

template <int MaxRows>
Eigen::Index BasicLeastSquares<MaxRows>::rank(double threshold) const {
  const auto pivots = qr_.diagonal().head(nonzero_pivots_).array().abs();
  return (pivots > max_pivot_ * threshold).count();
}

template <int MaxRows>
typename BasicLeastSquares<MaxRows>::Unknowns BasicLeastSquares<MaxRows>::solve(const Vector& b) const {
  Unknowns x = Unknowns::Zero(unknowns());
  if (nonzero_pivots_ == 0) return x;
  Vector c = b;
  c.applyOnTheLeft(Eigen::householderSequence(qr_, reflections_).setLength(nonzero_pivots_).adjoint());
  qr_.topLeftCorner(nonzero_pivots_, nonzero_pivots_)
      .template triangularView<Eigen::Upper>()
      .solveInPlace(c.topRows(nonzero_pivots_));
  for (Eigen::Index i = 0; i < nonzero_pivots_; ++i) x(columns_[static_cast<std::size_t>(i)]) = c(i);
  return x;
}

template <int MaxRows>
Cofactor BasicLeastSquares<MaxRows>::cofactor() const {
  const Eigen::Index n = unknowns();
  const Cofactor r = qr_.topRows(n);
  const Cofactor rows = r.triangularView<Eigen::Upper>().solve(Cofactor::Identity(n, n));
  Cofactor inverse(n, n);
  for (Eigen::Index i = 0; i < n; ++i) inverse.row(columns_[static_cast<std::size_t>(i)]) = rows.row(i);
  return inverse.lazyProduct(inverse.transpose());
}

template <int MaxRows>
Cofactor BasicLeastSquares<MaxRows>::covariance(const Vector& sigma) const {
  Cofactor result = Cofactor::Zero(unknowns(), unknowns());
  for (Eigen::Index i = 0; i < sigma.size(); ++i) {
    const Unknowns x = solve(sigma(i) * Vector::Unit(sigma.size(), i));
    result += x.lazyProduct(x.transpose());
  }
  return result;
}

template <int MaxRows>
typename BasicLeastSquares<MaxRows>::Vector BasicLeastSquares<MaxRows>::leverages() const {
  const double rounding = std::numeric_limits<double>::epsilon();
  const Eigen::Index in_image = rank(rounding * static_cast<double>(std::min(qr_.rows(), qr_.cols())));
  const Matrix image = Eigen::householderSequence(qr_, reflections_) * Matrix::Identity(qr_.rows(), in_image);
  return image.rowwise().squaredNorm();
}

template class BasicLeastSquares<kMaxRows>;
template class BasicLeastSquares<Eigen::Dynamic>;

}  // namespace canyon::positioning
