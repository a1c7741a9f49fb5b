#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "canyon/simulation/simulator.hpp"

namespace canyon::output {

/// Column names of the CSV files, in order; docs/outputs.md lists the same.
[[nodiscard]] const std::vector<std::string>& epochs_csv_columns();
[[nodiscard]] const std::vector<std::string>& satellites_csv_columns();

/// Each sink writes one receiver's file, whole or not at all (finish() puts it in place).
[[nodiscard]] std::unique_ptr<simulation::EpochSink> make_epochs_csv(const std::filesystem::path& path,
                                                                     std::size_t receiver);
[[nodiscard]] std::unique_ptr<simulation::EpochSink> make_satellites_csv(const std::filesystem::path& path,
                                                                         std::size_t receiver);
/// NMEA 0183 v4.11: GGA, RMC, GSA, GSV, GST each epoch.
[[nodiscard]] std::unique_ptr<simulation::EpochSink> make_nmea(const std::filesystem::path& path,
                                                               std::size_t receiver);
/// RINEX 3.04 observation file; codes C1C D1C S1C (BeiDou C2I D2I S2I).
[[nodiscard]] std::unique_ptr<simulation::EpochSink> make_rinex_observation(
    const std::filesystem::path& path, std::size_t receiver, const simulation::Simulation& simulation);
[[nodiscard]] std::unique_ptr<simulation::EpochSink> make_kml(const std::filesystem::path& path,
                                                              std::size_t receiver, const std::string& name);
[[nodiscard]] std::unique_ptr<simulation::EpochSink> make_geojson(const std::filesystem::path& path,
                                                                  std::size_t receiver, const std::string& name);

/// Figures over a run, for the summary table.
struct RunSummary {
  std::string receiver;
  std::size_t epochs = 0;
  std::size_t fixes = 0;
  double horizontal_p50_m = 0, horizontal_p95_m = 0, horizontal_max_m = 0;  ///< NaN without fix
  double vertical_p50_m = 0, vertical_p95_m = 0;
  double mean_visible = 0, mean_blocked = 0, mean_used = 0;
  double los_share = 0, los_multipath_share = 0, nlos_share = 0, blocked_share = 0;  ///< of satellites above mask
  double median_hdop = 0;
  double longest_outage_s = 0;
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

/// All the files that the scenario's `outputs:` asks for, into `folder`. With one receiver the names are plain
/// (epochs.csv, satellites.csv, receiver.nmea, receiver.obs, sky.nav, track.kml, track.geojson); with several
/// each receiver has a folder of its name (sky.nav stays in `folder`). Pictures are canyon::io's (pictures.hpp).
[[nodiscard]] std::vector<std::unique_ptr<simulation::EpochSink>> make_file_sinks(
    const simulation::Simulation& simulation, const std::filesystem::path& folder);

}  // namespace canyon::output
