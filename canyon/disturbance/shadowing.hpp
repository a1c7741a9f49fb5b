#pragma once

#include "canyon/base/random.hpp"
#include "canyon/options/fwd.hpp"

namespace canyon::disturbance {

/// Whose numbers.
enum class ShadowingEnvironment {
  Urban,     ///< as published for streets of a city
  Suburban,  ///< as published for low houses with trees
  Custom,    ///< ShadowingOptions::custom
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

/// Shadow by what no map has: vehicles, trees, poles, signs, people, bridges, edges that a city's mesh lacks.
///
/// The three-state model of the land mobile satellite channel (clear, moderate shadow, deep shadow;
/// Perez-Fontan et al., IEEE Trans. Veh. Technol. 50(6), 2001, with the S-band tables of IEEE Trans.
/// Broadcast. 44(1), 1998) without its deep shadow, which is that of buildings: those are in the map. Steps
/// between the other two have their probabilities on condition that the third is not entered: enter = P12 /
/// (P11 + P12), leave = P21 / (P21 + P22). docs/tracking.md has the tables and where they come from.
struct ShadowingOptions {
  bool enabled = false;
  ShadowingEnvironment environment = ShadowingEnvironment::Urban;
  ShadowingParameters custom;  ///< at every elevation; used with ShadowingEnvironment::Custom
  /// Length of a frame [m], [0.1, 1000]: states last whole frames.
  double frame_m = 4.4;
  /// Way behind a change of state over which mean and deviation change linearly [m], [0, frame_m].
  double transition_m = 2.2;
  /// Way over which levels correlate by 1/e [m], (0, 1000].
  double correlation_m = 1.7;
  /// From antenna to what shadows it [m], [0, 1000]: while a satellite's direction turns by an angle, shadows
  /// move over the antenna by this times the angle. 10 m: assumed, range 2 (a vehicle) to 30 (across a
  /// street).
  double obstacle_distance_m = 10;
  /// Speed at which what shadows passes an antenna at rest [m/s], [0, 100]: vehicles and people come and go,
  /// leaves move. Added to the antenna's own speed by its square, so that only those at rest notice. 0.1 m/s:
  /// assumed; an urban shadow of 33 m in the mean then ends after some five minutes. Range 0.01 (parked
  /// vehicles) to 1 (traffic).
  double obstacle_speed_mps = 0.1;

  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
/// Its fields.
void visit(options::Visitor& v, ShadowingOptions& o);

/// Of the environment at an elevation [rad]: linear between 40, 60 and 80 deg, held beyond (nothing is
/// published there). Suburban chains are those of 40 deg everywhere.
[[nodiscard]] ShadowingParameters shadowing_parameters(const ShadowingOptions& options, double elevation_rad);

/// Level of one satellite's direct signal along the way of one antenna: semi-Markov states whose lengths are
/// drawn (geometric numbers of frames), and in them a Gauss-Markov process of the way in its exact discrete
/// form. Stationary from its first value on.
///
/// At one elevation the state at a place does not depend on the steps that led there, nor do the statistics
/// of levels. The same way again gives the same level.
class Shadowing {
 public:
  /// @param states draws the lengths of states, @param levels the levels in them.
  /// Throws InputError where options.validate() does.
  Shadowing(const ShadowingOptions& options, RandomStream states, RandomStream levels);

  /// Level [dB], to be added to the direct signal's; mostly below 0. @param way_m driven since some origin,
  /// not less than at the last call; @param elevation_rad of the satellite
  [[nodiscard]] double level_db(double way_m, double elevation_rad);
  /// At the last call's way.
  [[nodiscard]] bool shadowed() const { return shadowed_; }

 private:
  void start(double way_m, const ShadowingParameters& parameters);
  /// Frames left after the one in hand, of a state that ends after each frame with probability `change`.
  [[nodiscard]] double more_frames(double change);

  ShadowingOptions options_;
  RandomStream states_, levels_;
  bool started_ = false;
  bool shadowed_ = false;
  double way_m_ = 0;
  double changed_at_m_ = 0;  // where the state began
  double changes_at_m_ = 0;  // where it will end
  double normal_ = 0;        // of unit variance
};

}  // namespace canyon::disturbance
