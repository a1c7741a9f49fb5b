#include "canyon/positioning/code_smoothing.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "canyon/options/values.hpp"

namespace canyon::positioning {

void SmoothingOptions::validate() const {
  options::check(*this, "smoothing");
}

void visit(options::Visitor& v, SmoothingOptions& o) {
  static constexpr std::string_view kSmoothings[]{"none", "hatch", "divergence_free"};
  v.choice({"method", "",
            "carrier smoothing of the fix's pseudoranges: none, hatch, or divergence_free (by two carriers)"},
           o.smoothing, kSmoothings);
  v.number({"window_s", "s", "time constant"}, o.window_s, {1, 3600});
}

CodeSmoother::Smoothed CodeSmoother::next(geodesy::GpsTime time, double pseudorange_m,
                                          std::optional<double> carrier_step_m,
                                          const std::array<CodeNoise, 2>& noise,
                                          const SmoothingOptions& options) {
  const double dt = last_ ? time - *last_ : 0;
  if (!last_ || !carrier_step_m) {
    count_ = 0;
    smoothed_m_ = pseudorange_m;
  }
  ++count_;
  const double a = std::min(1.0, std::max(dt / options.window_s, 1.0 / count_));
  if (count_ > 1) smoothed_m_ = a * pseudorange_m + (1 - a) * (smoothed_m_ + *carrier_step_m);
  last_ = time;

  Smoothed result{smoothed_m_, 0};
  for (std::size_t i = 0; i < noise.size(); ++i) {
    if (count_ == 1) {
      variance_[i] = covariance_[i] = 1;
    } else {
      // cov(S_k-1, P_k) is cov(S_k-1, P_k-1) e^(-dt rate).
      const double before = dt > 0 ? covariance_[i] * std::exp(-dt * noise[i].rate_per_s) : covariance_[i];
      variance_[i] = a * a + (1 - a) * (1 - a) * variance_[i] + 2 * a * (1 - a) * before;
      covariance_[i] = a + (1 - a) * before;
    }
    result.sigma_m += noise[i].sigma_m * noise[i].sigma_m * variance_[i];
  }
  result.sigma_m = std::sqrt(result.sigma_m);
  return result;
}

}  // namespace canyon::positioning
