#pragma once

#include <array>
#include <filesystem>
#include <string>

#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario.hpp"
#include "cli/commands.hpp"
#include "cli/field_option.hpp"

namespace canyon::cli {

/// The subcommands of `canyon city`, one file each.
void add_city_build(Command& city);
void add_city_view(Command& city);

/// The city of a file of any kind, of a Gazebo model's folder, or of a scenario. `origin` ("LAT,LON,HEIGHT"
/// or empty) is for meshes and maps. Throws InputError where it stands beside a file that says its own.
[[nodiscard]] simulation::CityConfig city_config(const std::string& input, const std::string& origin);

/// --lod and --crs of a command.
void add_model_options(Command& command, buildings::ModelOptions& model);
/// Puts what these say into a map's configuration. Throws InputError where the city is not a map.
void set_model(simulation::CityConfig& config, const buildings::ModelOptions& model);

/// Which part of a tileset of 3D Tiles is read, and how.
struct TileArguments {
  Changes<tiles::TileOptions> changes;
  std::string bbox;
};
/// Adds --error, --most-tiles, --elsewhere, --skin, --flatten and, where `with_box`, --bbox.
/// @param arguments must live as long as the command
void add_tile_options(Command& command, TileArguments& arguments, bool with_box);
/// Makes the changes. Throws InputError where there are some and the city is not a tileset.
void change_tiles(simulation::CityConfig& config, const TileArguments& arguments, const std::string& input);

/// simulation::load_city_with_report() with a progress line.
[[nodiscard]] buildings::BuiltCity load_city(const simulation::CityConfig& config, const char* what,
                                             bool quiet);

/// "W,S,E,N" in degrees; throws InputError naming the option.
[[nodiscard]] std::array<double, 4> parse_bbox(const std::string& text, const std::string& option);

}  // namespace canyon::cli
