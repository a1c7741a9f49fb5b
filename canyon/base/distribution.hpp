#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

namespace canyon {

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
