// Declared in canyon/city/link_shapes.hpp.
#include "canyon/city/link_shapes.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>

#include "canyon/base/geodesy/constants.hpp"

namespace canyon::city {
namespace {

struct Ring {
  double radius, z;
};

/// A closed surface about the z axis: rings of `sides` vertices from the lowest to the highest, between two
/// points on the axis. Empty where it has no extent.
TriangleSet revolve(double bottom, const std::vector<Ring>& rings, double top, int sides) {
  TriangleSet set;
  if (!is_extent({rings.front().radius, top - bottom, 1})) return set;
  set.vertices = {{0, 0, bottom}, {0, 0, top}};
  for (const Ring& ring : rings) {
    for (int i = 0; i < sides; ++i) {
      const double angle = 2 * geodesy::kPi * i / sides;
      set.vertices.emplace_back(ring.radius * std::cos(angle), ring.radius * std::sin(angle), ring.z);
    }
  }
  const int last = static_cast<int>(rings.size()) - 1;
  const auto at = [sides](int ring, int i) {
    return static_cast<std::uint32_t>(2 + ring * sides + i % sides);
  };
  for (int i = 0; i < sides; ++i) {
    set.triangles.push_back({0, at(0, i + 1), at(0, i)});
    set.triangles.push_back({1, at(last, i), at(last, i + 1)});
    for (int ring = 0; ring < last; ++ring) {
      set.triangles.push_back({at(ring, i), at(ring, i + 1), at(ring + 1, i + 1)});
      set.triangles.push_back({at(ring, i), at(ring + 1, i + 1), at(ring + 1, i)});
    }
  }
  return set;
}

}  // namespace

TriangleSet box_mesh(const Eigen::Vector3d& size) {
  TriangleSet set;
  if (!is_extent(size)) return set;
  for (int corner = 0; corner < 8; ++corner) {
    set.vertices.emplace_back(((corner & 1) != 0 ? 0.5 : -0.5) * size.x(),
                              ((corner & 2) != 0 ? 0.5 : -0.5) * size.y(),
                              ((corner & 4) != 0 ? 0.5 : -0.5) * size.z());
  }
  set.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                   {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return set;
}

TriangleSet cylinder_mesh(double radius, double length, int sides) {
  return revolve(-length / 2, {{radius, -length / 2}, {radius, length / 2}}, length / 2, sides);
}

TriangleSet cone_mesh(double radius, double length, int sides) {
  return revolve(-length / 2, {{radius, -length / 2}}, length / 2, sides);
}

TriangleSet capsule_mesh(double radius, double length, int sides) {
  if (length < 0) return {};
  std::vector<Ring> rings;
  const int quarter = sides / 4;
  for (int ring = 1; ring <= quarter; ++ring) {
    const double angle = geodesy::kPi / 2 * ring / quarter;
    rings.push_back({radius * std::sin(angle), -length / 2 - radius * std::cos(angle)});
  }
  for (int ring = length > 0 ? quarter : quarter - 1; ring > 0; --ring) {
    const Ring& mirrored = rings[static_cast<std::size_t>(ring) - 1];
    rings.push_back({mirrored.radius, -mirrored.z});
  }
  return revolve(-length / 2 - radius, rings, length / 2 + radius, sides);
}

TriangleSet sphere_mesh(double radius, int sides) {
  std::vector<Ring> rings;
  const int count = sides / 2 - 1;
  for (int ring = 0; ring < count; ++ring) {
    const double latitude = geodesy::kPi * (ring + 1) / (count + 1) - geodesy::kPi / 2;
    rings.push_back({radius * std::cos(latitude), radius * std::sin(latitude)});
  }
  return revolve(-radius, rings, radius, sides);
}

TriangleSet ellipsoid_mesh(const Eigen::Vector3d& radii, int sides) {
  TriangleSet set = sphere_mesh(is_extent(radii) ? 1 : 0, sides);
  for (Eigen::Vector3d& v : set.vertices) v = v.cwiseProduct(radii);
  return set;
}

TriangleSet plane_mesh(const Eigen::Vector3d& normal, const Eigen::Vector2d& size) {
  const Eigen::Matrix3d turn =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), normal).toRotationMatrix();
  TriangleSet set;
  for (const auto& [x, y] : {std::pair{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}}) {
    set.vertices.emplace_back(turn * Eigen::Vector3d(x * size.x(), y * size.y(), 0));
  }
  set.triangles = {{0, 1, 2}, {0, 2, 3}};
  return set;
}

}  // namespace canyon::city
