#include "canyon/receiver/rtcm/rtcm_decoder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/receiver/rtcm/decoder_fields.hpp"
#include "canyon/receiver/rtcm/frames.hpp"

namespace canyon::rtcm {

using broadcast::Bits;
using geodesy::GpsTime;
using gnss::SatelliteId;
using gnss::System;

namespace {

constexpr std::int64_t kMillisecond_ns = 1'000'000;

}  // namespace

CorrectionsDecoder::CorrectionsDecoder(ChannelTable glonass_channel, bool needs_place, RangeTable ranges)
    : glonass_channel_(std::move(glonass_channel)), ranges_(std::move(ranges)), needs_place_(needs_place) {}

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
  give(complete);
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
  if (number == 1005 || number == 1006) return read_place(fields);
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
  if (msm && number % 10 == 2) {
    problem(fields, "it has phases alone, and a base needs pseudoranges; have it send MSM3 to MSM7");
  } else if (msm && number % 10 >= 1 && number % 10 <= 7) {
    return read_msm(fields, now, complete);
  }
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

const relative::GlonassBiases& CorrectionsDecoder::glonass_bias_m() const {
  static const relative::GlonassBiases kNone;
  const Station* const of = describing([](const Station& s) { return s.glonass_bias_m.has_value(); });
  return of == nullptr ? kNone : *of->glonass_bias_m;
}

void CorrectionsDecoder::read_place(Fields& fields) {
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
    return problem(fields, "the place is not within 10 km below and 100 km above the Earth's ellipsoid");
  of.place_ecef = ecef;
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
  relative::GlonassBiases biases;
  const int mask = fields.count(4);
  int bit = 3;
  for (const char* code : {"1C", "1P", "2C", "2P"}) {
    if ((mask >> bit-- & 1) == 0) continue;
    // The station has already corrected phases that are aligned.
    const auto bias = scaled(fields.take_signed(16), 16, 0.02);
    if (bias) biases[code] = aligned ? 0 : *bias;
  }
  if (fields.missing()) return problem(fields, "shorter than its fields");
  const relative::GlonassBiases before = glonass_bias_m();
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
  give(complete);
  epoch_ = Epoch{time, {}, {}, false};
}

void CorrectionsDecoder::give(Epochs& complete) {
  if (!epoch_ || !std::exchange(epoch_->news, false)) return;
  const Station* const placed = describing([](const Station& s) { return s.place_ecef.has_value(); });
  if (needs_place_ && placed == nullptr) {
    ++status_.epochs_held_back;
    return;
  }
  complete_milliseconds(placed != nullptr ? *placed->place_ecef : Eigen::Vector3d::Zero());
  epoch_->news = false;
  if (epoch_->observations.empty()) return;
  ++status_.epochs;
  relative::Corrections corrections;
  corrections.station = observing_;
  if (placed != nullptr) corrections.station_ecef = *placed->place_ecef;
  if (const Station* const named = describing([](const Station& s) { return !s.antenna_name.empty(); })) {
    corrections.antenna_name = named->antenna_name;
    corrections.receiver_name = named->receiver_name;
  }
  corrections.receiver_time = epoch_->time;
  for (const auto& [key, observation] : epoch_->observations) corrections.observations.push_back(observation);
  complete.push_back(std::make_shared<const relative::Corrections>(std::move(corrections)));
}

/// Adds the observations of the epoch that lack whole milliseconds, with these where they are found.
void CorrectionsDecoder::complete_milliseconds(const Eigen::Vector3d& place) {
  const std::vector<Observation> partial = std::exchange(epoch_->partial, {});
  const auto left_out = [this](const Observation& o, std::string_view why) {
    ++status_.problems[fmt::format(
        "observations without whole milliseconds (MSM1, MSM3, 1001, 1003, 1009, 1011) left out: {}", why)];
    status_.without_milliseconds.insert(o.id);
  };
  std::vector<const Observation*> predicted;
  std::vector<PartialRange> ranges;
  for (const Observation& o : partial) {
    const auto range_m = ranges_ ? ranges_(o.id, epoch_->time, place) : std::nullopt;
    if (!range_m) {
      left_out(o, ranges_ ? "no ephemeris of the satellite, or no place of the station"
                          : "they need ephemerides and the place of the station (canyon rtk); or have the "
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
      left_out(o, "place, ephemerides and clock do not agree with it; is the place of the station right?");
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
  // An indicator stands for a range of lock times. One that is fine says "as long as the time passed" by a
  // range that holds this time.
  const bool long_enough =
      o.lock.least_ms >= passed_ms ||
      (o.lock.end_ms > arc.least_ms + passed_ms && o.lock.end_ms - o.lock.least_ms <= passed_ms / 16);
  const bool goes_on =
      !begins && arc.code == o.code && passed_ms > 0 && o.lock.least_ms >= arc.least_ms && long_enough;
  double ahead_cycles = (*o.phase_range_m - o.range_m) / wavelength_m;
  if (o.turns && goes_on) {
    constexpr double kTurn_cycles = 1500;
    ahead_cycles += kTurn_cycles * std::round((arc.ahead_cycles - ahead_cycles) / kTurn_cycles);
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
                                          const Eigen::Vector3d& place) -> std::optional<double> {
    const Eigen::Vector3d& at = place.isZero() ? fallback : place;
    if (at.isZero()) return std::nullopt;
    const auto seen = orbit::line_of_sight(*sky, id, reception, at);
    if (!seen) return std::nullopt;
    return seen->range_m - geodesy::kSpeedOfLight * seen->state.clock_bias_s;
  };
}

std::vector<std::optional<double>> whole_milliseconds(const std::vector<PartialRange>& ranges) {
  // The receiver's clock by each satellite, modulo a millisecond: the one that most agree on.
  std::size_t most = 0;
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
    if (count <= most) continue;
    most = count;
    clock_m = wrapped(at_m + sum_m / static_cast<double>(count), kMillisecond_m);
  }
  std::vector<std::optional<double>> whole(ranges.size());
  if (most < 4 || 3 * most < 2 * ranges.size()) return whole;
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const PartialRange& range = ranges[i];
    const double expected_m = range.predicted_m + clock_m;
    const double units = std::round((expected_m - range.modulo_m) / range.unit_m);
    if (std::abs(range.modulo_m + units * range.unit_m - expected_m) <= kAgreement_m)
      whole[i] = units * range.unit_m;
  }
  return whole;
}

}  // namespace canyon::rtcm
