#include "canyon/receiver/rtk/integer_least_squares.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>
#include <vector>

namespace canyon::rtk {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Covariance of `n` ambiguities of one band over a short time: a few unknowns common to all of them, and
/// small independent parts.
MatrixXd random_covariance(std::mt19937& random, int n, double shared, double own) {
  std::normal_distribution<double> normal;
  MatrixXd a(n, 3);
  for (int i = 0; i < a.size(); ++i) a.data()[i] = shared * normal(random);
  MatrixXd q = a * a.transpose();
  for (int i = 0; i < n; ++i) q(i, i) += own * own * (1 + std::abs(normal(random)));
  return q;
}

double distance(const VectorXd& real, const VectorXd& whole, const MatrixXd& q) {
  return (real - whole).dot(q.inverse() * (real - whole));
}

/// The two smallest distances of all integer vectors within the box around the ellipsoid of a radius.
std::vector<double> exhaustive(const VectorXd& real, const MatrixXd& q, double radius_squared) {
  const MatrixXd inverse = q.inverse();
  const auto n = real.size();
  VectorXd low(n), high(n), at(n);
  for (int i = 0; i < n; ++i) {
    const double reach = std::sqrt(q(i, i) * radius_squared);
    low(i) = std::ceil(real(i) - reach);
    high(i) = std::floor(real(i) + reach);
  }
  at = low;
  double best = 1e300, second = 1e300;
  while (true) {
    const double d = (real - at).dot(inverse * (real - at));
    if (d < best) {
      second = best;
      best = d;
    } else if (d < second) {
      second = d;
    }
    int i = 0;
    for (; i < n && ++at(i) > high(i); ++i) at(i) = low(i);
    if (i == n) break;
  }
  return {best, second};
}

TEST(IntegerLeastSquares, FindsWhatExhaustiveSearchFinds) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-100, 100);
  for (int trial = 0; trial < 4000; ++trial) {
    const int n = 1 + trial % 4;
    const MatrixXd q = random_covariance(random, n, 0.4 + 0.6 * (trial % 3), 0.1);
    VectorXd real(n);
    for (int i = 0; i < n; ++i) real(i) = uniform(random);
    const auto found = integer_least_squares(real, q, {1, 1e9});
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->best_distance, distance(real, found->best, q), 1e-6 * (1 + found->best_distance));
    EXPECT_NEAR(found->second_distance, distance(real, found->second, q),
                1e-6 * (1 + found->second_distance));
    const auto all = exhaustive(real, q, found->second_distance * (1 + 1e-9) + 1e-9);
    EXPECT_NEAR(all[0], found->best_distance, 1e-6 * (1 + all[0])) << trial;
    EXPECT_NEAR(all[1], found->second_distance, 1e-6 * (1 + all[1])) << trial;
    EXPECT_NE(found->best, found->second);
  }
}

TEST(IntegerLeastSquares, ALowestRatioChangesNoAnswerAboveIt) {
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  int above = 0;
  constexpr int kTrials = 2000;
  for (int trial = 0; trial < kTrials; ++trial) {
    const int n = 2 + trial % 20;
    const MatrixXd q = random_covariance(random, n, 3, 0.04);
    const MatrixXd root = q.llt().matrixL();
    VectorXd noise(n);
    for (int i = 0; i < n; ++i) noise(i) = (1 + trial % 2) * normal(random);
    const VectorXd real = root * noise;
    const auto exact = integer_least_squares(real, q, {1, 10});
    const auto limited = integer_least_squares(real, q, {2, 10});
    ASSERT_TRUE(exact && limited);
    if (exact->ratio() < 2) {
      EXPECT_LT(limited->ratio(), 2) << trial;
      EXPECT_GE(limited->best_distance, exact->best_distance) << trial;
    } else {
      ++above;
      EXPECT_EQ(limited->ratio(), exact->ratio()) << trial;
      EXPECT_EQ(limited->best, exact->best) << trial;
      EXPECT_EQ(limited->second_distance, exact->second_distance) << trial;
    }
  }
  EXPECT_GT(above, kTrials / 4);
  EXPECT_LT(above, 3 * kTrials / 4);
}

TEST(IntegerLeastSquares, PublishedExample) {
  // De Jonge and Tiberius, The LAMBDA method for integer ambiguity estimation: implementation aspects, LGR
  // 12, Delft 1996, the example of three ambiguities.
  MatrixXd q(3, 3);
  q << 6.290, 5.978, 0.544, 5.978, 6.292, 2.340, 0.544, 2.340, 6.288;
  const VectorXd real = Eigen::Vector3d(5.450, 3.100, 2.970);
  const auto found = integer_least_squares(real, q);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->best, Eigen::Vector3d(5, 3, 4));
  EXPECT_EQ(found->second, Eigen::Vector3d(6, 4, 4));
  EXPECT_NEAR(found->best_distance, 0.2183, 5e-4);
  EXPECT_NEAR(found->second_distance, 0.3073, 5e-4);
}

TEST(IntegerLeastSquares, DecorrelationKeepsTheVolumeAndTheNumbersWhole) {
  std::mt19937 random(7);
  const MatrixXd q = random_covariance(random, 12, 8, 0.02);
  const VectorXd real = VectorXd::LinSpaced(12, -40.3, 50.2);
  const Eigen::Index sizes[] = {5, 5, 9, 12};
  const auto sets = decorrelate(real, q, sizes);
  ASSERT_EQ(sets.size(), 4);
  for (std::size_t k = 0; k < sets.size(); ++k) {
    SCOPED_TRACE(k);
    const auto& by = sets[k];
    ASSERT_TRUE(by);
    const MatrixXd& a = by->a_from_z;
    ASSERT_EQ(a.rows(), sizes[k]);
    EXPECT_NEAR(std::abs(a.determinant()), 1, 1e-6);
    EXPECT_EQ(a, a.array().round().matrix());
    EXPECT_LT((by->origin + a * by->z - real.tail(sizes[k])).cwiseAbs().maxCoeff(), 1e-9);
    const MatrixXd expected = q.bottomRightCorner(sizes[k], sizes[k]);
    const MatrixXd z_covariance = by->factors.l.transpose() * by->factors.d.asDiagonal() * by->factors.l;
    EXPECT_LT((a * z_covariance * a.transpose() - expected).cwiseAbs().maxCoeff(),
              1e-8 * expected.cwiseAbs().maxCoeff());
    for (int j = 0; j + 1 < sizes[k];
         ++j) {  // no exchange of neighbours would reduce the later one's variance
      const double apart = by->factors.l(j + 1, j) - std::round(by->factors.l(j + 1, j));
      EXPECT_GE(by->factors.d(j) + apart * apart * by->factors.d(j + 1), by->factors.d(j + 1) * (1 - 1e-6));
    }
    EXPECT_LT(by->factors.d.maxCoeff(), expected.diagonal().minCoeff());
  }
}

TEST(IntegerLeastSquares, SucceedsAtLeastAsOftenAsTheBootstrappedBound) {
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  for (const double own : {0.08, 0.15, 0.25}) {
    const MatrixXd q = random_covariance(random, 6, 1.5, own);
    const Eigen::Index all[] = {6};
    const double bound = bootstrapped_success(decorrelate(VectorXd::Zero(6), q, all).front()->factors);
    const MatrixXd root = q.llt().matrixL();
    int right = 0;
    constexpr int kTrials = 4000;
    for (int trial = 0; trial < kTrials; ++trial) {
      VectorXd noise(6);
      for (int i = 0; i < 6; ++i) noise(i) = normal(random);
      const VectorXd real = root * noise;
      right += integer_least_squares(real, q)->best.isZero() ? 1 : 0;
    }
    const double fraction = static_cast<double>(right) / kTrials;
    EXPECT_GT(fraction, bound - 3 * std::sqrt(bound * (1 - bound) / kTrials)) << own;
    EXPECT_LT(fraction, bound + 0.1) << own;  // sharp after decorrelation
  }
}

TEST(IntegerLeastSquares, SixtyAmbiguitiesAtOnce) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const MatrixXd q = random_covariance(random, 60, 20, 0.01);
  const MatrixXd root = q.llt().matrixL();
  VectorXd noise(60);
  for (int i = 0; i < 60; ++i) noise(i) = normal(random);
  const VectorXd real = root * noise + VectorXd::Constant(60, 3'000'017);
  const auto found = integer_least_squares(real, q);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->best, VectorXd::Constant(60, 3'000'017));
  EXPECT_GT(found->ratio(), 3);
  EXPECT_LE(found->ratio(), 10);
}

TEST(IntegerLeastSquares, HasNoAnswerForWhatIsNoCovariance) {
  MatrixXd q = MatrixXd::Identity(2, 2);
  q(1, 1) = -1;
  EXPECT_FALSE(integer_least_squares(Eigen::Vector2d(0.1, 0.2), q));
  q(1, 1) = std::nan("");
  EXPECT_FALSE(integer_least_squares(Eigen::Vector2d(0.1, 0.2), q));
  q << 1, 1, 1, 1;  // of rank 1
  EXPECT_FALSE(integer_least_squares(Eigen::Vector2d(0.1, 0.2), q));
  q = MatrixXd::Identity(2, 2);
  EXPECT_FALSE(integer_least_squares(Eigen::Vector2d(0.1, std::nan("")), q));
  EXPECT_FALSE(integer_least_squares(Eigen::Vector2d(0.1, 1e13), q));
  const auto exact = integer_least_squares(Eigen::Vector2d(4, -2), q);
  ASSERT_TRUE(exact);
  EXPECT_EQ(exact->best_distance, 0);
  EXPECT_TRUE(std::isinf(exact->ratio()));
}

}  // namespace
}  // namespace canyon::rtk
