#include "canyon/analysis/heatmap/files/map_reference.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

#include "canyon/analysis/heatmap/engine/map_source.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/buildings/sources/gdal.hpp"

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
  const bool known = plane && wgs84 && OSRCopyGeogCSFrom(plane.get(), wgs84.get()) == OGRERR_NONE &&
                     OSRSetAttrValue(plane.get(), "PROJCS", "Canyon city plane") == OGRERR_NONE &&
                     OSRExportToWktEx(plane.get(), &wkt, options.data()) == OGRERR_NONE;
  const std::string result = wkt != nullptr ? wkt : "";
  CPLFree(wkt);
  if (known) return result;
  throw InputError("PROJ rejects the map's projection " + text + " (" + quiet.message() + ")",
                   "install proj-data, or move the city's origin away from the pole");
}

int second_decimals(const std::vector<geodesy::GpsTime>& times) {
  int decimals = 0;
  for (const geodesy::GpsTime t : times) {
    std::int64_t rest = t.nanoseconds() % geodesy::GpsTime::kNanosecondsPerSecond;
    int digits = rest == 0 ? 0 : 9;
    for (; digits > 0 && rest % 10 == 0; rest /= 10) --digits;
    decimals = std::max(decimals, digits);
  }
  return decimals;
}

std::string compact_utc(geodesy::GpsTime t, int decimals) {
  std::string text = geodesy::format_utc(t, decimals);
  std::erase_if(text, [](char c) { return c == '-' || c == ':'; });
  if (text.find('.') == std::string::npos) return text;
  text.resize(text.find_last_not_of("0Z") + 1);
  if (text.back() == '.') text.pop_back();
  return text + 'Z';
}

}  // namespace canyon::heatmap
