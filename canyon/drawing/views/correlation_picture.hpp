#pragma once

#include "canyon/drawing/canvas.hpp"
#include "canyon/samples/correlation_record.hpp"

namespace canyon::drawing {

/// Two panels: the magnitude of the correlation over time and delay, with the measured detour as a line; and
/// the instant with the largest measured detour (without any, the middle): the sum, and each path by itself.
/// @param shape that the series was made with. A series without an instant gives a notice.
[[nodiscard]] Picture draw_correlation(const samples::CorrelationSeries& series,
                                       const tracking::Correlation& shape);

}  // namespace canyon::drawing
