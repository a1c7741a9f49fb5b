#include "canyon/heatmap/cells/cell_solution.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <vector>

#include "canyon/base/random.hpp"

namespace canyon::heatmap::cell_solution_test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Kabsch, Acta Crystallographica A 32, 1976: the least-squares rotation over all directions.
Matrix3d rotation_by_svd(const std::vector<Vector3d>& a, const std::vector<Vector3d>& b) {
  Matrix3d sum = Matrix3d::Zero();
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i].transpose();
  const Eigen::JacobiSVD<Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vector3d sign(1, 1, 1);
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) sign.z() = -1;
  return svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
}

TEST(RotationBetween, AgreesWithTheRotationAndWithLeastSquares) {
  RandomStream random(1, "rotation");
  const auto vector = [&] { return Vector3d(random.normal(), random.normal(), random.normal()); };
  for (int trial = 0; trial < 2000; ++trial) {
    const Vector3d axis = vector().normalized();
    const Matrix3d truth = Eigen::AngleAxisd(3 * random.normal(), axis).toRotationMatrix();
    std::vector<Vector3d> a, b;
    double sine = 0;
    for (int i = 0; i < 2 + trial % 11; ++i) {
      b.push_back(vector().normalized());
      a.push_back(truth * b.back());
      sine = std::max(sine, b.front().cross(b.back()).norm());
    }
    if (sine < 0.01) continue;
    const Matrix3d found = rotation_between(a, b);
    EXPECT_LT((found - truth).norm(), 5e-15 / sine) << trial;
    // Two directions leave a second singular value of sine^2 / 2.
    EXPECT_LT((found - rotation_by_svd(a, b)).norm(), 2e-14 / (sine * sine)) << trial;
  }
}

TEST(RotationBetween, IsTheIdentityForParallelDirections) {
  const std::vector<Vector3d> one{Vector3d::UnitX()}, both{Vector3d::UnitX(), -Vector3d::UnitX()};
  EXPECT_TRUE(rotation_between(one, one).isIdentity(0));
  EXPECT_TRUE(rotation_between(both, both).isIdentity(0));
  EXPECT_TRUE(rotation_between({}, {}).isIdentity(0));
}

}  // namespace
}  // namespace canyon::heatmap::cell_solution_test
