#include "canyon/receiver/tracking/noise.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "tests/support/refusal.hpp"

namespace canyon::tracking {
namespace {

// Statistical bounds are five standard deviations of the estimator: with fixed seeds a test either always
// passes or detects a deviation that occurs by chance once in a million.
constexpr double kSigmas = 5;

OuOptions ou(double theta, double mu, double sigma) {
  OuOptions options;
  options.theta_per_s = theta;
  options.mu_m = mu;
  options.sigma_m_per_sqrt_s = sigma;
  return options;
}

/// One realisation of theta = 0.5 /s, mu = 1.5 m, stationary deviation 2 m over 200,000 s.
class OuAtRate : public testing::TestWithParam<int> {
 protected:
  static constexpr double kTheta = 0.5;
  static constexpr double kMu = 1.5;
  static constexpr double kDeviation = 2;
  static constexpr double kSpan_s = 200'000;

  /// x(t) at 1 Hz and the mean square of the increments, stepped at GetParam() Hz.
  void SetUp() override {
    const int rate = GetParam();
    OuProcess process(ou(kTheta, kMu, kDeviation * std::sqrt(2 * kTheta)), RandomStream(5, "ou"));
    double last = process.advance(0);
    x_.push_back(last);
    const int steps = static_cast<int>(kSpan_s) * rate;
    for (int i = 1; i <= steps; ++i) {
      const double value = process.advance(1.0 / rate);
      increments2_ += (value - last) * (value - last) / steps;
      last = value;
      if (i % rate == 0) x_.push_back(value);
    }
    for (const double v : x_) mean_ += v / static_cast<double>(x_.size());
    for (const double v : x_) variance_ += (v - mean_) * (v - mean_) / static_cast<double>(x_.size());
  }

  [[nodiscard]] double autocorrelation(std::size_t lag) const {
    double sum = 0;
    for (std::size_t i = lag; i < x_.size(); ++i) sum += (x_[i] - mean_) * (x_[i - lag] - mean_);
    return sum / static_cast<double>(x_.size()) / variance_;
  }

  std::vector<double> x_;
  double mean_ = 0;
  double variance_ = 0;
  double increments2_ = 0;
};

// Samples at 1 Hz of every rate are the same AR(1) process, phi = e^(-theta): estimators' variances over n
// samples are those of AR(1) with n (1 - phi)/(1 + phi) and n (1 - phi^2)/(1 + phi^2) independent ones.
TEST_P(OuAtRate, MeanAndVarianceAreStationary) {
  const double phi = std::exp(-kTheta);
  const auto n = static_cast<double>(x_.size());
  const double n_mean = n * (1 - phi) / (1 + phi);
  const double n_variance = n * (1 - phi * phi) / (1 + phi * phi);
  EXPECT_NEAR(mean_, kMu, kSigmas * kDeviation / std::sqrt(n_mean));
  EXPECT_NEAR(variance_, kDeviation * kDeviation,
              kSigmas * kDeviation * kDeviation * std::sqrt(2 / n_variance));
}

// Bartlett's formula for AR(1): n var(r_k) = (1 + phi^2)(1 - phi^2k) / (1 - phi^2) - 2 k phi^2k.
TEST_P(OuAtRate, AutocorrelationIsExponential) {
  const double phi = std::exp(-kTheta);
  for (const int lag : {1, 2, 4, 10}) {
    const double p2k = std::pow(phi, 2 * lag);
    const double variance =
        ((1 + phi * phi) * (1 - p2k) / (1 - phi * phi) - 2 * lag * p2k) / static_cast<double>(x_.size());
    EXPECT_NEAR(autocorrelation(static_cast<std::size_t>(lag)), std::pow(phi, lag),
                kSigmas * std::sqrt(variance))
        << "lag " << lag;
  }
}

// E (x(t + dt) - x(t))^2 = 2 s^2 (1 - e^(-theta dt)): also the fastest motion has the right size. Increments
// are nearly independent; their squares' mean has relative deviation sqrt(2/n), up to sqrt 2 more for
// correlation.
TEST_P(OuAtRate, IncrementsHaveTheirVariance) {
  const double dt = 1.0 / GetParam();
  const double expected = 2 * kDeviation * kDeviation * -std::expm1(-kTheta * dt);
  EXPECT_NEAR(increments2_ / expected, 1, kSigmas * std::sqrt(4 * dt / kSpan_s));
}

INSTANTIATE_TEST_SUITE_P(Rates, OuAtRate, testing::Values(1, 10, 100));

TEST(OuProcess, FirstValueIsStationary) {
  const int n = 20'000;
  double mean = 0, square = 0;
  for (int i = 0; i < n; ++i) {
    OuProcess process(ou(0.02, 3, 0.2), RandomStream(1, "first " + std::to_string(i)));
    const double x = process.advance(100) - 3;
    mean += x / n;
    square += x * x / n;
  }
  EXPECT_NEAR(mean, 0, kSigmas / std::sqrt(n));
  EXPECT_NEAR(square, 1, kSigmas * std::sqrt(2.0 / n));  // sigma^2 / (2 theta) = 1
}

TEST(OuProcess, StandingStillGivesTheSameValueAndDrawsNothing) {
  OuProcess a(OuOptions{}, RandomStream(1, "x"));
  OuProcess b(OuOptions{}, RandomStream(1, "x"));
  const double x = a.advance(1);
  EXPECT_EQ(b.advance(1), x);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(a.advance(0), x);
  EXPECT_EQ(a.advance(2), b.advance(2));
}

TEST(OuProcess, WithoutDiffusionItDecaysExactlyWhateverTheSteps) {
  OuProcess fine(ou(0.1, 4, 0), RandomStream(1, "x"));
  OuProcess coarse(ou(0.1, 4, 0), RandomStream(1, "x"));
  EXPECT_EQ(fine.advance(0, 10), 10);
  EXPECT_EQ(coarse.advance(0, 10), 10);
  double x = 0;
  for (int i = 0; i < 700; ++i) x = fine.advance(0.01);
  EXPECT_NEAR(x, 4 + 6 * std::exp(-0.7), 1e-12);
  EXPECT_NEAR(coarse.advance(7), x, 1e-12);
}

TEST(OuProcess, VeryLongGapDrawsFromTheStationaryDistribution) {
  OuProcess process(ou(0.02, 0, 0.2), RandomStream(9, "gap"));
  double square = 0, product = 0, last = process.advance(0);
  const int n = 20'000;
  for (int i = 0; i < n; ++i) {
    const double x = process.advance(1e6);
    square += x * x / n;
    product += x * last / n;
    last = x;
  }
  EXPECT_NEAR(square, 1, kSigmas * std::sqrt(2.0 / n));
  EXPECT_NEAR(product, 0, kSigmas / std::sqrt(n));
}

TEST(OuProcess, RefusesBadOptionsAndSteps) {
  const auto message = [](const OuOptions& options) { return test::refusal([&] { options.validate(); }); };
  EXPECT_THAT(message(ou(0, 0, 1)), testing::HasSubstr("theta_per_s"));
  EXPECT_THAT(message(ou(std::nan(""), 0, 1)), testing::HasSubstr("theta_per_s"));
  EXPECT_THAT(message(ou(1, INFINITY, 1)), testing::HasSubstr("mu_m"));
  EXPECT_THAT(message(ou(1, 0, -1)), testing::HasSubstr("sigma_m_per_sqrt_s"));
  EXPECT_EQ(message(OuOptions{}), "");
  EXPECT_THROW(OuProcess(ou(-1, 0, 1), RandomStream(1, "x")), InputError);
  OuProcess process(OuOptions{}, RandomStream(1, "x"));
  EXPECT_THROW(process.advance(-1), InputError);
  EXPECT_THROW(process.advance(std::nan("")), InputError);
}

}  // namespace
}  // namespace canyon::tracking
