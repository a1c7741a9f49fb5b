#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace canyon::receiver {

/// A seeded stream of random numbers whose bytes do not depend on the standard library, the machine, or what
/// other streams do. Streams of one seed and different keys are independent.
///
/// xoshiro256++ (Blackman & Vigna 2019), its state drawn by SplitMix64 from the seed and the key's FNV-1a
/// hash.
class RandomStream {
 public:
  RandomStream(std::uint64_t seed, std::string_view key);
  /// A stream that continues from a generator state, which must not be all zeros.
  [[nodiscard]] static RandomStream from_state(const std::array<std::uint64_t, 4>& state);

  [[nodiscard]] std::uint64_t next();
  /// Uniform in [0, 1), 53 bits.
  [[nodiscard]] double uniform();
  /// Standard normal, by the ratio of uniforms (Kinderman & Monahan 1977): exact in distribution, and the
  /// value comes from one product and one quotient, so that no library's log() or cos() shows in its last
  /// bits.
  [[nodiscard]] double normal();

 private:
  RandomStream() = default;

  std::array<std::uint64_t, 4> state_{};
};

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

}  // namespace canyon::receiver
