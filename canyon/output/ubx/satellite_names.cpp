#include "canyon/output/ubx/satellite_names.hpp"

#include "canyon/gnss/broadcast_messages.hpp"

namespace canyon::output::ubx {

using gnss::System;

std::optional<SatelliteName> satellite_name(gnss::SatelliteId id) {
  const auto within = [&](std::uint8_t gnss, int last, int offset = 0) -> std::optional<SatelliteName> {
    if (id.number < 1 || id.number > last) return std::nullopt;
    return SatelliteName{gnss, static_cast<std::uint8_t>(id.number + offset)};
  };
  switch (id.system) {
    case System::GPS:
      return within(0, 32);
    case System::SBAS:
      return id.number < 20 ? std::nullopt : within(1, 58, 100);
    case System::Galileo:
      return within(2, 36);
    case System::BeiDou:
      return within(3, 63);
    case System::QZSS:
      return within(5, 10);
    case System::GLONASS:
      return within(6, 32);
  }
  return std::nullopt;
}

std::optional<std::uint8_t> signal_number(gnss::SatelliteId id, const gnss::Signal& signal) {
  struct Number {
    System system;
    std::string_view name;
    std::uint8_t number;
  };
  constexpr Number kNumbers[]{
      {System::GPS, "L1CA", 0},    {System::GPS, "L2C", 3},    {System::GPS, "L5", 7},
      {System::SBAS, "L1CA", 0},   {System::Galileo, "E1", 0}, {System::Galileo, "E5a", 4},
      {System::Galileo, "E5b", 6}, {System::BeiDou, "B1I", 0}, {System::BeiDou, "B1C", 5},
      {System::BeiDou, "B2I", 2},  {System::BeiDou, "B2a", 7}, {System::BeiDou, "B3I", 4},
      {System::QZSS, "L1CA", 0},   {System::QZSS, "L2C", 5},   {System::QZSS, "L5", 9},
      {System::GLONASS, "G1", 0},  {System::GLONASS, "G2", 2},
  };
  for (const Number& known : kNumbers) {
    if (known.system != signal.system || known.name != signal.name) continue;
    // Signals with D2 have numbers of their own: B1I, B2I, B3I of geostationary satellites.
    if (!gnss::is_beidou_geo(id) || known.number >= 5) return known.number;
    return static_cast<std::uint8_t>(known.number == 4 ? 10 : known.number + 1);
  }
  return std::nullopt;
}

std::uint8_t message_signal(gnss::SatelliteId id) {
  return id.system == System::Galileo || gnss::is_beidou_geo(id) ? 1 : 0;
}

}  // namespace canyon::output::ubx
