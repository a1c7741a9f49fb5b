#include "canyon/receiver/receiver_options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"

namespace canyon::receiver {

bool NoiseOptions::drifts(double speed_mps, int los) const {
  return enabled && drift_enabled && (speed_mps < 0.5 || los < 5);
}

void NoiseOptions::validate() const {
  options::check(*this, "noise");
}

void visit(options::Visitor& v, NoiseOptions& o) {
  options::visit_switch(
      v, {"enabled", "", "noise on pseudoranges and Doppler; if omitted: false with sky.errors"}, o.enabled);
  visit(v, o.ou);
  v.number({"doppler_sigma_hz", "Hz", "standard deviation of white noise on Doppler"}, o.doppler_sigma_hz,
           {0, 1e6});
  v.section("drift", [&] {
    v.boolean({"enabled", "",
               "the paper's drift mode: at low speed or with few satellites in line of sight, means drift "
               "away from mu"},
              o.drift_enabled);
  });
}

void visit(options::Visitor& v, FixNoiseOptions& o) {
  constexpr options::Range kSigma{0, 1e4};
  v.number({"horizontal_m", "m", "standard deviation of white noise on the solved position, east and north"},
           o.horizontal_m, kSigma);
  v.number({"vertical_m", "m", "standard deviation of white noise on the solved height"}, o.vertical_m,
           kSigma);
  v.number(
      {"horizontal_mps", "m/s", "standard deviation of white noise on the solved velocity, east and north"},
      o.horizontal_mps, kSigma);
  v.number({"vertical_mps", "m/s", "standard deviation of white noise on the solved vertical velocity"},
           o.vertical_mps, kSigma);
}

void BiasOptions::validate() const {
  options::check(*this, "biases");
  for (const auto& [group, bias] : code_m) gnss::check_group(group);
}

void visit(options::Visitor& v, BiasOptions& o) {
  gnss::visit_group_values(
      v, {"code_m", "m", "delays of the receiver for groups of signals: [GLONASS=12, L5=-2.5]"}, o.code_m,
      {-1e4, 1e4});
  v.number({"glonass_channel_m", "m", "GLONASS bias per frequency channel"}, o.glonass_channel_m,
           {-100, 100});
  v.number({"drift_sigma_m", "m",
            "standard deviation of each system's drift about these biases, a first-order process"},
           o.drift_sigma_m, {0, 1000});
  v.number({"drift_time_s", "s", "its time constant"}, o.drift_time_s, {1, 1e6});
}

namespace {

/// A tracked signal in a band that the antenna does not receive.
const gnss::Signal* unheard(const ReceiverOptions& o) {
  for (const gnss::System system : gnss::kAllSystems) {
    for (const gnss::Signal* signal : tracked_signals(o.tracks, system))
      if (!o.signal.antenna.receives(signal::band_of(signal->carrier_hz))) return signal;
  }
  return nullptr;
}

bool is_tracked(const ReceiverOptions& o, std::string_view signal_name) {
  return std::any_of(gnss::kAllSystems.begin(), gnss::kAllSystems.end(), [&](gnss::System system) {
    const auto tracked = tracked_signals(o.tracks, system);
    return std::any_of(tracked.begin(), tracked.end(),
                       [&](const gnss::Signal* signal) { return signal->name == signal_name; });
  });
}

bool is_among(const std::vector<std::string>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

void visit(options::Visitor& v, SpoofingCheckOptions& o) {
  v.boolean({"enabled", "", "report signs of spoofing"}, o.enabled);
  v.number({"gain_db", "dB", "sign of spoofing: gain falls by this amount but signals do not weaken"},
           o.gain_db, {0.1, 30});
  v.number(
      {"jump_m", "m",
       "sign of spoofing: position or clock jump by this amount relative to the fix's velocity and drift"},
      o.jump_m, {1, 1e6});
  v.number({"hold_s", "s", "time for which spoofing is reported after the last sign"}, o.hold_s, {0, 1e5});
}

void ReceiverOptions::validate() const {
  if (name.empty()) throw InputError("a receiver has no name", "give each receiver a different name");
  try {
    gnss::check_signals(tracks);
    for (const std::string& group : leaves_out) gnss::check_group(group);
    for (const char* other : {"G1", "B1C"}) {
      if (at_once == AtOnce::All || !is_among(tracks, "B1I") || !is_among(tracks, other)) continue;
      throw InputError(
          fmt::format("it tracks B1I and {}, which its hardware does not receive at the same time", other),
          "leave one of them out, or use `concurrent_systems: all` for another receiver");
    }
    if (const gnss::Signal* deaf_to = unheard(*this); deaf_to != nullptr && signal.enabled) {
      throw InputError(fmt::format("it tracks {}, and its antenna '{}' has no pattern for {:.2f} MHz",
                                   deaf_to->name, signal.antenna.name(), deaf_to->carrier_hz / 1e6),
                       "choose dual_patch, survey, phone or isotropic, or give antenna_lower_rows");
    }
    fix_input.validate();
    options::check(spoofing_check, "spoofing check");
    for (const std::string& name_of_signal : fix_input.uses) {
      if (!is_tracked(*this, name_of_signal)) {
        throw InputError(fmt::format("its fix uses {}, which it does not track", name_of_signal),
                         "add it to tracks");
      }
    }
    biases.validate();
    fix.validate();
    noise.validate();
    options::check(fix_noise, "fix noise");
    clock.validate();
    signal.validate();
    filter.validate();
    options::check(dead_reckoning, "dead reckoning");
    corrections.validate();
    options::check(rtk, "rtk");
  } catch (const InputError& error) {
    throw InputError(fmt::format("receiver '{}': {}", name, error.problem()), error.hint());
  }
}

positioning::CodeNoise ReceiverOptions::slow_error() const {
  if (noise.enabled) return {noise.ou.standard_deviation_m(), noise.ou.theta_per_s};
  return {orbit_errors ? kSpaceSigma_m : 0, 1.0 / 3600};
}

double ReceiverOptions::shared_error_m() const {
  return noise.enabled ? 0 : slow_error().sigma_m;
}

double ReceiverOptions::reported_noise_m() const {
  const double drift_m = noise.enabled && noise.drift_enabled ? NoiseOptions::kDriftMuSigma_m : 0;
  return std::hypot(slow_error().sigma_m, drift_m);
}

namespace {

void require_signals(const std::vector<std::string>& tracks, std::span<const gnss::SatelliteId> sky) {
  std::set<std::string_view> systems;
  for (const gnss::SatelliteId id : sky) {
    if (!tracked_signals(tracks, id.system).empty()) return;
    systems.insert(gnss::name(id.system));
  }
  if (systems.empty()) return;
  throw InputError(fmt::format("it tracks {}, but the sky only has satellites of {}", fmt::join(tracks, ", "),
                               fmt::join(systems, ", ")),
                   "add a signal of these systems to tracks, or their system to sky.systems");
}

}  // namespace

void ReceiverOptions::choose_signals(std::span<const gnss::SatelliteId> sky) {
  if (!tracks.empty()) require_signals(tracks, sky);
  if (!tracks.empty() || at_once == AtOnce::All) return;
  if (at_once == AtOnce::BeiDouByB1C) {
    tracks = {"L1CA", "G1", "E1", "B1C"};
    return;
  }
  const bool glonass = std::any_of(sky.begin(), sky.end(),
                                   [](gnss::SatelliteId id) { return id.system == gnss::System::GLONASS; });
  if (glonass && !is_among(leaves_out, "B1I")) leaves_out.emplace_back("B1I");
}

void ReceiverOptions::decide(bool space, bool with_ionosphere) {
  orbit_errors.set_default(space);
  troposphere.set_default(space);
  ionosphere.set_default(space && with_ionosphere);
  fix.correct_troposphere.set_default(space && troposphere);
  fix.correct_ionosphere.set_default(space && ionosphere);
  noise.enabled.set_default(!space);
}

std::vector<const gnss::Signal*> tracked_signals(const std::vector<std::string>& tracks,
                                                 gnss::System system) {
  const std::span<const gnss::Signal> all = gnss::signals_of(system);
  if (tracks.empty()) return {&all.front()};
  std::vector<const gnss::Signal*> found;
  for (const gnss::Signal& signal : all)
    if (signal.only_recorded.empty() && is_among(tracks, signal.name)) found.push_back(&signal);
  return found;
}

void visit(options::Visitor& v, ReceiverOptions& o) {
  options::visit_switch(
      v,
      {"independent_noise", "",
       "random values that are independent of other receivers: true: noise, clock, phases and shadows; "
       "false: none, all receivers of a seed are equal; if omitted: all except shadows"},
      o.independent_noise);
  v.former_name("own_draws", "independent_noise");
  static const std::string tracks =
      fmt::format("tracked signals: {}; if omitted: the signal near L1 of each satellite",
                  fmt::join(gnss::signal_names(true), ", "));
  gnss::visit_signals(v, {"tracks", "", tracks}, o.tracks);
  gnss::visit_groups(
      v, {"exclude_signals", "", "groups of signals in `tracks` that it does not track: [BeiDou-GEO]"},
      o.leaves_out);
  v.former_name("leaves_out", "exclude_signals");
  static constexpr std::string_view kAtOnce[]{"all", "glonass_or_beidou", "beidou_by_b1c"};
  v.choice({"concurrent_systems", "",
            "systems that the hardware receives at the same time near L1 without `tracks`: all; "
            "glonass_or_beidou (B1I only if the sky has no GLONASS); beidou_by_b1c (B1C instead of B1I)"},
           o.at_once, kAtOnce);
  v.former_name("at_once", "concurrent_systems");
  visit(v, o.fix_input);
  visit(v, o.fix);
  options::visit_switch(
      v,
      {"ionosphere", "",
       "add the ionosphere to the signals: that of sky.errors, else Klobuchar's with the coefficients of the "
       "navigation files or, with nominal satellites, a standard set; if omitted: true with sky.errors"},
      o.ionosphere);
  options::visit_switch(v,
                        {
                            "troposphere",
                            "",
                            "add the troposphere to the signals: that of sky.errors, else Saastamoinen's",
                        },
                        o.troposphere);
  options::visit_switch(
      v,
      {"orbit_errors", "",
       "add errors of broadcast orbits and clocks to the signals; if omitted: true with sky.errors"},
      o.orbit_errors);
  v.part("position_filter", o.filter);
  v.part("corrections", o.corrections);
  v.part("rtk", o.rtk);
  v.part("dead_reckoning", o.dead_reckoning);
  v.part("clock", o.clock);
  v.part("biases", o.biases);
  v.part("signal", o.signal);
  v.part("noise", o.noise);
  v.part("fix_noise", o.fix_noise);
  v.part("spoofing_check", o.spoofing_check);
}

}  // namespace canyon::receiver
