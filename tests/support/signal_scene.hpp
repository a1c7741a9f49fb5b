#pragma once

#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/sky/orbit/sky.hpp"
#include "tests/support/circular_sky.hpp"
#include "tests/support/observe.hpp"

// Antennas, paths and skies for receivers whose signals have a strength.
namespace canyon::test {

using geodesy::GpsTime;
using geodesy::kSpeedOfLight;
using gnss::System;
using propagation::Path;
using propagation::PathKind;
using propagation::SatelliteView;
using propagation::Visibility;
using receiver::Receiver;
using receiver::ReceiverEpoch;
using receiver::ReceiverOptions;
using receiver::SatelliteObservation;
using signal::AntennaPattern;

inline const geodesy::Geodetic kPosition = geodesy::Geodetic::from_degrees(22.3, 114.18, 30);
inline const geodesy::LocalFrame kFrame(kPosition);
inline const Eigen::Matrix3d kEcefFromEnu = kFrame.ecef_from_local_rotation();
inline const Eigen::Vector3d kAntenna = geodesy::ecef_from_geodetic(kPosition);
inline const Eigen::Vector3d kAtRest = Eigen::Vector3d::Zero();
inline constexpr GpsTime kTime = CircularSky::kEpoch + std::chrono::hours(5);
inline constexpr double kChip_m = kSpeedOfLight / 1.023e6;
inline constexpr double kWavelength_m = kSpeedOfLight / 1575.42e6;

/// Receives both polarizations equally, so that a metal mirror's reflection is as strong as the direct path.
inline AntennaPattern both_hands() {
  return {"both hands", {{0, 0, 0}}};
}

/// Signals without randomness except the paths' phases, tracked from the first epoch.
inline ReceiverOptions plain() {
  ReceiverOptions options;
  options.noise.enabled = false;
  options.signal.enabled = true;
  options.signal.antenna = both_hands();
  options.signal.loop_noise = false;
  options.signal.lock.warm_start = true;
  return options;
}

inline Path direct_path(const orbit::LineOfSight& line) {
  Path path;
  path.arrival = kEcefFromEnu.transpose() * line.direction_ecef;
  path.arrival_elevation_rad = line.elevation_rad;
  return path;
}

/// A reflection by a metal plane with the fraction `fraction` of the amplitude, at normal incidence from
/// `arrival` (ENU).
inline Path mirror_path(const Eigen::Vector3d& arrival, double excess_m, double fraction,
                        std::uint64_t reflector = 1) {
  Path path;
  path.kind = PathKind::Reflected;
  path.order = 1;
  path.excess_m = excess_m;
  path.arrival = arrival;
  path.reflector = reflector;
  path.incidence_count = 1;
  path.incidences[0].material = city::Material::Metal;
  path.incidences[0].specular_factor = fraction;
  path.arrival_elevation_rad = std::asin(arrival.z());
  return path;
}

inline Path diffuse_path(const Eigen::Vector3d& arrival, double excess_m, double power,
                         std::uint64_t reflector = 5) {
  Path path;
  path.kind = PathKind::Diffuse;
  path.excess_m = excess_m;
  path.arrival = arrival;
  path.reflector = reflector;
  path.scattered_power = power;
  path.arrival_elevation_rad = std::asin(arrival.z());
  return path;
}

/// Sets the paths; a direct one comes first.
inline void arrive(SatelliteView& view, std::vector<Path> paths) {
  const bool direct = !paths.empty() && paths.front().kind == PathKind::Direct;
  view.paths.visibility = paths.empty()      ? Visibility::Blocked
                          : !direct          ? Visibility::NLOS
                          : paths.size() > 1 ? Visibility::LOSMultipath
                                             : Visibility::LOS;
  view.paths.paths = std::move(paths);
}

inline std::vector<SatelliteView> open_sky(const orbit::Sky& sky, GpsTime time,
                                           const Eigen::Vector3d& antenna) {
  std::vector<SatelliteView> views;
  for (const gnss::SatelliteId id : sky.satellites()) {
    const auto line = orbit::line_of_sight(sky, id, time, antenna);
    if (!line || line->elevation_rad < 0) continue;
    SatelliteView view;
    view.line = *line;
    arrive(view, {direct_path(*line)});
    views.push_back(view);
  }
  return views;
}

/// One GPS satellite at 40 degrees in the north: the link budget's top (IS-GPS-200 figure 6-1).
inline const orbit::FrozenSky& one_satellite() {
  static const orbit::FrozenSky sky(kPosition, {0}, {geodesy::radians(40)});
  return sky;
}
inline const orbit::FrozenSky& six_satellites() {
  static const orbit::FrozenSky sky(kPosition, {0, 1, 2, 3, 4, 5}, {0.5, 1.2, 0.7, 0.4, 0.9, 0.6});
  return sky;
}
inline const CircularSky& four_systems() {
  static const CircularSky sky({System::GPS, System::GLONASS, System::Galileo, System::BeiDou});
  return sky;
}

inline ReceiverEpoch observe(Receiver& receiver, const orbit::Sky& sky, GpsTime time,
                             const std::vector<SatelliteView>& views,
                             const Eigen::Vector3d& antenna = kAntenna,
                             const Eigen::Vector3d& velocity = kAtRest) {
  return observe_views(receiver, time, antenna, velocity, views, kEcefFromEnu, raytrace::Containment::Free,
                       sky);
}

/// The only satellite, at `seconds`, with the paths made by `paths_of` from its line of sight.
using PathsOf = std::function<std::vector<Path>(const orbit::LineOfSight&)>;
inline SatelliteObservation observe_one(Receiver& receiver, double seconds, const PathsOf& paths_of,
                                        const Eigen::Vector3d& antenna = kAntenna,
                                        const Eigen::Vector3d& velocity = kAtRest) {
  std::vector<SatelliteView> views = open_sky(one_satellite(), kTime + seconds, antenna);
  arrive(views.front(), paths_of(views.front().line));
  return observe(receiver, one_satellite(), kTime + seconds, views, antenna, velocity).satellites.front();
}
inline std::vector<Path> clear(const orbit::LineOfSight& line) {
  return {direct_path(line)};
}
inline std::vector<Path> nothing(const orbit::LineOfSight& /*line*/) {
  return {};
}

inline const SatelliteObservation* find(const ReceiverEpoch& epoch, gnss::SatelliteId id) {
  for (const SatelliteObservation& each : epoch.satellites) {
    if (each.id == id) return &each;
  }
  return nullptr;
}

/// C/N0 of `one_satellite` in the clear with an antenna of 0 dBic: -158.5 dBW + 3 dB + 2 dB (elevation) - 1
/// dB
/// - 10 log10(k (211 K + 290 K (10^0.2 - 1))).
inline double clear_cn0_dbhz() {
  return -158.5 + 3 + 2 - 1 - 10 * std::log10(1.380649e-23 * (211 + 290 * (std::pow(10, 0.2) - 1)));
}

}  // namespace canyon::test
