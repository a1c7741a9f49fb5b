#include "canyon/receiver/tracking/loop_noise.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <functional>
#include <limits>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/random.hpp"

namespace canyon::tracking {
namespace {

using geodesy::kPi;
using propagation::Spectrum;
using Shape = Spectrum::Shape;

constexpr double kRate = 1.023e6;

Spectrum tone(double hz) {
  Spectrum s;
  s.shape = Shape::Tone;
  s.centre_hz = hz;
  return s;
}
Spectrum band(double hz, double width_hz) {
  Spectrum s;
  s.centre_hz = hz;
  s.width_hz = width_hz;
  return s;
}
Spectrum chirp(double hz, double width_hz, double period_s) {
  Spectrum s = band(hz, width_hz);
  s.shape = Shape::Chirp;
  s.period_s = period_s;
  return s;
}
Spectrum code(Modulation modulation, double rate = kRate, double hz = 0) {
  Spectrum s;
  s.shape = Shape::Code;
  s.centre_hz = hz;
  s.modulation = modulation;
  s.chip_rate_hz = rate;
  return s;
}
Correlation signal(Modulation modulation, double rate = kRate,
                   double bandwidth_hz = std::numeric_limits<double>::infinity()) {
  return Correlation({modulation, rate, bandwidth_hz});
}
double db(double ratio) {
  return 10 * std::log10(ratio);
}
double sinc(double x) {
  return x == 0 ? 1 : std::sin(kPi * x) / (kPi * x);
}

// The product of two spectra integrates to that of the correlation functions: of sinc^4 2/3 (Kaplan &
// Hegarty 2nd ed. 2006, 6.3: Q = 1.5), of (1 - t)(1 - 3t) and so on 1/6, of BOC(1,1) itself 1/3. Published
// for 1.023 Mchip/s: -61.8, -67.8 and -64.8 dB/Hz (J. W. Betz, Navigation 48(4), 2001).
TEST(Interference, CodesSeparateByTheirCorrelationFunctions) {
  const Correlation bpsk = signal(Modulation::BPSK), boc = signal(Modulation::BOC11);
  EXPECT_NEAR(spectral_separation_per_hz(bpsk, 0, code(Modulation::BPSK)) * kRate, 2.0 / 3, 1e-4);
  EXPECT_NEAR(spectral_separation_per_hz(bpsk, 0, code(Modulation::BOC11)) * kRate, 1.0 / 6, 1e-4);
  EXPECT_NEAR(spectral_separation_per_hz(boc, 0, code(Modulation::BPSK)) * kRate, 1.0 / 6, 1e-4);
  EXPECT_NEAR(spectral_separation_per_hz(boc, 0, code(Modulation::BOC11)) * kRate, 1.0 / 3, 1e-4);
  EXPECT_NEAR(db(spectral_separation_per_hz(bpsk, 0, code(Modulation::BPSK))), -61.8, 0.1);
  EXPECT_NEAR(db(spectral_separation_per_hz(bpsk, 0, code(Modulation::BOC11))), -67.8, 0.1);
  // Ten times the chip rate, ten times the width of the spectrum: 2/3 of 1 / Rc.
  EXPECT_NEAR(
      spectral_separation_per_hz(signal(Modulation::BPSK, 10.23e6), 0, code(Modulation::BPSK, 10.23e6)) *
          10.23e6,
      2.0 / 3, 1e-4);
  // A narrow code in the middle of a wide one has its density there, 1 / 10.23e6, minus its curvature.
  EXPECT_NEAR(
      db(spectral_separation_per_hz(signal(Modulation::BPSK, 10.23e6), 0, code(Modulation::BPSK)) * 10.23e6),
      0, 0.2);
}

TEST(Interference, TonesMeetTheTextbooksDensity) {
  for (const double off : {0.0, 0.3e6, 1.6e6, 5.2e6}) {
    const double f = off / kRate;
    EXPECT_NEAR(spectral_separation_per_hz(signal(Modulation::BPSK), 1e9, tone(1e9 + off)) * kRate,
                sinc(f) * sinc(f), 1e-9);
    EXPECT_NEAR(spectral_separation_per_hz(signal(Modulation::BOC11), 1e9, tone(1e9 - off)) * kRate,
                std::pow(sinc(f) * std::tan(kPi * f / 2), 2), 1e-9);
  }
  // TMBOC: 29/33 BOC(1,1) and 4/33 BOC(6,1), sinc^2(f) tan^2(pi f / 12).
  EXPECT_NEAR(spectral_separation_per_hz(signal(Modulation::TMBOC), 0, tone(0.7 * kRate)) * kRate,
              29.0 / 33 * std::pow(sinc(0.7) * std::tan(kPi * 0.35), 2) +
                  4.0 / 33 * std::pow(sinc(0.7) * std::tan(kPi * 0.7 / 12), 2),
              1e-9);
  // Outside the filter's band there is no effect.
  EXPECT_EQ(spectral_separation_per_hz(signal(Modulation::BPSK, kRate, 4e6), 0, tone(2.1e6)), 0);
}

// Narrow noise is a tone; for wide noise the signal's whole power counts, 1 / width.
TEST(Interference, BandsLieBetweenToneAndWhiteNoise) {
  const Correlation bpsk = signal(Modulation::BPSK);
  EXPECT_NEAR(spectral_separation_per_hz(bpsk, 0, band(0, 1e3)) * kRate, 1, 1e-4);
  EXPECT_NEAR(spectral_separation_per_hz(bpsk, 0, band(0, 400e6)) * 400e6, 1, 1e-3);
  // Half of its power if the noise ends in the middle.
  EXPECT_NEAR(spectral_separation_per_hz(bpsk, 0, band(100e6, 200e6)) * 200e6, 0.5, 1e-3);
  // 90.28 % of C/A's power is within its main lobe (2 / pi Si(2 pi) minus nothing).
  EXPECT_NEAR(
      spectral_separation_per_hz(signal(Modulation::BPSK, kRate, 2 * kRate), 0, band(0, 400e6)) * 400e6,
      2 / kPi * 1.4181515761, 1e-4);
}

/// Power of a chirp's line by a sum over its samples.
double line_power(const Spectrum& s, int line) {
  constexpr int kSamples = 200'000;
  std::complex<double> sum;
  for (int i = 0; i < kSamples; ++i) {
    const double t = ((i + 0.5) / kSamples - 0.5) * s.period_s;
    sum += std::polar(1.0, kPi * s.width_hz / s.period_s * t * t - 2 * kPi * line / s.period_s * t);
  }
  return std::norm(sum / static_cast<double>(kSamples));
}

TEST(Interference, ChirpsAreTheirLines) {
  for (const Spectrum& s : {chirp(0, 2e6, 10e-6), chirp(0.9e6, 10e6, 5e-6)}) {
    double expected = 0, power = 0;
    for (int line = -120; line <= 120; ++line) {
      const double here = line_power(s, line), f = (s.centre_hz + line / s.period_s) / kRate;
      power += here;
      expected += here * sinc(f) * sinc(f) / kRate;
    }
    EXPECT_NEAR(power, 1, 0.01);
    EXPECT_NEAR(db(spectral_separation_per_hz(signal(Modulation::BPSK), 0, s) / expected), 0, 0.05);
  }
  // A fast, wide one is as flat as noise, except for its lines: 100 kHz apart they sample the spectrum.
  const double flat = spectral_separation_per_hz(signal(Modulation::BPSK), 0, band(0, 20e6));
  EXPECT_NEAR(db(spectral_separation_per_hz(signal(Modulation::BPSK), 0, chirp(0, 20e6, 10e-6)) / flat), 0,
              0.5);
  EXPECT_NEAR(db(spectral_separation_per_hz(signal(Modulation::BPSK), 0, chirp(0, 20e6, 2e-3)) / flat), 0,
              0.01);
}

// Correlators of 20 ms with random codes of 1023 chips, chip by chip: the power of the tone is 1 / T times
// the separation, as N0 / T is that of white noise.
TEST(Interference, TonesHitTheLinesOfShortCodesOrMiss) {
  constexpr double kT = 0.02;
  RandomStream random(1, "codes");
  for (const double offset_hz : {100e3, 100e3 + 20, 100e3 + 75, 100e3 + 500}) {
    double power = 0;
    constexpr int kCodes = 1500, kChips = 1023, kRepetitions = 20;
    for (int c = 0; c < kCodes; ++c) {
      std::complex<double> once;
      for (int k = 0; k < kChips; ++k) {
        const double sign = random.uniform() < 0.5 ? -1 : 1;
        once += sign * std::polar(1.0, 2 * kPi * offset_hz * (k + 0.5) / kRate);
      }
      std::complex<double> all;
      for (int r = 0; r < kRepetitions; ++r) all += once * std::polar(1.0, 2 * kPi * offset_hz * r * 1e-3);
      power += std::norm(all / (1.0 * kChips * kRepetitions)) * std::pow(sinc(offset_hz / kRate), 2) / kCodes;
    }
    const double expected = spectral_separation_per_hz(signal(Modulation::BPSK), 0, tone(offset_hz)) *
                            line_factor(offset_hz, 1e3, kT) / kT;
    // |sum|^2 is exponential: its mean scatters by 1 / sqrt(1500).
    EXPECT_NEAR(power, expected, 4 * expected / std::sqrt(1.0 * kCodes) + 1e-12) << offset_hz;
  }
  // The mean equals that of a code without lines, on a line it is 13 dB more.
  double mean = 0;
  for (int i = 0; i < 10'000; ++i) mean += line_factor(i * 0.1 + 0.03, 1e3, kT) / 10'000;
  EXPECT_NEAR(mean, 1, 1e-6);
  EXPECT_EQ(line_factor(7e3, 1e3, kT), 20);
  EXPECT_EQ(line_factor(7e3, 0, kT), 1);
}

TEST(Interference, WhatIsWithinABand) {
  EXPECT_EQ(fraction_within(tone(1e9), 1e9 + 1e6, 4e6), 1);
  EXPECT_EQ(fraction_within(tone(1e9), 1e9 + 3e6, 4e6), 0);
  EXPECT_NEAR(fraction_within(band(1e9, 20e6), 1e9, 4e6), 0.2, 1e-12);
  EXPECT_NEAR(fraction_within(band(1e9, 20e6), 1e9 + 10e6, 4e6), 0.1, 1e-12);
  EXPECT_EQ(fraction_within(band(1e9, 20e6), 1.1e9, 4e6), 0);
  EXPECT_NEAR(fraction_within(code(Modulation::BPSK, kRate, 1e9), 1e9, 2 * kRate), 2 / kPi * 1.4181515761,
              1e-5);
}

// A linear wave has half of its power in each hand.
TEST(Interference, AntennasTakeTheirHand) {
  propagation::Interference wave;
  wave.arrival = {0, std::cos(0.1), std::sin(0.1)};
  const signal::AntennaPattern pattern("two", {{-90, 1, -9}, {90, 1, -9}});
  wave.polarisation = propagation::Polarisation::Right;
  EXPECT_NEAR(gain_for(pattern, wave, signal::Band::Upper), std::pow(10, 0.1), 1e-12);
  wave.polarisation = propagation::Polarisation::Left;
  EXPECT_NEAR(gain_for(pattern, wave, signal::Band::Upper), std::pow(10, -0.9), 1e-12);
  wave.polarisation = propagation::Polarisation::Linear;
  EXPECT_NEAR(gain_for(pattern, wave, signal::Band::Upper), (std::pow(10, 0.1) + std::pow(10, -0.9)) / 2,
              1e-12);
  EXPECT_NEAR(db(gain_for(signal::isotropic_antenna(), wave, signal::Band::Upper)), -3.01, 0.01);
}

}  // namespace
}  // namespace canyon::tracking
