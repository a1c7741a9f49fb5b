// Declared in canyon/broadcast/messages.hpp.
#include <array>
#include <cmath>

#include "canyon/broadcast/bits.hpp"
#include "canyon/broadcast/messages.hpp"

namespace canyon::broadcast {

Bits sbas_message(const gnss::SbasEphemeris& e, int type, geodesy::GpsTime start) {
  constexpr std::array<std::uint64_t, 3> kPreambles{0x53, 0x9A, 0xC6};
  constexpr double kSecondsPerDay = 86400;
  const std::int64_t second = start.nanosecond_of_week() / geodesy::GpsTime::kNanosecondsPerSecond;
  Bits bits;
  bits.put(kPreambles[static_cast<std::size_t>(second % 3)], 8).count(type, 6);
  if (type == 9) {
    bits.count(e.iodn, 8).positive(std::fmod(e.toe.seconds_of_week(), kSecondsPerDay), 16, 13);
    bits.count(accuracy_index(e.accuracy_m), 4);
    bits.number(e.position_m[0], 0.08, 30).number(e.position_m[1], 0.08, 30).number(e.position_m[2], 0.4, 25);
    bits.number(e.velocity_mps[0], 0.000625, 17)
        .number(e.velocity_mps[1], 0.000625, 17)
        .number(e.velocity_mps[2], 0.004, 18);
    bits.number(e.acceleration_mps2[0], 0.0000125, 10)
        .number(e.acceleration_mps2[1], 0.0000125, 10)
        .number(e.acceleration_mps2[2], 0.0000625, 10);
    bits.number(e.clock_bias_s, 0x1p-31, 12).number(e.clock_drift, 0x1p-40, 8);
  } else {
    for (int part = 0; part < 4; ++part) bits.put(0, 53);
  }
  return bits.put(crc24q(bits), 24);
}

}  // namespace canyon::broadcast
