#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "canyon/buildings/map_data.hpp"

namespace canyon::buildings {

struct OverpassOptions {
  std::string url = "https://overpass-api.de/api/interpreter";
  std::filesystem::path cache;  ///< folder; empty: $XDG_CACHE_HOME/canyon or ~/.cache/canyon
  int timeout_s = 180;          ///< of one request; [1, 3600]
  int retries = 3;              ///< after 429 and 5xx, waiting as Retry-After says, at most 60 s; [0, 10]
  double tile_deg =
      0.05;  ///< boxes larger than this are fetched in tiles, each cached: an interrupted download resumes
  bool foliage = false;
  void validate() const;
};

/// Downloads buildings, parts and (if asked) foliage of a box as an .osm file in the cache and returns its
/// path; what is there already is not asked for again. One request at a time, with a User-Agent that names
/// Canyon. Throws InputError: offline, refused, timed out, HTTP status, an answer that is no OSM XML or ends
/// early.
[[nodiscard]] std::vector<std::filesystem::path> download_osm(
    const LonLatBox& box, const OverpassOptions& options,
    const std::function<void(std::size_t, std::size_t)>& progress = {});

/// Box of a named place ("Tsim Sha Tsui, Hong Kong"), asked from the same endpoint (area by name). Throws
/// likewise, and where no such place is found.
[[nodiscard]] LonLatBox find_place(const std::string& name, const OverpassOptions& options);

}  // namespace canyon::buildings
