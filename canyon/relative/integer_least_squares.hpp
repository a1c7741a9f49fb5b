#pragma once

#include <Eigen/Core>
#include <optional>

namespace canyon::relative {

/// The whole numbers nearest to real ones in the metric of their covariance.
struct IntegerSolution {
  Eigen::VectorXd best, second;
  /// (a - best)^T Q^-1 (a - best), and of the second best, which is no less.
  double best_distance = 0, second_distance = 0;
  double success = 0;  ///< bootstrapped_success()
  /// second over best, 1 or more; infinite where the real numbers are whole ones.
  [[nodiscard]] double ratio() const;
};

/// Q = L^T D L with L unit lower triangular and D > 0; empty where Q is not positive definite.
struct Triangular {
  Eigen::MatrixXd l;
  Eigen::VectorXd d;
};
[[nodiscard]] std::optional<Triangular> triangular(const Eigen::MatrixXd& covariance);

/// A change of variables z = Z^T a, |det Z| = 1 and whole numbers, under which Q is nearly diagonal and the
/// last z are the best known; as far as products of L's elements can do it (Teunissen, The least-squares
/// ambiguity decorrelation adjustment, Journal of Geodesy 70, 1995; greedy order of permutations: Chang, Yang
/// and Zhou, MLAMBDA, Journal of Geodesy 79, 2005).
struct Decorrelation {
  Triangular factors;        ///< of Z^T Q Z
  Eigen::MatrixXd z_from_a;  ///< Z^T
};
[[nodiscard]] std::optional<Decorrelation> decorrelate(const Eigen::MatrixXd& covariance);

/// Probability that rounding one after the other, from the best known on, finds the right numbers:
/// prod (2 Phi(1 / (2 sigma_i)) - 1) of the conditional deviations. A lower bound of integer least squares'
/// own, sharp behind decorrelate() (Teunissen, Journal of Geodesy 73, 1999).
[[nodiscard]] double bootstrapped_success(const Triangular& factors);

/// The two nearest whole vectors by depth-first search in shrinking ellipsoids behind decorrelate().
/// @param real [n], n >= 1 @param covariance [n, n], symmetric
/// @param ratio_limit above 1: a second vector beyond so many times the best distance is not searched for;
/// second_distance then is that bound, and `second` one of the vectors beyond
/// Empty where the covariance is not positive definite, values are not finite or beyond 1e12, or the search
/// takes more than `max_nodes` steps: the numbers are then too uncertain to be found.
[[nodiscard]] std::optional<IntegerSolution> integer_least_squares(const Eigen::VectorXd& real,
                                                                   const Eigen::MatrixXd& covariance,
                                                                   double ratio_limit = 10,
                                                                   int max_nodes = 20'000);

}  // namespace canyon::relative
