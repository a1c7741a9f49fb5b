#include "canyon/base/predictive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>

#include "canyon/base/statistics.hpp"

namespace canyon {

double predictive_quantile(std::span<const double> values, double p) {
  assert(!values.empty());
  const auto n = static_cast<double>(values.size());
  const double rank = p * (n + 1) - 1, last = std::max(n - 1, 1.0);
  return *quantile(values, std::clamp(rank / last, 0.0, 1.0));
}

std::optional<std::string> caution_of_few(std::size_t count, std::string_view noun) {
  assert(count > 0);
  if (count >= kFewestOf90) return std::nullopt;
  const auto n = static_cast<double>(count);
  return fmt::format("90 % intervals of {} {} are intervals of {:.0f} %", count, noun,
                     100 * (n - 1) / (n + 1));
}

}  // namespace canyon
