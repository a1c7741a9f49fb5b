#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/mavlink/messages.hpp"

// Messages of RTCM 3 in GPS_RTCM_DATA (common.xml): up to 180 bytes in one, up to 720 in four parts.

namespace canyon::mavlink {

/// The messages that carry `message`. Longer ones than 720 bytes, which parts cannot number, go as successive
/// whole ones: autopilots pass on the bytes of each at once.
/// @param number counts messages of RTCM; its low 5 bits are sent
[[nodiscard]] std::vector<GpsRtcmData> rtcm_data(std::string_view message, std::uint8_t number);

/// Joins the parts, in whatever order they come.
class RtcmParts {
 public:
  /// Bytes that are complete with this message; none while parts are missing. Parts of a message are
  /// forgotten when one of another number comes.
  [[nodiscard]] std::string receive(const GpsRtcmData& data);

 private:
  std::array<std::optional<std::string>, 4> parts_;
  std::optional<std::size_t> count_;  ///< known from the last part
  int number_ = -1;
};

}  // namespace canyon::mavlink
