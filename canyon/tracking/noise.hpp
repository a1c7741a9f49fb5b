#pragma once

#include "canyon/base/random.hpp"
#include "canyon/options/fwd.hpp"

namespace canyon::tracking {

/// Ornstein-Uhlenbeck process dx = theta (mu - x) dt + sigma dW (the paper's equation 2, whose print lacks
/// the dt), stepped exactly: x' = mu + (x - mu) e^(-theta dt) + sigma sqrt((1 - e^(-2 theta dt)) / (2 theta))
/// N(0,1). Stationary mean mu, variance sigma^2 / (2 theta), autocorrelation e^(-theta |tau|), whatever the
/// steps.
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
  /// Throws InputError where options.validate() does.
  OuProcess(const OuOptions& options, RandomStream stream);
  /// Value `dt_s` >= 0 later, pulled towards `mu_m`; the first call draws from the stationary distribution.
  /// 0 gives the same value again. Throws InputError for a negative or non-finite step.
  double advance(double dt_s, double mu_m);
  double advance(double dt_s) { return advance(dt_s, options_.mu_m); }

 private:
  OuOptions options_;
  RandomStream stream_;
  double value_ = 0;
  bool started_ = false;
};

}  // namespace canyon::tracking
