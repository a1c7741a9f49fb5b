#pragma once

#include "tests/support/sample_epochs.hpp"

namespace canyon::test {

/// sample_epoch() of a receiver with strength and phase. All received signals are tracked at C/N0 46.3,
/// 45.3, ... dB-Hz in order of satellites (at the correlator 0.25 dB more), E36 (NLOS) at 22.4; phases are
/// continuous since `phase_since`, except G12, which has no phase. G31 is being searched. RAIM has excluded
/// E36, and its test passes.
inline simulation::Epoch sample_signal_epoch(geodesy::GpsTime time, geodesy::GpsTime phase_since,
                                             const Eigen::Vector3d& error_enu_m = {1, -2, 3}) {
  simulation::Epoch epoch = sample_epoch(time, sample_point(), error_enu_m);
  double cn0_dbhz = 46.3;
  for (receiver::SatelliteObservation& s : epoch.observed.satellites) {
    if (s.visibility == propagation::Visibility::Blocked) continue;
    s.lock = tracking::LockState::Tracking;
    const double reported = gnss::to_string(s.id) == "E36" ? 22.4 : cn0_dbhz;
    s.cn0_dbhz = reported + 0.25;
    cn0_dbhz -= 1;
    if (!s.measurement) continue;
    s.measurement->cn0_dbhz = reported;
    if (gnss::to_string(s.id) == "G12") continue;
    s.measurement->carrier_phase_cycles = 1234.5678 + s.id.number;
    s.measurement->carrier_phase_sigma_cycles = 0.01;
    s.measurement->phase_since = phase_since;
  }
  epoch.observed.fix.excluded = {*gnss::parse_satellite("E36")};
  epoch.observed.fix.consistent = true;
  return epoch;
}

}  // namespace canyon::test
