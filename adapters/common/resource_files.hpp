#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace canyon::adapters {

/// Folders in which a host looks for files that worlds and models name.
struct ResourcePaths {
  std::vector<std::filesystem::path> models;                ///< for model://
  std::vector<std::filesystem::path> resources;             ///< for relative paths
  std::string variables = "the simulator's resource path";  ///< where users add to them
};

/// Finds the file that a world or model names: an absolute path; a path relative to one of `folders`, in
/// their order, or to `paths.resources`; model:// in `paths.models`; package:// in
/// ROS_PACKAGE_PATH; file:// as the path behind it. Never looks in the network. Empty where there is none:
/// then `looked` has every place, in the order of looking. Folders are not files.
[[nodiscard]] std::optional<std::filesystem::path> find_resource(
    const std::string& name, const std::vector<std::filesystem::path>& folders, const ResourcePaths& paths,
    std::vector<std::filesystem::path>& looked);

}  // namespace canyon::adapters
