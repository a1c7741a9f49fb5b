#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "canyon/base/options/fwd.hpp"
#include "canyon/city/buildings/sources/map_data.hpp"

namespace canyon::buildings {

struct OverpassOptions {
  std::string url = "https://overpass-api.de/api/interpreter";
  std::filesystem::path cache;  ///< folder; empty: $XDG_CACHE_HOME/canyon or ~/.cache/canyon
  int timeout_s = 180;          ///< of one request; [1, 3600]
  /// Retries after 429 and 5xx, [0, 10]; waits as given by Retry-After (else 5 s, 10 s, ...), at most 60 s.
  int retries = 3;
  /// Larger boxes are fetched in equal tiles, each cached, so an interrupted download resumes. [0.001, 10]; a
  /// box of more than 10,000 tiles is rejected.
  double tile_deg = 0.05;
  bool foliage = false;
  void validate() const;
};
void visit(options::Visitor& v, OverpassOptions& o);

/// Downloads buildings, parts and (if enabled) foliage of a box as .osm files (one for each tile) to the
/// cache and returns their paths, for read_osm(); `progress` gets the numbers of finished and of all tiles.
/// Cached tiles are not downloaded again. One request at a time, with User-Agent Canyon. Throws InputError:
/// offline, refused, timed out, HTTP status, a response that is not OSM XML or is truncated.
[[nodiscard]] std::vector<std::filesystem::path> download_osm(
    const LonLatBox& box, const OverpassOptions& options,
    const std::function<void(std::size_t, std::size_t)>& progress = {});

/// Box of a named area ("Tsim Sha Tsui, Hong Kong": the area, then areas around it, each by `name` or
/// `name:en`), requested from the same endpoint and kept in the same cache: bounds of the largest boundary or
/// place of that name. Throws likewise, and for no such area, one without bounds, or several distant ones.
[[nodiscard]] LonLatBox find_named_area(const std::string& name, const OverpassOptions& options);

}  // namespace canyon::buildings
