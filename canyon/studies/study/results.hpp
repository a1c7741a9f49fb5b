#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "canyon/studies/study/run_store.hpp"

// Results of a finished study: one NetCDF file, a table, pictures. The same records give the same bytes,
// in whatever order they were computed.

namespace canyon::study {

/// Writes `path`: dimensions run and receiver, the axes as coordinates of runs, the figures over both; errors
/// counted by error_bin, epochs and available ones by hour; with epochs kept a dimension epoch, NaN behind
/// the end of shorter runs. CF-1.10; text coordinates are UTF-8 characters, which xarray reads as strings.
/// Every run is there. Throws OutputError as OutputFile does. @param folder of the store, for epochs
void write_study_netcdf(const std::filesystem::path& path, const Manifest& manifest,
                        std::vector<std::optional<RunRecord>>& records, const std::filesystem::path& folder);

/// A mean with its interval.
struct Estimate {
  double mean = 0, low = 0, high = 0;
};
/// A figure whose means are compared.
struct Compared {
  std::string name, unit;
  double scale;                      ///< from of() to the unit
  std::optional<std::size_t> place;  ///< in figures(); empty: the share of available epochs

  /// Empty where the record has no value.
  [[nodiscard]] std::optional<double> of(const ReceiverRecord& record) const;
};
[[nodiscard]] const std::vector<Compared>& compared_figures();

/// The runs of one setting: one value on each axis that groups, one receiver.
struct Group {
  std::vector<std::string> at;  ///< labels on the axes that group
  std::string receiver;
  std::size_t runs = 0;
  /// By compared_figures(): over the group's runs; and minus the first group, over the noise realizations
  /// that both have.
  std::vector<std::optional<Estimate>> estimates, differences;
  std::vector<const ReceiverRecord*> records;  ///< by noise realization, null where it has none
};

struct Comparison {
  std::vector<std::string> axes;  ///< that group
  std::vector<Group> groups;
};

/// Means of runs' figures for every group, with percentile bootstrap intervals (Efron and Tibshirani, An
/// Introduction to the Bootstrap, 1993, chapter 13) over noise realizations: these are drawn with
/// replacement, the same ones for all groups, so that differences are of pairs. Runs that failed and figures
/// that a run does not have are left out of means.
[[nodiscard]] Comparison compare(const Manifest& manifest,
                                 const std::vector<std::optional<RunRecord>>& records);
/// Long form: a line for each group and figure.
[[nodiscard]] std::string comparison_csv(const Comparison& comparison);
/// A table for terminals of the figures that matter most.
[[nodiscard]] std::string comparison_text(const Manifest& manifest, const Comparison& comparison);

/// A stretch of the way that all runs of a group go.
struct Stretch {
  double from_m = 0, to_m = 0;
  std::size_t epochs = 0;  ///< of all runs
  double available = 0;    ///< share of these with a fix
  /// Horizontal errors of all its epochs with a fix [m], with intervals over noise realizations.
  std::optional<Estimate> median, p95;
};
/// Errors along the way, in stretches of Manifest::along_m, one list for each group; reads the runs' epochs
/// one after the other. Quantiles are of all runs' epochs together; intervals as in compare(), whole runs
/// being drawn with replacement, since errors of one drive are correlated. Beyond 10,000 stretches:
/// InputError.
[[nodiscard]] std::vector<std::vector<Stretch>> errors_along(const Manifest& manifest,
                                                             const Comparison& comparison,
                                                             std::vector<std::optional<RunRecord>>& records,
                                                             const std::filesystem::path& folder);
/// A line for each group and stretch.
[[nodiscard]] std::string along_csv(const Comparison& comparison,
                                    const std::vector<std::vector<Stretch>>& along);
/// Writes along.png and along.svg: median and 95 % over the way with their intervals; returns their names.
std::vector<std::string> write_along_pictures(const std::filesystem::path& folder, const Manifest& manifest,
                                              const Comparison& comparison,
                                              const std::vector<std::vector<Stretch>>& along);

/// Writes errors, boxes and availability as PNG and SVG; returns their names.
std::vector<std::string> write_study_pictures(const std::filesystem::path& folder, const Manifest& manifest,
                                              const Comparison& comparison);

/// Noise realizations drawn with replacement: places in Group::records.
using Resamples = std::vector<std::vector<std::uint32_t>>;
/// Manifest::bootstrap of them, fewer for many occasions, none for one; the same for equal manifests.
[[nodiscard]] Resamples occasion_resamples(const Manifest& manifest, std::size_t occasions);

/// A field of a CSV line, in quotes where it needs them.
[[nodiscard]] std::string csv_text(const std::string& text);
/// Mean, low and high as three fields of a CSV line; a field without a value is empty.
[[nodiscard]] std::string csv_interval(const std::optional<Estimate>& estimate);

}  // namespace canyon::study
