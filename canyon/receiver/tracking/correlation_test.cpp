#include "canyon/receiver/tracking/correlation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <limits>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::tracking::correlation_test {
namespace {

using geodesy::kPi;

constexpr double kInfinite = std::numeric_limits<double>::infinity();
/// Modulations that receivers track: BOC(6,1) is tracked as a part of others.
const std::vector<Modulation> kAll{Modulation::BPSK, Modulation::BOC11, Modulation::CBOCData,
                                   Modulation::CBOCPilot, Modulation::TMBOC};

Correlation correlation(Modulation modulation, double bandwidth_chips = kInfinite) {
  CorrelationOptions options;
  options.modulation = modulation;
  options.bandwidth_hz = bandwidth_chips * options.chip_rate_hz;
  return Correlation(options);
}

/// Power spectral density of unit area over frequency in chip rates: sinc^2(f) for BPSK and sinc^2(f)
/// tan^2(pi f / 2) for sine-phased BOC(1,1), the textbook forms; for the others the square of the sum of both
/// subcarriers' transforms, of `half_periods` rectangles each.
std::complex<double> boc_transform(int half_periods, double f) {
  std::complex<double> sum;
  const double width = 1.0 / half_periods;
  for (int i = 0; i < half_periods; ++i) {
    const double middle = (i + 0.5) * width;
    sum += (i % 2 == 0 ? 1.0 : -1.0) * std::polar(1.0, -2 * kPi * f * middle);
  }
  const double x = kPi * f * width;
  return sum * width * (x == 0 ? 1 : std::sin(x) / x);
}

double density(Modulation modulation, double f) {
  const double a = std::sqrt(10.0 / 11);
  const double b = std::sqrt(1.0 / 11);
  switch (modulation) {
    case Modulation::BPSK:
      return f == 0 ? 1 : std::pow(std::sin(kPi * f) / (kPi * f), 2);
    case Modulation::BOC11: {
      if (f == 0) return 0;
      const double s = std::sin(kPi * f / 2);
      return std::pow(s * s / (kPi * f / 2), 2);  // sinc^2(f) tan^2(pi f / 2)
    }
    case Modulation::CBOCData:
      return std::norm(a * boc_transform(2, f) + b * boc_transform(12, f));
    case Modulation::CBOCPilot:
      return std::norm(a * boc_transform(2, f) - b * boc_transform(12, f));
    case Modulation::TMBOC:
      return 29.0 / 33 * std::norm(boc_transform(2, f)) + 4.0 / 33 * std::norm(boc_transform(12, f));
    case Modulation::BOC61:
      return std::norm(boc_transform(12, f));
  }
  return 0;
}

struct Integrals {
  double value = 0, slope = 0;
};

/// R and its derivative at `tau`: integrals of S(f) cos(2 pi f tau) and of -2 pi f S(f) sin(2 pi f tau) over
/// the band, by Simpson's rule.
Integrals integrated(Modulation modulation, double bandwidth, double tau) {
  const int n = 8'000;
  const double h = bandwidth / 2 / n;
  Integrals sum;
  for (int i = 0; i <= n; ++i) {
    const double f = i * h;
    const double weighted = (i == 0 || i == n ? 1 : i % 2 == 1 ? 4 : 2) * density(modulation, f);
    sum.value += weighted * std::cos(2 * kPi * f * tau);
    sum.slope -= weighted * 2 * kPi * f * std::sin(2 * kPi * f * tau);
  }
  return {2 * sum.value * h / 3, 2 * sum.slope * h / 3};
}

TEST(SineIntegral, TableValues) {
  // Abramowitz & Stegun, table 5.1, to its digits; pi: Wilbraham-Gibbs constant (OEIS A036792); 30: Simpson's
  // rule with 200,000 steps.
  EXPECT_NEAR(sine_integral(1), 0.9460830704, 1e-10);
  EXPECT_NEAR(sine_integral(2), 1.6054129768, 1e-10);
  EXPECT_NEAR(sine_integral(5), 1.5499312449, 1e-10);
  EXPECT_NEAR(sine_integral(10), 1.6583475942, 1e-10);
  EXPECT_NEAR(sine_integral(kPi), 1.851937051982466, 1e-14);
  EXPECT_NEAR(sine_integral(30), 1.5667565400303, 1e-12);
  EXPECT_EQ(sine_integral(0), 0);
  for (const double x : {0.3, 3.9, 4.1, 70.0}) EXPECT_EQ(sine_integral(-x), -sine_integral(x));
  // Both branches agree: dSi/dx = sin(x) / x across x = 4.
  EXPECT_NEAR(sine_integral(4 + 1e-6) - sine_integral(4 - 1e-6), 2e-6 * std::sin(4.0) / 4, 3e-15);
}

TEST(Correlation, ClosedFormsOfInfiniteBandwidth) {
  const Correlation bpsk = correlation(Modulation::BPSK);
  const Correlation boc = correlation(Modulation::BOC11);
  for (double tau = -1.5; tau <= 1.5; tau += 0.013) {
    const double a = std::abs(tau);
    EXPECT_NEAR(bpsk.value(tau), std::max(0.0, 1 - a), 1e-15);
    EXPECT_NEAR(boc.value(tau), a < 0.5 ? 1 - 3 * a : a < 1 ? a - 1 : 0, 2e-15);
  }
  EXPECT_EQ(bpsk.slope(0.3), -1);
  EXPECT_EQ(bpsk.slope(-0.3), 1);
  EXPECT_EQ(bpsk.slope(0), 0);
  EXPECT_EQ(bpsk.slope(1), -0.5);
  EXPECT_EQ(bpsk.slope(1.1), 0);
  EXPECT_NEAR(boc.slope(0.2), -3, 1e-14);
  EXPECT_NEAR(boc.slope(0.5), -1, 1e-14);
  EXPECT_NEAR(boc.slope(-0.7), -1, 1e-14);
}

// CBOC and TMBOC have, with their data channels, the MBOC spectrum: 10/11 BOC(1,1) + 1/11 BOC(6,1) for E1-B
// and E1-C together (Galileo OS SIS ICD 2.3.3). BOC(6,1) has R(k/12) = (-1)^k (1 - k/12), linear between.
TEST(Correlation, MultiplexedSignals) {
  const Correlation boc = correlation(Modulation::BOC11);
  const Correlation data = correlation(Modulation::CBOCData);
  const Correlation pilot = correlation(Modulation::CBOCPilot);
  const Correlation tmboc = correlation(Modulation::TMBOC);
  for (double tau = 0; tau < 1.1; tau += 0.0107) {
    const double cell = std::min(std::floor(12 * tau), 12.0);
    const auto corner = [](double k) { return k > 12 ? 0 : (std::fmod(k, 2) == 0 ? 1 : -1) * (1 - k / 12); };
    const double t = 12 * tau - cell;
    const double boc61 = (1 - t) * corner(cell) + t * corner(cell + 1);
    EXPECT_NEAR((data.value(tau) + pilot.value(tau)) / 2, 10.0 / 11 * boc.value(tau) + boc61 / 11, 1e-14);
    EXPECT_NEAR(tmboc.value(tau), 29.0 / 33 * boc.value(tau) + 4.0 / 33 * boc61, 1e-14);
  }
  // In antiphase the two subcarriers make a sharper peak.
  EXPECT_LT(pilot.slope(0.01), data.slope(0.01));
}

// At delays between the table's points, and beyond the table.
TEST(Correlation, BandLimitedIsTheIntegralOfTheSpectrum) {
  double worst = 0, worst_slope = 0;
  for (const Modulation modulation : kAll) {
    for (const double bandwidth : {0.5, 2.0, 8.0, 24.0, 40.0}) {
      const Correlation r = correlation(modulation, bandwidth);
      for (const double tau : {0.0, 0.0137, 0.02, 0.0771, 0.1, 0.31, 0.4999, 0.77, 1.0, 1.713, 3.999, 4.6}) {
        const Integrals expected = integrated(modulation, bandwidth, tau);
        EXPECT_NEAR(r.value(tau), expected.value, 1e-7) << name(modulation) << ' ' << bandwidth << ' ' << tau;
        EXPECT_NEAR(r.slope(tau), expected.slope, 2e-5) << name(modulation) << ' ' << bandwidth << ' ' << tau;
        EXPECT_EQ(r.value(-tau), r.value(tau));
        EXPECT_EQ(r.slope(-tau), -r.slope(tau));
        worst = std::max(worst, std::abs(r.value(tau) - expected.value));
        worst_slope = std::max(worst_slope, std::abs(r.slope(tau) - expected.slope));
      }
    }
  }
  RecordProperty("worst_error", std::to_string(worst * 1e9) + "e-9");
  RecordProperty("worst_slope_error", std::to_string(worst_slope * 1e6) + "e-6");
}

TEST(Correlation, PowerInTheMainLobe) {
  // Integral of sinc^2 from -1 to 1: 0.9028 (the 90 % of the textbooks), Simpson's rule with 200,000 steps.
  EXPECT_NEAR(correlation(Modulation::BPSK, 2).value(0), 0.902823333580287, 1e-9);
}

TEST(Correlation, WideBandwidthTendsToTheInfiniteOne) {
  for (const Modulation modulation : kAll) {
    const Correlation wide = correlation(modulation, 1000);
    const Correlation infinite = correlation(modulation);
    // The peak is reduced by the jumps of the slope times 1 / (pi^2 B).
    for (double tau = -1.2; tau < 1.2; tau += 0.017) {
      EXPECT_NEAR(wide.value(tau), infinite.value(tau), 2e-3) << name(modulation) << ' ' << tau;
    }
  }
}

TEST(Correlation, MetresOfAChip) {
  CorrelationOptions options;
  EXPECT_NEAR(Correlation(options).chip_m(), 293.0523, 1e-4);  // c / 1.023e6
  options.chip_rate_hz = 10.23e6;
  EXPECT_NEAR(Correlation(options).chip_m(), 29.30523, 1e-5);
}

TEST(Correlation, RefusesWhatIsNoSignal) {
  for (const double rate : {0.0, -1.0, 1e12, std::nan("")}) {
    CorrelationOptions options;
    options.chip_rate_hz = rate;
    EXPECT_THROW(Correlation{options}, InputError) << rate;
  }
  for (const double bandwidth : {0.0, 1e5, -kInfinite, 1e12, std::nan("")}) {
    CorrelationOptions options;
    options.bandwidth_hz = bandwidth;
    EXPECT_THROW(Correlation{options}, InputError) << bandwidth;
  }
}

}  // namespace
}  // namespace canyon::tracking::correlation_test
