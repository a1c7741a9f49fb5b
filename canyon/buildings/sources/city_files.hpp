#pragma once

#include <filesystem>
#include <vector>

#include "canyon/buildings/sources/city_model.hpp"
#include "canyon/buildings/sources/map_data.hpp"

namespace canyon::buildings {

/// Reads the files of a city model: CityGML and CityJSON by their content, each also as a zip archive or a
/// folder of any depth with many tiles, as authorities ship them, and several of these. Tiles are read in the
/// order of their names; an object that several of them have is taken once; each tile has its own reference
/// system.
///
/// A tile among many that is damaged is left out, and a warning names it with the line; a single file that is
/// damaged is an error. Files of archives and folders that are not city models are passed over.
///
/// Throws InputError as read_citygml() and read_cityjson() do, for an archive that unpacks to absurd sizes,
/// and where no tile can be read.
[[nodiscard]] MapData read_city_files(const std::vector<std::filesystem::path>& paths,
                                      const CityReadOptions& options = {});

}  // namespace canyon::buildings
