#include "canyon/relative/differences.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "canyon/geodesy/constants.hpp"
#include "canyon/relative/rtk_options.hpp"

namespace canyon::relative {
namespace {

/// The base's observation of the same signal; where that is missing or has no phase, of another component
/// on that carrier, whose phase files and RTCM align (RINEX 3.04, 5.2.16), unless the rover has that one as
/// well. Null without.
const ObservedMinusComputed* partner(const ObservedMinusComputed& r,
                                     std::span<const ObservedMinusComputed> rover,
                                     std::span<const ObservedMinusComputed> base) {
  const auto at = std::lower_bound(base.begin(), base.end(), r, before);
  const ObservedMinusComputed* const same = at != base.end() && !before(r, *at) ? &*at : nullptr;
  if (same != nullptr && (same->phase_m || !r.phase_m)) return same;
  const auto of_carrier = [&](const ObservedMinusComputed& o) {
    return o.id == r.id && o.signal->carrier_hz == r.signal->carrier_hz && o.phase_m;
  };
  // A carrier's phase counts once.
  const bool several = std::count_if(rover.begin(), rover.end(), of_carrier) > 1;
  const auto other = std::find_if(base.begin(), base.end(), of_carrier);
  return several || other == base.end() ? same : &*other;
}

}  // namespace

double Difference::ionosphere_rate() const {
  const double l1_m = geodesy::kSpeedOfLight / gnss::kL1_hz;
  return std::pow(rover->wavelength_m / l1_m, 2);
}

std::vector<Difference> differences_of(std::span<const ObservedMinusComputed> rover,
                                       std::span<const ObservedMinusComputed> base, double phase_sigma_m,
                                       double age_s) {
  std::vector<Difference> differences;
  for (const ObservedMinusComputed& r : rover) {
    const ObservedMinusComputed* const b = partner(r, rover, base);
    if (b == nullptr) continue;
    Difference d;
    d.rover = &r;
    d.code_m = r.code_m - b->code_m;
    d.has_phase = r.phase_m && b->phase_m;
    if (d.has_phase) d.phase_m = *r.phase_m - *b->phase_m;
    d.variance = phase_sigma_m * phase_sigma_m * (r.variance + b->variance);
    d.age_variance = std::pow(kAgeing_mps * age_s, 2);
    d.base_since = b->phase_since;
    d.half_cycle = r.half_cycle || b->half_cycle;
    d.aligned = r.aligned && b->aligned;
    differences.push_back(d);
  }
  return differences;
}

Groups groups_of(const std::vector<Difference>& differences) {
  Groups groups;
  for (std::size_t i = 0; i < differences.size(); ++i) groups[differences[i].rover->signal].push_back(i);
  for (auto group = groups.begin(); group != groups.end();) {
    group = group->second.size() < 2 ? groups.erase(group) : std::next(group);
  }
  return groups;
}

}  // namespace canyon::relative
