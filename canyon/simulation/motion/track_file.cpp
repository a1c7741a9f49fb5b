#include "canyon/simulation/motion/track_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/simulation/motion/xml_tags.hpp"
#include "canyon/sky/rinex/android_log.hpp"

namespace canyon::simulation {

namespace {

using geodesy::Geodetic;
using geodesy::GpsTime;

struct TrackPoint {
  int line = 0;
  Geodetic position;               ///< its height is not set
  std::optional<double> height_m;  ///< height_m from the file
  std::optional<double> geoid_m;   ///< of the geoid above the ellipsoid there
  std::optional<GpsTime> time;
  std::size_t segment = 0;       ///< index of the file's segment
  bool bad = false;              ///< it has an invalid value, or none
  std::string_view height_mode;  ///< KML's altitudeMode
};

/// "11.0,48.0,500 ..." from "11.0, 48.0, 500 ...", which some programs write.
std::string without_blanks_after_commas(std::string_view text) {
  std::string result;
  for (const char c : text) {
    const bool blank = c == ' ' || c == '\t';
    if (!blank || result.empty() || result.back() != ',') result += c;
  }
  return result;
}

class TrackReader {
 public:
  TrackReader(const TextFile& file, const std::string& format) : file_(file), report_(file.path()) {
    const bool gpx = format == "gpx";
    if (gpx) {
      read_gpx("trkpt");
      if (points_.empty()) read_gpx("rtept");
    } else {
      read_kml_tracks();
      read_kml_points();
      if (points_.empty()) read_kml_line();
    }
    if (points_.empty()) {
      throw InputError(
          file_.path(), 0,
          gpx ? "no track point and no route point" : "no gx:Track, no Points with times and no LineString",
          fmt::format("is it a {} file with a path?", gpx ? "GPX" : "KML"));
    }
    if (ends_early(file_.text(), format)) {
      report_.loss(static_cast<int>(std::count(file_.text().begin(), file_.text().end(), '\n')) + 1,
                   fmt::format("the file ends without </{}>", format),
                   "read up to there; the file is cut short: copy it again");
      // A truncated number may read as another one.
      if (!gpx) points_.pop_back();
    }
    std::erase_if(points_, [](const TrackPoint& p) { return p.bad; });
    report_.require_majority(points_.size());
    if (points_.empty()) throw InputError(file_.path(), 0, "none of its points has a fix");
  }

  RecordedPath path(const HeightReading& heights) {
    RecordedPath path;
    path.timed = keep_timed();
    set_heights(heights);
    for (const TrackPoint& point : points_)
      path.points.push_back({point.time.value_or(GpsTime{}), point.position, point.line});
    path.report = std::move(report_);
    return path;
  }

 private:
  RecordAt at(const XmlTags& tags) { return {report_, tags.line()}; }

  /// Calls `read` for a value of a point; the point is bad if it throws InputError.
  template <typename Read>
  void guard(TrackPoint& point, const Read& read) {
    guard_record(report_, [&] {
      if (std::exchange(point.bad, true)) return;
      read();
      point.bad = false;
    });
  }
  [[nodiscard]] NoValue no_fix(const XmlTags& tags) const {
    return {file_.path(), tags.line(), "point without a fix"};
  }
  void read_time(const XmlTags& tags, TrackPoint& point) {
    if (!tags.content.empty()) point.time = time_of_text(at(tags), tags.content);
  }

  void read_gpx(std::string_view name) {
    bool inside = false, extension = false;
    for (XmlTags tags(file_); tags.next();) {
      // Extensions that a program adds to a point may use GPX's own names.
      if (tags.name == "extensions") extension = !trim(tags.attributes).ends_with('/');
      if (tags.name == "/extensions" || tags.name == name) extension = false;
      if (tags.name == "trkseg" || tags.name == "rte") ++segments_;
      if (tags.name == name) {
        TrackPoint& added = points_.emplace_back();
        added.line = tags.line();
        added.segment = segments_;
        guard(added, [&] {
          added.position = position_of(at(tags), to_number(at(tags), tags.attribute("lat"), "latitude"),
                                       to_number(at(tags), tags.attribute("lon"), "longitude"));
        });
        inside = !trim(tags.attributes).ends_with('/');
      } else if (tags.name.starts_with('/') && tags.name.substr(1) == name) {
        inside = false;
      } else if (inside && !extension) {
        guard(points_.back(), [&] { read_gpx_value(tags, points_.back()); });
      }
    }
    // The file ends within it.
    if (inside) points_.pop_back();
  }
  void read_gpx_value(const XmlTags& tags, TrackPoint& point) {
    if (tags.name == "ele" && !is_missing(tags.content)) {
      point.height_m = to_number(at(tags), tags.content, "ele");
    } else if (tags.name == "geoidheight" && !is_missing(tags.content)) {
      point.geoid_m = to_number(at(tags), tags.content, "geoidheight");
    } else if (tags.name == "fix") {
      if (lower_case(tags.content) == "none") throw no_fix(tags);
    } else if (tags.name == "time") {
      read_time(tags, point);
    }
  }

  /// "longitude,latitude,height", or separated by blanks; the height may be absent.
  void read_kml_point(const XmlTags& tags, std::string_view text, char separator, TrackPoint& point) {
    const std::vector<std::string_view> fields = separator == ',' ? split(text, ',') : split_blanks(text);
    if (fields.size() < 2 || fields.size() > 3)
      throw tags.error(fmt::format("'{}' is not a position", text), "write longitude,latitude,height");
    point.position = position_of(at(tags), to_number(at(tags), fields[1], "latitude"),
                                 to_number(at(tags), fields[0], "longitude"));
    if (fields.size() > 2 && !is_missing(fields[2]))
      point.height_m = to_number(at(tags), fields[2], "height");
  }
  void read_kml_tracks() {
    std::size_t times = 0, positions = 0, begin = 0;
    std::string_view mode;
    const auto end = [&](const XmlTags& tags) {
      if (times != positions) {
        // The times cannot be assigned to the positions.
        report_.loss(tags.error(fmt::format("gx:Track has {} times for {} positions", times, positions)),
                     points_.size() - begin);
        for (std::size_t i = begin; i < points_.size(); ++i) points_[i].bad = true;
      }
      for (std::size_t i = begin; i < points_.size(); ++i) points_[i].height_mode = mode;
      times = positions = 0;
      begin = points_.size();
      mode = {};
      ++segments_;
    };
    const auto point = [&](const XmlTags& tags, std::size_t number) -> TrackPoint& {
      if (begin + number > points_.size()) {
        points_.emplace_back().line = tags.line();
        points_.back().segment = segments_;
      }
      return points_[begin + number - 1];
    };
    bool inside = false;
    XmlTags tags(file_);
    while (tags.next()) {
      if (tags.name == "Track") inside = true;
      if (tags.name == "/Track") {
        inside = false;
        end(tags);
      }
      if (!inside) continue;
      if (tags.name == "altitudeMode") mode = tags.content;
      if (tags.name == "when") {
        TrackPoint& of = point(tags, ++times);
        guard(of, [&] { read_time(tags, of); });
      } else if (tags.name == "coord") {
        TrackPoint& of = point(tags, ++positions);
        guard(of, [&] {
          if (tags.content.empty()) throw no_fix(tags);
          read_kml_point(tags, tags.content, ' ', of);
        });
      }
    }
    end(tags);
  }
  /// The points of an element `coordinates`.
  std::vector<TrackPoint> kml_points(const XmlTags& tags, std::string_view mode) {
    std::vector<TrackPoint> points;
    const std::string positions = without_blanks_after_commas(tags.content);
    for (const std::string_view tuple : split_blanks(positions)) {
      TrackPoint& point = points.emplace_back();
      point.line = tags.line();
      point.height_mode = mode;
      guard(point, [&] { read_kml_point(tags, tuple, ',', point); });
    }
    return points;
  }
  /// Placemarks with a time and a Point, as trackers write each fix, in any order. Points next to a gx:Track,
  /// and a single one next to a LineString, are not the path.
  void read_kml_points() {
    std::vector<TrackPoint> timed, untimed, placemark_points;
    TrackPoint stamp;
    std::string_view mode;
    bool view = false, track = false, point = false, is_span = false;
    int lines = 0, first_time = 0;
    for (XmlTags tags(file_); tags.next();) {
      const bool ends = tags.name.starts_with('/');
      const std::string_view name = tags.name.substr(ends ? 1 : 0);
      if (name == "Placemark") {
        if (ends && stamp.time && is_span && !placemark_points.empty())
          report_.guess(tags.line(), "TimeSpan of a Point", "its begin is used");
        if (ends && placemark_points.empty() && stamp.time && first_time == 0) first_time = tags.line();
        for (TrackPoint& each : placemark_points) {
          each.time = stamp.time;
          each.bad = each.bad || stamp.bad;
          each.segment = ++segments_;
          (stamp.time || stamp.bad ? timed : untimed).push_back(each);
        }
        placemark_points.clear();
        stamp = {};
        mode = {};
      } else if (name == "LookAt" || name == "Camera") {
        view = !ends;
      } else if (name == "Track") {
        track = !ends;
      } else if (name == "Point") {
        point = !ends;
      } else if (name == "LineString") {
        lines += ends ? 1 : 0;
      } else if (!view && !track && !stamp.time && (name == "when" || name == "begin" || name == "end")) {
        is_span = name != "when";
        if (!ends) guard(stamp, [&] { read_time(tags, stamp); });
      } else if (point && name == "altitudeMode") {
        mode = tags.content;
      } else if (point && tags.name == "coordinates") {
        const std::vector<TrackPoint> more = kml_points(tags, mode);
        placemark_points.insert(placemark_points.end(), more.begin(), more.end());
      }
    }
    const auto drop = [this](const std::vector<TrackPoint>& points, std::string_view what,
                             std::string_view path) {
      for (const TrackPoint& each : points)
        report_.drop(each.line, what, fmt::format("not read: {} is the path", path));
    };
    if (!points_.empty()) return drop(timed, "Point with a time", "gx:Track");
    if (lines > 0 && timed.size() < 2) {
      drop(timed, "Point with a time", "the LineString");
      if (first_time > 0) report_.drop(first_time, "time of a LineString", "not read: it has no point");
      return;
    }
    if (timed.empty()) return;
    drop(untimed, "Point without a time", "that of the Points with times");
    if (lines > 0) report_.remark(0, "LineStrings", "not read: the Points with times are the path");
    points_ = std::move(timed);
  }
  void read_kml_line() {
    bool line = false;
    std::string_view mode;
    for (XmlTags tags(file_); tags.next();) {
      if (tags.name == "LineString" || tags.name == "/LineString") {
        line = tags.name == "LineString";
        mode = {};
      }
      if (line && tags.name == "altitudeMode") mode = tags.content;
      if (!line || tags.name != "coordinates") continue;
      const std::vector<TrackPoint> more = kml_points(tags, mode);
      if (more.empty()) continue;
      // Trails are split into pieces, each of which begins at the end of the previous one.
      const auto same = [](const TrackPoint& a, const TrackPoint& b) {
        return !a.bad && !b.bad && a.position.latitude_rad == b.position.latitude_rad &&
               a.position.longitude_rad == b.position.longitude_rad;
      };
      const std::size_t known = points_.empty() ? 0 : 1;
      if (known > 0 && !same(points_.back(), more.front()))
        report_.drop(tags.line(), "another LineString", "not read: the first one is the path");
      else
        points_.insert(points_.end(), more.begin() + static_cast<std::ptrdiff_t>(known), more.end());
    }
  }

  /// Keeps only the points with a time, segments sorted by their middle time; all points if none has one.
  /// Returns whether there are times.
  bool keep_timed() {
    const std::size_t count = points_.size();
    const auto timed = static_cast<std::size_t>(std::count_if(
        points_.begin(), points_.end(), [](const TrackPoint& p) { return p.time.has_value(); }));
    if (timed == 0) return false;
    if (2 * timed <= count) {
      throw InputError(file_.path(), 0, fmt::format("{} of {} points have no time", count - timed, count),
                       "give all points a time, or none");
    }
    std::erase_if(points_, [&](const TrackPoint& point) {
      if (!point.time) report_.loss(point.line, "point without a time");
      return !point.time;
    });
    std::map<std::size_t, std::vector<GpsTime>> times;
    for (const TrackPoint& point : points_) times[point.segment].push_back(*point.time);
    for (auto& [segment, all] : times) std::sort(all.begin(), all.end());
    const auto middle = [&](const TrackPoint& point) {
      const std::vector<GpsTime>& all = times.at(point.segment);
      return all[all.size() / 2];
    };
    std::stable_sort(points_.begin(), points_.end(),
                     [&](const TrackPoint& a, const TrackPoint& b) { return middle(a) < middle(b); });
    return true;
  }

  /// The height above the ellipsoid of a point that has a height.
  double height_of(const TrackPoint& point, const HeightReading& heights) {
    const RecordAt at{report_, point.line};
    if (point.geoid_m) return *point.height_m + *point.geoid_m;
    if (point.height_mode.empty() || point.height_mode == "absolute")
      return from_sea_level(at, *point.height_m, "height above sea level by the format", heights);
    if (heights.needed) {
      at.report.guess(at.line, fmt::format("height by the altitudeMode {}", point.height_mode),
                      "taken as ellipsoidal; not needed with height_above_terrain_m");
    }
    return *point.height_m;
  }
  void set_heights(const HeightReading& heights) {
    const auto known = std::find_if(points_.begin(), points_.end(),
                                    [](const TrackPoint& p) { return p.height_m.has_value(); });
    std::optional<double> last_m;
    for (TrackPoint& point : points_) {
      if (point.height_m) last_m = height_of(point, heights);
      if (!point.height_m && heights.needed) {
        report_.guess(point.line, "point without a height",
                      last_m ? "that of the previous point is used" : "that of the next point is used, or 0");
      }
      if (!last_m) last_m = known == points_.end() ? 0 : height_of(*known, heights);
      point.position.height_m = *last_m;
    }
  }

  const TextFile& file_;
  ReadReport report_;
  std::vector<TrackPoint> points_;
  std::size_t segments_ = 0;
};

}  // namespace

RecordedPath read_track_file(const std::filesystem::path& path, const std::string& format,
                             const HeightReading& heights) {
  const TextFile file(path);
  return TrackReader(file, format).path(heights);
}

namespace {

enum FixColumn : std::size_t { FixProvider, FixLatitude, FixLongitude, FixAltitude, FixTime };
constexpr std::string_view kFixColumns =
    "Provider LatitudeDegrees|Latitude LongitudeDegrees|Longitude AltitudeMeters|Altitude "
    "UnixTimeMillis|(UTC)TimeInMs|utcTimeMillis";

/// Best first, with their names in versions of the app.
constexpr std::array<std::pair<std::string_view, std::string_view>, 3> kProviders{
    {{"GPS", " gps "}, {"fused", " flp fused "}, {"network", " nlp network "}}};

std::optional<std::size_t> provider_of(std::string_view text) {
  for (std::size_t i = 0; i < kProviders.size(); ++i)
    if (!text.empty() && kProviders[i].second.find(" " + lower_case(text) + " ") != std::string_view::npos)
      return i;
  return std::nullopt;
}

/// @param height_m used if it has none
RecordedPoint point_of(const RecordAt& at, const rinex::AndroidLog& log, std::optional<double> height_m) {
  const auto number = [&](FixColumn column) {
    if (log.text(column).empty())
      throw NoValue(at.report.path(), at.line, "a fix without a time, latitude, longitude or altitude");
    return to_number(at, log.text(column), log.name(column));
  };
  RecordedPoint point{{}, position_of(at, number(FixLatitude), number(FixLongitude)), at.line};
  if (!height_m || !is_missing(log.text(FixAltitude))) height_m = number(FixAltitude);
  point.position.height_m = *height_m;
  if (!(std::abs(*height_m) < 1e6))
    throw at.error(fmt::format("the altitude {} m is out of range", *height_m));
  const double unix_ms = number(FixTime);
  constexpr double kLatest_ms = 9e12;  // the year 2255
  if (!(std::abs(unix_ms) < kLatest_ms)) throw at.error(fmt::format("'{}' is no Unix time in ms", unix_ms));
  point.time = set_time(at, geodesy::gps_from_unix(std::llround(unix_ms) * 1'000'000));
  return point;
}

}  // namespace

RecordedPath read_android_fixes(const std::filesystem::path& path, const HeightReading& heights) {
  std::array<RecordedPoints, kProviders.size()> points;
  RecordedPath result;
  ReadReport& report = result.report = ReadReport(path);
  rinex::AndroidLog log(TextFile::streamed(path), "Fix", kFixColumns);
  while (log.next()) {
    const auto provider = provider_of(log.text(FixProvider));
    if (!provider) {
      report.drop(log.file().line(), "fix of an unknown provider");
      continue;
    }
    RecordedPoints& of = points[*provider];
    std::optional<double> instead_m;
    if (!heights.needed) instead_m = of.empty() ? 0 : of.back().position.height_m;
    guard_record(report, [&] { of.push_back(point_of({report, log.file().line()}, log, instead_m)); });
  }
  report.require_majority(points[0].size() + points[1].size() + points[2].size());
  const auto* const best =
      std::find_if(points.begin(), points.end(), [](const RecordedPoints& of) { return !of.empty(); });
  if (best == points.end()) {
    throw InputError(
        path, 0, fmt::format("has no usable line of 'Fix' (it has {})", rinex::android_log_kinds_text(path)),
        "enable fixes (locations) in the app");
  }
  if (best != points.begin()) {
    report.guess(0, "it has no fix of GPS",
                 fmt::format("those of {} are used", kProviders[best - points.begin()].first));
  }
  if (const auto& cut = log.file().cut_warning()) report.loss(*cut, 1, cut->hint());
  result.points = *best;
  return result;
}

}  // namespace canyon::simulation
