#include "canyon/base/predictive.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "canyon/base/random.hpp"

namespace canyon {
namespace {

// Ranks p (n + 1) by hand.
TEST(Predictive, QuantilesAreAtTheRanksOfTheNextValue) {
  const std::vector<double> nine{9, 1, 8, 2, 7, 3, 6, 4, 5};
  EXPECT_DOUBLE_EQ(predictive_quantile(nine, 0.5), 5);
  EXPECT_DOUBLE_EQ(predictive_quantile(nine, 0.25), 2.5);
  EXPECT_DOUBLE_EQ(predictive_quantile(nine, 0.9), 9);
  EXPECT_DOUBLE_EQ(predictive_quantile(nine, 0.95), 9);
  EXPECT_DOUBLE_EQ(predictive_quantile(nine, 0.05), 1);
  EXPECT_DOUBLE_EQ(predictive_quantile(std::vector<double>{4}, 0.05), 4);
}

TEST(Predictive, TheNextValueIsWithinWithItsProbability) {
  RandomStream stream(1, "predictive test");
  for (const std::size_t count : {10U, 40U}) {
    constexpr int kTrials = 20000;
    int within = 0;
    for (int i = 0; i < kTrials; ++i) {
      std::vector<double> values(count);
      for (double& value : values) value = stream.normal();
      const double next = stream.normal();
      within += next >= predictive_quantile(values, 0.05) && next <= predictive_quantile(values, 0.95);
    }
    EXPECT_NEAR(within / double{kTrials}, count < kFewestOf90 ? 9.0 / 11 : 0.9, 0.01);
  }
}

TEST(Predictive, FewValuesAreNamed) {
  EXPECT_EQ(caution_of_few(10, "draws"), "90 % intervals of 10 draws are intervals of 82 %");
  EXPECT_EQ(caution_of_few(18, "runs"), "90 % intervals of 18 runs are intervals of 89 %");
  EXPECT_FALSE(caution_of_few(19, "draws"));
}

}  // namespace
}  // namespace canyon
