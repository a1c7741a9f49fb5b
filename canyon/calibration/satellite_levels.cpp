#include "canyon/calibration/satellite_levels.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>

#include "canyon/geodesy/constants.hpp"
#include "canyon/gnss/signal_groups.hpp"
#include "canyon/options/values.hpp"

namespace canyon::calibration {
namespace {

using Verdict = Estimate::Verdict;
constexpr double kStandsOut = 2.5, kStandsOut_db = 0.5;

struct Mean {
  double value = 0, variance = 0;
  std::size_t n = 0;
};

std::string system_of(const SatelliteLevel& s) {
  return std::string(gnss::name(s.id.system));
}

/// "GPS-IIF", "BeiDou-2&BeiDou-GEO"; the system where blocks are not distinguished.
std::string block_of(const SatelliteLevel& s) {
  std::string block(gnss::block_of(s.id, s.time));
  for (const char* orbit : {"BeiDou-GEO", "BeiDou-IGSO", "BeiDou-MEO"}) {
    if (gnss::in_group(orbit, s.id, *s.signal, s.time)) block += std::string("&") + orbit;
  }
  return block.empty() ? system_of(s) : block;
}

/// Satellites' first signals in groups that have one level each.
class Groups {
 public:
  explicit Groups(std::span<const SatelliteLevel> satellites) {
    for (const SatelliteLevel& s : satellites) {
      if (gnss::index_of(*s.signal) != 0) continue;
      satellites_.push_back(&s);
      group_.push_back(system_of(s));
    }
    find_spread();
    while (split_one()) find_spread();
  }

  [[nodiscard]] std::set<std::string> names() const { return {group_.begin(), group_.end()}; }
  [[nodiscard]] Mean mean(const std::string& group) const {
    return mean_of([&](std::size_t i) { return group_[i] == group; });
  }
  /// Of one system, satellites of blocks that stand out aside; of the whole where all do.
  template <typename Of>
  [[nodiscard]] Mean mean_of(const Of& of) const {
    Mean m;
    double weights = 0;
    std::vector<double> drawn;
    for (std::size_t i = 0; i < satellites_.size(); ++i) {
      if (!of(i)) continue;
      const SatelliteLevel& s = *satellites_[i];
      const double w = weight(i);
      m.value += w * s.level_db;
      weights += w;
      ++m.n;
      drawn.resize(s.drawn_db.size(), 0);
      for (std::size_t k = 0; k < drawn.size(); ++k) drawn[k] += w * s.drawn_db[k];
    }
    if (m.n == 0) return m;
    m.value /= weights;
    // What stands beside a street shadows several satellites at once.
    double together = 0, sum = 0;
    for (const double v : drawn) sum += v / weights / static_cast<double>(drawn.size());
    for (const double v : drawn)
      together += std::pow(v / weights - sum, 2) / static_cast<double>(drawn.size());
    m.variance = std::max(1 / weights, together);
    return m;
  }
  /// What is left of a satellite's level behind its group's.
  [[nodiscard]] double rest(std::size_t i) const { return satellites_[i]->level_db - mean(group_[i]).value; }
  [[nodiscard]] double weight(std::size_t i) const {
    return 1 / (satellites_[i]->variance_db2 + spread_ * spread_);
  }
  [[nodiscard]] std::size_t size() const { return satellites_.size(); }
  [[nodiscard]] const SatelliteLevel& at(std::size_t i) const { return *satellites_[i]; }
  [[nodiscard]] double spread_db() const { return spread_; }
  [[nodiscard]] std::size_t freedom() const {
    const std::size_t groups = names().size();
    return satellites_.size() > groups ? satellites_.size() - groups : 0;
  }

 private:
  /// Generalised chi square of the rests over their degrees of freedom, which is 1 for the right spread.
  [[nodiscard]] double excess(double spread) {
    spread_ = spread;
    std::map<std::string, Mean> means;
    for (const std::string& group : names()) means[group] = mean(group);
    double sum = 0;
    for (std::size_t i = 0; i < satellites_.size(); ++i) {
      const double rest = satellites_[i]->level_db - means[group_[i]].value;
      sum += rest * rest * weight(i);
    }
    return sum - static_cast<double>(freedom());
  }
  void find_spread() {
    double low = 0, high = 20;
    if (freedom() == 0 || excess(0) <= 0) {
      spread_ = 0;
      return;
    }
    for (int i = 0; i < 50; ++i) {
      const double middle = (low + high) / 2;
      (excess(middle) > 0 ? low : high) = middle;
    }
    spread_ = (low + high) / 2;
  }
  bool split_one() {
    double most = kStandsOut;
    std::string chosen;
    std::set<std::string> blocks;
    for (const SatelliteLevel* s : satellites_) blocks.insert(block_of(*s));
    for (const std::string& block : blocks) {
      if (names().count(block) != 0) continue;
      std::string of;
      const Mean own = mean_of([&](std::size_t i) {
        const bool in = block_of(*satellites_[i]) == block;
        if (in) of = group_[i];
        return in;
      });
      const Mean others =
          mean_of([&](std::size_t i) { return group_[i] == of && block_of(*satellites_[i]) != block; });
      if (own.n < 2 || others.n < 2) continue;
      const double difference = std::abs(own.value - others.value);
      const double z = difference / std::sqrt(own.variance + others.variance);
      if (difference > kStandsOut_db && z > most) {
        most = z;
        chosen = block;
      }
    }
    if (chosen.empty()) return false;
    for (std::size_t i = 0; i < satellites_.size(); ++i) {
      if (block_of(*satellites_[i]) == chosen) group_[i] = chosen;
    }
    return true;
  }

  std::vector<const SatelliteLevel*> satellites_;
  std::vector<std::string> group_;
  double spread_ = 1;
};

std::string plus_minus(double value, double sigma) {
  return fmt::format("{} +- {}", rounded(value, sigma), rounded(sigma, sigma));
}

/// The system whose level is the link budget's: GPS if it has three satellites, else the one with most.
std::string reference_of(const Groups& groups) {
  std::map<std::string, std::size_t> counts;
  for (std::size_t i = 0; i < groups.size(); ++i) ++counts[system_of(groups.at(i))];
  if (counts["GPS"] >= 3) return "GPS";
  return std::max_element(counts.begin(), counts.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

/// Of a group that is a block, the system's name.
std::string system_of_group(const std::string& group) {
  return group.substr(0, std::min(group.find('-'), group.size()));
}

/// Further signals beside the first of the same satellites: "GPS&L2C".
std::map<std::string, Mean> further_levels(std::span<const SatelliteLevel> satellites) {
  std::map<std::string, std::vector<double>> differences;
  for (const SatelliteLevel& s : satellites) {
    if (gnss::index_of(*s.signal) == 0) continue;
    const auto first = std::find_if(satellites.begin(), satellites.end(), [&s](const SatelliteLevel& o) {
      return o.drive == s.drive && o.id == s.id && gnss::index_of(*o.signal) == 0;
    });
    if (first == satellites.end()) continue;
    differences[system_of(s) + "&" + std::string(s.signal->name)].push_back(s.level_db - first->level_db);
  }
  std::map<std::string, Mean> means;
  for (const auto& [group, values] : differences) {
    const auto n = static_cast<double>(values.size());
    Mean m;
    m.n = values.size();
    for (const double v : values) m.value += v / n;
    for (const double v : values) m.variance += (v - m.value) * (v - m.value) / std::max(n - 1, 1.0) / n;
    m.variance += 0.04;
    means[group] = m;
  }
  return means;
}

void add_slope(const Groups& groups, Levels& levels) {
  // A straight line over the mean elevations of the satellites.
  double w = 0, wx = 0, wy = 0, wxx = 0, wxy = 0;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const double x = geodesy::degrees(groups.at(i).elevation_rad) / 10, weight = groups.weight(i);
    w += weight;
    wx += weight * x;
    wy += weight * groups.rest(i);
    wxx += weight * x * x;
    wxy += weight * x * groups.rest(i);
  }
  const double spread = wxx - wx * wx / w;
  if (groups.freedom() >= 4 && spread > 0) {
    const double slope = (wxy - wx * wy / w) / spread, sigma = std::sqrt(1 / spread);
    levels.notes.push_back(fmt::format(
        "Over elevation C/N0 changes by {} dB for 10 deg beside antenna and budget{}",
        plus_minus(slope, sigma),
        std::abs(slope) > kStandsOut * sigma ? ": the antenna's pattern (signal.antenna) does not fit"
                                             : ", as it should"));
  }
}

/// Takes off what one recording's reference system lies beside the mean of all: another car, antenna or cable
/// is no spread between satellites. Notes report it.
std::vector<SatelliteLevel> without_drives(std::span<const SatelliteLevel> satellites,
                                           std::span<const std::string> drives, Levels& levels) {
  std::vector<SatelliteLevel> result(satellites.begin(), satellites.end());
  std::map<std::size_t, Mean> means;
  std::map<std::string, std::set<std::size_t>> recorded_by;
  for (const SatelliteLevel& s : satellites) {
    if (gnss::index_of(*s.signal) == 0) recorded_by[system_of(s)].insert(s.drive);
  }
  const auto common = std::find_if(recorded_by.begin(), recorded_by.end(),
                                   [&](const auto& of) { return of.second.size() == drives.size(); });
  if (drives.size() < 2 || common == recorded_by.end()) return result;
  const std::string system = recorded_by["GPS"].size() == drives.size() ? "GPS" : common->first;
  double all = 0;
  for (std::size_t d = 0; d < drives.size(); ++d) {
    std::vector<SatelliteLevel> own;
    std::copy_if(satellites.begin(), satellites.end(), std::back_inserter(own), [&](const SatelliteLevel& s) {
      return s.drive == d && system_of(s) == system && gnss::index_of(*s.signal) == 0;
    });
    const Groups groups(own);
    means[d] = groups.mean_of([](std::size_t) { return true; });
    all += means[d].value / static_cast<double>(drives.size());
  }
  for (SatelliteLevel& s : result) s.level_db -= means[s.drive].value - all;
  for (std::size_t d = 0; d < drives.size(); ++d) {
    const double sigma = std::sqrt(means[d].variance);
    if (std::abs(means[d].value - all) < 2 * sigma) continue;
    levels.notes.push_back(
        fmt::format("{}: {} lies {} dB from the mean of all recordings; its antenna, cable or "
                    "receiver is another",
                    drives[d], system, plus_minus(means[d].value - all, sigma)));
  }
  return result;
}

}  // namespace

void add_satellite_levels(std::span<const SatelliteLevel> of_drives, std::span<const std::string> drives,
                          const simulation::ReceiverConfig& receiver, Levels& levels) {
  const std::vector<SatelliteLevel> satellites = without_drives(of_drives, drives, levels);
  const tracking::SignalOptions& signal = receiver.options.signal;
  Estimate common{
      "signal.link.above_minimum_db", "dB", options::show(signal.link.above_minimum_db), {}, {}, {}, {}, {}};
  common.after = common.before;
  Estimate spread{
      "signal.satellite_sigma_db", "dB", options::show(signal.satellite_sigma_db), {}, {}, {}, {}, {}};
  spread.after = spread.before;
  const Groups groups(satellites);
  if (groups.size() == 0) {
    common.basis = spread.basis = "no satellite stands in clear view with C/N0 for long enough";
    levels.estimates.insert(levels.estimates.end(), {common, spread});
    return;
  }

  const std::string reference = reference_of(groups);
  const auto in_reference = [&](std::size_t i) { return system_of(groups.at(i)) == reference; };
  Mean base = groups.mean(reference);
  if (base.n == 0) base = groups.mean_of(in_reference);
  const double sigma = std::sqrt(base.variance);
  const double above_db = std::clamp(signal.link.above_minimum_db + base.value, -10.0, 20.0);
  common.told = rounded(above_db, sigma);
  common.interval =
      fmt::format("{} to {}", rounded(above_db - 2 * sigma, sigma), rounded(above_db + 2 * sigma, sigma));
  common.verdict = std::abs(base.value) > 2 * sigma ? Verdict::Fitted : Verdict::Agrees;
  common.basis = fmt::format("{} {} satellites in clear view; satellite, antenna, cable and noise together",
                             base.n, reference);
  if (common.verdict == Verdict::Fitted) {
    common.after = common.told;
    levels.values[common.key] = common.after;
  }
  levels.estimates.push_back(common);

  // Others beside the reference.
  Estimate offsets{"signal.offset_db", "dB", "", "", "", "", Verdict::Agrees, ""};
  gnss::GroupValues after = signal.offset_db;
  std::vector<std::string> offset_texts;
  const auto add = [&](const std::string& group, double difference, double error, std::size_t n) {
    const auto was = signal.offset_db.find(group);
    const double before = was != signal.offset_db.end() ? was->second : 0;
    offset_texts.push_back(fmt::format("{} {} ({})", group, plus_minus(before + difference, error), n));
    if (std::abs(difference) < 2 * error) return;
    after[group] = std::stod(rounded(before + difference, error));
    offsets.verdict = Verdict::Fitted;
  };
  for (const std::string& group : groups.names()) {
    if (group == reference) continue;
    const Mean own = groups.mean(group);
    const std::string system = system_of_group(group);
    Mean beside = group == system || system == reference ? base : groups.mean(system);
    if (beside.n == 0) beside = base;
    add(group, own.value - beside.value, std::sqrt(own.variance + beside.variance), own.n);
  }
  for (const auto& [group, level] : further_levels(satellites)) {
    if (level.n >= 2) add(group, level.value, std::sqrt(level.variance), level.n);
  }
  if (!offset_texts.empty()) {
    const auto text_of = [](const gnss::GroupValues& values) {
      std::vector<std::string> items;
      for (const auto& [group, value] : values)
        items.push_back(fmt::format("{}={}", group, options::show(value)));
      return fmt::format("[{}]", fmt::join(items, ", "));
    };
    offsets.before = text_of(signal.offset_db);
    offsets.after = text_of(after);
    offsets.told = fmt::format("{}", fmt::join(offset_texts, ", "));
    offsets.basis = fmt::format("levels beside {}, satellites in brackets", reference);
    if (offsets.verdict == Verdict::Fitted) levels.values[offsets.key] = offsets.after;
    levels.estimates.push_back(offsets);
  }

  constexpr std::size_t kFewest = 4;
  if (groups.freedom() < kFewest) {
    spread.basis =
        fmt::format("{} satellites in {} groups tell no spread", groups.size(), groups.names().size());
  } else {
    const auto freedom = static_cast<double>(groups.freedom());
    const double value = groups.spread_db(), error = std::max(value, 0.3) / std::sqrt(2 * freedom);
    spread.told = rounded(value, error);
    spread.interval = fmt::format("{} to {}", rounded(std::max(0.0, value - 2 * error), error),
                                  rounded(value + 2 * error, error));
    spread.verdict =
        std::abs(value - signal.satellite_sigma_db) > 2 * error ? Verdict::Fitted : Verdict::Agrees;
    spread.basis =
        fmt::format("levels of {} satellites about those of {} groups", groups.size(), groups.names().size());
    if (spread.verdict == Verdict::Fitted) {
      spread.after = spread.told;
      levels.values[spread.key] = spread.after;
    }
  }
  levels.estimates.push_back(spread);
  add_slope(groups, levels);
}

}  // namespace canyon::calibration
