#pragma once

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"

// A street from south to north between two walls, 20 m apart, with a car whose antenna is 7 m from the
// eastern and 13 m from the western wall, 2 m above the ground. Frozen satellites; their paths have closed
// forms.

namespace canyon::test {

struct StreetSatellite {
  double azimuth_deg;
  double elevation_deg;
  /// Excess path [m] of the specular and of the mirror model: 0 LOS, -1 blocked. A wall at distance h gives 2
  /// h cos(elevation) to both, if the reflection point sees the satellite above the opposite wall (30 m).
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
      {90, 20, -1, street_excess_m(13, 20)},  // the eastern wall also blocks it at the reflection point
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

/// The paper's elements for the street's satellites.
inline std::string paper_elements(const std::string& ros_namespace = "/multipath") {
  return "<ros><namespace>" + ros_namespace +
         "</namespace><remapping>~/out:=scan</remapping></ros>"
         "<output_type>sensor_msgs/LaserScan</output_type><disableNoise>1</disableNoise><satNum>" +
         std::to_string(street_satellites().size()) + "</satNum><satAzimuth>" +
         street_angles(&StreetSatellite::azimuth_deg) + "</satAzimuth><satElevation>" +
         street_angles(&StreetSatellite::elevation_deg) + "</satElevation>";
}

}  // namespace canyon::test
