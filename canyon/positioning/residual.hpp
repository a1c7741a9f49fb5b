#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <optional>
#include <vector>

#include "canyon/positioning/dop.hpp"
#include "canyon/positioning/fix.hpp"

namespace canyon::positioning {

/// The residual of a satellite in a fix, measured minus computed [m]; empty where the satellite is not used.
[[nodiscard]] std::optional<double> residual_m(const Fix& fix, gnss::SatelliteId id);

/// Row whose residual is largest beside its own standard deviation: |w_i| = |r_i| / (sigma_i sqrt(q_ii)),
/// with Q = I - A (A^T A)^-1 A^T (Baarda's w-test; Kuusniemi 2005). Rows that nothing checks (q_ii below
/// 1e-6: a lone satellite of its clock) are passed over; empty where all are such. Ties go to the first.
/// @param design whitened: each row divided by its sigma; full column rank
/// @param residual whitened residuals of the least-squares solution, one per row
[[nodiscard]] std::optional<Eigen::Index> largest_normalised_residual(const Design& design,
                                                                      const Eigen::VectorXd& residual);

/// Variance of errors over that of their weights, 1 or more [1], by `squares`, the sum of the squared
/// whitened residuals of least squares: s^2 n / (n - 2), with s^2 = squares / n, n the degrees of freedom. An
/// error over its deviation by the residuals has Student's distribution, of that variance; up to two degrees,
/// where that has none, 5 s^2. Without redundancy (n < 1) nothing is known: 1.
[[nodiscard]] inline double excess_variance(double squares, std::ptrdiff_t redundancy) {
  if (redundancy < 1) return 1;
  const auto n = static_cast<double>(redundancy);
  return std::max(1.0, squares / n * (n > 2 ? n / (n - 2) : 5));
}

/// Middle value, of two middle ones the larger. @param values not empty
[[nodiscard]] inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace canyon::positioning
