#pragma once

#include <Eigen/Geometry>
#include <string>
#include <utility>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/city/link_shapes.hpp"

namespace canyon::test {

/// Adds a closed box, front sides outwards, to a mesh: footprint corners are [min.x, max.x] x [min.y, max.y],
/// rotated about its centre by `yaw_rad`.
inline void append_box(city::Mesh& mesh, std::string name, city::Surface surface, city::Material material,
                       const Eigen::Vector3d& min, const Eigen::Vector3d& max, double yaw_rad = 0) {
  const Eigen::Vector3d centre = 0.5 * (min + max);
  const Eigen::Matrix3d rotation = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  std::vector<Eigen::Vector3d> corners;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d corner((i & 1) != 0 ? max.x() : min.x(), (i & 2) != 0 ? max.y() : min.y(),
                                 (i & 4) != 0 ? max.z() : min.z());
    // Exact corners without yaw: boxes that share a wall then share its vertices.
    corners.push_back(yaw_rad == 0 ? corner : Eigen::Vector3d(centre + rotation * (corner - centre)));
  }
  city::append_object(mesh, std::move(name), surface, material, corners, city::box_mesh({1, 1, 1}).triangles);
}

}  // namespace canyon::test
