#include "canyon/sky/orbit/sky.hpp"

#include <fmt/format.h>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::orbit {

namespace {

// Middle of the flight times of medium Earth orbits (67 to 90 ms); geostationary ones need up to 140 ms.
constexpr double kFirstGuess_s = 0.075;
constexpr double kTolerance_s = 1e-10;
constexpr int kMaxEvaluations = 6;
// sin(-5 deg).
constexpr double kFarBelowHorizon = -0.0871557;

/// Flight time from a satellite that moves straight from `state` at `reception - tau0`. Each iteration
/// contracts by v/c, about 1e-5: two reduce a first guess to 1e-12 s.
double light_time(const SatelliteState& state, double tau0, const Eigen::Vector3d& receiver) {
  double tau = tau0;
  for (int i = 0; i < 2; ++i) {
    const Eigen::Vector3d moved = state.position_m - state.velocity_mps * (tau - tau0);
    tau = (rotate_earth(moved, tau) - receiver).norm() / geodesy::kSpeedOfLight;
  }
  return tau;
}

constexpr double kDistance_m = 20'200e3;  // GPS altitude
constexpr std::size_t kMaxSatellites = 63;

void check(std::size_t index, double azimuth_rad, double elevation_rad) {
  constexpr double kRight = geodesy::kPi / 2;
  if (!std::isfinite(azimuth_rad)) {
    throw InputError(
        fmt::format("frozen sky: azimuth {} of satellite {} is not a finite number", azimuth_rad, index + 1),
        "give radians from north, clockwise");
  }
  // The condition is negated to reject NaN; an angle of 1.5708 means the zenith.
  if (!(elevation_rad >= 0 && elevation_rad <= kRight + 1e-5)) {
    const bool degrees = elevation_rad > kRight && elevation_rad <= 90;
    throw InputError(fmt::format("frozen sky: elevation {} of satellite {} is out of range{}", elevation_rad,
                                 index + 1, degrees ? ", it looks like degrees" : ""),
                     degrees ? fmt::format("give radians: {} deg is {:.6f}", elevation_rad,
                                           geodesy::radians(elevation_rad))
                             : std::string("it runs from 0 to pi/2 rad"));
  }
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
    // The straight line is accurate to a millimetre, so the first of these evaluations is the last.
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
    // The guess and the transmit time may be on both sides of the end of a validity.
    const double dt = los.transmit_time - guess;
    state->position_m += state->velocity_mps * dt;
    state->clock_bias_s += state->clock_drift * dt;
  }
  los.state = *state;

  // Rotation over the interval between the two rounded instants (whole nanoseconds), so that the result is
  // exact for them; the satellite moves 4 micrometres in a nanosecond.
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

FrozenSky::FrozenSky(const geodesy::Geodetic& position, const std::vector<double>& azimuth_rad,
                     const std::vector<double>& elevation_rad) {
  geodesy::check_geodetic(position, "position of the frozen sky");
  if (azimuth_rad.size() != elevation_rad.size()) {
    throw InputError(
        fmt::format("frozen sky: {} azimuths but {} elevations", azimuth_rad.size(), elevation_rad.size()),
        "give one of each for every satellite");
  }
  if (azimuth_rad.empty() || azimuth_rad.size() > kMaxSatellites) {
    throw InputError(fmt::format("frozen sky: {} satellites", azimuth_rad.size()),
                     fmt::format("give 1 to {}", kMaxSatellites));
  }
  const Eigen::Vector3d origin = geodesy::ecef_from_geodetic(position);
  const Eigen::Matrix3d ecef_from_enu = geodesy::enu_from_ecef_rotation(position).transpose();
  for (std::size_t i = 0; i < azimuth_rad.size(); ++i) {
    check(i, azimuth_rad[i], elevation_rad[i]);
    const Eigen::Vector3d enu = geodesy::enu_from_azimuth_elevation(azimuth_rad[i], elevation_rad[i]);
    const Eigen::Vector3d at_reception = origin + ecef_from_enu * enu * kDistance_m;
    // Rotated back over the flight time, so that the Earth's rotation moves it to the requested position.
    positions_.push_back(rotate_earth(at_reception, -kDistance_m / geodesy::kSpeedOfLight));
    directions_.push_back(geodesy::azimuth_elevation_from_enu(enu));
  }
}

bool FrozenSky::has(gnss::SatelliteId id) const {
  return id.system == gnss::System::GPS && id.number >= 1 && id.number <= positions_.size();
}

std::vector<gnss::SatelliteId> FrozenSky::satellites() const {
  std::vector<gnss::SatelliteId> ids;
  for (std::size_t i = 1; i <= positions_.size(); ++i)
    ids.push_back({gnss::System::GPS, static_cast<std::uint8_t>(i)});
  return ids;
}

std::optional<SatelliteState> FrozenSky::state(gnss::SatelliteId id, geodesy::GpsTime) const {
  if (!has(id)) return std::nullopt;
  SatelliteState state;
  state.position_m = positions_[id.number - 1U];
  state.carrier_frequency_hz = l1_frequency_hz(gnss::System::GPS);
  return state;
}

std::string FrozenSky::source(gnss::SatelliteId id, geodesy::GpsTime) const {
  if (!has(id)) return to_string(id) + " is not in the frozen sky";
  const geodesy::AzimuthElevation& direction = directions_[id.number - 1U];
  return fmt::format("frozen sky, azimuth {:.2f} deg, elevation {:.2f} deg",
                     geodesy::degrees(direction.azimuth_rad), geodesy::degrees(direction.elevation_rad));
}

}  // namespace canyon::orbit
