#include "canyon/broadcast/symbols.hpp"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cstddef>
#include <string_view>

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

/// Words of 30 bits, as BeiDou sends them.
std::vector<std::int8_t> plain_symbols(const std::vector<std::uint32_t>& words) {
  std::vector<std::int8_t> symbols;
  for (const std::uint32_t word : words) {
    for (int bit = 29; bit >= 0; --bit) symbols.push_back(symbol_of(word >> bit & 1U));
  }
  return symbols;
}

/// A string as it is sent: 85 bits by differences, each turned over in its second half, then the time mark
/// (ICD L1, L2 5.1, 3.3.2.2).
std::vector<std::int8_t> glonass_symbols(const std::vector<std::uint32_t>& words) {
  constexpr std::string_view kTimeMark = "111110001101110101000010010110";
  std::vector<std::int8_t> symbols;
  std::uint32_t bit = 0;
  for (std::size_t i = 0; i < 85; ++i) {
    bit ^= words.at(i / 32) >> (31 - i % 32) & 1U;
    symbols.push_back(symbol_of(bit ^ 1U));
    symbols.push_back(symbol_of(bit));
  }
  for (const char c : kTimeMark) symbols.push_back(symbol_of(c == '1' ? 1 : 0));
  return symbols;
}

enum class Message { Lnav, Inav, D1, D2, Glonass };

std::optional<Message> message_of(gnss::SatelliteId id, const gnss::Signal& signal) {
  switch (id.system) {
    case gnss::System::GPS:
    case gnss::System::QZSS:
      if (signal.name == "L1CA") return Message::Lnav;
      break;
    case gnss::System::Galileo:
      if (signal.name == "E1") return Message::Inav;
      break;
    case gnss::System::BeiDou:
      if (signal.name != "B1I" && signal.name != "B2I" && signal.name != "B3I") break;
      return gnss::is_beidou_geo(id) ? Message::D2 : Message::D1;
    case gnss::System::GLONASS:
      if (signal.name == "G1" || signal.name == "G2") return Message::Glonass;
      break;
    case gnss::System::SBAS:
      break;
  }
  return std::nullopt;
}

/// Lengths [ns] of a frame of symbols, and of that of which Schedule sends at most one message.
struct Lengths {
  std::int64_t symbols, message;
};
Lengths lengths_of(Message message) {
  switch (message) {
    case Message::Lnav:
    case Message::D1:
      return {6 * kNanoseconds, 6 * kNanoseconds};
    case Message::D2:
      return {kNanoseconds * 6 / 10, 3 * kNanoseconds};
    case Message::Inav:
    case Message::Glonass:
      break;
  }
  return {2 * kNanoseconds, 2 * kNanoseconds};
}

}  // namespace

std::optional<SymbolFrame> symbol_frame(const gnss::NavigationData& navigation, gnss::SatelliteId id,
                                        const gnss::Signal& signal, geodesy::GpsTime time) {
  const std::optional<Message> kind = message_of(id, signal);
  if (!kind) return std::nullopt;
  const Lengths lengths = lengths_of(*kind);
  const std::int64_t offset = Schedule::offset(id, time).count();
  const auto begin_of = [&](std::int64_t step) {
    const std::int64_t since = time.nanoseconds() - offset;
    return geodesy::GpsTime::from_nanoseconds(time.nanoseconds() - (since % step + step) % step);
  };
  SymbolFrame frame;
  frame.start = begin_of(lengths.symbols);
  const geodesy::GpsTime message_start = begin_of(lengths.message), first = begin_of(kFrame);
  const auto number =
      static_cast<int>((frame.start - message_start) * 1e9 / static_cast<double>(lengths.symbols) + 0.5);
  const std::vector<SentMessage> sent =
      Schedule().sent(navigation, id, first, first + std::chrono::nanoseconds(kFrame));
  if (sent.empty()) return std::nullopt;
  const auto found = std::find_if(sent.begin(), sent.end(),
                                  [&](const SentMessage& message) { return message.start == frame.start; });
  const bool known = found != sent.end();
  const auto place =
      static_cast<int>((frame.start - first) * 1e9 / static_cast<double>(lengths.symbols) + 0.5) + 1;
  switch (*kind) {
    case Message::Lnav: {
      SystemMessage message;
      if (const auto k = navigation.klobuchar.find(id.system); k != navigation.klobuchar.end()) {
        message.klobuchar = k->second;
      }
      frame.symbol_s = 0.02;
      frame.symbols = lnav_symbols(known ? found->words : lnav_page18(id.system, message, frame.start));
      break;
    }
    case Message::Inav: {
      gnss::KeplerEphemeris spare;
      spare.id = id;
      const std::vector<std::uint32_t> page =
          known ? found->words : inav_page(inav_word(spare, {}, 0, frame.start));
      frame.symbol_s = 0.004;
      put_inav_part(page, 0, frame.symbols);
      put_inav_part(page, 1, frame.symbols);
      break;
    }
    case Message::D1:
      frame.symbol_s = 0.02;
      frame.symbols = plain_symbols(known ? found->words : spare_beidou_subframe(place, frame.start));
      break;
    case Message::D2: {
      // Ten words of a page, of which Schedule has as many as receivers pass on.
      frame.symbol_s = 0.002;
      frame.symbols = plain_symbols(known ? found->words : spare_beidou_subframe(number + 1, message_start));
      break;
    }
    case Message::Glonass:
      frame.symbol_s = 0.01;
      frame.symbols = glonass_symbols(known ? found->words : glonass_string({}, place, first).words32());
      break;
  }
  return frame;
}

}  // namespace canyon::broadcast
