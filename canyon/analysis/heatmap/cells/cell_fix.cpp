#include "canyon/analysis/heatmap/cells/cell_fix.hpp"

#include <array>

#include "canyon/receiver/positioning/range_terms.hpp"
#include "canyon/receiver/random_streams.hpp"

namespace canyon::heatmap {

CellRange cell_range(std::size_t satellite, double error_m, const positioning::Measurement& reported,
                     double elevation_rad, const positioning::WeightOptions& weights) {
  const bool equal = weights.weighting == positioning::Weighting::Equal;
  const double sigma_m = equal ? 1 : weights.sigma_m(reported, elevation_rad);
  return {static_cast<std::uint32_t>(satellite), error_m, 1 / (sigma_m * sigma_m),
          reported.sigma_m * reported.sigma_m};
}

CellFix::CellSolution CellFix::solve(std::span<const CellRange> ranges, bool covariance) {
  CellSolution result;
  std::array<int, gnss::kSystemCount> count{};
  for (const CellRange& range : ranges)
    ++count[static_cast<std::size_t>(satellites_[range.satellite].system)];
  clocks_ = positioning::clocks_of(count);
  used_.clear();
  LinearFix& fix = fix_.emplace(clocks_.count);
  for (const CellRange& range : ranges) {
    const int clock = clock_of(range);
    if (clock < 0) continue;
    used_.push_back(range.satellite);
    fix.add(satellites_[range.satellite].direction, clock, range.weight, range.error_m);
  }
  if (!positioning::enough_satellites(static_cast<int>(used_.size()), clocks_.count, options_)) return result;
  if (used_.size() < fix.unknowns() || !fix.factorise()) return result;
  if (used_ != geometry_) {
    geometry_ = used_;
    LinearFix shape(clocks_.count);
    for (const std::uint32_t satellite : used_)
      shape.add(satellites_[satellite].direction, clock_of({satellite}), 1);
    dop_.reset();
    if (shape.factorise()) dop_ = shape.dop();
  }
  if (!positioning::strong_enough(dop_, options_)) return result;
  const LinearFix::Unknowns x = fix.solve();
  result.error = {x[0], x[1], x[2]};
  result.dop = dop_;
  result.used = static_cast<int>(used_.size());
  result.solved = true;
  if (covariance) state_covariance(ranges, x, result);
  return result;
}

Eigen::Vector3d CellFix::gain(const CellRange& range) const {
  const int clock = clock_of(range);
  if (clock < 0) return Eigen::Vector3d::Zero();
  const LinearFix::Unknowns x = fix_->gain(satellites_[range.satellite].direction, clock, range.weight);
  return {x[0], x[1], x[2]};
}

/// As in positioning::solve_fix(): equal weights use the mean of variances, and residuals may scale all.
void CellFix::state_covariance(std::span<const CellRange> ranges, const LinearFix::Unknowns& x,
                               CellSolution& result) const {
  result.covariance = fix_->covariance();
  double variances = 0, squares = 0;
  for (const CellRange& range : ranges) {
    const int clock = clock_of(range);
    if (clock < 0) continue;
    variances += range.variance_m2;
    const double residual =
        range.error_m + satellites_[range.satellite].direction.dot(result.error) - x[clock];
    squares += range.weight * residual * residual;
  }
  const auto rows = static_cast<double>(used_.size());
  if (options_.weights.weighting == positioning::Weighting::Equal) {
    result.covariance *= variances / rows;
    squares *= rows / variances;
  }
  if (options_.covariance_by_residuals) {
    result.covariance *= positioning::excess_variance(
        squares, static_cast<std::ptrdiff_t>(used_.size()) - static_cast<std::ptrdiff_t>(fix_->unknowns()));
  }
}

bool LinearFix::factorise() {
  constexpr double kMinPivot = positioning::kRankThreshold * positioning::kRankThreshold;
  factors_.compute(matrix_);
  return factors_.info() == Eigen::Success &&
         (factors_.matrixLLT().diagonal().array().square() > kMinPivot * matrix_.diagonal().array()).all();
}

Eigen::Matrix3d LinearFix::covariance() const {
  return factors_.solve(Matrix::Identity(matrix_.rows(), 3)).topRows<3>();
}

positioning::Dop LinearFix::dop() const {
  const Matrix cofactor = factors_.solve(Matrix::Identity(matrix_.rows(), matrix_.rows()));
  return positioning::dop_from_cofactor(positioning::Cofactor(cofactor));
}

const gnss::Signal* TileErrors::signal_of(gnss::SatelliteId id) const {
  std::vector<const gnss::Signal*> tracked;
  receiver::signals_to_track(options, id, time, tracked);
  return tracked.empty() ? nullptr : tracked.front();
}

double TileErrors::error_m(const propagation::SatelliteView& view, const gnss::Signal& signal,
                           double carrier_hz) const {
  const receiver::RangeState state{&options, &klobuchar, &view, &signal, carrier_hz, time, centre};
  return receiver::uncorrected_m(state) +
         receiver::fixed_bias_m(options.biases, view.line.id, signal, carrier_hz, time);
}

double TileErrors::sigma_factor(gnss::SatelliteId id, const gnss::Signal& signal) const {
  double product = 1;
  for (const auto& [group, factor] : options.fix_input.sigma_factor)
    if (gnss::in_group(group, id, signal, time)) product *= factor;
  return product;
}

geodesy::Geodetic seen_from(const orbit::LineOfSight& line) {
  return geodesy::geodetic_from_ecef(line.position_at_reception_m - line.range_m * line.direction_ecef);
}

std::vector<FixSatellite> fix_satellites(const std::vector<orbit::LineOfSight>& lines,
                                         const geodesy::Geodetic& centre) {
  const Eigen::Matrix3d enu_from_ecef = geodesy::enu_from_ecef_rotation(centre);
  std::vector<FixSatellite> satellites;
  satellites.reserve(lines.size());
  for (const orbit::LineOfSight& line : lines)
    satellites.push_back({line.id.system, enu_from_ecef * line.direction_ecef});
  return satellites;
}

}  // namespace canyon::heatmap
