#include "canyon/tracking/noise.hpp"

#include <fmt/format.h>

#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/options/values.hpp"

namespace canyon::tracking {
double OuOptions::standard_deviation_m() const {
  return sigma_m_per_sqrt_s / std::sqrt(2 * theta_per_s);
}

OuProcess::OuProcess(const OuOptions& options, RandomStream stream) : options_(options), stream_(stream) {
  options_.validate();
}

double OuProcess::advance(double dt_s, double mu_m) {
  if (!(dt_s >= 0) || !std::isfinite(dt_s)) {
    throw InputError(fmt::format("a noise process cannot step by {} s", dt_s),
                     "give epochs in order of time");
  }
  if (!started_) {
    started_ = true;
    value_ = mu_m + options_.standard_deviation_m() * stream_.normal();
    return value_;
  }
  if (dt_s == 0) return value_;
  // expm1 keeps short steps exact: 1 - e^-x loses all digits of x below 1e-16.
  const double decay = std::exp(-options_.theta_per_s * dt_s);
  const double kept = std::sqrt(-std::expm1(-2 * options_.theta_per_s * dt_s));
  value_ = mu_m + (value_ - mu_m) * decay + options_.standard_deviation_m() * kept * stream_.normal();
  return value_;
}

void OuOptions::validate() const {
  options::check(*this, "OU noise");
}

void visit(options::Visitor& v, OuOptions& o) {
  v.number({"theta_per_s", "1/s", "mean reversion of each satellite's Ornstein-Uhlenbeck process"},
           o.theta_per_s, {0, 1e6, true});
  v.number({"mu_m", "m", "mean of that process"}, o.mu_m, {-1e6, 1e6});
  v.number({"sigma_m_per_sqrt_s", "m/sqrt(s)",
            "diffusion of that process; its standard deviation is sigma / sqrt(2 theta)"},
           o.sigma_m_per_sqrt_s, {0, 1e6});
}

}  // namespace canyon::tracking
