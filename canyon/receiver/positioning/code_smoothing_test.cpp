#include "canyon/receiver/positioning/pseudorange_model.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "canyon/base/random.hpp"

namespace canyon::positioning {
namespace {

constexpr double kWhite = std::numeric_limits<double>::infinity();
const geodesy::GpsTime kStart{};

// a = dt / window in the steady state; a first-order recursion of white noise keeps a / (2 - a) of its
// variance.
TEST(CodeSmoother, WhiteNoiseFallsAsTheClosedFormSays) {
  SmoothingOptions options;
  options.window_s = 50;
  CodeSmoother smoother;
  CodeSmoother::Smoothed last;
  for (int k = 0; k < 2000; ++k) {
    last = smoother.next(kStart + 1.0 * k, 0, k > 0 ? std::optional(0.0) : std::nullopt,
                         {CodeNoise{2, kWhite}, CodeNoise{}}, options);
    if (k < 50) {
      EXPECT_NEAR(last.sigma_m, 2 / std::sqrt(k + 1.0), 1e-12);  // a plain average
    }
  }
  const double a = 1.0 / 50;
  EXPECT_NEAR(last.sigma_m, 2 * std::sqrt(a / (2 - a)), 1e-9);
}

// The reported deviation of two correlated parts agrees with 4000 runs, within five deviations of a variance.
TEST(CodeSmoother, StatesTheDeviationOfCorrelatedCodes) {
  SmoothingOptions options;
  options.window_s = 20;
  const std::array<CodeNoise, 2> noise{CodeNoise{1, 0.02}, CodeNoise{3, 4}};
  constexpr int kRuns = 4000, kEpochs = 60;
  constexpr double kStep_s = 0.5;
  std::vector<double> squares(kEpochs), reported(kEpochs);
  for (int run = 0; run < kRuns; ++run) {
    RandomStream stream(5, std::to_string(run));
    CodeSmoother smoother;
    double x = noise[0].sigma_m * stream.normal(), y = noise[1].sigma_m * stream.normal();
    for (int k = 0; k < kEpochs; ++k) {
      if (k > 0) {
        const double p = std::exp(-kStep_s * noise[0].rate_per_s),
                     q = std::exp(-kStep_s * noise[1].rate_per_s);
        x = p * x + noise[0].sigma_m * std::sqrt(1 - p * p) * stream.normal();
        y = q * y + noise[1].sigma_m * std::sqrt(1 - q * q) * stream.normal();
      }
      // The range grows by 700 m an epoch, which the carrier measures.
      const auto s = smoother.next(kStart + kStep_s * k, 2e7 + 700.0 * k + x + y,
                                   k > 0 ? std::optional(700.0) : std::nullopt, noise, options);
      const auto i = static_cast<std::size_t>(k);
      squares[i] += std::pow(s.pseudorange_m - (2e7 + 700.0 * k), 2) / kRuns;
      reported[i] = s.sigma_m;
    }
  }
  for (std::size_t k = 0; k < kEpochs; ++k) {
    EXPECT_NEAR(squares[k], reported[k] * reported[k], 5 * std::sqrt(2.0 / kRuns) * squares[k]) << k;
  }
  EXPECT_LT(reported.back(), 0.6 * reported.front());
  EXPECT_GT(reported.back(), 0.25 * reported.front());  // the slow part stays
}

TEST(CodeSmoother, BeginsAnewWithoutACarrier) {
  SmoothingOptions options;
  CodeSmoother smoother;
  const std::array<CodeNoise, 2> noise{CodeNoise{1, kWhite}, CodeNoise{}};
  static_cast<void>(smoother.next(kStart, 10, std::nullopt, noise, options));
  EXPECT_EQ(smoother.next(kStart + 1.0, 14, 2.0, noise, options).pseudorange_m, 13);  // (14 + 12) / 2
  const auto restarted = smoother.next(kStart + 2.0, 100, std::nullopt, noise, options);
  EXPECT_EQ(restarted.pseudorange_m, 100);
  EXPECT_EQ(restarted.sigma_m, 1);
}

}  // namespace
}  // namespace canyon::positioning
