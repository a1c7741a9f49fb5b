#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace canyon::rtk {

/// Q = L^T D L with L unit lower triangular and D > 0.
struct Triangular {
  Eigen::MatrixXd l;
  Eigen::VectorXd d;
};
/// Factors of the last variables of a covariance, the largest positive definite block.
/// @param covariance [n, n], symmetric
[[nodiscard]] Triangular triangular(const Eigen::MatrixXd& covariance);

/// B Q^-1. Relative error below 1e-15 times n times the condition number of Q.
/// @param b [m, n]
[[nodiscard]] Eigen::MatrixXd times_inverse(Eigen::MatrixXd b, const Triangular& q);

/// to += factor from, of n numbers each.
void add_multiple(double factor, const double* from, std::ptrdiff_t n, double* to);

/// Integer vector nearest to real values in the metric of their covariance.
struct IntegerSolution {
  Eigen::VectorXd best, second;
  /// (a - best)^T Q^-1 (a - best), and of the second best, which is no less.
  double best_distance = 0, second_distance = 0;
  double success = 0;  ///< bootstrapped_success()
  /// second over best, 1 or more; infinite if the real values are integers.
  [[nodiscard]] double ratio() const;
};

/// A change of variables a = origin + A z, |det A| = 1 and integer, under which Q is nearly diagonal and the
/// last z have the smallest variances, as far as products of L's elements allow (Teunissen, The least-squares
/// ambiguity decorrelation adjustment, Journal of Geodesy 70, 1995; greedy order of permutations: Chang, Yang
/// and Zhou, MLAMBDA, Journal of Geodesy 79, 2005).
struct Decorrelation {
  Triangular factors;      ///< of the covariance of z
  Eigen::VectorXd origin;  ///< integers
  Eigen::VectorXd z;       ///< of the real values
  Eigen::MatrixXd a_from_z;
};
/// Decorrelates nested sets, the last `sizes[k]` variables each. Sizes rise from 1 to n; the cost of a set is
/// that of its additional variables.
/// @param real [n], n >= 1 @param covariance [n, n], symmetric
/// Sets whose covariance is not positive definite are empty; all are if values are not finite or beyond 1e12.
[[nodiscard]] std::vector<std::optional<Decorrelation>> decorrelate(const Eigen::VectorXd& real,
                                                                    const Eigen::MatrixXd& covariance,
                                                                    std::span<const Eigen::Index> sizes);

/// Probability that sequential rounding, starting with the smallest variance, finds the right integers: prod
/// (2 Phi(1 / (2 sigma_i)) - 1) of the conditional deviations. A lower bound for integer least squares, sharp
/// after decorrelate() (Teunissen, Journal of Geodesy 73, 1999).
[[nodiscard]] double bootstrapped_success(const Triangular& factors);

/// Range in which the ratio of the second best distance to the best is exact.
struct RatioLimits {
  /// 1 or more. A lower ratio need not be exact, nor the two vectors nearest: the true ratio is lower too.
  double lowest = 1;
  /// Above `lowest`. A second vector beyond it is not searched: second_distance is then that bound, and
  /// `second` one of the vectors beyond.
  double highest = 10;
};
/// The two nearest integer vectors by depth-first search in shrinking ellipsoids. Empty if the search takes
/// more than `max_nodes` steps: the real values are then too uncertain.
[[nodiscard]] std::optional<IntegerSolution> integer_least_squares(const Decorrelation& by,
                                                                   RatioLimits ratios = {},
                                                                   int max_nodes = 20'000);
/// The same without decorrelation. Empty also unless the variances are so small that this search is short, as
/// under an open sky.
/// @param real [n], n >= 1 @param covariance [n, n], symmetric
[[nodiscard]] std::optional<IntegerSolution> short_search(const Eigen::VectorXd& real,
                                                          const Eigen::MatrixXd& covariance,
                                                          RatioLimits ratios = {});
/// Result of short_search(), else of the search after decorrelate(); empty also if that is.
[[nodiscard]] std::optional<IntegerSolution> integer_least_squares(const Eigen::VectorXd& real,
                                                                   const Eigen::MatrixXd& covariance,
                                                                   RatioLimits ratios = {},
                                                                   int max_nodes = 20'000);

}  // namespace canyon::rtk
