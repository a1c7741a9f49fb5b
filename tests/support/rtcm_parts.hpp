#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <tuple>

#include "canyon/base/mavlink/frames.hpp"

namespace canyon::mavlink {

/// Joins the parts, received in any order.
class RtcmParts {
 public:
  /// Bytes that are complete with this message; none while parts are missing. Parts of a message are dropped
  /// when one of another number arrives.
  [[nodiscard]] std::string receive(const GpsRtcmData& data);

 private:
  std::array<std::optional<std::string>, 4> parts_;
  std::optional<std::size_t> count_;  ///< known from the last part
  int number_ = -1;
};

inline std::string RtcmParts::receive(const GpsRtcmData& data) {
  constexpr std::size_t kPart = std::tuple_size_v<decltype(GpsRtcmData::data)>, kMaxParts = 4;
  const std::size_t length = std::min<std::size_t>(data.length, kPart);
  const std::string bytes(data.data.begin(), data.data.begin() + static_cast<std::ptrdiff_t>(length));
  if ((data.flags & 1U) == 0) return bytes;
  if (const int number = data.flags >> 3U; number != number_) {
    *this = {};
    number_ = number;
  }
  const std::size_t part = data.flags >> 1U & 3U;
  parts_[part] = bytes;
  if (length < kPart || part + 1 == kMaxParts) count_ = part + 1;
  if (!count_) return {};
  std::string message;
  for (std::size_t i = 0; i < *count_; ++i) {
    if (!parts_[i]) return {};
    message += *parts_[i];
  }
  *this = {};
  return message;
}

}  // namespace canyon::mavlink
