#pragma once

#include <algorithm>
#include <complex>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/paths/propagation/paths.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/receiver/tracking/signal_options.hpp"
#include "canyon/simulation/epoch.hpp"

namespace canyon::encoding {

/// "free", "inside building", "under terrain".
[[nodiscard]] std::string_view containment_word(raytrace::Containment containment);

/// "fix" or "no fix"; always "no fix" for an unsolved fix, whatever its other members are.
[[nodiscard]] inline std::string_view status_word(const positioning::Fix& fix) {
  return positioning::name(fix.status);
}

/// Reason why there is no fix, as text: "too few satellites". @param containment of the antenna
[[nodiscard]] std::string_view no_fix_reason(const positioning::Fix& fix, raytrace::Containment containment);

/// Satellites in the position: 0 without a position.
[[nodiscard]] inline std::size_t used_count(const positioning::Fix& fix) {
  return fix.solved() ? fix.used.size() : 0;
}

/// Whether RAIM or the position filter excluded the satellite from the fix.
[[nodiscard]] inline bool is_excluded(const positioning::Fix& fix, gnss::SatelliteId id) {
  return std::find(fix.excluded.begin(), fix.excluded.end(), id) != fix.excluded.end();
}

/// Whether a satellite's `excess_m` is meaningful: its signal arrives and, if signals have strength, the
/// receiver is locked on to it.
[[nodiscard]] inline bool has_tracked_excess(const receiver::SatelliteObservation& satellite) {
  return satellite.visibility != propagation::Visibility::Blocked &&
         !(satellite.cn0_dbhz && satellite.lock != tracking::LockState::Tracking);
}

/// Whether the receiver measured any of the satellite's signals.
[[nodiscard]] bool measured(const receiver::SatelliteObservation& satellite);

/// Whether a fixed position is off by more than 0.1 m horizontally or 0.2 m vertically, plus 1 and 2 ppm of
/// the baseline: half a wavelength or more, so that an integer ambiguity must be wrong. Empty if not fixed.
[[nodiscard]] std::optional<bool> wrong_fix(const simulation::Epoch& epoch);

/// Azimuth of the vector between two antennas of a vehicle, from the base's to the receiver's, if the
/// ambiguities are fixed [deg], in [0, 360) also after rounding to `decimals`. With float ambiguities it
/// would be off by many degrees.
[[nodiscard]] std::optional<double> heading_deg(const positioning::Fix& fix, int decimals);

/// An azimuth [rad] in degrees, in [0, 360) also after rounding to `decimals`.
[[nodiscard]] double wrapped_azimuth_deg(double azimuth_rad, int decimals);

/// "jammer; outage 2"; names have no semicolon.
[[nodiscard]] std::string fault_names(const std::vector<std::string>& faults);

/// Horizontal error [m] of an east-north-up error; NaN stays NaN.
[[nodiscard]] double horizontal_m(const Eigen::Vector3d& error_enu_m);

/// Amplitude of a path of the satellite's first tracked signal, relative to its clear line of sight
/// (signal::path_amplitude()); 0 if signals have no strength.
[[nodiscard]] std::complex<double> first_signal_amplitude(const receiver::SatelliteObservation& satellite,
                                                          const propagation::SatelliteView& view,
                                                          const propagation::Path& path,
                                                          const tracking::SignalOptions& signal);

/// Calls `take(satellite, view)` for each satellite of an epoch with known paths; no calls without `arrival`.
template <typename RowHandler>
void for_each_view(const receiver::ReceiverEpoch& observed, const propagation::Arrival* arrival,
                   const RowHandler& take) {
  if (arrival == nullptr) return;
  auto satellite = observed.satellites.begin();
  const auto end = observed.satellites.end();
  for (const propagation::SatelliteView& view : arrival->views) {  // both are ascending
    while (satellite != end && satellite->id < view.line.id) ++satellite;
    if (satellite == end) break;
    if (satellite->id == view.line.id) take(*satellite, view);
  }
}

}  // namespace canyon::encoding
