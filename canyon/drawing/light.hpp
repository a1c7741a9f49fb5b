#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/drawing/palette.hpp"

// Shared by the ray-traced pictures: sums of light, places within a pixel, objects by triangle.

namespace canyon::drawing {

/// Linear light by colour; may be above 1 until it is made a pixel.
struct Light {
  float r = 0, g = 0, b = 0;

  Light& operator+=(const Light& o) {
    r += o.r;
    g += o.g;
    b += o.b;
    return *this;
  }
};

[[nodiscard]] inline Light operator*(const Light& l, double s) {
  const auto f = static_cast<float>(s);
  return {l.r * f, l.g * f, l.b * f};
}

/// The mean of two lights with the weights 1 - t and t, t in [0, 1].
[[nodiscard]] inline Light mix(const Light& from, const Light& to, double t) {
  Light sum = from * (1 - t);
  sum += to * t;
  return sum;
}

/// sRGB (IEC 61966-2-1) to linear light.
[[nodiscard]] inline Light linear(const Colour& c) {
  const auto decode = [](double v) {
    return static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
  };
  return {decode(c.r), decode(c.g), decode(c.b)};
}

/// Linear light to an sRGB pixel 0xRRGGBB, clamped.
[[nodiscard]] inline std::uint32_t pixel_of(const Light& l) {
  const auto encode = [](float v) {
    const float x = std::clamp(v, 0.0F, 1.0F);
    const float s = x <= 0.0031308F ? 12.92F * x : 1.055F * std::pow(x, 1 / 2.4F) - 0.055F;
    return static_cast<std::uint32_t>(std::lround(255 * s));
  };
  return encode(l.r) << 16U | encode(l.g) << 8U | encode(l.b);
}

/// Sub-pixel places, one in each row and column of an 8 x 8 lattice (n-rooks): near-level edges come out as
/// smooth as near-upright ones.
inline constexpr std::array<std::array<double, 2>, 8> kRooks{{{0.0625, 0.4375},
                                                              {0.1875, 0.8125},
                                                              {0.3125, 0.1875},
                                                              {0.4375, 0.6875},
                                                              {0.5625, 0.0625},
                                                              {0.6875, 0.5625},
                                                              {0.8125, 0.9375},
                                                              {0.9375, 0.3125}}};

/// Calls work(row) for each of `rows` rows of pixels, on all cores.
inline void for_rows(int rows, const std::function<void(int)>& work) {
  tbb::parallel_for(tbb::blocked_range<int>(0, rows, 4), [&work](const tbb::blocked_range<int>& range) {
    for (int row = range.begin(); row != range.end(); ++row) work(row);
  });
}

/// The object that each triangle belongs to.
[[nodiscard]] inline std::vector<std::uint32_t> objects_by_triangle(const city::Mesh& mesh) {
  std::vector<std::uint32_t> objects(mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.objects.size(); ++i) {
    std::fill_n(objects.begin() + mesh.objects[i].first_triangle, mesh.objects[i].triangle_count,
                static_cast<std::uint32_t>(i));
  }
  return objects;
}

}  // namespace canyon::drawing
