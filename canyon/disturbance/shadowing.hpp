#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "canyon/base/random.hpp"
#include "canyon/disturbance/frame_states.hpp"
#include "canyon/disturbance/shadowing_options.hpp"
#include "canyon/disturbance/sky_nodes.hpp"

namespace canyon::disturbance {

/// Level of direct signals over the sky, along the way of one antenna: in each direction semi-Markov states
/// whose lengths are geometric numbers of frames, and in them a Gauss-Markov process of the way in its exact
/// discrete form, both alike in directions close to each other (SkyNodes, which has the correlation of levels
/// and of the numbers that drive the states). Stationary from the first value on.
///
/// Same seed and key, same shadows in each direction, whatever satellites are asked for and in what order.
/// States at a place do not depend on the steps that led there, nor do the statistics of levels.
class Shadowing {
 public:
  struct Shadow {
    double level_db = 0;  ///< to be added to the direct signal's; mostly below 0
    bool shadowed = false;
  };

  /// @param key names its random streams
  /// Throws InputError where options.validate() does.
  Shadowing(const ShadowingOptions& options, std::uint64_t seed, const std::string& key);

  /// @param way_m driven since some origin, not less than at the last call
  /// @param height_m of the antenna above the ground
  void go_to(double way_m, double height_m = SkylineNumbers::kBase_m);
  /// Shadow on a satellite at the last go_to(). @param direction unit, ENU, not below the horizon
  [[nodiscard]] Shadow of(const Eigen::Vector3d& direction);

 private:
  /// Way in a direction's frames. Each direction has its own origin, as shadows fall from some distance.
  struct Place {
    std::int64_t frame;
    double into_m;
  };
  [[nodiscard]] Place place(const Eigen::Vector3d& direction) const;
  /// How far a state has come about: 0 off, 1 on, between them over the transition.
  [[nodiscard]] double passed(FrameStates::States states, double into_m) const;
  [[nodiscard]] ShadowingParameters parameters(double elevation_rad) const;

  ShadowingOptions options_;
  SkyNodes nodes_;
  FrameStates shadows_;
  RandomStream levels_stream_;
  std::vector<double> levels_;  // of the nodes, unit variance
  Eigen::Vector3d axis_;        // along which shadows move as satellites do
  double origin_m_ = 0;         // of frames
  double way_m_ = 0;
  double share_above_ = 1;  // of obstacles, SkylineNumbers::share_above()
  std::vector<SkyNodes::Share> shares_;
};

}  // namespace canyon::disturbance
