#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "canyon/outputs/encoding/ubx/frame.hpp"
#include "canyon/simulation/scenario/outputs.hpp"

namespace canyon::encoding::ubx {

using Generation = simulation::UbxGeneration;

/// The M10 and the X20: settings only by CFG-VALSET, older CFG messages are rejected, and only SEC-SIG
/// reports jamming (MON-RF has 0, unknown).
[[nodiscard]] constexpr bool is_newest(Generation generation) {
  return generation == Generation::M10 || generation == Generation::X20;
}

/// The ports in settings; the device is on UART1.
inline constexpr int kPorts = 5;  ///< I2C (DDC), UART1, UART2, USB, SPI
inline constexpr int kConnectedPort = 1;

/// The event that makes the device send a message.
enum class Sent : std::uint8_t {
  Epochs,  ///< every so many epochs
  Events,  ///< events independent of epochs, or that never happen here
  Never    ///< known but not generated: a rate other than 0 is rejected
};

/// A message whose rate can be set.
struct MessageInfo {
  MessageId id = 0;
  std::uint32_t key = 0;  ///< CFG-MSGOUT-..._I2C, followed by those of the other ports; 0: it has none
  bool m8 = false, f9 = false;
  int rate = 0;  ///< initial rate on the device's own port
  Sent sent = Sent::Epochs;
  bool high_precision = false;  ///< only in receivers with carrier phases, not in the M10

  [[nodiscard]] bool known(Generation generation) const {
    if (generation == Generation::M8) return m8;
    return f9 && !(high_precision && generation == Generation::M10);
  }
};
/// NAV-RELPOSNED: initially on only for receivers with RTK.
inline constexpr MessageId kRelativePosition = 0x013C;
/// ESF-STATUS: initially on only for receivers with dead reckoning.
inline constexpr MessageId kFusionStatus = 0x1010;
/// ESF-MEAS: as ESF-STATUS; samples of the vehicle's sensors.
inline constexpr MessageId kSensorSamples = 0x1002;
/// ESF-RAW: the same samples as ESF-MEAS, several in a message; on request.
inline constexpr MessageId kRawSamples = 0x1003;
/// All messages, in the order of sending in an epoch.
[[nodiscard]] std::span<const MessageInfo> messages();

/// Keys of CFG-VALSET and CFG-VALGET that the device itself reads (UBX-22008968, chapter 6).
inline constexpr std::uint32_t kRateMeasurement = 0x30210001;  ///< CFG-RATE-MEAS [ms]
inline constexpr std::uint32_t kRateNavigation = 0x30210002;   ///< CFG-RATE-NAV [measurements]
inline constexpr std::uint32_t kRateTimeReference = 0x20210003;
inline constexpr std::uint32_t kBaud = 0x40520001;            ///< CFG-UART1-BAUDRATE
inline constexpr std::uint32_t kOutputUbx = 0x10740001;       ///< CFG-UART1OUTPROT-UBX
inline constexpr std::uint32_t kOutputNmea = 0x10740002;      ///< CFG-UART1OUTPROT-NMEA
inline constexpr std::uint32_t kOutputRtcm = 0x10740004;      ///< CFG-UART1OUTPROT-RTCM3X
inline constexpr std::uint32_t kBaseMode = 0x20030001;        ///< CFG-TMODE-MODE
inline constexpr std::uint32_t kDynamicModel = 0x20110021;    ///< CFG-NAVSPG-DYNMODEL
inline constexpr std::uint32_t kFixMode = 0x20110011;         ///< CFG-NAVSPG-FIXMODE
inline constexpr std::uint32_t kJammingMonitor = 0x1041000d;  ///< CFG-ITFM-ENABLE

/// All settings, by the keys of the newer protocol. Older CFG messages set the same values or are stored as
/// blocks of bytes. The set of keys is fixed, so memory is bounded.
class Configuration {
 public:
  /// @param period_ms default of CFG-RATE-MEAS, at least 1; @param rtk NAV-RELPOSNED is sent from the start
  /// @param dead_reckoning likewise ESF-STATUS
  /// @param is_stationary it may be a base station with a fixed position (CFG-TMODE-MODE 2)
  Configuration(Generation generation, int period_ms, bool rtk = false, bool dead_reckoning = false,
                bool is_stationary = false);
  [[nodiscard]] bool operator==(const Configuration&) const = default;

  [[nodiscard]] std::optional<std::uint64_t> value(std::uint32_t key) const;
  /// False, without a change, for an unknown key or a value that the device rejects.
  bool set(std::uint32_t key, std::uint64_t value);
  [[nodiscard]] bool takes(std::uint32_t key, std::uint64_t value) const;
  /// Known keys that a mask of CFG-VALGET names (item 0xFFFF: all of a group; group 0xFFF: all), ascending.
  [[nodiscard]] std::vector<std::uint32_t> keys(std::uint32_t mask) const;

  /// The key of a message's rate on a port; empty if the device lacks the message, or has it on its own port.
  [[nodiscard]] std::optional<std::uint32_t> rate_key(MessageId id, int port) const;
  /// The interval of a message on the own port [epochs]; 0: never.
  [[nodiscard]] int rate(MessageId id) const;

  /// The antenna position set by CFG-TMODE [m, ECEF]; empty if the mode is not "fixed".
  [[nodiscard]] std::optional<Eigen::Vector3d> configured_position_ecef() const;

  /// Payload of a CFG message that is stored unchanged (CFG-NAV5, CFG-SBAS, ...); null for others.
  [[nodiscard]] std::string* block(MessageId id);

 private:
  Generation generation_;
  bool is_stationary_;
  std::map<std::uint32_t, std::uint64_t> values_;
  std::map<MessageId, std::string> blocks_;
};

/// Size of a key's value in bytes, by its bits 30 to 28; 0: no key.
[[nodiscard]] int value_size(std::uint32_t key);

}  // namespace canyon::encoding::ubx
