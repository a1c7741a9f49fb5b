#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace canyon::adapters {

/// Folders in which a host searches files named in worlds and models.
struct ResourcePaths {
  std::vector<std::filesystem::path> models;                ///< for model://
  std::vector<std::filesystem::path> resources;             ///< for relative paths
  std::string variables = "the simulator's resource path";  ///< setting to which users add folders
};

/// Finds a file named in a world or model: an absolute path; a path relative to one of `folders`, in
/// their order, or to `paths.resources`; model:// in `paths.models`; package:// in
/// ROS_PACKAGE_PATH; file:// as the path after it. Does not use the network. Empty if not found: then
/// `looked` has all searched paths, in order. Folders are not files.
[[nodiscard]] std::optional<std::filesystem::path> find_resource(
    const std::string& name, const std::vector<std::filesystem::path>& folders, const ResourcePaths& paths,
    std::vector<std::filesystem::path>& looked);

}  // namespace canyon::adapters
