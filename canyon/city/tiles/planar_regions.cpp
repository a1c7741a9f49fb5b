#include "canyon/city/tiles/planar_regions.hpp"

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>

namespace canyon::tiles {

namespace {

/// Minimum for the angle between a triangle's normal and its region's.
constexpr double kMinCosine = 0.85;
constexpr double kMinArea_m2 = 3, kAmpleArea_m2 = 40;
constexpr std::size_t kMinTriangles = 4;

/// Sums for the least-squares plane through triangles, weighted by area.
class PlaneFit {
 public:
  void add(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
           const Eigen::Vector3d& normal, double area) {
    if (area_ == 0) first_ = a;
    for (const Eigen::Vector3d* p : {&a, &b, &c}) {
      const Eigen::Vector3d q = *p - first_;
      sum_ += area / 3 * q;
      squares_ += area / 3 * q * q.transpose();
    }
    area_ += area;
    normal_ += area * normal;
  }
  [[nodiscard]] double area() const { return area_; }
  /// The plane; with the mean normal if the points do not determine it.
  [[nodiscard]] std::pair<Eigen::Vector3d, double> plane() const {
    const Eigen::Vector3d mean = sum_ / area_;
    const Eigen::Matrix3d spread = squares_ / area_ - mean * mean.transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
    Eigen::Vector3d normal = normal_.normalized();
    const Eigen::Vector3d& values = solver.eigenvalues();
    if (values[1] > 4 * values[0] && values[1] > 1e-6) {
      const Eigen::Vector3d fitted = solver.eigenvectors().col(0);
      if (std::abs(fitted.dot(normal)) > 0.9)
        normal = fitted.dot(normal) > 0 ? fitted : Eigen::Vector3d(-fitted);
    }
    return {normal, normal.dot(first_ + mean)};
  }

 private:
  Eigen::Vector3d first_ = Eigen::Vector3d::Zero(), sum_ = Eigen::Vector3d::Zero(),
                  normal_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares_ = Eigen::Matrix3d::Zero();
  double area_ = 0;
};

class RegionGrowth {
 public:
  RegionGrowth(const std::vector<Eigen::Vector3d>& vertices, const city::TriangleIndices& triangles,
               double distance_m)
      : vertices_(vertices),
        triangles_(triangles),
        distance_m_(distance_m),
        across_(city::neighbours(triangles)) {
    normals_.reserve(triangles.size());
    areas_.reserve(triangles.size());
    for (const auto& [a, b, c] : triangles) {
      const Eigen::Vector3d twice = (vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]);
      areas_.push_back(twice.norm() / 2);
      normals_.push_back(areas_.back() > 0 ? Eigen::Vector3d(twice / (2 * areas_.back()))
                                           : Eigen::Vector3d::Zero().eval());
    }
  }

  PlanarRegions find() {
    out_.of.assign(triangles_.size(), kNoRegion);
    for (const std::uint32_t seed : seeds())
      if (out_.of[seed] == kNoRegion && areas_[seed] > 0) grow(seed);
    return std::move(out_);
  }

 private:
  /// Flat surroundings first, larger triangles before smaller ones.
  [[nodiscard]] std::vector<std::uint32_t> seeds() const {
    std::vector<double> rank(triangles_.size());
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      double flat = 1;
      for (const std::uint32_t other : across_[t])
        if (other != city::kNoTriangle) flat = std::min(flat, normals_[t].dot(normals_[other]));
      rank[t] = std::floor(flat * 50) + std::min(areas_[t], 1e6) / 1e7;
    }
    std::vector<std::uint32_t> order(triangles_.size());
    std::iota(order.begin(), order.end(), 0U);
    std::sort(order.begin(), order.end(), [&rank](std::uint32_t a, std::uint32_t b) {
      return rank[a] != rank[b] ? rank[a] > rank[b] : a < b;
    });
    return order;
  }

  [[nodiscard]] bool fits(std::uint32_t t, const Eigen::Vector3d& normal, double offset) const {
    // Thin triangles have no reliable normal.
    if (areas_[t] > 1e-4 && normals_[t].dot(normal) < kMinCosine) return false;
    return std::all_of(triangles_[t].begin(), triangles_[t].end(), [&](std::uint32_t v) {
      return std::abs(normal.dot(vertices_[v]) - offset) <= distance_m_;
    });
  }

  void grow(std::uint32_t seed) {
    const auto number = static_cast<std::uint32_t>(out_.regions.size());
    PlaneFit fit;
    std::vector<std::uint32_t> members;
    std::size_t fit_at = 8;
    auto [normal, offset] = std::pair(normals_[seed], normals_[seed].dot(vertices_[triangles_[seed][0]]));
    const auto join = [&](std::uint32_t t) {
      out_.of[t] = number;
      members.push_back(t);
      const auto& [a, b, c] = triangles_[t];
      fit.add(vertices_[a], vertices_[b], vertices_[c], normals_[t], areas_[t]);
    };
    join(seed);
    for (std::size_t next = 0; next < members.size(); ++next) {
      for (const std::uint32_t t : across_[members[next]])
        if (t != city::kNoTriangle && out_.of[t] == kNoRegion && fits(t, normal, offset)) join(t);
      if (members.size() >= fit_at) {
        std::tie(normal, offset) = fit.plane();
        fit_at = members.size() * 2;
      }
    }
    const bool few = members.size() < kMinTriangles && fit.area() < kAmpleArea_m2;
    if (fit.area() < kMinArea_m2 || few) {
      for (const std::uint32_t t : members) out_.of[t] = kNoRegion;
      return;
    }
    std::tie(normal, offset) = fit.plane();
    out_.regions.push_back({normal, offset, fit.area(), static_cast<std::uint32_t>(members.size())});
  }

  const std::vector<Eigen::Vector3d>& vertices_;
  const city::TriangleIndices& triangles_;
  double distance_m_;
  std::vector<std::array<std::uint32_t, 3>> across_;
  std::vector<Eigen::Vector3d> normals_;
  std::vector<double> areas_;
  PlanarRegions out_;
};

constexpr int kPasses = 30;
/// Limits for normals of planes that meet in a line, or a corner.
constexpr double kSameNormal = 0.96, kMinDeterminant = 0.15;
/// Limit for the rotation of a triangle's normal: cosine.
constexpr double kMinRotation = 0.5;

double distance_to_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                            const Eigen::Vector3d& c) {
  const Eigen::Vector3d n = (b - a).cross(c - a);
  const double square = n.squaredNorm();
  const auto inside = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    return (to - from).cross(p - from).dot(n) >= 0;
  };
  if (square > 0 && inside(a, b) && inside(b, c) && inside(c, a))
    return std::abs((p - a).dot(n)) / std::sqrt(square);
  const auto to_edge = [&p](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    const Eigen::Vector3d d = to - from;
    const double length = d.squaredNorm();
    const double t = length > 0 ? std::clamp((p - from).dot(d) / length, 0.0, 1.0) : 0.0;
    return (p - from - t * d).norm();
  };
  return std::min({to_edge(a, b), to_edge(b, c), to_edge(c, a)});
}

/// The triangles around each vertex, updated explicitly.
using Fans = std::vector<std::vector<std::uint32_t>>;

Fans fans_of(std::size_t vertices, const city::TriangleIndices& triangles) {
  Fans fans(vertices);
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (const std::uint32_t v : triangles[t]) fans[v].push_back(static_cast<std::uint32_t>(t));
  return fans;
}

bool has_corner(const std::array<std::uint32_t, 3>& triangle, std::uint32_t v) {
  return triangle[0] == v || triangle[1] == v || triangle[2] == v;
}

class Decimation {
 public:
  Decimation(const std::vector<Eigen::Vector3d>& vertices, LabelledTriangles& mesh, double distance_m)
      : vertices_(vertices),
        mesh_(mesh),
        distance_m_(distance_m),
        fans_(fans_of(vertices.size(), mesh.triangles)),
        moved_(vertices.size(), 0.0) {}

  void run() {
    for (int pass = 0; pass < kPasses; ++pass) {
      std::size_t removed = 0;
      for (std::uint32_t v = 0; v < vertices_.size(); ++v) removed += !fans_[v].empty() && remove(v) ? 1 : 0;
      if (removed * 200 < mesh_.triangles.size() / 2) break;
    }
    LabelledTriangles left;
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (mesh_.triangles[t][0] == mesh_.triangles[t][1]) continue;  // removed
      left.triangles.push_back(mesh_.triangles[t]);
      left.labels.push_back(mesh_.labels[t]);
    }
    mesh_ = std::move(left);
  }

 private:
  /// A neighbour of a vertex, by the triangles that share the edge.
  struct Spoke {
    std::uint32_t to = 0;
    int triangles = 0;
    std::uint32_t label = kNoRegion;
    bool crease = false;  ///< its triangles have several labels
  };

  [[nodiscard]] std::vector<Spoke> spokes_of(std::uint32_t v) const {
    std::vector<Spoke> spokes;
    for (const std::uint32_t t : fans_[v]) {
      for (const std::uint32_t other : mesh_.triangles[t]) {
        if (other == v) continue;
        auto found =
            std::find_if(spokes.begin(), spokes.end(), [other](const Spoke& s) { return s.to == other; });
        if (found == spokes.end()) {
          spokes.push_back({other, 0, mesh_.labels[t], false});
          found = spokes.end() - 1;
        }
        ++found->triangles;
        found->crease = found->crease || found->label != mesh_.labels[t];
      }
    }
    return spokes;
  }

  bool remove(std::uint32_t v) {
    const std::vector<Spoke> spokes = spokes_of(v);
    int fixed = 0;
    for (const Spoke& spoke : spokes) {
      if (spoke.triangles > 2) return false;
      fixed += spoke.crease || spoke.triangles == 1 ? 1 : 0;
    }
    // Inside a label, on one crease or border that passes through, or at a junction of several.
    if (fixed != 0 && fixed != 2) return false;
    std::optional<std::uint32_t> best;
    double least = std::numeric_limits<double>::infinity();
    for (const Spoke& spoke : spokes) {
      if (fixed == 2 && !spoke.crease && spoke.triangles == 2) continue;
      const double cost = cost_of(v, spoke, spokes);
      if (cost < least) {
        least = cost;
        best = spoke.to;
      }
    }
    if (!best) return false;
    collapse(v, *best);
    return true;
  }

  /// Movement of the surface [m], plus a little for thin triangles; infinite if the edge must stay.
  [[nodiscard]] double cost_of(std::uint32_t v, const Spoke& spoke, const std::vector<Spoke>& spokes) const {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    // Two triangles must not end up with the same three vertices.
    std::vector<std::uint32_t> shared;
    for (const std::uint32_t t : fans_[spoke.to]) {
      for (const std::uint32_t other : mesh_.triangles[t]) {
        const bool known =
            other != v && other != spoke.to &&
            std::any_of(spokes.begin(), spokes.end(), [other](const Spoke& s) { return s.to == other; });
        if (known && std::find(shared.begin(), shared.end(), other) == shared.end()) shared.push_back(other);
      }
    }
    if (shared.size() != static_cast<std::size_t>(spoke.triangles)) return kNever;
    double nearest = kNever, thinnest = 1;
    for (const std::uint32_t t : fans_[v]) {
      if (has_corner(mesh_.triangles[t], spoke.to)) continue;
      std::array<Eigen::Vector3d, 3> old, now;
      for (std::size_t k = 0; k < 3; ++k) {
        old[k] = vertices_[mesh_.triangles[t][k]];
        now[k] = mesh_.triangles[t][k] == v ? vertices_[spoke.to] : old[k];
      }
      const Eigen::Vector3d before = (old[1] - old[0]).cross(old[2] - old[0]);
      const Eigen::Vector3d after = (now[1] - now[0]).cross(now[2] - now[0]);
      if (city::is_degenerate(now[0], now[1], now[2]) ||
          before.dot(after) < kMinRotation * before.norm() * after.norm())
        return kNever;
      const double longest = std::max({(now[1] - now[0]).squaredNorm(), (now[2] - now[1]).squaredNorm(),
                                       (now[0] - now[2]).squaredNorm()});
      thinnest = std::min(thinnest, after.norm() / longest);
      if (after.norm() < 1e-4 * longest) return kNever;
      nearest = std::min(nearest, distance_to_triangle(vertices_[v], now[0], now[1], now[2]));
    }
    if (!(moved_[v] + nearest <= distance_m_)) return kNever;
    return nearest + distance_m_ * 1e-3 * (1 - thinnest);
  }

  void collapse(std::uint32_t v, std::uint32_t to) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const std::uint32_t t : fans_[v]) {
      std::array<std::uint32_t, 3>& triangle = mesh_.triangles[t];
      if (has_corner(triangle, to)) {
        for (const std::uint32_t other : triangle) {
          if (other == v) continue;
          auto& fan = fans_[other];
          fan.erase(std::find(fan.begin(), fan.end(), t));
        }
        triangle = {0, 0, 0};
        continue;
      }
      std::replace(triangle.begin(), triangle.end(), v, to);
      fans_[to].push_back(t);
      nearest = std::min(nearest, distance_to_triangle(vertices_[v], vertices_[triangle[0]],
                                                       vertices_[triangle[1]], vertices_[triangle[2]]));
    }
    const std::vector<std::uint32_t> changed = std::move(fans_[v]);
    fans_[v].clear();
    if (!std::isfinite(nearest)) return;
    const double moved = moved_[v] + nearest;
    for (const std::uint32_t t : changed) {
      if (mesh_.triangles[t][0] == mesh_.triangles[t][1]) continue;  // removed
      for (const std::uint32_t corner : mesh_.triangles[t]) moved_[corner] = std::max(moved_[corner], moved);
    }
  }

  const std::vector<Eigen::Vector3d>& vertices_;
  LabelledTriangles& mesh_;
  double distance_m_;
  Fans fans_;
  std::vector<double> moved_;  ///< maximum movement of the surface around each vertex
};

/// The nearest point to `from` on one plane, the line of two or the corner of three.
Eigen::Vector3d on_planes(const Eigen::Vector3d& from, const std::vector<const PlanarRegion*>& planes) {
  Eigen::MatrixXd normals(static_cast<Eigen::Index>(planes.size()), 3);
  Eigen::VectorXd gaps(static_cast<Eigen::Index>(planes.size()));
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    normals.row(row) = planes[i]->normal.transpose();
    gaps[row] = planes[i]->offset - planes[i]->normal.dot(from);
  }
  return from + normals.transpose() * (normals * normals.transpose()).ldlt().solve(gaps);
}

/// Up to three of the planes, the largest first, that intersect at large angles.
std::vector<const PlanarRegion*> independent(std::vector<const PlanarRegion*> planes) {
  std::sort(planes.begin(), planes.end(),
            [](const auto* a, const auto* b) { return a->area_m2 > b->area_m2; });
  std::vector<const PlanarRegion*> out;
  for (const PlanarRegion* plane : planes) {
    if (out.empty()) {
      out.push_back(plane);
    } else if (out.size() == 1) {
      if (std::abs(out[0]->normal.dot(plane->normal)) < kSameNormal) out.push_back(plane);
    } else if (out.size() == 2) {
      if (std::abs(out[0]->normal.cross(out[1]->normal).dot(plane->normal)) > kMinDeterminant)
        out.push_back(plane);
    }
  }
  return out;
}

}  // namespace

PlanarRegions find_regions(const std::vector<Eigen::Vector3d>& vertices,
                           const city::TriangleIndices& triangles, double distance_m) {
  return RegionGrowth(vertices, triangles, distance_m).find();
}

void flatten_regions(std::vector<Eigen::Vector3d>& vertices, const city::TriangleIndices& triangles,
                     const PlanarRegions& regions, double distance_m) {
  std::vector<std::vector<std::uint32_t>> faces_by_vertex(vertices.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const std::uint32_t region = regions.of[t];
    if (region == kNoRegion) continue;
    for (const std::uint32_t v : triangles[t]) {
      auto& known = faces_by_vertex[v];
      if (std::find(known.begin(), known.end(), region) == known.end()) known.push_back(region);
    }
  }
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    if (faces_by_vertex[v].empty()) continue;
    std::vector<const PlanarRegion*> planes;
    for (const std::uint32_t region : faces_by_vertex[v]) planes.push_back(&regions.regions[region]);
    planes = independent(std::move(planes));
    for (; !planes.empty(); planes.pop_back()) {
      const Eigen::Vector3d to = on_planes(vertices[v], planes);
      if (!((to - vertices[v]).norm() <= 2 * distance_m)) continue;
      vertices[v] = to;
      break;
    }
  }
}

void decimate(const std::vector<Eigen::Vector3d>& vertices, LabelledTriangles& mesh, double distance_m) {
  Decimation(vertices, mesh, distance_m).run();
}

}  // namespace canyon::tiles
