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

/// Two states, on and off, along frames of a route and over the sky. Each direction has a Markov chain with
/// one step per frame; nearby directions are correlated.
///
/// Each frame has one realization of SkyNodes. Its number z at a direction gives u = P(normal < z). The state
/// changes from off to on if u < enter, and stays on if u < 1 - leave. Steps at one direction are
/// independent, so the durations of states are geometric numbers of frames. If u is below both bounds or
/// above both, the state does not depend on the previous one: searching back to such a frame finds the
/// stationary chain's state without a memory (coupling from the past: Propp & Wilson, Random Struct.
/// Algorithms 9, 1996).
class FrameStates {
 public:
  struct Steps {
    double enter = 0;  ///< probability of on in the frame after off, [0, 1]
    double leave = 1;  ///< probability of off in the frame after on, (0, 1]
  };
  struct States {
    bool now = false, before = false;  ///< in the frame, and in the previous one
  };

  FrameStates(const SkyNodes& nodes, std::uint64_t seed, std::string_view key);

  /// @param frame any number; @param weights of the direction. A chain with a memory of more than 4,096
  /// frames is restarted at that distance with a new sample.
  [[nodiscard]] States at(std::int64_t frame, std::span<const SkyNodes::NodeWeight> weights, Steps steps);

 private:
  [[nodiscard]] bool state(std::int64_t frame, std::span<const SkyNodes::NodeWeight> weights, Steps steps);
  /// P(normal < z) of a direction's number in a frame.
  [[nodiscard]] double uniform(std::int64_t frame, std::span<const SkyNodes::NodeWeight> weights);

  std::size_t size_;  // of a realization
  std::uint64_t root_;
  /// Realizations of the latest frames, in the slots of their numbers.
  std::vector<std::int64_t> frames_;
  std::vector<std::int8_t> quarters_;  ///< coins() are multiples of 1/4
};

/// Level of direct signals over the sky, along the route of one antenna. Each direction has semi-Markov
/// states whose lengths are geometric numbers of frames, and in them a Gauss-Markov process over travelled
/// distance in its exact discrete form. Nearby directions are correlated (SkyNodes, which has the correlation
/// of levels and of the numbers that drive the states). Stationary from the first value on.
///
/// Equal seed and key give equal shadows in each direction, for any set and order of requested satellites.
/// States at a travelled distance do not depend on earlier steps, nor do the statistics of levels.
class Shadowing {
 public:
  struct Shadow {
    double level_db = 0;  ///< added to the direct signal's level; mostly below 0
    bool shadowed = false;
  };

  /// @param key names its random streams
  /// Throws InputError if options.validate() does.
  Shadowing(const ShadowingOptions& options, std::uint64_t seed, const std::string& key);

  /// @param travelled_m distance since some origin, not less than at the last call
  /// @param height_m of the antenna above the ground
  void go_to(double travelled_m, double height_m = SkylineOptions::kBase_m);
  /// Shadow on a satellite at the last go_to(). @param direction unit, ENU, not below the horizon
  [[nodiscard]] Shadow of(const Eigen::Vector3d& direction);

 private:
  /// Travelled distance in a direction's frames. Each direction has an origin, as shadows come from a
  /// distance.
  struct SkyCell {
    std::int64_t frame;
    double into_m;
  };
  [[nodiscard]] SkyCell locate(const Eigen::Vector3d& direction) const;
  /// Progress of a state: 0 off, 1 on, between them during the transition.
  [[nodiscard]] double passed(FrameStates::States states, double into_m) const;
  [[nodiscard]] ShadowingParameters parameters(double elevation_rad) const;

  ShadowingOptions options_;
  SkyNodes nodes_;
  FrameStates shadows_;
  RandomStream levels_stream_;
  std::vector<double> levels_;  // of the nodes, unit variance
  Eigen::Vector3d axis_;        // axis along which shadows move with the satellites
  double origin_m_ = 0;         // of frames
  double travelled_m_ = 0;
  double fraction_above_ = 1;  // of obstacles, SkylineOptions::fraction_above()
  std::vector<SkyNodes::NodeWeight> weights_;
};

/// Obstacles that the map lacks, at one antenna: shadows on every satellite's direct path (Shadowing), and
/// obstacles on all of its paths (Skyline). Antennas with equal seed, name and route get equal shadows; all
/// antennas with equal seed get the same skyline.
class DirectShadowing : public Disturbance {
 public:
  /// Throws InputError if options.validate() does.
  DirectShadowing(const ShadowingOptions& options, std::uint64_t seed, const std::string& receiver);

  void apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) override;

 private:
  Shadowing shadowing_;
  Skyline skyline_;
  std::optional<propagation::Antenna> before_;
  double travelled_m_ = 0;
};

}  // namespace canyon::disturbance
