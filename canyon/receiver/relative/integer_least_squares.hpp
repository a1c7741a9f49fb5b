#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace canyon::relative {

/// Q = L^T D L with L unit lower triangular and D > 0.
struct Triangular {
  Eigen::MatrixXd l;
  Eigen::VectorXd d;
};
/// Factors of the last variables of a covariance, as many as are positive definite.
/// @param covariance [n, n], symmetric
[[nodiscard]] Triangular triangular(const Eigen::MatrixXd& covariance);

/// B Q^-1. Relative error below 1e-15 times n times the condition number of Q.
/// @param b [m, n]
[[nodiscard]] Eigen::MatrixXd times_inverse(Eigen::MatrixXd b, const Triangular& q);

/// to += factor from, of n numbers each.
void add_multiple(double factor, const double* from, std::ptrdiff_t n, double* to);

/// The whole numbers nearest to real ones in the metric of their covariance.
struct IntegerSolution {
  Eigen::VectorXd best, second;
  /// (a - best)^T Q^-1 (a - best), and of the second best, which is no less.
  double best_distance = 0, second_distance = 0;
  double success = 0;  ///< bootstrapped_success()
  /// second over best, 1 or more; infinite where the real numbers are whole ones.
  [[nodiscard]] double ratio() const;
};

/// A change of variables a = origin + A z, |det A| = 1 and whole numbers, under which Q is nearly diagonal
/// and the last z are the best known; as far as products of L's elements can do it (Teunissen, The
/// least-squares ambiguity decorrelation adjustment, Journal of Geodesy 70, 1995; greedy order of
/// permutations: Chang, Yang and Zhou, MLAMBDA, Journal of Geodesy 79, 2005).
struct Decorrelation {
  Triangular factors;      ///< of the covariance of z
  Eigen::VectorXd origin;  ///< whole numbers
  Eigen::VectorXd z;       ///< of the real numbers
  Eigen::MatrixXd a_from_z;
};
/// Decorrelates nested sets, the last `sizes[k]` variables each: sizes rise from 1 to n; a set costs what
/// it adds to the one before.
/// @param real [n], n >= 1 @param covariance [n, n], symmetric
/// Those are empty whose covariance is not positive definite; all are where values are not finite or beyond
/// 1e12.
[[nodiscard]] std::vector<std::optional<Decorrelation>> decorrelate(const Eigen::VectorXd& real,
                                                                    const Eigen::MatrixXd& covariance,
                                                                    std::span<const Eigen::Index> sizes);

/// Probability that rounding one after the other, from the best known on, finds the right numbers:
/// prod (2 Phi(1 / (2 sigma_i)) - 1) of the conditional deviations. A lower bound of integer least squares'
/// own, sharp behind decorrelate() (Teunissen, Journal of Geodesy 73, 1999).
[[nodiscard]] double bootstrapped_success(const Triangular& factors);

/// Bounds between which the ratio of the second best distance to the best counts.
struct RatioLimits {
  /// 1 or more. A ratio below need not be right, nor the two vectors the nearest: the true ratio is below
  /// too.
  double lowest = 1;
  /// Above `lowest`. A second vector beyond is not searched for: second_distance then is that bound, and
  /// `second` one of the vectors beyond.
  double highest = 10;
};
/// The two nearest whole vectors by depth-first search in shrinking ellipsoids. Empty where the search takes
/// more than `max_nodes` steps: the numbers are then too uncertain to be found.
[[nodiscard]] std::optional<IntegerSolution> integer_least_squares(const Decorrelation& by,
                                                                   RatioLimits ratios = {},
                                                                   int max_nodes = 20'000);
/// The same without decorrelation. Empty also unless the numbers are known so well that this search is short;
/// those of an open sky are.
/// @param real [n], n >= 1 @param covariance [n, n], symmetric
[[nodiscard]] std::optional<IntegerSolution> short_search(const Eigen::VectorXd& real,
                                                          const Eigen::MatrixXd& covariance,
                                                          RatioLimits ratios = {});
/// Answer of short_search(), else of the search behind decorrelate(); empty also where that is.
[[nodiscard]] std::optional<IntegerSolution> integer_least_squares(const Eigen::VectorXd& real,
                                                                   const Eigen::MatrixXd& covariance,
                                                                   RatioLimits ratios = {},
                                                                   int max_nodes = 20'000);

}  // namespace canyon::relative
