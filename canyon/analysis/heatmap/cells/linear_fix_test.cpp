#include "canyon/analysis/heatmap/cells/cell_fix.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <vector>

#include "canyon/base/random.hpp"
#include "canyon/receiver/positioning/pseudorange_model.hpp"

namespace canyon::heatmap {
namespace {

using Eigen::Vector3d;

struct Rows {
  std::vector<Vector3d> directions;
  std::vector<int> clocks;
  std::vector<double> weights, errors_m;

  void add(const Vector3d& direction, int clock, double weight, double error_m) {
    directions.push_back(direction.normalized());
    clocks.push_back(clock);
    weights.push_back(weight);
    errors_m.push_back(error_m);
  }
  [[nodiscard]] LinearFix fix(int systems, bool weighted = true) const {
    LinearFix fix(systems);
    for (std::size_t i = 0; i < weights.size(); ++i) {
      fix.add(directions[i], clocks[i], weighted ? weights[i] : 1, errors_m[i]);
    }
    return fix;
  }
  /// H, its rows times the roots of the weights.
  [[nodiscard]] positioning::Design design(int systems, bool weighted) const {
    const auto n = static_cast<Eigen::Index>(weights.size());
    positioning::Design design = positioning::Design::Zero(n, 3 + systems);
    for (Eigen::Index row = 0; row < n; ++row) {
      const auto i = static_cast<std::size_t>(row);
      design.row(row).head<3>() = -directions[i].transpose();
      design(row, clocks[i]) = 1;
      if (weighted) design.row(row) *= std::sqrt(weights[i]);
    }
    return design;
  }
};

// 20,000 geometries of one to four systems, weights of 1 to 100 and errors of a normal distribution of 100 m,
// against positioning::cofactor(), which decomposes H by QR with column pivoting.
TEST(LinearFix, IsWhatAnOrthogonalDecompositionGives) {
  RandomStream random(7, "linear fix");
  double worst_m = 0, worst_gain = 0, worst_dop = 0, worst_covariance = 0;
  int compared = 0;
  for (int trial = 0; trial < 20'000; ++trial) {
    const int systems = 1 + trial % 4, satellites = 4 + 2 * systems + trial % 7;
    Rows rows;
    for (int i = 0; i < satellites; ++i) {
      // Often in a small part of the sky, as in a street.
      const double across = trial % 3 == 0 ? 0.2 : 1;
      const Vector3d u(across * random.normal(), random.normal(), 0.1 + std::abs(random.normal()));
      rows.add(u, 3 + i % systems, 1 + 99 * random.uniform(), 100 * random.normal());
    }
    LinearFix fix = rows.fix(systems), shape = rows.fix(systems, false);
    const auto weighted = positioning::cofactor(rows.design(systems, true));
    const auto plain = positioning::cofactor(rows.design(systems, false));
    ASSERT_TRUE(fix.factorise() && shape.factorise() && weighted && plain);
    const positioning::Dop expected = positioning::dop_from_cofactor(*plain), dop = shape.dop();
    if (expected.pdop > 100) continue;
    ++compared;
    const positioning::Design h = rows.design(systems, false);
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(3 + systems);
    double largest_m = 0;
    for (std::size_t i = 0; i < rows.weights.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const Eigen::VectorXd gain = *weighted * h.row(row).transpose() * rows.weights[i];
      sum += gain * rows.errors_m[i];
      largest_m = std::max(largest_m, std::abs(rows.errors_m[i]));
      const LinearFix::Unknowns found = fix.gain(rows.directions[i], rows.clocks[i], rows.weights[i]);
      for (Eigen::Index k = 0; k < gain.size(); ++k) {
        worst_gain = std::max(worst_gain, std::abs(found[static_cast<std::size_t>(k)] - gain[k]));
      }
    }
    const LinearFix::Unknowns x = fix.solve();
    for (Eigen::Index k = 0; k < sum.size(); ++k) {
      worst_m = std::max(worst_m, std::abs(x[static_cast<std::size_t>(k)] - sum[k]) / largest_m);
    }
    const Eigen::Matrix3d covariance = weighted->topLeftCorner<3, 3>();
    worst_covariance = std::max(worst_covariance, (fix.covariance() - covariance).norm() / covariance.norm());
    for (const auto of : {&positioning::Dop::gdop, &positioning::Dop::pdop, &positioning::Dop::hdop,
                          &positioning::Dop::vdop, &positioning::Dop::tdop}) {
      worst_dop = std::max(worst_dop, std::abs(dop.*of / (expected.*of) - 1));
    }
  }
  std::cout << compared << " geometries: " << worst_m << " of the largest error, gain " << worst_gain
            << ", covariance " << worst_covariance << ", DOP " << worst_dop << " of themselves\n";
  EXPECT_GT(compared, 19'000);
  EXPECT_LT(worst_m, 1e-10);
  EXPECT_LT(worst_gain, 1e-10);
  EXPECT_LT(worst_covariance, 1e-10);
  EXPECT_LT(worst_dop, 1e-10);
}

// One clock, satellites in the directions of a regular tetrahedron: H^T H = diag(4/3, 4/3, 4/3, 4), so that
// PDOP = sqrt(9/4) and TDOP = sqrt(1/4).
TEST(LinearFix, OfATetrahedronIsAClosedForm) {
  Rows rows;
  for (const Vector3d& u : {Vector3d(1, 1, 1), {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}}) rows.add(u, 3, 1, 7);
  LinearFix fix = rows.fix(1);
  ASSERT_TRUE(fix.factorise());
  EXPECT_NEAR(fix.dop().pdop, 1.5, 1e-15);
  EXPECT_NEAR(fix.dop().tdop, 0.5, 1e-15);
  EXPECT_NEAR(fix.covariance()(1, 1), 0.75, 1e-15);
  const LinearFix::Unknowns x = fix.solve();  // a common error changes only the clock
  EXPECT_NEAR(std::hypot(x[0], x[1], x[2]), 0, 1e-14);
  EXPECT_NEAR(x[3], 7, 1e-14);
}

// On a cone about an axis, the distance along it and the clock are one unknown.
TEST(LinearFix, IsRefusedWhereRowsDoNotDetermineIt) {
  for (const double off : {0.0, 1e-9, 1e-7}) {
    Rows rows;
    for (int i = 0; i < 8; ++i) {
      const double azimuth = 0.7 * i + 0.1, elevation = 0.6 + off * i;
      rows.add({std::cos(elevation) * std::sin(azimuth), std::cos(elevation) * std::cos(azimuth),
                std::sin(elevation)},
               3, 1, 0);
    }
    EXPECT_FALSE(rows.fix(1).factorise()) << off;
    EXPECT_FALSE(positioning::cofactor(rows.design(1, false), positioning::kRankThreshold)) << off;
  }
  Rows few;
  few.add({0, 0, 1}, 3, 1, 0);
  few.add({0, 1, 1}, 3, 1, 0);
  few.add({1, 0, 1}, 3, 1, 0);
  EXPECT_FALSE(few.fix(1).factorise());
}

}  // namespace
}  // namespace canyon::heatmap
