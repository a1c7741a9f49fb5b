#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <memory>

#include "canyon/outputs/drawing/canvas.hpp"
#include "canyon/simulation/samples/correlation_record.hpp"
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

/// Two panels: the magnitude of the correlation over time and delay, with the measured excess path as a line;
/// and the sum and each path alone at the instant of the largest measured excess path (if none, the middle).
/// @param shape used to compute the series. For a series without an instant the picture has only a notice.
[[nodiscard]] Picture draw_correlation(const samples::CorrelationSeries& series,
                                       const tracking::Correlation& shape);

}  // namespace canyon::drawing
