#include "canyon/tracking/clock.hpp"

#include <fmt/format.h>

#include <cmath>

#include "canyon/base/input_error.hpp"

namespace canyon::tracking {

void ClockOptions::validate() const {
  if (!(std::abs(bias_s) <= 0.1)) {
    throw InputError(fmt::format("bias_s of the receiver clock is {}", bias_s), "it must lie within +-0.1 s");
  }
  if (!(std::abs(drift) <= 1e-4)) {
    throw InputError(fmt::format("drift of the receiver clock is {}", drift),
                     "it must lie within +-1e-4 s/s");
  }
  if (!(drift_walk >= 0 && drift_walk <= 1e-4)) {
    throw InputError(fmt::format("drift_walk of the receiver clock is {}", drift_walk),
                     "it must lie within 0 and 1e-4 s/s/sqrt(s)");
  }
}

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

}  // namespace canyon::tracking
