#pragma once

#include <Eigen/Geometry>
#include <utility>

#include "adapters/common/ros_names.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/outputs/live/epoch_publisher.hpp"
#include "tests/support/sample_signals.hpp"

namespace canyon::test {

/// A report with distinct non-zero values in every field, which owns its step. Satellites and fix are those
/// of tests/support/sample_epochs.hpp, with a fix also strengths, phases since 12.5 s ago and RAIM of
/// sample_signals.hpp; G05 (LOS) has a direct path, G17 (NLOS) one reflection.
struct SampleReport {
  simulation::ReceiverRunner::Step step;
  live::ReceiverReport report;

  /// Reflection point of G17 in ENU [m].
  static Eigen::Vector3d reflection_enu() { return {12.0, -34.0, 5.6}; }

  explicit SampleReport(bool fix = true) {
    simulation::Epoch& epoch = step.epoch;
    const geodesy::GpsTime time = sample_time();
    epoch = fix ? sample_signal_epoch(time, time - 12.5, {1.25, -2.5, 3.75})
                : sample_epoch(time, sample_point(), {1.25, -2.5, 3.75}, false);
    epoch.faults = {"jammer", "outage 2"};
    epoch.observed.clock_bias_s = 1.5e-4;
    epoch.observed.clock_drift = 2.5e-8;
    epoch.observed.fix.available = 11;
    if (fix) {
      epoch.observed.fix.velocity_covariance_enu.emplace();
      *epoch.observed.fix.velocity_covariance_enu << 0.01, 0.001, 0.002, 0.001, 0.02, 0.003, 0.002, 0.003,
          0.03;
      epoch.observed.fix.clock_drift = 2.625e-8;
      epoch.observed.fix.clock_bias_s[gnss::System::GLONASS] = 1.25e-4;
    }
    for (const auto& satellite : epoch.observed.satellites) {
      propagation::SatelliteView view;
      view.line.id = satellite.id;
      view.line.azimuth_rad = satellite.azimuth_rad;
      view.line.elevation_rad = satellite.elevation_rad;
      view.paths.visibility = satellite.visibility;
      if (satellite.visibility == propagation::Visibility::LOS) {
        propagation::Path path;
        path.arrival = geodesy::enu_from_azimuth_elevation(satellite.azimuth_rad, satellite.elevation_rad);
        view.paths.paths.push_back(path);
      } else if (satellite.visibility == propagation::Visibility::NLOS) {
        propagation::Path path;
        path.kind = propagation::PathKind::Reflected;
        path.excess_m = satellite.excess_m;
        path.point = reflection_enu();
        path.arrival = geodesy::enu_from_azimuth_elevation(0.75, 0.5);
        path.incidence_count = 2;
        path.incidences[0].incidence_rad = 0.375;
        path.incidences[1].incidence_rad = 0.625;
        path.order = 2;
        path.far_point = {-7.5, 21, 9.25};
        view.paths.paths.push_back(path);
      }
      step.arrival.views.push_back(std::move(view));
    }
    report.sim_time_ns = 12'345'678'901;
    report.step = &step;
    report.antenna_world_m = {10.5, -20.25, 2.125};
    report.link_attitude_world = {0.5, -0.5, 0.5, 0.5};
    report.world_yaw_from_enu_rad = 0.5;
    report.scan_max_range_m = 150;
    for (int i = 0; i < 24; ++i) report.scan_ranges_m.push_back(i + 0.5);
    report.scan_ranges_m[1] = std::numeric_limits<double>::infinity();
  }
  SampleReport(const SampleReport&) = delete;
  SampleReport& operator=(const SampleReport&) = delete;
};

inline adapters::ReceiverIdentity sample_identity() {
  return {"city", "iris", "iris::gps0::link", "gps0", "gps", "gps_plugin"};
}

}  // namespace canyon::test
