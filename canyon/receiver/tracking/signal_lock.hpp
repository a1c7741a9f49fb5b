#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/options/fwd.hpp"

namespace canyon::tracking {

/// Conditions under which a channel of a receiver starts and stops tracking a signal.
struct SignalLockOptions {
  /// A signal is found at this C/N0 or above [dB-Hz]. Default: cold start sensitivity of u-blox M8 modules,
  /// -148 dBm (data sheet UBX-15031506), over -174 dBm/Hz of thermal noise.
  double acquisition_threshold_dbhz = 26;
  /// A tracked signal is kept at this C/N0 or above [dB-Hz]; at most the acquisition threshold: the
  /// difference is the hysteresis. Default: at which three sigma of the noise of a 2 Hz loop with 1 chip
  /// spacing and 20 ms reach half the spacing (Kaplan & Hegarty, 2nd ed. 2006, equation 5.21 and figure 5.28
  /// c).
  double tracking_threshold_dbhz = 18;
  /// From a signal's appearance to its first measurement, without prior knowledge [s], >= 0: search and
  /// ephemeris. Default: cold start of the same data sheet.
  double cold_acquisition_s = 26;
  /// The same for a previously tracked signal [s], >= 0. Default: hot start of the same data sheet.
  double reacquisition_s = 1;
  /// Time for which the loops coast below the tracking threshold before the channel returns to search [s], >=
  /// 0. There is no measurement meanwhile. Default: a few time constants of a 1 Hz loop, 1 / (4 Bn).
  double hold_s = 1;
  /// A signal lost for longer than this is cold again [s], >= 0. Default: fit interval of a GPS ephemeris
  /// (IS-GPS-200, 20.3.4.4).
  double memory_s = 14'400;
  /// The receiver has been running for long at its first epoch: signals above the acquisition threshold are
  /// tracked at once, and all others are known.
  bool warm_start = false;
  /// Throws InputError naming the field that is out of range. Times are at most 1e8 s.
  void validate() const;
};
void visit(options::Visitor& v, SignalLockOptions& o);

enum class LockState : std::uint8_t {
  Searching,  ///< not tracked
  Tracking,   ///< measured
  Holding,    ///< too weak to measure; tracked again at once if it returns in time
};
/// "searching", "tracking", "holding".
[[nodiscard]] std::string_view name(LockState state);

/// Lock of one receiver channel on one signal: a deterministic state machine in continuous time.
///
/// The C/N0 of an update is assumed constant since the previous update, so that a period of constant C/N0
/// gives the same state and the same instants in one step or in thousands (whole nanoseconds; exact).
///   Searching -> Tracking: C/N0 >= acquisition threshold without interruption for the acquisition time, cold
///     or re-, selected by the time between loss and the signal's appearance;
///   Tracking -> Holding: C/N0 < tracking threshold;
///   Holding -> Tracking: C/N0 >= tracking threshold;
///   Holding -> Searching: hold_s after the signal fell.
class SignalLock {
 public:
  /// Throws InputError if options.validate() does.
  explicit SignalLock(const SignalLockOptions& options = {});

  /// State at `time`, with the signal at `cn0_dbhz` since the last update; empty: no signal. The first update
  /// starts the clock: with warm_start it may track at once, and reacquires later signals within
  /// reacquisition_s; else it searches from cold. Throws InputError for time running backwards and a C/N0
  /// that is not finite.
  LockState update(geodesy::GpsTime time, std::optional<double> cn0_dbhz);

  /// Instead of SignalLockOptions::cold_acquisition_s. @param seconds [0, 1e8]
  void search_for(double seconds) { options_.cold_acquisition_s = seconds; }

  [[nodiscard]] LockState state() const { return state_; }
  /// Start of uninterrupted tracking; empty unless Tracking. Carrier phase is continuous since then (RINEX's
  /// loss-of-lock indicator must be set if this is later than the previous epoch).
  [[nodiscard]] std::optional<geodesy::GpsTime> tracking_since() const;

 private:
  SignalLockOptions options_;
  LockState state_ = LockState::Searching;
  std::optional<geodesy::GpsTime> now_;
  geodesy::GpsTime tracking_since_;
  geodesy::GpsTime holding_since_;
  /// Searching: start of sufficient strength.
  std::optional<geodesy::GpsTime> found_since_;
  /// When it was last lost; empty: never tracked.
  std::optional<geodesy::GpsTime> lost_at_;
};

}  // namespace canyon::tracking
