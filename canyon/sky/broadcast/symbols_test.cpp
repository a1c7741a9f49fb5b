// Symbols decoded as by a receiver.
#include "canyon/sky/broadcast/symbols.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>

#include "canyon/sky/broadcast/messages.hpp"

namespace canyon::broadcast {
namespace {

gnss::NavigationData navigation_of(gnss::SatelliteId id, geodesy::GpsTime toe) {
  gnss::NavigationData navigation;
  gnss::KeplerEphemeris e;
  e.id = id;
  e.toe = e.toc = toe;
  e.sqrt_a = 5153.7;
  e.eccentricity = 0.01;
  e.mean_anomaly = 1.2;
  e.data_sources = 1;
  navigation.kepler.push_back(e);
  return navigation;
}
const gnss::Signal& signal_of(gnss::System system, std::string_view name) {
  const auto all = gnss::signals_of(system);
  return *std::find_if(all.begin(), all.end(), [&](const gnss::Signal& s) { return s.name == name; });
}

std::uint32_t number(const SymbolFrame& frame, std::size_t first, std::size_t count) {
  std::uint32_t bits = 0;
  for (std::size_t i = first; i < first + count; ++i) bits = bits << 1U | (frame.symbols[i] < 0 ? 1U : 0U);
  return bits;
}
/// Words of D1 or D2 as decoded by a receiver (BDS-SIS-ICD-B1I-3.0, 5.1.3): the symbols of all words but the
/// first alternate between two code words of 15 bits; the 11 bits of both are followed by both parities.
std::vector<std::uint32_t> beidou_words(const SymbolFrame& frame) {
  std::vector<std::uint32_t> words{number(frame, 0, 30)};
  for (std::size_t first = 30; first < 300; first += 30) {
    std::uint32_t code_words[2] = {0, 0};
    for (std::size_t i = 0; i < 30; ++i) {
      code_words[i % 2] = code_words[i % 2] << 1U | number(frame, first + i, 1);
    }
    words.push_back((code_words[0] >> 4U) << 19U | (code_words[1] >> 4U) << 8U | (code_words[0] & 15U) << 4U |
                    (code_words[1] & 15U));
  }
  return words;
}
const geodesy::GpsTime kToe = geodesy::GpsTime::from_week(2421, 115200);

// IS-GPS-200, 20.3.5.2 and table 20-XIV: six parity bits from data and the last two bits of the preceding
// word.
TEST(Symbols, LnavHasParityAndPreamble) {
  const gnss::SatelliteId id{gnss::System::GPS, 7};
  const gnss::NavigationData navigation = navigation_of(id, kToe);
  const gnss::Signal& signal = gnss::signals_of(gnss::System::GPS)[0];
  for (int k = 0; k < 5; ++k) {
    const auto frame = symbol_frame(navigation, id, signal, kToe + (6 * k + 2.5));
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->start, kToe + 6 * k);
    EXPECT_EQ(frame->symbol_s, 0.02);
    ASSERT_EQ(frame->symbols.size(), 300U);
    bool d29 = false, d30 = false;
    for (std::size_t word = 0; word < 10; ++word) {
      std::uint32_t bits = 0;
      for (std::size_t i = 0; i < 30; ++i) bits = bits << 1U | (frame->symbols[30 * word + i] < 0 ? 1U : 0U);
      const std::uint32_t data = (bits >> 6U ^ (d30 ? 0xFFFFFFU : 0U)) & 0xFFFFFFU;
      EXPECT_EQ(bits & 0x3FU, lnav_parity(data, d29, d30)) << word;
      if (word == 0) {
        EXPECT_EQ(data >> 16U, 0x8BU);
      }
      if (word == 1) {
        EXPECT_EQ(data >> 2U & 7U, static_cast<std::uint32_t>(k < 3 ? k + 1 : 4));
      }
      d29 = (bits & 2U) != 0;
      d30 = (bits & 1U) != 0;
    }
  }
  EXPECT_FALSE(symbol_frame(navigation, {gnss::System::GPS, 8}, signal, kToe));
}

// Subframe 4 instead of almanacs: delta t_LS is bits 271 to 278 of page 18 (IS-GPS-200, figure 20-1).
TEST(Symbols, LnavTellsTheLeapSecondsOfItsDate) {
  const gnss::SatelliteId id{gnss::System::GPS, 7};
  gnss::NavigationData navigation = navigation_of(id, kToe);
  navigation.leap_seconds = 16;
  const auto frame = symbol_frame(navigation, id, gnss::signals_of(gnss::System::GPS)[0], kToe + 18);
  ASSERT_TRUE(frame);
  const std::uint32_t rotated = frame->symbols[269] < 0 ? 0xFF : 0;
  EXPECT_EQ(number(*frame, 270, 8) ^ rotated, 16U);
}

/// A decoder that follows the only path without an error: taps of 171 and 133 (octal) on the bit and the
/// preceding six. @param before six bits of the encoder
Bits decoded(const std::vector<int>& coded, bool inverted, std::vector<int> before) {
  Bits bits;
  for (std::size_t i = 0; 2 * i < coded.size(); ++i) {
    const std::size_t n = before.size();
    const int bit = coded[2 * i] ^ before[n - 1] ^ before[n - 2] ^ before[n - 3] ^ before[n - 6];
    EXPECT_EQ(coded[2 * i + 1],
              (inverted ? 1 : 0) ^ bit ^ before[n - 2] ^ before[n - 3] ^ before[n - 5] ^ before[n - 6]);
    before.push_back(bit);
    bits.put(static_cast<std::uint64_t>(bit), 1);
  }
  return bits;
}

// OS SIS ICD 2.1, 4.1.4.
TEST(Symbols, InavPagesComeOutOfTheirEncoder) {
  const gnss::SatelliteId id{gnss::System::Galileo, 11};
  const gnss::NavigationData navigation = navigation_of(id, kToe);
  const gnss::Signal& signal = gnss::signals_of(gnss::System::Galileo)[0];
  const geodesy::GpsTime start = kToe + 1;  // word 2
  const auto frame = symbol_frame(navigation, id, signal, start + 1.9);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->start, start);
  ASSERT_EQ(frame->symbols.size(), 500U);
  const std::vector<std::uint32_t> page = inav_page(inav_word(navigation.kepler[0], {}, 2, start));
  for (std::size_t part = 0; part < 2; ++part) {
    std::string synchronisation;
    for (std::size_t i = 0; i < 10; ++i) {
      synchronisation += frame->symbols[250 * part + i] < 0 ? '1' : '0';
    }
    EXPECT_EQ(synchronisation, "0101100000");
    std::vector<int> coded(240);
    for (std::size_t i = 0; i < 240; ++i) {
      coded[i % 30 * 8 + i / 30] = frame->symbols[250 * part + 10 + i] < 0 ? 1 : 0;
    }
    const Bits bits = decoded(coded, true, std::vector<int>(6));
    for (std::size_t i = 0; i < 120; ++i) {
      EXPECT_EQ(bits[i] ? 1U : 0U, page[4 * part + i / 32] >> (31 - i % 32) & 1U) << i;
    }
  }
}

// OS SIS ICD 2.1, 4.2: pages of 10 s, five in a cycle of 50 s; 488 symbols over 61 columns and 8 rows.
TEST(Symbols, FnavPagesComeOutOfTheirEncoder) {
  const gnss::SatelliteId id{gnss::System::Galileo, 11};
  const gnss::NavigationData navigation = navigation_of(id, kToe);
  for (int k = 0; k < 5; ++k) {
    const auto frame = symbol_frame(navigation, id, signal_of(id.system, "E5a"), kToe + (10 * k + 9.9));
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->start, kToe + 10 * k);
    EXPECT_EQ(frame->symbol_s, 0.02);
    ASSERT_EQ(frame->symbols.size(), 500U);
    EXPECT_EQ(number(*frame, 0, 12), 0b101101110000U);
    std::vector<int> coded(488);
    for (std::size_t i = 0; i < 488; ++i) coded[i % 61 * 8 + i / 61] = frame->symbols[12 + i] < 0 ? 1 : 0;
    SystemMessage message;
    EXPECT_EQ(decoded(coded, true, std::vector<int>(6)),
              fnav_page(navigation.kepler[0], message, k + 1, frame->start));
  }
}

// 4.3.3: E5b-I sends words 1, 3, 5 and, half a cycle of 30 s later, 2, 4, 6; a page begins with each even
// second.
TEST(Symbols, E5bSendsThePagesOfE1InAnotherOrder) {
  const gnss::SatelliteId id{gnss::System::Galileo, 11};
  const gnss::NavigationData navigation = navigation_of(id, kToe);
  const std::array<int, 15> words{1, 3, 5, 0, 0, 0, 0, 0, 0, 0, 2, 4, 6, 0, 0};
  for (int k = 0; k < 15; ++k) {
    const auto frame = symbol_frame(navigation, id, signal_of(id.system, "E5b"), kToe + (2 * k + 0.1));
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->start, kToe + 2 * k);
    EXPECT_EQ(frame->symbol_s, 0.004);
    const auto page =
        inav_page(inav_word(navigation.kepler[0], {}, words[static_cast<std::size_t>(k)], frame->start));
    Bits sent, expected;
    for (std::size_t part = 0; part < 2; ++part) {
      std::vector<int> coded(240);
      for (std::size_t i = 0; i < 240; ++i) {
        coded[i % 30 * 8 + i / 30] = frame->symbols[250 * part + 10 + i] < 0 ? 1 : 0;
      }
      sent.append(decoded(coded, true, std::vector<int>(6))).put(0, 8);
    }
    for (const std::uint32_t word : page) expected.put(word, 32);
    EXPECT_EQ(sent, expected) << k;
  }
}

// IS-GPS-200, 3.3.3.1.1 and IS-GPS-705, 3.3.3.1.1: the encoder continues from message to message.
TEST(Symbols, CnavGoesThroughOneEncoder) {
  struct Case {
    gnss::System system;
    const char* name;
    int length_s;
    double semi_major_axis_m, reference_m;
  };
  for (const auto& [system, name, length_s, semi_major_axis_m, reference_m] :
       {Case{gnss::System::GPS, "L2C", 12, 26'560'000, 26'559'710},
        Case{gnss::System::GPS, "L5", 6, 26'560'000, 26'559'710},
        Case{gnss::System::QZSS, "L2C", 12, 42'165'000, 42'164'200},
        Case{gnss::System::QZSS, "L5", 6, 42'165'000, 42'164'200}}) {
    const gnss::SatelliteId id{system, 3};
    gnss::NavigationData navigation = navigation_of(id, kToe);
    navigation.kepler[0].group_delay[0] = 5e-9;
    navigation.kepler[0].sqrt_a = std::sqrt(semi_major_axis_m);
    std::vector<int> coded;
    for (int k = 0; k < 8; ++k) {
      const auto frame =
          symbol_frame(navigation, id, signal_of(id.system, name), kToe + (length_s * k + 0.01));
      ASSERT_TRUE(frame);
      EXPECT_EQ(frame->start, kToe + length_s * k);
      EXPECT_EQ(frame->symbol_s, length_s / 600.0);
      ASSERT_EQ(frame->symbols.size(), 600U);
      for (const std::int8_t symbol : frame->symbols) coded.push_back(symbol < 0 ? 1 : 0);
    }
    coded.erase(coded.begin(), coded.begin() + 600);  // from the second message on
    const std::array<int, 4> types{10, 11, 30, 33};
    // The delay of L1 C/A is TGD; the others scale with the squares of the frequencies.
    const CnavDelays delays{5e-9, 5e-9, 5e-9 * 77 * 77 / 3600, 5e-9 * 154 * 154 / (115 * 115)};
    const auto message = [&, seconds = length_s](int k) {
      return cnav_message(navigation.kepler[0], {}, delays, types[static_cast<std::size_t>(k % 4)],
                          kToe + seconds * k, seconds);
    };
    std::vector<int> state;
    for (std::size_t i = 294; i < 300; ++i) state.push_back(message(0)[i] ? 1 : 0);
    Bits expected;
    for (int k = 1; k < 8; ++k) expected.append(message(k));
    const Bits found = decoded(coded, false, state);
    EXPECT_EQ(found, expected) << name;
    // Message 10 is the fourth here: its axis minus the reference, in steps of 2^-9 m from bit 81 on.
    EXPECT_EQ(found.number(900 + 81, 26),
              static_cast<std::uint64_t>((semi_major_axis_m - reference_m) * 512));
  }
}

// RTCA DO-229, A.4.2 and A.4.3: 250 bits a second; three preambles from each third second on; bits 0 to 225
// in the parity of the last 24.
TEST(Symbols, SbasGoesThroughOneEncoder) {
  const gnss::SatelliteId id{gnss::System::SBAS, 23};
  gnss::NavigationData navigation;
  gnss::SbasEphemeris e;
  e.id = id;
  e.toe = kToe;  // 115200 s of the week, 28800 s of the day
  e.position_m = {4.2e7 - 1e6, -5e6, 1e4};
  e.velocity_mps = {-1, 0.5, -2};
  e.clock_bias_s = -1e-7;
  navigation.sbas.push_back(e);
  const gnss::Signal& signal = signal_of(id.system, "L1CA");
  std::vector<int> coded;
  for (int k = -1; k < 121; ++k) {
    const auto frame = symbol_frame(navigation, id, signal, kToe + (k + 0.99));
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->start, kToe + k);
    EXPECT_EQ(frame->symbol_s, 0.002);
    ASSERT_EQ(frame->symbols.size(), 500U);
    for (const std::int8_t symbol : frame->symbols) coded.push_back(symbol < 0 ? 1 : 0);
  }
  // A null message before the first one: its last six bits are parity bits, from the encoder itself.
  std::vector<int> state;
  const Bits null = sbas_message(e, 63, kToe + -2);
  for (std::size_t i = 244; i < 250; ++i) state.push_back(null[i] ? 1 : 0);
  const Bits bits = decoded(coded, false, state);
  const std::array<std::uint64_t, 3> preambles{0b01010011, 0b10011010, 0b11000110};
  for (std::size_t k = 0; k < 122; ++k) {
    const std::size_t first = 250 * k;
    EXPECT_EQ(bits.number(first, 8), preambles[(115199 + k) % 3]) << k;
    EXPECT_EQ(bits.number(first + 8, 6), k % 120 == 1 ? 9U : 63U) << k;
    Bits data;
    for (std::size_t i = first; i < first + 226; ++i) data.put(bits[i] ? 1 : 0, 1);
    EXPECT_EQ(bits.number(first + 226, 24), crc24q(data)) << k;
  }
  const auto signed_at = [&](std::size_t first, std::size_t width) {
    const auto value = static_cast<std::int64_t>(bits.number(250 + first, width));
    return value >> (width - 1) != 0 ? value - (std::int64_t{1} << width) : value;
  };
  EXPECT_EQ(bits.number(250 + 22, 13), 28800U / 16);
  EXPECT_NEAR(static_cast<double>(signed_at(39, 30)) * 0.08, e.position_m[0], 0.04);
  EXPECT_NEAR(static_cast<double>(signed_at(69, 30)) * 0.08, e.position_m[1], 0.04);
  EXPECT_NEAR(static_cast<double>(signed_at(99, 25)) * 0.4, e.position_m[2], 0.2);
  EXPECT_NEAR(static_cast<double>(signed_at(158, 18)) * 0.004, e.velocity_mps[2], 0.002);
  EXPECT_NEAR(static_cast<double>(signed_at(206, 12)) * 0x1p-31, e.clock_bias_s, 0x1p-32);
  EXPECT_FALSE(symbol_frame(navigation, {gnss::System::SBAS, 24}, signal, kToe));
}

// BDS-SIS-ICD-B1I-3.0, 5.2.1: subframes 1 to 5 in 30 s from a whole half minute of BDT, which is 14 s behind
// GPS time.
TEST(Symbols, D1SubframesFollowEachOther) {
  const gnss::SatelliteId id{gnss::System::BeiDou, 11};
  const geodesy::GpsTime begin = kToe + 14;
  const gnss::NavigationData navigation = navigation_of(id, begin);
  for (const char* name : {"B1I", "B3I"}) {
    const gnss::Signal& signal = signal_of(id.system, name);
    for (int k = 0; k < 5; ++k) {
      const auto frame = symbol_frame(navigation, id, signal, begin + (6 * k + 5.9));
      ASSERT_TRUE(frame);
      EXPECT_EQ(frame->start, begin + 6 * k);
      EXPECT_EQ(frame->symbol_s, 0.02);
      ASSERT_EQ(frame->symbols.size(), 300U);
      EXPECT_EQ(number(*frame, 0, 11), 0b11100010010U);
      EXPECT_EQ(number(*frame, 15, 3), static_cast<std::uint32_t>(k + 1));
      const std::vector<std::uint32_t> words = beidou_words(*frame);
      const std::uint32_t second = number(*frame, 18, 8) << 12U | words[1] >> 18U;
      EXPECT_EQ(second, 115200U + 6 * static_cast<std::uint32_t>(k));
      if (k < 3) {
        EXPECT_EQ(words, d1_subframe(navigation.kepler[0], {}, k + 1, frame->start));
      }
    }
  }
}

// 5.3.1: geostationary satellites send five subframes in 3 s, the first one a page of ten.
TEST(Symbols, D2SendsAPageEveryThreeSeconds) {
  const gnss::SatelliteId id{gnss::System::BeiDou, 3};
  const geodesy::GpsTime begin = kToe + 14;
  const gnss::NavigationData navigation = navigation_of(id, begin);
  const gnss::Signal& signal = signal_of(id.system, "B1I");
  for (int k = 0; k < 50; ++k) {
    const auto frame = symbol_frame(navigation, id, signal, begin + (0.6 * k + 0.3));
    ASSERT_TRUE(frame);
    EXPECT_NEAR(frame->start - begin, 0.6 * k, 1e-9);
    EXPECT_EQ(frame->symbol_s, 0.002);
    ASSERT_EQ(frame->symbols.size(), 300U);
    EXPECT_EQ(number(*frame, 15, 3), static_cast<std::uint32_t>(k % 5 + 1));
    const std::uint32_t second_word = beidou_words(*frame)[1];
    EXPECT_EQ(number(*frame, 18, 8) << 12U | second_word >> 18U,
              115200U + 3 * static_cast<std::uint32_t>(k / 5));
    if (k % 5 == 0) {
      EXPECT_EQ(second_word >> 14U & 15U, static_cast<std::uint32_t>(k / 5 + 1));
    }
  }
}

// ICD L1, L2 5.1, 3.3.2.2 and 4.7: equal halves give the bits by differences; check bits are valid.
TEST(Symbols, GlonassStringsComeOutOfTheirCode) {
  const gnss::SatelliteId id{gnss::System::GLONASS, 5};
  const geodesy::GpsTime begin = kToe + 18;  // a half minute of UTC
  gnss::NavigationData navigation;
  gnss::GlonassEphemeris e;
  e.id = id;
  e.toe = begin;
  e.position_m = {1e7, -2e7, 1.2e7};
  e.velocity_mps = {1000, 2000, -1500};
  navigation.glonass.push_back(e);
  for (int k = 0; k < 15; ++k) {
    const auto frame = symbol_frame(navigation, id, gnss::signals_of(id.system)[0], begin + (2 * k + 1.99));
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->start, begin + 2 * k);
    EXPECT_EQ(frame->symbol_s, 0.01);
    ASSERT_EQ(frame->symbols.size(), 200U);
    Bits bits;
    std::int8_t before = 1;
    for (std::size_t i = 0; i < 85; ++i) {
      ASSERT_EQ(frame->symbols[2 * i], -frame->symbols[2 * i + 1]);
      const std::int8_t half = frame->symbols[2 * i + 1];
      bits.put(half != before, 1);
      before = half;
    }
    EXPECT_EQ(bits.number(1, 4), static_cast<std::uint64_t>(k + 1));
    if (k < 5) {
      EXPECT_EQ(bits.number(0, 64), glonass_string(e, k + 1, begin).number(0, 64));
      EXPECT_EQ(bits.number(64, 21), glonass_string(e, k + 1, begin).number(64, 21));
    }
    std::string mark;
    for (std::size_t i = 170; i < 200; ++i) mark += frame->symbols[i] < 0 ? '1' : '0';
    EXPECT_EQ(mark, "111110001101110101000010010110");
  }
}

}  // namespace
}  // namespace canyon::broadcast
