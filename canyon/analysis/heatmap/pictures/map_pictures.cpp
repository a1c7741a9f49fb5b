#include "canyon/analysis/heatmap/pictures/map_pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>

#include "canyon/analysis/heatmap/files/map_reference.hpp"
#include "canyon/analysis/heatmap/pictures/map_pictures_sheet.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/output_file.hpp"

namespace canyon::heatmap {
namespace {

namespace fs = std::filesystem;

/// A middle dot, with spaces.
constexpr const char* kDot = "  \u00b7  ";
/// Values to draw are kept in memory up to this size; the rest is read from the source a second time.
constexpr std::size_t kMaxKeptBytes = std::size_t{256} << 20;

/// "2019-04-28 04:44:00 UTC".
std::string readable_utc(geodesy::GpsTime t, int decimals) {
  std::string text = geodesy::format_utc(t, decimals);
  std::replace(text.begin(), text.end(), 'T', ' ');
  text.pop_back();
  return text + " UTC";
}

std::string readable_position(const MapSource& source) {
  const Grid& grid = source.request->grid;
  const geodesy::Geodetic position = source.frame.geodetic_from_local(
      {0.5 * (grid.west_m + grid.east_m()), 0.5 * (grid.south_m + grid.north_m()), 0});
  const auto angle = [](double rad, char positive, char negative) {
    const double degrees = geodesy::degrees(rad);
    return fmt::format("{:.4f}\u00b0 {}", std::abs(degrees), degrees < 0 ? negative : positive);
  };
  return angle(position.latitude_rad, 'N', 'S') + ", " + angle(position.longitude_rad, 'E', 'W');
}

class Writer {
 public:
  Writer(const fs::path& folder, const MapSource& source, const city::City& city)
      : folder_(folder),
        source_(source),
        request_(*source.request),
        city_(city),
        layout_(request_.grid, sheet_layers(0)),
        decimals_(second_decimals(request_.times)) {
    const drawing::Outlines outlines = drawing::building_outlines(city.mesh, layout_.extent());
    has_outlines_ = !outlines.empty();
    outlines_ = outline_coverage(outlines, layout_);
  }

  std::vector<std::string> write() {
    find_scales();
    std::vector<std::string> names;
    for (std::size_t time = 0; time < request_.times.size(); ++time) {
      const Rasters rasters = this->rasters(time, false);
      for (std::size_t altitude = 0; altitude < request_.altitudes_m.size(); ++altitude) {
        for (std::size_t sheet = 0; sheet < sheets(); ++sheet) {
          names.push_back(name(sheet, altitude, time));
          draw(names.back(), sheet, altitude, time, rasters[altitude]);
        }
      }
      kept_[time].reset();
      step();
    }
    return names;
  }

 private:
  using Rasters = std::vector<std::vector<PanelRaster>>;  ///< [altitude][layer]
  [[nodiscard]] std::size_t sheets() const { return (request_.layers.size() + kMaxPanels - 1) / kMaxPanels; }
  [[nodiscard]] std::vector<Layer> sheet_layers(std::size_t sheet) const {
    const auto first = request_.layers.begin() + static_cast<std::ptrdiff_t>(sheet * kMaxPanels);
    const auto left = static_cast<std::size_t>(request_.layers.end() - first);
    return {first, first + static_cast<std::ptrdiff_t>(std::min(left, kMaxPanels))};
  }

  [[nodiscard]] std::string name(std::size_t sheet, std::size_t altitude, std::size_t time) const {
    std::string text = "map";
    if (sheets() > 1) text += fmt::format("_{}", sheet + 1);
    if (request_.altitudes_m.size() > 1) text += fmt::format("_a{}m", request_.altitudes_m[altitude]);
    if (request_.times.size() > 1) text += "_t" + compact_utc(request_.times[time], decimals_);
    return text + ".png";
  }

  void step() {
    if (source_.progress) source_.progress(++done_, 2 * request_.times.size());
  }

  /// @param keep whether they will be requested again
  Rasters rasters(std::size_t time, bool keep) {
    if (kept_[time]) return std::move(*kept_[time]);
    Rasters rasters = reduce(source_, time, layout_.raster_size());
    const std::size_t bytes = layout_.raster_size().pixels() * request_.layers.size() *
                              request_.altitudes_m.size() * (sizeof(float) + sizeof(CellShade));
    if (keep && bytes <= kMaxKeptBytes - kept_bytes_) {
      kept_[time] = rasters;
      kept_bytes_ += bytes;
    }
    return rasters;
  }

  /// Reads everything once, so that colours mean the same on all pictures.
  void find_scales() {
    kept_.resize(request_.times.size());
    std::vector<ValueCounts> histograms(request_.layers.size());
    std::vector<ShadesSeen> seen(request_.layers.size());
    for (std::size_t time = 0; time < request_.times.size(); ++time) {
      const Rasters all = rasters(time, true);
      for (const auto& layers : all) {
        for (std::size_t layer = 0; layer < layers.size(); ++layer) {
          const bool both = style_of(request_.layers[layer]).kind == ValueKind::SignedLength;
          for (const float value : layers[layer].values)
            histograms[layer].add(both ? std::abs(value) : value);
          for (const CellShade shade : layers[layer].shades)
            seen[layer][static_cast<std::size_t>(shade)] = true;
        }
      }
      step();
    }
    seen_.resize(sheets());
    no_value_.resize(sheets());
    for (std::size_t layer = 0; layer < request_.layers.size(); ++layer) {
      scales_.push_back(make_colour_scale(request_.layers[layer], histograms[layer]));
      const std::size_t sheet = layer / kMaxPanels;
      for (std::size_t shade = 0; shade < kShades; ++shade)
        seen_[sheet][shade] = seen_[sheet][shade] || seen[layer][shade];
      if (!seen[layer][static_cast<std::size_t>(CellShade::NoValue)]) continue;
      const Layer sampled = request_.layers[layer];
      const std::string meaning = is_rtk_layer(sampled)                      ? "never fixed"
                                  : style_of(sampled).kind == ValueKind::Dop ? "too few satellites for a DOP"
                                  : info(sampled).error                      ? "no fix"
                                                                             : "nothing received";
      std::string& text = no_value_[sheet];
      if (text.find(meaning) == std::string::npos) text += (text.empty() ? "" : " / ") + meaning;
    }
  }

  [[nodiscard]] std::array<std::string, 2> subtitles(std::size_t altitude, std::size_t time) const {
    const std::string above =
        request_.altitude_kind == AltitudeKind::AboveTerrain ? "above the terrain" : "above the ellipsoid";
    std::array<std::string, 2> lines;
    lines[0] = readable_position(source_) + kDot + readable_utc(request_.times[time], decimals_) + kDot +
               fmt::format("{:g} m {}", request_.altitudes_m[altitude], above) + kDot +
               fmt::format("cells of {:g} m", request_.grid.spacing_m);
    using Word = std::pair<const char*, const char*>;  // an attribute, and its name for people
    for (const auto& [key, word] :
         {Word{"model", "model"}, Word{"propagation_model", "model"}, Word{"receiver", "receiver"},
          Word{"systems", "systems"}, Word{"space_errors", "errors from space"}}) {
      const auto found = source_.attributes.find(key);
      if (found == source_.attributes.end() || found->second.empty()) continue;
      lines[1] += fmt::format("{}{}: {}", lines[1].empty() ? "" : kDot, word, found->second);
    }
    for (const Layer layer : request_.layers) {
      const LimitOptions& limits = request_.limits;
      std::string text;
      if (layer == Layer::HorizontalErrorExceedance)
        text = fmt::format("error limit: {:g} m", limits.error_m);
      if (layer == Layer::ProtectedAvailability) text = fmt::format("alert limit: {:g} m", limits.alert_m);
      if (!text.empty()) lines[1] += (lines[1].empty() ? "" : kDot) + text;
    }
    return lines;
  }

  void draw(const std::string& file, std::size_t number, std::size_t altitude, std::size_t time,
            const std::vector<PanelRaster>& rasters) {
    Sheet sheet;
    sheet.title = source_.title.empty() ? city_.name : source_.title;
    sheet.subtitles = subtitles(altitude, time);
    sheet.seen = seen_[number];
    sheet.no_value = no_value_[number];
    sheet.outlines = &outlines_;
    sheet.has_outlines = has_outlines_;
    const std::vector<Layer> layers = sheet_layers(number);
    for (std::size_t i = 0; i < layers.size(); ++i) {
      const std::size_t layer = number * kMaxPanels + i;
      sheet.panels.push_back({layers[i], &rasters[layer], &scales_[layer]});
    }
    const auto pixels = [](double units) {
      return static_cast<int>(std::ceil(kPixelsPerUnit * units - 1e-9));
    };
    write_file(
        folder_ / file,
        drawing::render_png(pixels(layout_.width()), pixels(layout_.height(layers.size())), kPixelsPerUnit,
                            [&](drawing::Canvas& canvas) { draw_sheet(canvas, sheet, layout_); }));
  }

  fs::path folder_;
  const MapSource& source_;
  const Request& request_;
  const city::City& city_;
  SheetLayout layout_;
  int decimals_ = 0;
  bool has_outlines_ = false;
  std::vector<std::uint8_t> outlines_;
  std::vector<std::optional<Rasters>> kept_;
  std::size_t kept_bytes_ = 0;
  std::vector<ColourScale> scales_;  ///< [layer]
  std::vector<ShadesSeen> seen_;     ///< [sheet]
  std::vector<std::string> no_value_;
  std::size_t done_ = 0;
};

}  // namespace

std::vector<std::string> write_map_pictures(const fs::path& folder, const MapSource& source,
                                            const city::City& city) {
  assert(source.request != nullptr && source.slice);
  make_output_folder(folder);
  return Writer(folder, source, city).write();
}

}  // namespace canyon::heatmap
