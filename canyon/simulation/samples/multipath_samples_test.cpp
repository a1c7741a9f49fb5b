// A correlator on samples of a direct path and one reflection, compared with the code loop's model of both.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <complex>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/city.hpp"
#include "canyon/receiver/tracking/code_tracking.hpp"
#include "canyon/simulation/samples/generator.hpp"
#include "canyon/simulation/samples/path_interpolator.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::samples::multipath_samples_test {
namespace {

using geodesy::kSpeedOfLight;
constexpr double kTwoPi = 2 * geodesy::kPi;
constexpr double kEcho = 0.5;  // amplitude relative to the direct path's

/// One satellite, its direct path, and the same later and weaker.
class Echo final : public disturbance::Disturbance {
 public:
  Echo(gnss::SatelliteId id, double excess_m) : id_(id), excess_m_(excess_m) {}
  void apply(const propagation::Antenna& /*antenna*/, propagation::Arrival& arrival) override {
    std::erase_if(arrival.views, [&](const auto& view) { return view.line.id != id_; });
    for (propagation::SatelliteView& view : arrival.views) {
      propagation::Path echo = view.paths.paths.front();
      echo.reflector = 1;
      echo.excess_m = excess_m_;
      echo.amplitude_factor = kEcho;
      view.paths.paths.push_back(echo);
    }
  }

 private:
  gnss::SatelliteId id_;
  double excess_m_;
};

class Keeper final : public simulation::EpochSink {
 public:
  Keeper(const simulation::Simulation& simulation, FrontEnd front_end)
      : generator(simulation.scenario().receivers[0].options, 1, {}, front_end) {}
  void write(const simulation::Epoch& epoch) override {
    if (epochs.empty() || epoch.truth.time - epochs.front().truth.time < 0.0499) epochs.push_back(epoch);
    generator.next(epoch, [this](const SampleBlock& block, std::size_t samples) {
      for (std::size_t n = 0; n < samples; ++n) values.emplace_back(block.re[n], block.im[n]);
    });
  }
  void finish() override {}
  Generator generator;
  std::vector<simulation::Epoch> epochs;  // the first two
  std::vector<std::complex<float>> values;
};

/// The delay at which early and late power are equal [m after the direct path], over the run's middle 16 ms.
class Correlator {
 public:
  Correlator(const simulation::Simulation& simulation, const Keeper& kept, const FrontEnd& front_end)
      : kept_(kept), rate_hz_(front_end.rate_hz) {
    const simulation::Epoch& first = kept.epochs.front();
    const gnss::Signal& signal = *first.observed.satellites.at(0).signal;
    line_ = orbit::line_of_sight(simulation.environment().sky(), first.observed.satellites.at(0).id,
                                 first.truth.time, first.truth_ecef);
    later_ = orbit::line_of_sight(simulation.environment().sky(), line_->id, first.truth.time + 0.1,
                                  first.truth_ecef);
    carrier_hz_ = signal.carrier_hz;
    Waveform waveform(line_->id, signal, first.truth.time);
    (void)waveform.read_symbols(simulation.navigation(), -1, 1);
    slot_rate_hz_ = waveform.slot_rate_hz();
    group_delay_s_ = line_->state.group_delay_of(signal);
    base_ = static_cast<std::int64_t>(-0.11 * slot_rate_hz_);
    waveform.send(base_, static_cast<std::size_t>(0.3 * slot_rate_hz_), slots_);
  }
  /// Power of a replica with this delay relative to the direct path.
  [[nodiscard]] double power(double distance_m) const {
    std::complex<double> sum;
    const auto half = static_cast<std::size_t>(0.008 * rate_hz_);
    const std::size_t middle = kept_.values.size() / 2;
    for (std::size_t n = middle - half; n < middle + half; ++n) {
      const double t = static_cast<double>(n) / rate_hz_;
      const double delay_s = direct_s(t);
      const auto slot = static_cast<std::int64_t>(
          std::floor((t - delay_s - group_delay_s_ - distance_m / kSpeedOfLight) * slot_rate_hz_));
      sum += std::complex<double>(kept_.values[n]) *
             static_cast<double>(slots_.re[static_cast<std::size_t>(slot - base_)]) *
             std::polar(1.0, kTwoPi * std::remainder(delay_s * carrier_hz_, 1));
    }
    return std::norm(sum);
  }
  [[nodiscard]] double rests_at(double spacing_m) const {
    double low = -spacing_m, high = spacing_m;
    while (high - low > 0.2) {
      const double middle = (low + high) / 2;
      (power(middle - spacing_m / 2) > power(middle + spacing_m / 2) ? high : low) = middle;
    }
    return (low + high) / 2;
  }

 private:
  /// Linear within a tenth of a second: 0.2 m/s^2 give 0.2 mm.
  [[nodiscard]] double direct_s(double t) const {
    const auto delay = [](const orbit::LineOfSight& line) {
      return line.range_m / kSpeedOfLight - line.state.clock_bias_s;
    };
    return delay(*line_) + (delay(*later_) - delay(*line_)) * t / 0.1;
  }
  const Keeper& kept_;
  double rate_hz_, carrier_hz_ = 0, slot_rate_hz_ = 0, group_delay_s_ = 0;
  std::optional<orbit::LineOfSight> line_, later_;
  std::int64_t base_ = 0;
  Slots slots_;
};

TEST(MultipathSamples, CodeErrorsAreThoseOfTheCodeLoopsModel) {
  const double wavelength = kSpeedOfLight / gnss::kL1_hz;
  const double chip_m = kSpeedOfLight / 1.023e6;
  for (const double about_m : {20.0, 150.0, 260.0, 330.0}) {
    for (const double rotation : {0.0, 0.5}) {
      const double excess_m = (std::round(about_m / wavelength) + rotation) * wavelength;
      simulation::Scenario scenario = simulation::parse_scenario(
          "city: {open: true, origin: {latitude_deg: 48, longitude_deg: 11, height_m: 500}}\n"
          "sky: {nominal: true, systems: [GPS], errors: {enabled: false}}\n"
          "start: 2026-06-01T08:00:00Z\nrate_hz: 20\nduration_s: 0.1\n"
          "trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2}], hold_s: 1}\n"
          "receivers: [{name: rx, signal: {enabled: true}}]\n",
          "test.yaml");
      scenario.receivers[0].disturbances.push_back(
          {"echo", [excess_m](std::uint64_t, const std::string&) {
             return std::make_unique<Echo>(gnss::SatelliteId{gnss::System::GPS, 15}, excess_m);
           }});
      city::City city;
      city.frame = geodesy::LocalFrame(*scenario.city.origin);
      const simulation::Simulation simulation(scenario, std::move(city));
      FrontEnd front_end;
      front_end.rate_hz = 20.0113e6;  // samples at many positions in the chips
      front_end.noise = false;
      Keeper kept(simulation, front_end);
      (void)simulation.run({&kept});
      const Correlator correlator(simulation, kept, front_end);
      for (const double spacing_chips : {0.5, 0.1}) {
        tracking::DllOptions loop;
        loop.spacing_chips = spacing_chips;
        const tracking::CodeTracker model({}, loop);
        const std::array<tracking::SignalPath, 2> paths{tracking::SignalPath{0, 1, 0},
                                                        {excess_m, std::polar(kEcho, -kTwoPi * rotation), 0}};
        const double expected_m = model.lock(paths, 0.0)->delay_m;
        // The model's codes have no sidelobes; this one's are 6 % of the peak, one chip away.
        const bool neighbour = excess_m + spacing_chips / 2 * chip_m > chip_m;
        EXPECT_NEAR(correlator.rests_at(spacing_chips * chip_m), expected_m, neighbour ? 2.5 : 0.8)
            << excess_m << " m, turned by " << rotation << ", spacing " << spacing_chips;
      }
    }
  }
}

}  // namespace
}  // namespace canyon::samples::multipath_samples_test
