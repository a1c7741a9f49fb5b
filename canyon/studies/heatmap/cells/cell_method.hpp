#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "canyon/run/scenario/scenario.hpp"
#include "canyon/studies/heatmap/cells/cell_solver.hpp"
#include "canyon/studies/heatmap/cells/moving_fixes.hpp"

namespace canyon::heatmap {

/// How the cells of a map are computed, fastest first.
enum class CellMethod : std::uint8_t {
  Shared,  ///< geometry alone: cells that receive the same satellites share one fix
  Steady,  ///< the state of loops and fix at rest, without the time until they rest
  Run,     ///< a receiver::Receiver runs in each cell
};

/// The fastest method that computes the fix of this receiver.
[[nodiscard]] CellMethod cell_method(const simulation::ReceiverConfig& receiver);

/// The receiver of a map and how its cells are computed.
struct CellReceiver {
  const simulation::ReceiverConfig& config;
  const simulation::ReceiverConfig* base = nullptr;  ///< at a fixed place, settled, for layers of RTK
  DrawOptions draws;
  CellReceiverOptions how;
  LimitOptions limits;
  std::optional<Movement> movement;  ///< of Steady
};
/// Solvers that give the layers together, but for SkyView. The environment and the tracer must outlive them.
/// Throws InputError for options that do not validate().
[[nodiscard]] std::vector<std::unique_ptr<const CellSolver>> cell_solvers(
    const simulation::Environment& environment, const TileTracer& tracer, const CellReceiver& receiver,
    std::span<const Layer> layers);

}  // namespace canyon::heatmap
