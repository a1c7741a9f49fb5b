#include "canyon/view/view_sink.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/output/epoch_rows.hpp"
#include "canyon/output/sinks.hpp"
#include "canyon/output/view_chunk.hpp"
#include "canyon/simulation/scenario.hpp"
#include "canyon/view/header.hpp"
#include "canyon/view/skyline.hpp"

namespace canyon::view {
namespace {

/// The rows of one receiver.
class Recorder {
 public:
  Recorder(const simulation::Simulation& simulation, std::filesystem::path folder, std::size_t receiver,
           const ViewOptions& options, std::shared_ptr<output::ViewWords> words)
      : simulation_(simulation),
        folder_(std::move(folder)),
        receiver_(receiver),
        options_(options),
        rows_(simulation.scenario().receivers.at(receiver).options.signal, options.paths_per_satellite,
              std::move(words)) {}

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

  /// Writes the remaining epochs to files.
  void finish() {
    finish_block();
    const std::string file = fmt::format("track-{}.bin.gz", receiver_);
    put(file, {&rows_.epochs, &skylines_.rows()}, {file, receiver_, true, 0, epochs_});
  }

  [[nodiscard]] const std::vector<FaultStretch>& faults() const { return faults_; }
  [[nodiscard]] const std::vector<ChunkEntry>& chunks() const { return chunks_; }

 private:
  [[nodiscard]] const geodesy::LocalFrame& frame() const { return simulation_.environment().city().frame; }

  /// Beside the epoch before, a fault goes on; else a new stretch begins.
  void add_faults(const std::vector<std::string>& names, double time_s) {
    for (const std::string& name : names) {
      const auto open = std::find_if(faults_.rbegin(), faults_.rend(),
                                     [&](const FaultStretch& f) { return f.name == name; });
      if (open != faults_.rend() && last_time_s_ && open->until_s == *last_time_s_) {
        open->until_s = time_s;
      } else {
        faults_.push_back({name, time_s, time_s});
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
    for (output::ViewRows* rows : {&rows_.satellites, &rows_.paths, &rows_.bodies}) rows->clear();
    block_begin_ = epochs_;
  }

  void put(const std::string& name, const std::vector<const output::ViewRows*>& tables, ChunkEntry entry) {
    entry.bytes = output::write_chunk(folder_, name, tables);
    chunks_.push_back(std::move(entry));
  }

  const simulation::Simulation& simulation_;
  std::filesystem::path folder_;
  std::size_t receiver_;
  const ViewOptions& options_;
  std::vector<FaultStretch> faults_;
  std::vector<ChunkEntry> chunks_;
  output::EpochRows rows_;
  Skylines skylines_{options_.skyline_step_m};
  std::size_t epochs_ = 0, block_begin_ = 0;
  std::optional<double> last_time_s_;
};

/// The header of a run before its first epoch, without the city's objects.
Header begun(const simulation::Simulation& simulation) {
  const simulation::Scenario& scenario = simulation.scenario();
  const city::City& city = simulation.environment().city();
  Header header;
  header.title = scenario.file.empty() ? "Canyon" : scenario.file.stem().string();
  header.city = {city.name, city.frame.origin(), city.notes, {}, city.mesh.triangles.size()};
  header.begin = simulation.begin();
  header.interval_s = simulation.interval_s();
  header.satellites = simulation.environment().sky().satellites();
  std::sort(header.satellites.begin(), header.satellites.end());
  for (const auto& receiver : scenario.receivers)
    header.receivers.push_back(receiver_header(receiver.options));
  return header;
}

std::vector<std::string> receiver_names(const simulation::Simulation& simulation) {
  std::vector<std::string> names;
  for (const auto& receiver : simulation.scenario().receivers) names.push_back(receiver.options.name);
  return names;
}

class View final : public simulation::EpochSink {
 public:
  View(const simulation::Simulation& simulation, std::filesystem::path folder, ViewOptions options)
      : folder_(std::move(folder)),
        options_(std::move(options)),
        figures_(receiver_names(simulation)),
        header_(begun(simulation)) {
    options_.validate();
    make_output_folder(folder_);
    header_.city = write_city(simulation.environment().city(), options_.height_sources, folder_);
    header_.paths_per_satellite = options_.paths_per_satellite;
    for (std::size_t i = 0; i < simulation.scenario().receivers.size(); ++i) {
      recorders_.push_back(std::make_unique<Recorder>(simulation, folder_, i, options_, words_));
    }
    if (!options_.watched) return;
    Header live = header_;
    live.live = true;
    write_header(live, folder_);
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
      header_.receivers[i].faults = recorder.faults();
      header_.receivers[i].summary = std::move(summaries.at(i));
      header_.chunks.insert(header_.chunks.end(), recorder.chunks().begin(), recorder.chunks().end());
    }
    header_.words = *words_;
    write_header(header_, folder_);
  }

 private:
  std::filesystem::path folder_;
  ViewOptions options_;
  output::SummarySink figures_;
  Header header_;
  std::shared_ptr<output::ViewWords> words_ = std::make_shared<output::ViewWords>();
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

void check_run(const std::filesystem::path& folder, const simulation::Simulation& simulation) {
  const Json shown = read_header(folder);
  const Json ours = Json::parse(header_json(begun(simulation)));
  const auto names = [](const Json& receivers) {
    std::vector<Json> result;
    for (const Json& receiver : receivers) result.push_back(receiver["name"]);
    return result;
  };
  std::string_view differ;
  if (shown["satellites"] != ours["satellites"]) differ = "satellites";
  if (shown["time"] != ours["time"]) differ = "times";
  if (names(shown["receivers"]) != names(ours["receivers"])) differ = "receivers";
  if (!shows_city(shown, simulation.environment().city())) differ = "walls";
  if (differ.empty()) return;
  throw InputError(folder, 0, fmt::format("is of a run with other {} than the scenario's", differ),
                   "give the scenario that it was computed from");
}

std::unique_ptr<simulation::EpochSink> make_view(const simulation::Simulation& simulation,
                                                 const std::filesystem::path& folder, ViewOptions options) {
  return std::make_unique<View>(simulation, folder, std::move(options));
}

}  // namespace canyon::view
