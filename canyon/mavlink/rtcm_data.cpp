#include "canyon/mavlink/rtcm_data.hpp"

#include <algorithm>

namespace canyon::mavlink {
namespace {

constexpr std::size_t kPart = std::tuple_size_v<decltype(GpsRtcmData::data)>, kMostParts = 4;

}  // namespace

std::vector<GpsRtcmData> rtcm_data(std::string_view message, std::uint8_t number) {
  const bool divided = message.size() > kPart && message.size() <= kMostParts * kPart;
  std::vector<GpsRtcmData> parts;
  const auto add = [&](std::string_view bytes) {
    GpsRtcmData& part = parts.emplace_back();
    part.flags = static_cast<std::uint8_t>(number << 3U | (divided ? (parts.size() - 1) << 1U | 1U : 0U));
    part.length = static_cast<std::uint8_t>(bytes.size());
    std::copy(bytes.begin(), bytes.end(), part.data.begin());
  };
  for (std::size_t at = 0; at < message.size(); at += kPart) add(message.substr(at, kPart));
  // The end shows by a part that is not full, or the fourth.
  if (divided && message.size() % kPart == 0 && parts.size() < kMostParts) add({});
  return parts;
}

std::string RtcmParts::receive(const GpsRtcmData& data) {
  const std::size_t length = std::min<std::size_t>(data.length, kPart);
  const std::string bytes(data.data.begin(), data.data.begin() + static_cast<std::ptrdiff_t>(length));
  if ((data.flags & 1U) == 0) return bytes;
  if (const int number = data.flags >> 3U; number != number_) {
    *this = {};
    number_ = number;
  }
  const std::size_t part = data.flags >> 1U & 3U;
  parts_[part] = bytes;
  if (length < kPart || part + 1 == kMostParts) count_ = part + 1;
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
