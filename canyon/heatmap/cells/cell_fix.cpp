#include "canyon/heatmap/cells/cell_fix.hpp"

#include <algorithm>
#include <array>

namespace canyon::heatmap {

CellRange cell_range(std::size_t satellite, double error_m, const positioning::Measurement& stated,
                     double elevation_rad, const positioning::WeightOptions& weights) {
  const bool equal = weights.weighting == positioning::Weighting::Equal;
  const double sigma_m = equal ? 1 : weights.sigma_m(stated, elevation_rad);
  return {static_cast<std::uint32_t>(satellite), error_m, 1 / (sigma_m * sigma_m),
          stated.sigma_m * stated.sigma_m};
}

CellFix::Answer CellFix::solve(std::span<const CellRange> ranges, bool covariance) {
  Answer answer;
  std::array<int, gnss::kSystemCount> count{};
  for (const CellRange& range : ranges) {
    ++count[static_cast<std::size_t>(satellites_[range.satellite].system)];
  }
  clocks_ = positioning::clocks_of(count);
  used_.clear();
  LinearFix& fix = fix_.emplace(clocks_.count);
  for (const CellRange& range : ranges) {
    const int clock = clock_of(range);
    if (clock < 0) continue;
    used_.push_back(range.satellite);
    fix.add(satellites_[range.satellite].direction, clock, range.weight, range.error_m);
  }
  if (!positioning::enough_satellites(static_cast<int>(used_.size()), clocks_.count, options_)) return answer;
  if (used_.size() < fix.unknowns() || !fix.factorise()) return answer;
  if (used_ != geometry_) {
    geometry_ = used_;
    LinearFix shape(clocks_.count);
    for (const std::uint32_t satellite : used_) {
      shape.add(satellites_[satellite].direction, clock_of({satellite}), 1);
    }
    dop_.reset();
    if (shape.factorise()) dop_ = shape.dop();
  }
  if (!positioning::strong_enough(dop_, options_)) return answer;
  const LinearFix::Unknowns x = fix.solve();
  answer.error = {x[0], x[1], x[2]};
  answer.dop = dop_;
  answer.used = static_cast<int>(used_.size());
  answer.solved = true;
  if (covariance) state_covariance(ranges, x, answer);
  return answer;
}

Eigen::Vector3d CellFix::gain(const CellRange& range) const {
  const int clock = clock_of(range);
  if (clock < 0) return Eigen::Vector3d::Zero();
  const LinearFix::Unknowns x = fix_->gain(satellites_[range.satellite].direction, clock, range.weight);
  return {x[0], x[1], x[2]};
}

/// Computed as in positioning::solve_fix(): equal weights stand for the mean of the variances, and residuals
/// may enlarge all.
void CellFix::state_covariance(std::span<const CellRange> ranges, const LinearFix::Unknowns& x,
                               Answer& answer) const {
  answer.covariance = fix_->covariance();
  double variances = 0, squares = 0;
  for (const CellRange& range : ranges) {
    const int clock = clock_of(range);
    if (clock < 0) continue;
    variances += range.variance_m2;
    const double residual = range.error_m + satellites_[range.satellite].direction.dot(answer.error) -
                            x[static_cast<std::size_t>(clock)];
    squares += range.weight * residual * residual;
  }
  const auto rows = static_cast<double>(used_.size());
  if (options_.weights.weighting == positioning::Weighting::Equal) {
    answer.covariance *= variances / rows;
    squares *= rows / variances;
  }
  if (options_.covariance_by_residuals && used_.size() > fix_->unknowns()) {
    answer.covariance *= std::max(1.0, squares / (rows - static_cast<double>(fix_->unknowns())));
  }
}

}  // namespace canyon::heatmap
