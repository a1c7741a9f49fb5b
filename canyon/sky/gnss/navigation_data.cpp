#include "canyon/sky/gnss/navigation_data.hpp"

#include <algorithm>
#include <iterator>
#include <set>
#include <tuple>
#include <type_traits>
#include <utility>

namespace canyon::gnss {
namespace {

// Fields that identify duplicate records. They include the health: a message that only marks a satellite as
// unhealthy must not be lost.
auto identity(const KeplerEphemeris& e) {
  return std::make_tuple(e.id, e.toe, is_galileo_fnav(e), e.iode, e.iodc, e.health);
}
auto identity(const GlonassEphemeris& e) {
  return std::make_tuple(e.id, e.toe, e.health);
}

auto identity(const SbasEphemeris& e) {
  return std::make_tuple(e.id, e.toe, e.iodn, e.health);
}

/// Keeps records whose clock has the time of their orbit, and others if no such record has their toe: some
/// receivers have written messages mixed from two issues, with errors of 2,201 km.
void drop_mixed(std::vector<KeplerEphemeris>& records, ReadReport& report) {
  const auto key = [](const KeplerEphemeris& e) { return std::make_tuple(e.id, e.toe, is_galileo_fnav(e)); };
  std::set<decltype(key(records.front()))> whole;
  for (const KeplerEphemeris& e : records)
    if (e.toc == e.toe) whole.insert(key(e));
  std::erase_if(records, [&](const KeplerEphemeris& e) {
    const bool dropped = e.toc != e.toe && whole.count(key(e)) > 0;
    if (dropped)
      report.add_counted(ReadReport::Level::Remark,
                         "{} messages of two issues (toc is not toe) next to one of the same toe, left out",
                         to_string(e.id));
    return dropped;
  });
}

template <typename Ephemeris>
void merge_records(std::vector<Ephemeris>& into, std::vector<Ephemeris>&& from, int source_offset,
                   ReadReport& report) {
  for (Ephemeris& e : from) e.source += source_offset;
  into.insert(into.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
  if constexpr (std::is_same_v<Ephemeris, KeplerEphemeris>) drop_mixed(into, report);
  // Stable, so that the first record is kept.
  std::stable_sort(into.begin(), into.end(),
                   [](const Ephemeris& a, const Ephemeris& b) { return identity(a) < identity(b); });
  into.erase(std::unique(into.begin(), into.end(),
                         [](const Ephemeris& a, const Ephemeris& b) { return identity(a) == identity(b); }),
             into.end());
  std::stable_sort(into.begin(), into.end(), [](const Ephemeris& a, const Ephemeris& b) {
    return std::tie(a.id, a.toe, a.transmission) < std::tie(b.id, b.toe, b.transmission);
  });
}

}  // namespace

void NavigationData::merge(NavigationData other) {
  const int source_offset = static_cast<int>(sources.size());
  merge_records(kepler, std::move(other.kepler), source_offset, report);
  merge_records(glonass, std::move(other.glonass), source_offset, report);
  merge_records(sbas, std::move(other.sbas), source_offset, report);
  const auto by_time = [](const SignalDelays& a, const SignalDelays& b) {
    return std::tie(a.id, a.toc) < std::tie(b.id, b.toc);
  };
  std::move(other.signal_delays.begin(), other.signal_delays.end(), std::back_inserter(signal_delays));
  std::stable_sort(signal_delays.begin(), signal_delays.end(), by_time);
  for (const auto& [system, coefficients] : other.klobuchar) klobuchar[system] = coefficients;
  if (other.galileo_nequick) galileo_nequick = other.galileo_nequick;
  if (other.leap_seconds) leap_seconds = other.leap_seconds;
  std::move(other.sources.begin(), other.sources.end(), std::back_inserter(sources));
  report.append(other.report);
}

bool is_galileo_fnav(const KeplerEphemeris& e) {
  if (e.id.system != System::Galileo) return false;
  const bool fnav_clock = (e.data_sources & (1 << 8)) != 0;
  const bool inav_clock = (e.data_sources & (1 << 9)) != 0;
  if (fnav_clock != inav_clock) return fnav_clock;
  return (e.data_sources & 0b111) == 0b010;
}

bool is_beidou_geo(SatelliteId id) {
  return id.system == System::BeiDou && (id.number <= 5 || (id.number >= 59 && id.number <= 63));
}

bool is_healthy(const KeplerEphemeris& e) {
  switch (e.id.system) {
    case System::QZSS:
      return (e.health & 0x30) == 0;
    case System::Galileo: {
      const bool knows_e1 = !is_galileo_fnav(e) || (e.data_sources & 0b101) != 0;
      return (e.health & (knows_e1 ? 0b111 : 0b111111)) == 0 && e.accuracy_m >= 0;
    }
    case System::GPS:
    case System::GLONASS:
    case System::BeiDou:
    case System::SBAS:
      break;
  }
  return e.health == 0;
}

bool is_healthy(const GlonassEphemeris& e) {
  return e.health == 0;
}

bool is_healthy(const SbasEphemeris& e) {
  return (e.health & 0b110001) == 0;
}

Validity validity(const KeplerEphemeris& e) {
  constexpr double kHour = 3600;
  // IS-GPS-200 table 20-XII: the longest fit interval is 146 h.
  constexpr double kMaxFit = 146;
  switch (e.id.system) {
    case System::Galileo:
      return {0.5 * kHour, 4 * kHour};
    case System::BeiDou:
      return {1 * kHour, 3 * kHour};
    case System::GPS:
    case System::QZSS:
    case System::GLONASS:
    case System::SBAS:
      break;
  }
  const double half_fit = std::clamp(e.fit_interval_h / 2, 2.0, kMaxFit / 2) * kHour;
  return {half_fit, half_fit};
}

Validity validity(const GlonassEphemeris&) {
  return {1800, 1800};
}

Validity validity(const SbasEphemeris&) {
  return {360, 360};
}

}  // namespace canyon::gnss
