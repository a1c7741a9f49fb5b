#include "canyon/heatmap/files/map_reference.hpp"

#include <cpl_conv.h>
#include <ogr_srs_api.h>

#include <array>

#include "canyon/base/input_error.hpp"
#include "canyon/buildings/sources/gdal.hpp"
#include "canyon/heatmap/engine/map_source.hpp"

namespace canyon::heatmap {

std::string projection_wkt(const geodesy::LocalFrame& frame, const std::string& format) {
  namespace gdal = buildings::gdal;
  const gdal::Quiet quiet;
  const std::string text = projection(frame);
  const gdal::SpatialReference plane = gdal::spatial_reference(text);
  const gdal::SpatialReference wgs84 = gdal::spatial_reference("EPSG:4326");
  const std::string option = "FORMAT=" + format;
  const std::array<const char*, 2> options{option.c_str(), nullptr};
  char* wkt = nullptr;
  if (!plane || !wgs84 || OSRCopyGeogCSFrom(plane.get(), wgs84.get()) != OGRERR_NONE ||
      OSRSetAttrValue(plane.get(), "PROJCS", "Canyon city plane") != OGRERR_NONE ||
      OSRExportToWktEx(plane.get(), &wkt, options.data()) != OGRERR_NONE) {
    CPLFree(wkt);
    throw InputError("PROJ does not take the map's projection " + text + " (" + quiet.message() + ")",
                     "install proj-data, or move the city's origin away from the pole");
  }
  std::string result = wkt;
  CPLFree(wkt);
  return result;
}

}  // namespace canyon::heatmap
