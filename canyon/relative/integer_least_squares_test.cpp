#include "canyon/relative/integer_least_squares.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>
#include <vector>

namespace canyon::relative {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Covariance of `n` ambiguities of one band over a short time: a few unknowns that all of them share, and
/// little of their own.
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

/// The two least distances of all whole vectors within the box that holds the ellipsoid of a radius.
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
  std::uniform_real_distribution<double> anywhere(-100, 100);
  for (int trial = 0; trial < 4000; ++trial) {
    const int n = 1 + trial % 4;
    const MatrixXd q = random_covariance(random, n, 0.4 + 0.6 * (trial % 3), 0.1);
    VectorXd real(n);
    for (int i = 0; i < n; ++i) real(i) = anywhere(random);
    const auto found = integer_least_squares(real, q, 1e9);
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
  const auto by = decorrelate(q);
  ASSERT_TRUE(by);
  EXPECT_NEAR(std::abs(by->z_from_a.determinant()), 1, 1e-6);
  EXPECT_EQ(by->z_from_a, by->z_from_a.array().round().matrix());
  const MatrixXd of_z = by->z_from_a * q * by->z_from_a.transpose();
  const MatrixXd again = by->factors.l.transpose() * by->factors.d.asDiagonal() * by->factors.l;
  EXPECT_LT((of_z - again).cwiseAbs().maxCoeff(), 1e-8 * of_z.cwiseAbs().maxCoeff());
  for (int j = 0; j < 11; ++j) {  // no exchange of neighbours would make the later one better known
    const double apart = by->factors.l(j + 1, j) - std::round(by->factors.l(j + 1, j));
    EXPECT_GE(by->factors.d(j) + apart * apart * by->factors.d(j + 1), by->factors.d(j + 1) * (1 - 1e-6));
  }
  EXPECT_LT(by->factors.d.maxCoeff(), q.diagonal().minCoeff());
}

TEST(IntegerLeastSquares, SucceedsAtLeastAsOftenAsTheBootstrappedBound) {
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  for (const double own : {0.08, 0.15, 0.25}) {
    const MatrixXd q = random_covariance(random, 6, 1.5, own);
    const auto by = decorrelate(q);
    const double bound = bootstrapped_success(by->factors);
    const MatrixXd root = q.llt().matrixL();
    int right = 0;
    constexpr int kTrials = 4000;
    for (int trial = 0; trial < kTrials; ++trial) {
      VectorXd noise(6);
      for (int i = 0; i < 6; ++i) noise(i) = normal(random);
      const VectorXd real = root * noise;
      right += integer_least_squares(real, q)->best.isZero() ? 1 : 0;
    }
    const double share = static_cast<double>(right) / kTrials;
    EXPECT_GT(share, bound - 3 * std::sqrt(bound * (1 - bound) / kTrials)) << own;
    EXPECT_LT(share, bound + 0.1) << own;  // sharp behind decorrelation
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
}  // namespace canyon::relative
