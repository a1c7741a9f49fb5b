#include "canyon/city/city.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/city/mesh_topology.hpp"

namespace canyon::city {
namespace {

constexpr double kFarthestVertex_m = 1e6;
/// Cells of summarize()'s sampling along the longer side.
constexpr int kSummaryCells = 2048;

/// Marks the cells of a grid whose centres are under upward-facing triangles.
class RoofSampler {
 public:
  explicit RoofSampler(const Box& bounds) : origin_(bounds.min.head<2>()) {
    const Eigen::Vector2d size = (bounds.max - bounds.min).head<2>();
    cell_ = size.maxCoeff() / kSummaryCells;
    if (!(cell_ > 0)) return;
    columns_ = std::max(1, static_cast<int>(std::ceil(size.x() / cell_)));
    rows_ = std::max(1, static_cast<int>(std::ceil(size.y() / cell_)));
    covered_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), false);
  }

  void add(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
    const double twice = cross((b - a).head<2>(), (c - a).head<2>());
    if (covered_.empty() || !(twice > 0)) return;  // walls and undersides cover no cell
    const int first_row = row(std::min({a.y(), b.y(), c.y()}));
    const int last_row = row(std::max({a.y(), b.y(), c.y()}));
    for (int j = first_row; j <= last_row; ++j) {
      const double y = origin_.y() + (j + 0.5) * cell_;
      // The part of the row's line that is to the left of all three sides.
      double from = std::min({a.x(), b.x(), c.x()}), to = std::max({a.x(), b.x(), c.x()});
      const auto cut = [&](const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
        const double rise = v.y() - u.y();
        const double x = u.x() + (v.x() - u.x()) * (y - u.y()) / rise;
        if (rise > 0) to = std::min(to, x);
        if (rise < 0) from = std::max(from, x);
        if (rise == 0 && (v.x() - u.x()) * (y - u.y()) < 0) to = from - cell_;
      };
      cut(a, b), cut(b, c), cut(c, a);
      const int first = std::max(0, static_cast<int>(std::ceil((from - origin_.x()) / cell_ - 0.5)));
      const int last = std::min(columns_ - 1, static_cast<int>(std::floor((to - origin_.x()) / cell_ - 0.5)));
      if (first > last) continue;
      const auto begin = covered_.begin() + static_cast<std::ptrdiff_t>(j) * columns_;
      std::fill(begin + first, begin + last + 1, true);
    }
  }

  [[nodiscard]] double fraction() const {
    if (covered_.empty()) return 0;
    return static_cast<double>(std::count(covered_.begin(), covered_.end(), true)) /
           static_cast<double>(covered_.size());
  }

 private:
  [[nodiscard]] int row(double y) const {
    return std::clamp(static_cast<int>((y - origin_.y()) / cell_), 0, rows_ - 1);
  }

  Eigen::Vector2d origin_;
  double cell_ = 0;
  int columns_ = 0;
  int rows_ = 0;
  std::vector<bool> covered_;
};

}  // namespace

Surface Mesh::surface_of(std::uint32_t triangle) const {
  assert(triangle < triangles.size());
  const auto after =
      std::upper_bound(objects.begin(), objects.end(), triangle,
                       [](std::uint32_t t, const Object& object) { return t < object.first_triangle; });
  assert(after != objects.begin());
  return std::prev(after)->surface;
}

Box City::bounds() const {
  Box box;
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t index : triangle) extend(box, mesh.vertices[index]);
  return box;
}

void check_mesh(const Mesh& mesh, const std::string& name) {
  constexpr std::size_t kMax = std::numeric_limits<std::uint32_t>::max();
  if (mesh.vertices.size() > kMax || mesh.triangles.size() > kMax)
    throw InputError(fmt::format("mesh '{}' has more than {} vertices or triangles", name, kMax));
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3d& v = mesh.vertices[i];
    if (!v.allFinite()) throw InputError(fmt::format("mesh '{}': vertex {} is not finite", name, i));
    if (v.norm() > kFarthestVertex_m) {
      throw InputError(
          fmt::format("mesh '{}': vertex {} is {:.0f} km from the origin", name, i, v.norm() / 1e3),
          "give coordinates in metres about the city's origin (at most 1,000 km away)");
    }
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (const std::uint32_t index : mesh.triangles[i]) {
      if (index >= mesh.vertices.size()) {
        throw InputError(
            fmt::format("mesh '{}': triangle {} uses vertex {} of {}", name, i, index, mesh.vertices.size()));
      }
    }
  }
  if (mesh.materials.size() != mesh.triangles.size()) {
    throw InputError(fmt::format("mesh '{}' has {} materials for {} triangles", name, mesh.materials.size(),
                                 mesh.triangles.size()),
                     "give one material for each triangle");
  }
  std::size_t next = 0;
  for (const Object& object : mesh.objects) {
    if (object.first_triangle != next) {
      throw InputError(fmt::format("mesh '{}': object '{}' begins at triangle {}, not {}", name, object.name,
                                   object.first_triangle, next),
                       "let objects cover the triangles in order, without gap or overlap");
    }
    next += object.triangle_count;
  }
  if (next != mesh.triangles.size()) {
    throw InputError(
        fmt::format("mesh '{}': objects cover {} of {} triangles", name, next, mesh.triangles.size()),
        "let objects cover the triangles in order, without gap or overlap");
  }
}

std::size_t append_object(Mesh& mesh, std::string name, Surface surface, Material material,
                          const std::vector<Eigen::Vector3d>& vertices,
                          const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  return append_object(mesh, std::move(name), surface, std::vector(triangles.size(), material), vertices,
                       triangles);
}

std::size_t append_object(Mesh& mesh, std::string name, Surface surface,
                          const std::vector<Material>& materials,
                          const std::vector<Eigen::Vector3d>& vertices, const TriangleIndices& triangles) {
  constexpr std::uint32_t kMax = std::numeric_limits<std::uint32_t>::max();
  for (const auto& triangle : triangles) {
    for (const std::uint32_t index : triangle) {
      if (index >= vertices.size()) {
        throw InputError(
            fmt::format("object '{}': a triangle uses vertex {} of {}", name, index, vertices.size()));
      }
    }
  }
  if (mesh.vertices.size() + vertices.size() >= kMax || mesh.triangles.size() + triangles.size() >= kMax)
    throw InputError(fmt::format("object '{}' makes the mesh larger than {} triangles", name, kMax));
  std::unordered_map<std::uint32_t, std::uint32_t> indices;
  const auto first = static_cast<std::uint32_t>(mesh.triangles.size());
  std::size_t dropped = 0;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const auto& triangle = triangles[t];
    if (is_degenerate(vertices[triangle[0]], vertices[triangle[1]], vertices[triangle[2]])) {
      ++dropped;
      continue;
    }
    std::array<std::uint32_t, 3> posed{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [found, is_new] =
          indices.try_emplace(triangle[k], static_cast<std::uint32_t>(mesh.vertices.size()));
      if (is_new) mesh.vertices.push_back(vertices[triangle[k]]);
      posed[k] = found->second;
    }
    mesh.triangles.push_back(posed);
    mesh.materials.push_back(materials[t]);
  }
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size()) - first;
  if (count > 0) mesh.objects.push_back({std::move(name), surface, first, count});
  return dropped;
}

void note_degenerate(ReadReport& notes, std::size_t dropped) {
  if (dropped == 0) return;
  notes.add_counted(ReadReport::Level::Loss,
                    "{} degenerate triangles (area below 1e-8 m^2) dropped: no ray can hit them", {},
                    dropped);
}

CitySummary summarize(const City& city) {
  CitySummary summary;
  const Mesh& mesh = city.mesh;
  summary.triangles = mesh.triangles.size();
  summary.bounds = city.bounds();
  Box built;
  for (const Object& object : mesh.objects) {
    if (object.surface == Surface::Terrain) summary.terrain_triangles += object.triangle_count;
    if (object.surface != Surface::Building) continue;
    ++summary.buildings;
    extend(built, mesh, object);
  }
  if (summary.buildings == 0) return summary;
  summary.highest_roof_m = built.max.z();
  RoofSampler sampler(built);
  for (const Object& object : mesh.objects) {
    if (object.surface != Surface::Building) continue;
    for (std::uint32_t t = 0; t < object.triangle_count; ++t) {
      const auto& triangle = mesh.triangles[object.first_triangle + t];
      sampler.add(mesh.vertices[triangle[0]], mesh.vertices[triangle[1]], mesh.vertices[triangle[2]]);
    }
  }
  summary.built_area_fraction = sampler.fraction();
  return summary;
}

}  // namespace canyon::city
