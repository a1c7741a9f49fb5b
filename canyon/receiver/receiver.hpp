#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "canyon/paths/disturbance/disturbance.hpp"
#include "canyon/paths/propagation/paths.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/receiver/positioning/fusion/dead_reckoning.hpp"
#include "canyon/receiver/positioning/position_filter.hpp"
#include "canyon/receiver/positioning/range_terms.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/receiver/tracking/noise.hpp"
#include "canyon/receiver/tracking/signal_lock.hpp"
#include "canyon/receiver/tracking/signal_options.hpp"

namespace canyon::relative {
struct Corrections;
}

namespace canyon::receiver {

/// One signal of a satellite at one epoch.
struct SignalObservation {
  const gnss::Signal* signal = nullptr;  ///< of gnss::signals_of()
  /// Code delay by paths of the tracked signal [m]: with SignalOptions::enabled where the code loop stands
  /// (multipath error of a direct signal, either sign; detour of an NLOS one), else the shortest path's
  /// excess; 0 when blocked or not tracked.
  double excess_m = 0;
  /// True C/N0 at the correlator [dB-Hz], tracked or not; empty where nothing arrives or signals have no
  /// strength (SignalOptions::enabled off). The receiver states Measurement::cn0_dbhz.
  std::optional<double> cn0_dbhz;
  /// Path whose carrier is followed; empty where nothing arrives.
  std::optional<propagation::PathKind> tracked_path;
  /// Whether that is the direct path, by itself strong enough to be tracked.
  bool direct = false;
  /// State of the channel; Tracking for everything received where signals have no strength.
  tracking::LockState lock = tracking::LockState::Searching;
  /// Empty where the signal is not tracked or the satellite is below the elevation mask.
  std::optional<positioning::Measurement> measurement;
  double noise_m = 0;  ///< OU value and code loop noise in the pseudorange; 0 without measurement
  /// Rate of the code loop's noise: its errors tau apart correlate by e^(-rate tau); 0 without it.
  double code_rate_per_s = 0;
  /// Excess + noise + terms of space left uncorrected (in the signal less what the fix takes off; negative
  /// where it corrects what is not there); 0 without measurement.
  double pseudorange_error_m = 0;
  /// Each term of the pseudorange, in the order of range_terms(); 0 without measurement.
  std::array<double, kMostRangeTerms> terms_m{};

  [[nodiscard]] double term_m(RangeTermId id) const { return terms_m[static_cast<std::size_t>(id)]; }
};

/// One satellite at one epoch as the receiver saw it, with the truth behind it: its first tracked signal, and
/// the others.
struct SatelliteObservation : SignalObservation {
  gnss::SatelliteId id;
  double azimuth_rad = 0;    ///< true
  double elevation_rad = 0;  ///< true
  /// As this receiver finds it. Where signals have a strength it is LOS or LOSMultipath if it follows the
  /// direct path of one of its signals, and that reaches the tracking threshold by itself
  /// (tracking::SignalLockOptions); else NLOS if one of its signals reaches that, else Blocked.
  propagation::Visibility visibility = propagation::Visibility::Blocked;
  /// By the map and the bodies about the antenna, however weak: SatellitePaths::visibility.
  propagation::Visibility map_visibility = propagation::Visibility::Blocked;
  /// Loss of its direct path by obstacles that the map lacks [dB]; >= 0 where they weaken it, 0 without an
  /// obstacle.
  double obstacles_db = 0;
  bool above_mask = false;
  bool used = false;  ///< in the fix
  /// Slant delay of the ionosphere at 1575.42 MHz that the receiver estimates
  /// (FixInput::Chosen::ionosphere_m) [m].
  std::optional<double> estimated_ionosphere_m;
  /// Beyond the first, in the order of gnss::signals_of(); only with ReceiverOptions::tracks.
  std::vector<SignalObservation> more;

  /// visit(signal) for the first one and each of `more`.
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
  double carrier_hz = 0;  ///< of the signals there, as gnss::Signal::carrier_hz
  /// Power of interference within the band over the front end's own noise there [1], >= 0.
  double interference_ratio = 0;
  /// Part of it on single frequencies (tones).
  double tone_ratio = 0;

  /// Gain of the automatic gain control over that without interference, (0, 1]: it holds the level of noise
  /// and interference together at the converter.
  [[nodiscard]] double agc() const { return 1 / std::sqrt(1 + interference_ratio); }
};

/// A receiver's judgement whether its signals are authentic.
enum class SpoofingState : std::uint8_t {
  Unknown,    ///< it has no checks
  None,       ///< nothing suspicious
  Indicated,  ///< one of its checks failed
  Multiple    ///< both did
};

struct ReceiverEpoch {
  geodesy::GpsTime time;  ///< true reception instant
  /// Reading of the receiver's clock, to the nearest nanosecond; pseudoranges hold the exact reading (a
  /// satellite moves 2 micrometres in the difference).
  geodesy::GpsTime receiver_time;
  double clock_bias_s = 0;             ///< of the receiver, true
  double clock_drift = 0;              ///< of the receiver, true [s/s]
  disturbance::ReceiverEvents events;  ///< at this epoch; instants here are right whatever date it states
  std::vector<SatelliteObservation> satellites;  ///< above the horizon, ascending
  positioning::Fix fix;  ///< of this epoch's measurements; with a position filter the filter's answer
  positioning::Fix single_epoch;  ///< by this epoch's measurements alone, whatever filters are behind it
  std::vector<BandState> bands;   ///< of what it tracks, by carrier; empty where signals have no strength
  SpoofingState spoofing = SpoofingState::Unknown;
  /// CodeCorrections::station_offset_m() of the base whose corrections are in use.
  std::optional<double> station_offset_m;
  int visible = 0;  ///< tracked, above the mask (at the true place)
  int blocked = 0;  ///< above the mask, not tracked

  /// The GPS time that the receiver states for an instant.
  [[nodiscard]] geodesy::GpsTime stated(geodesy::GpsTime instant) const;
  /// The same for the epoch.
  [[nodiscard]] geodesy::GpsTime stated_time() const { return stated(time); }
  /// The instant whose UTC the receiver states: off by whole weeks where its date is, with the leap seconds
  /// that satellites send today.
  [[nodiscard]] geodesy::GpsTime stated_utc() const;
};

/// The vehicle's sensors as a receiver has them.
struct VehicleSensors {
  positioning::SensorMounting mounting;
  positioning::SensorReadings readings;  ///< since the epoch before
};

/// Inputs of a receiver at an epoch.
struct EpochContext {
  propagation::Antenna antenna;
  propagation::Arrival& arrival;  ///< as the environment answers; disturbed in place
  const orbit::Sky& sky;          ///< for the fix, where arrival.broadcast is null
  /// Needed where ReceiverOptions::ionosphere or FixOptions::correct_ionosphere is on.
  const std::map<gnss::System, gnss::Klobuchar>& klobuchar;
  /// Corrections of a reference station that came since the epoch before; null: none did.
  const relative::Corrections* corrections = nullptr;
  /// Used with ReceiverOptions::dead_reckoning; null: the receiver has its satellites alone.
  const VehicleSensors* sensors = nullptr;
};

/// The part with memory: disturbances, clock, noise and channels of one antenna, and its position filter.
/// Same options and seed, same numbers, whatever runs beside it and (with own_draws: false)
/// whatever its name. Epochs must be given in order of time.
///
/// With corrections of CorrectionOptions::max_age_s or less the fix is that of the satellites that have one
/// (CodeCorrections), a differential one; where that has no solution, and without corrections, it is that of
/// all.
///
/// P = r + excess + c (bias - (satellite clock - group delay)) + ionosphere + troposphere + orbit error +
/// noise, with r the geometric range to the satellite at transmission, turned with the Earth
/// (docs/receiver.md has every sign).
class Receiver {
 public:
  /// @param disturbances behind that of SignalOptions::shadowing, in this order
  /// @param models in place of its own weights and position; empty: its own
  /// Throws InputError where options.validate() does, or a disturbance cannot be made.
  Receiver(ReceiverOptions options, std::uint64_t seed,
           std::span<const disturbance::DisturbanceSource> disturbances = {}, const ModelSource& models = {});
  ~Receiver();
  Receiver(Receiver&&) noexcept;
  Receiver& operator=(Receiver&&) noexcept;

  [[nodiscard]] const ReceiverOptions& options() const;

  /// Disturbs what arrives, then measures it. Times must not run backwards; a placement other than Free gives
  /// status NoSignal. Throws InputError, naming the receiver, for a pose that is not finite, time running
  /// backwards, missing Klobuchar coefficients, corrections that are not numbers, and, with strength, code
  /// correlators too far apart for a satellite's signal. Paths then need what their strength depends on
  /// (PathGeometry, Path::reflector, Path::scattered_power).
  [[nodiscard]] ReceiverEpoch observe(const EpochContext& context);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace canyon::receiver
