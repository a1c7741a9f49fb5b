#include "canyon/positioning/residual.hpp"

#include <algorithm>

namespace canyon::positioning {

std::optional<double> residual_m(const Fix& fix, gnss::SatelliteId id) {
  const auto at = std::lower_bound(fix.used.begin(), fix.used.end(), id);
  const auto index = static_cast<std::size_t>(at - fix.used.begin());
  if (!fix.solved() || at == fix.used.end() || *at != id || index >= fix.residuals_m.size()) return {};
  return fix.residuals_m[index];
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

}  // namespace canyon::positioning
