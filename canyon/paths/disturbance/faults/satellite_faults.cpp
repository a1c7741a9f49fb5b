#include "canyon/paths/disturbance/faults/satellite_faults.hpp"

#include <cmath>
#include <utility>

#include "canyon/base/options/visitor.hpp"
#include "canyon/base/statistics.hpp"

namespace canyon::disturbance {
namespace {

/// The path comes from the satellite itself, not from a transmitter with copies.
bool from_satellite(const propagation::Path& path) {
  return path.kind != propagation::PathKind::Transmitted;
}

orbit::MessageError unhealthy() {
  orbit::MessageError error;
  error.unhealthy = true;
  return error;
}

orbit::MessageError error_of(const EphemerisOptions& o, geodesy::GpsTime begin) {
  orbit::MessageError error;
  error.orbit_m = {o.radial_m, o.along_m, o.cross_m};
  error.orbit_rate_mps = {o.radial_mps, o.along_mps, o.cross_mps};
  if (o.clock_in == ClockFault::Message) {
    error.clock_s = o.clock_offset_s;
    error.clock_drift = o.clock_drift;
  }
  error.since = begin;
  return error;
}

}  // namespace

void visit(options::Visitor& v, OutageOptions& o) {
  static constexpr std::string_view kModes[]{"silent", "unhealthy"};
  visit_satellites(v, o.satellites);
  v.choice({"mode", "", "silent (no signals) or unhealthy (signals continue, flagged as unusable)"}, o.mode,
           kModes);
}

void visit(options::Visitor& v, EphemerisOptions& o) {
  static constexpr std::string_view kStages[]{"message", "signal"};
  constexpr options::Range kOrbit{-1e6, 1e6}, kRate{-1e3, 1e3};
  visit_satellites(v, o.satellites);
  v.number({"radial_m", "m", "position in the message minus the true one, outwards"}, o.radial_m, kOrbit);
  v.number({"along_m", "m", "along the orbit"}, o.along_m, kOrbit);
  v.number({"cross_m", "m", "across the orbit, in the direction of its angular momentum"}, o.cross_m, kOrbit);
  v.number({"radial_mps", "m/s", "growth of radial_m from the fault's start"}, o.radial_mps, kRate);
  v.number({"along_mps", "m/s", "growth of along_m"}, o.along_mps, kRate);
  v.number({"cross_mps", "m/s", "growth of cross_m"}, o.cross_mps, kRate);
  v.number({"clock_offset_s", "s", "error of the satellite's clock: 1e-7 s are 30 m"}, o.clock_offset_s,
           {-1e-2, 1e-2});
  v.number({"clock_drift", "s/s", "growth of that error from the fault's start"}, o.clock_drift,
           {-1e-6, 1e-6});
  v.choice({"clock_in", "",
            "message (the clock is right, its message is wrong) or signal (the clock drifts, the message "
            "does not contain it)"},
           o.clock_in, kStages);
}

void visit(options::Visitor& v, ScintillationOptions& o) {
  visit_satellites(v, o.satellites);
  v.number({"s4", "", "standard deviation of the power over its mean; Nakagami m = 1/S4^2"}, o.s4, {0, 1.4});
  v.number({"sigma_phi_rad", "rad", "standard deviation of the carrier's phase at L1"}, o.sigma_phi_rad,
           {0, 10});
  v.number({"correlation_s", "s", "correlation time of the amplitude, to 1/e"}, o.correlation_s,
           {0, 1000, true});
  v.number({"phase_correlation_s", "s", "correlation time T of the phase: (1 + t/T) exp(-t/T)"},
           o.phase_correlation_s, {0, 1000, true});
}

MessageFault::MessageFault(SatelliteSet satellites, const orbit::MessageError& error)
    : concerned_([set = std::move(satellites)](gnss::SatelliteId id) { return holds(set, id); }),
      error_(error) {}

void MessageFault::apply(propagation::Arrival& arrival, const std::shared_ptr<const orbit::Sky>& truth) {
  const std::shared_ptr<const orbit::Sky> reported = arrival.broadcast ? arrival.broadcast : truth;
  if (reported != sky_) {
    sky_ = reported;
    wrong_sky_ = std::make_shared<orbit::FaultySky>(reported, concerned_, error_);
  }
  arrival.broadcast = wrong_sky_;
  if (!arrival.messages) return;
  if (arrival.messages != messages_) {
    messages_ = arrival.messages;
    wrong_messages_ =
        std::make_shared<gnss::NavigationData>(orbit::wrong_messages(*messages_, concerned_, error_));
  }
  arrival.messages = wrong_messages_;
}

Outage::Outage(const OutageOptions& options, const FaultContext& context)
    : options_(options), truth_(context.sky), unhealthy_(options.satellites, unhealthy()) {}

void Outage::apply(const propagation::Antenna& /*antenna*/, propagation::Arrival& arrival) {
  if (options_.mode == OutageMode::Unhealthy) return unhealthy_.apply(arrival, truth_);
  for (propagation::SatelliteView& view : arrival.views) {
    if (!holds(options_.satellites, view.line.id)) continue;
    std::erase_if(view.paths.paths, from_satellite);
  }
}

EphemerisFault::EphemerisFault(const EphemerisOptions& options, const FaultContext& context)
    : options_(options),
      begin_(context.begin),
      truth_(context.sky),
      message_(options.satellites, error_of(options, context.begin)) {}

void EphemerisFault::apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) {
  message_.apply(arrival, truth_);
  if (options_.clock_in == ClockFault::Message) return;
  for (propagation::SatelliteView& view : arrival.views) {
    if (!holds(options_.satellites, view.line.id)) continue;
    view.line.state.clock_bias_s += options_.clock_offset_s + options_.clock_drift * (antenna.time - begin_);
    view.line.state.clock_drift += options_.clock_drift;
  }
}

Scintillation::Scintillation(const ScintillationOptions& options, const FaultContext& context)
    : options_(options), seed_(context.seed), key_(context.receiver + "/scintillation/" + context.name) {}

Scintillation::SignalState& Scintillation::state_of(gnss::SatelliteId id, geodesy::GpsTime time) {
  const auto found = states_.find(id);
  if (found == states_.end()) {
    SignalState route{RandomStream(seed_, key_ + "/" + gnss::to_string(id)), time};
    route.amplitude_normal = route.stream.normal();
    route.phase = {route.stream.normal(), route.stream.normal() / options_.phase_correlation_s};
    return states_.emplace(id, route).first->second;
  }
  SignalState& route = found->second;
  const double dt = time - route.last;
  route.last = time;
  const double kept = std::exp(-dt / options_.correlation_s);
  route.amplitude_normal = kept * route.amplitude_normal + std::sqrt(1 - kept * kept) * route.stream.normal();
  // x'' + 2 b x' + b^2 x = white noise, unit variance of x: the transition over dt, and its difference from
  // the stationary covariance diag(1, b^2).
  const double b = 1 / options_.phase_correlation_s;
  Eigen::Matrix2d step;
  step << 1 + b * dt, dt, -b * b * dt, 1 - b * dt;
  step *= std::exp(-b * dt);
  Eigen::Matrix2d covariance = Eigen::Vector2d(1, b * b).asDiagonal();
  covariance -= (step * covariance * step.transpose()).eval();
  const double first = std::sqrt(std::max(0.0, covariance(0, 0)));
  const double along = first > 0 ? covariance(1, 0) / first : 0;
  const double n0 = route.stream.normal(), n1 = route.stream.normal();
  route.phase = (step * route.phase).eval();
  route.phase += Eigen::Vector2d(
      first * n0, along * n0 + std::sqrt(std::max(0.0, covariance(1, 1) - along * along)) * n1);
  return route;
}

double Scintillation::power(double normal) const {
  if (options_.s4 < 1e-3) return 1;
  const double m = 1 / (options_.s4 * options_.s4);
  // The smaller tail keeps its digits.
  const double tail = normal_probability(-std::abs(normal));
  return (normal < 0 ? gamma_quantile(m, tail) : gamma_quantile_above(m, tail)) / m;
}

void Scintillation::apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) {
  for (propagation::SatelliteView& view : arrival.views) {
    if (!holds(options_.satellites, view.line.id)) continue;
    const SignalState& here = state_of(view.line.id, antenna.time);
    const double amplitude = std::sqrt(power(here.amplitude_normal));
    for (propagation::Path& path : view.paths.paths)
      if (from_satellite(path)) path.amplitude_factor *= amplitude;
    view.carrier_phase_offset_rad += options_.sigma_phi_rad * here.phase.x();
    view.carrier_phase_rate_radps += options_.sigma_phi_rad * here.phase.y();
  }
}

}  // namespace canyon::disturbance
