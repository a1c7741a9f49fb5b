#pragma once

#include <string_view>

namespace canyon::city {

/// The ground that write_gazebo_world() adds under a city without terrain; not part of the city.
inline constexpr std::string_view kGroundPlaneModel = "canyon_ground_plane";

/// Whether names of models, worlds and folders may have it: these are plain in XML, in URIs and for every
/// Gazebo.
[[nodiscard]] constexpr bool is_gazebo_name_character(char c) {
  return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '_' || c == '-' ||
         c == '.';
}

}  // namespace canyon::city
