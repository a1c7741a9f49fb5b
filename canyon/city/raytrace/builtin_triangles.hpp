#pragma once

// A bounding volume hierarchy over triangles, in doubles; replaces Embree if it is missing (CANYON_OWN_RAYS).

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <vector>

#include "canyon/city/city.hpp"

namespace canyon::raytrace {

/// Trees have no common state.
struct Tracing {};

/// A ray with its origin relative to the centre of the triangles.
struct Probe {
  Probe() = default;
  Probe(const Eigen::Vector3d& from, const Eigen::Vector3d& along, double min_range_m, double max_range_m)
      : origin(from), direction(along), min_m(min_range_m), max_m(max_range_m) {
    for (int k = 0; k < 3; ++k) inverse[k] = 1 / direction[k];
    // Woop, Benthin, Wald: Watertight Ray/Triangle Intersection, JCGT 2(1), 2013: rotates z along the ray.
    direction.cwiseAbs().maxCoeff(&axes[2]);
    axes[0] = (axes[2] + 1) % 3;
    axes[1] = (axes[0] + 1) % 3;
    if (direction[axes[2]] < 0) std::swap(axes[0], axes[1]);
    shear = {direction[axes[0]] / direction[axes[2]], direction[axes[1]] / direction[axes[2]],
             1 / direction[axes[2]]};
  }
  Eigen::Vector3d origin, direction, inverse, shear;
  std::array<int, 3> axes{};
  double min_m = 0, max_m = 0;
};

/// Triangles of a mesh for ray queries. Neighbours compute edges alike, so no ray passes between them.
class Triangles {
 public:
  struct TriangleHit {
    std::uint32_t triangle;
    double range;
  };

  Triangles() = default;
  Triangles(const Tracing& /*none*/, const city::Mesh& mesh, const Eigen::Vector3d& centre, bool /*all*/) {
    for (const Eigen::Vector3d& v : mesh.vertices) vertices_.push_back(v - centre);
    corners_ = mesh.triangles;
    order_.resize(corners_.size());
    std::iota(order_.begin(), order_.end(), 0U);
    for (const auto& t : corners_) {
      Eigen::AlignedBox3d box;
      for (const std::uint32_t corner : t) box.extend(vertices_[corner]);
      boxes_.push_back(box);
    }
    if (!corners_.empty()) split(0, static_cast<std::uint32_t>(corners_.size()));
    boxes_ = {};
  }

  [[nodiscard]] bool occluded(const Probe& probe) const {
    bool any = false;
    follow(probe, [&](const TriangleHit& /*first*/) { return any = true; });
    return any;
  }
  [[nodiscard]] std::optional<TriangleHit> first(Probe probe) const {
    std::optional<TriangleHit> nearest;
    follow(probe, [&](const TriangleHit& met) {
      nearest = met;
      probe.max_m = met.range;
      return false;
    });
    return nearest;
  }
  /// Every triangle on the ray.
  void all(const Probe& probe, std::vector<TriangleHit>& found) const {
    follow(probe, [&](const TriangleHit& met) {
      found.push_back(met);
      return false;
    });
  }

 private:
  static constexpr std::uint32_t kLeaf = 4;
  struct Node {
    Eigen::Vector3d low, high;
    std::uint32_t first = 0;  ///< leaf: its first triangle; else: second child (the next node is the first)
    std::uint32_t count = 0;  ///< of a leaf; 0: no leaf
  };

  /// Builds the tree over order_[begin, end): the cheapest split between twelve slices of the longest axis by
  /// the surface area heuristic.
  void split(std::uint32_t begin, std::uint32_t end) {
    const std::size_t number = nodes_.size();
    Eigen::AlignedBox3d box, middles;
    for (std::uint32_t i = begin; i < end; ++i) {
      box.extend(boxes_[order_[i]]);
      middles.extend(boxes_[order_[i]].center());
    }
    // Boxes are enlarged by the possible rounding of their slabs.
    const Eigen::Vector3d skin =
        Eigen::Vector3d::Constant(1e-9) + 1e-12 * box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs());
    nodes_.push_back({box.min() - skin, box.max() + skin, begin, end - begin});
    if (end - begin <= kLeaf) return;
    int axis = 0;
    const double extent = middles.sizes().maxCoeff(&axis);
    std::uint32_t middle = begin + (end - begin) / 2;
    constexpr int kSlices = 12;
    const auto slice = [&](std::uint32_t triangle) {
      const double fraction = (boxes_[triangle].center()[axis] - middles.min()[axis]) / extent;
      return std::min(kSlices - 1, static_cast<int>(kSlices * fraction));
    };
    if (extent > 0) {
      std::array<Eigen::AlignedBox3d, kSlices> slices;
      std::array<std::uint32_t, kSlices> counts{};
      for (std::uint32_t i = begin; i < end; ++i) {
        slices.at(static_cast<std::size_t>(slice(order_[i]))).extend(boxes_[order_[i]]);
        ++counts.at(static_cast<std::size_t>(slice(order_[i])));
      }
      const auto area = [](const Eigen::AlignedBox3d& b) {
        const Eigen::Vector3d s = b.sizes();
        return b.isEmpty() ? 0 : s.x() * s.y() + s.y() * s.z() + s.z() * s.x();
      };
      double cheapest = std::numeric_limits<double>::infinity();
      int best = 0;
      for (int at = 1; at < kSlices; ++at) {
        Eigen::AlignedBox3d left, right;
        std::uint32_t in_left = 0, in_right = 0;
        for (int k = 0; k < kSlices; ++k) {
          (k < at ? left : right).extend(slices.at(static_cast<std::size_t>(k)));
          (k < at ? in_left : in_right) += counts.at(static_cast<std::size_t>(k));
        }
        const double cost = area(left) * in_left + area(right) * in_right;
        if (in_left == 0 || in_right == 0 || cost >= cheapest) continue;
        cheapest = cost;
        best = at;
      }
      const auto at = std::partition(order_.begin() + begin, order_.begin() + end,
                                     [&](std::uint32_t triangle) { return slice(triangle) < best; });
      middle = static_cast<std::uint32_t>(at - order_.begin());
      if (middle == begin || middle == end) middle = begin + (end - begin) / 2;
    }
    nodes_[number].count = 0;
    split(begin, middle);
    nodes_[number].first = static_cast<std::uint32_t>(nodes_.size());
    split(middle, end);
  }

  /// Calls meet() for each triangle between the ends of the probe, until it returns true; it may shorten the
  /// far end.
  template <typename Meet>
  void follow(const Probe& probe, Meet meet) const {
    if (nodes_.empty()) return;
    std::array<std::uint32_t, 128> stack{};
    std::size_t top = 1;
    while (top > 0) {
      const Node& node = nodes_[stack.at(--top)];
      if (!reaches(probe, node)) continue;
      if (node.count == 0) {
        const auto left = static_cast<std::uint32_t>(&node - nodes_.data()) + 1;
        // Visits the nearer child first.
        const bool ahead = probe.direction.dot(nodes_[node.first].low + nodes_[node.first].high -
                                               nodes_[left].low - nodes_[left].high) > 0;
        stack.at(top++) = ahead ? node.first : left;
        stack.at(top++) = ahead ? left : node.first;
        continue;
      }
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        const std::optional<double> range = range_to(probe, corners_[order_[i]]);
        if (range && meet(TriangleHit{order_[i], *range})) return;
      }
    }
  }

  static bool reaches(const Probe& probe, const Node& node) {
    double from = probe.min_m, to = probe.max_m;
    for (int k = 0; k < 3; ++k) {
      double a = (node.low[k] - probe.origin[k]) * probe.inverse[k];
      double b = (node.high[k] - probe.origin[k]) * probe.inverse[k];
      if (a > b) std::swap(a, b);
      // NaN, for a ray in the plane of a side, has no effect.
      if (a > from) from = a;
      if (b < to) to = b;
    }
    return from <= to * (1 + 1e-12) + 1e-9;
  }

  [[nodiscard]] std::optional<double> range_to(const Probe& probe,
                                               const std::array<std::uint32_t, 3>& corners) const {
    const auto& [kx, ky, kz] = probe.axes;
    std::array<Eigen::Vector3d, 3> p;
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector3d q = vertices_[corners[i]] - probe.origin;
      p[i] = {q[kx] - probe.shear.x() * q[kz], q[ky] - probe.shear.y() * q[kz], probe.shear.z() * q[kz]};
    }
    const double u = p[2].x() * p[1].y() - p[2].y() * p[1].x();
    const double v = p[0].x() * p[2].y() - p[0].y() * p[2].x();
    const double w = p[1].x() * p[0].y() - p[1].y() * p[0].x();
    if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) return std::nullopt;
    const double sum = u + v + w;
    if (sum == 0) return std::nullopt;
    const double range = (u * p[0].z() + v * p[1].z() + w * p[2].z()) / sum;
    if (!(range > probe.min_m && range <= probe.max_m)) return std::nullopt;
    return range;
  }

  std::vector<Eigen::Vector3d> vertices_;
  std::vector<std::array<std::uint32_t, 3>> corners_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
  std::vector<Eigen::AlignedBox3d> boxes_;  ///< during the build
};

}  // namespace canyon::raytrace
