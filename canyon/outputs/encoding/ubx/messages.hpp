#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "canyon/outputs/encoding/observations/raw_observations.hpp"
#include "canyon/outputs/encoding/ubx/configuration.hpp"
#include "canyon/outputs/encoding/ubx/frame.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::encoding::ubx {

// Payloads of the messages that the device sends, field by field as in UBX-13003221 (M8) and UBX-22008968
// (F9); each has its ID and section. Without a solved fix, coordinates are 0, accuracies have their maximum
// value and DOPs are 99.99.
/// An entry of SEC-SIGLOG.
struct SecurityEvent {
  /// detectionType.
  enum class Detection : std::uint8_t { AbruptChange = 3, BroadbandJamming = 4, NarrowbandJamming = 5 };
  geodesy::GpsTime time;
  Detection detection = Detection::AbruptChange;
  bool stopped = false;  ///< eventType: 0 started, 1 stopped
};

/// An epoch with all inputs of its messages.
struct UbxEpoch : DeviceEpoch {
  Generation generation = Generation::F9;
  bool jamming_monitor = true;                                  ///< CFG-ITFM
  const std::vector<SecurityEvent>* security_events = nullptr;  ///< the latest first; null: none
};

/// The log of SEC-SIGLOG: beginnings and ends of jamming and of spoofing, as reported by MON-RF and SEC-SIG.
class SecurityLog {
 public:
  /// @param epoch in order of time
  void take(const UbxEpoch& epoch);
  /// The latest first, at most 16.
  [[nodiscard]] const std::vector<SecurityEvent>& events() const { return events_; }

 private:
  void change(std::optional<SecurityEvent::Detection>& before, std::optional<SecurityEvent::Detection> now,
              geodesy::GpsTime time);

  std::vector<SecurityEvent> events_;
  std::optional<SecurityEvent::Detection> jamming_, spoofing_;  ///< active; empty: none
};

/// The payload of an output message. Precondition: `id` is one of messages() that is generated in each epoch.
[[nodiscard]] std::string payload(MessageId id, const UbxEpoch& epoch);

/// RXM-SFRBX (0x0213).
[[nodiscard]] std::string subframe_payload(const broadcast::SentMessage& message, Generation generation,
                                           const std::map<gnss::SatelliteId, int>& glonass_channels);
/// A received RTCM 3 message.
struct ReceivedRtcm {
  int type = 0;  ///< DF002
  bool crc_failed = false;
  std::optional<bool> used;    ///< in the fix; empty: not known
  std::optional<int> station;  ///< DF003, of messages with a station
};
/// RXM-RTCM (0x0232).
[[nodiscard]] std::string rtcm_payload(const ReceivedRtcm& received);
/// RXM-COR (0x0234).
[[nodiscard]] std::string correction_payload(const ReceivedRtcm& received);
/// ESF-MEAS (0x1002) of an inertial sensor: rates of gyroscopes and accelerations along its axes.
/// @param time_ms since the start
[[nodiscard]] std::string inertial_payload(std::uint32_t time_ms, const Eigen::Vector3d& specific_force_mps2,
                                           const Eigen::Vector3d& angular_rate_radps);
/// A sample of ESF-RAW, whose units and axes are those of ESF-MEAS.
struct RawInertialSample {
  std::uint32_t time_ms = 0;
  Eigen::Vector3d specific_force_mps2, angular_rate_radps;
};
/// ESF-RAW of several samples, in their order.
[[nodiscard]] std::string raw_inertial_payload(std::span<const RawInertialSample> samples);
/// ESF-MEAS of the rear wheels, left and right: ticks in either direction, and whether backwards.
[[nodiscard]] std::string wheels_payload(std::uint32_t time_ms, const std::array<std::uint32_t, 2>& ticks,
                                         const std::array<bool, 2>& backwards);
/// MON-VER (0x0A04): reports the protocol version, and Canyon as firmware.
[[nodiscard]] std::string version_payload(Generation generation);

// Messages by subject; see payload().
[[nodiscard]] std::string nav_sat(const UbxEpoch& epoch);
[[nodiscard]] std::string nav_sig(const UbxEpoch& epoch);
[[nodiscard]] std::string nav_svinfo(const UbxEpoch& epoch);
[[nodiscard]] std::string rxm_rawx(const UbxEpoch& epoch);
[[nodiscard]] std::string mon_hw(const UbxEpoch& epoch);
[[nodiscard]] std::string mon_hw2(const UbxEpoch& epoch);
[[nodiscard]] std::string mon_rf(const UbxEpoch& epoch);
[[nodiscard]] std::string sec_sig(const UbxEpoch& epoch);
[[nodiscard]] std::string sec_siglog(const UbxEpoch& epoch);
[[nodiscard]] std::string esf_status(const UbxEpoch& epoch);
/// Milliseconds of the GPS week, nearest.
[[nodiscard]] std::uint32_t itow(const UbxEpoch& epoch);

/// A satellite's identifiers in UBX (UBX-22008968, 1.5.2).
struct SatelliteName {
  std::uint8_t gnss = 0;  ///< 0 GPS, 1 SBAS, 2 Galileo, 3 BeiDou, 5 QZSS, 6 GLONASS
  std::uint8_t satellite = 0;
};
/// Empty for satellites without a number in UBX (frozen skies with more than 32).
[[nodiscard]] std::optional<SatelliteName> satellite_name(gnss::SatelliteId id);

/// The number of a satellite in messages with one number per satellite (UBX-13003221, annex A), as in
/// MAVLink; 0 for satellites without one.
[[nodiscard]] int single_number(gnss::SatelliteId id);

/// Signal::ubx, or ubx_geo of a geostationary satellite. Empty for signals without a number in UBX (L1C).
[[nodiscard]] std::optional<std::uint8_t> signal_number(gnss::SatelliteId id, const gnss::Signal& signal);
/// sigId of the signal of broadcast::sent_messages(): L1 C/A, E1-B, B1I D1 or D2, L1OF.
[[nodiscard]] std::uint8_t message_signal(gnss::SatelliteId id);

}  // namespace canyon::encoding::ubx
