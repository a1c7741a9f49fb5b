#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "canyon/sky/gnss/signals.hpp"

namespace canyon::tracking {

using gnss::Modulation;
using gnss::name;

/// Equal parts of a chip in which the subcarrier is constant: 1, 2 or 12.
[[nodiscard]] int slots_per_chip(Modulation modulation);
/// Chips after which the pattern of subcarriers repeats: 33 of TMBOC(6,1,4/33) (IS-GPS-800, 3.3), else 1.
[[nodiscard]] int chips_per_pattern(Modulation modulation);
/// Value of the subcarrier, of mean power 1, at a point within a chip.
/// @param fraction of the chip, [0, 1)
/// @param chip index in the code; of TMBOC chips 0, 4, 6 and 29 of 33 are BOC(6,1) (IS-GPS-800, 3.3)
[[nodiscard]] double subcarrier(Modulation modulation, double fraction, std::size_t chip);

struct CorrelationOptions {
  Modulation modulation = Modulation::BPSK;
  /// Chips per second, [1e5, 1e8]: 1.023e6 for C/A and E1, 2.046e6 for B1I, 0.511e6 for GLONASS L1OF, 10.23e6
  /// for L5 and P(Y).
  double chip_rate_hz = 1.023e6;
  /// Two-sided bandwidth of the front end [Hz], an ideal filter without phase; [0.5, 1000] chip rates, or
  /// infinite (the default).
  double bandwidth_hz = std::numeric_limits<double>::infinity();
  [[nodiscard]] bool operator==(const CorrelationOptions&) const = default;
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};

/// Correlation of a received signal with its unfiltered replica, for ideal codes (no sidelobes), as a
/// function of the delay between them. Even in the delay, unit power at the antenna: R(0) = 1 with infinite
/// bandwidth, else the fraction of the power that passes the front end.
///
/// Infinite bandwidth: R(tau) = Tc^-1 times the integral of p(t) p(t + tau) over the chip pulse p, which is
/// piecewise linear; e.g. 1 - |tau| for BPSK, and 1 - 3 |tau| to half a chip, then |tau| - 1, for BOC(1,1)
/// (Kaplan & Hegarty, Understanding GPS, 2nd ed. 2006, section 4.2.3). Exact to rounding.
///
/// Bandwidth B: the integral of S(f) cos(2 pi f tau) over |f| <= B/2, S the power spectral density. With w_k
/// the jumps of dR/dtau at the knots t_k it is, in closed form, the sum of w_k g(tau - t_k) with
///   g(x) = x Si(pi B x) / pi + cos(pi B x) / (pi^2 B),
/// whose second derivative is sin(pi B x) / (pi x), the response of the ideal filter. Tabulated to 4 chips,
/// with cubic Hermite steps of 1 / (32 B): error below 1e-7 (slope: 2e-5 per chip, 4e-5 of BOC(6,1));
/// evaluated directly beyond. Copyable, const, thread-safe.
class Correlation {
 public:
  /// Throws InputError if options.validate() does.
  explicit Correlation(const CorrelationOptions& options = {});

  [[nodiscard]] const CorrelationOptions& options() const { return options_; }
  /// R at a delay in chips, any finite value.
  [[nodiscard]] double value(double delay_chips) const {
    const double position = std::abs(delay_chips) * steps_per_chip_;
    // Without a table table_steps_ is 0.
    if (!(position < table_steps_)) return beyond_table(delay_chips);
    const auto i = static_cast<std::size_t>(position);
    const double t = position - static_cast<double>(i);
    const double* p = table_.data() + 2 * i;
    const double rise = p[2] - p[0];
    return p[0] + t * (p[1] + t * ((3 * rise - 2 * p[1] - p[3]) + t * (p[1] + p[3] - 2 * rise)));
  }
  /// dR/dtau [1/chip]; at a knot of the infinite-bandwidth form the mean of both sides (0 at the peak).
  [[nodiscard]] double slope(double delay_chips) const;
  /// Power spectral density before the front end at a frequency [chips^-1] off the carrier, any finite value;
  /// its integral over all of them is 1. The transform of the piecewise linear R: with knots h apart, h
  /// sinc^2(pi f h) times the sum of R(k h) cos(2 pi f k h) over all k; sinc^2(pi f) for BPSK.
  [[nodiscard]] double density(double frequency) const;
  /// Metres of light in one chip: 293.05 m for 1.023 Mchip/s.
  [[nodiscard]] double chip_m() const { return chip_m_; }
  /// Chips between knots of the infinite-bandwidth form: 1 / slots_per_chip().
  [[nodiscard]] double knot_spacing_chips() const { return knot_spacing_; }

 private:
  [[nodiscard]] double beyond_table(double delay_chips) const;
  [[nodiscard]] double filtered(double delay_chips) const;
  [[nodiscard]] double filtered_slope(double delay_chips) const;

  CorrelationOptions options_;
  double chip_m_ = 0;
  double knot_spacing_ = 1;
  double bandwidth_ = 0;             // per chip; 0: infinite
  std::vector<double> knot_values_;  // R at 0, knot_spacing_, ... 1 chip
  std::vector<double> jumps_;        // w_k at -1 ... 1 chip
  double step_ = 0;                  // of the table
  double steps_per_chip_ = 0;        // 1 / step_; 0 without a table
  double table_steps_ = 0;
  std::vector<double> table_;  // value and slope * step_, alternating
};

/// Si(x), the integral of sin(t) / t from 0 to x; error below 1e-14. Series to |x| = 4 (Abramowitz & Stegun
/// 5.2.14), beyond it pi/2 + Im E1(ix) (5.2.23) by the continued fraction of E1 (5.1.22).
[[nodiscard]] double sine_integral(double x);

}  // namespace canyon::tracking
