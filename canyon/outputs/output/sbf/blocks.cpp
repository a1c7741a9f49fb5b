// Declared in canyon/outputs/output/sbf/block.hpp.
#include "canyon/outputs/output/sbf/block.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/payload.hpp"
#include "canyon/outputs/output/ubx/fix_codes.hpp"

namespace canyon::output::sbf {
namespace {

using positioning::Fix;
using positioning::FixKind;

/// "Do-Not-Use" of numbers with a point.
constexpr double kUnknown = -2e10;
constexpr float kUnknown4 = -2e10F;

/// PVT mode (4.2.9): how the position was made.
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

/// Bits of the signals that the fix uses.
std::uint32_t signals_used(const receiver::ReceiverEpoch& seen) {
  std::uint32_t bits = 0;
  for (const receiver::SatelliteObservation& s : seen.satellites) {
    if (!s.used || !s.measurement) continue;
    const int number = (s.signal != nullptr ? *s.signal : gnss::signals_of(s.id.system).front()).sbf;
    if (number >= 0 && number < 32) bits |= 1U << static_cast<unsigned>(number);
  }
  return bits;
}

/// Age and station of corrections, in hundredths of a second; each 65535 where it is not known.
Payload corrections_of(const Fix& fix) {
  const bool corrected = positioning::corrected(fix.kind());
  Payload p;
  p.u2(corrected && fix.correction_station ? *fix.correction_station : 0xFFFF);
  if (corrected && fix.correction_age_s) return p.unsigned_field(*fix.correction_age_s, 0.01, 2);
  return p.u2(0xFFFF);
}

/// Twice the deviation [cm], 65535 where there is none.
void accuracy(Payload& p, bool known, double variance_m2) {
  if (!known) {
    p.u2(0xFFFF);
  } else {
    p.unsigned_field(std::min(2 * std::sqrt(variance_m2), 655.34), 0.01, 2);
  }
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
  constexpr double kLeastForCourse_mps = 0.1;
  float course_deg = kUnknown4;
  if (moves && fix.velocity_enu_mps->head<2>().norm() >= kLeastForCourse_mps) {
    const double degrees = geodesy::degrees(std::atan2(fix.velocity_enu_mps->x(), fix.velocity_enu_mps->y()));
    course_deg = static_cast<float>(degrees < 0 ? degrees + 360 : degrees);
  }
  p.r4(course_deg);
  // The clock by the first of these systems that is in the fix: 0 GPS, 1 Galileo, 3 GLONASS, 4 BeiDou.
  static constexpr std::pair<gnss::System, int> kTimes[]{{gnss::System::GPS, 0},
                                                         {gnss::System::Galileo, 1},
                                                         {gnss::System::GLONASS, 3},
                                                         {gnss::System::BeiDou, 4}};
  double bias_ms = kUnknown;
  int time_system = 0;
  for (const auto& [system, number] : kTimes) {
    const auto bias = fix.clock_bias_s.find(system);
    if (!known || bias == fix.clock_bias_s.end()) continue;
    // Measurements are moved to whole milliseconds: what the clock reads beyond these is not in them.
    bias_ms = (bias->second - (epoch.seen.receiver_time - epoch.raw.tag)) * 1e3;
    time_system = number;
    break;
  }
  p.r8(bias_ms).r4(kUnknown4);  // nor is its drift
  p.u1(time_system).u1(0);      // WGS 84
  p.u1(known ? std::min<std::size_t>(fix.used.size(), 254) : 255).u1(0);
  p.raw(corrections_of(fix).bytes()).u4(known ? signals_used(epoch.seen) : 0);
  p.u1(!known || !fix.consistent ? 0 : *fix.consistent ? 1 : 2);  // RAIM: off, passed, failed
  p.u1(positioning::corrected(fix.kind()) ? 1 : 0).u2(0).u2(0);
  accuracy(p, known, fix.covariance_enu(0, 0) + fix.covariance_enu(1, 1));
  accuracy(p, known, fix.covariance_enu(2, 2));
  return p.u1(0).bytes();
}

/// Variances of north, east, up, clock, and the six covariances between them, by the order of 4.2.9.
/// @param clock of the clock, in units of the matrix
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
       {&positioning::Dop::pdop, &positioning::Dop::tdop, &positioning::Dop::hdop, &positioning::Dop::vdop}) {
    p.unsigned_field(known ? (*fix.dop).*member : 0, 0.01, 2);  // 0: not known
  }
  return p.r4(kUnknown4).r4(kUnknown4).bytes();  // protection levels
}

std::string receiver_time(const DeviceEpoch& epoch) {
  Payload p;
  if (!epoch.time_known)
    return p.u1(-128).u1(-128).u1(-128).u1(-128).u1(-128).u1(-128).u1(-128).u1(0).bytes();
  // To the millisecond that the block's time of week is rounded to: it may be that of the next second.
  const double rounded_s = epoch.stated - epoch.seen.stated_time();
  const geodesy::CalendarTime utc = geodesy::utc_from_gps(epoch.seen.stated_utc() + rounded_s);
  p.u1(utc.year % 100).u1(utc.month).u1(utc.day).u1(utc.hour).u1(utc.minute).u1(utc.second);
  return p.u1(geodesy::leap_seconds(epoch.seen.time)).u1(0b111).bytes();  // week, time of week, fine time
}

/// A baseline that this receiver states the direction of: that of a moving base, of an antenna beside it.
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
  if (fix.correction_age_s) {
    p.unsigned_field(*fix.correction_age_s, 0.01, 2);
  } else {
    p.u2(0xFFFF);
  }
  return p.u4(signals_used(epoch.seen)).bytes();
}

std::string channel_status(const DeviceEpoch& epoch) {
  constexpr int kSatelliteBytes = 12, kStateBytes = 8;
  const auto bits = [](int place, unsigned value) { return value << static_cast<unsigned>(2 * place); };
  Payload list;
  std::size_t count = 0;
  for (const receiver::SatelliteObservation& s : epoch.seen.satellites) {
    const auto number = satellite_number(s.id);
    if (!number) continue;
    ++count;
    unsigned tracking = 0, health = 0, use = 0;
    const auto add = [&](const receiver::SignalObservation& o, const gnss::Signal& signal, bool used) {
      const auto place = status_place(signal);
      if (!place) return;
      tracking |= bits(*place, o.measurement ? 3 : 1);  // tracked, or searched for
      health |= o.measurement ? bits(*place, 1) : 0;
      use |= used ? bits(*place, 2) : 0;
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
  // The gain in dB has no zero that is written down: 40 stands for no interference.
  constexpr double kQuiet_db = 40;
  constexpr int kStateBytes = 4;
  Payload list;
  std::size_t count = 0;
  for (const receiver::BandState& band : epoch.seen.bands) {
    list.u1(count++).signed_field(kQuiet_db + 20 * std::log10(band.agc()), 1, 1).u1(100).u1(0);
  }
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

std::string empty(const DeviceEpoch& /*epoch*/) {
  return {};
}

struct Row {
  BlockId id;
  std::string (*body)(const DeviceEpoch&);
  bool may_lack = false;  ///< an empty body: there is no block
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
/// pages of Galileo bit by bit, the first one foremost.
std::vector<std::uint32_t> navigation_bits(const broadcast::SentMessage& message) {
  if (message.id.system != gnss::System::Galileo) return message.words;
  // Two pages of 120 bits in four words each; the six tail bits of the first one are left out.
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
  if (epoch.time_known) time = measured ? epoch.seen.stated(epoch.raw.tag) : epoch.stated;
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

}  // namespace canyon::output::sbf
