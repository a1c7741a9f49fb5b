// Codes against the equations of the interface documents, fields against their tables. Other programs read
// complete messages in tests/integration/ubx_files_test.cpp.
#include "canyon/sky/broadcast/messages.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <set>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/sky/broadcast/bits.hpp"
#include "canyon/sky/broadcast/schedule.hpp"
#include "tests/support/sample_ephemeris.hpp"

namespace canyon::broadcast {
namespace {

using geodesy::GpsTime;

/// 2026-03-01 10:00:00 GPST.
GpsTime start() {
  return GpsTime::from_week(2408, 36000);
}

// The check value of CRC-24Q (polynomial 0x864CFB, start 0) over "123456789" is 0xCDE703 (catalogue of
// parametrised CRC algorithms, CRC-24/LTE-A, which is the same code).
TEST(Crc24q, HasItsCheckValue) {
  Bits bits;
  for (const char c : {'1', '2', '3', '4', '5', '6', '7', '8', '9'})
    bits.put(static_cast<unsigned char>(c), 8);
  EXPECT_EQ(crc24q(bits), 0xCDE703U);
}

TEST(FieldValue, RoundsAndStaysInRange) {
  EXPECT_EQ(field_value(2.6, 0.5, 8, true), 5);
  EXPECT_EQ(field_value(-2.6, 0.5, 8, true), -5);
  EXPECT_EQ(field_value(1e9, 1, 8, true), 127);
  EXPECT_EQ(field_value(-1e9, 1, 8, true), -128);
  EXPECT_EQ(field_value(-1, 1, 8, false), 0);
  EXPECT_EQ(field_value(1e9, 1, 8, false), 255);
  EXPECT_EQ(field_value(std::nan(""), 1, 8, true), 0);
  EXPECT_EQ(Bits().count(-3, 6).number(0, 6), 0b111101U);
}

// IS-GPS-200, table 20-XIV: D25 to D30 as sums of D29* or D30* and data bits.
TEST(LnavParity, IsThatOfTheTable) {
  struct Row {
    bool by_30;
    std::set<int> bits;
  };
  const Row rows[]{{false, {1, 2, 3, 5, 6, 10, 11, 12, 13, 14, 17, 18, 20, 23}},
                   {true, {2, 3, 4, 6, 7, 11, 12, 13, 14, 15, 18, 19, 21, 24}},
                   {false, {1, 3, 4, 5, 7, 8, 12, 13, 14, 15, 16, 19, 20, 22}},
                   {true, {2, 4, 5, 6, 8, 9, 13, 14, 15, 16, 17, 20, 21, 23}},
                   {true, {1, 3, 5, 6, 7, 9, 10, 14, 15, 16, 17, 18, 21, 22, 24}},
                   {false, {3, 5, 6, 8, 9, 10, 11, 13, 15, 19, 22, 23, 24}}};
  std::uint32_t data = 0x123456;
  for (int trial = 0; trial < 500; ++trial, data = (data * 1664525 + 1013904223) & 0xFFFFFF) {
    const bool d29 = trial % 2 != 0, d30 = trial % 3 != 0;
    std::uint32_t expected = 0;
    for (const Row& row : rows) {
      bool bit = row.by_30 ? d30 : d29;
      for (const int i : row.bits) bit ^= (data >> (24 - i) & 1) != 0;
      expected = expected << 1 | (bit ? 1 : 0);
    }
    EXPECT_EQ(lnav_parity(data, d29, d30), expected) << data;
  }
}

TEST(LnavSubframe, HasItsPreambleTimeAndZeroBits) {
  for (const int subframe : {1, 2, 3}) {
    const GpsTime at = start() + 6.0 * (subframe - 1);
    const auto words = lnav_subframe(test::sample_ephemeris("G05", start()), subframe, at);
    ASSERT_EQ(words.size(), 10U);
    EXPECT_EQ(words[0] >> 22, 0x8BU);
    EXPECT_EQ(words[1] >> 13, 36000U / 6 + static_cast<unsigned>(subframe)) << "count of the next subframe";
    EXPECT_EQ(words[1] >> 8 & 7, static_cast<unsigned>(subframe));
    // IS-GPS-200 20.3.3: the last two parity bits of words 2 and 10 are zero.
    EXPECT_EQ(words[1] & 3, 0U);
    EXPECT_EQ(words[9] & 3, 0U);
    bool d29 = false, d30 = false;
    for (const std::uint32_t word : words) {
      EXPECT_EQ(word & 0x3F, lnav_parity(word >> 6, d29, d30));
      d29 = (word & 2) != 0;
      d30 = (word & 1) != 0;
    }
  }
  // Table 20-III: the square root of the axis, 32 bits from bit 227 on, steps of 2^-19.
  const auto words = lnav_subframe(test::sample_ephemeris("G05", start()), 2, start());
  EXPECT_EQ((words[7] >> 6 & 0xFF) << 24 | words[8] >> 6,
            static_cast<std::uint32_t>(std::llround(5153.7 * std::ldexp(1, 19))));
  // The last count of a week is followed by 0.
  EXPECT_EQ(
      lnav_subframe(test::sample_ephemeris("G05", start()), 3, GpsTime::from_week(2408, 604794))[1] >> 13,
      0U);
}

// BDS-SIS-ICD-B1I 5.1.3: code words are multiples of x^4 + x + 1, and any two words of such a code differ in
// three bits or more.
TEST(Bch, GivesCodeWords) {
  std::set<std::uint32_t> words;
  for (std::uint32_t information = 0; information < 1 << 11; ++information) {
    const std::uint32_t word = information << 4 | bch_15_11(information);
    std::uint32_t value = 0;  // with x a root: x^4 = x + 1 in GF(16)
    for (int i = 14; i >= 0; --i) {
      value <<= 1;
      if ((value & 16) != 0) value ^= 0b10011;
      value ^= word >> i & 1;
    }
    EXPECT_EQ(value, 0U) << information;
    if (information > 0) {
      EXPECT_GE(std::popcount(word), 3);
    }
    words.insert(word);
  }
  EXPECT_EQ(words.size(), 1U << 11);
}

TEST(BeiDouWords, HoldTheFieldsOfTheIcd) {
  const auto e = test::sample_ephemeris("C25", start() + 14);
  const auto first = d1_subframe(e, {}, 1, start() + 14);
  // 5.2.4: preamble, subframe, second of the week in BDT.
  EXPECT_EQ(first[0] >> 19, 0b11100010010U);
  EXPECT_EQ(first[0] >> 12 & 7, 1U);
  EXPECT_EQ((first[0] >> 4 & 0xFF) << 12 | first[1] >> 18, 36000U);
  EXPECT_EQ(first[2] >> 17, 2408U - 1356U);  // week of BDT
  // The two code words of each other word.
  for (std::size_t i = 1; i < first.size(); ++i) {
    EXPECT_EQ(first[i] >> 4 & 15, bch_15_11(first[i] >> 19)) << i;
    EXPECT_EQ(first[i] & 15, bch_15_11(first[i] >> 8 & 0x7FF)) << i;
  }
  const auto page = d2_page(test::sample_ephemeris("C03", start()), {}, 7, start() + 14);
  EXPECT_EQ(page[1] >> 14 & 15, 7U) << "its number behind the second of the week";
}

// ICD GLONASS L1, L2 5.1, 4.7: the sums C1 to C7 and C of correct strings are 0.
TEST(GlonassString, FulfilsTheEquationsOfItsCode) {
  const std::vector<std::vector<int>> sums{
      {1,  9,  10, 12, 13, 15, 17, 19, 20, 22, 24, 26, 28, 30, 32, 34, 35, 37, 39, 41, 43,
       45, 47, 49, 51, 53, 55, 57, 59, 61, 63, 65, 66, 68, 70, 72, 74, 76, 78, 80, 82, 84},
      {2,  9,  11, 12, 14, 15, 18, 19, 21, 22, 25, 26, 29, 30, 33, 34, 36, 37, 40, 41, 44,
       45, 48, 49, 52, 53, 56, 57, 60, 61, 64, 65, 67, 68, 71, 72, 75, 76, 79, 80, 83, 84}};
  const std::vector<std::pair<int, std::vector<std::pair<int, int>>>> ranges{
      {3,
       {{10, 12},
        {16, 19},
        {23, 26},
        {31, 34},
        {38, 41},
        {46, 49},
        {54, 57},
        {62, 65},
        {69, 72},
        {77, 80},
        {85, 85}}},
      {4, {{13, 19}, {27, 34}, {42, 49}, {58, 65}, {73, 80}}},
      {5, {{20, 34}, {50, 65}, {81, 85}}},
      {6, {{35, 65}}},
      {7, {{66, 85}}}};
  gnss::GlonassEphemeris e;
  e.id = *gnss::parse_satellite("R07");
  e.toe = geodesy::gps_from_utc({2026, 3, 1, 10, 15, 0, 0});
  e.clock_bias_s = 3.3e-5;
  e.frequency_bias = -9e-13;
  e.position_m = {12'345'678.9, -9'876'543.2, 20'000'000.5};
  e.velocity_mps = {-1234.5, 2345.6, -345.7};
  e.acceleration_mps2 = {1.9e-6, -9.3e-7, 0};
  for (int string = 1; string <= 5; ++string) {
    const Bits bits = glonass_string(e, string, geodesy::gps_from_utc({2026, 3, 1, 10, 0, 30, 0}));
    ASSERT_EQ(bits.size(), 85U);
    const auto bit = [&](int number) { return bits[static_cast<std::size_t>(85 - number)]; };
    for (const auto& sum : sums) {
      int ones = 0;
      for (const int number : sum) ones += bit(number);
      EXPECT_EQ(ones % 2, 0) << string;
    }
    for (const auto& [check, parts] : ranges) {
      int ones = bit(check);
      for (const auto& [from, to] : parts) {
        for (int number = from; number <= to; ++number) ones += bit(number);
      }
      EXPECT_EQ(ones % 2, 0) << string << " C" << check;
    }
    int ones = 0;
    for (int number = 1; number <= 85; ++number) ones += bit(number);
    EXPECT_EQ(ones % 2, 0) << string;
  }
  // Table 4.5: x in steps of 2^-11 km, sign and magnitude, bits 35 to 9.
  const Bits second = glonass_string(e, 2, e.toe);
  EXPECT_EQ(second.number(85 - 35, 1), 1U);
  EXPECT_EQ(second.number(85 - 34, 26), static_cast<std::uint64_t>(std::llround(9876.5432 * 2048)));
  // 13:15 in Moscow is quarter 53 of the day.
  EXPECT_EQ(second.number(85 - 76, 7), 53U);
}

// OS SIS ICD 2.1, 4.3.2.3: even and odd parts, CRC over 196 bits.
TEST(InavPage, CarriesTheWordAndItsCrc) {
  const Bits word = inav_word(test::sample_ephemeris("E11", start()), {}, 1, start());
  ASSERT_EQ(word.size(), 128U);
  EXPECT_EQ(word.number(0, 6), 1U);
  EXPECT_EQ(word.number(6, 10), 77U);
  EXPECT_EQ(word.number(16, 14), 36000U / 60);
  for (int type = 0; type <= 6; ++type) {
    EXPECT_EQ(inav_word(test::sample_ephemeris("E11", start()), {}, type, start()).size(), 128U) << type;
  }
  const auto page = inav_page(word);
  ASSERT_EQ(page.size(), 8U);
  EXPECT_EQ(page[0] >> 30, 0U);
  EXPECT_EQ(page[4] >> 30, 2U);
  Bits all;
  for (const std::uint32_t w : page) all.put(w, 32);
  Bits checked;
  checked.put(all.number(0, 64), 64)
      .put(all.number(64, 50), 50)
      .put(all.number(128, 64), 64)
      .put(all.number(192, 18), 18);
  EXPECT_EQ(all.number(128 + 82, 24), crc24q(checked));
  EXPECT_EQ(all.number(2, 62), word.number(0, 62));
}

std::int64_t signed_field(const Bits& bits, std::size_t first, std::size_t width) {
  const std::uint64_t value = bits.number(first, width);
  return static_cast<std::int64_t>(value) - (bits[first] ? std::int64_t{1} << width : 0);
}
/// Angle or rate of a field [rad].
double semicircles(const Bits& bits, std::size_t first, std::size_t width, int exponent) {
  return std::ldexp(static_cast<double>(signed_field(bits, first, width)), exponent) * geodesy::kPi;
}

// OS SIS ICD 2.1, tables 30 to 34: offsets of fields, and a CRC over all preceding bits.
TEST(FnavPage, HasItsFieldsAndItsCrc) {
  gnss::KeplerEphemeris e = test::sample_ephemeris("E11", start());
  e.health = 0b10'1000;  // E5a: HS 2, DVS 1
  for (int type = 1; type <= 6; ++type) {
    const Bits page = fnav_page(e, {}, type, start());
    ASSERT_EQ(page.size(), 244U) << type;
    EXPECT_EQ(page.number(0, 6), static_cast<std::uint64_t>(type));
    Bits checked;
    for (std::size_t i = 0; i < 214; ++i) checked.put(page[i], 1);
    EXPECT_EQ(page.number(214, 24), crc24q(checked)) << type;
    EXPECT_EQ(page.number(238, 6), 0U);
  }
  constexpr std::uint64_t kWeek = 2408 - 1024, kSecond = 36000;
  Bits page = fnav_page(e, {}, 1, start());
  EXPECT_EQ(page.number(6, 6), 11U);
  EXPECT_EQ(page.number(12, 10), 77U);
  EXPECT_EQ(page.number(22, 14), kSecond / 60);
  // From the clock of E1 and E5b to that of E1 and E5a: BGD(E1,E5a) minus BGD(E1,E5b).
  EXPECT_NEAR(std::ldexp(static_cast<double>(signed_field(page, 36, 31)), -34), e.af0 - 1.1e-8 - 5e-9, 3e-11);
  EXPECT_NEAR(std::ldexp(static_cast<double>(signed_field(page, 143, 10)), -32), -1.1e-8, 1.2e-10);
  EXPECT_EQ(page.number(153, 2), 2U);
  EXPECT_EQ(page.number(155, 12), kWeek);
  EXPECT_EQ(page.number(167, 20), kSecond);
  EXPECT_EQ(page.number(187, 1), 1U);
  e.data_sources = 1 << 1 | 1 << 8;
  EXPECT_NEAR(std::ldexp(static_cast<double>(signed_field(fnav_page(e, {}, 1, start()), 36, 31)), -34), e.af0,
              3e-11);
  page = fnav_page(e, {}, 2, start());
  EXPECT_NEAR(semicircles(page, 16, 32, -31), e.mean_anomaly, 1e-9);
  EXPECT_NEAR(semicircles(page, 48, 24, -43), e.right_ascension_rate, 3e-13);
  EXPECT_NEAR(static_cast<double>(page.number(104, 32)) * 0x1p-19, e.sqrt_a, 1e-6);
  EXPECT_NEAR(semicircles(page, 136, 32, -31), e.right_ascension, 1e-9);
  EXPECT_EQ(page.number(194, 20), kSecond);
  page = fnav_page(e, {}, 3, start());
  EXPECT_NEAR(semicircles(page, 16, 32, -31), e.inclination, 1e-9);
  EXPECT_EQ(page.number(160, 14), kSecond / 60);
  EXPECT_EQ(page.number(186, 20), kSecond);
  page = fnav_page(e, {}, 4, start());
  EXPECT_EQ(page.number(104, 8), 18U);
  EXPECT_EQ(page.number(189, 20), kSecond);
}

// IS-GPS-200 figures 30-1 to 30-6.
TEST(CnavMessage, HasItsFieldsAndItsCrc) {
  gnss::KeplerEphemeris e = test::sample_ephemeris("G07", start());
  e.toe = e.toc = start() + 7200 - 16;  // not a multiple of 300 s
  const CnavDelays delays{-1.1e-8, -1.1e-8, -1.8e-8, -2e-8};
  for (const int type : {10, 11, 30, 33}) {
    const Bits bits = cnav_message(e, {}, delays, type, start(), 12);
    ASSERT_EQ(bits.size(), 300U) << type;
    EXPECT_EQ(bits.number(0, 8), 0b10001011U);
    EXPECT_EQ(bits.number(8, 6), 7U);
    EXPECT_EQ(bits.number(14, 6), static_cast<std::uint64_t>(type));
    EXPECT_EQ(bits.number(20, 17), 6002U);  // of the next message, in 6 s
    Bits checked;
    for (std::size_t i = 0; i < 276; ++i) checked.put(bits[i], 1);
    EXPECT_EQ(bits.number(276, 24), crc24q(checked)) << type;
  }
  EXPECT_EQ(cnav_message(e, {}, delays, 10, GpsTime::from_week(2409, 0) + -6, 6).number(20, 17), 0U);
  Bits bits = cnav_message(e, {}, delays, 10, start(), 12);
  EXPECT_EQ(bits.number(38, 13), 2408U);
  EXPECT_EQ(bits.number(70, 11), 43200U / 300);
  // 16 s later on the orbit: Kepler's third law.
  const double axis_m = e.sqrt_a * e.sqrt_a;
  EXPECT_NEAR(std::ldexp(static_cast<double>(signed_field(bits, 81, 26)), -9), axis_m - 26'559'710, 2e-3);
  EXPECT_NEAR(semicircles(bits, 132, 17, -44), e.mean_motion_difference, 2e-13);
  const double motion = std::sqrt(3.986005e14 / std::pow(axis_m, 3)) + e.mean_motion_difference;
  EXPECT_NEAR(semicircles(bits, 172, 33, -32), e.mean_anomaly + 16 * motion, 1e-9);
  EXPECT_NEAR(static_cast<double>(bits.number(205, 33)) * 0x1p-34, e.eccentricity, 1e-10);
  EXPECT_NEAR(semicircles(bits, 238, 33, -32), e.argument_of_perigee, 1e-9);
  bits = cnav_message(e, {}, delays, 11, start(), 12);
  EXPECT_EQ(bits.number(38, 11), 43200U / 300);
  EXPECT_NEAR(semicircles(bits, 49, 33, -32), e.right_ascension + 16 * e.right_ascension_rate, 1e-9);
  EXPECT_NEAR(semicircles(bits, 82, 33, -32), e.inclination + 16 * e.inclination_rate, 1e-9);
  EXPECT_NEAR(semicircles(bits, 115, 17, -44) - 2.6e-9 * geodesy::kPi, e.right_ascension_rate, 2e-13);
  EXPECT_NEAR(semicircles(bits, 132, 15, -44), e.inclination_rate, 2e-13);
  EXPECT_NEAR(std::ldexp(static_cast<double>(signed_field(bits, 179, 24)), -8), e.crs, 3e-3);
  EXPECT_NEAR(std::ldexp(static_cast<double>(signed_field(bits, 248, 21)), -30), e.cuc, 1e-9);
  bits = cnav_message(e, {}, delays, 30, start(), 12);
  EXPECT_EQ(bits.number(60, 11), 43200U / 300);
  EXPECT_NEAR(std::ldexp(static_cast<double>(signed_field(bits, 71, 26)), -35), e.af0 + 16 * e.af1, 2e-11);
  // TGD, then corrections for L1 C/A, L2C, I5 and Q5: together they give the signal's delay.
  EXPECT_NEAR(std::ldexp(static_cast<double>(signed_field(bits, 127, 13)), -35), -1.1e-8, 2e-11);
  const std::array<double, 4> later{-1.1e-8, -1.8e-8, -2e-8, -2e-8};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(std::ldexp(static_cast<double>(signed_field(bits, 140 + 13 * i, 13)), -35),
                -1.1e-8 - later[i], 2e-11);
  }
  EXPECT_EQ(cnav_message(e, {}, delays, 33, start(), 12).number(163, 8), 18U);
  // Nodes refer to the start of the week of toe, which stays in its week.
  e.toe = e.toc = GpsTime::from_week(2408, 604'784);
  bits = cnav_message(e, {}, delays, 11, e.toe, 12);
  EXPECT_EQ(bits.number(38, 11), 604'500U / 300);
  EXPECT_NEAR(semicircles(bits, 49, 33, -32), e.right_ascension - 284 * e.right_ascension_rate, 1e-9);
}

TEST(AccuracyIndex, FollowsTheTables) {
  // IS-GPS-200 20.3.3.3.1.3: nominal values 2.0, 2.8, 4.0, 5.7, 8.0, 11.3, 16, 32, ...
  const double nominal[]{2.0, 2.8, 4.0, 5.7, 8.0, 11.3, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096};
  for (int i = 0; i < 15; ++i) EXPECT_EQ(accuracy_index(nominal[i]), i) << nominal[i];
  EXPECT_EQ(accuracy_index(8192), 15);
  // OS SIS ICD 2.1, table 76.
  EXPECT_EQ(sisa_index(0.49), 49);
  EXPECT_EQ(sisa_index(0.5), 50);
  EXPECT_EQ(sisa_index(0.98), 74);
  EXPECT_EQ(sisa_index(1.0), 75);
  EXPECT_EQ(sisa_index(1.96), 99);
  EXPECT_EQ(sisa_index(3.12), 107);
  EXPECT_EQ(sisa_index(6), 125);
  EXPECT_EQ(sisa_index(6.1), 255);
  EXPECT_EQ(sisa_index(-1), 255);
}

class Sent : public testing::Test {
 protected:
  Sent() {
    for (const char* id : {"G05", "J02", "E11", "C03", "C25"}) {
      navigation_.kepler.push_back(test::sample_ephemeris(id, start()));
      navigation_.kepler.push_back(test::sample_ephemeris(id, start() + 7200));
      navigation_.kepler.back().iode = 78;
    }
    navigation_.klobuchar[gnss::System::GPS] = {};
    gnss::GlonassEphemeris r;
    r.id = *gnss::parse_satellite("R07");
    r.toe = start();
    navigation_.glonass.push_back(r);
  }
  std::vector<SentMessage> sent(const char* id, double from_s, double to_s) {
    return sent_messages(navigation_, *gnss::parse_satellite(id), start() + from_s, start() + to_s);
  }
  gnss::NavigationData navigation_;
};

// 12.5 minutes: 25 frames of five subframes, of which three are ephemeris and one page 18
// (IS-GPS-200 20.3.2); I/NAV 13 of 15 pages of 2 s; D1 three of five of 6 s; D2 a page every 3 s; five of 15
// strings in 30 s.
TEST_F(Sent, KeepsThePaceOfEachSystem) {
  EXPECT_EQ(sent("G05", 0, 750).size(), 25U * 3 + 1);
  EXPECT_EQ(sent("J02", 0, 750).size(), 25U * 3) << "has no ionosphere of its own";
  EXPECT_EQ(sent("E11", 0, 750).size(), 25U * 13);
  EXPECT_EQ(sent("C25", 0, 750).size(), 25U * 3);
  EXPECT_EQ(sent("C03", 0, 750).size(), 250U);
  EXPECT_EQ(sent("R07", 0, 750).size(), 25U * 5);
  EXPECT_TRUE(sent("G06", 0, 750).empty()) << "no ephemeris";
  EXPECT_TRUE(sent("S23", 0, 750).empty());
}

TEST_F(Sent, GivesAMessageAtItsLastBitAndOnce) {
  EXPECT_TRUE(sent("G05", 0, 5.999).empty());
  const auto first = sent("G05", 5.999, 6);
  ASSERT_EQ(first.size(), 1U);
  EXPECT_EQ(first[0].start, start());
  EXPECT_TRUE(sent("G05", 6, 11.9).empty());
  std::size_t in_steps = 0;
  for (int i = 0; i < 7500; ++i) {
    in_steps += sent_messages(navigation_, first[0].id, start() + 0.1 * i, start() + 0.1 * (i + 1)).size();
  }
  EXPECT_EQ(in_steps, 76U);
}

TEST_F(Sent, ChangesTheEphemerisWithTheFrame) {
  int issue = 0;
  for (const SentMessage& message : sent("G05", 3540, 3690)) {
    if ((message.words[1] >> 8 & 7) != 2) continue;
    issue = static_cast<int>(message.words[2] >> 22);
    EXPECT_EQ(issue, message.start < start() + 3600 ? 77 : 78);
  }
  EXPECT_EQ(issue, 78);
}

// Closed forms: ends of the messages of an ephemeris that a receiver reads from an instant of the GPS week on
// (frames of GPS begin at 0, of Galileo at 1 s with words 2 and 4, the others of BeiDou at 14 s, of GLONASS
// 18 s after, by 18 leap seconds).
TEST(UnsentEphemeris, IsSentWithTheFrames) {
  const geodesy::GpsTime week = geodesy::GpsTime::from_week(2421, 0);
  const auto complete_after_s = [&](const char* satellite, double from_s, const char* signal = "") {
    const gnss::SatelliteId id = *gnss::parse_satellite(satellite);
    const auto signals = gnss::signals_of(id.system);
    const auto named =
        std::find_if(signals.begin(), signals.end(), [&](const auto& each) { return each.name == signal; });
    const gnss::Signal& read = named == signals.end() ? signals.front() : *named;
    for (int k = 0; k < 2000; ++k) {
      if (unsent_ephemeris(id, read, week + from_s, week + (from_s + 0.1 * k)) == 0) return 0.1 * k;
    }
    return 1e9;
  };
  EXPECT_NEAR(complete_after_s("G05", 0), 18, 0.1);
  EXPECT_NEAR(complete_after_s("G05", 0.1), 35.9, 0.1) << "subframe 1 of the next frame";
  EXPECT_NEAR(complete_after_s("G05", 12.5), 35.5, 0.1) << "all but a bit of subframe 3";
  EXPECT_NEAR(complete_after_s("G05", 18), 30, 0.1);
  EXPECT_NEAR(complete_after_s("J02", 30), 18, 0.1);
  EXPECT_NEAR(complete_after_s("E05", 1), 26, 0.1);
  EXPECT_NEAR(complete_after_s("E05", 5), 30, 0.1) << "1, 3, 5, then 2, 4";
  EXPECT_NEAR(complete_after_s("C20", 14), 18, 0.1);
  EXPECT_NEAR(complete_after_s("C20", 14, "B1C"), 18, 0.1);
  EXPECT_NEAR(complete_after_s("C20", 15, "B1C"), 35, 0.1);
  EXPECT_NEAR(complete_after_s("G05", 0, "L2C"), 36, 0.1);
  EXPECT_NEAR(complete_after_s("G05", 1, "L2C"), 59, 0.1) << "type 10 of the next turn of 48 s";
  EXPECT_NEAR(complete_after_s("G05", 0, "L5"), 18, 0.1);
  EXPECT_NEAR(complete_after_s("E05", 0, "E5a"), 40, 0.1);
  EXPECT_NEAR(complete_after_s("E05", 0, "E5b"), 24, 0.1);
  EXPECT_NEAR(complete_after_s("C20", 14, "B2a"), 9, 0.1);
  EXPECT_NEAR(complete_after_s("C20", 14, "B2b"), 2, 0.1);
  EXPECT_NEAR(complete_after_s("C20", 15, "B2b"), 2, 0.1) << "type 30, then type 10";
  EXPECT_NEAR(complete_after_s("C03", 14), 27.6, 0.1) << "ten pages";
  EXPECT_NEAR(complete_after_s("R05", 18), 8, 0.1);
  EXPECT_NEAR(complete_after_s("R05", 19), 31, 0.1);
  EXPECT_NEAR(complete_after_s("S23", 0), 1, 0.1);
  EXPECT_NEAR(complete_after_s("S23", 1), 120, 0.1);
}

}  // namespace
}  // namespace canyon::broadcast
