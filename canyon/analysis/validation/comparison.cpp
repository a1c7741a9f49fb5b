#include "canyon/analysis/validation/comparison.hpp"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <complex>
#include <map>
#include <memory>
#include <utility>

#include "canyon/analysis/validation/statistics.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/named.hpp"
#include "canyon/city/city.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/paths/signal/path_strength.hpp"
#include "canyon/receiver/positioning/position_filter.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/ordered_blocks.hpp"
#include "canyon/simulation/receiver_surroundings.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::validation {
namespace {

using propagation::Visibility;

bool is_clear(Visibility visibility) {
  return visibility == Visibility::LOS || visibility == Visibility::LOSMultipath;
}

bool among(const std::vector<const gnss::Signal*>& signals, const gnss::Signal* signal) {
  return std::find(signals.begin(), signals.end(), signal) != signals.end();
}

/// Phase minus the terms of geometry, satellite and atmosphere, as in PseudorangeResidual.
ComparedPhase simulated_phase(const orbit::LineOfSight& line, const receiver::SignalObservation& o) {
  const positioning::Measurement& m = *o.measurement;
  if (!m.carrier_phase_cycles) return {};
  const double phase_m = *m.carrier_phase_cycles * (geodesy::kSpeedOfLight / m.carrier_frequency_hz);
  return {(phase_m - line.range_m) + geodesy::kSpeedOfLight * line.state.clock_bias_s +
              o.term_m(receiver::RangeTermId::Ionosphere) - o.term_m(receiver::RangeTermId::Troposphere),
          false};
}

class Comparer {
 public:
  Comparer(const Recording& recording, const simulation::ReceiverConfig& receiver,
           const simulation::Environment& environment, const Registration& registration, std::uint64_t seed,
           const CompareOptions& options)
      : recording_(recording),
        environment_(environment),
        registration_(registration),
        options_(long_since_on(
            simulation::with_surroundings(receiver, environment.scene(), environment.city(), seed))),
        propagator_(environment.make_propagator(receiver.propagation)),
        receiver_(options_, seed, simulation::with_streets(receiver, environment.city(), road()),
                  receiver.models),
        ecef_from_map_(environment.city().frame.ecef_from_local_rotation() *
                       Eigen::AngleAxisd(registration.heading_rad, Eigen::Vector3d::UnitZ())),
        clear_(recording.residuals.observations.size(), 0) {
    assert(recording.antennas.size() == recording.residuals.epochs.size());
    assert(recording.measurements.size() == recording.residuals.epochs.size());
    std::set<const gnss::Signal*> observed;
    for (const PseudorangeResidual& o : recording.residuals.observations) observed.insert(o.signal);
    for (const PseudorangeResidual& o : recording.residuals.further) observed.insert(o.signal);
    for (const gnss::System system : gnss::kAllSystems) {
      const std::size_t before = result_.recorded.size();
      for (const gnss::Signal& signal : gnss::signals_of(system))
        if (observed.count(&signal) != 0) result_.recorded.push_back(&signal);
      if (result_.recorded.size() == before) continue;
      for (const gnss::Signal* signal : receiver::tracked_signals(options_.tracks, system))
        result_.tracked.push_back(signal);
    }
    for (const gnss::SatelliteId id : environment.sky().satellites())
      if (has_system(result_.recorded, id.system) && options.leave_out.count(id) == 0)
        satellites_.push_back(id);
    result_.name = options.name;
    result_.filtered = options_.filter.enabled;
    if (result_.filtered) filter_.emplace(options_.filter, recorded_fix_options());
  }

  /// The pure part: thread-safe.
  [[nodiscard]] propagation::Arrival trace(std::size_t e) const {
    const ResidualEpoch& epoch = recording_.residuals.epochs[e];
    propagation::Arrival arrival =
        simulation::make_arrival(environment_.sky(), satellites_, environment_.scene(),
                                 {epoch.reception, epoch.antenna_ecef, position(e), ecef_from_map_});
    simulation::add_paths(arrival, [this](const auto& antenna, const auto& towards, auto paths) {
      std::vector<Eigen::Vector3d> directions(towards.begin(), towards.end());
      // A product of two rotations preserves the unit length up to rounding.
      for (Eigen::Vector3d& direction : directions) direction.normalize();
      propagator_.trace(antenna, directions, paths);
    });
    environment_.add_errors(arrival, epoch.reception, epoch.antenna_ecef);
    return arrival;
  }

  /// The part with state: epochs in order.
  void observe(std::size_t e, propagation::Arrival& arrival) {
    const ResidualEpoch& epoch = recording_.residuals.epochs[e];
    const Eigen::Vector3d velocity_ecef =
        environment_.city().frame.ecef_from_local_rotation() * recording_.antennas[e].velocity_enu_mps;
    const receiver::ReceiverEpoch observed =
        receiver_.observe({{epoch.reception, epoch.antenna_ecef, velocity_ecef},
                           arrival,
                           environment_.sky(),
                           environment_.klobuchar()});
    const std::vector<propagation::SatelliteView>& views = arrival.views;

    ComparedEpoch& compared = result_.epochs.emplace_back();
    compared.time = epoch.reception;
    compared.position_enu_m = position(e);
    compared.first = result_.satellites.size();
    const positioning::Fix& single = observed.single_epoch;
    compared.fix.simulated = fix_error(single, epoch);
    if (result_.filtered) compared.filter.simulated = fix_error(observed.fix, epoch);
    // Both ascend; systems that the receiver does not track are only in the views.
    auto satellite_value = views.begin();
    for (const receiver::SatelliteObservation& o : observed.satellites) {
      while (satellite_value->line.id < o.id) ++satellite_value;
      if (!o.above_mask) continue;
      ComparedSatellite& s = result_.satellites.emplace_back(simulated_part(*satellite_value, o));
      s.used.simulated = std::binary_search(single.used.begin(), single.used.end(), s.id);
    }
    compared.count = result_.satellites.size() - compared.first;

    for (std::size_t i = epoch.first; i < epoch.first + epoch.count; ++i) {
      const gnss::SatelliteId id = recording_.residuals.observations[i].id;
      const auto view = std::lower_bound(
          views.begin(), views.end(), id,
          [](const propagation::SatelliteView& v, gnss::SatelliteId wanted) { return v.line.id < wanted; });
      clear_[i] = view != views.end() && view->line.id == id && is_clear(view->paths.visibility);
    }
  }

  /// Adds the measured part.
  Comparison finish() {
    std::size_t next = 0;
    const PseudorangeErrors errors = remove_receiver_clock(
        recording_.residuals,
        [&](const PseudorangeResidual&, const ResidualEpoch&) { return clear_[next++] != 0; });
    for (std::size_t e = 0; e < result_.epochs.size(); ++e) add_measured(e, errors);
    remove_simulated_clock();
    remove_biases();

    std::vector<Eigen::Vector3d> points;
    for (const Recording::AntennaTrack& p : recording_.antennas) points.push_back(p.enu_m);
    result_.segments = street_segments(points);
    for (std::size_t s = 0; s < result_.segments.size(); ++s) {
      const StreetSegment& segment = result_.segments[s];
      for (std::size_t e = segment.first; e < segment.first + segment.count; ++e)
        result_.epochs[e].segment = s;
    }
    result_.registration = registration_;
    return std::move(result_);
  }

 private:
  static receiver::ReceiverOptions long_since_on(receiver::ReceiverOptions options) {
    options.signal.lock.warm_start = true;
    // A recording has no sigmas.
    if (options.fix.weights.weighting == positioning::Weighting::Sigma)
      options.fix.weights.weighting = positioning::Weighting::Equal;
    return options;
  }

  [[nodiscard]] positioning::FixOptions recorded_fix_options() const {
    positioning::FixOptions options = options_.fix;
    options.correct_ionosphere = recording_.ionosphere;
    options.correct_troposphere = recording_.troposphere;
    return options;
  }

  /// In the map's frame, as the rays are.
  [[nodiscard]] std::shared_ptr<const disturbance::Road> road() const {
    auto road = std::make_shared<disturbance::Road>();
    for (std::size_t e = 0; e < recording_.residuals.epochs.size(); ++e)
      road->add(recording_.residuals.epochs[e].reception, position(e).head<2>());
    return road;
  }

  [[nodiscard]] Eigen::Vector3d position(std::size_t e) const {
    return recording_.point_in_map(environment_.scene(), registration_, e);
  }

  [[nodiscard]] static ComparedFix fix_error(const positioning::Fix& fix, const ResidualEpoch& epoch) {
    ComparedFix compared;
    compared.solved = fix.solved();
    if (!compared.solved) return compared;
    compared.error_enu_m =
        geodesy::enu_from_ecef_rotation(epoch.antenna) * (fix.position_ecef - epoch.antenna_ecef);
    compared.used = static_cast<int>(fix.used.size());
    compared.horizontal_sigma_m = std::sqrt(fix.covariance_enu(0, 0) + fix.covariance_enu(1, 1));
    compared.vertical_sigma_m = std::sqrt(fix.covariance_enu(2, 2));
    return compared;
  }

  [[nodiscard]] ComparedSatellite simulated_part(const propagation::SatelliteView& view,
                                                 const receiver::SatelliteObservation& o) const {
    assert(view.line.id == o.id);
    ComparedSatellite s;
    s.id = o.id;
    s.signal = gnss::signals_of(o.id.system).data();
    s.azimuth_rad = o.azimuth_rad;
    s.elevation_rad = o.elevation_rad;
    s.visibility = view.paths.visibility;
    s.clear = is_clear(s.visibility);
    if (s.visibility == Visibility::NLOS) s.prediction = predict(view, o);
    for (const gnss::Signal& signal : gnss::signals_of(o.id.system).subspan(1)) {
      if (!among(result_.recorded, &signal) && !among(result_.tracked, &signal)) continue;
      if (gnss::transmits(o.id, signal, view.line.transmit_time)) s.more.emplace_back().signal = &signal;
    }
    add_simulated(view.line, o, s);
    for (const receiver::SignalObservation& other : o.more) add_simulated(view.line, other, s);
    return s;
  }

  /// Adds one simulated signal to its satellite.
  void add_simulated(const orbit::LineOfSight& line, const receiver::SignalObservation& o,
                     ComparedSatellite& satellite) const {
    if (!o.measurement) return;
    // C/N0 as reported by the receiver, if it reports it.
    ComparedObservation& s = signal_of(satellite, o.signal).simulated;
    s = {true, o.pseudorange_error_m, o.measurement->cn0_dbhz ? o.measurement->cn0_dbhz : o.cn0_dbhz,
         simulated_phase(line, o)};
    const std::size_t e = result_.epochs.size() - 1;
    s.phase.slip =
        e > 0 && o.measurement->phase_since && *o.measurement->phase_since > result_.epochs[e - 1].time;
  }

  /// The satellite's entry for a signal, created if missing.
  static ComparedSignal& signal_of(ComparedSatellite& satellite, const gnss::Signal* signal) {
    if (signal == satellite.signal) return satellite;
    const auto at = std::lower_bound(
        satellite.more.begin(), satellite.more.end(), signal,
        [](const ComparedSignal& s, const gnss::Signal* wanted) { return s.signal < wanted; });
    if (at != satellite.more.end() && at->signal == signal) return *at;
    ComparedSignal fresh;
    fresh.signal = signal;
    return *satellite.more.insert(at, fresh);
  }

  static bool has_system(const std::vector<const gnss::Signal*>& signals, gnss::System system) {
    return std::any_of(signals.begin(), signals.end(),
                       [system](const gnss::Signal* signal) { return signal->system == system; });
  }

  [[nodiscard]] ComparedSatellite::Prediction predict(const propagation::SatelliteView& view,
                                                      const receiver::SatelliteObservation& o) const {
    const std::vector<propagation::Path>& paths = view.paths.paths;
    assert(!paths.empty());
    const propagation::Path* main = &*std::min_element(
        paths.begin(), paths.end(),
        [](const propagation::Path& a, const propagation::Path& b) { return a.excess_m < b.excess_m; });
    const tracking::SignalOptions& signal = options_.signal;
    if (!signal.enabled) return {main->kind, main->order, main->excess_m};
    std::vector<std::complex<double>> amplitudes;
    signal::path_amplitudes(view, view.line.state.carrier_frequency_hz, signal.antenna, signal.strength,
                            amplitudes);
    double strongest = -1;
    for (std::size_t i = 0; i < paths.size(); ++i) {
      const double amplitude = std::abs(amplitudes[i]);
      if (!(amplitude > strongest)) continue;
      strongest = amplitude;
      main = &paths[i];
    }
    return {main->kind, main->order, o.measurement ? o.excess_m : main->excess_m};
  }

  void add_measured(std::size_t e, const PseudorangeErrors& errors) {
    const ResidualEpoch& epoch = recording_.residuals.epochs[e];
    ComparedEpoch& compared = result_.epochs[e];
    compared.clock = errors.clocks[e].source;

    std::vector<positioning::Measurement> measurements;
    const std::span<ComparedSatellite> satellites(result_.satellites.data() + compared.first, compared.count);
    const auto satellite = [&satellites](gnss::SatelliteId id) -> ComparedSatellite* {
      const auto at = std::lower_bound(
          satellites.begin(), satellites.end(), id,
          [](const ComparedSatellite& s, gnss::SatelliteId wanted) { return s.id < wanted; });
      return at != satellites.end() && at->id == id ? &*at : nullptr;
    };
    for (std::size_t i = 0; i < epoch.count; ++i) {
      const PseudorangeError& error = errors.observations[epoch.first + i];
      const PseudorangeResidual& o = recording_.residuals.observations[epoch.first + i];
      // Fixes of both receivers use the same systems.
      if (error.gross || !has_system(result_.tracked, o.id.system)) continue;
      measurements.push_back(recording_.measurements[e][i]);
      if (ComparedSatellite* s = satellite(o.id)) add_measured(o, error.error_m, compared.clock, *s);
    }
    const double gross_m = ReceiverClockOptions{}.gross_m;
    for (std::size_t i = epoch.first_further; i < epoch.first_further + epoch.further; ++i) {
      const PseudorangeResidual& o = recording_.residuals.further[i];
      ComparedSatellite* s = satellite(o.id);
      if (s == nullptr) continue;
      const double error_m = o.residual_m - clock_of(errors, e, o.id.system);
      if (std::abs(error_m) > gross_m) continue;
      add_measured(o, error_m, compared.clock, signal_of(*s, o.signal));
    }
    const positioning::Fix fix = positioning::solve_fix(epoch.receiver_time, measurements, environment_.sky(),
                                                        recorded_fix_options(), environment_.klobuchar());
    compared.fix.measured = fix_error(fix, epoch);
    if (filter_) {
      compared.filter.measured = fix_error(filter_->update(epoch.receiver_time, measurements,
                                                           environment_.sky(), fix, environment_.klobuchar()),
                                           epoch);
    }
    for (const gnss::SatelliteId id : fix.used)
      if (ComparedSatellite* s = satellite(id)) s->used.measured = true;
  }

  static void add_measured(const PseudorangeResidual& o, double error_m, ClockSource clock,
                           ComparedSignal& s) {
    s.measured = {true, {}, o.cn0_dbhz, {o.phase_residual_m, o.lost_lock}};
    if (clock != ClockSource::None) s.measured.error_m = error_m;
  }

  /// Recorded errors are relative to a clock from satellites in clear view, which contains their common
  /// errors. This shifts the simulated ones likewise: their true clock is 0.
  void remove_simulated_clock() {
    PseudorangeResiduals residuals;
    std::vector<bool> clear;
    for (const ComparedEpoch& compared : result_.epochs) {
      ResidualEpoch epoch;
      epoch.receiver_time = compared.time;
      epoch.first = residuals.observations.size();
      for (std::size_t i = compared.first; i < compared.first + compared.count; ++i) {
        const ComparedSatellite& s = result_.satellites[i];
        if (!s.simulated.error_m) continue;
        PseudorangeResidual& o = residuals.observations.emplace_back();
        o.epoch = residuals.epochs.size();
        o.id = s.id;
        o.residual_m = *s.simulated.error_m;
        o.cn0_dbhz = s.simulated.cn0_dbhz;
        o.elevation_rad = s.elevation_rad;
        clear.push_back(s.clear);
      }
      epoch.count = residuals.observations.size() - epoch.first;
      if (epoch.count > 0) residuals.epochs.push_back(epoch);
    }
    if (residuals.epochs.empty()) return;
    std::size_t next = 0;
    const PseudorangeErrors errors = remove_receiver_clock(
        residuals, [&](const PseudorangeResidual&, const ResidualEpoch&) { return clear[next++]; });
    std::size_t k = 0;
    for (const ComparedEpoch& compared : result_.epochs) {
      if (k == residuals.epochs.size() || residuals.epochs[k].receiver_time != compared.time) continue;
      for (std::size_t i = compared.first; i < compared.first + compared.count; ++i) {
        ComparedSatellite& satellite = result_.satellites[i];
        const double clock_m = clock_of(errors, k, satellite.id.system);
        if (satellite.simulated.error_m) *satellite.simulated.error_m -= clock_m;
        for (ComparedSignal& s : satellite.more)
          if (s.simulated.error_m) *s.simulated.error_m -= clock_m;
      }
      ++k;
    }
  }

  /// The value around which an epoch's pseudoranges of a system are [m].
  static double clock_of(const PseudorangeErrors& errors, std::size_t epoch, gnss::System system) {
    const auto bias = errors.inter_system_bias_m.find(system);
    return errors.clocks[epoch].bias_m + (bias != errors.inter_system_bias_m.end() ? bias->second : 0);
  }

  /// Removes the bias of each further signal, measured and simulated.
  void remove_biases() {
    for (const Side side : kSides) {
      std::map<const gnss::Signal*, std::array<std::vector<double>, 2>> values;  // of all, of clear ones
      for (const ComparedSatellite& satellite : result_.satellites) {
        for (const ComparedSignal& s : satellite.more) {
          const std::optional<double>& error_m = s.of(side).error_m;
          if (!error_m) continue;
          values[s.signal][0].push_back(*error_m);
          if (satellite.clear) values[s.signal][1].push_back(*error_m);
        }
      }
      std::map<const gnss::Signal*, double> bias_m;
      for (const auto& [signal, of] : values) bias_m[signal] = *median(of[1].empty() ? of[0] : of[1]);
      for (ComparedSatellite& satellite : result_.satellites) {
        for (ComparedSignal& s : satellite.more)
          if (s.of(side).error_m) *s.of(side).error_m -= bias_m[s.signal];
      }
    }
  }

  const Recording& recording_;
  const simulation::Environment& environment_;
  Registration registration_;
  receiver::ReceiverOptions options_;
  propagation::Propagator propagator_;
  receiver::Receiver receiver_;
  Eigen::Matrix3d ecef_from_map_;                      ///< rotation, of the moved map
  std::optional<positioning::PositionFilter> filter_;  ///< of the recorded measurements
  std::vector<gnss::SatelliteId> satellites_;
  std::vector<std::uint8_t> clear_;  ///< by residual observation
  Comparison result_;
};

}  // namespace

Comparison compare(const Recording& recording, const simulation::ReceiverConfig& receiver,
                   const simulation::Environment& environment, const Registration& registration,
                   std::uint64_t seed, const CompareOptions& options) {
  const SeededReceiver one{&receiver, seed};
  return std::move(compare(recording, {&one, 1}, environment, registration, options).front());
}

std::vector<Comparison> compare(const Recording& recording, std::span<const SeededReceiver> receivers,
                                const simulation::Environment& environment, const Registration& registration,
                                const CompareOptions& options) {
  assert(!receivers.empty());
  std::vector<std::unique_ptr<Comparer>> comparers;
  for (const auto& [receiver, seed] : receivers) {
    comparers.push_back(
        std::make_unique<Comparer>(recording, *receiver, environment, registration, seed, options));
  }
  const std::size_t count = recording.residuals.epochs.size();
  tbb::task_arena arena(simulation::threads_of(options.threads));
  const auto for_each_receiver = [&](const auto& work) {
    arena.execute([&] { tbb::parallel_for(std::size_t{0}, comparers.size(), work); });
  };
  const auto running = [] { return true; };
  simulation::for_each_in_order<propagation::Arrival>(
      count, 32, options.threads, running, [&](std::size_t e) { return comparers.front()->trace(e); },
      [&](std::size_t e, const propagation::Arrival& arrival) {
        for_each_receiver([&](std::size_t i) {
          propagation::Arrival own = arrival;
          comparers[i]->observe(e, own);
        });
        if (options.progress) options.progress(e + 1, count);
      });
  std::vector<Comparison> results(comparers.size());
  for_each_receiver([&](std::size_t i) { results[i] = comparers[i]->finish(); });
  return results;
}

std::vector<NeverTracked> never_tracked(const Comparison& comparison, double elevation_rad, double clear_s) {
  const double interval_s = interval_of(comparison.epochs);
  std::map<gnss::SatelliteId, double> untracked_s;
  std::set<gnss::SatelliteId> tracked;
  for (const ComparedSatellite& s : comparison.satellites) {
    const auto recorded = [](const ComparedSignal& o) { return o.measured.tracked; };
    if (recorded(s) || std::any_of(s.more.begin(), s.more.end(), recorded)) tracked.insert(s.id);
    if (s.clear && s.elevation_rad >= elevation_rad) untracked_s[s.id] += interval_s;
  }
  std::vector<NeverTracked> result;
  for (const auto& [id, seconds] : untracked_s) {
    // A millisecond of tolerance for the rounding of sums of intervals.
    if (tracked.count(id) == 0 && seconds + 1e-3 >= clear_s) result.push_back({id, seconds});
  }
  return result;
}

std::vector<Model> cumulative_models(const simulation::ReceiverConfig& receiver) {
  simulation::ReceiverConfig step = receiver;
  propagation::PropagationOptions& paths = step.propagation;
  paths.model = propagation::Model::Mirror;
  paths.reflection_order = 1;
  paths.ground_reflection = paths.diffraction = paths.diffuse = false;
  step.options.signal.enabled = false;
  const bool shadowing = step.options.signal.shadowing.enabled;

  std::vector<Model> models;
  const auto add = [&](const char* key, const char* name) { models.push_back({key, name, step}); };
  add("mirror", "mirror (the paper's)");
  paths.model = propagation::Model::Specular;
  add("specular", "specular, first order");
  paths.reflection_order = 2;
  add("second", "+ second order");
  step.options.signal.enabled = true;
  step.options.signal.shadowing.enabled = false;
  add("tracking", "+ strength and tracking");
  paths.diffuse = true;
  add("diffuse", "+ diffuse scattering");
  paths.ground_reflection = true;
  add("ground", "+ ground reflection");
  step.options.signal.shadowing.enabled = true;
  add("shadowing", "+ shadowing");
  step.options.signal.shadowing.enabled = shadowing;
  paths.diffraction = true;
  add("diffraction", "+ diffraction");
  return models;
}

std::vector<Model> models_of(const simulation::ReceiverConfig& receiver,
                             const std::vector<std::string>& keys) {
  const std::vector<Model> ladder = cumulative_models(receiver);
  std::vector<std::string> known;
  for (const Model& model : ladder) known.push_back(model.key);
  for (const std::string& key : keys)
    if (std::find(known.begin(), known.end(), key) == known.end()) throw unknown_name("model", key, known);
  std::vector<Model> chosen;
  for (const Model& model : ladder)
    if (std::find(keys.begin(), keys.end(), model.key) != keys.end()) chosen.push_back(model);
  return chosen;
}

}  // namespace canyon::validation
