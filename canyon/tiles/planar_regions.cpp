#include "canyon/tiles/planar_regions.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

namespace canyon::tiles {
namespace {

struct Side {
  std::uint32_t low, high;    // vertices
  std::uint32_t triangle, k;  // of the edge
};

/// Sums for the plane of least squares through triangles, weighted by area.
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
  /// The plane; by the mean normal where the points do not determine it.
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
               const RegionRule& rule)
      : vertices_(vertices), triangles_(triangles), rule_(rule), across_(neighbours(triangles)) {
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
    for (const std::uint32_t seed : seeds()) {
      if (out_.of[seed] == kNoRegion && areas_[seed] > 0) grow(seed);
    }
    return std::move(out_);
  }

 private:
  /// Flat surroundings first, larger triangles before smaller ones.
  [[nodiscard]] std::vector<std::uint32_t> seeds() const {
    std::vector<double> rank(triangles_.size());
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      double flat = 1;
      for (const std::uint32_t other : across_[t]) {
        if (other != kNoRegion) flat = std::min(flat, normals_[t].dot(normals_[other]));
      }
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
    // Thin triangles have no normal to speak of.
    if (areas_[t] > 1e-4 && normals_[t].dot(normal) < rule_.cosine) return false;
    return std::all_of(triangles_[t].begin(), triangles_[t].end(), [&](std::uint32_t v) {
      return std::abs(normal.dot(vertices_[v]) - offset) <= rule_.distance_m;
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
      for (const std::uint32_t t : across_[members[next]]) {
        if (t != kNoRegion && out_.of[t] == kNoRegion && fits(t, normal, offset)) join(t);
      }
      if (members.size() >= fit_at) {
        std::tie(normal, offset) = fit.plane();
        fit_at = members.size() * 2;
      }
    }
    const bool few = members.size() < rule_.least_triangles && fit.area() < rule_.ample_area_m2;
    if (fit.area() < rule_.least_area_m2 || few) {
      for (const std::uint32_t t : members) out_.of[t] = kNoRegion;
      return;
    }
    std::tie(normal, offset) = fit.plane();
    out_.regions.push_back({normal, offset, fit.area(), static_cast<std::uint32_t>(members.size())});
  }

  const std::vector<Eigen::Vector3d>& vertices_;
  const city::TriangleIndices& triangles_;
  RegionRule rule_;
  std::vector<std::array<std::uint32_t, 3>> across_;
  std::vector<Eigen::Vector3d> normals_;
  std::vector<double> areas_;
  PlanarRegions out_;
};

}  // namespace

std::vector<std::array<std::uint32_t, 3>> neighbours(const city::TriangleIndices& triangles) {
  std::vector<Side> sides;
  sides.reserve(triangles.size() * 3);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t a = triangles[t][k], b = triangles[t][(k + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), static_cast<std::uint32_t>(t), k});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.low, a.high, a.triangle, a.k) < std::tie(b.low, b.high, b.triangle, b.k);
  });
  std::vector<std::array<std::uint32_t, 3>> across(triangles.size(), {kNoRegion, kNoRegion, kNoRegion});
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t end = i + 1;
    while (end < sides.size() && sides[end].low == sides[i].low && sides[end].high == sides[i].high) ++end;
    if (end - i == 2) {
      across[sides[i].triangle][sides[i].k] = sides[i + 1].triangle;
      across[sides[i + 1].triangle][sides[i + 1].k] = sides[i].triangle;
    }
    i = end;
  }
  return across;
}

PlanarRegions find_regions(const std::vector<Eigen::Vector3d>& vertices,
                           const city::TriangleIndices& triangles, const RegionRule& rule) {
  return RegionGrowth(vertices, triangles, rule).find();
}

}  // namespace canyon::tiles
