#include "canyon/city/buildings/sources/raster.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <mutex>
#include <system_error>
#include <utility>
#include <vector>

#include "canyon/base/gzip_file.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/input_files.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/buildings/sources/gdal.hpp"
#include "canyon/city/buildings/sources/geoid.hpp"

namespace canyon::buildings {
namespace {

/// Blocks network access for files next to a raster and files that it references.
struct NoServers : gdal::ThreadOption {
  NoServers() : ThreadOption("CPL_VSIL_CURL_ALLOWED_FILENAME", "none") {}
};

/// Metres of one unit of a band (GDALRasterBand::GetUnitType); empty if the band names none.
std::optional<double> metres_of_band(const std::string& unit, const std::filesystem::path& path) {
  if (unit.empty()) return std::nullopt;
  if (const auto metres = metres_of_unit(lower_case(unit))) return metres;
  throw InputError(path, 0, fmt::format("its band 1 is in \"{}\", which is not a known unit of length", unit),
                   "set the band's unit to metres or feet, or use a height raster");
}

constexpr double kMetresPerDegree = 111'320;  // of latitude

/// Plausible heights of ground above sea level: the lowest shore is at -430 m, the highest summit at 8,849 m.
/// Others are fill values that the raster does not declare.
bool is_possible(double height_m) {
  return height_m >= -500 && height_m <= 9000;
}

}  // namespace

struct Raster::Impl {
  std::filesystem::path path;
  gdal::Dataset dataset;
  GDALRasterBandH band = nullptr;
  GDALRasterBandH mask = nullptr;  ///< null if every pixel counts
  int width = 0;
  int height = 0;
  bool degrees = false;                    ///< geographic: x is modulo 360 deg
  std::array<double, 6> pixel_from_map{};  ///< GDAL's affine order; pixel corners are whole numbers
  double first_x = 0, last_x = 0;          ///< bounds of x
  double factor = 1, addend_m = 0;         ///< metres = value * factor + addend
  gdal::Transformation map_from_wgs84;     ///< null if the raster is in longitude and latitude of WGS 84
  std::optional<Geoid> geoid;
  ReadReport notes;
  mutable std::mutex mutex;  ///< guards the handles of GDAL and PROJ, and the next member
  mutable std::map<std::pair<int, int>, std::optional<double>> impossible;  ///< pixels: replacements
  mutable double first_impossible_m = 0;
  double post_spacing_m = 0;  ///< the smaller of both directions

  void open();
  void georeference(const TerrainOptions& options);
  void read_band();
  /// [m], before the geoid; the caller holds the mutex.
  std::optional<double> sample(double x, double y) const;
  /// Pixels of a window [m], row by row; NaN if there is no data.
  std::vector<double> window(int left, int top, int columns, int rows) const {
    return values({left, top, columns, rows}, columns, rows);
  }
  struct Window {
    int left = 0, top = 0, columns = 0, rows = 0;
  };
  /// `columns` x `rows` of the pixels of a window.
  std::vector<double> values(const Window& of, int columns, int rows) const;
  std::optional<double> instead_of_impossible(int column, int row) const;
};

void Raster::Impl::open() {
  // Only formats with heights: the content of others (VRT, WMS) may reference files and servers. Others are
  // not even registered, because any registered driver opens files next to a raster.
  static std::once_flag registered;
  std::call_once(registered, [] {
    for (void (*add)() :
         std::initializer_list<void (*)()>{GDALRegister_GTiff, GDALRegister_SRTMHGT, GDALRegister_DTED,
                                           GDALRegister_AAIGrid, GDALRegister_AIGrid, GDALRegister_HFA,
                                           GDALRegister_EHdr, GDALRegister_USGSDEM, GDALRegister_XYZ})
      add();
  });
  const std::array<const char*, 10> kDrivers{"GTiff", "SRTMHGT", "DTED",    "AAIGrid", "AIG",
                                             "HFA",   "EHdr",    "USGSDEM", "XYZ",     nullptr};
  std::error_code ignored;
  // Some rasters are folders.
  std::filesystem::is_directory(path, ignored) ? InputFiles::current().add(path) : check_input_file(path);
  const gdal::Quiet quiet;
  // Without this option some drivers drop the vertical part of the reference system.
  const gdal::ThreadOption geotiff("GTIFF_REPORT_COMPD_CS", "YES");
  const gdal::ThreadOption others("REPORT_COMPD_CS", "YES");
  // Integers have no NaN: GDAL would read 0.
  const gdal::ThreadOption ascii("AAIGRID_DATATYPE", "Float64");
  dataset.reset(GDALOpenEx(path.string().c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY | GDAL_OF_VERBOSE_ERROR,
                           kDrivers.data(), nullptr, nullptr));
  if (!dataset) {
    throw InputError(path, 0, fmt::format("not a raster that GDAL can read ({})", quiet.message()),
                     "give GeoTIFF, SRTM .hgt, DTED, an Arc/Info grid, .img, .bil, USGS DEM or .xyz; "
                     "convert others to GeoTIFF with gdal_translate");
  }
}

void Raster::Impl::read_band() {
  width = GDALGetRasterXSize(dataset.get());
  height = GDALGetRasterYSize(dataset.get());
  if (GDALGetRasterCount(dataset.get()) < 1 || width < 1 || height < 1)
    throw InputError(path, 0, "has no raster band", "give a height raster, heights in band 1");
  band = GDALGetRasterBand(dataset.get(), 1);
  const GDALColorInterp colour = GDALGetRasterColorInterpretation(band);
  if ((colour != GCI_GrayIndex && colour != GCI_Undefined) ||
      GDALDataTypeIsComplex(GDALGetRasterDataType(band))) {
    throw InputError(
        path, 0,
        fmt::format("its band 1 is a picture ({}), not heights", GDALGetColorInterpretationName(colour)),
        "give a height raster, heights in band 1");
  }
  // Files may declare blocks and pixels that they do not store (sparse), or that are highly compressed:
  // deflate, a thousand to one.
  int block_width = 0, block_height = 0;
  GDALGetBlockSize(band, &block_width, &block_height);
  const double pixel = GDALGetDataTypeSizeBytes(GDALGetRasterDataType(band));
  double stored = 0;
  char** const files = GDALGetFileList(dataset.get());
  for (char** file = files; file != nullptr && *file != nullptr; ++file) {
    std::error_code unknown;
    const std::uintmax_t size = std::filesystem::file_size(*file, unknown);
    if (!unknown) stored += static_cast<double>(size);
  }
  CSLDestroy(files);
  if (pixel * block_width * block_height > std::max(64e6, 1000 * stored) ||
      pixel * width * height > std::max(1.1e9, 10'000 * stored)) {
    throw InputError(path, 0,
                     fmt::format("{:.0f} bytes declare {} x {} pixels in blocks of {} x {}", stored, width,
                                 height, block_width, block_height),
                     "cut out the part with the city by gdal_translate -projwin, with -co TILED=YES");
  }
  if ((GDALGetMaskFlags(band) & GMF_ALL_VALID) == 0) mask = GDALGetMaskBand(band);
}

void Raster::Impl::georeference(const TerrainOptions& options) {
  std::array<double, 6> map_from_pixel{};
  if (GDALGetGeoTransform(dataset.get(), map_from_pixel.data()) != CE_None) {
    throw InputError(path, 0, "has no georeference (no affine transform from pixels)",
                     "warp it to a map projection first, e.g. with gdalwarp");
  }
  if (GDALInvGeoTransform(map_from_pixel.data(), pixel_from_map.data()) == 0)
    throw InputError(path, 0, "its georeference cannot be inverted", "correct its affine transform");
  for (const double column : {0.0, static_cast<double>(width)}) {
    for (const double row : {0.0, static_cast<double>(height)}) {
      const double x = map_from_pixel[0] + column * map_from_pixel[1] + row * map_from_pixel[2];
      const bool first = column == 0 && row == 0;
      first_x = first ? x : std::min(first_x, x);
      last_x = first ? x : std::max(last_x, x);
    }
  }
  const OGRSpatialReferenceH reference = GDALGetSpatialRef(dataset.get());
  if (reference == nullptr || OSRIsLocal(reference) != 0) {
    throw InputError(path, 0, "names no coordinate reference system",
                     "name it, e.g. with gdal_edit.py -a_srs EPSG:4326");
  }
  const gdal::SpatialReference map = gdal::horizontal_part(reference);
  const gdal::SpatialReference wgs84 = gdal::spatial_reference("EPSG:4326");
  degrees = OSRIsGeographic(map.get()) != 0;
  if (OSRIsSame(map.get(), wgs84.get()) == 0) {
    map_from_wgs84 =
        gdal::best_transformation(wgs84.get(), map.get(), path, "from WGS 84 to its horizontal datum", notes);
  }

  Geoid::Heights heights;
  heights.file = path;
  heights.reference = reference;
  const std::string driver = GDALGetDriverShortName(GDALGetDatasetDriver(dataset.get()));
  const double unit_m = degrees ? kMetresPerDegree : OSRGetLinearUnits(map.get(), nullptr);
  post_spacing_m = unit_m * std::min(std::hypot(map_from_pixel[1], map_from_pixel[4]),
                                     std::hypot(map_from_pixel[2], map_from_pixel[5]));
  // SRTM: heights above EGM96 (USGS, SRTM collection user guide, section 3.0); DTED: above mean sea level of
  // EGM96 (MIL-PRF-89020B, 3.5).
  if (driver == "SRTMHGT" || driver == "DTED") heights.prescribed = "EPSG:4326+5773";
  const char* unit = GDALGetRasterUnitType(band);
  heights.metres_per_unit = metres_of_band(unit != nullptr ? unit : "", path);
  heights.options = options;
  geoid.emplace(heights);
  geoid->add_line(notes);

  const double metres = geoid->metres_per_unit();
  int has = 0;
  const double scale = GDALGetRasterScale(band, &has);
  factor = (has != 0 ? scale : 1.0) * metres;
  const double offset = GDALGetRasterOffset(band, &has);
  addend_m = (has != 0 ? offset : 0.0) * metres;
}

std::optional<double> Raster::Impl::sample(double x, double y) const {
  const double column = pixel_from_map[0] + x * pixel_from_map[1] + y * pixel_from_map[2];
  const double row = pixel_from_map[3] + x * pixel_from_map[4] + y * pixel_from_map[5];
  // Rounding of the projection must not open a gap between adjacent tiles: a millionth of a pixel.
  constexpr double kEdge = 1e-6;
  if (!(column >= -kEdge && row >= -kEdge && column <= width + kEdge && row <= height + kEdge))
    return std::nullopt;
  const double u = std::clamp(column - 0.5, 0.0, width - 1.0);
  const double v = std::clamp(row - 0.5, 0.0, height - 1.0);
  const int left = std::min(static_cast<int>(u), std::max(width - 2, 0));
  const int top = std::min(static_cast<int>(v), std::max(height - 2, 0));
  const int columns = std::min(2, width);
  const int rows = std::min(2, height);
  const std::vector<double> heights = window(left, top, columns, rows);
  double sum = 0;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const double weight_x = columns == 1 ? 1 : i == 0 ? 1 - (u - left) : u - left;
      const double weight_y = rows == 1 ? 1 : j == 0 ? 1 - (v - top) : v - top;
      const double weight = weight_x * weight_y;
      if (weight < 1e-9) continue;  // at a pixel's centre, except for rounding
      double height_m = heights[static_cast<std::size_t>(j) * static_cast<std::size_t>(columns) +
                                static_cast<std::size_t>(i)];
      if (!std::isfinite(height_m)) return std::nullopt;
      if (!is_possible(height_m)) {
        if (impossible.empty()) first_impossible_m = height_m;
        const auto filled = instead_of_impossible(left + i, top + j);
        if (!filled) return std::nullopt;
        height_m = *filled;
      }
      sum += weight * height_m;
    }
  }
  return sum;
}

std::vector<double> Raster::Impl::values(const Window& of, int columns, int rows) const {
  const std::size_t count = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  std::vector<double> values(count);
  std::vector<std::uint8_t> valid(count, 255);
  const gdal::Quiet quiet;
  CPLErr error = GDALRasterIO(band, GF_Read, of.left, of.top, of.columns, of.rows, values.data(), columns,
                              rows, GDT_Float64, 0, 0);
  if (error == CE_None && mask != nullptr) {
    error = GDALRasterIO(mask, GF_Read, of.left, of.top, of.columns, of.rows, valid.data(), columns, rows,
                         GDT_Byte, 0, 0);
  }
  if (error != CE_None) {
    throw InputError(path, 0, fmt::format("heights cannot be read ({})", quiet.message()),
                     "is the file cut short? fetch it again");
  }
  for (std::size_t k = 0; k < count; ++k)
    values[k] = valid[k] == 0 ? std::nan("") : values[k] * factor + addend_m;
  return values;
}

// The mean of the plausible heights on the closest ring of pixels that has any.
std::optional<double> Raster::Impl::instead_of_impossible(int column, int row) const {
  const auto [known, fresh] = impossible.try_emplace({column, row});
  if (!fresh) return known->second;
  constexpr int kFarthest = 16;
  for (int ring = 1; ring <= kFarthest; ++ring) {
    const int left = std::max(0, column - ring), right = std::min(width - 1, column + ring);
    const int top = std::max(0, row - ring), bottom = std::min(height - 1, row + ring);
    double sum = 0;
    int count = 0;
    for (const double height_m : window(left, top, right - left + 1, bottom - top + 1)) {
      if (!is_possible(height_m)) continue;  // also excludes NaN
      sum += height_m;
      ++count;
    }
    if (count > 0) return known->second = sum / count;
  }
  return std::nullopt;
}

Raster::Raster(const std::filesystem::path& path, const TerrainOptions& options)
    : impl_(std::make_unique<Impl>()) {
  impl_->path = path;
  const NoServers offline;
  impl_->open();
  const gdal::Quiet quiet;
  impl_->read_band();
  impl_->georeference(options);
}
Raster::~Raster() = default;
Raster::Raster(Raster&&) noexcept = default;

RasterSummary Raster::summary() const {
  const std::lock_guard lock(impl_->mutex);
  const NoServers offline;
  RasterSummary summary;
  summary.columns = impl_->width;
  summary.rows = impl_->height;
  summary.spacing_m = impl_->post_spacing_m;
  constexpr int kMax = 256;
  const std::vector<double> heights = impl_->values(
      {0, 0, impl_->width, impl_->height}, std::min(impl_->width, kMax), std::min(impl_->height, kMax));
  std::size_t empty = 0;
  for (const double height_m : heights) {
    if (!is_possible(height_m)) {  // also excludes NaN
      ++empty;
      continue;
    }
    summary.lowest_m = std::min(summary.lowest_m.value_or(height_m), height_m);
    summary.highest_m = std::max(summary.highest_m.value_or(height_m), height_m);
  }
  summary.empty_fraction = static_cast<double>(empty) / static_cast<double>(heights.size());
  std::array<double, 6> map_from_pixel{};
  GDALGetGeoTransform(impl_->dataset.get(), map_from_pixel.data());
  double x = 0, y = 0;
  GDALApplyGeoTransform(map_from_pixel.data(), 0.5 * impl_->width, 0.5 * impl_->height, &x, &y);
  if (impl_->map_from_wgs84) {
    const gdal::Quiet quiet;
    const gdal::SpatialReference map = gdal::horizontal_part(GDALGetSpatialRef(impl_->dataset.get()));
    const gdal::SpatialReference wgs84 = gdal::spatial_reference("EPSG:4326");
    const gdal::Transformation back = gdal::transformation(map.get(), wgs84.get(), true);
    int ok = 0;
    if (!back || OCTTransformEx(back.get(), 1, &x, &y, nullptr, &ok) == 0 || ok == 0) return summary;
  }
  summary.middle = LonLat(longitude_near(x, 0), y);
  return summary;
}

ReadReport Raster::notes() const {
  const std::lock_guard lock(impl_->mutex);
  const std::string name = impl_->path.filename().string();
  ReadReport notes = impl_->notes;
  if (!impl_->impossible.empty()) {
    notes.add_line(
        ReadReport::Level::Loss,
        fmt::format("{}: {} of the posts in use are outside -500 to 9,000 m (such as {:g} m) and are not "
                    "ground: filled from those around; declare the no-data value, e.g. with gdal_edit.py "
                    "-a_nodata",
                    name, impl_->impossible.size(), impl_->first_impossible_m));
  }
  return notes;
}

std::optional<double> Raster::geoid_undulation_m(const LonLat& point) const {
  if (!impl_->geoid->above_sea_level()) return std::nullopt;
  return impl_->geoid->undulation_m(point);
}

std::optional<double> Raster::height_m(const LonLat& point) const {
  if (!std::isfinite(point.x()) || !std::isfinite(point.y())) return std::nullopt;
  std::optional<double> height;
  {
    const std::lock_guard lock(impl_->mutex);
    double x = longitude_near(point.x(), 0);
    double y = point.y();
    if (impl_->map_from_wgs84) {
      const gdal::Quiet quiet;
      int ok = 0;
      if (OCTTransformEx(impl_->map_from_wgs84.get(), 1, &x, &y, nullptr, &ok) == 0 || ok == 0)
        return std::nullopt;  // outside the projection's range
    }
    if (impl_->degrees) x = longitude_near(x, 0.5 * (impl_->first_x + impl_->last_x));
    height = impl_->sample(x, y);
  }
  if (height) *height += impl_->geoid->undulation_m(point);
  return height;
}

}  // namespace canyon::buildings
