#include "canyon/validation/report/report_samples.hpp"

#include <fmt/format.h>

#include <cassert>

#include "canyon/geodesy/time_scales.hpp"

namespace canyon::validation {

std::span<const ComparedSatellite> satellites_of(const Comparison& comparison, const ComparedEpoch& epoch) {
  return std::span<const ComparedSatellite>(comparison.satellites).subspan(epoch.first, epoch.count);
}

std::optional<double> horizontal_error_m(const ComparedFix& fix) {
  return fix.solved ? std::optional(fix.error_enu_m.head<2>().norm()) : std::nullopt;
}

ReportSamples report_samples(const Comparison& comparison, std::size_t first, std::size_t count) {
  ReportSamples samples;
  for (std::size_t e = first; e < first + count; ++e) {
    const ComparedEpoch& epoch = comparison.epochs[e];
    for (const ComparedSatellite& s : satellites_of(comparison, epoch)) {
      SamplePair& errors = s.clear ? samples.error_los_m : samples.error_nlos_m;
      if (s.measured && s.measured_error_m) errors.measured.push_back(*s.measured_error_m);
      if (s.simulated && s.simulated_error_m) errors.simulated.push_back(*s.simulated_error_m);
    }
    if (const auto m = horizontal_error_m(epoch.measured)) samples.horizontal_m.measured.push_back(*m);
    if (const auto m = horizontal_error_m(epoch.simulated)) samples.horizontal_m.simulated.push_back(*m);
  }
  return samples;
}

std::size_t richest_epoch(const Comparison& comparison, std::size_t first, std::size_t count) {
  assert(count > 0);
  const auto measured = [&](std::size_t e) {
    std::size_t n = 0;
    for (const ComparedSatellite& s : satellites_of(comparison, comparison.epochs[e]))
      n += s.measured ? 1U : 0U;
    return n;
  };
  const std::size_t middle = first + count / 2;
  const auto distance = [middle](std::size_t e) { return e > middle ? e - middle : middle - e; };
  std::size_t best = first, most = measured(first);
  for (std::size_t e = first + 1; e < first + count; ++e) {
    const std::size_t n = measured(e);
    if (n > most || (n == most && distance(e) < distance(best))) {
      best = e;
      most = n;
    }
  }
  return best;
}

std::string clock_gpst(geodesy::GpsTime time) {
  const geodesy::CalendarTime t = geodesy::calendar_from_gps(time);
  return fmt::format("{:02}:{:02}:{:02}", t.hour, t.minute, t.second);
}

}  // namespace canyon::validation
