#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/city/buildings/sources/map_data.hpp"
#include "canyon/city/fwd.hpp"

namespace canyon::buildings {

/// The ground as triangles (a city model's relief).
class Tin {
 public:
  /// Longitude, latitude [deg], ellipsoidal height [m]; polygons of more corners become fans, holes are
  /// ignored.
  explicit Tin(const std::vector<MapSurface>& surfaces);

  [[nodiscard]] std::size_t size() const { return triangles_.size(); }
  /// The height of the highest triangle at a place; in a gap (under a building) that of the nearest corner.
  /// Empty outside the triangles' bounds.
  [[nodiscard]] std::optional<double> height_m(const LonLat& place) const;
  /// Appends the triangles that reach into [min, max] (east, north [m]) of `frame`, front sides up, as one
  /// object named "terrain".
  void append(city::Mesh& mesh, const geodesy::LocalFrame& frame, const Eigen::Vector2d& min,
              const Eigen::Vector2d& max) const;

 private:
  using Corners = std::array<std::uint32_t, 3>;
  [[nodiscard]] std::array<std::size_t, 2> cell_of(const LonLat& place) const;
  [[nodiscard]] double height_of_nearest_m(const LonLat& place) const;

  std::vector<Eigen::Vector3d> vertices_;
  std::vector<Corners> triangles_;
  Eigen::AlignedBox2d bounds_;
  std::array<std::size_t, 2> cells_{1, 1};
  std::vector<std::vector<std::uint32_t>> triangles_of_cell_;
};

}  // namespace canyon::buildings
