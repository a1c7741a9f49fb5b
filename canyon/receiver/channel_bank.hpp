#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "canyon/gnss/signals.hpp"
#include "canyon/receiver/known_ephemerides.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/tracking/channel.hpp"

namespace canyon::receiver {

/// A signal's channel after an epoch.
struct Tracked {
  tracking::Channel* channel = nullptr;
  tracking::Reception reception;
};

/// The satellites of an epoch after their channels have received it, in the order of ReceiverEpoch.
struct Followed {
  struct Satellite {
    const propagation::SatelliteView* view;
    std::size_t first_channel;  ///< in `channels`; those of SatelliteObservation::more come next
  };
  std::vector<Satellite> satellites;
  std::vector<std::optional<Tracked>> channels;  ///< empty where signals have no strength
  int los = 0;                                   ///< satellites in line of sight above the mask
};

/// A receiver's front end and its channels: which signals are found, how strong they are, and whose
/// ephemerides are known.
class ChannelBank {
 public:
  /// @param options must outlive this
  /// @param draws name of its random streams
  ChannelBank(const ReceiverOptions& options, std::uint64_t seed, std::string draws);

  /// Forgets all channels and ephemerides, and searches as after the restart.
  void restart(const disturbance::Restart& restart);
  /// Interference of an epoch behind the antenna; valid until the next call.
  [[nodiscard]] std::span<const tracking::ReceivedWave> receive(
      std::span<const propagation::Interference> waves);
  /// State of the front end around each tracked carrier, by carrier.
  [[nodiscard]] std::vector<BandState> bands(std::span<const tracking::ReceivedWave> waves);
  /// Lists the satellites of an arrival in `epoch`, and passes their signals through their channels.
  [[nodiscard]] Followed follow(const tracking::AntennaMotion& motion, const propagation::Arrival& arrival,
                                ReceiverEpoch& epoch);
  /// Tells the channels of satellites that are below the horizon. @param satellites ascending
  void miss_all_but(const std::vector<SatelliteObservation>& satellites, geodesy::GpsTime now);
  /// Errors of a tracked signal's loops at an epoch.
  [[nodiscard]] tracking::LoopErrors sample(const Tracked& tracked, geodesy::GpsTime now);
  /// Whether a satellite's ephemeris is known; asked once an epoch for each.
  [[nodiscard]] bool read_ephemeris(const SatelliteObservation& satellite, geodesy::GpsTime now);

 private:
  [[nodiscard]] tracking::Channel& channel_of(const tracking::AntennaMotion& motion, gnss::SatelliteId id,
                                              const gnss::Signal& signal);
  std::optional<Tracked> track(const tracking::AntennaMotion& motion, const propagation::SatelliteView& view,
                               bool free, bool received, SignalObservation& observation);
  [[nodiscard]] propagation::Visibility visibility_of(const SatelliteObservation& satellite) const;

  const ReceiverOptions& options_;
  std::uint64_t seed_;
  std::string draws_;
  /// Tracked signals of each system, by System.
  std::array<std::vector<const gnss::Signal*>, gnss::kSystemCount> tracks_;
  std::optional<tracking::ChannelModel> signals_;  ///< empty: signals have no strength
  std::map<gnss::SatelliteId, std::vector<tracking::Channel>> channels_;
  std::optional<KnownEphemerides> known_;  ///< since the last restart; empty: all
  // Kept for their memory.
  std::vector<tracking::ReceivedWave> received_waves_;
  std::vector<const gnss::Signal*> wanted_;
};

}  // namespace canyon::receiver
