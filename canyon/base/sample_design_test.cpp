#include "canyon/base/sample_design.hpp"

#include <gtest/gtest.h>

#include <set>

namespace canyon {
namespace {

// McKay, Beckman and Conover's definition: of n points each stratum of each axis has exactly one.
TEST(SampleDesign, LatinHypercubeHasOnePointInEachStratum) {
  constexpr std::size_t kN = 101;
  const RandomStream of_a(3, "a"), of_b(3, "b");
  const std::vector<double> a = draw_sample(of_a, kN, true), b = draw_sample(of_b, kN, true);
  for (const auto* axis : {&a, &b}) {
    std::set<std::size_t> strata;
    for (const double u : *axis) strata.insert(static_cast<std::size_t>(u * kN));
    EXPECT_EQ(strata.size(), kN);
    EXPECT_EQ(*strata.rbegin(), kN - 1);
  }
  EXPECT_NE(a, b);
  EXPECT_EQ(a, draw_sample(of_a, kN, true));
  // Alone, all strata of 101 are hit with probability 101!/101^101 = 1e-43.
  std::set<std::size_t> strata;
  for (const double u : draw_sample(of_a, kN, false)) strata.insert(static_cast<std::size_t>(u * kN));
  EXPECT_LT(strata.size(), kN);
}

}  // namespace
}  // namespace canyon
