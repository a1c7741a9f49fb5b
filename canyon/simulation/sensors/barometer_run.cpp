#include "canyon/simulation/sensors/barometer_run.hpp"

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

std::optional<BarometerSample> BarometerRun::next(geodesy::GpsTime until) {
  const geodesy::GpsTime time = begin_ + sample_end_s(count_ + 1, options_.rate_hz);
  if (time > until) return std::nullopt;
  ++count_;
  const Pose pose = mounted_antenna(vehicle_(time), options_.position_m);
  const double height_m = pose.position.height_m - geoid_undulation_m_;
  return BarometerSample{time, height_m, barometer_.measure(height_m, pose.velocity_enu_mps.norm())};
}

}  // namespace canyon::simulation
