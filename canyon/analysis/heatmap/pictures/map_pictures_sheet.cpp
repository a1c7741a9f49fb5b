#include "canyon/analysis/heatmap/pictures/map_pictures_sheet.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace canyon::heatmap {
namespace {

using drawing::Align;
using drawing::Canvas;
using drawing::Colour;
using drawing::kFaintInk;
using drawing::kInk;
using drawing::kPaper;
using drawing::Point;
using drawing::Rect;
using drawing::Stroke;
using drawing::TextLevel;

constexpr double kMargin = 20, kGap = 22;
constexpr double kTop = 94;  ///< below the title and its two lines
constexpr double kTitleSize = 12, kTitleLine = 16, kTitleFoot = 7;
constexpr double kBarGap = 9, kBarHeight = 11, kBarFoot = 34;
constexpr double kLegendHeight = 52;
constexpr double kBarPoint = 9;  ///< extension of a bar whose end values are exceeded
/// Taller maps get margins at their sides, flatter ones above and below.
constexpr double kTallest = 1.6, kFlattest = 0.5;

constexpr Colour kBuilding = drawing::rgb(0xC9C9C9), kUnderground = drawing::rgb(0xA89F91);

/// Pixels without a value have patterns, so that they are not mistaken for a colour of the map.
std::uint32_t pixel_of(CellShade shade, std::uint32_t x, std::uint32_t y) {
  static const std::uint32_t paper = packed(kPaper), building = packed(kBuilding),
                             underground = packed(kUnderground), stripe = packed(drawing::kSkyBlue),
                             dot = packed(kFaintInk);
  switch (shade) {
    case CellShade::NoValue:
      return (x + y) % 8 < 4 ? stripe : paper;
    case CellShade::InsideBuilding:
      return building;
    case CellShade::UnderTerrain:
      return underground;
    case CellShade::NotComputed:
      return x % 8 < 2 && (y + (x / 8 % 2) * 4) % 8 < 2 ? dot : paper;
    case CellShade::Value:
    case CellShade::Nothing:
      break;
  }
  return paper;
}

std::uint32_t darkened(std::uint32_t pixel, std::uint8_t coverage) {
  if (coverage == 0) return pixel;
  constexpr double kStrength = 0.62;
  const double part = kStrength * coverage / 255;
  const auto channel = [&](int shift, double ink) {
    const double value = static_cast<double>(pixel >> shift & 0xFFU);
    return static_cast<std::uint32_t>(std::lround(value + part * (255 * ink - value))) << shift;
  };
  return channel(16, kInk.r) | channel(8, kInk.g) | channel(0, kInk.b);
}

std::string heading(Layer layer, const ColourScale& scale) {
  std::string text(info(layer).long_name);
  if (!text.empty() && text[0] >= 'a' && text[0] <= 'z') text[0] = static_cast<char>(text[0] - 'a' + 'A');
  return scale.unit.empty() ? text : fmt::format("{} [{}]", text, scale.unit);
}

/// The text in one line if it fits, else in two of about equal length.
std::vector<std::string> wrapped(Canvas& canvas, const std::string& text, const drawing::TextStyle& style,
                                 double room) {
  std::vector<std::string> best{text};
  double width = canvas.text_width(text, style);
  if (width <= room) return best;
  for (std::size_t gap = text.find(' '); gap != std::string::npos; gap = text.find(' ', gap + 1)) {
    const std::string first = text.substr(0, gap), second = text.substr(gap + 1);
    const double wider = std::max(canvas.text_width(first, style), canvas.text_width(second, style));
    if (wider < width) {
      width = wider;
      best = {first, second};
    }
  }
  return best;
}

void draw_fitting(Canvas& canvas, const Point& at, const std::string& text, drawing::TextStyle style,
                  double room) {
  const double width = canvas.text_width(text, style);
  if (width > room) style.size *= room / width;
  canvas.text(at, text, style);
}

void draw_heading(Canvas& canvas, const Rect& map, const std::string& text) {
  const drawing::TextStyle style{.size = kTitleSize, .bold = true};
  const std::vector<std::string> lines = wrapped(canvas, text, style, map.width);
  double y = map.y - kTitleFoot - kTitleLine * static_cast<double>(lines.size() - 1);
  for (const std::string& line : lines) {
    draw_fitting(canvas, {map.x, y}, line, style, map.width);
    y += kTitleLine;
  }
}

/// Draws labels below a bar, within `position`: the ends first, then those that do not overlap others.
void draw_labels(Canvas& canvas, const Rect& position, const Rect& bar, const ColourScale& scale) {
  constexpr double kOverhang = 3, kApart = 5;
  const drawing::TextStyle style{.size = 11, .align = Align::Centre, .level = TextLevel::Top};
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < scale.ticks.size(); ++i) order.push_back(i);
  if (order.size() > 1) std::rotate(order.begin() + 1, order.end() - 1, order.end());
  std::vector<std::pair<double, double>> taken;
  for (const std::size_t i : order) {
    std::string label = scale.ticks[i].second;
    if (i + 1 == scale.ticks.size() && scale.above) label = "> " + label;
    if (i == 0 && scale.below) label = "< " + label;
    const double half = 0.5 * canvas.text_width(label, style);
    const double x = std::clamp(bar.x + bar.width * scale.ticks[i].first,
                                std::min(position.x - kOverhang + half, position.centre().x),
                                std::max(position.right() + kOverhang - half, position.centre().x));
    const bool free = std::all_of(taken.begin(), taken.end(), [&](const auto& other) {
      return x - half > other.second + kApart || x + half < other.first - kApart;
    });
    if (!free) continue;
    taken.emplace_back(x - half, x + half);
    canvas.text({x, bar.bottom() + 6}, label, style);
  }
}

void draw_bar(Canvas& canvas, const Rect& position, const ColourScale& scale) {
  Rect bar = position;
  if (scale.below) bar.x += kBarPoint, bar.width -= kBarPoint;
  if (scale.above) bar.width -= kBarPoint;
  const double middle = bar.y + 0.5 * bar.height;
  std::vector<Point> rim{{bar.x, bar.y}, {bar.right(), bar.y}};
  if (scale.above) rim.push_back({bar.right() + kBarPoint, middle});
  rim.insert(rim.end(), {{bar.right(), bar.bottom()}, {bar.x, bar.bottom()}});
  if (scale.below) rim.push_back({bar.x - kBarPoint, middle});
  if (scale.above) canvas.polygons({{rim[1], rim[2], rim[3]}}, scale.colour_at(1));
  if (scale.below) canvas.polygons({{rim.front(), rim.back(), {bar.x, bar.bottom()}}}, scale.colour_at(0));
  const int steps = scale.classes > 0 ? scale.classes : static_cast<int>(2 * bar.width);
  for (int i = 0; i < steps; ++i) {
    const double x = bar.x + bar.width * i / steps;
    // A little beyond the next one's begin, so that no seam is visible.
    const double width = std::min(bar.width / steps + 0.3, bar.right() - x);
    canvas.rectangle({x, bar.y, width, bar.height}, scale.colour_at((i + 0.5) / steps));
  }
  canvas.polygons({rim}, {}, Stroke{kFaintInk, 0.8});
  for (const auto& tick : scale.ticks) {
    const double x = bar.x + bar.width * tick.first;
    canvas.segments({{{x, bar.bottom()}, {x, bar.bottom() + 3}}}, {kFaintInk, 0.8});
  }
  draw_labels(canvas, position, bar, scale);
}

}  // namespace

SheetLayout::SheetLayout(const Grid& grid, const std::vector<Layer>& layers) {
  assert(!layers.empty() && layers.size() <= kMaxPanels);
  columns_ = layers.size() <= 3 ? layers.size() : layers.size() == 4 ? 2 : 3;
  map_width_ = columns_ == 1 ? 600 : columns_ == 2 ? 430 : 286;
  const double east = grid.columns * grid.spacing_m, north = grid.rows * grid.spacing_m;
  map_height_ = std::round(map_width_ * std::clamp(north / east, kFlattest, kTallest));
  const double metres = std::max(east / map_width_, north / map_height_);
  const Eigen::Vector3d centre(grid.west_m + 0.5 * east, grid.south_m + 0.5 * north, 0);
  const Eigen::Vector3d half(0.5 * metres * map_width_, 0.5 * metres * map_height_, 0);
  extent_ = {centre - half, centre + half};

  const auto pixels = [](double units) {
    return std::max(1U, static_cast<std::uint32_t>(std::lround(kPixelsPerUnit * units)));
  };
  map_pixels_ = {pixels(map_width_), pixels(map_height_)};
  grid_pixels_ = {std::min(pixels(east / metres), map_pixels_.columns),
                  std::min(pixels(north / metres), map_pixels_.rows)};
  grid_corner_ = {(map_pixels_.columns - grid_pixels_.columns) / 2,
                  (map_pixels_.rows - grid_pixels_.rows) / 2};
  raster_size_ = {std::min(grid.columns, grid_pixels_.columns), std::min(grid.rows, grid_pixels_.rows)};
  // Bold letters are about 0.63 of their size wide; draw_heading() shrinks texts that are still too long.
  for (const Layer layer : layers) {
    const double letters = static_cast<double>(info(layer).long_name.size() + 4);
    if (0.63 * kTitleSize * letters > map_width_) title_lines_ = 2;
  }
}

double SheetLayout::width() const {
  return 2 * kMargin + static_cast<double>(columns_) * (map_width_ + kGap) - kGap;
}

Rect SheetLayout::map(std::size_t panel) const {
  const double row_height =
      title_lines_ * kTitleLine + kTitleFoot + map_height_ + kBarGap + kBarHeight + kBarFoot;
  return {kMargin + static_cast<double>(panel % columns_) * (map_width_ + kGap),
          kTop + static_cast<double>(panel / columns_) * row_height + title_lines_ * kTitleLine + kTitleFoot,
          map_width_, map_height_};
}

double SheetLayout::legend_top(std::size_t panels) const {
  return map(panels - 1).bottom() + kBarGap + kBarHeight + kBarFoot;
}

double SheetLayout::height(std::size_t panels) const {
  return legend_top(panels) + kLegendHeight;
}

std::vector<std::uint8_t> outline_coverage(const drawing::Outlines& outlines, const SheetLayout& layout) {
  const RasterSize& size = layout.map_pixels();
  const Rect map{0, 0, size.columns / kPixelsPerUnit, size.rows / kPixelsPerUnit};
  std::vector<std::pair<Point, Point>> lines;
  lines.reserve(outlines.size());
  for (const auto& [from, to] : outlines) {
    lines.emplace_back(drawing::map_point(map, layout.extent(), from),
                       drawing::map_point(map, layout.extent(), to));
  }
  const drawing::RgbImage sampled = drawing::render_pixels(
      static_cast<int>(size.columns), static_cast<int>(size.rows), kPixelsPerUnit, [&](Canvas& canvas) {
        // One stroke draws all lines, so that they are not darker where they cross.
        canvas.segments(lines, {drawing::kBlack, 0.55});
      });
  std::vector<std::uint8_t> coverage(sampled.pixels.size());
  std::transform(sampled.pixels.begin(), sampled.pixels.end(), coverage.begin(),
                 [](std::uint32_t pixel) { return static_cast<std::uint8_t>(255 - (pixel & 0xFFU)); });
  return coverage;
}

namespace {

/// A panel's map, with outlines over it.
std::vector<std::uint32_t> map_image(const Sheet::Panel& panel, const std::vector<std::uint8_t>& outlines,
                                     const SheetLayout& layout) {
  const RasterSize map = layout.map_pixels(), grid = layout.grid_pixels(), raster = layout.raster_size();
  const auto [left, top] = layout.grid_corner();
  std::vector<std::uint32_t> pixels(map.pixels(), packed(kPaper));
  for (std::uint32_t y = 0; y < grid.rows; ++y) {
    const std::size_t row = std::uint64_t{y} * raster.rows / grid.rows * raster.columns;
    for (std::uint32_t x = 0; x < grid.columns; ++x) {
      const std::size_t cell = row + std::uint64_t{x} * raster.columns / grid.columns;
      const CellShade shade = panel.raster->shades[cell];
      double value = panel.raster->values[cell];
      if (panel.scale->classes > 0) value = std::round(value);
      pixels[(top + y) * std::size_t{map.columns} + left + x] =
          shade == CellShade::Value ? packed(panel.scale->colour(value)) : pixel_of(shade, x, y);
    }
  }
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = darkened(pixels[i], outlines[i]);
  return pixels;
}

void draw_legend(Canvas& canvas, const Sheet& sheet, const SheetLayout& layout, double top) {
  const Rect first = layout.map(0);
  // The marks have the positions for a map of this shape: below the panels they hide nothing.
  drawing::draw_scale_bar(canvas, {first.x - 26, top + 36 - first.height, first.width, first.height},
                          layout.extent());
  drawing::draw_north_arrow(canvas, {0, top - 22, canvas.width() - kMargin + 14, 40});
  double x = first.x + 0.22 * first.width + 44;
  const double y = top + 14;
  constexpr double kWidth = 22, kHeight = 13;
  const drawing::TextStyle style{.size = 11.5, .level = TextLevel::Middle};
  const auto label = [&](const std::string& text) {
    canvas.text({x + kWidth + 7, y}, text, style);
    x += kWidth + 7 + canvas.text_width(text, style) + 22;
  };
  const auto swatch = [&](CellShade shade, const std::string& text) {
    if (!sheet.seen[static_cast<std::size_t>(shade)]) return;
    std::vector<std::uint32_t> pixels;
    for (std::uint32_t py = 0; py < 2 * kHeight; ++py) {
      for (std::uint32_t px = 0; px < 2 * kWidth; ++px) pixels.push_back(pixel_of(shade, px, py));
    }
    const Rect r{x, y - 0.5 * kHeight, kWidth, kHeight};
    canvas.image(r, static_cast<int>(2 * kWidth), static_cast<int>(2 * kHeight), pixels);
    canvas.rectangle(r, {}, Stroke{kFaintInk, 0.8});
    label(text);
  };
  swatch(CellShade::InsideBuilding, "inside a building");
  swatch(CellShade::NoValue, sheet.no_value);
  swatch(CellShade::UnderTerrain, "below the terrain");
  swatch(CellShade::NotComputed, "not computed");
  if (sheet.has_outlines) {
    canvas.segments({{{x, y}, {x + kWidth, y}}}, {kInk.with_alpha(0.75), 1.0});
    label("edges of roofs");
  }
}

}  // namespace

void draw_sheet(Canvas& canvas, const Sheet& sheet, const SheetLayout& layout) {
  drawing::draw_title(canvas, kMargin, sheet.title, sheet.subtitles[0]);
  draw_fitting(canvas, {kMargin, 76}, sheet.subtitles[1], {.size = 12.5, .colour = kFaintInk},
               canvas.width() - 2 * kMargin);
  for (std::size_t i = 0; i < sheet.panels.size(); ++i) {
    const Rect map = layout.map(i);
    draw_heading(canvas, map, heading(sheet.panels[i].layer, *sheet.panels[i].scale));
    canvas.image(map, static_cast<int>(layout.map_pixels().columns),
                 static_cast<int>(layout.map_pixels().rows),
                 map_image(sheet.panels[i], *sheet.outlines, layout));
    canvas.rectangle(map, {}, Stroke{kFaintInk, 0.8});
    draw_bar(canvas, {map.x, map.bottom() + kBarGap, map.width, kBarHeight}, *sheet.panels[i].scale);
  }
  draw_legend(canvas, sheet, layout, layout.legend_top(sheet.panels.size()));
}

namespace {

/// Sums of one layer at one altitude.
struct Sums {
  std::vector<float> values;  ///< float is precise enough for colours and saves memory
  std::vector<std::uint32_t> counts;
};

CellShade shade_of(CellState state) {
  switch (state) {
    case CellState::Computed:
      return CellShade::NoValue;  // unless there is one
    case CellState::InsideBuilding:
      return CellShade::InsideBuilding;
    case CellState::UnderTerrain:
      return CellShade::UnderTerrain;
    case CellState::OutsideArea:
    case CellState::NoTerrain:
      break;
  }
  return CellShade::Nothing;
}

class Reduction {
 public:
  Reduction(const Request& request, const RasterSize& size)
      : request_(request), grid_(request.grid), size_(size), shades_(request.altitudes_m.size()) {
    assert(size.columns >= 1 && size.columns <= grid_.columns && size.rows >= 1 && size.rows <= grid_.rows);
    for (auto& shades : shades_) shades.resize(size.pixels());
    sums_.resize(request.layers.size() * request.altitudes_m.size());
    for (Sums& sums : sums_) {
      sums.values.resize(size.pixels());
      sums.counts.resize(size.pixels());
    }
  }

  void add(const Tile& tile, const std::optional<MapSource::Slice>& slice) {
    const std::size_t cells = tile.cells(), altitudes = request_.altitudes_m.size();
    assert(!slice || slice->state.size() == altitudes * cells);
    assert(!slice || slice->values.size() == request_.layers.size() * altitudes * cells);
    const std::vector<std::size_t> pixels = pixels_of(tile);
    for (std::size_t altitude = 0; altitude < altitudes; ++altitude) {
      const std::size_t states = altitude * cells;
      for (std::size_t i = 0; i < cells; ++i) {
        const CellShade shade = slice ? shade_of(slice->state[states + i]) : CellShade::NotComputed;
        ++shades_[altitude][pixels[i]][static_cast<std::size_t>(shade)];
      }
      if (!slice) continue;
      for (std::size_t layer = 0; layer < request_.layers.size(); ++layer) {
        Sums& sums = sums_[layer * altitudes + altitude];
        const float* values = slice->values.data() + (layer * altitudes + altitude) * cells;
        for (std::size_t i = 0; i < cells; ++i) {
          if (slice->state[states + i] != CellState::Computed || std::isnan(values[i])) continue;
          sums.values[pixels[i]] += values[i];
          ++sums.counts[pixels[i]];
        }
      }
    }
  }

  [[nodiscard]] PanelRaster raster(std::size_t altitude, std::size_t layer) const {
    const Sums& sums = sums_[layer * request_.altitudes_m.size() + altitude];
    PanelRaster raster;
    raster.values.assign(size_.pixels(), std::numeric_limits<float>::quiet_NaN());
    raster.shades.resize(size_.pixels());
    for (std::size_t p = 0; p < size_.pixels(); ++p) {
      std::array<std::uint32_t, kShades> counts = shades_[altitude][p];
      std::uint32_t cells = 0;
      for (const std::uint32_t n : counts) cells += n;
      if (sums.counts[p] > 0 && 2 * std::uint64_t{sums.counts[p]} >= cells) {
        raster.values[p] = sums.values[p] / static_cast<float>(sums.counts[p]);
        raster.shades[p] = CellShade::Value;
        continue;
      }
      counts[static_cast<std::size_t>(CellShade::NoValue)] -= sums.counts[p];
      raster.shades[p] =
          static_cast<CellShade>(std::max_element(counts.begin() + 1, counts.end()) - counts.begin());
    }
    return raster;
  }

 private:
  [[nodiscard]] std::vector<std::size_t> pixels_of(const Tile& tile) const {
    std::vector<std::size_t> pixels;
    pixels.reserve(tile.cells());
    for (std::uint32_t r = 0; r < tile.rows; ++r) {
      const std::uint64_t from_top = grid_.rows - 1 - (tile.first_row + r);
      const std::size_t row = from_top * size_.rows / grid_.rows;
      for (std::uint32_t c = 0; c < tile.columns; ++c) {
        pixels.push_back(row * size_.columns +
                         std::uint64_t{tile.first_column + c} * size_.columns / grid_.columns);
      }
    }
    return pixels;
  }

  const Request& request_;
  const Grid& grid_;
  RasterSize size_;
  std::vector<std::vector<std::array<std::uint32_t, kShades>>> shades_;  ///< [altitude][pixel]
  std::vector<Sums> sums_;                                               ///< [layer][altitude]
};

}  // namespace

std::vector<std::vector<PanelRaster>> reduce(const MapSource& source, std::size_t time,
                                             const RasterSize& size) {
  const Request& request = *source.request;
  Reduction reduction(request, size);
  for (std::size_t tile = 0; tile < request.grid.tile_count(); ++tile)
    reduction.add(request.grid.tile(tile), source.slice(tile, time));
  std::vector<std::vector<PanelRaster>> rasters(request.altitudes_m.size());
  for (std::size_t altitude = 0; altitude < rasters.size(); ++altitude)
    for (std::size_t layer = 0; layer < request.layers.size(); ++layer)
      rasters[altitude].push_back(reduction.raster(altitude, layer));
  return rasters;
}

}  // namespace canyon::heatmap
