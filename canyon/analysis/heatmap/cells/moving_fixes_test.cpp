#include "canyon/analysis/heatmap/cells/moving_fixes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

namespace canyon::heatmap {
namespace {

/// A street of cells of 2 m, one row.
TileCells street(std::uint32_t columns) {
  TileCells cells;
  cells.tile.columns = columns;
  cells.tile.rows = 1;
  cells.plane.spacing_m = 2;
  cells.state.assign(columns, CellState::Computed);
  return cells;
}

/// Filtered errors along the street of a receiver at 8 m/s. @param error_m NaN: no fix
std::vector<double> filtered(const TileCells& cells, double variance_m2,
                             const std::function<double(std::size_t)>& error_m) {
  Movement movement{{simulation::Motion::Driving, 8}, {}};
  movement.filter.acceleration_horizontal = movement.filter.acceleration_vertical = 2;
  MovingFixes fixes(cells, 1, movement);
  for (std::size_t i = 0; i < cells.state.size(); ++i) {
    CellFix::CellSolution result;
    result.solved = !std::isnan(error_m(i));
    result.error = {0, error_m(i), 0};
    result.covariance = variance_m2 * Eigen::Matrix3d::Identity();
    fixes.set(i, {result});
  }
  fixes.filter();
  std::vector<double> errors;
  for (std::size_t i = 0; i < cells.state.size(); ++i) {
    CellValues values;
    fixes.describe(i, {}, false, values);
    errors.push_back(double{values.of[static_cast<std::size_t>(Layer::HorizontalError)]});
  }
  return errors;
}

// A random walk of density Q = 4 / 12 m^2/s, measured with white noise of R = 25 m^2 s: P = sqrt(Q R), the
// gain is P / R = 0.115 a second. With a factor of 1 - 0.115 t in each cell of t = 0.25 s, a step of 10 m
// decays with a time constant of 8.7 s in one direction, and is not yet visible in the other: their mean.
TEST(MovingFixes, ForgetAsTheSteadyStateOfTheFilterDoes) {
  const std::vector<double> errors =
      filtered(street(401), 25, [](std::size_t i) { return i < 200 ? 0.0 : 10.0; });
  const double tau_s = 1 / std::sqrt(4.0 / 12 / 25);
  for (const double after_s : {2.0, 5.0, 10.0}) {
    const double expected_m = (10 * (1 - std::exp(-after_s / tau_s)) + 10) / 2;
    EXPECT_NEAR(errors[200 + static_cast<std::size_t>(after_s * 4)], expected_m, 0.3) << after_s;
  }
}

TEST(MovingFixes, KeepAConstantErrorAndAverageOnesThatChange) {
  for (const double error : filtered(street(200), 25, [](std::size_t) { return 7.0; })) {
    EXPECT_NEAR(error, 7, 1e-4);
  }
  const std::vector<double> errors =
      filtered(street(200), 25, [](std::size_t i) { return i % 2 == 0 ? 7.0 : -7.0; });
  EXPECT_LT(errors[100], 0.3);
}

// The filter coasts for 5 s: 20 cells from each end.
TEST(MovingFixes, CoastOverAGapAndBeginAnewBehindAWall) {
  const auto with_gap = [](std::size_t i) {
    return i >= 100 && i < 150 ? std::nan("") : i < 100 ? 1.0 : 3.0;
  };
  TileCells cells = street(250);
  const std::vector<double> errors = filtered(cells, 25, with_gap);
  EXPECT_NEAR(errors[118], 1, 1e-4);
  EXPECT_TRUE(std::isnan(errors[125]));
  EXPECT_NEAR(errors[131], 3, 1e-4);
  cells.state[100] = CellState::InsideBuilding;
  const std::vector<double> walled = filtered(cells, 25, [](std::size_t i) { return i < 100 ? 1.0 : 3.0; });
  EXPECT_NEAR(walled[99], 1, 1e-4);
  EXPECT_NEAR(walled[101], 3, 1e-4);
}

}  // namespace
}  // namespace canyon::heatmap
