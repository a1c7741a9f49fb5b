#include "canyon/orbit/sky.hpp"

#include <cmath>

#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/frames.hpp"

namespace canyon::orbit {
namespace {

// Middle of what medium Earth orbits need (67 to 90 ms); geostationary ones need up to 140 ms.
constexpr double kFirstGuess_s = 0.075;
constexpr double kTolerance_s = 1e-10;
constexpr int kMaxEvaluations = 6;
// sin(-5 deg).
constexpr double kFarBelowHorizon = -0.0871557;

/// Flight time from a satellite that moves straight from `state` at `reception - tau0`. Contracts by v/c,
/// about 1e-5, with each round.
double light_time(const SatelliteState& state, double tau0, const Eigen::Vector3d& receiver) {
  double tau = tau0;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d moved = state.position_m - state.velocity_mps * (tau - tau0);
    tau = (rotate_earth(moved, tau) - receiver).norm() / geodesy::kSpeedOfLight;
  }
  return tau;
}

}  // namespace

Eigen::Vector3d rotate_earth(const Eigen::Vector3d& position, double flight_time_s) {
  const double angle = geodesy::kEarthRotationRate * flight_time_s, square = angle * angle;
  // The next terms are below 1e-18 for flight times up to a second.
  constexpr double kSmall = 1e-4;
  const bool small = std::abs(angle) < kSmall;
  const double c = small ? 1 - square / 2 : std::cos(angle);
  const double s = small ? angle * (1 - square / 6) : std::sin(angle);
  return {c * position.x() + s * position.y(), c * position.y() - s * position.x(), position.z()};
}

Observer::Observer(const Eigen::Vector3d& ecef)
    : position_ecef(ecef),
      enu_from_ecef(geodesy::enu_from_ecef_rotation(geodesy::geodetic_from_ecef(ecef))) {}

std::optional<LineOfSight> line_of_sight(const Sky& sky, gnss::SatelliteId id, geodesy::GpsTime reception,
                                         const Observer& observer) {
  const Eigen::Vector3d& receiver = observer.position_ecef;
  LineOfSight los;
  los.id = id;
  los.transmit_time = reception - kFirstGuess_s;
  std::optional<SatelliteState> state = sky.state(id, los.transmit_time);
  if (!state) return std::nullopt;
  double tau = light_time(*state, reception - los.transmit_time, receiver);

  const Eigen::Vector3d rough = rotate_earth(state->position_m, tau) - receiver;
  const bool visible = observer.enu_from_ecef.row(2).dot(rough) > kFarBelowHorizon * rough.norm();
  const geodesy::GpsTime guess = los.transmit_time;
  los.transmit_time = reception - tau;
  if (visible) {
    // The straight line is within a millimetre, so that the first of these evaluations is the last.
    for (int i = 1; i < kMaxEvaluations; ++i) {
      state = sky.state(id, los.transmit_time);
      if (!state) return std::nullopt;
      const double better = light_time(*state, reception - los.transmit_time, receiver);
      const bool converged = std::abs(better - tau) < kTolerance_s;
      tau = better;
      if (converged) break;
      los.transmit_time = reception - tau;
    }
  } else {
    // The guess and the transmit time may lie on both sides of the end of a validity.
    const double dt = los.transmit_time - guess;
    state->position_m += state->velocity_mps * dt;
    state->clock_bias_s += state->clock_drift * dt;
  }
  los.state = *state;

  // Rotation over the interval between the two instants as they are named (whole nanoseconds), so that the
  // result is exact for them; the satellite moves 4 micrometres in a nanosecond.
  const double flight = reception - los.transmit_time;
  los.position_at_reception_m = rotate_earth(state->position_m, flight);
  los.velocity_at_reception_mps = rotate_earth(state->velocity_mps, flight);
  const Eigen::Vector3d baseline = los.position_at_reception_m - receiver;
  los.range_m = baseline.norm();
  los.direction_ecef = baseline / los.range_m;
  const geodesy::AzimuthElevation angles =
      geodesy::azimuth_elevation_from_enu(observer.enu_from_ecef * los.direction_ecef);
  los.azimuth_rad = angles.azimuth_rad;
  los.elevation_rad = angles.elevation_rad;
  return los;
}

std::optional<LineOfSight> line_of_sight(const Sky& sky, gnss::SatelliteId id, geodesy::GpsTime reception,
                                         const Eigen::Vector3d& receiver_ecef) {
  return line_of_sight(sky, id, reception, Observer(receiver_ecef));
}

}  // namespace canyon::orbit
