#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "canyon/gnss/signals.hpp"

namespace canyon::samples {

/// One component of a signal: what is multiplied by one sequence of chips. The complex envelope of a signal
/// of mean power 1 is the sum over its components of
///   amplitude() exp(i phase_rad) chip subcarrier() secondary chip navigation symbol.
/// Chips and secondary chips count from the beginning of the week of the system's time at transmission
/// (GLONASS: from each second), where all codes begin, so that a code's phase is that time times the rate of
/// its chips.
struct Component {
  std::vector<std::int8_t> chips;  ///< one period of the primary code, +1 (logical 0) or -1; 0: the chip is
                                   ///< the other component's (L2C is time-multiplexed)
  double chip_rate_hz = 0;         ///< of `chips`
  std::vector<std::int8_t>
      secondary;  ///< one value for each period of the primary code, repeated; {1} without
  gnss::Modulation modulation = gnss::Modulation::BPSK;  ///< shape of a chip
  double power_share = 1;  ///< of the signal's mean power; those of a signal's components add to 1
  double phase_rad = 0;    ///< of its carrier, ahead of the first component's
  bool data = false;       ///< multiplied by navigation symbols (broadcast::symbol_frame())
};

/// The components of a signal of a satellite; the first is that which Signal::code names, the pilot where
/// there is one. Empty where the satellite has no code of it: GPS has those of PRN 1 to 63, GLONASS any slot,
/// Galileo 1 to 50, BeiDou 1 to 63, QZSS PRN 193 to 202, SBAS PRN 120 to 158. Codes of encrypted signals are
/// empty.
///
///   signal      components (share of power, phase ahead of the first)              chips        secondary
///   L1CA, SBAS  data                                                               1023
///   L1C         pilot TMBOC (3/4), data BOC(1,1) (1/4, 0)                          10230        pilot 1800
///   L2C         CL (1/2, on in odd chips), CM with data (1/2, 0, even chips)       75 x 20460
///   L5          Q5 (1/2), I5 with data (1/2, +90 degrees)                          10230        Q5 20, I5 10
///   E1          E1-C CBOC- (1/2), E1-B CBOC+ with data (1/2, 180 degrees)          4092         E1-C 25
///   E5a, E5b    Q (1/2), I with data (1/2, -90 degrees)                            10230        Q 100, I 20
///   or 4 B1C         pilot TMBOC (3/4), data BOC(1,1) (1/4, -90 degrees)                10230        pilot
///   1800 B1I, B2I    data                                                               2046         20, but
///   of D2 B3I         data                                                               10230        20,
///   but of D2 B2a         pilot (1/2), data (1/2, -90 degrees)                               10230 100 and 5
///   B2b         data                                                               10230
///   G1, G2      data                                                               511
///
/// E5a and E5b are sent by AltBOC(15,10) together; here they are two signals of BPSK(10), without the
/// products of its subcarriers (15 % of the power) far from both carriers.
[[nodiscard]] std::vector<Component> components(gnss::SatelliteId id, const gnss::Signal& signal);

/// Factor of a component's chips that are not 0: its mean power is then its share. Of L2C sqrt(2) times the
/// root of the share, since each component sends half of the time.
[[nodiscard]] double amplitude(const Component& component);

/// Value of the subcarrier, of mean power 1, at a place within a chip.
/// @param fraction of the chip, [0, 1)
/// @param chip index in Component::chips, which TMBOC depends on (IS-GPS-800, 3.3: chips 0, 4, 6 and 29 of 33
/// are
///             BOC(6,1))
[[nodiscard]] double subcarrier(gnss::Modulation modulation, double fraction, std::size_t chip);

}  // namespace canyon::samples
