#pragma once

#include <cmath>
#include <cstdint>
#include <ctime>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"

// The few functions of RTKLIB 2.4.3 b34 (librtklib-dev, which packages no header) used to check Canyon's
// orbits, and the layout of their structs. With a wrong layout broadcast_sky_rtklib_test.cpp would fail.
extern "C" {

struct RtklibTime {
  std::time_t time;  ///< whole seconds since 1970, on the scale of GPST
  double sec;        ///< fraction
};

// RTKLIB leaves these to the linking program; weak, since several files of one program include this header.
__attribute__((weak)) int showmsg(const char*, ...) {
  return 0;
}
__attribute__((weak)) void settspan(RtklibTime, RtklibTime) {}
__attribute__((weak)) void settime(RtklibTime) {}

/// Delays at L1 [m]. @param position latitude, longitude [rad], height [m]
double ionmodel(RtklibTime time, const double* alpha_beta, const double* position,
                const double* azimuth_elevation);
double tropmodel(RtklibTime time, const double* position, const double* azimuth_elevation, double humidity);

struct RtklibEphemeris {
  int sat;
  int iode, iodc;
  int sva, svh;
  int week, code, flag;
  RtklibTime toe, toc, ttr;
  double A, e, i0, OMG0, omg, M0, deln, OMGd, idot;
  double crc, crs, cuc, cus, cic, cis;
  double toes, fit;
  double f0, f1, f2;
  double tgd[6];
  double Adot, ndot;
};

struct RtklibGlonassEphemeris {
  int sat;
  int iode, frq;
  int svh, sva, age;
  RtklibTime toe, tof;
  double pos[3], vel[3], acc[3];
  double taun, gamn, dtaun;
};

struct RtklibSbasEphemeris {
  int sat;
  RtklibTime t0, tof;
  int sva, svh;
  double pos[3], vel[3], acc[3];
  double af0, af1;
};

/// The first fields of nav_t; the rest is only space written by RTKLIB.
struct RtklibNavigation {
  int n, nmax, ng, ngmax, ns, nsmax, ne, nemax, nc, ncmax, na, namax, nt, ntmax;
  RtklibEphemeris* eph;
  RtklibGlonassEphemeris* geph;
  RtklibSbasEphemeris* seph;
  char rest[32 << 20];
};

/// RTKLIB's number of a satellite; 0 if this build lacks the system.
int satno(int system, int prn);
void eph2pos(RtklibTime time, const RtklibEphemeris* eph, double* position_m, double* clock_s,
             double* variance);
void geph2pos(RtklibTime time, const RtklibGlonassEphemeris* eph, double* position_m, double* clock_s,
              double* variance);
void seph2pos(RtklibTime time, const RtklibSbasEphemeris* eph, double* position_m, double* clock_s,
              double* variance);
int readrnx(const char* file, int receiver, const char* options, void* observations,
            RtklibNavigation* navigation, void* station);
}

namespace canyon::test {

inline constexpr std::int64_t kUnixOfGpsEpoch = 315'964'800;  // 1980-01-06: `date -u -d 1980-01-06 +%s`

inline RtklibTime rtklib_time(geodesy::GpsTime t) {
  const std::int64_t s = t.nanoseconds() / geodesy::GpsTime::kNanosecondsPerSecond;  // after 1980
  return {static_cast<std::time_t>(s + kUnixOfGpsEpoch),
          static_cast<double>(t.nanoseconds() - s * geodesy::GpsTime::kNanosecondsPerSecond) * 1e-9};
}

inline geodesy::GpsTime gps_time(RtklibTime t) {
  return geodesy::GpsTime::from_nanoseconds(
      (t.time - kUnixOfGpsEpoch) * geodesy::GpsTime::kNanosecondsPerSecond + std::llround(t.sec * 1e9));
}

/// RTKLIB's number of a satellite; 0 if its build lacks the system.
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
