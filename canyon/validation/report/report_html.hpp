#pragma once

#include <string>
#include <vector>

#include "canyon/base/base64.hpp"
#include "canyon/validation/report/report.hpp"

namespace canyon::validation {

/// A picture of the report with its words.
struct ReportFigure {
  std::string name;  ///< of its files, without ending
  std::string png;   ///< bytes
  std::string alt;   ///< what it shows, for those who do not see it
  std::string caption;
};

/// The report as one HTML page that is well-formed XML too, its pictures as data: URIs; loads nothing.
[[nodiscard]] std::string report_html(const ReportInput& input, const std::vector<ReportFigure>& figures);

/// The page of several recordings beside each other, likewise. @param lines below it
[[nodiscard]] std::string overview_html(const std::string& title, const std::vector<RecordingRow>& rows,
                                        const std::vector<std::string>& lines);

}  // namespace canyon::validation
