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

// Frames of MAVLink 1 and 2 (mavlink.io, "Packet Serialization"), written by hand from that description:
// Debian packages no library of it.
/// The layout of a message's frames; it follows from the fields.
struct FrameLayout {
  std::uint32_t id = 0;
  std::string_view name;
  std::uint8_t crc_extra = 0;
  std::size_t base_bytes = 0;  ///< of a MAVLink 1 payload
  std::size_t bytes = 0;       ///< with extensions
};
/// The layouts of all alternatives of Message, in their order.
[[nodiscard]] const std::array<FrameLayout, std::variant_size_v<Message>>& layouts();

/// CRC-16/MCRF4XX (X.25's polynomial, bits reflected) of `bytes`, going on from `crc`.
[[nodiscard]] std::uint16_t crc16(std::string_view bytes, std::uint16_t crc = 0xFFFF);

struct Sender {
  std::uint8_t system = 1;       ///< the vehicle's
  std::uint8_t component = 220;  ///< MAV_COMP_ID_GPS
};

enum class Version : std::uint8_t { V1 = 1, V2 = 2 };

/// One frame, unsigned; of MAVLink 2 less the payload's trailing zeros, of MAVLink 1 without extensions.
/// Precondition: MAVLink 1 has ids to 255 alone.
[[nodiscard]] std::string encode(const Message& message, std::uint8_t sequence, Sender sender = {},
                                 Version version = Version::V2);

/// Bytes of the frame that begins `bytes`, as encode() made it. Precondition: it is there.
[[nodiscard]] std::size_t frame_bytes(std::string_view bytes);

struct Frame {
  Version version = Version::V2;
  std::uint8_t sequence = 0;
  Sender sender;
  Message message;
};

/// Finds frames in a stream of bytes that may be cut, mixed with anything, or hostile. Holds at most one
/// frame's bytes. Frames with a wrong checksum and messages that Canyon does not know are passed over; bytes
/// that only look like a frame cost no frame behind them. Signatures are passed over unchecked.
class MavlinkParser {
 public:
  /// Hands over each frame whose last byte is there, in order.
  void receive(std::string_view bytes, const std::function<void(const Frame&)>& each);
  /// Bytes so far that belonged to no frame.
  [[nodiscard]] std::uint64_t passed_over() const { return passed_over_; }

 private:
  std::string held_;  ///< begins with a magic byte, or is empty
  std::uint64_t passed_over_ = 0;
};

// Messages of RTCM 3 in GPS_RTCM_DATA (common.xml): up to 180 bytes in one, up to 720 in four parts.
/// The messages that carry `message`. Longer ones than 720 bytes, which parts cannot number, go as successive
/// whole ones: autopilots pass on the bytes of each at once.
/// @param number counts messages of RTCM; its low 5 bits are sent
[[nodiscard]] std::vector<GpsRtcmData> rtcm_data(std::string_view message, std::uint8_t number);

}  // namespace canyon::mavlink
