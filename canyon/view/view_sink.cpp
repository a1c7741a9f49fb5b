#include "canyon/view/view_sink.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "canyon/base/output_file.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/output/epoch_values.hpp"
#include "canyon/output/path_loss.hpp"
#include "canyon/output/sinks.hpp"
#include "canyon/simulation/scenario.hpp"
#include "canyon/view/chunk.hpp"
#include "canyon/view/header.hpp"
#include "canyon/view/skyline.hpp"

namespace canyon::view {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// To a binary fraction: digits that nobody sees make files twice as large.
double rounded(double value, double steps_per_unit) {
  return std::round(value * steps_per_unit) / steps_per_unit;
}

double value_or_nan(const std::optional<double>& value) {
  return value.value_or(kNone);
}

/// The rows of one receiver.
class Recorder {
 public:
  Recorder(const simulation::Simulation& simulation, std::filesystem::path folder, std::size_t receiver,
           const ViewOptions& options)
      : simulation_(simulation), folder_(std::move(folder)), receiver_(receiver), options_(options) {
    const receiver::ReceiverOptions& config = simulation.scenario().receivers.at(receiver).options;
    header_.name = config.name;
    header_.strength = config.signal.enabled;
    header_.elevation_mask_deg = geodesy::degrees(config.fix.elevation_mask_rad);
    signal_ = config.signal;
  }

  void write(const simulation::Epoch& epoch, const std::vector<gnss::SatelliteId>& satellites) {
    const Eigen::Vector3d antenna = frame().local_from_ecef(epoch.truth_ecef);
    const double time_s = epoch.observed.time - simulation_.begin();
    add_faults(epoch.faults, time_s);
    add_epoch(epoch, antenna, time_s);
    add_satellites(epoch, satellites);
    ++epochs_;
    if (epochs_ - block_begin_ >= options_.epochs_per_block) finish_block();
  }

  /// What is left goes to files.
  void finish() {
    finish_block();
    const std::string file = fmt::format("track-{}.bin.gz", receiver_);
    put(file, {&rows_, &skylines_.rows()}, {file, receiver_, true, 0, epochs_});
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

  void add_epoch(const simulation::Epoch& epoch, const Eigen::Vector3d& antenna, double time_s) {
    const positioning::Fix& fix = epoch.observed.fix;
    const Eigen::Vector3d& v = epoch.truth.velocity_enu_mps;
    const bool solved = fix.solved();
    Eigen::Vector3d place = Eigen::Vector3d::Constant(kNone);
    if (solved) place = frame().local_from_ecef(fix.position_ecef);
    const Eigen::Vector3d error = solved ? epoch.error_enu_m : place;
    const Eigen::Matrix3d covariance =
        solved ? fix.covariance_enu : Eigen::Matrix3d(Eigen::Matrix3d::Constant(kNone));
    const positioning::Dop dop =
        solved && fix.dop ? *fix.dop : positioning::Dop{kNone, kNone, kNone, kNone, kNone};
    rows_.add({time_s,
               antenna.x(),
               antenna.y(),
               antenna.z(),
               geodesy::degrees(epoch.truth.yaw_rad),
               geodesy::degrees(epoch.truth.roll_rad),
               geodesy::degrees(epoch.truth.pitch_rad),
               v.x(),
               v.y(),
               v.z(),
               static_cast<double>(fix.status),
               static_cast<double>(epoch.placement),
               place.x(),
               place.y(),
               place.z(),
               error.x(),
               error.y(),
               error.z(),
               covariance(0, 0),
               covariance(1, 1),
               covariance(2, 2),
               covariance(0, 1),
               covariance(0, 2),
               covariance(1, 2),
               dop.gdop,
               dop.pdop,
               dop.hdop,
               dop.vdop,
               dop.tdop,
               static_cast<double>(output::used_count(fix)),
               static_cast<double>(epoch.observed.visible),
               static_cast<double>(epoch.observed.blocked),
               static_cast<double>(skylines_.row_at(simulation_.environment().scene(), antenna))});
  }

  void add_satellites(const simulation::Epoch& epoch, const std::vector<gnss::SatelliteId>& satellites) {
    const positioning::Fix& fix = epoch.observed.fix;
    std::map<gnss::SatelliteId, const propagation::SatelliteView*> views;
    output::for_each_view(epoch.observed, epoch.arrival,
                          [&](const receiver::SatelliteObservation& s,
                              const propagation::SatelliteView& view) { views[s.id] = &view; });
    for (const receiver::SatelliteObservation& s : epoch.observed.satellites) {
      const auto index = std::lower_bound(satellites.begin(), satellites.end(), s.id);
      if (index == satellites.end() || *index != s.id) continue;
      const bool excluded = std::find(fix.excluded.begin(), fix.excluded.end(), s.id) != fix.excluded.end();
      double residual_m = kNone;
      const auto used = std::lower_bound(fix.used.begin(), fix.used.end(), s.id);
      const auto at = static_cast<std::size_t>(used - fix.used.begin());
      if (fix.solved() && used != fix.used.end() && *used == s.id && at < fix.residuals_m.size()) {
        residual_m = fix.residuals_m[at];
      }
      const auto view = views.find(s.id);
      const std::size_t paths = view == views.end() ? 0 : add_paths(s, *view->second);
      const auto& m = s.measurement;
      satellites_.add({static_cast<double>(epochs_), static_cast<double>(index - satellites.begin()),
                       geodesy::degrees(s.azimuth_rad), geodesy::degrees(s.elevation_rad),
                       static_cast<double>(s.visibility),
                       static_cast<double>((s.above_mask ? kAboveMask : 0) | (s.used ? kUsed : 0) |
                                           (m ? kMeasured : 0) | (excluded ? kExcluded : 0)),
                       static_cast<double>(s.lock), value_or_nan(m ? m->cn0_dbhz : std::nullopt),
                       value_or_nan(s.cn0_dbhz), output::has_tracked_excess(s) ? s.excess_m : kNone,
                       m ? s.pseudorange_error_m : kNone, residual_m, static_cast<double>(paths)});
    }
  }

  /// Returns how many were kept.
  std::size_t add_paths(const receiver::SatelliteObservation& satellite,
                        const propagation::SatelliteView& view) {
    struct Kept {
      const propagation::Path* path;
      double loss_db;
    };
    std::vector<Kept> kept;
    for (const propagation::Path& path : view.paths.paths) {
      const double amplitude = std::abs(output::first_signal_amplitude(satellite, view, path, signal_));
      kept.push_back({&path, amplitude > 0 ? -20 * std::log10(amplitude) : kNone});
    }
    // The first stays in front: it is the direct one, or the shortest detour. Ties and what has no strength
    // stay in order of their detours.
    if (kept.size() > options_.paths_per_satellite) {
      const auto strength = [](const Kept& k) {
        return std::isnan(k.loss_db) ? std::numeric_limits<double>::infinity() : k.loss_db;
      };
      std::stable_sort(kept.begin() + 1, kept.end(),
                       [&](const Kept& a, const Kept& b) { return strength(a) < strength(b); });
      kept.resize(options_.paths_per_satellite);
    }
    const auto place = [](const Eigen::Vector3d& point, bool known, int axis) {
      return known ? rounded(point[axis], 64) : kNone;
    };
    for (const Kept& k : kept) {
      const propagation::Path& p = *k.path;
      const bool has_point =
          p.kind != propagation::PathKind::Direct && p.kind != propagation::PathKind::Transmitted;
      const bool has_far = p.order > 1;
      paths_.add({static_cast<double>(p.kind), static_cast<double>(p.order), rounded(p.excess_m, 1024),
                  rounded(k.loss_db, 64), place(p.point, has_point, 0), place(p.point, has_point, 1),
                  place(p.point, has_point, 2), place(p.far_point, has_far, 0),
                  place(p.far_point, has_far, 1), place(p.far_point, has_far, 2)});
    }
    return kept.size();
  }

  void finish_block() {
    if (epochs_ == block_begin_) return;
    const std::string file = fmt::format("block-{}-{:05}.bin.gz", receiver_, block_begin_);
    put(file, {&satellites_, &paths_},
        {file, receiver_, false, block_begin_, epochs_ - block_begin_, 0, satellites_.size(), paths_.size()});
    satellites_.clear();
    paths_.clear();
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
  tracking::SignalOptions signal_;
  ReceiverHeader header_;
  std::vector<ChunkEntry> chunks_;
  Rows rows_{kEpochs}, satellites_{kSatellites}, paths_{kPaths};
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
