#include "canyon/paths/propagation/index/beam_index.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "canyon/base/arithmetic.hpp"
#include "canyon/paths/propagation/index/bounds_blocks.hpp"
#include "canyon/paths/propagation/index/clear_rays.hpp"

namespace canyon::propagation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Boxes per vector operation, and children of one box.
constexpr std::size_t kLanes = 8;
constexpr float kNothing = -1e30f;
/// Facets whose normals are within this of the horizontal are walls; within this of the vertical, level.
constexpr double kTilt = 1e-3;
/// Largest difference of the z of s' = s - 2 (s . n) n from s_z and -s_z, with roundings to float.
constexpr double kMaxRotation = 2 * kTilt + 2 * kTilt * kTilt + 1e-6;

/// A beam in floats relative to the centre of a set. `slack` covers the roundings of coordinates of both.
struct FloatBeam {
  float x, y, z, axis_x, axis_y, axis_z, sine, reach, slack;
  float room;        ///< `slack` plus the radius of the ball around the apex
  float spread = 0;  ///< BeamIndex::find()
  /// The window and the sides: normals, their absolute values, smallest distances along them.
  float plane_x[5], plane_y[5], plane_z[5], size_x[5], size_y[5], size_z[5], plane_m[5];
  /// The length of a ray is at most (d + lift) * per_climb at the height d above the apex.
  float lift = 1e30f, per_climb = 1;

  FloatBeam(const Beam& beam, const Vector3d& centre, double radius) {
    const Vector3d apex = beam.apex - centre;
    const auto f = [](double value) { return static_cast<float>(value); };
    x = f(apex.x()), y = f(apex.y()), z = f(apex.z());
    axis_x = f(beam.axis.x()), axis_y = f(beam.axis.y()), axis_z = f(beam.axis.z());
    sine = f(beam.sine);
    slack = f(2e-3 + 2e-6 * (radius + apex.norm()));
    room = slack + f(beam.radius_m);
    reach = f(beam.reach_m) + room;
    for (std::size_t k = 0; k < 5; ++k) {
      const Vector3d& normal = k == 0 ? beam.window : beam.side[k - 1];
      plane_x[k] = f(normal.x()), plane_y[k] = f(normal.y()), plane_z[k] = f(normal.z());
      size_x[k] = std::abs(plane_x[k]), size_y[k] = std::abs(plane_y[k]), size_z[k] = std::abs(plane_z[k]);
      plane_m[k] = f(k == 0 ? beam.window_m : beam.side_m[k - 1]) - slack;
    }
  }
  /// For rays whose z is at least `least_z`.
  void set_climb(double least_z) {
    if (!(least_z > 1e-3)) return;
    lift = 2 * room;
    per_climb = static_cast<float>(1.00001 / least_z);
  }
};

/// max(0, |distance| - half). Without branches, because compilers do not vectorize loops with branches.
inline float clearance(float distance, float half) {
  const float beyond = std::abs(distance) - half;
  return 0.5f * (beyond + std::abs(beyond));
}

/// Whether a box meets the beam: it is not outside any of its planes, nor beyond its reach.
inline int meets(const FloatBeam& b, float dx, float dy, float dz, float hx, float hy, float hz) {
  const float cx = clearance(dx, hx), cy = clearance(dy, hy), cz = clearance(dz, hz);
  const float squared = (cx * cx + cy * cy + cz * cz) * (1 - 1e-5f);
  const float climb = (dz + hz + b.lift) * b.per_climb;
  int inside = static_cast<int>(squared <= b.reach * b.reach) & static_cast<int>(climb >= 0) &
               static_cast<int>(squared <= climb * climb);
  for (std::size_t k = 0; k < 5; ++k) {
    const float maximum = dx * b.plane_x[k] + hx * b.size_x[k] + dy * b.plane_y[k] + hy * b.size_y[k] +
                          dz * b.plane_z[k] + hz * b.size_z[k];
    inside &= static_cast<int>(maximum >= b.plane_m[k]);
  }
  return inside;
}

/// Marks the boxes of the groups that meet the beam.
CANYON_CLONES void mark_boxes(const FloatBeam& beam, const float* __restrict x, const float* __restrict y,
                              const float* __restrict z, const float* __restrict hx,
                              const float* __restrict hy, const float* __restrict hz,
                              const std::uint32_t* __restrict groups, std::size_t count,
                              std::uint8_t* __restrict marks) {
  const FloatBeam b = beam;
  for (std::size_t g = 0; g < count; ++g) {
    const std::size_t first = kLanes * groups[g];
    int inside[kLanes];  // as wide as the floats: bytes would give short vectors
    for (std::size_t i = 0; i < kLanes; ++i) {
      const std::size_t k = first + i;
      inside[i] = meets(b, x[k] - b.x, y[k] - b.y, z[k] - b.z, hx[k], hy[k], hz[k]);
    }
    for (std::size_t i = 0; i < kLanes; ++i) marks[kLanes * g + i] = static_cast<std::uint8_t>(inside[i]);
  }
}

/// 1 / sqrt(x) to 1 in 100,000, for x in (1e-30, 1e30): two of Newton's steps from the guess that halves the
/// exponent (Lomont, "Fast inverse square root", 2003). std::sqrt sets errno, which prevents the
/// vectorization of the loop.
inline float inverse_root(float x) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &x, 4);
  bits = 0x5f375a86u - (bits >> 1);
  float y = 0;
  std::memcpy(&y, &bits, 4);
  y *= 1.5f - 0.5f * x * y * y;
  return y * (1.5f - 0.5f * x * y * y);
}

/// Facets: centres, normals, offsets, radii of their boxes' bounding spheres.
struct EightFacets {
  float x[kLanes], y[kLanes], z[kLanes], nx[kLanes], ny[kLanes], nz[kLanes], offset[kLanes], radius[kLanes];
};
/// Directions of satellites that facets may reflect into a beam: within `reach` (the chord of the half-angle)
/// of a unit direction.
struct Caps {
  float x[kLanes], y[kLanes], z[kLanes], reach[kLanes];
  float height[kLanes];  ///< of the apex over the facet
};
/// The caps as boxes of slices of DirectionBins.
struct SliceBoxes {
  int low[3][kLanes], high[3][kLanes];
};

CANYON_CLONES void make_caps(const FloatBeam& beam, const EightFacets& __restrict f, Caps& __restrict caps) {
  const FloatBeam b = beam;
  // Two loops, and sums instead of choices: compilers turn choices into branches and then do not vectorize.
  float inverse[kLanes], facet_part[kLanes];
  for (std::size_t i = 0; i < kLanes; ++i) {
    const float dx = f.x[i] - b.x, dy = f.y[i] - b.y, dz = f.z[i] - b.z;
    inverse[i] = inverse_root(dx * dx + dy * dy + dz * dz + 1e-12f);
    facet_part[i] = static_cast<float>(static_cast<int>((f.radius[i] + b.room) * inverse[i] < b.sine));
  }
  for (std::size_t i = 0; i < kLanes; ++i) {
    const float facet_part_of = facet_part[i], beam_part = 1 - facet_part_of;
    const float sine = facet_part_of * (f.radius[i] + b.room) * inverse[i] + beam_part * b.sine;
    const float scale = facet_part_of * inverse[i];
    const float ax = scale * (f.x[i] - b.x) + beam_part * b.axis_x;
    const float ay = scale * (f.y[i] - b.y) + beam_part * b.axis_y;
    const float az = scale * (f.z[i] - b.z) + beam_part * b.axis_z;
    const float twice = 2 * (ax * f.nx[i] + ay * f.ny[i] + az * f.nz[i]);
    caps.x[i] = ax - twice * f.nx[i];
    caps.y[i] = ay - twice * f.ny[i];
    caps.z[i] = az - twice * f.nz[i];
    // The chord 2 sin(angle / 2) of an angle up to 90 deg is at most sin + (sqrt(2) - 1) sin^3, which is
    // exact at 0 and at 90 deg. The other terms are for the roundings of the axis.
    caps.reach[i] = sine * (1 + 0.41422f * sine * sine) + 1e-4f + b.spread;
    caps.height[i] = f.nx[i] * b.x + f.ny[i] * b.y + f.nz[i] * b.z - f.offset[i];
  }
}

CANYON_CLONES void slice_caps(const float* __restrict at, const float* __restrict reach, int* __restrict low,
                              int* __restrict high) {
  for (std::size_t i = 0; i < kLanes; ++i) {
    low[i] = DirectionBins::slice(at[i] - reach[i]);
    high[i] = DirectionBins::slice(at[i] + reach[i]);
  }
}

void rotate(Caps& caps, const Eigen::Matrix3f& rotation) {
  for (std::size_t i = 0; i < kLanes; ++i) {
    const Eigen::Vector3f v = rotation * Eigen::Vector3f(caps.x[i], caps.y[i], caps.z[i]);
    caps.x[i] = v.x(), caps.y[i] = v.y(), caps.z[i] = v.z();
  }
}

/// Sets the sides of the beam, and the range of z of the unit vectors from `apex` to points of the facet,
/// which is `height_m` in front of it.
void set_sides(const Facet& facet, const Vector3d& apex, double height_m, const Surroundings& antennas,
               Beam& beam) {
  const Vector3d& n = facet.normal;
  const double flat = n.head<2>().norm();
  // The facet is within the rectangle of its bounds along these axes; for a wall it is the smallest one.
  const Vector3d u =
      flat > 0.1 ? Vector3d(-n.y() / flat, n.x() / flat, 0) : Vector3d(n.z(), 0, -n.x()).normalized();
  const Vector3d v = n.cross(u);
  const Vector3d to_centre = 0.5 * (facet.min + facet.max) - apex, half_size = 0.5 * (facet.max - facet.min);
  const double slack = 1e-3 + facet.deviation;
  // Images are around the apex like the antennas around theirs, mirrored.
  const auto extent = [&](const Vector3d& axis) { return antennas.extent_m(axis - 2 * axis.dot(n) * n); };
  const double depth = extent(n), rise = extent(Vector3d::UnitZ());
  std::size_t k = 0;
  // A plane that bounds the rays through the rectangle's end at `to` along an axis: through that end and the
  // image from which the end is seen farthest outwards.
  const auto bound = [&](const Vector3d& axis, double to) {
    const double across = to + extent(axis), ahead = height_m + (across > 0 ? -depth : depth);
    beam.side[k] = (across * n - ahead * axis).normalized();
    beam.side_m[k] = beam.side[k].dot(height_m * n + to * axis);
    ++k;
  };
  double along = 0, half = 0;
  for (const Vector3d& axis : {v, u}) {
    along = axis.dot(to_centre);
    half = axis.cwiseAbs().dot(half_size) + slack;
    bound(-axis, half - along);
    bound(axis, along + half);
  }
  if (flat <= 0.1) return;
  const double low = facet.min.z() - apex.z() - slack - rise, high = facet.max.z() - apex.z() + slack + rise;
  // Horizontally along the facet, and across it, where normal . (point - apex) = height.
  const double at_low = (height_m - n.z() * low) / flat, at_high = (height_m - n.z() * high) / flat;
  const double nearest = std::hypot(std::max(0.0, std::abs(along) - half),
                                    std::max(0.0, std::min(at_low, at_high) - slack / flat));
  const double farthest =
      std::hypot(std::abs(along) + half, std::max(std::abs(at_low), std::abs(at_high)) + slack / flat);
  const double near = std::max(0.0, nearest - beam.radius_m), far = farthest + beam.radius_m;
  const auto sine = [](double up, double across) {
    const double range = std::hypot(up, across);
    return range > 0 ? up / range : 0;
  };
  beam.low_z = sine(low, low > 0 ? far : near);
  beam.high_z = sine(high, high > 0 ? near : far);
}

}  // namespace

Beam make_beam(const Facet& facet, const Vector3d& apex, double height_m, double reach_m,
               const Surroundings& antennas) {
  Beam beam;
  beam.radius_m = antennas.reach_m();
  beam.apex = apex;
  beam.window = facet.normal;
  beam.window_m = height_m;
  beam.reach_m = reach_m;
  const Vector3d to_centre = 0.5 * (facet.min + facet.max) - apex;
  const double distance = to_centre.norm();
  const double radius = 0.5 * (facet.max - facet.min).norm() + beam.radius_m;
  if (distance > radius) {
    beam.axis = to_centre / distance;
    beam.sine = radius / distance;
    beam.cosine = std::sqrt(1 - beam.sine * beam.sine);
  } else {
    beam.axis = facet.normal;  // all rays pass the window's plane
    beam.sine = 1;
    beam.cosine = 0;
  }
  set_sides(facet, apex, height_m, antennas, beam);
  return beam;
}

void BeamIndex::Boxes::clear() {
  for (auto* v : {&x, &y, &z, &half_x, &half_y, &half_z}) v->clear();
}

void BeamIndex::Boxes::append(const Vector3d& low, const Vector3d& high) {
  const Vector3d middle = 0.5 * (low + high), half = 0.5 * (high - low);
  const auto f = [](double value) { return static_cast<float>(value); };
  x.push_back(f(middle.x())), y.push_back(f(middle.y())), z.push_back(f(middle.z()));
  half_x.push_back(f(half.x())), half_y.push_back(f(half.y())), half_z.push_back(f(half.z()));
}

void BeamIndex::Boxes::append(const Boxes& from, std::size_t i) {
  x.push_back(from.x[i]), y.push_back(from.y[i]), z.push_back(from.z[i]);
  half_x.push_back(from.half_x[i]), half_y.push_back(from.half_y[i]), half_z.push_back(from.half_z[i]);
}

void BeamIndex::Boxes::pad() {
  const std::size_t padded = (size() + kLanes - 1) / kLanes * kLanes;
  for (auto* v : {&x, &y, &z}) v->resize(padded, 0);
  for (auto* v : {&half_x, &half_y, &half_z}) v->resize(padded, kNothing);
}

BeamIndex::BeamIndex(const FacetSet& set) {
  const auto& facets = set.facets();
  if (facets.empty()) return;
  Vector3d low = facets[0].min, high = facets[0].max;
  std::array<std::vector<std::uint32_t>, kTrees> trees;
  for (std::uint32_t i = 0; i < facets.size(); ++i) {
    low = low.cwiseMin(facets[i].min);
    high = high.cwiseMax(facets[i].max);
    const Vector3d& n = facets[i].normal;
    const bool wall = std::abs(n.z()) <= kTilt, level = n.head<2>().norm() <= kTilt;
    trees[wall ? kWalls : level ? kLevel : kSloped].push_back(i);
  }
  centre_ = 0.5 * (low + high);
  radius_ = 0.5 * (high - low).norm();
  for (std::size_t tree = 0; tree < kTrees; ++tree) {
    append(set, std::move(trees[tree]));
    end_[tree] = blocks_.size();
  }
}

/// Appends a tree of facets.
void BeamIndex::append(const FacetSet& set, std::vector<std::uint32_t> facets) {
  constexpr std::size_t kBlock = kLanes * kLanes;
  const auto bounds_of = [&](std::size_t begin, std::size_t end, Boxes& boxes) {
    Vector3d low = Vector3d::Constant(1e300), high = -low;
    for (std::size_t k = begin; k < std::min(end, facets.size()); ++k) {
      low = low.cwiseMin(set.facets()[facets[k]].min);
      high = high.cwiseMax(set.facets()[facets[k]].max);
    }
    boxes.append(low - centre_, high - centre_);
  };
  const auto centre_of = [&](std::uint32_t i) -> Vector3d {
    return set.facets()[i].min + set.facets()[i].max;
  };
  order_compactly(facets.data(), facets.data() + facets.size(), kBlock, centre_of);
  for (std::size_t block = 0; block < facets.size(); block += kBlock) {
    const std::size_t end = std::min(block + kBlock, facets.size());
    order_compactly(facets.data() + block, facets.data() + end, kLanes, centre_of);
    bounds_of(block, end, blocks_);
    for (std::size_t eight = block; eight < end; eight += kLanes) {
      bounds_of(eight, std::min(eight + kLanes, end), eights_);
      for (std::size_t k = eight; k < std::min(eight + kLanes, end); ++k) {
        bounds_of(k, k + 1, facets_);
        const Facet& facet = set.facets()[facets[k]];
        facet_.push_back(facets[k]);
        const auto f = [](double value) { return static_cast<float>(value); };
        skin_.push_back({f(facet.normal.x()), f(facet.normal.y()), f(facet.normal.z()),
                         f(facet.offset - facet.normal.dot(centre_)),
                         f(0.5 * (facet.max - facet.min).norm())});
      }
      facets_.pad();
      facet_.resize(facets_.size(), 0);
      skin_.resize(facets_.size());
    }
    eights_.pad();
    const Vector3d nothing = Vector3d::Constant(static_cast<double>(kNothing));
    while (facets_.size() < kLanes * eights_.size()) facets_.append(-nothing, nothing);
    facet_.resize(facets_.size(), 0);
    skin_.resize(facets_.size());
  }
}

void BeamIndex::gather(const Vector3d& antenna, double reach_m, Blocks& out) const {
  out.block.clear();
  out.boxes.clear();
  const Vector3d here = antenna - centre_;
  const double far = reach_m + 2e-3 + 2e-6 * (radius_ + here.norm());
  const auto distance = [](float at, double from, float half) {
    return std::max(0.0, std::abs(static_cast<double>(at) - from) - static_cast<double>(half));
  };
  for (std::size_t tree = 0, i = 0; tree < kTrees; ++tree) {
    for (; i < end_[tree]; ++i) {
      const Vector3d apart(distance(blocks_.x[i], here.x(), blocks_.half_x[i]),
                           distance(blocks_.y[i], here.y(), blocks_.half_y[i]),
                           distance(blocks_.z[i], here.z(), blocks_.half_z[i]));
      if (apart.squaredNorm() > far * far) continue;
      out.block.push_back(static_cast<std::uint32_t>(i));
      out.boxes.append(blocks_, i);
    }
    out.boxes.pad();
    out.block.resize(out.boxes.size(), 0);
    out.end[tree] = out.block.size();
  }
}

struct BeamIndex::Query {
  FloatBeam beam;
  const DirectionBins* bins;
  const Eigen::Isometry3d* outer_from_set;
  int low_slice, high_slice;  ///< of the z of directions
};

void BeamIndex::find(const Beam& beam, Blocks& blocks, const DirectionBins& bins,
                     const Eigen::Isometry3d* outer_from_set, std::vector<Match>& out, double spread) const {
  out.clear();
  Query query{FloatBeam(beam, centre_, radius_), &bins, outer_from_set, 0, DirectionBins::kSlices - 1};
  query.beam.spread = static_cast<float>(spread);
  const double rotated = kMaxRotation + spread;
  find(query, blocks, kSloped, out);
  for (const std::size_t tree : {kLevel, kWalls}) {
    if (outer_from_set == nullptr) {
      const double low = (tree == kWalls ? beam.low_z : -beam.high_z) - rotated;
      const double high = (tree == kWalls ? beam.high_z : -beam.low_z) + rotated;
      const double least = bins.least_z(low, high);
      if (least > 1) continue;
      if (tree == kWalls) query.beam.set_climb(least - rotated);
      query.low_slice = DirectionBins::slice(static_cast<float>(low));
      query.high_slice = DirectionBins::slice(static_cast<float>(high));
    }
    find(query, blocks, tree, out);
  }
}

/// Appends the matches of one tree.
void BeamIndex::find(const Query& query, Blocks& blocks, std::size_t tree, std::vector<Match>& out) const {
  const std::size_t begin = tree > 0 ? blocks.end[tree - 1] : 0, end = blocks.end[tree];
  if (begin == end) return;
  const FloatBeam& b = query.beam;
  const auto mark = [&](const Boxes& boxes) {
    blocks.marks.resize(kLanes * blocks.groups.size());
    mark_boxes(b, boxes.x.data(), boxes.y.data(), boxes.z.data(), boxes.half_x.data(), boxes.half_y.data(),
               boxes.half_z.data(), blocks.groups.data(), blocks.groups.size(), blocks.marks.data());
  };
  // Level by level: `groups` become the marked children.
  blocks.groups.clear();
  for (std::size_t g = begin / kLanes; g < end / kLanes; ++g)
    blocks.groups.push_back(static_cast<std::uint32_t>(g));
  for (const Boxes* boxes : std::array<const Boxes*, 3>{&blocks.boxes, &eights_, &facets_}) {
    mark(*boxes);
    blocks.next.clear();
    for_each_mark(blocks.marks.data(), blocks.marks.size(), [&](std::size_t k) {
      const std::size_t child = kLanes * blocks.groups[k / kLanes] + k % kLanes;
      blocks.next.push_back(boxes == &blocks.boxes ? blocks.block[child] : static_cast<std::uint32_t>(child));
    });
    std::swap(blocks.groups, blocks.next);
  }
  const std::vector<std::uint32_t>& found = blocks.groups;
  for (std::size_t from = 0; from < found.size(); from += kLanes) {
    const std::size_t count = std::min(kLanes, found.size() - from);
    EightFacets facets;
    for (std::size_t k = 0; k < kLanes; ++k) {
      const std::size_t i = found[from + std::min(k, count - 1)];
      facets.x[k] = facets_.x[i], facets.y[k] = facets_.y[i], facets.z[k] = facets_.z[i];
      facets.nx[k] = skin_[i][0], facets.ny[k] = skin_[i][1], facets.nz[k] = skin_[i][2];
      facets.offset[k] = skin_[i][3], facets.radius[k] = skin_[i][4];
    }
    Caps caps;
    make_caps(b, facets, caps);
    if (query.outer_from_set != nullptr) rotate(caps, query.outer_from_set->linear().cast<float>());
    SliceBoxes slices;
    slice_caps(caps.x, caps.reach, slices.low[0], slices.high[0]);
    slice_caps(caps.y, caps.reach, slices.low[1], slices.high[1]);
    slice_caps(caps.z, caps.reach, slices.low[2], slices.high[2]);
    for (std::size_t k = 0; k < count; ++k) {
      if (caps.height[k] < -b.room) continue;  // the apex does not see its front
      const std::array<int, 3> low{slices.low[0][k], slices.low[1][k],
                                   std::max(slices.low[2][k], query.low_slice)};
      const std::array<int, 3> high{slices.high[0][k], slices.high[1][k],
                                    std::min(slices.high[2][k], query.high_slice)};
      if (low[2] > high[2]) continue;
      for (std::size_t group = 0; group < query.bins->groups(); ++group) {
        const std::uint64_t directions = query.bins->within(group, low, high);
        if (directions == 0) continue;
        out.push_back({facet_[found[from + k]], static_cast<std::uint32_t>(group), directions});
      }
    }
  }
}

}  // namespace canyon::propagation
