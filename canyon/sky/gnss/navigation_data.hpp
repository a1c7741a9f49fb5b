#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/read_report.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"

namespace canyon::gnss {

/// Keplerian broadcast ephemeris of GPS, QZSS, Galileo or BeiDou. The ICDs' units are converted to SI and
/// radians as in RINEX. All times are GPST.
struct KeplerEphemeris {
  SatelliteId id;
  geodesy::GpsTime toc;              ///< clock reference
  geodesy::GpsTime toe;              ///< orbit reference
  geodesy::GpsTime transmission;     ///< transmission time of the message; toe if the file has none
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
  double accuracy_m = 0;      ///< SV accuracy / SISA as in RINEX; negative: no prediction
  double fit_interval_h = 0;  ///< GPS, QZSS; 0: not given
  int data_sources = 0;       ///< Galileo: bits of I/NAV (0, 2, 9) and F/NAV (1, 8); GPS: codes on L2
  int l2p_flag = 0;           ///< GPS
  int source = 0;             ///< index into NavigationData::sources
  int line = 0;               ///< in its file; 0: not from a file
};

/// GLONASS broadcast ephemeris (PZ-90.11, treated as WGS 84: the difference is centimetres).
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
  double group_delay_difference_s = 0;  ///< delta tau n, L2 minus L1; 0 if not in the file
  int source = 0;
  int line = 0;  ///< in its file; 0: not from a file
};

/// Navigation message of a geostationary SBAS satellite (message 9, RTCA DO-229 A.4.4.11); WGS 84, GPST.
struct SbasEphemeris {
  SatelliteId id;
  geodesy::GpsTime toe;           ///< t0, of orbit and clock
  geodesy::GpsTime transmission;  ///< toe if the file has none
  double clock_bias_s = 0;        ///< aGf0, against SBAS network time
  double clock_drift = 0;         ///< aGf1
  std::array<double, 3> position_m{};
  std::array<double, 3> velocity_mps{};
  std::array<double, 3> acceleration_mps2{};
  int health = 0;         ///< bits as in RINEX; 0 is healthy
  double accuracy_m = 0;  ///< URA
  int iodn = 0;           ///< issue of data
  int source = 0;
  int line = 0;  ///< in its file; 0: not from a file
};

/// Maximum number of signals of a system; the tables of signals.cpp assert it.
inline constexpr std::size_t kMaxSignals = 8;

/// Group delays that a newer message gives for signals [s], in the order of signals_of(); NaN: blank;
/// infinity: no such field. GPS, QZSS CNAV, CNAV-2: TGD minus inter-signal correction
/// (IS-GPS-200 30.3.3.3.1.1, IS-GPS-705 20.3.3.3.1.2, IS-GPS-800 3.5.3.9); BeiDou B-CNAV1 and 2: TGD of the
/// pilots of B1C and B2a (BDS-SIS-ICD-B1C-1.0 7.6.2), B-CNAV3: of B2b's I component (BDS-SIS-ICD-B2b-1.0).
struct SignalDelays {
  SatelliteId id;
  geodesy::GpsTime toc;
  std::array<double, kMaxSignals> group_delay_s{};
};

/// Klobuchar coefficients of a system (GPS: GPSA/GPSB, BeiDou: BDSA/BDSB, QZSS: QZSA/QZSB).
struct Klobuchar {
  std::array<double, 4> alpha{};
  std::array<double, 4> beta{};
};

/// Content of navigation files, merged. Records of one satellite are ordered by toe. Duplicate records (same
/// satellite, toe, issue of data, health and, for Galileo, message type) are dropped.
struct NavigationData {
  std::vector<KeplerEphemeris> kepler;
  std::vector<GlonassEphemeris> glonass;
  std::vector<SbasEphemeris> sbas;
  std::vector<SignalDelays> signal_delays;  ///< by satellite and toc
  std::map<System, Klobuchar> klobuchar;
  std::optional<std::array<double, 3>> galileo_nequick;  ///< ai0..ai2, kept for output
  std::optional<int> leap_seconds;                       ///< GPST minus UTC from the header
  std::vector<std::string> sources;                      ///< file names
  ReadReport report;                                     ///< of the readers of these files

  [[nodiscard]] bool empty() const { return kepler.empty() && glonass.empty() && sbas.empty(); }
  /// Adds another file's content, without duplicates. Later header values override earlier ones.
  void merge(NavigationData other);
};

/// True for a Galileo record whose clock belongs to F/NAV (E5a/E1); false for I/NAV (E5b/E1) and for every
/// other system. RINEX data source bits 8 (F/NAV clock) and 9 (I/NAV clock) decide; if neither is set, bit 1
/// (F/NAV E5a) without bits 0 and 2 (I/NAV E1, E5b) does.
[[nodiscard]] bool is_galileo_fnav(const KeplerEphemeris& ephemeris);

/// BeiDou satellites in geostationary orbit: C01 to C05 and C59 to C63 (BDS-SIS-ICD B1I 3.0, table 4-1).
[[nodiscard]] bool is_beidou_geo(SatelliteId id);

/// Whether the message marks the open L1-band signal as usable.
///  - GPS: all six bits zero (IS-GPS-200, 20.3.3.3.1.4).
///  - QZSS: only the L1 bits, 0x20 (L1 summary) and 0x10 (L1 C/A); satellites that are healthy on L1 may have
///    the bits of L1C/B, L5 or the former LEX set (IS-QZSS-PNT, SV health).
///  - Galileo: "healthy" of OS-SDD 2.3.1.4: DVS and HS of E1-B zero (bits 0 to 2) and an accuracy prediction
///    given (negative SISA: none). F/NAV pages have only E5a: in a record from F/NAV alone (data source
///    without bits 0 and 2) its DVS and HS (bits 3 to 5) must be zero as well.
///  - BeiDou: SatH1 zero (BDS-SIS-ICD B1I 5.2.4.6).
[[nodiscard]] bool is_healthy(const KeplerEphemeris& ephemeris);
/// Bn (RINEX: 0 healthy) and, since RINEX 3.05, l(3) and the almanac's Cn.
[[nodiscard]] bool is_healthy(const GlonassEphemeris& ephemeris);
/// Whether ranging is allowed: bits 0 (ranging off), 4 (health not known) and 5 (no accuracy given) zero;
/// missing corrections (bit 1) or integrity (2) do not matter (RINEX 3.05, 5.4.4; message 17).
[[nodiscard]] bool is_healthy(const SbasEphemeris& ephemeris);

/// Span about toe in which a message may be used [s].
struct Validity {
  double before_s = 0;  ///< t earlier than toe
  double after_s = 0;

  /// @param age_s t - toe
  [[nodiscard]] bool contains(double age_s) const { return age_s >= -before_s && age_s <= after_s; }
};

/// The span of the control segment's orbit fit; the error grows with the fourth power beyond it.
///  - GPS, QZSS: half the fit interval on either side, at least 2 h (IS-GPS-200 table 20-XII has none
///  shorter;
///    also used for files with the one-bit flag instead of hours).
///  - Galileo: 0.5 h before, 4 h after (OS-SDD: a receiver shall not use older ones). Messages are sent from
///    toe on: against precise orbits their error is 0.9 m from -0.5 to 3 h, 4 m at 4 h, but 10 m at -2 h and
///    70 m at -4 h.
///  - BeiDou: 1 h before, 3 h after. Sent from toe on as well, renewed every hour: against the record of the
///    hour their error is 4 m at 3 h in medium orbits, 20 m at 4 h, 100 m at 6 h, and 4 m at -2 h.
///  - GLONASS: 0.5 h on either side (records are 30 min apart).
///  - SBAS: 360 s on either side: sent every 120 s, dropped by receivers en route after 360 s (RTCA DO-229,
///    appendix A, time-outs of messages).
/// docs/results.md has the measured errors.
[[nodiscard]] Validity validity(const KeplerEphemeris& ephemeris);
[[nodiscard]] Validity validity(const GlonassEphemeris& ephemeris);
[[nodiscard]] Validity validity(const SbasEphemeris& ephemeris);

}  // namespace canyon::gnss
