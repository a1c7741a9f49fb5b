#include "canyon/outputs/output/sbf/block.hpp"

#include <algorithm>
#include <initializer_list>

#include "canyon/base/payload.hpp"

namespace canyon::output::sbf {

using gnss::System;

std::uint16_t crc16(std::string_view bytes) {
  std::uint32_t crc = 0;
  for (const char c : bytes) {
    crc ^= static_cast<std::uint32_t>(static_cast<unsigned char>(c)) << 8;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 0x8000) != 0 ? crc << 1 ^ 0x1021 : crc << 1;
    crc &= 0xFFFF;
  }
  return static_cast<std::uint16_t>(crc);
}

std::string block(BlockId id, const std::optional<geodesy::GpsTime>& time, std::string_view body) {
  constexpr std::size_t kHeader = 14;
  constexpr std::int64_t kMillisecond = 1'000'000, kWeek_ms = 604'800'000;
  const std::size_t length = (kHeader + body.size() + 3) / 4 * 4;
  std::uint32_t time_of_week_ms = 0xFFFFFFFF;
  std::uint32_t week = 0xFFFF;
  if (time) {
    const std::int64_t ms = time->nanoseconds() / kMillisecond;
    time_of_week_ms = static_cast<std::uint32_t>(ms % kWeek_ms);
    week = static_cast<std::uint32_t>(ms / kWeek_ms);
  }
  Payload rest;
  rest.u2(id.number | id.revision << 13).u2(length).u4(time_of_week_ms).u2(week).raw(body);
  rest.zeros(length - kHeader - body.size());
  return Payload().raw("$@").u2(crc16(rest.bytes())).raw(rest.bytes()).bytes();
}

std::optional<std::uint8_t> satellite_number(gnss::SatelliteId id) {
  struct Range {
    System system;
    int first, last, offset;
  };
  static constexpr Range kRanges[]{
      {System::GPS, 1, 37, 0},      {System::GLONASS, 1, 24, 37},  {System::GLONASS, 25, 30, 38},
      {System::Galileo, 1, 36, 70}, {System::SBAS, 20, 40, 100},   {System::SBAS, 41, 58, 157},
      {System::BeiDou, 1, 40, 140}, {System::BeiDou, 41, 63, 182}, {System::QZSS, 1, 10, 180}};
  for (const Range& r : kRanges) {
    if (id.system == r.system && id.number >= r.first && id.number <= r.last)
      return static_cast<std::uint8_t>(id.number + r.offset);
  }
  return std::nullopt;
}

int frequency_number(gnss::SatelliteId id, const std::map<gnss::SatelliteId, int>& channels) {
  const auto channel = channels.find(id);
  return channel == channels.end() ? 0 : channel->second + 8;
}

std::optional<int> status_place(const gnss::Signal& signal) {
  // The numbers of the signals that share a place.
  static constexpr std::initializer_list<int> kNumbers[]{
      {0, 6, 8, 24, 28},  // L1CA of GPS, QZSS, GLONASS and SBAS; B1I
      {7, 17, 29},        // QZSS L2C; E1; B2I
      {2, 26, 30},        // GPS L2P; QZSS L5; B3I
      {3, 11, 13},        // GPS L2C; GLONASS L2CA; B1C
      {4, 14, 20, 32},    // GPS L5; B2a; E5a; QZSS L1C
      {5, 21, 34}};       // GPS L1C; E5b; B2b
  for (int place = 0; const auto& numbers : kNumbers) {
    if (std::find(numbers.begin(), numbers.end(), signal.sbf) != numbers.end()) return place;
    ++place;
  }
  return std::nullopt;
}

}  // namespace canyon::output::sbf
