#pragma once

#include <filesystem>
#include <string>

#include "canyon/city/buildings/city_builder.hpp"

namespace canyon::buildings {

/// Footprints with the heights used and their sources, for inspection on a map: a GeoJSON (RFC 7946)
/// FeatureCollection, one feature per line, in the order of `built.features`. Geometry: Polygon or
/// MultiPolygon, longitude and latitude [deg, WGS 84, 9 decimals: 0.1 mm], outer rings counter-clockwise,
/// inner ones clockwise; null if no part of the outline was usable or a building came as ready-made surfaces
/// without a footprint. Trees are omitted; woods are included. Properties, null if not known:
///   id                        as on the map: "way/123"
///   kind                      "building", "part" or "foliage"
///   built, reason             whether it is in the city; reason if not, else repairs
///   height_m, min_height_m    top and bottom above its ground [m]
///   height_source             "height" (tagged), "levels", "default"; "surfaces": measured on the mesh
///   roof_shape                "flat", "gabled", ...
///   roof_height_m             [m], part of height_m
///   roof_source               source of roof_height_m, as height_source
///   ground_m                  ellipsoidal height of its base [m]
///   facade, roof              materials: "concrete", "glass", ...; "unknown"
[[nodiscard]] std::string format_footprints_geojson(const BuiltCity& built);

/// Writes it to a file, completely or not at all. Throws InputError if it cannot be written.
void write_footprints_geojson(const std::filesystem::path& path, const BuiltCity& built);

}  // namespace canyon::buildings
