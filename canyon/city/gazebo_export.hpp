#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "canyon/base/options/fwd.hpp"
#include "canyon/city/fwd.hpp"

namespace canyon::city {

// Part of canyon::io.
struct GazeboOptions {
  /// The name of the model and the world: letters, digits, '_', '-' and '.', 1 to 100 of them.
  std::string name = "canyon_city";
  /// Largest number of triangles in one collision mesh: buildings are grouped by location into links of about
  /// this size. A single larger object is not split. At least 1.
  std::size_t triangles_per_mesh = 20'000;
  std::string gps_time;  ///< ISO 8601, written as a comment if given
  /// Throws InputError with the field and its bound.
  void validate() const;
};
void visit(options::Visitor& v, GazeboOptions& o);

/// A Gazebo model folder: model.config, model.sdf (SDF 1.6, static), meshes/*.dae split by location, coloured
/// materials. Each link's origin is at whole metres near its middle, so that single precision suffices. Its
/// collision mesh has a node for each object, its visual mesh one piece for each material, which Gazebo
/// renders quickly. Meshes are named model://FOLDER/meshes/..., which every Gazebo finds if the parent of
/// FOLDER is in GAZEBO_MODEL_PATH (Classic) or GZ_SIM_RESOURCE_PATH (Sim). The folder is written completely
/// or not at all; an older model written by Canyon is replaced. Throws InputError for a city without a
/// triangle, a folder with other contents, or if nothing can be written.
void write_gazebo_model(const std::filesystem::path& folder, const City& city,
                        const GazeboOptions& options = {});

/// A world (.world or .sdf) with spherical_coordinates at the city's origin, sun, terrain or ground plane and
/// the city's model; valid for Gazebo Classic 11 and for Gazebo Sim, without network or environment
/// variables: the model is part of the world and names its meshes by paths relative to it, which Gazebo Sim
/// and Classic since 11.2 resolve (Classic before 11.2: start it in the world's folder, or put that folder in
/// GAZEBO_RESOURCE_PATH). The meshes are in a model folder STEM_model next to the world, as written by
/// write_gazebo_model(), for use in other worlds; move both together. Throws as write_gazebo_model() does.
void write_gazebo_world(const std::filesystem::path& path, const City& city,
                        const GazeboOptions& options = {});

/// The ground that write_gazebo_world() adds under a city without terrain; not part of the city.
inline constexpr std::string_view kGroundPlaneModel = "canyon_ground_plane";

/// Whether names of models, worlds and folders may contain this character: it needs no escape in XML, in URIs
/// and in any Gazebo.
[[nodiscard]] constexpr bool is_gazebo_name_character(char c) {
  return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '_' || c == '-' ||
         c == '.';
}

}  // namespace canyon::city
