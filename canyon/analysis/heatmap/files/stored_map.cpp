#include "canyon/analysis/heatmap/files/stored_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <list>
#include <mutex>
#include <utility>

#include "canyon/analysis/heatmap/files/map_reference.hpp"
#include "canyon/analysis/heatmap/files/netcdf_file.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::heatmap {
namespace {

constexpr std::size_t kCacheBytes = std::size_t{64} << 20;
constexpr double kSingleTimeReach = 900;  // [s]

/// Values of one tile at one time and altitude.
struct Piece {
  std::size_t tile = 0, time = 0, altitude = 0;
  std::vector<float> values;  ///< [layer][cell]
  std::vector<signed char> state;
};

/// The cell along one axis; the grid's last side belongs to its last cell.
std::optional<std::uint32_t> cell_along(double at, double first_side, double last_side, double spacing,
                                        std::uint32_t count) {
  if (!(at >= first_side && at <= last_side)) return std::nullopt;
  const double cell = std::floor((at - first_side) / spacing);
  return static_cast<std::uint32_t>(std::min(cell, count - 1.0));
}

std::optional<std::size_t> nearest_time(const std::vector<geodesy::GpsTime>& times, geodesy::GpsTime t) {
  if (times.size() == 1) {
    if (std::abs(t - times[0]) > kSingleTimeReach) return std::nullopt;
    return 0;
  }
  const auto later = std::lower_bound(times.begin(), times.end(), t);
  const auto i = static_cast<std::size_t>(later - times.begin());
  if (i == 0) {
    if (times[0] - t > (times[1] - times[0]) / 2) return std::nullopt;
    return 0;
  }
  if (i == times.size()) {
    if (t - times[i - 1] > (times[i - 1] - times[i - 2]) / 2) return std::nullopt;
    return i - 1;
  }
  return t - times[i - 1] <= times[i] - t ? i - 1 : i;
}

}  // namespace

struct StoredMap::Impl : MapInfo {
  explicit Impl(const std::filesystem::path& path) : file(NetcdfFile::open(path)) {}

  [[noreturn]] void refuse(const std::string& what) const {
    throw InputError(file.path(), 0, "is not a heat map of Canyon: " + what,
                     "give the NetCDF file that canyon heatmap wrote");
  }
  double required(const char* name) const {
    const std::optional<double> value = file.number(NC_GLOBAL, name);
    if (!value || !std::isfinite(*value)) refuse(fmt::format("its attribute {} is missing", name));
    return *value;
  }
  std::size_t size_of(const char* dimension) const {
    const std::optional<std::size_t> size = file.dimension(dimension);
    if (!size || *size == 0) refuse(fmt::format("it has no dimension {}", dimension));
    return *size;
  }
  /// A variable over exactly these dimensions.
  int over(const char* name, const std::vector<std::string>& dimensions) const {
    const std::optional<int> variable = file.variable(name);
    if (!variable || file.dimensions_of(*variable) != dimensions)
      refuse(fmt::format("it has no variable {} over {}", name, fmt::join(dimensions, ", ")));
    return *variable;
  }

  void read_frame() {
    using geodesy::Geodetic;
    const Geodetic origin = Geodetic::from_degrees(required(layout::kLatitude), required(layout::kLongitude),
                                                   required(layout::kHeight));
    try {
      frame = geodesy::LocalFrame(origin, geodesy::radians(required(layout::kHeading)));
    } catch (const InputError& error) {
      if (!error.file().empty()) throw;
      refuse(error.problem());
    }
  }

  void read_grid() {
    grid.west_m = required(layout::kWest);
    grid.south_m = required(layout::kSouth);
    grid.spacing_m = required(layout::kSpacing);
    const double tile_size = required(layout::kTileSize);
    if (!(grid.spacing_m > 0) || !(tile_size >= 1 && tile_size <= 65536)) refuse("its grid is invalid");
    grid.tile_size = static_cast<std::uint32_t>(tile_size);
    const std::size_t columns = size_of(layout::kX), rows = size_of(layout::kY);
    constexpr std::size_t kMax = std::size_t{1} << 31;
    if (columns > kMax || rows > kMax) refuse("its grid is invalid");
    grid.columns = static_cast<std::uint32_t>(columns);
    grid.rows = static_cast<std::uint32_t>(rows);
    // An extract by another tool has these attributes but other axes.
    const auto expect = [&](const char* axis, std::size_t at, double wanted) {
      double found = 0;
      file.read(over(axis, {axis}), {at}, {1}, &found);
      if (!(std::abs(found - wanted) <= 1e-6 * grid.spacing_m))
        refuse(fmt::format("its {} does not match its grid", axis));
    };
    expect(layout::kX, 0, grid.centre(0, 0).x());
    expect(layout::kX, columns - 1, grid.centre(grid.columns - 1, 0).x());
    expect(layout::kY, 0, grid.centre(0, 0).y());
    expect(layout::kY, rows - 1, grid.centre(0, grid.rows - 1).y());
  }

  void read_axes() {
    std::vector<std::int64_t> gps(size_of(layout::kTime));
    if (gps.size() > (std::size_t{1} << 26)) refuse("it has too many times");
    file.read(over(layout::kGpsTime, {layout::kTime}), {0}, {gps.size()}, gps.data());
    for (const std::int64_t t : gps) times.push_back(geodesy::GpsTime::from_nanoseconds(t));
    if (std::adjacent_find(gps.begin(), gps.end(), std::greater_equal<>()) != gps.end())
      refuse("its times are not ascending");
    altitudes_m.resize(size_of(layout::kAltitude));
    if (altitudes_m.size() > (std::size_t{1} << 20)) refuse("it has too many altitudes");
    file.read(over(layout::kAltitude, {layout::kAltitude}), {0}, {altitudes_m.size()}, altitudes_m.data());
    for (const double altitude : altitudes_m)
      if (!std::isfinite(altitude)) refuse("its altitudes are not finite");
    const std::optional<std::string> kind = file.text(NC_GLOBAL, layout::kAltitudeKind);
    if (!kind || (*kind != layout::kEllipsoid && *kind != layout::kAboveTerrain))
      refuse(fmt::format("its attribute {} is missing", layout::kAltitudeKind));
    altitude_kind = *kind == layout::kEllipsoid ? AltitudeKind::Ellipsoid : AltitudeKind::AboveTerrain;
  }

  void find_layers() {
    state = over(layout::kState, {layout::kAltitude, layout::kY, layout::kX});
    for (const std::string& name : file.variable_names()) {
      for (const LayerInfo& about : all_layers()) {
        if (about.name != name) continue;
        variables.push_back(over(name.c_str(), {layout::kTime, layout::kAltitude, layout::kY, layout::kX}));
        layers.push_back(about.layer);
      }
    }
    if (layers.empty()) refuse("it has no layer");
    checksum = over(layout::kChecksum, {layout::kTile, layout::kTime, layout::kAltitude});
    if (size_of(layout::kTile) != grid.tile_count()) refuse("its tiles do not match its grid");
    // Decoded pieces are cached here, so the library need not cache them.
    const std::size_t chunk =
        std::size_t{std::min(grid.tile_size, grid.rows)} * std::min(grid.tile_size, grid.columns);
    file.set_cache(state, chunk);
    for (const int variable : variables) file.set_cache(variable, chunk * sizeof(float));
  }

  void check(const Piece& piece) const {
    std::int64_t wanted = 0;
    file.read(checksum, {piece.tile, piece.time, piece.altitude}, {1, 1, 1}, &wanted);
    const bool none =
        std::all_of(piece.values.begin(), piece.values.end(), [](float v) { return std::isnan(v); });
    const std::int64_t found = NetcdfFile::checksum(
        std::as_bytes(std::span(piece.state)), NetcdfFile::checksum(std::as_bytes(std::span(piece.values))));
    if (wanted < 0 ? !none : wanted != found) {
      throw InputError(file.path(), 0, fmt::format("tile {} is damaged", piece.tile),
                       "write the map again with canyon heatmap");
    }
  }

  /// Precondition: the caller holds the mutex.
  const Piece& piece(std::size_t tile, std::size_t time, std::size_t altitude) {
    const auto same = [&](const Piece& p) {
      return p.tile == tile && p.time == time && p.altitude == altitude;
    };
    const auto found = std::find_if(pieces.begin(), pieces.end(), same);
    if (found != pieces.end()) {
      pieces.splice(pieces.begin(), pieces, found);
      return pieces.front();
    }
    const Tile box = grid.tile(tile);
    Piece fresh;
    fresh.tile = tile;
    fresh.time = time;
    fresh.altitude = altitude;
    file.first_in_child([&] {
      fresh.values.resize(layers.size() * box.cells());
      fresh.state.resize(box.cells());
      for (std::size_t k = 0; k < layers.size(); ++k)
        file.read(variables[k], {time, altitude, box.first_row, box.first_column},
                  {1, 1, box.rows, box.columns}, fresh.values.data() + k * box.cells());
      file.read(state, {altitude, box.first_row, box.first_column}, {1, box.rows, box.columns},
                fresh.state.data());
      check(fresh);
    });
    pieces.push_front(std::move(fresh));
    const std::size_t bytes = (layers.size() * sizeof(float) + 1) * grid.tile_size * grid.tile_size;
    const std::size_t maximum = std::max<std::size_t>(1, kCacheBytes / bytes);
    while (pieces.size() > maximum) pieces.pop_back();
    return pieces.front();
  }

  void read() {
    const std::optional<double> version = file.number(NC_GLOBAL, layout::kMapVersion);
    if (!version) refuse(fmt::format("its attribute {} is missing", layout::kMapVersion));
    if (*version > layout::kVersion) {
      throw InputError(
          file.path(), 0,
          fmt::format("is of version {}, this Canyon reads up to {}", *version, layout::kVersion),
          "read it with the Canyon that wrote it");
    }
    read_frame();
    read_grid();
    read_axes();
    find_layers();
    motion = file.text(NC_GLOBAL, "motion").value_or("standing");
  }

  NetcdfFile file;
  std::vector<int> variables;  ///< by layer
  int state = 0, checksum = 0;
  std::mutex mutex;         ///< for `pieces`
  std::list<Piece> pieces;  ///< most recently used first
};

StoredMap::StoredMap(const std::filesystem::path& netcdf) : impl_(std::make_unique<Impl>(netcdf)) {
  impl_->file.first_in_child([this] { impl_->read(); });
}

StoredMap::~StoredMap() = default;
StoredMap::StoredMap(StoredMap&&) noexcept = default;

const MapReader::MapInfo& StoredMap::about() const {
  return *impl_;
}

std::optional<MapSample> StoredMap::at(const Eigen::Vector2d& enu, double altitude_m,
                                       geodesy::GpsTime time) const {
  const Grid& grid = impl_->grid;
  const auto column = cell_along(enu.x(), grid.west_m, grid.east_m(), grid.spacing_m, grid.columns);
  const auto row = cell_along(enu.y(), grid.south_m, grid.north_m(), grid.spacing_m, grid.rows);
  const auto time_index = nearest_time(impl_->times, time);
  if (!column || !row || !time_index || !std::isfinite(altitude_m)) return std::nullopt;
  std::size_t altitude = 0;
  for (std::size_t i = 1; i < impl_->altitudes_m.size(); ++i) {
    const double here = impl_->altitudes_m[i], best = impl_->altitudes_m[altitude];
    const double gain = std::abs(best - altitude_m) - std::abs(here - altitude_m);
    if (gain > 0 || (gain == 0 && here < best)) altitude = i;
  }
  const std::size_t tile = *row / grid.tile_size * grid.tiles_across() + *column / grid.tile_size;
  const Tile box = grid.tile(tile);
  const std::size_t cell = std::size_t{*row - box.first_row} * box.columns + (*column - box.first_column);

  const std::lock_guard<std::mutex> lock(impl_->mutex);
  const Piece& piece = impl_->piece(tile, *time_index, altitude);
  MapSample result;
  for (std::size_t k = 0; k < impl_->layers.size(); ++k)
    result.values.push_back(piece.values[k * box.cells() + cell]);
  const signed char state = piece.state[cell];
  if (state > static_cast<signed char>(CellState::NoTerrain)) impl_->refuse("a cell has an unknown state");
  // A cell that was not computed has no values and no other state.
  result.state = state < 0 ? CellState::Computed : static_cast<CellState>(state);
  result.time = impl_->times[*time_index];
  result.altitude_m = impl_->altitudes_m[altitude];
  return result;
}

}  // namespace canyon::heatmap
