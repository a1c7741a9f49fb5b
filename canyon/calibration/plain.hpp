#pragma once

#include <cstdint>
#include <set>
#include <span>
#include <vector>

#include "canyon/calibration/calibrate.hpp"
#include "canyon/calibration/observed.hpp"

// Parameters estimated from a recording alone, without a simulated receiver. Private to canyon/calibration.

namespace canyon::calibration {

/// Adds `tracks` and `leaves_out`: signals that are recorded, and systems, orbits and blocks that never are
/// although their satellites stand high in clear view. @param skies systems of each recording's sky
void add_tracked(std::span<const Observed> recorded, std::span<const std::set<gnss::System>> skies,
                 const simulation::ReceiverConfig& receiver, Calibration& result);

/// Adds `signal.cn0_step_db`: the coarsest step that the stated C/N0 are multiples of.
void add_step(std::span<const Observed> recorded, const simulation::ReceiverConfig& receiver,
              Calibration& result);

/// Adds `signal.phase_threshold_dbhz`: the C/N0 that parts clear signals with a phase from those without.
void add_phase_threshold(std::span<const Observed> recorded, const simulation::ReceiverConfig& receiver,
                         std::span<const std::vector<std::uint16_t>> draws, Calibration& result);

/// Adds `signal.lock.tracking_threshold_dbhz` and `signal.lock.acquisition_threshold_dbhz`: the weakest
/// signals of hidden satellites that are measured, and the weakest that are found again behind gaps.
void add_lock_thresholds(std::span<const Observed> recorded, const simulation::ReceiverConfig& receiver,
                         std::span<const std::vector<std::uint16_t>> draws, Calibration& result);

}  // namespace canyon::calibration
