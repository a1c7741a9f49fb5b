#pragma once

#include "canyon/buildings/footprint.hpp"
#include "canyon/buildings/shape.hpp"
#include "canyon/city/city.hpp"

namespace canyon::buildings {

/// Appends the closed solid over a footprint as one object: floor, walls, roof; every edge shared by two
/// triangles of opposite orientation, normals outward, facade and roof materials on their triangles.
/// @param polygon from repair(), in the city's east-north metres
/// @param base_m z of the ground that shape.height_m and min_height_m count from
/// @param bottom_m z of the solid's bottom where min_height_m is 0: lower than base_m on a slope, so that no
/// gap is left Roof shapes act over the footprint's smallest bounding rectangle (ridge along its longer side,
/// or as roof_direction_rad and roof_across say); dome, onion and pyramidal about its centre. A footprint
/// that a roof shape cannot cover as a closed surface gets a flat roof at the eaves' mean, and `notes` says
/// so. Precondition: height_m - roof_height_m >= min_height_m, height_m > min_height_m.
void append_solid(city::Mesh& mesh, const std::string& name, city::Surface surface, const Polygon2& polygon,
                  const Shape& shape, double base_m, double bottom_m, std::vector<std::string>& notes);

/// A tree: a vertical trunk of wood and a closed crown of foliage.
void append_tree(city::Mesh& mesh, const std::string& name, const Point2& place, double base_m,
                 double height_m, double crown_diameter_m);

/// Volume [m^3] enclosed by an object's triangles (divergence theorem), and whether it is watertight: every
/// directed edge met by exactly one opposite one, vertices compared by position.
struct SolidCheck {
  double volume_m3 = 0;
  bool watertight = false;
};
[[nodiscard]] SolidCheck check_solid(const city::Mesh& mesh, const city::Object& object);

}  // namespace canyon::buildings
