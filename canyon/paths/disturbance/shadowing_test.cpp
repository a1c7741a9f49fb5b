#include "canyon/paths/disturbance/shadowing.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/input_error.hpp"
#include "tests/support/spoiled_options.hpp"

namespace canyon::disturbance {
namespace {

using geodesy::radians;

ShadowingOptions custom(double enter, double leave) {
  ShadowingOptions options;
  options.enabled = true;
  options.numbers = {-1, 0.5, -9, 4, enter, leave};
  return options;
}

Eigen::Vector3d direction_deg(double azimuth, double elevation) {
  return geodesy::enu_from_azimuth_elevation(radians(azimuth), radians(elevation));
}

/// One satellite that does not move.
class One {
 public:
  explicit One(const ShadowingOptions& options, std::uint64_t seed = 1, double azimuth_deg = 70)
      : shadowing_(options, seed, "test"), direction_(direction_deg(azimuth_deg, 40)) {}
  double level_db(double travelled_m) {
    shadowing_.go_to(travelled_m);
    last_ = shadowing_.of(direction_);
    return last_.level_db;
  }
  [[nodiscard]] bool shadowed() const { return last_.shadowed; }

 private:
  Shadowing shadowing_;
  Eigen::Vector3d direction_;
  Shadowing::Shadow last_;
};

TEST(ShadowingOptions, SurroundingsFollowTheSkyAndTheMap) {
  using E = ShadowingEnvironment;
  EXPECT_EQ(environment_for(0), E::Open);
  EXPECT_EQ(environment_for(0.05), E::Suburban);
  EXPECT_EQ(environment_for(0.1), E::Urban);
  EXPECT_EQ(environment_for(0.3), E::Dense);
  ShadowingOptions options;
  options.enabled = true;
  options.environment = E::Open;
  EXPECT_FALSE(options.active());
}

// Perez-Fontan et al. 1998 as in docs/shadowing.md; P12 / (P11 + P12) and P21 / (P21 + P22) by hand.
TEST(ShadowingParameters, AreThePublishedOnesWithoutDeepShadow) {
  ShadowingOptions options;
  const auto at = [&](double deg) { return shadowing_parameters(options, radians(deg)); };
  EXPECT_DOUBLE_EQ(at(40).clear_mean_db, -0.3);
  EXPECT_DOUBLE_EQ(at(40).shadowed_mean_db, -8);
  EXPECT_DOUBLE_EQ(at(40).shadowed_sigma_db, 4.5);
  EXPECT_NEAR(at(40).enter, 0.0787, 5e-5);
  EXPECT_NEAR(at(40).leave, 0.1318, 5e-5);
  EXPECT_NEAR(at(40).shadowed_fraction(), 0.374, 5e-4);
  EXPECT_NEAR(at(60).shadowed_fraction(), 0.425, 5e-4);
  EXPECT_NEAR(at(80).shadowed_fraction(), 0.276, 5e-4);
  EXPECT_NEAR(at(50).shadowed_mean_db, (-8 - 6.3) / 2, 1e-12);
  EXPECT_NEAR(at(75).clear_sigma_db, 0.26 + 0.75 * (0.87 - 0.26), 1e-12);
  // Constant where nothing is published.
  EXPECT_EQ(at(5).shadowed_mean_db, at(40).shadowed_mean_db);
  EXPECT_EQ(at(90).enter, at(80).enter);
  options.environment = ShadowingEnvironment::Suburban;
  EXPECT_DOUBLE_EQ(at(40).shadowed_mean_db, -3.7);
  EXPECT_DOUBLE_EQ(at(60).shadowed_mean_db, -2);
  EXPECT_DOUBLE_EQ(at(80).clear_sigma_db, 0.58);
  EXPECT_NEAR(at(40).shadowed_fraction(), 0.517, 5e-4);
}

// Lengths and counts of the states along one route, to `step_m`.
struct Stretch {
  bool shadowed;
  double length_m;
};
std::vector<Stretch> stretches(One& shadowing, double travelled_m, double step_m) {
  std::vector<Stretch> result;
  double since = -1;
  bool state = false;
  for (long i = 0; i * step_m < travelled_m; ++i) {
    (void)shadowing.level_db(i * step_m);
    if (i > 0 && shadowing.shadowed() != state) {
      if (since >= 0) result.push_back({state, i * step_m - since});  // the first one has no start
      since = i * step_m;
    }
    state = shadowing.shadowed();
  }
  return result;
}

// Obstacles of a mean height of 8 m above 2 m, a gamma distribution of shape 2: of those above the roof of a
// car the fraction (1 + x) e^-x is above an antenna at the height 2 m + 4 m x.
TEST(Shadowing, EndsAboveTheObstacles) {
  ShadowingOptions options;
  options.enabled = true;
  const auto fraction = [&options](double height_m) {
    Shadowing shadowing(options, 3, "test");
    int shadowed = 0;
    constexpr int kFrames = 40000;
    for (int i = 0; i < kFrames; ++i) {
      shadowing.go_to(options.frame_m * i, height_m);
      shadowed += shadowing.of(direction_deg(70, 40)).shadowed;
    }
    return shadowed / double{kFrames};
  };
  const double car_fraction = shadowing_parameters(options, radians(40)).shadowed_fraction();
  EXPECT_NEAR(fraction(1.5), car_fraction, 0.015);
  EXPECT_NEAR(fraction(6), car_fraction * 2 * std::exp(-1), 0.015);
  EXPECT_NEAR(fraction(14), car_fraction * 4 * std::exp(-3), 0.01);
  EXPECT_EQ(fraction(200), 0);
}

TEST(Shadowing, StatesLastGeometricNumbersOfFrames) {
  ShadowingOptions options = custom(0.2, 0.35);
  options.frame_m = 4;
  One shadowing(options);
  constexpr double kStep = 0.5;
  const std::vector<Stretch> found = stretches(shadowing, 400e3, kStep);
  std::map<std::pair<bool, int>, int> counts;
  std::map<bool, int> totals;
  for (const Stretch& stretch : found) {
    const double frames = stretch.length_m / 4;
    ASSERT_NEAR(frames, std::round(frames), kStep / 4 + 1e-9);
    ++counts[{stretch.shadowed, static_cast<int>(std::round(frames))}];
    ++totals[stretch.shadowed];
  }
  ASSERT_GT(totals[true], 10000);
  for (const bool shadowed : {false, true}) {
    const double change = shadowed ? 0.35 : 0.2;
    for (int n = 1; n <= 8; ++n) {
      const double p = std::pow(1 - change, n - 1) * change;
      const double total = totals[shadowed];
      const int count = counts[{shadowed, n}];
      EXPECT_NEAR(count / total, p, 4.5 * std::sqrt(p * (1 - p) / total)) << shadowed << " " << n;
    }
  }
}

TEST(Shadowing, BeginsAnywhereOfAnEndlessWay) {
  // Fraction and time to the first change over many starts: (1 - change)^n beyond n frames, straight lines
  // between.
  const ShadowingOptions options = custom(0.1, 0.3);
  constexpr int kCount = 20000;
  int shadowed = 0;
  int beyond = 0, clear = 0;
  double level = 0;
  for (int seed = 0; seed < kCount; ++seed) {
    One shadowing(options, static_cast<std::uint64_t>(seed));
    level += shadowing.level_db(1000) / kCount;
    if (shadowing.shadowed()) {
      ++shadowed;
      continue;
    }
    ++clear;
    bool left = false;
    for (int i = 1; i <= 10 && !left; ++i) {
      (void)shadowing.level_db(1000 + 0.25 * options.frame_m * i);
      left = shadowing.shadowed();
    }
    if (!left) ++beyond;  // 2.5 frames
  }
  EXPECT_NEAR(shadowed / double{kCount}, 0.25, 4.5 * std::sqrt(0.25 * 0.75 / kCount));
  const double stay = (std::pow(0.9, 2) + std::pow(0.9, 3)) / 2;
  EXPECT_NEAR(beyond / static_cast<double>(clear), stay, 4.5 * std::sqrt(stay * (1 - stay) / clear));
  // Transitions in and out cancel: the mean is that of the fractions.
  EXPECT_NEAR(level, 0.75 * -1 + 0.25 * -9, 4.5 * 5 / std::sqrt(kCount));
}

TEST(Shadowing, LevelsAreNormalInEachState) {
  ShadowingOptions options = custom(0.1, 0.15);
  options.frame_m = 100;  // almost none of it is a transition
  One shadowing(options, 7);
  std::map<bool, std::vector<double>> levels;
  // Ten correlation lengths: independent.
  for (int i = 0; i < 40000; ++i) {
    const double level = shadowing.level_db(17.0 * i);
    levels[shadowing.shadowed()].push_back(level);
  }
  EXPECT_NEAR(levels[true].size() / 40000.0, 0.4, 0.06);
  for (auto& [shadowed, values] : levels) {
    const double mean = shadowed ? -9 : -1;
    const double sigma = shadowed ? 4 : 0.5;
    std::sort(values.begin(), values.end());
    const double n = static_cast<double>(values.size());
    double ks = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double cdf = 0.5 * std::erfc(-(values[i] - mean) / sigma / std::sqrt(2));
      ks = std::max({ks, std::abs(cdf - i / n), std::abs(cdf - (i + 1) / n)});
    }
    EXPECT_LT(ks, 1.95 / std::sqrt(n)) << shadowed;  // 0.1 % (Kolmogorov)
  }
}

TEST(Shadowing, LevelsCorrelateOverTheWay) {
  ShadowingOptions options = custom(0, 1);  // clear for ever
  options.numbers->clear_sigma_db = 2;
  for (const double step : {0.1, 1.0, 2.5}) {
    One shadowing(options, 3);
    std::vector<double> values;
    for (int i = 0; i * step < 60e3; ++i) values.push_back(shadowing.level_db(i * step) + 1);
    double square = 0;
    for (const double v : values) square += v * v / static_cast<double>(values.size());
    const double independent = 60e3 / (2 * 1.7);
    EXPECT_NEAR(square, 4, 4.5 * 4 * std::sqrt(2 / independent));
    for (const double lag : {5.0, 10.0}) {
      const std::size_t shift = static_cast<std::size_t>(std::lround(lag / step));
      double product = 0;
      for (std::size_t i = shift; i < values.size(); ++i) product += values[i] * values[i - shift];
      product /= static_cast<double>(values.size() - shift);
      EXPECT_NEAR(product / square, std::exp(-lag / 1.7), 4.5 / std::sqrt(independent)) << step << " " << lag;
    }
  }
}

TEST(Shadowing, StatesDoNotDependOnTheStep) {
  const ShadowingOptions options = custom(0.2, 0.3);
  One fine(options, 11);
  One coarse(options, 11);
  int shadowed = 0;
  for (int i = 0; i <= 20000; ++i) {
    (void)fine.level_db(0.5 * i);
    if (i % 37 != 0) continue;
    (void)coarse.level_db(0.5 * i);
    EXPECT_EQ(fine.shadowed(), coarse.shadowed()) << i;
    shadowed += fine.shadowed();
  }
  EXPECT_GT(shadowed, 100);
  EXPECT_LT(shadowed, 400);
}

TEST(Shadowing, PassesFromStateToStateInAStraightLine) {
  ShadowingOptions options = custom(0.3, 0.3);
  options.numbers->clear_sigma_db = options.numbers->shadowed_sigma_db = 0;
  One shadowing(options, 2);
  double before = shadowing.level_db(0);
  double least = 0, maximum = -100;
  for (int i = 1; i < 4000; ++i) {
    const double level = shadowing.level_db(0.1 * i);
    // 8 dB in 2.2 m.
    EXPECT_LE(std::abs(level - before), 8 / 2.2 * 0.1 + 1e-9);
    least = std::min(least, level);
    maximum = std::max(maximum, level);
    before = level;
  }
  EXPECT_EQ(least, -9);
  EXPECT_EQ(maximum, -1);
}

TEST(Shadowing, StandsStillAtOnePlace) {
  One shadowing(custom(0.2, 0.3));
  (void)shadowing.level_db(0);
  const double level = shadowing.level_db(10);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(shadowing.level_db(10), level);
  // No values were sampled between.
  One other(custom(0.2, 0.3));
  (void)other.level_db(0);
  (void)other.level_db(10);
  EXPECT_EQ(other.level_db(12), shadowing.level_db(12));
}

TEST(Shadowing, FollowsItsSeed) {
  const auto levels = [](std::uint64_t seed) {
    One shadowing(custom(0.2, 0.3), seed);
    std::vector<double> result;
    result.reserve(20);
    for (int i = 0; i < 20; ++i) result.push_back(shadowing.level_db(3.0 * i));
    return result;
  };
  EXPECT_EQ(levels(5), levels(5));
  EXPECT_NE(levels(5), levels(6));
}

// --- correlation between satellites

// Two satellites whose numbers correlate by `rho`, by the definition of the chain in shadowing.hpp: with the
// test's own numbers.
double both_shadowed(double rho, double enter, double leave) {
  RandomStream random(5, "pairs");
  const auto low = [](double z) { return 0.5 * std::erfc(-z / std::sqrt(2)); };
  bool a = false, b = false;
  int both = 0;
  constexpr int kFrames = 400000;
  for (int i = 0; i < kFrames; ++i) {
    const double first = random.normal();
    const double second = rho * first + std::sqrt(1 - rho * rho) * random.normal();
    a = low(first) < (a ? 1 - leave : enter);
    b = low(second) < (b ? 1 - leave : enter);
    both += a && b;
  }
  return both / double{kFrames};
}

TEST(Shadowing, NeighboursInTheSkyShareIt) {
  ShadowingOptions options = custom(0.1, 0.15);
  options.frame_m = 100;  // all frames start at nearly the same distance
  options.numbers->clear_sigma_db = options.numbers->shadowed_sigma_db = 2;
  const std::vector<double> apart_deg{0, 5, 10, 20, 30, 60};
  Shadowing shadowing(options, 3, "test");
  std::vector<double> both(apart_deg.size()), product(apart_deg.size());
  constexpr int kFrames = 60000;
  for (int i = 0; i < kFrames; ++i) {
    shadowing.go_to(100.0 * i);
    const auto from_mean = [](const Shadowing::Shadow& s) { return s.level_db - (s.shadowed ? -9 : -1); };
    const Shadowing::Shadow first = shadowing.of(direction_deg(20, 0));
    for (std::size_t k = 0; k < apart_deg.size(); ++k) {
      const Shadowing::Shadow other = shadowing.of(direction_deg(20 + apart_deg[k], 0));
      both[k] += (first.shadowed && other.shadowed) / double{kFrames};
      product[k] += from_mean(first) * from_mean(other) / 4 / kFrames;
    }
  }
  for (std::size_t k = 0; k < apart_deg.size(); ++k) {
    // Levels: the closed form of the nodes of the sky, for small angles.
    const double angle = apart_deg[k] / 10;
    const double rho = std::exp(-angle * angle / 2);
    EXPECT_NEAR(product[k], rho, 0.04) << apart_deg[k];
    // States: 0.03 of correlation are up to 0.01 here; 60,000 frames of four independent ones each give
    // 0.008.
    EXPECT_NEAR(both[k], both_shadowed(std::min(rho, 1.0), 0.1, 0.15), 0.018) << apart_deg[k];
  }
  EXPECT_NEAR(both.front(), 0.4, 0.012);
}

TEST(Shadowing, StatesCorrelateOverTheWay) {
  // The memory of a chain of two states decays by 1 - enter - leave per frame; positions of any phase within
  // a frame are on straight lines between.
  ShadowingOptions options = custom(0.1, 0.15);
  options.frame_m = 4;
  std::vector<double> fractions(21);
  double shadowed = 0;
  constexpr int kCount = 400;
  for (int seed = 0; seed < kCount; ++seed) {
    One one(options, static_cast<std::uint64_t>(seed));
    std::vector<bool> states;
    for (int i = 0; i < 600; ++i) {
      (void)one.level_db(i);
      states.push_back(one.shadowed());
    }
    for (std::size_t i = 0; i < 580; ++i) {
      shadowed += states[i] / (580.0 * kCount);
      for (std::size_t lag = 0; lag < fractions.size(); ++lag)
        fractions[lag] += (states[i] && states[i + lag]) / (580.0 * kCount);
    }
  }
  EXPECT_NEAR(shadowed, 0.4, 0.01);
  for (std::size_t lag = 0; lag < fractions.size(); ++lag) {
    const double frames = static_cast<double>(lag) / 4;
    const double below = std::floor(frames);
    const double kept = std::pow(0.75, below) * (1 - 0.25 * (frames - below));
    EXPECT_NEAR((fractions[lag] - 0.4 * 0.4) / (0.4 * 0.6), kept, 0.05) << lag;
  }
}

TEST(Shadowing, DoesNotDependOnWhoElseIsAsked) {
  const ShadowingOptions options = custom(0.2, 0.3);
  Shadowing alone(options, 8, "test"), forward(options, 8, "test"), backward(options, 8, "test");
  std::vector<Eigen::Vector3d> sky;
  sky.reserve(12);
  for (int i = 0; i < 12; ++i) sky.push_back(direction_deg(137.5 * i, 5 + 7 * i));
  for (int i = 0; i < 300; ++i) {
    alone.go_to(3.0 * i);
    forward.go_to(3.0 * i);
    backward.go_to(3.0 * i);
    std::vector<double> there, back;
    for (const auto& direction : sky) there.push_back(forward.of(direction).level_db);
    for (auto it = sky.rbegin(); it != sky.rend(); ++it) back.push_back(backward.of(*it).level_db);
    EXPECT_TRUE(std::equal(there.begin(), there.end(), back.rbegin())) << i;
    if (i % 7 == 0) {
      EXPECT_EQ(alone.of(sky[5]).level_db, there[5]) << i;
    }
  }
}

TEST(ShadowingOptions, NamesTheFieldThatIsOutOfRange) {
  const test::SpoiledOptions<ShadowingOptions> message;
  using O = ShadowingOptions;
  using testing::HasSubstr;
  EXPECT_EQ(message([](O&) {}), "");
  EXPECT_THAT(message([](O& o) { o.frame_m = 1; }), HasSubstr("frame_m"));
}

}  // namespace
}  // namespace canyon::disturbance
