#include "canyon/heatmap/kernels/shadow_tree.hpp"

#include <algorithm>
#include <numeric>

#include "canyon/city/city.hpp"

namespace canyon::heatmap {
namespace {

using Eigen::Vector3d;

constexpr std::uint32_t kLeafTriangles = 8;

}  // namespace

ShadowTree::ShadowTree(const city::Mesh& mesh) : order_(mesh.triangles.size()) {
  std::iota(order_.begin(), order_.end(), 0U);
  if (order_.empty()) return;
  std::vector<Vector3d> low, high;
  low.reserve(order_.size());
  high.reserve(order_.size());
  for (const auto& t : mesh.triangles) {
    const Vector3d &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    low.emplace_back(a.cwiseMin(b).cwiseMin(c));
    high.emplace_back(a.cwiseMax(b).cwiseMax(c));
  }
  struct Task {
    std::uint32_t node, first, count;
  };
  std::vector<Task> tasks{{0, 0, static_cast<std::uint32_t>(order_.size())}};
  nodes_.resize(1);
  while (!tasks.empty()) {
    const Task task = tasks.back();
    tasks.pop_back();
    Vector3d min = Vector3d::Constant(1e300), max = -min;
    for (std::uint32_t i = task.first; i < task.first + task.count; ++i) {
      min = min.cwiseMin(low[order_[i]]);
      max = max.cwiseMax(high[order_[i]]);
    }
    nodes_[task.node].min = min;
    nodes_[task.node].max = max;
    if (task.count <= kLeafTriangles) {
      nodes_[task.node].first = task.first;
      nodes_[task.node].count = task.count;
      continue;
    }
    int axis = 0;
    (max - min).maxCoeff(&axis);
    const std::uint32_t half = task.count / 2;
    const auto begin = order_.begin() + task.first;
    std::nth_element(begin, begin + half, begin + task.count, [&](std::uint32_t a, std::uint32_t b) {
      const double at_a = low[a][axis] + high[a][axis], at_b = low[b][axis] + high[b][axis];
      return at_a != at_b ? at_a < at_b : a < b;
    });
    const auto child = static_cast<std::uint32_t>(nodes_.size());
    nodes_.resize(nodes_.size() + 2);
    nodes_[task.node].first = child;
    nodes_[task.node].count = 0;
    tasks.push_back({child, task.first, half});
    tasks.push_back({child + 1, task.first + half, task.count - half});
  }
}

}  // namespace canyon::heatmap
