#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <vector>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/spool.hpp"
#include "canyon/base/utf8.hpp"
#include "canyon/outputs/output/encoder.hpp"
#include "canyon/outputs/output/epoch_values.hpp"
#include "canyon/outputs/output/number.hpp"
#include "canyon/outputs/output/track.hpp"

namespace canyon::output {
namespace {

constexpr std::string_view kFaultRgb = "cc79a7";

/// Styles of lines of fixes by kind; dead reckoning goes on as the kind before it.
struct KindStyle {
  positioning::FixKind kind;
  std::string_view id, rgb;
};
constexpr std::array kKinds{KindStyle{positioning::FixKind::Single, "fix", "999999"},
                            KindStyle{positioning::FixKind::Differential, "fix_differential", "56b4e9"},
                            KindStyle{positioning::FixKind::Float, "fix_float", "e69f00"},
                            KindStyle{positioning::FixKind::Fixed, "fix_fixed", "009e73"},
                            KindStyle{positioning::FixKind::Combined, "fix_combined", "8a6a00"}};

/// KML writes colours as alpha, blue, green, red.
std::string kml_colour(std::string_view rgb) {
  return fmt::format("ff{}{}{}", rgb.substr(4, 2), rgb.substr(2, 2), rgb.substr(0, 2));
}

std::string style(std::string_view id, std::string_view rgb, double width) {
  const std::string colour = kml_colour(rgb);
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

/// Degrees with 9 decimals (0.1 mm), metres with 3.
std::string kml_coordinates(const geodesy::Geodetic& point) {
  return fixed(geodesy::degrees(point.longitude_rad), 9) + ',' +
         fixed(geodesy::degrees(point.latitude_rad), 9) + ',' + fixed(point.height_m, 3);
}

/// Connected stretches of a track, cut at the antimeridian; a stretch of one epoch is a point.
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
  /// Of all but a stretch that was not interrupted.
  void geometry(const Encoder::Put& put) const {
    put("<MultiGeometry>\n");
    text_.read(put);
    put("</MultiGeometry>");
  }

 private:
  // The heights are ellipsoidal. KML's absolute mode counts from the geoid, which would bury or lift the
  // track by tens of metres; clamped to the ground it is always seen.
  static constexpr std::string_view kMode = "<altitudeMode>clampToGround</altitudeMode><coordinates>\n";

  void put(const geodesy::Geodetic& point) {
    std::string line = kml_coordinates(point) + '\n';
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
  std::string first_;                      ///< of a stretch that has no second place yet
  std::optional<geodesy::Geodetic> last_;  ///< of the present stretch
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
      if (active) {
        stretches.add(epoch.truth.position);
      } else {
        stretches.interrupt();
      }
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
    for (std::size_t i = 0; i < kKinds.size(); ++i) {
      if (i == 0 || !fix_lines_[i].empty()) put(style(kKinds[i].id, kKinds[i].rgb, i == 0 ? 1.5 : 3));
    }
    put(style("outage", kOutageRgb, 6));
    if (!faults_.empty()) put(style("fault", kFaultRgb, 8));
    for (const ErrorClass& c : error_classes()) put(style(c.id, c.rgb, 2));
    placemark("True track", "truth", truth_);
    placemark("Without fix (true place)", "outage", outages_);
    for (std::size_t i = 0; i < kKinds.size(); ++i) {
      const std::string kind = i == 0 ? "" : fmt::format(": {}", name(kKinds[i].kind));
      placemark("Fixes, connected" + kind, kKinds[i].id, fix_lines_[i]);
    }
    for (auto& [name, stretches] : faults_) {
      placemark(fmt::format("Fault {} (true place)", xml_escaped(name)), "fault", stretches);
    }
    put("  <Folder>\n  <name>Fixes by horizontal error</name>\n");
    for (std::size_t i = 0; i < kErrorClassCount; ++i) {
      const ErrorClass& c = error_classes()[i];
      placemark(fmt::format("Error {}", c.label), c.id, points_[i]);
    }
    put("  </Folder>\n</Document>\n</kml>\n");
  }

 private:
  /// A line of another kind begins where that before it ended.
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

}  // namespace

std::unique_ptr<Encoder> encode_kml(const ReceiverDescription& receiver) {
  return std::make_unique<Kml>(receiver.name);
}

}  // namespace canyon::output
