#pragma once

#include <cstdint>
#include <string_view>

namespace canyon::receiver {

/// A seeded stream of random numbers whose bytes do not depend on the standard library, the machine, or what
/// other streams do. Streams of one seed and different keys are independent.
class RandomStream {
 public:
  RandomStream(std::uint64_t seed, std::string_view key);
  [[nodiscard]] std::uint64_t next();
  /// Uniform in [0, 1), 53 bits.
  [[nodiscard]] double uniform();
  /// Standard normal.
  [[nodiscard]] double normal();

 private:
  std::uint64_t state_[4];
  double spare_ = 0;
  bool has_spare_ = false;
};

/// Ornstein-Uhlenbeck process dx = theta (mu - x) dt + sigma dW (the paper's equation 2), stepped exactly:
/// x' = mu + (x - mu) e^(-theta dt) + sigma sqrt((1 - e^(-2 theta dt)) / (2 theta)) N(0,1).
/// Stationary mean mu, variance sigma^2 / (2 theta), autocorrelation e^(-theta |tau|), whatever the steps.
struct OuOptions {
  double theta_per_s = 0.02;  ///< mean reversion [1/s], > 0
  double mu_m = 0;            ///< mean [m]
  double sigma_m_per_sqrt_s = 0.2;  ///< diffusion [m/sqrt(s)], >= 0; with theta 0.02: 1 m standard deviation
  void validate() const;
};

class OuProcess {
 public:
  OuProcess(const OuOptions& options, RandomStream stream);
  /// Value `dt_s` >= 0 later, pulled towards `mu_m`; the first call draws from the stationary distribution.
  double advance(double dt_s, double mu_m);
  double advance(double dt_s) { return advance(dt_s, options_.mu_m); }

 private:
  OuOptions options_;
  RandomStream stream_;
  double value_ = 0;
  bool started_ = false;
};

}  // namespace canyon::receiver
