#include "canyon/receiver/tracking/noise.hpp"

#include <fmt/format.h>
#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"

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

ReceiverClock::ReceiverClock(const ClockOptions& options, RandomStream stream)
    : options_((options.validate(), options)),
      stream_(stream),
      bias_s_(options.bias_s),
      drift_(options.drift) {}

void ReceiverClock::advance(double dt_s) {
  if (!(dt_s >= 0) || !std::isfinite(dt_s)) {
    throw InputError(fmt::format("a receiver clock cannot step by {} s", dt_s),
                     "give epochs in order of time");
  }
  bias_s_ += drift_ * dt_s;
  if (dt_s == 0) return;
  if (const double walk = options_.drift_walk; walk > 0) {
    // Bias given the drift's gain g: mean g dt / 2, variance q dt^3 / 12; together q dt^3 / 3 and q dt^2 / 2.
    const double gain = walk * std::sqrt(dt_s) * stream_.normal();
    bias_s_ += gain * dt_s / 2 + walk * dt_s * std::sqrt(dt_s / 12) * stream_.normal();
    drift_ += gain;
  }
  if (options_.tag_sigma_s > 0) bias_s_ = options_.bias_s + options_.tag_sigma_s * stream_.normal();
}

void ClockOptions::validate() const {
  options::check(*this, "receiver clock");
}

void visit(options::Visitor& v, ClockOptions& o) {
  v.number({"bias_s", "s", "receiver clock minus GPST at the first epoch"}, o.bias_s, {-0.1, 0.1});
  v.number({"drift", "s/s", "clock drift at the first epoch"}, o.drift, {-1e-4, 1e-4});
  v.number({"drift_walk", "s/s/sqrt(s)", "random walk of the drift"}, o.drift_walk, {0, 1e-4});
  v.number({"time_tag_sigma_s", "s", "standard deviation of time tags that are independent at each epoch"},
           o.tag_sigma_s, {0, 1e-3});
  v.former_name("tag_sigma_s", "time_tag_sigma_s");
}

}  // namespace canyon::tracking
