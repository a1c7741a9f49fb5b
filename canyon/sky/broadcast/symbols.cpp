#include "canyon/sky/broadcast/symbols.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <chrono>
#include <cmath>
#include <limits>
#include <mutex>
#include <string_view>

#include "canyon/sky/broadcast/messages.hpp"
#include "canyon/sky/broadcast/schedule.hpp"

namespace canyon::broadcast {
namespace {

using Symbols = std::vector<std::int8_t>;

std::int8_t symbol_of(std::uint32_t bit) {
  return bit != 0 ? -1 : 1;
}

/// Ten words of 30 bits as sent: data bits are inverted by the last bit of the preceding word (IS-GPS-200,
/// 20.3.5.2).
Symbols lnav_symbols(const std::vector<std::uint32_t>& words) {
  constexpr int kParity = 6;
  Symbols symbols;
  std::uint32_t before = 0;
  for (const std::uint32_t word : words) {
    for (int bit = 29; bit >= 0; --bit)
      symbols.push_back(symbol_of((word >> bit & 1U) ^ (bit >= kParity ? before : 0)));
    before = word & 1U;
  }
  return symbols;
}

/// Bits by the convolutional code of rate 1/2 and constraint length 7 (171, 133): two symbols a bit.
/// @param inverted inverts the second symbols (Galileo) @param state of the encoder, the newest bit is bit 6
Symbols convolved(const Bits& bits, bool inverted, std::uint32_t state = 0) {
  Symbols coded;
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
void put_galileo_page(std::string_view synchronisation, const Bits& bits, Symbols& symbols) {
  constexpr std::size_t kRows = 8;
  for (const char c : synchronisation) symbols.push_back(symbol_of(c == '1' ? 1 : 0));
  const Symbols coded = convolved(bits, true);
  for (std::size_t row = 0; row < kRows; ++row)
    for (std::size_t i = row; i < coded.size(); i += kRows) symbols.push_back(coded[i]);
}

Symbols inav_symbols(const std::vector<std::uint32_t>& page) {
  Symbols symbols;
  for (std::size_t part = 0; part < 8; part += 4) {
    Bits bits;
    for (std::size_t word = part; word < part + 3; ++word) bits.put(page.at(word), 32);
    put_galileo_page("0101100000", bits.put(page.at(part + 3) >> 8U, 24), symbols);
  }
  return symbols;
}

/// Delay of a signal relative to the clock: the one broadcast for it, else the one in the ephemeris, as in
/// orbit::BroadcastSky.
double signal_delay_s(const gnss::NavigationData& navigation, const gnss::KeplerEphemeris& e,
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

/// A message through an encoder that continues from the preceding message (IS-GPS-200, 3.3.3.1.1; RTCA
/// DO-229, A.4.2.2).
Symbols convolved_after(const Bits& before, const Bits& bits) {
  std::uint32_t state = 0;
  for (std::size_t i = before.size() - 6; i < before.size(); ++i)
    state = state >> 1U | (before[i] ? 1U << 6U : 0U);
  return convolved(bits, false, state);
}

Symbols symbols_of(const Bits& bits) {
  Symbols symbols;
  for (std::size_t i = 0; i < bits.size(); ++i) symbols.push_back(symbol_of(bits[i] ? 1 : 0));
  return symbols;
}

/// A word of the cyclic code of this check polynomial: it begins with `information`, and in each run of bits
/// those at the polynomial's terms (the first bit is x^0) add to 0.
Bits cyclic(std::uint64_t information, int width, std::uint32_t polynomial, std::size_t size) {
  Bits word;
  word.put(information, width);
  for (std::size_t first = 0; word.size() < size; ++first) {
    std::uint32_t sum = 0;
    for (std::size_t i = 0; first + i < word.size(); ++i)
      sum ^= (polynomial >> i & 1U) & (word[first + i] ? 1U : 0U);
    word.put(sum, 1);
  }
  return word;
}
/// BCH(51, 8) of B1C and L1C (BDS-SIS-ICD-B1C-1.0, table 6-1; IS-GPS-800, 3.2.3.2).
Bits bch_51_8(std::uint64_t information) {
  return cyclic(information, 8, 0b1'1001'1111, 51);
}

/// Bits written row by row, read column by column.
Bits interleaved(const Bits& bits, std::size_t columns) {
  Bits result;
  for (std::size_t column = 0; column < columns; ++column)
    for (std::size_t i = column; i < bits.size(); i += columns) result.put(bits[i] ? 1 : 0, 1);
  return result;
}

/// Number of frames of 18 s since the week began.
std::uint64_t frames_of_18_s(geodesy::GpsTime since_week_began) {
  return static_cast<std::uint64_t>(since_week_began.nanosecond_of_week() / 18'000'000'000);
}

/// IS-GPS-800, 3.2.3 and 3.5.2: BCH of the count of 18 s in two hours, at the start of the next frame; 38
/// rows of 46.
Bits cnav2_frame(const gnss::KeplerEphemeris& e, const SystemMessage& message, const CnavDelays& delays,
                 geodesy::GpsTime start) {
  Bits rows = ldpc_encoded(LdpcCode::Cnav2Subframe2, cnav2_subframe2(e, delays, start));
  rows.append(ldpc_encoded(LdpcCode::Cnav2Subframe3, cnav2_subframe3(e, message, delays, start)));
  const std::uint64_t count = (frames_of_18_s(start) + 1) % 400;
  const bool ninth = count >> 8 != 0;  // inverts the others
  const Bits low = bch_51_8(count & 255);
  Bits bits;
  bits.put(ninth, 1);
  for (std::size_t i = 0; i < low.size(); ++i) bits.put(low[i] != ninth, 1);
  return bits.append(interleaved(rows, 46));
}

/// BDS-SIS-ICD-B1C-1.0, 6.2.1 and 6.2.2: BCH of PRN and second of the hour; 36 rows, alternately two of
/// subframe 2 and one of subframe 3, the last three of subframe 2.
Bits bcnav1_frame(const gnss::KeplerEphemeris& e, const SystemMessage& message, const BcnavDelays& delays,
                  geodesy::GpsTime start) {
  const Bits second = ldpc_encoded(LdpcCode::Bcnav1Subframe2, bcnav1_subframe2(e, delays, start));
  const Bits third = ldpc_encoded(LdpcCode::Bcnav1Subframe3, bcnav1_subframe3(e, message, start));
  constexpr std::size_t kRows = 36, kColumns = 48;
  Bits rows;
  for (std::size_t row = 0, second_row = 0, third_row = 0; row < kRows; ++row) {
    const bool last = row % 3 == 2 && row < 33;
    rows.put(last ? third.number(kColumns * third_row++, kColumns)
                  : second.number(kColumns * second_row++, kColumns),
             kColumns);
  }
  Bits bits = cyclic(static_cast<std::uint64_t>(e.id.number), 6, 0b101'0111, 21);
  return bits.append(bch_51_8(frames_of_18_s(bdt(start)) % 200)).append(interleaved(rows, kColumns));
}

/// Words of 30 bits as sent by BeiDou: the bits of a word's two code words alternate, except in the first
/// word (BDS-SIS-ICD-B1I-3.0, 5.1.3).
Symbols beidou_symbols(const std::vector<std::uint32_t>& words) {
  Symbols symbols;
  const auto put = [&](std::uint32_t word, int bit) { symbols.push_back(symbol_of(word >> bit & 1U)); };
  for (int bit = 29; bit >= 0; --bit) put(words.front(), bit);
  for (std::size_t i = 1; i < words.size(); ++i) {
    for (int bit = 0; bit < 11; ++bit) put(words[i], 29 - bit), put(words[i], 18 - bit);
    for (int bit = 0; bit < 4; ++bit) put(words[i], 7 - bit), put(words[i], 3 - bit);
  }
  return symbols;
}

/// A string as sent: 85 differentially coded bits, each inverted in its second half, then the time mark (ICD
/// L1, L2 5.1, 3.3.2.2).
Symbols glonass_symbols(const std::vector<std::uint32_t>& words) {
  constexpr std::string_view kTimeMark = "111110001101110101000010010110";
  Symbols symbols;
  std::uint32_t bit = 0;
  for (std::size_t i = 0; i < 85; ++i) {
    bit ^= words.at(i / 32) >> (31 - i % 32) & 1U;
    symbols.push_back(symbol_of(bit ^ 1U));
    symbols.push_back(symbol_of(bit));
  }
  for (const char c : kTimeMark) symbols.push_back(symbol_of(c == '1' ? 1 : 0));
  return symbols;
}

/// The bits of a message with its block code; without one if the message is convolved.
Bits message_bits(const gnss::NavigationData& navigation, gnss::SatelliteId id, const MessagePace& pace,
                  const CurrentMessage& current) {
  const geodesy::GpsTime start = current.start;
  if (pace.kind == MessageKind::Sbas) {
    const gnss::SbasEphemeris& e = *sent_record(navigation.sbas, id, start);
    return sbas_message(e, current.number == 0 ? 9 : e.health != 0 ? 0 : 63, start);
  }
  const gnss::KeplerEphemeris& e = *sent_record(navigation.kepler, id, current.frame_start);
  const SystemMessage message = system_message(navigation, id.system, start);
  if (pace.kind == MessageKind::Fnav) return fnav_page(e, message, current.number + 1, start);
  const auto delay_of = [&](std::string_view signal) { return signal_delay_s(navigation, e, signal); };
  if (id.system != gnss::System::BeiDou) {
    const CnavDelays delays{e.group_delay[0], delay_of("L1CA"), delay_of("L2C"), delay_of("L5"),
                            delay_of("L1C")};
    if (pace.kind == MessageKind::Cnav2) return cnav2_frame(e, message, delays, start);
    constexpr int kTypes[]{10, 11, 30, 33};
    const auto length_s = static_cast<int>(pace.period / geodesy::GpsTime::kNanosecondsPerSecond);
    return cnav_message(e, message, delays, kTypes[current.number], start, length_s);
  }
  const BcnavDelays delays{delay_of("B1C"), delay_of("B2a"), delay_of("B2b")};
  if (pace.kind == MessageKind::Bcnav1) return bcnav1_frame(e, message, delays, start);
  Bits bits;
  if (pace.kind == MessageKind::Bcnav2) {  // BDS-SIS-ICD-B2a-1.0, 6.2
    constexpr int kTypes[]{10, 11, 30, 34};
    const Bits content = bcnav2_message(e, message, delays, kTypes[current.number], start);
    return bits.put(0xE24DE8, 24).append(ldpc_encoded(LdpcCode::Bcnav2, content));
  }
  // BDS-SIS-ICD-B2b-1.0, 6.2.
  const Bits content = bcnav3_message(e, message, delays, current.number == 0 ? 10 : 30, start);
  bits.put(0xEB90, 16).count(id.number, 6).put(0, 6);
  return bits.append(ldpc_encoded(LdpcCode::Bcnav3, content));
}

#include "canyon/sky/broadcast/ldpc_tables.inc"

struct Table {
  int symbol_bits;
  std::string_view terms;
};
/// Codes in the order of LdpcCode.
constexpr std::array<Table, 6> kTables{{{1, kCnav2Subframe2},
                                        {1, kCnav2Subframe3},
                                        {6, kBcnav1Subframe2},
                                        {6, kBcnav1Subframe3},
                                        {6, kBcnav2},
                                        {6, kBcnav3}}};

/// Products in GF(64). Those of 0 and 1 are those of GF(2).
using Products = std::array<std::array<std::uint8_t, 64>, 64>;
constexpr Products kProducts = [] {
  Products products{};
  for (unsigned a = 0; a < 64; ++a) {
    for (unsigned b = 0; b < 64; ++b) {
      unsigned product = 0;
      for (unsigned bit = 6; bit-- > 0;) {
        product <<= 1U;
        if ((product & 64U) != 0) product ^= 0b1000011U;
        if ((b >> bit & 1U) != 0) product ^= a;
      }
      products[a][b] = static_cast<std::uint8_t>(product);
    }
  }
  return products;
}();

using Row = std::vector<std::uint8_t>;

/// B^-1 A of H = (A | B), which maps information to parity.
std::vector<Row> generator(LdpcCode code) {
  const std::vector<std::vector<LdpcTerm>> checks = parity_checks(code);
  const std::size_t n = checks.size();
  std::vector<Row> rows(n, Row(2 * n));  // (B | A), until B is the unit matrix
  for (std::size_t i = 0; i < n; ++i)
    for (const LdpcTerm& term : checks[i]) rows[i][(term.symbol + n) % (2 * n)] = term.factor;
  for (std::size_t column = 0; column < n; ++column) {
    const auto pivot = std::find_if(rows.begin() + static_cast<std::ptrdiff_t>(column), rows.end(),
                                    [&](const Row& row) { return row[column] != 0; });
    assert(pivot != rows.end());
    std::swap(rows[column], *pivot);
    const auto& by_pivot = kProducts[rows[column][column]];
    const auto inverse =
        static_cast<std::size_t>(std::find(by_pivot.begin(), by_pivot.end(), 1) - by_pivot.begin());
    for (std::uint8_t& element : rows[column]) element = kProducts[inverse][element];
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint8_t factor = rows[i][column];
      if (i == column || factor == 0) continue;
      for (std::size_t j = column; j < 2 * n; ++j) rows[i][j] ^= kProducts[factor][rows[column][j]];
    }
  }
  for (Row& row : rows) row.erase(row.begin(), row.begin() + static_cast<std::ptrdiff_t>(n));
  return rows;
}

}  // namespace

std::optional<SymbolFrame> symbol_frame(const gnss::NavigationData& navigation, gnss::SatelliteId id,
                                        const gnss::Signal& signal, geodesy::GpsTime time) {
  const MessagePace pace = pace_of(id, signal, time);
  const bool another_of_geo = gnss::is_beidou_geo(id) && pace.kind != MessageKind::D2;
  const bool known = sent_record(navigation.kepler, id, time) != nullptr ||
                     sent_record(navigation.glonass, id, time) != nullptr ||
                     sent_record(navigation.sbas, id, time) != nullptr;
  if (!signal.only_recorded.empty() || another_of_geo || !known) return std::nullopt;
  const CurrentMessage current = position_of(pace, time);
  const geodesy::GpsTime start = current.start;
  // The page of D2 is the first subframe of five.
  const std::int64_t subframe = (time.nanoseconds() - start.nanoseconds()) / pace.duration;
  const auto words_or = [&](const auto& spare) {
    std::vector<std::uint32_t> words;
    if (subframe == 0) words = message_words(navigation, id, pace, current);
    return words.empty() ? spare() : words;
  };
  SymbolFrame frame{start + std::chrono::nanoseconds(subframe * pace.duration), 0, {}};
  switch (pace.kind) {
    case MessageKind::Lnav:
      frame.symbols = lnav_symbols(words_or(
          [&] { return lnav_page18(id.system, system_message(navigation, id.system, start), start); }));
      break;
    case MessageKind::Inav:
      frame.symbols = inav_symbols(words_or([&] { return inav_page(inav_word({}, {}, 0, start)); }));
      break;
    case MessageKind::D1:
    case MessageKind::D2:
      frame.symbols = beidou_symbols(words_or([&] {
        const bool d1 = pace.kind == MessageKind::D1;
        return spare_beidou_subframe((d1 ? current.number : static_cast<int>(subframe)) + 1, start);
      }));
      break;
    case MessageKind::Glonass:
      frame.symbols = glonass_symbols(
          words_or([&] { return glonass_string({}, current.number + 1, current.frame_start).words32(); }));
      break;
    case MessageKind::Cnav:
    case MessageKind::Sbas: {
      const CurrentMessage before = position_of(pace, start - std::chrono::nanoseconds(pace.period));
      frame.symbols = convolved_after(message_bits(navigation, id, pace, before),
                                      message_bits(navigation, id, pace, current));
      break;
    }
    case MessageKind::Fnav:
      put_galileo_page("101101110000", message_bits(navigation, id, pace, current), frame.symbols);
      break;
    case MessageKind::Cnav2:
    case MessageKind::Bcnav1:
    case MessageKind::Bcnav2:
    case MessageKind::Bcnav3:
      frame.symbols = symbols_of(message_bits(navigation, id, pace, current));
      break;
  }
  frame.symbol_s = static_cast<double>(pace.duration) / (1e9 * static_cast<double>(frame.symbols.size()));
  return frame;
}

std::vector<std::vector<LdpcTerm>> parity_checks(LdpcCode code) {
  const Table& table = kTables.at(static_cast<std::size_t>(code));
  const bool binary = table.symbol_bits == 1;
  const auto number = [&](std::size_t first, std::size_t digits) {
    std::size_t value = 0;
    for (const char c : table.terms.substr(first, digits))
      value = 16 * value + static_cast<std::size_t>(c <= '9' ? c - '0' : c - 'A' + 10);
    return value;
  };
  std::vector<std::vector<LdpcTerm>> checks;
  for (std::size_t i = 0; i < table.terms.size(); i += binary ? 3 : 5) {
    const std::size_t symbol = number(i, 3);
    if (checks.empty() || symbol <= checks.back().back().symbol) checks.emplace_back();
    checks.back().push_back({symbol, binary ? std::uint8_t{1} : static_cast<std::uint8_t>(number(i + 3, 2))});
  }
  return checks;
}

Bits ldpc_encoded(LdpcCode code, const Bits& information) {
  struct Made {
    std::once_flag once;
    std::vector<Row> generator;
  };
  static std::array<Made, kTables.size()> made;
  const auto index = static_cast<std::size_t>(code);
  std::call_once(made.at(index).once, [&] { made[index].generator = generator(code); });
  const auto width = static_cast<std::size_t>(kTables[index].symbol_bits);
  assert(information.size() == made[index].generator.size() * width);
  Bits word = information;
  for (const Row& row : made[index].generator) {
    std::uint8_t parity = 0;
    for (std::size_t i = 0; i < row.size(); ++i)
      parity ^= kProducts[row[i]][information.number(width * i, width)];
    word.put(parity, kTables[index].symbol_bits);
  }
  return word;
}

}  // namespace canyon::broadcast
