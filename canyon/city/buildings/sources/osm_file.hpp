#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <osmium/osm/entity_bits.hpp>
#include <osmium/osm/object.hpp>
#include <string>
#include <vector>

namespace canyon::buildings {

/// A file of OpenStreetMap, or its text if it was changed for libosmium.
struct OsmFile {
  std::filesystem::path path;
  std::string format;
  std::optional<std::string> text;
};

/// Detects the format by content. Throws InputError for other files and downloads that Overpass aborted.
[[nodiscard]] OsmFile open_osm_file(const std::filesystem::path& path);

using UseOsmObject = std::function<void(const osmium::OSMObject&)>;
/// Calls `use` with each object of the kinds `bits` in each file, including invisible ones; ids and
/// references below zero are mapped as described at OsmId. Throws InputError for a file that is damaged or of
/// another version.
void for_each_object(const std::vector<OsmFile>& files, osmium::osm_entity_bits::type bits,
                     const UseOsmObject& use);

}  // namespace canyon::buildings
