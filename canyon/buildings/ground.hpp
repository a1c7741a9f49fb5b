#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

#include "canyon/buildings/sources/map_data.hpp"
#include "canyon/buildings/sources/terrain.hpp"
#include "canyon/city/city.hpp"
#include "canyon/geodesy/frames.hpp"

namespace canyon::buildings {

/// Converts places on the map to mesh coordinates, and gives the height of the ground there.
class MapFrame {
 public:
  /// Without a terrain the ground has the origin's ellipsoidal height everywhere. `terrain` must outlive
  /// this. Throws InputError for an origin outside WGS 84's bounds.
  MapFrame(const geodesy::Geodetic& origin, const Terrain* terrain) : frame_(origin), terrain_(terrain) {}

  [[nodiscard]] const geodesy::LocalFrame& frame() const { return frame_; }

  /// East, north, up [m] of longitude, latitude [deg] and ellipsoidal height [m].
  [[nodiscard]] Eigen::Vector3d mesh_from_map(const LonLat& place, double height_m) const;
  /// Inverse: longitude, latitude [deg], ellipsoidal height [m].
  [[nodiscard]] Eigen::Vector3d map_from_mesh(const Eigen::Vector3d& point) const;

  /// Ellipsoidal height of the ground; empty where the terrain has none.
  [[nodiscard]] std::optional<double> ground_height_m(const LonLat& place) const;
  /// Mesh coordinates of the ground at a place; empty likewise.
  [[nodiscard]] std::optional<Eigen::Vector3d> ground(const LonLat& place) const;

 private:
  geodesy::LocalFrame frame_;
  const Terrain* terrain_;
};

/// The ground along a feature, in mesh coordinates [m].
struct Ground {
  double lowest_z = 0, mean_z = 0;  ///< over its points
  double lowest_height_m = 0;       ///< ellipsoidal, of the lowest one
};

/// The ground at the corners of the outer rings and, on a terrain, at points at most 10 m apart between them.
/// Empty where the terrain has no height for any of them.
[[nodiscard]] std::optional<Ground> ground_along(const std::vector<MapPolygon>& polygons,
                                                 const MapFrame& map_frame, bool terrain);

/// Appends the object "terrain" over `bounds` (east, north [m] in the frame about the origin): the
/// terrain's sheet, or without one (nullptr) a sheet at the origin's ellipsoidal height with posts 500 m
/// apart. Throws InputError where the terrain does not cover it, or would have more than 25 million posts.
void append_ground(city::Mesh& mesh, const geodesy::LocalFrame& frame, const Terrain* terrain,
                   const Eigen::AlignedBox2d& bounds, double terrain_spacing_m);

}  // namespace canyon::buildings
