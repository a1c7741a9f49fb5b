#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "canyon/base/random.hpp"
#include "canyon/paths/disturbance/disturbance.hpp"
#include "canyon/receiver/random_streams.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/receiver/tracking/channel.hpp"
#include "canyon/receiver/tracking/signal_lock.hpp"
#include "canyon/sky/broadcast/schedule.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::receiver {

/// Progress of a receiver after a restart, per satellite: search time, and state of its ephemeris. Hot: the
/// search takes SignalLockOptions::reacquisition_s, and ephemerides are known. Warm: same search, and the
/// ephemeris is read: all of its messages (broadcast::unsent_ephemeris()), during uninterrupted tracking at
/// the acquisition threshold or above. Cold: a random search time (assumed distribution), uniform from 0.4 to
/// 2.25 (T - 20 s), then reading. T is SignalLockOptions::cold_acquisition_s, the resulting median time to
/// first fix of receivers of several systems under an open sky (a test: within 3 s). If T is below 18 s, too
/// short for a GPS satellite's ephemeris, the ephemeris comes from a network: search of 0.8 to 1.6 T.
class EphemerisAcquisition {
 public:
  /// @param channels_search whether the receiver's channels search for search_s(); else a satellite is found
  /// this long after it appears
  /// @param stream_name name of its random streams
  EphemerisAcquisition(const disturbance::Restart& restart, const tracking::SignalLockOptions& lock,
                       bool channels_search, std::uint64_t seed, std::string stream_name)
      : restart_(restart),
        lock_(lock),
        channels_search_(channels_search),
        seed_(seed),
        stream_name_(std::move(stream_name)) {}

  /// [s], >= 0.
  [[nodiscard]] double search_s(gnss::SatelliteId id) const;

  /// Whether an ephemeris is known; call once per epoch and satellite. @param readable tracked, strong enough
  [[nodiscard]] bool read(gnss::SatelliteId id, const gnss::Signal& signal, bool readable,
                          geodesy::GpsTime now) {
    Satellite& satellite = satellites_[id];
    if (satellite.unread == 0) return true;
    if (!readable) {
      satellite.since.reset();
      return false;
    }
    if (!satellite.since) satellite.since = now + (channels_search_ ? 0 : search_s(id));
    if (now < *satellite.since) return false;
    if (restart_.ephemeris_s) {
      if (now - *satellite.since >= *restart_.ephemeris_s) satellite.unread = 0;
    } else if (restart_.kind == disturbance::RestartKind::Hot || has_network_aid()) {
      satellite.unread = 0;
    } else {
      satellite.unread &= broadcast::unsent_ephemeris(id, signal, *satellite.since, now);
    }
    return satellite.unread == 0;
  }

 private:
  struct Satellite {
    std::optional<geodesy::GpsTime> since;  // readable without interruption
    std::uint32_t unread = ~0U;             // messages not yet read
  };
  [[nodiscard]] bool has_network_aid() const {
    constexpr double kSubframes1To3_s = 18;
    return lock_.cold_acquisition_s < kSubframes1To3_s;
  }

  disturbance::Restart restart_;
  tracking::SignalLockOptions lock_;
  bool channels_search_;
  std::uint64_t seed_;
  std::string stream_name_;
  std::map<gnss::SatelliteId, Satellite> satellites_;
};

/// A signal's channel after an epoch.
struct TrackedChannel {
  tracking::Channel* channel = nullptr;
  tracking::Reception reception;
};

/// The satellites of an epoch after processing by their channels, in the order of ReceiverEpoch.
struct TrackingResult {
  struct Satellite {
    const propagation::SatelliteView* view;
    std::size_t first_channel;  ///< in `channels`; those of SatelliteObservation::more come next
  };
  std::vector<Satellite> satellites;
  std::vector<std::optional<TrackedChannel>> channels;  ///< empty if signals have no strength
  int los = 0;                                          ///< satellites in line of sight above the mask
};

/// A receiver's front end and its channels: found signals, their strength, and known ephemerides.
class ChannelBank {
 public:
  /// @param options must outlive this
  /// @param stream_name name of its random streams
  ChannelBank(const ReceiverOptions& options, std::uint64_t seed, std::string stream_name);

  /// Resets all channels and ephemerides, and searches as after the restart.
  void restart(const disturbance::Restart& restart);
  /// Interference of an epoch after the antenna; valid until the next call.
  [[nodiscard]] std::span<const tracking::ReceivedWave> receive(
      std::span<const propagation::Interference> waves);
  /// State of the front end around each tracked carrier, by carrier.
  [[nodiscard]] std::vector<BandState> bands(std::span<const tracking::ReceivedWave> waves);
  /// Lists the satellites of an arrival in `epoch`, and processes their signals in their channels.
  [[nodiscard]] TrackingResult follow(const tracking::AntennaMotion& motion,
                                      const propagation::Arrival& arrival, ReceiverEpoch& epoch);
  /// Processes an epoch without signal in the channels of all satellites not in `satellites` (ascending).
  void drop_channels_except(const std::vector<SatelliteObservation>& satellites, geodesy::GpsTime now);
  [[nodiscard]] tracking::LoopErrors sample(const TrackedChannel& tracked, geodesy::GpsTime now);
  /// Whether a satellite's ephemeris is known; call once per epoch for each.
  [[nodiscard]] bool read_ephemeris(const SatelliteObservation& satellite, geodesy::GpsTime now);

 private:
  [[nodiscard]] tracking::Channel& channel_of(const tracking::AntennaMotion& motion, gnss::SatelliteId id,
                                              const gnss::Signal& signal);
  std::optional<TrackedChannel> track(const tracking::AntennaMotion& motion,
                                      const propagation::SatelliteView& view, bool free, bool received,
                                      SignalObservation& observation);
  [[nodiscard]] propagation::Visibility visibility_of(const SatelliteObservation& satellite) const;

  const ReceiverOptions& options_;
  std::uint64_t seed_;
  std::string stream_name_;
  /// Tracked signals of each system, by System.
  std::array<std::vector<const gnss::Signal*>, gnss::kSystemCount> tracks_;
  std::optional<tracking::ChannelModel> signals_;  ///< empty: signals have no strength
  std::map<gnss::SatelliteId, std::vector<tracking::Channel>> channels_;
  std::optional<EphemerisAcquisition> known_;  ///< since the last restart; empty: all
  // Members to keep their capacity.
  std::vector<tracking::ReceivedWave> received_waves_;
  std::vector<const gnss::Signal*> wanted_;
};

}  // namespace canyon::receiver
