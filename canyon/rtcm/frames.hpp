#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "canyon/broadcast/bits.hpp"

// RTCM 10403.3, Differential GNSS Services, version 3. Signs, fields and tables are named by its DF numbers
// and tables.

namespace canyon::rtcm {

/// A message as it is sent (4.2): preamble D3, 6 reserved bits, length, the message filled to whole bytes,
/// CRC-24Q. Precondition: at most 1,023 bytes.
[[nodiscard]] std::string frame(const broadcast::Bits& message);

/// Finds frames in a stream of bytes that may be cut, damaged, mixed with anything, or hostile. Holds less
/// than one frame's bytes between two calls. Bytes that look like a frame and are not one cost no frame
/// behind them.
class FrameParser {
 public:
  /// Hands over the message of each frame whose last byte is there, in order.
  void receive(std::string_view bytes, const std::function<void(const broadcast::Bits&)>& each);
  /// Counts bytes that began like a frame and had a wrong checksum.
  [[nodiscard]] std::uint64_t damaged() const { return damaged_; }
  /// Bytes so far that belonged to no frame.
  [[nodiscard]] std::uint64_t passed_over() const { return passed_over_; }
  /// Bytes of a frame whose end has not come.
  [[nodiscard]] std::size_t held() const { return buffer_.size(); }

 private:
  std::string buffer_;
  std::uint64_t damaged_ = 0, passed_over_ = 0;
};

}  // namespace canyon::rtcm
