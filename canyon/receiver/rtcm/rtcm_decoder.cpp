#include "canyon/receiver/rtcm/rtcm_decoder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/sky/broadcast/bits.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"

namespace canyon::rtcm {

using broadcast::Bits;
using geodesy::GpsTime;
using gnss::SatelliteId;
using gnss::System;

namespace {

constexpr std::int64_t kMillisecond_ns = 1'000'000;
constexpr std::int64_t kDay_ms = 86'400'000, kWeek_ms = 7 * kDay_ms;
constexpr int kNoRoughRange = 255;  ///< ms, DF397
constexpr int kMaxCells = 64;

/// The instant nearest to `now` that is `ms` after the start of a period of GPS time: a week or a day.
GpsTime nearest(GpsTime now, std::int64_t ms, std::int64_t period_ms) {
  const std::int64_t period = period_ms * kMillisecond_ns;
  std::int64_t ahead = (ms * kMillisecond_ns - now.nanosecond_of_week()) % period;
  if (ahead < -period / 2) ahead += period;
  if (ahead >= period / 2) ahead -= period;
  return now + std::chrono::nanoseconds(ahead);
}

/// GLONASS time of a day of the week from Sunday on, 7: unknown.
GpsTime from_glonass(GpsTime now, int day, std::int64_t ms) {
  const std::int64_t to_gps_ms = geodesy::leap_seconds(now) * 1000LL - 3 * 3'600'000LL;
  return day == 7 ? nearest(now, ms + to_gps_ms, kDay_ms)
                  : nearest(now, day * kDay_ms + ms + to_gps_ms, kWeek_ms);
}

/// A signed field; empty for its most negative value, which means "none".
std::optional<double> scaled(std::int64_t value, int width, double step) {
  if (value == -(std::int64_t{1} << (width - 1))) return std::nullopt;
  return static_cast<double>(value) * step;
}

}  // namespace

/// Fields of a message in order; beyond its end they are 0 and missing() is true.
class CorrectionsDecoder::Fields {
 public:
  explicit Fields(const broadcast::Bits& bits) : bits_(bits), number_(static_cast<int>(take(12))) {}
  std::uint64_t take(std::size_t width) {
    const std::size_t first = at_;
    at_ += width;
    return missing() ? 0 : bits_.number(first, width);
  }
  int count(std::size_t width) { return static_cast<int>(take(width)); }
  std::int64_t take_signed(std::size_t width) {
    const std::uint64_t value = take(width);
    const bool negative = (value >> (width - 1) & 1) != 0;
    return static_cast<std::int64_t>(value) - (negative ? std::int64_t{1} << width : 0);
  }
  std::vector<std::int64_t> column(std::size_t count, std::size_t width, bool is_signed) {
    std::vector<std::int64_t> values(count);
    for (std::int64_t& value : values)
      value = is_signed ? take_signed(width) : static_cast<std::int64_t>(take(width));
    return values;
  }
  std::string text() {
    std::string word;
    for (int n = count(8); n > 0 && !missing(); --n) {
      const auto c = static_cast<char>(take(8));
      word += c >= ' ' && c <= '~' ? c : '?';
    }
    return word;
  }
  [[nodiscard]] bool missing() const { return at_ > bits_.size(); }
  [[nodiscard]] bool lacks(std::size_t width) const { return at_ + width > bits_.size(); }
  [[nodiscard]] int number() const { return number_; }

 private:
  const broadcast::Bits& bits_;
  std::size_t at_ = 0;
  int number_ = 0;
};

CorrectionsDecoder::CorrectionsDecoder(ChannelTable glonass_channel, bool needs_position, RangeTable ranges)
    : glonass_channel_(std::move(glonass_channel)),
      ranges_(std::move(ranges)),
      needs_position_(needs_position) {}

CorrectionsDecoder::Epochs CorrectionsDecoder::feed(std::string_view bytes, GpsTime now) {
  Epochs complete;
  frames_.receive(bytes, [&](const Bits& message) { read(message, now, complete); });
  status_.checksum_errors = frames_.damaged();
  status_.bytes_passed_over = frames_.passed_over();
  status_.bytes_held = frames_.held();
  return complete;
}

CorrectionsDecoder::Epochs CorrectionsDecoder::finish() {
  Epochs complete;
  deliver(complete);
  return complete;
}

void CorrectionsDecoder::problem(const Fields& fields, std::string_view what) {
  ++status_.problems[fmt::format("message {}: {}", fields.number(), what)];
}

void CorrectionsDecoder::read(const Bits& message, GpsTime now, Epochs& complete) {
  if (message.size() < 24) {
    ++status_.problems["a message is too short for its number and station"];
    return;
  }
  Fields fields(message);
  const int number = fields.number();
  ++status_.messages[number];
  if (number == 1005 || number == 1006) return read_station_position(fields);
  if (number == 1007 || number == 1008 || number == 1033) return read_names(fields);
  if (number == 1230) return read_biases(fields);
  if ((number >= 1001 && number <= 1004) || (number >= 1009 && number <= 1012))
    return read_legacy(fields, now, complete);
  if (number == 1020) {
    const auto id = satellite_at(System::GLONASS, fields.count(6));
    const int channel = fields.count(5) - 7;
    if (id && channel <= 6) channels_[*id] = channel;
    return;
  }
  const bool msm = number >= 1071 && number <= 1127;
  if (msm && number % 10 == 2)
    problem(fields, "it has only phases, and corrections need pseudoranges; have the base send MSM3 to MSM7");
  else if (msm && number % 10 >= 1 && number % 10 <= 7)
    return read_msm(fields, now, complete);
  ++status_.messages_unread[number];
}

CorrectionsDecoder::Station& CorrectionsDecoder::station(int id) {
  status_.station = id;
  return stations_[id];
}

void CorrectionsDecoder::observe(int id) {
  station(id).observes = true;
  if (observing_ == id) return;
  observing_ = id;
  arcs_.clear();
  epoch_.reset();
}

template <typename Has>
const CorrectionsDecoder::Station* CorrectionsDecoder::describing(Has has) const {
  const auto own = stations_.find(observing_);
  if (own != stations_.end() && has(own->second)) return &own->second;
  const Station* other = nullptr;
  for (const auto& [id, each] : stations_) {
    if (each.observes || !has(each)) continue;
    if (other != nullptr) return nullptr;
    other = &each;
  }
  return other;
}

const rtk::GlonassBiases& CorrectionsDecoder::glonass_bias_m() const {
  static const rtk::GlonassBiases kNone;
  const Station* const of = describing([](const Station& s) { return s.glonass_bias_m.has_value(); });
  return of == nullptr ? kNone : *of->glonass_bias_m;
}

void CorrectionsDecoder::read_station_position(Fields& fields) {
  constexpr double kLowest_m = -10e3, kHighest_m = 100e3;
  Station& of = station(fields.count(12));
  fields.take(6 + 4);  // DF021 to DF024, DF141
  Eigen::Vector3d ecef;
  for (int axis = 0; axis < 3; ++axis) {
    ecef[axis] = 1e-4 * static_cast<double>(fields.take_signed(38));
    if (axis < 2) fields.take(2);  // DF142, DF364
  }
  if (fields.missing()) return problem(fields, "shorter than its fields");
  const double height_m = geodesy::geodetic_from_ecef(ecef).height_m;
  if (!(height_m > kLowest_m && height_m < kHighest_m))
    return problem(fields, "the position is not within 10 km below and 100 km above the Earth's ellipsoid");
  of.antenna_position_ecef = ecef;
}

void CorrectionsDecoder::read_names(Fields& fields) {
  Station& of = station(fields.count(12));
  const std::string antenna = fields.text();
  fields.take(8);  // DF031
  std::string receiver;
  if (fields.number() == 1033) {
    fields.text();  // the antenna's serial number
    receiver = fields.text();
  }
  if (fields.missing()) return problem(fields, "shorter than its fields");
  of.antenna_name = antenna;
  if (fields.number() == 1033) of.receiver_name = receiver;
}

void CorrectionsDecoder::read_biases(Fields& fields) {
  Station& of = station(fields.count(12));
  const bool aligned = fields.take(1) != 0;
  fields.take(3);
  rtk::GlonassBiases biases;
  const int mask = fields.count(4);
  int bit = 3;
  for (const char* code : {"1C", "1P", "2C", "2P"}) {
    if ((mask >> bit-- & 1) == 0) continue;
    // Phases that are aligned are already corrected by the station.
    const auto bias = scaled(fields.take_signed(16), 16, 0.02);
    if (bias) biases[code] = aligned ? 0 : *bias;
  }
  if (fields.missing()) return problem(fields, "shorter than its fields");
  const rtk::GlonassBiases before = glonass_bias_m();
  of.glonass_bias_m = std::move(biases);
  if (glonass_bias_m() == before) return;
  for (auto arc = arcs_.begin(); arc != arcs_.end();) {
    const bool moves = arc->first.first.system == System::GLONASS;
    arc = moves ? arcs_.erase(arc) : std::next(arc);
  }
}

std::optional<int> CorrectionsDecoder::channel(SatelliteId id) const {
  if (id.system != System::GLONASS) return 0;
  const auto at = channels_.find(id);
  if (at != channels_.end()) return at->second;
  return glonass_channel_ ? glonass_channel_(id) : std::nullopt;
}

void CorrectionsDecoder::begin(GpsTime time, Epochs& complete) {
  status_.last_epoch = time;
  if (epoch_ && epoch_->time == time) return;
  deliver(complete);
  epoch_ = Epoch{time, {}, {}, false};
}

void CorrectionsDecoder::deliver(Epochs& complete) {
  if (!epoch_ || !std::exchange(epoch_->news, false)) return;
  const Station* const posed =
      describing([](const Station& s) { return s.antenna_position_ecef.has_value(); });
  if (needs_position_ && posed == nullptr) {
    ++status_.epochs_held_back;
    return;
  }
  complete_milliseconds(posed != nullptr ? *posed->antenna_position_ecef : Eigen::Vector3d::Zero());
  epoch_->news = false;
  if (epoch_->observations.empty()) return;
  ++status_.epochs;
  rtk::Corrections corrections;
  corrections.station = observing_;
  if (posed != nullptr) corrections.station_ecef = *posed->antenna_position_ecef;
  if (const Station* const named = describing([](const Station& s) { return !s.antenna_name.empty(); })) {
    corrections.antenna_name = named->antenna_name;
    corrections.receiver_name = named->receiver_name;
  }
  corrections.receiver_time = epoch_->time;
  for (const auto& [key, observation] : epoch_->observations) corrections.observations.push_back(observation);
  complete.push_back(std::make_shared<const rtk::Corrections>(std::move(corrections)));
}

/// Adds the epoch's observations without whole milliseconds, completed if these are found.
void CorrectionsDecoder::complete_milliseconds(const Eigen::Vector3d& point) {
  const std::vector<Observation> partial = std::exchange(epoch_->partial, {});
  const auto left_out = [this](const Observation& o, std::string_view why) {
    ++status_.problems[fmt::format(
        "ignored observations without whole milliseconds (MSM1, MSM3, 1001, 1003, 1009, 1011): {}", why)];
    status_.without_milliseconds.insert(o.id);
  };
  std::vector<const Observation*> predicted;
  std::vector<PartialRange> ranges;
  for (const Observation& o : partial) {
    const auto range_m = ranges_ ? ranges_(o.id, epoch_->time, point) : std::nullopt;
    if (!range_m) {
      left_out(o, ranges_ ? "no ephemeris of the satellite, or no position of the station"
                          : "they need ephemerides and the position of the station (canyon rtk); or have the "
                            "base send MSM4 to MSM7");
      continue;
    }
    predicted.push_back(&o);
    ranges.push_back({o.range_m, o.unit_m, *range_m});
  }
  const auto whole = whole_milliseconds(ranges);
  for (std::size_t i = 0; i < predicted.size(); ++i) {
    Observation o = *predicted[i];
    if (!whole[i]) {
      left_out(o, "position, ephemerides and clock do not agree with it; check the position of the station");
      continue;
    }
    o.unit_m = 0;
    o.range_m += *whole[i];
    if (o.phase_range_m) *o.phase_range_m += *whole[i];
    add(o);
  }
}

void CorrectionsDecoder::add(const Observation& o) {
  if (o.unit_m > 0) {
    epoch_->partial.push_back(o);
    epoch_->news = true;
    return;
  }
  const SignalKey key{o.id, gnss::index_of(*o.reading.signal)};
  const auto [at, first] = epoch_->observations.try_emplace(key);
  if (!first) return;
  epoch_->news = true;
  at->second.signal = o.reading.signal;
  positioning::Measurement& m = at->second.measurement;
  m.id = o.id;
  m.pseudorange_m = o.range_m;
  m.cn0_dbhz = o.cn0_dbhz;
  const auto glonass_channel = channel(o.id);
  m.carrier_frequency_hz =
      gnss::carrier_hz(*o.reading.signal, gnss::l1_frequency_hz(o.id.system, glonass_channel.value_or(0)));
  if (!glonass_channel) return;
  const double wavelength_m = geodesy::kSpeedOfLight / m.carrier_frequency_hz;
  if (o.rate_mps) m.doppler_hz = -*o.rate_mps / wavelength_m;
  if (!o.phase_range_m) return;

  const GpsTime now = epoch_->time;
  const auto [arc_at, begins] = arcs_.try_emplace(key);
  Arc& arc = arc_at->second;
  const double passed_ms = static_cast<double>(now.nanoseconds() - arc.at.nanoseconds()) / kMillisecond_ns;
  // An indicator is a range of lock times. A fine one is continuous if its range contains the last lock time
  // plus the elapsed time.
  const bool long_enough =
      o.lock.least_ms >= passed_ms ||
      (o.lock.end_ms > arc.least_ms + passed_ms && o.lock.end_ms - o.lock.least_ms <= passed_ms / 16);
  const bool goes_on =
      !begins && arc.code == o.code && passed_ms > 0 && o.lock.least_ms >= arc.least_ms && long_enough;
  double ahead_cycles = (*o.phase_range_m - o.range_m) / wavelength_m;
  if (o.rotations && goes_on) {
    constexpr double kRollover_cycles = 1500;
    ahead_cycles += kRollover_cycles * std::round((arc.ahead_cycles - ahead_cycles) / kRollover_cycles);
  }
  if (begins) arc.since = now - o.lock.least_ms * 1e-3;
  if (!begins && !goes_on) arc.since = now;
  arc.at = now;
  arc.least_ms = o.lock.least_ms;
  arc.code = o.code;
  arc.ahead_cycles = ahead_cycles;
  m.carrier_phase_cycles = o.range_m / wavelength_m + ahead_cycles;
  m.phase_since = arc.since;
  m.half_cycle = o.half_cycle;
  align(at->second, o.code, glonass_bias_m());
}

namespace {

constexpr double kAgreement_m = 0.05 * kMillisecond_m;

/// The value plus whole units that is nearest to zero.
double wrapped(double value, double unit) {
  return value - unit * std::round(value / unit);
}

}  // namespace

RangeTable range_table(std::shared_ptr<const orbit::Sky> sky, const Eigen::Vector3d& fallback) {
  return [sky = std::move(sky), fallback](gnss::SatelliteId id, geodesy::GpsTime reception,
                                          const Eigen::Vector3d& point) -> std::optional<double> {
    const Eigen::Vector3d& at = point.isZero() ? fallback : point;
    if (at.isZero()) return std::nullopt;
    const auto seen = orbit::line_of_sight(*sky, id, reception, at);
    if (!seen) return std::nullopt;
    return seen->range_m - geodesy::kSpeedOfLight * seen->state.clock_bias_s;
  };
}

std::vector<std::optional<double>> whole_milliseconds(const std::vector<PartialRange>& ranges) {
  // The receiver's clock by each satellite, modulo a millisecond: finds the majority's one.
  std::size_t maximum = 0;
  double clock_m = 0;
  for (const PartialRange& centre : ranges) {
    const double at_m = wrapped(centre.modulo_m - centre.predicted_m, kMillisecond_m);
    double sum_m = 0;
    std::size_t count = 0;
    for (const PartialRange& range : ranges) {
      const double off_m = wrapped(range.modulo_m - range.predicted_m - at_m, kMillisecond_m);
      if (std::abs(off_m) > kAgreement_m) continue;
      sum_m += off_m;
      ++count;
    }
    if (count <= maximum) continue;
    maximum = count;
    clock_m = wrapped(at_m + sum_m / static_cast<double>(count), kMillisecond_m);
  }
  std::vector<std::optional<double>> whole(ranges.size());
  if (maximum < 4 || 3 * maximum < 2 * ranges.size()) return whole;
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const PartialRange& range = ranges[i];
    const double expected_m = range.predicted_m + clock_m;
    const double units = std::round((expected_m - range.modulo_m) / range.unit_m);
    if (std::abs(range.modulo_m + units * range.unit_m - expected_m) <= kAgreement_m)
      whole[i] = units * range.unit_m;
  }
  return whole;
}

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
  return {min_lock_ms(indicator, extended),
          indicator == last ? HUGE_VAL : min_lock_ms(indicator + 1, extended)};
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
  const std::uint64_t reported = fields.take(30);
  const bool more = fields.take(1) != 0;
  fields.take(3 + 7 + 2 + 2 + 1 + 3);  // DF409, DF001, DF411, DF412, DF417, DF418
  const std::uint64_t satellites = fields.take(64), signals = fields.take(32);
  const int satellite_count = std::popcount(satellites), signal_count = std::popcount(signals);
  const int mask_bits = satellite_count * signal_count;
  if (fields.missing()) return problem(fields, "shorter than its header");
  if (mask_bits > kMaxCells) return problem(fields, "the masks have more than 64 cells");
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
  const auto ms = static_cast<std::int64_t>(glonass ? reported & ((1U << 27) - 1) : reported);
  if (ms >= (glonass ? kDay_ms + 1000 : kWeek_ms)) return problem(fields, "the time is beyond its period");

  observe(id);
  begin(glonass
            ? from_glonass(now, static_cast<int>(reported >> 27), ms)
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
  for (int index = 1; index <= 64; ++index) {
    if ((satellites >> (64 - index) & 1) == 0) continue;
    const std::size_t k = satellite++;
    const auto sv = satellite_at(system, index);
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
  if (!more) deliver(complete);
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
      // Both phases are given relative to the range of L1.
      if (phase) o.phase_range_m = range_m + *phase;
      if (cn0 != 0) o.cn0_dbhz = 0.25 * cn0;
      add(o);
    };
    put(precise1 ? (glonass ? "1P" : "1W") : "1C", range_m, phase1, lock1, cn0_1);
    // DF016: 0 is L2C, 1 to 3 are P(Y) by several methods; DF046: 0 is C/A.
    if (difference)
      put(glonass ? (code2 == 0 ? "2C" : "2P") : (code2 == 0 ? "2X" : "2W"), range_m + *difference, phase2,
          lock2, cn0_2);
  }
  if (!more) deliver(complete);
}

std::vector<std::string> DecoderStatus::warnings() const {
  std::vector<std::string> lines;
  const auto times = [](std::uint64_t count) { return count > 1 ? fmt::format(" ({} times)", count) : ""; };
  for (const auto& [problem, count] : problems) lines.push_back(problem + times(count));
  if (checksum_errors > 0) lines.push_back(fmt::format("{} frames with a wrong checksum", checksum_errors));
  if (bytes_passed_over > 0) lines.push_back(fmt::format("{} bytes outside frames", bytes_passed_over));
  if (epochs_held_back > 0 && epochs > 0)
    lines.push_back(fmt::format("{} epochs before the first position of the station", epochs_held_back));
  return lines;
}

}  // namespace canyon::rtcm
