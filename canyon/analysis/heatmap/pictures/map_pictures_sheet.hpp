#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "canyon/analysis/heatmap/engine/map_source.hpp"
#include "canyon/analysis/heatmap/kernels/grid.hpp"
#include "canyon/analysis/heatmap/kernels/layers.hpp"
#include "canyon/analysis/heatmap/pictures/map_style.hpp"
#include "canyon/city/city.hpp"
#include "canyon/outputs/drawing/canvas.hpp"
#include "canyon/outputs/drawing/views/track_picture.hpp"

namespace canyon::heatmap {

/// The content of a pixel of a map.
enum class CellShade : std::uint8_t {
  Value,
  NoValue,  ///< computed, but NaN: no fix, or nothing received
  InsideBuilding,
  UnderTerrain,
  NotComputed,  ///< of an interrupted run
  Nothing,      ///< outside the area, or no terrain
};
inline constexpr std::size_t kShades = 6;

/// One layer at one time and altitude, averaged over cells; rows from the top (north).
struct PanelRaster {
  std::vector<float> values;  ///< NaN if the shade is not Value
  std::vector<CellShade> shades;
};

struct RasterSize {
  std::uint32_t columns = 1, rows = 1;
  [[nodiscard]] std::size_t pixels() const { return std::size_t{columns} * rows; }
  [[nodiscard]] bool operator==(const RasterSize&) const = default;
};

/// All layers and altitudes of one time, [altitude][layer], tile by tile. Every cell belongs to the one pixel
/// that contains its centre: column c * size.columns / columns of the grid, and rows likewise. A pixel is
/// Value, with the mean, if at least half of its cells have a value, else the most frequent shade.
/// @param size neither side larger than the grid's (asserted)
[[nodiscard]] std::vector<std::vector<PanelRaster>> reduce(const MapSource& source, std::size_t time,
                                                           const RasterSize& size);

inline constexpr std::size_t kMaxPanels = 6;
/// Text is 11 units high.
inline constexpr double kPixelsPerUnit = 2;

/// Positions of the parts of a sheet. A sheet has up to six panels of one size: up to three in one row, more
/// in two rows. Lengths are in units of the canvas.
class SheetLayout {
 public:
  /// @param layers of the fullest sheet, [1, kMaxPanels]
  SheetLayout(const Grid& grid, const std::vector<Layer>& layers);

  [[nodiscard]] double width() const;
  /// @param panels of a sheet
  [[nodiscard]] double height(std::size_t panels) const;
  /// The map of a panel, whole units.
  [[nodiscard]] drawing::Rect map(std::size_t panel) const;
  [[nodiscard]] double legend_top(std::size_t panels) const;

  /// Extent of a map [m, ENU]: the grid, with margins if it is very slim. z is 0.
  [[nodiscard]] const city::Box& extent() const { return extent_; }
  /// Pixels of a whole map, and of the grid on it.
  [[nodiscard]] const RasterSize& map_pixels() const { return map_pixels_; }
  [[nodiscard]] const RasterSize& grid_pixels() const { return grid_pixels_; }
  [[nodiscard]] const std::array<std::uint32_t, 2>& grid_corner() const { return grid_corner_; }
  /// Size of a layer's raster: at most the grid's cells, at most the map's pixels.
  [[nodiscard]] RasterSize raster_size() const { return raster_size_; }

 private:
  std::size_t columns_ = 1;
  double map_width_ = 0, map_height_ = 0;
  int title_lines_ = 1;
  city::Box extent_;
  RasterSize map_pixels_, grid_pixels_, raster_size_;
  std::array<std::uint32_t, 2> grid_corner_{};
};

/// The fraction of each pixel of a map that outlines cover, 0 to 255.
[[nodiscard]] std::vector<std::uint8_t> outline_coverage(const drawing::Outlines& outlines,
                                                         const SheetLayout& layout);

/// Shades that a sheet's legend explains.
using ShadesSeen = std::array<bool, kShades>;

/// Contents of a sheet.
struct Sheet {
  std::string title;
  std::array<std::string, 2> subtitles;
  struct Panel {
    Layer layer = Layer::HorizontalError;
    const PanelRaster* raster = nullptr;
    const ColourScale* scale = nullptr;
  };
  std::vector<Panel> panels;
  /// Shades on any picture of this sheet, so that all have the same legend.
  ShadesSeen seen{};
  std::string no_value = "no fix";  ///< meaning of NoValue
  const std::vector<std::uint8_t>* outlines = nullptr;
  bool has_outlines = false;
};

void draw_sheet(drawing::Canvas& canvas, const Sheet& sheet, const SheetLayout& layout);

}  // namespace canyon::heatmap
