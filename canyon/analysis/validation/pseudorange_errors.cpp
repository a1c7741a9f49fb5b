#include "canyon/analysis/validation/pseudorange_errors.hpp"

#include <fmt/format.h>

#include <cmath>

#include "canyon/analysis/validation/statistics.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/sky/range_errors.hpp"

namespace canyon::validation {
namespace {

using geodesy::GpsTime;
using geodesy::kSpeedOfLight;
using gnss::System;

/// Upper bound of pseudoranges, whatever the receiver's clock does [m].
constexpr double kMax_m = 1e12;

/// A satellite at the transmission of its signal.
struct Sent {
  const rinex::ObservedSignal* observed = nullptr;
  const gnss::Signal* signal = nullptr;
  orbit::SatelliteState state;

  /// The signal's clock minus GPS time.
  [[nodiscard]] double clock_s() const { return state.clock_bias_s - state.group_delay_of(*signal); }
};

Eigen::Vector3d antenna_ecef(const simulation::Pose& pose, const Eigen::Vector3d& lever_arm) {
  const Eigen::Vector3d point = geodesy::ecef_from_geodetic(pose.position);
  if (lever_arm.isZero(0)) return point;
  const double c = std::cos(pose.yaw_rad), s = std::sin(pose.yaw_rad);
  const Eigen::Vector3d enu(c * lever_arm.x() - s * lever_arm.y(), s * lever_arm.x() + c * lever_arm.y(),
                            lever_arm.z());
  return point + geodesy::enu_from_ecef_rotation(pose.position).transpose() * enu;
}

}  // namespace

std::vector<std::string> PseudorangeResiduals::warnings() const {
  std::vector<std::string> lines;
  const auto count = [&lines](std::size_t n, const char* what) {
    if (n > 0) lines.push_back(fmt::format("{} {}", n, what));
  };
  count(epochs_outside_truth, "epochs outside the truth's span, or in a pause of it, left out");
  count(without_pseudorange, "signals without a pseudorange left out");
  count(below_horizon, "pseudoranges of satellites below the horizon left out");
  for (const auto& [id, n] : without_ephemeris) {
    lines.push_back(
        fmt::format("{} pseudoranges of {} left out: no valid ephemeris", n, gnss::to_string(id)));
  }
  return lines;
}

PseudorangeResiduals pseudorange_residuals(std::span<const rinex::ObservationEpoch> epochs,
                                           const simulation::Trajectory& truth, const orbit::Sky& sky,
                                           const std::map<System, gnss::Klobuchar>& klobuchar,
                                           const ResidualOptions& options) {
  PseudorangeResiduals result;
  std::vector<Sent> sent;
  std::vector<PseudorangeResidual> row, further;
  std::vector<double> values;
  for (std::size_t index = 0; index < epochs.size(); ++index) {
    const rinex::ObservationEpoch& recorded = epochs[index];
    sent.clear();
    std::size_t missing = 0;
    std::vector<gnss::SatelliteId> unknown;
    for (const rinex::ObservedSignal& signal : recorded.signals) {
      if (!signal.pseudorange_m || !(std::abs(*signal.pseudorange_m) < kMax_m)) {
        ++missing;
        continue;
      }
      // The satellite's own clock had the time tag - P / c at transmission (docs/receiver.md, Fix).
      const GpsTime shown = recorded.receiver_time - *signal.pseudorange_m / kSpeedOfLight;
      Sent s{&signal, signal.first() ? gnss::signals_of(signal.id.system).data() : signal.signal, {}};
      std::optional<orbit::SatelliteState> state = sky.state(signal.id, shown);
      if (state) {
        s.state = *state;
        state = sky.state(signal.id, shown - s.clock_s());
      }
      if (state) {
        s.state = *state;
        sent.push_back(s);
      } else {
        unknown.push_back(signal.id);
      }
    }

    ResidualEpoch epoch;
    epoch.recorded = index;
    epoch.receiver_time = recorded.receiver_time;
    epoch.reception = recorded.receiver_time;
    epoch.first = result.observations.size();
    epoch.first_further = result.further.size();
    // The first pass finds the clock, and so the time of the antenna's position; an error of a metre in one
    // has a negligible effect on the other, so two passes suffice.
    std::size_t low = 0;
    for (int pass = 0; pass < 3; ++pass) {
      const simulation::Pose pose = truth.at(epoch.reception);
      epoch.antenna_ecef = antenna_ecef(pose, options.lever_arm_m);
      epoch.antenna = geodesy::geodetic_from_ecef(epoch.antenna_ecef);
      const Eigen::Matrix3d enu_from_ecef = geodesy::enu_from_ecef_rotation(epoch.antenna);
      row.clear();
      further.clear();
      values.clear();
      low = 0;
      for (const Sent& s : sent) {
        Eigen::Vector3d line = s.state.position_m - epoch.antenna_ecef;
        for (int i = 0; i < 3; ++i)
          line = orbit::rotate_earth(s.state.position_m, line.norm() / kSpeedOfLight) - epoch.antenna_ecef;
        const double range = line.norm();
        PseudorangeResidual o;
        o.epoch = result.epochs.size();
        o.id = s.observed->id;
        o.signal = s.signal;
        o.pseudorange_m = *s.observed->pseudorange_m;
        o.lost_lock = (s.observed->loss_of_lock & 1U) != 0 || recorded.power_failure;
        o.cn0_dbhz = s.observed->cn0_dbhz;
        o.direction_ecef = line / range;
        const auto look_angles = geodesy::azimuth_elevation_from_enu(enu_from_ecef * o.direction_ecef);
        o.azimuth_rad = look_angles.azimuth_rad;
        o.elevation_rad = look_angles.elevation_rad;
        if (o.elevation_rad <= 0) {
          ++low;
          continue;
        }
        const double carrier_hz = gnss::carrier_hz(*s.signal, s.state.carrier_frequency_hz);
        double ionosphere = 0, troposphere = 0;
        if (options.ionosphere) {
          ionosphere =
              sky::klobuchar_delay_m(sky::klobuchar_of(klobuchar, o.id.system), recorded.receiver_time,
                                     epoch.antenna, o.azimuth_rad, o.elevation_rad, carrier_hz);
        }
        if (options.troposphere) troposphere = sky::saastamoinen_delay_m(epoch.antenna, o.elevation_rad);
        const double clock_m = kSpeedOfLight * s.clock_s();
        // Ranges first: they are nearly equal, so their difference keeps its digits.
        o.residual_m = (o.pseudorange_m - range) + clock_m - (ionosphere + troposphere);
        if (s.observed->carrier_phase_cycles) {
          const double phase_m = *s.observed->carrier_phase_cycles * (kSpeedOfLight / carrier_hz);
          o.phase_residual_m = (phase_m - range) + clock_m + ionosphere - troposphere;
        }
        if (!s.observed->first()) {
          further.push_back(o);
          continue;
        }
        row.push_back(o);
        values.push_back(o.residual_m);
      }
      if (row.empty()) break;
      const GpsTime reception = recorded.receiver_time - *median(values) / kSpeedOfLight;
      const bool converged = std::abs(reception - epoch.reception) < 1e-6;
      epoch.reception = reception;
      if (converged) break;
    }
    if (!truth.covers(epoch.reception)) {
      ++result.epochs_outside_truth;
      continue;
    }
    result.without_pseudorange += missing;
    result.below_horizon += low;
    for (const gnss::SatelliteId id : unknown) ++result.without_ephemeris[id];
    if (row.empty()) continue;
    epoch.count = row.size();
    epoch.further = further.size();
    result.observations.insert(result.observations.end(), row.begin(), row.end());
    result.further.insert(result.further.end(), further.begin(), further.end());
    result.epochs.push_back(epoch);
  }
  return result;
}

}  // namespace canyon::validation
