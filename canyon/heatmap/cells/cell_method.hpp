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

/// Paths of the fields of receiver::ReceiverOptions that cell_method.cpp does not list for the method, or
/// lists twice. A new option is among them until it is listed; until then a receiver that sets it runs.
[[nodiscard]] std::vector<std::string> unlisted_fields(CellMethod method);

}  // namespace canyon::heatmap
