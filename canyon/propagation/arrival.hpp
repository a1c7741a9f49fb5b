#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "canyon/errors/space_errors.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/gnss/navigation_data.hpp"
#include "canyon/gnss/signals.hpp"
#include "canyon/orbit/sky.hpp"
#include "canyon/propagation/paths.hpp"
#include "canyon/raytrace/ray_scene.hpp"

namespace canyon::propagation {

/// Distribution of an unwanted wave's power over frequencies.
struct Spectrum {
  enum class Shape : std::uint8_t {
    Band,   ///< flat over width_hz about centre_hz: wide-band noise, matched noise where as wide as a signal
    Tone,   ///< all on centre_hz
    Chirp,  ///< a saw-tooth sweep over width_hz about centre_hz, once in period_s
    Code,   ///< a ranging signal of another code: modulation and chip_rate_hz about centre_hz
  };
  Shape shape = Shape::Band;
  double centre_hz = gnss::kL1_hz;
  double width_hz = 0;
  double period_s = 0;
  gnss::Modulation modulation = gnss::Modulation::BPSK;
  double chip_rate_hz = 0;

  [[nodiscard]] bool operator==(const Spectrum&) const = default;
};

enum class Polarisation : std::uint8_t { Right, Left, Linear };

/// A wave at the antenna that no satellite sends: a jammer's or a spoofer's.
struct Interference {
  Spectrum spectrum;
  /// Power at an isotropic antenna of the wave's own polarisation [dBW].
  double power_dbw = -200;
  Polarisation polarisation = Polarisation::Linear;
  /// Unit, from the antenna towards where it comes from, in the frame of the arrival's paths.
  Eigen::Vector3d arrival = Eigen::Vector3d::UnitZ();
  /// Satellite whose signal it repeats: for that satellite's channels it is a path, not noise.
  std::optional<gnss::SatelliteId> copy_of{};
};

/// A body that no map has: it stands or moves in a street, or is a host's moving model. An upright box, or
/// the crown of a tree. Places in metres, east, north, up.
struct Body {
  enum class Kind : std::uint8_t { Vehicle, Structure, Crown };
  Kind kind = Kind::Vehicle;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Vector2d ahead = Eigen::Vector2d::UnitX();  ///< unit: of its length
  double half_length_m = 0, half_width_m = 0;        ///< Crown: the radius of the sphere, both
  double bottom_m = 0, top_m = 0;
  bool grounded = true;    ///< nothing passes below it
  double sill_m = 0;       ///< height over the ground up to which it is metal; glass above
  std::uint64_t name = 0;  ///< stays the same while it lives

  /// Whether a point lies in it or within `margin_m` of it.
  [[nodiscard]] bool holds(const Eigen::Vector3d& point, double margin_m) const;
};

/// The upright box about a movable mesh, turned with it.
[[nodiscard]] Body body_of(const raytrace::PlacedInstance& instance);

/// "vehicle", "structure", "crown".
[[nodiscard]] std::string_view name(Body::Kind kind);

/// An antenna at an instant.
struct Antenna {
  geodesy::GpsTime time;                                    ///< true reception instant
  Eigen::Vector3d position_ecef = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d velocity_ecef = Eigen::Vector3d::Zero();  ///< [m/s], in the rotating frame
};

/// A satellite above the horizon as it arrives at an antenna: orbit and surroundings together.
struct SatelliteView {
  orbit::LineOfSight line;
  SatellitePaths paths;
  /// The elevation that a receiver compares with its mask [rad], if not the true one: the
  /// higher of both where a spoofer shows another place.
  std::optional<double> shown_elevation_rad{};
  /// Phase by which the carrier at 1575.42 MHz, but not the code, turns on all paths [rad], and its rate;
  /// other carriers turn by the inverse of their frequency, as in phase scintillation.
  double carrier_turn_rad = 0, carrier_turn_radps = 0;
  /// Errors that the signals carry from space; empty: none beside broadcast orbits, clocks and models.
  std::optional<errors::SpaceDelays> space{};

  /// Rate at which the satellite's direction turns in the axes of the Earth [rad/s].
  [[nodiscard]] double turning_radps() const {
    return line.direction_ecef.cross(line.velocity_at_reception_mps).norm() / line.range_m;
  }
};

/// Everything that arrives at an antenna at one instant.
struct Arrival {
  raytrace::Placement placement = raytrace::Placement::Free;  ///< anything else: nothing is received
  std::vector<SatelliteView> views;  ///< satellites above the horizon, ascending by id
  /// Rotation of the frame that the views' paths are given in.
  Eigen::Matrix3d ecef_from_enu = Eigen::Matrix3d::Identity();
  Eigen::Vector3d antenna_enu = Eigen::Vector3d::Zero();  ///< the antenna in that frame [m]
  double height_above_ground_m = 0;  ///< of the antenna: raytrace::RayScene::height_above_ground()
  /// Other waves at the antenna; powers add.
  std::vector<Interference> interference{};
  /// Orbits and clocks that the satellites broadcast, which the fix uses. Null: the true ones.
  std::shared_ptr<const orbit::Sky> broadcast{};
  /// The messages with these; null: those of the sky.
  std::shared_ptr<const gnss::NavigationData> messages{};
  /// Bodies about the antenna that are not in the city, in the paths' frame, for viewers: the paths include
  /// their effects already.
  std::vector<Body> bodies{};
};

}  // namespace canyon::propagation
