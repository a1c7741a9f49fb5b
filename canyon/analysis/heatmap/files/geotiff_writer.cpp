#include "canyon/analysis/heatmap/files/geotiff_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>
#include <mutex>
#include <system_error>

#include "canyon/analysis/heatmap/files/map_reference.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/city/buildings/sources/gdal.hpp"

namespace canyon::heatmap {
namespace {

namespace gdal = buildings::gdal;
namespace fs = std::filesystem;

/// During its lifetime, GDAL prints nothing on this thread, and its first reported failure is kept: some are
/// reported in no other way (GDALClose() has no result up to GDAL 3.6).
class Failures {
 public:
  Failures() { CPLPushErrorHandlerEx(&Failures::take, this); }
  ~Failures() { CPLPopErrorHandler(); }
  Failures(const Failures&) = delete;
  Failures& operator=(const Failures&) = delete;

  /// Throws OutputError with `path` if anything has failed, or if `ok` is false.
  void check(bool ok, const fs::path& path) const {
    if (ok && first_.empty()) return;
    std::error_code unknown;
    const fs::space_info space = fs::space(path.parent_path().empty() ? "." : path.parent_path(), unknown);
    const bool full = !unknown && space.available < (1U << 20);
    throw OutputError(
        path, 0, "cannot be written: " + (first_.empty() ? "GDAL gives no reason" : first_),
        full ? "free disk space and run again" : "check free space and permissions of the disk");
  }

 private:
  static void CPL_STDCALL take(CPLErr level, CPLErrorNum /*number*/, const char* message) {
    auto* self = static_cast<Failures*>(CPLGetErrorHandlerUserData());
    if (level < CE_Failure || !self->first_.empty()) return;
    self->first_ = gdal::short_line(message);
    if (self->first_.empty()) self->first_ = "unnamed failure of GDAL";
  }

  std::string first_;
};

using Strings = std::vector<const char*>;  ///< for GDAL: null-terminated

class GeotiffWriter {
 public:
  GeotiffWriter(const fs::path& folder, const MapSource& source)
      : folder_(folder),
        source_(source),
        request_(*source.request),
        grid_(request_.grid),
        work_(folder / ".canyon-geotiff", Temporary::Kind::Folder),
        wkt_(projection_wkt(source.frame, "WKT2")),
        decimals_(second_decimals(request_.times)),
        names_(geotiff_names(request_)) {
    for (const std::string& name : names_) ResultFiles::refuse(folder_ / name);
    static std::once_flag registered;
    // Only the drivers that the writer needs: registered drivers also open files next to a terrain's rasters.
    std::call_once(registered, [] {
      for (void (*add)() : std::initializer_list<void (*)()>{GDALRegister_GTiff, GDALRegister_COG,
                                                             GDALRegister_VRT, GDALRegister_MEM})
        add();
    });
    if (GDALGetDriverByName("COG") == nullptr)
      throw InputError("this GDAL has no driver for Cloud Optimized GeoTIFF", "install GDAL 3.1 or later");
    constexpr std::uint32_t kMax = std::numeric_limits<int>::max();
    if (grid_.columns > kMax || grid_.rows > kMax) {
      throw InputError(fmt::format("a GeoTIFF cannot have {} x {} cells", grid_.columns, grid_.rows),
                       "use a coarser spacing or a smaller area, or write NetCDF");
    }
    steps_ = request_.times.size() * (grid_.tile_count() + bands());
  }

  std::vector<std::string> write() {
    for (std::size_t time = 0; time < request_.times.size(); ++time) {
      gather(time);
      publish(time);
    }
    for (const std::string& name : names_) {
      ResultFiles::note(folder_ / name);
      std::error_code error;
      fs::rename(work_.temporary_path() / name, folder_ / name, error);
      if (error) throw InputError(folder_ / name, 0, "cannot be renamed: " + error.message());
    }
    return names_;
  }

 private:
  [[nodiscard]] const std::string& name(std::size_t layer, std::size_t altitude, std::size_t time) const {
    return names_[(time * request_.layers.size() + layer) * request_.altitudes_m.size() + altitude];
  }
  [[nodiscard]] std::size_t bands() const { return request_.layers.size() * request_.altitudes_m.size(); }
  [[nodiscard]] fs::path gathered() const { return work_.temporary_path() / "values.tif"; }

  /// Values of one time, a band for each layer and altitude. COGs are made from whole rasters; this
  /// uncompressed one can be written by tiles in any order.
  void gather(std::size_t time) {
    const Failures failures;
    const Strings options{"TILED=YES",      "BLOCKXSIZE=256",   "BLOCKYSIZE=256", "INTERLEAVE=BAND",
                          "SPARSE_OK=TRUE", "BIGTIFF=IF_SAFER", nullptr};
    gdal::Dataset dataset(GDALCreate(GDALGetDriverByName("GTiff"), gathered().c_str(),
                                     static_cast<int>(grid_.columns), static_cast<int>(grid_.rows),
                                     static_cast<int>(bands()), GDT_Float32, options.data()));
    failures.check(dataset != nullptr, folder_);
    std::array<double, 6> map_from_pixel{grid_.west_m,    grid_.spacing_m, 0, grid_.north_m(), 0,
                                         -grid_.spacing_m};
    failures.check(GDALSetGeoTransform(dataset.get(), map_from_pixel.data()) == CE_None, folder_);
    failures.check(GDALSetProjection(dataset.get(), wkt_.c_str()) == CE_None, folder_);
    // All bands of a TIFF have one nodata value, also for cells that are never written.
    failures.check(GDALSetRasterNoDataValue(GDALGetRasterBand(dataset.get(), 1),
                                            std::numeric_limits<double>::quiet_NaN()) == CE_None,
                   folder_);
    for (std::size_t tile = 0; tile < grid_.tile_count(); ++tile) {
      put(dataset.get(), tile, time, failures);
      step();
    }
    dataset.reset();
    failures.check(true, folder_);
  }

  void publish(std::size_t time) {
    const Failures failures;
    const gdal::Dataset values(GDALOpen(gathered().c_str(), GA_ReadOnly));
    failures.check(values != nullptr, folder_);
    for (std::size_t layer = 0; layer < request_.layers.size(); ++layer) {
      for (std::size_t altitude = 0; altitude < request_.altitudes_m.size(); ++altitude) {
        write_one(values.get(), layer, altitude, time);
        step();
      }
    }
  }

  void put(GDALDatasetH dataset, std::size_t i, std::size_t time, const Failures& failures) {
    const std::optional<MapSource::Slice> slice = source_.slice(i, time);
    if (!slice) return;
    const Tile tile = grid_.tile(i);
    assert(slice->values.size() == bands() * tile.cells());
    rows_.resize(tile.cells());
    for (std::size_t band = 0; band < bands(); ++band) {
      // Rows of a picture start in the north.
      const float* values = slice->values.data() + band * tile.cells();
      for (std::size_t r = 0; r < tile.rows; ++r) {
        std::copy_n(values + (tile.rows - 1 - r) * tile.columns, tile.columns,
                    rows_.begin() + r * tile.columns);
      }
      const CPLErr error = GDALRasterIO(
          GDALGetRasterBand(dataset, static_cast<int>(band) + 1), GF_Write,
          static_cast<int>(tile.first_column), static_cast<int>(grid_.rows - tile.first_row - tile.rows),
          static_cast<int>(tile.columns), static_cast<int>(tile.rows), rows_.data(),
          static_cast<int>(tile.columns), static_cast<int>(tile.rows), GDT_Float32, 0, 0);
      failures.check(error == CE_None, folder_);
    }
  }

  void write_one(GDALDatasetH values, std::size_t layer, std::size_t altitude, std::size_t time) {
    const Failures failures;
    const std::string file = name(layer, altitude, time);
    const fs::path shown = folder_ / file;
    const std::string band = std::to_string(layer * request_.altitudes_m.size() + altitude + 1);
    const Strings arguments{"-of", "VRT", "-b", band.c_str(), "-mo", "AREA_OR_POINT=Area", nullptr};
    GDALTranslateOptions* choice = GDALTranslateOptionsNew(const_cast<char**>(arguments.data()), nullptr);
    // A name without a folder: the VRT stays in memory.
    const gdal::Dataset one(GDALTranslate("", values, choice, nullptr));
    GDALTranslateOptionsFree(choice);
    failures.check(one != nullptr, shown);
    const LayerInfo& about = info(request_.layers[layer]);
    const GDALRasterBandH only = GDALGetRasterBand(one.get(), 1);
    GDALSetDescription(only, std::string(about.long_name).c_str());
    GDALSetRasterUnitType(only, std::string(about.unit).c_str());
    const auto tag = [&one](const char* key, const std::string& value) {
      if (!value.empty()) GDALSetMetadataItem(one.get(), key, value.c_str(), nullptr);
    };
    tag("title", source_.title);
    tag("source", source_.source);
    tag("history", source_.history);
    for (const auto& [key, value] : source_.attributes) tag(key.c_str(), value);
    tag("layer", std::string(about.name));
    tag("comment", limits_text(about.layer, request_.limits));
    tag("over_runs", source_.over_runs);
    tag("time", geodesy::format_utc(request_.times[time], decimals_));
    tag("altitude_m", fmt::format("{}", request_.altitudes_m[altitude]));
    tag("altitude_above", request_.altitude_kind == AltitudeKind::Ellipsoid ? "WGS 84 ellipsoid" : "terrain");

    const Strings options{"COMPRESS=DEFLATE", "PREDICTOR=YES", "RESAMPLING=AVERAGE", "BIGTIFF=IF_SAFER",
                          nullptr};
    gdal::Dataset cog(GDALCreateCopy(GDALGetDriverByName("COG"), (work_.temporary_path() / file).c_str(),
                                     one.get(), 0, options.data(), nullptr, nullptr));
    failures.check(cog != nullptr, shown);
    cog.reset();
    failures.check(true, shown);
  }

  void step() {
    if (source_.progress) source_.progress(++done_, steps_);
  }

  fs::path folder_;
  const MapSource& source_;
  const Request& request_;
  const Grid& grid_;
  Temporary work_;
  std::string wkt_;
  int decimals_ = 0;
  std::size_t done_ = 0, steps_ = 0;
  std::vector<std::string> names_;
  std::vector<float> rows_;
};

}  // namespace

std::vector<std::string> geotiff_names(const Request& request) {
  const int decimals = second_decimals(request.times);
  std::vector<std::string> names;
  for (const geodesy::GpsTime time : request.times) {
    for (const Layer layer : request.layers) {
      for (const double altitude_m : request.altitudes_m) {
        std::string text(info(layer).name);
        if (request.altitudes_m.size() > 1) text += fmt::format("_a{}m", altitude_m);
        if (request.times.size() > 1) text += "_t" + compact_utc(time, decimals);
        names.push_back(text + ".tif");
      }
    }
  }
  return names;
}

std::vector<std::string> write_geotiffs(const fs::path& folder, const MapSource& source) {
  assert(source.request != nullptr && source.slice && !source.request->times.empty() &&
         !source.request->altitudes_m.empty() && source.request->grid.cells() > 0);
  if (source.request->layers.empty()) return {};
  make_output_folder(folder);
  return GeotiffWriter(folder, source).write();
}

}  // namespace canyon::heatmap
