#pragma once

#include <array>
#include <string>

#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "cli/commands.hpp"
#include "cli/field_option.hpp"

namespace canyon::cli {

void add_city_build(Command& city);

/// Options for reading a city: changes to the file's or the scenario's values.
struct CityArguments {
  std::string origin;  ///< "LAT,LON,HEIGHT" of a mesh, a map or a tileset
  std::string bbox;    ///< "W,S,E,N" of a map or a tileset
  Changes<buildings::ModelOptions> model;
  Changes<buildings::TerrainOptions> sea_level;
  Changes<tiles::TileOptions> tiles;
};
/// Adds --lod, --crs, --error, --max-tiles, --allow-external and --bbox.
/// @param arguments must live as long as the command
void add_city_options(Command& command, CityArguments& arguments);
/// Adds --origin, --geoid and --geoid-undulation.
void add_georeference_options(Command& command, CityArguments& arguments);
/// Applies the changes. InputError for options without effect on this kind of city. @param input for messages
void change_city(simulation::CityConfig& config, const CityArguments& arguments, const std::string& input);

/// The city of a file of any kind, of a Gazebo model's folder, or of a scenario, changed by the arguments.
/// Throws InputError as change_city(), and if an origin is given for a file or scenario that has its own.
[[nodiscard]] simulation::CityConfig city_config(const std::string& input,
                                                 const CityArguments& arguments = {});

/// simulation::read_city() with a progress line.
[[nodiscard]] buildings::BuiltCity read_city(const simulation::CityConfig& config, const char* what,
                                             bool quiet);

/// "W,S,E,N" in degrees; throws InputError naming the option.
[[nodiscard]] std::array<double, 4> parse_bbox(const std::string& text, const std::string& option);

}  // namespace canyon::cli
