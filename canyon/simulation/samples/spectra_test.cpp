// Generated samples against closed forms: power spectra, correlation functions, bounds of other codes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <string>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/samples/generator.hpp"
#include "canyon/simulation/samples/path_interpolator.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::samples::spectra_test {
namespace {

using geodesy::kPi;
using gnss::System;
using Complex = std::complex<double>;

/// Keeps the direct paths of one signal, of all of its satellites or of one.
class OneSignal final : public disturbance::Disturbance {
 public:
  OneSignal(const gnss::Signal& signal, int number) : signal_(&signal), number_(number) {}
  void apply(const propagation::Antenna& /*antenna*/, propagation::Arrival& arrival) override {
    std::erase_if(arrival.views, [&](const propagation::SatelliteView& view) {
      return view.line.id.system != signal_->system || (number_ != 0 && view.line.id.number != number_);
    });
    for (propagation::SatelliteView& view : arrival.views) {
      view.paths.paths.resize(1);
      view.paths.paths[0].signals = 1U << gnss::index_of(*signal_);
    }
  }

 private:
  const gnss::Signal* signal_;
  int number_;
};

const gnss::Signal& signal_of(System system, std::string_view name) {
  const auto all = gnss::signals_of(system);
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const gnss::Signal& s) { return s.name == name; });
  EXPECT_NE(found, all.end()) << name;
  return *found;
}

struct Made {
  std::vector<std::complex<float>> values;
  std::size_t satellites = 0;
};
/// A tenth of a second without noise. @param number 0: of all satellites
Made samples_of(const gnss::Signal& signal, double rate_hz, int number = 0) {
  simulation::Scenario scenario = simulation::parse_scenario(
      "city: {open: true, origin: {latitude_deg: 48, longitude_deg: 11, height_m: 500}}\n"
      "sky: {nominal: true, systems: [" +
          std::string(gnss::name(signal.system)) +
          "]}\nstart: 2026-06-01T08:00:00Z\nrate_hz: 10\nduration_s: 0.1\n"
          "trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2}], hold_s: 1}\n"
          "receivers: [{name: rx, clock: {bias_s: 0, drift: 0, drift_walk: 0}, "
          "signal: {enabled: true, antenna: dual_patch}}]\n",
      "test.yaml");
  scenario.receivers[0].disturbances.push_back(
      {"one signal", [&signal, number](std::uint64_t, const std::string&) {
         return std::make_unique<OneSignal>(signal, number);
       }});
  city::City city;
  city.frame = geodesy::LocalFrame(*scenario.city.origin);
  const simulation::Simulation simulation(scenario, std::move(city));
  FrontEnd front_end;
  front_end.centre_hz = signal.carrier_hz;
  front_end.rate_hz = rate_hz;
  front_end.noise = false;
  struct Recorder final : simulation::EpochSink {
    Recorder(const simulation::Simulation& of, const FrontEnd& with)
        : generator(of.scenario().receivers[0].options, 1, {}, with) {}
    void write(const simulation::Epoch& epoch) override {
      generator.next(epoch, [this](const SampleBlock& block, std::size_t count) {
        for (std::size_t n = 0; n < count; ++n) made.values.emplace_back(block.re[n], block.im[n]);
      });
    }
    void finish() override {}
    Generator generator;
    Made made;
  } recorder(simulation, front_end);
  (void)simulation.run({&recorder});
  for (const auto& [name, count] : recorder.generator.contents().satellites)
    recorder.made.satellites += count;
  return std::move(recorder.made);
}

/// Power spectral densities of unit power, in chip rates (J. W. Betz, Navigation 48(4), 2001): BPSK, and BOC
/// of a sine subcarrier of `cycles` in a chip.
double bpsk(double f) {
  return std::abs(f) < 1e-9 ? 1 : std::pow(std::sin(kPi * f) / (kPi * f), 2);
}
double boc(double f, int cycles) {
  f = std::max(std::abs(f), 1e-9);
  const double half_slot = kPi * f / (2 * cycles);
  // At the zeros of the cosine the quotient with the sine of the chip has a limit: evaluated next to them.
  if (std::abs(std::cos(half_slot)) < 1e-6) return boc(f * (1 + 1e-5), cycles);
  return std::pow(std::sin(half_slot) * std::sin(kPi * f) / (kPi * f * std::cos(half_slot)), 2);
}
/// MBOC(6,1,1/11): E1 of CBOC, L1C of TMBOC and B1C of QMBOC, data and pilot together.
double mboc(double f) {
  return 10.0 / 11 * boc(f, 1) + 1.0 / 11 * boc(f, 6);
}

/// A Fourier transform in place; the size is a power of two.
void transform(std::vector<Complex>& x) {
  const std::size_t n = x.size();
  for (std::size_t i = 1, j = 0; i < n; ++i) {
    std::size_t bit = n >> 1U;
    for (; (j & bit) != 0; bit >>= 1U) j ^= bit;
    j ^= bit;
    if (i < j) std::swap(x[i], x[j]);
  }
  for (std::size_t length = 2; length <= n; length *= 2) {
    for (std::size_t k = 0; k < length / 2; ++k) {
      const Complex w = std::polar(1.0, -2 * kPi * static_cast<double>(k) / static_cast<double>(length));
      for (std::size_t i = k; i < n; i += length) {
        const Complex odd = w * x[i + length / 2];
        x[i + length / 2] = x[i] - odd;
        x[i] += odd;
      }
    }
  }
}

struct Sent {
  System system;
  std::string_view signal;
  double (*density)(double);
};
constexpr Sent kSent[]{
    {System::GPS, "L1CA", bpsk},    {System::GPS, "L1C", mboc},    {System::GPS, "L2C", bpsk},
    {System::GPS, "L5", bpsk},      {System::Galileo, "E1", mboc}, {System::Galileo, "E5a", bpsk},
    {System::Galileo, "E5b", bpsk}, {System::BeiDou, "B1I", bpsk}, {System::BeiDou, "B1C", mboc},
    {System::BeiDou, "B2a", bpsk},  {System::BeiDou, "B3I", bpsk}};

TEST(Spectra, AreThoseOfTheSignalsDefinitions) {
  constexpr double kRate_hz = 41.01e6;              // pieces begin at all positions in the codes
  constexpr std::size_t kLength = 2048, kBand = 8;  // bins of 20 kHz, compared in bands of 160 kHz
  for (const Sent& sent : kSent) {
    const gnss::Signal& signal = signal_of(sent.system, sent.signal);
    const Made made = samples_of(signal, kRate_hz);
    ASSERT_GE(made.satellites, 2U) << sent.signal;
    std::vector<double> found(kLength);
    std::vector<Complex> piece(kLength);
    double power = 0;
    for (std::size_t from = 0; from + kLength <= made.values.size(); from += kLength) {
      for (std::size_t n = 0; n < kLength; ++n) {
        piece[n] =
            Complex(made.values[from + n]) * std::pow(std::sin(kPi * static_cast<double>(n) / kLength), 2);
      }
      transform(piece);
      for (std::size_t k = 0; k < kLength; ++k) {
        found[k] += std::norm(piece[k]);
        power += std::norm(piece[k]);
      }
    }
    const double chip_hz = signal.chip_rate_hz;
    double peak = 0;
    std::vector<std::pair<double, double>> bands;  // expected and found, over the whole power
    for (std::size_t band = 0; band < kLength; band += kBand) {
      double expected = 0, there = 0;
      for (std::size_t k = band; k < band + kBand; ++k) {
        double hz = static_cast<double>(k) * kRate_hz / kLength;
        if (k >= kLength / 2) hz -= kRate_hz;
        // There is no filter: frequencies beyond the rate are aliased.
        for (int fold = -200; fold <= 200; ++fold) {
          expected += sent.density((hz + fold * kRate_hz) / chip_hz) / chip_hz * kRate_hz / kLength;
        }
        there += found[k] / power;
      }
      bands.emplace_back(expected, there);
      peak = std::max(peak, expected);
    }
    double whole = 0;
    for (const auto& [expected, there] : bands) {
      whole += expected;
      EXPECT_NEAR(there, expected, 0.12 * expected + 1e-3 * peak)
          << sent.signal << " band " << &expected - &bands[0].first;
    }
    EXPECT_NEAR(whole, 1, 0.005) << sent.signal;
    // All values above a hundredth of the peak together.
    double error = 0, count = 0;
    for (const auto& [expected, there] : bands) {
      if (expected < 0.01 * peak) continue;
      error += std::pow(there / expected - 1, 2);
      ++count;
    }
    EXPECT_LT(std::sqrt(error / count), 0.05) << sent.signal;
  }
}

/// A satellite of the signal in the sky.
int satellite_of(const gnss::Signal& signal) {
  for (int number = 1; number <= 63; ++number) {
    if (samples_of(signal, std::max(6e6, 2.5 * signal.chip_rate_hz), number).satellites == 1) return number;
  }
  ADD_FAILURE() << "no satellite sends " << signal.name;
  return 1;
}

TEST(Spectra, CorrelationFunctionsAreThoseOfTheSignalsDefinitions) {
  for (const Sent& sent : kSent) {
    const gnss::Signal& signal = signal_of(sent.system, sent.signal);
    const double rate_hz = 12.06e6 * (signal.chip_rate_hz > 5e6 ? 4 : 1);
    const int number = satellite_of(signal);
    const std::vector<std::complex<float>> x = samples_of(signal, rate_hz, number).values;
    const bool shaped = sent.density == &mboc;
    tracking::CorrelationOptions options;
    options.modulation = shaped ? gnss::Modulation::BOC11 : gnss::Modulation::BPSK;
    const tracking::Correlation base(options);
    options.modulation = gnss::Modulation::BOC61;
    const tracking::Correlation fast(options);
    // Whole codes: of 1, 4, 10 or 20 ms.
    const auto length = static_cast<std::size_t>(0.04 * rate_hz);
    const auto at = [&](std::size_t lag) {
      Complex sum;
      for (std::size_t n = 0; n < length; ++n) sum += Complex(x[n]) * std::conj(Complex(x[n + lag]));
      return sum;
    };
    const double power = at(0).real();
    const auto chip = static_cast<std::size_t>(rate_hz / signal.chip_rate_hz);
    // Doppler rotates it; the first lag gives the angle, where the function is positive.
    const double rotation = std::arg(at(1));
    for (std::size_t lag = 1; lag <= chip; ++lag) {
      const double delay = static_cast<double>(lag) / rate_hz * signal.chip_rate_hz;
      const double expected =
          shaped ? 10.0 / 11 * base.value(delay) + 1.0 / 11 * fast.value(delay) : base.value(delay);
      const Complex found = at(lag) * std::polar(1 / power, -rotation * static_cast<double>(lag));
      EXPECT_NEAR(found.real(), expected, 0.02) << sent.signal << ' ' << delay;
      EXPECT_NEAR(found.imag(), 0, 0.02) << sent.signal << ' ' << delay;
    }
    // Sidelobes. Data symbols differ from period to period.
    for (std::size_t lag = 2 * chip; lag < 12 * chip; lag += chip / 2) {
      EXPECT_LT(std::abs(at(lag)) / power, sent.signal == "L1CA" ? 65.0 / 1023 + 0.01 : 0.06)
          << sent.signal << ' ' << lag;
    }
  }
}

// IS-GPS-200, 3.3.2.3: codes of other satellites are 23.9 dB down if their Doppler shifts are equal.
TEST(Spectra, OtherSatellitesCodesAreFarDownInTheSamples) {
  constexpr double kRate_hz = 4.092e6;
  const gnss::Signal& signal = signal_of(System::GPS, "L1CA");
  constexpr std::size_t kCode = 4092;
  int there = 0;
  for (int number = 1; number <= 32 && there < 3; ++number) {
    const Made made = samples_of(signal, kRate_hz, number);
    if (made.satellites == 0) continue;
    ++there;
    Complex step;
    for (std::size_t n = 1; n < made.values.size(); ++n) {
      step += Complex(made.values[n]) * std::conj(Complex(made.values[n - 1]));
    }
    std::vector<Complex> x(kCode);
    double power = 0;
    for (std::size_t n = 0; n < kCode; ++n) {
      x[n] = Complex(made.values[n]) * std::polar(1.0, -std::arg(step) * static_cast<double>(n));
      power += std::norm(x[n]);
    }
    for (int other = 1; other <= 32; ++other) {
      const std::vector<std::int8_t> chips =
          components({System::GPS, static_cast<std::uint8_t>(other)}, signal).at(0).chips;
      double greatest = 0;
      for (std::size_t shift = 0; shift < kCode; ++shift) {
        Complex sum;
        for (std::size_t n = 0; n < kCode; ++n)
          sum += x[n] * static_cast<double>(chips[(n + shift) % kCode / 4]);
        greatest = std::max(greatest, std::abs(sum));
      }
      const double db = 20 * std::log10(greatest / std::sqrt(power * kCode));
      if (other == number) {
        EXPECT_GT(db, -1.2) << number;  // up to an eighth of a chip beside the peak
      } else {
        EXPECT_LT(db, -23.9) << other << " in " << number;
        EXPECT_GT(db, -25.5) << other << " in " << number;  // the bound is met, but for the place of samples
      }
    }
  }
  EXPECT_EQ(there, 3);
}

}  // namespace
}  // namespace canyon::samples::spectra_test
