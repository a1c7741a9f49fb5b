#include "canyon/outputs/encoding/epoch_rows.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <map>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/outputs/encoding/epoch_values.hpp"

namespace canyon::encoding {
namespace {

/// Rounds to a binary fraction: invisible digits would double the size of files.
double in_steps(double value, double steps_per_unit) {
  return std::round(value * steps_per_unit) / steps_per_unit;
}

}  // namespace

EpochRows::EpochRows(tracking::SignalOptions signal, std::size_t paths_per_satellite,
                     std::shared_ptr<ViewWords> words)
    : signal_(std::move(signal)), paths_per_satellite_(paths_per_satellite), words_(std::move(words)) {}

void EpochRows::clear() {
  for (ViewRows* rows : {&epochs, &satellites, &paths, &bodies}) rows->clear();
}

void EpochRows::add_epoch(const simulation::Epoch& epoch, const ShownRow& shown) {
  const positioning::Fix& fix = epoch.observed.fix;
  const Eigen::Vector3d &at = shown.antenna_m, &fix_m = shown.fix_m;
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const auto variance = [&](int axis) { return fix.solved() ? fix.covariance_enu(axis, axis) : kNan; };
  epochs.add({shown.time_s, at.x(), at.y(), at.z(), geodesy::degrees(epoch.truth.yaw_rad),
              geodesy::degrees(epoch.truth.roll_rad), geodesy::degrees(epoch.truth.pitch_rad),
              static_cast<double>(fix.status), fix_m.x(), fix_m.y(), fix_m.z(), variance(0), variance(1),
              variance(2), static_cast<double>(shown.skyline)},
             Row{epoch}, *words_);
}

void EpochRows::add_satellite(const Row& row, std::size_t number, std::size_t index, int flags,
                              std::size_t paths_of_it) {
  satellites.add({static_cast<double>(number), static_cast<double>(index), static_cast<double>(flags),
                  static_cast<double>(paths_of_it)},
                 row, *words_);
}

void EpochRows::add_path(const Row& row) {
  paths.add({static_cast<double>(row.path->kind)}, row, *words_);
}

void EpochRows::add(const simulation::Epoch& epoch, std::size_t number, double time_s, int skyline,
                    const ToLocal& local, std::span<const gnss::SatelliteId> known) {
  const positioning::Fix& fix = epoch.observed.fix;
  ShownRow shown{time_s, skyline, local(epoch.truth_ecef)};
  if (fix.solved()) shown.fix_m = local(fix.position_ecef);
  add_epoch(epoch, shown);
  if (epoch.arrival != nullptr) {
    for (const propagation::Body& body : epoch.arrival->bodies) {
      bodies.add({static_cast<double>(number), static_cast<double>(body.kind), in_steps(body.centre.x(), 64),
                  in_steps(body.centre.y(), 64), in_steps(body.bottom_m, 64), in_steps(body.top_m, 64),
                  in_steps(geodesy::degrees(std::atan2(body.ahead.y(), body.ahead.x())), 64),
                  in_steps(2 * body.half_length_m, 64), in_steps(2 * body.half_width_m, 64)});
    }
  }
  std::map<gnss::SatelliteId, const propagation::SatelliteView*> views;
  for_each_view(epoch.observed, epoch.arrival,
                [&](const receiver::SatelliteObservation& s, const propagation::SatelliteView& seen) {
                  views[s.id] = &seen;
                });
  for (const receiver::SatelliteObservation& s : epoch.observed.satellites) {
    const auto index = std::lower_bound(known.begin(), known.end(), s.id);
    if (index == known.end() || *index != s.id) continue;
    const Row row{epoch, &s, &s};
    const auto found = views.find(s.id);
    const std::size_t count = found == views.end() ? 0 : add_paths(row, *found->second);
    const int flags = (s.above_mask ? kAboveMask : 0) | (s.used ? kUsed : 0) |
                      (s.measurement ? kMeasured : 0) | (is_excluded(fix, s.id) ? kExcluded : 0);
    add_satellite(row, number, static_cast<std::size_t>(index - known.begin()), flags, count);
  }
}

/// Returns the number of stored paths.
std::size_t EpochRows::add_paths(Row row, const propagation::SatelliteView& view) {
  struct StoredRow {
    const propagation::Path* path;
    std::complex<double> amplitude;
  };
  std::vector<StoredRow> kept;
  for (const propagation::Path& path : view.paths.paths)
    kept.push_back({&path, first_signal_amplitude(*row.satellite, view, path, signal_)});
  // The first path stays first: the direct one, or the shortest. Ties and paths without strength stay in
  // order of excess path.
  if (kept.size() > paths_per_satellite_) {
    std::stable_sort(kept.begin() + 1, kept.end(), [](const StoredRow& a, const StoredRow& b) {
      return std::abs(a.amplitude) > std::abs(b.amplitude);
    });
    kept.resize(paths_per_satellite_);
  }
  for (const StoredRow& k : kept) {
    row.amplitude = k.amplitude;
    row.path = k.path;
    propagation::Path copy;
    if (k.path->kind == propagation::PathKind::Transmitted) {  // it has no point of interaction
      copy = *k.path;
      copy.point.setConstant(std::numeric_limits<double>::quiet_NaN());
      row.path = &copy;
    }
    add_path(row);
  }
  return kept.size();
}

}  // namespace canyon::encoding
