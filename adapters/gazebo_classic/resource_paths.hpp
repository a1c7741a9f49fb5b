#pragma once

#include <filesystem>
#include <gazebo/common/SystemPaths.hh>
#include <list>
#include <string>
#include <vector>

#include "adapters/common/resource_files.hpp"

namespace canyon::adapters::gazebo_classic {

/// Gazebo's own resource paths, as its environment has them now.
[[nodiscard]] inline ResourcePaths gazebos_paths() {
  const auto given = [](const std::list<std::string>& folders) {
    std::vector<std::filesystem::path> paths(folders.begin(), folders.end());
    std::erase(paths, std::filesystem::path());
    return paths;
  };
  auto* paths = gazebo::common::SystemPaths::Instance();
  return {given(paths->GetModelPaths()), given(paths->GetGazeboPaths()),
          "GAZEBO_RESOURCE_PATH, or GAZEBO_MODEL_PATH for model://"};
}

}  // namespace canyon::adapters::gazebo_classic
