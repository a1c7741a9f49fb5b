#pragma once

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "canyon/geodesy/constants.hpp"

// A street from south to north between two walls, 20 m apart, with a car whose antenna stands 7 m from the
// eastern and 13 m from the western wall, 2 m above the ground. Frozen satellites whose paths have closed
// forms.

namespace canyon::adapters::gazebo_classic::test {

struct StreetSatellite {
  double azimuth_deg;
  double elevation_deg;
  /// Excess path [m] of the specular and of the mirror model: 0 LOS, -1 blocked. A wall at distance h gives
  /// 2 h cos(elevation) to both, where the reflection point sees the satellite above the opposite wall (30
  /// m).
  double specular_m;
  double mirror_m;
};

inline double street_excess_m(double distance_m, double elevation_deg) {
  return 2 * distance_m * std::cos(geodesy::radians(elevation_deg));
}

inline const std::vector<StreetSatellite>& street_satellites() {
  static const std::vector<StreetSatellite> satellites = {
      {90, 45, street_excess_m(13, 45), street_excess_m(13, 45)},  // by the western wall
      {270, 50, street_excess_m(7, 50), street_excess_m(7, 50)},   // by the eastern wall
      {0, 30, 0, 0},                                               // along the street
      {180, 35, 0, 0},
      {10, 80, 0, 0},                         // above the roofs
      {90, 20, -1, street_excess_m(13, 20)},  // the eastern wall hides it from the reflection point as well
      {355, 60, 0, 0},
      {185, 55, 0, 0},
  };
  return satellites;
}

inline std::string street_angles(double StreetSatellite::*angle) {
  std::string text;
  for (const StreetSatellite& satellite : street_satellites()) {
    if (!text.empty()) text += " ";
    text += std::to_string(geodesy::radians(satellite.*angle));
  }
  return text;
}

/// A solid box as a static model.
inline std::string box_model(const std::string& name, const std::string& pose, const std::string& size,
                             bool is_static = true) {
  const std::string geometry = "<geometry><box><size>" + size + "</size></box></geometry>";
  return "<model name='" + name + "'><static>" + (is_static ? "true" : "false") + "</static><pose>" + pose +
         "</pose><link name='link'><gravity>false</gravity><collision name='c'>" + geometry +
         "</collision><visual name='v'>" + geometry + "</visual></link></model>";
}

/// `inside` goes into the world beside the walls.
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

/// A car whose roof lies under the antenna. `sensor_type` empty: the plugin hangs on the model itself.
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

/// The paper's elements for the street's satellites.
inline std::string paper_elements(const std::string& ros_namespace = "/multipath") {
  return "<ros><namespace>" + ros_namespace +
         "</namespace><remapping>~/out:=scan</remapping></ros>"
         "<output_type>sensor_msgs/LaserScan</output_type><disableNoise>1</disableNoise><satNum>" +
         std::to_string(street_satellites().size()) + "</satNum><satAzimuth>" +
         street_angles(&StreetSatellite::azimuth_deg) + "</satAzimuth><satElevation>" +
         street_angles(&StreetSatellite::elevation_deg) + "</satElevation>";
}

}  // namespace canyon::adapters::gazebo_classic::test
