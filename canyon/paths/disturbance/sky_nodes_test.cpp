#include "canyon/paths/disturbance/skyline.hpp"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/paths/disturbance/shadowing.hpp"

namespace canyon::disturbance {
namespace {

using geodesy::radians;

Eigen::Vector3d somewhere(RandomStream& random) {
  return geodesy::enu_from_azimuth_elevation(2 * geodesy::kPi * random.uniform(),
                                             std::asin(random.uniform()));
}

// The correlation of the numbers of two directions in one realization, by their weights.
double correlation(const SkyNodes& nodes, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  std::vector<SkyNodes::NodeWeight> from_a, from_b;
  nodes.weights(a, from_a);
  nodes.weights(b, from_b);
  std::vector<double> weights(nodes.size(), 0.0);
  for (const SkyNodes::NodeWeight& node_weight : from_a) weights[node_weight.node] = node_weight.weight;
  return SkyNodes::blend(from_b, weights);
}

// The integral of both weights over the sphere, of two von Mises-Fisher kernels in closed form.
double expected(double angle, double apart) {
  const double k = 2 / (angle * angle);
  const auto log_f = [](double x) { return x + std::log1p(-std::exp(-2 * x)) - std::log(2 * x); };
  return std::exp(log_f(2 * k * std::cos(apart / 2)) - log_f(2 * k));
}

TEST(SkyNodes, EveryDirectionHasUnitVariance) {
  RandomStream random(1, "directions");
  for (const double angle_deg : {5.0, 15.0, 30.0, 60.0, 90.0}) {
    const SkyNodes nodes(radians(angle_deg));
    for (int i = 0; i < 200; ++i) {
      const Eigen::Vector3d direction = somewhere(random);
      EXPECT_NEAR(correlation(nodes, direction, direction), 1, 1e-12) << angle_deg;
    }
    EXPECT_NEAR(correlation(nodes, {0, 0, 1}, {0, 0, 1}), 1, 1e-12);
    EXPECT_NEAR(correlation(nodes, {1, 0, 0}, {1, 0, 0}), 1, 1e-12);
  }
}

TEST(SkyNodes, DirectionsCorrelateByTheAngleBetweenThem) {
  RandomStream random(2, "directions");
  for (const double angle_deg : {5.0, 10.0, 30.0, 60.0}) {
    const double angle = radians(angle_deg);
    const SkyNodes nodes(angle);
    double square = 0;
    constexpr int kCount = 2000;
    for (int i = 0; i < kCount; ++i) {
      const Eigen::Vector3d a = somewhere(random);
      Eigen::Vector3d b = somewhere(random);
      // Mostly at small angles, where the correlation falls.
      if (i % 4 != 0) b = (a + 1.5 * angle * random.uniform() * (b - a)).normalized();
      const double apart = std::atan2(a.cross(b).norm(), a.dot(b));
      const double difference = correlation(nodes, a, b) - expected(angle, apart);
      EXPECT_LT(std::abs(difference), 0.15) << angle_deg << " " << apart;
      square += difference * difference / kCount;
    }
    EXPECT_LT(std::sqrt(square), 0.025) << angle_deg;
  }
  // The correlation at `angle` is exp(-1/2).
  EXPECT_NEAR(expected(radians(10), radians(10)), std::exp(-0.5), 0.003);
}

TEST(SkyNodes, ADrawIsNormalAtEveryDirection) {
  const SkyNodes nodes(radians(10));
  RandomStream random(3, "draws");
  std::vector<double> numbers(nodes.size());
  for (const double elevation : {0.0, 0.5, 1.5}) {
    std::vector<SkyNodes::NodeWeight> weights;
    nodes.weights(geodesy::enu_from_azimuth_elevation(1, elevation), weights);
    std::vector<double> blended;
    constexpr int kCount = 100000;
    for (int i = 0; i < kCount; ++i) {
      SkyNodes::draw(random, numbers);
      blended.push_back(SkyNodes::blend(weights, numbers));
    }
    std::sort(blended.begin(), blended.end());
    double ks = 0;
    for (int i = 0; i < kCount; ++i) {
      const double cdf = 0.5 * std::erfc(-blended[static_cast<std::size_t>(i)] / std::sqrt(2));
      ks = std::max(ks, std::abs(cdf - (i + 0.5) / kCount));
    }
    EXPECT_LT(ks, 0.001 + 1.95 / std::sqrt(kCount))
        << elevation;  // 0.1 % (Kolmogorov) beyond the allowed difference
  }
}

TEST(FrameStates, StepAsTheirChainDoes) {
  const SkyNodes nodes(radians(15));
  std::vector<SkyNodes::NodeWeight> weights;
  nodes.weights(geodesy::enu_from_azimuth_elevation(1, 0.5), weights);
  // The last one changes more often than not.
  for (const FrameStates::Steps steps : {FrameStates::Steps{0.1, 0.2}, {0.02, 0.03}, {0.7, 0.8}}) {
    FrameStates chain(nodes, 4, "chain");
    int off = 0, entered = 0, on = 0, left = 0;
    bool before = chain.at(-1, weights, steps).now;
    constexpr int kFrames = 100000;
    for (int i = 0; i < kFrames; ++i) {
      const FrameStates::States states = chain.at(i, weights, steps);
      EXPECT_EQ(states.before, before);
      (before ? on : off) += 1;
      if (states.now != before) (before ? left : entered) += 1;
      before = states.now;
    }
    const auto near = [](int count, int of, double p) {
      EXPECT_NEAR(count / double(of), p, 4.5 * std::sqrt(p * (1 - p) / of));
    };
    near(entered, off, steps.enter);
    near(left, on, steps.leave);
    // The state at a position does not depend on the earlier ones.
    FrameStates other(nodes, 4, "chain");
    for (int i = kFrames - 1; i > kFrames - 500; i -= 37) {
      const FrameStates::States one = chain.at(i, weights, steps), same = other.at(i, weights, steps);
      EXPECT_EQ(one.now, same.now);
      EXPECT_EQ(one.before, same.before);
    }
  }
}

TEST(FrameStates, FarDirectionsHaveNothingInCommon) {
  const SkyNodes nodes(radians(10));
  std::vector<SkyNodes::NodeWeight> east, west;
  nodes.weights(geodesy::enu_from_azimuth_elevation(radians(90), 0.5), east);
  nodes.weights(geodesy::enu_from_azimuth_elevation(radians(270), 0.5), west);
  FrameStates chain(nodes, 4, "chain");
  int both = 0;
  constexpr int kFrames = 40000;
  for (int i = 0; i < kFrames; ++i) {
    const FrameStates::Steps steps{0.3, 0.7};  // no memory: on if u < 0.3
    both += chain.at(i, east, steps).now && chain.at(i, west, steps).now;
  }
  EXPECT_NEAR(both / double{kFrames}, 0.09, 4.5 * std::sqrt(0.09 * 0.91 / kFrames));
}

TEST(FrameStates, TakeSureStepsAtTheirWord) {
  const SkyNodes nodes(radians(15));
  std::vector<SkyNodes::NodeWeight> weights;
  nodes.weights({0, 0, 1}, weights);
  FrameStates chain(nodes, 4, "chain");
  for (int i = 0; i < 100; ++i) {
    EXPECT_FALSE(chain.at(i, weights, {0, 1}).now);
    EXPECT_FALSE(chain.at(i, weights, {0, 1e-9}).now);
    EXPECT_NE(chain.at(i, weights, {1, 1}).now, chain.at(i, weights, {1, 1}).before);
    EXPECT_TRUE(chain.at(i, weights, {1, 1e-9}).now);
  }
}

}  // namespace
}  // namespace canyon::disturbance
