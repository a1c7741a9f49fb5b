#pragma once

#include "canyon/orbit/navigation_data.hpp"

namespace canyon::orbit {

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
///    (negative SISA: none). F/NAV pages know only E5a: its DVS and HS (bits 3 to 5) must be zero as well.
///  - BeiDou: SatH1 zero (BDS-SIS-ICD B1I 5.2.4.6).
[[nodiscard]] bool is_healthy(const KeplerEphemeris& ephemeris);
/// Bn (RINEX: 0 healthy) and, from RINEX 3.05 on, l(3).
[[nodiscard]] bool is_healthy(const GlonassEphemeris& ephemeris);

/// Largest |t - toe| [s] at which the message may be used.
///  - GPS, QZSS: half the fit interval, at least 2 h (IS-GPS-200 table 20-XII has none shorter; files that
///  hold
///    the one-bit flag instead of hours fall there too).
///  - Galileo 4 h (OS-SDD: a receiver shall not use older ones), BeiDou 6 h, GLONASS 0.5 h (records lie
///    30 min apart).
[[nodiscard]] double validity_s(const KeplerEphemeris& ephemeris);
[[nodiscard]] double validity_s(const GlonassEphemeris& ephemeris);

}  // namespace canyon::orbit
