#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/read_report.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"

namespace canyon::gnss {

/// Keplerian broadcast ephemeris of GPS, QZSS, Galileo or BeiDou, in the units of the ICDs turned to SI and
/// radians as RINEX writes them. All times are GPST.
struct KeplerEphemeris {
  SatelliteId id;
  geodesy::GpsTime toc;              ///< clock reference
  geodesy::GpsTime toe;              ///< orbit reference
  geodesy::GpsTime transmission;     ///< when the message was sent; toe where the file does not say
  double af0 = 0, af1 = 0, af2 = 0;  ///< clock [s, s/s, s/s^2]
  double sqrt_a = 0;                 ///< [sqrt(m)]
  double eccentricity = 0;
  double inclination = 0;                     ///< i0 [rad]
  double inclination_rate = 0;                ///< IDOT [rad/s]
  double right_ascension = 0;                 ///< OMEGA0 [rad]
  double right_ascension_rate = 0;            ///< OMEGA DOT [rad/s]
  double argument_of_perigee = 0;             ///< omega [rad]
  double mean_anomaly = 0;                    ///< M0 [rad]
  double mean_motion_difference = 0;          ///< delta n [rad/s]
  double cuc = 0, cus = 0, cic = 0, cis = 0;  ///< [rad]
  double crc = 0, crs = 0;                    ///< [m]
  /// GPS, QZSS: TGD; Galileo: BGD E5a/E1 then BGD E5b/E1; BeiDou: TGD1 (B1/B3) then TGD2 (B2/B3) [s].
  std::array<double, 2> group_delay{};
  int iode = 0;               ///< IODE; IODnav; AODE
  int iodc = 0;               ///< IODC; -; AODC
  int health = 0;             ///< as broadcast; 0 is healthy
  double accuracy_m = 0;      ///< SV accuracy / SISA as RINEX gives it; negative: no prediction
  double fit_interval_h = 0;  ///< GPS, QZSS; 0: not given
  int data_sources = 0;       ///< Galileo: bits of I/NAV (0, 2, 9) and F/NAV (1, 8); GPS: codes on L2
  int l2p_flag = 0;           ///< GPS
  int source = 0;             ///< index into NavigationData::sources
  int line = 0;               ///< in its file; 0: not of a file
};

/// GLONASS broadcast ephemeris (PZ-90.11, taken as WGS 84: the difference is centimetres).
struct GlonassEphemeris {
  SatelliteId id;
  geodesy::GpsTime toe;           ///< tb
  geodesy::GpsTime transmission;  ///< message frame time tk
  double clock_bias_s = 0;        ///< -TauN
  double frequency_bias = 0;      ///< +GammaN
  std::array<double, 3> position_m{};
  std::array<double, 3> velocity_mps{};
  std::array<double, 3> acceleration_mps2{};  ///< luni-solar
  int health = 0;                             ///< 0 is healthy
  int channel = 0;                            ///< frequency number, -7 to 13
  double age_days = 0;
  double group_delay_difference_s = 0;  ///< delta tau n, L2 minus L1; 0 where the file does not say
  int source = 0;
  int line = 0;  ///< in its file; 0: not of a file
};

/// Navigation message of a geostationary SBAS satellite (message 9, RTCA DO-229 A.4.4.11); WGS 84, GPST.
struct SbasEphemeris {
  SatelliteId id;
  geodesy::GpsTime toe;           ///< t0, of orbit and clock
  geodesy::GpsTime transmission;  ///< toe where the file does not say
  double clock_bias_s = 0;        ///< aGf0, against SBAS network time
  double clock_drift = 0;         ///< aGf1
  std::array<double, 3> position_m{};
  std::array<double, 3> velocity_mps{};
  std::array<double, 3> acceleration_mps2{};
  int health = 0;         ///< bits as RINEX has them; 0 is healthy
  double accuracy_m = 0;  ///< URA
  int iodn = 0;           ///< issue of data
  int source = 0;
  int line = 0;  ///< in its file; 0: not of a file
};

/// Room for the signals of one system; the tables of signals.cpp assert that they have it.
inline constexpr std::size_t kMostSignals = 8;

/// Group delays that a newer message gives for signals [s], in the order of signals_of(); NaN: left blank;
/// infinity: no such field. GPS, QZSS CNAV, CNAV-2: TGD less inter-signal correction
/// (IS-GPS-200 30.3.3.3.1.1, IS-GPS-705 20.3.3.3.1.2, IS-GPS-800 3.5.3.9); BeiDou B-CNAV1 and 2: TGD of the
/// pilots of B1C and B2a (BDS-SIS-ICD-B1C-1.0 7.6.2), B-CNAV3: of B2b's I component (BDS-SIS-ICD-B2b-1.0).
struct SignalDelays {
  SatelliteId id;
  geodesy::GpsTime toc;
  std::array<double, kMostSignals> group_delay_s{};
};

/// Klobuchar coefficients of a system (GPS: GPSA/GPSB, BeiDou: BDSA/BDSB, QZSS: QZSA/QZSB).
struct Klobuchar {
  std::array<double, 4> alpha{};
  std::array<double, 4> beta{};
};

/// Content of navigation files, merged. Records of one satellite are ordered by toe; a record that
/// repeats one already there (same satellite, toe, issue of data, health and, for Galileo, message type) is
/// dropped.
struct NavigationData {
  std::vector<KeplerEphemeris> kepler;
  std::vector<GlonassEphemeris> glonass;
  std::vector<SbasEphemeris> sbas;
  std::vector<SignalDelays> signal_delays;  ///< by satellite and toc
  std::map<System, Klobuchar> klobuchar;
  std::optional<std::array<double, 3>> galileo_nequick;  ///< ai0..ai2, kept for writing back
  std::optional<int> leap_seconds;                       ///< GPST minus UTC as the header says
  std::vector<std::string> sources;                      ///< file names
  ReadReport report;                                     ///< of the readers of these files

  [[nodiscard]] bool empty() const { return kepler.empty() && glonass.empty() && sbas.empty(); }
  /// Adds another file's content, dropping repeats. Later header values win.
  void merge(NavigationData other);
};

}  // namespace canyon::gnss
