#include "canyon/paths/propagation/index/occluders.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>

#include "canyon/base/arithmetic.hpp"

namespace canyon::propagation {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using Hidden = Occluders::Hidden;

/// Rounding of the product of float coordinates and a float unit normal, relative to the distance.
constexpr float kRounding = 1e-6f;

/// The corner of each facet's bounds that is first along `direction`.
struct Corner {
  const float *x, *y, *z;
  Corner(const FacingFacets& f, const Vector3f& direction)
      : x((direction.x() >= 0 ? f.min_x : f.max_x).data()),
        y((direction.y() >= 0 ? f.min_y : f.max_y).data()),
        z((direction.z() >= 0 ? f.min_z : f.max_z).data()) {}
};

/// inside[i] &= corner i . direction >= height, minus roundings.
CANYON_CLONES void narrow(const float* __restrict x, const float* __restrict y, const float* __restrict z,
                          std::size_t count, float dx, float dy, float dz, float height,
                          std::uint8_t* __restrict inside) {
  for (std::size_t i = 0; i < count; ++i) {
    const float slack = kRounding * (std::abs(x[i]) + std::abs(y[i]) + std::abs(z[i]));
    const float along = x[i] * dx + y[i] * dy + z[i] * dz;
    inside[i] = static_cast<std::uint8_t>(inside[i] & static_cast<int>(along - slack >= height));
  }
}

/// FacetSet::convex_part(); the last corner of a triangle is duplicated.
std::size_t corners_of(const FacetSet& set, const Facet& facet, std::array<Vector3d, 4>& corner) {
  const std::size_t count = set.convex_part(facet, corner);
  if (count == 3) corner[3] = corner[2];
  return count;
}

CANYON_CLONES void merge(const std::uint8_t* __restrict inside, std::size_t count,
                         std::uint8_t* __restrict hidden) {
  for (std::size_t i = 0; i < count; ++i) hidden[i] = static_cast<std::uint8_t>(hidden[i] | inside[i]);
}

}  // namespace

Occluders::Occluders(const FacetSet& set) {
  parts_.reserve(set.facets().size());
  for (const Facet& facet : set.facets()) {
    std::array<Vector3d, 4> corner;
    const std::size_t count = corners_of(set, facet, corner);
    Part part;
    part.centre.setZero();
    for (std::size_t k = 0; k < count; ++k) part.centre += corner[k] / static_cast<double>(count);
    Vector3d twice_area = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
    twice_area += (corner[2] - corner[0]).cross(corner[3] - corner[0]);
    part.area = static_cast<float>(0.5 * twice_area.norm());
    parts_.push_back(part);
  }
}

void Occluders::hidden_regions(const FacetSet& set, const FacingFacets& facing, const Vector3d& antenna,
                               std::size_t count, double margin_m, Scratch& scratch,
                               std::vector<Hidden>& out) const {
  auto& largest = scratch.largest;
  largest.clear();
  for (std::size_t i = 0; i < facing.facet.size(); ++i) {
    if (!(facing.height[i] > 0)) continue;
    const Part& part = parts_[facing.facet[i]];
    const auto squared = static_cast<float>((part.centre - antenna).squaredNorm());
    largest.emplace_back(part.area * facing.height[i] / (squared * std::sqrt(squared)), facing.facet[i]);
  }
  count = std::min(count, largest.size());
  std::partial_sort(largest.begin(), largest.begin() + static_cast<std::ptrdiff_t>(count), largest.end(),
                    std::greater<>());
  for (std::size_t i = 0; i < count; ++i) {
    const Facet& facet = set.facets()[largest[i].second];
    const Part& part = parts_[largest[i].second];
    std::array<Vector3d, 4> corner;
    (void)corners_of(set, facet, corner);
    bool large = true;
    for (Vector3d& at : corner) {
      const Vector3d inwards = part.centre - at;
      const double length = inwards.norm();
      large &= length > 4 * margin_m;
      at = at + margin_m / length * inwards - antenna;
    }
    if (!large) continue;
    Hidden region;
    bool sound = true;
    for (std::size_t k = 0; k < 4; ++k) {
      // A triangle's last corner is duplicated and has no side between; the previous side is used again.
      const bool none = corner[k] == corner[(k + 1) % 4];
      const std::size_t from = none ? k - 1 : k;
      // Corners are counter-clockwise as seen from the antenna, so the reverse cross product points inwards.
      const Vector3d normal = corner[(from + 1) % 4].cross(corner[from]);
      const double length = normal.norm();
      sound &= length > 1e-6 * corner[from].squaredNorm() && length > 1e-9;
      region.side[k] = (normal / length).cast<float>();
    }
    if (!sound) continue;
    region.normal = facet.normal.cast<float>();
    region.height = static_cast<float>(facet.normal.dot(antenna) - facet.offset + facet.deviation + margin_m);
    out.push_back(region);
  }
}

void mark_hidden(const FacingFacets& facing, const std::vector<Hidden>& regions,
                 std::vector<std::uint8_t>& hidden) {
  const std::size_t count = facing.height.size();
  hidden.assign(count, 0);
  constexpr std::size_t kChunk = 1024;
  std::array<std::uint8_t, kChunk> inside;
  for (const Hidden& region : regions) {
    const auto narrow_by = [&](const Vector3f& direction, float height, std::size_t from, std::size_t to) {
      const Corner c(facing, direction);
      narrow(c.x + from, c.y + from, c.z + from, to - from, direction.x(), direction.y(), direction.z(),
             height, inside.data());
    };
    for (std::size_t from = 0; from < count; from += kChunk) {
      const std::size_t to = std::min(from + kChunk, count);
      std::fill_n(inside.begin(), to - from, std::uint8_t{1});
      for (const Vector3f& side : region.side) narrow_by(side, 0, from, to);
      narrow_by(-region.normal, region.height, from, to);
      merge(inside.data(), to - from, hidden.data() + from);
    }
  }
}

bool is_hidden(const Vector3d& centre, double radius, const std::vector<Hidden>& regions) {
  const Vector3f c = centre.cast<float>();
  const float reach = static_cast<float>(radius) + 2e-3f + 2 * kRounding * c.lpNorm<1>();
  return std::any_of(regions.begin(), regions.end(), [&](const Hidden& region) {
    return c.dot(region.normal) + region.height <= -reach &&
           std::all_of(region.side.begin(), region.side.end(),
                       [&](const Vector3f& side) { return c.dot(side) >= reach; });
  });
}

}  // namespace canyon::propagation
