#include "canyon/gnss/navigation_data.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <tuple>
#include <utility>

#include "canyon/gnss/broadcast_messages.hpp"

namespace canyon::gnss {
namespace {

// Fields by which two records are the same. The health is one of them: a message that only turns a satellite
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

/// Whether two records of one identity say other things, by more than writers round.
bool contradict(const KeplerEphemeris& a, const KeplerEphemeris& b) {
  constexpr double kAngle_rad = 1e-6, kClock_s = 1e-7, kRootAxis = 1e-3;
  return std::abs(a.sqrt_a - b.sqrt_a) > kRootAxis ||
         std::abs(a.eccentricity - b.eccentricity) > kAngle_rad ||
         std::abs(a.mean_anomaly - b.mean_anomaly) > kAngle_rad ||
         std::abs(a.right_ascension - b.right_ascension) > kAngle_rad ||
         std::abs(a.inclination - b.inclination) > kAngle_rad ||
         std::abs(a.argument_of_perigee - b.argument_of_perigee) > kAngle_rad ||
         std::abs(a.af0 - b.af0) > kClock_s;
}
template <typename Ephemeris>
bool contradict(const Ephemeris& a, const Ephemeris& b) {
  constexpr double kPlace_m = 30;
  return std::hypot(a.position_m[0] - b.position_m[0], a.position_m[1] - b.position_m[1],
                    a.position_m[2] - b.position_m[2]) > kPlace_m;
}

template <typename Ephemeris>
void merge_records(std::vector<Ephemeris>& into, std::vector<Ephemeris>&& from, int source_offset) {
  for (Ephemeris& e : from) e.source += source_offset;
  into.insert(into.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
  // Stable, so that the record that came first stays. One that contradicts it stays for the review.
  std::stable_sort(into.begin(), into.end(),
                   [](const Ephemeris& a, const Ephemeris& b) { return identity(a) < identity(b); });
  into.erase(std::unique(into.begin(), into.end(),
                         [](const Ephemeris& a, const Ephemeris& b) {
                           return identity(a) == identity(b) && !contradict(a, b);
                         }),
             into.end());
  std::stable_sort(into.begin(), into.end(), [](const Ephemeris& a, const Ephemeris& b) {
    return std::tie(a.id, a.toe, a.transmission) < std::tie(b.id, b.toe, b.transmission);
  });
}

}  // namespace

void NavigationData::merge(NavigationData other) {
  const int source_offset = static_cast<int>(sources.size());
  merge_records(kepler, std::move(other.kepler), source_offset);
  merge_records(glonass, std::move(other.glonass), source_offset);
  merge_records(sbas, std::move(other.sbas), source_offset);
  const auto by_time = [](const SignalDelays& a, const SignalDelays& b) {
    return std::tie(a.id, a.toc) < std::tie(b.id, b.toc);
  };
  std::move(other.signal_delays.begin(), other.signal_delays.end(), std::back_inserter(signal_delays));
  std::stable_sort(signal_delays.begin(), signal_delays.end(), by_time);
  for (const auto& [system, coefficients] : other.klobuchar) klobuchar[system] = coefficients;
  if (other.galileo_nequick) galileo_nequick = other.galileo_nequick;
  if (other.leap_seconds) leap_seconds = other.leap_seconds;
  std::move(other.sources.begin(), other.sources.end(), std::back_inserter(sources));
  std::move(other.warnings.begin(), other.warnings.end(), std::back_inserter(warnings));
}

}  // namespace canyon::gnss
