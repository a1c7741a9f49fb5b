#include "canyon/geodesy/stray_times.hpp"

#include "canyon/base/longest_rise.hpp"

namespace canyon::geodesy {

void mark_apart(const std::vector<GpsTime>& times, const StandsApart& rule, std::vector<bool>& stray) {
  std::vector<std::size_t> rising;
  for (std::size_t i = 0; i < times.size(); ++i)
    if (!stray[i]) rising.push_back(i);
  for (std::size_t begin = 0, end = 0; begin < rising.size(); begin = end) {
    end = begin + 1;
    while (end < rising.size() && times[rising[end]] - times[rising[end - 1]] <= rule.gap_s) ++end;
    if (end - begin > rule.few || rising.size() < rule.all * (end - begin)) continue;
    for (std::size_t i = begin; i < end; ++i) stray[rising[i]] = true;
  }
}

std::vector<bool> stray_times(const std::vector<GpsTime>& times, std::span<const StandsApart> rules) {
  std::vector<bool> stray = outside_longest_rise(times);
  for (const StandsApart& rule : rules) mark_apart(times, rule, stray);
  return stray;
}

}  // namespace canyon::geodesy
