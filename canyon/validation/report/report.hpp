#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "canyon/validation/alignment.hpp"
#include "canyon/validation/figures.hpp"
#include "canyon/validation/recording_table.hpp"

namespace canyon::validation {

/// The contents of a report. There is at least one model, and the comparison has epochs [first, first +
/// count) (asserted); everything may be empty otherwise, and the report then says so.
struct ReportInput {
  std::string title;                                     ///< the scenario's name
  const city::City* city = nullptr;                      ///< not null
  const simulation::Environment* environment = nullptr;  ///< not null: rays for the mask of the sky plot
  const Comparison* comparison = nullptr;  ///< not null: the scenario's own model, whole recording
  std::size_t first = 0, count = 0;        ///< epochs that the figures are of
  std::vector<Figures> models;             ///< the first is `comparison`'s
  std::optional<Alignment> alignment;
  std::vector<std::string> notes;  ///< warnings, versions, files: one line each
};

/// Writes report.html (self-contained: pictures inside, nothing loaded from elsewhere) and its pictures as
/// PNG and SVG files beside it: `track` (measured and simulated fixes over the city), `errors` (horizontal
/// error along the drive), `error_cdf` (LOS and NLOS pseudorange errors, horizontal error), `prediction`
/// (measured NLOS error against predicted delay by path kind), `cn0` (C/N0 by elevation, LOS and NLOS,
/// measured and simulated), `sky` (one epoch's satellites by measured C/N0 over the city's mask). The page
/// is well-formed XML as well, and compares the figures with the goals of targets() (headlines.hpp). All
/// files appear together, whole, or none; the same bytes for the same input. Throws InputError where `folder`
/// cannot be written to. Part of canyon::io.
void write_report(const std::filesystem::path& folder, const ReportInput& input);

/// Writes report.html: the rows beside each other, each with a link to its own report (RecordingRow::report,
/// from `folder`). The rest as write_report().
void write_overview(const std::filesystem::path& folder, const std::string& title,
                    const std::vector<RecordingRow>& rows, const std::vector<std::string>& notes);

}  // namespace canyon::validation
