#include "canyon/sky/gnss/satellite_id.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "canyon/base/input_error.hpp"

namespace canyon::gnss {
namespace {

TEST(SatelliteId, PrintsAsRinex3Does) {
  EXPECT_EQ(to_string({System::GPS, 5}), "G05");
  EXPECT_EQ(to_string({System::GLONASS, 24}), "R24");
  EXPECT_EQ(to_string({System::Galileo, 36}), "E36");
  EXPECT_EQ(to_string({System::BeiDou, 59}), "C59");
  EXPECT_EQ(to_string({System::QZSS, 2}), "J02");
  EXPECT_EQ(to_string({System::SBAS, 23}), "S23");
}

TEST(SatelliteId, EveryNameIsReadBack) {
  for (const System system : kAllSystems) {
    EXPECT_EQ(system_from_letter(letter(system)), system);
    EXPECT_EQ(system_from_name(name(system)), system);
    for (int number = 1; number < 100; ++number) {
      const SatelliteId id{system, static_cast<std::uint8_t>(number)};
      EXPECT_EQ(parse_satellite(to_string(id)), id);
    }
  }
}

TEST(SatelliteId, LooserSpellingsAreRead) {
  const SatelliteId g05{System::GPS, 5};
  for (const char* text : {"G05", "G 5", "g5", "G5", " G05 "}) EXPECT_EQ(parse_satellite(text), g05) << text;
}

TEST(SatelliteId, AnythingElseIsNone) {
  for (const char* text : {"", "G", "G0", "G00", "05", "I03", "G5x", "G-1", "G100", "G  ", "GG5", "G5 5"}) {
    EXPECT_EQ(parse_satellite(text), std::nullopt) << text;
  }
  EXPECT_EQ(system_from_letter('I'), std::nullopt);
  EXPECT_EQ(parse_satellite("Q02"), (SatelliteId{System::QZSS, 2}));
  EXPECT_EQ(system_from_letter('g'), std::nullopt);
}

// A solution has a clock for each constellation, by its index in the enumeration; SBAS has none of its own.
TEST(SatelliteId, SbasHasTheClockOfGps) {
  for (std::size_t i = 0; i < kConstellations.size(); ++i) {
    EXPECT_EQ(static_cast<std::size_t>(kConstellations[i]), i);
    EXPECT_EQ(clock_system(kConstellations[i]), kConstellations[i]);
  }
  EXPECT_EQ(clock_system(System::SBAS), System::GPS);
  EXPECT_EQ(kAllSystems.size(), kConstellations.size() + 1);
}

TEST(SatelliteId, OrdersBySystemThenNumber) {
  const std::set<SatelliteId> ids{{System::QZSS, 1},    {System::GPS, 32},    {System::BeiDou, 3},
                                  {System::Galileo, 1}, {System::GLONASS, 2}, {System::GPS, 4}};
  std::string order;
  for (const SatelliteId id : ids) order += to_string(id);
  EXPECT_EQ(order, "G04G32R02E01C03J01");
}

TEST(SatelliteId, SystemNamesAreForgivingAndHelpful) {
  EXPECT_EQ(system_from_name("beidou"), System::BeiDou);
  EXPECT_EQ(system_from_name("GALILEO"), System::Galileo);
  try {
    (void)system_from_name("Galilo");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("did you mean 'Galileo'?"));
    EXPECT_THAT(error.what(), testing::HasSubstr("GPS, GLONASS, Galileo, BeiDou, QZSS"));
  }
}

TEST(SatelliteId, CarriersAreThoseOfTheIcds) {
  EXPECT_DOUBLE_EQ(l1_frequency_hz(System::GPS), 1575.42e6);
  EXPECT_DOUBLE_EQ(l1_frequency_hz(System::Galileo), 1575.42e6);
  EXPECT_DOUBLE_EQ(l1_frequency_hz(System::QZSS), 1575.42e6);
  EXPECT_DOUBLE_EQ(l1_frequency_hz(System::BeiDou), 1561.098e6);
  // ICD GLONASS L1, L2, table 3.1.
  EXPECT_DOUBLE_EQ(l1_frequency_hz(System::GLONASS, -7), 1598.0625e6);
  EXPECT_DOUBLE_EQ(l1_frequency_hz(System::GLONASS, 6), 1605.375e6);
}

}  // namespace
}  // namespace canyon::gnss
