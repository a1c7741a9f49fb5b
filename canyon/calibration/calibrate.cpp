#include "canyon/calibration/calibrate.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "canyon/base/input_error.hpp"
#include "canyon/calibration/plain.hpp"
#include "canyon/calibration/simulated_fit.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/facades.hpp"
#include "canyon/gnss/signal_groups.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/validation/epoch_interval.hpp"
#include "canyon/validation/ranked_sample.hpp"

namespace canyon::calibration {
namespace {

using Draws = std::vector<std::vector<std::uint16_t>>;

/// Signals that the recording has and the antenna receives, beside those of the profile.
std::vector<std::string> all_signals(const Drive& drive) {
  std::set<const gnss::Signal*> wanted;
  bool further = false;
  for (const validation::PseudorangeResidual& o : drive.recording.residuals.observations)
    wanted.insert(o.signal);
  for (const validation::PseudorangeResidual& o : drive.recording.residuals.further) {
    further =
        further || drive.receiver.options.signal.antenna.receives(signal::band_of(o.signal->carrier_hz));
    wanted.insert(o.signal);
  }
  const std::vector<std::string>& own = drive.receiver.options.tracks;
  if (own.empty() && !further) return {};
  std::vector<std::string> names;
  for (const gnss::System system : gnss::kAllSystems) {
    for (const gnss::Signal* s : receiver::tracked_signals(own, system)) wanted.insert(s);
  }
  for (const gnss::Signal* s : wanted) {
    if (!drive.receiver.options.signal.antenna.receives(signal::band_of(s->carrier_hz))) continue;
    const std::string name(s->name);
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

/// The profile's antenna and budget under a receiver that tracks whatever arrives and draws nothing.
simulation::ReceiverConfig reference_of(const Drive& drive) {
  constexpr double kAnything_dbhz = -100;
  simulation::ReceiverConfig receiver = drive.receiver;
  receiver.options.tracks = all_signals(drive);
  receiver.options.leaves_out.clear();
  receiver.options.ranging.uses.clear();
  receiver.options.noise.enabled = receiver.options.orbit_errors = false;
  receiver.options.ionosphere = receiver.options.troposphere = false;
  receiver.options.fix.correct_ionosphere = receiver.options.fix.correct_troposphere = false;
  tracking::SignalOptions& signal = receiver.options.signal;
  signal.satellite_sigma_db = signal.cn0_sigma_db = signal.cn0_step_db = 0;
  signal.shadowing.enabled = false;
  signal.loop_noise = false;
  signal.lock.acquisition_threshold_dbhz = signal.lock.tracking_threshold_dbhz = kAnything_dbhz;
  signal.lock.cold_acquisition_s = signal.lock.reacquisition_s = 0;
  return receiver;
}

simulation::ReceiverConfig without_echoes(simulation::ReceiverConfig receiver) {
  propagation::PropagationOptions& p = receiver.propagation;
  p.reflection_order = 0;
  p.ground_reflection = p.diffraction = p.diffuse = false;
  return receiver;
}

/// Satellites that the simulated receiver will not have either.
void drop_series(Observed& observed, const std::set<gnss::SatelliteId>& leave_out,
                 const std::vector<std::string>& groups) {
  const auto drop = [&](const Series& series) {
    return leave_out.count(series.id) != 0 ||
           std::any_of(groups.begin(), groups.end(), [&](const std::string& group) {
             return gnss::in_group(group, series.id, *series.signal, observed.times.front());
           });
  };
  observed.series.erase(std::remove_if(observed.series.begin(), observed.series.end(), drop),
                        observed.series.end());
}

/// Blocks of all drives, one behind the other.
Draws joined(const std::vector<Draws>& of_drives) {
  Draws all = of_drives.front();
  for (std::size_t d = 1; d < of_drives.size(); ++d) {
    for (std::size_t k = 0; k < all.size(); ++k) {
      all[k].insert(all[k].end(), of_drives[d][k].begin(), of_drives[d][k].end());
    }
  }
  return all;
}

/// Keys that no recording of pseudoranges determines.
void add_unidentifiable(const Values& base, Calibration& result) {
  for (const auto& [key, why] :
       {std::pair("signal.front_end_bandwidth_hz",
                  "acts as the spacing of the correlators does, which is fitted"),
        {"signal.dll.discriminator", "acts through the width of correlation, as the spacing does"},
        {"signal.lock.hold_s", "gaps end by what is in the way more than by the receiver"},
        {"signal.lock.cold_acquisition_s", "the receiver is on since before the recording"},
        {"signal.lock.memory_s", "longer than the recordings"}}) {
    const auto value = base.find(key);
    if (value == base.end()) continue;
    result.estimates.push_back(
        {key, "", value->second, value->second, {}, {}, Estimate::Verdict::Unidentified, why});
  }
}

std::string fragment_of(const Calibration& c, const std::vector<Drive>& drives) {
  std::vector<std::string> names;
  for (const Drive& drive : drives) names.push_back(drive.name);
  std::string text =
      fmt::format("# Surroundings by canyon calibrate, of {} together: paste the keys into the scenario.\n",
                  fmt::join(names, ", "));
  const auto comment = [&c](const std::string& key) {
    const auto e = std::find_if(c.environment.begin(), c.environment.end(),
                                [&key](const Estimate& each) { return each.key == key; });
    return e == c.environment.end() ? "" : fmt::format("    # 95 % {}; {}", e->interval, e->basis);
  };
  if (!c.facade_shares.empty()) {
    std::vector<std::string> shares;
    for (const auto& [facade, share] : c.facade_shares)
      shares.push_back(fmt::format("{}={:g}", facade, share));
    text += fmt::format("city:\n  facades:\n    shares: [{}]{}\n    named: redraw\n", fmt::join(shares, ", "),
                        comment("city.facades.shares"));
  }
  text += nested_yaml(c.surroundings);
  for (const Estimate& e : c.environment) {
    if (e.verdict == Estimate::Verdict::Unidentified)
      text += fmt::format("# not identified: {}: {}\n", e.key, e.basis);
    if (e.verdict == Estimate::Verdict::Agrees)
      text += fmt::format("# as it is: {}: {} ({})\n", e.key, e.recorded, e.interval);
  }
  return text;
}

}  // namespace

simulation::Environment with_facades(const Drive& drive, const std::map<std::string, double>& shares) {
  city::City city = drive.environment->city();
  city::FacadeOptions facades;
  facades.shares = shares;
  (void)city::dress_facades(city, facades, false, drive.seed);
  simulation::Environment environment(std::move(city), drive.sky, drive.environment->klobuchar());
  environment.set_errors(drive.environment->errors());
  return environment;
}

Calibration calibrate(const std::vector<Drive>& drives, const CalibrateOptions& options) {
  if (drives.empty()) throw InputError("there is no recording to calibrate by", "give one");
  for (const Drive& drive : drives) {
    if (drive.receiver.options.signal.enabled) continue;
    throw InputError(
        fmt::format("{}: the receiver's signals have no strength, and nothing to calibrate", drive.name),
        "begin with a profile that has signal: {enabled: true}: --profile ublox-m8t");
  }
  const simulation::ReceiverConfig& receiver = drives.front().receiver;
  const Values base = values_of(receiver);

  Calibration result;
  std::vector<LevelEvidence> evidence;
  std::vector<Draws> draws;
  std::vector<std::set<gnss::System>> skies;
  std::size_t done = 0;
  for (const Drive& drive : drives) {
    validation::CompareOptions compare;
    compare.threads = options.threads;
    compare.progress = [&](std::size_t, std::size_t) {
      if (options.progress) options.progress("levels in clear view", done, 2 * drives.size());
    };
    const auto simulate = [&](const simulation::ReceiverConfig& of) {
      ++done;
      return validation::compare(drive.recording, of, *drive.environment, drive.registration, drive.seed,
                                 compare);
    };
    const simulation::ReceiverConfig reference = reference_of(drive);
    const validation::Comparison all = simulate(reference);
    LevelEvidence& e = evidence.emplace_back();
    e.name = drive.name;
    e.recorded = observed(all, Side::Recorded);
    e.all = observed(all, Side::Simulated);
    e.direct = observed(simulate(without_echoes(reference)), Side::Simulated);
    e.speed_mps = receiver.options.signal.shadowing.obstacle_speed_mps;
    for (const validation::NeverTracked& s : validation::never_tracked(all))
      result.never_tracked[drive.name].insert(s.id);
    skies.push_back(drive.systems);
    draws.push_back(validation::block_draws(e.recorded.times.size(),
                                            validation::epochs_in(options.block_s, e.recorded.times),
                                            options.resamples, drive.seed));
  }

  const Draws all_draws = joined(draws);
  Levels levels;
  add_tracked(evidence, skies, receiver, levels);
  const double step_db = add_step(evidence, receiver, levels);
  simulation::ReceiverConfig stated = receiver;
  set_values(levels.values, stated);
  const Levels of_satellites = estimate_levels(evidence, stated, all_draws);
  levels.estimates.insert(levels.estimates.end(), of_satellites.estimates.begin(),
                          of_satellites.estimates.end());
  levels.notes.insert(levels.notes.end(), of_satellites.notes.begin(), of_satellites.notes.end());
  levels.values.insert(of_satellites.values.begin(), of_satellites.values.end());
  add_phase_threshold(evidence, stated, all_draws, levels);
  set_values(levels.values, stated);

  std::vector<FitDrive> fit_drives;
  for (std::size_t d = 0; d < drives.size(); ++d) {
    FitDrive& f = fit_drives.emplace_back();
    f.drive = &drives[d];
    f.leave_out = result.never_tracked[drives[d].name];
    drop_series(evidence[d].recorded, f.leave_out, stated.options.leaves_out);
    const FixErrors own = own_fixes_of(drives[d].recording);
    f.recorded = moments(evidence[d].recorded, own, step_db);
    for (const auto& weights : draws[d])
      f.resampled.push_back(moments(evidence[d].recorded, own, step_db, weights));
  }
  SimulatedFit fit = fit_by_simulation(fit_drives, base, levels.values, step_db, options);

  result.estimates = std::move(levels.estimates);
  result.estimates.insert(result.estimates.end(), fit.estimates.begin(), fit.estimates.end());
  result.environment = std::move(fit.environment);
  result.notes = std::move(levels.notes);
  result.notes.insert(result.notes.end(), fit.notes.begin(), fit.notes.end());
  result.values = std::move(levels.values);
  for (const auto& [key, value] : fit.values) result.values[key] = value;
  result.surroundings = std::move(fit.surroundings);
  result.facade_shares = std::move(fit.facade_shares);
  const bool own_fixes = std::any_of(drives.begin(), drives.end(),
                                     [](const Drive& drive) { return !drive.recording.own_fixes.empty(); });
  if (own_fixes && !receiver.options.filter.enabled) {
    result.values["position_filter.enabled"] = "true";
    result.estimates.push_back({"position_filter.enabled",
                                "",
                                "false",
                                "true",
                                "true",
                                {},
                                Estimate::Verdict::Fitted,
                                "the receiver's own fixes are those of a filter"});
  }
  add_unidentifiable(base, result);
  if (options.environment) result.fragment = fragment_of(result, drives);
  return result;
}

}  // namespace canyon::calibration
