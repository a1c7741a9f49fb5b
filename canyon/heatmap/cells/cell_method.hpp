#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "canyon/heatmap/cells/cell_solver.hpp"
#include "canyon/heatmap/cells/moving_fixes.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::heatmap {

/// The parts of a receiver that the cells of a map leave out, most first.
enum class CellMethod : std::uint8_t {
  Shared,  ///< strength of signals and loops: cells that receive the same satellites share one fix
  Steady,  ///< the time until loops and fix rest
  Run,     ///< nothing
};

/// The most that a receiver's cells can leave out. The receiver's options answer by options::Effect: a field
/// that has not its default and does not say that cells follow it makes the receiver run.
[[nodiscard]] CellMethod cell_method(const simulation::ReceiverConfig& receiver);

/// Paths of the fields of receivers that say no options::Effect.
[[nodiscard]] std::vector<std::string> unsaid_fields();

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
