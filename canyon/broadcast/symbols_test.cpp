// Symbols as a receiver reads them.
#include "canyon/broadcast/symbols.hpp"

#include <gtest/gtest.h>

#include "canyon/broadcast/messages.hpp"

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
const geodesy::GpsTime kToe = geodesy::GpsTime::from_week(2421, 115200);

// IS-GPS-200, 20.3.5.2 and table 20-XIV: six parity bits by data and the last two bits of the word before.
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

// OS SIS ICD 2.1, 4.1.4: a decoder of the convolutional code that follows the only path without an error.
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
    // Taps of 171 and 133 (octal) on the bit and the six before; the second is inverted.
    std::vector<int> bits(6, 0);
    for (std::size_t i = 0; i < 120; ++i) {
      const std::size_t n = bits.size();
      const int bit = coded[2 * i] ^ bits[n - 1] ^ bits[n - 2] ^ bits[n - 3] ^ bits[n - 6];
      EXPECT_EQ(coded[2 * i + 1], 1 ^ bit ^ bits[n - 2] ^ bits[n - 3] ^ bits[n - 5] ^ bits[n - 6]);
      EXPECT_EQ(static_cast<std::uint32_t>(bit), page[4 * part + i / 32] >> (31 - i % 32) & 1U) << i;
      bits.push_back(bit);
    }
  }
}

}  // namespace
}  // namespace canyon::broadcast
