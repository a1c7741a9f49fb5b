#include "canyon/simulation/motion/track_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/geodesy/time_scales.hpp"

namespace canyon::simulation {
namespace {

using geodesy::Geodetic;
using geodesy::GpsTime;

/// The tags of an XML text one after the other, each with the text behind it. Names are without their prefix
/// ("gx:coord" is "coord"), "/name" where an element ends. What stands in comments, declarations and CDATA is
/// passed over. (Ends of elements with a prefix are "/".) Nothing is nested here, so no depth of a file can
/// do harm.
class Tags {
 public:
  explicit Tags(const TextFile& file) : file_(file), text_(file.text()) {}

  std::string_view name, attributes, content;

  bool next() {
    for (;;) {
      const std::size_t open = text_.find('<', at_);
      if (open == std::string_view::npos) return false;
      if (skip(open, "<!--", "-->") || skip(open, "<![CDATA[", "]]>") || skip(open, "<?", "?>")) continue;
      const std::size_t close = text_.find('>', open);
      if (close == std::string_view::npos) throw error("a tag does not end");
      count_lines(open);
      std::string_view tag = text_.substr(open + 1, close - open - 1);
      name = tag.substr(0, tag.find_first_of(" \t\r\n"));
      attributes = tag.substr(name.size());
      if (!name.empty() && name.back() == '/') name.remove_suffix(1);
      const std::size_t colon = name.find(':');
      if (colon != std::string_view::npos) {
        name = name.front() == '/' ? std::string_view("/") : name.substr(colon + 1);
      }
      at_ = close + 1;
      const std::size_t behind = text_.find('<', at_);
      content = trim(text_.substr(at_, (behind == std::string_view::npos ? text_.size() : behind) - at_));
      return true;
    }
  }

  /// The value of an attribute of this tag; empty where it has none.
  [[nodiscard]] std::string_view attribute(std::string_view key) const {
    for (std::size_t at = attributes.find(key); at != std::string_view::npos;
         at = attributes.find(key, at + 1)) {
      std::size_t from = at + key.size();
      const bool begins = at > 0 && (attributes[at - 1] == ' ' || attributes[at - 1] == '\t' ||
                                     attributes[at - 1] == '\n' || attributes[at - 1] == '\r');
      from = attributes.find_first_not_of(" \t\r\n", from);
      if (!begins || from == std::string_view::npos || attributes[from] != '=') continue;
      from = attributes.find_first_of("\"'", from);
      if (from == std::string_view::npos) return {};
      const std::size_t to = attributes.find(attributes[from], from + 1);
      return to == std::string_view::npos ? std::string_view() : attributes.substr(from + 1, to - from - 1);
    }
    return {};
  }

  [[nodiscard]] InputError error(std::string_view problem, std::string_view cure = {}) const {
    return {file_.path(), line_, problem, cure};
  }

 private:
  bool skip(std::size_t open, std::string_view begin, std::string_view end) {
    if (text_.compare(open, begin.size(), begin) != 0) return false;
    const std::size_t close = text_.find(end, open + begin.size());
    at_ = close == std::string_view::npos ? text_.size() : close + end.size();
    return true;
  }
  void count_lines(std::size_t to) {
    line_ += static_cast<int>(std::count(text_.begin() + static_cast<std::ptrdiff_t>(counted_),
                                         text_.begin() + static_cast<std::ptrdiff_t>(to), '\n'));
    counted_ = to;
  }

  const TextFile& file_;
  std::string_view text_;
  std::size_t at_ = 0, counted_ = 0;
  int line_ = 1;
};

double number(const Tags& tags, std::string_view text, std::string_view what) {
  const auto value = parse_double(text);
  if (!value) throw tags.error(fmt::format("the {} '{}' is no number", what, text));
  return *value;
}

Geodetic place(const Tags& tags, std::string_view latitude, std::string_view longitude) {
  const double latitude_deg = number(tags, latitude, "latitude");
  const double longitude_deg = number(tags, longitude, "longitude");
  if (!(std::abs(latitude_deg) <= 90) || !(std::abs(longitude_deg) <= 180)) {
    throw tags.error(fmt::format("latitude {}, longitude {} is no place", latitude_deg, longitude_deg),
                     "they are degrees");
  }
  return Geodetic::from_degrees(latitude_deg, longitude_deg, 0);
}

GpsTime instant(const Tags& tags) {
  try {
    return geodesy::parse_time(tags.content);
  } catch (const InputError& e) {
    throw tags.error(e.problem(), e.cure());
  }
}

/// Points as they are read, with what each says.
struct Points {
  std::vector<Geodetic> places;
  std::vector<std::optional<GpsTime>> times;
  std::size_t without_height = 0;
};

void read_gpx(Tags& tags, std::string_view point, Points& points) {
  bool inside = false, height = false;
  while (tags.next()) {
    if (tags.name == point) {
      inside = true, height = false;
      points.places.push_back(place(tags, tags.attribute("lat"), tags.attribute("lon")));
      points.times.emplace_back();
      if (!trim(tags.attributes).empty() && trim(tags.attributes).back() == '/')
        inside = false, ++points.without_height;
    } else if (inside && tags.name == "ele") {
      points.places.back().height_m = number(tags, tags.content, "ele");
      height = true;
    } else if (inside && tags.name == "time") {
      points.times.back() = instant(tags);
    } else if (inside && tags.name.size() == point.size() + 1 && tags.name.front() == '/' &&
               tags.name.substr(1) == point) {
      inside = false;
      points.without_height += height ? 0 : 1;
    }
  }
}

/// "longitude,latitude,height" or with blanks between; a height may be absent.
void add_kml(const Tags& tags, std::string_view text, char separator, Points& points) {
  const std::vector<std::string_view> fields = separator == ',' ? split(text, ',') : split_blanks(text);
  if (fields.size() < 2) throw tags.error(fmt::format("'{}' is no place", text), "longitude,latitude,height");
  points.places.push_back(place(tags, fields[1], fields[0]));
  points.times.emplace_back();
  if (fields.size() > 2) {
    points.places.back().height_m = number(tags, fields[2], "height");
  } else {
    ++points.without_height;
  }
}

void read_kml_track(Tags& tags, Points& points) {
  std::vector<std::optional<GpsTime>> times;
  while (tags.next()) {
    if (tags.name == "when") times.emplace_back(instant(tags));
    if (tags.name == "coord") add_kml(tags, tags.content, ' ', points);
  }
  if (points.places.empty()) return;
  if (times.size() != points.places.size()) {
    throw tags.error(fmt::format("gx:Track has {} times for {} places", times.size(), points.places.size()));
  }
  points.times = std::move(times);
}

void read_kml_line(Tags& tags, Points& points) {
  bool line = false;
  while (tags.next() && points.places.empty()) {
    if (tags.name == "LineString") line = true;
    if (!line || tags.name != "coordinates") continue;
    for (const std::string_view tuple : split_blanks(tags.content)) add_kml(tags, tuple, ',', points);
  }
}

}  // namespace

bool is_track_format(const std::string& format) {
  return format == "gpx" || format == "kml";
}

TrackFile read_track_file(const std::filesystem::path& path, const std::string& format) {
  const TextFile file(path);
  Points points;
  const auto read = [&](const auto& reader) {
    if (!points.places.empty()) return;
    Tags tags(file);
    reader(tags);
  };
  if (format == "gpx") {
    read([&](Tags& tags) { read_gpx(tags, "trkpt", points); });
    read([&](Tags& tags) { read_gpx(tags, "rtept", points); });
  } else {
    read([&](Tags& tags) { read_kml_track(tags, points); });
    read([&](Tags& tags) { read_kml_line(tags, points); });
  }
  if (points.places.empty()) {
    throw InputError(path, 0,
                     format == "gpx" ? "no track point and no route point" : "no gx:Track and no LineString",
                     fmt::format("is it a {} file with a path?", format == "gpx" ? "GPX" : "KML"));
  }
  const auto timed = static_cast<std::size_t>(std::count_if(
      points.times.begin(), points.times.end(), [](const auto& time) { return time.has_value(); }));
  if (timed != 0 && timed != points.places.size()) {
    throw InputError(
        path, 0,
        fmt::format("{} of {} points have no time", points.places.size() - timed, points.places.size()),
        "give each a time, or none");
  }
  TrackFile track;
  std::size_t backwards = 0;
  for (std::size_t i = 0; i < points.places.size(); ++i) {
    if (timed != 0) {
      if (!track.times.empty() && *points.times[i] <= track.times.back()) {
        ++backwards;
        continue;
      }
      track.times.push_back(*points.times[i]);
    }
    track.places.push_back(points.places[i]);
  }
  const auto say = [&](std::size_t count, std::string_view what) {
    if (count > 0) track.warnings.push_back(fmt::format("{}: {} {}", path.string(), count, what));
  };
  say(backwards, "points whose time does not follow the one before are left out");
  say(points.without_height, "points have no height: 0 is taken");
  say(points.places.size() - points.without_height,
      "heights are above sea level by the format and are taken as ellipsoidal; height_above_terrain_m does "
      "without them");
  return track;
}

}  // namespace canyon::simulation
