#pragma once

#include <cpl_conv.h>
#include <cpl_string.h>
#include <gdal.h>
#include <gdal_frmts.h>
#include <gdal_utils.h>
#include <ogr_srs_api.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <type_traits>

#include "canyon/base/input_error.hpp"
#include "canyon/city/buildings/sources/map_data.hpp"
#include "canyon/city/buildings/sources/model_kind.hpp"

namespace canyon {

/// The address of a function of GDAL's shared library, which the first call loads: with its dependencies it
/// is a hundred libraries, and most runs do not use it. Throws InputError if it is not installed.
[[nodiscard]] void* gdal_function(const char* name);

// These hide GDAL's own declarations in this namespace. Other functions do not link.
// clang-format off
#define CANYON_GDAL_FUNCTIONS(X) \
  X(CPLErrorReset) X(CPLGetErrorHandlerUserData) X(CPLGetLastErrorMsg) X(CPLPopErrorHandler) \
  X(CPLPushErrorHandler) X(CPLPushErrorHandlerEx) X(CPLQuietErrorHandler) X(CPLSetThreadLocalConfigOption) \
  X(CSLDestroy) X(GDALApplyGeoTransform) X(GDALClose) X(GDALCreate) X(GDALCreateCopy) \
  X(GDALDataTypeIsComplex) X(GDALGetBlockSize) X(GDALGetColorInterpretationName) X(GDALGetDataTypeSizeBytes) \
  X(GDALGetDatasetDriver) X(GDALGetDriverByName) X(GDALGetDriverShortName) X(GDALGetFileList) \
  X(GDALGetGeoTransform) X(GDALGetMaskBand) X(GDALGetMaskFlags) X(GDALGetRasterBand) \
  X(GDALGetRasterColorInterpretation) X(GDALGetRasterCount) X(GDALGetRasterDataType) X(GDALGetRasterOffset) \
  X(GDALGetRasterScale) X(GDALGetRasterUnitType) X(GDALGetRasterXSize) X(GDALGetRasterYSize) \
  X(GDALGetSpatialRef) X(GDALInvGeoTransform) X(GDALOpen) X(GDALOpenEx) X(GDALRasterIO) \
  X(GDALRegister_AAIGrid) X(GDALRegister_AIGrid) X(GDALRegister_COG) X(GDALRegister_DTED) \
  X(GDALRegister_EHdr) X(GDALRegister_GTiff) X(GDALRegister_HFA) X(GDALRegister_MEM) X(GDALRegister_SRTMHGT) \
  X(GDALRegister_USGSDEM) X(GDALRegister_VRT) X(GDALRegister_XYZ) X(GDALSetDescription) \
  X(GDALSetGeoTransform) X(GDALSetMetadataItem) X(GDALSetProjection) X(GDALSetRasterNoDataValue) \
  X(GDALSetRasterUnitType) X(GDALTranslate) X(GDALTranslateOptionsFree) X(GDALTranslateOptionsNew) \
  X(OCTCoordinateTransformationOptionsSetBallparkAllowed) X(OCTDestroyCoordinateTransformation) \
  X(OCTDestroyCoordinateTransformationOptions) X(OCTNewCoordinateTransformationEx) \
  X(OCTNewCoordinateTransformationOptions) X(OCTTransformEx) X(OSRClone) X(OSRCopyGeogCSFrom) \
  X(OSRDemoteTo2D) X(OSRExportToWktEx) X(OSRGetAreaOfUse) X(OSRGetAttrValue) X(OSRGetAuthorityCode) \
  X(OSRGetAuthorityName) X(OSRGetAxesCount) X(OSRGetAxis) X(OSRGetLinearUnits) X(OSRGetName) \
  X(OSRGetTargetLinearUnits) X(OSRIsCompound) X(OSRIsGeographic) X(OSRIsLocal) X(OSRIsProjected) \
  X(OSRIsSame) X(OSRNewSpatialReference) X(OSRRelease) X(OSRSetAttrValue) X(OSRSetAxisMappingStrategy) \
  X(OSRSetFromUserInput) X(OSRStripVertical) X(VSIFCloseL) X(VSIFOpenL) X(VSIFReadL) X(VSIFree) \
  X(VSIReadDirRecursive) X(VSIStatL)
// clang-format on
#define CANYON_GDAL_FUNCTION(name)                                                          \
  inline constexpr auto name = [](auto... arguments) {                                      \
    static const auto function = reinterpret_cast<decltype(&::name)>(gdal_function(#name)); \
    return function(arguments...);                                                          \
  };
CANYON_GDAL_FUNCTIONS(CANYON_GDAL_FUNCTION)
#undef CANYON_GDAL_FUNCTION
#undef CANYON_GDAL_FUNCTIONS

}  // namespace canyon

/// RAII owners of GDAL's C handles, for the sources of this folder. Use each handle on one thread at a time.
namespace canyon::buildings::gdal {

template <const auto& close>
struct Close {
  template <typename Handle>
  void operator()(Handle handle) const {
    close(handle);
  }
};
template <typename Handle, const auto& close>
using Owner = std::unique_ptr<std::remove_pointer_t<Handle>, Close<close>>;
using Dataset = Owner<GDALDatasetH, GDALClose>;
using SpatialReference = Owner<OGRSpatialReferenceH, OSRRelease>;
using Transformation = Owner<OGRCoordinateTransformationH, OCTDestroyCoordinateTransformation>;

/// The first line of a message, at most 200 characters.
[[nodiscard]] inline std::string short_line(std::string text) {
  text.resize(std::min(text.find_first_of("\r\n"), text.size()));
  if (text.size() > 200) text = text.substr(0, 197) + "...";
  return text;
}

/// During its lifetime GDAL and PROJ print nothing on this thread; message() has their text.
class Quiet {
 public:
  Quiet() {
    CPLPushErrorHandler(CPLQuietErrorHandler);
    CPLErrorReset();
  }
  ~Quiet() { CPLPopErrorHandler(); }
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

  /// The last error; empty if there was none.
  [[nodiscard]] std::string message() const { return short_line(CPLGetLastErrorMsg()); }
};

/// During its lifetime a GDAL option has this value on this thread.
class ThreadOption {
 public:
  ThreadOption(const char* name, const char* value) : name_(name) {
    CPLSetThreadLocalConfigOption(name, value);
  }
  ~ThreadOption() { CPLSetThreadLocalConfigOption(name_, nullptr); }
  ThreadOption(const ThreadOption&) = delete;
  ThreadOption& operator=(const ThreadOption&) = delete;

 private:
  const char* name_;
};

/// The bytes of a file by its GDAL name, such as one in an archive; empty if it cannot be opened.
[[nodiscard]] inline ByteReader bytes_of(const std::string& name) {
  const Quiet quiet;
  VSILFILE* const opened = VSIFOpenL(name.c_str(), "rb");
  if (opened == nullptr) return nullptr;
  const std::shared_ptr<VSILFILE> file(opened, [](VSILFILE* f) { VSIFCloseL(f); });
  return [file](char* to, std::size_t size) {
    const Quiet silent;
    return VSIFReadL(to, 1, size, file.get());
  };
}

/// Any description that GDAL accepts ("EPSG:7415", "EPSG:4326+5773", WKT), x east or longitude, y north or
/// latitude, independent of the authority's axis order. Null if it is not known.
[[nodiscard]] inline SpatialReference spatial_reference(const std::string& text) {
  const Quiet quiet;
  SpatialReference reference(OSRNewSpatialReference(nullptr));
  if (OSRSetFromUserInput(reference.get(), text.c_str()) != OGRERR_NONE) return nullptr;
  OSRSetAxisMappingStrategy(reference.get(), OAMS_TRADITIONAL_GIS_ORDER);
  return reference;
}

/// The horizontal part, x east or longitude, y north or latitude.
[[nodiscard]] inline SpatialReference horizontal_part(OGRSpatialReferenceH whole) {
  SpatialReference reference(OSRClone(whole));
  OSRStripVertical(reference.get());
  OSRDemoteTo2D(reference.get(), nullptr);
  OSRSetAxisMappingStrategy(reference.get(), OAMS_TRADITIONAL_GIS_ORDER);
  return reference;
}

/// Null if PROJ has no operation. Without `ballpark`, operations that omit a datum shift or a geoid because
/// its grid is not installed are excluded; PROJ would use them without a message.
[[nodiscard]] inline Transformation transformation(OGRSpatialReferenceH from, OGRSpatialReferenceH to,
                                                   bool ballpark) {
  const Quiet quiet;
  OGRCoordinateTransformationOptionsH options = OCTNewCoordinateTransformationOptions();
  OCTCoordinateTransformationOptionsSetBallparkAllowed(options, ballpark ? 1 : 0);
  Transformation result(OCTNewCoordinateTransformationEx(from, to, options));
  OCTDestroyCoordinateTransformationOptions(options);
  return result;
}

/// The exact operation; else, with a note, one that treats the datums as equal. Throws InputError with `file`
/// if PROJ has none. @param way for messages: "from X to Y"
[[nodiscard]] inline Transformation best_transformation(OGRSpatialReferenceH from, OGRSpatialReferenceH to,
                                                        const std::filesystem::path& file,
                                                        const std::string& route, ReadReport& notes) {
  if (Transformation exact = transformation(from, to, false)) return exact;
  Transformation guess = transformation(from, to, true);
  if (!guess) {
    throw InputError(file, 0, "PROJ cannot transform " + route,
                     "convert it to another reference system first, rasters with gdalwarp -t_srs EPSG:4326");
  }
  notes.add_line(ReadReport::Level::Guess, file.filename().string() + ": PROJ has no exact operation " +
                                               route + "; the datums are treated as equal");
  return guess;
}

}  // namespace canyon::buildings::gdal
