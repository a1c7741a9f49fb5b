#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <sdf/sdf.hh>
#include <string>
#include <vector>

#include "adapters/common/resource_files.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/simulation/motion/vehicle_drive.hpp"

namespace canyon::adapters {

/// The settings in the element of libCanyonDrivePlugin.so.
struct DriveSettings {
  simulation::VehicleDrive drive;
  bool heading = true;  ///< the model heads in the direction of motion; false: it keeps its initial attitude
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();  ///< model's origin from the path: forward, left, up
  std::vector<std::string> warnings;
};

/// @param name for messages: "plugin 'rails' of model 'car'"
/// @param folder of relative paths, searched before `resources`
/// @param world the world's position on the Earth, for files with geodetic positions
/// Throws InputError, whose text names plugin, element and hint.
[[nodiscard]] DriveSettings read_drive_settings(const sdf::ElementPtr& element, const std::string& name,
                                                const std::filesystem::path& folder,
                                                const ResourcePaths& resources,
                                                const geodesy::LocalFrame& world);

/// A key per element, for docs and tests.
[[nodiscard]] const options::Description& drive_description();

}  // namespace canyon::adapters
