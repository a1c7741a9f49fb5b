#include "canyon/base/distribution.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "canyon/base/statistics.hpp"

namespace canyon {

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
