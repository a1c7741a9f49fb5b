#include "canyon/paths/propagation/index/direction_bins.hpp"

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"

namespace canyon::propagation {
namespace {

using Eigen::Vector3d;

TEST(DirectionBins, FindEveryDirectionInABox) {
  std::mt19937_64 random(64);
  std::uniform_real_distribution<double> azimuth(0, 6.3), elevation(-1.5, 1.5);
  std::uniform_real_distribution<float> edge(-1.1f, 1.1f);
  std::vector<Vector3d> sky;
  for (int i = 0; i < 150; ++i) {
    sky.push_back(geodesy::enu_from_azimuth_elevation(azimuth(random), elevation(random)));
  }
  sky.insert(sky.end(), {{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {-1, 0, 0}});
  DirectionBins bins;
  bins.build(sky);
  ASSERT_EQ(bins.groups(), 3u);
  int in = 0;
  constexpr double kWidth = 2.0 / DirectionBins::kSlices;
  for (int i = 0; i < 2'000; ++i) {
    std::array<int, 3> low, high;
    Vector3d from, to;
    for (int axis = 0; axis < 3; ++axis) {
      float a = edge(random), b = edge(random);
      if (a > b) std::swap(a, b);
      from[axis] = static_cast<double>(a);
      to[axis] = static_cast<double>(b);
      low[static_cast<std::size_t>(axis)] = DirectionBins::slice(a);
      high[static_cast<std::size_t>(axis)] = DirectionBins::slice(b);
    }
    for (std::size_t k = 0; k < DirectionBins::kGroup * bins.groups(); ++k) {
      const bool bit = (bins.within(k / 64, low, high) >> (k % 64) & 1) != 0;
      if (k >= sky.size()) {
        EXPECT_FALSE(bit);
        continue;
      }
      const double outside = (from - sky[k]).cwiseMax(sky[k] - to).maxCoeff();
      in += outside <= 0 ? 1 : 0;
      if (outside <= 0) {
        EXPECT_TRUE(bit);
      }
      if (bit) {
        EXPECT_LE(outside, 0.1 + kWidth) << "the outermost slices hold what is beyond 1";
      }
    }
  }
  EXPECT_GT(in, 1'000);
}

}  // namespace
}  // namespace canyon::propagation
