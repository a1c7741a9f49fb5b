#include "canyon/sky/gnss/signals.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "canyon/base/geodesy/time_scales.hpp"

namespace canyon::gnss {
namespace {

geodesy::GpsTime day(int year, int month, int day) {
  geodesy::CalendarTime time;
  time.year = year;
  time.month = month;
  time.day = day;
  return geodesy::gps_from_calendar(time);
}

const Signal& named(System system, std::string_view name) {
  for (const Signal& signal : signals_of(system)) {
    if (signal.name == name) return signal;
  }
  ADD_FAILURE() << name;
  return signals_of(system).front();
}

TEST(Signals, AreOneOfEachNameAndCode) {
  for (const System system : kAllSystems) {
    std::set<std::string_view> names, codes;
    std::set<int> masks, numbers;
    const auto signals = signals_of(system);
    ASSERT_LE(signals.size(), kMaxSignals);
    EXPECT_EQ(signals.front().carrier_hz, l1_frequency_hz(system));
    for (std::size_t i = 0; i < signals.size(); ++i) {
      EXPECT_EQ(index_of(signals[i]), i);
      EXPECT_EQ(signals[i].system, system);
      EXPECT_TRUE(names.insert(signals[i].name).second) << signals[i].name;
      EXPECT_TRUE(codes.insert(signals[i].code).second) << signals[i].name;
      EXPECT_TRUE(signals[i].msm == 0 || masks.insert(signals[i].msm).second) << signals[i].name;
      EXPECT_TRUE(signals[i].ubx < 0 || numbers.insert(signals[i].ubx).second) << signals[i].name;
      EXPECT_TRUE(signals[i].ubx_geo < 0 || numbers.insert(signals[i].ubx_geo).second) << signals[i].name;
      EXPECT_LT(signals[i].minimum_dbw, -150);
      EXPECT_GT(signals[i].minimum_dbw, -170);
    }
  }
}

// RINEX 3.04, tables 4 (GPS), 5 (GLONASS), 6 (Galileo), 8 (QZSS) and 9 (BeiDou): the tracked channel, X for
// data and pilot together.
TEST(Signals, HaveTheCodesOfWhatIsTracked) {
  struct Row {
    System system;
    const char *name, *code;
  };
  const Row rows[]{
      {System::GPS, "L1CA", "1C"},    {System::GPS, "L1C", "1L"},     {System::GPS, "L2C", "2L"},
      {System::GPS, "L5", "5Q"},      {System::GPS, "L2P", "2W"},     {System::QZSS, "L1CA", "1C"},
      {System::QZSS, "L1C", "1L"},    {System::QZSS, "L2C", "2L"},    {System::QZSS, "L5", "5Q"},
      {System::GLONASS, "G1", "1C"},  {System::GLONASS, "G2", "2C"},  {System::Galileo, "E1", "1X"},
      {System::Galileo, "E5a", "5X"}, {System::Galileo, "E5b", "7X"}, {System::BeiDou, "B1I", "2I"},
      {System::BeiDou, "B1C", "1P"},  {System::BeiDou, "B2I", "7I"},  {System::BeiDou, "B2a", "5P"},
      {System::BeiDou, "B3I", "6I"},  {System::BeiDou, "B2b", "7D"},  {System::SBAS, "L1CA", "1C"},
      {System::GLONASS, "G3", "3Q"},  {System::GLONASS, "G1a", "4B"}, {System::GLONASS, "G2a", "6B"},
      {System::Galileo, "E6", "6X"},  {System::Galileo, "E5", "8X"},  {System::BeiDou, "B2", "8P"},
      {System::SBAS, "L5", "5I"},     {System::QZSS, "L6", "6L"},
  };
  std::size_t signals = 0;
  for (const System system : kAllSystems) signals += signals_of(system).size();
  EXPECT_EQ(std::size(rows), signals);
  for (const Row& row : rows) EXPECT_EQ(named(row.system, row.name).code, row.code) << row.name;
}

// RTCM 10403.3, tables 3.5-91 (GPS), -96 (GLONASS), -99 (Galileo), -102 (SBAS), -105 (QZSS), -108 with
// amendment 1 (BeiDou), by the RINEX code of the tracked component; UBX-22008968, 1.5.4, if available.
TEST(Signals, HaveTheNumbersOfRtcmAndUbx) {
  struct Row {
    System system;
    const char* code;
    int msm, ubx, ubx_geo;
  };
  const Row rows[]{
      {System::GPS, "1C", 2, 0, -1},       {System::GPS, "1L", 31, -1, -1},
      {System::GPS, "2L", 16, 3, -1},      {System::GPS, "5Q", 23, 7, -1},
      {System::GPS, "2W", 10, -1, -1},     {System::QZSS, "1C", 2, 0, -1},
      {System::QZSS, "1L", 31, -1, -1},    {System::QZSS, "2L", 16, 5, -1},
      {System::QZSS, "5Q", 23, 9, -1},     {System::GLONASS, "1C", 2, 0, -1},
      {System::GLONASS, "2C", 8, 2, -1},   {System::Galileo, "1X", 5, 0, -1},
      {System::Galileo, "5X", 24, 4, -1},  {System::Galileo, "7X", 16, 6, -1},
      {System::BeiDou, "2I", 2, 0, 1},     {System::BeiDou, "1P", 31, 5, -1},
      {System::BeiDou, "7I", 14, 2, 3},    {System::BeiDou, "5P", 23, 7, -1},
      {System::BeiDou, "6I", 8, 4, 10},    {System::BeiDou, "7D", 25, -1, -1},
      {System::SBAS, "1C", 2, 0, -1},      {System::SBAS, "5I", 22, -1, -1},
      {System::Galileo, "6X", 11, -1, -1}, {System::Galileo, "8X", 20, -1, -1},
      {System::QZSS, "6L", 10, -1, -1},    {System::BeiDou, "8P", 0, -1, -1},
      {System::GLONASS, "3Q", 0, -1, -1},  {System::GLONASS, "4B", 0, -1, -1},
      {System::GLONASS, "6B", 0, -1, -1},
  };
  std::size_t signals = 0;
  for (const System system : kAllSystems) signals += signals_of(system).size();
  EXPECT_EQ(std::size(rows), signals);
  for (const Row& row : rows) {
    const auto all = signals_of(row.system);
    const auto at = std::find_if(all.begin(), all.end(), [&](const Signal& s) { return s.code == row.code; });
    ASSERT_NE(at, all.end()) << row.code;
    EXPECT_EQ(at->msm, row.msm) << at->name;
    EXPECT_EQ(at->ubx, row.ubx) << at->name;
    EXPECT_EQ(at->ubx_geo, row.ubx_geo) << at->name;
  }
}

// Multiples of 10.23 MHz of the interface documents.
TEST(Signals, HaveTheCarriersOfTheInterfaceDocuments) {
  const double f0 = 10.23e6;
  for (const System system : {System::GPS, System::QZSS}) {
    EXPECT_EQ(named(system, "L1C").carrier_hz, 154 * f0);
    EXPECT_EQ(named(system, "L2C").carrier_hz, 120 * f0);
    EXPECT_EQ(named(system, "L5").carrier_hz, 115 * f0);
  }
  EXPECT_EQ(named(System::SBAS, "L1CA").carrier_hz, 154 * f0);
  EXPECT_EQ(named(System::Galileo, "E5a").carrier_hz, 115 * f0);
  EXPECT_EQ(named(System::Galileo, "E5b").carrier_hz, 118 * f0);
  EXPECT_NEAR(named(System::BeiDou, "B1I").carrier_hz, 152.6 * f0, 1e-3);
  EXPECT_EQ(named(System::BeiDou, "B2I").carrier_hz, 118 * f0);
  EXPECT_EQ(named(System::BeiDou, "B3I").carrier_hz, 124 * f0);
  EXPECT_EQ(named(System::BeiDou, "B2b").carrier_hz, 118 * f0);
  EXPECT_EQ(named(System::BeiDou, "B2").carrier_hz, 116.5 * f0);
  EXPECT_EQ(named(System::Galileo, "E5").carrier_hz, 116.5 * f0);
  EXPECT_EQ(named(System::Galileo, "E6").carrier_hz, 125 * f0);
  EXPECT_EQ(named(System::QZSS, "L6").carrier_hz, 125 * f0);
  EXPECT_EQ(named(System::SBAS, "L5").carrier_hz, 115 * f0);
  const double f1 = 1.023e6;  // GLONASS's signals of code division: 1565, 1220, 1175
  EXPECT_NEAR(named(System::GLONASS, "G1a").carrier_hz, 1565 * f1, 1e-3);
  EXPECT_NEAR(named(System::GLONASS, "G2a").carrier_hz, 1220 * f1, 1e-3);
  EXPECT_NEAR(named(System::GLONASS, "G3").carrier_hz, 1175 * f1, 1e-3);
}

TEST(Signals, FollowTheFrequencyChannelOfGlonass) {
  for (int channel = -7; channel <= 6; ++channel) {
    const double l1 = l1_frequency_hz(System::GLONASS, channel);
    EXPECT_EQ(carrier_hz(named(System::GLONASS, "G1"), l1), l1);
    // 7 / 9 of the carrier near L1 (ICD GLONASS 3.3.1.1).
    EXPECT_NEAR(carrier_hz(named(System::GLONASS, "G2"), l1), l1 * 7 / 9, 1e-3);
    EXPECT_EQ(carrier_hz(named(System::GLONASS, "G3"), l1), 1202.025e6) << "code division: one carrier";
  }
}

// SatelliteBlock IIR sends only C/A, IIR-M also L2C, IIF also L5, III also L1C (IS-GPS-200, -705, -800).
TEST(Transmits, FollowsTheBlocksOfGps) {
  const auto sends = [](int prn, std::string_view name, geodesy::GpsTime time) {
    return transmits({System::GPS, static_cast<std::uint8_t>(prn)}, named(System::GPS, name), time);
  };
  const geodesy::GpsTime now = day(2024, 6, 1);
  for (int prn = 1; prn <= 32; ++prn) EXPECT_TRUE(sends(prn, "L1CA", now));
  EXPECT_FALSE(sends(2, "L2C", now));  // SVN 61, IIR
  EXPECT_TRUE(sends(5, "L2C", now));   // SVN 50, IIR-M
  EXPECT_FALSE(sends(5, "L5", now));
  EXPECT_TRUE(sends(25, "L5", now));  // SVN 62, the first IIF
  EXPECT_FALSE(sends(25, "L1C", now));
  EXPECT_TRUE(sends(4, "L1C", now));  // SVN 74, the first III
  EXPECT_FALSE(sends(14, "L2C", day(2019, 4, 28)));
  EXPECT_TRUE(sends(14, "L1C", now));
  int l2c = 0, l5 = 0;
  for (int prn = 1; prn <= 32; ++prn) {
    l2c += sends(prn, "L2C", now);
    l5 += sends(prn, "L5", now);
  }
  // 7 IIR-M, 12 IIF, 6 III.
  EXPECT_EQ(l2c, 25);
  EXPECT_EQ(l5, 18);
  EXPECT_TRUE(sends(33, "L1C", now));  // not in the table: as the newest
}

TEST(Transmits, TellsBeiDou2From3) {
  const geodesy::GpsTime now = day(2024, 6, 1);
  const auto sends = [&](int prn, std::string_view name) {
    return transmits({System::BeiDou, static_cast<std::uint8_t>(prn)}, named(System::BeiDou, name), now);
  };
  EXPECT_TRUE(sends(6, "B2I"));
  EXPECT_FALSE(sends(6, "B1C"));
  EXPECT_FALSE(sends(27, "B2I"));
  EXPECT_TRUE(sends(27, "B2a"));
  EXPECT_TRUE(sends(6, "B3I") && sends(27, "B3I"));
  EXPECT_TRUE(sends(27, "B2b"));
  EXPECT_FALSE(sends(6, "B2b"));
  EXPECT_FALSE(sends(60, "B2b")) << "geostationary: PPP-B2b";
}

TEST(Transmits, EverySignalIsSentByABlockAndEveryBlockSendsTheFirst) {
  const geodesy::GpsTime now = day(2024, 6, 1);
  std::set<std::string_view> blocks;
  for (const System system : kAllSystems) {
    for (const Signal& signal : signals_of(system)) {
      int senders = 0;
      for (std::uint8_t number = 1; number <= 63; ++number) {
        const SatelliteId id{system, number};
        const bool sends = transmits(id, signal, now);
        senders += sends;
        EXPECT_TRUE(sends || index_of(signal) > 0) << to_string(id);
        blocks.insert(block_of(id, now));
      }
      EXPECT_GT(senders, 0) << signal.name;
    }
  }
  blocks.erase("");
  const auto names = block_names();
  EXPECT_EQ(blocks, (std::set<std::string_view>{names.begin(), names.end()}));
}

double ionosphere_free(double f1, double d1, double f2, double d2) {
  return (f1 * f1 * d1 - f2 * f2 * d2) / (f1 * f1 - f2 * f2);
}

// A broadcast clock refers to an ionosphere-free pair: its group delays cancel (IS-GPS-200 20.3.3.3.3.3; OS
// SIS ICD 5.1.5, E1/E5b for I/NAV and E1/E5a for F/NAV).
TEST(GroupDelays, CancelInThePairThatTheClockBelongsTo) {
  KeplerEphemeris e;
  e.id = {System::GPS, 5};
  e.group_delay = {-1.1e-8, 0};
  const auto gps = group_delays_s(e, false);
  const auto l1 = signals_of(System::GPS)[0].carrier_hz, l2 = named(System::GPS, "L2C").carrier_hz;
  EXPECT_EQ(gps[0], -1.1e-8);
  EXPECT_NEAR(ionosphere_free(l1, gps[0], l2, gps[2]), 0, 1e-20);

  e.id = {System::Galileo, 11};
  e.group_delay = {4e-9, 5e-9};
  const double e1 = signals_of(System::Galileo)[0].carrier_hz, e5a = named(System::Galileo, "E5a").carrier_hz,
               e5b = named(System::Galileo, "E5b").carrier_hz;
  const auto inav = group_delays_s(e, false), fnav = group_delays_s(e, true);
  EXPECT_EQ(inav[0], 5e-9);
  EXPECT_EQ(fnav[0], 4e-9);
  EXPECT_NEAR(ionosphere_free(e1, inav[0], e5b, inav[2]), 0, 1e-20);
  EXPECT_NEAR(ionosphere_free(e1, fnav[0], e5a, fnav[1]), 0, 1e-20);
  // The difference of two signals belongs to the satellite, independent of the message with the clock.
  EXPECT_NEAR(inav[1] - inav[0], fnav[1] - fnav[0], 1e-20);
  EXPECT_NEAR(inav[2] - inav[0], fnav[2] - fnav[0], 1e-20);

  e.id = {System::BeiDou, 27};
  const auto beidou = group_delays_s(e, false);
  EXPECT_EQ(beidou[index_of(named(System::BeiDou, "B1I"))], 4e-9);
  EXPECT_EQ(beidou[index_of(named(System::BeiDou, "B2I"))], 5e-9);
  EXPECT_EQ(beidou[index_of(named(System::BeiDou, "B3I"))], 0);
}

}  // namespace
}  // namespace canyon::gnss
