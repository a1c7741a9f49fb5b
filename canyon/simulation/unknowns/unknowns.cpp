#include "canyon/simulation/unknowns/unknowns.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <optional>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/random.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/base/text.hpp"

namespace canyon::unknowns {
namespace {

using disturbance::ShadowingEnvironment;
using simulation::ReceiverConfig;
using simulation::Scenario;

constexpr std::array<std::string_view, 4> kNames{"level", "skyline", "facades", "map"};

// Priors; docs/results.md compares them with recordings.
constexpr double kLowestLevel_db = -10, kHighestLevel_db = 6;
// Between installations of one kind; of a measured level (canyon calibrate's intervals are 2 dB to both
// sides).
constexpr double kSaidLevelSigma_db = 4, kMeasuredLevelSigma_db = 1;
constexpr double kMaxCoated = 0.7;  // of thermally_efficient buildings
constexpr double kMapSigma_m = 3;
constexpr double kMaxOfPower_db = 20, kMinOfPower_db = -10;  // of link.above_minimum_db

/// A distribution: its text, and its quantile function of a fraction [0, 1).
struct Distribution {
  std::string text;
  std::function<double(double)> at;
};

Distribution uniform(double low, double high, const char* unit) {
  return {fmt::format("{:g} to {:g}{}, uniform", low, high, unit),
          [=](double fraction) { return low + fraction * (high - low); }};
}

/// The distribution of the level, around that of the receiver's settings.
std::optional<Distribution> level_of(const ReceiverConfig& receiver) {
  const tracking::SignalOptions& signal = receiver.options.signal;
  if (!signal.enabled) return std::nullopt;
  const bool reported = signal.installation != tracking::Installation::Nominal || signal.installation_db;
  if (!reported && signal.installation_sigma_db == 0)
    return uniform(kLowestLevel_db, kHighestLevel_db, " dB");
  const double sigma_db = signal.installation_sigma_db > 0 ? signal.installation_sigma_db
                          : signal.installation_db         ? kMeasuredLevelSigma_db
                                                           : kSaidLevelSigma_db;
  return Distribution{
      fmt::format("normal, {:g} dB about the installation's", sigma_db),
      [=](double fraction) { return sigma_db * normal_quantile(std::clamp(fraction, 1e-9, 1 - 1e-9)); }};
}

/// The distribution of the fraction of azimuths with an obstacle.
std::optional<Distribution> skyline_of(const ReceiverConfig& receiver) {
  const tracking::SignalOptions& signal = receiver.options.signal;
  if (!signal.enabled || !signal.shadowing.active() || signal.shadowing.skyline.fraction) return std::nullopt;
  const auto [low, high] = disturbance::obstacle_fractions(signal.shadowing.environment);
  return uniform(low, high, "");
}

/// The distribution of the fraction of buildings with coated glass: from traditional to thermally_efficient
/// ones.
std::optional<Distribution> facades_of(const Scenario& scenario) {
  if (!leaves_facades_open(scenario)) return std::nullopt;
  return Distribution{
      fmt::format("coated glass on 0 to {:g} of buildings, median {:.3g}", kMaxCoated, 0.25 * kMaxCoated),
      [](double fraction) { return kMaxCoated * fraction * fraction; }};
}

/// The standard deviation of the map's position, from which a run samples: one value.
std::optional<Distribution> map_of(const Scenario& scenario) {
  const simulation::CityConfig& city = scenario.city;
  if (city.is<simulation::OpenField>() || city.is<city::SyntheticCityOptions>()) return std::nullopt;
  const double sigma_m = city.georeference.sigma_m > 0 ? city.georeference.sigma_m : kMapSigma_m;
  return Distribution{fmt::format("normal, {:.2g} m eastwards and northwards", sigma_m),
                      [=](double) { return sigma_m; }};
}

/// An unknown of a scenario.
struct SampledUnknown {
  Unknown unknown;
  std::size_t receiver;  ///< index, of Level and Skyline
  std::string name;
  Distribution distribution;
};

std::vector<SampledUnknown> all_of(const Scenario& scenario, const std::vector<Unknown>& known) {
  std::vector<SampledUnknown> all;
  const auto add = [&](Unknown unknown, std::size_t receiver, const std::string& of,
                       const std::optional<Distribution>& distribution) {
    const bool is_known = std::find(known.begin(), known.end(), unknown) != known.end();
    if (distribution && !is_known)
      all.push_back({unknown, receiver, std::string(name_of(unknown)) + of, *distribution});
  };
  for (std::size_t i = 0; i < scenario.receivers.size(); ++i) {
    const ReceiverConfig& receiver = scenario.receivers[i];
    const std::string of = scenario.receivers.size() > 1 ? " of " + receiver.options.name : "";
    add(Unknown::Level, i, of, level_of(receiver));
    add(Unknown::Skyline, i, of, skyline_of(receiver));
  }
  add(Unknown::Facades, 0, "", facades_of(scenario));
  add(Unknown::Map, 0, "", map_of(scenario));
  return all;
}

void set(const SampledUnknown& sampled, double value, Scenario& scenario) {
  tracking::SignalOptions& signal = scenario.receivers.at(sampled.receiver).options.signal;
  switch (sampled.unknown) {
    case Unknown::Level:
      signal.installation_sigma_db = 0;
      signal.link.above_minimum_db =
          std::clamp(signal.link.above_minimum_db + value, kMinOfPower_db, kMaxOfPower_db);
      return;
    case Unknown::Skyline:
      signal.shadowing.skyline.fraction = value;
      return;
    case Unknown::Facades:
      scenario.city.facades.fractions = facades_with(value);
      return;
    case Unknown::Map:
      scenario.city.georeference.sigma_m = value;
  }
}

}  // namespace

std::map<std::string, double> facades_with(double coated_glass) {
  city::FacadeOptions options;
  options.mix = city::FacadeMix::ThermallyEfficient;
  const std::map<std::string, double> efficient = city::facade_fractions(options);
  options.mix = city::FacadeMix::Traditional;
  const double weight = coated_glass / efficient.at("coated_glass");
  std::map<std::string, double> fractions;
  for (const auto& [name, fraction] : efficient) fractions[name] += weight * fraction;
  for (const auto& [name, fraction] : city::facade_fractions(options))
    fractions[name] += (1 - weight) * fraction;
  return fractions;
}

bool leaves_facades_open(const Scenario& scenario) {
  const city::FacadeOptions& facades = scenario.city.facades;
  return !scenario.city.is<simulation::OpenField>() && facades.mix == city::FacadeMix::ByBuilding &&
         facades.fractions.empty();
}

std::string_view name_of(Unknown unknown) {
  return kNames.at(static_cast<std::size_t>(unknown));
}

Unknown unknown_of(std::string_view name) {
  const auto* const at = std::find(kNames.begin(), kNames.end(), name);
  if (at != kNames.end()) return static_cast<Unknown>(at - kNames.begin());
  throw InputError(fmt::format("there is no unknown '{}'", name),
                   fmt::format("write {}", fmt::join(kNames, ", ")));
}

std::vector<Unknown> unknowns_of(std::string_view list) {
  std::vector<Unknown> unknowns;
  if (list.empty()) return unknowns;
  for (const std::string_view name : split(list, ',')) unknowns.push_back(unknown_of(trim(name)));
  return unknowns;
}

std::vector<std::string_view> names() {
  return {kNames.begin(), kNames.end()};
}

std::vector<std::string> priors_of(const Scenario& scenario, const std::vector<Unknown>& known) {
  std::vector<std::string> texts;
  for (const SampledUnknown& each : all_of(scenario, known))
    texts.push_back(fmt::format("{}: {}", each.name, each.distribution.text));
  return texts;
}

UnknownSamples::UnknownSamples(std::uint64_t seed, std::size_t count, std::vector<Unknown> known)
    : count_(count), known_(std::move(known)) {
  for (const std::string_view name : kNames)
    fractions_.push_back(draw_sample(RandomStream(seed, "unknown " + std::string(name)), count, true));
}

std::map<std::string, double> UnknownSamples::apply(std::size_t draw, Scenario& scenario) const {
  std::map<std::string, double> values;
  for (const SampledUnknown& each : all_of(scenario, known_)) {
    const double value = each.distribution.at(fractions_.at(static_cast<std::size_t>(each.unknown)).at(draw));
    set(each, value, scenario);
    values[each.name] = value;
  }
  return values;
}

void forget(Scenario& scenario) {
  scenario.city.facades.mix = city::FacadeOptions().mix;
  scenario.city.facades.fractions.clear();
  scenario.city.roofs_m = 0;
  for (ReceiverConfig& receiver : scenario.receivers) {
    tracking::SignalOptions& signal = receiver.options.signal;
    signal.installation = tracking::Installation::Nominal;
    signal.installation_db.reset();
    signal.installation_sigma_db = 0;
    if (signal.shadowing.enabled) signal.shadowing.environment = ShadowingEnvironment::Auto;
    signal.shadowing.skyline = {};
  }
}

}  // namespace canyon::unknowns
