#pragma once

#include "canyon/sky/gnss/navigation_data.hpp"

namespace canyon::gnss {

/// True for a Galileo record whose clock belongs to F/NAV (E5a/E1); false for I/NAV (E5b/E1) and for every
/// other system. RINEX data source bits 8 (F/NAV clock) and 9 (I/NAV clock) decide; where neither is set, bit
/// 1 (F/NAV E5a) without bits 0 and 2 (I/NAV E1, E5b) does.
[[nodiscard]] bool is_galileo_fnav(const KeplerEphemeris& ephemeris);

/// BeiDou satellites in geostationary orbit: C01 to C05 and C59 to C63 (BDS-SIS-ICD B1I 3.0, table 4-1).
[[nodiscard]] bool is_beidou_geo(SatelliteId id);

/// Whether the message calls the open L1-band signal usable.
///  - GPS: all six bits zero (IS-GPS-200, 20.3.3.3.1.4).
///  - QZSS: the L1 bits only, 0x20 (L1 summary) and 0x10 (L1 C/A); satellites that are fine on L1 fly with
///  the
///    bits of L1C/B, L5 or the former LEX set (IS-QZSS-PNT, SV health).
///  - Galileo: "healthy" of OS-SDD 2.3.1.4: DVS and HS of E1-B zero (bits 0 to 2) and an accuracy prediction
///  given
///    (negative SISA: none). F/NAV pages know only E5a: of a record of them alone (data source without bits 0
///  and 2) its DVS and HS (bits 3 to 5) must be zero as well.
///  - BeiDou: SatH1 zero (BDS-SIS-ICD B1I 5.2.4.6).
[[nodiscard]] bool is_healthy(const KeplerEphemeris& ephemeris);
/// Bn (RINEX: 0 healthy) and, from RINEX 3.05 on, l(3) and the almanac's Cn.
[[nodiscard]] bool is_healthy(const GlonassEphemeris& ephemeris);
/// Whether the satellite may be ranged to: bits 0 (ranging off), 4 (health not known) and 5 (no accuracy
/// given) zero; without corrections (bit 1) or integrity (2) it may (RINEX 3.05, 5.4.4; message 17).
[[nodiscard]] bool is_healthy(const SbasEphemeris& ephemeris);

/// Span about toe in which a message may be used [s].
struct Validity {
  double before_s = 0;  ///< t earlier than toe
  double after_s = 0;

  /// @param age_s t - toe
  [[nodiscard]] bool contains(double age_s) const { return age_s >= -before_s && age_s <= after_s; }
};

/// The span that the control segment fits the orbit to; the error grows with the fourth power beyond it.
///  - GPS, QZSS: half the fit interval on either side, at least 2 h (IS-GPS-200 table 20-XII has none
///  shorter;
///    files that hold the one-bit flag instead of hours fall there too).
///  - Galileo: 0.5 h before, 4 h after (OS-SDD: a receiver shall not use older ones). Messages are sent from
///  toe on:
///    against precise orbits they are 0.9 m off from -0.5 to 3 h, 4 m at 4 h, but 10 m at -2 h and 70 m at -4
///    h.
///  - BeiDou: 1 h before, 3 h after. Sent from toe on as well, renewed every hour: against the record of the
///  hour
///    they are 4 m off at 3 h in medium orbits, 20 m at 4 h, 100 m at 6 h, and 4 m at -2 h.
///  - GLONASS: 0.5 h on either side (records lie 30 min apart).
///  - SBAS: 360 s on either side: sent every 120 s, dropped by receivers en route after 360 s (RTCA DO-229,
///  appendix A, time-outs of messages).
/// docs/results.md shows the figures.
[[nodiscard]] Validity validity(const KeplerEphemeris& ephemeris);
[[nodiscard]] Validity validity(const GlonassEphemeris& ephemeris);
[[nodiscard]] Validity validity(const SbasEphemeris& ephemeris);

}  // namespace canyon::gnss
