#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/city/buildings/shapes/footprint.hpp"
#include "canyon/city/buildings/sources/map_data.hpp"
#include "canyon/city/buildings/sources/shape.hpp"
#include "canyon/city/fwd.hpp"

namespace canyon::buildings {

/// The note of append_solid() if nothing is built for a footprint.
inline constexpr const char* kNoTriangles = "outline cannot be triangulated";

/// Appends the closed solid over a footprint as one object: floor, walls, roof. Every edge is shared by two
/// triangles of opposite orientation, normals are outward, floor and walls have the facade material, the roof
/// has the roof material. Neighbouring triangles share vertices by index.
///
/// Roof shapes are fitted to the footprint's smallest bounding rectangle (ridge along its longer side, or by
/// roof_direction_rad and roof_across; see roof_planes.hpp). If an outline without holes is star-shaped about
/// its centroid, a pyramidal roof has level eaves and its tip over the centroid, else four faces that meet
/// over the rectangle's centre. Dome and onion need such an outline and scale it about the centroid, so a
/// round footprint gets a dome of revolution and a square one a cloister vault. An onion overhangs the
/// outline by up to 18 % of the distance to the centroid. A footprint unsuitable for its roof (no such
/// outline, or narrower than 0.1 m) gets a flat roof at half of the roof's height, with a line in `notes`.
/// Roofs below 1 cm are flat.
/// @param polygon from repair(), in the city's east-north metres
/// @param base_m z of the ground that shape.height_m and min_height_m count from
/// @param bottom_m z of the solid's bottom if min_height_m is 0: lower than base_m on a slope, so that no gap
/// is left
/// Precondition: height_m - roof_height_m >= min_height_m, height_m > min_height_m. Appends nothing, with a
/// note, if less than 1 mm of height is left or triangulate() returns nothing.
void append_solid(city::Mesh& mesh, const std::string& name, city::Surface surface, const Polygon2& polygon,
                  const Shape& shape, double base_m, double bottom_m, std::vector<std::string>& notes);

/// A tree as one object of Surface::Foliage: a vertical six-sided trunk and a closed crown, an ellipsoid of 8
/// meridians from a quarter of the height to the top; both of Material::Wood. [m]; all but base_m positive.
void append_tree(city::Mesh& mesh, const std::string& name, const Point2& point, double base_m,
                 double height_m, double crown_diameter_m);

/// Appends ready-made surfaces (CityGML, CityJSON) as one object of Surface::Building in `frame`: planar
/// polygons with holes are triangulated in their plane, vertices within 1 mm are merged, and front sides face
/// outwards (each connected closed shell is flipped if its volume is negative). Materials by semantic:
/// RoofSurface `roof`, Window Glass, all else `facade`; windows and doors are cut out of walls that contain
/// them (cut_openings()). ClosureSurfaces only close the shell and are not built, because they do not exist
/// in reality. Surfaces whose rings cross or touch along edges are repaired, those without an area (below
/// 1e-6 m^2) are dropped; `notes` gets both counts and any leak, with `name`. Returns whether it added one.
[[nodiscard]] bool append_surfaces(city::Mesh& mesh, const std::string& name,
                                   const std::vector<MapSurface>& surfaces, const geodesy::LocalFrame& frame,
                                   std::vector<std::string>& notes,
                                   city::Material facade = city::Material::Concrete,
                                   city::Material roof = city::Material::Concrete);

/// A surface of a building in its frame [m].
struct LocalSurface {
  std::vector<Eigen::Vector3d> outer;
  std::vector<std::vector<Eigen::Vector3d>> inners;
  std::string semantic;
};

/// Repairs a surface whose rings cross themselves or each other, or touch along edges, by repair() in its
/// plane. The result may be empty.
[[nodiscard]] std::vector<LocalSurface> mended(const LocalSurface& surface);

/// Cuts windows and doors (by their semantics) out of the surfaces that contain them, so that no surface is
/// doubled: many files draw them on walls without a hole. A surface contains them if they are within 5 cm of
/// its plane and half of their area is inside. A surface may become several, or none.
void cut_openings(std::vector<LocalSurface>& surfaces);

}  // namespace canyon::buildings
