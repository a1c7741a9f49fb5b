#include "canyon/paths/propagation/index/foliage_volumes.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <tuple>
#include <utility>

#include "canyon/city/city.hpp"
#include "canyon/city/mesh_topology.hpp"

namespace canyon::propagation {
namespace {

using Eigen::Vector3d;
using Triangle = std::array<Vector3d, 3>;

constexpr double kSameRange = 1e-6;  // m
/// Triangles are extended by this fraction of their size, so that no ray passes between two.
constexpr double kRim = 1e-9;

struct Crossing {
  double range_m = 0;
  bool front = false;
};

/// T. Moeller and B. Trumbore, "Fast, minimum storage ray-triangle intersection", J. Graphics Tools 2(1),
/// 1997, both sides.
bool meet(const Vector3d& origin, const Vector3d& direction, const Triangle& t, Crossing& crossing) {
  const Vector3d u = t[1] - t[0], v = t[2] - t[0], p = direction.cross(v);
  const double determinant = u.dot(p);
  if (determinant == 0) return false;
  const Vector3d from = origin - t[0];
  const double a = from.dot(p) / determinant;
  if (!(a >= -kRim && a <= 1 + kRim)) return false;
  const Vector3d q = from.cross(u);
  const double b = direction.dot(q) / determinant;
  if (!(b >= -kRim && a + b <= 1 + kRim)) return false;
  crossing = {v.dot(q) / determinant, determinant > 0};
  return crossing.range_m > 0;
}

/// Whether a ray meets bounds, with a tolerance of a micrometre.
bool meets_bounds(const Eigen::AlignedBox3d& bounds, const Vector3d& origin, const Vector3d& direction) {
  double from = 0, to = 1e300;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = bounds.min()[axis] - kSameRange - origin[axis];
    const double high = bounds.max()[axis] + kSameRange - origin[axis];
    if (std::abs(direction[axis]) < 1e-12) {
      if (low > 0 || high < 0) return false;
      continue;
    }
    const double a = low / direction[axis], b = high / direction[axis];
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  return from <= to;
}

}  // namespace

double covered_length_m(std::vector<RangeInterval>& intervals) {
  std::sort(intervals.begin(), intervals.end(),
            [](const RangeInterval& a, const RangeInterval& b) { return a.from_m < b.from_m; });
  double covered = 0, end = -1e300;
  for (const RangeInterval& interval : intervals) {
    const double from = std::max(interval.from_m, end);
    if (interval.to_m <= from) continue;
    covered += interval.to_m - from;
    end = interval.to_m;
  }
  return covered;
}

FoliageVolumes::FoliageVolumes(const city::Mesh& mesh) {
  city::TriangleIndices corners;  // numbers of the positions
  std::uint32_t position_count = 0;
  std::vector<Triangle> triangles;
  for (const city::Object& object : mesh.objects) {
    if (object.surface != city::Surface::Foliage) continue;
    // Each object has its own positions: touching trees stay separate.
    std::map<std::tuple<double, double, double>, std::uint32_t> positions;
    for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t) {
      auto& corner = corners.emplace_back();
      auto& triangle = triangles.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        triangle[k] = mesh.vertices[mesh.triangles[t][k]];
        const auto key = std::make_tuple(triangle[k].x(), triangle[k].y(), triangle[k].z());
        const auto [found, is_new] = positions.emplace(key, position_count);
        position_count += is_new ? 1 : 0;
        corner[k] = found->second;
      }
    }
  }
  city::TriangleIndices own;
  for (const std::vector<std::uint32_t>& group : city::connected_components(corners, position_count)) {
    Volume volume;
    volume.first = triangles_.size();
    volume.count = group.size();
    double six_volumes = 0;
    own.clear();
    const Vector3d origin = triangles[group.front()][0];
    for (const std::uint32_t i : group) {
      const Triangle& t = triangles[i];
      six_volumes += (t[0] - origin).dot((t[1] - origin).cross(t[2] - origin));
      own.push_back(corners[i]);
      if (triangles_.size() % kBlock == 0) triangle_blocks_.emplace_back();
      triangles_.push_back(t);
      for (const Vector3d& corner : t) {
        triangle_blocks_.back().extend(corner);
        volume.bounds.extend(corner);
      }
    }
    // Closed: every side occurs equally often in both directions.
    volume.closed = true;
    city::each_edge(own, [&](std::span<const city::TriangleSide> sides) {
      const auto forward =
          std::count_if(sides.begin(), sides.end(), [](const auto& side) { return side.forward; });
      volume.closed = volume.closed && 2 * static_cast<std::size_t>(forward) == sides.size();
    });
    if (volume.closed && six_volumes < 0)
      for (std::size_t k = volume.first; k < triangles_.size(); ++k)
        std::swap(triangles_[k][1], triangles_[k][2]);
    if (volumes_.size() % kBlock == 0) volume_blocks_.emplace_back();
    volume_blocks_.back().extend(volume.bounds);
    volumes_.push_back(volume);
  }
}

void FoliageVolumes::append_inside(const Vector3d& origin, const Vector3d& direction,
                                   std::vector<RangeInterval>& intervals) const {
  static thread_local std::vector<Crossing> crossings;
  for (std::size_t v = 0; v < volumes_.size(); ++v) {
    if (v % kBlock == 0 && !meets_bounds(volume_blocks_[v / kBlock], origin, direction)) {
      v += kBlock - 1;
      continue;
    }
    const Volume& volume = volumes_[v];
    if (!meets_bounds(volume.bounds, origin, direction)) continue;
    crossings.clear();
    const std::size_t end = volume.first + volume.count;
    for (std::size_t i = volume.first; i < end;) {
      const std::size_t block_end = std::min(end, (i / kBlock + 1) * kBlock);
      if (meets_bounds(triangle_blocks_[i / kBlock], origin, direction)) {
        Crossing crossing;
        for (std::size_t t = i; t < block_end; ++t)
          if (meet(origin, direction, triangles_[t], crossing)) crossings.push_back(crossing);
      }
      i = block_end;
    }
    std::sort(crossings.begin(), crossings.end(),
              [](const Crossing& a, const Crossing& b) { return a.range_m < b.range_m; });
    bool inside = false, first = true;
    double entered = 0;
    for (std::size_t i = 0; i < crossings.size();) {
      const double range = crossings[i].range_m;
      bool front = false, back = false;
      for (; i < crossings.size() && crossings[i].range_m - range <= kSameRange; ++i)
        (crossings[i].front ? front : back) = true;
      if (front && back) continue;  // touches from outside, or two lobes that touch
      if (front && !inside) {
        inside = true;
        entered = range;
      } else if (back && (inside || (first && volume.closed))) {
        intervals.push_back({inside ? entered : 0, range});
        inside = false;
      }
      first = false;
    }
  }
}

}  // namespace canyon::propagation
