#include "canyon/output/epoch_rows.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "canyon/geodesy/constants.hpp"
#include "canyon/output/epoch_values.hpp"
#include "canyon/output/path_loss.hpp"
#include "canyon/view/tables/epoch_row.hpp"

namespace canyon::output {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// To a binary fraction: digits that nobody sees make files twice as large.
double in_steps(double value, double steps_per_unit) {
  return std::round(value * steps_per_unit) / steps_per_unit;
}

double value_or_nan(const std::optional<double>& value) {
  return value.value_or(kNone);
}

}  // namespace

EpochRows::EpochRows(tracking::SignalOptions signal, std::size_t paths_per_satellite)
    : signal_(std::move(signal)), paths_per_satellite_(paths_per_satellite) {}

void EpochRows::clear() {
  for (view::Rows* rows : {&epochs, &satellites, &paths, &bodies}) rows->clear();
}

void EpochRows::add_epoch(const simulation::Epoch& epoch, double time_s, int skyline, const ToLocal& local) {
  const positioning::Fix& fix = epoch.observed.fix;
  view::EpochRow row;
  row.time_s = time_s;
  row.antenna_m = local(epoch.truth_ecef);
  row.yaw_deg = geodesy::degrees(epoch.truth.yaw_rad);
  row.roll_deg = geodesy::degrees(epoch.truth.roll_rad);
  row.pitch_deg = geodesy::degrees(epoch.truth.pitch_rad);
  row.velocity_mps = epoch.truth.velocity_enu_mps;
  row.status = fix.status;
  row.placement = epoch.placement;
  if (fix.solved()) {
    row.fix_m = local(fix.position_ecef);
    row.error_m = epoch.error_enu_m;
    row.covariance_m2 = fix.covariance_enu;
    if (fix.dop) row.dop = *fix.dop;
  }
  row.used = static_cast<int>(used_count(fix));
  row.visible = epoch.observed.visible;
  row.blocked = epoch.observed.blocked;
  row.skyline = skyline;
  row.add_to(epochs);
}

void EpochRows::add(const simulation::Epoch& epoch, std::size_t number, double time_s, int skyline,
                    const ToLocal& local, std::span<const gnss::SatelliteId> known) {
  add_epoch(epoch, time_s, skyline, local);
  if (epoch.arrival != nullptr) add_bodies(epoch.arrival->bodies, number);
  const positioning::Fix& fix = epoch.observed.fix;
  std::map<gnss::SatelliteId, const propagation::SatelliteView*> views;
  for_each_view(epoch.observed, epoch.arrival,
                [&](const receiver::SatelliteObservation& s, const propagation::SatelliteView& seen) {
                  views[s.id] = &seen;
                });
  for (const receiver::SatelliteObservation& s : epoch.observed.satellites) {
    const auto index = std::lower_bound(known.begin(), known.end(), s.id);
    if (index == known.end() || *index != s.id) continue;
    const bool excluded = std::find(fix.excluded.begin(), fix.excluded.end(), s.id) != fix.excluded.end();
    double residual_m = kNone;
    const auto used = std::lower_bound(fix.used.begin(), fix.used.end(), s.id);
    const auto at = static_cast<std::size_t>(used - fix.used.begin());
    if (fix.solved() && used != fix.used.end() && *used == s.id && at < fix.residuals_m.size()) {
      residual_m = fix.residuals_m[at];
    }
    const auto found = views.find(s.id);
    const std::size_t count = found == views.end() ? 0 : add_paths(s, *found->second);
    const auto& m = s.measurement;
    satellites.add({static_cast<double>(number), static_cast<double>(index - known.begin()),
                    geodesy::degrees(s.azimuth_rad), geodesy::degrees(s.elevation_rad),
                    static_cast<double>(s.visibility),
                    static_cast<double>((s.above_mask ? view::kAboveMask : 0) | (s.used ? view::kUsed : 0) |
                                        (m ? view::kMeasured : 0) | (excluded ? view::kExcluded : 0)),
                    static_cast<double>(s.lock), value_or_nan(m ? m->cn0_dbhz : std::nullopt),
                    value_or_nan(s.cn0_dbhz), has_tracked_excess(s) ? s.excess_m : kNone,
                    m ? s.pseudorange_error_m : kNone, residual_m, static_cast<double>(count)});
  }
}

void EpochRows::add_bodies(const std::vector<propagation::Body>& about, std::size_t number) {
  for (const propagation::Body& body : about) {
    bodies.add({static_cast<double>(number), static_cast<double>(body.kind), in_steps(body.centre.x(), 64),
                in_steps(body.centre.y(), 64), in_steps(body.bottom_m, 64), in_steps(body.top_m, 64),
                in_steps(geodesy::degrees(std::atan2(body.ahead.y(), body.ahead.x())), 64),
                in_steps(2 * body.half_length_m, 64), in_steps(2 * body.half_width_m, 64)});
  }
}

/// Returns how many were kept.
std::size_t EpochRows::add_paths(const receiver::SatelliteObservation& satellite,
                                 const propagation::SatelliteView& view) {
  struct Kept {
    const propagation::Path* path;
    double loss_db;
  };
  std::vector<Kept> kept;
  for (const propagation::Path& path : view.paths.paths) {
    const double amplitude = std::abs(first_signal_amplitude(satellite, view, path, signal_));
    kept.push_back({&path, amplitude > 0 ? -20 * std::log10(amplitude) : kNone});
  }
  // The first stays in front: it is the direct one, or the shortest detour. Ties and what has no strength
  // stay in order of their detours.
  if (kept.size() > paths_per_satellite_) {
    const auto strength = [](const Kept& k) {
      return std::isnan(k.loss_db) ? std::numeric_limits<double>::infinity() : k.loss_db;
    };
    std::stable_sort(kept.begin() + 1, kept.end(),
                     [&](const Kept& a, const Kept& b) { return strength(a) < strength(b); });
    kept.resize(paths_per_satellite_);
  }
  const auto place = [](const Eigen::Vector3d& point, bool known, int axis) {
    return known ? in_steps(point[axis], 64) : kNone;
  };
  for (const Kept& k : kept) {
    const propagation::Path& p = *k.path;
    const bool has_point =
        p.kind != propagation::PathKind::Direct && p.kind != propagation::PathKind::Transmitted;
    const bool has_far = p.order > 1;
    paths.add({static_cast<double>(p.kind), static_cast<double>(p.order), in_steps(p.excess_m, 1024),
               in_steps(k.loss_db, 64), place(p.point, has_point, 0), place(p.point, has_point, 1),
               place(p.point, has_point, 2), place(p.far_point, has_far, 0), place(p.far_point, has_far, 1),
               place(p.far_point, has_far, 2)});
  }
  return kept.size();
}

}  // namespace canyon::output
