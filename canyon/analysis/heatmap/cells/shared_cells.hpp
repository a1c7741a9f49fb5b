#pragma once

#include <map>
#include <memory>

#include "canyon/analysis/heatmap/cells/cell_solver.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/range_errors.hpp"

namespace canyon::heatmap {

/// A receiver whose signals have no strength, in the cells of a map.
struct SharedReceiver {
  receiver::ReceiverOptions options;  ///< for which cell_method() is Shared
  MonteCarloOptions samples;
  std::map<gnss::System, gnss::Klobuchar> klobuchar;
  LimitOptions limits;
  std::shared_ptr<const sky::RangeErrorModel> space = nullptr;  ///< null: none
};

/// Layers of a tile from its signals. Cells that receive the same satellites have one common solution
/// (CellFix). Errors of pseudoranges are excess, the receiver's delays, the noise's mean, and the atmosphere
/// in the signal minus the corrections of the fix, at the tile's centre. Noise is sampled from the stationary
/// distribution of each satellite's process, drifting mean included (the cell's receiver is at rest), by a
/// separate stream for each satellite and time; range errors of a realization are those of its seed_of(), at
/// the centre.
///
/// @param signals of at most 128 satellites, else InputError. Without excess LargestExcess is NaN, and DOPs,
/// counts and availability are those of a receiver without reflections.
void solve_shared(const SharedReceiver& receiver, const TileCells& cells, geodesy::GpsTime time,
                  const TileSignals& signals, std::span<const Layer> wanted,
                  std::span<const std::span<float>> layers);

}  // namespace canyon::heatmap
