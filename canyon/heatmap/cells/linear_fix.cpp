#include "canyon/heatmap/cells/linear_fix.hpp"

#include <cmath>

#include "canyon/positioning/pseudorange_model.hpp"

namespace canyon::heatmap {

using Eigen::Index;

bool LinearFix::factorise() {
  constexpr double kLeastPivot = positioning::kRankThreshold * positioning::kRankThreshold;
  const auto n = static_cast<Index>(unknowns_);
  for (Index i = 0; i < n; ++i) {
    double pivot = matrix_(i, i);
    const double whole = pivot;
    for (Index k = 0; k < i; ++k) pivot -= matrix_(k, i) * matrix_(k, i);
    if (!(pivot > kLeastPivot * whole)) return false;
    const double inverse = 1 / std::sqrt(pivot);
    matrix_(i, i) = inverse;
    for (Index j = i + 1; j < n; ++j) {
      double sum = matrix_(i, j);
      for (Index k = 0; k < i; ++k) sum -= matrix_(k, i) * matrix_(k, j);
      matrix_(i, j) = sum * inverse;
    }
  }
  return true;
}

LinearFix::Unknowns LinearFix::substitute(Unknowns b) const {
  const auto at = [this](std::size_t i, std::size_t j) {
    return matrix_(static_cast<Index>(i), static_cast<Index>(j));
  };
  for (std::size_t i = 0; i < unknowns_; ++i) {
    for (std::size_t k = 0; k < i; ++k) b[i] -= at(k, i) * b[k];
    b[i] *= at(i, i);
  }
  for (std::size_t i = unknowns_; i-- > 0;) {
    for (std::size_t k = i + 1; k < unknowns_; ++k) b[i] -= at(i, k) * b[k];
    b[i] *= at(i, i);
  }
  return b;
}

Eigen::Matrix3d LinearFix::covariance() const {
  Eigen::Matrix3d covariance;
  for (std::size_t j = 0; j < 3; ++j) {
    const Unknowns column = inverse_column(j);
    covariance.col(static_cast<Index>(j)) = Eigen::Vector3d(column[0], column[1], column[2]);
  }
  return covariance;
}

positioning::Dop LinearFix::dop() const {
  const auto n = static_cast<Index>(unknowns_);
  positioning::Cofactor cofactor(n, n);
  for (std::size_t j = 0; j < unknowns_; ++j) {
    const Unknowns column = inverse_column(j);
    for (Index i = 0; i < n; ++i) cofactor(i, static_cast<Index>(j)) = column[static_cast<std::size_t>(i)];
  }
  return positioning::dop_from_cofactor(cofactor);
}

}  // namespace canyon::heatmap
