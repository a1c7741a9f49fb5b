#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/sky/broadcast/bits.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"

namespace canyon::rtcm {

// RTCM 10403.3, Differential GNSS Services, version 3. Signs, fields and tables have its (DF) numbers.
/// A message with its frame (4.2): preamble D3, 6 reserved bits, length, the message padded to whole bytes,
/// CRC-24Q. Precondition: at most 1,023 bytes.
[[nodiscard]] std::string frame(const broadcast::Bits& message);

/// Finds frames in a stream of bytes that may be cut, damaged, mixed with other data, or hostile. Stores less
/// than one frame's bytes between two calls. Bytes that only look like a frame do not hide a later frame.
class FrameParser {
 public:
  /// Calls `each` with the message of each complete frame, in order.
  void receive(std::string_view bytes, const std::function<void(const broadcast::Bits&)>& each);
  /// Number of frame-like byte sequences with a wrong checksum.
  [[nodiscard]] std::uint64_t damaged() const { return damaged_; }
  /// Number of bytes outside frames.
  [[nodiscard]] std::uint64_t passed_over() const { return passed_over_; }
  /// Number of stored bytes of an incomplete frame.
  [[nodiscard]] std::size_t held() const { return buffer_.size(); }

 private:
  std::string buffer_;
  std::uint64_t damaged_ = 0, passed_over_ = 0;
};

// Common parts of messages of the Multiple Signal type (MSM): RTCM 10403.3, 3.5.16.
/// Distance of light in a millisecond [m], the unit of MSM's ranges.
inline constexpr double kMillisecond_m = geodesy::kSpeedOfLight * 1e-3;

/// The i-th has messages 1071 + 10 i (MSM1) to 1077 + 10 i (MSM7).
inline constexpr std::array kMsmSystems{gnss::System::GPS,  gnss::System::GLONASS, gnss::System::Galileo,
                                        gnss::System::SBAS, gnss::System::QZSS,    gnss::System::BeiDou};

/// Bit number in the mask of satellites (DF394), 1 to 64; 0: none.
[[nodiscard]] int mask_number(gnss::SatelliteId id);
/// The satellite of a bit in the mask, 1 to 64; empty for reserved ones.
[[nodiscard]] std::optional<gnss::SatelliteId> satellite_at(gnss::System system, int index);

/// RINEX code of a bit in the mask of signals (DF395), 1 to 32: "1C"; empty for reserved ones.
[[nodiscard]] std::string_view rinex_code(gnss::System system, int index);

/// DF407 (table 3.5-75: 0 to 704) or, not extended, DF402 (table 3.5-74: 0 to 15) of a phase that has been
/// continuous for `seconds` >= 0 [s].
[[nodiscard]] int lock_time_indicator(double seconds, bool extended);
/// The minimum lock time [ms] of an indicator: DF402 (table 3.5-74, 0 to 15) or DF407 (0 to 704). The minimum
/// of the next indicator is the upper bound.
[[nodiscard]] double min_lock_ms(int indicator, bool extended);

}  // namespace canyon::rtcm
