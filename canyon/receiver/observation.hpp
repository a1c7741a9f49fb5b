#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "canyon/paths/disturbance/disturbance.hpp"
#include "canyon/paths/propagation/paths.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/receiver/positioning/range_terms.hpp"
#include "canyon/receiver/tracking/signal_lock.hpp"

namespace canyon::receiver {

/// One signal of a satellite at one epoch.
struct SignalObservation {
  const gnss::Signal* signal = nullptr;  ///< of gnss::signals_of()
  /// Code delay by paths of the tracked signal [m]. With SignalOptions::enabled: the delay of the code loop
  /// (multipath error of a direct signal, either sign; detour of an NLOS one). Else the shortest path's
  /// excess; 0 when blocked or not tracked.
  double excess_m = 0;
  /// True C/N0 at the correlator [dB-Hz], tracked or not; empty if nothing arrives or signals have no
  /// strength (SignalOptions::enabled off). The receiver reports Measurement::cn0_dbhz.
  std::optional<double> cn0_dbhz;
  /// Path whose carrier is tracked; empty if nothing arrives.
  std::optional<propagation::PathKind> tracked_path;
  /// Whether tracked_path is the direct path, and strong enough for tracking without the others.
  bool direct = false;
  /// State of the channel; Tracking for all received signals if signals have no strength.
  tracking::LockState lock = tracking::LockState::Searching;
  /// Empty if the signal is not tracked or the satellite is below the elevation mask.
  std::optional<positioning::Measurement> measurement;
  double noise_m = 0;  ///< OU value and code loop noise in the pseudorange; 0 without measurement
  /// Rate of the code loop's noise: errors tau apart correlate by e^(-rate tau); 0 without it.
  double code_rate_per_s = 0;
  /// Excess + noise + uncorrected errors in space (those in the signal minus the fix's corrections, so
  /// negative if the fix corrects an absent error); 0 without measurement.
  double pseudorange_error_m = 0;
  /// Each term of the pseudorange, in the order of range_terms(); 0 without measurement.
  std::array<double, kRangeTermCount> terms_m{};

  [[nodiscard]] double term_m(RangeTermId id) const { return terms_m[static_cast<std::size_t>(id)]; }
};

/// One satellite at one epoch as seen by the receiver, with the truth: its first tracked signal, and others.
struct SatelliteObservation : SignalObservation {
  gnss::SatelliteId id;
  double azimuth_rad = 0;    ///< true
  double elevation_rad = 0;  ///< true
  /// As seen by this receiver. If signals have a strength: LOS or LOSMultipath if it tracks the direct path
  /// of one of the satellite's signals, and that path alone reaches the tracking threshold
  /// (tracking::SignalLockOptions). Else NLOS if one of the signals reaches it, else Blocked.
  propagation::Visibility visibility = propagation::Visibility::Blocked;
  /// By the map and the bodies near the antenna, independent of strength: SatellitePaths::visibility.
  propagation::Visibility map_visibility = propagation::Visibility::Blocked;
  /// Loss of its direct path by obstacles missing in the map [dB]; >= 0 if they weaken it, 0 without one.
  double obstacles_db = 0;
  bool above_mask = false;
  bool used = false;  ///< in the fix
  /// Estimated slant ionosphere delay at 1575.42 MHz (FixInput::CombinedMeasurement::ionosphere_m) [m].
  std::optional<double> estimated_ionosphere_m;
  /// Signals after the first, in the order of gnss::signals_of(); only with ReceiverOptions::tracks.
  std::vector<SignalObservation> more;

  /// Calls visit(signal) for the first one and each of `more`.
  template <typename Visit>
  void for_each_signal(const Visit& visit) const {
    visit(static_cast<const SignalObservation&>(*this));
    for (const SignalObservation& other : more) visit(other);
  }
  template <typename Visit>
  void for_each_signal(const Visit& visit) {
    visit(static_cast<SignalObservation&>(*this));
    for (SignalObservation& other : more) visit(other);
  }
};

/// The front end around one carrier at one epoch.
struct BandState {
  double carrier_hz = 0;  ///< carrier of its signals, as gnss::Signal::carrier_hz
  /// Ratio of the power of interference in the band to the front end's own noise there [1], >= 0.
  double interference_ratio = 0;
  /// Part of interference_ratio on single frequencies (tones).
  double tone_ratio = 0;

  /// Gain of the automatic gain control relative to that without interference, (0, 1]: it keeps the sum of
  /// noise and interference constant at the converter.
  [[nodiscard]] double agc() const { return 1 / std::sqrt(1 + interference_ratio); }
};

/// A receiver's assessment of the authenticity of its signals.
enum class SpoofingState : std::uint8_t {
  Unknown,    ///< no checks are enabled
  None,       ///< nothing suspicious
  Indicated,  ///< one of its checks failed
  Multiple    ///< both failed
};

struct ReceiverEpoch {
  geodesy::GpsTime time;  ///< true reception instant
  /// Reading of the receiver's clock, to the nearest nanosecond; pseudoranges contain the exact reading (a
  /// satellite moves 2 micrometres in the difference).
  geodesy::GpsTime receiver_time;
  double clock_bias_s = 0;             ///< of the receiver, true
  double clock_drift = 0;              ///< of the receiver, true [s/s]
  disturbance::ReceiverEvents events;  ///< at this epoch; their instants are true, whatever date is reported
  std::vector<SatelliteObservation> satellites;  ///< above the horizon, ascending
  positioning::Fix fix;  ///< of this epoch's measurements; with a position filter the filter's result
  positioning::Fix single_epoch;  ///< by this epoch's measurements alone, without filters
  std::vector<BandState> bands;   ///< of the tracked signals, by carrier; empty if signals have no strength
  SpoofingState spoofing = SpoofingState::Unknown;
  /// CodeCorrections::station_offset_m() of the base whose corrections are in use.
  std::optional<double> station_offset_m;
  int visible = 0;  ///< tracked, above the mask (at the true position)
  int blocked = 0;  ///< above the mask, not tracked

  /// Sets SatelliteObservation::used by Fix::used of `fix`.
  void update_used();
  /// The GPS time that the receiver reports for an instant.
  [[nodiscard]] geodesy::GpsTime reported(geodesy::GpsTime instant) const;
  /// The reported GPS time of the epoch.
  [[nodiscard]] geodesy::GpsTime reported_time() const { return reported(time); }
  /// The instant whose UTC the receiver reports: off by whole weeks if its date is off. Leap seconds are
  /// those that satellites send at this epoch.
  [[nodiscard]] geodesy::GpsTime reported_utc() const;
};

}  // namespace canyon::receiver
