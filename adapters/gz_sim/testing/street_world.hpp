#pragma once

#include <string>

#include "adapters/common/testing/street.hpp"

// The street of common/testing as a world of Gazebo Sim.

namespace canyon::adapters::gz_sim::test {

using namespace canyon::test;

inline std::string box(const std::string& size) {
  return "<box><size>" + size + "</size></box>";
}

/// A model of one solid shape.
inline std::string shape_model(const std::string& name, const std::string& pose, const std::string& geometry,
                               bool is_static = true, const std::string& shape_pose = "0 0 0 0 0 0") {
  const std::string shape = "<pose>" + shape_pose + "</pose><geometry>" + geometry + "</geometry>";
  return "<model name='" + name + "'><static>" + (is_static ? "true" : "false") + "</static><pose>" + pose +
         "</pose><link name='link'><gravity>false</gravity><collision name='c'>" + shape +
         "</collision><visual name='v'>" + shape + "</visual></link></model>";
}

inline const std::string kGnssSystem = "<plugin filename='CanyonGnssSystem' name='canyon::GnssSystem'/>";

/// A world in steps of 10 ms. `inside` is added to it.
inline std::string empty_world(const std::string& inside, double heading_deg = 0,
                               const std::string& name = "street") {
  return "<?xml version='1.0'?><sdf version='1.9'><world name='" + name +
         "'><physics name='p' type='dart'><max_step_size>0.01</max_step_size>"
         "<real_time_factor>0</real_time_factor></physics>"
         "<plugin filename='gz-sim-physics-system' name='gz::sim::systems::Physics'/>"
         "<plugin filename='gz-sim-user-commands-system' name='gz::sim::systems::UserCommands'/>"
         "<spherical_coordinates><surface_model>EARTH_WGS84</surface_model>"
         "<world_frame_orientation>ENU</world_frame_orientation><latitude_deg>22.3</latitude_deg>"
         "<longitude_deg>114.17</longitude_deg><elevation>5</elevation><heading_deg>" +
         std::to_string(heading_deg) + "</heading_deg></spherical_coordinates>" + inside + "</world></sdf>";
}

/// The street with its walls and the system; `inside` is added to the world next to them.
inline std::string street_world(const std::string& inside, double heading_deg = 0, bool walls = true,
                                const std::string& system = kGnssSystem) {
  return empty_world(system +
                         (walls ? shape_model("east", "10.5 0 15 0 0 0", box("1 400 30")) +
                                      shape_model("west", "-10.5 0 15 0 0 0", box("1 400 30"))
                                : std::string()) +
                         inside,
                     heading_deg);
}

/// A navsat sensor at the antenna's position with these elements in <canyon>.
inline std::string navsat(const std::string& elements, const std::string& more = "") {
  return "<sensor name='antenna' type='navsat'><pose>0 0 2 0 0 0</pose><update_rate>10</update_rate>"
         "<always_on>true</always_on>" +
         more + "<canyon>" + elements + "<publishers><ros>false</ros></publishers></canyon></sensor>";
}

/// A car with its roof under the antenna.
inline std::string street_car(const std::string& sensor, const std::string& name = "car",
                              const std::string& pose = "3 0 0 0 0 0", const std::string& plugins = "") {
  return "<model name='" + name + "'><pose>" + pose +
         "</pose><link name='body'><gravity>false</gravity><inertial><mass>100</mass></inertial>"
         "<collision name='c'><pose>0 0 1.2 0 0 0</pose><geometry>" +
         box("1.8 4 1.2") + "</geometry></collision>" + sensor + "</link>" + plugins + "</model>";
}

/// The default topic of a car's receiver; canyon.msgs.GnssReceiver is on "gnss" instead of "navsat".
inline std::string topic_of(const std::string& car = "car", const std::string& last = "gnss") {
  return "/world/street/model/" + car + "/link/body/sensor/antenna/" + last;
}

}  // namespace canyon::adapters::gz_sim::test
