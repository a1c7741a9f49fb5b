#include "canyon/heatmap/kernels/shadow_solids.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "canyon/city/mesh_topology.hpp"
#include "canyon/city/planar.hpp"
#include "canyon/heatmap/kernels/bins.hpp"

namespace canyon::heatmap {
namespace {

using city::cross;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// The tests of a part compare its triangles pair by pair.
constexpr std::size_t kMostTriangles = 4096;
constexpr double kFloorTolerance_m = 1e-6;
/// Nearer than this counts as touching.
constexpr double kContact_m = 1e-6;
/// Nearer than this to an edge, a count of crossings is in doubt.
constexpr double kDoubt_m = 1e-9;

/// A connected part with welded vertices.
class Part {
 public:
  Part(const std::vector<Vector3d>& vertices, city::TriangleIndices triangles)
      : triangles_(std::move(triangles)) {
    for (const auto& t : triangles_) {
      Corners corners;
      for (std::size_t k = 0; k < 3; ++k) {
        corners.at[k] = vertices[t[k]];
        bounds_.min = bounds_.min.cwiseMin(corners.at[k]);
        bounds_.max = bounds_.max.cwiseMax(corners.at[k]);
      }
      const Vector3d normal = (corners.at[1] - corners.at[0]).cross(corners.at[2] - corners.at[0]);
      corners.flat = !(normal.norm() > 1e-12);
      corners.normal = corners.flat ? Vector3d::Zero() : Vector3d(normal.normalized());
      corners.min = corners.at[0].cwiseMin(corners.at[1]).cwiseMin(corners.at[2]);
      corners.max = corners.at[0].cwiseMax(corners.at[1]).cwiseMax(corners.at[2]);
      corners_.push_back(corners);
    }
  }

  [[nodiscard]] bool is_solid() { return is_closed() && !crosses_itself() && winds_forward(); }
  [[nodiscard]] Solid solid() const { return {bounds_, floorless_}; }

 private:
  struct Corners {
    std::array<Vector3d, 3> at;
    Vector3d normal, min, max;
    bool flat = false;  ///< no area to speak of
  };

  bool is_closed() {
    struct Side {
      std::uint64_t edge;
      int sense;
      bool floor;
    };
    std::vector<Side> sides;
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t next = (k + 1) % 3;
        const std::uint64_t a = triangles_[t][k], b = triangles_[t][next];
        if (a == b) continue;
        const double high = std::max(corners_[t].at[k].z(), corners_[t].at[next].z());
        sides.push_back({(std::min(a, b) << 32) | std::max(a, b), a < b ? 1 : -1,
                         high <= bounds_.min.z() + kFloorTolerance_m});
      }
    }
    std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) { return x.edge < y.edge; });
    for (std::size_t i = 0; i < sides.size();) {
      int balance = 0;
      std::size_t end = i;
      for (; end < sides.size() && sides[end].edge == sides[i].edge; ++end) balance += sides[end].sense;
      if (balance != 0) {
        if (!sides[i].floor) return false;
        floorless_ = true;
      }
      i = end;
    }
    return true;
  }

  [[nodiscard]] bool crosses_itself() const {
    std::vector<std::uint32_t> order;
    for (std::uint32_t t = 0; t < corners_.size(); ++t) {
      if (!corners_[t].flat) order.push_back(t);
    }
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return corners_[a].min.x() < corners_[b].min.x(); });
    for (std::size_t i = 0; i < order.size(); ++i) {
      const Corners& a = corners_[order[i]];
      for (std::size_t j = i + 1; j < order.size(); ++j) {
        const Corners& b = corners_[order[j]];
        if (b.min.x() > a.max.x() + kContact_m) break;
        if (((b.min.array() > a.max.array() + kContact_m) || (a.min.array() > b.max.array() + kContact_m))
                .any()) {
          continue;
        }
        if (pierces(order[i], order[j]) || pierces(order[j], order[i])) return true;
      }
    }
    return false;
  }

  /// Whether a side of triangle s goes through triangle t or ends on it.
  [[nodiscard]] bool pierces(std::uint32_t s, std::uint32_t t) const {
    const Corners& plate = corners_[t];
    const auto shared = [&](std::uint32_t vertex) {
      const auto& own = triangles_[t];
      return vertex == own[0] || vertex == own[1] || vertex == own[2];
    };
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t next = (k + 1) % 3;
      if (shared(triangles_[s][k]) || shared(triangles_[s][next])) continue;
      const Vector3d& p = corners_[s].at[k];
      const Vector3d& q = corners_[s].at[next];
      const double above_p = plate.normal.dot(p - plate.at[0]);
      const double above_q = plate.normal.dot(q - plate.at[0]);
      const bool on_p = std::abs(above_p) <= kContact_m, on_q = std::abs(above_q) <= kContact_m;
      if ((on_p && on_q) || (!on_p && !on_q && (above_p > 0) == (above_q > 0))) continue;
      const Vector3d x = on_p ? p : on_q ? q : Vector3d(p + above_p / (above_p - above_q) * (q - p));
      bool within = true;
      for (std::size_t e = 0; e < 3 && within; ++e) {
        const Vector3d side = plate.at[(e + 1) % 3] - plate.at[e];
        within = side.cross(x - plate.at[e]).dot(plate.normal) >= -kContact_m * side.norm();
      }
      if (within) return true;
    }
    return false;
  }

  /// Winding number in front of each triangle, counted along a ray that rises from its centroid.
  [[nodiscard]] bool winds_forward() const {
    // The ray is steep, so that it leaves through the top, and not along streets, so that it meets no edge.
    const Vector2d shear(0.01234567, 0.02718282);
    struct Flat {
      std::array<Vector2d, 3> at;
      Vector2d min, max;  ///< with a little around
      double twice_area;
    };
    std::vector<Flat> flat;
    for (const Corners& c : corners_) {
      Flat f;
      for (std::size_t k = 0; k < 3; ++k) f.at[k] = c.at[k].head<2>() - c.at[k].z() * shear;
      f.min = f.at[0].cwiseMin(f.at[1]).cwiseMin(f.at[2]) - Vector2d::Constant(kDoubt_m);
      f.max = f.at[0].cwiseMax(f.at[1]).cwiseMax(f.at[2]) + Vector2d::Constant(kDoubt_m);
      f.twice_area = cross(f.at[1] - f.at[0], f.at[2] - f.at[0]);
      flat.push_back(f);
    }
    for (std::size_t t = 0; t < corners_.size(); ++t) {
      if (corners_[t].flat) continue;
      const Vector3d centre = (corners_[t].at[0] + corners_[t].at[1] + corners_[t].at[2]) / 3;
      const Vector2d start = centre.head<2>() - centre.z() * shear;
      // Begins in front: where the front looks down, the ray passes the triangle itself first.
      int winding = flat[t].twice_area > 0 ? 0 : -1;
      for (std::size_t k = 0; k < corners_.size(); ++k) {
        if (k == t || corners_[k].flat) continue;
        const Flat& f = flat[k];
        if (start.x() < f.min.x() || start.x() > f.max.x() || start.y() < f.min.y() ||
            start.y() > f.max.y()) {
          continue;
        }
        const double sense = f.twice_area > 0 ? 1 : -1;
        std::array<double, 3> weight;
        double smallest = 1e300;
        for (std::size_t e = 0; e < 3; ++e) {
          const Vector2d side = f.at[(e + 1) % 3] - f.at[e];
          const double area = sense * cross(side, start - f.at[e]);
          weight[(e + 2) % 3] = area;
          smallest = std::min(smallest, area / std::max(side.norm(), 1e-30));
        }
        if (smallest < -kDoubt_m) continue;
        if (smallest < kDoubt_m) return false;
        const double total = weight[0] + weight[1] + weight[2];
        const double z = (weight[0] * corners_[k].at[0].z() + weight[1] * corners_[k].at[1].z() +
                          weight[2] * corners_[k].at[2].z()) /
                         total;
        if (std::abs(z - centre.z()) < kDoubt_m) return false;
        if (z > centre.z()) winding += sense > 0 ? 1 : -1;
      }
      if (winding < 0) return false;
    }
    return true;
  }

  city::TriangleIndices triangles_;
  std::vector<Corners> corners_;
  city::Box bounds_;
  bool floorless_ = false;
};

}  // namespace

Solids find_solids(const city::Mesh& mesh) {
  Solids found;
  found.of_triangle.assign(mesh.triangles.size(), Solids::kNone);
  city::TriangleIndices welded = mesh.triangles;
  city::weld(mesh.vertices, welded);
  std::vector<std::uint32_t> used;
  for (const city::Object& object : mesh.objects) {
    const auto first = welded.begin() + object.first_triangle;
    city::TriangleIndices own(first, first + object.triangle_count);
    used.clear();
    for (const auto& t : own) used.insert(used.end(), t.begin(), t.end());
    sort_unique(used);
    std::vector<Vector3d> vertices;
    for (const std::uint32_t v : used) vertices.push_back(mesh.vertices[v]);
    for (auto& t : own) {
      for (std::uint32_t& v : t) {
        v = static_cast<std::uint32_t>(std::lower_bound(used.begin(), used.end(), v) - used.begin());
      }
    }
    for (const auto& component : city::connected_components(own, used.size())) {
      if (component.size() < 4 || component.size() > kMostTriangles) continue;
      city::TriangleIndices triangles;
      for (const std::uint32_t t : component) triangles.push_back(own[t]);
      Part part(vertices, std::move(triangles));
      if (!part.is_solid()) continue;
      for (const std::uint32_t t : component) {
        found.of_triangle[object.first_triangle + t] = static_cast<std::uint32_t>(found.solids.size());
      }
      found.solids.push_back(part.solid());
    }
  }
  return found;
}

}  // namespace canyon::heatmap
