#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "canyon/base/payload.hpp"

// Frames of the UBX protocol (u-blox M8 Receiver Description UBX-13003221, chapter 32; u-blox F9 HPG 1.32
// Interface Description UBX-22008968, chapter 3): 0xB5 0x62, class, ID, length, payload, Fletcher checksum;
// numbers little-endian.

namespace canyon::encoding::ubx {

/// Class and ID of a message, class in the high byte: 0x0107 is NAV-PVT.
using MessageId = std::uint16_t;

/// The complete frame of a payload of at most 65535 bytes.
[[nodiscard]] std::string frame(MessageId id, std::string_view payload);

/// Unsigned number of `bytes` bytes at `offset`. Precondition: `offset` + `bytes` is within the data.
[[nodiscard]] std::uint64_t number_at(std::string_view bytes, std::size_t offset, std::size_t size);

/// Finds frames, and lines of NMEA 0183, in bytes cut anywhere. Ignores other bytes. After a damaged frame
/// the search continues after its first two bytes. Holds at most kMaxBytes.
class UbxParser {
 public:
  /// Payloads of commands are not longer.
  static constexpr std::size_t kMaxPayload = 1024;
  static constexpr std::size_t kMaxBytes = kMaxPayload + 8;
  static constexpr std::size_t kMaxLine = 100;

  struct Handlers {
    std::function<void(MessageId, std::string_view payload)> frame;
    std::function<void(std::string_view sentence)> line;  ///< "PUBX,41,...": checksum verified and removed
  };
  void receive(std::string_view bytes, const Handlers& handlers);
  [[nodiscard]] std::size_t held() const { return waiting_.size(); }

 private:
  std::string waiting_;  ///< begins with the possible start of a frame or a line
};

}  // namespace canyon::encoding::ubx
