#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "canyon/simulation/scenario.hpp"

namespace canyon::heatmap {

/// How a map finds a receiver's fixes in its cells, cheapest first.
enum class CellMethod : std::uint8_t {
  Shared,  ///< CellSolver: cells that receive the same satellites share one solution; signals without
           ///< strength
  Steady,  ///< SteadyReceivers: the steady state of loops and fix
  Run,     ///< CellReceivers: a receiver runs in each cell; fits every receiver
};

/// Whether a method gives the fixes of this receiver: it follows each option that differs from its default,
/// or the option changes no fix of a receiver that stands in a cell and has no epoch before.
[[nodiscard]] bool fits(CellMethod method, const simulation::ReceiverConfig& receiver);

/// Fields of receiver::ReceiverOptions, by path, of which cell_method.cpp does not say what the method makes
/// of them, or says it twice. A new option is among them until it is listed, and a receiver that sets it runs
/// until then.
[[nodiscard]] std::vector<std::string> unlisted_fields(CellMethod method);

}  // namespace canyon::heatmap
