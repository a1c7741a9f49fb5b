#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "canyon/city/city.hpp"

namespace canyon::test {

struct LocatedTriangle {
  std::array<Eigen::Vector3d, 3> corners;
  city::Material material = city::Material::Unknown;
};

/// The first difference of two cities of the same objects in the same order, corners compared to
/// `tolerance_m`; "" if there is none. Indices may differ, and the order of an object's triangles of
/// different materials.
inline std::string difference_of(const city::City& a, const city::City& b, double tolerance_m) {
  using city::Mesh;
  const auto count = [](const char* what, std::size_t x, std::size_t y) {
    return std::to_string(x) + " and " + std::to_string(y) + " " + what;
  };
  if (a.mesh.objects.size() != b.mesh.objects.size()) {
    return count("objects", a.mesh.objects.size(), b.mesh.objects.size());
  }
  const auto triangles_of = [](const Mesh& mesh, const city::Object& object) {
    std::vector<LocatedTriangle> triangles;
    for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t) {
      LocatedTriangle triangle;
      for (std::size_t i = 0; i < 3; ++i) triangle.corners[i] = mesh.vertices[mesh.triangles[t][i]];
      triangle.material = mesh.materials[t];
      triangles.push_back(triangle);
    }
    std::stable_sort(triangles.begin(), triangles.end(),
                     [](const auto& x, const auto& y) { return x.material < y.material; });
    return triangles;
  };
  for (std::size_t i = 0; i < a.mesh.objects.size(); ++i) {
    const city::Object& x = a.mesh.objects[i];
    const city::Object& y = b.mesh.objects[i];
    const std::string where = "object " + std::to_string(i) + " '" + x.name + "': ";
    if (x.name != y.name) return where + "is named '" + y.name + "'";
    if (x.surface != y.surface) return where + "surface differs";
    const auto s = triangles_of(a.mesh, x);
    const auto t = triangles_of(b.mesh, y);
    if (s.size() != t.size()) return where + count("triangles", s.size(), t.size());
    for (std::size_t k = 0; k < s.size(); ++k) {
      if (s[k].material != t[k].material) return where + "material differs";
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const double distance = (s[k].corners[corner] - t[k].corners[corner]).norm();
        if (!(distance <= tolerance_m)) return where + "corner moved by " + std::to_string(distance) + " m";
      }
    }
  }
  return "";
}

/// The city with its objects in the order of their names (equal names: of their lowest corner, x then y then
/// z).
inline city::City by_name(const city::City& city) {
  const city::Mesh& mesh = city.mesh;
  std::vector<std::pair<std::array<double, 3>, city::Object>> objects;
  for (const city::Object& object : mesh.objects) {
    std::array<double, 3> lowest{1e300, 0, 0};
    for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t) {
      for (const std::uint32_t v : mesh.triangles[t]) {
        // To a decimetre, so that rounding does not change the order.
        const Eigen::Vector3d p = (10 * mesh.vertices[v]).array().round();
        lowest = std::min(lowest, {p.x(), p.y(), p.z()});
      }
    }
    objects.emplace_back(lowest, object);
  }
  std::sort(objects.begin(), objects.end(), [](const auto& a, const auto& b) {
    return a.second.name != b.second.name ? a.second.name < b.second.name : a.first < b.first;
  });
  city::City sorted = city;
  sorted.mesh.triangles.clear();
  sorted.mesh.materials.clear();
  sorted.mesh.objects.clear();
  for (auto& [lowest, object] : objects) {
    const std::uint32_t first = object.first_triangle;
    object.first_triangle = static_cast<std::uint32_t>(sorted.mesh.triangles.size());
    for (std::uint32_t t = first; t < first + object.triangle_count; ++t) {
      sorted.mesh.triangles.push_back(mesh.triangles[t]);
      sorted.mesh.materials.push_back(mesh.materials[t]);
    }
    sorted.mesh.objects.push_back(object);
  }
  return sorted;
}

}  // namespace canyon::test
