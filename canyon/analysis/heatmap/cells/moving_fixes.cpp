#include "canyon/analysis/heatmap/cells/moving_fixes.hpp"

#include <array>
#include <cmath>
#include <cstddef>

#include "canyon/analysis/heatmap/kernels/tile_tasks.hpp"
#include "canyon/receiver/positioning/least_squares.hpp"

namespace canyon::heatmap {
namespace {

/// The interval between fixes [s].
constexpr double kEpoch_s = 1;
/// The four axes of lines, in cells eastwards and northwards.
constexpr std::array<std::array<int, 2>, 4> kAxes{{{1, 0}, {1, 1}, {0, 1}, {-1, 1}}};

double length_of(const std::array<int, 2>& step) {
  return std::hypot(step[0], step[1]);
}

}  // namespace

bool is_motion_layer(Layer layer) {
  return layer == Layer::HorizontalError || layer == Layer::VerticalError || layer == Layer::Availability ||
         layer == Layer::ProtectionLevel || (info(layer).needs_samples && is_solver_layer(layer));
}

/// The filter along one line.
struct MovingFixes::TrackFilter {
  Fix at;  ///< without variances: not started
  double lost_s = 0;
  /// Horizontal: error variance of the estimate if the fixes' errors are correlated, and covariance of the
  /// two over the deviation of the latter (positioning::report_accuracy()).
  double reported_m2 = 0, lasting_m = 0;

  void go(const Fix& fix, double step_s, const positioning::PositionFilterOptions& filter) {
    lost_s += step_s;
    if (lost_s > filter.coast_s) at = {};
    const auto grow = [step_s](float& variance_m2, double density) {
      if (variance_m2 > 0) variance_m2 += static_cast<float>(density * density / 12 * kEpoch_s * step_s);
    };
    const float before_m2 = at.horizontal_m2;
    grow(at.horizontal_m2, filter.acceleration_horizontal);
    reported_m2 += at.horizontal_m2 - before_m2;
    lasting_m *= filter.error_correlation_s > 0 ? std::exp(-step_s / filter.error_correlation_s) : 0;
    grow(at.vertical_m2, filter.acceleration_vertical);
    if (!(fix.horizontal_m2 > 0)) return;
    lost_s = 0;
    if (!(at.horizontal_m2 > 0)) {
      at = fix;
      reported_m2 = fix.horizontal_m2;
      lasting_m = -std::sqrt(reported_m2);
      return;
    }
    const auto epochs = static_cast<float>(step_s / kEpoch_s);
    const float k = at.horizontal_m2 / (at.horizontal_m2 + fix.horizontal_m2 / epochs);
    const float k_up = at.vertical_m2 / (at.vertical_m2 + fix.vertical_m2 / epochs);
    at.east_m += k * (fix.east_m - at.east_m);
    at.north_m += k * (fix.north_m - at.north_m);
    at.up_m += k_up * (fix.up_m - at.up_m);
    const double fix_variance_m2 =
        filter.error_correlation_s > 0 ? fix.horizontal_m2 : fix.horizontal_m2 / epochs;
    const double fix_sigma_m = std::sqrt(fix_variance_m2);
    reported_m2 =
        (1 - k) * (1 - k) * reported_m2 + k * k * fix_variance_m2 - 2 * k * (1 - k) * lasting_m * fix_sigma_m;
    lasting_m = (1 - k) * lasting_m - k * fix_sigma_m;
    at.horizontal_m2 *= 1 - k;
    at.vertical_m2 *= 1 - k_up;
  }
};

MovingFixes::MovingFixes(const TileCells& cells, std::size_t lanes, const Movement& movement)
    : cells_(cells), lanes_(lanes), movement_(movement), fixes_(lanes * cells.state.size()) {}

void MovingFixes::set(std::size_t cell, const std::vector<CellFix::CellSolution>& answers) {
  for (std::size_t lane = 0; lane < lanes_; ++lane) {
    const CellFix::CellSolution& result = answers[lane];
    if (!result.solved) continue;
    const double major_m = positioning::horizontal_protection_level_m(result.covariance, 1);
    fixes_[lane * cells_.state.size() + cell] = {
        static_cast<float>(result.error.x()), static_cast<float>(result.error.y()),
        static_cast<float>(result.error.z()), static_cast<float>(major_m * major_m),
        static_cast<float>(result.covariance(2, 2))};
  }
}

/// Calls f(cell, the previous computed cell on the line, or the number of cells).
template <typename F>
void MovingFixes::sweep(int east, int north, const F& f) const {
  const auto columns = static_cast<std::ptrdiff_t>(cells_.tile.columns),
             rows = static_cast<std::ptrdiff_t>(cells_.tile.rows);
  const auto computed = [&](std::ptrdiff_t column, std::ptrdiff_t row) {
    return column >= 0 && row >= 0 && column < columns && row < rows &&
           cells_.state[static_cast<std::size_t>(row * columns + column)] == CellState::Computed;
  };
  for (std::ptrdiff_t r = 0; r < rows; ++r) {
    const std::ptrdiff_t row = north < 0 ? rows - 1 - r : r;
    for (std::ptrdiff_t c = 0; c < columns; ++c) {
      const std::ptrdiff_t column = east < 0 ? columns - 1 - c : c;
      if (!computed(column, row)) continue;
      const std::ptrdiff_t before =
          computed(column - east, row - north) ? (row - north) * columns + column - east : columns * rows;
      f(static_cast<std::size_t>(row * columns + column), static_cast<std::size_t>(before));
    }
  }
}

/// For each cell, the axis with the longest run of cells through it, in metres.
std::vector<std::uint8_t> MovingFixes::longest_axes() const {
  const std::size_t cells = cells_.state.size();
  std::vector<std::uint8_t> axes(cells, 0);
  std::vector<double> longest(cells, 0);
  std::array<std::vector<int>, 2> run{std::vector<int>(cells), std::vector<int>(cells)};
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    for (const int sign : {1, -1}) {
      std::vector<int>& count = run[sign > 0 ? 0 : 1];
      sweep(sign * kAxes[axis][0], sign * kAxes[axis][1], [&](std::size_t cell, std::size_t before) {
        count[cell] = before == cells ? 1 : count[before] + 1;
      });
    }
    for (std::size_t cell = 0; cell < cells; ++cell) {
      const double length = length_of(kAxes[axis]) * (run[0][cell] + run[1][cell] - 1);
      if (!(length > longest[cell])) continue;
      longest[cell] = length;
      axes[cell] = static_cast<std::uint8_t>(axis);
    }
  }
  return axes;
}

/// @param axes of each cell; empty: all
void MovingFixes::filter_lane(std::size_t lane, const std::vector<std::uint8_t>& axes) {
  const std::size_t cells = cells_.state.size();
  Fix* const fixes = fixes_.data() + lane * cells;
  const positioning::PositionFilterOptions& filter = movement_.filter;
  std::vector<TrackFilter> filters(cells);
  std::vector<Fix> sums(cells);  // weighted; vertical_m2: the weights
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    const double step_s = length_of(kAxes[axis]) * cells_.plane.spacing_m / movement_.how.pace_mps;
    for (const int sign : {1, -1}) {
      sweep(sign * kAxes[axis][0], sign * kAxes[axis][1], [&](std::size_t cell, std::size_t before) {
        TrackFilter& route = filters[cell];
        route = before == cells ? TrackFilter() : filters[before];
        route.go(fixes[cell], step_s, filter);
        if (!(route.at.horizontal_m2 > 0) || (!axes.empty() && axes[cell] != axis)) return;
        const float weight = 1 / route.at.horizontal_m2;
        Fix& sum = sums[cell];
        sum.east_m += weight * std::hypot(route.at.east_m, route.at.north_m);
        sum.up_m += weight * (lane == 0 ? route.at.up_m : std::abs(route.at.up_m));
        sum.horizontal_m2 += weight * static_cast<float>(route.reported_m2);
        sum.vertical_m2 += weight;
      });
    }
  }
  for (std::size_t cell = 0; cell < cells; ++cell) {
    const Fix& sum = sums[cell];
    fixes[cell] = {};
    if (!(sum.vertical_m2 > 0)) continue;
    fixes[cell] = {sum.east_m / sum.vertical_m2, 0, sum.up_m / sum.vertical_m2,
                   sum.horizontal_m2 / sum.vertical_m2, 0};
  }
}

void MovingFixes::filter() {
  std::vector<std::uint8_t> axes;
  if (movement_.how.motion == simulation::Motion::Driving) axes = longest_axes();
  spread(lanes_, [&](std::size_t lane) { filter_lane(lane, axes); });
}

void MovingFixes::describe(std::size_t cell, const LimitOptions& limits, bool statistics,
                           CellValues& values) const {
  SampledFixes sampled;
  for (std::size_t lane = 0; lane < lanes_; ++lane) {
    const Fix& fix = fixes_[lane * cells_.state.size() + cell];
    const bool solved = fix.horizontal_m2 > 0;
    const double protection_m = limits.protection_factor * std::sqrt(double{fix.horizontal_m2});
    if (lane == 0) {
      values.set(Layer::Availability, solved ? 1 : 0);
      if (!solved) continue;
      values.set(Layer::HorizontalError, fix.east_m);
      values.set(Layer::VerticalError, fix.up_m);
      values.set(Layer::ProtectionLevel, protection_m);
    } else if (solved) {
      sampled.horizontal_m.push_back(fix.east_m);
      sampled.vertical_m.push_back(std::abs(fix.up_m));
      sampled.protection_m.push_back(protection_m);
    }
  }
  if (lanes_ == 1) return;
  const auto sample_count = static_cast<int>(lanes_) - 1;
  values.set(Layer::Availability, static_cast<double>(sampled.horizontal_m.size()) / sample_count);
  if (statistics) sampled.describe(limits, sample_count, values);
}

}  // namespace canyon::heatmap
