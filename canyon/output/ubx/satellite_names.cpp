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
  const int number = gnss::is_beidou_geo(id) && signal.ubx_geo >= 0 ? signal.ubx_geo : signal.ubx;
  if (number < 0) return std::nullopt;
  return static_cast<std::uint8_t>(number);
}

std::uint8_t message_signal(gnss::SatelliteId id) {
  return id.system == System::Galileo || gnss::is_beidou_geo(id) ? 1 : 0;
}

}  // namespace canyon::output::ubx
