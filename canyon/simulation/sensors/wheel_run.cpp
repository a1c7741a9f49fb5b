#include "canyon/simulation/sensors/wheel_run.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace canyon::simulation {

using inertial::WheelPair;

WheelRun::WheelRun(const inertial::WheelOptions& options, std::uint64_t seed, geodesy::GpsTime begin,
                   std::function<Pose(geodesy::GpsTime)> vehicle)
    : options_(options),
      times_(begin, options.rate_hz),
      vehicle_(std::move(vehicle)),
      wheels_(options, seed),
      last_(speeds(begin)) {}

WheelPair WheelRun::speeds(geodesy::GpsTime t) const {
  const Pose pose = vehicle_(t);
  const double middle = pose.forward_enu().dot(pose.velocity_enu_mps);
  const double turn = pose.yaw_rate_radps * options_.track_m / 2;
  return {middle - turn, middle + turn};
}

void WheelRun::skip(geodesy::GpsTime time) {
  if (times_.skip(time)) last_ = speeds(times_.begin() + times_.end_s());
}

std::optional<WheelsAtWork> WheelRun::next(geodesy::GpsTime until) {
  const auto interval = times_.next(until);
  if (!interval) return std::nullopt;
  WheelsAtWork result;
  result.time = times_.begin() + interval->to_s;
  result.dt_s = interval->to_s - interval->from_s;
  // The way by Simpson's rule, in an even number of steps of 25 ms at most.
  constexpr double kStep_s = 0.025;
  const int steps = 2 * std::max(1, static_cast<int>(std::ceil(result.dt_s / (2 * kStep_s) - 1e-9)));
  WheelPair sum = last_;
  for (int i = 1; i <= steps; ++i) {
    last_ = speeds(times_.begin() + (interval->from_s + result.dt_s * i / steps));
    const double weight = i == steps ? 1 : i % 2 == 1 ? 4 : 2;
    for (std::size_t w = 0; w < sum.size(); ++w) sum[w] += weight * last_[w];
  }
  WheelPair way_m{};
  for (std::size_t w = 0; w < sum.size(); ++w) {
    result.true_mps[w] = sum[w] / (3 * steps);
    way_m[w] = result.true_mps[w] * result.dt_s;
  }
  result.sample = wheels_.measure(way_m, result.dt_s);
  return result;
}

}  // namespace canyon::simulation
