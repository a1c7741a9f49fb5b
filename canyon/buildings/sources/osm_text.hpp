#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace canyon::buildings {

/// OSM XML with those attributes of nodes, ways and relations that matter to buildings: users, change sets
/// and times are left out, for libosmium refuses files by them (user ids above 31 bits), and an object that
/// JOSM has marked with action='delete' becomes visible='false' (OSM wiki, JOSM file format). Lines keep
/// their numbers. Text that is not XML comes back as it is.
[[nodiscard]] std::string plain_osm_xml(std::string_view xml);

/// Whether plain_osm_xml() would change what libosmium reads of this piece of a file.
[[nodiscard]] bool needs_plain_xml(std::string_view xml);

/// Overpass JSON (`out body` with nodes, or `out geom`) as OSM XML. Ways without node ids get ids of their
/// own, and members of relations with a geometry become ways. Throws InputError where the text is not
/// Overpass JSON, where the server gave up (`remark`), and where ways have no geometry.
[[nodiscard]] std::string osm_xml_from_overpass(const std::filesystem::path& path, std::string_view json);

}  // namespace canyon::buildings
