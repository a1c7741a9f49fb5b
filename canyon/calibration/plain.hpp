#pragma once

#include <cstdint>
#include <set>
#include <span>
#include <vector>

#include "canyon/calibration/estimate.hpp"
#include "canyon/calibration/levels.hpp"

// Parameters estimated from a recording alone, without a simulated receiver. Private to canyon/calibration.

namespace canyon::calibration {

/// Adds `tracks` and `leaves_out`: signals that are recorded, and systems, orbits and blocks that never are
/// although their satellites stand high in clear view. @param skies systems of each recording's sky
void add_tracked(std::span<const LevelEvidence> evidence, std::span<const std::set<gnss::System>> skies,
                 const simulation::ReceiverConfig& receiver, Levels& levels);

/// Adds `signal.cn0_step_db`: the coarsest step that the stated C/N0 are multiples of. Returns it.
double add_step(std::span<const LevelEvidence> evidence, const simulation::ReceiverConfig& receiver,
                Levels& levels);

/// Adds `signal.phase_threshold_dbhz`: the C/N0 that parts clear signals with a phase from those without.
void add_phase_threshold(std::span<const LevelEvidence> evidence, const simulation::ReceiverConfig& receiver,
                         std::span<const std::vector<std::uint16_t>> draws, Levels& levels);

}  // namespace canyon::calibration
