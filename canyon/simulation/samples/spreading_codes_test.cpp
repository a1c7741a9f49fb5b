#include "canyon/simulation/samples/spreading_codes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <string>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/receiver/tracking/correlation.hpp"

namespace canyon::samples::spreading_codes_test {
namespace {

using geodesy::kPi;
using gnss::Modulation;
using gnss::System;

std::vector<Component> sent(System system, int number, std::string_view signal) {
  for (const gnss::Signal& s : gnss::signals_of(system)) {
    if (s.name == signal) return components({system, static_cast<std::uint8_t>(number)}, s);
  }
  ADD_FAILURE() << "no signal " << signal;
  return {};
}

/// Chips [from, from + 3 x digits) as octal digits, as the documents write them.
std::string octal(const std::vector<std::int8_t>& chips, std::size_t from, std::size_t digits) {
  std::string text;
  for (std::size_t i = from; i < from + 3 * digits; i += 3) {
    const int value = (chips[i] < 0 ? 4 : 0) + (chips[i + 1] < 0 ? 2 : 0) + (chips[i + 2] < 0 ? 1 : 0);
    text += static_cast<char>('0' + value);
  }
  return text;
}

/// Sum of the products of a code and another one `lag` chips later, both repeated.
int correlation(const std::vector<std::int8_t>& a, const std::vector<std::int8_t>& b, std::size_t lag) {
  int sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum += a[i] * b[i + lag < b.size() ? i + lag : i + lag - b.size()];
  }
  return sum;
}

int total(const std::vector<std::int8_t>& chips) {
  return std::accumulate(chips.begin(), chips.end(), 0);
}

TEST(SpreadingCodes, EverySignalHasItsPeriodsRatesAndShares) {
  struct Expected {
    System system;
    std::string_view signal;
    int satellites;
    std::vector<std::size_t> chips, secondary;  // of each component
  };
  const Expected all[]{
      {System::GPS, "L1CA", 63, {1023}, {1}},
      {System::GPS, "L1C", 63, {10230, 10230}, {1800, 1}},
      {System::GPS, "L2C", 63, {1534500, 20460}, {1, 1}},
      {System::GPS, "L5", 63, {10230, 10230}, {20, 10}},
      {System::QZSS, "L1CA", 10, {1023}, {1}},
      {System::QZSS, "L1C", 10, {10230, 10230}, {1800, 1}},
      {System::QZSS, "L2C", 10, {1534500, 20460}, {1, 1}},
      {System::QZSS, "L5", 10, {10230, 10230}, {20, 10}},
      {System::GLONASS, "G1", 99, {511}, {1}},
      {System::GLONASS, "G2", 99, {511}, {1}},
      {System::Galileo, "E1", 50, {4092, 4092}, {25, 1}},
      {System::Galileo, "E5a", 50, {10230, 10230}, {100, 20}},
      {System::Galileo, "E5b", 50, {10230, 10230}, {100, 4}},
      {System::BeiDou, "B1I", 63, {2046}, {20}},
      {System::BeiDou, "B1C", 63, {10230, 10230, 10230}, {1800, 1800, 1}},
      {System::BeiDou, "B2I", 63, {2046}, {20}},
      {System::BeiDou, "B2a", 63, {10230, 10230}, {100, 5}},
      {System::BeiDou, "B3I", 63, {10230}, {20}},
      {System::BeiDou, "B2b", 63, {10230}, {1}},
      {System::SBAS, "L1CA", 39, {1023}, {1}},
  };
  std::size_t signals = 0;
  for (const gnss::System system : gnss::kAllSystems) {
    for (const gnss::Signal& signal : gnss::signals_of(system))
      signals += signal.only_recorded.empty() ? 1 : 0;
  }
  EXPECT_EQ(std::size(all), signals);
  for (const Expected& e : all) {
    int satellites = 0;
    // The chips of CL take longest: only some of the satellites.
    for (int number = 1; number <= 99; number += e.signal == "L2C" ? 7 : 1) {
      const std::vector<Component> found = sent(e.system, number, e.signal);
      if (found.empty()) continue;
      ++satellites;
      ASSERT_EQ(found.size(), e.chips.size());
      const bool d2 = e.system == System::BeiDou && (number <= 5 || number >= 59);
      double fraction = 0;
      for (std::size_t i = 0; i < found.size(); ++i) {
        const Component& c = found[i];
        SCOPED_TRACE(std::string(e.signal) + " of " + std::to_string(number));
        EXPECT_EQ(c.chips.size(), e.chips[i]);
        EXPECT_EQ(c.secondary.size(), d2 && e.secondary[i] == 20 ? 1 : e.secondary[i]);
        EXPECT_TRUE(
            std::all_of(c.secondary.begin(), c.secondary.end(), [](int s) { return s == 1 || s == -1; }));
        EXPECT_EQ(static_cast<std::size_t>(std::count(c.chips.begin(), c.chips.end(), 0)),
                  e.signal == "L2C" ? c.chips.size() / 2 : 0);
        EXPECT_TRUE(std::all_of(c.chips.begin(), c.chips.end(), [](int s) { return s * s <= 1; }));
        EXPECT_EQ(c.data, i + 1 == found.size());
        fraction += c.power_fraction;
        // Whole periods in a week, so that all begin with it.
        const double weeks =
            604800 * c.chip_rate_hz / static_cast<double>(c.chips.size() * c.secondary.size());
        EXPECT_EQ(weeks, std::round(weeks));
      }
      EXPECT_DOUBLE_EQ(fraction, 1);
      EXPECT_EQ(found.front().phase_rad, 0);
    }
    EXPECT_EQ(satellites, e.signal == "L2C" ? (e.satellites + 6) / 7 : e.satellites) << e.signal;
  }
}

TEST(SpreadingCodes, FirstChipsAreThoseOfTheDocuments) {
  // IS-GPS-200 table 3-Ia.
  const std::string_view gps[]{"1440", "1620", "1710", "1744", "1133", "1455", "1131", "1454",
                               "1626", "1504", "1642", "1750", "1764", "1772", "1775", "1776",
                               "1156", "1467", "1633", "1715", "1746", "1763", "1063", "1706",
                               "1743", "1761", "1770", "1774", "1127", "1453", "1625", "1712"};
  const auto ten = [](const std::vector<std::int8_t>& chips) {  // the first digit is one bit
    return (chips[0] < 0 ? "1" : "0") + octal(chips, 1, 3);
  };
  for (int prn = 1; prn <= 32; ++prn) {
    EXPECT_EQ(ten(sent(System::GPS, prn, "L1CA")[0].chips), gps[prn - 1]) << prn;
  }
  // Table 6-I: PRN 120, 138 and 193.
  EXPECT_EQ(ten(sent(System::SBAS, 20, "L1CA")[0].chips), "0671");
  EXPECT_EQ(ten(sent(System::SBAS, 38, "L1CA")[0].chips), "1327");
  EXPECT_EQ(ten(sent(System::QZSS, 1, "L1CA")[0].chips), "0727");

  struct Listed {
    System system;
    int number;
    std::string_view signal;
    std::size_t component;
    std::string_view first, last;  // 24 chips; empty: not listed
  };
  const Listed listed[]{
      {System::GPS, 1, "L1C", 0, "05752067", "20173742"},  // IS-GPS-800, 3.2.2.1
      {System::GPS, 2, "L1C", 0, "70146401", "35437154"},
      {System::GPS, 3, "L1C", 0, "32066222", "00161056"},
      {System::GPS, 1, "L1C", 1, "77001425", "52231646"},
      {System::GPS, 2, "L1C", 1, "23342754", "46703351"},
      {System::GPS, 3, "L1C", 1, "30523404", "00145161"},
      {System::BeiDou, 1, "B1C", 0, "71676756", "13053205"},  // BDS-SIS-ICD-B1C-1.0
      {System::BeiDou, 63, "B1C", 0, "03210227", "56250500"},
      {System::BeiDou, 1, "B1C", 2, "53773116", "42711657"},
      {System::BeiDou, 2, "B1C", 2, "32235341", "17306122"},
      {System::BeiDou, 63, "B1C", 2, "27571255", "47160627"},
      {System::BeiDou, 1, "B2a", 0, "26772435", "05133452"},  // BDS-SIS-ICD-B2a-1.0
      {System::BeiDou, 1, "B2a", 1, "26771056", "42646672"},
      {System::BeiDou, 1, "B2b", 0, "26773275", "01362377"},  // BDS-SIS-ICD-B2b-1.0
      {System::Galileo, 1, "E5a", 1, "17165235", ""},         // 3CEA9D: OS SIS ICD 2.1, 3.4.1
      {System::Galileo, 2, "E5a", 1, "47306361", ""},         // 9D8CF1
      {System::Galileo, 1, "E5a", 0, "24252467", ""},         // 515537
      {System::Galileo, 1, "E5b", 1, "61337241", ""},         // C5BEA1
      {System::Galileo, 1, "E1", 1, "75353420", ""},          // F5D710, annex C
      {System::GLONASS, 1, "G1", 0, "77407574", ""},          // nine ones, read at stage 7
  };
  for (const Listed& l : listed) {
    const std::vector<std::int8_t> chips = sent(l.system, l.number, l.signal)[l.component].chips;
    EXPECT_EQ(octal(chips, 0, 8), l.first) << l.signal << " of " << l.number;
    if (!l.last.empty()) {
      EXPECT_EQ(octal(chips, chips.size() - 24, 8), l.last) << l.signal << " of " << l.number;
    }
  }
}

TEST(SpreadingCodes, L5BeginsWithTheListedStateOfXb) {
  // IS-GPS-705, 3.2.1.1. XA begins with 13 ones, so that 0 is sent where XB's stages 13 to 1 contain 1.
  const auto state = [](int prn, std::size_t component) {
    const std::vector<std::int8_t> chips = sent(System::GPS, prn, "L5")[component].chips;
    std::string text;
    for (std::size_t stage = 1; stage <= 13; ++stage) text += chips[13 - stage] > 0 ? '1' : '0';
    return text;
  };
  EXPECT_EQ(state(1, 1), "0101011100100");
  EXPECT_EQ(state(2, 1), "1100000110101");
  EXPECT_EQ(state(1, 0), "1001011001100");
  EXPECT_EQ(state(2, 0), "0100011110110");
  // XB continues through its 8191 states: the sum with XA repeats after both registers were restarted.
  const std::vector<std::int8_t> i5 = sent(System::GPS, 1, "L5")[1].chips;
  const std::vector<std::int8_t> q5 = sent(System::GPS, 1, "L5")[0].chips;
  // The sum of both is that of two phases of XB, which has a period of 8191.
  for (std::size_t i = 0; i + 8191 < i5.size(); ++i) {
    ASSERT_EQ(i5[i] * q5[i], i5[i + 8191] * q5[i + 8191]) << i;
  }
}

TEST(SpreadingCodes, L2cEndsWithTheListedState) {
  // IS-GPS-200 tables 3-IIa: contents of the register at the last chip. Run backwards from there.
  const auto backwards = [](std::uint32_t state, const std::vector<std::int8_t>& chips, std::size_t offset) {
    for (std::size_t i = chips.size() - 2 + offset; i < chips.size(); i -= 2) {
      if (chips[i] != ((state & 1U) != 0 ? -1 : 1)) return i;
      const std::uint32_t bit = state >> 26U;
      state = (((state ^ (bit != 0 ? 0445112474U : 0U)) << 1U) | bit) & 0777777777U;
    }
    return std::size_t{0};
  };
  const std::vector<Component> one = sent(System::GPS, 1, "L2C"), two = sent(System::GPS, 2, "L2C");
  EXPECT_EQ(backwards(0267724236, one[0].chips, 1), 0U);
  EXPECT_EQ(backwards(0552566002, one[1].chips, 0), 0U);
  EXPECT_EQ(backwards(0167516066, two[0].chips, 1), 0U);
  EXPECT_EQ(backwards(0034445034, two[1].chips, 0), 0U);
  // One of both is sent in each chip, at full power.
  for (std::size_t i = 0; i < one[0].chips.size(); ++i) {
    ASSERT_EQ(std::abs(one[0].chips[i]) + std::abs(one[1].chips[i % one[1].chips.size()]), 1);
  }
  EXPECT_DOUBLE_EQ(amplitude(one[0]), 1);
  EXPECT_DOUBLE_EQ(amplitude(one[1]), 1);
}

TEST(SpreadingCodes, CaCodesAreGoldCodes) {
  std::vector<std::vector<std::int8_t>> codes;
  for (int prn = 1; prn <= 32; ++prn) codes.push_back(sent(System::GPS, prn, "L1CA")[0].chips);
  codes.push_back(sent(System::GPS, 63, "L1CA")[0].chips);
  codes.push_back(sent(System::SBAS, 23, "L1CA")[0].chips);
  codes.push_back(sent(System::QZSS, 2, "L1CA")[0].chips);
  for (std::size_t a = 0; a < codes.size(); ++a) {
    for (std::size_t b = 0; b <= a; ++b) {
      std::set<int> values;
      for (std::size_t lag = a == b ? 1 : 0; lag < codes[a].size(); ++lag) {
        values.insert(correlation(codes[a], codes[b], lag));
      }
      // IS-GPS-200, 3.3.2.3: 65 of 1023 are -23.9 dB.
      EXPECT_EQ(values, (std::set<int>{-65, -1, 63})) << a << " " << b;
    }
  }
}

TEST(SpreadingCodes, GlonassIsAMaximumLengthSequence) {
  const std::vector<std::int8_t> chips = sent(System::GLONASS, 1, "G1")[0].chips;
  for (std::size_t lag = 1; lag < chips.size(); ++lag) ASSERT_EQ(correlation(chips, chips, lag), -1);
  EXPECT_EQ(sent(System::GLONASS, 24, "G2")[0].chips, chips);
}

TEST(SpreadingCodes, MemoryAndWeilCodesAreBalanced) {
  for (int number = 1; number <= 50; ++number) {
    for (const Component& c : sent(System::Galileo, number, "E1")) {
      EXPECT_EQ(total(c.chips), 0) << number;
      EXPECT_EQ(correlation(c.chips, c.chips, 1), 0) << number;  // as these codes were chosen
    }
  }
  for (int number = 1; number <= 63; ++number) {
    for (const Component& c : sent(System::GPS, number, "L1C")) EXPECT_EQ(total(c.chips), 0) << number;
    for (const Component& c : sent(System::BeiDou, number, "B1C")) EXPECT_EQ(total(c.chips), 0) << number;
  }
}

/// Largest value outside the peak of the autocorrelation, and of the cross-correlation with another code, in
/// dB of the peak. All shifts of the short codes, every 11th of the long ones.
double worst_db(const std::vector<std::int8_t>& a, const std::vector<std::int8_t>& b, std::size_t from) {
  int worst = 0;
  for (std::size_t lag = from; lag<a.size(); lag += a.size()> 5000 ? 11 : 1) {
    worst = std::max(worst, std::abs(correlation(a, b, lag)));
  }
  return 20 * std::log10(worst / static_cast<double>(a.size()));
}

TEST(SpreadingCodes, CodesOfOtherSatellitesAreFarBelowThePeak) {
  struct Bound {
    System system;
    std::string_view signal;
    double db;
  };
  // Values of the documents' authors: -23.9 dB for Gold codes of 1023 chips, about -25 dB for E1 and B1I, -27
  // dB for 10230 chips; here the largest of the computed shifts.
  for (const Bound& bound : {Bound{System::GPS, "L1CA", -23.9}, Bound{System::Galileo, "E1", -25.0},
                             Bound{System::BeiDou, "B1I", -23.0}, Bound{System::GPS, "L1C", -27.0},
                             Bound{System::BeiDou, "B1C", -27.0}, Bound{System::GPS, "L5", -26.0},
                             Bound{System::Galileo, "E5a", -26.0}, Bound{System::Galileo, "E5b", -26.0},
                             Bound{System::BeiDou, "B2a", -26.0}, Bound{System::BeiDou, "B2b", -26.0},
                             Bound{System::BeiDou, "B3I", -26.0}}) {
    const std::vector<Component> one = sent(bound.system, 21, bound.signal);
    const std::vector<Component> other = sent(bound.system, 33, bound.signal);
    for (std::size_t i = 0; i < one.size(); ++i) {
      EXPECT_LT(worst_db(one[i].chips, one[i].chips, 1), bound.db) << bound.signal << " " << i;
      EXPECT_LT(worst_db(one[i].chips, other[i].chips, 0), bound.db) << bound.signal << " " << i;
    }
    if (one.size() > 1) {
      EXPECT_LT(worst_db(one.front().chips, one.back().chips, 0), bound.db) << bound.signal;
    }
  }
}

TEST(SpreadingCodes, SecondaryCodesAreThoseOfTheDocuments) {
  const auto secondary = [](System system, int number, std::string_view signal, std::size_t component) {
    const std::vector<Component> found = sent(system, number, signal);
    std::string text;
    for (const int chip : found[component].secondary) text += chip < 0 ? '1' : '0';
    return text;
  };
  const std::string neuman_hofman = "00000100110101001110";
  EXPECT_EQ(secondary(System::GPS, 3, "L5", 0), neuman_hofman);
  EXPECT_EQ(secondary(System::GPS, 3, "L5", 1), "0000110101");
  EXPECT_EQ(secondary(System::BeiDou, 6, "B1I", 0), neuman_hofman);
  EXPECT_EQ(secondary(System::BeiDou, 58, "B3I", 0), neuman_hofman);
  EXPECT_EQ(secondary(System::BeiDou, 5, "B1I", 0), "0");
  EXPECT_EQ(secondary(System::BeiDou, 59, "B3I", 0), "0");
  EXPECT_EQ(secondary(System::BeiDou, 20, "B2a", 1), "00010");
  EXPECT_EQ(secondary(System::Galileo, 9, "E1", 0), "0011100000001010110110010");
  EXPECT_EQ(secondary(System::Galileo, 9, "E5a", 1), "10000100001011101001");
  EXPECT_EQ(secondary(System::Galileo, 9, "E5b", 1), "1110");
  // 83F6F69D8F6E15411FB8C9B1C and CFF914EE3C6126A49FD5E5C94, the first and last 12 chips.
  EXPECT_EQ(secondary(System::Galileo, 1, "E5a", 0).substr(0, 12), "100000111111");
  EXPECT_EQ(secondary(System::Galileo, 1, "E5a", 0).substr(88), "101100011100");
  EXPECT_EQ(secondary(System::Galileo, 1, "E5b", 0).substr(0, 12), "110011111111");
  EXPECT_EQ(secondary(System::Galileo, 1, "E5b", 0).substr(88), "110010010100");
  // IS-GPS-800, 3.2.2.1.2: first and last 11 chips of the overlay of PRN 1.
  EXPECT_EQ(secondary(System::GPS, 1, "L1C", 0).substr(0, 11), "11010110110");
  EXPECT_EQ(secondary(System::GPS, 1, "L1C", 0).substr(1789), "00100001000");
}

TEST(SpreadingCodes, SubcarriersHaveTheirCorrelation) {
  struct Case {
    System system;
    std::string_view signal;
    std::size_t component;
    double tolerance;
  };
  // The next chip is uncorrelated with this one on average in E1's codes, nearly so in the others.
  for (const Case& c : {Case{System::GPS, "L1CA", 0, 2e-3}, Case{System::GPS, "L1C", 0, 0.015},
                        Case{System::GPS, "L1C", 1, 0.015}, Case{System::BeiDou, "B1C", 0, 0.015},
                        Case{System::BeiDou, "B1C", 1, 0.015}, Case{System::Galileo, "E1", 0, 1e-12},
                        Case{System::Galileo, "E1", 1, 1e-12}}) {
    const Component component = sent(c.system, 11, c.signal)[c.component];
    constexpr std::size_t kCells = 12;
    std::vector<double> wave;
    for (std::size_t i = 0; i < component.chips.size(); ++i) {
      for (std::size_t cell = 0; cell < kCells; ++cell) {
        const double fraction = (static_cast<double>(cell) + 0.5) / kCells;
        wave.push_back(component.chips[i] * subcarrier(component.modulation, fraction, i));
      }
    }
    tracking::CorrelationOptions options;
    options.modulation = component.modulation;
    const tracking::Correlation expected(options);
    for (std::size_t lag = 0; lag <= kCells; ++lag) {
      double sum = 0;
      for (std::size_t i = 0; i < wave.size(); ++i) sum += wave[i] * wave[(i + lag) % wave.size()];
      EXPECT_NEAR(sum / static_cast<double>(wave.size()), expected.value(static_cast<double>(lag) / kCells),
                  c.tolerance)
          << c.signal << " " << c.component << " lag " << lag;
    }
  }
  // Values of Galileo OS SIS ICD figure 8: both subcarriers have the same sign at the start of a chip, E1-B's
  // add.
  EXPECT_NEAR(subcarrier(Modulation::CBOCData, 0, 0), std::sqrt(10.0 / 11) + std::sqrt(1.0 / 11), 1e-15);
  EXPECT_NEAR(subcarrier(Modulation::CBOCPilot, 0, 0), std::sqrt(10.0 / 11) - std::sqrt(1.0 / 11), 1e-15);
  EXPECT_NEAR(subcarrier(Modulation::CBOCData, 0.99, 0), -std::sqrt(10.0 / 11) - std::sqrt(1.0 / 11), 1e-15);
  EXPECT_EQ(subcarrier(Modulation::BOC11, 0.49, 0), 1);
  EXPECT_EQ(subcarrier(Modulation::BOC11, 0.5, 0), -1);
  EXPECT_EQ(subcarrier(Modulation::TMBOC, 0.1, 29), -1);
  EXPECT_EQ(subcarrier(Modulation::TMBOC, 0.1, 33 + 5), 1);
}

TEST(SpreadingCodes, PhasesAreThoseOfTheDocuments) {
  const auto data_phase = [](System system, std::string_view signal) {
    return sent(system, 7, signal).back().phase_rad;
  };
  EXPECT_DOUBLE_EQ(data_phase(System::GPS, "L1C"), 0);
  EXPECT_DOUBLE_EQ(data_phase(System::GPS, "L2C"), 0);
  EXPECT_DOUBLE_EQ(data_phase(System::GPS, "L5"), kPi / 2);
  EXPECT_DOUBLE_EQ(data_phase(System::Galileo, "E1"), kPi);
  EXPECT_DOUBLE_EQ(data_phase(System::Galileo, "E5a"), -kPi / 2);
  EXPECT_DOUBLE_EQ(data_phase(System::Galileo, "E5b"), -kPi / 2);
  EXPECT_DOUBLE_EQ(data_phase(System::BeiDou, "B1C"), -kPi / 2);
  EXPECT_DOUBLE_EQ(data_phase(System::BeiDou, "B2a"), -kPi / 2);
}

}  // namespace
}  // namespace canyon::samples::spreading_codes_test
