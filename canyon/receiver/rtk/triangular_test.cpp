#include "canyon/receiver/rtk/integer_least_squares.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "canyon/base/random.hpp"

namespace canyon::rtk::triangular_test {
namespace {

using Eigen::MatrixXd;

MatrixXd random_matrix(RandomStream& random, Eigen::Index rows, Eigen::Index columns) {
  return MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

// Q = L^T D L, multiplied out; B Q^-1 by Eigen's inverse.
TEST(Triangular, FactorsAndSolves) {
  RandomStream random(1, "matrices");
  for (Eigen::Index n = 1; n <= 40; n += 3) {
    const MatrixXd root = random_matrix(random, n, n + 5);
    const MatrixXd q = root * root.transpose();
    const Triangular factors = triangular(q);
    ASSERT_EQ(factors.d.size(), n);
    EXPECT_LT((factors.l.transpose() * factors.d.asDiagonal() * factors.l - q).norm(), 1e-12 * q.norm());
    const MatrixXd b = random_matrix(random, 7, n);
    EXPECT_LT((times_inverse(b, factors) * q - b).norm(), 1e-9 * b.norm()) << n;
  }
}

TEST(Triangular, EndsBeforeWhatOthersExplain) {
  MatrixXd q(3, 3);
  q << 1, 1, 0, 1, 1, 0, 0, 0, 2;
  EXPECT_EQ(triangular(q).d.size(), 2);
}

}  // namespace
}  // namespace canyon::rtk::triangular_test
