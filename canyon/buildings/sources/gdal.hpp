#pragma once

#include <cpl_conv.h>
#include <cpl_error.h>
#include <gdal.h>
#include <ogr_srs_api.h>

#include <algorithm>
#include <memory>
#include <string>
#include <type_traits>

/// GDAL's C handles as owners, for the sources of this folder. Every handle is used by one thread at a time.
namespace canyon::buildings::gdal {

struct CloseDataset {
  void operator()(GDALDatasetH dataset) const { GDALClose(dataset); }
};
using Dataset = std::unique_ptr<std::remove_pointer_t<GDALDatasetH>, CloseDataset>;

struct ReleaseReference {
  void operator()(OGRSpatialReferenceH reference) const { OSRRelease(reference); }
};
using SpatialReference = std::unique_ptr<std::remove_pointer_t<OGRSpatialReferenceH>, ReleaseReference>;

struct DestroyTransformation {
  void operator()(OGRCoordinateTransformationH transformation) const {
    OCTDestroyCoordinateTransformation(transformation);
  }
};
using Transformation =
    std::unique_ptr<std::remove_pointer_t<OGRCoordinateTransformationH>, DestroyTransformation>;

/// While it lives, GDAL and PROJ print nothing on this thread; message() has their text.
class Quiet {
 public:
  Quiet() {
    CPLPushErrorHandler(CPLQuietErrorHandler);
    CPLErrorReset();
  }
  ~Quiet() { CPLPopErrorHandler(); }
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

  /// The last error in one line of at most 200 characters; empty where there was none.
  [[nodiscard]] std::string message() const {
    std::string text = CPLGetLastErrorMsg();
    text.resize(std::min(text.find_first_of("\r\n"), text.size()));
    if (text.size() > 200) text = text.substr(0, 197) + "...";
    return text;
  }
};

/// Any description that GDAL knows ("EPSG:7415", "EPSG:4326+5773", WKT), x east or longitude, y north or
/// latitude whatever the authority's axis order. Null where it is not known.
[[nodiscard]] inline SpatialReference spatial_reference(const std::string& text) {
  const Quiet quiet;
  SpatialReference reference(OSRNewSpatialReference(nullptr));
  if (OSRSetFromUserInput(reference.get(), text.c_str()) != OGRERR_NONE) return nullptr;
  OSRSetAxisMappingStrategy(reference.get(), OAMS_TRADITIONAL_GIS_ORDER);
  return reference;
}

/// The horizontal part alone, x east or longitude, y north or latitude.
[[nodiscard]] inline SpatialReference horizontal_part(OGRSpatialReferenceH whole) {
  SpatialReference reference(OSRClone(whole));
  OSRStripVertical(reference.get());
  OSRDemoteTo2D(reference.get(), nullptr);
  OSRSetAxisMappingStrategy(reference.get(), OAMS_TRADITIONAL_GIS_ORDER);
  return reference;
}

/// Null where PROJ has no way. Without `ballpark`, ways that leave out a datum shift or a geoid, because its
/// grid is not installed, count as none: PROJ would take them in silence.
[[nodiscard]] inline Transformation transformation(OGRSpatialReferenceH from, OGRSpatialReferenceH to,
                                                   bool ballpark) {
  const Quiet quiet;
  OGRCoordinateTransformationOptionsH options = OCTNewCoordinateTransformationOptions();
  OCTCoordinateTransformationOptionsSetBallparkAllowed(options, ballpark ? 1 : 0);
  Transformation result(OCTNewCoordinateTransformationEx(from, to, options));
  OCTDestroyCoordinateTransformationOptions(options);
  return result;
}

}  // namespace canyon::buildings::gdal
