#include "canyon/geodesy/stray_times.hpp"

#include "canyon/base/longest_rise.hpp"

namespace canyon::geodesy {
namespace {

void mark_apart(const std::vector<GpsTime>& times, double apart_s, std::size_t many,
                std::vector<bool>& stray) {
  constexpr std::size_t kFew = 3;
  std::vector<std::size_t> rising;
  for (std::size_t i = 0; i < times.size(); ++i)
    if (!stray[i]) rising.push_back(i);
  for (std::size_t begin = 0, end = 0; begin < rising.size(); begin = end) {
    end = begin + 1;
    while (end < rising.size() && times[rising[end]] - times[rising[end - 1]] <= apart_s) ++end;
    if (end - begin > kFew || rising.size() < many * (end - begin)) continue;
    for (std::size_t i = begin; i < end; ++i) stray[rising[i]] = true;
  }
}

}  // namespace

std::vector<bool> stray_times(const std::vector<GpsTime>& times) {
  std::vector<bool> stray = outside_longest_rise(times);
  mark_apart(times, 86'400, 5, stray);
  mark_apart(times, 3600, 100, stray);
  return stray;
}

}  // namespace canyon::geodesy
