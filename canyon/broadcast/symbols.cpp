#include "canyon/broadcast/symbols.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>

#include "canyon/broadcast/messages.hpp"
#include "canyon/broadcast/schedule.hpp"

namespace canyon::broadcast {
namespace {

constexpr std::int64_t kNanoseconds = geodesy::GpsTime::kNanosecondsPerSecond;
constexpr std::int64_t kFrame = 30 * kNanoseconds;

std::int8_t symbol_of(std::uint32_t bit) {
  return bit != 0 ? -1 : 1;
}

/// Ten words of 30 bits as they are sent: data bits are turned over by the last bit of the word before
/// (IS-GPS-200, 20.3.5.2).
std::vector<std::int8_t> lnav_symbols(const std::vector<std::uint32_t>& words) {
  constexpr int kParity = 6;
  std::vector<std::int8_t> symbols;
  std::uint32_t before = 0;
  for (const std::uint32_t word : words) {
    for (int bit = 29; bit >= 0; --bit) {
      symbols.push_back(symbol_of((word >> bit & 1U) ^ (bit >= kParity ? before : 0)));
    }
    before = word & 1U;
  }
  return symbols;
}

/// A part of a page: ten bits of synchronisation, then 120 bits by the convolutional code of rate 1/2 and
/// constraint length 7 (171, 133 with its output inverted), interleaved over 30 columns and 8 rows
/// (OS SIS ICD 2.1, 4.1.4).
void put_inav_part(const std::vector<std::uint32_t>& page, std::size_t part,
                   std::vector<std::int8_t>& symbols) {
  constexpr std::uint32_t kSynchronisation = 0b0101100000;
  constexpr std::size_t kBits = 120, kRows = 8, kColumns = 30;
  for (int bit = 9; bit >= 0; --bit) symbols.push_back(symbol_of(kSynchronisation >> bit & 1U));
  std::vector<std::int8_t> coded;
  std::uint32_t state = 0;  // the newest bit is bit 6
  for (std::size_t i = 0; i < kBits; ++i) {
    const std::uint32_t bit = page.at(4 * part + i / 32) >> (31 - i % 32) & 1U;
    state = state >> 1U | bit << 6U;
    coded.push_back(symbol_of(static_cast<std::uint32_t>(std::popcount(state & 0171U)) & 1U));
    coded.push_back(symbol_of((static_cast<std::uint32_t>(std::popcount(state & 0133U)) & 1U) ^ 1U));
  }
  for (std::size_t row = 0; row < kRows; ++row) {
    for (std::size_t column = 0; column < kColumns; ++column) symbols.push_back(coded[column * kRows + row]);
  }
}

}  // namespace

std::optional<SymbolFrame> symbol_frame(const gnss::NavigationData& navigation, gnss::SatelliteId id,
                                        const gnss::Signal& signal, geodesy::GpsTime time) {
  const bool lnav =
      signal.name == "L1CA" && (id.system == gnss::System::GPS || id.system == gnss::System::QZSS);
  const bool inav = id.system == gnss::System::Galileo && signal.name == "E1";
  if (!lnav && !inav) return std::nullopt;
  // Subframes of 6 s; pages of 2 s from odd seconds on.
  const std::int64_t length = (lnav ? 6 : 2) * kNanoseconds, offset = lnav ? 0 : kNanoseconds;
  const auto begin_of = [&](std::int64_t step) {
    const std::int64_t since = time.nanoseconds() - offset;
    return geodesy::GpsTime::from_nanoseconds(time.nanoseconds() - (since % step + step) % step);
  };
  SymbolFrame frame;
  frame.start = begin_of(length);
  const geodesy::GpsTime first = begin_of(kFrame);
  const std::vector<SentMessage> sent =
      Schedule().sent(navigation, id, first, first + std::chrono::nanoseconds(kFrame));
  if (sent.empty()) return std::nullopt;
  const auto found = std::find_if(sent.begin(), sent.end(),
                                  [&](const SentMessage& message) { return message.start == frame.start; });
  if (lnav) {
    SystemMessage message;
    if (const auto k = navigation.klobuchar.find(id.system); k != navigation.klobuchar.end()) {
      message.klobuchar = k->second;
    }
    frame.symbol_s = 0.02;
    frame.symbols =
        lnav_symbols(found != sent.end() ? found->words : lnav_page18(id.system, message, frame.start));
    return frame;
  }
  gnss::KeplerEphemeris spare;
  spare.id = id;
  const std::vector<std::uint32_t> page =
      found != sent.end() ? found->words : inav_page(inav_word(spare, {}, 0, frame.start));
  frame.symbol_s = 0.004;
  put_inav_part(page, 0, frame.symbols);
  put_inav_part(page, 1, frame.symbols);
  return frame;
}

}  // namespace canyon::broadcast
