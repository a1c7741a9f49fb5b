#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

// The cities that tests/gazebo/prepare.sh exported.

namespace canyon::test {

/// The folder of a prepared city; empty if it was not prepared.
inline std::filesystem::path prepared_city(const std::string& name) {
  const char* data = std::getenv("CANYON_GAZEBO_DATA");
  if (data == nullptr) return {};
  const std::filesystem::path folder = std::filesystem::path(data) / name;
  return std::filesystem::exists(folder / "reference.yaml") ? folder : std::filesystem::path();
}

/// <sky> and <start> of the city's drive.
inline std::string city_sky(const std::filesystem::path& folder) {
  const simulation::Scenario scenario = simulation::read_scenario(folder / "reference.yaml");
  std::string elements = "<sky>";
  for (const auto& file : scenario.sky.navigation)
    elements += "<navigation>" + file.string() + "</navigation>";
  elements += "<systems>";
  for (const gnss::System system : scenario.sky.systems) elements += std::string(gnss::name(system)) + " ";
  elements += "</systems></sky>";
  const simulation::TrajectoryFile truth =
      simulation::read_trajectory_file(folder / "truth.csv", "urbannav", geodesy::GpsTime{});
  const geodesy::GpsTime start = truth.trajectory.begin();
  return elements + "<start><week>" + std::to_string(start.week()) + "</week><tow>" +
         std::to_string(start.seconds_of_week()) + "</tow></start>";
}

}  // namespace canyon::test
