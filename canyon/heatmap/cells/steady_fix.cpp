#include "canyon/heatmap/cells/steady_fix.hpp"

#include <algorithm>
#include <array>

#include "canyon/heatmap/cells/linear_fix.hpp"
#include "canyon/positioning/pseudorange_model.hpp"

namespace canyon::heatmap {

SteadyFix::SteadyFix(const std::vector<SteadySatellite>& satellites, const positioning::FixOptions& options)
    : satellites_(satellites), options_(options) {}

/// Calls f(range, satellite, column) for the ranges whose system has a clock.
template <typename F>
void SteadyFix::for_each(std::span<const SteadyRange> ranges, const positioning::Clocks& clocks, const F& f) {
  for (const SteadyRange& range : ranges) {
    const SteadySatellite& satellite = satellites_[range.satellite];
    const int column = clocks.column[static_cast<std::size_t>(satellite.line.id.system)];
    if (column >= 0) f(range, satellite, column);
  }
}

SteadyFix::Answer SteadyFix::solve(std::span<const SteadyRange> ranges, bool covariance) {
  Answer answer;
  std::array<int, gnss::kSystemCount> count{};
  for (const SteadyRange& range : ranges) {
    ++count[static_cast<std::size_t>(satellites_[range.satellite].line.id.system)];
  }
  const positioning::Clocks clocks = positioning::clocks_of(count);
  used_.clear();
  LinearFix fix(clocks.count);
  for_each(ranges, clocks, [&](const SteadyRange& range, const SteadySatellite& s, int column) {
    used_.push_back(range.satellite);
    fix.add(s.local, column, range.weight, range.error_m);
  });
  if (!positioning::enough_satellites(static_cast<int>(used_.size()), clocks.count, options_)) return answer;
  if (used_.size() < fix.unknowns() || !fix.factorise()) return answer;
  if (used_ != geometry_) {
    geometry_ = used_;
    LinearFix shape(clocks.count);
    for_each(ranges, clocks, [&](const SteadyRange&, const SteadySatellite& s, int column) {
      shape.add(s.local, column, 1);
    });
    dop_.reset();
    if (shape.factorise()) dop_ = shape.dop();
  }
  if (!dop_ || !positioning::strong_enough(dop_, options_)) return answer;
  const LinearFix::Unknowns x = fix.solve();
  answer.error = {x[0], x[1], x[2]};
  answer.dop = *dop_;
  answer.used = static_cast<int>(used_.size());
  answer.solved = true;
  if (!covariance) return answer;

  answer.covariance = fix.covariance();
  // As positioning::solve_fix(): equal weights stand for the mean of the variances, and the residuals may say
  // that all are larger.
  double variances = 0, squares = 0;
  for_each(ranges, clocks, [&](const SteadyRange& range, const SteadySatellite& s, int column) {
    variances += range.variance_m2;
    const double residual = range.error_m + s.local.dot(answer.error) - x[static_cast<std::size_t>(column)];
    squares += range.weight * residual * residual;
  });
  const auto rows = static_cast<double>(used_.size());
  if (options_.weights.weighting == positioning::Weighting::Equal) {
    answer.covariance *= variances / rows;
    squares *= rows / variances;
  }
  if (options_.covariance_by_residuals && used_.size() > fix.unknowns()) {
    answer.covariance *= std::max(1.0, squares / (rows - static_cast<double>(fix.unknowns())));
  }
  return answer;
}

}  // namespace canyon::heatmap
