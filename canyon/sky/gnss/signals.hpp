#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"

namespace canyon::gnss {

/// Spreading symbol of a ranging signal, one chip long.
enum class Modulation : std::uint8_t {
  BPSK,       ///< BPSK-R(n): GPS L1 C/A (n = 1), BeiDou B1I (2), L5, E5a, P(Y) (10)
  BOC11,      ///< sine-phased BOC(1,1): GPS L1C data, BeiDou B1C data
  CBOCData,   ///< CBOC(6,1,1/11,'+'): Galileo E1-B (Galileo OS SIS ICD 2.3.3)
  CBOCPilot,  ///< CBOC(6,1,1/11,'-'): Galileo E1-C
  TMBOC,      ///< TMBOC(6,1,4/33): GPS L1C pilot (IS-GPS-800, 3.3)
  BOC61,      ///< sine-phased BOC(6,1): the smaller part of BeiDou B1C's pilot, QMBOC (B1C-1.0, 4.2.3)
};
/// "BPSK", "BOC(1,1)", "CBOC+", "CBOC-", "TMBOC", "BOC(6,1)".
[[nodiscard]] std::string_view name(Modulation modulation);

/// Blocks and generations of satellites whose signals differ, one bit each.
enum class SatelliteBlock : std::uint16_t {
  IIR = 1U << 0U,  ///< GPS
  IIRM = 1U << 1U,
  IIF = 1U << 2U,
  III = 1U << 3U,
  BeiDou2 = 1U << 4U,
  BeiDou3 = 1U << 5U,     ///< medium and inclined orbits
  BeiDou3Geo = 1U << 6U,  ///< geostationary
  All = 1U << 15U,        ///< satellites of the other systems, each
};
[[nodiscard]] constexpr SatelliteBlock operator|(SatelliteBlock a, SatelliteBlock b) {
  return static_cast<SatelliteBlock>(static_cast<unsigned>(a) | static_cast<unsigned>(b));
}

/// Which parameter of the broadcast message makes a signal's group delay (group_delays_s()).
enum class GroupDelay : std::uint8_t {
  Unstated,  ///< no row of a table may have it
  None,      ///< the broadcast clock is this signal's
  Tgd,       ///< GPS, QZSS: TGD of L1, scaled by carrier
  BgdE1,     ///< Galileo E1: the BGD of the pair that the message's clock belongs to
  BgdE5a,    ///< Galileo: BGD(E1,E5a), scaled by carrier
  BgdE5b,    ///< Galileo: BGD(E1,E5b), scaled by carrier
  Tgd1,      ///< BeiDou
  Tgd2,      ///< BeiDou
  DeltaTau,  ///< GLONASS: delta tau n, of L2 against L1
};

/// One open signal of a satellite system as its interface document gives it (docs/signals.md has the table):
/// all that Canyon knows of it. Times, codes and numbers of formats are read from here alone.
struct Signal {
  System system = System::GPS;
  std::string_view name;  ///< as users write it: "L1CA", "E5a", "B2I", "G2"
  std::string_view code;  ///< RINEX 3.04 band and attribute of the component that is tracked: "1C", "5Q"
  /// Codes that observation files are read by besides `code`, best first (RINEX 3.05, tables 4 to 10). That
  /// of a system's first signal stands for the band near L1: it ends with codes that are another's, or
  /// encrypted, and better than nothing.
  std::string_view also_read;
  double carrier_hz = 0;  ///< of GLONASS that of channel 0
  double channel_hz = 0;  ///< GLONASS: from one frequency channel to the next
  Modulation modulation = Modulation::BPSK;
  double chip_rate_hz = 0;
  /// Power of what is tracked that the document promises at least [dBW], of a 0 dBic RHCP antenna near the
  /// ground and a satellite above 5 degrees.
  double minimum_dbw = 0;
  SatelliteBlock sent_by = {};  ///< all blocks that send it; no row of a table may leave it empty
  GroupDelay group_delay = GroupDelay::Unstated;
  /// Number in the signal mask of RTCM MSM (DF395; RTCM 10403.3, tables 3.5-91 to 3.5-108), 1 to 32; 0: none.
  std::uint8_t msm = 0;
  /// Signal number of Septentrio's SBF (PolaRx5TR Reference Guide, 4.1.10); -1: none.
  std::int8_t sbf = -1;
  /// sigId of UBX (UBX-22008968, 1.5.4) of what is tracked: the pilot where it has one; -1: none.
  std::int8_t ubx = -1;
  std::int8_t ubx_geo = -1;  ///< of geostationary BeiDou satellites (D2), where that differs
  /// Distance of its spectrum's lines [Hz], where a code repeats once in 1 / line_hz and has no secondary
  /// code. 0: closer than an integration resolves.
  double line_hz = 0;
  /// Why no receiver here tracks it, as in "it is encrypted": recordings alone have it. Empty: receivers do.
  std::string_view only_recorded = {};
};

/// Carrier of GPS L1, which delays of the ionosphere refer to unless said otherwise [Hz].
inline constexpr double kL1_hz = 1575.42e6;

/// The signals of a system; the first is the one near L1 that all of its satellites send.
[[nodiscard]] std::span<const Signal> signals_of(System system);
/// Place among signals_of() its system.
[[nodiscard]] std::size_t index_of(const Signal& signal);
/// Carrier [Hz] of a satellite whose carrier near L1 is `l1_carrier_hz`, which gives the channel of GLONASS.
[[nodiscard]] double carrier_hz(const Signal& signal, double l1_carrier_hz);

/// Whether a satellite sends a signal at a time: its block is of Signal::sent_by. A satellite that the table
/// does not know sends what its system's current ones send.
[[nodiscard]] bool transmits(SatelliteId id, const Signal& signal, geodesy::GpsTime time);

/// The block or generation of a satellite: "GPS-IIR", "GPS-IIRM", "GPS-IIF", "GPS-III", "BeiDou-2",
/// "BeiDou-3"; its system's current one where the table does not know it; empty for other systems.
[[nodiscard]] std::string_view block_of(SatelliteId id, geodesy::GpsTime time);

/// Names of all blocks, in the order of SatelliteBlock.
[[nodiscard]] std::vector<std::string_view> block_names();
/// Names of all signals, none twice, by system. @param only_received those that a receiver here tracks
[[nodiscard]] std::vector<std::string_view> signal_names(bool only_received = false);

/// Group delays [s] of a satellite's signals in the order of signals_of(): a signal's clock is the broadcast
/// one less this.
///   GPS, QZSS: TGD at L1, (f1 / f)^2 TGD elsewhere, since the broadcast clock is that of the ionosphere-free
///   pair
///     (IS-GPS-200 20.3.3.3.3.2);
///   Galileo: from BGD(E1,E5a) and BGD(E1,E5b) for the clock of F/NAV or I/NAV (OS SIS ICD 5.1.5);
///   BeiDou: clock of B3I, TGD1 at B1I and B1C, TGD2 at B2I and B2a (BDS-SIS-ICD-B1I 5.2.4.10).
/// A signal's own delay in newer messages (SignalDelays) holds instead.
/// @param fnav Galileo: the message's clock is that of F/NAV
[[nodiscard]] std::array<double, kMostSignals> group_delays_s(const KeplerEphemeris& ephemeris, bool fnav);

}  // namespace canyon::gnss
