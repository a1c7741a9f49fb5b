#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "canyon/geodesy/gps_time.hpp"
#include "canyon/gnss/navigation_data.hpp"
#include "canyon/gnss/signals.hpp"

namespace canyon::broadcast {

/// Symbols that a satellite sends on a signal's data component, with their encoding (parity, error
/// correction, interleaving, synchronisation).
struct SymbolFrame {
  geodesy::GpsTime start;  ///< of the first symbol, by the satellite's clock
  double symbol_s = 0;
  std::vector<std::int8_t> symbols;  ///< +1 (logical 0) or -1
};

/// The frame that a satellite sends at `time` of its clock: a subframe of LNAV on GPS and QZSS L1 C/A
/// (IS-GPS-200, 20.3), a page of I/NAV on Galileo E1 (OS SIS ICD 2.1, 4.1 and 4.3), of the messages
/// of Schedule. In the place of those that it does not send stand page 18 of subframe 4 and spare words.
/// Empty: another signal, or a satellite without an ephemeris.
[[nodiscard]] std::optional<SymbolFrame> symbol_frame(const gnss::NavigationData& navigation,
                                                      gnss::SatelliteId id, const gnss::Signal& signal,
                                                      geodesy::GpsTime time);

}  // namespace canyon::broadcast
