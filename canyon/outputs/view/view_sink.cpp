#include "canyon/outputs/view/view_sink.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/city/city.hpp"
#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/outputs/encoding/sinks.hpp"
#include "canyon/outputs/encoding/view_messages.hpp"
#include "canyon/outputs/view/header.hpp"
#include "canyon/outputs/view/recorder.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::view {
namespace {

/// The header of a run before its first epoch, without the city's objects.
ViewHeader initial_header(const simulation::Simulation& simulation) {
  const simulation::Scenario& scenario = simulation.scenario();
  const city::City& city = simulation.environment().city();
  ViewHeader header;
  header.title = scenario.file.empty() ? "Canyon" : scenario.file.stem().string();
  header.city = {city.name, city.frame.origin(), city.notes.lines(), {}, city.mesh.triangles.size()};
  header.begin = simulation.begin();
  header.interval_s = simulation.interval_s();
  header.satellites = simulation.environment().sky().satellites();
  std::sort(header.satellites.begin(), header.satellites.end());
  for (const auto& receiver : scenario.receivers)
    header.receivers.push_back(receiver_header(receiver.options));
  return header;
}

class View final : public simulation::EpochSink {
 public:
  View(const simulation::Simulation& simulation, std::filesystem::path folder, ViewOptions options)
      : simulation_(simulation),
        folder_(std::move(folder)),
        options_(std::move(options)),
        metrics_(shown_names(simulation, options_.tracks)),
        header_(initial_header(simulation)) {
    make_output_folder(folder_);
    ResultFiles::refuse(folder_ / kHeaderFile);
    header_.city = write_city(simulation.environment().city(), {}, folder_);
    header_.paths_per_satellite = options_.paths_per_satellite;
    const auto add_recorder = [&](const tracking::SignalOptions& signal) {
      recorders_.push_back(std::make_unique<Recorder>(folder_, recorders_.size(), options_, signal,
                                                      simulation.environment().scene(), words_));
    };
    for (const auto& receiver : simulation.scenario().receivers) add_recorder(receiver.options.signal);
    for (const OtherTrack& track : options_.tracks) {
      header_.receivers.emplace_back().name = track.name;
      add_recorder({});
    }
    if (!options_.watched) return;
    ViewHeader live = header_;
    live.live = true;
    write_header(live, folder_);
  }

  void write(const simulation::Epoch& epoch) override {
    add(epoch);
    for (std::size_t i = 0; epoch.receiver == 0 && i < options_.tracks.size(); ++i) {
      simulation::Epoch there;
      there.receiver = simulation_.scenario().receivers.size() + i;
      there.truth = epoch.truth;
      there.truth_ecef = epoch.truth_ecef;
      there.observed.time = epoch.observed.time;
      if (const auto point = options_.tracks[i].antenna_position_ecef(epoch.truth.time)) {
        there.observed.fix.status = positioning::FixStatus::Fix;
        there.observed.fix.position_ecef = *point;
        there.observed.fix.position = geodesy::geodetic_from_ecef(*point);
        there.error_enu_m =
            geodesy::enu_from_ecef_rotation(epoch.truth.position) * (*point - epoch.truth_ecef);
      }
      add(there);
    }
  }

  void finish() override {
    if (std::exchange(finished_, true)) return;
    metrics_.finish();
    std::vector<encoding::RunSummary> summaries = metrics_.summaries();
    for (std::size_t i = 0; i < recorders_.size(); ++i) {
      recorders_[i]->finish(header_);
      header_.receivers[i].summary = std::move(summaries.at(i));
    }
    header_.words = *words_;
    write_header(header_, folder_);
  }

 private:
  static std::vector<std::string> shown_names(const simulation::Simulation& simulation,
                                              const std::vector<OtherTrack>& tracks) {
    std::vector<std::string> names = simulation::receiver_names(simulation.scenario().receivers);
    for (const OtherTrack& track : tracks) names.push_back(track.name);
    return names;
  }

  void add(const simulation::Epoch& epoch) {
    Recorder& recorder = *recorders_.at(epoch.receiver);
    const geodesy::LocalFrame& frame = simulation_.environment().city().frame;
    const auto local = [&frame](const Eigen::Vector3d& ecef) { return frame.local_from_ecef(ecef); };
    const double time_s = epoch.observed.time - simulation_.begin();
    recorder.rows().add(epoch, recorder.epoch(), time_s, recorder.skyline(local(epoch.truth_ecef)), local,
                        header_.satellites);
    recorder.end_epoch(epoch.faults, time_s);
    metrics_.write(epoch);
  }

  const simulation::Simulation& simulation_;
  std::filesystem::path folder_;
  ViewOptions options_;
  encoding::SummarySink metrics_;
  ViewHeader header_;
  std::shared_ptr<encoding::ViewWords> words_ = std::make_shared<encoding::ViewWords>();
  std::vector<std::unique_ptr<Recorder>> recorders_;
  bool finished_ = false;
};

}  // namespace

void check_run(const std::filesystem::path& folder, const simulation::Simulation& simulation) {
  const Json shown = read_header(folder);
  const Json ours = Json::parse(header_json(initial_header(simulation)));
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

struct RunRelay::Impl {
  using Clock = std::chrono::steady_clock;

  struct Receiver {
    encoding::EpochRows rows;
    MovingSkyline skyline;
  };

  Impl(const simulation::Simulation& s, Server& to, std::size_t paths, std::chrono::milliseconds each)
      : simulation(s), server(to), step(each) {
    for (std::size_t i = 0; i < s.scenario().receivers.size(); ++i) {
      descriptions.push_back(encoding::describe_receiver(s, i));
      receivers.push_back({encoding::EpochRows(descriptions.back().signal, paths), MovingSkyline()});
    }
    hello = encoding::hello_message(descriptions);
    server.greet({hello});
  }

  /// Sends all receivers of an instant, or none.
  bool due(geodesy::GpsTime instant) {
    if (shown == instant) return true;
    const auto now = Clock::now();
    if (server.clients() == 0 || (shown && now - last < step)) return false;
    shown = instant;
    last = now;
    return true;
  }

  /// Sends a message, also as the greeting of later pages.
  void send_text(const std::string& text) const {
    server.greet({hello, text});
    server.send(text);
  }

  const simulation::Simulation& simulation;
  Server& server;
  std::chrono::milliseconds step;
  std::vector<encoding::ReceiverDescription> descriptions;
  std::vector<Receiver> receivers;
  std::string hello;
  std::optional<geodesy::GpsTime> shown;
  Clock::time_point last;
};

RunRelay::RunRelay(const simulation::Simulation& simulation, Server& server, std::size_t paths_per_satellite,
                   std::chrono::milliseconds step)
    : impl_(std::make_unique<Impl>(simulation, server, paths_per_satellite, step)) {}
RunRelay::~RunRelay() = default;

void RunRelay::write(const simulation::Epoch& epoch) {
  Impl& impl = *impl_;
  if (!impl.due(epoch.truth.time)) return;
  const simulation::Environment& environment = impl.simulation.environment();
  const geodesy::LocalFrame& frame = environment.city().frame;
  Impl::Receiver& receiver = impl.receivers.at(epoch.receiver);
  receiver.skyline.move(environment.scene(), frame.local_from_ecef(epoch.truth_ecef));
  encoding::EpochMessage message;
  message.receiver = impl.descriptions[epoch.receiver].name;
  message.time_s = epoch.observed.time - impl.simulation.begin();
  message.skyline = receiver.skyline.bytes();
  impl.server.send(encoding::epoch_message(
      std::move(message), epoch, [&](const Eigen::Vector3d& ecef) { return frame.local_from_ecef(ecef); },
      receiver.rows));
}

void RunRelay::progress(std::size_t done, std::size_t planned) {
  impl_->send_text(encoding::progress_message(done, planned));
}

void RunRelay::finished() {
  impl_->send_text(encoding::finished_message());
}

}  // namespace canyon::view
