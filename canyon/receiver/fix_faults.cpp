#include "canyon/receiver/fix_faults.hpp"

#include "canyon/base/geodesy/frames.hpp"

namespace canyon::receiver {
namespace {

positioning::Fix without_fix(const positioning::Fix& fix) {
  positioning::Fix none;
  none.available = fix.available;
  none.fusion = fix.fusion;
  return none;
}

/// Reports a forced fix. Satellites and clock stay those of the computed one; if it has none, all above the
/// mask count as used. A vector from a base stays if it has the forced quality.
void force(const disturbance::ForcedFix& forced, const propagation::Antenna& antenna, ReceiverEpoch& epoch) {
  positioning::Fix& fix = epoch.fix;
  if (forced.kind == positioning::FixKind::None) {
    fix = without_fix(fix);
    return;
  }
  if (!fix.measured()) {
    std::vector<Eigen::Vector3d> directions;
    for (const SatelliteObservation& satellite : epoch.satellites) {
      if (!satellite.above_mask) continue;
      fix.used.push_back(satellite.id);
      fix.clock_bias_s[satellite.id.system] = epoch.clock_bias_s;
      directions.push_back(
          geodesy::enu_from_azimuth_elevation(satellite.azimuth_rad, satellite.elevation_rad));
    }
    fix.dop = positioning::dop_of_directions(directions);
    fix.clock_drift = epoch.clock_drift;
    fix.available = static_cast<int>(fix.used.size());
  }
  const geodesy::Geodetic truth = geodesy::geodetic_from_ecef(antenna.position_ecef);
  const Eigen::Matrix3d enu_from_ecef = geodesy::enu_from_ecef_rotation(truth);
  fix.status = positioning::FixStatus::Fix;
  fix.solution = forced.kind;
  fix.position_ecef = antenna.position_ecef + enu_from_ecef.transpose() * forced.error_m;
  fix.position = geodesy::geodetic_from_ecef(fix.position_ecef);
  fix.covariance_enu = forced.sigma_m.cwiseAbs2().asDiagonal();
  fix.velocity_enu_mps = enu_from_ecef * antenna.velocity_ecef + forced.velocity_error_mps;
  fix.velocity_covariance_enu = forced.velocity_sigma_mps.cwiseAbs2().asDiagonal();
  if (!fix.baseline) return;
  const bool good = fix.baseline->kind >= fix.solution && fix.solution >= positioning::FixKind::Float;
  fix.baseline->kind = fix.solution;
  if (!good) fix.baseline.reset();
}

}  // namespace

void FixFaults::apply(const propagation::Antenna& antenna, ReceiverEpoch& epoch) {
  if (epoch.events.forced) force(*epoch.events.forced, antenna, epoch);
  fix_.apply(epoch, epoch.fix);
  single_epoch_.apply(epoch, epoch.single_epoch);
  epoch.update_used();
}

void FixFaults::Edits::apply(const ReceiverEpoch& epoch, positioning::Fix& fix) {
  constexpr double kOutage_s = 2;
  if (fix.solved()) {
    if (last && epoch.time - *last > kOutage_s) back = epoch.time;
    last = epoch.time;
  }
  fixes.add(epoch.time, fix, epoch.events);
  for (const disturbance::FixEdit& each : epoch.events.fix_edits) {
    if (each.after_outage_s && !(back && epoch.time - *back < *each.after_outage_s)) continue;
    if (each.of) {
      const positioning::Fix* then = fixes.find(each);
      fix = then != nullptr ? *then : without_fix(fix);
    }
    if (each.dropped) {
      fix = without_fix(fix);
    } else if (fix.solved()) {
      positioning::add_offset(fix, each.offset_m);
      if (each.kind) fix.solution = *each.kind;
      const double factor = each.sigma_factor * each.sigma_factor;
      fix.covariance_enu *= factor;
      if (fix.velocity_covariance_enu) *fix.velocity_covariance_enu *= factor;
      if (each.sigma_m)
        fix.covariance_enu = Eigen::Vector3d::Constant(*each.sigma_m * *each.sigma_m).asDiagonal();
      if (each.without_satellites) {
        fix.used.clear();
        fix.claimed = true;
      }
    }
  }
}

}  // namespace canyon::receiver
