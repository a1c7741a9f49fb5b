#include "canyon/tracking/noise.hpp"

#include <fmt/format.h>

#include <cmath>

#include "canyon/base/input_error.hpp"

namespace canyon::tracking {
double OuOptions::standard_deviation_m() const {
  return sigma_m_per_sqrt_s / std::sqrt(2 * theta_per_s);
}

void OuOptions::validate() const {
  if (!(theta_per_s > 0) || !std::isfinite(theta_per_s)) {
    throw InputError(fmt::format("theta_per_s of the OU noise is {}", theta_per_s),
                     "it must be above 0 per second");
  }
  if (!std::isfinite(mu_m)) {
    throw InputError(fmt::format("mu_m of the OU noise is {}", mu_m), "it must be a finite number of metres");
  }
  if (!(sigma_m_per_sqrt_s >= 0) || !std::isfinite(sigma_m_per_sqrt_s)) {
    throw InputError(fmt::format("sigma_m_per_sqrt_s of the OU noise is {}", sigma_m_per_sqrt_s),
                     "it must be 0 or more m/sqrt(s)");
  }
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

}  // namespace canyon::tracking
