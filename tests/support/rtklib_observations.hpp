#pragma once

#include <cmath>
#include <cstdint>

#include "canyon/geodesy/gps_time.hpp"
#include "canyon/gnss/satellite_id.hpp"
#include "tests/support/rtklib.hpp"

namespace canyon::test {

/// obsd_t of Debian's build of RTKLIB 2.4.3 b34, which keeps eight frequencies. The tests that use it would
/// not agree with a wrong layout.
struct RtklibObservation {
  RtklibTime time;
  unsigned char sat, rcv;
  std::uint16_t snr[8];  ///< [0.001 dB-Hz]
  unsigned char lli[8], code[8];
  double phase[8], range[8];
  float doppler[8];
};
static_assert(sizeof(RtklibObservation) == 216);

/// obs_t; `data` is malloc()'s.
struct RtklibObservations {
  int n, nmax;
  RtklibObservation* data;
};

inline constexpr std::int64_t kUnixOfGpsEpoch = 315'964'800;  // 1980-01-06: `date -u -d 1980-01-06 +%s`

inline geodesy::GpsTime gps_time(RtklibTime t) {
  return geodesy::GpsTime::from_nanoseconds(
      (t.time - kUnixOfGpsEpoch) * geodesy::GpsTime::kNanosecondsPerSecond + std::llround(t.sec * 1e9));
}

/// RTKLIB's number of a satellite; 0 where its build leaves the system out.
inline int rtklib_satellite(gnss::SatelliteId id) {
  switch (id.system) {
    case gnss::System::GPS:
      return satno(0x01, id.number);
    case gnss::System::GLONASS:
      return satno(0x04, id.number);
    case gnss::System::Galileo:
      return satno(0x08, id.number);
    case gnss::System::QZSS:
      return satno(0x10, id.number + 192);
    case gnss::System::BeiDou:
      return satno(0x20, id.number);
    case gnss::System::SBAS:
      return satno(0x02, id.number + 100);
  }
  return 0;
}

}  // namespace canyon::test
