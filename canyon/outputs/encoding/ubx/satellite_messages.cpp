#include <algorithm>
#include <cmath>
#include <span>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/outputs/encoding/ubx/messages.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"

namespace canyon::encoding::ubx {
namespace {

using gnss::System;
using receiver::SatelliteObservation;
using receiver::SignalObservation;

constexpr std::size_t kMaxEntries = 255;  // counts are one byte

int degrees(double rad) {
  return static_cast<int>(std::lround(geodesy::degrees(rad)));
}

/// [0, 360).
int azimuth_deg(double rad) {
  const int deg = degrees(rad) % 360;
  return deg < 0 ? deg + 360 : deg;
}

std::uint64_t strength(const SignalObservation& signal) {
  if (!signal.measurement || !signal.measurement->cn0_dbhz) return 0;
  return static_cast<std::uint64_t>(std::clamp(std::lround(*signal.measurement->cn0_dbhz), 0L, 255L));
}

/// qualityInd: 1 searching, 4 code locked, 7 code and carrier locked.
std::uint64_t quality(const SignalObservation& signal) {
  if (!signal.measurement) return 1;
  return signal.measurement->carrier_phase_cycles ? 7 : 4;
}

/// freqId: for GLONASS the channel + 7.
std::uint64_t frequency(gnss::SatelliteId id, const std::map<gnss::SatelliteId, int>& channels) {
  if (id.system != gnss::System::GLONASS) return 0;
  const auto channel = channels.find(id);
  return static_cast<std::uint64_t>((channel == channels.end() ? 0 : channel->second) + 7);
}

/// The largest n in [least, 15] with base 2^n <= sigma. A recorded NEO-F9P with known noise in a laboratory
/// reports the next lower step; no recorded value is below 0.08 m.
std::uint64_t doubling(double sigma, double base, double least) {
  return static_cast<std::uint64_t>(std::clamp(std::floor(std::log2(sigma / base) + 1e-9), least, 15.0));
}

/// Corrections of a satellite used in a solution: code (bit 0), phase (bit 1).
std::uint64_t corrections(const receiver::ReceiverEpoch& seen, bool used) {
  if (!used || !corrected(seen.fix.kind())) return 0;
  return seen.fix.kind() == positioning::FixKind::Differential ? 1 : 3;
}

/// Numbers from `first` to `last` of a system, shifted by `offset`.
struct Range {
  System system;
  std::uint8_t gnss;
  int first, last, offset;
};

std::optional<SatelliteName> name_in(std::span<const Range> ranges, gnss::SatelliteId id) {
  for (const Range& r : ranges)
    if (id.system == r.system && id.number >= r.first && id.number <= r.last)
      return SatelliteName{r.gnss, static_cast<std::uint8_t>(id.number + r.offset)};
  return std::nullopt;
}

}  // namespace

// 3.15.16
std::string nav_sat(const UbxEpoch& epoch) {
  Payload list;
  std::size_t count = 0;
  for (const SatelliteObservation& s : epoch.seen.satellites) {
    const auto name = satellite_name(s.id);
    if (!name || count == kMaxEntries) continue;
    ++count;
    const bool used = s.used && epoch.seen.fix.solved();
    list.u1(name->gnss).u1(name->satellite).u1(strength(s));
    list.u1(degrees(s.elevation_rad));
    list.u2(azimuth_deg(s.azimuth_rad));
    list.signed_field(positioning::residual_m(epoch.seen.fix, s.id).value_or(0), 0.1, 2);
    const std::uint64_t corrections_used = corrections(epoch.seen, used);
    // A measured satellite is healthy; its orbit is from a known ephemeris. Corrections are from RTCM.
    list.u4(quality(s) | (used ? 1 << 3 : 0) | (s.measurement ? 1 << 4 | 1 << 8 | 1 << 11 : 0) |
            (corrections_used != 0 ? 1 << 6 | 1 << 17 : 0) | corrections_used << 20);
  }
  return Payload().u4(itow(epoch)).u1(1).u1(count).zeros(2).raw(list.bytes()).bytes();
}

// 3.15.17
std::string nav_sig(const UbxEpoch& epoch) {
  Payload list;
  std::size_t count = 0;
  for (const SatelliteObservation& s : epoch.seen.satellites) {
    const auto name = satellite_name(s.id);
    if (!name) continue;
    const auto entry = [&](const SignalObservation& signal, const gnss::Signal& of, bool used) {
      const auto number = signal_number(s.id, of);
      if (!number || count == kMaxEntries) return;
      ++count;
      list.u1(name->gnss).u1(name->satellite).u1(*number).u1(frequency(s.id, epoch.glonass_channels));
      list.signed_field(used ? positioning::residual_m(epoch.seen.fix, s.id).value_or(0) : 0, 0.1, 2)
          .u1(strength(signal))
          .u1(quality(signal));
      const std::uint64_t corrections_used = corrections(epoch.seen, used);
      list.u1(corrections_used != 0 ? 4 : 0);     // RTCM 3, observations of a base
      list.u1(s.estimated_ionosphere_m ? 1 : 0);  // Klobuchar
      list.u2((signal.measurement ? 1 : 0) |
              (used ? 1 << 3 | (signal.measurement->doppler_hz ? 1 << 5 : 0) : 0) | corrections_used << 6);
      list.zeros(4);
    };
    const bool used = s.used && s.measurement && epoch.seen.fix.solved();
    entry(s, s.signal != nullptr ? *s.signal : gnss::signals_of(s.id.system).front(), used);
    for (const SignalObservation& other : s.more) entry(other, *other.signal, false);
  }
  return Payload().u4(itow(epoch)).u1(0).u1(count).zeros(2).raw(list.bytes()).bytes();
}

// UBX-13003221, 32.17.26.
std::string nav_svinfo(const UbxEpoch& epoch) {
  Payload list;
  std::size_t count = 0;
  for (const SatelliteObservation& s : epoch.seen.satellites) {
    const int number = single_number(s.id);
    if (number == 0 || count == kMaxEntries) continue;
    const bool used = s.used && epoch.seen.fix.solved();
    list.u1(count++).u1(number);
    list.u1((used ? 1 : 0) | (corrections(epoch.seen, used) != 0 ? 2 : 0) | (s.measurement ? 0b1100 : 0))
        .u1(quality(s))
        .u1(strength(s));
    list.u1(degrees(s.elevation_rad));
    list.u2(azimuth_deg(s.azimuth_rad));
    list.signed_field(positioning::residual_m(epoch.seen.fix, s.id).value_or(0), 0.01, 4);
  }
  return Payload().u4(itow(epoch)).u1(count).u1(4).zeros(2).raw(list.bytes()).bytes();  // 4: u-blox 8 / M8
}

// 3.17.6
std::string rxm_rawx(const UbxEpoch& epoch) {
  Payload list;
  std::size_t count = 0;
  for (const RawObservation& raw : epoch.raw.observations) {
    const auto name = satellite_name(raw.id);
    const auto signal = signal_number(raw.id, *raw.signal);
    const bool m8 = epoch.generation == Generation::M8;
    if (!name || !signal || count == kMaxEntries || (m8 && gnss::index_of(*raw.signal) != 0)) continue;
    ++count;
    const positioning::Measurement& m = *raw.measurement;
    double phase = raw.carrier_phase_cycles.value_or(0);
    // u-blox's phases of geostationary BeiDou satellites are half a cycle off; readers correct this.
    const bool d2 = raw.id.system == gnss::System::BeiDou && message_signal(raw.id) == 1;
    if (raw.carrier_phase_cycles && d2) phase -= 0.5;
    list.r8(raw.pseudorange_m).r8(phase).r4(static_cast<float>(m.doppler_hz.value_or(0)));
    list.u1(name->gnss)
        .u1(name->satellite)
        .u1(m8 ? 0 : *signal)
        .u1(frequency(raw.id, epoch.glonass_channels));
    list.u2(std::clamp(std::floor(raw.locked_s * 1e3 + 1e-6), 0.0, 64500.0));
    list.u1(m.cn0_dbhz ? static_cast<std::uint64_t>(std::clamp(std::lround(*m.cn0_dbhz), 0L, 255L)) : 0);
    list.u1(doubling(m.sigma_m, 0.01, 3));
    list.u1(raw.carrier_phase_cycles ? static_cast<std::uint64_t>(std::clamp(
                                           std::floor(m.carrier_phase_sigma_cycles / 0.004), 1.0, 14.0))
                                     : 15);
    list.u1(doubling(m.doppler_sigma_hz, 0.002, 0));
    list.u1(raw.carrier_phase_cycles ? 0b111 : 0b001).u1(0);
  }
  const geodesy::GpsTime t = epoch.seen.reported(epoch.raw.tag);
  Payload p;
  p.r8(t.seconds_of_week()).u2(t.week());
  p.u1(geodesy::leap_seconds(epoch.seen.time)).u1(count).u1(1).u1(1).zeros(2);
  return p.raw(list.bytes()).bytes();
}

// 3.17.9
std::string subframe_payload(const broadcast::SentMessage& message, Generation generation,
                             const std::map<gnss::SatelliteId, int>& glonass_channels) {
  const SatelliteName name = satellite_name(message.id).value_or(SatelliteName{});
  std::vector<std::uint32_t> words = message.words;
  if (message.id.system == gnss::System::GLONASS) {
    // Added by the receiver: superframe of the day and frame within it, both from 1.
    const geodesy::CalendarTime moscow = geodesy::glonass_from_gps(message.start);
    const auto frame =
        static_cast<std::uint32_t>(((moscow.hour * 60 + moscow.minute) * 60 + moscow.second) / 30);
    words.push_back((frame / 5 + 1) << 16 | (frame % 5 + 1));
  }
  // LNAV as output by u-blox: parity as if the bit before the word were 0; the highest bit of the word is the
  // bit before that bit.
  if (message.id.system == gnss::System::GPS || message.id.system == gnss::System::QZSS) {
    for (std::size_t i = words.size() - 1; i > 0; --i) {
      const std::uint32_t d29 = words[i - 1] >> 1 & 1, d30 = words[i - 1] & 1;
      words[i] = (words[i] ^ (d30 != 0 ? 63U : 0U)) | (d29 ^ d30) << 31;
    }
  }
  // E1-B pages have a ninth word, not documented by u-blox; readers use it to recognise E5b pages.
  if (message.id.system == gnss::System::Galileo) words.push_back(0);
  Payload p;
  p.u1(name.gnss).u1(name.satellite).u1(generation == Generation::M8 ? 0 : message_signal(message.id));
  p.u1(frequency(message.id, glonass_channels)).u1(words.size()).u1(0).u1(2).u1(0);
  for (const std::uint32_t word : words) p.u4(word);
  return p.bytes();
}

std::optional<SatelliteName> satellite_name(gnss::SatelliteId id) {
  static constexpr Range kRanges[]{{System::GPS, 0, 1, 32, 0},     {System::SBAS, 1, 20, 58, 100},
                                   {System::Galileo, 2, 1, 36, 0}, {System::BeiDou, 3, 1, 63, 0},
                                   {System::QZSS, 5, 1, 10, 0},    {System::GLONASS, 6, 1, 32, 0}};
  return name_in(kRanges, id);
}

int single_number(gnss::SatelliteId id) {
  static constexpr Range kRanges[]{{System::GPS, 0, 1, 32, 0},       {System::SBAS, 1, 20, 58, 100},
                                   {System::Galileo, 2, 1, 36, 210}, {System::BeiDou, 3, 1, 5, 158},
                                   {System::BeiDou, 3, 6, 37, 27},   {System::QZSS, 5, 1, 10, 192},
                                   {System::GLONASS, 6, 1, 32, 64}};
  return name_in(kRanges, id).value_or(SatelliteName{}).satellite;
}

std::optional<std::uint8_t> signal_number(gnss::SatelliteId id, const gnss::Signal& signal) {
  const int number = gnss::is_beidou_geo(id) && signal.ubx_geo >= 0 ? signal.ubx_geo : signal.ubx;
  if (number < 0) return std::nullopt;
  return static_cast<std::uint8_t>(number);
}

std::uint8_t message_signal(gnss::SatelliteId id) {
  return id.system == System::Galileo || gnss::is_beidou_geo(id) ? 1 : 0;
}

}  // namespace canyon::encoding::ubx
