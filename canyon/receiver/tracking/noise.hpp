#pragma once

#include "canyon/base/options/fwd.hpp"
#include "canyon/base/random.hpp"

namespace canyon::tracking {

/// Ornstein-Uhlenbeck process dx = theta (mu - x) dt + sigma dW (the paper's equation 2, which lacks the dt
/// in print), stepped exactly: x' = mu + (x - mu) e^(-theta dt) + sigma sqrt((1 - e^(-2 theta dt)) / (2
/// theta)) N(0,1). Stationary mean mu, variance sigma^2 / (2 theta), autocorrelation e^(-theta |tau|), for
/// any steps.
struct OuOptions {
  double theta_per_s = 0.02;        ///< mean reversion [1/s], > 0
  double mu_m = 0;                  ///< mean [m]
  double sigma_m_per_sqrt_s = 0.2;  ///< diffusion [m/sqrt(s)], >= 0; with theta 0.02: 1 m standard deviation

  /// sigma / sqrt(2 theta), of the stationary distribution [m].
  [[nodiscard]] double standard_deviation_m() const;
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
void visit(options::Visitor& v, OuOptions& o);

class OuProcess {
 public:
  /// Throws InputError if options.validate() does.
  OuProcess(const OuOptions& options, RandomStream stream);
  /// Value `dt_s` >= 0 later, reverting to `mu_m`; the first call samples the stationary distribution. 0
  /// gives the same value again. Throws InputError for a negative or non-finite step.
  double advance(double dt_s, double mu_m);
  double advance(double dt_s) { return advance(dt_s, options_.mu_m); }

 private:
  OuOptions options_;
  RandomStream stream_;
  double value_ = 0;
  bool started_ = false;
};

/// Receiver clock: bias' = drift, drift a random walk. The clock shows true time + bias.
struct ClockOptions {
  double bias_s = 0;      ///< at the first epoch; |bias| <= 0.1 s
  double drift = 0;       ///< at the first epoch [s/s]; |drift| <= 1e-4
  double drift_walk = 0;  ///< [s/s/sqrt(s)], 0 to 1e-4
  /// Standard deviation of independent time tags of each epoch, around `bias_s` [s], 0 to 1e-3: phones report
  /// pseudoranges by the time of each epoch's own fix, and Dopplers by the oscillator. 0: time tags by the
  /// oscillator.
  double tag_sigma_s = 0;
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
void visit(options::Visitor& v, ClockOptions& o);

/// The two states of the clock, stepped exactly: over dt the drift gains N(0, q dt), the bias drift dt plus
/// N(0, q dt^3 / 3), their covariance q dt^2 / 2, with q = drift_walk^2 (the two-state clock model, e.g.
/// Brown & Hwang, Introduction to Random Signals, 4th ed., 9.3). The statistics do not depend on the steps.
class ReceiverClock {
 public:
  /// Throws InputError if options.validate() does.
  ReceiverClock(const ClockOptions& options, RandomStream stream);
  /// Propagates by `dt_s` >= 0. Throws InputError for a negative or non-finite step.
  void advance(double dt_s);

  [[nodiscard]] double bias_s() const { return bias_s_; }
  [[nodiscard]] double drift() const { return drift_; }

 private:
  ClockOptions options_;
  RandomStream stream_;
  double bias_s_ = 0;
  double drift_ = 0;
};

}  // namespace canyon::tracking
