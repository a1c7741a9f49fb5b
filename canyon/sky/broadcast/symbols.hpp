#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/sky/broadcast/bits.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::broadcast {

/// Symbols of a signal's data component, encoded (parity, error correction, interleaving, sync).
struct SymbolFrame {
  geodesy::GpsTime start;  ///< of the first symbol, by the satellite's clock
  double symbol_s = 0;
  std::vector<std::int8_t> symbols;  ///< +1 (logical 0) or -1
};

/// The frame that a satellite sends at `time` of its clock:
///   GPS, QZSS L1 C/A: a subframe of LNAV (IS-GPS-200, 20.3)
///   Galileo E1: a page of I/NAV (OS SIS ICD 2.1, 4.1 and 4.3)
///   Galileo E5b: likewise, words 1, 3 and 5 first (4.3.3); E5a: a page of F/NAV, 1 to 5 in rotation (4.2)
///   GPS, QZSS L2C, L5: a message of CNAV, 10, 11, 30 and 33 in rotation (IS-GPS-200, 30.3; IS-GPS-705, 20.3)
///   GPS, QZSS L1C: a frame of CNAV-2 with page 1 (IS-GPS-800, 3.2.3 and 3.5)
///   SBAS L1 C/A: message 9 once in 120 s, else 63, or 0 for an unhealthy satellite (RTCA DO-229, A.4)
///   BeiDou B1I, B2I, B3I: a subframe of D1, or of D2 (BDS-SIS-ICD-B1I-3.0, 5.2, 5.3)
///   BeiDou B1C: a frame of B-CNAV1 with page 1 (BDS-SIS-ICD-B1C-1.0, 6.2), not for geostationary satellites
///   BeiDou B2a: a message of B-CNAV2, 10, 11, 30 and 34 in rotation (BDS-SIS-ICD-B2a-1.0, 6.2), likewise
///   BeiDou B2b: a message of B-CNAV3, 10 and 30 in rotation (BDS-SIS-ICD-B2b-1.0, 6.2), likewise
///   GLONASS G1, G2: a string of 2 s, in symbols of 10 ms (ICD L1, L2 5.1, 3.3.2)
/// Messages missing in message_words() are replaced by page 18 of subframe 4, spare words, and subframes and
/// strings without content. Empty: an untracked signal, or a satellite without an ephemeris.
[[nodiscard]] std::optional<SymbolFrame> symbol_frame(const gnss::NavigationData& navigation,
                                                      gnss::SatelliteId id, const gnss::Signal& signal,
                                                      geodesy::GpsTime time);

/// Systematic LDPC codes of rate 1/2 of the messages that use them. Symbols of BeiDou have six bits and are
/// elements of GF(64) by x^6 + x + 1, the highest power first (BDS-SIS-ICD-B1C-1.0, 6.2.2.2).
enum class LdpcCode {
  Cnav2Subframe2,   ///< (1200, 600), bits
  Cnav2Subframe3,   ///< (548, 274), bits
  Bcnav1Subframe2,  ///< (200, 100)
  Bcnav1Subframe3,  ///< (88, 44)
  Bcnav2,           ///< (96, 48)
  Bcnav3,           ///< (162, 81)
};

/// A symbol of a parity check, counted from 0, and its factor.
struct LdpcTerm {
  std::size_t symbol;
  std::uint8_t factor;
};
/// The rows of the parity-check matrix H: in a code word each sum of symbols times factors is 0.
[[nodiscard]] std::vector<std::vector<LdpcTerm>> parity_checks(LdpcCode code);

/// `information`, followed by as many parity bits. Precondition: its size is that of the code.
[[nodiscard]] Bits ldpc_encoded(LdpcCode code, const Bits& information);

}  // namespace canyon::broadcast
