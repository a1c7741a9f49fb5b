#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "canyon/studies/study/run_store.hpp"

namespace canyon::study {

/// Writes `path`: dimensions run and receiver, the axes as coordinates of runs, the figures over both; errors
/// counted by error_bin, epochs and available ones by hour; with epochs kept a dimension epoch, NaN behind
/// the end of shorter runs. CF-1.10; text coordinates are UTF-8 characters, which xarray reads as strings.
/// Every run is there. Throws OutputError as OutputFile does. @param folder of the store, for epochs
void write_study_netcdf(const std::filesystem::path& path, const Manifest& manifest,
                        std::vector<std::optional<RunRecord>>& records, const std::filesystem::path& folder);

}  // namespace canyon::study
