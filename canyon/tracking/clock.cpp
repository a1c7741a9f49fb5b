#include "canyon/tracking/clock.hpp"

#include <fmt/format.h>

#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/options/values.hpp"

namespace canyon::tracking {

ReceiverClock::ReceiverClock(const ClockOptions& options, RandomStream stream)
    : walk_(options.drift_walk), stream_(stream), bias_s_(options.bias_s), drift_(options.drift) {
  options.validate();
}

void ReceiverClock::advance(double dt_s) {
  if (!(dt_s >= 0) || !std::isfinite(dt_s)) {
    throw InputError(fmt::format("a receiver clock cannot step by {} s", dt_s),
                     "give epochs in order of time");
  }
  bias_s_ += drift_ * dt_s;
  if (walk_ == 0 || dt_s == 0) return;
  // Bias given the drift's gain g: mean g dt / 2, variance q dt^3 / 12; together q dt^3 / 3 and q dt^2 / 2.
  const double gain = walk_ * std::sqrt(dt_s) * stream_.normal();
  bias_s_ += gain * dt_s / 2 + walk_ * dt_s * std::sqrt(dt_s / 12) * stream_.normal();
  drift_ += gain;
}

void ClockOptions::validate() const {
  options::check(*this, "receiver clock");
}

void visit(options::Visitor& v, ClockOptions& o) {
  v.number({"bias_s", "s", "receiver clock minus GPST at the first epoch"}, o.bias_s, {-0.1, 0.1});
  v.number({"drift", "s/s", "clock drift at the first epoch"}, o.drift, {-1e-4, 1e-4});
  v.number({"drift_walk", "s/s/sqrt(s)", "random walk of the drift"}, o.drift_walk, {0, 1e-4});
}

}  // namespace canyon::tracking
