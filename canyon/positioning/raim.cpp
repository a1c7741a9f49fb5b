#include "canyon/positioning/raim.hpp"

#include <fmt/format.h>

#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/positioning/fix.hpp"

namespace canyon::positioning {
namespace {

/// Below this part of a residual the solution takes up whatever error there is.
constexpr double kUnchecked = 1e-6;

}  // namespace

double chi_square_quantile(double probability, int degrees) {
  return quantile(complement(boost::math::chi_squared(degrees), probability));
}

std::optional<Eigen::Index> largest_normalised_residual(const Design& design,
                                                        const Eigen::VectorXd& residual) {
  const std::optional<Cofactor> covariance = cofactor(design, 1e-13);
  if (!covariance) return std::nullopt;
  std::optional<Eigen::Index> worst;
  double largest = 0;
  for (Eigen::Index i = 0; i < design.rows(); ++i) {
    const double q = 1 - design.row(i) * *covariance * design.row(i).transpose();
    if (q < kUnchecked) continue;
    const double squared = residual(i) * residual(i) / q;
    if (worst && !(squared > largest)) continue;
    worst = i;
    largest = squared;
  }
  return worst;
}

}  // namespace canyon::positioning
