#include "canyon/inertial/wheels.hpp"

#include <cmath>

namespace canyon::inertial {

Wheels::Wheels(const WheelOptions& options, std::uint64_t seed) : options_(options), random_(seed, "wheels") {
  options.validate();
  for (Wheel& wheel : wheels_) {
    wheel.scale = options.scale * random_.normal();
    wheel.slip = options.slip * random_.normal();
  }
}

WheelSample Wheels::measure(const WheelPair& way_m, double dt_s) {
  WheelSample sample;
  const double keep = std::exp(-dt_s / options_.slip_time_s);
  if (options_.tick_m > 0) sample.ticks.emplace();
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    Wheel& wheel = wheels_[i];
    wheel.slip = keep * wheel.slip + options_.slip * std::sqrt(1 - keep * keep) * random_.normal();
    double felt_m = way_m[i] * (1 + wheel.scale + wheel.slip);
    if (std::abs(felt_m) < options_.minimum_mps * dt_s) felt_m = 0;
    if (!options_.direction) felt_m = std::abs(felt_m);
    wheel.counted_m += felt_m;
    double stated_m = wheel.counted_m;
    if (sample.ticks) {
      const double ticks = std::floor(wheel.counted_m / options_.tick_m);
      (*sample.ticks)[i] = static_cast<std::int64_t>(ticks);
      stated_m = ticks * options_.tick_m;
    }
    sample.speed_mps[i] = (stated_m - wheel.stated_m) / dt_s;
    wheel.stated_m = stated_m;
  }
  return sample;
}

}  // namespace canyon::inertial
