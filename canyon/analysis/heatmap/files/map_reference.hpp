#pragma once

#include <string>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/geodesy/gps_time.hpp"

// Names, projection and times of map files.

/// Names that write_netcdf() and StoredMap have in common.
namespace canyon::heatmap::layout {

inline constexpr int kVersion = 1;  ///< version of `canyon_map`; a reader rejects later ones
inline constexpr const char* kMapVersion = "canyon_map";
// The exact grid; x and y are cell centres.
inline constexpr const char* kWest = "canyon_grid_west_m";
inline constexpr const char* kSouth = "canyon_grid_south_m";
inline constexpr const char* kSpacing = "canyon_grid_spacing_m";
inline constexpr const char* kTileSize = "canyon_grid_tile_size";
// The city's frame.
inline constexpr const char* kLatitude = "canyon_origin_latitude_deg";
inline constexpr const char* kLongitude = "canyon_origin_longitude_deg";
inline constexpr const char* kHeight = "canyon_origin_height_m";
inline constexpr const char* kHeading = "canyon_origin_heading_deg";
inline constexpr const char* kAltitudeKind = "canyon_altitude_kind";
inline constexpr const char* kAboveTerrain = "above_terrain";
inline constexpr const char* kEllipsoid = "ellipsoid";

inline constexpr const char* kTime = "time";
inline constexpr const char* kGpsTime = "gps_time";
inline constexpr const char* kAltitude = "altitude";
inline constexpr const char* kY = "y";
inline constexpr const char* kX = "x";
inline constexpr const char* kState = "cell_state";
inline constexpr signed char kNotComputed = -1;
inline constexpr const char* kTile = "tile";
inline constexpr const char* kChecksum = "tile_crc32";  ///< (tile, time, altitude); negative: not computed

}  // namespace canyon::heatmap::layout

namespace canyon::heatmap {

/// The coordinate system of projection(), named, on the geographic system EPSG:4326, as WKT for GDAL's
/// `format`: "WKT2", "WKT1_GDAL". Throws InputError if PROJ rejects it (proj.db missing). Part of canyon::io.
[[nodiscard]] std::string projection_wkt(const geodesy::LocalFrame& frame, const std::string& format);

/// Number of decimals of the second, at most 9, with which all times are exact.
[[nodiscard]] int second_decimals(const std::vector<geodesy::GpsTime>& times);
/// "20190428T125803Z", with a fraction only if there is one: for names of files.
/// @param decimals of all times: second_decimals()
[[nodiscard]] std::string compact_utc(geodesy::GpsTime t, int decimals);

}  // namespace canyon::heatmap
