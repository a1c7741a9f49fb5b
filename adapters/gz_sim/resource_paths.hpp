#pragma once

#include <gz/sim/Util.hh>

#include "adapters/common/resource_files.hpp"

namespace canyon::adapters::gz_sim {

/// Folders in which Gazebo Sim looks for files that worlds name.
[[nodiscard]] inline ResourcePaths gazebos_paths() {
  ResourcePaths paths{{}, {}, "GZ_SIM_RESOURCE_PATH"};
  for (const std::string& path : gz::sim::resourcePaths()) {
    paths.models.emplace_back(path);
    paths.resources.emplace_back(path);
  }
  return paths;
}

}  // namespace canyon::adapters::gz_sim
