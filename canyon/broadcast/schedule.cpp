#include "canyon/broadcast/schedule.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <string_view>

#include "canyon/base/arithmetic.hpp"
#include "canyon/broadcast/messages.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/gnss/broadcast_messages.hpp"

namespace canyon::broadcast {
namespace {

using geodesy::GpsTime;
using gnss::System;

constexpr std::int64_t kSecond = GpsTime::kNanosecondsPerSecond;

/// Message k fills [offset + k period, offset + k period + duration) [ns of GPST].
struct Pace {
  std::int64_t offset, period, duration;
  std::int64_t of_frame;  ///< messages until they repeat
};

Pace pace_of(gnss::SatelliteId id, GpsTime t) {
  switch (id.system) {
    case System::Galileo:
      return {kSecond, 2 * kSecond, 2 * kSecond, 15};
    case System::BeiDou: {
      constexpr std::int64_t kOffset = geodesy::kBdtSecondsOffset * kSecond;
      if (gnss::is_beidou_geo(id)) return {kOffset, 3 * kSecond, kSecond * 6 / 10, 10};
      return {kOffset, 6 * kSecond, 6 * kSecond, 5};
    }
    case System::GLONASS:
      return {geodesy::leap_seconds(t) * kSecond, 2 * kSecond, 2 * kSecond, 15};
    case System::GPS:
    case System::QZSS:
    case System::SBAS:
      break;
  }
  return {0, 6 * kSecond, 6 * kSecond, 5};
}

/// The record with the nearest toe, the newer one among equals, as BroadcastSky has it. Galileo's begin to be
/// sent at toe, and readers refuse earlier ones: the last one of the past where there is any.
template <typename Record>
const Record* sent_record(const std::vector<Record>& records, gnss::SatelliteId id, GpsTime t) {
  const Record* best = nullptr;
  const auto to_come = [&](const Record& r) { return id.system == System::Galileo && r.toe > t; };
  for (const Record& record : records) {
    if (record.id != id) continue;
    if constexpr (std::is_same_v<Record, gnss::KeplerEphemeris>) {
      if (gnss::is_galileo_fnav(record)) continue;  // is sent on E5a
    }
    if (best == nullptr || to_come(record) < to_come(*best) ||
        (to_come(record) == to_come(*best) && std::abs(t - record.toe) <= std::abs(t - best->toe))) {
      best = &record;
    }
  }
  return best;
}

/// Empty where nothing is sent that Canyon knows.
std::vector<std::uint32_t> words_of(const gnss::KeplerEphemeris& e, const gnss::NavigationData& navigation,
                                    std::int64_t k, GpsTime start) {
  const System system = e.id.system;
  if (system == System::Galileo) {
    constexpr std::array<int, 15> kWords{2, 4, 6, -1, -1, 0, 0, 0, 0, 0, 1, 3, 5, 0, 0};
    const int type = kWords[static_cast<std::size_t>(k % 15)];
    if (type < 0) return {};  // almanacs
    return inav_page(inav_word(e, system_message(navigation, system, start), type, start));
  }
  if (system == System::BeiDou) {
    const SystemMessage message = system_message(navigation, system, start);
    if (gnss::is_beidou_geo(e.id)) return d2_page(e, message, static_cast<int>(k % 10) + 1, start);
    return k % 5 < 3 ? d1_subframe(e, message, static_cast<int>(k % 5) + 1, start)
                     : std::vector<std::uint32_t>();
  }
  if (k % 5 < 3) return lnav_subframe(e, static_cast<int>(k % 5) + 1, start);
  // The 25 pages begin anew with each week.
  const std::int64_t frame = start.nanosecond_of_week() / (30 * kSecond);
  if (k % 5 == 3 && frame % 25 == 17 && navigation.klobuchar.count(system) > 0) {
    return lnav_page18(system, system_message(navigation, system, start), start);
  }
  return {};
}

}  // namespace

const gnss::KeplerEphemeris* sent_ephemeris(const gnss::NavigationData& navigation, gnss::SatelliteId id,
                                            GpsTime t) {
  return sent_record(navigation.kepler, id, t);
}

SystemMessage system_message(const gnss::NavigationData& navigation, System system, GpsTime t) {
  SystemMessage message;
  const auto klobuchar = navigation.klobuchar.find(system);
  if (klobuchar != navigation.klobuchar.end()) message.klobuchar = klobuchar->second;
  if (navigation.galileo_nequick) message.nequick = *navigation.galileo_nequick;
  message.leap_seconds = navigation.leap_seconds.value_or(geodesy::leap_seconds(t));
  return message;
}

std::uint32_t unsent_ephemeris(gnss::SatelliteId id, const gnss::Signal& signal, GpsTime from, GpsTime to) {
  /// Messages of signals that have others than the one of their system near L1, as symbols.cpp sends them.
  struct Other {
    std::string_view signal;
    std::int64_t offset_s, period_s, of_frame;
    std::uint32_t needed;
  };
  constexpr std::int64_t kBdt_s = geodesy::kBdtSecondsOffset;
  static constexpr Other kOthers[]{{"L1C", 0, 18, 1, 1},
                                   {"L2C", 0, 12, 4, 0b111},
                                   {"L5", 0, 6, 4, 0b111},
                                   {"E5a", 0, 10, 5, 0b1111},
                                   {"E5b", 0, 2, 15, 0b1100'0000'0111},
                                   {"B1C", kBdt_s, 18, 1, 1},
                                   {"B2a", kBdt_s, 3, 4, 0b111},
                                   {"B2b", kBdt_s, 1, 2, 0b11}};
  Pace pace = pace_of(id, to);
  std::uint32_t needed = 0b111;
  const auto* other = std::find_if(std::begin(kOthers), std::end(kOthers),
                                   [&](const Other& o) { return o.signal == signal.name; });
  if (other != std::end(kOthers)) {
    const std::int64_t period = other->period_s * kSecond;
    pace = {other->offset_s * kSecond, period, period, other->of_frame};
    needed = other->needed;
  } else if (id.system == System::Galileo) {
    needed = 0b1'1100'0000'0011;
  } else if (id.system == System::GLONASS) {
    needed = 0b1111;
  } else if (id.system == System::SBAS) {
    pace = {0, kSecond, kSecond, 120};
    needed = 1;
  } else if (gnss::is_beidou_geo(id)) {
    needed = 0b11'1111'1111;
  }
  std::uint32_t unsent = 0;
  for (std::int64_t k = 0; needed >> k != 0; ++k) {
    if ((needed >> k & 1U) == 0) continue;
    // The last one that has ended.
    const std::int64_t first = pace.offset + k * pace.period, frame = pace.of_frame * pace.period;
    const std::int64_t start = first + floor_div(to.nanoseconds() - first - pace.duration, frame) * frame;
    if (start < from.nanoseconds()) unsent |= 1U << k;
  }
  return unsent;
}

std::chrono::nanoseconds Schedule::offset(gnss::SatelliteId id, GpsTime time) {
  return std::chrono::nanoseconds(pace_of(id, time).offset);
}

std::vector<SentMessage> Schedule::sent(const gnss::NavigationData& navigation, gnss::SatelliteId id,
                                        GpsTime from, GpsTime to) {
  std::vector<SentMessage> messages;
  if (id.system == System::SBAS) return messages;
  const Pace pace = pace_of(id, to);
  Current& current = current_[id];
  const std::int64_t last = to.nanoseconds() - pace.offset - pace.duration;
  std::int64_t k = floor_div(from.nanoseconds() - pace.offset - pace.duration, pace.period) + 1;
  for (; k * pace.period <= last; ++k) {
    const GpsTime start = GpsTime::from_nanoseconds(pace.offset + k * pace.period);
    const std::int64_t frame = floor_div(k, pace.of_frame);
    if (current.frame != frame) {
      const GpsTime frame_start =
          GpsTime::from_nanoseconds(pace.offset + frame * pace.of_frame * pace.period);
      current.frame = frame;
      current.ephemeris = std::monostate();
      if (id.system == System::GLONASS) {
        if (const auto* e = sent_record(navigation.glonass, id, frame_start)) current.ephemeris = *e;
      } else if (const auto* e = sent_ephemeris(navigation, id, frame_start)) {
        current.ephemeris = *e;
      }
    }
    SentMessage message{id, start, {}};
    if (const auto* kepler = std::get_if<gnss::KeplerEphemeris>(&current.ephemeris)) {
      message.words = words_of(*kepler, navigation, k, start);
    } else if (const auto* glonass = std::get_if<gnss::GlonassEphemeris>(&current.ephemeris)) {
      const auto string = static_cast<int>(k % 15) + 1;
      if (string <= 5) {
        const GpsTime frame_start = start - std::chrono::seconds(2 * (string - 1));
        message.words = glonass_string(*glonass, string, frame_start).words32();
      }
    }
    if (!message.words.empty()) messages.push_back(std::move(message));
  }
  return messages;
}

}  // namespace canyon::broadcast
