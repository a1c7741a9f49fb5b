#include "canyon/simulation/sensors/barometer_run.hpp"

#include <algorithm>
#include <utility>

#include "canyon/simulation/motion/antenna_pose.hpp"
#include "canyon/simulation/sensors/sample_times.hpp"

namespace canyon::simulation {

BarometerRun::BarometerRun(const inertial::BarometerOptions& options, std::uint64_t seed,
                           geodesy::GpsTime begin, std::function<Pose(geodesy::GpsTime)> vehicle,
                           double geoid_undulation_m)
    : options_(options),
      begin_(begin),
      vehicle_(std::move(vehicle)),
      geoid_undulation_m_(geoid_undulation_m),
      barometer_(options, seed) {}

void BarometerRun::skip(geodesy::GpsTime time) {
  count_ = std::max(count_, samples_until(time - begin_, options_.rate_hz));
}

std::optional<BarometerSample> BarometerRun::next(geodesy::GpsTime until) {
  const double now_s = sample_end_s(count_ + 1, options_.rate_hz);
  if (begin_ + now_s > until) return std::nullopt;
  ++count_;
  BarometerSample sample;
  sample.time = begin_ + now_s;
  const auto height_m = [this](const Pose& pose) { return pose.position.height_m - geoid_undulation_m_; };
  const auto pose_at = [this](double t_s) {
    return mounted_antenna(vehicle_(begin_ + t_s), options_.position_m);
  };
  const double felt_s = std::max(0.0, now_s - options_.delay_s);
  const Pose felt = pose_at(felt_s);
  sample.pressure = barometer_.measure(height_m(felt), felt.velocity_enu_mps.norm(), felt_s);
  sample.height_m = height_m(felt_s < now_s ? pose_at(now_s) : felt);
  sample.pressure.true_pa = barometer_.air(sample.height_m, now_s).pressure_pa;
  return sample;
}

}  // namespace canyon::simulation
