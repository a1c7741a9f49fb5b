#include "canyon/outputs/drawing/views/pictures.hpp"
#include "canyon/outputs/drawing/views/timeline_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/city/city.hpp"
#include "canyon/outputs/drawing/views/sky_picture.hpp"
#include "canyon/outputs/drawing/views/track_picture.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::drawing {
namespace {

/// Directions of satellites at one epoch.
struct Snapshot {
  geodesy::GpsTime time;
  Eigen::Vector3d antenna_enu = Eigen::Vector3d::Zero();
  raytrace::Containment containment = raytrace::Containment::Free;
  std::vector<std::string> faults;
  struct Satellite {
    gnss::SatelliteId id;
    SkyPoint point;
    bool used = false;
  };
  std::vector<Satellite> satellites;
};

bool is_worse(const Snapshot&, const Snapshot&) {
  return false;
}
bool is_worse(const TrackPoint& a, const TrackPoint& b) {
  return b.fix && (!a.fix || a.error_m > b.error_m);
}
bool is_worse(const TimelinePoint& a, const TimelinePoint& b) {
  return !std::isnan(b.error_m) && !(a.error_m <= b.error_m);
}

/// Evenly spaced epochs of a run of unknown length, at most kMax: if there are too many, one of each two is
/// kept, the worse or the first, and the sampling rate is halved.
template <typename Each, std::size_t kMax>
class Decimator {
 public:
  /// Whether the next epoch begins a step.
  [[nodiscard]] bool wanted() const { return seen_ % stride_ == 0; }
  void skip() { ++seen_; }
  void add(Each each) {
    if (seen_++ % stride_ != 0) {
      if (is_worse(each, kept_.back())) kept_.back() = std::move(each);
      return;
    }
    kept_.push_back(std::move(each));
    if (kept_.size() < kMax) return;
    for (std::size_t i = 0; 2 * i < kept_.size(); ++i) {
      const bool second = 2 * i + 1 < kept_.size() && is_worse(kept_[2 * i + 1], kept_[2 * i]);
      if (i > 0 || second) kept_[i] = std::move(kept_[2 * i + (second ? 1 : 0)]);
    }
    kept_.resize((kept_.size() + 1) / 2);
    stride_ *= 2;
  }
  [[nodiscard]] const std::vector<Each>& all() const { return kept_; }

 private:
  std::vector<Each> kept_;
  std::size_t seen_ = 0;
  std::size_t stride_ = 1;
};

/// The end of a subtitle with the names of the first four faults.
std::string faults_text(const std::vector<std::string>& faults) {
  if (faults.empty()) return {};
  constexpr std::size_t kMax = 4;
  const std::size_t shown = std::min(faults.size(), kMax);
  const std::vector<std::string> first(faults.begin(), faults.begin() + static_cast<std::ptrdiff_t>(shown));
  std::string text = fmt::format("  \u00B7  faults: {}", fmt::join(first, ", "));
  if (shown < faults.size()) text += fmt::format(" and {} more", faults.size() - shown);
  return text;
}

/// Rounded to 0.1, never "-0.0".
double tenths(double value) {
  return std::round(value * 10) / 10 + 0.0;
}

/// Mean C/N0 of an epoch's measurements; NaN if there are none.
struct Strength {
  double los_dbhz = 0, nlos_dbhz = 0;
};
Strength mean_strength(const receiver::ReceiverEpoch& observed) {
  std::array<double, 2> sum{};
  std::array<int, 2> count{};
  for (const receiver::SatelliteObservation& s : observed.satellites) {
    if (!s.measurement || !s.measurement->cn0_dbhz) continue;
    const std::size_t i = s.visibility == propagation::Visibility::NLOS ? 1 : 0;
    sum[i] += *s.measurement->cn0_dbhz;
    ++count[i];
  }
  return {sum[0] / count[0], sum[1] / count[1]};
}

class Pictures final : public simulation::EpochSink {
 public:
  Pictures(const simulation::Simulation& simulation, const std::filesystem::path& folder,
           std::size_t receiver, const std::atomic<bool>* stop)
      : simulation_(simulation), receiver_(receiver), stop_(stop) {
    // Reserves all names now, to detect a folder that cannot be written to before the run.
    for (const char* name : {"track", "skyplot", "timeline"}) {
      files_.emplace_back(folder / fmt::format("{}.png", name));
      files_.emplace_back(folder / fmt::format("{}.svg", name));
    }
  }

  void write(const simulation::Epoch& epoch) override {
    if (epoch.receiver != receiver_) return;
    const geodesy::LocalFrame& frame = simulation_.environment().city().frame;
    const Eigen::Vector3d antenna = frame.local_from_ecef(epoch.truth_ecef);
    const receiver::ReceiverEpoch& observed = epoch.observed;

    TrackPoint track;
    track.truth = antenna.head<2>();
    TimelinePoint moment;
    moment.time = observed.time;
    moment.visible = observed.visible;
    moment.blocked = observed.blocked;
    if (observed.fix.solved()) {
      track.fix = frame.local_from_ecef(observed.fix.position_ecef).head<2>();
      track.error_m = epoch.error_enu_m.head<2>().norm();
      moment.error_m = track.error_m;
      moment.vertical_m = std::abs(epoch.error_enu_m.z());
      moment.used = static_cast<int>(observed.fix.used.size());
      if (observed.fix.dop) moment.hdop = observed.fix.dop->hdop;
    }
    track_.add(track);
    ++epochs_;
    if (track.fix) error_m_.add(track.error_m);
    if (!track.fix) ++without_fix_;
    const Strength strength = mean_strength(observed);
    moment.cn0_los_dbhz = strength.los_dbhz;
    moment.cn0_nlos_dbhz = strength.nlos_dbhz;
    add_faults(epoch);
    if (epochs_ == 1) begin_ = moment.time;
    end_ = moment.time;
    timeline_.add(moment);

    if (!snapshots_.wanted()) {
      snapshots_.skip();
      return;
    }
    Snapshot snapshot;
    snapshot.time = observed.time;
    snapshot.antenna_enu = antenna;
    snapshot.containment = epoch.containment;
    snapshot.faults = epoch.faults;
    for (const receiver::SatelliteObservation& s : observed.satellites)
      snapshot.satellites.push_back({s.id, {s.azimuth_rad, s.elevation_rad, s.visibility}, s.used});
    snapshots_.add(std::move(snapshot));
  }

  void finish() override {
    if (std::exchange(finished_, true)) return;
    if (epochs_ > 0 && (stop_ == nullptr || !stop_->load())) {
      const std::array<Picture, 3> pictures{draw_track(track_drawing()), draw_sky(sky_drawing()),
                                            draw_timeline(timeline_drawing())};
      for (std::size_t i = 0; i < pictures.size(); ++i) {
        files_[2 * i].write(pictures[i].png);
        files_[2 * i + 1].write(pictures[i].svg);
      }
      for (OutputFile& file : files_) file.commit();
    }
    files_.clear();
  }

 private:
  /// Call it before the epoch's own point is added.
  void add_faults(const simulation::Epoch& epoch) {
    for (const std::string& name : epoch.faults) {
      auto at = std::find_if(faults_.begin(), faults_.end(),
                             [&](const TimelineFault& fault) { return fault.name == name; });
      if (at == faults_.end()) at = faults_.insert(at, TimelineFault{name, {}});
      const geodesy::GpsTime now = epoch.observed.time;
      const bool goes_on = !at->stretches.empty() && at->stretches.back().second == end_;
      if (goes_on)
        at->stretches.back().second = now;
      else
        at->stretches.emplace_back(now, now);
    }
  }

  [[nodiscard]] const receiver::ReceiverOptions& options() const {
    return simulation_.scenario().receivers.at(receiver_).options;
  }

  [[nodiscard]] std::string span() const {
    const std::string from = geodesy::format_utc(begin_, 0);
    const std::string to = geodesy::format_utc(end_, 0);
    const bool same_day = from.substr(0, 10) == to.substr(0, 10);
    return fmt::format("{} {} to {} UTC", from.substr(0, 10), from.substr(11, 8),
                       same_day ? to.substr(11, 8) : to.substr(0, 10) + " " + to.substr(11, 8));
  }

  [[nodiscard]] TrackDrawing track_drawing() const {
    TrackDrawing drawing;
    const city::City& city = simulation_.environment().city();
    drawing.title = fmt::format("{}: true track and fixes", options().name);
    drawing.subtitle = fmt::format("{}  \u00B7  {}", city.name, span());
    std::vector<std::string> names;
    for (const TimelineFault& fault : faults_) names.push_back(fault.name);
    drawing.subtitle += faults_text(names);
    drawing.mesh = &city.mesh;
    drawing.points = track_.all();
    drawing.epochs = epochs_;
    drawing.without_fix = without_fix_;
    drawing.error_m = error_m_;
    return drawing;
  }

  [[nodiscard]] SkyDrawing sky_drawing() const {
    const std::vector<Snapshot>& all = snapshots_.all();
    const Snapshot& middle = all[all.size() / 2];
    SkyDrawing drawing;
    const std::string time = geodesy::format_utc(middle.time, 0);
    drawing.title = fmt::format("{}: sky in the middle of the run", options().name);
    drawing.subtitle =
        fmt::format("{} {} UTC  \u00B7  {:.1f} m east, {:.1f} m north, {:.1f} m above the city's origin",
                    time.substr(0, 10), time.substr(11, 8), tenths(middle.antenna_enu.x()),
                    tenths(middle.antenna_enu.y()), tenths(middle.antenna_enu.z()));
    if (middle.containment == raytrace::Containment::InsideBuilding)
      drawing.subtitle += "  \u00B7  inside a building";
    if (middle.containment == raytrace::Containment::UnderTerrain)
      drawing.subtitle += "  \u00B7  under the terrain";
    drawing.subtitle += faults_text(middle.faults);
    drawing.elevation_mask_rad = options().fix.elevation_mask_rad;
    if (!simulation_.environment().city().mesh.triangles.empty())
      drawing.mask = make_sky_mask(simulation_.environment().scene(), middle.antenna_enu);
    struct Trail {
      std::size_t last = 0;  // snapshot
      std::vector<std::vector<SkyPoint>> pieces;
    };
    std::map<gnss::SatelliteId, Trail> trails;
    for (std::size_t i = 0; i < all.size(); ++i) {
      for (const Snapshot::Satellite& s : all[i].satellites) {
        Trail& trail = trails[s.id];
        if (trail.pieces.empty() || i > trail.last + 1) trail.pieces.emplace_back();
        trail.pieces.back().push_back(s.point);
        trail.last = i;
      }
    }
    for (const Snapshot::Satellite& s : middle.satellites)
      drawing.satellites.push_back({gnss::to_string(s.id), s.point, s.used, std::move(trails[s.id].pieces)});
    return drawing;
  }

  [[nodiscard]] TimelineDrawing timeline_drawing() const {
    return {fmt::format("{}: accuracy and satellites", options().name),
            fmt::format("{}  \u00B7  {}", simulation_.environment().city().name, span()), timeline_.all(),
            faults_};
  }

  const simulation::Simulation& simulation_;
  std::size_t receiver_;
  const std::atomic<bool>* stop_;
  std::vector<OutputFile> files_;
  Decimator<TrackPoint, 20'000> track_;
  Decimator<TimelinePoint, 20'000> timeline_;
  std::vector<TimelineFault> faults_;
  Decimator<Snapshot, 2000> snapshots_;
  std::size_t epochs_ = 0, without_fix_ = 0;
  Distribution error_m_;
  geodesy::GpsTime begin_, end_;  ///< the first and the latest epoch
  bool finished_ = false;
};

}  // namespace

std::unique_ptr<simulation::EpochSink> make_pictures(const simulation::Simulation& simulation,
                                                     const std::filesystem::path& folder,
                                                     std::size_t receiver, const std::atomic<bool>* stop) {
  return std::make_unique<Pictures>(simulation, folder, receiver, stop);
}

}  // namespace canyon::drawing
