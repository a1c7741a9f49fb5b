#pragma once

#include <string>

#include "canyon/drawing/canvas.hpp"
#include "canyon/drawing/palette.hpp"
#include "canyon/drawing/plot.hpp"
#include "canyon/validation/report/report.hpp"

// The pictures of write_report(), one function each: of epochs [first, first + count) of its comparison,
// unless said otherwise. Where there is nothing to draw, the picture says so. The same bytes for the same
// input.

namespace canyon::validation {

/// Measured is a blue disc or a full line, simulated a vermilion triangle or a dashed line, in all of them.
inline constexpr drawing::Colour kMeasured = drawing::kBlue, kSimulated = drawing::kVermilion;

/// Scenario, model and part: the line below each title.
[[nodiscard]] std::string report_subtitle(const ReportInput& input);

/// Two maps of one extent: measured and simulated fixes, each joined to its true place.
[[nodiscard]] drawing::Picture draw_report_track(const ReportInput& input);
/// Horizontal error and satellites used over the whole recording, the part of the figures on white.
[[nodiscard]] drawing::Picture draw_report_errors(const ReportInput& input);
/// Cumulative distributions of LOS and NLOS pseudorange errors and of horizontal errors.
[[nodiscard]] drawing::Picture draw_report_error_cdf(const ReportInput& input);
/// Measured pseudorange error of NLOS satellites over the predicted code delay, by kind of path.
[[nodiscard]] drawing::Picture draw_report_prediction(const ReportInput& input);
/// Medians and quartiles of C/N0 in bins of 5 degrees of elevation.
[[nodiscard]] drawing::Picture draw_report_cn0(const ReportInput& input);
/// Satellites of richest_epoch() by measured C/N0 over the city's mask.
[[nodiscard]] drawing::Picture draw_report_sky(const ReportInput& input);

}  // namespace canyon::validation
