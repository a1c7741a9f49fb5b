#pragma once

#include <filesystem>
#include <string>

#include "canyon/city/city.hpp"

namespace canyon::city {

struct GazeboOptions {
  std::string name = "canyon_city";
  /// Largest number of triangles in one collision mesh: buildings are grouped by place into links of about
  /// this size.
  std::size_t triangles_per_mesh = 20'000;
  std::string gps_time;  ///< ISO 8601, kept as a comment where given
  void validate() const;
};

/// A Gazebo model folder: model.config, model.sdf (SDF 1.6, static), meshes/*.dae split by place, materials
/// coloured. The folder appears whole or not at all.
void write_gazebo_model(const std::filesystem::path& folder, const City& city,
                        const GazeboOptions& options = {});

/// A world (.world or .sdf) with spherical_coordinates at the city's origin, sun, terrain or ground plane and
/// the model beside it in a folder NAME_model; valid for Gazebo Classic 11 and for Gazebo Sim.
void write_gazebo_world(const std::filesystem::path& path, const City& city,
                        const GazeboOptions& options = {});

/// Reads such a world or model back (mesh and primitive geometries: box, cylinder, sphere, plane, mesh;
/// poses; includes by relative or model:// path beside it; spherical_coordinates as origin). Part of
/// canyon::io.
[[nodiscard]] City read_gazebo_world(const std::filesystem::path& path);

}  // namespace canyon::city
