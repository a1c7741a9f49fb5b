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

/// The parameter of the broadcast message for a signal's group delay (group_delays_s()).
enum class GroupDelay : std::uint8_t {
  Unspecified,  ///< not allowed in a row of a table
  None,         ///< the broadcast clock refers to this signal
  Tgd,          ///< GPS, QZSS: TGD of L1, scaled by carrier
  BgdE1,        ///< Galileo E1: the BGD of the pair of the message's clock
  BgdE5a,       ///< Galileo: BGD(E1,E5a), scaled by carrier
  BgdE5b,       ///< Galileo: BGD(E1,E5b), scaled by carrier
  Tgd1,         ///< BeiDou
  Tgd2,         ///< BeiDou
  DeltaTau,     ///< GLONASS: delta tau n, of L2 against L1
};

/// One open signal of a satellite system from its interface document (docs/signals.md has the table): all
/// properties used in Canyon. Times, codes and numbers of formats are read only from here.
struct Signal {
  System system = System::GPS;
  std::string_view name;  ///< for users: "L1CA", "E5a", "B2I", "G2"
  std::string_view code;  ///< RINEX 3.04 band and attribute of the tracked component: "1C", "5Q"
  /// Codes besides `code` for reading observation files, best first (RINEX 3.05, tables 4 to 10). The list of
  /// a system's first signal covers the band near L1: codes of other or encrypted signals are last.
  std::string_view also_read;
  double carrier_hz = 0;  ///< for GLONASS that of channel 0
  double channel_hz = 0;  ///< GLONASS: spacing of frequency channels
  Modulation modulation = Modulation::BPSK;
  double chip_rate_hz = 0;
  /// Guaranteed minimum power of the tracked component in the document [dBW], for a 0 dBic RHCP antenna near
  /// the ground and a satellite above 5 degrees.
  double minimum_dbw = 0;
  SatelliteBlock sent_by = {};  ///< all blocks that send it; must not be empty in a row of a table
  GroupDelay group_delay = GroupDelay::Unspecified;
  /// Number in the signal mask of RTCM MSM (DF395; RTCM 10403.3, tables 3.5-91 to 3.5-108), 1 to 32; 0: none.
  std::uint8_t msm = 0;
  /// Signal number of Septentrio's SBF (PolaRx5TR Reference Guide, 4.1.10); -1: none.
  std::int8_t sbf = -1;
  /// sigId of UBX (UBX-22008968, 1.5.4) of the tracked component: the pilot if there is one; -1: none.
  std::int8_t ubx = -1;
  std::int8_t ubx_geo = -1;  ///< of geostationary BeiDou satellites (D2), if different
  /// Spacing of its spectrum's lines [Hz], if a code repeats once in 1 / line_hz and has no secondary code.
  /// 0: finer than the resolution of an integration.
  double line_hz = 0;
  /// Reason why no receiver here tracks it, as in "it is encrypted": only in recordings. Empty: tracked.
  std::string_view only_recorded = {};
};

/// Carrier of GPS L1, the reference of ionosphere delays unless noted otherwise [Hz].
inline constexpr double kL1_hz = 1575.42e6;

/// The signals of a system; the first is near L1 and sent by all of its satellites.
[[nodiscard]] std::span<const Signal> signals_of(System system);
/// Index in signals_of() of its system.
[[nodiscard]] std::size_t index_of(const Signal& signal);
/// Carrier [Hz] of a satellite whose carrier near L1 is `l1_carrier_hz`, which gives the GLONASS channel.
[[nodiscard]] double carrier_hz(const Signal& signal, double l1_carrier_hz);

/// Whether a satellite sends a signal at a time: its block is in Signal::sent_by. A satellite missing in the
/// table sends the signals of its system's current ones.
[[nodiscard]] bool transmits(SatelliteId id, const Signal& signal, geodesy::GpsTime time);

/// The block or generation of a satellite: "GPS-IIR", "GPS-IIRM", "GPS-IIF", "GPS-III", "BeiDou-2",
/// "BeiDou-3"; its system's current one if it is missing in the table; empty for other systems.
[[nodiscard]] std::string_view block_of(SatelliteId id, geodesy::GpsTime time);

/// Names of all blocks, in the order of SatelliteBlock.
[[nodiscard]] std::vector<std::string_view> block_names();
/// Names of all signals without duplicates, by system. @param only_received those that a receiver here tracks
[[nodiscard]] std::vector<std::string_view> signal_names(bool only_received = false);

/// Group delays [s] of a satellite's signals in the order of signals_of(): a signal's clock is the broadcast
/// one minus this delay.
///   GPS, QZSS: TGD at L1, (f1 / f)^2 TGD elsewhere, because the broadcast clock refers to the
///     ionosphere-free pair (IS-GPS-200 20.3.3.3.3.2);
///   Galileo: from BGD(E1,E5a) and BGD(E1,E5b) for the clock of F/NAV or I/NAV (OS SIS ICD 5.1.5);
///   BeiDou: clock of B3I, TGD1 at B1I and B1C, TGD2 at B2I and B2a (BDS-SIS-ICD-B1I 5.2.4.10).
/// A signal's own delay in newer messages (SignalDelays) has priority.
/// @param fnav Galileo: the message's clock is from F/NAV
[[nodiscard]] std::array<double, kMaxSignals> group_delays_s(const KeplerEphemeris& ephemeris, bool fnav);

}  // namespace canyon::gnss
