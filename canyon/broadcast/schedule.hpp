#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <variant>
#include <vector>

#include "canyon/broadcast/messages.hpp"
#include "canyon/gnss/navigation_data.hpp"
#include "canyon/gnss/signals.hpp"

namespace canyon::broadcast {

/// The ephemeris that a satellite begins to send at `t`: that with the nearest toe, of Galileo the last one
/// of I/NAV that is of the past, where there is any. Null without one.
[[nodiscard]] const gnss::KeplerEphemeris* sent_ephemeris(const gnss::NavigationData& navigation,
                                                          gnss::SatelliteId id, geodesy::GpsTime t);
/// Content of a system's messages at `t`.
[[nodiscard]] SystemMessage system_message(const gnss::NavigationData& navigation, gnss::System system,
                                           geodesy::GpsTime t);

/// A message as it came from a satellite: subframe, page or string, the words as messages.hpp makes them
/// (strings of GLONASS: three words of 32 bits, the first bit foremost).
struct SentMessage {
  gnss::SatelliteId id;
  geodesy::GpsTime start;  ///< when its first bit was sent
  std::vector<std::uint32_t> words;
};

/// Times of satellites' messages, at their systems' pace: GPS and QZSS a subframe of LNAV every 6 s (1, 2, 3;
/// page 18 of subframe 4 once in 12.5 min), Galileo on E1-B a page of I/NAV every 2 s from odd seconds on
/// (words 2, 4, 6, ..., 1, 3, 5 in 30 s, spare ones between), BeiDou a subframe of D1 every 6 s or, in
/// geostationary orbit, a page of D2 every 3 s, GLONASS a string every 2 s (1 to 5 of 15). Almanacs, SBAS and
/// messages of other signals are not sent (symbol_frame() has some of these). A satellite sends the ephemeris
/// that its receivers' sky goes by, that with the nearest toe, and changes it from one 30 s frame to the
/// next.
class Schedule {
 public:
  /// Messages whose last bit a satellite sends in (from, to], in order of time; none without an ephemeris.
  /// Calls for one satellite must go forward in time.
  [[nodiscard]] std::vector<SentMessage> sent(const gnss::NavigationData& navigation, gnss::SatelliteId id,
                                              geodesy::GpsTime from, geodesy::GpsTime to);

  /// Offset of the begin of a satellite's messages from GPS time, less whole messages [ns].
  [[nodiscard]] static std::chrono::nanoseconds offset(gnss::SatelliteId id, geodesy::GpsTime time);

 private:
  using Ephemeris = std::variant<std::monostate, gnss::KeplerEphemeris, gnss::GlonassEphemeris>;
  struct Current {
    std::optional<std::int64_t> frame;
    Ephemeris ephemeris;
  };
  std::map<gnss::SatelliteId, Current> current_;
};

/// Messages of a satellite's ephemeris that it does not send from the first to the last bit within [from,
/// to], by their places in the frame, one bit each; 0: all are sent. LNAV: subframes 1 to 3. D1: likewise;
/// D2: ten pages. I/NAV: words 1 to 5. GLONASS: strings 1 to 4, the immediate data. SBAS: message 9, once in
/// 120 s (RTCA DO-229, A.4.4). L1C and B1C: a frame of 18 s (IS-GPS-800 3.5.2, BDS-SIS-ICD-B1C-1.0 6.2.1).
/// L2C, L5 and B2a: types 10, 11 and 30; B2b: types 10 and 30; E5a: pages 1 to 4; E5b: words 1 to 5.
/// @param signal whose messages are read
[[nodiscard]] std::uint32_t unsent_ephemeris(gnss::SatelliteId id, const gnss::Signal& signal,
                                             geodesy::GpsTime from, geodesy::GpsTime to);

}  // namespace canyon::broadcast
