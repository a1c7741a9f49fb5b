#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "canyon/geodesy/frames.hpp"
#include "canyon/gnss/navigation_data.hpp"
#include "canyon/gnss/signals.hpp"
#include "canyon/propagation/paths.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/tracking/channel.hpp"

// Ranges of signals as a receiver's clock shows them: the one place that receivers and samples have them
// from.

namespace canyon::receiver {

/// Delays [m] of a signal between satellite and antenna beside range and detours, as a receiver's options
/// switch them on: the view's own where it has them, else those of the models that receivers correct by.
struct DelaysInSignal {
  double ionosphere_m = 0;  ///< of a code on this carrier; an advance of its phase
  double troposphere_m = 0;
  double orbit_error_m = 0;

  [[nodiscard]] double of_carrier_m() const { return troposphere_m - ionosphere_m + orbit_error_m; }
};
/// @param place of the antenna. InputError where the ionosphere is asked for and has no coefficients.
[[nodiscard]] DelaysInSignal delays_in_signal(const ReceiverOptions& options,
                                              const std::map<gnss::System, gnss::Klobuchar>& klobuchar,
                                              const propagation::SatelliteView& view, double carrier_hz,
                                              geodesy::GpsTime time, const geodesy::Geodetic& place);

/// Pseudorange of a signal [m]: geometric range, detour by paths, clocks (the receiver's reading is `bias_s`
/// ahead of GPS time), atmosphere and noise. positioning::ranged_satellites() takes the satellite's clock out
/// again.
[[nodiscard]] double pseudorange_m(const orbit::LineOfSight& line, double excess_m, double bias_s,
                                   double atmosphere_m, double noise_m);

/// A receiver's clock against GPST.
struct ClockReading {
  double bias_s = 0;
  double drift = 0;  ///< [s/s]
};

/// Terms of a signal's range beside geometry and clocks [m].
struct RangeTerms {
  DelaysInSignal delays;
  double code_excess_m = 0, carrier_excess_m = 0;  ///< over the geometric range
  double code_noise_m = 0;
  double bias_m = 0;  ///< the receiver's own delay of the code
};

/// A signal's range by its code and by its carrier [m].
struct SignalRange {
  /// r + excess + c (bias - (satellite clock - the signal's group delay)) + ionosphere + troposphere + noise
  /// + the receiver's bias + orbit error: the pseudorange.
  double code_m = 0;
  /// r + excess + c (bias - satellite clock) + troposphere - ionosphere + orbit error, and the view's turn of
  /// the carrier: carrier phase times wavelength, without an ambiguity.
  double carrier_m = 0;
};
/// @param carrier_hz of the satellite's signal
[[nodiscard]] SignalRange signal_range(const propagation::SatelliteView& view, const gnss::Signal& signal,
                                       double carrier_hz, const ClockReading& clock, const RangeTerms& terms);

/// d/dt of a SignalRange over one path per second of the receiver's clock [m/s].
struct SignalRate {
  double code_mps = 0;     ///< with Path::code_ahead_mps, without the atmosphere
  double carrier_mps = 0;  ///< -f / c of it is the Doppler shift
};
/// @param motion of the antenna; @param atmosphere_mps rate of DelaysInSignal::of_carrier_m()
[[nodiscard]] SignalRate signal_rate(const propagation::SatelliteView& view, double carrier_hz,
                                     const propagation::Path& path, const tracking::AntennaMotion& motion,
                                     const ClockReading& clock, double atmosphere_mps = 0);

// Parts of a receiver that follow from its options and seed alone.

/// Name of a receiver's random streams, by ReceiverOptions::own_draws: its own name, or none; kReceiver
/// counts as none.
[[nodiscard]] std::string draws_of(const ReceiverOptions& options);
/// The same for its disturbances.
[[nodiscard]] std::string disturbance_draws_of(const ReceiverOptions& options);
/// Signals that it tracks of a satellite at a time, in the order of gnss::signals_of(). @param found replaced
void signals_to_track(const ReceiverOptions& options, gnss::SatelliteId id, geodesy::GpsTime time,
                      std::vector<const gnss::Signal*>& found);
/// The receiver's delay of a satellite's signal [m] by BiasOptions, without the drift.
[[nodiscard]] double fixed_bias_m(const BiasOptions& options, gnss::SatelliteId id,
                                  const gnss::Signal& signal, double carrier_hz, geodesy::GpsTime time);
/// The drift of that delay, where drift_sigma_m is above 0.
[[nodiscard]] tracking::OuProcess bias_drift(const ReceiverOptions& options, std::uint64_t seed,
                                             const gnss::Signal& signal);
/// Key of a signal's own streams: "/code", "/doppler" and "/mean" behind it.
[[nodiscard]] std::string noise_key(const ReceiverOptions& options, gnss::SatelliteId id,
                                    const gnss::Signal& signal);
/// The process of a signal's pseudorange noise (NoiseOptions::ou).
[[nodiscard]] tracking::OuProcess pseudorange_noise(const ReceiverOptions& options, std::uint64_t seed,
                                                    gnss::SatelliteId id, const gnss::Signal& signal);

}  // namespace canyon::receiver
