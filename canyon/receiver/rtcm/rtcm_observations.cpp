// Declared in canyon/receiver/rtcm/rtcm_decoder.hpp.
// The messages of observations.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/receiver/rtcm/decoder_fields.hpp"
#include "canyon/receiver/rtcm/frames.hpp"
#include "canyon/receiver/rtcm/rtcm_decoder.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"

namespace canyon::rtcm {

using geodesy::GpsTime;
using gnss::SatelliteId;
using gnss::System;

namespace {

constexpr std::int64_t kNanosecondsInMs = 1'000'000;
constexpr std::int64_t kDay_ms = 86'400'000, kWeek_ms = 7 * kDay_ms;
constexpr int kNoRoughRange = 255;  ///< ms, DF397
constexpr int kMostCells = 64;

/// The instant nearest to `now` that is `ms` after the beginning of a period of GPS time: a week or a day.
GpsTime nearest(GpsTime now, std::int64_t ms, std::int64_t period_ms) {
  const std::int64_t period = period_ms * kNanosecondsInMs;
  std::int64_t ahead = (ms * kNanosecondsInMs - now.nanosecond_of_week()) % period;
  if (ahead < -period / 2) ahead += period;
  if (ahead >= period / 2) ahead -= period;
  return now + std::chrono::nanoseconds(ahead);
}

/// GLONASS time of a day of the week from Sunday on, 7: not known.
GpsTime from_glonass(GpsTime now, int day, std::int64_t ms) {
  const std::int64_t to_gps_ms = geodesy::leap_seconds(now) * 1000LL - 3 * 3'600'000LL;
  return day == 7 ? nearest(now, ms + to_gps_ms, kDay_ms)
                  : nearest(now, day * kDay_ms + ms + to_gps_ms, kWeek_ms);
}

}  // namespace

CorrectionsDecoder::Reading CorrectionsDecoder::reading_of(System system, std::string_view code) {
  constexpr double kRinexVersion = 3.05;  // of the MSM tables' codes
  static const auto readings = [] {
    std::map<std::pair<System, std::string>, Reading> all;
    for (const System each : gnss::kAllSystems) {
      for (const gnss::Signal& signal : gnss::signals_of(each)) {
        int rank = 0;
        for (const std::string& known : rinex::signal_codes(signal, kRinexVersion))
          all.try_emplace({each, known}, Reading{&signal, rank++});
      }
    }
    return all;
  }();
  const auto at = readings.find({system, std::string(code)});
  return at == readings.end() ? Reading{} : at->second;
}

CorrectionsDecoder::LockTime CorrectionsDecoder::msm_lock(int indicator, bool extended) {
  const int last = extended ? 704 : 15;
  if (indicator > last) return {};  // reserved
  return {least_lock_ms(indicator, extended),
          indicator == last ? HUGE_VAL : least_lock_ms(indicator + 1, extended)};
}
/// DF013, DF019 (table 3.4-2).
CorrectionsDecoder::LockTime CorrectionsDecoder::legacy_lock(int indicator) {
  const auto least_s = [](int i) {
    if (i < 24) return i;
    if (i < 48) return 2 * i - 24;
    if (i < 72) return 4 * i - 120;
    if (i < 96) return 8 * i - 408;
    return i < 120 ? 16 * i - 1176 : i < 127 ? 32 * i - 3096 : 937;
  };
  return {1e3 * least_s(indicator), indicator == 127 ? HUGE_VAL : 1e3 * least_s(indicator + 1)};
}

void CorrectionsDecoder::read_msm(Fields& fields, GpsTime now, Epochs& complete) {
  const System system = kMsmSystems[static_cast<std::size_t>((fields.number() - 1071) / 10)];
  const int kind = fields.number() % 10;
  const bool whole = kind >= 4, fine = kind >= 6, rates = kind == 5 || kind == 7, phases = kind >= 3;
  const int id = fields.count(12);
  const std::uint64_t stated = fields.take(30);
  const bool more = fields.take(1) != 0;
  fields.take(3 + 7 + 2 + 2 + 1 + 3);  // DF409, DF001, DF411, DF412, DF417, DF418
  const std::uint64_t satellites = fields.take(64), signals = fields.take(32);
  const int satellite_count = std::popcount(satellites), signal_count = std::popcount(signals);
  const int mask_bits = satellite_count * signal_count;
  if (fields.missing()) return problem(fields, "shorter than its header");
  if (mask_bits > kMostCells) return problem(fields, "the masks have more than 64 cells");
  const std::uint64_t mask = fields.take(static_cast<std::size_t>(mask_bits));
  const auto cell_count = static_cast<std::size_t>(std::popcount(mask));
  const std::size_t code_bits = fine ? 20 : 15, phase_bits = fine ? 24 : 22, lock_bits = fine ? 10 : 4,
                    cn0_bits = fine ? 10 : 6;
  const std::size_t satellite_bits = rates   ? 36
                                     : whole ? 18
                                             : 10,
                    cell_bits = code_bits + (phases ? phase_bits + lock_bits + 1 : 0) +
                                (whole ? cn0_bits : 0) + (rates ? 15 : 0);
  const auto n = static_cast<std::size_t>(satellite_count);
  if (fields.lacks(n * satellite_bits + cell_count * cell_bits))
    return problem(fields, "shorter than its masks require");
  const bool glonass = system == System::GLONASS;
  const auto ms = static_cast<std::int64_t>(glonass ? stated & ((1U << 27) - 1) : stated);
  if (ms >= (glonass ? kDay_ms + 1000 : kWeek_ms)) return problem(fields, "the time is beyond its period");

  observe(id);
  begin(glonass
            ? from_glonass(now, static_cast<int>(stated >> 27), ms)
            : nearest(now, ms + (system == System::BeiDou ? geodesy::kBdtSecondsOffset * 1000 : 0), kWeek_ms),
        complete);
  const auto whole_ms = fields.column(whole ? n : 0, 8, false);
  const auto extended = fields.column(rates ? n : 0, 4, false);
  const auto rough = fields.column(n, 10, false);
  const auto rough_rate = fields.column(rates ? n : 0, 14, true);
  const auto code = fields.column(cell_count, code_bits, true);
  const std::size_t phase_count = phases ? cell_count : 0;
  const auto phase = fields.column(phase_count, phase_bits, true);
  const auto lock = fields.column(phase_count, lock_bits, false);
  const auto half = fields.column(phase_count, 1, false);
  const auto cn0 = fields.column(whole ? cell_count : 0, cn0_bits, false);
  const auto rate = fields.column(rates ? cell_count : 0, 15, true);
  if (cell_count == 0) problem(fields, "its masks have no cell");

  std::size_t cell = 0, satellite = 0;
  int mask_at = 0;
  for (int place = 1; place <= 64; ++place) {
    if ((satellites >> (64 - place) & 1) == 0) continue;
    const std::size_t k = satellite++;
    const auto sv = satellite_at(system, place);
    if (sv && glonass && rates && extended[k] <= 13) channels_[*sv] = static_cast<int>(extended[k]) - 7;
    if (!sv) problem(fields, "a satellite's number is reserved");
    const double range_ms =
        static_cast<double>(whole ? whole_ms[k] : 0) + static_cast<double>(rough[k]) / 1024;
    std::map<const gnss::Signal*, Observation> best;
    for (int signal = 1; signal <= 32; ++signal) {
      if ((signals >> (32 - signal) & 1) == 0) continue;
      if ((mask >> (mask_bits - ++mask_at) & 1) == 0) continue;
      const std::size_t c = cell++;
      if (!sv || (whole && whole_ms[k] == kNoRoughRange)) continue;
      Observation o{*sv,   rinex_code(system, signal),  {}, 0, {}, {}, {}, false, {},
                    false, whole ? 0.0 : kMillisecond_m};
      o.reading = reading_of(system, o.code);
      if (o.reading.signal == nullptr) {
        ++status_.unknown_codes[o.code.empty() ? fmt::format("{} signal {}", letter(system), signal)
                                               : fmt::format("{} {}", letter(system), o.code)];
        continue;
      }
      const auto range = scaled(code[c], static_cast<int>(code_bits), fine ? 0x1p-29 : 0x1p-24);
      const auto phase_range =
          phases ? scaled(phase[c], static_cast<int>(phase_bits), fine ? 0x1p-31 : 0x1p-29) : std::nullopt;
      if (!range) continue;
      o.range_m = (range_ms + *range) * kMillisecond_m;
      if (phase_range) o.phase_range_m = (range_ms + *phase_range) * kMillisecond_m;
      if (rates) {
        const auto whole_mps = scaled(rough_rate[k], 14, 1), more_mps = scaled(rate[c], 15, 1e-4);
        if (whole_mps && more_mps) o.rate_mps = *whole_mps + *more_mps;
      }
      if (whole && cn0[c] != 0) o.cn0_dbhz = static_cast<double>(cn0[c]) * (fine ? 0x1p-4 : 1.0);
      if (phases) {
        o.lock = msm_lock(static_cast<int>(lock[c]), fine);
        o.half_cycle = half[c] != 0;
      }
      const auto [at, first] = best.try_emplace(o.reading.signal, o);
      if (!first && o.reading.rank < at->second.reading.rank) at->second = o;
    }
    for (const auto& [signal, o] : best) add(o);
  }
  if (!more) give(complete);
}

// 3.5.1 and 3.5.5, tables 3.5-2, 3.5-3, 3.5-5, 3.5-10, 3.5-11, 3.5-12.
void CorrectionsDecoder::read_legacy(Fields& fields, GpsTime now, Epochs& complete) {
  const bool glonass = fields.number() >= 1009;
  const int kind = fields.number() - (glonass ? 1008 : 1000);
  const bool two_bands = kind >= 3, whole = kind % 2 == 0;  // with whole milliseconds and C/N0
  const System system = glonass ? System::GLONASS : System::GPS;
  const int station = fields.count(12);
  const auto ms = static_cast<std::int64_t>(fields.take(glonass ? 27 : 30));
  const bool more = fields.take(1) != 0;
  const int count = fields.count(5);
  fields.take(1 + 3);  // DF007, DF008; DF036, DF037
  if (fields.missing() || fields.lacks(static_cast<std::size_t>(count) *
                                       ((glonass ? 64U : 58U) + (two_bands ? 43U : 0U) +
                                        (whole ? (glonass ? 15U : 16U) + (two_bands ? 8U : 0U) : 0U))))
    return problem(fields, "shorter than its satellites need");
  if (ms >= (glonass ? kDay_ms + 1000 : kWeek_ms)) return problem(fields, "the time is beyond its period");
  observe(station);
  begin(glonass ? from_glonass(now, 7, ms) : nearest(now, ms, kWeek_ms), complete);
  for (int i = 0; i < count; ++i) {
    const int number = fields.count(6);
    const bool sbas = !glonass && number >= 40 && number <= 58;  // DF009: PRN 120 is 40
    const auto sv = sbas           ? satellite_at(System::SBAS, number - 39)
                    : number <= 32 ? satellite_at(system, number)
                                   : std::nullopt;
    const bool precise1 = fields.take(1) != 0;
    const int channel = glonass ? fields.count(5) - 7 : 0;
    const double unit_m = glonass ? 2 * kMillisecond_m : kMillisecond_m;
    const auto modulo = static_cast<double>(fields.take(glonass ? 25 : 24)) * 0.02;
    const auto phase1 = scaled(fields.take_signed(20), 20, 0.0005);
    const int lock1 = fields.count(7);
    const double range_m = modulo + (whole ? fields.count(glonass ? 7 : 8) * unit_m : 0);
    const int cn0_1 = whole ? fields.count(8) : 0;
    const int code2 = two_bands ? fields.count(2) : 0;
    const auto difference = two_bands ? scaled(fields.take_signed(14), 14, 0.02) : std::nullopt;
    const auto phase2 = two_bands ? scaled(fields.take_signed(20), 20, 0.0005) : std::nullopt;
    const int lock2 = two_bands ? fields.count(7) : 0;
    const int cn0_2 = two_bands && whole ? fields.count(8) : 0;
    if (!sv) {
      problem(fields, "a satellite's number is reserved");
      continue;
    }
    if (glonass && channel <= 6) channels_[*sv] = channel;
    const auto put = [&](std::string_view code, double range, const std::optional<double>& phase, int lock,
                         int cn0) {
      Observation o{*sv,
                    code,
                    reading_of(sv->system, code),
                    range,
                    {},
                    {},
                    {},
                    true,
                    legacy_lock(lock),
                    false,
                    whole ? 0 : unit_m};
      if (o.reading.signal == nullptr) {
        ++status_.unknown_codes[fmt::format("{} {}", letter(sv->system), code)];
        return;
      }
      // Both phases are stated relative to the range of L1.
      if (phase) o.phase_range_m = range_m + *phase;
      if (cn0 != 0) o.cn0_dbhz = 0.25 * cn0;
      add(o);
    };
    put(precise1 ? (glonass ? "1P" : "1W") : "1C", range_m, phase1, lock1, cn0_1);
    // DF016: 0 is L2C, 1 to 3 are P(Y) by several ways; DF046: 0 is C/A.
    if (difference)
      put(glonass ? (code2 == 0 ? "2C" : "2P") : (code2 == 0 ? "2X" : "2W"), range_m + *difference, phase2,
          lock2, cn0_2);
  }
  if (!more) give(complete);
}

}  // namespace canyon::rtcm
