#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace canyon::gazebo_classic {

/// Finds the file that a world or model names: an absolute path; a path relative to one of `folders`, in
/// their order, or to Gazebo's resource paths; model:// in Gazebo's model paths; package:// in
/// ROS_PACKAGE_PATH; file:// as the path behind it. Never looks in the network. Empty where there is none:
/// then `looked` has every place, in the order of looking. Folders are no files.
[[nodiscard]] std::optional<std::filesystem::path> find_resource(
    const std::string& name, const std::vector<std::filesystem::path>& folders,
    std::vector<std::filesystem::path>& looked);

}  // namespace canyon::gazebo_classic
