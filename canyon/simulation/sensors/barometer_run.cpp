#include "canyon/simulation/sensors/barometer_run.hpp"

#include <algorithm>
#include <utility>

#include "canyon/simulation/motion/antenna_pose.hpp"

namespace canyon::simulation {

BarometerRun::BarometerRun(const inertial::BarometerOptions& options, std::uint64_t seed,
                           geodesy::GpsTime begin, std::function<Pose(geodesy::GpsTime)> vehicle,
                           double geoid_undulation_m)
    : options_(options),
      times_(begin, options.rate_hz),
      vehicle_(std::move(vehicle)),
      geoid_undulation_m_(geoid_undulation_m),
      barometer_(options, seed) {}

std::optional<BarometerSample> BarometerRun::next(geodesy::GpsTime until) {
  const auto interval = times_.next(until);
  if (!interval) return std::nullopt;
  const double now_s = interval->to_s;
  BarometerSample sample;
  sample.time = times_.begin() + now_s;
  const auto height_m = [this](const Pose& pose) { return pose.position.height_m - geoid_undulation_m_; };
  const auto pose_at = [this](double t_s) {
    return mounted_antenna(vehicle_(times_.begin() + t_s), options_.position_m);
  };
  const double felt_s = std::max(0.0, now_s - options_.delay_s);
  const Pose felt = pose_at(felt_s);
  sample.pressure = barometer_.measure(height_m(felt), felt.velocity_enu_mps.norm(), felt_s);
  sample.height_m = height_m(felt_s < now_s ? pose_at(now_s) : felt);
  sample.pressure.true_pa = barometer_.air(sample.height_m, now_s).pressure_pa;
  return sample;
}

}  // namespace canyon::simulation
