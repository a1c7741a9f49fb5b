#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "canyon/calibration/estimate.hpp"
#include "canyon/calibration/observed.hpp"
#include "canyon/calibration/shadow_chain.hpp"

// Levels of C/N0 and shadows, from satellites in line of sight. Private to canyon/calibration.

namespace canyon::calibration {

/// A recording beside a receiver that tracks whatever arrives and draws nothing: what the profile's antenna
/// and link budget say of the same satellites at the same places.
struct LevelEvidence {
  std::string name;        ///< of the recording
  Observed recorded;       ///< its series are those of `direct` and `all`, one by one
  Observed direct;         ///< of the direct path alone
  Observed all;            ///< of all paths
  double speed_mps = 0.1;  ///< ShadowingOptions::obstacle_speed_mps
};

struct Levels {
  std::vector<Estimate> estimates;
  std::vector<std::string> notes;
  Values values;  ///< keys that are set
};
/// Level of systems, blocks and further signals, the spread between satellites, and shadowing; `receiver` is
/// what the evidence was simulated with. @param draws blocks of epochs, of all recordings one behind the
/// other
[[nodiscard]] Levels estimate_levels(std::span<const LevelEvidence> evidence,
                                     const simulation::ReceiverConfig& receiver,
                                     std::span<const std::vector<std::uint16_t>> draws);

}  // namespace canyon::calibration
