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

/// Standard deviation of a normal distribution over its median absolute deviation.
inline constexpr double kMadToSigma = 1.4826;

/// Value at rank p (n - 1) of the ordered values, counted from 0, linear between neighbours: definition 7 of
/// Hyndman and Fan (The American Statistician 50, 1996), NumPy's and R's default. Empty for no values.
/// @param values none is NaN
/// @param p in [0, 1] (asserted)
[[nodiscard]] std::optional<double> quantile(std::span<const double> values, double p);
/// The same at several `p`, which rise; empty for no values.
[[nodiscard]] std::vector<double> quantiles(std::span<const double> values, std::span<const double> p);
/// The same without a copy, for hot loops: reorders `values`, at least one.
/// @param ranked values before this index are at their rank already, 0 at first; it advances to the rank of
/// the quantile, which speeds up the next call with a larger p.
[[nodiscard]] double select_quantile(std::span<double> values, double p, std::size_t& ranked);
/// quantile(values, 0.5).
[[nodiscard]] std::optional<double> median(std::span<const double> values);
/// Middle value, of two middle ones the larger. @param values not empty; reordered
[[nodiscard]] double upper_median(std::span<double> values);

// Probability distributions, by Boost.Math, accurate to a few units in the last place.

/// P(x <= `x`) of the standard normal distribution.
[[nodiscard]] double normal_probability(double x);
/// Quantile of the standard normal distribution at probability `p`, in (0, 1).
[[nodiscard]] double normal_quantile(double p);
/// Quantile of the gamma distribution of `shape` > 0 and scale 1 at probability `p`, in [0, 1).
[[nodiscard]] double gamma_quantile(double shape, double p);
/// Value that this gamma variable exceeds with `probability`, in (0, 1].
[[nodiscard]] double gamma_quantile_above(double shape, double probability);
/// Value that a chi-square variable of 1 to 300 `degrees` of freedom exceeds with `probability`, in (0, 0.5].
[[nodiscard]] double chi_square_quantile(double probability, int degrees);

/// Smallest sample size whose 90 % interval does not end at the smallest and largest values.
inline constexpr std::size_t kMinCountFor90 = 19;

/// Value that the next sample is below with probability p: at rank p (n + 1) of the n ordered values, linear
/// between neighbours (definition 6 of Hyndman and Fan, The American Statistician 50, 1996). For p within 1 /
/// (n + 1) of either end it is the smallest or largest value: 90 % intervals need kMinCountFor90.
/// @param values one or more (asserted), none is NaN; @param p in [0, 1]
[[nodiscard]] double predictive_quantile(std::span<const double> values, double p);

/// Caution about 90 % intervals of fewer than kMinCountFor90 values: they contain the next value with
/// probability (n - 1) / (n + 1). Empty from kMinCountFor90 on. @param count 1 or more; @param noun of the
/// values, such as "draws"
[[nodiscard]] std::optional<std::string> caution_of_few(std::size_t count, std::string_view noun);

/// Quantiles of a stream of values in bounded memory: for the first `exact` values equal to quantile(), for
/// more within 0.1 %, or 1e-6.
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
  std::vector<double> values_;           ///< all, while they are few
  std::map<int, std::uint64_t> counts_;  ///< else the count in each step of 0.1 %
  std::uint64_t count_ = 0;
  double least_ = 0, greatest_ = 0;
};

}  // namespace canyon
