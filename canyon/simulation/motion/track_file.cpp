#include "canyon/simulation/motion/track_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/take_out.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/geodesy/time_text.hpp"
#include "canyon/simulation/motion/recorded_path.hpp"
#include "canyon/simulation/motion/xml_tags.hpp"

namespace canyon::simulation {
namespace {

using geodesy::Geodetic;
using geodesy::GpsTime;

double number(const XmlTags& tags, std::string_view text, std::string_view what) {
  const auto value = parse_double(text);
  if (!value) throw tags.error(fmt::format("the {} '{}' is not a number", what, text));
  return *value;
}

Geodetic place(const XmlTags& tags, std::string_view latitude, std::string_view longitude) {
  const double latitude_deg = number(tags, latitude, "latitude");
  const double longitude_deg = number(tags, longitude, "longitude");
  if (!(std::abs(latitude_deg) <= 90) || !(std::abs(longitude_deg) <= 180)) {
    throw tags.error(fmt::format("latitude {}, longitude {} is not a place", latitude_deg, longitude_deg),
                     "they are degrees");
  }
  return Geodetic::from_degrees(latitude_deg, longitude_deg, 0);
}

GpsTime instant(const XmlTags& tags, RecordNotes& notes) {
  if (!geodesy::names_time_scale(tags.content))
    notes.skip(tags.line(), "time without a zone", "taken as UTC");
  try {
    return geodesy::parse_time(tags.content);
  } catch (const InputError& e) {
    throw tags.error(e.problem(), e.cure());
  }
}

/// The altitude mode and offset of a KML geometry.
struct KmlAltitude {
  std::string_view mode;
  double offset_m = 0;  ///< to be added

  void read(const XmlTags& tags) {
    if (tags.name == "altitudeMode" && !tags.content.empty()) mode = tags.content;
    if (tags.name == "altitudeOffset") offset_m = number(tags, tags.content, "altitudeOffset");
  }
};

/// A point as a file has it.
struct TrackPoint {
  int line = 0;
  Geodetic place;                  ///< its height is not set
  std::optional<double> height_m;  ///< of the file
  std::optional<double> geoid_m;   ///< the geoid above the ellipsoid there
  std::optional<GpsTime> time;
  std::size_t segment = 0;  ///< which of the file's segments it belongs to
  bool no_fix = false;
  bool flat = false;  ///< a fix of two dimensions
  bool bad = false;   ///< it has a value that cannot be
  KmlAltitude kml;
};

struct TrackPoints {
  std::vector<TrackPoint> points;
  RecordNotes notes;
  std::size_t segments = 0;

  TrackPoint& add(const XmlTags& tags) {
    TrackPoint& added = points.emplace_back();
    added.line = tags.line();
    added.segment = segments;
    return added;
  }
  /// Calls `read` for a value of a point; the point is bad where it throws InputError.
  template <typename Read>
  void guard(TrackPoint& point, const Read& read) {
    const std::size_t before = notes.bad_count();
    if (!point.bad) notes.guard(read);
    point.bad = point.bad || notes.bad_count() > before;
  }
};

/// A dilution of precision that stands for none, such as 99.99.
constexpr double kNoDilution = 50;

void read_gpx_value(const XmlTags& tags, TrackPoint& point, RecordNotes& notes) {
  if (tags.name == "ele" && !is_missing_height(tags.content)) {
    point.height_m = number(tags, tags.content, "ele");
  } else if (tags.name == "geoidheight" && !is_missing(tags.content)) {
    point.geoid_m = number(tags, tags.content, "geoidheight");
  } else if (tags.name == "fix") {
    const std::string kind = lower_case(tags.content);
    point.no_fix = point.no_fix || kind == "none";
    point.flat = kind == "2d";
  } else if (tags.name == "src" && lower_case(tags.content) == "network") {
    // Android's GPSLogger and others: a place by radio cells and WLAN.
    point.no_fix = true;
  } else if (tags.name == "hdop" && parse_double(tags.content).value_or(0) >= kNoDilution) {
    notes.skip(tags.line(), "point with a dilution of precision of 50 or more", "it is taken");
  } else if (tags.name == "sat" && tags.content == "0") {
    notes.skip(tags.line(), "point of a fix with 0 satellites", "it is taken");
  } else if (tags.name == "time" && !tags.content.empty()) {
    point.time = instant(tags, notes);
  }
  // A fix of two dimensions measures no height.
  if (point.flat && point.height_m == 0) point.height_m.reset();
}

void read_gpx(XmlTags& tags, std::string_view point, TrackPoints& track) {
  bool inside = false, extension = false;
  while (tags.next()) {
    // Extensions that a program adds to a point may have names of GPX's own.
    if (tags.name == "extensions") extension = !trim(tags.attributes).ends_with('/');
    if (tags.name == "/extensions" || tags.name == point) extension = false;
    if (tags.name == "trkseg" || tags.name == "rte") ++track.segments;
    // Garmin's routes have the way between two points in an extension of the first.
    if (tags.name == "rpt" && inside && point == "rtept") {
      TrackPoint& added = track.add(tags);
      track.guard(added, [&] { added.place = place(tags, tags.attribute("lat"), tags.attribute("lon")); });
      continue;
    }
    const bool end =
        tags.name.size() == point.size() + 1 && tags.name.front() == '/' && tags.name.substr(1) == point;
    if (tags.name == point) {
      TrackPoint& added = track.add(tags);
      track.guard(added, [&] { added.place = place(tags, tags.attribute("lat"), tags.attribute("lon")); });
      inside = trim(tags.attributes).empty() || trim(tags.attributes).back() != '/';
    } else if (end) {
      if (!inside) track.notes.bad(tags.error(fmt::format("a {} ends that did not begin", point)));
      inside = false;
    } else if (inside && !extension) {
      TrackPoint& last = track.points.back();
      track.guard(last, [&] { read_gpx_value(tags, last, track.notes); });
    }
  }
  // The file ends within it.
  if (inside) track.points.pop_back();
}

/// A route is what somebody planned.
void note_routes(XmlTags tags, RecordNotes& notes) {
  while (tags.next())
    if (tags.name == "rtept") notes.skip(tags.line(), "point of a route", "not read: the track is the path");
}

/// "longitude,latitude,height" or with blanks between; a height may be absent.
void read_kml_place(const XmlTags& tags, std::string_view text, char separator, TrackPoint& point) {
  const std::vector<std::string_view> fields = separator == ',' ? split(text, ',') : split_blanks(text);
  if (fields.size() < 2 || fields.size() > 3) {
    throw tags.error(fmt::format("'{}' is not a place", text), "write longitude,latitude,height");
  }
  point.place = place(tags, fields[1], fields[0]);
  if (fields.size() > 2 && !is_missing_height(fields[2])) point.height_m = number(tags, fields[2], "height");
}

/// The times and places of one gx:Track.
class KmlTrack {
 public:
  explicit KmlTrack(TrackPoints& track) : track_(track) {}

  void read(const XmlTags& tags) {
    track_.notes.guard([&] { altitude_.read(tags); });
    if (tags.name == "when") {
      ++times_;
      TrackPoint& point = at(tags, times_);
      track_.guard(point, [&] {
        if (!tags.content.empty()) point.time = instant(tags, track_.notes);
      });
    } else if (tags.name == "coord") {
      ++places_;
      TrackPoint& point = at(tags, places_);
      // Without a place it is as without a fix.
      point.no_fix = tags.content.empty();
      track_.guard(point, [&] {
        if (!tags.content.empty()) read_kml_place(tags, tags.content, ' ', point);
      });
    }
  }
  /// Takes the points over. Which time belongs to which place is not known where the numbers differ.
  void end(const XmlTags& tags) {
    if (times_ != places_) {
      track_.notes.bad(tags.error(fmt::format("gx:Track has {} times for {} places", times_, places_)),
                       points_.size());
      for (TrackPoint& point : points_) point.bad = true;
    }
    for (TrackPoint& point : points_) {
      point.segment = track_.segments;
      point.kml = altitude_;
      track_.points.push_back(point);
    }
    ++track_.segments;
    points_.clear();
    times_ = places_ = 0;
    altitude_ = {};
  }

 private:
  TrackPoint& at(const XmlTags& tags, std::size_t number) {
    if (number > points_.size()) points_.emplace_back().line = tags.line();
    return points_[number - 1];
  }

  TrackPoints& track_;
  std::vector<TrackPoint> points_;
  std::size_t times_ = 0, places_ = 0;
  KmlAltitude altitude_;
};

void read_kml_tracks(XmlTags& tags, TrackPoints& track) {
  KmlTrack one(track);
  bool inside = false;
  while (tags.next()) {
    // Points of placemarks have a "when", too.
    if (tags.name == "Placemark") inside = false;
    if (tags.name == "Track") {
      one.end(tags);
      inside = true;
    }
    if (inside) one.read(tags);
  }
  one.end(tags);
}

/// Placemarks of points with times.
void read_kml_points(XmlTags& tags, TrackPoints& track) {
  std::optional<GpsTime> time;
  KmlAltitude altitude;
  std::string_view inside;
  while (tags.next()) {
    if (tags.name == "Placemark") time.reset();
    if (tags.name == "Point" || tags.name == "TimeStamp" || tags.name == "TimeSpan") inside = tags.name;
    if (tags.name == "Point") altitude = {};
    track.notes.guard([&] {
      altitude.read(tags);
      if ((tags.name == "when" && inside == "TimeStamp") || (tags.name == "begin" && inside == "TimeSpan"))
        time = instant(tags, track.notes);
    });
    if (tags.name != "coordinates" || inside != "Point" || !time) continue;
    TrackPoint& point = track.add(tags);
    point.time = time;
    point.kml = altitude;
    track.guard(point, [&] { read_kml_place(tags, tags.content, ',', point); });
  }
}

/// "11.0,48.0,500 ..." of "11.0, 48.0, 500 ...", which some programs write.
std::string without_blanks_behind_commas(std::string_view text) {
  std::string result;
  for (const char c : text) {
    const bool blank = c == ' ' || c == '\t';
    if (!blank || result.empty() || result.back() != ',') result += c;
  }
  return result;
}

void read_kml_line(XmlTags& tags, TrackPoints& track) {
  bool line = false;
  KmlAltitude altitude;
  while (tags.next()) {
    if (tags.name == "LineString") {
      line = track.points.empty();
      if (!line) track.notes.skip(tags.line(), "another LineString", "not read: the first one is the path");
    }
    if (line) track.notes.guard([&] { altitude.read(tags); });
    if (!line || tags.name != "coordinates") continue;
    const std::string places = without_blanks_behind_commas(tags.content);
    for (const std::string_view tuple : split_blanks(places)) {
      TrackPoint& point = track.add(tags);
      point.kml = altitude;
      track.guard(point, [&] { read_kml_place(tags, tuple, ',', point); });
    }
    line = track.points.empty();
  }
}

template <typename Predicate>
void leave_out(std::vector<TrackPoint>& points, const Predicate& dropped, std::string_view why,
               RecordNotes& notes) {
  std::erase_if(points, [&](const TrackPoint& point) {
    if (!dropped(point)) return false;
    notes.skip(point.line, why);
    return true;
  });
}

/// Leaves the points with a time, segments in order of their first time; all points where none has one.
/// Returns whether there are times.
bool keep_timed(const std::filesystem::path& path, std::vector<TrackPoint>& points, RecordNotes& notes) {
  const std::size_t count = points.size();
  const auto timed = static_cast<std::size_t>(
      std::count_if(points.begin(), points.end(), [](const TrackPoint& p) { return p.time.has_value(); }));
  if (timed == 0) return false;
  if (2 * timed <= count) {
    throw InputError(path, 0, fmt::format("{} of {} points have no time", count - timed, count),
                     "give each a time, or none");
  }
  leave_out(
      points, [](const TrackPoint& p) { return !p.time; }, "point without a time", notes);
  std::map<std::size_t, GpsTime> begin;
  for (const TrackPoint& point : points) begin.emplace(point.segment, *point.time);
  std::stable_sort(points.begin(), points.end(), [&](const TrackPoint& a, const TrackPoint& b) {
    return begin.at(a.segment) < begin.at(b.segment);
  });
  return true;
}

/// Segments without times are one path: says how far apart they are.
void note_joints(const std::vector<TrackPoint>& points, RecordNotes& notes) {
  std::size_t joints = 0, longest = 0;
  double longest_m = 0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (points[i].segment == points[i - 1].segment) continue;
    ++joints;
    const double gap_m =
        (geodesy::ecef_from_geodetic(points[i].place) - geodesy::ecef_from_geodetic(points[i - 1].place))
            .norm();
    if (gap_m > longest_m) longest = i;
    longest_m = std::max(longest_m, gap_m);
  }
  if (joints == 0) return;
  notes.say(points[longest].line,
            fmt::format("the path has {} segments without times: they are joined straight, "
                        "over at most {:.0f} m",
                        joints + 1, longest_m));
}

void leave_out_zeros(std::vector<TrackPoint>& points, RecordNotes& notes) {
  std::vector<Geodetic> places;
  places.reserve(points.size());
  for (const TrackPoint& point : points) places.push_back(point.place);
  take_out(points, zero_places(places), [&](const TrackPoint& p) { notes.skip(p.line, kZeroPlace); });
}

/// The surface that a height is above.
enum class Above : std::uint8_t { Sea, Ground, Unsaid };

Above above(const TrackPoint& point) {
  if (point.kml.mode.empty() || point.kml.mode == "absolute") return Above::Sea;
  return point.kml.mode == "relativeToGround" ? Above::Ground : Above::Unsaid;
}

/// Notes how a height that is above something else than the ellipsoid is taken.
void note_height(const TrackPoint& point, const HeightReading& heights, RecordNotes& notes) {
  const double undulation_m = heights.geoid_undulation_m;
  switch (above(point)) {
    case Above::Ground:
      return notes.skip(point.line, "height above the ground by the file",
                        "taken as ellipsoidal; height_above_terrain_m says it for Canyon");
    case Above::Unsaid:
      return notes.skip(point.line, "height on no datum by the file (clampToGround)",
                        "taken as ellipsoidal; height_above_terrain_m does without it");
    case Above::Sea:
      return notes.skip(point.line, "height above sea level by the format",
                        undulation_m != 0
                            ? fmt::format("the city's geoid undulation, {:.1f} m, is added", undulation_m)
                            : "taken as ellipsoidal; city.geoid_undulation_m corrects it, "
                              "height_above_terrain_m does without it");
  }
}

/// The geoid is smooth: where some points have its height, the others take the one before.
void fill_geoid(std::vector<TrackPoint>& points, RecordNotes& notes) {
  const auto known =
      std::find_if(points.begin(), points.end(), [](const TrackPoint& p) { return p.geoid_m.has_value(); });
  if (known == points.end()) return;
  double last_m = *known->geoid_m;
  for (TrackPoint& point : points) {
    if (!point.geoid_m && point.height_m)
      notes.skip(point.line, "point without a geoidheight", "that of the point before is taken");
    last_m = point.geoid_m.value_or(last_m);
    point.geoid_m = last_m;
  }
}

void set_heights(TrackPoints& track, const HeightReading& heights) {
  std::vector<TrackPoint>& points = track.points;
  if (heights.needed) fill_geoid(points, track.notes);
  const auto known =
      std::find_if(points.begin(), points.end(), [](const TrackPoint& p) { return p.height_m.has_value(); });
  const auto above_ellipsoid_m = [&](const TrackPoint& p) {
    return *p.height_m + p.kml.offset_m +
           p.geoid_m.value_or(above(p) == Above::Sea ? heights.geoid_undulation_m : 0);
  };
  double last_m = known == points.end() ? 0 : above_ellipsoid_m(*known);
  for (TrackPoint& point : points) {
    if (point.height_m) last_m = above_ellipsoid_m(point);
    point.place.height_m = last_m;
    if (!heights.needed) continue;
    if (point.height_m) {
      if (!point.geoid_m) note_height(point, heights, track.notes);
    } else {
      track.notes.skip(point.line, "point without a height",
                       known == points.end() ? "0 is taken" : "that of the point before is taken");
    }
  }
}

}  // namespace

bool is_track_format(const std::string& format) {
  return format == "gpx" || format == "kml";
}

TrackFile read_track_file(const std::filesystem::path& path, const std::string& format,
                          const HeightReading& heights) {
  const TextFile file(path);
  TrackPoints track;
  track.notes = RecordNotes(path);
  const auto read = [&](const auto& reader) {
    if (!track.points.empty()) return;
    XmlTags tags(file);
    reader(tags);
  };
  if (format == "gpx") {
    read([&](XmlTags& tags) { read_gpx(tags, "trkpt", track); });
    if (!track.points.empty()) note_routes(XmlTags(file), track.notes);
    read([&](XmlTags& tags) { read_gpx(tags, "rtept", track); });
  } else {
    read([&](XmlTags& tags) { read_kml_tracks(tags, track); });
    read([&](XmlTags& tags) { read_kml_points(tags, track); });
    read([&](XmlTags& tags) { read_kml_line(tags, track); });
  }
  if (ends_early(file.text(), format)) {
    track.notes.say(static_cast<int>(std::count(file.text().begin(), file.text().end(), '\n')) + 1,
                    fmt::format("the file ends without </{}>", format),
                    "read up to there; it is cut short: copy it again");
    // Half a number may read as another one.
    if (format == "kml" && !track.points.empty()) track.points.pop_back();
  }
  if (track.points.empty()) {
    throw InputError(path, 0,
                     format == "gpx" ? "no track point and no route point"
                                     : "no gx:Track, no points with times and no LineString",
                     fmt::format("is it a {} file with a path?", format == "gpx" ? "GPX" : "KML"));
  }
  std::erase_if(track.points, [](const TrackPoint& p) { return p.bad; });
  track.notes.require_most(track.points.size());
  leave_out(
      track.points, [](const TrackPoint& p) { return p.no_fix; }, "point without a fix", track.notes);
  if (track.points.empty()) throw InputError(path, 0, "none of its points has a fix");
  const bool timed = keep_timed(path, track.points, track.notes);
  if (!timed) {
    leave_out_zeros(track.points, track.notes);
    note_joints(track.points, track.notes);
  }
  set_heights(track, heights);
  TrackFile result;
  for (const TrackPoint& point : track.points) {
    result.places.push_back(point.place);
    result.lines.push_back(point.line);
    if (timed) result.times.push_back(*point.time);
  }
  result.notes = std::move(track.notes);
  return result;
}

TrajectoryFile timed_trajectory(TrackFile track) {
  RecordedPoints points;
  for (std::size_t i = 0; i < track.places.size(); ++i)
    points.push_back({track.times.at(i), track.places[i], track.lines[i]});
  return recorded_trajectory(std::move(points), true, std::move(track.notes));
}

}  // namespace canyon::simulation
