#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <memory>

#include "canyon/simulation/simulator.hpp"

namespace canyon::drawing {

/// Pictures of a run, drawn with Cairo, readable by colour-blind people. Part of canyon::io.
/// `track.png`/`track.svg`: the city from above (buildings shaded by height), true track, fixes coloured by
/// horizontal error with colour bar, positions without fix, scale bar, north arrow.
/// `skyplot.png`/`.svg`: satellites at the run's middle epoch, tracks over the run, coloured and shaped by
/// visibility, with the building silhouette (sky mask) at that position. `timeline.png`/`.svg`: horizontal
/// error, satellites (used, tracked, not tracked), HDOP and, if signals have strength, C/N0 over time.
///
/// Epochs of other receivers are ignored. finish() writes all files together, none without an epoch.
/// Throws InputError if `folder` is missing or cannot be written to (found here, before the run).
/// `simulation` must outlive the sink. `receiver` is an index into its scenario's receivers.
/// @param stop if set at finish(), nothing is drawn: drawing takes about a second
[[nodiscard]] std::unique_ptr<simulation::EpochSink> make_pictures(const simulation::Simulation& simulation,
                                                                   const std::filesystem::path& folder,
                                                                   std::size_t receiver,
                                                                   const std::atomic<bool>* stop = nullptr);

}  // namespace canyon::drawing
