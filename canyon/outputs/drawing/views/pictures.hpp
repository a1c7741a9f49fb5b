#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <memory>

#include "canyon/outputs/drawing/canvas.hpp"
#include "canyon/run/samples/correlation_record.hpp"
#include "canyon/run/simulator.hpp"

namespace canyon::drawing {

/// Pictures of a run, drawn with Cairo, readable by colour-blind people. Part of canyon::io.
/// `track.png`/`track.svg`: the city from above (buildings shaded by height), true track, fixes coloured by
/// horizontal error with colour bar, places without fix, scale bar, north arrow.
/// `skyplot.png`/`.svg`: satellites at the run's middle epoch, tracks over the run, coloured and shaped by
/// visibility, with the building silhouette (sky mask) at that place. `timeline.png`/`.svg`: horizontal
/// error, satellites (used, tracked, not tracked), HDOP and, where signals have strength, C/N0 over time.
///
/// Epochs of other receivers are passed over. The files appear together at finish(), none where there was no
/// epoch. Throws InputError where `folder` is missing or cannot be written to (found here, before the run).
/// `simulation` must outlive the sink. `receiver` is an index into its scenario's receivers.
/// @param stop nothing is drawn where it is set at finish(): drawing takes about a second
[[nodiscard]] std::unique_ptr<simulation::EpochSink> make_pictures(const simulation::Simulation& simulation,
                                                                   const std::filesystem::path& folder,
                                                                   std::size_t receiver,
                                                                   const std::atomic<bool>* stop = nullptr);

/// Two panels: the magnitude of the correlation over time and delay, with the measured detour as a line; and
/// the instant with the largest measured detour (without any, the middle): the sum, and each path by itself.
/// @param shape that the series was made with. A series without an instant gives a notice.
[[nodiscard]] Picture draw_correlation(const samples::CorrelationSeries& series,
                                       const tracking::Correlation& shape);

}  // namespace canyon::drawing
