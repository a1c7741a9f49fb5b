// Symbols of the messages with LDPC codes, decoded as by a receiver without errors: parity checks by the
// tables of the interface documents, interleaving, BCH, CRC-24Q, fields in their order.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <random>
#include <string_view>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/sky/broadcast/messages.hpp"
#include "canyon/sky/broadcast/symbols.hpp"
#include "tests/support/sample_ephemeris.hpp"

namespace canyon::broadcast {
namespace {

using geodesy::GpsTime;

/// Logarithms in GF(64) to the root of x^6 + x + 1; 0 has none.
const std::array<int, 64> kLogarithms = [] {
  std::array<int, 64> result{};
  unsigned power = 1;
  for (int i = 0; i < 63; ++i) {
    result.at(power) = i;
    power = power < 32 ? 2 * power : (2 * power - 64) ^ 3U;
  }
  return result;
}();
unsigned product(unsigned a, unsigned b) {
  if (a == 0 || b == 0) return 0;
  const int logarithm = (kLogarithms.at(a) + kLogarithms.at(b)) % 63;
  for (unsigned x = 1; x < 64; ++x) {
    if (kLogarithms.at(x) == logarithm) return x;
  }
  return 0;
}
/// Number of failed parity checks of a word.
int broken_checks(const std::vector<std::vector<LdpcTerm>>& checks, std::size_t symbol_bits,
                  const Bits& word) {
  int broken = 0;
  for (const auto& check : checks) {
    unsigned sum = 0;
    for (const LdpcTerm& term : check) {
      sum ^= product(term.factor, static_cast<unsigned>(word.number(symbol_bits * term.symbol, symbol_bits)));
    }
    broken += sum != 0 ? 1 : 0;
  }
  return broken;
}

struct Code {
  LdpcCode code;
  std::size_t symbol_bits, checks;
  std::uint32_t
      crc;  ///< of the terms, which agree with satellite frames and another program's generator matrices
};
const std::array kCodes{
    Code{LdpcCode::Cnav2Subframe2, 1, 600, 0xA4BB51},  Code{LdpcCode::Cnav2Subframe3, 1, 274, 0xB5C715},
    Code{LdpcCode::Bcnav1Subframe2, 6, 100, 0x05B6C6}, Code{LdpcCode::Bcnav1Subframe3, 6, 44, 0x72E486},
    Code{LdpcCode::Bcnav2, 6, 48, 0xF50245},           Code{LdpcCode::Bcnav3, 6, 81, 0xA6BED3}};

TEST(Ldpc, WordsFulfilTheParityChecks) {
  std::mt19937 random(7);
  for (const auto& [code, symbol_bits, count, crc] : kCodes) {
    const auto checks = parity_checks(code);
    ASSERT_EQ(checks.size(), count);
    std::vector<int> uses(2 * count);
    Bits terms;
    for (const auto& check : checks) {
      for (const LdpcTerm& term : check) {
        terms.put(term.symbol, 12).put(term.factor, 6);
        ++uses.at(term.symbol);
        EXPECT_GE(term.factor, 1);
        EXPECT_LT(term.factor, 1 << symbol_bits);
      }
      // Regular codes of the ICDs: four symbols per check, each symbol in two checks.
      if (symbol_bits == 6) {
        EXPECT_EQ(check.size(), 4U);
      }
    }
    EXPECT_EQ(crc24q(terms), crc);
    for (const int use : uses) {
      if (symbol_bits == 6) {
        EXPECT_EQ(use, 2);
      }
      EXPECT_GE(use, 1);
    }
    for (int trial = 0; trial < 5; ++trial) {
      Bits information;
      for (std::size_t i = 0; i < symbol_bits * count; ++i) information.put(random() & 1U, 1);
      const Bits word = ldpc_encoded(code, information);
      ASSERT_EQ(word.size(), 2 * information.size());
      for (std::size_t i = 0; i < information.size(); ++i) EXPECT_EQ(word[i], information[i]);
      EXPECT_EQ(broken_checks(checks, symbol_bits, word), 0);
      Bits wrong;
      const std::size_t index = random() % word.size();
      for (std::size_t i = 0; i < word.size(); ++i) wrong.put(word[i] != (i == index) ? 1 : 0, 1);
      EXPECT_EQ(broken_checks(checks, symbol_bits, wrong), uses[index / symbol_bits]);
    }
  }
}

/// The bits of a message in their order.
class Reader {
 public:
  explicit Reader(const Bits& bits) : bits_(bits) {}
  std::uint64_t number(std::size_t width) {
    at_ += width;
    return bits_.number(at_ - width, width);
  }
  double number(std::size_t width, double step) {
    const bool negative = bits_[at_];
    const auto value = static_cast<std::int64_t>(number(width));
    return static_cast<double>(negative ? value - (std::int64_t{1} << width) : value) * step;
  }
  void expect(std::size_t width, double step, double value) {
    EXPECT_NEAR(number(width, step), value, 0.501 * step) << "before bit " << at_;
  }
  void expect_angle(std::size_t width, double step, double radians) {
    const double apart = number(width, step) - radians / geodesy::kPi;
    EXPECT_NEAR(std::remainder(apart, 2), 0, 0.501 * step) << "before bit " << at_;
  }
  void expect_zeros(std::size_t width) {
    for (std::size_t i = 0; i < width; ++i) EXPECT_EQ(number(1), 0U) << "bit " << at_ - 1;
  }
  /// The last bits: CRC-24Q of all others.
  void expect_crc() {
    Bits checked;
    for (std::size_t i = 0; i < at_; ++i) checked.put(bits_[i] ? 1 : 0, 1);
    EXPECT_EQ(number(24), crc24q(checked));
    EXPECT_EQ(at_, bits_.size());
  }

 private:
  const Bits& bits_;
  std::size_t at_ = 0;
};

/// @param orbit_s, clock_s from the reference times to whole 300 s
void expect_ellipse(Reader& r, const gnss::KeplerEphemeris& e, double orbit_s, double earth_gm,
                    double reference_m) {
  const double axis_m = e.sqrt_a * e.sqrt_a;
  r.expect(26, 0x1p-9, axis_m - reference_m);
  r.expect_zeros(25);
  r.expect_angle(17, 0x1p-44, e.mean_motion_difference);
  r.expect_zeros(23);
  const double motion = std::sqrt(earth_gm / std::pow(axis_m, 3)) + e.mean_motion_difference;
  r.expect_angle(33, 0x1p-32, e.mean_anomaly + orbit_s * motion);
  r.expect(33, 0x1p-34, e.eccentricity);
  r.expect_angle(33, 0x1p-32, e.argument_of_perigee);
}
void expect_plane(Reader& r, const gnss::KeplerEphemeris& e, double orbit_s, double reference_rate,
                  std::size_t rate_bits) {
  r.expect_angle(33, 0x1p-32, e.right_ascension + orbit_s * e.right_ascension_rate);
  r.expect_angle(33, 0x1p-32, e.inclination + orbit_s * e.inclination_rate);
  r.expect_angle(rate_bits, 0x1p-44, e.right_ascension_rate - reference_rate);
  r.expect_angle(15, 0x1p-44, e.inclination_rate);
  r.expect(16, 0x1p-30, e.cis);
  r.expect(16, 0x1p-30, e.cic);
  r.expect(24, 0x1p-8, e.crs);
  r.expect(24, 0x1p-8, e.crc);
  r.expect(21, 0x1p-30, e.cus);
  r.expect(21, 0x1p-30, e.cuc);
}

/// 2026-03-01 00:00 of BDT, a Sunday.
const GpsTime kBdtWeek = GpsTime::from_week(2408, 14);

class LdpcSymbols : public testing::Test {
 protected:
  /// @param toe its toc is 600 s later
  gnss::NavigationData navigation_of(const char* satellite, GpsTime toe, double semi_major_axis_m) {
    e_ = test::sample_ephemeris(satellite, toe);
    e_.toc = toe + 600;
    e_.af2 = 1e-18;
    e_.sqrt_a = std::sqrt(semi_major_axis_m);
    gnss::NavigationData navigation;
    navigation.kepler.push_back(e_);
    navigation.leap_seconds = 18;
    return navigation;
  }
  [[nodiscard]] const gnss::Signal& signal(std::string_view name) const {
    const auto all = gnss::signals_of(e_.id.system);
    return *std::find_if(all.begin(), all.end(), [&](const gnss::Signal& s) { return s.name == name; });
  }
  /// The delays that are broadcast only for these signals [s].
  [[nodiscard]] gnss::SignalDelays broadcast_delays(
      std::initializer_list<std::pair<std::string_view, double>> of) const {
    gnss::SignalDelays delays;
    delays.id = e_.id;
    delays.toc = e_.toc;
    delays.group_delay_s.fill(std::numeric_limits<double>::infinity());
    for (const auto& [name, delay_s] : of) delays.group_delay_s[gnss::index_of(signal(name))] = delay_s;
    return delays;
  }
  /// The frame around `time`, of `size` symbols.
  Bits bits(const gnss::NavigationData& navigation, std::string_view name, GpsTime time, GpsTime start,
            double symbol_s, std::size_t size) {
    const auto frame = symbol_frame(navigation, e_.id, signal(name), time);
    Bits result;
    if (!frame) {
      ADD_FAILURE() << "no frame";
      return result;
    }
    EXPECT_EQ(frame->start, start);
    EXPECT_EQ(frame->symbol_s, symbol_s);
    EXPECT_EQ(frame->symbols.size(), size);
    for (const std::int8_t symbol : frame->symbols) result.put(symbol < 0 ? 1 : 0, 1);
    return result;
  }
  /// The information of a code word that passes its checks.
  static Bits decoded(LdpcCode code, const Bits& word) {
    const auto code_symbols =
        std::find_if(kCodes.begin(), kCodes.end(), [&](const Code& c) { return c.code == code; });
    EXPECT_EQ(word.size(), 2 * code_symbols->checks * code_symbols->symbol_bits);
    EXPECT_EQ(broken_checks(parity_checks(code), code_symbols->symbol_bits, word), 0);
    Bits information;
    for (std::size_t i = 0; i < word.size() / 2; ++i) information.put(word[i] ? 1 : 0, 1);
    return information;
  }
  void expect_b_cnav_ephemeris_1(Reader& r, double toe_s, double orbit_s, int type, double reference_m) {
    EXPECT_EQ(r.number(11), toe_s / 300);
    EXPECT_EQ(static_cast<int>(r.number(2)), type);
    expect_ellipse(r, e_, orbit_s, 3.986004418e14, reference_m);
  }
  void expect_b_cnav_clock(Reader& r, double toc_s, double clock_s) {
    EXPECT_EQ(r.number(11), toc_s / 300);
    r.expect(25, 0x1p-34, e_.af0 + clock_s * (e_.af1 + clock_s * e_.af2));
    r.expect(22, 0x1p-50, e_.af1 + 2 * clock_s * e_.af2);
    r.expect(11, 0x1p-66, e_.af2);
  }
  static void expect_utc(Reader& r, int leap_seconds, std::uint64_t week, std::uint64_t day,
                         std::size_t day_bits) {
    r.expect_zeros(16 + 13 + 7);
    r.expect(8, 1, leap_seconds);
    r.expect_zeros(16);
    EXPECT_EQ(r.number(13), week);
    EXPECT_EQ(r.number(13), week);
    EXPECT_EQ(r.number(day_bits), day);
    r.expect(8, 1, leap_seconds);
  }
  /// A cyclic code contains the word iff it is orthogonal to all cyclic shifts of the check polynomial.
  static void expect_cyclic(const Bits& bits, std::size_t first, std::size_t size, unsigned check) {
    for (std::size_t shift = 0; shift < size; ++shift) {
      bool sum = false;
      for (std::size_t i = 0; check >> i != 0; ++i) {
        sum ^= (check >> i & 1U) != 0 && bits[first + (shift + i) % size];
      }
      EXPECT_FALSE(sum) << shift;
    }
  }
  gnss::KeplerEphemeris e_;
};

// BDS-SIS-ICD-B1C-1.0, 6.2: frames of 18 s from the start of the BDT week on.
TEST_F(LdpcSymbols, BcnavOneIsReadBack) {
  struct Case {
    const char* satellite;
    double semi_major_axis_m, toe_s;  // of the BDT week
    int type;
    double reference_m;
    int frame;  // from the begin of the week
    bool broadcast_delays;
  };
  for (const Case& c : {Case{"C25", 27'906'500, 36000, 3, 27'906'100, 2000, false},
                        Case{"C40", 42'161'000, 36100, 2, 42'162'200, 2199, true},
                        Case{"C19", 27'905'000, 3600 - 16, 3, 27'906'100, 0, false},
                        Case{"C58", 27'905'000, 601'200, 3, 27'906'100, 33'599, true}}) {
    SCOPED_TRACE(c.satellite);
    gnss::NavigationData navigation = navigation_of(c.satellite, kBdtWeek + c.toe_s, c.semi_major_axis_m);
    navigation.kepler[0].health = c.broadcast_delays ? 1 : 0;
    double b1c_s = e_.group_delay[0], b2a_s = e_.group_delay[1];
    if (c.broadcast_delays) {
      b1c_s = -2.5e-9;
      b2a_s = 7.5e-9;
      navigation.signal_delays.push_back(broadcast_delays({{"B1C", b1c_s}, {"B2a", b2a_s}}));
    }
    const GpsTime start = kBdtWeek + 18 * c.frame;
    for (const double within_s : {0.0, 17.99}) {
      const Bits frame = bits(navigation, "B1C", start + within_s, start, 0.01, 1800);
      // Subframe 1: BCH(21,6) of the PRN, BCH(51,8) of 18 s of the hour.
      EXPECT_EQ(frame.number(0, 6), e_.id.number);
      EXPECT_EQ(frame.number(21, 8), static_cast<unsigned>(c.frame % 200));
      expect_cyclic(frame, 0, 21, 0b101'0111);
      expect_cyclic(frame, 21, 51, 0b1'1001'1111);
      // 36 rows of 48, read by columns: subframe 3 in each third row of the first 33.
      Bits second, third;
      for (std::size_t row = 0; row < 36; ++row) {
        Bits& to = row < 33 && row % 3 == 2 ? third : second;
        for (std::size_t column = 0; column < 48; ++column) to.put(frame[72 + 36 * column + row] ? 1 : 0, 1);
      }
      const Bits subframe2 = decoded(LdpcCode::Bcnav1Subframe2, second);
      const Bits subframe3 = decoded(LdpcCode::Bcnav1Subframe3, third);
      const double toe_s = std::round(c.toe_s / 300) * 300, toc_s = toe_s + 600;
      Reader r(subframe2);
      EXPECT_EQ(r.number(13), 2408U - 1356);
      EXPECT_EQ(r.number(8), static_cast<unsigned>(c.frame / 200));
      const std::uint64_t iodc = r.number(10);
      EXPECT_EQ(iodc, r.number(8));
      EXPECT_LT(iodc, 60U) << "younger than 12 h";
      expect_b_cnav_ephemeris_1(r, toe_s, toe_s - c.toe_s, c.type, c.reference_m);
      expect_plane(r, e_, toe_s - c.toe_s, 0, 19);
      expect_b_cnav_clock(r, toc_s, toe_s - c.toe_s);
      r.expect(12, 0x1p-34, b2a_s);
      r.expect_zeros(12);
      r.expect(12, 0x1p-34, b1c_s);
      r.expect_zeros(7);
      r.expect_crc();
      Reader page(subframe3);
      EXPECT_EQ(page.number(6), 1U);
      EXPECT_EQ(page.number(2), c.broadcast_delays ? 1U : 0U);
      page.expect_zeros(3 + 4 + 5 + 22 + 74);
      expect_utc(page, 18 - 14, 2408 - 1356, 6, 3);
      page.expect_zeros(27);
      page.expect_crc();
    }
  }
  const gnss::NavigationData navigation = navigation_of("C03", kBdtWeek, 42'164'000);
  EXPECT_FALSE(symbol_frame(navigation, e_.id, signal("B1C"), kBdtWeek)) << "geostationary";
}

// BDS-SIS-ICD-B2a-1.0, 6.2: messages of 3 s from the start of the BDT week on.
TEST_F(LdpcSymbols, BcnavTwoIsReadBack) {
  const double toe_s = 36000;
  for (const int first : {12'000, 201'596}) {  // the last ones end with the week
    gnss::NavigationData navigation =
        navigation_of("C25", kBdtWeek + (first == 12'000 ? toe_s : 604'800 - toe_s), 27'906'500);
    const double sent_toe_s = first == 12'000 ? toe_s : 604'800 - toe_s;
    navigation.kepler[0].health = 1;
    const std::array<unsigned, 4> types{10, 11, 30, 34};
    std::uint64_t iode = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      SCOPED_TRACE(types.at(k));
      const auto count = static_cast<unsigned>(first) + static_cast<unsigned>(k);
      const GpsTime start = kBdtWeek + 3.0 * count;
      const Bits frame = bits(navigation, "B2a", start + 2.999, start, 0.005, 600);
      EXPECT_EQ(frame.number(0, 24), 0xE24DE8U);
      Bits word;
      for (std::size_t i = 24; i < 600; ++i) word.put(frame[i] ? 1 : 0, 1);
      const Bits message = decoded(LdpcCode::Bcnav2, word);
      Reader r(message);
      EXPECT_EQ(r.number(6), 25U);
      EXPECT_EQ(r.number(6), types.at(k));
      EXPECT_EQ(r.number(18), count);
      if (k == 0) {
        EXPECT_EQ(r.number(13), 2408U - 1356);
      } else {
        EXPECT_EQ(r.number(2), 1U) << "unhealthy";
      }
      r.expect_zeros(3 + 4 + 3);
      switch (k) {
        case 0:
          iode = r.number(8);
          expect_b_cnav_ephemeris_1(r, sent_toe_s, 0, 3, 27'906'100);
          break;
        case 1:
          expect_plane(r, e_, 0, 0, 19);
          break;
        case 2:
          expect_b_cnav_clock(r, sent_toe_s + 600, 0);
          EXPECT_EQ(r.number(10), iode);
          r.expect(12, 0x1p-34, e_.group_delay[1]);
          r.expect_zeros(12 + 74);
          r.expect(12, 0x1p-34, e_.group_delay[0]);
          r.expect_zeros(33);
          break;
        default:
          r.expect_zeros(22);
          expect_b_cnav_clock(r, sent_toe_s + 600, 0);
          EXPECT_EQ(r.number(10), iode);
          expect_utc(r, 18 - 14, 2408 - 1356, 6, 3);
          r.expect_zeros(24);
          break;
      }
      r.expect_crc();
    }
  }
}

// BDS-SIS-ICD-B2b-1.0, 6.2: messages of a second from the start of the BDT week on.
TEST_F(LdpcSymbols, BcnavThreeIsReadBack) {
  for (const bool end_of_week : {false, true}) {
    const double toe_s = end_of_week ? 601'200 : 36100, sent_toe_s = end_of_week ? toe_s : 36000;
    gnss::NavigationData navigation = navigation_of("C40", kBdtWeek + toe_s, 42'161'000);
    navigation.kepler[0].health = 1;
    navigation.signal_delays.push_back(broadcast_delays({{"B2b", -2.5e-9}}));
    for (const unsigned type : {10U, 30U}) {
      SCOPED_TRACE(type);
      const unsigned second = (end_of_week ? 604'798U : 36'000U) + (type == 10 ? 0 : 1);
      const GpsTime start = kBdtWeek + second;
      const Bits frame = bits(navigation, "B2b", start + 0.999, start, 0.001, 1000);
      EXPECT_EQ(frame.number(0, 16), 0xEB90U);
      EXPECT_EQ(frame.number(16, 6), 40U);
      EXPECT_EQ(frame.number(22, 6), 0U);
      Bits word;
      for (std::size_t i = 28; i < 1000; ++i) word.put(frame[i] ? 1 : 0, 1);
      const Bits message = decoded(LdpcCode::Bcnav3, word);
      Reader r(message);
      EXPECT_EQ(r.number(6), type);
      EXPECT_EQ(r.number(20), second);
      if (type == 10) {
        r.expect_zeros(4);
        expect_b_cnav_ephemeris_1(r, sent_toe_s, sent_toe_s - toe_s, 2, 42'162'200);
        expect_plane(r, e_, sent_toe_s - toe_s, 0, 19);
        r.expect_zeros(3 + 4);
      } else {
        EXPECT_EQ(r.number(13), 2408U - 1356);
        r.expect_zeros(4);
        expect_b_cnav_clock(r, sent_toe_s + 600, sent_toe_s - toe_s);
        r.expect(12, 0x1p-34, -2.5e-9);
        r.expect_zeros(74);
        expect_utc(r, 18 - 14, 2408 - 1356, 6, 3);
        r.expect_zeros(138 + 22 + 5);
        EXPECT_EQ(r.number(2), 1U) << "unhealthy";
      }
      r.expect_crc();
    }
  }
}

// IS-GPS-800, 3.2.3 and 3.5: frames of 18 s from the start of the week on.
TEST_F(LdpcSymbols, CnavTwoIsReadBack) {
  struct Case {
    const char* satellite;
    double semi_major_axis_m, toe_s, reference_m;
    int frame;
    bool broadcast_delay;
  };
  for (const Case& c : {Case{"G05", 26'560'000, 36000, 26'559'710, 2000, false},
                        Case{"G32", 26'561'000, 7200 - 16, 26'559'710, 399, true},
                        Case{"J03", 42'165'000, 601'200, 42'164'200, 33'599, false},
                        Case{"G11", 26'559'000, 604'784, 26'559'710, 33'455, false}}) {
    SCOPED_TRACE(c.satellite);
    const GpsTime week = GpsTime::from_week(2408, 0), start = week + 18 * c.frame;
    gnss::NavigationData navigation = navigation_of(c.satellite, week + c.toe_s, c.semi_major_axis_m);
    navigation.kepler[0].health = c.broadcast_delay ? 1 : 0;
    gnss::Klobuchar klobuchar;
    klobuchar.alpha[1] = 3 * 0x1p-27;
    navigation.klobuchar[e_.id.system] = klobuchar;
    const double tgd_s = e_.group_delay[0];
    double l1c_s = tgd_s;
    if (c.broadcast_delay) {
      l1c_s = -7e-9;
      navigation.signal_delays.push_back(broadcast_delays({{"L1C", l1c_s}}));
    }
    const Bits frame = bits(navigation, "L1C", start + 17.99, start, 0.01, 1800);
    // Subframe 1: the count at the start of the next frame; its first bit inverts BCH(51,8) of the others.
    const auto count = static_cast<unsigned>((c.frame + 1) % 400);
    EXPECT_EQ(frame.number(0, 1), count >> 8U);
    Bits low;
    for (std::size_t i = 1; i < 52; ++i) low.put(frame[i] != frame[0] ? 1 : 0, 1);
    EXPECT_EQ(low.number(0, 8), count & 255U);
    expect_cyclic(low, 0, 51, 0b1'1001'1111);
    // 38 rows of 46, read by columns.
    Bits rows;
    for (std::size_t row = 0; row < 38; ++row) {
      for (std::size_t column = 0; column < 46; ++column) rows.put(frame[52 + 38 * column + row] ? 1 : 0, 1);
    }
    Bits second, third;
    for (std::size_t i = 0; i < rows.size(); ++i) (i < 1200 ? second : third).put(rows[i] ? 1 : 0, 1);
    const Bits subframe2 = decoded(LdpcCode::Cnav2Subframe2, second);
    const Bits subframe3 = decoded(LdpcCode::Cnav2Subframe3, third);
    // It stays in the week of toe if the nearest multiple of 300 s is the start of the next week.
    const double toe_s = std::min(std::round(c.toe_s / 300), 2015.0) * 300;
    Reader r(subframe2);
    EXPECT_EQ(r.number(13), 2408U);
    EXPECT_EQ(r.number(8), static_cast<unsigned>(c.frame / 400));
    EXPECT_EQ(r.number(11), toe_s / 300);
    EXPECT_EQ(r.number(1), c.broadcast_delay ? 1U : 0U);
    EXPECT_EQ(r.number(5), 0U) << "2 m";
    EXPECT_EQ(r.number(11), toe_s / 300);
    expect_ellipse(r, e_, toe_s - c.toe_s, 3.986005e14, c.reference_m);
    expect_plane(r, e_, toe_s - c.toe_s, -2.6e-9 * geodesy::kPi, 17);
    r.expect_zeros(5 + 3 + 3);
    const double clock_s = toe_s - c.toe_s - 600;
    r.expect(26, 0x1p-35, e_.af0 + clock_s * (e_.af1 + clock_s * e_.af2));
    r.expect(20, 0x1p-48, e_.af1 + 2 * clock_s * e_.af2);
    r.expect(10, 0x1p-60, e_.af2);
    r.expect(13, 0x1p-35, tgd_s);
    r.expect(13, 0x1p-35, tgd_s - l1c_s);
    r.expect(13, 0x1p-35, tgd_s - l1c_s);
    r.expect_zeros(1);
    EXPECT_EQ(r.number(8), 2408U % 256);
    r.expect_zeros(2);
    r.expect_crc();
    Reader page(subframe3);
    EXPECT_EQ(page.number(8), e_.id.number + (c.satellite[0] == 'J' ? 192U : 0U));
    EXPECT_EQ(page.number(6), 1U);
    expect_utc(page, 18, 2408, 7, 4);
    page.expect_zeros(8);
    EXPECT_EQ(page.number(8), 3U);
    page.expect_zeros(48);
    // L1 C/A, L2C and both of L5: TGD by the squares of the frequencies.
    for (const double square : {1.0, 77.0 * 77 / 3600, 154.0 * 154 / 13225, 154.0 * 154 / 13225}) {
      page.expect(13, 0x1p-35, tgd_s * (1 - square));
    }
    page.expect_zeros(22);
    page.expect_crc();
  }
}

}  // namespace
}  // namespace canyon::broadcast
