#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace canyon {

/// Standard deviation over the median of magnitudes, of a normal distribution.
inline constexpr double kMadToSigma = 1.4826;

/// Value at rank p (n - 1) of the ordered values, counted from 0, linear between neighbours: definition 7 of
/// Hyndman and Fan (The American Statistician 50, 1996), NumPy's and R's default. Empty for no values.
/// @param values none is NaN
/// @param p in [0, 1] (asserted)
[[nodiscard]] std::optional<double> quantile(std::span<const double> values, double p);
/// The same at several `p`, which rise; empty for no values.
[[nodiscard]] std::vector<double> quantiles(std::span<const double> values, std::span<const double> p);
/// The same without a copy, for hot loops: reorders `values`, of which there is at least one.
/// @param ranked values before this index are at their rank already; moves on to that of the quantile, so
/// that the next one, of a larger p, has less to do. 0 at first.
[[nodiscard]] double select_quantile(std::span<double> values, double p, std::size_t& ranked);
/// quantile(values, 0.5).
[[nodiscard]] std::optional<double> median(std::span<const double> values);
/// Middle value, of two middle ones the larger. @param values not empty; reordered
[[nodiscard]] double upper_median(std::span<double> values);

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

/// Fewest values whose 90 % interval does not end at the smallest and the largest one.
inline constexpr std::size_t kFewestOf90 = 19;

/// Value that the next one of a sample is below with probability p: at rank p (n + 1) of the n ordered
/// values, linear between neighbours (definition 6 of Hyndman and Fan, The American Statistician 50, 1996).
/// Beyond 1 / (n + 1) from either end it is the smallest or the largest value: 90 % intervals need
/// kFewestOf90.
/// @param values one or more (asserted), none is NaN; @param p in [0, 1]
[[nodiscard]] double predictive_quantile(std::span<const double> values, double p);

/// What 90 % intervals of fewer than kFewestOf90 values are: they hold the next one with (n - 1) / (n + 1).
/// Empty from kFewestOf90 on. @param count 1 or more; @param noun of the values, such as "draws"
[[nodiscard]] std::optional<std::string> caution_of_few(std::size_t count, std::string_view noun);

/// Quantiles of values that come one by one, in bounded memory: of the first `exact` as quantile() has them,
/// of more within 0.1 %, or 1e-6.
class Distribution {
 public:
  static constexpr std::size_t kExact = 100'000;
  Distribution() = default;
  explicit Distribution(std::size_t exact) : exact_(exact) {}

  /// @param value >= 0
  void add(double value);
  [[nodiscard]] std::uint64_t count() const { return count_; }
  /// Empty for no values.
  [[nodiscard]] std::optional<double> quantile(double p) const;
  /// 0 for no values.
  [[nodiscard]] double greatest() const { return greatest_; }

 private:
  std::size_t exact_ = kExact;
  std::vector<double> values_;           ///< all, as long as they are few
  std::map<int, std::uint64_t> counts_;  ///< else of each step of 0.1 %
  std::uint64_t count_ = 0;
  double least_ = 0, greatest_ = 0;
};

}  // namespace canyon
