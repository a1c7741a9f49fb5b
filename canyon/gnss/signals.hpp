#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "canyon/geodesy/gps_time.hpp"
#include "canyon/gnss/navigation_data.hpp"
#include "canyon/gnss/satellite_id.hpp"

namespace canyon::gnss {

/// Spreading symbol of a ranging signal, one chip long.
enum class Modulation : std::uint8_t {
  BPSK,       ///< BPSK-R(n): GPS L1 C/A (n = 1), BeiDou B1I (2), L5, E5a, P(Y) (10)
  BOC11,      ///< sine-phased BOC(1,1): GPS L1C data, BeiDou B1C data
  CBOCData,   ///< CBOC(6,1,1/11,'+'): Galileo E1-B (Galileo OS SIS ICD 2.3.3)
  CBOCPilot,  ///< CBOC(6,1,1/11,'-'): Galileo E1-C
  TMBOC,      ///< TMBOC(6,1,4/33): GPS L1C pilot (IS-GPS-800, 3.3)
};
/// "BPSK", "BOC(1,1)", "CBOC+", "CBOC-", "TMBOC".
[[nodiscard]] std::string_view name(Modulation modulation);

/// One open signal of a satellite system as its interface document gives it (docs/signals.md has the table).
struct Signal {
  System system = System::GPS;
  std::string_view name;  ///< as users write it: "L1CA", "E5a", "B2I", "G2"
  std::string_view code;  ///< RINEX 3.04 band and attribute of the component that is tracked: "1C", "5Q"
  double carrier_hz = 0;  ///< of GLONASS that of channel 0
  double channel_hz = 0;  ///< GLONASS: from one frequency channel to the next
  Modulation modulation = Modulation::BPSK;
  double chip_rate_hz = 0;
  /// Power of what is tracked that the document promises at least [dBW], of a 0 dBic RHCP antenna near the
  /// ground and a satellite above 5 degrees.
  double minimum_dbw = 0;
  /// Between the lines of its spectrum [Hz]: of a code that repeats once in 1 / line_hz and has no secondary
  /// code. 0: closer than an integration tells apart.
  double line_hz = 0;
};

/// Carrier of GPS L1, which delays of the ionosphere refer to unless said otherwise [Hz].
inline constexpr double kL1_hz = 1575.42e6;

/// The signals of a system; the first is the one near L1 that all of its satellites send.
[[nodiscard]] std::span<const Signal> signals_of(System system);
/// Place among signals_of() its system.
[[nodiscard]] std::size_t index_of(const Signal& signal);
/// Carrier [Hz] of a satellite whose carrier near L1 is `l1_carrier_hz`, which tells the channel of GLONASS.
[[nodiscard]] double carrier_hz(const Signal& signal, double l1_carrier_hz);

/// Whether a satellite sends a signal at a time, by its block. A satellite that the table does not know sends
/// what its system's current ones send.
[[nodiscard]] bool transmits(SatelliteId id, const Signal& signal, geodesy::GpsTime time);

/// The block or generation of a satellite: "GPS-IIR", "GPS-IIRM", "GPS-IIF", "GPS-III", "BeiDou-2",
/// "BeiDou-3"; of one that the table does not know its system's current one; empty for other systems.
[[nodiscard]] std::string_view block_of(SatelliteId id, geodesy::GpsTime time);

/// Group delays [s] of a satellite's signals in the order of signals_of(): a signal's clock is the broadcast
/// one less this.
///   GPS, QZSS: TGD at L1, (f1 / f)^2 TGD elsewhere, since the broadcast clock is that of the ionosphere-free
///   pair
///     (IS-GPS-200 20.3.3.3.3.2);
///   Galileo: from BGD(E1,E5a) and BGD(E1,E5b) for the clock of F/NAV or I/NAV (OS SIS ICD 5.1.5);
///   BeiDou: clock of B3I, TGD1 at B1I and B1C, TGD2 at B2I and B2a (BDS-SIS-ICD-B1I 5.2.4.10).
/// Where newer messages tell a signal's own (SignalDelays), that holds instead.
/// @param fnav Galileo: the message's clock is that of F/NAV
[[nodiscard]] std::array<double, kMostSignals> group_delays_s(const KeplerEphemeris& ephemeris, bool fnav);

}  // namespace canyon::gnss
