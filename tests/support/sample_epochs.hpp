#pragma once

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/simulation/epoch.hpp"

namespace canyon::test {

/// A manually made satellite observation of a receiver.
inline receiver::SatelliteObservation sample_satellite(const std::string& id, double azimuth_deg,
                                                       double elevation_deg,
                                                       propagation::Visibility visibility,
                                                       double excess_m = 0, bool used = true) {
  receiver::SatelliteObservation satellite;
  satellite.id = *gnss::parse_satellite(id);
  satellite.azimuth_rad = geodesy::radians(azimuth_deg);
  satellite.elevation_rad = geodesy::radians(elevation_deg);
  satellite.visibility = visibility;
  satellite.excess_m = excess_m;
  satellite.above_mask = elevation_deg >= 10;
  if (visibility != propagation::Visibility::Blocked && satellite.above_mask) {
    positioning::Measurement measurement;
    measurement.id = satellite.id;
    measurement.pseudorange_m = 2.1e7 + 1000.12345 * satellite.id.number + excess_m;
    measurement.doppler_hz = -1234.5678 + satellite.id.number;
    measurement.carrier_frequency_hz = gnss::l1_frequency_hz(satellite.id.system, 1);
    measurement.sigma_m = 1.5;
    satellite.measurement = measurement;
    satellite.noise_m = 0.25;
    satellite.pseudorange_error_m = excess_m + 0.25;
    satellite.used = used;
  }
  return satellite;
}

/// An epoch of receiver 0: five systems, LOS, multipath, NLOS, blocked and low satellites. Without `fix`: the
/// same satellites, but no solution.
inline simulation::Epoch sample_epoch(geodesy::GpsTime time, const geodesy::Geodetic& truth,
                                      const Eigen::Vector3d& error_enu_m, bool fix = true) {
  using propagation::Visibility;
  simulation::Epoch epoch;
  epoch.truth.time = time;
  epoch.truth.position = truth;
  epoch.truth.velocity_enu_mps = {3.0, -4.0, 0.5};
  epoch.truth_ecef = geodesy::ecef_from_geodetic(truth);
  receiver::ReceiverEpoch& seen = epoch.observed;
  seen.time = time;
  seen.receiver_time = time + 0.00012345678;  // 123456.78 ns: not a multiple of 100
  seen.clock_bias_s = 0.00012345678;
  seen.satellites = {
      sample_satellite("G05", 45.5, 60.2, Visibility::LOS),
      sample_satellite("G12", 359.7, 30.0, Visibility::LOSMultipath),
      sample_satellite("G17", 200.0, 15.5, Visibility::NLOS, 35.25),
      sample_satellite("G24", 90.0, 5.0, Visibility::LOS),
      sample_satellite("G31", 120.0, 25.0, Visibility::Blocked),
      sample_satellite("R01", 10.0, 40.0, Visibility::LOS),
      sample_satellite("R24", 310.0, 55.0, Visibility::LOS),
      sample_satellite("E11", 250.0, 70.0, Visibility::LOS),
      sample_satellite("E36", 180.0, 33.0, Visibility::NLOS, 12.5, false),
      sample_satellite("C03", 220.0, 48.0, Visibility::LOS),
      sample_satellite("C30", 80.0, 20.0, Visibility::LOS),
      sample_satellite("J02", 60.0, 80.0, Visibility::LOS),
  };
  for (auto& satellite : seen.satellites) {
    if (!fix) satellite.used = false;
    if (!satellite.above_mask) continue;
    ++(satellite.measurement ? seen.visible : seen.blocked);
  }
  if (!fix) {
    seen.fix.status = positioning::FixStatus::TooFewSatellites;
    return epoch;
  }
  epoch.error_enu_m = error_enu_m;
  seen.fix.status = positioning::FixStatus::Fix;
  seen.fix.position_ecef =
      epoch.truth_ecef + geodesy::enu_from_ecef_rotation(truth).transpose() * error_enu_m;
  seen.fix.position = geodesy::geodetic_from_ecef(seen.fix.position_ecef);
  seen.fix.covariance_enu << 4.0, 1.5, 0.2, 1.5, 2.25, 0.1, 0.2, 0.1, 9.0;
  seen.fix.velocity_enu_mps = Eigen::Vector3d(3.1, -4.2, 0.4);
  seen.fix.dop = positioning::Dop{2.5, 2.1, 1.25, 1.6875, 1.356};
  for (const auto& satellite : seen.satellites) {
    if (!satellite.used) continue;
    seen.fix.used.push_back(satellite.id);
    seen.fix.residuals_m.push_back(0.5);
    seen.fix.clock_bias_s[satellite.id.system] = 1.2345e-4;
  }
  return epoch;
}

/// A position filter's prediction: without satellites of the epoch and without DOP.
inline simulation::Epoch predicted(simulation::Epoch epoch) {
  for (auto& satellite : epoch.observed.satellites) satellite.used = false;
  positioning::Fix& fix = epoch.observed.fix;
  fix.used.clear();
  fix.residuals_m.clear();
  fix.dop.reset();
  return epoch;
}

/// An epoch whose fix has corrections 1.6 s old of station 7.
inline simulation::Epoch corrected(simulation::Epoch epoch, positioning::FixKind solution) {
  positioning::Fix& fix = epoch.observed.fix;
  fix.solution = solution;
  fix.correction_age_s = 1.6;
  fix.correction_station = 7;
  return epoch;
}

/// With a vector from a base by carrier phases [m]; standard deviations of 2 mm east, 3 mm north, 5 mm up.
inline simulation::Epoch with_baseline(simulation::Epoch epoch, positioning::FixKind kind, bool moving_base,
                                       const Eigen::Vector3d& vector_enu = {-0.6012, 0.80456, -0.1234}) {
  positioning::Fix& fix = epoch.observed.fix;
  positioning::Baseline& baseline = fix.baseline.emplace();
  baseline.kind = kind;
  baseline.moving_base = moving_base;
  baseline.vector_enu = vector_enu;
  baseline.base_ecef =
      fix.position_ecef - geodesy::enu_from_ecef_rotation(fix.position).transpose() * vector_enu;
  baseline.covariance_enu = Eigen::Vector3d(4e-6, 9e-6, 2.5e-5).asDiagonal();
  baseline.ratio = 4.5;
  baseline.used = fix.used;
  return epoch;
}

inline geodesy::Geodetic sample_point() {
  return geodesy::Geodetic::from_degrees(22.298251, 114.178761, 12.345);
}

/// 2019-04-28 12:58:21 GPST, 12:58:03 UTC.
inline geodesy::GpsTime sample_time() {
  return geodesy::GpsTime::from_week(2051, 46701);
}

}  // namespace canyon::test
