// Declared in canyon/output/ubx/messages.hpp.
#include "canyon/output/ubx/messages.hpp"

#include <span>

#include "canyon/gnss/broadcast_messages.hpp"

namespace canyon::output::ubx {

using gnss::System;

namespace {

/// Numbers from `first` to `last` of a system, moved by `offset`.
struct Range {
  System system;
  std::uint8_t gnss;
  int first, last, offset;
};

std::optional<SatelliteName> name_in(std::span<const Range> ranges, gnss::SatelliteId id) {
  for (const Range& r : ranges) {
    if (id.system == r.system && id.number >= r.first && id.number <= r.last) {
      return SatelliteName{r.gnss, static_cast<std::uint8_t>(id.number + r.offset)};
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<SatelliteName> satellite_name(gnss::SatelliteId id) {
  static constexpr Range kRanges[]{{System::GPS, 0, 1, 32, 0},     {System::SBAS, 1, 20, 58, 100},
                                   {System::Galileo, 2, 1, 36, 0}, {System::BeiDou, 3, 1, 63, 0},
                                   {System::QZSS, 5, 1, 10, 0},    {System::GLONASS, 6, 1, 32, 0}};
  return name_in(kRanges, id);
}

int single_number(gnss::SatelliteId id) {
  static constexpr Range kRanges[]{{System::GPS, 0, 1, 32, 0},       {System::SBAS, 1, 20, 58, 100},
                                   {System::Galileo, 2, 1, 36, 210}, {System::BeiDou, 3, 1, 5, 158},
                                   {System::BeiDou, 3, 6, 37, 27},   {System::QZSS, 5, 1, 10, 192},
                                   {System::GLONASS, 6, 1, 32, 64}};
  return name_in(kRanges, id).value_or(SatelliteName{}).satellite;
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
