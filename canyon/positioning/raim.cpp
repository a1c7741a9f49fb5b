#include "canyon/positioning/raim.hpp"

namespace canyon::positioning {
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
