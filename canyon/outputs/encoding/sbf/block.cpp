#include "canyon/outputs/encoding/sbf/block.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <initializer_list>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/payload.hpp"
#include "canyon/outputs/encoding/observations/fix_codes.hpp"

namespace canyon::encoding::sbf {
namespace {

using positioning::Fix;
using positioning::FixKind;

/// "Do-Not-Use" of floating-point numbers.
constexpr double kUnknown = -2e10;
constexpr float kUnknown4 = -2e10F;

/// PVT mode (4.2.9): kind of position.
int mode_of(FixKind kind, bool moving_base = false) {
  constexpr int kFixed = 4, kTowardsMovingBase = 3;
  const int mode = codes_of(kind).sbf_mode;
  return moving_base && mode >= kFixed ? mode + kTowardsMovingBase : mode;
}

/// PVT error (4.2.9).
int error_of(const Fix& fix) {
  switch (fix.status) {
    case positioning::FixStatus::Fix:
      return fix.measured() ? 0 : 1;
    case positioning::FixStatus::WeakGeometry:
      return 3;
    case positioning::FixStatus::NotConverged:
    case positioning::FixStatus::Singular:
      return 5;
    default:
      return 1;
  }
}

Payload mode_and_error(const Fix& fix) {
  return Payload().u1(fix.measured() ? mode_of(fix.kind()) : 0).u1(error_of(fix));
}

/// Bits of the signals used in the fix.
std::uint32_t signals_used(const receiver::ReceiverEpoch& seen) {
  std::uint32_t bits = 0;
  for (const receiver::SatelliteObservation& s : seen.satellites) {
    if (!s.used || !s.measurement) continue;
    const int number = (s.signal != nullptr ? *s.signal : gnss::signals_of(s.id.system).front()).sbf;
    if (number >= 0 && number < 32) bits |= 1U << static_cast<unsigned>(number);
  }
  return bits;
}

/// Age and station of corrections, in hundredths of a second; each 65535 if unknown.
Payload corrections_of(const Fix& fix) {
  const bool corrected = gnss::corrected(fix.kind());
  Payload p;
  p.u2(corrected && fix.correction_station ? *fix.correction_station : 0xFFFF);
  if (corrected && fix.correction_age_s) return p.unsigned_field(*fix.correction_age_s, 0.01, 2);
  return p.u2(0xFFFF);
}

/// Twice the standard deviation [cm], 65535 if there is none.
void accuracy(Payload& p, bool known, double variance_m2) {
  if (!known)
    p.u2(0xFFFF);
  else
    p.unsigned_field(std::min(2 * std::sqrt(variance_m2), 655.34), 0.01, 2);
}

std::string pvt_geodetic(const DeviceEpoch& epoch) {
  const Fix& fix = epoch.seen.fix;
  const bool known = fix.measured();
  Payload p = mode_and_error(fix);
  p.r8(known ? fix.position.latitude_rad : kUnknown).r8(known ? fix.position.longitude_rad : kUnknown);
  p.r8(known ? fix.position.height_m : kUnknown);
  p.r4(known ? static_cast<float>(epoch.geoid_undulation_m) : kUnknown4);
  const bool moves = known && fix.velocity_enu_mps.has_value();
  for (const int axis : {1, 0, 2})
    p.r4(moves ? static_cast<float>((*fix.velocity_enu_mps)[axis]) : kUnknown4);
  constexpr double kMinForCourse_mps = 0.1;
  float course_deg = kUnknown4;
  if (moves && fix.velocity_enu_mps->head<2>().norm() >= kMinForCourse_mps) {
    const double degrees = geodesy::degrees(std::atan2(fix.velocity_enu_mps->x(), fix.velocity_enu_mps->y()));
    course_deg = static_cast<float>(degrees < 0 ? degrees + 360 : degrees);
  }
  p.r4(course_deg);
  // The clock of the first of these systems in the fix: 0 GPS, 1 Galileo, 3 GLONASS, 4 BeiDou.
  static constexpr std::pair<gnss::System, int> kTimes[]{{gnss::System::GPS, 0},
                                                         {gnss::System::Galileo, 1},
                                                         {gnss::System::GLONASS, 3},
                                                         {gnss::System::BeiDou, 4}};
  double bias_ms = kUnknown;
  int time_system = 0;
  for (const auto& [system, number] : kTimes) {
    const auto bias = fix.clock_bias_s.find(system);
    if (!known || bias == fix.clock_bias_s.end()) continue;
    // Measurements are referred to whole milliseconds, without the clock's fraction of one.
    bias_ms = (bias->second - (epoch.seen.receiver_time - epoch.raw.tag)) * 1e3;
    time_system = number;
    break;
  }
  p.r8(bias_ms).r4(kUnknown4);  // nor its drift
  p.u1(time_system).u1(0);      // WGS 84
  p.u1(known ? std::min<std::size_t>(fix.used.size(), 254) : 255).u1(0);
  p.raw(corrections_of(fix).bytes()).u4(known ? signals_used(epoch.seen) : 0);
  p.u1(!known || !fix.consistent ? 0 : *fix.consistent ? 1 : 2);  // RAIM: off, passed, failed
  p.u1(gnss::corrected(fix.kind()) ? 1 : 0).u2(0).u2(0);
  accuracy(p, known, fix.covariance_enu(0, 0) + fix.covariance_enu(1, 1));
  accuracy(p, known, fix.covariance_enu(2, 2));
  return p.u1(0).bytes();
}

/// Variances of north, east, up, clock, and the six covariances between them, in the order of 4.2.9. @param
/// clock its variance, in units of the matrix
void covariances(Payload& p, bool known, const Eigen::Matrix3d& enu, double clock) {
  const auto put = [&](double value) { p.r4(known ? static_cast<float>(value) : kUnknown4); };
  put(enu(1, 1));
  put(enu(0, 0));
  put(enu(2, 2));
  p.r4(known ? static_cast<float>(clock) : kUnknown4);
  put(enu(1, 0));
  put(enu(1, 2));
  p.r4(kUnknown4);
  put(enu(0, 2));
  p.r4(kUnknown4).r4(kUnknown4);
}

std::string pos_cov_geodetic(const DeviceEpoch& epoch) {
  const Fix& fix = epoch.seen.fix;
  Payload p = mode_and_error(fix);
  const auto clock_m = clock_sigma_m(fix);
  covariances(p, fix.measured(), fix.covariance_enu, clock_m ? *clock_m * *clock_m : kUnknown);
  return p.bytes();
}

std::string vel_cov_geodetic(const DeviceEpoch& epoch) {
  const Fix& fix = epoch.seen.fix;
  Payload p = mode_and_error(fix);
  covariances(p, fix.measured() && fix.velocity_covariance_enu.has_value(),
              fix.velocity_covariance_enu.value_or(Eigen::Matrix3d::Zero()), kUnknown);
  return p.bytes();
}

std::string dop(const DeviceEpoch& epoch) {
  const Fix& fix = epoch.seen.fix;
  const bool known = fix.measured() && fix.dop;
  Payload p;
  p.u1(known ? std::min<std::size_t>(fix.used.size(), 254) : 0).u1(0);
  for (const auto member :
       {&positioning::Dop::pdop, &positioning::Dop::tdop, &positioning::Dop::hdop, &positioning::Dop::vdop})
    p.unsigned_field(known ? (*fix.dop).*member : 0, 0.01, 2);  // 0: not known
  return p.r4(kUnknown4).r4(kUnknown4).bytes();                 // protection levels
}

std::string receiver_time(const DeviceEpoch& epoch) {
  Payload p;
  if (!epoch.time_known)
    return p.u1(-128).u1(-128).u1(-128).u1(-128).u1(-128).u1(-128).u1(-128).u1(0).bytes();
  // Uses the block's time of week rounded to a millisecond, which may be in the next second.
  const double rounded_s = epoch.reported_time - epoch.seen.reported_time();
  const geodesy::CalendarTime utc = geodesy::utc_from_gps(epoch.seen.reported_utc() + rounded_s);
  p.u1(utc.year % 100).u1(utc.month).u1(utc.day).u1(utc.hour).u1(utc.minute).u1(utc.second);
  return p.u1(geodesy::leap_seconds(epoch.seen.time)).u1(0b111).bytes();  // week, time of week, fine time
}

/// A baseline with a reported direction: from a moving base, such as a second antenna.
const positioning::Baseline* attitude_of(const Fix& fix) {
  return fix.baseline && fix.baseline->moving_base ? &*fix.baseline : nullptr;
}

std::string att_euler(const DeviceEpoch& epoch) {
  const positioning::Baseline* vector = attitude_of(epoch.seen.fix);
  if (vector == nullptr) return {};
  Payload p;
  p.u1(std::min<std::size_t>(vector->used.size(), 254)).u1(0);
  p.u2(vector->kind == FixKind::Fixed ? 2 : 1).u2(0);  // heading and pitch, by two antennas
  p.r4(static_cast<float>(geodesy::degrees(vector->heading_rad())));
  p.r4(static_cast<float>(geodesy::degrees(vector->pitch_rad()))).r4(kUnknown4);
  return p.r4(kUnknown4).r4(kUnknown4).r4(kUnknown4).bytes();
}

std::string att_cov_euler(const DeviceEpoch& epoch) {
  const positioning::Baseline* vector = attitude_of(epoch.seen.fix);
  if (vector == nullptr) return {};
  Payload p;
  p.u1(0).u1(0).r4(static_cast<float>(std::pow(geodesy::degrees(vector->heading_sigma_rad()), 2)));
  for (int i = 0; i < 5; ++i) p.r4(kUnknown4);
  return p.bytes();
}

std::string base_vector_geod(const DeviceEpoch& epoch) {
  const Fix& fix = epoch.seen.fix;
  if (!fix.baseline) return {};
  const positioning::Baseline& vector = *fix.baseline;
  constexpr int kVectorBytes = 52;
  Payload p;
  p.u1(1).u1(kVectorBytes);
  p.u1(std::min<std::size_t>(vector.used.size(), 254)).u1(0);
  p.u1(mode_of(vector.kind, vector.moving_base)).u1(0);
  p.r8(vector.vector_enu.x()).r8(vector.vector_enu.y()).r8(vector.vector_enu.z());
  p.r4(kUnknown4).r4(kUnknown4).r4(kUnknown4);
  p.unsigned_field(geodesy::degrees(vector.heading_rad()), 0.01, 2);
  p.signed_field(geodesy::degrees(vector.pitch_rad()), 0.01, 2);
  p.u2(fix.correction_station.value_or(0xFFFF));
  if (fix.correction_age_s)
    p.unsigned_field(*fix.correction_age_s, 0.01, 2);
  else
    p.u2(0xFFFF);
  return p.u4(signals_used(epoch.seen)).bytes();
}

std::string channel_status(const DeviceEpoch& epoch) {
  constexpr int kSatelliteBytes = 12, kStateBytes = 8;
  const auto bits = [](int position, unsigned value) { return value << static_cast<unsigned>(2 * position); };
  Payload list;
  std::size_t count = 0;
  for (const receiver::SatelliteObservation& s : epoch.seen.satellites) {
    const auto number = satellite_number(s.id);
    if (!number) continue;
    ++count;
    unsigned tracking = 0, health = 0, use = 0;
    const auto add = [&](const receiver::SignalObservation& o, const gnss::Signal& signal, bool used) {
      const auto position = status_bit_offset(signal);
      if (!position) return;
      tracking |= bits(*position, o.measurement ? 3 : 1);  // tracked, or searching
      health |= o.measurement ? bits(*position, 1) : 0;
      use |= used ? bits(*position, 2) : 0;
    };
    const bool used = s.used && epoch.seen.fix.measured();
    add(s, s.signal != nullptr ? *s.signal : gnss::signals_of(s.id.system).front(), used);
    for (const receiver::SignalObservation& other : s.more) add(other, *other.signal, false);
    const double azimuth_deg = geodesy::degrees(s.azimuth_rad);
    const auto azimuth =
        static_cast<unsigned>(std::lround(azimuth_deg < 0 ? azimuth_deg + 360 : azimuth_deg) % 360);
    constexpr unsigned kRateUnknown = 3U << 14U;
    list.u1(*number).u1(frequency_number(s.id, epoch.glonass_channels)).zeros(2).u2(azimuth | kRateUnknown);
    list.u2(health).signed_field(geodesy::degrees(s.elevation_rad), 1, 1).u1(1).u1(count).u1(0);
    list.u1(0).u1(0).u2(tracking).u2(use).u2(0);
  }
  return Payload().u1(count).u1(kSatelliteBytes).u1(kStateBytes).zeros(3).raw(list.bytes()).bytes();
}

std::string receiver_status(const DeviceEpoch& epoch) {
  // The guide defines no zero of the gain in dB: 40 means no interference.
  constexpr double kQuiet_db = 40;
  constexpr int kStateBytes = 4;
  Payload list;
  std::size_t count = 0;
  for (const receiver::BandState& band : epoch.seen.bands)
    list.u1(count++).signed_field(kQuiet_db + 20 * std::log10(band.agc()), 1, 1).u1(100).u1(0);
  Payload p;
  p.u1(0).u1(0).unsigned_field(epoch.uptime_s, 1, 4);
  p.u4(epoch.time_known ? 0b11000U : 0U).u4(0);  // RxState: week and time of week are set
  return p.u1(count).u1(kStateBytes).u1(0).u1(0).raw(list.bytes()).bytes();
}

std::string rf_status(const DeviceEpoch& epoch) {
  constexpr int kBandBytes = 8;
  constexpr double kBandwidth_khz = 20e3;
  constexpr unsigned kNotMitigated = 8;
  Payload list;
  std::size_t count = 0;
  for (const receiver::BandState& band : epoch.seen.bands) {
    if (band.interference_ratio < 1) continue;  // weaker than the front end's own noise
    ++count;
    list.unsigned_field(band.carrier_hz, 1, 4).unsigned_field(kBandwidth_khz, 1, 2).u1(kNotMitigated).u1(0);
  }
  const bool spoofed = epoch.seen.spoofing > receiver::SpoofingState::None;
  return Payload().u1(count).u1(kBandBytes).u1(spoofed ? 1 : 0).zeros(3).raw(list.bytes()).bytes();
}

// MeasEpoch (4.2.1): of each satellite one sub-block with its first signal, and others relative to it.

constexpr double kCode_m = 0.001, kDoppler_hz = 1e-4, kPhase_cycles = 0.001;
constexpr double kLowestCn0_dbhz = 10, kCn0_db = 0.25;
constexpr int kFirstBytes = 20, kFurtherBytes = 12;
constexpr std::int64_t kHigh = 65536;  ///< weight of the high byte of a two-part field

/// Bits 0 to 4 of a signal's number; 31: the rest is in ObsInfo.
int type_of(const gnss::Signal& signal) {
  return std::min<int>(signal.sbf, 31);
}

int observation_info(const RawObservation& o, const std::map<gnss::SatelliteId, int>& channels) {
  const int info = o.measurement->half_cycle ? 1 << 2 : 0;
  const int rest = o.signal->sbf >= 31 ? o.signal->sbf - 32 : frequency_number(o.id, channels);
  return info | rest << 3;
}

/// A phase relative to the pseudorange in 0.001 cycles: low 16 bits, high 8 bits; -128 and 0 without one.
struct Carrier {
  std::int64_t steps = -128 * kHigh;
  [[nodiscard]] std::uint64_t low() const { return static_cast<std::uint64_t>(steps) & 0xFFFF; }
  [[nodiscard]] std::int64_t high() const { return steps >> 16; }
};
Carrier carrier_of(const RawObservation& o, double reported_range_m) {
  if (!o.carrier_phase_cycles) return {};
  const double wavelength_m = geodesy::kSpeedOfLight / o.measurement->carrier_frequency_hz;
  const auto steps =
      std::llround((*o.carrier_phase_cycles - reported_range_m / wavelength_m) / kPhase_cycles);
  constexpr std::int64_t kMax = 127 * kHigh;  // a phase this far from the code is not sent
  return std::abs(steps) > kMax ? Carrier{} : Carrier{steps};
}

/// C/N0 in quarters of a decibel; 255: not known. P(Y) codes start at 0.
int strength(const RawObservation& o) {
  if (!o.measurement->cn0_dbhz) return 255;
  const double from = o.signal->sbf == 1 || o.signal->sbf == 2 ? 0 : kLowestCn0_dbhz;
  return static_cast<int>(std::clamp(std::lround((*o.measurement->cn0_dbhz - from) / kCn0_db), 0L, 254L));
}

/// The rounded pseudorange of its field, to which readers add.
double encoded_range_m(double range_m) {
  return std::llround(range_m / kCode_m) * kCode_m;
}

void put_first(Payload& p, const RawObservation& o, std::size_t channel, std::size_t further,
               const std::map<gnss::SatelliteId, int>& channels) {
  const auto code = static_cast<std::uint64_t>(std::llround(o.pseudorange_m / kCode_m));
  const Carrier carrier = carrier_of(o, encoded_range_m(o.pseudorange_m));
  p.u1(channel).u1(type_of(*o.signal)).u1(satellite_number(o.id).value_or(0)).u1(code >> 32 & 0xF);
  p.u4(code & 0xFFFFFFFF);
  if (o.doppler_hz)
    p.signed_field(*o.doppler_hz, kDoppler_hz, 4);
  else
    p.u4(0x80000000U);
  p.u2(carrier.low()).u1(carrier.high()).u1(strength(o));
  p.u2(std::clamp(std::floor(o.locked_s + 1e-6), 0.0, 65534.0)).u1(observation_info(o, channels)).u1(further);
}

void put_further(Payload& p, const RawObservation& first, const RawObservation& o,
                 const std::map<gnss::SatelliteId, int>& channels) {
  constexpr std::int64_t kNoCode = -4 * kHigh, kNoDoppler = -16 * kHigh;
  constexpr double kMax_s = 254;
  const double from_m = encoded_range_m(first.pseudorange_m);
  std::int64_t code = std::llround((o.pseudorange_m - from_m) / kCode_m);
  if (code <= kNoCode || code > 4 * kHigh - 1) code = kNoCode;
  std::int64_t doppler = kNoDoppler;
  if (o.doppler_hz && first.doppler_hz) {
    const double base = std::llround(*first.doppler_hz / kDoppler_hz) * kDoppler_hz *
                        (o.measurement->carrier_frequency_hz / first.measurement->carrier_frequency_hz);
    doppler = std::llround((*o.doppler_hz - base) / kDoppler_hz);
    if (doppler <= kNoDoppler || doppler > 16 * kHigh - 1) doppler = kNoDoppler;
  }
  const Carrier carrier =
      code == kNoCode ? Carrier{} : carrier_of(o, from_m + static_cast<double>(code) * kCode_m);
  p.u1(type_of(*o.signal)).u1(std::clamp(std::floor(o.locked_s + 1e-6), 0.0, kMax_s)).u1(strength(o));
  p.u1((code >> 16 & 7) | (doppler >> 16 & 31) << 3).u1(carrier.high()).u1(observation_info(o, channels));
  p.u2(code & 0xFFFF).u2(carrier.low()).u2(doppler & 0xFFFF);
}

std::string meas_epoch(const DeviceEpoch& epoch) {
  Payload list;
  const std::vector<RawObservation>& observations = epoch.raw.observations;
  std::size_t satellites = 0;
  for (std::size_t i = 0; i < observations.size();) {
    std::vector<const RawObservation*> signals;
    const gnss::SatelliteId id = observations[i].id;
    for (; i < observations.size() && observations[i].id == id; ++i)
      if (observations[i].signal->sbf >= 0) signals.push_back(&observations[i]);
    if (signals.empty() || !satellite_number(id)) continue;
    put_first(list, *signals.front(), ++satellites, signals.size() - 1, epoch.glonass_channels);
    for (std::size_t k = 1; k < signals.size(); ++k)
      put_further(list, *signals.front(), *signals[k], epoch.glonass_channels);
  }
  Payload p;
  constexpr unsigned kSteered = 1U << 3U;
  p.u1(satellites).u1(kFirstBytes).u1(kFurtherBytes).u1(kSteered).u1(0).u1(0);
  return p.raw(list.bytes()).bytes();
}

std::string empty(const DeviceEpoch& /*epoch*/) {
  return {};
}

struct Row {
  BlockId id;
  std::string (*body)(const DeviceEpoch&);
  bool may_lack = false;  ///< an empty body means no block
};
constexpr std::array kRows{Row{kReceiverTime, receiver_time},
                           Row{kMeasEpoch, meas_epoch},
                           Row{kEndOfMeas, empty},
                           Row{kPvtGeodetic, pvt_geodetic},
                           Row{kPosCovGeodetic, pos_cov_geodetic},
                           Row{kVelCovGeodetic, vel_cov_geodetic},
                           Row{kDop, dop},
                           Row{kBaseVectorGeod, base_vector_geod, true},
                           Row{kAttEuler, att_euler, true},
                           Row{kAttCovEuler, att_cov_euler, true},
                           Row{kEndOfPvt, empty},
                           Row{kChannelStatus, channel_status},
                           Row{kReceiverStatus, receiver_status},
                           Row{kRfStatus, rf_status}};

/// NAVBits of a message (4.2.2 and on): words of 30 bits for GPS, QZSS and BeiDou; strings of GLONASS and
/// pages of Galileo as bits, most significant first.
std::vector<std::uint32_t> navigation_bits(const broadcast::SentMessage& message) {
  if (message.id.system != gnss::System::Galileo) return message.words;
  // Two pages of 120 bits in four words each; without the six tail bits of the first page.
  constexpr std::size_t kPage = 120, kTail = 6;
  std::vector<std::uint32_t> words(8, 0);
  std::size_t at = 0;
  for (const std::size_t page : {0, 1}) {
    for (std::size_t bit = 0; bit < (page == 0 ? kPage - kTail : kPage); ++bit, ++at) {
      const std::uint32_t value = message.words[4 * page + bit / 32] >> (31 - bit % 32) & 1U;
      words[at / 32] |= value << (31 - at % 32);
    }
  }
  return words;
}

}  // namespace

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
  for (const Range& r : kRanges)
    if (id.system == r.system && id.number >= r.first && id.number <= r.last)
      return static_cast<std::uint8_t>(id.number + r.offset);
  return std::nullopt;
}

int frequency_number(gnss::SatelliteId id, const std::map<gnss::SatelliteId, int>& channels) {
  const auto channel = channels.find(id);
  return channel == channels.end() ? 0 : channel->second + 8;
}

std::optional<int> status_bit_offset(const gnss::Signal& signal) {
  // The numbers of the signals with the same index.
  static constexpr std::initializer_list<int> kNumbers[]{
      {0, 6, 8, 24, 28},  // L1CA of GPS, QZSS, GLONASS and SBAS; B1I
      {7, 17, 29},        // QZSS L2C; E1; B2I
      {2, 26, 30},        // GPS L2P; QZSS L5; B3I
      {3, 11, 13},        // GPS L2C; GLONASS L2CA; B1C
      {4, 14, 20, 32},    // GPS L5; B2a; E5a; QZSS L1C
      {5, 21, 34}};       // GPS L1C; E5b; B2b
  for (int index = 0; const auto& numbers : kNumbers) {
    if (std::find(numbers.begin(), numbers.end(), signal.sbf) != numbers.end()) return index;
    ++index;
  }
  return std::nullopt;
}

std::span<const std::uint16_t> epoch_blocks() {
  static constexpr auto kNumbers = [] {
    std::array<std::uint16_t, kRows.size()> numbers{};
    for (std::size_t i = 0; i < kRows.size(); ++i) numbers[i] = kRows[i].id.number;
    return numbers;
  }();
  return kNumbers;
}

std::string epoch_block(std::uint16_t number, const DeviceEpoch& epoch) {
  const auto* const row =
      std::find_if(kRows.begin(), kRows.end(), [&](const Row& each) { return each.id.number == number; });
  assert(row != kRows.end());
  const std::string body = row->body(epoch);
  if (body.empty() && row->may_lack) return {};
  const bool measured = number == kMeasEpoch.number || number == kEndOfMeas.number;
  std::optional<geodesy::GpsTime> time;
  if (epoch.time_known) time = measured ? epoch.seen.reported(epoch.raw.tag) : epoch.reported_time;
  return block(row->id, time, body);
}

std::uint16_t message_number(gnss::System system) {
  constexpr std::array<std::uint16_t, 6> kNumbers{kGpsRawCa.number, kGloRawCa.number,   kGalRawInav.number,
                                                  kBdsRaw.number,   kQzsRawL1Ca.number, 0};
  return kNumbers.at(static_cast<std::size_t>(system));
}

std::string message_block(const broadcast::SentMessage& message, geodesy::GpsTime time,
                          const std::map<gnss::SatelliteId, int>& glonass_channels) {
  const std::uint16_t number = message_number(message.id.system);
  const auto satellite = satellite_number(message.id);
  if (number == 0 || !satellite) return {};
  const int signal = gnss::signals_of(message.id.system).front().sbf;
  Payload p;
  p.u1(*satellite).u1(1).u1(0).u1(signal).u1(frequency_number(message.id, glonass_channels)).u1(0);
  for (const std::uint32_t word : navigation_bits(message)) p.u4(word);
  return block({number}, time, p.bytes());
}

}  // namespace canyon::encoding::sbf
