#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "canyon/disturbance/sky_nodes.hpp"

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
  std::vector<double> numbers_;
};

}  // namespace canyon::disturbance
