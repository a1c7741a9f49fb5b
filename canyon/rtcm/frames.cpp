#include "canyon/rtcm/frames.hpp"

#include <algorithm>

namespace canyon::rtcm {

using broadcast::Bits;

namespace {

constexpr char kPreamble = '\xD3';
constexpr std::size_t kHeader = 3, kChecksum = 3;

Bits bits_of(std::string_view bytes) {
  Bits bits;
  for (const char c : bytes) bits.put(static_cast<unsigned char>(c), 8);
  return bits;
}

}  // namespace

std::string frame(const Bits& message) {
  const std::size_t bytes = (message.size() + 7) / 8;
  Bits all;
  all.put(0xD3, 8).put(0, 6).put(bytes, 10).append(message).put(0,
                                                                static_cast<int>(8 * bytes - message.size()));
  all.put(broadcast::crc24q(all), 24);
  std::string text;
  for (std::size_t i = 0; i < all.size(); i += 8) text += static_cast<char>(all.number(i, 8));
  return text;
}

void FrameParser::receive(std::string_view bytes, const std::function<void(const Bits&)>& each) {
  buffer_ += bytes;
  const std::string_view all = buffer_;
  std::size_t at = 0;
  while (at < all.size()) {
    const std::size_t preamble = std::min(all.find(kPreamble, at), all.size());
    passed_over_ += preamble - at;
    at = preamble;
    const std::string_view rest = all.substr(at);
    if (rest.size() < kHeader) break;
    const auto second = static_cast<unsigned char>(rest[1]), third = static_cast<unsigned char>(rest[2]);
    const std::size_t length = static_cast<std::size_t>(second & 3U) << 8 | third;
    const bool plausible = second < 4;
    if (plausible && rest.size() < kHeader + length + kChecksum) break;
    // The checksum of a message with its checksum behind it is 0.
    if (plausible && broadcast::crc24q(bits_of(rest.substr(0, kHeader + length + kChecksum))) == 0) {
      each(bits_of(rest.substr(kHeader, length)));
      at += kHeader + length + kChecksum;
      continue;
    }
    if (plausible) ++damaged_;
    ++passed_over_;
    ++at;
  }
  buffer_.erase(0, at);
}

}  // namespace canyon::rtcm
