#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "canyon/analysis/study/run_store.hpp"

namespace canyon::study {

/// Writes `path`: dimensions run and receiver, the axes as coordinates of runs, the metrics over both; errors
/// counted by error_bin, epochs and available ones by hour; with stored epochs a dimension epoch, NaN after
/// the end of shorter runs. CF-1.10; text coordinates are UTF-8 characters, which xarray reads as strings.
/// All runs must be finished. Throws OutputError as OutputFile. @param folder of the store
void write_study_netcdf(const std::filesystem::path& path, const Manifest& manifest,
                        std::vector<std::optional<RunRecord>>& records, const std::filesystem::path& folder);

}  // namespace canyon::study
