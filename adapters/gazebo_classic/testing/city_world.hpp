#pragma once

#include <filesystem>
#include <regex>
#include <string>

#include "adapters/common/testing/prepared_city.hpp"
#include "tests/support/temporary_folder.hpp"

// The cities that tests/gazebo/prepare.sh exported, with a car of the test in them.

namespace canyon::adapters::gazebo_classic::test {

using canyon::test::city_sky;
using canyon::test::prepared_city;

/// The city's world with physics in steps of `step_s`, as fast as possible, with `inside` added. Meshes have
/// absolute paths, so the file may be in any folder.
inline std::string city_world(const std::filesystem::path& folder, double step_s, const std::string& inside) {
  const std::string name = folder.filename().string();
  std::string world = canyon::test::read_bytes(folder / (name + ".world"));
  world = std::regex_replace(world, std::regex("<max_step_size>[^<]*"),
                             "<max_step_size>" + std::to_string(step_s));
  world = std::regex_replace(world, std::regex("<real_time_update_rate>[^<]*"), "<real_time_update_rate>0");
  world = std::regex_replace(world, std::regex("<uri>(" + name + "_model/)"),
                             "<uri>file://" + folder.string() + "/$1");
  return world.replace(world.rfind("</world>"), 0, inside);
}

/// A car on rails along the city's drive, the antenna at the path.
inline std::string city_car(const std::filesystem::path& folder, const std::string& plugin_elements) {
  return "<model name='car'><link name='base'><kinematic>true</kinematic><gravity>false</gravity>"
         "<sensor name='antenna' "
         "type='ray'><update_rate>1</update_rate><ray><scan><horizontal><samples>1</samples>"
         "<resolution>1</resolution><min_angle>0</min_angle><max_angle>0</max_angle></horizontal></scan>"
         "<range><min>0.1</min><max>300</max></range></ray>"
         "<plugin name='gnss' filename='libMultipathSensorPlugin.so'>" +
         plugin_elements +
         "</plugin></sensor></link><plugin name='rails' filename='libCanyonDrivePlugin.so'><trajectory>" +
         (folder / "truth.csv").string() + "</trajectory><format>urbannav</format></plugin></model>";
}

}  // namespace canyon::adapters::gazebo_classic::test
