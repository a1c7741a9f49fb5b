#include "canyon/calibration/calibrate.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <array>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/calibration/likelihood_fit.hpp"
#include "canyon/calibration/plain.hpp"
#include "canyon/unknowns/unknowns.hpp"
#include "canyon/validation/ranked_sample.hpp"

namespace canyon::calibration {

namespace {

using Draws = std::vector<std::vector<std::uint16_t>>;

/// Blocks of time of the bootstrap [s], and how many draws.
constexpr double kBlock_s = 60;
constexpr int kResamples = 60;

/// All systems beside the recorded ones: what a receiver has too, the profile may leave out.
simulation::ReceiverConfig of_all_systems(simulation::ReceiverConfig receiver) {
  receiver.options.tracks.clear();
  receiver.options.leaves_out.clear();
  receiver.options.fix_input.uses.clear();
  return receiver;
}

/// Keys that tracked satellites and their C/N0 hardly show.
void add_unidentifiable(const Values& base, Calibration& result) {
  for (const auto& [key, why] :
       {std::pair("signal.offset_db", "needs many satellites of each system in clear view"),
        {"signal.dll.loop_bandwidth_hz", "errors show the echoes more than the loop"},
        {"signal.dll.spacing_chips", "errors show the echoes more than the loop"},
        {"noise.sigma_m_per_sqrt_s", "errors from space replace it where there are navigation files"},
        {"signal.lock.reacquisition_s", "gaps end by what is in the way more than by the receiver"}}) {
    const auto value = base.find(key);
    const bool known = std::any_of(result.estimates.begin(), result.estimates.end(),
                                   [key = key](const Estimate& e) { return e.key == key; });
    if (value == base.end() || known) continue;
    result.estimates.push_back(
        {key, "", value->second, value->second, {}, {}, Estimate::Verdict::Unidentified, why});
  }
}

}  // namespace

Calibration calibrate(const std::vector<Drive>& drives, const CalibrateOptions& options) {
  if (drives.empty()) throw InputError("calibration needs a recording", "give one");
  if (options.seeds < 1)
    throw InputError(fmt::format("{} seeds are too few", options.seeds), "give 1 or more");
  for (const Drive& drive : drives) {
    if (drive.receiver.options.signal.enabled) continue;
    throw InputError(
        fmt::format("{}: the receiver's signals have no strength, and nothing to calibrate", drive.name),
        "begin with a profile that has signal: {enabled: true}: --profile ublox-m8t");
  }
  const simulation::ReceiverConfig& receiver = drives.front().receiver;

  std::vector<Observed> recorded;
  std::vector<std::set<gnss::System>> skies;
  std::vector<FitDrive> fit_drives;
  Draws draws(kResamples);
  for (const Drive& drive : drives) {
    validation::CompareOptions compare;
    compare.threads = options.threads;
    compare.progress = [&](std::size_t done, std::size_t epochs) {
      if (options.progress) options.progress(drive.name + ": satellites in clear view", done, epochs);
    };
    const validation::Comparison comparison =
        validation::compare(drive.recording, of_all_systems(drive.receiver), *drive.environment,
                            drive.registration, drive.seed, compare);
    recorded.push_back(observed(comparison));
    skies.push_back(drive.systems);
    FitDrive& fit = fit_drives.emplace_back();
    fit.drive = &drive;
    for (const validation::NeverTracked& s : validation::never_tracked(comparison))
      fit.leave_out.insert(s.id);
    // Blocks of all drives, one behind the other.
    const std::vector<geodesy::GpsTime>& times = recorded.back().times;
    const Draws own = validation::draws_in_time(times, kBlock_s, kResamples, drive.seed);
    for (std::size_t k = 0; k < draws.size(); ++k)
      draws[k].insert(draws[k].end(), own[k].begin(), own[k].end());
  }

  Calibration result;
  add_tracked(recorded, skies, receiver, result);
  add_step(recorded, receiver, result);
  add_phase_threshold(recorded, receiver, draws, result);
  add_lock_thresholds(recorded, receiver, draws, result);
  add_likelihood_fit(fit_drives, options, result);
  add_unidentifiable(values_of(receiver), result);
  return result;
}

namespace {

/// Shares of buildings with coated glass that a receiver is simulated with.
constexpr std::array kCoatedShares = {0.0, 0.35, 0.7};

}  // namespace

simulation::Scenario with_coated_glass(simulation::Scenario scenario, double share) {
  scenario.city.facades.shares = unknowns::facades_with(share);
  return scenario;
}

std::vector<Facades> open_facades(
    const simulation::Scenario& scenario,
    const std::function<std::unique_ptr<simulation::Environment>(const simulation::Scenario&)>& draw) {
  std::vector<Facades> facades;
  if (!unknowns::leaves_facades_open(scenario)) return facades;
  for (const double share : kCoatedShares)
    facades.push_back({share, [=] { return draw(with_coated_glass(scenario, share)); }});
  return facades;
}

std::optional<double> fitted_glass(const Calibration& result) {
  if (!result.coated_glass || result.coated_glass->verdict != Estimate::Verdict::Fitted) return {};
  return parse_double(result.coated_glass->after);
}

std::vector<std::string> facade_shares(double coated_glass) {
  std::vector<std::string> items;
  for (const auto& [facade, share] : unknowns::facades_with(coated_glass))
    items.push_back(fmt::format("{}={:.0f}", facade, 100 * share));
  return items;
}

}  // namespace canyon::calibration
