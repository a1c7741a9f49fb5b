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
#include "canyon/outputs/drawing/plot.hpp"
#include "canyon/outputs/drawing/views/sky_marks.hpp"
#include "canyon/outputs/drawing/views/sky_picture.hpp"
#include "canyon/outputs/drawing/views/track_picture.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

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

using samples::CorrelationSeries;

constexpr double kWidth = 1000, kHeight = 830, kLeft = 74, kRight = 30;

double magnitude(const CorrelationSeries::Instant& instant, std::size_t k) {
  return std::abs(instant.values[k]);
}

double greatest(const CorrelationSeries& series) {
  double maximum = 0;
  for (const auto& instant : series.instants)
    for (std::size_t k = 0; k < instant.values.size(); ++k)
      maximum = std::max(maximum, magnitude(instant, k));
  return maximum > 0 ? maximum : 1;
}

std::size_t shown(const CorrelationSeries& series) {
  std::size_t best = series.instants.size() / 2;
  double largest = -1;
  for (std::size_t i = 0; i < series.instants.size(); ++i) {
    const double detour = std::abs(series.instants[i].measured_m);
    if (!(detour > largest)) continue;  // false for NaN
    largest = detour;
    best = i;
  }
  return best;
}

Colour path_colour(propagation::PathKind kind) {
  switch (kind) {
    case propagation::PathKind::Direct:
      return kGreen;
    case propagation::PathKind::Reflected:
      return kVermilion;
    case propagation::PathKind::Diffracted:
      return kPurple;
    default:
      return kFaintInk.with_alpha(0.5);
  }
}

/// A scale that ends at the extreme values.
Scale scale_of(double low, double high) {
  Scale scale;
  scale.low = low;
  scale.high = high > low ? high : low + 1;
  scale.ticks = linear_ticks(scale.low, scale.high, 8);
  return scale;
}

void draw_waterfall(Canvas& canvas, const CorrelationSeries& series, const Rect& area) {
  const auto& delays = series.delays_m;
  Plot plot;
  plot.area = area;
  plot.x = scale_of(series.instants.front().time_s, series.instants.back().time_s);
  plot.y = scale_of(delays.front(), delays.back());
  plot.x_label = "time [s]";
  plot.y_label = "delay after the line of sight [m]";
  plot.draw_ground(canvas);
  const auto columns = static_cast<int>(series.instants.size());
  constexpr int kRows = 300;
  const double maximum = greatest(series);
  std::vector<std::uint32_t> pixels;
  for (int row = 0; row < kRows; ++row) {
    const double delay = delays.back() + (delays.front() - delays.back()) * (row + 0.5) / kRows;
    const auto next = std::upper_bound(delays.begin(), delays.end() - 1, delay);
    const auto k = static_cast<std::size_t>(next - delays.begin());
    for (const auto& instant : series.instants)
      pixels.push_back(packed(viridis(magnitude(instant, k) / maximum)));
  }
  canvas.image(area, columns, kRows, pixels);
  std::vector<Point> line;
  canvas.clipped(area, [&] {
    for (const auto& instant : series.instants) {
      if (std::isnan(instant.measured_m)) {
        if (line.size() > 1) canvas.polyline(line, {kPaper, 1.6});
        line.clear();
      } else {
        line.push_back(plot.at(instant.time_s, instant.measured_m));
      }
    }
    if (line.size() > 1) canvas.polyline(line, {kPaper, 1.6});
  });
  plot.draw_frame(canvas);
}

void draw_instant(Canvas& canvas, const CorrelationSeries& series, const tracking::Correlation& shape,
                  const Rect& area) {
  const CorrelationSeries::Instant& instant = series.instants[shown(series)];
  const auto& delays = series.delays_m;
  double maximum = 0;
  for (std::size_t k = 0; k < delays.size(); ++k) maximum = std::max(maximum, magnitude(instant, k));
  for (const auto& path : instant.paths) maximum = std::max(maximum, path.amplitude);
  Plot plot;
  plot.area = area;
  plot.x = scale_of(delays.front(), delays.back());
  plot.y = linear_scale(0, maximum > 0 ? maximum : 1, 5);
  plot.x_label = fmt::format("delay after the line of sight [m], at {:.1f} s", instant.time_s);
  plot.y_label = "correlation";
  plot.draw_ground(canvas);
  canvas.clipped(area, [&] {
    const auto curve = [&](const auto& value, const Stroke& stroke) {
      std::vector<Point> points;
      for (std::size_t k = 0; k < delays.size(); ++k) points.push_back(plot.at(delays[k], value(k)));
      canvas.polyline(points, stroke);
    };
    for (const auto& path : instant.paths)
      curve(
          [&](std::size_t k) {
            return std::abs(path.amplitude * shape.value((delays[k] - path.excess_m) / shape.chip_m()));
          },
          {path_colour(path.kind), path.kind == propagation::PathKind::Direct ? 1.6 : 1.0});
    curve([&](std::size_t k) { return magnitude(instant, k); }, {kInk, 2.4});
    if (!std::isnan(instant.measured_m))
      canvas.segments({{plot.at(instant.measured_m, 0), plot.at(instant.measured_m, maximum)}}, {kBlue, 1.4});
  });
  plot.draw_frame(canvas);
  const auto stroke_of = [](const Colour& colour, double width) {
    return [colour, width](Canvas& c, const Point& at) {
      c.segments({{{at.x - 12, at.y}, {at.x + 12, at.y}}}, {colour, width});
    };
  };
  std::vector<LegendEntry> entries{{stroke_of(kInk, 2.4), "sum of all paths"},
                                   {stroke_of(kBlue, 1.4), "measured detour"}};
  for (const auto& [kind, name] : {std::pair{propagation::PathKind::Direct, "line of sight"},
                                   {propagation::PathKind::Reflected, "reflections"},
                                   {propagation::PathKind::Diffracted, "around edges"},
                                   {propagation::PathKind::Diffuse, "scattering"}}) {
    const bool any = std::any_of(instant.paths.begin(), instant.paths.end(),
                                 [&, k = kind](const auto& path) { return path.kind == k; });
    if (any) entries.push_back({stroke_of(path_colour(kind), 1.4), name});
  }
  const Rect size = legend_size(canvas, entries);
  draw_legend(canvas, {area.x + area.width - size.width - 10, area.y + 10}, entries);
}

}  // namespace

std::unique_ptr<simulation::EpochSink> make_pictures(const simulation::Simulation& simulation,
                                                     const std::filesystem::path& folder,
                                                     std::size_t receiver, const std::atomic<bool>* stop) {
  return std::make_unique<Pictures>(simulation, folder, receiver, stop);
}

Picture draw_correlation(const CorrelationSeries& series, const tracking::Correlation& shape) {
  const std::string title =
      fmt::format("Correlation of {} {}", gnss::to_string(series.satellite), series.signal);
  if (series.instants.empty()) return draw_notice(title, series.receiver, "no epoch");
  return render(kWidth, kHeight, [&](Canvas& canvas) {
    const double y =
        draw_title(canvas, kLeft, title,
                   fmt::format("receiver {}; magnitude over time and delay, the measured detour in white",
                               series.receiver));
    const double width = kWidth - kLeft - kRight;
    draw_waterfall(canvas, series, {kLeft, y + 8, width, 350});
    draw_instant(canvas, series, shape, {kLeft, y + 420, width, 260});
  });
}

}  // namespace canyon::drawing
