#pragma once

#include <string>

#include "adapters/common/testing/street.hpp"

// The street of common/testing as a world of Gazebo Classic.

namespace canyon::adapters::gazebo_classic::test {

using namespace canyon::test;

/// `inside` is added to the world next to the walls.
inline std::string street_world(const std::string& inside, double heading_deg = 0, bool walls = true) {
  return "<?xml version='1.0'?><sdf version='1.6'><world name='street'>"
         "<physics type='ode'><max_step_size>0.01</max_step_size>"
         "<real_time_update_rate>0</real_time_update_rate></physics>"
         "<spherical_coordinates><surface_model>EARTH_WGS84</surface_model><latitude_deg>22.3</latitude_deg>"
         "<longitude_deg>114.17</longitude_deg><elevation>5</elevation><heading_deg>" +
         std::to_string(heading_deg) + "</heading_deg></spherical_coordinates>" +
         (walls ? box_model("east", "10.5 0 15 0 0 0", "1 400 30") +
                      box_model("west", "-10.5 0 15 0 0 0", "1 400 30")
                : std::string()) +
         inside + "</world></sdf>";
}

/// A car with its roof under the antenna. `sensor_type` empty: the plugin is attached to the model itself.
inline std::string street_car(const std::string& plugin_elements, const std::string& sensor_type = "ray",
                              const std::string& name = "car", const std::string& pose = "3 0 0 0 0 0") {
  const std::string file =
      sensor_type.empty() ? "libGNSSMultipathModelPlugin.so" : "libMultipathSensorPlugin.so";
  const std::string plugin = "<plugin name='gnss' filename='" + file + "'>" + plugin_elements + "</plugin>";
  const std::string ray =
      sensor_type == "ray"
          ? "<ray><scan><horizontal><samples>16</samples><resolution>1</resolution><min_angle>-3.14"
            "</min_angle><max_angle>3.14</max_angle></horizontal></scan><range><min>0.1</min>"
            "<max>50</max></range></ray>"
          : "";
  const std::string sensor = sensor_type.empty()
                                 ? ""
                                 : "<sensor name='antenna' type='" + sensor_type +
                                       "'><pose>0 0 2 0 0 0</pose><update_rate>10</update_rate>" + ray +
                                       plugin + "</sensor>";
  return "<model name='" + name + "'><pose>" + pose +
         "</pose><link name='body'><gravity>false</gravity><collision name='c'><pose>0 0 1.2 0 0 "
         "0</pose><geometry>"
         "<box><size>1.8 4 1.2</size></box></geometry></collision>" +
         sensor + "</link>" + (sensor_type.empty() ? plugin : "") + "</model>";
}

}  // namespace canyon::adapters::gazebo_classic::test
