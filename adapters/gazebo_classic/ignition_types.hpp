#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <gazebo/common/SystemPaths.hh>
#include <gazebo/common/Time.hh>
#include <ignition/math/Vector3.hh>
#include <list>
#include <string>
#include <vector>

#include "adapters/common/gazebo_math.hpp"
#include "adapters/common/resource_files.hpp"

// Conversions between Gazebo's and the engine's types.

namespace canyon::adapters::gazebo_classic {

[[nodiscard]] inline std::int64_t nanoseconds(const gazebo::common::Time& t) {
  return t.sec * std::int64_t{1'000'000'000} + t.nsec;
}
[[nodiscard]] inline ignition::math::Vector3d ignition_from(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

/// Gazebo's own resource paths, from its present environment.
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
