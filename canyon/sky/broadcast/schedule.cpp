#include "canyon/sky/broadcast/schedule.hpp"

#include <chrono>
#include <utility>

#include "canyon/base/arithmetic.hpp"
#include "canyon/base/geodesy/time_scales.hpp"

namespace canyon::broadcast {
namespace {

using geodesy::GpsTime;
using gnss::System;

constexpr std::int64_t kSecond = GpsTime::kNanosecondsPerSecond;

}  // namespace

SystemMessage system_message(const gnss::NavigationData& navigation, System system, GpsTime t) {
  SystemMessage message;
  const auto klobuchar = navigation.klobuchar.find(system);
  if (klobuchar != navigation.klobuchar.end()) message.klobuchar = klobuchar->second;
  if (navigation.galileo_nequick) message.nequick = *navigation.galileo_nequick;
  message.leap_seconds = navigation.leap_seconds.value_or(geodesy::leap_seconds(t));
  return message;
}

MessagePace pace_of(gnss::SatelliteId id, const gnss::Signal& signal, GpsTime t) {
  const auto pace = [](MessageKind kind, std::int64_t offset_s, std::int64_t period_s,
                       std::int64_t frame_messages, std::uint32_t needed) {
    return MessagePace{kind,  offset_s * kSecond, period_s * kSecond, period_s * kSecond, frame_messages,
                       needed};
  };
  constexpr std::int64_t kBdt_s = geodesy::kBdtSecondsOffset;
  switch (id.system) {
    case System::GPS:
    case System::QZSS:
      if (signal.name == "L1C") return pace(MessageKind::Cnav2, 0, 18, 1, 1);
      if (signal.name == "L2C") return pace(MessageKind::Cnav, 0, 12, 4, 0b111);
      if (signal.name == "L5") return pace(MessageKind::Cnav, 0, 6, 4, 0b111);
      break;
    case System::Galileo:
      if (signal.name == "E5a") return pace(MessageKind::Fnav, 0, 10, 5, 0b1111);
      if (signal.name == "E5b") return pace(MessageKind::Inav, 0, 2, 15, 0b1100'0000'0111);
      return pace(MessageKind::Inav, 1, 2, 15, 0b1'1100'0000'0011);
    case System::BeiDou:
      if (signal.name == "B1C") return pace(MessageKind::Bcnav1, kBdt_s, 18, 1, 1);
      if (signal.name == "B2a") return pace(MessageKind::Bcnav2, kBdt_s, 3, 4, 0b111);
      if (signal.name == "B2b") return pace(MessageKind::Bcnav3, kBdt_s, 1, 2, 0b11);
      if (!gnss::is_beidou_geo(id)) return pace(MessageKind::D1, kBdt_s, 6, 5, 0b111);
      return {MessageKind::D2, kBdt_s * kSecond, 3 * kSecond, kSecond * 6 / 10, 10, 0b11'1111'1111};
    case System::GLONASS:
      return pace(MessageKind::Glonass, geodesy::leap_seconds(t), 2, 15, 0b1111);
    case System::SBAS:
      return pace(MessageKind::Sbas, 0, 1, 120, 1);
  }
  return pace(MessageKind::Lnav, 0, 6, 5, 0b111);
}

CurrentMessage position_of(const MessagePace& pace, GpsTime t) {
  const std::int64_t k = floor_div(t.nanoseconds() - pace.offset, pace.period);
  const std::int64_t first = floor_div(k, pace.frame_messages) * pace.frame_messages;
  const auto start = [&](std::int64_t i) { return GpsTime::from_nanoseconds(pace.offset + i * pace.period); };
  return {start(k), start(first), static_cast<int>(k - first)};
}

std::vector<std::uint32_t> message_words(const gnss::NavigationData& navigation, gnss::SatelliteId id,
                                         const MessagePace& pace, const CurrentMessage& current) {
  const auto [start, frame_start, number] = current;
  if (pace.kind == MessageKind::Glonass) {
    const gnss::GlonassEphemeris* e = sent_record(navigation.glonass, id, frame_start);
    if (e == nullptr || number > 4) return {};
    return glonass_string(*e, number + 1, frame_start).words32();
  }
  const gnss::KeplerEphemeris* e = sent_record(navigation.kepler, id, frame_start);
  if (e == nullptr) return {};
  const SystemMessage message = system_message(navigation, id.system, start);
  if (pace.kind == MessageKind::Inav) {
    constexpr int kE1[]{2, 4, 6, -1, -1, 0, 0, 0, 0, 0, 1, 3, 5, 0, 0};  // -1: almanacs
    constexpr int kE5b[]{1, 3, 5, 0, 0, 0, 0, 0, 0, 0, 2, 4, 6, 0, 0};
    const int type = (pace.offset != 0 ? kE1 : kE5b)[number];
    if (type < 0) return {};
    return inav_page(inav_word(*e, message, type, start));
  }
  if (pace.kind == MessageKind::D2) return d2_page(*e, message, number + 1, start);
  if (number < 3) {
    return pace.kind == MessageKind::D1 ? d1_subframe(*e, message, number + 1, start)
                                        : lnav_subframe(*e, number + 1, start);
  }
  // The 25 pages restart with each week.
  const std::int64_t frame = start.nanosecond_of_week() / (30 * kSecond);
  const bool page18 = pace.kind == MessageKind::Lnav && number == 3 && frame % 25 == 17;
  if (!page18 || navigation.klobuchar.count(id.system) == 0) return {};
  return lnav_page18(id.system, message, start);
}

std::uint32_t unsent_ephemeris(gnss::SatelliteId id, const gnss::Signal& signal, GpsTime from, GpsTime to) {
  const MessagePace pace = pace_of(id, signal, to);
  std::uint32_t unsent = 0;
  for (std::int64_t k = 0; pace.needed >> k != 0; ++k) {
    if ((pace.needed >> k & 1U) == 0) continue;
    // The last completed one.
    const std::int64_t first = pace.offset + k * pace.period, frame = pace.frame_messages * pace.period;
    const std::int64_t start = first + floor_div(to.nanoseconds() - first - pace.duration, frame) * frame;
    if (start < from.nanoseconds()) unsent |= 1U << k;
  }
  return unsent;
}

std::vector<SentMessage> sent_messages(const gnss::NavigationData& navigation, gnss::SatelliteId id,
                                       GpsTime from, GpsTime to) {
  std::vector<SentMessage> messages;
  if (id.system == System::SBAS) return messages;
  const MessagePace pace = pace_of(id, gnss::signals_of(id.system).front(), to);
  const std::chrono::nanoseconds duration(pace.duration), period(pace.period);
  for (GpsTime t = position_of(pace, from - duration).start + period; t + duration <= to; t = t + period) {
    std::vector<std::uint32_t> words = message_words(navigation, id, pace, position_of(pace, t));
    if (!words.empty()) messages.push_back({id, t, std::move(words)});
  }
  return messages;
}

}  // namespace canyon::broadcast
