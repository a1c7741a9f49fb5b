#include "canyon/city/mesh_topology.hpp"

#include <numeric>
#include <unordered_map>
#include <utility>

#include "canyon/base/arithmetic.hpp"
#include "canyon/base/random.hpp"

namespace canyon::city {
namespace {

constexpr double kSmallestArea_m2 = 1e-8;
constexpr double kBasePlaneTolerance_m = 1e-3;

struct PositionHash {
  std::size_t operator()(const std::array<double, 3>& p) const {
    std::uint64_t h = 0;
    for (const double x : p) h = mix64(h ^ same_bytes<std::uint64_t>(x)) + kGolden64;
    return static_cast<std::size_t>(h);
  }
};

/// Two triangles at one edge, and whether they traverse it in opposite directions as neighbours should.
struct Neighbour {
  std::uint32_t triangle = 0;
  bool agrees = true;
};

/// A component with its base plane.
class Surroundings {
 public:
  Surroundings(const std::vector<Eigen::Vector3d>& vertices, const TriangleIndices& triangles)
      : vertices_(vertices), lowest_z_(vertices[triangles.front()[0]].z()) {
    for (const auto& triangle : triangles)
      for (const std::uint32_t v : triangle) lowest_z_ = std::min(lowest_z_, vertices[v].z());
  }
  [[nodiscard]] double lowest_z() const { return lowest_z_; }
  [[nodiscard]] bool at_base(std::uint64_t edge) const { return low(edge >> 32) && low(edge & 0xFFFFFFFFU); }
  [[nodiscard]] bool is_floor(const std::array<std::uint32_t, 3>& t) const {
    return low(t[0]) && low(t[1]) && low(t[2]);
  }

 private:
  [[nodiscard]] bool low(std::uint64_t v) const {
    return vertices_[static_cast<std::size_t>(v)].z() - lowest_z_ <= kBasePlaneTolerance_m;
  }
  const std::vector<Eigen::Vector3d>& vertices_;
  double lowest_z_;
};

/// For each triangle those across edges of exactly two. Two walls on one edge of the base plane are not
/// neighbours: they belong to two extrusions without floors, like a podium and its tower, or two houses.
std::vector<std::vector<Neighbour>> neighbours_of(const TriangleIndices& triangles,
                                                  const Surroundings& around, bool& manifold) {
  std::vector<std::vector<Neighbour>> result(triangles.size());
  each_edge(triangles, [&](std::span<const TriangleSide> sides) {
    manifold = manifold && sides.size() <= 2;
    if (sides.size() != 2) return;
    const TriangleSide &a = sides[0], &b = sides[1];
    const bool two_walls = around.at_base(a.edge) && !around.is_floor(triangles[a.triangle]) &&
                           !around.is_floor(triangles[b.triangle]);
    if (two_walls) return;
    result[a.triangle].push_back({b.triangle, a.forward != b.forward});
    result[b.triangle].push_back({a.triangle, a.forward != b.forward});
  });
  return result;
}

/// Triangles joined through neighbours, and those that must be flipped so that all agree.
struct Patch {
  std::vector<std::uint32_t> triangles;
  std::vector<std::uint32_t> flip;  ///< the minority
  bool orientable = true;           ///< if not, `flip` is empty
};

std::vector<Patch> patches_of(const std::vector<std::vector<Neighbour>>& neighbours) {
  std::vector<Patch> patches;
  std::vector<bool> rotation(neighbours.size(), false);
  std::vector<bool> seen(neighbours.size(), false);
  for (std::uint32_t seed = 0; seed < neighbours.size(); ++seed) {
    if (seen[seed]) continue;
    seen[seed] = true;
    Patch patch;
    patch.triangles.push_back(seed);
    for (std::size_t next = 0; next < patch.triangles.size(); ++next) {
      const std::uint32_t t = patch.triangles[next];
      for (const Neighbour& n : neighbours[t]) {
        const bool wanted = n.agrees ? rotation[t] : !rotation[t];
        if (!seen[n.triangle]) {
          seen[n.triangle] = true;
          rotation[n.triangle] = wanted;
          patch.triangles.push_back(n.triangle);
        } else if (rotation[n.triangle] != wanted) {
          patch.orientable = false;
        }
      }
    }
    std::vector<std::uint32_t> kept;
    for (const std::uint32_t t : patch.triangles) (rotation[t] ? patch.flip : kept).push_back(t);
    if (patch.flip.size() > kept.size()) patch.flip.swap(kept);
    if (!patch.orientable) patch.flip.clear();
    patches.push_back(std::move(patch));
  }
  return patches;
}

/// Whether the triangles have no boundary except in the base plane: any other edge is traversed equally often
/// in both directions.
bool encloses(const TriangleIndices& triangles, const Surroundings& around) {
  bool closed = true;
  each_edge(triangles, [&](std::span<const TriangleSide> sides) {
    const auto forward =
        std::count_if(sides.begin(), sides.end(), [](const TriangleSide& s) { return s.forward; });
    const bool balanced = 2 * static_cast<std::size_t>(forward) == sides.size();
    closed = closed && (balanced || around.at_base(sides[0].edge));
  });
  return closed;
}

void flip_triangle(std::array<std::uint32_t, 3>& triangle) {
  std::swap(triangle[1], triangle[2]);
}

/// Volume [m^3] by the divergence theorem, relative to a point in the plane of the lowest vertex: a missing
/// floor in that plane contributes nothing.
double enclosed_volume(const std::vector<Eigen::Vector3d>& vertices, const TriangleIndices& triangles,
                       double lowest_z) {
  Eigen::Vector3d origin = vertices[triangles.front()[0]];
  origin.z() = lowest_z;
  double six_volumes = 0;
  for (const auto& t : triangles) {
    const Eigen::Vector3d a = vertices[t[0]] - origin;
    const Eigen::Vector3d b = vertices[t[1]] - origin;
    const Eigen::Vector3d c = vertices[t[2]] - origin;
    six_volumes += a.dot(b.cross(c));
  }
  return six_volumes / 6;
}

}  // namespace

std::vector<TriangleSide> sorted_sides(const TriangleIndices& triangles) {
  std::vector<TriangleSide> sides;
  sides.reserve(triangles.size() * 3);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint64_t a = triangles[t][k];
      const std::uint64_t b = triangles[t][(k + 1) % 3];
      sides.push_back({(std::min(a, b) << 32) | std::max(a, b), static_cast<std::uint32_t>(t), k, a < b});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const TriangleSide& x, const TriangleSide& y) {
    return x.edge != y.edge ? x.edge < y.edge : x.triangle < y.triangle;
  });
  return sides;
}

bool is_degenerate(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  return !((b - a).cross(c - a).norm() >= 2 * kSmallestArea_m2);
}

bool face_up(const std::vector<Eigen::Vector3d>& vertices, TriangleIndices& triangles) {
  double up = 0, area = 0;
  for (const auto& triangle : triangles) {
    const Eigen::Vector3d normal = normal_of(vertices, triangle);
    up += normal.z();
    area += normal.norm();
  }
  if (up >= -1e-6 * area) return false;
  for (auto& triangle : triangles) flip_triangle(triangle);
  return true;
}

void weld(const std::vector<Eigen::Vector3d>& vertices, TriangleIndices& triangles) {
  std::unordered_map<std::array<double, 3>, std::uint32_t, PositionHash> first_at;
  first_at.reserve(vertices.size());
  std::vector<std::uint32_t> first(vertices.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    // + 0.0 maps -0 to 0.
    const std::array<double, 3> key{vertices[i].x() + 0.0, vertices[i].y() + 0.0, vertices[i].z() + 0.0};
    first[i] = first_at.emplace(key, static_cast<std::uint32_t>(i)).first->second;
  }
  for (auto& triangle : triangles)
    for (std::uint32_t& index : triangle) index = first[index];
}

std::vector<std::array<std::uint32_t, 3>> neighbours(const TriangleIndices& triangles) {
  std::vector<std::array<std::uint32_t, 3>> across(triangles.size(), {kNoTriangle, kNoTriangle, kNoTriangle});
  each_edge(triangles, [&](std::span<const TriangleSide> sides) {
    if (sides.size() != 2) return;
    across[sides[0].triangle][sides[0].corner] = sides[1].triangle;
    across[sides[1].triangle][sides[1].corner] = sides[0].triangle;
  });
  return across;
}

std::vector<std::vector<std::uint32_t>> connected_components(const TriangleIndices& triangles,
                                                             std::size_t vertex_count) {
  std::vector<std::uint32_t> parent(vertex_count);
  std::iota(parent.begin(), parent.end(), 0U);
  const auto root = [&parent](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const auto& triangle : triangles) {
    parent[root(triangle[1])] = root(triangle[0]);
    parent[root(triangle[2])] = root(triangle[0]);
  }
  std::unordered_map<std::uint32_t, std::size_t> number;
  std::vector<std::vector<std::uint32_t>> components;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const auto [found, is_new] = number.emplace(root(triangles[t][0]), components.size());
    if (is_new) components.emplace_back();
    components[found->second].push_back(static_cast<std::uint32_t>(t));
  }
  return components;
}

OrientedSolids orient_outwards(const std::vector<Eigen::Vector3d>& vertices, TriangleIndices& triangles) {
  OrientedSolids result;
  if (triangles.empty()) return result;
  const Surroundings around(vertices, triangles);
  const std::vector<Patch> patches = patches_of(neighbours_of(triangles, around, result.manifold));
  for (const Patch& patch : patches) {
    result.orientable = result.orientable && patch.orientable;
    for (const std::uint32_t t : patch.flip) flip_triangle(triangles[t]);
    std::size_t flipped = patch.flip.size();
    TriangleIndices own;
    for (const std::uint32_t t : patch.triangles) own.push_back(triangles[t]);
    if (patch.orientable && encloses(own, around) && enclosed_volume(vertices, own, around.lowest_z()) < 0) {
      for (const std::uint32_t t : patch.triangles) flip_triangle(triangles[t]);
      flipped = patch.triangles.size() - flipped;
    }
    result.flipped_count += flipped;
  }
  result.closed = encloses(triangles, around);
  result.volume_m3 = enclosed_volume(vertices, triangles, around.lowest_z());
  return result;
}

}  // namespace canyon::city
