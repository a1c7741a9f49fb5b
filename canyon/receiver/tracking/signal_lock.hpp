#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/options/fwd.hpp"

namespace canyon::tracking {

/// When a channel of a receiver begins and ceases to track a signal.
struct SignalLockOptions {
  /// A signal is found at this C/N0 or above [dB-Hz]. Default: cold start sensitivity of u-blox M8 modules,
  /// -148 dBm (data sheet UBX-15031506), over -174 dBm/Hz of thermal noise.
  double acquisition_threshold_dbhz = 26;
  /// A tracked signal is kept at this C/N0 or above [dB-Hz]; at most the acquisition threshold: the
  /// difference is the hysteresis. Default: where three sigma of the noise of a 2 Hz loop with 1 chip spacing
  /// and 20 ms reach half the spacing (Kaplan & Hegarty, 2nd ed. 2006, equation 5.21 and figure 5.28 c).
  double tracking_threshold_dbhz = 18;
  /// From a signal's appearance to its first measurement where nothing is known of it [s], >= 0: search and
  /// ephemeris. Default: cold start of the same data sheet.
  double cold_acquisition_s = 26;
  /// The same for a signal that was tracked before [s], >= 0. Default: hot start of the same data sheet.
  double reacquisition_s = 1;
  /// Below the tracking threshold, the loops coast this long before the channel goes back to search [s],
  /// >= 0. There is no measurement meanwhile. Default: a few time constants of a 1 Hz loop, 1 / (4 Bn).
  double hold_s = 1;
  /// A signal lost longer ago than this is cold again [s], >= 0. Default: fit interval of a GPS ephemeris
  /// (IS-GPS-200, 20.3.4.4).
  double memory_s = 14'400;
  /// Take the receiver as running long since at its first epoch: signals above the acquisition threshold are
  /// tracked at once, and all others are known.
  bool warm_start = false;
  /// Throws InputError naming the field that is out of range. Times are at most 1e8 s.
  void validate() const;
};
void visit(options::Visitor& v, SignalLockOptions& o);

enum class LockState : std::uint8_t {
  Searching,  ///< not tracked
  Tracking,   ///< measured
  Holding,    ///< too weak to measure; tracked again at once when it returns in time
};
/// "searching", "tracking", "holding".
[[nodiscard]] std::string_view name(LockState state);

/// Lock of one receiver channel on one signal: a deterministic state machine in continuous time.
///
/// The C/N0 given with an update is taken to have stood since the update before, so that a stretch of
/// constant C/N0 leads to the same state and the same instants in one step or in thousands (whole
/// nanoseconds; exact).
///   Searching -> Tracking: C/N0 >= acquisition threshold without a break for the acquisition time, cold or
///     re-; which of them is decided by the time between loss and the signal's appearance;
///   Tracking -> Holding: C/N0 < tracking threshold;
///   Holding -> Tracking: C/N0 >= tracking threshold;
///   Holding -> Searching: hold_s after the signal fell.
class SignalLock {
 public:
  /// Throws InputError where options.validate() does.
  explicit SignalLock(const SignalLockOptions& options = {});

  /// State at `time`, with the signal at `cn0_dbhz` since the last update; empty: nothing arrived. The first
  /// update starts the clock: with warm_start it may track at once, and reacquires within reacquisition_s
  /// what comes later; else it searches from cold. Throws InputError for time running backwards and a C/N0
  /// that is not finite.
  LockState update(geodesy::GpsTime time, std::optional<double> cn0_dbhz);

  /// Instead of SignalLockOptions::cold_acquisition_s. @param seconds [0, 1e8]
  void search_for(double seconds) { options_.cold_acquisition_s = seconds; }

  [[nodiscard]] LockState state() const { return state_; }
  /// Since when it has tracked without a break; empty unless Tracking. Carrier phase is continuous since then
  /// (RINEX's loss-of-lock indicator is due where this is later than the epoch before).
  [[nodiscard]] std::optional<geodesy::GpsTime> tracking_since() const;

 private:
  SignalLockOptions options_;
  LockState state_ = LockState::Searching;
  std::optional<geodesy::GpsTime> now_;
  geodesy::GpsTime tracking_since_;
  geodesy::GpsTime holding_since_;
  /// Searching: since when the signal has been strong enough.
  std::optional<geodesy::GpsTime> found_since_;
  /// When it was last lost; empty: never tracked.
  std::optional<geodesy::GpsTime> lost_at_;
};

}  // namespace canyon::tracking
