#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "canyon/simulation/simulator.hpp"

namespace canyon::output {

/// Figures over a run, for the summary table. Percentiles interpolate linearly between order statistics (rank
/// p (n - 1) from 0, as NumPy does); vertical errors count without their sign. What has nothing to be made
/// from (errors without a fix, means without an epoch, shares without a satellite) is NaN.
struct RunSummary {
  std::string receiver;
  std::size_t epochs = 0;
  std::size_t fixes = 0;
  std::size_t by_fixed = 0, by_float = 0, by_differential = 0;  ///< epochs with a fix of that kind
  std::size_t wrong_fixes = 0;                                  ///< of the fixed ones (wrong_fix())
  double fixed_p95_m = 0;                                       ///< horizontal error while fixed; NaN without
  double first_fixed_s = 0;  ///< from the first epoch to the first fixed one; NaN without
  double horizontal_p50_m = 0, horizontal_p95_m = 0, horizontal_max_m = 0;  ///< NaN without fix
  double vertical_p50_m = 0, vertical_p95_m = 0;
  double mean_visible = 0, mean_blocked = 0,
         mean_used = 0;  ///< per epoch, epochs without fix included (0 used)
  double los_share = 0, los_multipath_share = 0, nlos_share = 0,
         blocked_share = 0;  ///< of satellites above mask
  double median_hdop = 0;
  /// Of measurements above the mask, as the receiver states it; NaN where signals have no strength. LOS with
  /// multipath counts as LOS.
  double mean_cn0_los_dbhz = 0, mean_cn0_nlos_dbhz = 0;
  std::size_t exclusions = 0;    ///< of satellites from fixes, by RAIM, over all epochs
  std::size_t raim_tested = 0;   ///< epochs with a statement of RAIM
  std::size_t inconsistent = 0;  ///< of those, epochs where RAIM's test failed on what was left
  /// From the first epoch without fix to the next fix; at the end of the run to one interval behind the last
  /// epoch.
  double longest_outage_s = 0;
  /// What the epochs were like at which a fault was at work, by the order of their beginnings.
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

/// The figures as a table for terminals, one column for each receiver (four side by side), "-" for NaN.
/// Of more receivers than kMostSummarized it shows the first, and says how many follow. Ends with a newline;
/// empty for no receivers. Plain text but for the receivers' names.
[[nodiscard]] std::string format_summary_table(const std::vector<RunSummary>& summaries);
inline constexpr std::size_t kMostSummarized = 16;

/// Folder names for receivers: letters, digits, '.', '-' and '_' stay, anything else becomes '_'; names that
/// would fall together (upper and lower case count as one) get "-2", "-3", ... behind.
[[nodiscard]] std::vector<std::string> receiver_folder_names(const std::vector<std::string>& receiver_names);
/// Where a receiver's files lie: `folder` itself with one receiver, else a folder of its own in it.
/// Precondition: `receiver` is an index into simulation.scenario().receivers.
[[nodiscard]] std::filesystem::path receiver_folder(const simulation::Simulation& simulation,
                                                    const std::filesystem::path& folder,
                                                    std::size_t receiver);

/// All the files that the scenario's `outputs:` asks for, into `folder`. With one receiver the names are
/// plain (epochs.csv, satellites.csv, receiver.nmea, receiver.obs, sky.nav, track.kml, track.geojson); with
/// several each receiver has a folder of its name (sky.nav stays in `folder`; it is left out for skies
/// without broadcast records). Pictures are canyon::io's (pictures.hpp). `simulation` must outlive the sinks.
/// Throws InputError where a folder or file cannot be made.
[[nodiscard]] std::vector<std::unique_ptr<simulation::EpochSink>> make_file_sinks(
    const simulation::Simulation& simulation, const std::filesystem::path& folder);

}  // namespace canyon::output
