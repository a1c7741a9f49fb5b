#include "canyon/simulation/motion/recorded_path.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "canyon/base/input_error.hpp"
#include "canyon/base/longest_rise.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/base/take_out.hpp"
#include "canyon/base/text.hpp"
#include "canyon/geodesy/stray_times.hpp"
#include "canyon/geodesy/time_scales.hpp"

namespace canyon::simulation {
namespace {

using geodesy::Geodetic;
using geodesy::GpsTime;

constexpr double kFarDate_s = 100 * 86'400.0;
constexpr double kJump_mps = 1000;
constexpr double kNearZero_m = 10e3;
constexpr double kHigh_m = 50e3;
constexpr double kSpike_m = 15;
constexpr double kSpike_mps2 = 20;
constexpr double kOneVehicle_m = 100;

double distance_m(const Geodetic& a, const Geodetic& b) {
  return (geodesy::ecef_from_geodetic(a) - geodesy::ecef_from_geodetic(b)).norm();
}

bool is_zero(const Geodetic& place) {
  return std::abs(place.latitude_rad) < 1e-9 && std::abs(place.longitude_rad) < 1e-9;
}

/// Leaves out the points that are marked.
void leave_out(RecordedPoints& points, const std::vector<bool>& marked, std::string_view why,
               RecordNotes& notes) {
  take_out(points, marked, [&](const RecordedPoint& point) { notes.skip(point.line, why); });
}

/// Distances of points from the straight way between two others.
class Deviations {
 public:
  explicit Deviations(const RecordedPoints& points) : points_(points) {
    for (const auto& point : points) ecef_.push_back(geodesy::ecef_from_geodetic(point.place));
  }
  /// Distance of point b from the way from a to c, at b's time [m].
  [[nodiscard]] double m(std::size_t a, std::size_t b, std::size_t c) const {
    const double share = (points_[b].time - points_[a].time) / (points_[c].time - points_[a].time);
    return (ecef_[b] - ecef_[a] - share * (ecef_[c] - ecef_[a])).norm();
  }
  /// Whether the way a, b, c is beyond what vehicles do: `m` needs more than kSpike_mps2.
  [[nodiscard]] bool impossible(std::size_t a, std::size_t b, std::size_t c, double limit_m) const {
    const double product_s2 = (points_[b].time - points_[a].time) * (points_[c].time - points_[b].time);
    const double off_m = m(a, b, c);
    return off_m > limit_m && 2 * off_m > kSpike_mps2 * product_s2;
  }

 private:
  const RecordedPoints& points_;
  std::vector<Eigen::Vector3d> ecef_;
};

/// Whether point i of n is off while the points around it lie on one way without it.
bool is_spike(const Deviations& off, std::size_t i, std::size_t n, double limit_m) {
  constexpr double kCalm = 0.25;
  if (i == 0 || i + 1 == n) {
    const std::size_t next = i == 0 ? 1 : n - 2;
    if (!off.impossible(next - 1, next, next + 1, limit_m) || is_spike(off, next, n, limit_m)) return false;
    const double calm_m = i == 0 ? off.m(1, 2, 3) : off.m(n - 4, n - 3, n - 2);
    return calm_m < kCalm * off.m(next - 1, next, next + 1);
  }
  if (!off.impossible(i - 1, i, i + 1, limit_m)) return false;
  const double off_m = kCalm * off.m(i - 1, i, i + 1);
  return (i < 2 || off.m(i - 2, i - 1, i + 1) < off_m) && (i + 2 >= n || off.m(i - 1, i + 1, i + 2) < off_m);
}

void leave_out_spikes(RecordedPoints& points, RecordNotes& notes) {
  const std::size_t n = points.size();
  if (n < 5) return;
  const Deviations off(points);
  std::vector<double> all_m;
  for (std::size_t i = 1; i + 1 < n; ++i) all_m.push_back(off.m(i - 1, i, i + 1));
  const double middle_m = *median(all_m);
  const double limit_m = std::max(kSpike_m, 10 * middle_m);
  std::size_t jumps = 0;
  std::vector<bool> marked(n);
  for (std::size_t i = 0; i < n; ++i) {
    marked[i] = is_spike(off, i, n, limit_m);
    if (i > 0 && i + 1 < n && off.impossible(i - 1, i, i + 1, kSpike_m)) ++jumps;
  }
  if (2 * jumps > n) {
    notes.say(0, fmt::format("most points are off the way between their neighbours, by {:.0f} m: is it of "
                             "several receivers? keep one",
                             middle_m));
  }
  leave_out(points, marked, "point far off the way from the one before to the one behind", notes);
}

void leave_out_far_dates(RecordedPoints& points, RecordNotes& notes) {
  std::vector<GpsTime> times;
  times.reserve(points.size());
  for (const auto& point : points) times.push_back(point.time);
  const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
  std::nth_element(times.begin(), middle, times.end());
  std::vector<bool> far(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) far[i] = std::abs(points[i].time - *middle) > kFarDate_s;
  leave_out(points, far, "point more than 100 days from the others", notes);
}

/// A first or last point far from all others in time: a digit of its time is wrong.
void leave_out_lone_times(RecordedPoints& points, RecordNotes& notes) {
  if (points.size() < 3) return;
  std::vector<GpsTime> times;
  std::vector<double> steps_s;
  for (const auto& point : points) {
    if (!times.empty()) steps_s.push_back(point.time - times.back());
    times.push_back(point.time);
  }
  constexpr double kApart_s = 600, kApartSteps = 100;
  constexpr std::size_t kMany = 10;
  std::vector<bool> alone(points.size());
  geodesy::mark_apart(times, {std::max(kApart_s, kApartSteps * *median(steps_s)), kMany, 1}, alone);
  leave_out(points, alone, "point more than 10 minutes from all others", notes);
}

/// Ends of stretches that no jump interrupts: of each the index behind its last point.
std::vector<std::size_t> stretch_ends(const RecordedPoints& points) {
  std::vector<std::size_t> ends;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double limit_m = kJump_mps * (points[i].time - points[i - 1].time);
    if (distance_m(points[i].place, points[i - 1].place) > limit_m) ends.push_back(i);
  }
  ends.push_back(points.size());
  return ends;
}

void leave_out_jumps(RecordedPoints& points, RecordNotes& notes) {
  const std::vector<std::size_t> ends = stretch_ends(points);
  if (ends.size() == 1) return;
  std::vector<bool> marked(points.size());
  const auto size = [&](std::size_t k) { return ends[k] - (k == 0 ? 0 : ends[k - 1]); };
  constexpr std::size_t kMuchLonger = 4;
  for (std::size_t k = 0; k < ends.size(); ++k) {
    const std::size_t from = ends[k] - size(k);
    bool stray = false;
    if (k == 0 || k + 1 == ends.size()) {
      stray = size(k == 0 ? 1 : k - 1) >= kMuchLonger * size(k);
    } else if (size(k) <= std::max(size(k - 1), size(k + 1))) {
      const RecordedPoint& before = points[from - 1];
      const RecordedPoint& after = points[ends[k]];
      stray = distance_m(before.place, after.place) <= kJump_mps * (after.time - before.time) / 2;
    }
    std::fill(marked.begin() + static_cast<std::ptrdiff_t>(from),
              marked.begin() + static_cast<std::ptrdiff_t>(ends[k]), stray);
  }
  // Two vehicles in one file jump all the time: neither is the stray.
  if (4 * static_cast<std::size_t>(std::count(marked.begin(), marked.end(), true)) > points.size()) {
    notes.say(0, fmt::format("{} times the path jumps at more than 1000 m/s", ends.size() - 1),
              "is it of several vehicles?");
    return;
  }
  leave_out(points, marked, "point reached or left at more than 1000 m/s, unlike those around it", notes);
}

/// [m/s], between neighbours; times rise.
std::vector<double> step_speeds(const RecordedPoints& points) {
  std::vector<double> speeds;
  for (std::size_t i = 1; i < points.size(); ++i) {
    speeds.push_back(distance_m(points[i].place, points[i - 1].place) /
                     (points[i].time - points[i - 1].time));
  }
  return speeds;
}

/// Satellites in low orbits fly at 7.8 km/s.
void require_possible(const RecordedPoints& points, const RecordNotes& notes) {
  constexpr double kFastest_mps = 15e3;
  const std::vector<double> speeds = step_speeds(points);
  if (speeds.size() < 2 || *median(speeds) < kFastest_mps) return;
  throw InputError(
      notes.path(), points[1].line,
      fmt::format("most steps of the path are faster than anything moves: half of them by {:.3g} "
                  "km/s and more",
                  *median(speeds) / 1e3),
      "latitudes and longitudes are degrees, times seconds (not days or ms); local metres are "
      "waypoints east_m, north_m, up_m; of several receivers keep one");
}

/// A path in relative times that creeps: they may be milliseconds.
void note_slowness(const RecordedPoints& points, RecordNotes& notes) {
  constexpr double kSlow_mps = 0.1, kLong_m = 20;
  const std::vector<double> speeds = step_speeds(points);
  if (speeds.size() < 2) return;
  const double fastest = *std::max_element(speeds.begin(), speeds.end());
  if (fastest >= kSlow_mps || distance_m(points.front().place, points.back().place) < kLong_m) return;
  notes.say(0, fmt::format("the path never moves faster than {:.2g} m/s, in {:.0f} s: are its times in "
                           "milliseconds? name the column time_ms",
                           fastest, points.back().time - points.front().time));
}

/// The greatest step that no vehicle of this path makes: a wrong place for long, heights of a first fix.
void note_leaps(const RecordedPoints& points, RecordNotes& notes) {
  constexpr double kLeap_mps = 100, kUnlike = 10;
  const std::vector<double> speeds = step_speeds(points);
  if (speeds.empty()) return;
  const auto fastest = std::max_element(speeds.begin(), speeds.end());
  const auto i = static_cast<std::size_t>(fastest - speeds.begin()) + 1;
  if (*fastest <= kLeap_mps || *fastest <= kUnlike * *median(speeds)) return;
  notes.say(points[i].line, fmt::format("the path leaps {:.0f} m in {:g} s to here: is a part of it wrong?",
                                        distance_m(points[i].place, points[i - 1].place),
                                        points[i].time - points[i - 1].time));
}

/// Dates before GPS was complete are a receiver's or program's default; those of the first cycle of its week,
/// 1999 to 2007, may be of the second or third.
void note_date(GpsTime first, RecordNotes& notes) {
  const GpsTime complete = geodesy::gps_from_calendar({1995, 1, 1, 0, 0, 0, 0}),
                cycle = GpsTime::from_week(1024, 0), today = GpsTime::from_week(1421, 0);
  const std::string date = geodesy::format_gpst(first, 0).substr(0, 10);
  if (first < complete) {
    notes.say(0,
              fmt::format("the path is of {}, before GPS was complete: what wrote it may not have known the "
                          "date",
                          date));
  } else if (first >= cycle && first < today) {
    notes.say(0,
              fmt::format("the path is of {}; a receiver whose GPS week has rolled over means {}", date,
                          geodesy::format_gpst(first + std::chrono::hours(1024 * 7 * 24), 0).substr(0, 10)));
  }
}

void note_pauses(const Trajectory& trajectory, RecordNotes& notes) {
  const auto pauses = trajectory.pauses();
  if (pauses.empty()) return;
  const auto longest = *std::max_element(pauses.begin(), pauses.end(), [](const auto& a, const auto& b) {
    return a.second - a.first < b.second - b.first;
  });
  notes.say(
      0, fmt::format("the recording pauses {} {}, at most {:.0f} s from {}: such a gap is driven straight; "
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

bool is_missing_height(std::string_view text) {
  if (is_missing(text)) return true;
  const std::optional<double> value = parse_double(text);
  return value && (*value == -999 || *value == 9999 || *value == 99'999 || *value == 999'999);
}

void keep_rising(RecordedPoints& points, RecordNotes& notes) {
  const auto falls = [](const auto& a, const auto& b) { return b.time <= a.time; };
  if (points.empty()) return;
  leave_out_far_dates(points, notes);
  if (std::adjacent_find(points.begin(), points.end(), falls) == points.end()) return;
  std::vector<GpsTime> times;
  for (const auto& point : points) times.push_back(point.time);
  const std::size_t count = points.size();
  RecordedPoints outside;
  take_out(points, outside_longest_rise(times),
           [&](const RecordedPoint& point) { outside.push_back(point); });
  std::optional<int> backwards;  // line of the first
  std::size_t backwards_count = 0;
  for (const RecordedPoint& point : outside) {
    const auto same = std::lower_bound(points.begin(), points.end(), point.time,
                                       [](const auto& kept, GpsTime time) { return kept.time < time; });
    if (same == points.end() || same->time != point.time) {
      backwards = backwards.value_or(point.line);
      ++backwards_count;
      notes.skip(point.line, "point whose time does not follow the one before");
    } else if (distance_m(same->place, point.place) <= kOneVehicle_m) {
      notes.skip(point.line, "point that repeats the time of another");
    } else {
      notes.skip(point.line, "point that repeats the time of another more than 100 m away",
                 "left out: keep one receiver, if these are several");
    }
  }
  if (points.size() == 1 && outside.size() >= 2 && backwards_count == 0) {
    throw InputError(notes.path(), points.front().line, fmt::format("all {} points have one time", count),
                     "export the times with their seconds");
  }
  if (2 * backwards_count <= count) return;
  throw InputError(
      notes.path(), *backwards,
      fmt::format("the times of {} of {} points do not follow the others", backwards_count, count),
      "sort the points by time");
}

std::vector<bool> zero_places(const std::vector<Geodetic>& places) {
  std::vector<bool> marked(places.size());
  const bool elsewhere = std::any_of(places.begin(), places.end(), [](const Geodetic& place) {
    return distance_m(place, Geodetic{0, 0, place.height_m}) > kNearZero_m;
  });
  if (elsewhere) std::transform(places.begin(), places.end(), marked.begin(), is_zero);
  return marked;
}

void leave_out_strays(RecordedPoints& points, RecordNotes& notes) {
  std::vector<Geodetic> places;
  for (const auto& point : points) places.push_back(point.place);
  leave_out(points, zero_places(places), kZeroPlace, notes);
  leave_out_jumps(points, notes);
  leave_out_spikes(points, notes);
}

TrajectoryFile recorded_trajectory(RecordedPoints points, bool has_own_dates, RecordNotes notes) {
  keep_rising(points, notes);
  leave_out_lone_times(points, notes);
  require_possible(points, notes);
  leave_out_strays(points, notes);
  note_leaps(points, notes);
  if (!has_own_dates) note_slowness(points, notes);
  if (has_own_dates) note_date(points.front().time, notes);
  const auto highest = std::max_element(points.begin(), points.end(), [](const auto& a, const auto& b) {
    return a.place.height_m < b.place.height_m;
  });
  if (highest->place.height_m > kHigh_m) {
    notes.say(0, fmt::format("the path is up to {:.0f} km high: heights are metres above the ellipsoid; ECEF "
                             "coordinates belong in columns x, y, z of format csv",
                             highest->place.height_m / 1e3));
  }
  std::vector<std::pair<GpsTime, Geodetic>> samples;
  samples.reserve(points.size());
  for (const RecordedPoint& point : points) samples.emplace_back(point.time, point.place);
  Trajectory trajectory(std::move(samples));
  note_pauses(trajectory, notes);
  return {std::move(trajectory), has_own_dates, notes.lines()};
}

}  // namespace canyon::simulation
