#include "canyon/receiver/receiver_options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "canyon/base/input_error.hpp"
#include "canyon/gnss/signals.hpp"
#include "canyon/options/values.hpp"

namespace canyon::receiver {

bool NoiseOptions::drifts(double speed_mps, int los) const {
  return enabled && drift_enabled && (speed_mps < drift_below_speed_mps || los < drift_below_los);
}

namespace {

struct Fault {
  std::string problem, cure;
};

/// What is wrong with names of signals.
std::optional<Fault> fault_of(const std::vector<std::string>& tracks) {
  std::vector<std::string> names;
  for (const gnss::System system : gnss::kAllSystems) {
    for (const gnss::Signal& signal : gnss::signals_of(system)) {
      if (std::find(names.begin(), names.end(), signal.name) == names.end()) names.emplace_back(signal.name);
    }
  }
  for (auto track = tracks.begin(); track != tracks.end(); ++track) {
    if (std::find(names.begin(), names.end(), *track) == names.end()) {
      return Fault{fmt::format("no satellite sends a signal '{}'", *track),
                   fmt::format("signals are {}", fmt::join(names, ", "))};
    }
    if (std::find(tracks.begin(), track, *track) != track) {
      return Fault{fmt::format("'{}' stands twice", *track), "name each signal once"};
    }
  }
  return std::nullopt;
}

}  // namespace

void NoiseOptions::validate() const {
  options::check(*this, "noise");
}

void visit(options::Visitor& v, NoiseOptions& o) {
  v.boolean({"enabled", "", "noise on pseudoranges and Doppler"}, o.enabled);
  visit(v, o.ou);
  v.number({"doppler_sigma_hz", "Hz", "standard deviation of white noise on Doppler"}, o.doppler_sigma_hz,
           {0, 1e6});
  v.section("drift", [&] {
    v.boolean({"enabled", "",
               "the paper's drift mode: while slow or with few satellites in sight, means move away from mu"},
              o.drift_enabled);
    v.number({"below_speed_mps", "m/s", "drift while slower than this"}, o.drift_below_speed_mps, {0, 1e4});
    v.integer({"below_los", "satellites", "drift while fewer satellites are in line of sight"},
              o.drift_below_los, 0, 1000);
    v.number({"mu_sigma_m", "m", "standard deviation of the drifted means, drawn once per satellite"},
             o.drift_mu_sigma_m, {0, 1e6});
  });
}

void ReceiverOptions::validate() const {
  if (name.empty()) throw InputError("a receiver has no name", "give every receiver a name of its own");
  if (const auto fault = fault_of(tracks)) {
    throw InputError(fmt::format("receiver '{}': {}", name, fault->problem), fault->cure);
  }
  try {
    fix.validate();
    noise.validate();
    clock.validate();
    signal.validate();
    filter.validate();
  } catch (const InputError& error) {
    throw InputError(fmt::format("receiver '{}': {}", name, error.problem()), error.cure());
  }
}

std::vector<const gnss::Signal*> tracked_signals(const std::vector<std::string>& tracks,
                                                 gnss::System system) {
  const std::span<const gnss::Signal> all = gnss::signals_of(system);
  if (tracks.empty()) return {&all.front()};
  std::vector<const gnss::Signal*> found;
  for (const gnss::Signal& signal : all) {
    if (std::find(tracks.begin(), tracks.end(), signal.name) != tracks.end()) found.push_back(&signal);
  }
  return found;
}

void visit(options::Visitor& v, ReceiverOptions& o) {
  v.boolean(
      {"own_draws", "",
       "draws noise, clock, shadows and phases by the receiver's name too; false: alike for all receivers "
       "of a seed"},
      o.own_draws);
  v.texts({"tracks", "",
           "signals: L1CA, L1C, L2C, L5, E1, E5a, E5b, B1I, B1C, B2I, B2a, B3I, G1, G2; left out: of each "
           "satellite the one near L1"},
          o.tracks);
  if (v.reads()) {
    if (const auto fault = fault_of(o.tracks)) throw v.fault("tracks", fault->problem, fault->cure);
  }
  static constexpr std::string_view kCombinations[]{"first", "ionosphere_free"};
  v.choice({"combination", "", "pseudoranges of the fix: of the first signal, or ionosphere_free of two"},
           o.combination, kCombinations);
  visit(v, o.fix);
  v.boolean(
      {"ionosphere", "",
       "put the broadcast ionosphere (Klobuchar) into the signals, with the coefficients of the navigation "
       "files or, under nominal satellites, a standard set"},
      o.ionosphere);
  v.boolean({"troposphere", "", "put Saastamoinen's troposphere into the signals"}, o.troposphere);
  v.part("position_filter", o.filter);
  v.part("clock", o.clock);
  v.part("signal", o.signal);
  v.part("noise", o.noise);
}

}  // namespace canyon::receiver
