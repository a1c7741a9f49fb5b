#include "canyon/analysis/heatmap/pictures/map_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "canyon/analysis/heatmap/engine/map_summary.hpp"
#include "canyon/analysis/heatmap/pictures/map_style.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/outputs/encoding/view_tables.hpp"
#include "canyon/outputs/view/header.hpp"

namespace canyon::heatmap {

using namespace view;

namespace {

constexpr double kNoHeight = std::numeric_limits<double>::quiet_NaN();
/// Positions of one frame that differ by less than this in another are the same [m].
constexpr double kSamePosition_m = 0.05;
/// Colours of a bar: enough to show no steps.
constexpr int kColours = 65;

std::string hex(const drawing::Colour& colour) {
  const auto byte = [](double fraction) { return std::lround(255 * std::clamp(fraction, 0.0, 1.0)); };
  return fmt::format("#{:02x}{:02x}{:02x}", byte(colour.r), byte(colour.g), byte(colour.b));
}

Json bar(drawing::Colour (*colours)(double)) {
  Json list = Json::array();
  for (int i = 0; i < kColours; ++i) list.push_back(hex(colours(static_cast<double>(i) / (kColours - 1))));
  return list;
}

std::string_view progression_word(ColourScale::Progression progression) {
  static constexpr std::array<std::string_view, 3> kWords{"linear", "square root", "logarithm"};
  return kWords.at(static_cast<std::size_t>(progression));
}

std::string_view bar_word(const LayerStyle& style) {
  if (style.colours == &cividis) return "cividis";
  return style.colours == &orange_purple ? "orange-purple" : "inferno";
}

Json layer_json(Layer layer, const ValueCounts& values) {
  const LayerInfo& info = heatmap::info(layer);
  const ColourScale scale = make_colour_scale(layer, values);
  return {{"name", info.name},
          {"title", info.long_name},
          {"unit", scale.style.kind == ValueKind::Fraction ? "%" : scale.unit},
          {"factor", scale.style.kind == ValueKind::Fraction ? 100 : 1},
          {"decimals", scale.style.kind == ValueKind::Count ? 0 : 2},
          {"low", scale.low},
          {"high", scale.high},
          {"progression", progression_word(scale.progression)},
          {"classes", scale.classes},
          {"colours", bar_word(scale.style)},
          {"large_is_bad", scale.style.large_is_bad}};
}

void check_position(const MapReader& map, const city::City& city) {
  const Grid& grid = map.grid();
  for (const Eigen::Vector3d& position :
       {Eigen::Vector3d(grid.west_m, grid.south_m, 0), Eigen::Vector3d(grid.east_m(), grid.north_m(), 0)}) {
    const Eigen::Vector3d there = city.frame.local_from_ecef(map.frame().ecef_from_local(position));
    if ((there - position).norm() < kSamePosition_m) continue;
    throw InputError(fmt::format("the map's coordinates are not those of the city {}", city.name),
                     "give --city the city or scenario of the map");
  }
}

/// z of a cell's centre in the city's frame, as in the map's engine [m]; NaN without terrain.
double cell_height(const MapReader& map, const Eigen::Vector2d& centre, double altitude_m,
                   const raytrace::RayScene* terrain) {
  if (map.altitude_kind() == AltitudeKind::AboveTerrain) {
    return terrain == nullptr
               ? altitude_m
               : terrain->terrain_height(centre.x(), centre.y()).value_or(kNoHeight) + altitude_m;
  }
  Eigen::Vector3d point(centre.x(), centre.y(), 0);
  for (int step = 0; step < 3; ++step)
    point.z() += altitude_m - map.frame().geodetic_from_local(point).height_m;
  return point.z();
}

bool has_terrain(const city::City& city) {
  return std::any_of(city.mesh.objects.begin(), city.mesh.objects.end(),
                     [](const city::Object& o) { return o.surface == city::Surface::Terrain; });
}

/// Writes chunks and collects their entries in the header.
class MapViewWriter {
 public:
  MapViewWriter(const MapReader& map, const std::filesystem::path& folder)
      : map_(map), folder_(folder), counts_(map.layers().size()) {}

  /// Cells of an altitude; their states are the same at all times.
  void add_cells(std::size_t altitude, const raytrace::RayScene* terrain) {
    encoding::ViewRows cells(encoding::kViewMapCells);
    const double altitude_m = map_.altitudes_m()[altitude];
    for_each_cell([&](const Eigen::Vector2d& centre) {
      const auto result = map_.at(centre, altitude_m, map_.times().front());
      // Rounded to a centimetre: finer slopes are invisible and compress badly.
      const double up_m = cell_height(map_, centre, altitude_m, terrain);
      cells.add({static_cast<double>(result->state), std::round(up_m * 100) / 100});
    });
    put(fmt::format("map-{}.bin.gz", altitude), cells, {{"kind", "map-cells"}, {"altitude", altitude}});
  }

  /// Values of an altitude at a time, layer by layer.
  void add_values(std::size_t altitude, std::size_t time) {
    const std::size_t layers = map_.layers().size();
    std::vector<std::vector<float>> values(layers);
    for_each_cell([&](const Eigen::Vector2d& centre) {
      const auto result = map_.at(centre, map_.altitudes_m()[altitude], map_.times()[time]);
      for (std::size_t k = 0; k < layers; ++k) {
        values[k].push_back(result->values[k]);
        const bool is_signed = style_of(map_.layers()[k]).kind == ValueKind::SignedLength;
        counts_[k].add(is_signed ? std::abs(result->values[k]) : result->values[k]);
      }
    });
    encoding::ViewRows rows(encoding::kViewMapValues);
    for (const std::vector<float>& layer : values)
      for (const float value : layer) rows.add({value});
    put(fmt::format("map-{}-{}.bin.gz", altitude, time), rows,
        {{"kind", "map-values"}, {"altitude", altitude}, {"time", time}});
  }

  [[nodiscard]] Json header(const std::string& name) const {
    const Grid& grid = map_.grid();
    Json layers = Json::array(), times = Json::array();
    for (std::size_t k = 0; k < counts_.size(); ++k)
      layers.push_back(layer_json(map_.layers()[k], counts_[k]));
    for (const geodesy::GpsTime time : map_.times()) times.push_back(geodesy::format_utc(time));
    return {
        {"name", name},
        {"grid",
         {{"west_m", grid.west_m},
          {"south_m", grid.south_m},
          {"spacing_m", grid.spacing_m},
          {"columns", grid.columns},
          {"rows", grid.rows}}},
        {"altitudes_m", map_.altitudes_m()},
        {"altitude_above", map_.altitude_kind() == AltitudeKind::AboveTerrain ? "terrain" : "ellipsoid"},
        {"times_utc", times},
        {"layers", layers},
        {"states",
         {"computed", "inside a building", "under the terrain", "outside the map's area", "no terrain"}},
        {"colours",
         {{"inferno", bar(&inferno)}, {"cividis", bar(&cividis)}, {"orange-purple", bar(&orange_purple)}}}};
  }
  [[nodiscard]] const Json& chunks() const { return chunks_; }

 private:
  /// Row by row from the south-west corner. Every cell has a value: its centre is in the grid, and its time
  /// is one of the map's.
  template <typename Each>
  void for_each_cell(Each each) const {
    for (std::uint32_t row = 0; row < map_.grid().rows; ++row)
      for (std::uint32_t column = 0; column < map_.grid().columns; ++column)
        each(map_.grid().centre(column, row));
  }

  void put(const std::string& name, const encoding::ViewRows& rows, const Json& entry) {
    Json chunk{{"file", name}};
    for (const auto& [key, value] : entry.members()) chunk[key] = value;
    chunk["bytes"] = encoding::write_chunk(folder_, name, {&rows});
    chunks_.push_back(std::move(chunk));
  }

  const MapReader& map_;
  const std::filesystem::path& folder_;
  std::vector<ValueCounts> counts_;
  Json chunks_ = Json::array();
};

}  // namespace

void add_map(const MapReader& map, const std::string& name, const city::City& city,
             const std::filesystem::path& folder) {
  check_position(map, city);
  if (map.grid().cells() > kMaxMapCells || std::max(map.grid().columns, map.grid().rows) > kMaxMapColumns) {
    throw InputError(fmt::format("the map has {} by {} cells; the view shows at most {}, and {} in a row",
                                 map.grid().columns, map.grid().rows, kMaxMapCells, kMaxMapColumns),
                     "compute a map of a smaller area (--bbox, --enu-box) or with a wider --spacing");
  }
  std::optional<raytrace::RayScene> terrain;
  if (has_terrain(city)) terrain.emplace(city.mesh);
  MapViewWriter writer(map, folder);
  for (std::size_t altitude = 0; altitude < map.altitudes_m().size(); ++altitude) {
    writer.add_cells(altitude, terrain ? &*terrain : nullptr);
    for (std::size_t time = 0; time < map.times().size(); ++time) writer.add_values(altitude, time);
  }
  extend_header(folder, "map", writer.header(name), writer.chunks());
}

city::City field_of(const MapReader& map) {
  city::City city;
  city.name = "no city";
  city.frame = map.frame();
  return city;
}

}  // namespace canyon::heatmap
