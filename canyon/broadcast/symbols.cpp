#include "canyon/broadcast/symbols.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string_view>

#include "canyon/broadcast/messages.hpp"
#include "canyon/broadcast/schedule.hpp"
#include "canyon/gnss/broadcast_messages.hpp"

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

/// Bits by the convolutional code of rate 1/2 and constraint length 7 (171, 133): two symbols a bit.
/// @param inverted the second ones (Galileo) @param state of the encoder, the newest bit is bit 6
std::vector<std::int8_t> convolved(const Bits& bits, bool inverted, std::uint32_t state = 0) {
  std::vector<std::int8_t> coded;
  const auto parity = [&](std::uint32_t taps) {
    return static_cast<std::uint32_t>(std::popcount(state & taps)) & 1U;
  };
  for (std::size_t i = 0; i < bits.size(); ++i) {
    state = state >> 1U | (bits[i] ? 1U << 6U : 0U);
    coded.push_back(symbol_of(parity(0171U)));
    coded.push_back(symbol_of(parity(0133U) ^ (inverted ? 1U : 0U)));
  }
  return coded;
}

/// A page, or a part of one: synchronisation, then convolved bits interleaved over columns of 8 rows (OS SIS
/// ICD 2.1, 4.1.4).
void put_galileo_page(std::string_view synchronisation, const Bits& bits, std::vector<std::int8_t>& symbols) {
  constexpr std::size_t kRows = 8;
  for (const char c : synchronisation) symbols.push_back(symbol_of(c == '1' ? 1 : 0));
  const std::vector<std::int8_t> coded = convolved(bits, true);
  for (std::size_t row = 0; row < kRows; ++row) {
    for (std::size_t i = row; i < coded.size(); i += kRows) symbols.push_back(coded[i]);
  }
}

SymbolFrame inav_frame(const std::vector<std::uint32_t>& page, geodesy::GpsTime start) {
  SymbolFrame frame{start, 0.004, {}};
  for (std::size_t part = 0; part < 8; part += 4) {
    Bits bits;
    for (std::size_t word = part; word < part + 3; ++word) bits.put(page.at(word), 32);
    put_galileo_page("0101100000", bits.put(page.at(part + 3) >> 8U, 24), frame.symbols);
  }
  return frame;
}

/// Delay of a signal behind the clock: the one broadcast for it, else that of the ephemeris, like
/// orbit::BroadcastSky.
double delay_of(const gnss::NavigationData& navigation, const gnss::KeplerEphemeris& e,
                std::string_view name) {
  const auto signals = gnss::signals_of(e.id.system);
  const auto signal = std::find_if(signals.begin(), signals.end(),
                                   [&](const gnss::Signal& each) { return each.name == name; });
  const std::size_t index = gnss::index_of(*signal);
  double delay_s = gnss::group_delays_s(e, false)[index], nearest_s = std::numeric_limits<double>::infinity();
  for (const gnss::SignalDelays& each : navigation.signal_delays) {
    const double apart_s = std::abs(e.toc - each.toc);
    if (each.id != e.id || !std::isfinite(each.group_delay_s[index]) || apart_s >= nearest_s) continue;
    nearest_s = apart_s;
    delay_s = each.group_delay_s[index];
  }
  return delay_s;
}

/// Messages that follow each other from the begin of the week on, of one ephemeris for `turn` of them.
struct Place {
  geodesy::GpsTime start, begin_of_turn;
  int number = 0;  ///< of the turn
};
/// @param offset_s when the week begins
Place place_of(geodesy::GpsTime time, std::int64_t length_s, std::int64_t turn, std::int64_t offset_s = 0) {
  const std::int64_t length = length_s * kNanoseconds;
  const std::int64_t since = (time - std::chrono::seconds(offset_s)).nanosecond_of_week();
  const auto back = [&](std::int64_t step) {
    return geodesy::GpsTime::from_nanoseconds(time.nanoseconds() - since % step);
  };
  return {back(length), back(length * turn), static_cast<int>(since / length % turn)};
}

CnavDelays cnav_delays(const gnss::NavigationData& navigation, const gnss::KeplerEphemeris& e) {
  return {e.group_delay[0], delay_of(navigation, e, "L1CA"), delay_of(navigation, e, "L2C"),
          delay_of(navigation, e, "L5"), delay_of(navigation, e, "L1C")};
}

Bits cnav_bits(const gnss::NavigationData& navigation, gnss::SatelliteId id, geodesy::GpsTime time,
               int length_s) {
  constexpr std::array<int, 4> kTypes{10, 11, 30, 33};
  const Place place = place_of(time, length_s, kTypes.size());
  const gnss::KeplerEphemeris* e = sent_ephemeris(navigation, id, place.begin_of_turn);
  if (e == nullptr) return {};
  return cnav_message(*e, system_message(navigation, id.system, place.start), cnav_delays(navigation, *e),
                      kTypes[static_cast<std::size_t>(place.number)], place.start, length_s);
}

/// A message of bits_at(time) of this length through an encoder that goes on from message to message
/// (IS-GPS-200, 3.3.3.1.1; RTCA DO-229, A.4.2.2).
template <typename BitsAt>
std::optional<SymbolFrame> convolved_frame(geodesy::GpsTime time, int length_s, const BitsAt& bits_at) {
  const Bits bits = bits_at(time), before = bits_at(time + -length_s);
  if (bits.size() == 0 || before.size() == 0) return std::nullopt;
  std::uint32_t state = 0;
  for (std::size_t i = before.size() - 6; i < before.size(); ++i) {
    state = state >> 1U | (before[i] ? 1U << 6U : 0U);
  }
  return SymbolFrame{place_of(time, length_s, 1).start, length_s / (2.0 * static_cast<double>(bits.size())),
                     convolved(bits, false, state)};
}

std::optional<SymbolFrame> cnav_frame(const gnss::NavigationData& navigation, gnss::SatelliteId id,
                                      geodesy::GpsTime time, int length_s) {
  return convolved_frame(time, length_s,
                         [&](geodesy::GpsTime t) { return cnav_bits(navigation, id, t, length_s); });
}

std::optional<SymbolFrame> sbas_frame(const gnss::NavigationData& navigation, gnss::SatelliteId id,
                                      geodesy::GpsTime time) {
  return convolved_frame(time, 1, [&](geodesy::GpsTime t) {
    const geodesy::GpsTime start = place_of(t, 1, 1).start;
    const gnss::SbasEphemeris* sent = nullptr;
    for (const gnss::SbasEphemeris& each : navigation.sbas) {
      if (each.id != id) continue;
      if (sent == nullptr || std::abs(each.toe - start) < std::abs(sent->toe - start)) sent = &each;
    }
    if (sent == nullptr) return Bits();
    const bool orbit = unsent_ephemeris(id, gnss::signals_of(id.system)[0], start, start + 1) == 0;
    return sbas_message(*sent, orbit ? 9 : sent->health != 0 ? 0 : 63, start);
  });
}

std::optional<SymbolFrame> fnav_frame(const gnss::NavigationData& navigation, gnss::SatelliteId id,
                                      geodesy::GpsTime time) {
  const Place place = place_of(time, 10, 5);
  const gnss::KeplerEphemeris* e = sent_ephemeris(navigation, id, place.begin_of_turn);
  if (e == nullptr) return std::nullopt;
  SymbolFrame frame{place.start, 0.02, {}};
  put_galileo_page(
      "101101110000",
      fnav_page(*e, system_message(navigation, id.system, place.start), place.number + 1, place.start),
      frame.symbols);
  return frame;
}

std::optional<SymbolFrame> e5b_frame(const gnss::NavigationData& navigation, gnss::SatelliteId id,
                                     geodesy::GpsTime time) {
  constexpr std::array<int, 15> kWords{1, 3, 5, 0, 0, 0, 0, 0, 0, 0, 2, 4, 6, 0, 0};
  const Place place = place_of(time, 2, kWords.size());
  const gnss::KeplerEphemeris* e = sent_ephemeris(navigation, id, place.begin_of_turn);
  if (e == nullptr) return std::nullopt;
  const int word = kWords[static_cast<std::size_t>(place.number)];
  return inav_frame(
      inav_page(inav_word(*e, system_message(navigation, id.system, place.start), word, place.start)),
      place.start);
}

std::vector<std::int8_t> symbols_of(const Bits& bits) {
  std::vector<std::int8_t> symbols;
  for (std::size_t i = 0; i < bits.size(); ++i) symbols.push_back(symbol_of(bits[i] ? 1 : 0));
  return symbols;
}

/// A word of the cyclic code of this check polynomial: it begins with `information`, and of each run of bits
/// those of the polynomial's terms (the first bit x^0) add to 0.
Bits cyclic(std::uint64_t information, int width, std::uint32_t polynomial, std::size_t size) {
  Bits word;
  word.put(information, width);
  for (std::size_t first = 0; word.size() < size; ++first) {
    std::uint32_t sum = 0;
    for (std::size_t i = 0; first + i < word.size(); ++i) {
      sum ^= (polynomial >> i & 1U) & (word[first + i] ? 1U : 0U);
    }
    word.put(sum, 1);
  }
  return word;
}
/// BCH(51, 8) of B1C and L1C (BDS-SIS-ICD-B1C-1.0, table 6-1; IS-GPS-800, 3.2.3.2).
Bits bch_51_8(std::uint64_t information) {
  return cyclic(information, 8, 0b1'1001'1111, 51);
}

/// Bits that were written row by row, column by column.
Bits interleaved(const Bits& bits, std::size_t columns) {
  Bits result;
  for (std::size_t column = 0; column < columns; ++column) {
    for (std::size_t i = column; i < bits.size(); i += columns) result.put(bits[i] ? 1 : 0, 1);
  }
  return result;
}

/// IS-GPS-800, 3.2.3 and 3.5.2: BCH of the count of 18 s in two hours, to the begin of the next frame; 38
/// rows of 46.
std::optional<SymbolFrame> cnav2_frame(const gnss::NavigationData& navigation, gnss::SatelliteId id,
                                       geodesy::GpsTime time) {
  const geodesy::GpsTime start = place_of(time, 18, 1).start;
  const gnss::KeplerEphemeris* e = sent_ephemeris(navigation, id, start);
  if (e == nullptr) return std::nullopt;
  const CnavDelays delays = cnav_delays(navigation, *e);
  Bits rows = ldpc_encoded(LdpcCode::Cnav2Subframe2, cnav2_subframe2(*e, delays, start));
  rows.append(ldpc_encoded(LdpcCode::Cnav2Subframe3,
                           cnav2_subframe3(*e, system_message(navigation, id.system, start), delays, start)));
  const auto count = static_cast<std::uint64_t>((start.nanosecond_of_week() / (18 * kNanoseconds) + 1) % 400);
  const bool ninth = count >> 8 != 0;  // turns the others over
  const Bits low = bch_51_8(count & 255);
  Bits bits;
  bits.put(ninth, 1);
  for (std::size_t i = 0; i < low.size(); ++i) bits.put(low[i] != ninth, 1);
  bits.append(interleaved(rows, 46));
  return SymbolFrame{start, 0.01, symbols_of(bits)};
}

BcnavDelays bcnav_delays(const gnss::NavigationData& navigation, const gnss::KeplerEphemeris& e) {
  return {delay_of(navigation, e, "B1C"), delay_of(navigation, e, "B2a"), delay_of(navigation, e, "B2b")};
}

/// BDS-SIS-ICD-B1C-1.0, 6.2.1 and 6.2.2: BCH of PRN and second of the hour; 36 rows, two of subframe 2 and
/// one of subframe 3 in turn, the last three of subframe 2.
std::optional<SymbolFrame> bcnav1_frame(const gnss::NavigationData& navigation, gnss::SatelliteId id,
                                        geodesy::GpsTime time) {
  const geodesy::GpsTime start = place_of(time, 18, 1, geodesy::kBdtSecondsOffset).start;
  const gnss::KeplerEphemeris* e = sent_ephemeris(navigation, id, start);
  if (e == nullptr) return std::nullopt;
  const Bits second =
      ldpc_encoded(LdpcCode::Bcnav1Subframe2, bcnav1_subframe2(*e, bcnav_delays(navigation, *e), start));
  const Bits third = ldpc_encoded(LdpcCode::Bcnav1Subframe3,
                                  bcnav1_subframe3(*e, system_message(navigation, id.system, start), start));
  constexpr std::size_t kRows = 36, kColumns = 48;
  Bits rows;
  for (std::size_t row = 0, of_second = 0, of_third = 0; row < kRows; ++row) {
    const bool last = row % 3 == 2 && row < 33;
    rows.put(last ? third.number(kColumns * of_third++, kColumns)
                  : second.number(kColumns * of_second++, kColumns),
             kColumns);
  }
  const std::int64_t frame = bdt(start).nanosecond_of_week() / (18 * kNanoseconds);
  Bits bits = cyclic(static_cast<std::uint64_t>(id.number), 6, 0b101'0111, 21);
  bits.append(bch_51_8(static_cast<std::uint64_t>(frame % 200))).append(interleaved(rows, kColumns));
  return SymbolFrame{start, 0.01, symbols_of(bits)};
}

/// BDS-SIS-ICD-B2a-1.0, 6.2.
std::optional<SymbolFrame> bcnav2_frame(const gnss::NavigationData& navigation, gnss::SatelliteId id,
                                        geodesy::GpsTime time) {
  constexpr std::array<int, 4> kTypes{10, 11, 30, 34};
  const Place place = place_of(time, 3, kTypes.size(), geodesy::kBdtSecondsOffset);
  const gnss::KeplerEphemeris* e = sent_ephemeris(navigation, id, place.begin_of_turn);
  if (e == nullptr) return std::nullopt;
  Bits bits;
  bits.put(0xE24DE8, 24);
  bits.append(ldpc_encoded(
      LdpcCode::Bcnav2,
      bcnav2_message(*e, system_message(navigation, id.system, place.start), bcnav_delays(navigation, *e),
                     kTypes[static_cast<std::size_t>(place.number)], place.start)));
  return SymbolFrame{place.start, 0.005, symbols_of(bits)};
}

/// BDS-SIS-ICD-B2b-1.0, 6.2.
std::optional<SymbolFrame> bcnav3_frame(const gnss::NavigationData& navigation, gnss::SatelliteId id,
                                        geodesy::GpsTime time) {
  const Place place = place_of(time, 1, 2, geodesy::kBdtSecondsOffset);
  const gnss::KeplerEphemeris* e = sent_ephemeris(navigation, id, place.begin_of_turn);
  if (e == nullptr) return std::nullopt;
  Bits bits;
  bits.put(0xEB90, 16).count(id.number, 6).put(0, 6);
  bits.append(
      ldpc_encoded(LdpcCode::Bcnav3,
                   bcnav3_message(*e, system_message(navigation, id.system, place.start),
                                  bcnav_delays(navigation, *e), place.number == 0 ? 10 : 30, place.start)));
  return SymbolFrame{place.start, 0.001, symbols_of(bits)};
}

/// Words of 30 bits, as BeiDou sends them: the bits of a word's two code words in turn, of the first word as
/// they stand (BDS-SIS-ICD-B1I-3.0, 5.1.3).
std::vector<std::int8_t> beidou_symbols(const std::vector<std::uint32_t>& words) {
  std::vector<std::int8_t> symbols;
  const auto put = [&](std::uint32_t word, int bit) { symbols.push_back(symbol_of(word >> bit & 1U)); };
  for (int bit = 29; bit >= 0; --bit) put(words.front(), bit);
  for (std::size_t i = 1; i < words.size(); ++i) {
    for (int bit = 0; bit < 11; ++bit) put(words[i], 29 - bit), put(words[i], 18 - bit);
    for (int bit = 0; bit < 4; ++bit) put(words[i], 7 - bit), put(words[i], 3 - bit);
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

/// Lengths [ns] of a frame of symbols, and of the time in which Schedule sends at most one message.
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
  if (id.system == gnss::System::GPS || id.system == gnss::System::QZSS) {
    if (signal.name == "L2C") return cnav_frame(navigation, id, time, 12);
    if (signal.name == "L5") return cnav_frame(navigation, id, time, 6);
    if (signal.name == "L1C") return cnav2_frame(navigation, id, time);
  }
  if (id.system == gnss::System::SBAS && signal.name == "L1CA") return sbas_frame(navigation, id, time);
  if (signal.name == "E5a") return fnav_frame(navigation, id, time);
  if (signal.name == "E5b") return e5b_frame(navigation, id, time);
  if (id.system == gnss::System::BeiDou && !gnss::is_beidou_geo(id)) {
    if (signal.name == "B1C") return bcnav1_frame(navigation, id, time);
    if (signal.name == "B2a") return bcnav2_frame(navigation, id, time);
    if (signal.name == "B2b") return bcnav3_frame(navigation, id, time);
  }
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
  const auto number = static_cast<int>(
      std::lround((frame.start - message_start) * 1e9 / static_cast<double>(lengths.symbols)));
  const std::vector<SentMessage> sent =
      Schedule().sent(navigation, id, first, first + std::chrono::nanoseconds(kFrame));
  if (sent.empty()) return std::nullopt;
  const auto found = std::find_if(sent.begin(), sent.end(),
                                  [&](const SentMessage& message) { return message.start == frame.start; });
  const bool known = found != sent.end();
  const auto place =
      static_cast<int>(std::lround((frame.start - first) * 1e9 / static_cast<double>(lengths.symbols))) + 1;
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
      return inav_frame(known ? found->words : inav_page(inav_word(spare, {}, 0, frame.start)), frame.start);
    }
    case Message::D1:
      frame.symbol_s = 0.02;
      frame.symbols = beidou_symbols(known ? found->words : spare_beidou_subframe(place, frame.start));
      break;
    case Message::D2: {
      // Ten words of a page, of which Schedule has as many as receivers pass on.
      frame.symbol_s = 0.002;
      frame.symbols = beidou_symbols(known ? found->words : spare_beidou_subframe(number + 1, message_start));
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
