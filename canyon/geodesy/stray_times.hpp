#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "canyon/base/take_out.hpp"
#include "canyon/geodesy/gps_time.hpp"

namespace canyon::geodesy {

/// Groups of at most `few` times are stray if they are more than `gap_s` from all others, and if there are at
/// least `all` times as many in all.
struct StandsApart {
  double gap_s;
  std::size_t all;
  std::size_t few = 3;
};
/// A day from five times as many, an hour from a hundred times as many.
inline constexpr StandsApart kStandsApart[] = {{86'400, 5}, {3600, 100}};

/// Marks such groups in times that rise but for those that are marked already; equal times are allowed.
void mark_apart(const std::vector<GpsTime>& times, const StandsApart& rule, std::vector<bool>& stray);

/// Marks the times of a recording, in its order, that contradict the others: the fewest without which the
/// rest rises (outside_longest_rise()), and groups that stand apart.
[[nodiscard]] std::vector<bool> stray_times(const std::vector<GpsTime>& times,
                                            std::span<const StandsApart> rules = kStandsApart);

/// Takes the records out whose times are stray, and calls `taken` for each. @param time_of of a record
template <typename Record, typename TimeOf, typename Taken>
void leave_out_stray_times(std::vector<Record>& records, const TimeOf& time_of, const Taken& taken,
                           std::span<const StandsApart> rules = kStandsApart) {
  std::vector<GpsTime> times;
  times.reserve(records.size());
  for (const Record& record : records) times.push_back(time_of(record));
  take_out(records, stray_times(times, rules), taken);
}

}  // namespace canyon::geodesy
