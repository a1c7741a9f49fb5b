#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/mavlink/messages.hpp"

namespace canyon::mavlink {

// Frames of MAVLink 1 and 2 (mavlink.io, "Packet Serialization"), implemented from this specification,
// because Debian packages no MAVLink library.
/// The layout of a message's frames, computed from its fields.
struct FrameLayout {
  std::uint32_t id = 0;
  std::string_view name;
  std::uint8_t crc_extra = 0;
  std::size_t base_bytes = 0;  ///< of a MAVLink 1 payload
  std::size_t bytes = 0;       ///< with extensions
};
/// The layouts of all alternatives of Message, in their order.
[[nodiscard]] const std::array<FrameLayout, std::variant_size_v<Message>>& layouts();

/// CRC-16/MCRF4XX (X.25's polynomial, bits reflected) of `bytes`, continued from `crc`.
[[nodiscard]] std::uint16_t crc16(std::string_view bytes, std::uint16_t crc = 0xFFFF);

struct Sender {
  std::uint8_t system = 1;       ///< the vehicle's
  std::uint8_t component = 220;  ///< MAV_COMP_ID_GPS
};

enum class Version : std::uint8_t { V1 = 1, V2 = 2 };

/// One unsigned frame. MAVLink 2: without the payload's trailing zeros. MAVLink 1: without extensions.
/// Precondition: ids above 255 need MAVLink 2.
[[nodiscard]] std::string encode(const Message& message, std::uint8_t sequence, Sender sender = {},
                                 Version version = Version::V2);

/// Size of the frame at the start of `bytes`, made by encode(). Precondition: the frame is complete.
[[nodiscard]] std::size_t frame_bytes(std::string_view bytes);

struct Frame {
  Version version = Version::V2;
  std::uint8_t sequence = 0;
  Sender sender;
  Message message;
};

/// Finds frames in a byte stream that may be split anywhere, contain other data or be hostile. Buffers at
/// most one frame. Frames with a wrong checksum and unknown messages are skipped. Bytes that only resemble a
/// frame do not suppress a later frame. Signatures are skipped unchecked.
class MavlinkParser {
 public:
  /// Calls `each` for every completed frame, in order.
  void receive(std::string_view bytes, const std::function<void(const Frame&)>& each);
  /// Bytes so far that are not part of a frame.
  [[nodiscard]] std::uint64_t passed_over() const { return passed_over_; }

 private:
  std::string held_;  ///< begins with a magic byte, or is empty
  std::uint64_t passed_over_ = 0;
};

// Messages of RTCM 3 in GPS_RTCM_DATA (common.xml): up to 180 bytes in one, up to 720 in four parts.
/// The MAVLink messages that transport `message`. Parts cannot be numbered above 720 bytes; longer messages
/// are sent as successive whole ones, whose bytes autopilots forward at once.
/// @param number RTCM message counter; its low 5 bits are sent
[[nodiscard]] std::vector<GpsRtcmData> rtcm_data(std::string_view message, std::uint8_t number);

}  // namespace canyon::mavlink
