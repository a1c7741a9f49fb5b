#pragma once

#include <optional>
#include <string_view>

#include "canyon/options/fwd.hpp"

namespace canyon::disturbance {

/// Source of the numbers.
enum class ShadowingEnvironment {
  Urban,     ///< as published for streets of a city
  Suburban,  ///< as published for low houses with trees
  Custom,    ///< ShadowingOptions::custom
  Dense,     ///< Urban, and a skyline of obstacles that the map lacks (SkylineOptions)
  Open,      ///< nothing casts a shadow
  Auto,      ///< Open, Suburban, Urban or Dense by the city, see of_surroundings(); else Urban
};

/// Level of the direct signal [dB] against a clear line of sight, log-normal in each of two states, and the
/// chain that chooses between them, one step each frame.
struct ShadowingParameters {
  double clear_mean_db = -0.3;     ///< [-40, 10]
  double clear_sigma_db = 0.73;    ///< [0, 20]
  double shadowed_mean_db = -8.0;  ///< [-40, 10]
  double shadowed_sigma_db = 4.5;  ///< [0, 20]
  double enter = 0.0787;           ///< probability that shadow follows a clear frame, [0, 1]
  double leave = 0.1318;           ///< probability that a clear frame follows one in shadow, (0, 1]

  /// Share of the way that lies in shadow: the stationary one of the chain.
  [[nodiscard]] double shadowed_share() const { return enter / (enter + leave); }
};

/// Obstacles that a map lacks, in numbers (docs/shadowing.md has where they come from).
struct SkylineNumbers {
  double share;           ///< of azimuths with an obstacle
  double height_m;        ///< mean of heights above kBase_m: a gamma distribution of shape 2
  double distance_m;      ///< median of distances: log-normal
  double distance_sigma;  ///< standard deviation of the distances' logarithm
  double foliage_share;   ///< of obstacles that are vegetation; the others have an edge
  double crown_m;         ///< width of a crown
  double edge_radius_m;   ///< that edges are rounded with; 0: knife edges
  double length_m;        ///< way after which other obstacles are met
  double width_rad;       ///< azimuth after which other obstacles are seen
  double moving_share;    ///< of the variance of heights: changes with time, by traffic
  double moving_s;        ///< time in which that part changes

  /// Height above the ground at which obstacles begin [m]: the roof of a car.
  static constexpr double kBase_m = 2;
  /// Share of the obstacles whose tops are higher than this above the ground [m]; 1 up to kBase_m.
  [[nodiscard]] double share_above(double above_m) const;
};

/// Obstacles that a map lacks: trees, awnings, signs, footbridges, buses, podiums, people. They stand about
/// the antenna at a distance, up to a height, in a share of the azimuths, and are fixed in the world. An
/// antenna above their tops sees over them. Whatever is left out is that of the environment
/// (skyline_numbers()).
struct SkylineOptions {
  std::optional<double> share;           ///< [0, 1]
  std::optional<double> height_m;        ///< (0, 100] [m]
  std::optional<double> distance_m;      ///< [1, 100] [m]
  std::optional<double> distance_sigma;  ///< [0, 2]
  std::optional<double> foliage_share;   ///< [0, 1]
  std::optional<double> crown_m;         ///< (0, 100] [m]
  std::optional<double> edge_radius_m;   ///< [0, 10] [m]
  std::optional<double> length_m;        ///< [1, 1000] [m]
  std::optional<double> width_deg;       ///< [5, 90] [deg]
  std::optional<double> moving_share;    ///< [0, 1]
  std::optional<double> moving_s;        ///< [0.1, 1e4] [s]

  void validate() const;
};

/// Shadow by what no map has: vehicles, trees, poles, signs, people, bridges, edges that a city's mesh lacks.
///
/// The three-state model of the land mobile satellite channel (clear, moderate shadow, deep shadow;
/// Perez-Fontan et al., IEEE Trans. Veh. Technol. 50(6), 2001, with the S-band tables of IEEE Trans.
/// Broadcast. 44(1), 1998) without its deep shadow, which is that of buildings: those are in the map. Steps
/// between the other two have their probabilities on condition that the third is not entered: enter = P12 /
/// (P11 + P12), leave = P21 / (P21 + P22). docs/shadowing.md has the tables and where they come from. They
/// are those of a vehicle: for an antenna above SkylineNumbers::kBase_m the share of shadow is times
/// SkylineNumbers::share_above(), but not that of custom numbers.
struct ShadowingOptions {
  bool enabled = false;
  ShadowingEnvironment environment = ShadowingEnvironment::Urban;
  ShadowingParameters custom;  ///< at every elevation; used with ShadowingEnvironment::Custom
  SkylineOptions skyline;
  /// Satellites this far apart share shadows with a correlation of exp(-1/2) [rad], 5 to 60 deg.
  double shared_angle_rad = 0.17453292519943295;  // 10 deg
  /// Length of a frame [m], [0.1, 1000]: states last whole frames.
  double frame_m = 4.4;
  /// Way behind a change of state over which mean and deviation change linearly [m], [0, frame_m].
  double transition_m = 2.2;
  /// Way over which levels correlate by 1/e [m], (0, 1000].
  double correlation_m = 1.7;
  /// From antenna to what shadows it [m], [0, 1000]: while a satellite's direction turns by an angle, shadows
  /// move over the antenna by at most this times the angle, and a bridge shades the satellites ahead before
  /// those behind. 10 m: assumed, range 2 (a vehicle) to 30 (across a street).
  double obstacle_distance_m = 10;
  /// Speed at which what shadows passes an antenna at rest [m/s], [0, 100]: vehicles and people come and go,
  /// leaves move. Added to the antenna's own speed by its square, so that only those at rest notice. 0.1 m/s:
  /// assumed; an urban shadow of 33 m in the mean then ends after some five minutes. Range 0.01 (parked
  /// vehicles) to 1 (traffic).
  double obstacle_speed_mps = 0.1;

  /// Whether anything is ever shadowed.
  [[nodiscard]] bool active() const { return enabled && environment != ShadowingEnvironment::Open; }
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
/// SkylineOptions, completed by the numbers of the environment.
[[nodiscard]] SkylineNumbers skyline_numbers(const ShadowingOptions& options);

/// ShadowingEnvironment::Auto made definite.
/// @param closed_sky share of directions from 15 to 60 deg that the city hides, [0, 1]: below 0.02 open,
/// below 0.07 suburban, else urban; from 0.15 on dense (docs/shadowing.md)
/// @param outlines whether the map has outlines of buildings with flat roofs, and nothing else
[[nodiscard]] ShadowingEnvironment of_surroundings(double closed_sky, bool outlines);
/// Visits their fields. The environment is also a field of a scenario, by the key `surroundings`.
void visit_environment(options::Visitor& v, std::string_view key, ShadowingEnvironment& environment);
void visit(options::Visitor& v, SkylineOptions& o);
void visit(options::Visitor& v, ShadowingOptions& o);

/// Model of the environment at an elevation [rad], for a vehicle: linear between 40, 60 and 80 deg, held
/// beyond (nothing is published there). Suburban chains are those of 40 deg everywhere.
[[nodiscard]] ShadowingParameters shadowing_parameters(const ShadowingOptions& options, double elevation_rad);

}  // namespace canyon::disturbance
