#pragma once

#include <map>
#include <string>
#include <vector>

#include "canyon/analysis/bench/score.hpp"

namespace canyon::bench {

[[nodiscard]] std::vector<std::string> result_head();
[[nodiscard]] std::vector<std::string> result_cells(const Result& result);

/// A page with the table and, for each drive, its track, errors over time with events as bands, and true over
/// reported errors; one file of HTML. @param tracks by drive and estimate
[[nodiscard]] std::string page(const std::vector<Result>& results, const std::vector<DriveFolder>& drives,
                               const std::map<std::string, std::map<std::string, Track>>& tracks);

}  // namespace canyon::bench
