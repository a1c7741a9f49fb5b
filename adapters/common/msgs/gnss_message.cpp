#include "adapters/common/msgs/gnss_message.hpp"

#include <Eigen/Geometry>

#include "canyon/outputs/encoding/epoch_values.hpp"

namespace canyon::adapters {
namespace {

using geodesy::degrees;

/// A message's constant for a value of the engine's enumeration; both have the same order.
template <class Code, class Enum, std::size_t N>
Code code_of(Enum value, const Code (&codes)[N]) {
  const auto position = static_cast<std::size_t>(value);
  return codes[position < N ? position : 0];
}

msgs::GnssSystem system_of(gnss::System system) {
  return code_of(system, {msgs::GPS, msgs::GLONASS, msgs::GALILEO, msgs::BEIDOU, msgs::QZSS, msgs::SBAS});
}

void fill_geodetic(const geodesy::Geodetic& point, msgs::GnssGeodetic& message) {
  message.set_latitude_deg(degrees(point.latitude_rad));
  message.set_longitude_deg(degrees(point.longitude_rad));
  message.set_height_m(point.height_m);
}

void fill_enu(const Eigen::Vector3d& enu, msgs::GnssEnu& message) {
  message.set_east(enu.x());
  message.set_north(enu.y());
  message.set_up(enu.z());
}

template <typename Field>
void fill_rows(const Eigen::Matrix3d& matrix, Field& field) {
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) field.Add(matrix(row, column));
}

void fill_path(const propagation::Path& path, const Eigen::Matrix3d& world_from_enu,
               msgs::GnssPath& message) {
  message.set_excess_m(path.excess_m);
  const auto arrival = geodesy::azimuth_elevation_from_enu(path.arrival);
  message.set_arrival_azimuth_rad(arrival.azimuth_rad);
  message.set_arrival_elevation_rad(arrival.elevation_rad);
  using P = msgs::GnssPath;
  message.set_kind(code_of(path.kind, {P::DIRECT, P::REFLECTED, P::DIFFRACTED, P::DIFFUSE, P::SPOOFED}));
  if (path.kind == propagation::PathKind::Direct) return;
  if (path.kind == propagation::PathKind::Reflected) message.set_incidence_rad(path.incidence_rad());
  const auto set_point = [&](const Eigen::Vector3d& enu, msgs::GnssWorldPoint& to) {
    const Eigen::Vector3d point = world_from_enu * enu;
    to.set_x(point.x());
    to.set_y(point.y());
    to.set_z(point.z());
  };
  set_point(path.point, *message.mutable_reflection_point_world_m());
  if (path.order < 2) return;
  set_point(path.far_point, *message.mutable_far_reflection_point_world_m());
  message.set_far_incidence_rad(path.far_incidence_rad());
}

void fill_satellite(const receiver::SatelliteObservation& seen, const receiver::ReceiverEpoch& epoch,
                    msgs::GnssSatellite& message) {
  using S = msgs::GnssSatellite;
  message.set_id(gnss::to_string(seen.id));
  message.set_system(system_of(seen.id.system));
  message.set_number(seen.id.number);
  message.set_azimuth_rad(seen.azimuth_rad);
  message.set_elevation_rad(seen.elevation_rad);
  message.set_visibility(code_of(seen.visibility, {S::LOS, S::LOS_MULTIPATH, S::NLOS, S::BLOCKED}));
  message.set_above_mask(seen.above_mask);
  message.set_excess_m(seen.excess_m);
  message.set_used(seen.used);
  message.set_lock(code_of(seen.lock, {S::SEARCHING, S::TRACKING, S::HOLDING}));
  if (seen.cn0_dbhz) message.set_true_cn0_dbhz(*seen.cn0_dbhz);
  message.set_excluded(encoding::is_excluded(epoch.fix, seen.id));
  if (!seen.measurement) return;
  message.set_pseudorange_m(seen.measurement->pseudorange_m);
  if (seen.measurement->doppler_hz) message.set_doppler_hz(*seen.measurement->doppler_hz);
  message.set_carrier_frequency_hz(seen.measurement->carrier_frequency_hz);
  message.set_sigma_m(seen.measurement->sigma_m);
  message.set_noise_m(seen.noise_m);
  message.set_pseudorange_error_m(seen.pseudorange_error_m);
  if (seen.measurement->cn0_dbhz) message.set_cn0_dbhz(*seen.measurement->cn0_dbhz);
  if (!seen.measurement->carrier_phase_cycles) return;
  message.set_carrier_phase_cycles(*seen.measurement->carrier_phase_cycles);
  if (seen.measurement->phase_since) message.set_phase_lock_s(epoch.time - *seen.measurement->phase_since);
}

void fill_baseline(const positioning::Baseline& baseline, msgs::GnssBaseline& message) {
  message.set_fixed(baseline.kind == positioning::FixKind::Fixed);
  message.set_moving_base(baseline.moving_base);
  fill_enu(baseline.vector_enu, *message.mutable_vector_enu_m());
  fill_rows(baseline.covariance_enu, *message.mutable_covariance_enu_m2());
  if (baseline.ratio) message.set_ambiguity_ratio(*baseline.ratio);
  if (!baseline.moving_base) return;
  message.set_heading_rad(baseline.heading_rad());
  message.set_heading_sigma_rad(baseline.heading_sigma_rad());
}

void fill_fix(const simulation::Epoch& epoch, msgs::GnssFix& message) {
  const positioning::Fix& fix = epoch.observed.fix;
  using F = msgs::GnssFix;
  message.set_status(code_of(fix.status, {F::NOT_SOLVED, F::FIX, F::TOO_FEW_SATELLITES, F::SINGULAR,
                                          F::NOT_CONVERGED, F::WEAK_GEOMETRY, F::NO_SIGNAL}));
  message.set_reason(std::string(encoding::no_fix_reason(fix, epoch.containment)));
  message.set_kind(code_of(
      fix.kind(), {F::NONE, F::SINGLE, F::DIFFERENTIAL, F::FLOAT, F::FIXED, F::DEAD_RECKONING, F::COMBINED}));
  if (corrected(fix.kind())) {
    if (fix.correction_age_s) message.set_correction_age_s(*fix.correction_age_s);
    if (fix.correction_station)
      message.set_correction_station(static_cast<std::uint32_t>(*fix.correction_station));
  }
  message.set_available(static_cast<std::uint32_t>(fix.available));
  for (const auto id : fix.excluded) message.add_excluded(gnss::to_string(id));
  if (fix.consistent) message.set_consistent(*fix.consistent);
  if (!fix.solved()) return;
  fill_geodetic(fix.position, *message.mutable_position());
  fill_rows(fix.covariance_enu, *message.mutable_covariance_enu_m2());
  if (fix.velocity_enu_mps) fill_enu(*fix.velocity_enu_mps, *message.mutable_velocity_enu_mps());
  if (fix.velocity_covariance_enu)
    fill_rows(*fix.velocity_covariance_enu, *message.mutable_velocity_covariance_enu_m2ps2());
  if (fix.dop) {
    msgs::GnssDop& dop = *message.mutable_dop();
    dop.set_gdop(fix.dop->gdop);
    dop.set_pdop(fix.dop->pdop);
    dop.set_hdop(fix.dop->hdop);
    dop.set_vdop(fix.dop->vdop);
    dop.set_tdop(fix.dop->tdop);
  }
  for (const auto& [system, bias_s] : fix.clock_bias_s) {
    msgs::GnssClockBias& bias = *message.add_clock_biases();
    bias.set_system(system_of(system));
    bias.set_bias_s(bias_s);
  }
  if (fix.clock_drift) message.set_clock_drift(*fix.clock_drift);
  for (const auto id : fix.used) message.add_used(gnss::to_string(id));
  for (const double residual : fix.residuals_m) message.add_residuals_m(residual);
  fill_enu(epoch.error_enu_m, *message.mutable_error_enu_m());
  if (fix.baseline) fill_baseline(*fix.baseline, *message.mutable_baseline());
  if (const std::optional<bool> wrong = encoding::wrong_fix(epoch)) message.set_wrong_fix(*wrong);
}

}  // namespace

void fill_gnss_message(const ReceiverIdentity& identity, const live::ReceiverReport& report,
                       msgs::GnssReceiver& message) {
  message.Clear();
  message.set_sim_time_ns(report.sim_time_ns);
  message.set_model(identity.model);
  message.set_link(identity.link);
  message.set_sensor(identity.sensor);
  if (report.step == nullptr) {
    message.set_state(msgs::GnssReceiver::NO_TRUTH);
    message.set_reason(report.reason);
    return;
  }
  const simulation::Epoch& epoch = report.step->epoch;
  const receiver::ReceiverEpoch& seen = epoch.observed;
  if (seen.fix.measured()) {
    message.set_state(msgs::GnssReceiver::FIX);
  } else if (seen.fix.solved()) {
    message.set_state(msgs::GnssReceiver::PREDICTION);
    message.set_reason("prediction: no satellite is used");
  } else {
    message.set_state(msgs::GnssReceiver::NO_FIX);
    message.set_reason(std::string(encoding::no_fix_reason(seen.fix, epoch.containment)));
  }
  message.set_gps_week(seen.time.week());
  message.set_gps_time_of_week_ns(seen.time.nanosecond_of_week());

  fill_geodetic(epoch.truth.position, *message.mutable_antenna());
  fill_enu(epoch.truth.velocity_enu_mps, *message.mutable_antenna_velocity_enu_mps());
  const auto& position = report.antenna_world_m;
  auto& point = *message.mutable_antenna_world_m();
  point.set_x(position.x());
  point.set_y(position.y());
  point.set_z(position.z());
  const auto& rotation = report.link_attitude_world;
  auto& attitude = *message.mutable_link_attitude_world();
  attitude.set_w(rotation.w());
  attitude.set_x(rotation.x());
  attitude.set_y(rotation.y());
  attitude.set_z(rotation.z());
  using R = msgs::GnssReceiver;
  message.set_placement(code_of(epoch.containment, {R::FREE, R::INSIDE_BUILDING, R::UNDER_TERRAIN}));
  message.set_clock_bias_s(seen.clock_bias_s);
  message.set_clock_drift(seen.clock_drift);
  for (const std::string& fault : epoch.faults) message.add_faults(fault);

  fill_fix(epoch, *message.mutable_fix());
  message.set_visible(static_cast<std::uint32_t>(seen.visible));
  message.set_blocked(static_cast<std::uint32_t>(seen.blocked));
  const Eigen::Matrix3d world_from_enu =
      Eigen::AngleAxisd(report.world_yaw_from_enu_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  // Both lists are in ascending order of id.
  auto view = report.step->arrival.views.begin();
  const auto views_end = report.step->arrival.views.end();
  for (const auto& satellite : seen.satellites) {
    msgs::GnssSatellite& satellite_message = *message.add_satellites();
    fill_satellite(satellite, seen, satellite_message);
    while (view != views_end && view->line.id < satellite.id) ++view;
    if (view == views_end || view->line.id != satellite.id) continue;
    for (const auto& path : view->paths.paths)
      fill_path(path, world_from_enu, *satellite_message.add_paths());
  }

  if (report.scan_ranges_m.empty()) return;
  for (const double range : report.scan_ranges_m) message.add_scan_ranges_m(range);
  message.set_scan_max_range_m(report.scan_max_range_m);
}

}  // namespace canyon::adapters
