#pragma once

#include <Eigen/Core>
#include <optional>

#include "canyon/buildings/city_builder.hpp"
#include "canyon/buildings/sources/map_data.hpp"
#include "canyon/buildings/sources/terrain.hpp"
#include "canyon/geodesy/frames.hpp"

namespace canyon::buildings {

/// Converts places on the map to mesh coordinates, and gives the height of the ground there.
class MapFrame {
 public:
  /// Without a terrain the ground has the origin's ellipsoidal height everywhere. `terrain` must outlive
  /// this. Throws InputError for an origin outside WGS 84's or (Utm) UTM's bounds.
  MapFrame(const geodesy::Geodetic& origin, Grid grid, const Terrain* terrain);

  [[nodiscard]] const geodesy::LocalFrame& frame() const { return frame_; }
  [[nodiscard]] Grid grid() const { return grid_; }

  /// Mesh coordinates [m] of longitude, latitude [deg] and ellipsoidal height [m]. Throws InputError for a
  /// place outside the UTM zone's legal range (Utm).
  [[nodiscard]] Eigen::Vector3d mesh_from_map(const LonLat& place, double height_m) const;
  /// Inverse: longitude, latitude [deg], ellipsoidal height [m].
  [[nodiscard]] Eigen::Vector3d map_from_mesh(const Eigen::Vector3d& point) const;
  /// The transform from the ENU frame about the origin to mesh coordinates; the identity for Grid::Enu.
  [[nodiscard]] Eigen::Vector3d mesh_from_enu(const Eigen::Vector3d& enu) const;

  /// Ellipsoidal height of the ground; empty where the terrain has none.
  [[nodiscard]] std::optional<double> ground_height_m(const LonLat& place) const;
  /// Mesh coordinates of the ground at a place; empty likewise.
  [[nodiscard]] std::optional<Eigen::Vector3d> ground(const LonLat& place) const;

 private:
  geodesy::LocalFrame frame_;
  Grid grid_;
  const Terrain* terrain_;
  int zone_ = 0;
  double easting_m_ = 0, northing_m_ = 0;  // of the origin; the northing without the south's false northing
};

}  // namespace canyon::buildings
