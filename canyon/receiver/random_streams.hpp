#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "canyon/receiver/receiver_options.hpp"
#include "canyon/receiver/tracking/noise.hpp"
#include "canyon/sky/gnss/signals.hpp"

// Random realizations of a receiver by its options and seed alone, for receivers and map cells.

namespace canyon::receiver {

/// Name of a receiver's random streams, by ReceiverOptions::independent_noise: its own name, or none;
/// kReceiver counts as none.
[[nodiscard]] std::string stream_name(const ReceiverOptions& options);
/// Name of the random streams of its disturbances.
[[nodiscard]] std::string disturbance_stream_name(const ReceiverOptions& options);
/// Tracked signals of a satellite at a time, in the order of gnss::signals_of(). @param found replaced
void signals_to_track(const ReceiverOptions& options, gnss::SatelliteId id, geodesy::GpsTime time,
                      std::vector<const gnss::Signal*>& found);
/// Removes from tracked_signals() of its system the signals that are not tracked of a satellite at a time.
void leave_out(const ReceiverOptions& options, gnss::SatelliteId id, geodesy::GpsTime time,
               std::vector<const gnss::Signal*>& found);
/// The receiver's delay of a satellite's signal [m] by BiasOptions, without the drift.
[[nodiscard]] double fixed_bias_m(const BiasOptions& options, gnss::SatelliteId id,
                                  const gnss::Signal& signal, double carrier_hz, geodesy::GpsTime time);
/// The drift of that delay, if drift_sigma_m is above 0.
[[nodiscard]] tracking::OuProcess bias_drift(const ReceiverOptions& options, std::uint64_t seed,
                                             const gnss::Signal& signal);
/// Key prefix of a signal's own streams: "/code", "/doppler" and "/mean" are appended.
[[nodiscard]] std::string noise_key(const ReceiverOptions& options, gnss::SatelliteId id,
                                    const gnss::Signal& signal);
/// The process of a signal's pseudorange noise (NoiseOptions::ou).
[[nodiscard]] tracking::OuProcess pseudorange_noise(const ReceiverOptions& options, std::uint64_t seed,
                                                    gnss::SatelliteId id, const gnss::Signal& signal);

}  // namespace canyon::receiver
