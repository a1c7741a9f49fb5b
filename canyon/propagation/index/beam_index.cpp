#include "canyon/propagation/index/beam_index.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "canyon/propagation/index/simd_clones.hpp"

namespace canyon::propagation {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kBlock = FacetSet::kBlock;
constexpr float kNothing = -1e30f;

/// A beam in floats about the centre of a set. `slack` covers the roundings of coordinates of both.
struct FloatBeam {
  float x, y, z, axis_x, axis_y, axis_z, cosine, sine, window_x, window_y, window_z, window_m, reach, slack;

  FloatBeam(const Beam& beam, const Vector3d& centre, double radius) {
    const Vector3d apex = beam.apex - centre;
    const auto f = [](double value) { return static_cast<float>(value); };
    x = f(apex.x()), y = f(apex.y()), z = f(apex.z());
    axis_x = f(beam.axis.x()), axis_y = f(beam.axis.y()), axis_z = f(beam.axis.z());
    cosine = f(beam.cosine), sine = f(beam.sine);
    window_x = f(beam.window.x()), window_y = f(beam.window.y()), window_z = f(beam.window.z());
    window_m = f(beam.window_m), reach = f(beam.reach_m);
    slack = f(2e-3 + 2e-6 * (radius + apex.norm()));
  }
};

/// Whether a sphere meets the beam. With d to its centre, `along` the axis and `across` it, its distance from
/// the cone's side is across cos - along sin: at most the distance from the cone wherever it is.
inline int meets(const FloatBeam& b, float dx, float dy, float dz, float radius) {
  const float r = radius + b.slack;
  const float squared = dx * dx + dy * dy + dz * dz;
  const float along = dx * b.axis_x + dy * b.axis_y + dz * b.axis_z;
  const float room = r + along * b.sine;
  const float across2 = squared - along * along;
  const float far = r + b.reach;
  const float beyond = dx * b.window_x + dy * b.window_y + dz * b.window_z;
  // Roundings of the two squares are those of `squared`.
  return static_cast<int>(room >= 0) &
         static_cast<int>(across2 * b.cosine * b.cosine <= room * room + 4e-6f * squared) &
         static_cast<int>(squared <= far * far * (1 + 1e-5f)) & static_cast<int>(beyond + r >= b.window_m);
}

CANYON_CLONES void mark_spheres(const FloatBeam& beam, const float* __restrict x, const float* __restrict y,
                                const float* __restrict z, const float* __restrict radius, std::size_t count,
                                std::uint8_t* __restrict marks) {
  const FloatBeam b = beam;
  for (std::size_t i = 0; i < count; ++i) {
    marks[i] = static_cast<std::uint8_t>(meets(b, x[i] - b.x, y[i] - b.y, z[i] - b.z, radius[i]));
  }
}

CANYON_CLONES void mark_facets(const FloatBeam& beam, const float* __restrict x, const float* __restrict y,
                               const float* __restrict z, const float* __restrict radius,
                               const float* __restrict nx, const float* __restrict ny,
                               const float* __restrict nz, const float* __restrict offset,
                               std::uint8_t* __restrict marks) {
  const FloatBeam b = beam;
  for (std::size_t i = 0; i < kBlock; ++i) {
    const float height = nx[i] * b.x + ny[i] * b.y + nz[i] * b.z - offset[i];
    marks[i] = static_cast<std::uint8_t>(meets(b, x[i] - b.x, y[i] - b.y, z[i] - b.z, radius[i]) &
                                         static_cast<int>(height >= -b.slack));
  }
}

/// 1 / sqrt(x) to 1 in 100,000, for x in (1e-30, 1e30): two of Newton's steps from the guess that halves the
/// exponent (Lomont, "Fast inverse square root", 2003). std::sqrt sets errno, which keeps compilers from
/// making vectors of the loop.
inline float inverse_root(float x) {
  std::uint32_t bits;
  std::memcpy(&bits, &x, 4);
  bits = 0x5f375a86u - (bits >> 1);
  float y;
  std::memcpy(&y, &bits, 4);
  y *= 1.5f - 0.5f * x * y * y;
  return y * (1.5f - 0.5f * x * y * y);
}

/// Where satellites must stand for a facet to reflect them into the beam: within `reach` (the chord of the
/// half-angle) of a unit direction.
struct Caps {
  float x[kBlock], y[kBlock], z[kBlock], reach[kBlock];
};
/// The same as a box of slices of DirectionBins.
struct Boxes {
  int low[3][kBlock], high[3][kBlock];
};

CANYON_CLONES void make_caps(const FloatBeam& beam, const float* __restrict x, const float* __restrict y,
                             const float* __restrict z, const float* __restrict radius,
                             const float* __restrict nx, const float* __restrict ny,
                             const float* __restrict nz, Caps& caps) {
  const FloatBeam b = beam;
  // In two loops, and sums in place of choices: compilers make branches of choices, and no vectors of those.
  float inverse[kBlock], facet_part[kBlock];
  for (std::size_t i = 0; i < kBlock; ++i) {
    const float dx = x[i] - b.x, dy = y[i] - b.y, dz = z[i] - b.z;
    inverse[i] = inverse_root(dx * dx + dy * dy + dz * dz + 1e-12f);
    facet_part[i] = static_cast<float>(static_cast<int>((radius[i] + b.slack) * inverse[i] < b.sine));
  }
  for (std::size_t i = 0; i < kBlock; ++i) {
    const float of_facet = facet_part[i], of_beam = 1 - of_facet;
    const float sine = of_facet * (radius[i] + b.slack) * inverse[i] + of_beam * b.sine;
    const float scale = of_facet * inverse[i];
    const float ax = scale * (x[i] - b.x) + of_beam * b.axis_x;
    const float ay = scale * (y[i] - b.y) + of_beam * b.axis_y;
    const float az = scale * (z[i] - b.z) + of_beam * b.axis_z;
    const float twice = 2 * (ax * nx[i] + ay * ny[i] + az * nz[i]);
    caps.x[i] = ax - twice * nx[i];
    caps.y[i] = ay - twice * ny[i];
    caps.z[i] = az - twice * nz[i];
    // The chord 2 sin(angle / 2) of an angle up to 90 deg is at most sin + (sqrt(2) - 1) sin^3, which is
    // exact at 0 and at 90 deg. The rest is for the roundings of the axis.
    caps.reach[i] = sine * (1 + 0.41422f * sine * sine) + 1e-4f;
  }
}

CANYON_CLONES void slice_caps(const float* __restrict at, const float* __restrict reach, int* __restrict low,
                              int* __restrict high) {
  for (std::size_t i = 0; i < kBlock; ++i) {
    low[i] = DirectionBins::slice(at[i] - reach[i]);
    high[i] = DirectionBins::slice(at[i] + reach[i]);
  }
}

void turn(Caps& caps, const Eigen::Matrix3f& rotation) {
  for (std::size_t i = 0; i < kBlock; ++i) {
    const Eigen::Vector3f v = rotation * Eigen::Vector3f(caps.x[i], caps.y[i], caps.z[i]);
    caps.x[i] = v.x(), caps.y[i] = v.y(), caps.z[i] = v.z();
  }
}

/// Calls visit(i) for every i with marks[i] = 1 (not 0); `count` is a multiple of 8.
template <typename Visit>
void for_each_mark(const std::uint8_t* marks, std::size_t count, const Visit& visit) {
  for (std::size_t word = 0; word < count; word += 8) {
    std::uint64_t eight;
    std::memcpy(&eight, marks + word, 8);
    for (; eight != 0; eight &= eight - 1) {
      const auto byte = static_cast<std::size_t>(__builtin_ctzll(eight)) / 8;
      visit(word + (std::endian::native == std::endian::little ? byte : 7 - byte));
    }
  }
}

}  // namespace

Beam make_beam(const Facet& facet, const Vector3d& apex, double height_m, double reach_m) {
  Beam beam;
  beam.apex = apex;
  beam.window = facet.normal;
  beam.window_m = height_m;
  beam.reach_m = reach_m;
  const Vector3d to_centre = 0.5 * (facet.min + facet.max) - apex;
  const double distance = to_centre.norm(), radius = 0.5 * (facet.max - facet.min).norm();
  if (distance > radius) {
    beam.axis = to_centre / distance;
    beam.sine = radius / distance;
    beam.cosine = std::sqrt(1 - beam.sine * beam.sine);
  } else {
    beam.axis = facet.normal;  // all rays pass the window's plane
    beam.sine = 1;
    beam.cosine = 0;
  }
  return beam;
}

BeamIndex::BeamIndex(const FacetSet& set) {
  const auto& facets = set.facets();
  if (facets.empty()) return;
  Vector3d low = facets[0].min, high = facets[0].max;
  for (const Facet& facet : facets) {
    low = low.cwiseMin(facet.min);
    high = high.cwiseMax(facet.max);
  }
  centre_ = 0.5 * (low + high);
  radius_ = 0.5 * (high - low).norm();
  const std::size_t padded = (facets.size() + kBlock - 1) / kBlock * kBlock;
  for (auto* v : {&x_, &y_, &z_, &normal_x_, &normal_y_, &normal_z_, &offset_}) v->assign(padded, 0);
  sphere_.assign(padded, kNothing);
  for (std::size_t begin = 0; begin < facets.size(); begin += kBlock) {
    const std::size_t end = std::min(begin + kBlock, facets.size());
    low = facets[begin].min, high = facets[begin].max;
    for (std::size_t i = begin; i < end; ++i) {
      const Facet& facet = facets[i];
      low = low.cwiseMin(facet.min);
      high = high.cwiseMax(facet.max);
      const Vector3d middle = 0.5 * (facet.min + facet.max) - centre_;
      x_[i] = static_cast<float>(middle.x());
      y_[i] = static_cast<float>(middle.y());
      z_[i] = static_cast<float>(middle.z());
      sphere_[i] = static_cast<float>(0.5 * (facet.max - facet.min).norm());
      normal_x_[i] = static_cast<float>(facet.normal.x());
      normal_y_[i] = static_cast<float>(facet.normal.y());
      normal_z_[i] = static_cast<float>(facet.normal.z());
      offset_[i] = static_cast<float>(facet.offset - facet.normal.dot(centre_));
    }
    const Vector3d middle = 0.5 * (low + high) - centre_;
    block_x_.push_back(static_cast<float>(middle.x()));
    block_y_.push_back(static_cast<float>(middle.y()));
    block_z_.push_back(static_cast<float>(middle.z()));
    block_radius_.push_back(static_cast<float>(0.5 * (high - low).norm()));
  }
}

void BeamIndex::gather(const Vector3d& antenna, double reach_m, Blocks& out) const {
  out.block.clear();
  for (auto* v : {&out.x, &out.y, &out.z, &out.radius}) v->clear();
  const Vector3d here = antenna - centre_;
  const double slack = 2e-3 + 2e-6 * (radius_ + here.norm());
  for (std::size_t i = 0; i < block_x_.size(); ++i) {
    const Vector3d at(static_cast<double>(block_x_[i]), static_cast<double>(block_y_[i]),
                      static_cast<double>(block_z_[i]));
    const double far = reach_m + static_cast<double>(block_radius_[i]) + slack;
    if ((at - here).squaredNorm() > far * far) continue;
    out.block.push_back(static_cast<std::uint32_t>(i));
    out.x.push_back(block_x_[i]);
    out.y.push_back(block_y_[i]);
    out.z.push_back(block_z_[i]);
    out.radius.push_back(block_radius_[i]);
  }
  const std::size_t padded = (out.block.size() + 7) / 8 * 8;
  for (auto* v : {&out.x, &out.y, &out.z}) v->resize(padded, 0);
  out.radius.resize(padded, kNothing);
  out.marks.resize(std::max(padded, kBlock));
}

void BeamIndex::find(const Beam& beam, Blocks& blocks, const DirectionBins& bins,
                     const Eigen::Isometry3d* outer_from_set, std::vector<Match>& out) const {
  out.clear();
  const FloatBeam b(beam, centre_, radius_);
  mark_spheres(b, blocks.x.data(), blocks.y.data(), blocks.z.data(), blocks.radius.data(), blocks.x.size(),
               blocks.marks.data());
  for_each_mark(blocks.marks.data(), blocks.x.size(), [&](std::size_t k) {
    const std::size_t begin = blocks.block[k] * kBlock;
    std::uint8_t marks[kBlock];
    mark_facets(b, x_.data() + begin, y_.data() + begin, z_.data() + begin, sphere_.data() + begin,
                normal_x_.data() + begin, normal_y_.data() + begin, normal_z_.data() + begin,
                offset_.data() + begin, marks);
    if (std::memchr(marks, 1, kBlock) == nullptr) return;
    Caps caps;
    make_caps(b, x_.data() + begin, y_.data() + begin, z_.data() + begin, sphere_.data() + begin,
              normal_x_.data() + begin, normal_y_.data() + begin, normal_z_.data() + begin, caps);
    if (outer_from_set != nullptr) turn(caps, outer_from_set->linear().cast<float>());
    Boxes boxes;
    slice_caps(caps.x, caps.reach, boxes.low[0], boxes.high[0]);
    slice_caps(caps.y, caps.reach, boxes.low[1], boxes.high[1]);
    slice_caps(caps.z, caps.reach, boxes.low[2], boxes.high[2]);
    for_each_mark(marks, kBlock, [&](std::size_t i) {
      const std::array<int, 3> low{boxes.low[0][i], boxes.low[1][i], boxes.low[2][i]};
      const std::array<int, 3> high{boxes.high[0][i], boxes.high[1][i], boxes.high[2][i]};
      for (std::size_t group = 0; group < bins.groups(); ++group) {
        const std::uint64_t directions = bins.within(group, low, high);
        if (directions == 0) continue;
        out.push_back({static_cast<std::uint32_t>(begin + i), static_cast<std::uint32_t>(group), directions});
      }
    });
  });
}

}  // namespace canyon::propagation
