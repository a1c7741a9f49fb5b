#pragma once

#include <cmath>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "canyon/sky/broadcast/messages.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::broadcast {

/// The record that a satellite starts to send at `t`: the one with the nearest toe, of equal ones the newer,
/// as in BroadcastSky. Galileo records are sent from toe on, and readers reject earlier ones: the latest past
/// I/NAV record, if there is any. Null without one.
template <typename Record>
[[nodiscard]] const Record* sent_record(const std::vector<Record>& records, gnss::SatelliteId id,
                                        geodesy::GpsTime t) {
  const Record* best = nullptr;
  const auto to_come = [&](const Record& r) { return id.system == gnss::System::Galileo && r.toe > t; };
  for (const Record& record : records) {
    if (record.id != id) continue;
    if constexpr (std::is_same_v<Record, gnss::KeplerEphemeris>) {
      if (gnss::is_galileo_fnav(record)) continue;  // sent on E5a
    }
    if (best == nullptr || to_come(record) < to_come(*best) ||
        (to_come(record) == to_come(*best) && std::abs(t - record.toe) <= std::abs(t - best->toe)))
      best = &record;
  }
  return best;
}
/// Content of a system's messages at `t`.
[[nodiscard]] SystemMessage system_message(const gnss::NavigationData& navigation, gnss::System system,
                                           geodesy::GpsTime t);

/// Kinds of navigation messages.
enum class MessageKind { Lnav, Cnav, Cnav2, Inav, Fnav, D1, D2, Bcnav1, Bcnav2, Bcnav3, Glonass, Sbas };

/// Times of the messages of a signal: message k is sent in [offset + k period, offset + k period + duration)
/// [ns of GPST].
struct MessagePace {
  MessageKind kind = MessageKind::Lnav;
  std::int64_t offset = 0, period = 0, duration = 0;
  std::int64_t frame_messages = 0;  ///< messages per repetition, with one ephemeris
  /// Messages of an ephemeris, by index in the frame, one bit each. LNAV: subframes 1 to 3. D1: likewise;
  /// D2: ten pages. I/NAV: words 1 to 5. F/NAV: pages 1 to 4. GLONASS: strings 1 to 4, the immediate data.
  /// SBAS: message 9, once in 120 s (RTCA DO-229, A.4.4). CNAV-2 and B-CNAV1: a frame of 18 s (IS-GPS-800
  /// 3.5.2, BDS-SIS-ICD-B1C-1.0 6.2.1). CNAV and B-CNAV2: types 10, 11 and 30; B-CNAV3: types 10 and 30.
  std::uint32_t needed = 0;
};
/// @param t time of the leap second count, for GLONASS
[[nodiscard]] MessagePace pace_of(gnss::SatelliteId id, const gnss::Signal& signal, geodesy::GpsTime t);

/// The current message, or the last one.
struct CurrentMessage {
  geodesy::GpsTime start, frame_start;
  int number = 0;  ///< in its frame, from 0
};
[[nodiscard]] CurrentMessage position_of(const MessagePace& pace, geodesy::GpsTime t);

/// The words of a message of LNAV, I/NAV, D1, D2 or GLONASS as made by messages.hpp (strings of GLONASS:
/// three words of 32 bits, first bit most significant), with the record at the start of its frame. Of D2 only
/// the pages that receivers output. Empty without a record, and for messages that are not sent here:
/// almanacs, and pages of LNAV except page 18 of subframe 4, once in 12.5 min.
[[nodiscard]] std::vector<std::uint32_t> message_words(const gnss::NavigationData& navigation,
                                                       gnss::SatelliteId id, const MessagePace& pace,
                                                       const CurrentMessage& current);

/// A message sent by a satellite: subframe, page or string, with the words of message_words().
struct SentMessage {
  gnss::SatelliteId id;
  geodesy::GpsTime start;  ///< transmission time of its first bit
  std::vector<std::uint32_t> words;
};
/// Messages of a satellite's first signal whose last bit is sent in (from, to], in order of time; none
/// without a record, and none of SBAS.
[[nodiscard]] std::vector<SentMessage> sent_messages(const gnss::NavigationData& navigation,
                                                     gnss::SatelliteId id, geodesy::GpsTime from,
                                                     geodesy::GpsTime to);

/// Messages of MessagePace::needed that a satellite does not send completely within [from, to]; 0: all are
/// sent. @param signal signal that carries the messages
[[nodiscard]] std::uint32_t unsent_ephemeris(gnss::SatelliteId id, const gnss::Signal& signal,
                                             geodesy::GpsTime from, geodesy::GpsTime to);

}  // namespace canyon::broadcast
