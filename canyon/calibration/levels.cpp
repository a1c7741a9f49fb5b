#include "canyon/calibration/levels.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "canyon/base/statistics.hpp"
#include "canyon/calibration/satellite_levels.hpp"
#include "canyon/geodesy/constants.hpp"

namespace canyon::calibration {
namespace {

using Verdict = Estimate::Verdict;

/// Beside the edges of clear view a city's outlines decide, and a channel needs its time to be found.
constexpr double kEdge_s = 2;
constexpr std::size_t kFewestOfSatellite = 20, kFewestItems = 300;
constexpr int kFirstRounds = 60, kResampleRounds = 9;
/// Elevation at which the shadows of a published environment are given [rad].
constexpr double kMiddleElevation_rad = 0.87;

struct Chains {
  std::vector<LevelChain> chains;
  std::vector<SatelliteLevel> satellites;
  std::size_t epochs = 0, items = 0, untracked = 0;
  std::vector<double> multipath_db;         ///< all paths less the direct one
  std::vector<double> satellite_echoes_db;  ///< its mean over each satellite
};

/// Cuts what stands beside an edge off, and keeps what is left.
void keep(LevelChain chain, const Observed& recorded, std::uint32_t offset, Chains& chains) {
  std::vector<LevelItem>& items = chain.items;
  if (items.empty()) return;
  const double begin_s = recorded.time_s[items.front().epoch - offset] + kEdge_s,
               end_s = recorded.time_s[items.back().epoch - offset] - kEdge_s;
  const auto beside = [&](const LevelItem& item) {
    const double at_s = recorded.time_s[item.epoch - offset];
    return at_s < begin_s || at_s > end_s;
  };
  items.erase(std::remove_if(items.begin(), items.end(), beside), items.end());
  if (items.empty()) return;
  chains.items += items.size();
  chains.untracked += static_cast<std::size_t>(
      std::count_if(items.begin(), items.end(), [](const LevelItem& item) { return !item.tracked; }));
  chains.chains.push_back(std::move(chain));
}

void add_series(const LevelEvidence& e, std::size_t drive, std::size_t s, double weakest_dbhz,
                Chains& chains) {
  const Series &recorded = e.recorded.series[s], &direct = e.direct.series[s], &all = e.all.series[s];
  std::size_t known = 0;
  for (std::size_t i = 0; i < recorded.samples.size(); ++i) {
    const Sample& sample = recorded.samples[i];
    known += sample.clear && sample.cn0_dbhz && direct.samples[i].cn0_dbhz ? 1 : 0;
  }
  if (known < kFewestOfSatellite) return;
  const std::size_t satellite = chains.satellites.size(), echoes = chains.multipath_db.size();
  const auto offset = static_cast<std::uint32_t>(chains.epochs);
  SatelliteLevel& level = chains.satellites.emplace_back();
  level.drive = drive;
  level.id = recorded.id;
  level.signal = recorded.signal;
  level.time = e.recorded.times[recorded.samples.front().epoch];
  LevelChain chain{satellite, {}};
  double way_m = 0, elevation_sum = 0;
  std::size_t before = 0, clear = 0;
  for (std::size_t i = 0; i < recorded.samples.size(); ++i) {
    const Sample& sample = recorded.samples[i];
    const auto& reference = direct.samples[i].cn0_dbhz;
    if (i > 0) {
      for (std::size_t k = before + 1; k <= sample.epoch; ++k) {
        way_m +=
            std::hypot(e.recorded.step_m[k], e.speed_mps * (e.recorded.time_s[k] - e.recorded.time_s[k - 1]));
      }
    }
    const bool usable = sample.clear && reference && sample.tracked == sample.cn0_dbhz.has_value();
    if (!usable || (i > 0 && sample.epoch != before + 1)) {
      keep(std::move(chain), e.recorded, offset, chains);
      chain = {satellite, {}};
      way_m = 0;
    }
    before = sample.epoch;
    if (!usable) continue;
    LevelItem item;
    item.tracked = sample.tracked;
    item.level_db = (sample.tracked ? *sample.cn0_dbhz : weakest_dbhz) - *reference;
    item.way_m = way_m;
    item.epoch = offset + static_cast<std::uint32_t>(sample.epoch);
    chain.items.push_back(item);
    way_m = 0;
    elevation_sum += sample.elevation_rad;
    ++clear;
    if (sample.tracked && all.samples[i].cn0_dbhz) {
      chains.multipath_db.push_back(*all.samples[i].cn0_dbhz - *reference);
    }
  }
  keep(std::move(chain), e.recorded, offset, chains);
  double sum = 0;
  for (std::size_t i = echoes; i < chains.multipath_db.size(); ++i) sum += chains.multipath_db[i];
  if (chains.multipath_db.size() > echoes) {
    chains.satellite_echoes_db.push_back(sum / static_cast<double>(chains.multipath_db.size() - echoes));
  }
  level.elevation_rad = clear > 0 ? elevation_sum / static_cast<double>(clear) : 0;
}

Chains chains_of(std::span<const LevelEvidence> evidence) {
  Chains chains;
  for (std::size_t drive = 0; drive < evidence.size(); ++drive) {
    const LevelEvidence& e = evidence[drive];
    std::vector<double> stated;
    for (const Series& series : e.recorded.series) {
      for (const Sample& sample : series.samples) {
        if (sample.tracked && sample.cn0_dbhz) stated.push_back(*sample.cn0_dbhz);
      }
    }
    const double weakest = quantile(stated, 0.01).value_or(0);
    for (std::size_t s = 0; s < e.recorded.series.size(); ++s) add_series(e, drive, s, weakest, chains);
    chains.epochs += e.recorded.times.size();
  }
  return chains;
}

struct Spread {
  double mean = 0, sigma = 0, low = 0, high = 0;
};
Spread spread_of(const std::vector<double>& values) {
  Spread spread;
  if (values.size() < 2) return spread;
  for (const double v : values) spread.mean += v / static_cast<double>(values.size());
  for (const double v : values) spread.sigma += (v - spread.mean) * (v - spread.mean);
  spread.sigma = std::sqrt(spread.sigma / static_cast<double>(values.size() - 1));
  spread.low = *quantile(values, 0.025);
  spread.high = *quantile(values, 0.975);
  return spread;
}

/// The chain's probabilities for steps of a frame.
std::pair<double, double> per_frame(const ShadowFit& f, double frame_m) {
  const double changed = -std::expm1(-frame_m / f.length_m);
  return {f.shadowed_share * changed, (1 - f.shadowed_share) * changed};
}

/// What the recordings say of shadows, beside what the receiver has of them.
class Shadows {
 public:
  Shadows(const Chains& chains, const ShadowFit& fit, const std::vector<ShadowFit>& resampled,
          double clear_sigma_db, const disturbance::ShadowingOptions& before)
      : chains_(chains), fit_(fit), clear_sigma_db_(clear_sigma_db), before_(before) {
    std::vector<double> share, depth, sigma, enter, leave;
    for (const ShadowFit& f : resampled) {
      share.push_back(f.shadowed_share);
      depth.push_back(f.depth_db);
      sigma.push_back(f.shadowed_sigma_db);
      const auto [in, out] = per_frame(f, before.frame_m);
      enter.push_back(in);
      leave.push_back(out);
    }
    share_ = spread_of(share);
    depth_ = spread_of(depth);
    sigma_ = spread_of(sigma);
    enter_ = spread_of(enter);
    leave_ = spread_of(leave);
  }

  /// @return whether the receiver's own shadows stay
  bool add_to(Levels& levels) const {
    const auto was = disturbance::shadowing_parameters(before_, kMiddleElevation_rad);
    Estimate on;
    on.key = "signal.shadowing.enabled";
    on.before = on.after = before_.enabled ? "true" : "false";
    if (chains_.items < kFewestItems) {
      on.basis = fmt::format("{} clear views are too few to tell shadows", chains_.items);
      levels.estimates.push_back(on);
      return true;
    }
    const std::string seen =
        fmt::format("{} clear views of {} signals, {:.1f} % of them not tracked", chains_.items,
                    chains_.satellites.size(),
                    100 * static_cast<double>(chains_.untracked) / static_cast<double>(chains_.items));
    on.recorded = fmt::format("{:.0f} % in shadow", 100 * fit_.shadowed_share);
    on.interval = fmt::format("{:.0f} to {:.0f} %", 100 * share_.low, 100 * share_.high);
    const bool none = fit_.shadowed_share * fit_.depth_db < kNothing_db;
    const bool alike = before_.enabled &&
                       near(fit_.shadowed_share, was.shadowed_share(), share_.sigma + 0.02) &&
                       near(fit_.depth_db, was.clear_mean_db - was.shadowed_mean_db, depth_.sigma + 0.5);
    on.after = none ? "false" : "true";
    on.verdict = on.after != on.before ? Verdict::Fitted : Verdict::Agrees;
    on.basis = none ? "nothing is missing in clear view: " + seen : seen;
    levels.estimates.push_back(on);
    levels.values[on.key] = on.after;
    if (none || alike) return alike;

    const auto [enter, leave] = per_frame(fit_, before_.frame_m);
    add(levels, "signal.shadowing.environment",
        before_.environment == disturbance::ShadowingEnvironment::Custom ? "custom" : "published", "custom",
        {}, "this street's numbers, at every elevation");
    if (const double share = before_.blockage_share(); share > 0) {
      const std::string text = fmt::format("{:g}", share);
      add(levels, "signal.shadowing.blockage.share", text, text, {},
          "not estimated: that of the surroundings");
    }
    const auto number = [&](const char* key, double before, double after, const Spread& s, double scale,
                            const char* basis) {
      add(levels, std::string("signal.shadowing.custom.") + key, rounded(before, 0.01 * scale),
          rounded(after, s.sigma), fmt::format("{} to {}", rounded(s.low, s.sigma), rounded(s.high, s.sigma)),
          basis);
    };
    add(levels, "signal.shadowing.custom.clear_mean_db", rounded(was.clear_mean_db, 0.1), "0", {},
        "levels are those of the clear state");
    add(levels, "signal.shadowing.custom.clear_sigma_db", rounded(was.clear_sigma_db, 0.1),
        rounded(clear_sigma_db_, 0.1), {}, "spread in the clear less that of echoes and of the stated C/N0");
    // The level moves on its way into a shadow and out of it, which the states do not know.
    const double length_m = before_.frame_m / std::max(leave, 1e-3);
    const double deeper = 1 / (1 - 0.5 * std::min(1.0, before_.transition_m / length_m));
    const Spread mean{-deeper * depth_.mean, depth_.sigma, -deeper * depth_.high * (1 + kFilled),
                      -deeper * depth_.low * (1 - kFilled)};
    number("shadowed_mean_db", was.shadowed_mean_db, -deeper * fit_.depth_db, mean, 1,
           "mean of the shadowed state");
    number("shadowed_sigma_db", was.shadowed_sigma_db, fit_.shadowed_sigma_db, sigma_, 1, "its spread");
    number("enter", was.enter, enter, enter_, 0.1,
           "share and length of shadows along the way, hidden Markov chain of two states");
    number("leave", was.leave, leave, leave_, 0.1, "likewise");
    return false;
  }

 private:
  /// Mean loss by shadows below which there are none: echoes fade as much.
  static constexpr double kNothing_db = 0.3;
  /// Echoes fill shadows, and make them look less deep by up to this share.
  static constexpr double kFilled = 0.1;
  static bool near(double a, double b, double sigma) { return std::abs(a - b) < 2 * sigma; }
  static void add(Levels& levels, const std::string& key, const std::string& before, const std::string& after,
                  const std::string& interval, const std::string& basis) {
    levels.estimates.push_back({key, "", before, after, after, interval, Verdict::Fitted, basis});
    levels.values[key] = after;
  }

  const Chains& chains_;
  const ShadowFit& fit_;
  double clear_sigma_db_;
  const disturbance::ShadowingOptions& before_;
  Spread share_, depth_, sigma_, enter_, leave_;
};

}  // namespace

Levels estimate_levels(std::span<const LevelEvidence> evidence, const simulation::ReceiverConfig& receiver,
                       std::span<const std::vector<std::uint16_t>> draws) {
  Chains chains = chains_of(evidence);
  const std::vector<std::uint16_t> once(chains.epochs, 1);
  std::map<std::pair<std::size_t, const gnss::Signal*>, std::size_t> groups;
  std::vector<std::size_t> group;
  for (const SatelliteLevel& s : chains.satellites) {
    const gnss::Signal* own = gnss::index_of(*s.signal) == 0 ? nullptr : s.signal;
    group.push_back(groups.try_emplace({s.drive, own}, groups.size()).first->second);
  }
  const ShadowFit fit =
      fit_shadows(chains.chains, once, shadow_start(chains.chains, std::move(group)), kFirstRounds);
  std::vector<ShadowFit> resampled;
  for (const std::vector<std::uint16_t>& weights : draws) {
    resampled.push_back(fit_shadows(chains.chains, weights, fit, kResampleRounds));
  }
  const Spread echoes = spread_of(chains.multipath_db);

  Levels levels;
  const tracking::SignalOptions& signal = receiver.options.signal;
  const double stated_square =
      signal.cn0_sigma_db * signal.cn0_sigma_db + signal.cn0_step_db * signal.cn0_step_db / 12;
  const double clear_sigma_db = std::sqrt(
      std::max(0.01, fit.clear_sigma_db * fit.clear_sigma_db - echoes.sigma * echoes.sigma - stated_square));
  const bool shadows_stay = Shadows(chains, fit, resampled, clear_sigma_db, signal.shadowing).add_to(levels);
  const double clear_mean_db =
      shadows_stay && signal.shadowing.enabled
          ? disturbance::shadowing_parameters(signal.shadowing, kMiddleElevation_rad).clear_mean_db
          : 0;

  // Echoes that stay for minutes are no strength of a satellite; their phases are not those of the recording.
  const double echo_variance_db2 = std::pow(spread_of(chains.satellite_echoes_db).sigma, 2);
  std::vector<SatelliteLevel> known;
  for (std::size_t s = 0; s < chains.satellites.size(); ++s) {
    std::vector<double> drawn;
    drawn.reserve(resampled.size());
    for (const ShadowFit& f : resampled) drawn.push_back(f.own_db[s]);
    SatelliteLevel& level = chains.satellites[s];
    if (!std::isfinite(fit.satellite_db[s])) continue;
    level.level_db = fit.own_db[s] - echoes.mean - clear_mean_db;
    level.variance_db2 =
        std::max(std::pow(spread_of(drawn).sigma, 2), fit.own_variance_db2[s]) + echo_variance_db2 + 0.01;
    level.drawn_db = std::move(drawn);
    known.push_back(level);
  }
  std::vector<std::string> names;
  for (const LevelEvidence& e : evidence) names.push_back(e.name);
  add_satellite_levels(known, names, receiver, levels);
  return levels;
}

}  // namespace canyon::calibration
