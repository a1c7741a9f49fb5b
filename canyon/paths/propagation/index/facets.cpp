#include "canyon/paths/propagation/index/facets.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>

#include "canyon/base/arithmetic.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/mesh_topology.hpp"

namespace canyon::propagation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPlaneTolerance = 0.5e-3;  // m
const double kNormalTolerance = std::cos(geodesy::radians(0.5));
constexpr double kEdgeSlack = 1e-9;  // m

/// Neighbours of each triangle across its edges: neighbours[offsets[t]] to neighbours[offsets[t + 1]].
struct Adjacency {
  std::vector<std::uint32_t> offsets, neighbours;

  explicit Adjacency(const city::Mesh& mesh) {
    city::TriangleIndices welded = mesh.triangles;
    city::weld(mesh.vertices, welded);
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
    city::each_edge(welded, [&](std::span<const city::TriangleSide> sides) {
      for (const city::TriangleSide& from : sides) {
        for (const city::TriangleSide& to : sides)
          if (&from != &to) pairs.emplace_back(from.triangle, to.triangle);
      }
    });
    std::sort(pairs.begin(), pairs.end());
    offsets.assign(mesh.triangles.size() + 1, 0);
    for (const auto& [from, to] : pairs) {
      ++offsets[from + 1];
      neighbours.push_back(to);
    }
    std::partial_sum(offsets.begin(), offsets.end(), offsets.begin());
  }
};

/// Twice the area of (a, b, p): positive if p is left of a -> b.
double side(const Vector2d& a, const Vector2d& b, const Vector2d& p) {
  return (b.x() - a.x()) * (p.y() - a.y()) - (b.y() - a.y()) * (p.x() - a.x());
}

/// One block of kLanes facets, all in floats, written for vectorization.
CANYON_CLONES void mark_lanes(const float* __restrict nx, const float* __restrict ny,
                              const float* __restrict nz, const float* __restrict height,
                              const float* __restrict lx, const float* __restrict ly,
                              const float* __restrict lz, const float* __restrict hx,
                              const float* __restrict hy, const float* __restrict hz, std::size_t count,
                              float sx, float sy, float sz, float min_cosine, float reach,
                              std::uint8_t* __restrict marks) {
  // Roundings of the cosine (three products and factors) move the reflection point along s.
  constexpr float kCosineError = 4e-7f;
  for (std::size_t i = 0; i < count; ++i) {
    const float cosine = nx[i] * sx + ny[i] * sy + nz[i] * sz;
    const float inverse = 1 / cosine;  // if cosine <= 0 the first test fails
    const float leg = height[i] * inverse;
    const float error = leg * inverse * kCosineError;
    const float twice = -2 * height[i];
    const float x = sx * leg + twice * nx[i];
    const float y = sy * leg + twice * ny[i];
    const float z = sz * leg + twice * nz[i];
    const int hit = static_cast<int>(cosine >= min_cosine) & static_cast<int>(leg - error <= reach) &
                    static_cast<int>(x + error >= lx[i]) & static_cast<int>(x - error <= hx[i]) &
                    static_cast<int>(y + error >= ly[i]) & static_cast<int>(y - error <= hy[i]) &
                    static_cast<int>(z + error >= lz[i]) & static_cast<int>(z - error <= hz[i]);
    marks[i] = static_cast<std::uint8_t>(hit);
  }
}

/// Start of empty bounds.
constexpr float kNowhere = 1e30F;

/// Normals in floats, and the antenna's height over each plane: 0 if it is not above `clearance` and twice
/// the deviation.
CANYON_CLONES void make_normals(const double* __restrict nx, const double* __restrict ny,
                                const double* __restrict nz, const double* __restrict offset,
                                const double* __restrict deviation, std::size_t count, double ax, double ay,
                                double az, double clearance, float* __restrict normal_x,
                                float* __restrict normal_y, float* __restrict normal_z,
                                float* __restrict height) {
  for (std::size_t i = 0; i < count; ++i) {
    const double over = ((nx[i] * ax + ny[i] * ay) + nz[i] * az) - offset[i];
    const double least = clearance + 2 * deviation[i];
    normal_x[i] = static_cast<float>(nx[i]);
    normal_y[i] = static_cast<float>(ny[i]);
    normal_z[i] = static_cast<float>(nz[i]);
    // Products instead of choices: compilers turn choices into branches and then do not vectorize.
    height[i] = static_cast<float>(over * static_cast<double>(static_cast<int>(over > least)));
  }
}

/// Bounds along one axis relative to the antenna, widened; empty if the height is 0.
CANYON_CLONES void make_bounds(const double* __restrict low, const double* __restrict high,
                               const float* __restrict height, std::size_t count, double at,
                               float* __restrict min, float* __restrict max) {
  for (std::size_t i = 0; i < count; ++i) {
    const double from = low[i] - at, to = high[i] - at;
    const double slack = 2e-3 + 1e-6 * (std::abs(from) + std::abs(to));
    const float away = 2 * kNowhere * static_cast<float>(static_cast<int>(height[i] <= 0));
    min[i] = static_cast<float>(from - slack) + away;
    max[i] = static_cast<float>(to + slack) - away;
  }
}

}  // namespace

void FacingFacets::fill(const NearFacets& near, const Vector3d& antenna, double clearance_m) {
  facet = near.facet;
  const std::size_t count = facet.size(), padded = (count + kLanes - 1) / kLanes * kLanes;
  for (auto* v : {&normal_x, &normal_y, &normal_z, &height, &min_x, &min_y, &min_z, &max_x, &max_y, &max_z})
    v->resize(padded);
  make_normals(near.normal_x.data(), near.normal_y.data(), near.normal_z.data(), near.offset.data(),
               near.deviation.data(), count, antenna.x(), antenna.y(), antenna.z(), clearance_m,
               normal_x.data(), normal_y.data(), normal_z.data(), height.data());
  const auto position = [&](const std::vector<double>& low, const std::vector<double>& high, double at,
                            std::vector<float>& min, std::vector<float>& max) {
    make_bounds(low.data(), high.data(), height.data(), count, at, min.data(), max.data());
    std::fill(min.begin() + static_cast<std::ptrdiff_t>(count), min.end(), kNowhere);
    std::fill(max.begin() + static_cast<std::ptrdiff_t>(count), max.end(), -kNowhere);
  };
  position(near.min_x, near.max_x, antenna.x(), min_x, max_x);
  position(near.min_y, near.max_y, antenna.y(), min_y, max_y);
  position(near.min_z, near.max_z, antenna.z(), min_z, max_z);
  for (auto* v : {&normal_x, &normal_y, &normal_z, &height})
    std::fill(v->begin() + static_cast<std::ptrdiff_t>(count), v->end(), 0.0F);
}

void mark_reflecting(const FacingFacets& facing, const Vector3d& s, double min_cosine, double reach_m,
                     std::vector<std::uint8_t>& marks) {
  const std::size_t count = facing.height.size();
  marks.resize(count);
  const auto cosine = static_cast<float>(min_cosine - 1e-6);
  const auto reach = static_cast<float>(reach_m * (1 + 1e-6) + 1e-3);
  mark_lanes(facing.normal_x.data(), facing.normal_y.data(), facing.normal_z.data(), facing.height.data(),
             facing.min_x.data(), facing.min_y.data(), facing.min_z.data(), facing.max_x.data(),
             facing.max_y.data(), facing.max_z.data(), count, static_cast<float>(s.x()),
             static_cast<float>(s.y()), static_cast<float>(s.z()), cosine, reach, marks.data());
}

FacetSet::FacetSet(const city::Mesh& mesh, bool with_terrain) {
  find_facets(mesh, with_terrain);
  order_in_blocks();
}

void FacetSet::find_facets(const city::Mesh& mesh, bool with_terrain) {
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  std::vector<char> free(count, 0);  // reflects and is in no facet yet
  for (const city::Object& object : mesh.objects) {
    const bool reflects = object.surface == city::Surface::Building ||
                          object.surface == city::Surface::Vehicle ||
                          (object.surface == city::Surface::Terrain && with_terrain);
    if (reflects) std::fill_n(free.begin() + object.first_triangle, object.triangle_count, char{1});
  }
  const Adjacency adjacency(mesh);  // first: its temporary memory is large
  std::vector<double> area(count);
  std::vector<Vector3d> normal(count);
  for (std::uint32_t t = 0; t < count; ++t) {
    normal[t] = city::normal_of(mesh.vertices, mesh.triangles[t]);
    area[t] = normal[t].norm();
    if (!(area[t] > 0))
      free[t] = 0;
    else
      normal[t] /= area[t];
  }
  // Largest first: its plane is the most accurate of the group.
  std::vector<std::uint32_t> seeds(count);
  std::iota(seeds.begin(), seeds.end(), 0u);
  std::stable_sort(seeds.begin(), seeds.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return area[a] > area[b]; });
  flat_.reserve(count);
  std::vector<std::uint32_t> group;
  for (const std::uint32_t seed : seeds) {
    if (free[seed] == 0) continue;
    free[seed] = 0;
    group.assign(1, seed);
    const double offset = normal[seed].dot(mesh.vertices[mesh.triangles[seed][0]]);
    for (std::size_t i = 0; i < group.size(); ++i) {
      for (std::uint32_t k = adjacency.offsets[group[i]]; k < adjacency.offsets[group[i] + 1]; ++k) {
        const std::uint32_t next = adjacency.neighbours[k];
        if (free[next] == 0 || normal[next].dot(normal[seed]) < kNormalTolerance) continue;
        const auto& corners = mesh.triangles[next];
        const bool in_plane = std::all_of(corners.begin(), corners.end(), [&](std::uint32_t v) {
          return std::abs(normal[seed].dot(mesh.vertices[v]) - offset) <= kPlaneTolerance;
        });
        if (!in_plane) continue;
        free[next] = 0;
        group.push_back(next);
      }
    }
    add_facet(mesh, group);
  }
  flat_.shrink_to_fit();
}

void FacetSet::add_facet(const city::Mesh& mesh, std::vector<std::uint32_t>& group) {
  Facet facet;
  Vector3d sum = Vector3d::Zero();
  for (const std::uint32_t t : group) sum += city::normal_of(mesh.vertices, mesh.triangles[t]);
  facet.normal = sum.normalized();
  facet.min = Vector3d::Constant(1e300);
  facet.max = Vector3d::Constant(-1e300);
  double low = 1e300, high = -1e300;
  for (const std::uint32_t t : group) {
    for (const std::uint32_t v : mesh.triangles[t]) {
      facet.min = facet.min.cwiseMin(mesh.vertices[v]);
      facet.max = facet.max.cwiseMax(mesh.vertices[v]);
      const double height = facet.normal.dot(mesh.vertices[v]);
      low = std::min(low, height);
      high = std::max(high, height);
    }
  }
  facet.offset = 0.5 * (low + high);
  facet.deviation = 0.5 * (high - low);
  facet.normal.cwiseAbs().maxCoeff(&facet.axis);
  facet.first = static_cast<std::uint32_t>(flat_.size());
  facet.count = static_cast<std::uint32_t>(group.size());
  facet.first_bounds = static_cast<std::uint32_t>(flat_bounds_.size());
  facet.first_wide_bounds = static_cast<std::uint32_t>(wide_bounds_.size());

  const int u = (facet.axis + 1) % 3, v = (facet.axis + 2) % 3;
  order_compactly(group.data(), group.data() + group.size(), kFlatBlock, [&](std::uint32_t t) -> Vector3d {
    const auto& c = mesh.triangles[t];
    return mesh.vertices[c[0]] + mesh.vertices[c[1]] + mesh.vertices[c[2]];
  });
  const bool blocks = facet.count > kFlatBlock, wide_blocks = facet.count > kFlatBlock * kFlatBlock;
  for (std::size_t i = 0; i < group.size(); ++i) {
    if (blocks && i % kFlatBlock == 0) flat_bounds_.emplace_back();
    if (wide_blocks && i % (std::size_t{kFlatBlock} * kFlatBlock) == 0) wide_bounds_.emplace_back();
    FlatTriangle flat;
    flat.triangle = group[i];
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3d& corner = mesh.vertices[mesh.triangles[group[i]][k]];
      flat.corner[k] = {corner[u], corner[v]};
      if (blocks) flat_bounds_.back().extend(flat.corner[k]);
      if (wide_blocks) wide_bounds_.back().extend(flat.corner[k]);
    }
    // Seen along the axis the triangle is flipped if the normal points the other way.
    if (facet.normal[facet.axis] < 0) std::swap(flat.corner[1], flat.corner[2]);
    flat_.push_back(flat);
  }
  facets_.push_back(facet);
}

void FacetSet::order_in_blocks() {
  std::vector<std::uint32_t> order(facets_.size());
  std::iota(order.begin(), order.end(), 0u);
  order_compactly(order.data(), order.data() + order.size(), kBlock,
                  [this](std::uint32_t i) -> Vector3d { return facets_[i].min + facets_[i].max; });
  std::vector<Facet> ordered;
  ordered.reserve(facets_.size());
  for (const std::uint32_t i : order) ordered.push_back(facets_[i]);
  facets_ = std::move(ordered);
  for (const Facet& facet : facets_) blocks_.append(facet.min, facet.max);
}

void FacetSet::gather(const Vector3d& centre, double radius_m, double reach_m, NearFacets& out) const {
  out.centre = centre;
  out.radius_m = radius_m;
  out.facet.clear();
  const double reach2 = (reach_m + radius_m) * (reach_m + radius_m);
  blocks_.for_each_near(centre, reach2, [&](std::size_t i) {
    const Facet& facet = facets_[i];
    if (facet.normal.dot(centre) - facet.offset <= -radius_m) return;
    if (BoundsBlocks::squared_distance(centre, facet.min, facet.max) > reach2) return;
    out.facet.push_back(static_cast<std::uint32_t>(i));
  });
  for (auto* v : {&out.normal_x, &out.normal_y, &out.normal_z, &out.offset, &out.deviation, &out.min_x,
                  &out.min_y, &out.min_z, &out.max_x, &out.max_y, &out.max_z})
    v->resize(out.facet.size());
  for (std::size_t k = 0; k < out.facet.size(); ++k) {
    const Facet& facet = facets_[out.facet[k]];
    out.normal_x[k] = facet.normal.x(), out.normal_y[k] = facet.normal.y(),
    out.normal_z[k] = facet.normal.z();
    out.offset[k] = facet.offset, out.deviation[k] = facet.deviation;
    out.min_x[k] = facet.min.x(), out.min_y[k] = facet.min.y(), out.min_z[k] = facet.min.z();
    out.max_x[k] = facet.max.x(), out.max_y[k] = facet.max.y(), out.max_z[k] = facet.max.z();
  }
}

std::optional<std::uint32_t> FacetSet::triangle_at(const Facet& facet, const Vector3d& point) const {
  const Vector2d p(point[(facet.axis + 1) % 3], point[(facet.axis + 2) % 3]);
  std::optional<std::uint32_t> found;
  const auto outside = [&](const Eigen::AlignedBox2d& bounds) {
    return (p.array() < bounds.min().array() - kEdgeSlack).any() ||
           (p.array() > bounds.max().array() + kEdgeSlack).any();
  };
  const bool blocks = facet.count > kFlatBlock, wide_blocks = facet.count > kFlatBlock * kFlatBlock;
  for (std::uint32_t block = 0; block * kFlatBlock < facet.count; ++block) {
    if (wide_blocks && block % kFlatBlock == 0 &&
        outside(wide_bounds_[facet.first_wide_bounds + block / kFlatBlock])) {
      block += kFlatBlock - 1;
      continue;
    }
    if (blocks && outside(flat_bounds_[facet.first_bounds + block])) continue;
    const std::uint32_t begin = facet.first + block * kFlatBlock;
    const std::uint32_t end = std::min(begin + kFlatBlock, facet.first + facet.count);
    for (std::uint32_t i = begin; i < end; ++i) {
      const auto& [a, b, c] = flat_[i].corner;
      if (side(a, b, p) < -kEdgeSlack * (b - a).norm() || side(b, c, p) < -kEdgeSlack * (c - b).norm() ||
          side(c, a, p) < -kEdgeSlack * (a - c).norm())
        continue;
      found = std::min(found.value_or(flat_[i].triangle), flat_[i].triangle);
    }
  }
  return found;
}

std::size_t FacetSet::convex_part(const Facet& facet, std::array<Vector3d, 4>& corners) const {
  const auto area = [this](std::uint32_t i) {
    const auto& [a, b, c] = flat_[i].corner;
    return side(a, b, c);
  };
  std::uint32_t largest = facet.first;
  for (std::uint32_t i = facet.first; i < facet.first + facet.count; ++i)
    if (area(i) > area(largest)) largest = i;
  const auto& corner = flat_[largest].corner;
  std::array<Vector2d, 4> outline{corner[0], corner[1], corner[2]};
  std::size_t count = 3;
  double best = 0;
  for (std::uint32_t i = facet.first; i < facet.first + facet.count; ++i) {
    if (i == largest || area(i) <= best) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector2d &a = corner[k], &b = corner[(k + 1) % 3], &c = corner[(k + 2) % 3];
      for (std::size_t j = 0; j < 3; ++j) {
        // The neighbour has the edge a -> b in reverse order; its third corner comes between a and b.
        const auto& other = flat_[i].corner;
        if (other[j] != b || other[(j + 1) % 3] != a) continue;
        const Vector2d& tip = other[(j + 2) % 3];
        if (side(c, a, tip) < 0 || side(tip, b, c) < 0) continue;
        best = area(i);
        outline = {a, tip, b, c};
        count = 4;
      }
    }
  }
  const int u = (facet.axis + 1) % 3, v = (facet.axis + 2) % 3;
  for (std::size_t k = 0; k < count; ++k) {
    const Vector2d& p = outline[k];
    Vector3d& at = corners[k];
    at[u] = p.x();
    at[v] = p.y();
    at[facet.axis] =
        (facet.offset - facet.normal[u] * p.x() - facet.normal[v] * p.y()) / facet.normal[facet.axis];
  }
  // Seen along the axis the facet is flipped if its normal points the other way.
  if (facet.normal[facet.axis] < 0)
    std::reverse(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(count));
  return count;
}

}  // namespace canyon::propagation
