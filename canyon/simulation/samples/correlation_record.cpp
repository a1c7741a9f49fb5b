#include "canyon/simulation/samples/correlation_record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/paths/signal/path_strength.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::samples {
namespace {

const gnss::Signal& signal_of(const CorrelationRecord::Options& options) {
  const auto signals = gnss::signals_of(options.satellite.system);
  if (options.signal.empty()) return signals.front();
  std::string names;
  for (const gnss::Signal& signal : signals) {
    if (signal.name == options.signal) return signal;
    names += (names.empty() ? "" : ", ") + std::string(signal.name);
  }
  throw InputError(fmt::format("{} sends no signal '{}'", gnss::to_string(options.satellite), options.signal),
                   "its system has " + names);
}

tracking::CorrelationOptions shape_of(const gnss::Signal& signal, double bandwidth_hz) {
  tracking::CorrelationOptions shape;
  shape.modulation = signal.modulation;
  shape.chip_rate_hz = signal.chip_rate_hz;
  shape.bandwidth_hz = bandwidth_hz;
  return shape;
}

}  // namespace

CorrelationRecord::CorrelationRecord(const simulation::Simulation& simulation, Options options)
    : simulation_(&simulation),
      options_(std::move(options)),
      signal_(&signal_of(options_)),
      correlation_(shape_of(*signal_, options_.bandwidth_hz)) {
  const auto& receivers = simulation.scenario().receivers;
  if (options_.receiver >= receivers.size())
    throw InputError(fmt::format("the scenario has no receiver {}", options_.receiver));
  const auto satellites = simulation.environment().sky().satellites();
  if (std::find(satellites.begin(), satellites.end(), options_.satellite) == satellites.end()) {
    throw InputError(fmt::format("the sky has no satellite {}", gnss::to_string(options_.satellite)),
                     "satellites.csv of canyon simulate lists its satellites");
  }
  series_.satellite = options_.satellite;
  series_.signal = signal_->name;
  series_.receiver = receivers[options_.receiver].options.name;
  series_.delays_m = options_.delays_m;
  if (series_.delays_m.empty()) {
    constexpr int kSteps = 300;
    for (int i = 0; i <= kSteps; ++i)
      series_.delays_m.push_back((3.0 * i / kSteps - 1) * correlation_.chip_m());
  }
  const bool ascend = std::adjacent_find(series_.delays_m.begin(), series_.delays_m.end(),
                                         std::greater_equal<>()) == series_.delays_m.end();
  const bool finite = std::all_of(series_.delays_m.begin(), series_.delays_m.end(),
                                  [](double delay) { return std::abs(delay) <= 1e6; });
  if (!ascend || !finite) throw InputError("the delays are not ascending or exceed 1000 km", "give metres");
}

void CorrelationRecord::write(const simulation::Epoch& epoch) {
  if (epoch.receiver != options_.receiver) return;
  CorrelationSeries::Instant& instant = series_.instants.emplace_back();
  instant.time_s = epoch.observed.time - simulation_->begin();
  instant.values.assign(series_.delays_m.size(), 0);
  for (const receiver::SatelliteObservation& seen : epoch.observed.satellites) {
    if (seen.id != options_.satellite) continue;
    const auto take = [&](const receiver::SignalObservation& signal) {
      if (signal.signal == signal_ && signal.lock == tracking::LockState::Tracking)
        instant.measured_m = signal.excess_m;
    };
    seen.for_each_signal(take);
  }
  const auto& views = epoch.arrival->views;
  const auto view = std::find_if(views.begin(), views.end(), [&](const propagation::SatelliteView& each) {
    return each.line.id == options_.satellite;
  });
  if (view == views.end()) return;
  const receiver::ReceiverOptions& of = simulation_->scenario().receivers[options_.receiver].options;
  std::vector<std::complex<double>> amplitudes;
  signal::path_amplitudes(*view, gnss::carrier_hz(*signal_, view->line.state.carrier_frequency_hz),
                          of.signal.antenna, of.signal.strength, amplitudes);
  for (std::size_t i = 0; i < amplitudes.size(); ++i) {
    const double excess_m = view->paths.paths[i].excess_m;
    for (std::size_t k = 0; k < series_.delays_m.size(); ++k) {
      instant.values[k] +=
          amplitudes[i] * correlation_.value((series_.delays_m[k] - excess_m) / correlation_.chip_m());
    }
  }
}

}  // namespace canyon::samples
