#include "canyon/base/statistics.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <array>
#include <cmath>
#include <vector>

#include "canyon/base/random.hpp"

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

TEST(NormalQuantile, EqualsScipy) {
  // scipy.stats.norm.ppf
  EXPECT_NEAR(normal_quantile(0.975), 1.959963984540054, 1e-12);
  EXPECT_NEAR(normal_quantile(1e-6), -4.753424308822899, 1e-11);
  EXPECT_NEAR(normal_quantile(0.5), 0, 1e-12);
}

TEST(NormalProbability, IsTheQuantilesInverse) {
  for (const double p : {1e-12, 1e-3, 0.1, 0.5, 0.9, 0.999}) {
    EXPECT_NEAR(normal_probability(normal_quantile(p)), p, 1e-14 * p + 1e-15) << p;
  }
}

// Shape 1 is the exponential distribution: P = 1 - exp(-x).
TEST(GammaQuantile, HasTheClosedForm) {
  for (const double p : {1e-9, 0.01, 0.5, 0.99}) {
    EXPECT_NEAR(gamma_quantile(1, p), -std::log1p(-p), 1e-13 * -std::log1p(-p)) << p;
    EXPECT_NEAR(gamma_quantile_above(1, p), -std::log(p), 1e-13 * -std::log(p)) << p;
  }
}

// NIST/SEMATECH e-Handbook of Statistical Methods, 1.3.6.7.4, upper critical values.
TEST(ChiSquareQuantile, IsThatOfTheTables) {
  struct Entry {
    int degrees;
    double at[5];
  };
  constexpr double kAbove[5] = {0.10, 0.05, 0.025, 0.01, 0.001};
  const std::vector<Entry> table{
      {1, {2.706, 3.841, 5.024, 6.635, 10.828}},
      {2, {4.605, 5.991, 7.378, 9.210, 13.816}},
      {3, {6.251, 7.815, 9.348, 11.345, 16.266}},
      {4, {7.779, 9.488, 11.143, 13.277, 18.467}},
      {5, {9.236, 11.070, 12.833, 15.086, 20.515}},
      {10, {15.987, 18.307, 20.483, 23.209, 29.588}},
      {15, {22.307, 24.996, 27.488, 30.578, 37.697}},
      {20, {28.412, 31.410, 34.170, 37.566, 45.315}},
      {30, {40.256, 43.773, 46.979, 50.892, 59.703}},
      {50, {63.167, 67.505, 71.420, 76.154, 86.661}},
      {100, {118.498, 124.342, 129.561, 135.807, 149.449}},
  };
  for (const Entry& entry : table) {
    for (int i = 0; i < 5; ++i) {
      EXPECT_NEAR(chi_square_quantile(kAbove[i], entry.degrees), entry.at[i], 6e-4) << entry.degrees;
    }
  }
}

// Two degrees: exp(-x / 2). One degree: both tails of a normal variable; x = z^2 with P(|Z| > z).
TEST(ChiSquareQuantile, HasTheClosedForms) {
  for (const double above : {0.5, 0.1, 1e-3, 1e-6, 1e-12}) {
    EXPECT_NEAR(chi_square_quantile(above, 2), -2 * std::log(above), 1e-10 * -2 * std::log(above));
    const double x = chi_square_quantile(above, 1);
    EXPECT_NEAR(std::erfc(std::sqrt(x / 2)), above, 1e-9 * above);
    double last = 0;
    for (int degrees = 1; degrees <= 300; ++degrees) {
      const double each = chi_square_quantile(above, degrees);
      EXPECT_GT(each, last) << degrees;
      last = each;
    }
  }
  // Wilson & Hilferty's approximation, good to 1e-3 there.
  const double w = 1 - 2.0 / (9 * 300) + 3.090232306167813 * std::sqrt(2.0 / (9 * 300));
  EXPECT_NEAR(chi_square_quantile(1e-3, 300), 300 * w * w * w, 0.1);
}

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
    EXPECT_NEAR(within / double{kTrials}, count < kMinCountFor90 ? 9.0 / 11 : 0.9, 0.01);
  }
}

TEST(Predictive, FewValuesAreNamed) {
  EXPECT_EQ(caution_of_few(10, "samples"), "90 % intervals of 10 samples are intervals of 82 %");
  EXPECT_EQ(caution_of_few(18, "runs"), "90 % intervals of 18 runs are intervals of 89 %");
  EXPECT_FALSE(caution_of_few(19, "draws"));
}

}  // namespace
}  // namespace canyon
