#include "canyon/outputs/encoding/rtcm.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/outputs/encoding/epoch_values.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::encoding::rtcm {

using broadcast::Bits;
using canyon::rtcm::kMillisecond_m;
using canyon::rtcm::kMsmSystems;
using geodesy::GpsTime;
using gnss::System;

namespace {

constexpr std::int64_t kMillisecond_ns = 1'000'000;
constexpr std::size_t kMaxCells = 64;
constexpr int kRoughSteps = 1024;   ///< of a millisecond: DF398
constexpr int kNoRoughRange = 255;  ///< ms, DF397

/// A signed field's value, or its mark for "none" (the minimum value) if out of range.
std::int64_t or_none(double value, int width) {
  const std::int64_t none = -(std::int64_t{1} << (width - 1));
  const double whole = std::round(value);
  return std::abs(whole) < static_cast<double>(-none) ? static_cast<std::int64_t>(whole) : none;
}
std::int64_t none(int width) {
  return or_none(std::ldexp(1.0, width), width);
}

/// DF004, DF416 with DF034, DF248, DF427, DF428: 30 bits.
std::uint64_t epoch_time(System system, GpsTime tag) {
  if (system == System::BeiDou) tag = tag - std::chrono::seconds(geodesy::kBdtSecondsOffset);
  if (system != System::GLONASS)
    return static_cast<std::uint64_t>(tag.nanosecond_of_week() / kMillisecond_ns);
  geodesy::CalendarTime moscow = geodesy::glonass_from_gps(tag);
  moscow.second = std::min(moscow.second, 59);
  // Milliseconds of a week that begins on Sunday, as in GPS.
  const std::int64_t ms = geodesy::gps_from_calendar(moscow).nanosecond_of_week() / kMillisecond_ns;
  constexpr std::int64_t kDay_ms = 86'400'000;
  return static_cast<std::uint64_t>(ms / kDay_ms) << 27 | static_cast<std::uint64_t>(ms % kDay_ms);
}

}  // namespace

struct Observations::Satellite {
  struct Cell {
    int signal = 0;  ///< in the mask
    double range_m = 0;
    std::optional<double> phase_range_m, rate_mps;
    double lock_s = 0, cn0_dbhz = 0;
  };
  int number = 0;          ///< in the mask
  unsigned extended = 0;   ///< DF419: of GLONASS the frequency channel
  std::int64_t rough = 0;  ///< range [1/1024 ms]
  std::int64_t rough_mps = none(14);
  std::vector<Cell> cells;  ///< by signal
};

std::vector<Observations::Satellite> Observations::satellites_of(const RawEpoch& raw, System system) const {
  std::vector<Satellite> satellites;
  for (auto o = raw.observations.begin(); o != raw.observations.end();) {
    const gnss::SatelliteId id = o->id;
    if (id.system != system) {
      ++o;
      continue;
    }
    Satellite satellite;
    satellite.number = canyon::rtcm::mask_number(id);
    for (; o != raw.observations.end() && o->id == id; ++o) {
      const positioning::Measurement& m = *o->measurement;
      const double wavelength_m = geodesy::kSpeedOfLight / m.carrier_frequency_hz;
      Satellite::Cell cell;
      cell.signal = o->signal->msm;
      cell.range_m = o->pseudorange_m;
      if (o->carrier_phase_cycles) cell.phase_range_m = *o->carrier_phase_cycles * wavelength_m;
      cell.lock_s = o->locked_s;
      if (o->doppler_hz) cell.rate_mps = -*o->doppler_hz * wavelength_m;
      cell.cn0_dbhz = m.cn0_dbhz.value_or(0);
      if (cell.signal != 0) satellite.cells.push_back(cell);
    }
    if (satellite.cells.empty() || satellite.number == 0) continue;
    const auto [low, high] =
        std::minmax_element(satellite.cells.begin(), satellite.cells.end(),
                            [](const auto& a, const auto& b) { return a.range_m < b.range_m; });
    const double middle_ms = (low->range_m + high->range_m) / 2 / kMillisecond_m;
    if (!(middle_ms >= 0 && middle_ms < kNoRoughRange - 1)) continue;
    satellite.rough = std::llround(middle_ms * kRoughSteps);
    // Rates over different paths may exceed the range of fine rates: the mid-range loses fewest.
    double least_mps = HUGE_VAL, max_mps = -HUGE_VAL;
    for (const auto& cell : satellite.cells) {
      if (!cell.rate_mps) continue;
      least_mps = std::min(least_mps, *cell.rate_mps);
      max_mps = std::max(max_mps, *cell.rate_mps);
    }
    satellite.rough_mps = or_none((least_mps + max_mps) / 2, 14);
    std::sort(satellite.cells.begin(), satellite.cells.end(),
              [](const auto& a, const auto& b) { return a.signal < b.signal; });
    if (system == System::GLONASS) {
      const auto channel = glonass_channels_.find(id);
      const bool known = channel != glonass_channels_.end() && channel->second <= 6;
      satellite.extended = known ? static_cast<unsigned>(channel->second + 7) : 15;
    }
    satellites.push_back(std::move(satellite));
  }
  return satellites;
}

std::vector<Bits> Observations::messages(const receiver::ReceiverEpoch& seen, std::span<const int> numbers) {
  const RawEpoch raw = observations_.next(seen);
  const GpsTime tag = raw.tag;
  // A message has at most 64 cells, including cells of signals that a satellite does not have.
  struct Part {
    int number;
    System system;
    std::set<int> signals;
    std::vector<Satellite> satellites;
  };
  std::vector<Part> parts;
  for (const int number : numbers) {
    const System system = kMsmSystems.at(static_cast<std::size_t>(number - 1070) / 10);
    std::set<int> signals;
    std::vector<Satellite> all = satellites_of(raw, system);
    for (const Satellite& satellite : all)
      for (const auto& cell : satellite.cells) signals.insert(cell.signal);
    const std::size_t room = signals.empty() ? 1 : kMaxCells / signals.size();
    for (std::size_t i = 0; i < all.size(); i += room) {
      const auto begin = all.begin() + static_cast<std::ptrdiff_t>(i);
      const auto end = all.begin() + static_cast<std::ptrdiff_t>(std::min(i + room, all.size()));
      parts.push_back(
          {number, system, signals, {std::make_move_iterator(begin), std::make_move_iterator(end)}});
    }
  }

  std::vector<Bits> messages;
  for (const Part& part : parts) {
    const bool precise = part.number % 10 == 7;  // MSM7, else MSM4
    Bits bits;
    bits.put(static_cast<std::uint64_t>(part.number), 12).put(0, 12).put(epoch_time(part.system, tag), 30);
    bits.put(messages.size() + 1 < parts.size() ? 1 : 0, 1);  // more messages of this epoch follow
    bits.put(0,
             3 + 7 + 2 + 2 + 1 + 3);  // IODS, reserved, steering, external clock, smoothing and its interval
    std::uint64_t satellite_mask = 0, signal_mask = 0;
    for (const Satellite& satellite : part.satellites)
      satellite_mask |= std::uint64_t{1} << (64 - satellite.number);
    for (const int signal : part.signals) signal_mask |= std::uint64_t{1} << (32 - signal);
    bits.put(satellite_mask, 64).put(signal_mask, 32);
    for (const Satellite& satellite : part.satellites) {
      for (const int signal : part.signals) {
        const bool has = std::any_of(satellite.cells.begin(), satellite.cells.end(),
                                     [signal](const auto& cell) { return cell.signal == signal; });
        bits.put(has ? 1 : 0, 1);
      }
    }
    const auto each_satellite = [&](const auto& put) {
      for (const Satellite& satellite : part.satellites) put(satellite);
    };
    each_satellite(
        [&](const Satellite& s) { bits.put(static_cast<std::uint64_t>(s.rough / kRoughSteps), 8); });
    if (precise) each_satellite([&](const Satellite& s) { bits.put(s.extended, 4); });
    each_satellite(
        [&](const Satellite& s) { bits.put(static_cast<std::uint64_t>(s.rough % kRoughSteps), 10); });
    if (precise) each_satellite([&](const Satellite& s) { bits.count(s.rough_mps, 14); });
    const auto each_cell = [&](const auto& put) {
      for (const Satellite& satellite : part.satellites) {
        const double rough_m = static_cast<double>(satellite.rough) / kRoughSteps * kMillisecond_m;
        for (const auto& cell : satellite.cells) put(satellite, cell, rough_m);
      }
    };
    using Cell = Satellite::Cell;
    const int code_bits = precise ? 20 : 15, phase_bits = precise ? 24 : 22;
    each_cell([&](const Satellite&, const Cell& c, double rough_m) {
      const double fine_ms = (c.range_m - rough_m) / kMillisecond_m;
      bits.count(or_none(std::ldexp(fine_ms, precise ? 29 : 24), code_bits), code_bits);
    });
    each_cell([&](const Satellite&, const Cell& c, double rough_m) {
      const double fine_ms = (c.phase_range_m.value_or(HUGE_VAL) - rough_m) / kMillisecond_m;
      bits.count(or_none(std::ldexp(fine_ms, precise ? 31 : 29), phase_bits), phase_bits);
    });
    each_cell([&](const Satellite&, const Cell& c, double) {
      bits.put(static_cast<std::uint64_t>(canyon::rtcm::lock_time_indicator(c.lock_s, precise)),
               precise ? 10 : 4);
    });
    each_cell([&](const Satellite&, const Cell&, double) { bits.put(0, 1); });  // no half cycles
    each_cell([&](const Satellite&, const Cell& c, double) {
      bits.positive(c.cn0_dbhz, precise ? 1.0 / 16 : 1, precise ? 10 : 6);
    });
    if (precise) {
      each_cell([&](const Satellite& s, const Cell& c, double) {
        const bool has = c.rate_mps && s.rough_mps != none(14);
        bits.count(has ? or_none((*c.rate_mps - static_cast<double>(s.rough_mps)) * 1e4, 15) : none(15), 15);
      });
    }
    messages.push_back(std::move(bits));
  }
  return messages;
}

using broadcast::Bits;
using geodesy::GpsTime;
using gnss::KeplerEphemeris;
using gnss::System;

namespace {

constexpr double kRepeat_s = 30;

/// A message's first fields: its number and the satellite.
Bits head(int message, int satellite, int satellite_bits) {
  return Bits().count(message, 12).count(satellite, satellite_bits);
}

/// Resolutions that differ between systems.
struct Steps {
  int correction_bits;
  double correction;
  int radius_bits;
  double radius;
  int toe_bits, toe_s;
};
constexpr Steps kGps{16, 0x1p-29, 16, 0x1p-5, 16, 16}, kGalileo{16, 0x1p-29, 16, 0x1p-5, 14, 60},
    kBeiDou{18, 0x1p-31, 18, 0x1p-6, 17, 8};

/// The fields common to all Keplerian messages, in the same order: Crs to Cus, the square root of the axis,
/// toe, Cic to OMEGA DOT.
void put_orbit(Bits& to, const KeplerEphemeris& e, const Steps& s, double toe_s) {
  to.number(e.crs, s.radius, s.radius_bits)
      .angle(e.mean_motion_difference, 0x1p-43, 16)
      .angle(e.mean_anomaly, 0x1p-31, 32)
      .number(e.cuc, s.correction, s.correction_bits)
      .positive(e.eccentricity, 0x1p-33, 32)
      .number(e.cus, s.correction, s.correction_bits)
      .positive(e.sqrt_a, 0x1p-19, 32)
      .positive(toe_s, s.toe_s, s.toe_bits)
      .number(e.cic, s.correction, s.correction_bits)
      .angle(e.right_ascension, 0x1p-31, 32)
      .number(e.cis, s.correction, s.correction_bits)
      .angle(e.inclination, 0x1p-31, 32)
      .number(e.crc, s.radius, s.radius_bits)
      .angle(e.argument_of_perigee, 0x1p-31, 32)
      .angle(e.right_ascension_rate, 0x1p-43, 24);
}

int fit_flag(const KeplerEphemeris& e) {
  return e.fit_interval_h > 4 ? 1 : 0;
}

Bits gps(const KeplerEphemeris& e) {
  Bits w = head(1019, e.id.number, 6);
  w.count(e.toe.week(), 10)
      .count(broadcast::accuracy_index(e.accuracy_m), 4)
      .count(e.data_sources, 2)
      .angle(e.inclination_rate, 0x1p-43, 14)
      .count(e.iode, 8)
      .positive(e.toc.seconds_of_week(), 16, 16)
      .number(e.af2, 0x1p-55, 8)
      .number(e.af1, 0x1p-43, 16)
      .number(e.af0, 0x1p-31, 22)
      .count(e.iodc, 10);
  put_orbit(w, e, kGps, e.toe.seconds_of_week());
  return w.number(e.group_delay[0], 0x1p-31, 8).count(e.health, 6).count(e.l2p_flag, 1).count(fit_flag(e), 1);
}

Bits qzss(const KeplerEphemeris& e) {
  Bits w = head(1044, e.id.number, 4);
  w.positive(e.toc.seconds_of_week(), 16, 16)
      .number(e.af2, 0x1p-55, 8)
      .number(e.af1, 0x1p-43, 16)
      .number(e.af0, 0x1p-31, 22)
      .count(e.iode, 8);
  put_orbit(w, e, kGps, e.toe.seconds_of_week());
  return w.angle(e.inclination_rate, 0x1p-43, 14)
      .count(e.data_sources, 2)
      .count(e.toe.week(), 10)
      .count(broadcast::accuracy_index(e.accuracy_m), 4)
      .count(e.health, 6)
      .number(e.group_delay[0], 0x1p-31, 8)
      .count(e.iodc, 10)
      .count(fit_flag(e), 1);
}

Bits galileo(const KeplerEphemeris& e) {
  constexpr int kWeekOffset = 1024;  // of Galileo's week 0, 1999-08-22
  const bool fnav = is_galileo_fnav(e);
  Bits w = head(fnav ? 1045 : 1046, e.id.number, 6);
  w.count(e.toe.week() - kWeekOffset, 12)
      .count(e.iode, 10)
      .count(broadcast::sisa_index(e.accuracy_m), 8)
      .angle(e.inclination_rate, 0x1p-43, 14)
      .positive(e.toc.seconds_of_week(), 60, 14)
      .number(e.af2, 0x1p-59, 6)
      .number(e.af1, 0x1p-46, 21)
      .number(e.af0, 0x1p-34, 31);
  put_orbit(w, e, kGalileo, e.toe.seconds_of_week());
  w.number(e.group_delay[0], 0x1p-32, 10);
  // RINEX combines the flags in one word: data validity and two bits of health of E1-B, E5a, E5b.
  const auto health = [&](int at) { w.count(e.health >> (at + 1), 2).count(e.health >> at, 1); };
  if (fnav) {
    health(3);
    return w.count(0, 7);
  }
  w.number(e.group_delay[1], 0x1p-32, 10);
  health(6);
  health(0);
  return w.count(0, 2);
}

Bits beidou(const KeplerEphemeris& e) {
  const std::chrono::seconds offset(geodesy::kBdtSecondsOffset);
  const GpsTime toe = e.toe - offset, toc = e.toc - offset;  // BDT
  constexpr double kGroupDelay_s = 1e-10;
  Bits w = head(1042, e.id.number, 6);
  w.count(toe.week() - geodesy::kBdtWeekOffset, 13)
      .count(broadcast::accuracy_index(e.accuracy_m), 4)
      .angle(e.inclination_rate, 0x1p-43, 14)
      .count(e.iode, 5)
      .positive(toc.seconds_of_week(), 8, 17)
      .number(e.af2, 0x1p-66, 11)
      .number(e.af1, 0x1p-50, 22)
      .number(e.af0, 0x1p-33, 24)
      .count(e.iodc, 5);
  put_orbit(w, e, kBeiDou, toe.seconds_of_week());
  return w.number(e.group_delay[0], kGroupDelay_s, 10)
      .number(e.group_delay[1], kGroupDelay_s, 10)
      .count(e.health, 1);
}

}  // namespace

Bits ephemeris(const KeplerEphemeris& e) {
  const int n = e.id.number;
  switch (e.id.system) {
    case System::GPS:
      return n <= 32 ? gps(e) : Bits();
    case System::QZSS:
      return n <= 10 ? qzss(e) : Bits();
    case System::Galileo:
      return n <= 36 ? galileo(e) : Bits();
    case System::BeiDou:
      return n <= 63 ? beidou(e) : Bits();
    case System::GLONASS:
    case System::SBAS:
      break;
  }
  return {};
}

// DF104 to DF136 are as the strings of the satellite's own message (ICD GLONASS L1, L2 5.1, table 4.5).
Bits ephemeris(const gnss::GlonassEphemeris& e) {
  if (e.id.number > 24) return {};
  const geodesy::CalendarTime tb = geodesy::glonass_from_gps(e.toe),
                              tk = geodesy::glonass_from_gps(e.transmission);
  const int tb_minutes = tb.hour * 60 + tb.minute;
  // Four-year intervals count from 1996, days from 1 January of the leap year.
  const int four_years = (tb.year - 1996) / 4;
  const GpsTime first_day = geodesy::gps_from_calendar({.year = 1996 + 4 * four_years, .month = 1, .day = 1});
  const GpsTime day = geodesy::gps_from_calendar({.year = tb.year, .month = tb.month, .day = tb.day});
  const int day_number = static_cast<int>((day - first_day) / 86'400) + 1;
  constexpr double kKilo = 1e3;

  Bits w = head(1020, e.id.number, 6);
  w.count(e.channel + 7, 5)
      .count(0, 1 + 1)  // almanac health: not available
      .count(1, 2)      // P1: tb changes every 30 min
      .count(tk.hour, 5)
      .count(tk.minute, 6)
      .count(tk.second >= 30 ? 1 : 0, 1)
      .count(e.health != 0 ? 1 : 0, 1)
      .count(tb_minutes / 15 % 2, 1)  // P2: tb is an odd quarter of an hour
      .count(tb_minutes / 15, 7);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    w.sign_magnitude(e.velocity_mps[axis] / kKilo, 0x1p-20, 24)
        .sign_magnitude(e.position_m[axis] / kKilo, 0x1p-11, 27)
        .sign_magnitude(e.acceleration_mps2[axis] / kKilo, 0x1p-30, 5);
  }
  return w
      .count(0, 1)  // P3: four satellites in the almanac's frame
      .sign_magnitude(e.frequency_bias, 0x1p-40, 11)
      .count(0, 2)                      // P
      .count(e.health != 0 ? 1 : 0, 1)  // ln
      .sign_magnitude(-e.clock_bias_s, 0x1p-30, 22)
      .sign_magnitude(e.group_delay_difference_s, 0x1p-30, 5)
      .positive(e.age_days, 1, 5)
      .count(0, 1 + 4)  // P4, FT
      .count(day_number, 11)
      .count(1, 2)            // GLONASS-M
      .count(0, 1 + 11 + 32)  // no data of string 5: NA, tau c
      .count(four_years + 1, 5)
      .count(0, 22)  // tau GPS
      .count(e.health != 0 ? 1 : 0, 1)
      .count(0, 7);
}

template <typename Ephemeris>
void Ephemerides::add_due(const std::vector<Ephemeris>& records, const simulation::Epoch& epoch,
                          std::vector<Bits>& messages) {
  const GpsTime now = epoch.observed.time;
  // As in the simulated sky: the nearest in time, the newer of two.
  std::map<Key, const Ephemeris*> nearest;
  for (const auto& satellite : epoch.observed.satellites) {
    if (!measured(satellite)) continue;
    nearest[{satellite.id, false}] = nullptr;
    if (satellite.id.system == System::Galileo) nearest[{satellite.id, true}] = nullptr;
  }
  for (const Ephemeris& record : records) {
    Key key{record.id, false};
    if constexpr (std::is_same_v<Ephemeris, KeplerEphemeris>) key.second = is_galileo_fnav(record);
    const auto at = nearest.find(key);
    if (at == nearest.end()) continue;
    if (at->second == nullptr || std::abs(now - record.toe) <= std::abs(now - at->second->toe))
      at->second = &record;
  }
  for (const auto& [key, record] : nearest) {
    if (record == nullptr || !validity(*record).contains(now - record->toe)) continue;
    const auto [sent, first] = sent_.try_emplace(key);
    Sent& last = sent->second;
    Bits message = ephemeris(*record);
    if (!first && last.message == message && now - last.at < kRepeat_s) continue;
    if (message.size() > 0) messages.push_back(message);
    last = {now, std::move(message)};
  }
}

std::vector<Bits> Ephemerides::due(const simulation::Epoch& epoch) {
  std::vector<Bits> messages;
  if (epoch.navigation == nullptr) return messages;
  add_due(epoch.navigation->kepler, epoch, messages);
  add_due(epoch.navigation->glonass, epoch, messages);
  return messages;
}

}  // namespace canyon::encoding::rtcm

namespace canyon::encoding {

using broadcast::Bits;

namespace {

constexpr double kStationEvery_s = 10;

class Rtcm final : public Encoder {
 public:
  explicit Rtcm(const ReceiverDescription& receiver)
      : station_(rtcm::station_messages(receiver)), observations_(receiver.glonass_channels) {
    if (receiver.ephemerides) ephemerides_.emplace();
  }

  std::string encode(const simulation::Epoch& epoch) override {
    std::string bytes;
    const geodesy::GpsTime now = epoch.observed.time;
    if (!station_sent_ || now - *station_sent_ >= kStationEvery_s) {
      station_sent_ = now;
      for (const Bits& message : station_) bytes += rtcm::frame(message);
    }
    if (ephemerides_)
      for (const Bits& message : ephemerides_->due(epoch)) bytes += rtcm::frame(message);
    for (const Bits& message : observations_.messages(epoch.observed)) bytes += rtcm::frame(message);
    return bytes;
  }

 private:
  std::vector<Bits> station_;
  std::optional<geodesy::GpsTime> station_sent_;
  std::optional<rtcm::Ephemerides> ephemerides_;
  rtcm::Observations observations_;
};

}  // namespace

namespace rtcm {

Bits station(const Eigen::Vector3d& antenna_ecef, bool computed) {
  Bits bits;
  // DF003 station 0; DF021 year of the frame, not given; DF022 to DF024 serves GPS, GLONASS, Galileo; DF141
  // computed (virtual) station.
  bits.put(1005, 12).put(0, 12).put(0, 6).put(0b111, 3).put(computed ? 1 : 0, 1);
  const auto coordinate = [&](double metres) { bits.number(metres, 1e-4, 38); };
  coordinate(antenna_ecef.x());
  bits.put(0b10, 2);  // DF142: all signals of one instant; reserved
  coordinate(antenna_ecef.y());
  bits.put(0, 2);  // DF364: quarter cycles not given
  coordinate(antenna_ecef.z());
  return bits;
}

Bits descriptors() {
  Bits bits;
  bits.put(1033, 12).put(0, 12);
  const auto text = [&](std::string_view word) {
    bits.put(word.size(), 8);
    for (const char c : word) bits.put(static_cast<unsigned char>(c), 8);
  };
  text("ADVNULLANTENNA");
  bits.put(0, 8);  // DF031: the antenna's usual set-up
  text("");        // its serial number
  text("Canyon");
  text("");  // firmware
  text("");  // serial number
  return bits;
}

Bits glonass_biases(const std::vector<std::string_view>& rinex_codes) {
  // DF422: L1 C/A, L1 P, L2 C/A, L2 P.
  const std::set<std::string_view> codes(rinex_codes.begin(), rinex_codes.end());
  Bits bits;
  bits.put(1230, 12).put(0, 12).put(1, 1).put(0, 3);  // DF421: aligned
  for (const char* code : {"1C", "1P", "2C", "2P"}) bits.put(codes.count(code), 1);
  for (const char* code : {"1C", "1P", "2C", "2P"})
    if (codes.count(code) > 0) bits.put(0, 16);
  return bits;
}

std::vector<Bits> station_messages(const ReceiverDescription& receiver) {
  std::vector<Bits> messages;
  if (receiver.station_ecef) messages.push_back(station(*receiver.station_ecef, receiver.virtual_station));
  messages.push_back(descriptors());
  if (!receiver.signal.enabled || receiver.systems.count(gnss::System::GLONASS) == 0) return messages;
  std::vector<std::string_view> codes;
  for (const gnss::Signal* signal : receiver::tracked_signals(receiver.tracks, gnss::System::GLONASS))
    codes.push_back(signal->code);
  if (!codes.empty()) messages.push_back(glonass_biases(codes));
  return messages;
}

}  // namespace rtcm

std::unique_ptr<Encoder> encode_rtcm(const ReceiverDescription& receiver) {
  return std::make_unique<Rtcm>(receiver);
}

}  // namespace canyon::encoding
