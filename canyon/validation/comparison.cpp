#include "canyon/validation/comparison.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <complex>
#include <set>
#include <span>
#include <utility>

#include "canyon/city/city.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/signal/path_strength.hpp"
#include "canyon/simulation/ordered_blocks.hpp"
#include "canyon/simulation/scenario.hpp"
#include "canyon/validation/moved_city.hpp"
#include "canyon/validation/segments.hpp"

namespace canyon::validation {
namespace {

using propagation::PathKind;
using propagation::Visibility;

bool is_clear(Visibility visibility) {
  return visibility == Visibility::LOS || visibility == Visibility::LOSMultipath;
}

class Comparer {
 public:
  Comparer(const Recording& recording, const simulation::ReceiverConfig& receiver,
           const simulation::Environment& environment, const Registration& registration, std::uint64_t seed)
      : recording_(recording),
        environment_(environment),
        registration_(registration),
        options_(long_since_on(receiver.options)),
        propagator_(environment.make_propagator(receiver.propagation)),
        receiver_(options_, seed, receiver.disturbances),
        ecef_from_map_(environment.city().frame.ecef_from_local_rotation() *
                       Eigen::AngleAxisd(registration.heading_rad, Eigen::Vector3d::UnitZ())),
        clear_(recording.residuals.observations.size(), 0) {
    assert(recording.places.size() == recording.residuals.epochs.size());
    assert(recording.measurements.size() == recording.residuals.epochs.size());
    std::set<gnss::System> observed;
    for (const PseudorangeResidual& o : recording.residuals.observations) observed.insert(o.id.system);
    for (const gnss::SatelliteId id : environment.sky().satellites()) {
      if (observed.count(id.system) != 0) satellites_.push_back(id);
    }
  }

  /// The pure part: thread-safe.
  [[nodiscard]] propagation::Arrival trace(std::size_t e) const {
    const ResidualEpoch& epoch = recording_.residuals.epochs[e];
    // A product of two rotations turns to unit length but for rounding.
    const auto trace_unit = [this](const Eigen::Vector3d& antenna,
                                   std::span<const Eigen::Vector3d> directions,
                                   std::span<propagation::SatellitePaths> result) {
      std::vector<Eigen::Vector3d> unit(directions.begin(), directions.end());
      for (Eigen::Vector3d& direction : unit) direction.normalize();
      propagator_.trace(antenna, unit, result);
    };
    return simulation::make_arrival(environment_.sky(), satellites_, environment_.scene(),
                                    {epoch.reception, epoch.antenna_ecef, place(e), ecef_from_map_},
                                    trace_unit);
  }

  /// The part with memory: epochs in order.
  void observe(std::size_t e, propagation::Arrival& arrival) {
    const ResidualEpoch& epoch = recording_.residuals.epochs[e];
    const Eigen::Vector3d velocity_ecef =
        environment_.city().frame.ecef_from_local_rotation() * recording_.places[e].velocity_enu_mps;
    const receiver::ReceiverEpoch observed =
        receiver_.observe({{epoch.reception, epoch.antenna_ecef, velocity_ecef},
                           arrival,
                           environment_.sky(),
                           environment_.klobuchar()});
    const std::vector<propagation::SatelliteView>& views = arrival.views;
    assert(observed.satellites.size() == views.size());

    ComparedEpoch& compared = result_.epochs.emplace_back();
    compared.time = epoch.reception;
    compared.place_enu_m = place(e);
    compared.first = result_.satellites.size();
    compared.simulated = fix_error(observed.fix, epoch);
    for (std::size_t i = 0; i < views.size(); ++i) {
      const receiver::SatelliteObservation& o = observed.satellites[i];
      if (o.above_mask) result_.satellites.push_back(simulated_part(views[i], o));
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

  /// What was measured, beside it.
  Comparison finish() {
    std::size_t next = 0;
    const PseudorangeErrors errors = remove_receiver_clock(
        recording_.residuals,
        [&](const PseudorangeResidual&, const ResidualEpoch&) { return clear_[next++] != 0; });
    for (std::size_t e = 0; e < result_.epochs.size(); ++e) add_measured(e, errors);

    std::vector<Eigen::Vector3d> places;
    for (const Recording::Place& p : recording_.places) places.push_back(p.enu_m);
    result_.segments = street_segments(places);
    for (std::size_t s = 0; s < result_.segments.size(); ++s) {
      const Segment& segment = result_.segments[s];
      for (std::size_t e = segment.first; e < segment.first + segment.count; ++e)
        result_.epochs[e].segment = s;
    }
    result_.registration = registration_;
    return std::move(result_);
  }

 private:
  static receiver::ReceiverOptions long_since_on(receiver::ReceiverOptions options) {
    options.signal.lock.warm_start = true;
    options.filter.enabled = false;
    // A recording states no sigmas.
    if (options.fix.weights.weighting == positioning::Weighting::Sigma) {
      options.fix.weights.weighting = positioning::Weighting::Equal;
    }
    return options;
  }

  [[nodiscard]] Eigen::Vector3d place(std::size_t e) const {
    return place_in_moved_city(recording_, environment_.scene(), registration_, e);
  }

  [[nodiscard]] static ComparedFix fix_error(const positioning::Fix& fix, const ResidualEpoch& epoch) {
    ComparedFix compared;
    compared.solved = fix.solved();
    if (!compared.solved) return compared;
    compared.error_enu_m =
        geodesy::enu_from_ecef_rotation(epoch.antenna) * (fix.position_ecef - epoch.antenna_ecef);
    compared.used = static_cast<int>(fix.used.size());
    return compared;
  }

  [[nodiscard]] ComparedSatellite simulated_part(const propagation::SatelliteView& view,
                                                 const receiver::SatelliteObservation& o) const {
    assert(view.line.id == o.id);
    ComparedSatellite s;
    s.id = o.id;
    s.azimuth_rad = o.azimuth_rad;
    s.elevation_rad = o.elevation_rad;
    s.visibility = view.paths.visibility;
    s.clear = is_clear(s.visibility);
    s.simulated = o.measurement.has_value();
    if (s.simulated) {
      s.simulated_error_m = o.pseudorange_error_m;
      // As the receiver states it, where it does.
      s.simulated_cn0_dbhz = o.measurement->cn0_dbhz ? o.measurement->cn0_dbhz : o.cn0_dbhz;
    }
    s.used_simulated = o.used;
    if (s.visibility == Visibility::NLOS) s.prediction = predict(view, o);
    return s;
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
      if (error.gross) continue;
      measurements.push_back(recording_.measurements[e][i]);
      const PseudorangeResidual& o = recording_.residuals.observations[epoch.first + i];
      ComparedSatellite* s = satellite(o.id);
      if (s == nullptr) continue;
      s->measured = true;
      if (compared.clock != ClockSource::None) s->measured_error_m = error.error_m;
      s->measured_cn0_dbhz = o.cn0_dbhz;
    }
    positioning::FixOptions fix_options = options_.fix;
    fix_options.correct_ionosphere = recording_.ionosphere;
    fix_options.correct_troposphere = recording_.troposphere;
    const positioning::Fix fix = positioning::solve_fix(epoch.receiver_time, measurements, environment_.sky(),
                                                        fix_options, environment_.klobuchar());
    compared.measured = fix_error(fix, epoch);
    for (const gnss::SatelliteId id : fix.used) {
      if (ComparedSatellite* s = satellite(id)) s->used_measured = true;
    }
  }

  const Recording& recording_;
  const simulation::Environment& environment_;
  Registration registration_;
  receiver::ReceiverOptions options_;
  propagation::Propagator propagator_;
  receiver::Receiver receiver_;
  Eigen::Matrix3d ecef_from_map_;  ///< rotation, of the moved map
  std::vector<gnss::SatelliteId> satellites_;
  std::vector<std::uint8_t> clear_;  ///< by residual observation
  Comparison result_;
};

}  // namespace

Eigen::Vector3d Registration::place_in_city(const Eigen::Vector3d& enu) const {
  const Eigen::Vector2d moved =
      Eigen::Rotation2Dd(-heading_rad) * (enu.head<2>() - pivot - Eigen::Vector2d(east_m, north_m)) + pivot;
  return {moved.x(), moved.y(), enu.z()};
}

Eigen::Vector3d Registration::direction_in_city(const Eigen::Vector3d& enu) const {
  const Eigen::Vector2d turned = Eigen::Rotation2Dd(-heading_rad) * enu.head<2>();
  return {turned.x(), turned.y(), enu.z()};
}

Registration Registration::then(double more_east_m, double more_north_m, double more_heading_rad,
                                const Eigen::Vector2d& about) const {
  const Eigen::Vector2d offset =
      Eigen::Rotation2Dd(more_heading_rad) * (pivot + Eigen::Vector2d(east_m, north_m) - about) + about +
      Eigen::Vector2d(more_east_m, more_north_m) - pivot;
  return {offset.x(), offset.y(), heading_rad + more_heading_rad, pivot};
}

Eigen::Vector3d place_in_moved_city(const Recording& recording, const raytrace::RayScene& scene,
                                    const Registration& registration, std::size_t epoch) {
  Eigen::Vector3d place = registration.place_in_city(recording.places[epoch].enu_m);
  if (recording.antenna_above_terrain_m) {
    // Beyond the map's edge the height of the unmoved city stays.
    if (const auto terrain = scene.terrain_height(place.x(), place.y())) {
      place.z() = *terrain + *recording.antenna_above_terrain_m;
    }
  }
  return place;
}

Comparison compare(const Recording& recording, const simulation::ReceiverConfig& receiver,
                   const simulation::Environment& environment, const Registration& registration,
                   std::uint64_t seed, const CompareOptions& options) {
  Comparer comparer(recording, receiver, environment, registration, seed);
  const std::size_t count = recording.residuals.epochs.size();
  const auto running = [] { return true; };
  simulation::for_each_in_order<propagation::Arrival>(
      count, 32, options.threads, running, [&](std::size_t e) { return comparer.trace(e); },
      [&](std::size_t e, propagation::Arrival& arrival) {
        comparer.observe(e, arrival);
        if (options.progress) options.progress(e + 1, count);
      });
  Comparison comparison = comparer.finish();
  comparison.name = options.name;
  return comparison;
}

}  // namespace canyon::validation
