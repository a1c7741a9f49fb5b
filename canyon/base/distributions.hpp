#pragma once

namespace canyon {

// Distributions of probability, by Boost.Math, accurate to a few units of the last digit.

/// P(x <= `x`) of the standard normal distribution.
[[nodiscard]] double normal_probability(double x);
/// Value that the standard normal distribution is below with probability `p`, in (0, 1).
[[nodiscard]] double normal_quantile(double p);
/// Value that the gamma distribution of `shape` > 0 and scale 1 is below with probability `p`, in [0, 1).
[[nodiscard]] double gamma_quantile(double shape, double p);
/// Value that it exceeds with `probability`, in (0, 1].
[[nodiscard]] double gamma_quantile_above(double shape, double probability);
/// Value that a chi-square variable of `degrees` degrees of freedom, 1 to 300, exceeds with `probability`, in
/// (0, 0.5].
[[nodiscard]] double chi_square_quantile(double probability, int degrees);

}  // namespace canyon
