#include "canyon/sky/orbit/broadcast_sky.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/sky/gnss/broadcast_messages.hpp"

namespace canyon::orbit {
namespace {

/// Two records count as equally close within this: signals received together left their satellites 0.07 to
/// 0.14 s before, and an epoch midway between two records shall take the newer one for all, as if chosen at
/// reception.
constexpr double kTie_s = 0.3;

using geodesy::GpsTime;

constexpr std::size_t kNumbers = 256;  // SatelliteId::number is a byte

// One record as the search sees it.
struct Entry {
  GpsTime toe;
  GpsTime transmission;
  gnss::Validity validity;
  int record = 0;  ///< into NavigationData::kepler, ::glonass or ::sbas
  bool healthy = false;
};

// The records of a satellite by ascending toe, one for each toe.
struct Series {
  std::vector<Entry> entries;
  double reach_s = 0;  ///< of the longest validity

  template <typename Ephemeris>
  void add(const Ephemeris& e, int record) {
    const Entry entry{e.toe, e.transmission, validity(e), record, is_healthy(e)};
    reach_s = std::max({reach_s, entry.validity.before_s, entry.validity.after_s});
    entries.push_back(entry);
  }

  // Among records of one toe only the newest message counts; the last one read where these are equal.
  void finish() {
    std::stable_sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
      return std::tie(a.toe, a.transmission) < std::tie(b.toe, b.transmission);
    });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < entries.size(); ++i) {
      if (i + 1 == entries.size() || entries[i + 1].toe != entries[i].toe) entries[kept++] = entries[i];
    }
    entries.resize(kept);
  }

  // The closest toe; the later one among equals.
  [[nodiscard]] const Entry* closest(GpsTime t) const {
    const Entry* best = nullptr;
    walk(t, [&best](const Entry& entry) {
      best = &entry;
      return true;
    });
    return best;
  }

  // The closest one within its own validity.
  [[nodiscard]] const Entry* closest_valid(GpsTime t) const {
    const Entry* best = nullptr;
    walk(t, [&](const Entry& entry) {
      const double age = t - entry.toe;
      if (entry.validity.contains(age)) best = &entry;
      return best != nullptr || std::abs(age) > reach_s;
    });
    return best;
  }

 private:
  // Shows entries by growing |t - toe| until `done` says so.
  template <typename Done>
  void walk(GpsTime t, Done done) const {
    auto right = std::lower_bound(entries.begin(), entries.end(), t,
                                  [](const Entry& entry, GpsTime at) { return entry.toe < at; });
    auto left = right;
    while (left != entries.begin() || right != entries.end()) {
      const bool take_right = left == entries.begin() ||
                              (right != entries.end() && right->toe - t <= t - std::prev(left)->toe + kTie_s);
      if (done(take_right ? *right++ : *--left)) return;
    }
  }
};

/// Group delays of single signals in the messages nearest in time.
void set_delays(const std::vector<const gnss::SignalDelays*>& delays, GpsTime t, SatelliteState& state) {
  // A satellite sends several messages, each of which has fields for some of its signals.
  std::array<const gnss::SignalDelays*, gnss::kMostSignals> nearest{};
  for (const gnss::SignalDelays* each : delays) {
    for (std::size_t i = 0; i < nearest.size(); ++i) {
      if (std::isinf(each->group_delay_s[i])) continue;
      const bool nearer = nearest[i] == nullptr || std::abs(t - each->toc) < std::abs(t - nearest[i]->toc);
      if (nearer) nearest[i] = each;
    }
  }
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    if (nearest[i] == nullptr || std::isnan(nearest[i]->group_delay_s[i])) continue;
    (i == 0 ? state.group_delay_s : state.more_group_delays_s[i - 1]) = nearest[i]->group_delay_s[i];
  }
}

// Result of `f` for a record of a satellite.
template <typename F>
auto of_record(const gnss::NavigationData& data, gnss::SatelliteId id, const Entry& entry, F f) {
  const auto record = static_cast<std::size_t>(entry.record);
  if (id.system == gnss::System::GLONASS) return f(data.glonass[record]);
  if (id.system == gnss::System::SBAS) return f(data.sbas[record]);
  return f(data.kepler[record]);
}

std::string hours(double seconds) {
  seconds = std::abs(seconds);
  return seconds < 5400        ? fmt::format("{:.0f} min", seconds / 60)
         : seconds < 2 * 86400 ? fmt::format("{:.1f} h", seconds / 3600)
                               : fmt::format("{:.1f} days", seconds / 86400);
}

}  // namespace

struct BroadcastSky::Index {
  struct Satellite {
    Series main;                                    ///< all but Galileo's F/NAV
    Series fallback;                                ///< Galileo F/NAV
    std::vector<const gnss::SignalDelays*> delays;  ///< by toc
  };
  std::vector<gnss::SatelliteId> ids;
  std::array<std::array<std::int16_t, kNumbers>, gnss::kSystemCount> slot;  ///< into satellites; -1: none
  std::vector<Satellite> satellites;
  GpsTime first, last;

  struct Choice {
    const Entry* entry = nullptr;  ///< null: nothing within validity
    bool stale = false;
  };

  [[nodiscard]] const Satellite* find(gnss::SatelliteId id) const {
    const auto system = static_cast<std::size_t>(id.system);
    if (system >= gnss::kSystemCount) return nullptr;
    const std::int16_t s = slot[system][id.number];
    return s < 0 ? nullptr : &satellites[static_cast<std::size_t>(s)];
  }

  // A valid one, I/NAV before F/NAV; else, if allowed, the closest of all.
  [[nodiscard]] static Choice choose(const Satellite& satellite, GpsTime t, bool allow_stale) {
    for (const Series* series : {&satellite.main, &satellite.fallback}) {
      if (const Entry* entry = series->closest_valid(t)) return {entry, false};
    }
    if (!allow_stale) return {};
    return {closest(satellite, t), true};
  }

  [[nodiscard]] static const Entry* closest(const Satellite& satellite, GpsTime t) {
    const Entry* a = satellite.main.closest(t);
    const Entry* b = satellite.fallback.closest(t);
    if (a == nullptr || b == nullptr) return a == nullptr ? b : a;
    return std::abs(t - b->toe) < std::abs(t - a->toe) ? b : a;
  }

  [[nodiscard]] Satellite& at(gnss::SatelliteId id) {
    std::int16_t& s = slot[static_cast<std::size_t>(id.system)][id.number];
    if (s < 0) {
      s = static_cast<std::int16_t>(satellites.size());
      satellites.emplace_back();
      ids.push_back(id);
    }
    return satellites[static_cast<std::size_t>(s)];
  }

  Index(const gnss::NavigationData& data, const std::set<gnss::System>& systems) {
    for (auto& row : slot) row.fill(-1);
    for (std::size_t i = 0; i < data.kepler.size(); ++i) {
      const gnss::KeplerEphemeris& e = data.kepler[i];
      if (systems.count(e.id.system) == 0) continue;
      Satellite& satellite = at(e.id);
      (is_galileo_fnav(e) ? satellite.fallback : satellite.main).add(e, static_cast<int>(i));
    }
    const auto add_states = [&](const auto& records) {
      for (std::size_t i = 0; i < records.size(); ++i) {
        if (systems.count(records[i].id.system) == 0) continue;
        at(records[i].id).main.add(records[i], static_cast<int>(i));
      }
    };
    add_states(data.glonass);
    add_states(data.sbas);
    for (const gnss::SignalDelays& delays : data.signal_delays) {
      const std::int16_t s = slot[static_cast<std::size_t>(delays.id.system)][delays.id.number];
      if (s >= 0) satellites[static_cast<std::size_t>(s)].delays.push_back(&delays);
    }
    std::sort(ids.begin(), ids.end());
    bool any = false;
    for (Satellite& satellite : satellites) {
      for (Series* series : {&satellite.main, &satellite.fallback}) {
        series->finish();
        if (series->entries.empty()) continue;
        const GpsTime begin = series->entries.front().toe, end = series->entries.back().toe;
        first = any ? std::min(first, begin) : begin;
        last = any ? std::max(last, end) : end;
        any = true;
      }
    }
  }
};

BroadcastSky::BroadcastSky(gnss::NavigationData data, BroadcastOptions options)
    : data_(std::move(data)),
      options_(std::move(options)),
      glonass_(data_.glonass.size()),
      index_(std::make_unique<Index>(data_, options_.systems)) {
  if (index_->ids.empty()) {
    std::string wanted;
    for (const gnss::System system : options_.systems) {
      wanted += wanted.empty() ? "" : ", ";
      wanted += name(system);
    }
    std::string files;
    for (const std::string& file : data_.sources) files += (files.empty() ? "" : ", ") + file;
    throw InputError(fmt::format("no ephemeris of {} in {}", wanted.empty() ? "no system at all" : wanted,
                                 files.empty() ? "the navigation data" : files),
                     "name other systems or give their navigation files");
  }
}

BroadcastSky::~BroadcastSky() = default;

std::vector<gnss::SatelliteId> BroadcastSky::satellites() const {
  return index_->ids;
}

std::optional<SatelliteState> BroadcastSky::state(gnss::SatelliteId id, GpsTime t) const {
  const Index::Satellite* satellite = index_->find(id);
  if (satellite == nullptr) return std::nullopt;
  const Entry* entry = Index::choose(*satellite, t, options_.allow_stale).entry;
  if (entry == nullptr || (!entry->healthy && !options_.allow_unhealthy)) return std::nullopt;
  const auto record = static_cast<std::size_t>(entry->record);
  SatelliteState state = id.system == gnss::System::GLONASS
                             ? glonass_[record].propagate(data_.glonass[record], t)
                             : of_record(data_, id, *entry, [t](const auto& e) { return propagate(e, t); });
  set_delays(satellite->delays, t, state);
  return state;
}

std::string BroadcastSky::source(gnss::SatelliteId id, GpsTime t) const {
  const Index::Satellite* satellite = index_->find(id);
  if (satellite == nullptr) return fmt::format("no ephemeris of {} in the navigation data", to_string(id));
  const Index::Choice choice = Index::choose(*satellite, t, options_.allow_stale);
  const Entry& entry = choice.entry != nullptr ? *choice.entry : *Index::closest(*satellite, t);

  const auto file =
      static_cast<std::size_t>(of_record(data_, id, entry, [](const auto& e) { return e.source; }));
  std::string text = file < data_.sources.size() ? data_.sources[file] + ", " : std::string();
  if (id.system == gnss::System::Galileo)
    text += is_galileo_fnav(data_.kepler[static_cast<std::size_t>(entry.record)]) ? "F/NAV, " : "I/NAV, ";
  text += "toe " + geodesy::format_gpst(entry.toe, 0);

  const double age = t - entry.toe;
  const std::string limit =
      fmt::format("{} {} toe, {} allows {}", hours(age), age < 0 ? "before" : "after", name(id.system),
                  hours(age < 0 ? entry.validity.before_s : entry.validity.after_s));
  if (choice.entry == nullptr) {
    return fmt::format("none: the closest ephemeris is {}; allow_stale: true takes it ({})", limit, text);
  }
  if (choice.stale) text += ", stale: " + limit;
  if (!entry.healthy) {
    const int health = of_record(data_, id, entry, [](const auto& e) { return e.health; });
    text +=
        health == 0 ? ", unhealthy (no accuracy prediction)" : fmt::format(", unhealthy (health {})", health);
    if (!options_.allow_unhealthy) text = "none: " + text;
  }
  return text;
}

bool BroadcastSky::covers(GpsTime t) const {
  return std::any_of(index_->satellites.begin(), index_->satellites.end(), [&](const Index::Satellite& s) {
    const Entry* entry = Index::choose(s, t, options_.allow_stale).entry;
    return entry != nullptr && (entry->healthy || options_.allow_unhealthy);
  });
}

std::pair<GpsTime, GpsTime> BroadcastSky::span() const {
  return {index_->first, index_->last};
}

}  // namespace canyon::orbit
