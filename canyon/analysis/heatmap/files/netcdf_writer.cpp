#include "canyon/analysis/heatmap/files/netcdf_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "canyon/analysis/heatmap/files/map_reference.hpp"
#include "canyon/analysis/heatmap/files/netcdf_file.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/output_file.hpp"

// Attributes are those of the CF conventions 1.10 (cfconventions.org): chapters 4 (coordinates), 5.6 and
// appendix F (grid mappings), 7.1 (bounds), 3.5 (flags).

namespace canyon::heatmap {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
/// In larger maps, latitude and longitude of every cell would be larger than the layers.
constexpr std::size_t kMaxCellsWithLatitude = 4'000'000;

class NetcdfWriter {
 public:
  NetcdfWriter(const std::filesystem::path& at, const std::filesystem::path& shown, const MapSource& source)
      : source_(source),
        request_(*source.request),
        grid_(request_.grid),
        file_(NetcdfFile::create(at, shown)) {
    with_latitude_ = grid_.cells() <= kMaxCellsWithLatitude;
    steps_ = grid_.tile_count() * (request_.times.size() + (with_latitude_ ? 1 : 0));
  }

  void write() {
    define();
    write_coordinates();
    for (std::size_t i = 0; i < grid_.tile_count(); ++i) write_tile(i);
    file_.close();
  }

 private:
  void define() {
    time_dim_ = file_.define_dimension(layout::kTime, request_.times.size());
    altitude_dim_ = file_.define_dimension(layout::kAltitude, request_.altitudes_m.size());
    y_dim_ = file_.define_dimension(layout::kY, grid_.rows);
    x_dim_ = file_.define_dimension(layout::kX, grid_.columns);
    global_attributes();
    define_coordinates();
    define_plane();
    define_layers();
    define_checksums();
    file_.end_definitions();
  }

  void define_coordinates() {
    const int corner_dim = file_.define_dimension("bnds", 2);
    time_ = file_.define_variable(layout::kTime, NC_DOUBLE, {time_dim_});
    file_.put_text(time_, "standard_name", "time");
    file_.put_text(time_, "long_name", "time (UTC)");
    file_.put_text(time_, "units", "seconds since 1970-01-01T00:00:00Z");
    file_.put_text(time_, "calendar", "standard");
    file_.put_text(time_, "axis", "T");
    const auto& times = request_.times;
    const int first = geodesy::leap_seconds(times.front()), last = geodesy::leap_seconds(times.back());
    file_.put_text(
        time_, "comment",
        fmt::format("UTC, leap seconds not counted; GPS time is {} s ahead of it{}", first,
                    first == last ? "" : fmt::format(" at the first time, {} s at the last", last)));
    gps_time_ = file_.define_variable(layout::kGpsTime, NC_INT64, {time_dim_});
    file_.put_text(gps_time_, "long_name", "GPS time since 1980-01-06 00:00:00, exactly");
    file_.put_text(gps_time_, "units", "nanoseconds");

    altitude_ = file_.define_variable(layout::kAltitude, NC_DOUBLE, {altitude_dim_});
    if (request_.altitude_kind == AltitudeKind::Ellipsoid) {
      file_.put_text(altitude_, "standard_name", "height_above_reference_ellipsoid");
      file_.put_text(altitude_, "long_name", "height above the WGS 84 ellipsoid");
    } else {
      file_.put_text(altitude_, "standard_name", "height");
      file_.put_text(altitude_, "long_name", "height above the terrain");
      file_.put_text(altitude_, "comment", "above the city's plane z = 0 where it has no terrain");
    }
    file_.put_text(altitude_, "units", "m");
    file_.put_text(altitude_, "positive", "up");
    file_.put_text(altitude_, "axis", "Z");

    const auto axis = [&](const char* name, int dim, const char* letter, const char* direction, int& variable,
                          int& bounds) {
      variable = file_.define_variable(name, NC_DOUBLE, {dim});
      const std::string bounds_name = std::string(name) + "_bnds";
      file_.put_text(variable, "standard_name", fmt::format("projection_{}_coordinate", name));
      file_.put_text(variable, "long_name",
                     fmt::format("{} of the cell's centre from the city's origin", direction));
      file_.put_text(variable, "units", "m");
      file_.put_text(variable, "axis", letter);
      file_.put_text(variable, "bounds", bounds_name);
      bounds = file_.define_variable(bounds_name, NC_DOUBLE, {dim, corner_dim});
    };
    const bool rotated = source_.frame.heading_rad() != 0;
    axis(layout::kY, y_dim_, "Y", rotated ? "y" : "north", y_, y_bounds_);
    axis(layout::kX, x_dim_, "X", rotated ? "x" : "east", x_, x_bounds_);

    if (!with_latitude_) return;
    latitude_ = file_.define_variable("lat", NC_DOUBLE, {y_dim_, x_dim_});
    file_.put_text(latitude_, "standard_name", "latitude");
    file_.put_text(latitude_, "long_name", "WGS 84 latitude of the cell's centre");
    file_.put_text(latitude_, "units", "degrees_north");
    longitude_ = file_.define_variable("lon", NC_DOUBLE, {y_dim_, x_dim_});
    file_.put_text(longitude_, "standard_name", "longitude");
    file_.put_text(longitude_, "long_name", "WGS 84 longitude of the cell's centre");
    file_.put_text(longitude_, "units", "degrees_east");
    store_by_tile(latitude_, 0, sizeof(double));
    store_by_tile(longitude_, 0, sizeof(double));
  }

  void define_plane() {
    const int crs = file_.define_variable("crs", NC_INT, {});
    const geodesy::Geodetic& origin = source_.frame.origin();
    const double latitude_deg = geodesy::degrees(origin.latitude_rad);
    const double longitude_deg = geodesy::degrees(origin.longitude_rad);
    file_.put_text(crs, "long_name", "the city's plane: metres about its origin");
    if (source_.frame.heading_rad() == 0) {
      file_.put_text(crs, "grid_mapping_name", "transverse_mercator");
      file_.put_number(crs, "scale_factor_at_central_meridian", projection_scale(source_.frame));
      file_.put_number(crs, "longitude_of_central_meridian", longitude_deg);
      file_.put_number(crs, "latitude_of_projection_origin", latitude_deg);
      file_.put_number(crs, "false_easting", 0);
      file_.put_number(crs, "false_northing", 0);
    }  // CF has no name for a rotated one (its oblique_mercator is not rectified to a given angle): crs_wkt
       // has it
    file_.put_text(crs, "reference_ellipsoid_name", "WGS 84");
    file_.put_number(crs, "semi_major_axis", geodesy::kSemiMajorAxis);
    file_.put_number(crs, "inverse_flattening", 298.257223563);
    file_.put_text(crs, "prime_meridian_name", "Greenwich");
    file_.put_number(crs, "longitude_of_prime_meridian", 0);
    file_.put_text(crs, "horizontal_datum_name", "World Geodetic System 1984");
    file_.put_text(crs, "geographic_crs_name", "WGS 84");
    file_.put_text(crs, "projected_crs_name", "Canyon city plane");
    file_.put_text(crs, "crs_wkt", projection_wkt(source_.frame, "WKT2"));
    // An attribute of GDAL for readers older than WKT 2.
    file_.put_text(crs, "spatial_ref", projection_wkt(source_.frame, "WKT1_GDAL"));
  }

  void define_layers() {
    state_ = file_.define_variable(layout::kState, NC_BYTE, {altitude_dim_, y_dim_, x_dim_});
    file_.put_bytes(state_, "_FillValue", {layout::kNotComputed});
    file_.put_text(state_, "long_name", "why a cell has no values");
    file_.put_bytes(state_, "flag_values", {0, 1, 2, 3, 4});
    file_.put_text(state_, "flag_meanings", "computed inside_building under_terrain outside_area no_terrain");
    file_.put_text(state_, "grid_mapping", "crs");
    if (with_latitude_) file_.put_text(state_, "coordinates", "lat lon");
    store_by_tile(state_, 1, 1);
    for (const Layer layer : request_.layers) {
      const LayerInfo& about = info(layer);
      const int variable = file_.define_variable(std::string(about.name), NC_FLOAT,
                                                 {time_dim_, altitude_dim_, y_dim_, x_dim_});
      file_.put(variable, "_FillValue", NC_FLOAT, 1, &kNan);
      file_.put_text(variable, "long_name", about.long_name);
      file_.put_text(variable, "units", about.unit);
      file_.put_text(variable, "cell_methods",
                     "area: point" + (source_.over_runs.empty() ? "" : " realization: " + source_.over_runs));
      if (const std::string limits = limits_text(layer, request_.limits); !limits.empty())
        file_.put_text(variable, "comment", limits);
      file_.put_text(variable, "ancillary_variables", layout::kState);
      file_.put_text(variable, "grid_mapping", "crs");
      if (with_latitude_) file_.put_text(variable, "coordinates", "lat lon");
      store_by_tile(variable, 2, sizeof(float));
      layers_.push_back(variable);
    }
  }

  void global_attributes() {
    std::set<std::string> taken;
    const auto put = [&](const std::string& name, const std::string& value) {
      if (!value.empty() && taken.insert(name).second) file_.put_text(NC_GLOBAL, name, value);
    };
    put("Conventions", "CF-1.10");
    put("title", source_.title);
    put("source", source_.source);
    put("history", source_.history);
    for (const auto& [name, value] : source_.attributes)
      if (name.rfind("canyon_", 0) != 0) put(name, value);
    file_.put_integer(NC_GLOBAL, layout::kMapVersion, layout::kVersion);
    file_.put_number(NC_GLOBAL, layout::kWest, grid_.west_m);
    file_.put_number(NC_GLOBAL, layout::kSouth, grid_.south_m);
    file_.put_number(NC_GLOBAL, layout::kSpacing, grid_.spacing_m);
    file_.put_integer(NC_GLOBAL, layout::kTileSize, static_cast<int>(grid_.tile_size));
    const geodesy::Geodetic& origin = source_.frame.origin();
    file_.put_number(NC_GLOBAL, layout::kLatitude, geodesy::degrees(origin.latitude_rad));
    file_.put_number(NC_GLOBAL, layout::kLongitude, geodesy::degrees(origin.longitude_rad));
    file_.put_number(NC_GLOBAL, layout::kHeight, origin.height_m);
    file_.put_number(NC_GLOBAL, layout::kHeading, geodesy::degrees(source_.frame.heading_rad()));
    file_.put_text(
        NC_GLOBAL, layout::kAltitudeKind,
        request_.altitude_kind == AltitudeKind::Ellipsoid ? layout::kEllipsoid : layout::kAboveTerrain);
  }

  void write_coordinates() {
    std::vector<double> utc;
    std::vector<std::int64_t> gps;
    for (const geodesy::GpsTime t : request_.times) {
      utc.push_back(unix_seconds(t));
      gps.push_back(t.nanoseconds());
    }
    file_.write(time_, {0}, {utc.size()}, utc.data());
    file_.write(gps_time_, {0}, {gps.size()}, gps.data());
    file_.write(altitude_, {0}, {request_.altitudes_m.size()}, request_.altitudes_m.data());
    write_axis(y_, y_bounds_, grid_.south_m, grid_.rows);
    write_axis(x_, x_bounds_, grid_.west_m, grid_.columns);
  }

  void write_axis(int variable, int bounds, double first, std::size_t count) {
    constexpr std::size_t kBatch = 65536;
    std::vector<double> centres, sides;
    for (std::size_t begin = 0; begin < count; begin += kBatch) {
      const std::size_t n = std::min(kBatch, count - begin);
      centres.clear();
      sides.clear();
      for (std::size_t i = begin; i < begin + n; ++i) {
        const auto at = static_cast<double>(i);
        centres.push_back(first + (at + 0.5) * grid_.spacing_m);
        sides.push_back(first + at * grid_.spacing_m);
        sides.push_back(first + (at + 1) * grid_.spacing_m);
      }
      file_.write(variable, {begin}, {n}, centres.data());
      file_.write(bounds, {begin, 0}, {n, 2}, sides.data());
    }
  }

  void write_latitudes(const Tile& tile) {
    // Rounded to multiples of 2^-27 deg (0.8 mm on the ground), which halves their size.
    const auto cut = [](double deg) { return std::ldexp(std::round(std::ldexp(deg, 27)), -27); };
    std::vector<double> latitudes, longitudes;
    latitudes.reserve(tile.cells());
    longitudes.reserve(tile.cells());
    for (std::uint32_t r = 0; r < tile.rows; ++r) {
      for (std::uint32_t c = 0; c < tile.columns; ++c) {
        const Eigen::Vector2d at = grid_.centre(tile.first_column + c, tile.first_row + r);
        const geodesy::Geodetic position = source_.frame.geodetic_from_local({at.x(), at.y(), 0});
        latitudes.push_back(cut(geodesy::degrees(position.latitude_rad)));
        longitudes.push_back(cut(geodesy::degrees(position.longitude_rad)));
      }
    }
    file_.write(latitude_, {tile.first_row, tile.first_column}, {tile.rows, tile.columns}, latitudes.data());
    file_.write(longitude_, {tile.first_row, tile.first_column}, {tile.rows, tile.columns},
                longitudes.data());
    step();
  }

  /// Chunks have checksums, their index has none: a chunk missing in it is read as missing values.
  void define_checksums() {
    const int tile_dim = file_.define_dimension(layout::kTile, grid_.tile_count());
    checksum_ = file_.define_variable(layout::kChecksum, NC_INT64, {tile_dim, time_dim_, altitude_dim_});
    constexpr std::int64_t kNone = -1;
    file_.put(checksum_, "_FillValue", NC_INT64, 1, &kNone);
    file_.put_text(
        checksum_, "long_name",
        "CRC-32 of a tile's values, layer by layer, and cell states; tiles by rows from the south-west");
    const std::size_t times = request_.times.size(), altitudes = request_.altitudes_m.size();
    file_.set_storage(checksum_, {1, times, altitudes}, times * altitudes * sizeof(std::int64_t));
  }

  void write_tile(std::size_t i) {
    const Tile tile = grid_.tile(i);
    const std::size_t cells = tile.cells(), altitudes = request_.altitudes_m.size();
    if (with_latitude_) write_latitudes(tile);
    std::vector<signed char> state;  // [altitude][cell]; empty before the first slice
    std::vector<std::int64_t> checksums(request_.times.size() * altitudes, -1);
    // Times within tiles: a store has a tile's times together.
    for (std::size_t time = 0; time < request_.times.size(); ++time, step()) {
      const std::optional<MapSource::Slice> slice = source_.slice(i, time);
      if (!slice) continue;
      assert(slice->values.size() == layers_.size() * altitudes * cells);
      assert(slice->state.size() == altitudes * cells);
      if (state.empty()) {
        for (const CellState s : slice->state) state.push_back(static_cast<signed char>(s));
        for (std::size_t a = 0; a < altitudes; ++a) {
          file_.write(state_, {a, tile.first_row, tile.first_column}, {1, tile.rows, tile.columns},
                      state.data() + a * cells);
        }
      }
      for (std::size_t a = 0; a < altitudes; ++a) {
        std::int64_t checksum = 0;
        for (std::size_t k = 0; k < layers_.size(); ++k) {
          const std::span<const float> values(slice->values.data() + (k * altitudes + a) * cells, cells);
          file_.write(layers_[k], {time, a, tile.first_row, tile.first_column},
                      {1, 1, tile.rows, tile.columns}, values.data());
          checksum = NetcdfFile::checksum(std::as_bytes(values), checksum);
        }
        checksums[time * altitudes + a] =
            NetcdfFile::checksum(std::as_bytes(std::span(state).subspan(a * cells, cells)), checksum);
      }
    }
    file_.write(checksum_, {i, 0, 0}, {1, request_.times.size(), altitudes}, checksums.data());
  }

  void step() {
    if (source_.progress) source_.progress(++done_, steps_);
  }

  /// Sets the storage of a variable over (y, x) with `outer` dimensions before them.
  void store_by_tile(int variable, std::size_t outer, std::size_t value_size) {
    std::vector<std::size_t> chunk(outer, 1);
    chunk.push_back(std::min(grid_.tile_size, grid_.rows));
    chunk.push_back(std::min(grid_.tile_size, grid_.columns));
    // Chunks are written completely, one after the other.
    file_.set_storage(variable, chunk, chunk[outer] * chunk[outer + 1] * value_size);
  }

  const MapSource& source_;
  const Request& request_;
  const Grid& grid_;
  NetcdfFile file_;
  bool with_latitude_ = false;
  std::size_t done_ = 0, steps_ = 0;
  int time_dim_ = 0, altitude_dim_ = 0, y_dim_ = 0, x_dim_ = 0;
  int time_ = 0, gps_time_ = 0, altitude_ = 0, y_ = 0, x_ = 0, y_bounds_ = 0, x_bounds_ = 0;
  int latitude_ = 0, longitude_ = 0, state_ = 0, checksum_ = 0;
  std::vector<int> layers_;
};

}  // namespace

void write_netcdf(const std::filesystem::path& path, const MapSource& source) {
  assert(source.request != nullptr && source.slice && !source.request->times.empty() &&
         !source.request->altitudes_m.empty() && source.request->grid.cells() > 0);
  OutputFile file(path);
  NetcdfWriter(file.external_path(), path, source).write();
  file.commit();
}

}  // namespace canyon::heatmap
