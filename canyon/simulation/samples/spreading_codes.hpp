#pragma once

#include <cstdint>
#include <vector>

#include "canyon/receiver/tracking/correlation.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::samples {

using tracking::subcarrier;

/// One component of a signal, with its own sequence of chips. The complex envelope of a signal
/// of mean power 1 is the sum over its components of
///   amplitude() exp(i phase_rad) chip subcarrier() secondary chip navigation symbol.
/// Chips and secondary chips count from the beginning of the week of the system's time at transmission
/// (GLONASS: from each second), where all codes begin, so that a code's phase is that time times the rate of
/// its chips.
struct Component {
  /// One period of the primary code: +1 (logical 0), -1, or 0 if the chip is the other component's (L2C).
  std::vector<std::int8_t> chips;
  double chip_rate_hz = 0;             ///< of `chips`
  std::vector<std::int8_t> secondary;  ///< one for each period of the primary code, repeated; {1}: none
  gnss::Modulation modulation = gnss::Modulation::BPSK;  ///< shape of a chip
  double power_fraction = 1;  ///< of the signal's mean power; those of a signal's components add to 1
  double phase_rad = 0;       ///< of its carrier, ahead of the first component's
  bool data = false;          ///< multiplied by navigation symbols (broadcast::symbol_frame())
};

/// The components of a signal of a satellite; the first is the one that Signal::code names, the pilot if
/// there is one. Empty if the satellite has no code for the signal, and for encrypted signals: GPS has codes
/// of PRN 1 to 63, GLONASS the same code in each slot, Galileo 1 to 50, BeiDou 1 to 63, QZSS PRN 193 to 202,
/// SBAS PRN 120 to 158.
///
///   signal    components: fraction of power, degrees ahead of the first    chips   secondary code
///   L1CA      data                                                         1023
///   L1C       pilot TMBOC 3/4; data BOC(1,1) 1/4, 0                        10230   pilot 1800
///   L2C       CL in odd chips 1/2; CM in even chips, data 1/2, 0           75 x 20460, 20460
///   L5        Q5 1/2; I5, data 1/2, +90                                    10230   Q5 20, I5 10
///   E1        E1-C CBOC- 1/2; E1-B CBOC+, data 1/2, 180                    4092    E1-C 25
///   E5a       E5a-Q 1/2; E5a-I, data 1/2, -90                              10230   E5a-Q 100, E5a-I 20
///   E5b       E5b-Q 1/2; E5b-I, data 1/2, -90                              10230   E5b-Q 100, E5b-I 4
///   B1C       pilot BOC(1,1) 29/44; the same chips as BOC(6,1) 4/44, -90;
///             data BOC(1,1) 11/44, -90                                     10230   pilots 1800
///   B1I, B2I  data                                                         2046    20; none with D2
///   B3I       data                                                         10230   20; none with D2
///   B2a       pilot 1/2; data 1/2, -90                                     10230   pilot 100, data 5
///   B2b       data                                                         10230
///   G1, G2    data                                                         511
///
/// E5a and E5b are sent together by AltBOC(15,10). Here they are two signals of BPSK(10), without the
/// products of its subcarriers (15 % of the power).
[[nodiscard]] std::vector<Component> components(gnss::SatelliteId id, const gnss::Signal& signal);

/// Factor of a component's chips that are not 0, so that its mean power is power_fraction. For L2C it is
/// sqrt(2) times the root of power_fraction, since each component is sent half of the time.
[[nodiscard]] double amplitude(const Component& component);

}  // namespace canyon::samples
