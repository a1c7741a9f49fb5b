#include "canyon/view/view_sink.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "canyon/base/output_file.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/output/epoch_rows.hpp"
#include "canyon/output/sinks.hpp"
#include "canyon/simulation/scenario.hpp"
#include "canyon/view/header.hpp"
#include "canyon/view/skyline.hpp"
#include "canyon/view/tables/chunk.hpp"

namespace canyon::view {
namespace {

/// The rows of one receiver.
class Recorder {
 public:
  Recorder(const simulation::Simulation& simulation, std::filesystem::path folder, std::size_t receiver,
           const ViewOptions& options)
      : simulation_(simulation),
        folder_(std::move(folder)),
        receiver_(receiver),
        options_(options),
        rows_(simulation.scenario().receivers.at(receiver).options.signal, options.paths_per_satellite) {
    const receiver::ReceiverOptions& config = simulation.scenario().receivers.at(receiver).options;
    header_.name = config.name;
    header_.strength = config.signal.enabled;
    header_.elevation_mask_deg = geodesy::degrees(config.fix.elevation_mask_rad);
  }

  void write(const simulation::Epoch& epoch, const std::vector<gnss::SatelliteId>& satellites) {
    const Eigen::Vector3d antenna = frame().local_from_ecef(epoch.truth_ecef);
    const double time_s = epoch.observed.time - simulation_.begin();
    add_faults(epoch.faults, time_s);
    rows_.add(
        epoch, epochs_, time_s, skylines_.row_at(simulation_.environment().scene(), antenna),
        [this](const Eigen::Vector3d& ecef) { return frame().local_from_ecef(ecef); }, satellites);
    ++epochs_;
    if (epochs_ - block_begin_ >= options_.epochs_per_block) finish_block();
  }

  /// What is left goes to files.
  void finish() {
    finish_block();
    const std::string file = fmt::format("track-{}.bin.gz", receiver_);
    put(file, {&rows_.epochs, &skylines_.rows()}, {file, receiver_, true, 0, epochs_});
  }

  [[nodiscard]] ReceiverHeader& header() { return header_; }
  [[nodiscard]] const std::vector<ChunkEntry>& chunks() const { return chunks_; }

 private:
  [[nodiscard]] const geodesy::LocalFrame& frame() const { return simulation_.environment().city().frame; }

  /// Beside the epoch before, a fault goes on; else a new stretch begins.
  void add_faults(const std::vector<std::string>& names, double time_s) {
    for (const std::string& name : names) {
      const auto open = std::find_if(header_.faults.rbegin(), header_.faults.rend(),
                                     [&](const FaultStretch& f) { return f.name == name; });
      if (open != header_.faults.rend() && last_time_s_ && open->until_s == *last_time_s_) {
        open->until_s = time_s;
      } else {
        header_.faults.push_back({name, time_s, time_s});
      }
    }
    last_time_s_ = time_s;
  }

  void finish_block() {
    if (epochs_ == block_begin_) return;
    const std::string file = fmt::format("block-{}-{:05}.bin.gz", receiver_, block_begin_);
    put(file, {&rows_.satellites, &rows_.paths, &rows_.bodies},
        {file, receiver_, false, block_begin_, epochs_ - block_begin_, 0, rows_.satellites.size(),
         rows_.paths.size()});
    for (Rows* rows : {&rows_.satellites, &rows_.paths, &rows_.bodies}) rows->clear();
    block_begin_ = epochs_;
  }

  void put(const std::string& name, const std::vector<const Rows*>& tables, ChunkEntry entry) {
    entry.bytes = write_chunk(folder_, name, tables);
    chunks_.push_back(std::move(entry));
  }

  const simulation::Simulation& simulation_;
  std::filesystem::path folder_;
  std::size_t receiver_;
  const ViewOptions& options_;
  ReceiverHeader header_;
  std::vector<ChunkEntry> chunks_;
  output::EpochRows rows_;
  Skylines skylines_{options_.skyline_step_m};
  std::size_t epochs_ = 0, block_begin_ = 0;
  std::optional<double> last_time_s_;
};

std::vector<std::string> receiver_names(const simulation::Simulation& simulation) {
  std::vector<std::string> names;
  for (const auto& receiver : simulation.scenario().receivers) names.push_back(receiver.options.name);
  return names;
}

class View final : public simulation::EpochSink {
 public:
  View(const simulation::Simulation& simulation, std::filesystem::path folder, ViewOptions options)
      : folder_(std::move(folder)), options_(std::move(options)), figures_(receiver_names(simulation)) {
    options_.validate();
    make_output_folder(folder_);
    const simulation::Scenario& scenario = simulation.scenario();
    header_.title = scenario.file.empty() ? "Canyon" : scenario.file.stem().string();
    header_.city = write_city(simulation.environment().city(), options_.height_sources, folder_);
    header_.begin = simulation.begin();
    header_.interval_s = simulation.interval_s();
    header_.paths_per_satellite = options_.paths_per_satellite;
    header_.satellites = simulation.environment().sky().satellites();
    std::sort(header_.satellites.begin(), header_.satellites.end());
    for (std::size_t i = 0; i < scenario.receivers.size(); ++i) {
      recorders_.push_back(std::make_unique<Recorder>(simulation, folder_, i, options_));
    }
    if (!options_.watched) return;
    Header begun = header_;
    begun.live = true;
    for (const auto& recorder : recorders_) begun.receivers.push_back(recorder->header());
    write_header(begun, folder_);
  }

  void write(const simulation::Epoch& epoch) override {
    recorders_.at(epoch.receiver)->write(epoch, header_.satellites);
    figures_.write(epoch);
  }

  void finish() override {
    if (std::exchange(finished_, true)) return;
    figures_.finish();
    std::vector<output::RunSummary> summaries = figures_.summaries();
    for (std::size_t i = 0; i < recorders_.size(); ++i) {
      Recorder& recorder = *recorders_[i];
      recorder.finish();
      recorder.header().summary = std::move(summaries.at(i));
      header_.receivers.push_back(recorder.header());
      header_.chunks.insert(header_.chunks.end(), recorder.chunks().begin(), recorder.chunks().end());
    }
    write_header(header_, folder_);
  }

 private:
  std::filesystem::path folder_;
  ViewOptions options_;
  output::SummarySink figures_;
  Header header_;
  std::vector<std::unique_ptr<Recorder>> recorders_;
  bool finished_ = false;
};

}  // namespace

void ViewOptions::validate() const {
  if (paths_per_satellite < 1 || paths_per_satellite > 1000) {
    throw InputError("paths_per_satellite is out of range", "it runs from 1 to 1000");
  }
  if (epochs_per_block < 1 || epochs_per_block > 100'000) {
    throw InputError("epochs_per_block is out of range", "it runs from 1 to 100,000");
  }
  if (!(skyline_step_m >= 0)) throw InputError("skyline_step_m is negative", "give metres");
}

std::unique_ptr<simulation::EpochSink> make_view(const simulation::Simulation& simulation,
                                                 const std::filesystem::path& folder, ViewOptions options) {
  return std::make_unique<View>(simulation, folder, std::move(options));
}

}  // namespace canyon::view
