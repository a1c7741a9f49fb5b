#include "canyon/receiver/positioning/range_terms.hpp"

#include <cassert>
#include <cmath>
#include <iterator>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/receiver/tracking/channel.hpp"
#include "canyon/receiver/tracking/channel_fading.hpp"
#include "canyon/sky/range_errors.hpp"

namespace canyon::receiver {

namespace {

using geodesy::kSpeedOfLight;

CodeAndCarrier both(double value) {
  return {value, value};
}
CodeAndCarrier code_only(double value) {
  return {value, 0};
}
CodeAndCarrier carrier_only(double value) {
  return {0, value};
}

/// A phase rotation is given at L1, and scales on other carriers like a delay: metres per radian.
double metres_per_rad(double carrier_hz) {
  const double cycles_per_rad = gnss::kL1_hz / carrier_hz / (2 * geodesy::kPi);
  return cycles_per_rad * kSpeedOfLight / carrier_hz;
}

/// Inputs of the fix's models, at its own estimate of the position.
ModelState model_state(const RangeState& s) {
  const orbit::LineOfSight& line = s.view->line;
  return {&s.options->fix, s.klobuchar, &line.state,
          s.signal,        line.id,     s.carrier_hz,
          s.time,          s.position,  {line.azimuth_rad, line.elevation_rad}};
}

/// Delays by the receivers' correction models [m].
double modelled_m(const ModelState& s, bool ionosphere, bool troposphere) {
  return sky::atmosphere_m(ionosphere, troposphere, *s.klobuchar, s.id.system, s.carrier_hz, s.time,
                           s.position, s.look_angles);
}

CodeAndCarrier dispersive(double delay_m) {
  return {delay_m, -delay_m};
}

double ionosphere_m(const RangeState& s) {
  if (!s.options->ionosphere) return 0;
  if (!s.view->space) return modelled_m(model_state(s), true, false);
  return std::pow(gnss::kL1_hz / s.carrier_hz, 2) * s.view->space->ionosphere_m;
}

double troposphere_m(const RangeState& s) {
  if (!s.options->troposphere) return 0;
  return s.view->space ? s.view->space->troposphere_m : modelled_m(model_state(s), false, true);
}

/// Rate of a modelled delay: central differences over 1 s. @param delay_m at a nearby position and direction
template <typename Delay>
double central_mps(const RangeState& s, const Delay& delay_m) {
  return delay_m(*s.after, s.looks[1]) - delay_m(*s.before, s.looks[0]);
}

double ionosphere_mps(const RangeState& s) {
  if (!s.options->ionosphere || s.before == nullptr) return 0;
  return central_mps(s, [&](const ShiftedAntenna& there, const geodesy::AzimuthElevation& look_angles) {
    return sky::atmosphere_m(true, false, *s.klobuchar, s.view->line.id.system, s.carrier_hz,
                             s.time + there.dt_s, there.position, look_angles);
  });
}

double troposphere_mps(const RangeState& s) {
  if (!s.options->troposphere || s.before == nullptr) return 0;
  return central_mps(s, [](const ShiftedAntenna& there, const geodesy::AzimuthElevation& look_angles) {
    return sky::slant_delay_m(there.zenith_m, look_angles.elevation_rad);
  });
}

}  // namespace

std::span<const RangeTerm, kRangeTermCount> range_terms() {
  using S = const RangeState&;
  using M = const ModelState&;
  using Of = RangeTermOf;
  static constexpr RangeTerm kTerms[]{
      {"geometry", Of::Satellite, [](S s) { return both(s.view->line.range_m); }, nullptr,
       [](S s) {
         return both(tracking::path_rate_mps(s.view->line, s.motion->velocity_ecef, *s.path,
                                             s.motion->ecef_from_enu));
       }},
      {"satellite clock", Of::Satellite,
       [](S s) { return both(-kSpeedOfLight * s.view->line.state.clock_bias_s); },
       [](M m) { return both(-kSpeedOfLight * m.satellite->clock_bias_s); },
       [](S s) { return both(-kSpeedOfLight * s.view->line.state.clock_drift); }},
      {"group delay", Of::Satellite,
       [](S s) { return code_only(kSpeedOfLight * s.view->line.state.group_delay_of(*s.signal)); },
       [](M m) {
         const orbit::SatelliteState& sent = *m.satellite;
         const double delay_s = m.signal != nullptr ? sent.group_delay_of(*m.signal) : sent.group_delay_s;
         return code_only(kSpeedOfLight * delay_s);
       }},
      {"ionosphere", Of::Space, [](S s) { return dispersive(ionosphere_m(s)); },
       [](M m) {
         return dispersive(m.ionosphere_fraction * modelled_m(m, m.fix->correct_ionosphere, false));
       },
       [](S s) { return carrier_only(-ionosphere_mps(s)); }, "ionosphere_m",
       "delay in the pseudorange, advance in the phase; 0 if `ionosphere` is off"},
      {"troposphere", Of::Space, [](S s) { return both(troposphere_m(s)); },
       [](M m) { return both(modelled_m(m, false, m.fix->correct_troposphere)); },
       [](S s) { return carrier_only(troposphere_mps(s)); }, "troposphere_m",
       "delay in both; 0 if `troposphere` is off"},
      {"orbit error", Of::Space,
       [](S s) { return both(s.view->space && s.options->orbit_errors ? s.view->space->orbit_clock_m : 0); },
       nullptr, nullptr, "orbit_error_m",
       "error of the broadcast orbit and clock (`sky.errors`), in code and phase"},
      {"receiver clock", Of::Receiver, [](S s) { return both(kSpeedOfLight * s.clock.bias_s); }, nullptr,
       [](S s) { return both(kSpeedOfLight * s.clock.drift); }},
      {"bias", Of::Receiver, [](S s) { return code_only(s.bias_m); }, nullptr, nullptr, "bias_m",
       "the receiver's own delay, in the pseudorange and not in its error (`biases`)"},
      {"multipath", Of::Channel,
       [](S s) {
         return CodeAndCarrier{s.code_excess_m, s.carrier_excess_m};
       }},
      {"noise", Of::Channel, [](S s) { return code_only(s.code_noise_m); }},
      {"turn of the carrier", Of::Channel,
       [](S s) { return carrier_only(s.view->carrier_phase_offset_rad * metres_per_rad(s.carrier_hz)); },
       nullptr,
       [](S s) {  // rate per second of the receiver's clock
         return carrier_only(s.view->carrier_phase_rate_radps * metres_per_rad(s.carrier_hz) *
                             (1 + s.clock.drift));
       }},
  };
  static_assert(std::size(kTerms) == kRangeTermCount);
  return kTerms;
}

CodeAndCarrier signal_range(const RangeState& state, std::span<double> code_terms_m) {
  const auto terms = range_terms();
  assert(code_terms_m.empty() || code_terms_m.size() >= terms.size());
  CodeAndCarrier range;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const CodeAndCarrier part = terms[i].truth_m(state);
    range += part;
    if (!code_terms_m.empty()) code_terms_m[i] = part.code;
  }
  return range;
}

CodeAndCarrier range_of(RangeTermOf of, const RangeState& state) {
  CodeAndCarrier range;
  for (const RangeTerm& term : range_terms())
    if (term.of == of) range += term.truth_m(state);
  return range;
}

CodeAndCarrier modelled_range(RangeTermOf of, const ModelState& state, std::span<double> code_models_m) {
  const auto terms = range_terms();
  assert(code_models_m.empty() || code_models_m.size() >= terms.size());
  CodeAndCarrier range;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    if (terms[i].of != of || terms[i].model_m == nullptr) continue;
    const CodeAndCarrier part = terms[i].model_m(state);
    range += part;
    if (!code_models_m.empty()) code_models_m[i] = part.code;
  }
  return range;
}

double uncorrected_m(const RangeState& state, std::span<const double> code_terms_m) {
  const auto terms = range_terms();
  const ModelState model = model_state(state);
  double left_m = 0;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    if (terms[i].of != RangeTermOf::Space) continue;
    left_m += code_terms_m.empty() ? terms[i].truth_m(state).code : code_terms_m[i];
    if (terms[i].model_m != nullptr) left_m -= terms[i].model_m(model).code;
  }
  return left_m;
}

CodeAndCarrier signal_rate(const RangeState& state) {
  CodeAndCarrier rate;
  for (const RangeTerm& term : range_terms())
    if (term.rate_mps != nullptr) rate += term.rate_mps(state);
  const double clock = 1 + state.clock.drift;
  return {rate.code / clock + state.path->code_ahead_mps, rate.carrier / clock};
}

}  // namespace canyon::receiver
