#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "canyon/base/options/fwd.hpp"

namespace canyon::disturbance {

/// Preset of the numbers.
enum class ShadowingEnvironment {
  Urban,     ///< published numbers for streets of a city
  Suburban,  ///< published numbers for low houses with trees
  Dense,     ///< Urban, with more obstacles that the map lacks (SkylineOptions)
  Open,      ///< no shadows
  Auto,      ///< Open, Suburban, Urban or Dense by the city, see environment_for(); else Urban
};

/// Level of the direct signal [dB] relative to a clear line of sight, log-normal in each of two states, and
/// the chain that switches between them, one step per frame.
struct ShadowingParameters {
  double clear_mean_db, clear_sigma_db, shadowed_mean_db, shadowed_sigma_db;
  double enter;  ///< probability of shadow in the frame after a clear one, [0, 1]
  double leave;  ///< probability of a clear frame after one in shadow, (0, 1]

  /// Fraction of the route in shadow: the stationary probability of the chain.
  [[nodiscard]] double shadowed_fraction() const { return enter / (enter + leave); }
};

/// Obstacles on the ground that a map lacks: trees, awnings, signs, footbridges, buses, people. They cover a
/// fraction of the azimuths, each at a distance and with a height, and are fixed in the world. An antenna
/// above their tops has a free view over them.
struct SkylineOptions {
  std::optional<double> fraction;  ///< of azimuths with an obstacle, [0, 1]; empty: skyline_numbers()
  double height_m = 8;             ///< mean of heights above kBase_m: gamma, shape 2; (0, 100]

  /// Height above the ground at which obstacles begin [m]: the roof of a car.
  static constexpr double kBase_m = 2;
  /// Median of the distances [m], and deviation of their logarithm: log-normal.
  static constexpr double kDistance_m = 8, kDistanceSigma = 0.4;
  /// Travelled distance after which the obstacles are independent [m].
  static constexpr double kLength_m = 25;
  /// Fraction of the obstacles whose tops are higher than this above the ground [m]; 1 up to kBase_m.
  [[nodiscard]] double fraction_above(double above_m) const;
  void validate() const;
};

/// Shadows by objects that no map has: vehicles, trees, poles, signs, people, bridges, edges.
///
/// The three-state model of the land mobile satellite channel (clear, moderate shadow, deep shadow;
/// Perez-Fontan et al., IEEE Trans. Veh. Technol. 50(6), 2001, with the S-band tables of IEEE Trans.
/// Broadcast. 44(1), 1998) without its deep shadow: that is the shadow of buildings, which are in the map.
/// Step probabilities between the other two states are conditional on not entering the third: enter = P12 /
/// (P11 + P12), leave = P21 / (P21 + P22). docs/shadowing.md has the tables and their sources. They hold for
/// a vehicle: for an antenna above SkylineOptions::kBase_m the fraction of shadow is multiplied by
/// SkylineOptions::fraction_above().
struct ShadowingOptions {
  bool enabled = false;
  ShadowingEnvironment environment = ShadowingEnvironment::Urban;
  std::optional<ShadowingParameters> numbers;  ///< for all positions, instead of the environment's; no key
  SkylineOptions skyline;
  /// Length of a frame [m], [0.1, 1000]: a state lasts a whole number of frames.
  double frame_m = 4.4;

  /// Whether shadows occur at all.
  [[nodiscard]] bool active() const { return enabled && environment != ShadowingEnvironment::Open; }
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
/// Minimum and maximum fraction of azimuths with an obstacle; uniformly distributed if not known better.
[[nodiscard]] std::pair<double, double> obstacle_fractions(ShadowingEnvironment environment);
/// The obstacles with all values filled in: the middle of obstacle_fractions().
[[nodiscard]] SkylineOptions skyline_numbers(const ShadowingOptions& options);

/// Resolves ShadowingEnvironment::Auto.
/// @param closed_sky fraction of directions from 15 to 60 deg that the city hides, [0, 1]: below 0.02 open,
/// below 0.07 suburban, below 0.15 urban, else dense (docs/shadowing.md)
[[nodiscard]] ShadowingEnvironment environment_for(double closed_sky);
/// Visits their fields. The environment is also a field of a scenario, by the key `surroundings`.
void visit_environment(options::Visitor& v, std::string_view key, ShadowingEnvironment& environment);
void visit(options::Visitor& v, SkylineOptions& o);
void visit(options::Visitor& v, ShadowingOptions& o);

/// Model of the environment at an elevation [rad], for a vehicle: linear between 40, 60 and 80 deg, constant
/// outside (nothing is published there). Suburban chains use the numbers of 40 deg everywhere.
[[nodiscard]] ShadowingParameters shadowing_parameters(const ShadowingOptions& options, double elevation_rad);

/// Region: its vehicles, and the side of the road on which they drive.
enum class StreetRegion : std::uint8_t {
  Europe,
  Americas,
  EastAsia,  ///< Hong Kong: on the left, with double-deckers
  Tr37885,   ///< the vehicles of 3GPP TR 37.885 V15.3.0, table 6.1.2-1 and option B of 6.1.2: on the right
};

/// Class of a street, for numbers that are not given.
enum class StreetClass : std::uint8_t { Arterial, Street, Residential };

/// Vehicles of one kind: a box, sheet metal below the sill of its windows and glass above.
struct VehicleClass {
  std::string_view name;
  double length_m, width_m, height_m, sill_m;
  std::array<double, 4> weights;  ///< by StreetRegion, each region's sum is 1
};
/// All classes; docs/shadowing.md has the source or the range of each number.
[[nodiscard]] std::span<const VehicleClass> vehicle_classes();

/// Objects of a street that are in no map: traffic and, along the kerbs, trees, signs, awnings and
/// footbridges. docs/shadowing.md separates physics from assumptions.
struct StreetOptions {
  bool enabled = false;
  StreetRegion region = StreetRegion::Europe;
  StreetClass street = StreetClass::Street;
  int lanes = 0;                          ///< in each direction, [0, 6]; 0: by class
  std::optional<double> vehicles_per_km;  ///< of each lane, [0, 65]; empty: by class
  std::map<std::string, double>
      vehicle_fractions;            ///< of VehicleClass::name, over their sum; empty: the region's
  std::optional<double> speed_mps;  ///< in free flow, (0, 50]; empty: by class
  double cycle_s = 90;              ///< of traffic lights, [1, 1000]
  double red_s = 40;                ///< of each cycle, [0, cycle_s]
  /// Objects on each side, [0, 200]: crowns, signs above the road, awnings; and footbridges across the road,
  /// [0, 20]. Empty: by class and region.
  std::optional<double> trees_per_km, signs_per_km, awnings_per_km, footbridges_per_km;
  /// Height of the trajectory over the road [m], [0, 1000]; empty: height_above_terrain_m of the trajectory,
  /// else kAntennaHeight_m.
  std::optional<double> antenna_height_m;
  /// The street's direction while the antenna does not move [deg], clockwise from north, [0, 360); empty: the
  /// host's, else sampled by the seed.
  std::optional<double> azimuth_deg;

  /// The roof of a car and a magnetic mount: assumed, 1.5 to 2.2 m.
  static constexpr double kAntennaHeight_m = 1.8;

  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
void visit(options::Visitor& v, StreetOptions& o);

/// A street in numbers: those of StreetOptions, and for absent ones those of its class and region.
struct StreetNumbers {
  int lanes = 2;
  double vehicles_per_km = 0;
  double speed_mps = 0;  ///< of moving vehicles: the free-flow speed, or less by the density
  double trees_per_km = 0, signs_per_km = 0, awnings_per_km = 0, footbridges_per_km = 0;
  double antenna_height_m = StreetOptions::kAntennaHeight_m;
  bool left = false;              ///< vehicles drive on the left
  std::array<double, 8> weights;  ///< of vehicle_classes(), cumulative: the last one that counts is 1
};
/// Speeds by the triangular fundamental diagram: min(free, w (k_j / k - 1)) with the backward wave w = 5 m/s
/// and the jam density k_j = 140 vehicles/km (G. F. Newell, Transp. Res. B 27(4), 1993, p. 281-313; numbers
/// assumed, w 4 to 6 m/s, k_j 120 to 150).
[[nodiscard]] StreetNumbers street_numbers(const StreetOptions& options);

}  // namespace canyon::disturbance
