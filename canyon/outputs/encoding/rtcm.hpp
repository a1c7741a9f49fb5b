#pragma once

#include <array>
#include <map>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/outputs/encoding/observations/raw_observations.hpp"
#include "canyon/receiver/rtcm/frames.hpp"
#include "canyon/simulation/epoch.hpp"
#include "canyon/sky/broadcast/bits.hpp"

// RTCM 10403.3, Differential GNSS Services, version 3. Cited by DF and table numbers.

namespace canyon::encoding::rtcm {

using canyon::rtcm::frame;

/// Message 1005: the antenna position of a station [m, ECEF]; `computed`: a virtual station of a network.
[[nodiscard]] broadcast::Bits station(const Eigen::Vector3d& antenna_ecef, bool computed = false);
/// Message 1033: antennas without phase centre variation (IGS's ADVNULLANTENNA), the receiver is Canyon.
[[nodiscard]] broadcast::Bits descriptors();
/// Message 1230: GLONASS phases are aligned with the codes of these RINEX signals (1C, 2C), biases 0.
[[nodiscard]] broadcast::Bits glonass_biases(const std::vector<std::string_view>& rinex_codes);
/// The periodic messages that describe a receiver: 1005 if its position is known, 1033, and 1230 if it has
/// GLONASS phases.
[[nodiscard]] std::vector<broadcast::Bits> station_messages(const ReceiverDescription& receiver);

/// Messages 1019 (GPS), 1042 (BeiDou), 1044 (QZSS), 1045 and 1046 (Galileo, by its navigation message); 1020
/// (GLONASS). Values are rounded to the resolution of the satellite's own message. Empty for satellites
/// without a number in RTCM.
[[nodiscard]] broadcast::Bits ephemeris(const gnss::KeplerEphemeris& ephemeris);
[[nodiscard]] broadcast::Bits ephemeris(const gnss::GlonassEphemeris& ephemeris);

/// MSM7 of all systems.
inline constexpr std::array kMsm7{1077, 1087, 1097, 1107, 1117, 1127};

/// MSM4 and MSM7, 1074 to 1127, for a receiver's epochs.
class Observations {
 public:
  /// @param glonass_channels frequency numbers
  explicit Observations(std::map<gnss::SatelliteId, int> glonass_channels)
      : glonass_channels_(std::move(glonass_channels)) {}

  /// The messages of an epoch with these numbers; none without measurements. Epochs are in whole milliseconds
  /// of the receiver's clock; pseudoranges and phases are referred to the rounded time, as in the RINEX
  /// observation file. Pseudoranges from 0 to 254 ms can be encoded. Lock times count from an arc's first
  /// epoch here, so that every slip resets them to 0. Call it in order of time.
  [[nodiscard]] std::vector<broadcast::Bits> messages(const receiver::ReceiverEpoch& seen,
                                                      std::span<const int> numbers = kMsm7);

 private:
  struct Satellite;
  [[nodiscard]] std::vector<Satellite> satellites_of(const RawEpoch& raw, gnss::System system) const;

  std::map<gnss::SatelliteId, int> glonass_channels_;
  RawObservations observations_{Tags::WholeMilliseconds};
};

/// Ephemerides of the satellites measured by a receiver: sent if new or changed, and repeated every 30 s.
class Ephemerides {
 public:
  [[nodiscard]] std::vector<broadcast::Bits> due(const simulation::Epoch& epoch);

 private:
  /// Satellite, and whether the message is Galileo's F/NAV.
  using Key = std::pair<gnss::SatelliteId, bool>;
  struct Sent {
    geodesy::GpsTime at;
    broadcast::Bits message;
  };
  template <typename Ephemeris>
  void add_due(const std::vector<Ephemeris>& records, const simulation::Epoch& epoch,
               std::vector<broadcast::Bits>& messages);

  std::map<Key, Sent> sent_;
};

}  // namespace canyon::encoding::rtcm
