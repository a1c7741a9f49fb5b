// RFC 7946; colours by the simplestyle specification 1.1.0, supported by common viewers.
// GPX 1.1 (https://www.topografix.com/GPX/1/1): a track of the fixes, a segment for each interval without an
// outage. Elements of a point are in the order of the schema's wptType.
#include "canyon/outputs/encoding/track.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"
#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/outputs/encoding/epoch_values.hpp"
#include "canyon/outputs/encoding/number.hpp"

namespace canyon::encoding {
namespace {

constexpr std::string_view kFaultRgb = "cc79a7";

/// Styles of lines of fixes by kind; dead reckoning keeps the style of the previous kind.
struct KindStyle {
  positioning::FixKind kind;
  std::string_view id, rgb;
};
constexpr std::array kKinds{KindStyle{positioning::FixKind::Single, "fix", "999999"},
                            KindStyle{positioning::FixKind::Differential, "fix_differential", "56b4e9"},
                            KindStyle{positioning::FixKind::Float, "fix_float", "e69f00"},
                            KindStyle{positioning::FixKind::Fixed, "fix_fixed", "009e73"},
                            KindStyle{positioning::FixKind::Combined, "fix_combined", "8a6a00"}};

std::string style(std::string_view id, std::string_view rgb, double width) {
  // KML writes colours as alpha, blue, green, red.
  const std::string colour = fmt::format("ff{}{}{}", rgb.substr(4, 2), rgb.substr(2, 2), rgb.substr(0, 2));
  return fmt::format(
      R"(  <Style id="{}">
    <IconStyle>
      <color>{}</color>
      <scale>0.5</scale>
      <Icon><href>http://maps.google.com/mapfiles/kml/shapes/placemark_circle.png</href></Icon>
    </IconStyle>
    <LabelStyle><scale>0</scale></LabelStyle>
    <LineStyle><color>{}</color><width>{:.1f}</width></LineStyle>
  </Style>
)",
      id, colour, colour, width);
}

/// Connected segments of a track, cut at the antimeridian; a segment of one epoch is a point.
class Stretches {
 public:
  explicit Stretches(Spool& spool) : text_(spool) {}

  void add(const geodesy::Geodetic& point) {
    if (const auto crossing = last_ ? antimeridian_crossing(*last_, point) : std::nullopt) {
      put((*crossing)[0]);
      interrupt();
      put((*crossing)[1]);
    }
    put(point);
    last_ = point;
  }
  void interrupt() {
    if (!first_.empty()) text_.add("<Point>" + std::string(kMode) + first_ + "</coordinates></Point>\n");
    if (first_.empty() && last_) text_.add("</coordinates></LineString>\n");
    first_.clear();
    last_.reset();
  }
  [[nodiscard]] bool empty() const { return text_.empty() && first_.empty(); }
  /// All segments except an uninterrupted one.
  void geometry(const Encoder::Put& put) const {
    put("<MultiGeometry>\n");
    text_.read(put);
    put("</MultiGeometry>");
  }

 private:
  // The heights are ellipsoidal. KML's absolute mode refers to the geoid, which would shift the track
  // vertically by tens of metres; clamped to the ground it is always visible.
  static constexpr std::string_view kMode = "<altitudeMode>clampToGround</altitudeMode><coordinates>\n";

  void put(const geodesy::Geodetic& point) {
    // Degrees with 9 decimals (0.1 mm), metres with 3.
    std::string line = fmt::format("{},{},{}\n", fixed(geodesy::degrees(point.longitude_rad), 9),
                                   fixed(geodesy::degrees(point.latitude_rad), 9), fixed(point.height_m, 3));
    if (!first_.empty()) {
      line = "<LineString><tessellate>1</tessellate>" + std::string(kMode) + first_ + line;
      first_.clear();
    } else if (!last_) {
      first_ = std::move(line);
      last_ = point;
      return;
    }
    text_.add(line);
    last_ = point;
  }

  Spool::Text text_;
  std::string first_;                      ///< of a segment without a second position so far
  std::optional<geodesy::Geodetic> last_;  ///< of the present segment
};

class Kml final : public Encoder {
 public:
  explicit Kml(std::string name) : name_(std::move(name)) {}

  std::string encode(const simulation::Epoch& epoch) override {
    const positioning::Fix& fix = epoch.observed.fix;
    if (epochs_++ == 0) begin_ = epoch.observed.time;
    end_ = epoch.observed.time;
    truth_.add(epoch.truth.position);
    for (const std::string& name : epoch.faults) faults_.try_emplace(name, spool_);
    for (auto& [name, stretches] : faults_) {
      const bool active = std::find(epoch.faults.begin(), epoch.faults.end(), name) != epoch.faults.end();
      if (active)
        stretches.add(epoch.truth.position);
      else
        stretches.interrupt();
    }
    if (fix.solved()) {
      ++fixes_;
      add_to_line(fix);
      outages_.interrupt();
      Stretches& points = points_[error_class(horizontal_m(epoch.error_enu_m))];
      points.interrupt();
      points.add(fix.position);
    } else {
      fix_lines_[kind_].interrupt();
      last_fix_.reset();
      outages_.add(epoch.truth.position);
    }
    return {};
  }

  void end(const Put& put) override {
    const auto placemark = [&put](std::string_view title, std::string_view id, Stretches& stretches) {
      if (stretches.empty()) return;
      stretches.interrupt();
      put(fmt::format("  <Placemark><name>{}</name><styleUrl>#{}</styleUrl>\n", title, id));
      stretches.geometry(put);
      put("\n  </Placemark>\n");
    };
    put("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<kml "
        "xmlns=\"http://www.opengis.net/kml/2.2\">\n<Document>\n");
    put(fmt::format("  <name>{}</name>\n", xml_escaped(name_)));
    if (epochs_ > 0) {
      put(fmt::format("  <description>{} to {}: {} epochs, {} with fix, {} without</description>\n",
                      geodesy::format_utc(begin_), geodesy::format_utc(end_), epochs_, fixes_,
                      epochs_ - fixes_));
    }
    put(style("truth", kTruthRgb, 4));
    for (std::size_t i = 0; i < kKinds.size(); ++i)
      if (i == 0 || !fix_lines_[i].empty()) put(style(kKinds[i].id, kKinds[i].rgb, i == 0 ? 1.5 : 3));
    put(style("outage", kOutageRgb, 6));
    if (!faults_.empty()) put(style("fault", kFaultRgb, 8));
    for (const ErrorClass& c : error_classes()) put(style(c.id, c.rgb, 2));
    placemark("True track", "truth", truth_);
    placemark("Without fix (true place)", "outage", outages_);
    for (std::size_t i = 0; i < kKinds.size(); ++i) {
      const std::string kind = i == 0 ? "" : fmt::format(": {}", name(kKinds[i].kind));
      placemark("Fixes, connected" + kind, kKinds[i].id, fix_lines_[i]);
    }
    for (auto& [name, stretches] : faults_)
      placemark(fmt::format("Fault {} (true place)", xml_escaped(name)), "fault", stretches);
    put("  <Folder>\n  <name>Fixes by horizontal error</name>\n");
    for (std::size_t i = 0; i < kErrorClassCount; ++i) {
      const ErrorClass& c = error_classes()[i];
      placemark(fmt::format("Error {}", c.label), c.id, points_[i]);
    }
    put("  </Folder>\n</Document>\n</kml>\n");
  }

 private:
  /// A line of another kind begins at the end of the previous one.
  void add_to_line(const positioning::Fix& fix) {
    const auto* const found =
        std::find_if(kKinds.begin(), kKinds.end(), [&](const KindStyle& k) { return k.kind == fix.kind(); });
    const std::size_t kind = found == kKinds.end() ? kind_ : static_cast<std::size_t>(found - kKinds.begin());
    if (kind != kind_) {
      fix_lines_[kind_].interrupt();
      kind_ = kind;
      if (last_fix_) fix_lines_[kind].add(*last_fix_);
    }
    fix_lines_[kind].add(fix.position);
    last_fix_ = fix.position;
  }

  std::string name_;
  std::size_t kind_ = 0;  ///< of the last fix, among kKinds
  std::optional<geodesy::Geodetic> last_fix_;
  std::size_t epochs_ = 0, fixes_ = 0;
  geodesy::GpsTime begin_, end_;
  Spool spool_;
  Stretches truth_{spool_}, outages_{spool_};
  std::vector<Stretches> fix_lines_ = std::vector<Stretches>(kKinds.size(), Stretches(spool_));
  std::map<std::string, Stretches> faults_;  // by name
  std::vector<Stretches> points_ = std::vector<Stretches>(kErrorClassCount, Stretches(spool_));
};

std::string colour(std::string_view rgb) {
  return '#' + std::string(rgb);
}

/// Longitude, latitude [deg, 9 decimals: 0.1 mm], ellipsoidal height [m] (RFC 7946, 3.1.1 and 4).
Json coordinates(const geodesy::Geodetic& point) {
  return Json::array({rounded(geodesy::degrees(point.longitude_rad), 9),
                      rounded(geodesy::degrees(point.latitude_rad), 9), rounded(point.height_m, 3)});
}

Json feature(Json properties, std::string_view type, Json coordinates) {
  return {{"type", "Feature"},
          {"properties", std::move(properties)},
          {"geometry", {{"type", type}, {"coordinates", std::move(coordinates)}}}};
}

class GeoJson final : public Encoder {
 public:
  explicit GeoJson(std::string name) : name_(std::move(name)) {}

  std::string begin() override { return "{\"type\":\"FeatureCollection\",\"features\":["; }
  std::string encode(const simulation::Epoch& epoch) override {
    const receiver::ReceiverEpoch& seen = epoch.observed;
    add_truth(epoch.truth.position);
    Json properties{{"kind", seen.fix.solved() ? "fix" : "outage"},
                    {"name", name_},
                    {"time", geodesy::format_utc(seen.time)},
                    {"status", status_word(seen.fix)}};
    if (seen.fix.solved()) {
      properties["error_horizontal_m"] = rounded(horizontal_m(epoch.error_enu_m), 3);
      properties["error_up_m"] = rounded(epoch.error_enu_m.z(), 3);
      properties["hdop"] = seen.fix.dop ? Json(rounded(seen.fix.dop->hdop, 3)) : Json();
      properties["used"] = used_count(seen.fix);
      properties["marker-color"] = colour(error_classes()[error_class(horizontal_m(epoch.error_enu_m))].rgb);
    } else {
      properties["reason"] = no_fix_reason(seen.fix, epoch.containment);
      properties["marker-color"] = colour(kOutageRgb);
    }
    properties["tracked"] = seen.visible;
    properties["not_tracked"] = seen.blocked;
    if (!epoch.faults.empty()) properties["faults"] = epoch.faults;
    // For an epoch without a fix only the true position can be shown.
    return next(feature(std::move(properties), "Point",
                        coordinates(seen.fix.solved() ? seen.fix.position : epoch.truth.position)));
  }

  void end(const Put& put) override {
    if (last_) {
      // A LineString needs two positions (RFC 7946, 3.1.4).
      const std::size_t depth = cut_ ? 2 : points_ > 1 ? 1 : 0;
      constexpr std::array kTypes{"Point", "LineString", "MultiLineString"};
      constexpr std::string_view kPosition = "\"coordinates\":null";
      const std::string text = next(feature(
          {{"kind", "truth"}, {"name", name_}, {"stroke", colour(kTruthRgb)}}, kTypes[depth], Json()));
      const std::size_t at = text.rfind(kPosition) + kPosition.size();
      put(text.substr(0, at - std::string_view("null").size()) + std::string(depth, '['));
      truth_.read(put);
      put(std::string(depth, ']') + text.substr(at));
    }
    put("\n]}\n");
  }

 private:
  std::string next(const Json& feature) {
    return (std::exchange(first_, false) ? "\n" : ",\n") + feature.dump();
  }

  /// The line is cut at the antimeridian (RFC 7946, 3.1.9).
  void add_truth(const geodesy::Geodetic& geodetic) {
    if (const auto crossing = last_ ? antimeridian_crossing(*last_, geodetic) : std::nullopt) {
      truth_.add("," + coordinates((*crossing)[0]).dump() + "],[" + coordinates((*crossing)[1]).dump());
      cut_ = true;
    }
    truth_.add((last_ ? "," : "") + coordinates(geodetic).dump());
    last_ = geodetic;
    ++points_;
  }

  std::string name_;
  Spool spool_;
  Spool::Text truth_{spool_};  ///< positions of the lines, without the outer brackets
  std::optional<geodesy::Geodetic> last_;
  std::size_t points_ = 0;
  bool cut_ = false;
  bool first_ = true;
};

class Gpx final : public Encoder {
 public:
  explicit Gpx(const std::string& name) : name_(xml_escaped(name)) {}

  std::string begin() override {
    return fmt::format(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
        "<gpx version=\"1.1\" creator=\"Canyon\" xmlns=\"http://www.topografix.com/GPX/1/1\">\n"
        "<trk>\n<name>{}</name>\n",
        name_);
  }

  std::string encode(const simulation::Epoch& epoch) override {
    const positioning::Fix& fix = epoch.observed.fix;
    if (!fix.solved()) return close_segment();
    std::string text = open_ ? "" : "<trkseg>\n";
    open_ = true;
    text += fmt::format("<trkpt lat=\"{}\" lon=\"{}\"><ele>{}</ele><time>{}</time>",
                        fixed(geodesy::degrees(fix.position.latitude_rad), 9),
                        fixed(geodesy::degrees(fix.position.longitude_rad), 9), fixed(epoch.altitude_m(), 3),
                        geodesy::format_utc(epoch.observed.time));
    if (epoch.geoid_undulation_m != 0)
      text += fmt::format("<geoidheight>{}</geoidheight>", fixed(epoch.geoid_undulation_m, 3));
    text += fmt::format("<fix>{}</fix><sat>{}</sat>", fix.used.empty() ? "none" : "3d", used_count(fix));
    if (fix.dop) {
      text += fmt::format("<hdop>{}</hdop><vdop>{}</vdop><pdop>{}</pdop>", fixed(fix.dop->hdop, 3),
                          fixed(fix.dop->vdop, 3), fixed(fix.dop->pdop, 3));
    }
    return text + "</trkpt>\n";
  }

  void end(const Put& put) override { put(close_segment() + "</trk>\n</gpx>\n"); }

 private:
  std::string close_segment() {
    if (!open_) return {};
    open_ = false;
    return "</trkseg>\n";
  }

  std::string name_;
  bool open_ = false;
};

}  // namespace

const std::array<ErrorClass, kErrorClassCount>& error_classes() {
  static constexpr std::array<ErrorClass, kErrorClassCount> classes{{
      {2, "error_0_2", "below 2 m", "56b4e9"},
      {5, "error_2_5", "2 m to 5 m", "009e73"},
      {10, "error_5_10", "5 m to 10 m", "f0e442"},
      {30, "error_10_30", "10 m to 30 m", "e69f00"},
      {std::numeric_limits<double>::infinity(), "error_30", "30 m and more", "d55e00"},
  }};
  return classes;
}

std::size_t error_class(double horizontal_m) {
  for (std::size_t i = 0; i < kErrorClassCount; ++i)
    if (horizontal_m < error_classes()[i].below_m) return i;
  return kErrorClassCount - 1;
}

std::optional<std::array<geodesy::Geodetic, 2>> antimeridian_crossing(const geodesy::Geodetic& from,
                                                                      const geodesy::Geodetic& to) {
  const double apart = to.longitude_rad - from.longitude_rad;
  if (std::abs(apart) <= geodesy::kPi) return std::nullopt;
  const double edge = std::copysign(geodesy::kPi, from.longitude_rad);
  const double fraction = (edge - from.longitude_rad) / (apart + 2 * edge);
  geodesy::Geodetic last = from;
  last.longitude_rad = edge;
  last.latitude_rad += fraction * (to.latitude_rad - from.latitude_rad);
  last.height_m += fraction * (to.height_m - from.height_m);
  geodesy::Geodetic first = last;
  first.longitude_rad = -edge;
  return std::array{last, first};
}

std::unique_ptr<Encoder> encode_geojson(const ReceiverDescription& receiver) {
  return std::make_unique<GeoJson>(receiver.name);
}

std::unique_ptr<Encoder> encode_gpx(const ReceiverDescription& receiver) {
  return std::make_unique<Gpx>(receiver.name);
}

std::unique_ptr<Encoder> encode_kml(const ReceiverDescription& receiver) {
  return std::make_unique<Kml>(receiver.name);
}

}  // namespace canyon::encoding
