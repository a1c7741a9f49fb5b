#include "canyon/sky/orbit/cached_sky.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/thread_cache.hpp"

namespace canyon::orbit {
namespace {

constexpr std::int64_t kStep_ns = 500'000'000;

struct Carried {
  std::optional<SatelliteState> state;
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
};

/// By the Earth's gravity, its centre's and J2 (Vallado, Fundamentals of Astrodynamics, 8.7), in the rotating
/// frame [m/s^2].
Eigen::Vector3d gravity_acceleration(const SatelliteState& state) {
  const Eigen::Vector3d& p = state.position_m;
  const Eigen::Vector3d omega(0, 0, geodesy::kEarthRotationRate);
  const double square = p.squaredNorm();
  const double flat = 1.5 * geodesy::kEarthJ2 * geodesy::kSemiMajorAxis * geodesy::kSemiMajorAxis / square;
  const double high = 5 * p.z() * p.z() / square;
  const Eigen::Vector3d fractions(1 + flat * (1 - high), 1 + flat * (1 - high), 1 + flat * (3 - high));
  return -geodesy::kEarthMu / (square * std::sqrt(square)) * fractions.cwiseProduct(p) -
         2 * omega.cross(state.velocity_mps) - omega.cross(omega.cross(p));
}

}  // namespace

CachedSky::CachedSky(std::shared_ptr<const Sky> sky) : sky_(std::move(sky)), number_(next_cache_id()) {
  if (!sky_) throw InputError("a cached sky needs a sky");
}

std::optional<SatelliteState> CachedSky::state(gnss::SatelliteId id, geodesy::GpsTime t) const {
  const std::int64_t at_ns = geodesy::round_to(t, kStep_ns).nanoseconds();
  const auto& carried = thread_cached<Carried>(number_, gnss::dense_index(id), at_ns, [&] {
    Carried made{sky_->state(id, geodesy::GpsTime::from_nanoseconds(at_ns))};
    if (made.state) made.acceleration = gravity_acceleration(*made.state);
    return made;
  });
  // A validity may begin or end within the step.
  if (!carried.state) return sky_->state(id, t);
  std::optional<SatelliteState> state = carried.state;
  const double dt_s = static_cast<double>(t.nanoseconds() - at_ns) / 1e9;
  state->position_m += (state->velocity_mps + carried.acceleration * (dt_s / 2)) * dt_s;
  state->velocity_mps += carried.acceleration * dt_s;
  state->clock_bias_s += state->clock_drift * dt_s;
  return state;
}

}  // namespace canyon::orbit
