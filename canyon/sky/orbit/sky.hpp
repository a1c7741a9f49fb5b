#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::orbit {

/// A satellite at an instant, ECEF (WGS 84 axes of that instant).
struct SatelliteState {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();  ///< in the rotating frame
  double clock_bias_s = 0;   ///< satellite clock minus system time on GPST, relativity included
  double clock_drift = 0;    ///< [s/s], relativity included
  double group_delay_s = 0;  ///< TGD/BGD of the L1-band signal: its effective clock is bias - group delay
  double carrier_frequency_hz = 0;  ///< of the L1-band signal
  /// Group delays of the other signals of gnss::signals_of(), in their order after the first.
  std::array<double, gnss::kMaxSignals - 1> more_group_delays_s{};

  [[nodiscard]] double group_delay_of(const gnss::Signal& signal) const {
    const std::size_t index = gnss::index_of(signal);
    return index == 0 ? group_delay_s : more_group_delays_s[index - 1];
  }
};

/// Health of a satellite by its own messages; Unknown: no messages, or none valid.
enum class SatelliteHealth : std::uint8_t { Unknown, Healthy, Unhealthy };

/// Positions of satellites: the interface to orbits for all later modules. Implementations are immutable
/// after construction and thread-safe.
class Sky {
 public:
  virtual ~Sky() = default;
  Sky() = default;
  Sky(const Sky&) = delete;
  Sky& operator=(const Sky&) = delete;

  /// Satellites for which this sky may have states, ascending, no repeats.
  [[nodiscard]] virtual std::vector<gnss::SatelliteId> satellites() const = 0;

  /// State at `t` (system time at transmission, GPST). Empty if the satellite is unknown, unhealthy, or `t`
  /// is outside the validity of its data. Extrapolates only if source() reports this.
  [[nodiscard]] virtual std::optional<SatelliteState> state(gnss::SatelliteId id,
                                                            geodesy::GpsTime t) const = 0;

  /// Source of the state of `id` at `t`, as text: "hksc1180.19n, toe 2019-04-28T14:00:00 GPST"; or the reason
  /// why there is none.
  [[nodiscard]] virtual std::string source(gnss::SatelliteId id, geodesy::GpsTime t) const = 0;

  [[nodiscard]] virtual SatelliteHealth health(gnss::SatelliteId /*id*/, geodesy::GpsTime /*t*/) const {
    return SatelliteHealth::Unknown;
  }
};

/// A satellite as received by an antenna, at rest or moving, at one instant.
struct LineOfSight {
  gnss::SatelliteId id;
  geodesy::GpsTime transmit_time;
  SatelliteState state;  ///< at transmit_time, in the ECEF axes of that instant
  /// Satellite position in the ECEF axes of the reception instant (Sagnac rotation applied) [m].
  Eigen::Vector3d position_at_reception_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_at_reception_mps = Eigen::Vector3d::Zero();  ///< rotated likewise
  double range_m = 0;  ///< geometric, |position_at_reception - receiver|
  Eigen::Vector3d direction_ecef = Eigen::Vector3d::Zero();  ///< unit, receiver to satellite
  double azimuth_rad = 0;                                    ///< relative to the receiver's geodetic vertical
  double elevation_rad = 0;
};

/// An antenna position with its derived values: create one for all satellites of an epoch.
struct Observer {
  /// @param ecef antenna [m], on or above the Earth's surface
  explicit Observer(const Eigen::Vector3d& ecef);

  Eigen::Vector3d position_ecef;
  Eigen::Matrix3d enu_from_ecef;  ///< at the geodetic vertical
};

/// Solves the light-time equation by iteration (IS-GPS-200, 20.3.3.4.3.4); converged below 0.1 ns. Evaluates
/// the sky twice; once for satellites more than 5 deg below the horizon, whose state is extrapolated linearly
/// from the first guess to the transmit time (position within 2 mm, velocity within 5 cm/s).
/// @param observer antenna at reception
/// @param reception true reception instant
/// Empty if the sky has no state at the transmit time or 0.075 s before reception (the first guess; relevant
/// only in the outermost tenth of a second of an ephemeris's validity).
[[nodiscard]] std::optional<LineOfSight> line_of_sight(const Sky& sky, gnss::SatelliteId id,
                                                       geodesy::GpsTime reception, const Observer& observer);
/// The same for one satellite. @param receiver_ecef antenna at reception [m]
[[nodiscard]] std::optional<LineOfSight> line_of_sight(const Sky& sky, gnss::SatelliteId id,
                                                       geodesy::GpsTime reception,
                                                       const Eigen::Vector3d& receiver_ecef);

/// `position` (ECEF axes at transmission) expressed in the ECEF axes `flight_time_s` later: rotated by
/// -kEarthRotationRate * flight_time about z.
[[nodiscard]] Eigen::Vector3d rotate_earth(const Eigen::Vector3d& position, double flight_time_s);

/// The paper's virtual satellites: fixed azimuths and elevations, seen from `position`, that do not move
/// relative to the ground, 20,200 km (GPS altitude) away. At `position` line_of_sight() restores azimuth and
/// elevation within 1e-9 rad, elsewhere in a city (kilometres) within 1e-4 rad.
class FrozenSky final : public Sky {
 public:
  /// @param azimuth_rad from north, clockwise, any finite value; @param elevation_rad [0, pi/2], both of one
  /// length, 1 to 63. Satellites become G01, G02, ... in order.
  /// Throws InputError for differing lengths or values out of range (degrees given as radians are detected).
  FrozenSky(const geodesy::Geodetic& position, const std::vector<double>& azimuth_rad,
            const std::vector<double>& elevation_rad);

  [[nodiscard]] std::vector<gnss::SatelliteId> satellites() const override;
  [[nodiscard]] std::optional<SatelliteState> state(gnss::SatelliteId id, geodesy::GpsTime t) const override;
  [[nodiscard]] std::string source(gnss::SatelliteId id, geodesy::GpsTime t) const override;

 private:
  [[nodiscard]] bool has(gnss::SatelliteId id) const;

  std::vector<Eigen::Vector3d> positions_;             ///< ECEF, at transmission
  std::vector<geodesy::AzimuthElevation> directions_;  ///< as given, azimuth wrapped
};

}  // namespace canyon::orbit
