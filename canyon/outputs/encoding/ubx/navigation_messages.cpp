#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/outputs/encoding/observations/fix_codes.hpp"
#include "canyon/outputs/encoding/ubx/messages.hpp"

namespace canyon::encoding::ubx {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();  // a field's maximum value

/// Standard deviations and other properties of a fix used in several messages.
struct Quality {
  double horizontal_m = kNone, vertical_m = kNone, position_m = kNone, speed_mps = kNone, time_s = kNone;
  double course_deg = 180;
  double east_mps = 0, north_mps = 0, down_mps = 0, ground_mps = 0, motion_deg = 0;
};

Quality quality_of(const positioning::Fix& fix) {
  Quality q;
  if (!fix.solved()) return q;
  const Eigen::Matrix3d& p = fix.covariance_enu;
  q.horizontal_m = std::sqrt(p(0, 0) + p(1, 1));
  q.vertical_m = std::sqrt(p(2, 2));
  q.position_m = std::sqrt(p.trace());
  if (const auto clock = clock_sigma_m(fix)) q.time_s = *clock / geodesy::kSpeedOfLight;
  if (!fix.velocity_enu_mps) return q;
  const Eigen::Vector3d& v = *fix.velocity_enu_mps;
  q.east_mps = v.x();
  q.north_mps = v.y();
  q.down_mps = -v.z();
  q.ground_mps = std::hypot(v.x(), v.y());
  q.motion_deg = geodesy::degrees(std::atan2(v.x(), v.y()));
  if (q.motion_deg < 0) q.motion_deg += 360;
  if (!fix.velocity_covariance_enu) return q;
  const Eigen::Matrix3d& s = *fix.velocity_covariance_enu;
  q.speed_mps = std::sqrt(s.trace());
  q.course_deg = std::min(180.0, geodesy::degrees(std::sqrt(s(0, 0) + s(1, 1)) / q.ground_mps));
  return q;
}

double degrees_of(const positioning::Fix& fix, double geodesy::Geodetic::*angle) {
  return fix.solved() ? geodesy::degrees(fix.position.*angle) : 0;
}
/// Heights above the ellipsoid, and above mean sea level.
std::array<double, 2> heights_of(const UbxEpoch& epoch) {
  const positioning::Fix& fix = epoch.seen.fix;
  if (!fix.solved()) return {0, 0};
  return {fix.position.height_m, fix.position.height_m - epoch.geoid_undulation_m};
}

/// Position fix flags. A rover of a moving base reports the kind of the baseline vector, though its position
/// is single (ZED-F9P Integration Manual, "RTK rover mode output in messages").
std::uint8_t flags_of(const positioning::Fix& fix) {
  const bool is_moving_baseline = fix.measured() && fix.baseline && fix.baseline->moving_base;
  return codes_of(is_moving_baseline ? fix.baseline->kind : fix.kind()).ubx_flags;
}

/// lastCorrectionAge: 0 unknown, n from the (n-1)th of these ages on.
std::uint64_t correction_age(const positioning::Fix& fix) {
  constexpr std::array kFrom_s{1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 45.0, 60.0, 90.0, 120.0};
  if (!corrected(fix.kind()) || !fix.correction_age_s) return 0;
  const auto* const next = std::upper_bound(kFrom_s.begin(), kFrom_s.end(), *fix.correction_age_s);
  return static_cast<std::uint64_t>(next - kFrom_s.begin()) + 1;
}

std::uint64_t used(const positioning::Fix& fix) {
  return fix.solved() ? std::min<std::size_t>(fix.used.size(), 255) : 0;
}

double dop(const positioning::Fix& fix, double positioning::Dop::*member) {
  return fix.solved() && fix.dop ? std::min((*fix.dop).*member, 99.99) : 99.99;
}

/// The part of HDOP in a direction, in proportion to the covariance.
double horizontal_dop(const positioning::Fix& fix, int axis) {
  if (!fix.solved() || !fix.dop) return 99.99;
  const Eigen::Matrix3d& p = fix.covariance_enu;
  return std::min(99.99, fix.dop->hdop * std::sqrt(p(axis, axis) / (p(0, 0) + p(1, 1))));
}

/// flags of NAV-STATUS and NAV-SOL: gpsFixOk, diffSoln, wknSet, towSet.
std::uint64_t solution_flags(const UbxEpoch& epoch) {
  const std::uint64_t fix = flags_of(epoch.seen.fix) & (kUbxFixOk | kUbxDifferential);
  return fix | (epoch.time_known ? 0b1100 : 0);
}

// NAV-PVT, 3.15.13.
std::string pvt(const UbxEpoch& epoch) {
  const positioning::Fix& fix = epoch.seen.fix;
  const Quality q = quality_of(fix);
  const geodesy::CalendarTime utc = geodesy::utc_from_gps(epoch.seen.reported_utc());
  Payload p;
  p.u4(itow(epoch)).u2(utc.year).u1(utc.month);
  p.u1(utc.day).u1(utc.hour);
  p.u1(utc.minute).u1(utc.second);
  p.u1(epoch.time_known ? 0b111 : 0).unsigned_field(q.time_s, 1e-9, 4).u4(utc.nanosecond);
  const bool heading = fix.solved() && fix.fused();
  constexpr std::uint8_t kHeadingValid = 1 << 5;
  p.u1(ubx_type_of(fix)).u1(flags_of(fix) | (heading ? kHeadingValid : 0));
  p.u1(epoch.time_known ? 0b11100000 : 0).u1(used(fix));
  p.signed_field(degrees_of(fix, &geodesy::Geodetic::longitude_rad), 1e-7, 4);
  p.signed_field(degrees_of(fix, &geodesy::Geodetic::latitude_rad), 1e-7, 4);
  for (const double height_m : heights_of(epoch)) p.signed_field(height_m, 1e-3, 4);
  p.unsigned_field(q.horizontal_m, 1e-3, 4).unsigned_field(q.vertical_m, 1e-3, 4);
  p.signed_field(q.north_mps, 1e-3, 4).signed_field(q.east_mps, 1e-3, 4).signed_field(q.down_mps, 1e-3, 4);
  p.signed_field(q.ground_mps, 1e-3, 4).signed_field(q.motion_deg, 1e-5, 4);
  p.unsigned_field(q.speed_mps, 1e-3, 4).unsigned_field(q.course_deg, 1e-5, 4);
  p.unsigned_field(dop(fix, &positioning::Dop::pdop), 0.01, 2);
  p.u2((fix.solved() ? 0 : 1) | correction_age(fix) << 1).zeros(4);  // invalidLlh, lastCorrectionAge
  // magDec, magAcc: not known.
  return p.signed_field(heading ? geodesy::degrees(fix.fusion->heading_rad) : 0, 1e-5, 4).zeros(4).bytes();
}

// NAV-STATUS, 3.15.18.
std::string status(const UbxEpoch& epoch) {
  const positioning::Fix& fix = epoch.seen.fix;
  // spoofDetState: 0 unknown, 1 none, 2 indicated, 3 multiple indications, by the number of states.
  const auto spoofing = static_cast<std::uint64_t>(epoch.seen.spoofing);
  Payload p;
  const std::uint64_t flags = flags_of(fix), carrier = flags & (kUbxFloat | kUbxFixed);
  p.u4(itow(epoch)).u1(ubx_type_of(fix)).u1(solution_flags(epoch));
  p.u1(((flags & kUbxDifferential) != 0 ? 1 : 0) | (carrier != 0 ? 2 : 0)).u1(spoofing << 3 | carrier);
  return p.unsigned_field(epoch.first_fix_s, 1e-3, 4).unsigned_field(epoch.uptime_s, 1e-3, 4).bytes();
}

// NAV-DOP, 3.15.4.
std::string dops(const UbxEpoch& epoch) {
  const positioning::Fix& fix = epoch.seen.fix;
  Payload p;
  p.u4(itow(epoch));
  for (const auto member : {&positioning::Dop::gdop, &positioning::Dop::pdop, &positioning::Dop::tdop,
                            &positioning::Dop::vdop, &positioning::Dop::hdop})
    p.unsigned_field(dop(fix, member), 0.01, 2);
  return p.unsigned_field(horizontal_dop(fix, 1), 0.01, 2)
      .unsigned_field(horizontal_dop(fix, 0), 0.01, 2)
      .bytes();
}

// NAV-TIMEGPS, 3.15.24.
std::string time_gps(const UbxEpoch& epoch) {
  const geodesy::GpsTime t = epoch.seen.reported_time();
  const geodesy::GpsTime nearest = epoch.reported_time;
  Payload p;
  p.u4(itow(epoch)).u4(t.nanoseconds() - nearest.nanoseconds());
  p.u2(nearest.week()).u1(geodesy::leap_seconds(epoch.seen.time));
  p.u1(epoch.time_known ? 0b111 : 0);
  return p.unsigned_field(quality_of(epoch.seen.fix).time_s, 1e-9, 4).bytes();
}

// NAV-TIMEUTC, 3.15.28.
std::string time_utc(const UbxEpoch& epoch) {
  const geodesy::CalendarTime utc = geodesy::utc_from_gps(epoch.seen.reported_utc());
  Payload p;
  p.u4(itow(epoch)).unsigned_field(quality_of(epoch.seen.fix).time_s, 1e-9, 4);
  p.u4(utc.nanosecond).u2(utc.year);
  for (const int value : {utc.month, utc.day, utc.hour, utc.minute, utc.second}) p.u1(value);
  return p.u1(epoch.time_known ? 0b111 : 0).bytes();
}

// NAV-POSLLH, 3.15.12.
std::string position(const UbxEpoch& epoch) {
  const positioning::Fix& fix = epoch.seen.fix;
  const Quality q = quality_of(fix);
  Payload p;
  p.u4(itow(epoch)).signed_field(degrees_of(fix, &geodesy::Geodetic::longitude_rad), 1e-7, 4);
  p.signed_field(degrees_of(fix, &geodesy::Geodetic::latitude_rad), 1e-7, 4);
  for (const double height_m : heights_of(epoch)) p.signed_field(height_m, 1e-3, 4);
  return p.unsigned_field(q.horizontal_m, 1e-3, 4).unsigned_field(q.vertical_m, 1e-3, 4).bytes();
}

// NAV-HPPOSLLH, 3.15.8: the numbers of NAV-POSLLH and their remainders, in hundredths.
std::string precise_position(const UbxEpoch& epoch) {
  const positioning::Fix& fix = epoch.seen.fix;
  const Quality q = quality_of(fix);
  // Total in hundredths of the field's step; truncated to zero: the remainder has the value's sign.
  const auto hundredths = [](double value, double step) { return std::llround(value / step * 100); };
  const std::int64_t values[]{hundredths(degrees_of(fix, &geodesy::Geodetic::longitude_rad), 1e-7),
                              hundredths(degrees_of(fix, &geodesy::Geodetic::latitude_rad), 1e-7),
                              std::llround(heights_of(epoch)[0] * 1e4) * 10,
                              std::llround(heights_of(epoch)[1] * 1e4) * 10};
  Payload p;
  p.u1(0).zeros(2).u1(fix.solved() ? 0 : 1).u4(itow(epoch));
  for (const std::int64_t value : values) p.u4(value / 100);
  // Heights have tenths.
  for (std::size_t i = 0; i < 4; ++i) p.u1(values[i] % 100 / (i < 2 ? 1 : 10));
  return p.unsigned_field(q.horizontal_m, 1e-4, 4).unsigned_field(q.vertical_m, 1e-4, 4).bytes();
}

// NAV-VELNED, 3.15.31.
std::string velocity(const UbxEpoch& epoch) {
  const Quality q = quality_of(epoch.seen.fix);
  Payload p;
  p.u4(itow(epoch)).signed_field(q.north_mps, 0.01, 4).signed_field(q.east_mps, 0.01, 4);
  p.signed_field(q.down_mps, 0.01, 4).unsigned_field(std::hypot(q.ground_mps, q.down_mps), 0.01, 4);
  p.unsigned_field(q.ground_mps, 0.01, 4).signed_field(q.motion_deg, 1e-5, 4);
  return p.unsigned_field(q.speed_mps, 0.01, 4).unsigned_field(q.course_deg, 1e-5, 4).bytes();
}

// NAV-SOL, UBX-13003221 32.17.23.
std::string solution(const UbxEpoch& epoch) {
  const positioning::Fix& fix = epoch.seen.fix;
  const Quality q = quality_of(fix);
  const geodesy::GpsTime nearest = epoch.reported_time;
  Eigen::Vector3d ecef = Eigen::Vector3d::Zero(), speed = Eigen::Vector3d::Zero();
  if (fix.solved()) {
    ecef = fix.position_ecef;
    if (fix.velocity_enu_mps)
      speed = geodesy::enu_from_ecef_rotation(fix.position).transpose() * *fix.velocity_enu_mps;
  }
  Payload p;
  p.u4(itow(epoch)).u4(epoch.seen.reported_time().nanoseconds() - nearest.nanoseconds());
  p.u2(nearest.week());
  p.u1(ubx_type_of(fix)).u1(solution_flags(epoch));
  for (int i = 0; i < 3; ++i) p.signed_field(ecef[i], 0.01, 4);
  p.unsigned_field(q.position_m, 0.01, 4);
  for (int i = 0; i < 3; ++i) p.signed_field(speed[i], 0.01, 4);
  p.unsigned_field(q.speed_mps, 0.01, 4).unsigned_field(dop(fix, &positioning::Dop::pdop), 0.01, 2);
  return p.u1(0).u1(used(fix)).zeros(4).bytes();
}

// NAV-COV, 3.15.3: NN, NE, ND, EE, ED, DD of position and of velocity.
std::string covariance(const UbxEpoch& epoch) {
  const positioning::Fix& fix = epoch.seen.fix;
  const bool moving = fix.solved() && fix.velocity_covariance_enu.has_value();
  Payload p;
  p.u4(itow(epoch)).u1(0).u1(fix.solved() ? 1 : 0).u1(moving ? 1 : 0).zeros(9);
  const auto put = [&](bool valid, const Eigen::Matrix3d& enu) {
    if (!valid) {
      p.zeros(24);
      return;
    }
    for (const double value : {enu(1, 1), enu(1, 0), -enu(1, 2), enu(0, 0), -enu(0, 2), enu(2, 2)})
      p.r4(static_cast<float>(value));
  };
  put(fix.solved(), fix.covariance_enu);
  put(moving, fix.velocity_covariance_enu.value_or(Eigen::Matrix3d::Zero()));
  return p.bytes();
}

// NAV-PL, 3.15.9: bounds exceeded by one error in twenty on each axis (TMIR 5 % per epoch), from the reported
// covariance and the normal distribution. Frame 1: north, east, down.
std::string protection_level(const UbxEpoch& epoch) {
  constexpr double kFactor = 1.959964;  // two-sided 95 %
  const positioning::Fix& fix = epoch.seen.fix;
  const bool moving = fix.solved() && fix.velocity_covariance_enu.has_value();
  const auto clock_m = fix.solved() ? clock_sigma_m(fix) : std::nullopt;
  Payload p;
  p.u1(1).u1(5).u1(0);
  p.u1(fix.solved() ? 1 : 0).u1(fix.solved() ? 1 : 0).u1(moving ? 1 : 0).u1(moving ? 1 : 0);
  p.u1(clock_m ? 1 : 0).zeros(4).u4(itow(epoch));
  const auto put = [&](bool valid, const Eigen::Matrix3d& enu) {
    for (const Eigen::Index axis : {1, 0, 2})
      p.unsigned_field(valid ? kFactor * std::sqrt(std::max(0.0, enu(axis, axis))) : 0, 1e-3, 4);
  };
  put(fix.solved(), fix.covariance_enu);
  put(moving, fix.velocity_covariance_enu.value_or(Eigen::Matrix3d::Zero()));
  p.zeros(4).unsigned_field(clock_m ? kFactor * *clock_m / geodesy::kSpeedOfLight : 0, 1e-9, 4);
  return p.zeros(4).bytes();
}

// NAV-TIMELS, 3.15.27: the difference of GPS and UTC and the latest leap second, as in GPS's messages.
std::string leap_second(const UbxEpoch& epoch) {
  constexpr int kByGps = 2;
  const geodesy::GpsTime now = epoch.seen.time;
  const int seconds = geodesy::leap_seconds(now);
  const geodesy::GpsTime changed = geodesy::last_leap_second(now);
  const geodesy::GpsTime day_before = changed - (seconds + 1);  // the day that ended with it
  Payload p;
  p.u4(itow(epoch)).u1(0).zeros(3).u1(kByGps).u1(seconds).u1(kByGps).u1(0);
  p.u4(static_cast<std::int64_t>(std::floor(changed - now))).u2(day_before.week());
  p.u2(1 + day_before.nanosecond_of_week() / (86'400 * geodesy::GpsTime::kNanosecondsPerSecond)).zeros(3);
  return p.u1(epoch.time_known ? 3 : 0).bytes();
}

// NAV-RELPOSNED, 3.15.15, version 1: axes at the base, lengths in centimetres and tenths of a millimetre.
std::string relative_position(const UbxEpoch& epoch) {
  const positioning::Fix& fix = epoch.seen.fix;
  const std::optional<positioning::Baseline> baseline = fix.solved() ? fix.baseline : std::nullopt;
  positioning::Baseline b = baseline.value_or(positioning::Baseline());
  std::uint64_t flags = flags_of(fix) & (kUbxFixOk | kUbxDifferential);
  double heading_deg = 0, heading_sigma_deg = 0, length_sigma_m = 0;
  if (baseline) {
    flags |= 1 << 2;  // relPosValid
    flags |= (b.kind == positioning::FixKind::Fixed ? 2 : 1) << 3;
    flags |= (b.moving_base ? 1 : 0) << 5;
    const Eigen::Matrix3d rotation =
        geodesy::enu_from_ecef_rotation(geodesy::geodetic_from_ecef(b.base_ecef)) *
        geodesy::enu_from_ecef_rotation(fix.position).transpose();
    b.vector_enu = rotation * b.vector_enu;
    b.covariance_enu = rotation * b.covariance_enu * rotation.transpose();
    const Eigen::Vector3d along = b.vector_enu.normalized();  // zero length: 0
    length_sigma_m = std::sqrt(along.dot(b.covariance_enu * along));
    heading_deg = geodesy::degrees(b.heading_rad());
    heading_sigma_deg = std::min(180.0, geodesy::degrees(b.heading_sigma_rad()));
    constexpr double kReliable_deg = 5;  // u-blox gives no number
    flags |= (heading_sigma_deg <= kReliable_deg ? 1 : 0) << 8;
  }
  const Eigen::Vector3d& v = b.vector_enu;
  Payload p;
  p.u1(1).u1(0).u2(fix.correction_station.value_or(0)).u4(itow(epoch));
  std::array<std::int64_t, 4> tenths_mm{};
  const std::array metres{v.y(), v.x(), -v.z(), b.length_m()};
  for (std::size_t i = 0; i < metres.size(); ++i) {
    tenths_mm[i] = std::llround(metres[i] * 1e4);
    p.u4(tenths_mm[i] / 100);
  }
  p.signed_field(heading_deg, 1e-5, 4).zeros(4);
  for (const std::int64_t value : tenths_mm) p.u1(value % 100);
  for (const Eigen::Index axis : {1, 0, 2})
    p.unsigned_field(std::sqrt(b.covariance_enu(axis, axis)), 1e-4, 4);
  p.unsigned_field(length_sigma_m, 1e-4, 4).unsigned_field(heading_sigma_deg, 1e-5, 4);
  return p.zeros(4).u4(flags).bytes();
}

}  // namespace

// RXM-RTCM, 3.17.6, version 2. 65535: no station in the message.
std::string rtcm_payload(const ReceivedRtcm& received) {
  const int used = received.used ? (*received.used ? 2 : 1) : 0;
  Payload p;
  p.u1(2).u1((received.crc_failed ? 1 : 0) | used << 1).u2(0);
  p.u2(received.station.value_or(0xFFFF));
  return p.u2(received.type).bytes();
}

// RXM-COR, 3.17.1, version 1: RTCM 3 in clear, by its message number.
std::string correction_payload(const ReceivedRtcm& received) {
  constexpr std::uint64_t kRtcm = 1, kNoStation = 0xFFFF, kTypeIsKnown = 1U << 25, kInClear = 1U << 28;
  const std::uint64_t used = received.used ? (*received.used ? 2 : 1) : 0;
  std::uint64_t status = kRtcm | (received.crc_failed ? 2U : 1U) << 5 | used << 7;
  status |= static_cast<std::uint64_t>(received.station.value_or(kNoStation)) << 9 | kInClear;
  if (!received.crc_failed) status |= kTypeIsKnown;
  return Payload().u1(1).u1(0).zeros(2).u4(status).u2(received.type).u2(0).bytes();
}

std::uint32_t itow(const UbxEpoch& epoch) {
  return static_cast<std::uint32_t>(epoch.reported_time.nanosecond_of_week() / 1'000'000);
}

std::string payload(MessageId id, const UbxEpoch& epoch) {
  constexpr std::pair<MessageId, std::string (*)(const UbxEpoch&)> kMakers[]{
      {0x0107, pvt},
      {0x0103, status},
      {0x0104, dops},
      {0x0120, time_gps},
      {0x0121, time_utc},
      {0x0102, position},
      {0x0112, velocity},
      {0x0106, solution},
      {0x0136, covariance},
      {0x0162, protection_level},
      {0x0126, leap_second},
      {0x0114, precise_position},
      {0x0135, nav_sat},
      {0x0130, nav_svinfo},
      {0x0143, nav_sig},
      {0x0215, rxm_rawx},
      {0x0A09, mon_hw},
      {0x0A0B, mon_hw2},
      {0x0A38, mon_rf},
      {0x2709, sec_sig},
      {0x2710, sec_siglog},
      {kFusionStatus, esf_status},
      {kRelativePosition, relative_position}};
  for (const auto& [its_id, make] : kMakers)
    if (id == its_id) return make(epoch);
  return Payload().u4(itow(epoch)).bytes();  // NAV-EOE, 3.15.5
}

}  // namespace canyon::encoding::ubx
