#include "canyon/positioning/raim.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/positioning/fix.hpp"

namespace canyon::positioning {
namespace {

struct Tail {
  double above = 1;    ///< probability of more than x
  double density = 0;  ///< at x
};

/// x > 0. The last term of either sum is twice the density.
Tail chi_square_tail(double x, int degrees) {
  const double half = x / 2;
  Tail tail;
  double term = 0;
  if (degrees % 2 == 0) {
    term = std::exp(-half);
    tail.above = term;
    for (int k = 1; k < degrees / 2; ++k) {
      term *= half / k;
      tail.above += term;
    }
  } else {
    tail.above = std::erfc(std::sqrt(half));
    // (x/2)^(k - 1/2) e^(-x/2) / Gamma(k + 1/2), for k = 0 the density's term of one degree.
    term = std::exp(-half) / std::sqrt(geodesy::kPi * half);
    for (int k = 1; k <= degrees / 2; ++k) {
      term *= half / (k - 0.5);
      tail.above += term;
    }
  }
  tail.density = term / 2;
  return tail;
}

/// Below this part of a residual the solution takes up whatever error there is.
constexpr double kUnchecked = 1e-6;

}  // namespace

double chi_square_quantile(double probability, int degrees) {
  assert(probability > 0 && probability <= 0.5 && degrees >= 1 && degrees <= 300);
  // log(tail) falls and is convex (one degree), straight (two) or concave (more), so that Newton overshoots
  // once at most and then closes in from one side; the step's bound keeps it above 0 meanwhile.
  const double wanted = std::log(probability);
  double x = degrees;
  for (int i = 0; i < 60; ++i) {
    const Tail tail = chi_square_tail(x, degrees);
    const double step = (std::log(tail.above) - wanted) * tail.above / tail.density;
    const double next = std::max(x + step, x / 16);
    if (std::abs(next - x) <= 1e-13 * x) return next;
    x = next;
  }
  return x;
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

void RaimOptions::validate() const {
  if (!(false_alarm > 0 && false_alarm <= 0.5)) {
    throw InputError(fmt::format("false_alarm of RAIM is {}", false_alarm),
                     "it must lie above 0 and up to 0.5");
  }
  if (max_exclusions < 1 || max_exclusions > 30) {
    throw InputError(fmt::format("max_exclusions of RAIM is {}", max_exclusions),
                     "it must lie within 1 and 30");
  }
  if (!(sigma_scale > 0 && sigma_scale <= 1e6)) {
    throw InputError(fmt::format("sigma_scale of RAIM is {}", sigma_scale),
                     "it must lie above 0 and up to 1e6");
  }
}

}  // namespace canyon::positioning
