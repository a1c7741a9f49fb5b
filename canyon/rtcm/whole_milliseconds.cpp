#include "canyon/rtcm/whole_milliseconds.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "canyon/geodesy/constants.hpp"
#include "canyon/rtcm/msm.hpp"

namespace canyon::rtcm {
namespace {

constexpr double kAgreement_m = 0.05 * kMillisecond_m;

/// The value plus whole units that is nearest to zero.
double wrapped(double value, double unit) {
  return value - unit * std::round(value / unit);
}

}  // namespace

RangeTable range_table(std::shared_ptr<const orbit::Sky> sky, const Eigen::Vector3d& fallback) {
  return [sky = std::move(sky), fallback](gnss::SatelliteId id, geodesy::GpsTime reception,
                                          const Eigen::Vector3d& place) -> std::optional<double> {
    const Eigen::Vector3d& at = place.isZero() ? fallback : place;
    if (at.isZero()) return std::nullopt;
    const auto seen = orbit::line_of_sight(*sky, id, reception, at);
    if (!seen) return std::nullopt;
    return seen->range_m - geodesy::kSpeedOfLight * seen->state.clock_bias_s;
  };
}

std::vector<std::optional<double>> whole_milliseconds(const std::vector<PartialRange>& ranges) {
  // The receiver's clock by each satellite, modulo a millisecond: the one that most agree on.
  std::size_t most = 0;
  double clock_m = 0;
  for (const PartialRange& centre : ranges) {
    const double at_m = wrapped(centre.modulo_m - centre.predicted_m, kMillisecond_m);
    double sum_m = 0;
    std::size_t count = 0;
    for (const PartialRange& range : ranges) {
      const double off_m = wrapped(range.modulo_m - range.predicted_m - at_m, kMillisecond_m);
      if (std::abs(off_m) > kAgreement_m) continue;
      sum_m += off_m;
      ++count;
    }
    if (count <= most) continue;
    most = count;
    clock_m = wrapped(at_m + sum_m / static_cast<double>(count), kMillisecond_m);
  }
  std::vector<std::optional<double>> whole(ranges.size());
  if (most < 4 || 3 * most < 2 * ranges.size()) return whole;
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const PartialRange& range = ranges[i];
    const double expected_m = range.predicted_m + clock_m;
    const double units = std::round((expected_m - range.modulo_m) / range.unit_m);
    if (std::abs(range.modulo_m + units * range.unit_m - expected_m) <= kAgreement_m)
      whole[i] = units * range.unit_m;
  }
  return whole;
}

}  // namespace canyon::rtcm
