// Expected numbers: by hand, or SciPy 1.10.1 and NumPy 1.24.2, whose calls are given next to them.
#include "canyon/analysis/validation/statistics.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "canyon/receiver/tracking/noise.hpp"
#include "tests/support/bootstrap.hpp"

namespace canyon::validation {
namespace {

using test::bootstrap_interval;
using test::BootstrapOptions;
using testing::ElementsAre;

TEST(Statistics, Midranks) {
  EXPECT_THAT(midranks(std::array{3.0, 1.0, 4.0, 1.0, 5.0, 9.0, 2.0, 6.0}),
              ElementsAre(4, 1.5, 5, 1.5, 6, 8, 3, 7));
}

TEST(Statistics, SpearmanWithoutTies) {
  // IQ and hours of television, the worked example of Wikipedia's article: rho = -29/165.
  const std::vector<double> x{106, 86, 100, 101, 99, 103, 97, 113, 112, 110};
  const std::vector<double> y{7, 0, 27, 50, 28, 29, 20, 12, 6, 17};
  const auto c = spearman(x, y);
  ASSERT_TRUE(c);
  EXPECT_NEAR(c->rho, -29.0 / 165, 1e-15);
  EXPECT_EQ(c->n, 10U);
  // tanh(atanh(rho) -+ 1.959964 sqrt((1 + rho^2 / 2) / 7)) by hand
  const double z = std::atanh(-29.0 / 165),
               reach = 1.959963984540054 * std::sqrt((1 + 0.030890725436 / 2) / 7);
  EXPECT_NEAR(c->low, std::tanh(z - reach), 1e-9);
  EXPECT_NEAR(c->high, std::tanh(z + reach), 1e-9);
}

TEST(Statistics, SpearmanWithTies) {
  const std::vector<double> x{1, 2, 2, 3, 4, 4, 4, 5, 6, 7};
  const std::vector<double> y{2, 1, 3, 3, 5, 4, 6, 6, 6, 9};
  const auto c = spearman(x, y);
  ASSERT_TRUE(c);
  EXPECT_NEAR(c->rho, 0.934375, 1e-14);  // scipy.stats.spearmanr
}

TEST(Statistics, SpearmanAtItsEnds) {
  const std::vector<double> x{1, 2, 3, 4}, down{8, 4, 2, 1}, flat{5, 5, 5, 5};
  EXPECT_EQ(spearman(x, down)->rho, -1);
  EXPECT_EQ(spearman(x, down)->high, -1);
  EXPECT_EQ(spearman(x, flat), std::nullopt);
  EXPECT_EQ(spearman(std::array{1.0, 2.0}, std::array{1.0, 2.0}), std::nullopt);
}

TEST(Statistics, SeparationByHand) {
  // The positive is higher in 34 of 42 pairs and equal in 3: AUC 35.5 / 42 (scipy.stats.mannwhitneyu: 35.5).
  const std::vector<double> positives{5, 3, 3, 8, 9, 6}, negatives{1, 3, 2, 4, 3, 5, 0};
  const auto s = separation(positives, negatives);
  ASSERT_TRUE(s);
  EXPECT_NEAR(s->auc, 35.5 / 42, 1e-15);
  // Above 5: 3 of 6 and 7 of 7. From 5 on: 4 of 6 and 6 of 7. From 3 on: 6 of 6 and 3 of 7.
  EXPECT_NEAR(s->balanced_accuracy, (4.0 / 6 + 6.0 / 7) / 2, 1e-15);
  EXPECT_EQ(s->threshold, 4.5);
}

TEST(Statistics, SeparationAtItsEnds) {
  EXPECT_EQ(separation(std::array{2.0, 3.0}, std::array{0.0, 1.0})->auc, 1);
  EXPECT_EQ(separation(std::array{2.0, 3.0}, std::array{0.0, 1.0})->balanced_accuracy, 1);
  EXPECT_EQ(separation(std::array{2.0, 3.0}, std::array{0.0, 1.0})->threshold, 1.5);
  EXPECT_EQ(separation(std::array{0.0, 1.0}, std::array{2.0, 3.0})->auc, 0);
  EXPECT_EQ(separation(std::array{1.0, 1.0}, std::array{1.0})->auc, 0.5);
  EXPECT_EQ(separation(std::array{1.0, 1.0}, std::array{1.0})->threshold,
            -std::numeric_limits<double>::infinity());
  EXPECT_EQ(separation(std::vector<double>{}, std::array{1.0}), std::nullopt);
  const double above_one = std::nextafter(1.0, 2.0);
  EXPECT_EQ(separation(std::array{above_one}, std::array{1.0})->threshold, above_one);
}

TEST(Statistics, KolmogorovSmirnov) {
  // scipy.stats.ks_2samp(a, b): D 3/4.
  const auto small = kolmogorov_smirnov(std::array{1.0, 2.0, 3.0, 4.0, 5.0}, std::array{2.5, 6.0, 7.0, 8.0});
  ASSERT_TRUE(small);
  EXPECT_NEAR(*small, 0.75, 1e-15);

  // u = arange(300) / 300, v = 0.95 (arange(200) / 200)^1.2 + 0.00013: D 0.09; 0.09172757 with u's last value
  // twice.
  std::vector<double> u, v;
  for (int i = 0; i < 300; ++i) u.push_back(i / 300.0);
  for (int i = 0; i < 200; ++i) v.push_back(0.95 * std::pow(i / 200.0, 1.2) + 0.00013);
  EXPECT_NEAR(kolmogorov_smirnov(u, v).value(), 0.09, 1e-14);
  u.push_back(u.back());
  EXPECT_NEAR(kolmogorov_smirnov(u, v).value(), 0.09172757475083057, 1e-14);

  // Normal samples of 25 and 20 with ties (scipy.stats.ks_2samp: D 0.23).
  const std::vector<double> a{0.61, 0.29, 0.06,  0.59,  -1.73, -0.74, 0.51, -0.56, 0.39,
                              1.64, 0.05, -0.06, 0.64,  -0.82, 0.37,  1.77, 1.09,  -1.28,
                              2.36, 1.31, 1.05,  -0.32, -0.40, 1.06,  -2.47};
  const std::vector<double> b{2.20,  1.66, 1.38, 0.20, 0.36,  0.00,  0.96, 1.56, 0.44, 1.50,
                              -0.30, 0.66, 2.31, 3.29, -0.27, -0.37, 0.38, 0.71, 0.52, -0.71};
  EXPECT_NEAR(kolmogorov_smirnov(a, b).value(), 0.23, 1e-14);

  EXPECT_EQ(kolmogorov_smirnov(a, a), 0);
  EXPECT_EQ(kolmogorov_smirnov(a, std::vector<double>{}), std::nullopt);
  EXPECT_EQ(kolmogorov_smirnov(std::array{0.0, 1.0}, std::array{5.0, 6.0}), 1);
}

TEST(Statistics, BootstrapCoversTheMean) {
  // 400 independent samples of 60 exponential values of mean 1: 90 % intervals contain 1 in 90 % of the
  // samples, a few per cent less for the skew; two standard deviations of that count are 3 %.
  RandomStream random(3, "exponential");
  BootstrapOptions options;
  options.resamples = 300;
  options.confidence = 0.9;
  int held = 0;
  for (int sample = 0; sample < 400; ++sample) {
    std::vector<double> values(60);
    for (double& v : values) v = -std::log(1 - random.uniform());
    const auto mean = [&](std::span<const std::size_t> sampled) -> std::optional<double> {
      double sum = 0;
      for (const std::size_t i : sampled) sum += values[i];
      return sum / static_cast<double>(sampled.size());
    };
    options.seed = static_cast<std::uint64_t>(sample);
    const auto interval = bootstrap_interval(values.size(), mean, options);
    ASSERT_TRUE(interval);
    held += interval->low <= 1 && 1 <= interval->high ? 1 : 0;
  }
  EXPECT_GT(held, 0.84 * 400);
  EXPECT_LT(held, 0.94 * 400);
}

TEST(Statistics, BootstrapBlocksFollowTheSeries) {
  // 40 runs of 25 equal values: the mean's deviation is that of 40 values, five times as wide as that of
  // 1000.
  RandomStream random(4, "runs");
  std::vector<double> values;
  for (int run = 0; run < 40; ++run) values.insert(values.end(), 25, random.normal());
  const auto mean = [&](std::span<const std::size_t> sampled) -> std::optional<double> {
    double sum = 0;
    for (const std::size_t i : sampled) sum += values[i];
    return sum / static_cast<double>(sampled.size());
  };
  const auto single = bootstrap_interval(values.size(), mean, {});
  BootstrapOptions blocks;
  blocks.block = 100;
  const auto together = bootstrap_interval(values.size(), mean, blocks);
  ASSERT_TRUE(single && together);
  const double ratio = (together->high - together->low) / (single->high - single->low);
  EXPECT_GT(ratio, 3.5);
  EXPECT_LT(ratio, 6);
  EXPECT_EQ(bootstrap_interval(values.size(), mean, blocks)->low, together->low)
      << "same seed, same interval";
}

TEST(Statistics, BootstrapWithoutValues) {
  const auto none = [](std::span<const std::size_t>) -> std::optional<double> { return std::nullopt; };
  EXPECT_FALSE(bootstrap_interval(10, none, {}));
  const auto one = [](std::span<const std::size_t>) -> std::optional<double> { return 1; };
  EXPECT_FALSE(bootstrap_interval(0, one, {}));
}

}  // namespace
}  // namespace canyon::validation
