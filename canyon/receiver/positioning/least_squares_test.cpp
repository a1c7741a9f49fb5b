#include "canyon/receiver/positioning/least_squares.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "canyon/base/random.hpp"

namespace canyon::positioning::least_squares_test {
namespace {

// The normal equations: x = C A^T b with C = (A^T A)^-1; its covariance C A^T D^2 A C; leverages of A C A^T.
TEST(LeastSquares, EqualsTheNormalEquations) {
  RandomStream random(1, "rows");
  for (int run = 0; run < 200; ++run) {
    const Eigen::Index rows = 8 + run % 30, columns = 1 + run % 8;
    Design design(rows, columns);
    Eigen::VectorXd b(rows), sigma(rows);
    for (Eigen::Index i = 0; i < rows; ++i) {
      for (Eigen::Index k = 0; k < columns; ++k) design(i, k) = random.normal();
      b(i) = random.normal();
      sigma(i) = random.uniform() + 0.1;
    }
    const LeastSquares least_squares(design);
    ASSERT_EQ(least_squares.rank(1e-6), columns);
    const Eigen::MatrixXd a = design;
    const Eigen::MatrixXd c = (a.transpose() * a).inverse();
    const Eigen::MatrixXd spread = c * a.transpose() * sigma.asDiagonal();
    const Eigen::MatrixXd projection = a * c * a.transpose();
    const double scale = c.norm();
    const Eigen::VectorXd x = c * a.transpose() * b;
    EXPECT_LT((least_squares.solve(b) - x).norm(), 1e-10 * (1 + scale)) << run;
    EXPECT_LT((least_squares.cofactor() - c).norm(), 1e-10 * (1 + scale * scale)) << run;
    EXPECT_LT((least_squares.covariance(sigma) - spread * spread.transpose()).norm(),
              1e-10 * (1 + scale * scale))
        << run;
    EXPECT_LT((least_squares.leverages() - projection.diagonal()).norm(), 1e-10 * (1 + scale)) << run;
  }
}

TEST(LeastSquares, SolvesWhatLacksRankByItsPivots) {
  Design design(5, 3);
  design << 1, 2, 0, 1, 2, 1, 1, 2, 2, 1, 2, 3, 1, 2, 4;
  const LeastSquares least_squares(design);
  EXPECT_EQ(least_squares.rank(1e-6), 2);
  const Eigen::VectorXd b = design * Eigen::Vector3d(0, 1, -1);
  EXPECT_LT((design * least_squares.solve(b) - b).norm(), 1e-12);
  EXPECT_NEAR(least_squares.leverages().sum(), 2, 1e-12);
}

}  // namespace
}  // namespace canyon::positioning::least_squares_test
