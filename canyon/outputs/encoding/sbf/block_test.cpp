#include "canyon/outputs/encoding/sbf/block.hpp"

#include <gtest/gtest.h>

#include <map>

#include "canyon/base/geodesy/time_scales.hpp"

namespace canyon::encoding::sbf {
namespace {

using gnss::System;

std::uint32_t number(std::string_view bytes, std::size_t at, std::size_t size) {
  std::uint32_t value = 0;
  for (std::size_t i = size; i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

// The check value of CRC-16/XMODEM, which has this polynomial and seed.
TEST(SbfBlock, ChecksBytesByTheirCrc) {
  EXPECT_EQ(crc16("123456789"), 0x31C3);
}

TEST(SbfBlock, HasAHeaderAndAMultipleOfFourBytes) {
  const geodesy::GpsTime time = geodesy::GpsTime::from_week(2408, 36505.25);
  const std::string bytes = block({4007, 2}, time, "abc");
  ASSERT_EQ(bytes.size(), 20U);
  EXPECT_EQ(bytes.substr(0, 2), "$@");
  EXPECT_EQ(number(bytes, 2, 2), crc16(std::string_view(bytes).substr(4)));
  EXPECT_EQ(number(bytes, 4, 2), 4007U | 2U << 13U);
  EXPECT_EQ(number(bytes, 6, 2), 20U);
  EXPECT_EQ(number(bytes, 8, 4), 36'505'250U);
  EXPECT_EQ(number(bytes, 12, 2), 2408U);
  EXPECT_EQ(bytes.substr(14), std::string("abc\0\0\0", 6));
  const std::string unknown = block({5921}, std::nullopt, "");
  EXPECT_EQ(number(unknown, 8, 4), 0xFFFFFFFFU);
  EXPECT_EQ(number(unknown, 12, 2), 0xFFFFU);
}

// PolaRx5TR Reference Guide, 4.1.9.
TEST(SbfBlock, NumbersSatellites) {
  const auto of = [](System system, int number) {
    return satellite_number({system, static_cast<std::uint8_t>(number)}).value_or(0);
  };
  EXPECT_EQ(of(System::GPS, 1), 1);
  EXPECT_EQ(of(System::GLONASS, 24), 61);
  EXPECT_EQ(of(System::GLONASS, 25), 63);
  EXPECT_EQ(of(System::Galileo, 36), 106);
  EXPECT_EQ(of(System::SBAS, 20), 120);
  EXPECT_EQ(of(System::SBAS, 41), 198);
  EXPECT_EQ(of(System::BeiDou, 1), 141);
  EXPECT_EQ(of(System::BeiDou, 41), 223);
  EXPECT_EQ(of(System::QZSS, 1), 181);
  EXPECT_FALSE(satellite_number({System::GLONASS, 31}));
}

// Each signal of a satellite has its own bits.
TEST(SbfBlock, PlacesSignalsOfAStatusField) {
  for (const System system : gnss::kAllSystems) {
    std::map<int, std::string_view> indices;
    for (const gnss::Signal& signal : gnss::signals_of(system)) {
      if (!signal.only_recorded.empty()) continue;
      const auto position = status_bit_offset(signal);
      ASSERT_TRUE(position) << signal.name;
      EXPECT_TRUE(indices.emplace(*position, signal.name).second) << signal.name;
    }
  }
}

}  // namespace
}  // namespace canyon::encoding::sbf
