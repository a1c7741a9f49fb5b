#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/random.hpp"
#include "canyon/paths/disturbance/disturbance.hpp"
#include "canyon/paths/disturbance/shadowing_options.hpp"
#include "canyon/paths/disturbance/skyline.hpp"

namespace canyon::disturbance {

/// Two states, on and off, along frames of a way and over the sky: in each direction a Markov chain with one
/// step a frame, and alike in directions close to each other.
///
/// Each frame has a draw of SkyNodes. Its number z at a direction, u = P(normal < z), turns the state on
/// where it was off and u < enter, and leaves it on where u < 1 - leave. Steps at one direction are
/// independent, so that states last geometric numbers of frames. Where u is below or above both bounds the
/// state does not depend on the one before: going back to such a frame finds the stationary chain's state
/// without a memory (coupling from the past: Propp & Wilson, Random Struct. Algorithms 9, 1996).
class FrameStates {
 public:
  struct Steps {
    double enter = 0;  ///< probability that on follows a frame of off, [0, 1]
    double leave = 1;  ///< probability that off follows a frame of on, (0, 1]
  };
  struct States {
    bool now = false, before = false;  ///< in the frame, and in the one before it
  };

  FrameStates(const SkyNodes& nodes, std::uint64_t seed, std::string_view key);

  /// @param frame any number; @param shares of the direction. Chains that forget in more than 4,096 frames
  /// are taken as drawn anew that far back.
  [[nodiscard]] States at(std::int64_t frame, std::span<const SkyNodes::Share> shares, Steps steps);

 private:
  [[nodiscard]] bool state(std::int64_t frame, std::span<const SkyNodes::Share> shares, Steps steps);
  /// P(normal < z) of a direction's number in a frame.
  [[nodiscard]] double uniform(std::int64_t frame, std::span<const SkyNodes::Share> shares);

  std::size_t size_;  // of a draw
  std::uint64_t root_;
  /// Draws of the latest frames, in the slots of their numbers.
  std::vector<std::int64_t> frames_;
  std::vector<std::int8_t> quarters_;  ///< coins() are multiples of 1/4
};

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
  void go_to(double way_m, double height_m = SkylineOptions::kBase_m);
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
  double share_above_ = 1;  // of obstacles, SkylineOptions::share_above()
  std::vector<SkyNodes::Share> shares_;
};

/// What the map lacks, at one antenna: shadows on every satellite's direct path (Shadowing), and obstacles on
/// all of its paths (Skyline). Antennas of one seed and name that drive the same way meet the same shadows;
/// all of one seed meet the same skyline.
class DirectShadowing : public Disturbance {
 public:
  /// Throws InputError where options.validate() does.
  DirectShadowing(const ShadowingOptions& options, std::uint64_t seed, const std::string& receiver);

  void apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) override;

 private:
  Shadowing shadowing_;
  Skyline skyline_;
  std::optional<propagation::Antenna> before_;
  double way_m_ = 0;
};

}  // namespace canyon::disturbance
