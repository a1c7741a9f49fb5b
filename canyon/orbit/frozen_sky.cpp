#include "canyon/orbit/frozen_sky.hpp"

#include <fmt/format.h>

#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"

namespace canyon::orbit {
namespace {

constexpr double kDistance_m = 20'200e3;  // GPS altitude
constexpr std::size_t kMaxSatellites = 63;

void check(std::size_t index, double azimuth_rad, double elevation_rad) {
  constexpr double kRight = geodesy::kPi / 2;
  if (!std::isfinite(azimuth_rad)) {
    throw InputError(
        fmt::format("frozen sky: azimuth {} of satellite {} is not a finite number", azimuth_rad, index + 1),
        "give radians from north, clockwise");
  }
  // The condition is negated, so that NaN is refused; an angle of 1.5708 means the zenith.
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

FrozenSky::FrozenSky(const geodesy::Geodetic& place, const std::vector<double>& azimuth_rad,
                     const std::vector<double>& elevation_rad) {
  geodesy::check_geodetic(place, "place of the frozen sky");
  if (azimuth_rad.size() != elevation_rad.size()) {
    throw InputError(
        fmt::format("frozen sky: {} azimuths but {} elevations", azimuth_rad.size(), elevation_rad.size()),
        "give one of each for every satellite");
  }
  if (azimuth_rad.empty() || azimuth_rad.size() > kMaxSatellites) {
    throw InputError(fmt::format("frozen sky: {} satellites", azimuth_rad.size()),
                     fmt::format("give 1 to {}", kMaxSatellites));
  }
  const Eigen::Vector3d origin = geodesy::ecef_from_geodetic(place);
  const Eigen::Matrix3d ecef_from_enu = geodesy::enu_from_ecef_rotation(place).transpose();
  for (std::size_t i = 0; i < azimuth_rad.size(); ++i) {
    check(i, azimuth_rad[i], elevation_rad[i]);
    const Eigen::Vector3d enu = geodesy::enu_from_azimuth_elevation(azimuth_rad[i], elevation_rad[i]);
    const Eigen::Vector3d at_reception = origin + ecef_from_enu * enu * kDistance_m;
    // Turned back over the flight, so that the Earth's rotation brings it where it was asked for.
    positions_.push_back(rotate_earth(at_reception, -kDistance_m / geodesy::kSpeedOfLight));
    directions_.push_back(geodesy::azimuth_elevation_from_enu(enu));
  }
}

bool FrozenSky::has(gnss::SatelliteId id) const {
  return id.system == gnss::System::GPS && id.number >= 1 && id.number <= positions_.size();
}

std::vector<gnss::SatelliteId> FrozenSky::satellites() const {
  std::vector<gnss::SatelliteId> ids;
  for (std::size_t i = 1; i <= positions_.size(); ++i) {
    ids.push_back({gnss::System::GPS, static_cast<std::uint8_t>(i)});
  }
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
