#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "canyon/heatmap/engine/engine.hpp"
#include "canyon/heatmap/engine/map_source.hpp"

namespace canyon::heatmap {

/// MapSource::slice of a map whose tiles stand in a store: empty for units that it does not have. Keeps the
/// units read last, as many as fit in 256 MiB and at least one, since writers that go time by time meet the
/// same units again and again. Both must outlive it. Not thread-safe. Throws as TileStore::load()
/// does.
[[nodiscard]] std::function<std::optional<MapSource::Slice>(std::size_t, std::size_t)> store_slices(
    const Heatmap& heatmap, const TileStore& store);

/// The statistic over several maps, cell by cell: the value that this share of the runs [0, 1] reach or are
/// better than, which is that quantile, or one less it of layers where more is better, of a further run
/// (predictive_quantile()). Empty: the mean.
using OverRuns = std::optional<double>;
/// MapSource::slice over maps of one request that differ in their seed, each a slice of its own: over the
/// runs that have a value there; states are the first run's that computed the cell, else the first's. Empty
/// where any of them is. Memory: a slice of each run.
[[nodiscard]] std::function<std::optional<MapSource::Slice>(std::size_t, std::size_t)> slices_over_runs(
    std::vector<std::function<std::optional<MapSource::Slice>(std::size_t, std::size_t)>> runs,
    std::vector<Layer> layers, OverRuns what);

/// The whole map as writers see it: store_slices(), and a description of it. The caller sets `history`.
/// `scenario` is the one that `environment` was made of, for the names of what was computed. All must outlive
/// it. Not thread-safe.
[[nodiscard]] MapSource map_source(const Heatmap& heatmap, const TileStore& store,
                                   const simulation::Environment& environment,
                                   const simulation::ReceiverConfig& receiver,
                                   const simulation::Scenario& scenario);

}  // namespace canyon::heatmap
