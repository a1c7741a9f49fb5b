#include "canyon/base/statistics.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

namespace canyon {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;

TEST(Statistics, Quantiles) {
  const std::vector<double> values{3, 1, 4, 1, 5, 9, 2, 6};
  // numpy.quantile(values, [0.05, 0.25, 0.5, 0.9, 0.95])
  EXPECT_THAT(quantiles(values, std::array{0.05, 0.25, 0.5, 0.9, 0.95}),
              ElementsAre(1, 1.75, 3.5, DoubleNear(6.9, 1e-14), DoubleNear(7.95, 1e-14)));
  EXPECT_EQ(quantile(values, 0), 1);
  EXPECT_EQ(quantile(values, 1), 9);
  EXPECT_EQ(median(std::array{7.0}), 7);
  EXPECT_EQ(median(std::vector<double>{}), std::nullopt);
}

// numpy.percentile([15, 20, 35, 40, 50], [0, 40, 50, 95, 100]) = 15, 29, 35, 48, 50.
TEST(Statistics, QuantileAsNumpy) {
  const std::vector<double> values{40, 15, 50, 35, 20};
  EXPECT_EQ(quantile(values, 0.00), 15);
  EXPECT_NEAR(*quantile(values, 0.40), 29, 1e-12);
  EXPECT_EQ(quantile(values, 0.50), 35);
  EXPECT_NEAR(*quantile(values, 0.95), 48, 1e-12);
  EXPECT_EQ(quantile(values, 1.00), 50);
  EXPECT_EQ(quantile(std::array{7.0}, 0.95), 7);
  EXPECT_EQ(quantile({}, 0.5), std::nullopt);
}

TEST(Statistics, SelectionGoesOnFromTheLastRank) {
  std::vector<double> values{3, 1, 4, 1, 5, 9, 2, 6};
  std::size_t ranked = 0;
  EXPECT_EQ(select_quantile(values, 0.5, ranked), 3.5);
  EXPECT_EQ(ranked, 3U);
  EXPECT_NEAR(select_quantile(values, 0.95, ranked), 7.95, 1e-14);
  EXPECT_EQ(ranked, 6U);
}

}  // namespace
}  // namespace canyon
