#include "canyon/receiver/rtcm/frames.hpp"

#include <algorithm>
#include <cmath>

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
    // The checksum of a message followed by its checksum is 0.
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

using gnss::System;

namespace {

/// RTCM 10403.3, tables 3.5-78 and following (satellites), 3.5-91, 3.5-96, 3.5-99, 3.5-102, 3.5-105, 3.5-108
/// (signals; BeiDou's newer ones: amendment 1), in the order of kMsmSystems.
struct Masks {
  int satellites = 0;
  int offset = 0;  ///< of a satellite's number from its bit
  /// Two letters per bit, from 1 on; dots: reserved.
  std::string_view signals;
};
constexpr std::array<Masks, kMsmSystems.size()> kMasks{{
    {63, 0, "..1C1P1W......2C2P2W........2S2L2X........5I5Q5X..........1S1L1X"},
    {24, 0, "..1C1P........2C2P"},
    {50, 0, "..1C1A1B1X1Z..6C6A6B6X6Z..7I7Q7X..8I8Q8X..5I5Q5X"},
    {39, 19, "..1C......................................5I5Q5X"},
    {10, 0, "..1C............6S6L6X......2S2L2X........5I5Q5X..........1S1L1X"},
    {63, 0, "..2I2Q2X......6I6Q6X......7I7Q7X..........5D5P5X7D........1D1P1X"},
}};

const Masks& masks(System system) {
  const auto* const at = std::find(kMsmSystems.begin(), kMsmSystems.end(), system);
  return kMasks[static_cast<std::size_t>(at - kMsmSystems.begin())];
}

}  // namespace

int mask_number(gnss::SatelliteId id) {
  const Masks& m = masks(id.system);
  const int index = id.number - m.offset;
  return index >= 1 && index <= m.satellites ? index : 0;
}

std::optional<gnss::SatelliteId> satellite_at(System system, int index) {
  const Masks& m = masks(system);
  if (index < 1 || index > m.satellites) return std::nullopt;
  return gnss::SatelliteId{system, static_cast<std::uint8_t>(index + m.offset)};
}

std::string_view rinex_code(System system, int index) {
  const std::string_view signals = masks(system).signals;
  const auto at = 2 * static_cast<std::size_t>(std::max(index - 1, 0));
  if (index < 1 || at >= signals.size() || signals[at] == '.') return {};
  return signals.substr(at, 2);
}

int lock_time_indicator(double seconds, bool extended) {
  const double ms = std::clamp(std::floor(seconds * 1e3 + 1e-6), 0.0, std::ldexp(1.0, 26));
  if (!extended) return ms < 32 ? 0 : std::min(std::ilogb(ms) - 4, 15);
  // Segment k has 32 steps of 2^k ms, the first one 64 of 1 ms.
  const int k = ms < 64 ? 0 : std::ilogb(ms) - 5;
  return static_cast<int>(std::ldexp(ms, -k)) + 32 * k;
}

double min_lock_ms(int indicator, bool extended) {
  if (!extended) return indicator == 0 ? 0 : std::ldexp(1.0, indicator + 4);
  const int k = std::max(indicator / 32 - 1, 0);
  return std::ldexp(indicator - 32 * k, k);
}

}  // namespace canyon::rtcm
