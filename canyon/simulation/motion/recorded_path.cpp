#include "canyon/simulation/motion/recorded_path.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/base/longest_rise.hpp"
#include "canyon/base/text.hpp"
#include "canyon/geodesy/time_scales.hpp"

namespace canyon::simulation {
namespace {

using geodesy::Geodetic;
using geodesy::GpsTime;

constexpr double kFarDate_s = 100 * 86'400.0;
constexpr double kJump_mps = 1000;
constexpr double kNearZero_m = 10e3;
constexpr double kHigh_m = 50e3;

double distance_m(const Geodetic& a, const Geodetic& b) {
  return (geodesy::ecef_from_geodetic(a) - geodesy::ecef_from_geodetic(b)).norm();
}

bool is_zero(const Geodetic& place) {
  return std::abs(place.latitude_rad) < 1e-9 && std::abs(place.longitude_rad) < 1e-9;
}

/// Removes the points that are marked; returns how many.
std::size_t erase_marked(RecordedPoints& points, const std::vector<bool>& marked) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (!marked[i]) points[kept++] = points[i];
  const std::size_t erased = points.size() - kept;
  points.resize(kept);
  return erased;
}

std::size_t leave_out_far_dates(RecordedPoints& points) {
  std::vector<GpsTime> times;
  times.reserve(points.size());
  for (const auto& point : points) times.push_back(point.first);
  const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
  std::nth_element(times.begin(), middle, times.end());
  std::vector<bool> far(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) far[i] = std::abs(points[i].first - *middle) > kFarDate_s;
  return erase_marked(points, far);
}

/// Ends of stretches that no jump interrupts: of each the index behind its last point.
std::vector<std::size_t> stretch_ends(const RecordedPoints& points) {
  std::vector<std::size_t> ends;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double limit_m = kJump_mps * (points[i].first - points[i - 1].first);
    if (distance_m(points[i].second, points[i - 1].second) > limit_m) ends.push_back(i);
  }
  ends.push_back(points.size());
  return ends;
}

void note_pauses(const Trajectory& trajectory, FileNotes& notes) {
  const auto pauses = trajectory.pauses();
  if (pauses.empty()) return;
  const auto longest = *std::max_element(pauses.begin(), pauses.end(), [](const auto& a, const auto& b) {
    return a.second - a.first < b.second - b.first;
  });
  notes.say(
      fmt::format("the recording pauses {} {}, at most {:.0f} s from {}: such a gap is driven straight; "
                  "start and duration_s choose a part without it",
                  pauses.size(), pauses.size() == 1 ? "time" : "times", longest.second - longest.first,
                  geodesy::format_gpst(longest.first, 0)));
}

}  // namespace

bool is_missing(std::string_view text) {
  const std::string word = lower_case(trim(text));
  for (const std::string_view none : {"", "nan", "null", "none", "na", "n/a", "-", "inf", "-inf"})
    if (word == none) return true;
  const std::optional<double> value = parse_double(word);
  if (!value) return false;
  for (const double fill : {-9999.0, -99999.0, -32768.0, 32767.0, 214.7483647})
    if (*value == fill) return true;
  return std::abs(*value) >= 1e19;
}

void FileNotes::say(std::size_t count, std::string_view what) {
  if (count > 0) say(fmt::format("{} {}", count, what));
}

void FileNotes::say(std::string_view what) {
  warnings_.push_back(fmt::format("{}: {}", path_.string(), what));
}

void keep_rising(RecordedPoints& points, FileNotes& notes) {
  const auto falls = [](const auto& a, const auto& b) { return b.first <= a.first; };
  if (points.empty()) return;
  notes.say(leave_out_far_dates(points), "points more than 100 days from the others are left out");
  if (std::adjacent_find(points.begin(), points.end(), falls) == points.end()) return;
  std::vector<GpsTime> times;
  for (const auto& point : points) times.push_back(point.first);
  const std::vector<bool> outside = outside_longest_rise(times);
  const std::size_t count = points.size();
  RecordedPoints kept = points;
  const std::size_t erased = erase_marked(kept, outside);
  std::size_t repeated = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (!outside[i]) continue;
    const auto same = std::lower_bound(kept.begin(), kept.end(), points[i].first,
                                       [](const auto& point, GpsTime time) { return point.first < time; });
    if (same != kept.end() && same->first == points[i].first) ++repeated;
  }
  const std::size_t backwards = erased - repeated;
  if (2 * backwards > count) {
    throw InputError(notes.path(), 0,
                     fmt::format("the times of {} of {} points do not follow the others", backwards, count),
                     "sort the points by time");
  }
  notes.say(repeated, "points repeat the time of another and are left out");
  notes.say(backwards, "points whose time does not follow the one before are left out");
  points = std::move(kept);
}

void leave_out_strays(RecordedPoints& points, FileNotes& notes) {
  std::vector<bool> marked(points.size());
  const auto elsewhere = std::count_if(points.begin(), points.end(), [](const auto& point) {
    return distance_m(point.second, Geodetic{0, 0, point.second.height_m}) > kNearZero_m;
  });
  for (std::size_t i = 0; i < points.size() && elsewhere > 0; ++i) marked[i] = is_zero(points[i].second);
  notes.say(erase_marked(points, marked),
            "points at latitude 0, longitude 0 are left out: receivers without a fix report that");

  const std::vector<std::size_t> ends = stretch_ends(points);
  if (ends.size() == 1) return;
  marked.assign(points.size(), false);
  const auto size = [&](std::size_t k) { return ends[k] - (k == 0 ? 0 : ends[k - 1]); };
  constexpr std::size_t kMuchLonger = 4;
  for (std::size_t k = 0; k < ends.size(); ++k) {
    const std::size_t from = ends[k] - size(k);
    bool stray = false;
    if (k == 0 || k + 1 == ends.size()) {
      stray = size(k == 0 ? 1 : k - 1) >= kMuchLonger * size(k);
    } else if (size(k) <= std::max(size(k - 1), size(k + 1))) {
      const auto& [time_before, place_before] = points[from - 1];
      const auto& [time_after, place_after] = points[ends[k]];
      stray = distance_m(place_before, place_after) <= kJump_mps * (time_after - time_before) / 2;
    }
    std::fill(marked.begin() + static_cast<std::ptrdiff_t>(from),
              marked.begin() + static_cast<std::ptrdiff_t>(ends[k]), stray);
  }
  // Two vehicles in one file jump all the time: neither is the stray.
  if (4 * static_cast<std::size_t>(std::count(marked.begin(), marked.end(), true)) > points.size()) {
    notes.say(ends.size() - 1, "times the path jumps at more than 1000 m/s: is it of several vehicles?");
    return;
  }
  notes.say(erase_marked(points, marked),
            "points are left out: they are reached or left at more than 1000 m/s, unlike those around them");
}

TrajectoryFile recorded_trajectory(RecordedPoints points, bool has_own_dates, FileNotes notes) {
  keep_rising(points, notes);
  leave_out_strays(points, notes);
  const auto highest = std::max_element(points.begin(), points.end(), [](const auto& a, const auto& b) {
    return a.second.height_m < b.second.height_m;
  });
  if (highest->second.height_m > kHigh_m) {
    notes.say(
        fmt::format("the path is up to {:.0f} km high: heights are metres above the ellipsoid; ECEF "
                    "coordinates belong in columns x, y, z of format csv",
                    highest->second.height_m / 1e3));
  }
  Trajectory trajectory(std::move(points));
  note_pauses(trajectory, notes);
  return {std::move(trajectory), has_own_dates, notes.take()};
}

}  // namespace canyon::simulation
