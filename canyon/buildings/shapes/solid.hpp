#pragma once

#include <string>
#include <vector>

#include "canyon/buildings/shapes/footprint.hpp"
#include "canyon/buildings/sources/shape.hpp"
#include "canyon/city/fwd.hpp"

namespace canyon::buildings {

/// The note of append_solid() on a footprint of which nothing is built.
inline constexpr const char* kNoTriangles = "outline cannot be triangulated";

/// Appends the closed solid over a footprint as one object: floor, walls, roof; every edge shared by two
/// triangles of opposite orientation, normals outward, facade material on floor and walls, roof material on
/// the roof. Neighbouring triangles share vertices by index.
///
/// Roof shapes act over the footprint's smallest bounding rectangle (ridge along its longer side, or as
/// roof_direction_rad and roof_across say; see roof_planes.hpp). Where an outline without holes is
/// star-shaped about its centroid, a pyramidal roof has level eaves and its tip over the centroid, else four
/// faces that meet over the rectangle's centre; dome and onion need such an outline and are that outline
/// scaled about the centroid, so that a round footprint bears a dome of revolution and a square one a
/// cloister vault. An onion overhangs the outline by up to 18 % of the distance to the centroid. A footprint
/// that cannot bear its roof (none such outline, or narrower than 0.1 m) gets a flat roof halfway up the
/// roof's height, and `notes` says so. Roofs below 1 cm are flat.
///
/// @param polygon from repair(), in the city's east-north metres
/// @param base_m z of the ground that shape.height_m and min_height_m count from
/// @param bottom_m z of the solid's bottom where min_height_m is 0: lower than base_m on a slope, so that no
/// gap is left
/// Precondition: height_m - roof_height_m >= min_height_m, height_m > min_height_m. Appends nothing, with a
/// note, where less than 1 mm of height is left or triangulate() gives nothing.
void append_solid(city::Mesh& mesh, const std::string& name, city::Surface surface, const Polygon2& polygon,
                  const Shape& shape, double base_m, double bottom_m, std::vector<std::string>& notes);

/// A tree as one object of Surface::Foliage: a vertical six-sided trunk and a closed crown, an ellipsoid of 8
/// meridians from a quarter of the height to the top; both of Material::Wood. Metres; all but base_m
/// positive.
void append_tree(city::Mesh& mesh, const std::string& name, const Point2& place, double base_m,
                 double height_m, double crown_diameter_m);

}  // namespace canyon::buildings
