#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/random.hpp"
#include "canyon/city/fwd.hpp"
#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/gnss/signals.hpp"
#include "canyon/sky/orbit/sky.hpp"
#include "canyon/sky/range_errors.hpp"

namespace canyon::propagation {

/// One reflection along a path.
struct Incidence {
  double incidence_rad = 0;  ///< between ray and normal, [0, pi/2]
  city::Material material = city::Material::Unknown;
  std::optional<double> thickness_m;  ///< of the slab; empty: the material's default
  double plane_rotation_rad = 0;  ///< of the plane of incidence since the last reflection; 0 for the first
  /// Fraction [0, 1] of the smooth surface's amplitude that continues in the mirror direction: sqrt(1 - S^2)
  /// of a wall that scatters with the coefficient S (DiffuseOptions), by the energy balance of the effective
  /// roughness model (V. Degli-Esposti, IEEE Trans. AP 49(7), 2001, pp. 1111-1113).
  double specular_factor = 1;
};

/// Geometry for a path's strength: any sequence of reflections, one edge, foliage. All empty: direct.
struct PathGeometry {
  std::array<Incidence, 2> incidences;  ///< in the order from the satellite
  int incidence_count = 0;              ///< 0 to 2
  /// nu of the diffracting edge (signed_knife_edge_nu()): > 0 if it blocks the path; < 0: the wave that an
  /// edge near a clear path adds to it (edge_wave()).
  std::optional<double> edge_nu;
  /// Radius [m] of the rounded edge, >= 0 (rounded_edge_loss_db()); 0: a knife edge. For > 0 also used: the
  /// angle by which the ray bends [rad] and the distance from antenna to edge [m].
  double edge_radius_m = 0;
  double edge_bending_rad = 0;
  double edge_leg_m = 0;
  double excess_m = 0;               ///< sum of all detours over the straight line, >= 0 along a path
  double arrival_elevation_rad = 0;  ///< of the direction of arrival, [-pi/2, pi/2]
  double foliage_depth_m = 0;        ///< of vegetation along the ray, >= 0
};

/// Angle (-pi, pi] by which the plane of incidence rotates between two reflections.
/// @param direction of propagation between the two, unit
/// @param first_normal, second_normal unit normals of the surfaces, to the side that reflects
/// 0 if a plane of incidence is undefined (normal incidence).
[[nodiscard]] double plane_rotation_rad(const Eigen::Vector3d& direction, const Eigen::Vector3d& first_normal,
                                        const Eigen::Vector3d& second_normal);

enum class PathKind : std::uint8_t {
  Direct,
  Reflected,    ///< by one or two facets, as by mirrors
  Diffracted,   ///< around one edge
  Diffuse,      ///< scattered by a rough or structured facade: a cluster of waves with one mean detour
  Transmitted,  ///< not from the satellite: a copy of its signal from a transmitter (disturbance::Spoofing)
};
/// "direct", "reflected", "diffracted", "diffuse", "spoofed": the words of all outputs.
[[nodiscard]] std::string_view name(PathKind kind);

/// One path from satellite to antenna. Directions and points are in the city's ENU frame. `point` and its
/// related fields belong to the interaction next to the antenna. `far_point` and its related fields belong to
/// the one next to the satellite, if there are two. The strength depends on the PathGeometry; Diffuse has
/// only excess and arrival of it. A Direct path with foliage_depth_m > 0 passes through vegetation.
struct Path : PathGeometry {
  PathKind kind = PathKind::Direct;
  std::uint8_t order = 0;  ///< number of reflections: 0 for Direct, 1 or 2 for Reflected
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    ///< of reflection, on the edge, on the facade
  Eigen::Vector3d arrival = Eigen::Vector3d::Zero();  ///< unit, from the antenna to the wave's origin
  std::uint32_t triangle = 0;  ///< that reflects or scatters, of `instance`; 0 for Diffracted
  std::uint32_t instance = 0;

  Eigen::Vector3d far_point = Eigen::Vector3d::Zero();  ///< reflection point next to the satellite (order 2)
  std::uint32_t far_triangle = 0;                       ///< that reflects there, of `far_instance`
  std::uint32_t far_instance = 0;
  double leg_m = 0;  ///< from the antenna to `point` (order 2)

  /// Constant while the signal comes over the same surfaces or edge; random phases depend on it
  /// (tracking::PathPhases). 0 for Direct.
  std::uint64_t reflector = 0;
  /// From `arrival` to the direction of the scattering centre on a rough facade or edge: a pane, a frame, a
  /// balcony. It is fixed while the antenna passes, which changes the rate of the carrier
  /// (tracking::path_rate_mps). 0 for ideal planes and edges.
  Eigen::Vector3d scattering_offset = Eigen::Vector3d::Zero();
  /// Mean power [1] relative to the unobstructed line of sight at isotropic antennas (Diffuse only); the
  /// instantaneous power has Rayleigh fading.
  double scattered_power = 0;
  /// Multiplies the path's amplitude [1], >= 0: effects that are not in its geometry
  /// (disturbance::Disturbance).
  double amplitude_factor = 1;

  // Transmitted: amplitude_factor is relative to the satellite's clear line of sight before the antenna, for
  // a right-hand wave; excess_m may have either sign and any size.
  double range_rate_mps = 0;  ///< of range plus excess, as seen by the carrier [m/s]
  /// Excess of the code over the carrier, a part of excess_m [m], and its rate [m/s].
  double code_ahead_m = 0, code_ahead_mps = 0;
  std::uint32_t signals = ~0U;  ///< transmitted signals: bit gnss::index_of(signal)

  /// Excess of the carrier [m].
  [[nodiscard]] double carrier_excess_m() const { return excess_m - code_ahead_m; }
  /// Between ray and facet normal, [0, pi/2): at `point`, and at `far_point`; 0 without a reflection.
  [[nodiscard]] double incidence_rad() const {
    return incidence_count > 0 ? incidences[static_cast<std::size_t>(incidence_count) - 1].incidence_rad : 0;
  }
  [[nodiscard]] double far_incidence_rad() const {
    return incidence_count > 1 ? incidences[0].incidence_rad : 0;
  }
};

/// Image of the antenna in the mirrors of `path`, for the satellite in direction `s` (unit, ENU). Direct: the
/// antenna itself. Else it is on the line through the reflection point next to the satellite, behind it by
/// the path length from there to the antenna. excess_m = s . (antenna - image), and for fixed reflectors
/// d(excess)/dt = s' . (antenna - image) + (s - arrival) . antenna'. Holds for planes and also for
/// Diffracted: the path is stationary at the point on the edge, so the motion of Keller's point has no
/// first-order effect. Diffuse: over one facade, to a fixed point; a class's mean detour differs by its
/// width and by further facades.
[[nodiscard]] Eigen::Vector3d antenna_image(const Path& path, const Eigen::Vector3d& antenna,
                                            const Eigen::Vector3d& s);

/// How a satellite is seen: by all paths, however weak (SatellitePaths), or by a receiver
/// (receiver::SatelliteObservation).
enum class Visibility : std::uint8_t {
  LOS,           ///< direct path clear, no reflection arrives
  LOSMultipath,  ///< direct path clear, reflections arrive as well (an edge near the path does not count)
  NLOS,          ///< direct path blocked, at least one other path arrives
  Blocked,       ///< nothing arrives
};
/// "LOS", "LOS+multipath", "NLOS", "blocked": the words of all outputs.
[[nodiscard]] std::string_view name(Visibility visibility);

/// Whether `a` comes before `b` in SatellitePaths.
[[nodiscard]] bool comes_before(const Path& a, const Path& b);

/// All paths of one satellite. Direct first, then by excess path (equal ones: the lower order first),
/// Transmitted last. Visibility ignores Transmitted paths.
struct SatellitePaths {
  Visibility visibility = Visibility::Blocked;
  std::vector<Path> paths;

  /// Sorts the paths and sets their visibility.
  void arrange();
  /// Copies unordered paths, with no spare capacity, and arranges them.
  void take(const std::vector<Path>& found);
  [[nodiscard]] bool received() const { return visibility != Visibility::Blocked; }
  /// Excess path [m] of the signal that an ideal receiver tracks, which receives every path and follows the
  /// first. 0 with a direct path (also through leaves), else the excess of the shortest path of any kind,
  /// however weak; 0 when blocked. Transmitted ones do not count. A real correlator, which weighs all paths
  /// by their strengths, is part of the receiver's signal model.
  [[nodiscard]] double tracked_excess_m() const;
};

/// Path::reflector: a hash of the kind and of the numbers of the reflectors (instances, facets, an edge, a
/// class), never 0. Mixed by the finaliser of SplitMix64 (G. L. Steele, D. Lea, C. H. Flood, OOPSLA 2014,
/// figure 18), so that adjacent numbers are uncorrelated; two of a thousand reflectors collide with a
/// probability of 3e-14. The same on every machine.
[[nodiscard]] inline std::uint64_t reflector_id(PathKind kind, std::initializer_list<std::uint32_t> names) {
  std::uint64_t hash = mix64(static_cast<std::uint64_t>(kind) + kGolden64);
  for (const std::uint32_t name : names) hash = mix64(hash + kGolden64 + name);
  return hash != 0 ? hash : 1;
}

/// Reflections of one satellite are one if their planes differ by less than this [m] and 1 deg: common walls
/// of two buildings are often not drawn in exactly the same plane. Points along the planes then differ by
/// this over the cosine of incidence.
inline constexpr double kCoincidentPoint = 2e-3;
inline const double kSameNormal = std::cos(geodesy::radians(1));

/// Distribution of an unwanted wave's power over frequencies.
struct Spectrum {
  enum class Shape : std::uint8_t {
    Band,   ///< flat over width_hz about centre_hz: wide-band noise, or matched noise if as wide as a signal
    Tone,   ///< all power at centre_hz
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

/// A wave at the antenna that is not from a satellite: a jammer's or a spoofer's.
struct Interference {
  Spectrum spectrum;
  /// Power at an isotropic antenna of the wave's own polarisation [dBW].
  double power_dbw = -200;
  Polarisation polarisation = Polarisation::Linear;
  /// Unit, from the antenna towards the source, in the frame of the arrival's paths.
  Eigen::Vector3d arrival{0, 0, 1};
  /// Satellite whose signal it copies: a path for that satellite's channels, not noise.
  std::optional<gnss::SatelliteId> copy_of{};
};

/// A body that is in no map: at rest or moving in a street, or a host's moving model. An upright box, or the
/// crown of a tree. Positions in metres, east, north, up.
struct Body {
  enum class Kind : std::uint8_t { Vehicle, Structure, Crown };
  Kind kind = Kind::Vehicle;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Vector2d ahead{1, 0};                 ///< unit: along its length
  double half_length_m = 0, half_width_m = 0;  ///< Crown: the radius of the sphere, both
  double bottom_m = 0, top_m = 0;
  bool grounded = true;    ///< no signal passes below it
  double sill_m = 0;       ///< height over the ground up to which it is metal; glass above
  std::uint64_t name = 0;  ///< constant during its life

  /// Whether a point is inside it or within `margin_m` of it.
  [[nodiscard]] bool holds(const Eigen::Vector3d& point, double margin_m) const;
};

/// The upright bounding box of a movable mesh, rotated with it.
[[nodiscard]] Body body_of(const raytrace::PosedInstance& instance);

/// "vehicle", "structure", "crown".
[[nodiscard]] std::string_view name(Body::Kind kind);

/// An antenna at an instant.
struct Antenna {
  geodesy::GpsTime time;                                    ///< true reception instant
  Eigen::Vector3d position_ecef = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d velocity_ecef = Eigen::Vector3d::Zero();  ///< [m/s], in the rotating frame
};

/// A satellite above the horizon and its signal at an antenna: orbit and environment together.
struct SatelliteView {
  orbit::LineOfSight line;
  SatellitePaths paths;
  /// The elevation that a receiver compares with its mask [rad], if not the true one: the higher of true and
  /// shown one if a spoofer shows another position.
  std::optional<double> shown_elevation_rad{};
  /// Phase offset of the carrier at 1575.42 MHz, but not of the code, on all paths [rad], and its rate; those
  /// of other carriers scale with the inverse of their frequency, as in phase scintillation.
  double carrier_phase_offset_rad = 0, carrier_phase_rate_radps = 0;
  /// Range errors of the signals in space; empty: none except those of broadcast orbits, clocks and models.
  std::optional<sky::RangeErrors> space{};

  /// Angular rate of the satellite's direction in Earth-fixed axes [rad/s].
  [[nodiscard]] double direction_rate_radps() const;
};

/// Everything that arrives at an antenna at one instant.
struct Arrival {
  raytrace::Containment containment = raytrace::Containment::Free;  ///< anything else: nothing is received
  std::vector<SatelliteView> views;  ///< satellites above the horizon, ascending by id
  /// Rotation of the frame that the views' paths are given in.
  Eigen::Matrix3d ecef_from_enu = Eigen::Matrix3d::Identity();
  Eigen::Vector3d antenna_enu = Eigen::Vector3d::Zero();  ///< the antenna in that frame [m]
  double height_above_ground_m = 0;  ///< of the antenna: raytrace::RayScene::height_above_ground()
  /// Other waves at the antenna; powers add.
  std::vector<Interference> interference{};
  /// Broadcast orbits and clocks, used by the fix. Null: the true ones.
  std::shared_ptr<const orbit::Sky> broadcast{};
  /// The broadcast messages; null: those of the sky.
  std::shared_ptr<const gnss::NavigationData> messages{};
  /// Bodies near the antenna that are not in the city, in the paths' frame, for viewers: the paths include
  /// their effects already.
  std::vector<Body> bodies{};
};

}  // namespace canyon::propagation
