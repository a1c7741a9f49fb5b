#include "canyon/base/statistics.hpp"

#include <fmt/format.h>
#include <boost/math/special_functions/erf.hpp>
#include <boost/math/special_functions/gamma.hpp>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <utility>

namespace canyon {

double select_quantile(std::span<double> values, double p, std::size_t& ranked) {
  assert(!values.empty() && p >= 0 && p <= 1);
  const double rank = p * static_cast<double>(values.size() - 1);
  const auto from = values.begin() + static_cast<std::ptrdiff_t>(ranked);
  ranked = static_cast<std::size_t>(rank);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(ranked);
  std::nth_element(from, at, values.end());
  const double part = rank - std::floor(rank);
  if (part == 0) return *at;
  return *at + part * (*std::min_element(at + 1, values.end()) - *at);
}

std::vector<double> quantiles(std::span<const double> values, std::span<const double> p) {
  assert(std::is_sorted(p.begin(), p.end()));
  std::vector<double> result;
  if (values.empty()) return result;
  std::vector<double> copy(values.begin(), values.end());
  std::size_t ranked = 0;
  for (const double each : p) result.push_back(select_quantile(copy, each, ranked));
  return result;
}

std::optional<double> quantile(std::span<const double> values, double p) {
  const std::vector<double> result = quantiles(values, {&p, 1});
  if (result.empty()) return std::nullopt;
  return result.front();
}

std::optional<double> median(std::span<const double> values) {
  return quantile(values, 0.5);
}

double upper_median(std::span<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double normal_probability(double x) {
  return boost::math::erfc(-x / boost::math::constants::root_two<double>()) / 2;
}

double normal_quantile(double p) {
  return -boost::math::erfc_inv(2 * p) * boost::math::constants::root_two<double>();
}

double gamma_quantile(double shape, double p) {
  return boost::math::gamma_p_inv(shape, p);
}

double gamma_quantile_above(double shape, double probability) {
  return boost::math::gamma_q_inv(shape, probability);
}

double chi_square_quantile(double probability, int degrees) {
  return 2 * gamma_quantile_above(degrees / 2.0, probability);
}

double predictive_quantile(std::span<const double> values, double p) {
  assert(!values.empty());
  const auto n = static_cast<double>(values.size());
  const double rank = p * (n + 1) - 1, last = std::max(n - 1, 1.0);
  return *quantile(values, std::clamp(rank / last, 0.0, 1.0));
}

std::optional<std::string> caution_of_few(std::size_t count, std::string_view noun) {
  assert(count > 0);
  if (count >= kMinCountFor90) return std::nullopt;
  const auto n = static_cast<double>(count);
  return fmt::format("90 % intervals of {} {} are intervals of {:.0f} %", count, noun,
                     100 * (n - 1) / (n + 1));
}

constexpr double kFirstStep = 1e-6, kStepRatio = 1.001;

void Distribution::add(double value) {
  least_ = count_ == 0 ? value : std::min(least_, value);
  greatest_ = std::max(greatest_, value);
  values_.push_back(value);
  if (++count_ <= exact_) return;
  for (const double each : std::exchange(values_, {})) {
    const double steps = std::log(std::max(each, kFirstStep) / kFirstStep) / std::log(kStepRatio);
    ++counts_[static_cast<int>(std::lround(steps))];
  }
}

std::optional<double> Distribution::quantile(double p) const {
  if (count_ <= exact_ || count_ == 0) return canyon::quantile(values_, p);
  if (p == 1) return greatest_;
  const auto rank = static_cast<std::uint64_t>(std::llround(p * static_cast<double>(count_ - 1)));
  std::uint64_t seen = 0;
  auto at = counts_.begin();
  while (seen + at->second <= rank && std::next(at) != counts_.end()) seen += (at++)->second;
  return std::clamp(kFirstStep * std::pow(kStepRatio, at->first), least_, greatest_);
}

}  // namespace canyon
