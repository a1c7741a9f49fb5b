#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "canyon/city/fwd.hpp"

namespace canyon::heatmap {

/// The space that can throw a shadow onto a rectangle of a horizontal plane: points p above it, at most
/// `highest` over it, whose place along the direction, p - (p.z - z) shear, lies in the rectangle.
struct ShadowReach {
  Eigen::Vector2d min, max;  ///< of the rectangle
  double z = 0;              ///< of the plane
  Eigen::Vector2d shear;     ///< horizontal way per metre of height, direction.xy / direction.z
  double highest = 0;        ///< above the plane; may be infinite

  /// Whether a box may throw a shadow. Exact by the separating axes of a rectangle and a box swept along the
  /// shear, but for rounding on its edges, where the answer is true.
  [[nodiscard]] bool meets(const Eigen::Vector3d& low, const Eigen::Vector3d& high) const {
    const double top = std::min(high.z() - z, highest), base = std::max(low.z() - z, 0.0);
    if (!(high.z() > z) || base > highest) return false;
    constexpr double kSlack_m = 1e-6;
    for (int k = 0; k < 2; ++k) {
      const double a = shear[k] * base, b = shear[k] * top;
      if (low[k] - std::max(a, b) > max[k] + kSlack_m || high[k] - std::min(a, b) < min[k] - kSlack_m) {
        return false;
      }
    }
    const double away = shear.x() * (0.5 * (low.y() + high.y()) - 0.5 * (min.y() + max.y())) -
                        shear.y() * (0.5 * (low.x() + high.x()) - 0.5 * (min.x() + max.x()));
    const double half_x = 0.5 * (high.x() - low.x() + max.x() - min.x()) + kSlack_m;
    const double half_y = 0.5 * (high.y() - low.y() + max.y() - min.y()) + kSlack_m;
    return std::abs(away) <= std::abs(shear.x()) * half_y + std::abs(shear.y()) * half_x;
  }
};

/// Boxes around boxes around the triangles of a mesh (split at the median of the longest side), so that those
/// which throw a shadow onto a tile are found without looking at the others.
class ShadowTree {
 public:
  explicit ShadowTree(const city::Mesh& mesh);

  /// The triangles in the order of visit().
  [[nodiscard]] const std::vector<std::uint32_t>& order() const { return order_; }

  /// Calls leaf(first, count) for runs of order() that hold every triangle which may reach.
  template <class Leaf>
  void visit(const ShadowReach& reach, Leaf&& leaf) const {
    if (nodes_.empty()) return;
    std::array<std::uint32_t, kDeepest> stack;
    std::size_t depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
      const Node& node = nodes_[stack[--depth]];
      if (!reach.meets(node.min, node.max)) continue;
      if (node.count > 0) {
        leaf(node.first, node.count);
      } else {
        stack[depth++] = node.first + 1;
        stack[depth++] = node.first;
      }
    }
  }

 private:
  /// Halving 2^32 triangles takes 32 steps, each of which leaves one node waiting.
  static constexpr std::size_t kDeepest = 64;
  struct Node {
    Eigen::Vector3d min, max;
    std::uint32_t first = 0;  ///< of a leaf: triangle in order(); else: node, the other child follows it
    std::uint32_t count = 0;  ///< of a leaf; 0: not a leaf
  };
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> order_;
};

}  // namespace canyon::heatmap
