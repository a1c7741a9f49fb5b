// Multipath error envelopes of every modulation through the code loop, against closed forms.
//
// With infinite bandwidth R falls by s per chip at its peak. While the replica's error e keeps early and late
// on either side of the peak, early minus late of the direct path is 2 s e, and one echo of relative
// amplitude a (negative: antiphase) delayed by t adds a S(e - t), S(x) = R(x - d/2) - R(x + d/2), so that the
// equilibrium of the loop is the only zero of
//   2 s e + a S(e - t)                                                                                   (1)
// since |S'| <= 2 s and |a| < 1. It starts as a t / (1 + a), never exceeds |a| d / 2 as |S| <= s d, ends at 1
// + d/2, and while R around the echo is straight with slope m it is
//   -(a d / 2) (m / s)                                                                                   (2)
// so that the slopes of R's twelfths of a chip appear in the envelope: the plateau a d / 2 of BPSK, and of
// BOC(1,1) a third of it, reversed, beyond half a chip (Braasch, Multipath Effects, in Parkinson & Spilker,
// GPS: Theory and Applications I, 1996; Hein et al., MBOC, Inside GNSS 2006, for the multiplexed ones). Here
// R is computed independently from the power fractions of the interface documents.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <string>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/receiver/tracking/code_tracking.hpp"
#include "canyon/receiver/tracking/signal_options.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::tracking::multipath_envelopes_test {
namespace {

constexpr std::array kModulations{Modulation::BPSK, Modulation::BOC11, Modulation::CBOCData,
                                  Modulation::CBOCPilot, Modulation::TMBOC};
constexpr std::array kEarlyLate{Discriminator::Coherent, Discriminator::EarlyLatePower,
                                Discriminator::DotProduct};
constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// R at k twelfths of a chip, k >= 0; it is straight between.
double corner(Modulation modulation, int k) {
  if (k >= 12) return 0;
  const double boc11 = k <= 6 ? 1 - k / 4.0 : k / 12.0 - 1;          // slopes -3, +1
  const double boc61 = (k % 2 == 0 ? 1 : -1) * (1 - k / 12.0);       // slopes -23, +21, -19 ...
  const double cross = k % 2 == 0 ? 0 : k < 6 ? 1.0 / 6 : -1.0 / 6;  // both orders together: slopes +-2
  switch (modulation) {
    case Modulation::BPSK:
      return 1 - k / 12.0;
    case Modulation::BOC11:
      return boc11;
    case Modulation::CBOCData:  // Galileo OS SIS ICD 2.3.3: powers 10/11 and 1/11, in phase
      return (10 * boc11 + boc61 + std::sqrt(10.0) * cross) / 11;
    case Modulation::CBOCPilot:  // in antiphase
      return (10 * boc11 + boc61 - std::sqrt(10.0) * cross) / 11;
    case Modulation::TMBOC:  // IS-GPS-800 3.3: 29 chips of 33, and 4
      return (29 * boc11 + 4 * boc61) / 33;
    case Modulation::BOC61:
      return boc61;
  }
  return 0;
}

/// Slope [1/chip] of the k-th twelfth.
double slope(Modulation modulation, int k) {
  return 12 * (corner(modulation, k + 1) - corner(modulation, k));
}

double r(Modulation modulation, double delay) {
  const double twelfths = 12 * std::abs(delay);
  if (twelfths >= 12) return 0;
  const int k = static_cast<int>(twelfths);
  return corner(modulation, k) + slope(modulation, k) * (twelfths - k) / 12;
}

/// The zero of (1), by bisection.
double envelope(Modulation modulation, double a, double d, double t) {
  const double s = -slope(modulation, 0);
  double low = -d, high = d;
  while (high - low > 1e-13) {
    const double e = (low + high) / 2;
    const double echo = r(modulation, e - t - d / 2) - r(modulation, e - t + d / 2);
    (2 * s * e + a * echo > 0 ? high : low) = e;
  }
  return (low + high) / 2;
}

CodeTracker tracker(const CorrelationOptions& signal, Discriminator discriminator, double d) {
  DllOptions loop;
  loop.discriminator = discriminator;
  loop.spacing_chips = d;
  return CodeTracker(signal, loop);
}

CodeTracker tracker(Modulation modulation, Discriminator discriminator, double d) {
  CorrelationOptions signal;
  signal.modulation = modulation;
  return tracker(signal, discriminator, d);
}

/// The equilibrium error of a loop that has tracked the direct path [chips].
double error_chips(const CodeTracker& loop, std::complex<double> amplitude, double t) {
  const double chip = loop.correlation().chip_m();
  const std::vector<SignalPath> paths{{0, {1, 0}, 0}, {t * chip, amplitude, 0}};
  const auto lock = loop.lock(paths, 0.0);
  EXPECT_TRUE(lock) << amplitude << ' ' << t;
  return lock ? lock->delay_m / chip : std::nan("");
}

// Slopes at the peak by power fractions: 3, 3 10/11 + 23/11 -+ 2 sqrt(10)/11, 3 29/33 + 23 4/33.
TEST(MultipathEnvelope, SlopesAtThePeakAreThoseOfThePowerShares) {
  EXPECT_NEAR(slope(Modulation::BPSK, 0), -1, 1e-12);
  EXPECT_NEAR(slope(Modulation::BOC11, 0), -3, 1e-12);
  EXPECT_NEAR(slope(Modulation::CBOCData, 0), -(53 - 2 * std::sqrt(10.0)) / 11, 1e-12);
  EXPECT_NEAR(slope(Modulation::CBOCPilot, 0), -(53 + 2 * std::sqrt(10.0)) / 11, 1e-12);
  EXPECT_NEAR(slope(Modulation::TMBOC, 0), -179.0 / 33, 1e-12);
  // No two modulations have the same envelope: the plateaus (2) differ somewhere by 2 % at least.
  for (const Modulation one : kModulations) {
    for (const Modulation other : kModulations) {
      double largest = 0;
      for (int k = 0; k < 12; ++k) {
        largest =
            std::max(largest, std::abs(slope(one, k) / slope(one, 0) - slope(other, k) / slope(other, 0)));
      }
      EXPECT_EQ(largest > 0.02, one != other) << name(one) << ' ' << name(other);
    }
  }
}

TEST(MultipathEnvelope, PlateausAreTheSlopesOfTheCorrelation) {
  const double d = 0.02;
  for (const Modulation modulation : kModulations) {
    for (const Discriminator discriminator : kEarlyLate) {
      const CodeTracker loop = tracker(modulation, discriminator, d);
      for (const double a : {0.1, 0.5, -0.1, -0.5}) {
        for (int k = 0; k < 12; ++k) {
          EXPECT_NEAR(error_chips(loop, a, (k + 0.5) / 12),
                      a * d / 2 * slope(modulation, k) / slope(modulation, 0), 1e-8)
              << name(modulation) << ' ' << name(discriminator) << ' ' << a << ' ' << k;
        }
      }
    }
  }
}

TEST(MultipathEnvelope, IsTheClosedFormAtEveryDelay) {
  double worst = 0;
  for (const Modulation modulation : kModulations) {
    for (const Discriminator discriminator : kEarlyLate) {
      for (const double d : {0.08, 0.02}) {
        const CodeTracker loop = tracker(modulation, discriminator, d);
        for (const double a : {0.1, 0.5, 0.9, -0.1, -0.5, -0.9}) {
          double largest = 0;
          for (int i = 0; i <= 220; ++i) {
            const double t = i * 0.005;
            const double error = error_chips(loop, a, t);
            const double expected = envelope(modulation, a, d, t);
            EXPECT_NEAR(error, expected, 1e-8)
                << name(modulation) << ' ' << name(discriminator) << ' ' << d << ' ' << a << ' ' << t;
            worst = std::max(worst, std::abs(error - expected));
            largest = std::max(largest, std::abs(error));
            if (t > 1 + d / 2) {
              EXPECT_NEAR(error, 0, 1e-9);
            }
          }
          EXPECT_LE(largest, std::abs(a) * d / 2 + 1e-8);
          EXPECT_NEAR(error_chips(loop, a, (1 + a) * d / 4), a * d / 4, 1e-8);
          EXPECT_NEAR(error_chips(loop, a, (1 + a) * d / 2), a * d / 2, 1e-8);
        }
      }
    }
  }
  RecordProperty("worst_chips", std::to_string(worst * 1e12) + "e-12");
}

// D for an echo's phase p is (1 + cos p) / 2 times that of phase 0 and (1 - cos p) / 2 times that of 180
// degrees, for these discriminators: its zero is between theirs.
TEST(MultipathEnvelope, InPhaseAndAntiphaseBoundAllPhases) {
  const double d = 0.08;
  for (const Modulation modulation : kModulations) {
    for (const Discriminator discriminator : kEarlyLate) {
      const CodeTracker loop = tracker(modulation, discriminator, d);
      for (double t = 0.01; t < 1.1; t += 0.03) {
        for (const double a : {0.3, 0.7}) {
          const auto [low, high] = std::minmax({error_chips(loop, a, t), error_chips(loop, -a, t)});
          for (int degrees = 0; degrees < 360; degrees += 15) {
            const double error = error_chips(loop, std::polar(a, geodesy::radians(degrees)), t);
            EXPECT_GE(error, low - 1e-9) << name(modulation) << ' ' << t << ' ' << degrees;
            EXPECT_LE(error, high + 1e-9) << name(modulation) << ' ' << t << ' ' << degrees;
          }
        }
      }
    }
  }
}

// By the tables of the interface documents (docs/signals.md names them): modulation and metres of a chip,
// c / 0.511e6, 1.023e6, 2.046e6, 10.23e6.
TEST(MultipathEnvelope, EverySignalHasThatOfItsInterfaceDocument) {
  struct Row {
    const char* system;
    const char* signal;
    Modulation modulation;
    double chip_m;
  };
  const double half = 586.67800, one = 293.05226, two = 146.52613, ten = 29.305226;
  const std::vector<Row> rows{{"G", "L1CA", Modulation::BPSK, one},    {"G", "L1C", Modulation::TMBOC, one},
                              {"G", "L2C", Modulation::BPSK, one},     {"G", "L5", Modulation::BPSK, ten},
                              {"J", "L1CA", Modulation::BPSK, one},    {"J", "L1C", Modulation::TMBOC, one},
                              {"J", "L2C", Modulation::BPSK, one},     {"J", "L5", Modulation::BPSK, ten},
                              {"E", "E1", Modulation::CBOCPilot, one}, {"E", "E5a", Modulation::BPSK, ten},
                              {"E", "E5b", Modulation::BPSK, ten},     {"C", "B1I", Modulation::BPSK, two},
                              {"C", "B1C", Modulation::TMBOC, one},    {"C", "B2I", Modulation::BPSK, two},
                              {"C", "B2a", Modulation::BPSK, ten},     {"C", "B3I", Modulation::BPSK, ten},
                              {"C", "B2b", Modulation::BPSK, ten},     {"R", "G1", Modulation::BPSK, half},
                              {"R", "G2", Modulation::BPSK, half},     {"S", "L1CA", Modulation::BPSK, one}};
  SignalOptions options;
  options.front_end_bandwidth_hz = options.wide_front_end_bandwidth_hz = kInfinite;
  const double a = 0.5, d = 0.02;
  std::size_t signals = 0;
  for (const gnss::System system : gnss::kAllSystems) {
    for (const gnss::Signal& signal : gnss::signals_of(system)) {
      if (!signal.only_recorded.empty()) continue;
      ++signals;
      const auto row = std::find_if(rows.begin(), rows.end(), [&](const Row& candidate) {
        return candidate.system[0] == gnss::letter(system) && candidate.signal == signal.name;
      });
      ASSERT_NE(row, rows.end()) << signal.name;
      const CodeTracker loop = tracker(correlation_of(signal, options), Discriminator::EarlyLatePower, d);
      for (int k = 0; k < 12; ++k) {
        const double t_m = (k + 0.5) / 12 * row->chip_m;
        const std::vector<SignalPath> paths{{0, {1, 0}, 0}, {t_m, {a, 0}, 0}};
        EXPECT_NEAR(loop.lock(paths, 0.0)->delay_m,
                    a * d / 2 * slope(row->modulation, k) / slope(row->modulation, 0) * row->chip_m, 1e-6)
            << gnss::letter(system) << ' ' << signal.name << ' ' << k;
      }
    }
  }
  EXPECT_EQ(signals, rows.size());
}

}  // namespace
}  // namespace canyon::tracking::multipath_envelopes_test
