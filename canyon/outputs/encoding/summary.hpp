#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "canyon/simulation/simulator.hpp"

namespace canyon::encoding {

/// Metrics of a run. Percentiles interpolate linearly between order statistics (rank p (n - 1) from 0, as in
/// NumPy); vertical errors are absolute. A metric without data (errors without a fix, means without an epoch,
/// fractions without a satellite) is NaN.
struct RunSummary {
  std::string receiver;
  std::size_t epochs = 0;
  std::size_t fixes = 0;
  std::size_t by_fixed = 0, by_float = 0, by_differential = 0;  ///< epochs with a fix of that kind
  std::size_t wrong_fixes = 0;                                  ///< of the fixed epochs (wrong_fix())
  double fixed_p95_m = 0;    ///< horizontal error of fixed epochs; NaN: none
  double first_fixed_s = 0;  ///< from the first epoch to the first fixed one; NaN: none
  double horizontal_p50_m = 0, horizontal_p95_m = 0, horizontal_max_m = 0;  ///< NaN without fix
  double vertical_p50_m = 0, vertical_p95_m = 0;
  double mean_visible = 0, mean_blocked = 0,
         mean_used = 0;  ///< per epoch, including epochs without a fix (0 used)
  double los_fraction = 0, los_multipath_fraction = 0, nlos_fraction = 0,
         blocked_fraction = 0;  ///< of satellites above mask
  double median_hdop = 0;
  /// C/N0 of measurements above the mask, as reported; NaN without signal strength. LOS includes multipath.
  double mean_cn0_los_dbhz = 0, mean_cn0_nlos_dbhz = 0;
  std::size_t exclusions = 0;   ///< of satellites from fixes, by RAIM or the position filter, over all epochs
  std::size_t raim_tested = 0;  ///< epochs with a result of RAIM
  std::size_t inconsistent = 0;  ///< of those, epochs at which RAIM's test failed after exclusions
  /// Time from the first epoch without fix to the next fix; if none, to one interval after the last.
  double longest_outage_s = 0;
  /// The epochs during which a fault was active. Faults are in order of their beginning.
  struct Fault {
    std::string name;
    std::size_t epochs = 0, fixes = 0;
    double horizontal_p95_m = 0;  ///< NaN without fix
  };
  std::vector<Fault> faults;
};

/// Collects RunSummary of every receiver.
class SummarySink final : public simulation::EpochSink {
 public:
  explicit SummarySink(std::vector<std::string> receiver_names);
  ~SummarySink() override;
  void write(const simulation::Epoch& epoch) override;
  void finish() override;
  [[nodiscard]] std::vector<RunSummary> summaries() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// A metric of RunSummary, declared once, in summary.cpp. That list defines the printed table, records and
/// NetCDF of studies, the viewer, Python and docs/outputs.md; docs/extending.md describes how to add one.
struct SummaryMetric {
  const char* name;   ///< in Python and view.json
  const char* unit;   ///< as Column::unit
  int decimals;       ///< when printed; 0: a count
  const char* label;  ///< in printed tables; empty: not in them
  double factor;      ///< of the value in printed tables: 100 for fractions, in percent
  const char* kept;   ///< its variable in studies; empty: not stored
  const char* help;   ///< one line of Markdown
  double (*value)(const RunSummary& summary);
  /// Whether it applies to a run; null: to every run.
  bool (*applies)(const RunSummary& summary) = nullptr;

  [[nodiscard]] bool is_applicable(const RunSummary& summary) const {
    return applies == nullptr || applies(summary);
  }
  [[nodiscard]] bool is_count() const { return decimals == 0; }
  /// Unit of value() times `factor`.
  [[nodiscard]] const char* printed_unit() const { return factor == 100 ? "%" : unit; }
};
/// All metrics in the order of tables and files.
[[nodiscard]] std::span<const SummaryMetric> summary_metrics();
/// Rows of a Markdown table: metric, variable in studies, unit, meaning.
[[nodiscard]] std::string markdown(std::span<const SummaryMetric> metrics);

/// The metrics as a table for terminals, one column for each receiver (four side by side), "-" for NaN. Shows
/// the first kMaxSummarized receivers and the number of the others. Ends with a newline; empty for no
/// receivers. ASCII except the receivers' names.
[[nodiscard]] std::string format_summary_table(const std::vector<RunSummary>& summaries);
inline constexpr std::size_t kMaxSummarized = 16;

}  // namespace canyon::encoding
