// Declared in canyon/output/encoder.hpp.
#include <fmt/format.h>

#include "canyon/base/utf8.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/output/encoder.hpp"
#include "canyon/output/epoch_values.hpp"
#include "canyon/output/number.hpp"

// GPX 1.1 (https://www.topografix.com/GPX/1/1): a track of the fixes, a segment for each stretch without an
// outage. Elements of a point stand in the order of the schema's wptType.

namespace canyon::output {
namespace {

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
    if (epoch.geoid_undulation_m != 0) {
      text += fmt::format("<geoidheight>{}</geoidheight>", fixed(epoch.geoid_undulation_m, 3));
    }
    text += fmt::format("<fix>{}</fix><sat>{}</sat>", fix.used.empty() ? "none" : "3d", used_count(fix));
    if (fix.dop) {
      text += fmt::format("<hdop>{}</hdop><vdop>{}</vdop><pdop>{}</pdop>", fixed(fix.dop->hdop, 3),
                          fixed(fix.dop->vdop, 3), fixed(fix.dop->pdop, 3));
    }
    return text + "</trkpt>\n";
  }

  std::string end() override { return close_segment() + "</trk>\n</gpx>\n"; }

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

std::unique_ptr<Encoder> encode_gpx(const ReceiverDescription& receiver) {
  return std::make_unique<Gpx>(receiver.name);
}

}  // namespace canyon::output
