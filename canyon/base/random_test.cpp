#include "canyon/base/random.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace canyon {

namespace {

// Statistical bounds are five standard deviations of the estimator: a failure with a fixed seed has a
// probability of one in a million if the code is right.
constexpr double kSigmas = 5;

std::vector<double> normals(std::uint64_t seed, const std::string& key, int n) {
  RandomStream stream(seed, key);
  std::vector<double> x(static_cast<std::size_t>(n));
  for (double& each : x) each = stream.normal();
  return x;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += a[i] * b[i];
    aa += a[i] * a[i];
    bb += b[i] * b[i];
  }
  return ab / std::sqrt(aa * bb);
}

// The recurrence of Blackman & Vigna, "Scrambled linear pseudorandom number generators" (2021), figure 4, in
// Python integers from the state [1, 2, 3, 4]; the same vector is the self-test of Rust's rand_xoshiro.
TEST(RandomStream, IsXoshiro256PlusPlus) {
  RandomStream stream = RandomStream::from_state({1, 2, 3, 4});
  const std::vector<std::uint64_t> expected{41943041U,
                                            58720359U,
                                            3588806011781223U,
                                            3591011842654386U,
                                            9228616714210784205U,
                                            9973669472204895162U,
                                            14011001112246962877U,
                                            12406186145184390807U,
                                            15849039046786891736U,
                                            10450023813501588000U};
  for (const std::uint64_t value : expected) EXPECT_EQ(stream.next(), value);
}

TEST(RandomStream, SameSeedAndKeySameNumbers) {
  EXPECT_EQ(normals(1, "rover/G05/code", 100), normals(1, "rover/G05/code", 100));
}

TEST(RandomStream, StreamsOfOtherKeysAndSeedsAreUncorrelated) {
  const int n = 200'000;
  const std::vector<double> reference = normals(1, "rover/G05/code", n);
  const std::vector<std::pair<std::uint64_t, std::string>> others{{1, "rover/G06/code"},
                                                                  {1, "rover/G05/doppler"},
                                                                  {1, "base/G05/code"},
                                                                  {2, "rover/G05/code"},
                                                                  {0, "rover/G05/code"},
                                                                  {1U << 31, "rover/G05/code"},
                                                                  {1, ""}};
  for (const auto& [seed, key] : others) {
    EXPECT_LT(std::abs(correlation(reference, normals(seed, key, n))), kSigmas / std::sqrt(n)) << seed << key;
  }
}

TEST(RandomStream, UniformFillsItsBinsEvenly) {
  constexpr int kBins = 64;
  constexpr int kSamples = 640'000;
  RandomStream stream(7, "uniform");
  std::vector<int> count(kBins);
  for (int i = 0; i < kSamples; ++i) {
    const double u = stream.uniform();
    ASSERT_GE(u, 0);
    ASSERT_LT(u, 1);
    ++count[static_cast<std::size_t>(u * kBins)];
  }
  double chi2 = 0;
  for (const int c : count) chi2 += std::pow(c - kSamples / kBins, 2) / (kSamples / kBins);
  EXPECT_NEAR(chi2, kBins - 1, kSigmas * std::sqrt(2.0 * (kBins - 1)));
}

TEST(RandomStream, NormalHasNormalMomentsAndTails) {
  const int n = 1'000'000;
  std::vector<double> x = normals(3, "normal", n);
  double m1 = 0, m2 = 0, m3 = 0, m4 = 0;
  int beyond3 = 0, beyond4 = 0;
  for (const double v : x) {
    m1 += v / n;
    m2 += v * v / n;
    m3 += v * v * v / n;
    m4 += v * v * v * v / n;
    beyond3 += std::abs(v) > 3;
    beyond4 += std::abs(v) > 4;
  }
  // Variances of the sample moments of N(0,1): 1, 2, 15, 96 over n.
  EXPECT_NEAR(m1, 0, kSigmas * std::sqrt(1.0 / n));
  EXPECT_NEAR(m2, 1, kSigmas * std::sqrt(2.0 / n));
  EXPECT_NEAR(m3, 0, kSigmas * std::sqrt(15.0 / n));
  EXPECT_NEAR(m4, 3, kSigmas * std::sqrt(96.0 / n));
  // erfc(3/sqrt 2) and erfc(4/sqrt 2).
  EXPECT_NEAR(beyond3, n * 2.6997961e-3, kSigmas * std::sqrt(n * 2.7e-3));
  EXPECT_NEAR(beyond4, n * 6.3342484e-5, kSigmas * std::sqrt(n * 6.34e-5));
  // Kolmogorov-Smirnov: P(D sqrt n > 2.6) = 2 exp(-2 * 2.6^2) = 3e-6.
  std::sort(x.begin(), x.end());
  double distance = 0;
  for (int i = 0; i < n; ++i) {
    const double cdf = 0.5 * std::erfc(-x[static_cast<std::size_t>(i)] / std::sqrt(2.0));
    distance = std::max({distance, std::abs(cdf - static_cast<double>(i) / n),
                         std::abs(cdf - static_cast<double>(i + 1) / n)});
  }
  EXPECT_LT(distance * std::sqrt(n), 2.6);
}

TEST(RandomStream, SuccessiveNormalsAreUncorrelated) {
  const int n = 500'000;
  const std::vector<double> x = normals(11, "lag", n + 1);
  for (const std::ptrdiff_t lag : {1}) {
    EXPECT_LT(std::abs(correlation({x.begin(), x.end() - lag}, {x.begin() + lag, x.end()})),
              kSigmas / std::sqrt(n));
  }
}

// McKay, Beckman and Conover's definition: each stratum of each axis has exactly one of n points.
TEST(SampleDesign, LatinHypercubeHasOnePointInEachStratum) {
  constexpr std::size_t kN = 101;
  const RandomStream from_a(3, "a"), from_b(3, "b");
  const std::vector<double> a = draw_sample(from_a, kN, true), b = draw_sample(from_b, kN, true);
  for (const auto* axis : {&a, &b}) {
    std::set<std::size_t> strata;
    for (const double u : *axis) strata.insert(static_cast<std::size_t>(u * kN));
    EXPECT_EQ(strata.size(), kN);
    EXPECT_EQ(*strata.rbegin(), kN - 1);
  }
  EXPECT_NE(a, b);
  EXPECT_EQ(a, draw_sample(from_a, kN, true));
  // With independent samples, all strata of 101 are hit with probability 101!/101^101 = 1e-43.
  std::set<std::size_t> strata;
  for (const double u : draw_sample(from_a, kN, false)) strata.insert(static_cast<std::size_t>(u * kN));
  EXPECT_LT(strata.size(), kN);
}

}  // namespace

}  // namespace canyon
