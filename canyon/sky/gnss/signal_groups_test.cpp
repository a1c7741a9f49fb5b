#include "canyon/sky/gnss/signal_groups.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::gnss {
namespace {

const Signal& signal_of(System system, std::string_view name) {
  for (const Signal& signal : signals_of(system)) {
    if (signal.name == name) return signal;
  }
  throw std::logic_error("no such signal");
}

geodesy::GpsTime year(int year) {
  geodesy::CalendarTime day;
  day.year = year;
  day.month = day.day = 1;
  return geodesy::gps_from_calendar(day);
}

// PRN 5 is a block IIR-M of 2009, 14 a IIR until 2020 and then a III (GPS constellation status); C03 is
// geostationary, C08 inclined, C14 and C21 in medium orbits (CSNO's constellation list).
TEST(SignalGroups, AreSystemsSignalsBlocksAndOrbits) {
  const Signal &l1 = signal_of(System::GPS, "L1CA"), &l2 = signal_of(System::GPS, "L2C");
  const Signal& b1 = signal_of(System::BeiDou, "B1I");
  const SatelliteId g05{System::GPS, 5}, g14{System::GPS, 14};
  const auto c = [](std::uint8_t n) { return SatelliteId{System::BeiDou, n}; };
  EXPECT_TRUE(in_group("GPS", g05, l1, year(2024)));
  EXPECT_FALSE(in_group("BeiDou", g05, l1, year(2024)));
  EXPECT_TRUE(in_group("L2C", g05, l2, year(2024)));
  EXPECT_FALSE(in_group("L2C", g05, l1, year(2024)));
  EXPECT_TRUE(in_group("GPS-IIRM", g05, l1, year(2024)));
  EXPECT_TRUE(in_group("GPS-IIR", g14, l1, year(2019)));
  EXPECT_TRUE(in_group("GPS-III", g14, l1, year(2024)));
  EXPECT_FALSE(in_group("GPS-IIR", g14, l1, year(2024)));
  for (const auto& [prn, orbit] : {std::pair(3, "BeiDou-GEO"),
                                   {60, "BeiDou-GEO"},
                                   {8, "BeiDou-IGSO"},
                                   {38, "BeiDou-IGSO"},
                                   {14, "BeiDou-MEO"},
                                   {21, "BeiDou-MEO"}}) {
    for (const char* other : {"BeiDou-GEO", "BeiDou-IGSO", "BeiDou-MEO"}) {
      EXPECT_EQ(in_group(other, c(static_cast<std::uint8_t>(prn)), b1, year(2024)),
                std::string(other) == orbit)
          << prn;
    }
  }
  EXPECT_TRUE(in_group("BeiDou-2&BeiDou-IGSO", c(8), b1, year(2024)));
  EXPECT_FALSE(in_group("BeiDou-2&BeiDou-IGSO", c(38), b1, year(2024)));
  EXPECT_TRUE(in_group("BeiDou-3 & BeiDou-IGSO & B1I", c(38), b1, year(2024)));
  const GroupValues values{{"BeiDou", 1}, {"B1I", 0.5}, {"BeiDou-GEO", -4}, {"L5", 7}};
  EXPECT_EQ(sum_of(values, c(21), b1, year(2024)), 1.5);
  EXPECT_EQ(sum_of(values, c(3), b1, year(2024)), -2.5);
  EXPECT_EQ(sum_of(values, g05, l1, year(2024)), 0);
}

TEST(SignalGroups, WrongNamesAreToldTheRightOnes) {
  for (const char* good : {"GPS", "E5a", "BeiDou-GEO", "GPS-III&L5"}) EXPECT_NO_THROW(check_group(good));
  for (const char* bad : {"", "GPS-IV", "gps", "GPS&", "GPS&Compass"}) {
    try {
      check_group(bad);
      ADD_FAILURE() << bad;
    } catch (const InputError& error) {
      EXPECT_THAT(error.hint(), testing::AllOf(testing::HasSubstr("GLONASS"), testing::HasSubstr("GPS-IIF")));
    }
  }
  EXPECT_NO_THROW(check_signals({"L1CA", "L5"}));
  EXPECT_THROW(check_signals({"L1CA", "L1CA"}), InputError);
  EXPECT_THROW(check_signals({"L1"}), InputError);
  for (const char* recorded : {"L2P", "G3", "G1a", "G2a", "E6", "E5", "B2", "L6"}) {
    EXPECT_NO_THROW(check_group(recorded));
    try {
      check_signals({recorded});
      ADD_FAILURE() << recorded;
    } catch (const InputError& error) {
      EXPECT_THAT(error.problem(), testing::StartsWith(std::string("no receiver here tracks ") + recorded));
    }
  }
}

}  // namespace
}  // namespace canyon::gnss
