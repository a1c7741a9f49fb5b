#include "canyon/sky/gnss/broadcast_messages.hpp"

#include <algorithm>

namespace canyon::gnss {

bool is_galileo_fnav(const KeplerEphemeris& e) {
  if (e.id.system != System::Galileo) return false;
  const bool fnav_clock = (e.data_sources & (1 << 8)) != 0;
  const bool inav_clock = (e.data_sources & (1 << 9)) != 0;
  if (fnav_clock != inav_clock) return fnav_clock;
  return (e.data_sources & 0b111) == 0b010;
}

bool is_beidou_geo(SatelliteId id) {
  return id.system == System::BeiDou && (id.number <= 5 || (id.number >= 59 && id.number <= 63));
}

bool is_healthy(const KeplerEphemeris& e) {
  switch (e.id.system) {
    case System::QZSS:
      return (e.health & 0x30) == 0;
    case System::Galileo: {
      const bool knows_e1 = !is_galileo_fnav(e) || (e.data_sources & 0b101) != 0;
      return (e.health & (knows_e1 ? 0b111 : 0b111111)) == 0 && e.accuracy_m >= 0;
    }
    case System::GPS:
    case System::GLONASS:
    case System::BeiDou:
    case System::SBAS:
      break;
  }
  return e.health == 0;
}

bool is_healthy(const GlonassEphemeris& e) {
  return e.health == 0;
}

bool is_healthy(const SbasEphemeris& e) {
  return (e.health & 0b110001) == 0;
}

Validity validity(const KeplerEphemeris& e) {
  constexpr double kHour = 3600;
  // IS-GPS-200 table 20-XII: the longest fit interval is 146 h.
  constexpr double kLongestFit = 146;
  switch (e.id.system) {
    case System::Galileo:
      return {0.5 * kHour, 4 * kHour};
    case System::BeiDou:
      return {1 * kHour, 3 * kHour};
    case System::GPS:
    case System::QZSS:
    case System::GLONASS:
    case System::SBAS:
      break;
  }
  const double half_fit = std::clamp(e.fit_interval_h / 2, 2.0, kLongestFit / 2) * kHour;
  return {half_fit, half_fit};
}

Validity validity(const GlonassEphemeris&) {
  return {1800, 1800};
}

Validity validity(const SbasEphemeris&) {
  return {360, 360};
}

}  // namespace canyon::gnss
