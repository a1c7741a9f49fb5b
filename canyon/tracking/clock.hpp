#pragma once

#include "canyon/options/fwd.hpp"
#include "canyon/tracking/noise.hpp"

namespace canyon::tracking {

/// Receiver clock: bias' = drift, drift a random walk. The clock shows true time + bias.
struct ClockOptions {
  double bias_s = 0;      ///< at the first epoch; |bias| <= 0.1 s
  double drift = 0;       ///< at the first epoch [s/s]; |drift| <= 1e-4
  double drift_walk = 0;  ///< [s/s/sqrt(s)], 0 to 1e-4
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
void visit(options::Visitor& v, ClockOptions& o);

/// The two states of the clock, stepped exactly: over dt the drift gains N(0, q dt), the bias drift dt plus
/// N(0, q dt^3 / 3), their covariance q dt^2 / 2, with q = drift_walk^2 (the two-state clock model, e.g.
/// Brown & Hwang, Introduction to Random Signals, 4th ed., 9.3). The statistics do not depend on the steps.
class ReceiverClock {
 public:
  /// Throws InputError where options.validate() does.
  ReceiverClock(const ClockOptions& options, RandomStream stream);
  /// Goes `dt_s` >= 0 on. Throws InputError for a negative or non-finite step.
  void advance(double dt_s);

  [[nodiscard]] double bias_s() const { return bias_s_; }
  [[nodiscard]] double drift() const { return drift_; }

 private:
  double walk_ = 0;
  RandomStream stream_;
  double bias_s_ = 0;
  double drift_ = 0;
};

}  // namespace canyon::tracking
