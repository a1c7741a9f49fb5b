#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <type_traits>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/outputs/encoding/epoch_values.hpp"
#include "canyon/outputs/encoding/observations/fix_codes.hpp"
#include "canyon/receiver/positioning/least_squares.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"

// Epochs as ROS messages. Templates over the message types, shared by ROS 1 and ROS 2 and tested without
// either; the two differ only in the name of a stamp's nanoseconds and in the type of fixed arrays.
// docs/ros.md lists all fields.

namespace canyon::ros_messages {

/// A message's time since the beginning of the simulation, by its clock.
struct Stamp {
  std::int32_t sec = 0;       ///< >= 0
  std::uint32_t nanosec = 0;  ///< [0, 1e9)
};

/// The fields of a header.
struct Head {
  Stamp stamp;
  std::string frame_id;  ///< of the antenna
};

/// Number of a satellite, unique over all constellations, in extended NMEA 0183 numbering: GPS PRN, GLONASS
/// slot + 64, Galileo PRN + 300, BeiDou PRN + 400, QZSS PRN (193 and up), SBAS PRN (120 to 158).
[[nodiscard]] inline std::int32_t prn_number(gnss::SatelliteId id) {
  switch (id.system) {
    case gnss::System::GPS:
      return id.number;
    case gnss::System::GLONASS:
      return id.number + 64;
    case gnss::System::Galileo:
      return id.number + 300;
    case gnss::System::BeiDou:
      return id.number + 400;
    case gnss::System::QZSS:
      return id.number + 192;
    case gnss::System::SBAS:
      return id.number + 100;
  }
  return 0;
}

namespace detail {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Strings of messages may have their own allocator.
template <class String>
void assign(String& to, const std::string& from) {
  to.assign(from.data(), from.size());
}

template <class Header>
void set_header(Header& header, const Head& head) {
  if constexpr (requires { header.stamp.nanosec; }) {  // ROS 2
    header.stamp.sec = head.stamp.sec;
    header.stamp.nanosec = head.stamp.nanosec;
  } else {
    header.stamp.sec = static_cast<std::uint32_t>(std::max(head.stamp.sec, 0));
    header.stamp.nsec = head.stamp.nanosec;
  }
  assign(header.frame_id, head.frame_id);
}

[[nodiscard]] inline bool has_fix(const simulation::Epoch* epoch) {
  return epoch != nullptr && epoch->observed.fix.solved();
}

/// The covariance of a NavSatFix or GPSFix: east, north, up [m^2]; unknown if a fault reports none.
template <class Message>
void set_position_covariance(Message& message, const positioning::Fix& fix) {
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      message.position_covariance[3 * row + column] =
          fix.covariance_enu(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column));
    }
  }
  message.position_covariance_type =
      fix.covariance_enu.isZero(0) ? Message::COVARIANCE_TYPE_UNKNOWN : Message::COVARIANCE_TYPE_KNOWN;
}

/// A message's constant for a value of the engine's enumeration; both have the same order. They are
/// members of the message's type: enumerators in ROS 1, static members in ROS 2.
template <class Enum, std::size_t N>
[[nodiscard]] std::uint8_t code_of(Enum value, const std::uint8_t (&codes)[N]) {
  const auto index = static_cast<std::size_t>(value);
  return index < N ? codes[index] : std::uint8_t{255};
}

template <class M>
[[nodiscard]] std::uint8_t system_code(gnss::System system) {
  return code_of(system, {M::GPS, M::GLONASS, M::GALILEO, M::BEIDOU, M::QZSS, M::SBAS});
}

template <class Satellite>
[[nodiscard]] Satellite satellite_message(const receiver::SatelliteObservation& seen,
                                          const receiver::ReceiverEpoch& epoch) {
  const positioning::Fix& fix = epoch.fix;
  Satellite message;
  assign(message.id, gnss::to_string(seen.id));
  message.system = system_code<Satellite>(seen.id.system);
  message.prn = prn_number(seen.id);
  message.azimuth = seen.azimuth_rad;
  message.elevation = seen.elevation_rad;
  message.above_mask = seen.above_mask;
  message.visibility = code_of(
      seen.visibility, {Satellite::LOS, Satellite::LOS_MULTIPATH, Satellite::NLOS, Satellite::BLOCKED});
  const auto& measured = seen.measurement;
  message.cn0 = static_cast<float>(measured ? measured->cn0_dbhz.value_or(kNaN) : kNaN);
  message.pseudorange = measured ? measured->pseudorange_m : kNaN;
  message.doppler = measured ? measured->doppler_hz.value_or(kNaN) : kNaN;
  message.carrier_frequency = measured ? measured->carrier_frequency_hz : kNaN;
  message.excess_path = static_cast<float>(encoding::has_tracked_excess(seen) ? seen.excess_m : kNaN);
  message.noise = static_cast<float>(measured ? seen.noise_m : kNaN);
  message.pseudorange_error = static_cast<float>(measured ? seen.pseudorange_error_m : kNaN);
  message.used = seen.used;
  message.residual = static_cast<float>(positioning::residual_m(fix, seen.id).value_or(kNaN));
  message.lock = code_of(seen.lock, {Satellite::SEARCHING, Satellite::TRACKING, Satellite::HOLDING});
  message.true_cn0 = static_cast<float>(seen.cn0_dbhz.value_or(kNaN));
  const bool phase = measured && measured->carrier_phase_cycles;
  message.carrier_phase = phase ? *measured->carrier_phase_cycles : kNaN;
  message.phase_lock = phase && measured->phase_since ? epoch.time - *measured->phase_since : kNaN;
  message.excluded = encoding::is_excluded(fix, seen.id);
  return message;
}

}  // namespace detail

/// Keeps only the variances of a NavSatFix or GPSFix, as reported by most receiver drivers. Nodes that use a
/// part of a covariance, such as robot_localization in two dimensions, then get a valid one.
template <class Message>
void make_covariance_diagonal(Message& message) {
  if (message.position_covariance_type != Message::COVARIANCE_TYPE_KNOWN) return;
  for (std::size_t i = 0; i < 9; ++i)
    if (i % 4 != 0) message.position_covariance[i] = 0;
  message.position_covariance_type = Message::COVARIANCE_TYPE_DIAGONAL_KNOWN;
}

/// sensor_msgs/NavSatFix: degrees, metres above the ellipsoid, covariance in ENU [m^2], known. A QZSS signal
/// has no bit of its own in `service`. With a base's corrections, of codes or phases, the status is GBAS_FIX,
/// the message has no finer distinction; dead reckoning is NO_FIX with its position and covariance, as in
/// drivers of real receivers. Without a fix: status NO_FIX, service 0, NaN position and covariance,
/// covariance of unknown type. @param epoch null if the truth has not come: no fix.
template <class NavSatFix>
[[nodiscard]] NavSatFix fix_message(const Head& head, const simulation::Epoch* epoch) {
  using Status = std::remove_reference_t<decltype(std::declval<NavSatFix&>().status)>;
  NavSatFix message;
  detail::set_header(message.header, head);
  if (!detail::has_fix(epoch)) {
    message.status.status = Status::STATUS_NO_FIX;
    message.status.service = 0;
    message.latitude = message.longitude = message.altitude = detail::kNaN;
    std::fill(message.position_covariance.begin(), message.position_covariance.end(), detail::kNaN);
    message.position_covariance_type = NavSatFix::COVARIANCE_TYPE_UNKNOWN;
    return message;
  }
  const positioning::Fix& fix = epoch->observed.fix;
  message.status.status = encoding::codes_of(fix.kind()).navsat_status;
  int service = 0;
  for (const gnss::SatelliteId id : fix.used) {
    if (id.system == gnss::System::GPS) service |= Status::SERVICE_GPS;
    if (id.system == gnss::System::GLONASS) service |= Status::SERVICE_GLONASS;
    if (id.system == gnss::System::BeiDou) service |= Status::SERVICE_COMPASS;
    if (id.system == gnss::System::Galileo) service |= Status::SERVICE_GALILEO;
  }
  message.status.service = static_cast<std::uint16_t>(service);
  message.latitude = geodesy::degrees(fix.position.latitude_rad);
  message.longitude = geodesy::degrees(fix.position.longitude_rad);
  message.altitude = fix.position.height_m;
  detail::set_position_covariance(message, fix);
  return message;
}

/// geometry_msgs/TwistWithCovarianceStamped: velocity over ground, east, north, up [m/s], for any axes of
/// frame_id. The angular part is NaN, covariance[21] -1: not measured. Without a velocity the linear part is
/// NaN too; if its covariance is unknown, covariance[0] is -1.
template <class TwistWithCovarianceStamped>
[[nodiscard]] TwistWithCovarianceStamped velocity_message(const Head& head, const simulation::Epoch* epoch) {
  constexpr std::size_t kRow = 6;  // linear x, y, z, angular x, y, z
  TwistWithCovarianceStamped message;
  detail::set_header(message.header, head);
  auto& twist = message.twist.twist;
  auto& covariance = message.twist.covariance;
  twist.linear.x = twist.linear.y = twist.linear.z = detail::kNaN;
  twist.angular.x = twist.angular.y = twist.angular.z = detail::kNaN;
  std::fill(covariance.begin(), covariance.end(), 0.0);
  covariance[0] = -1;
  covariance[3 * kRow + 3] = -1;
  if (!detail::has_fix(epoch)) return message;
  const positioning::Fix& fix = epoch->observed.fix;
  if (fix.velocity_enu_mps) {
    twist.linear.x = fix.velocity_enu_mps->x();
    twist.linear.y = fix.velocity_enu_mps->y();
    twist.linear.z = fix.velocity_enu_mps->z();
    if (fix.velocity_covariance_enu) {
      for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t column = 0; column < 3; ++column) {
          covariance[kRow * row + column] = (*fix.velocity_covariance_enu)(static_cast<Eigen::Index>(row),
                                                                           static_cast<Eigen::Index>(column));
        }
      }
    }
  }
  return message;
}

/// canyon_msgs/GnssMultipath, the paper's; arrays ordered as in GnssMultipath.msg. No truth: no satellites.
template <class GnssMultipath>
[[nodiscard]] GnssMultipath multipath_message(const Head& head, const simulation::Epoch* epoch) {
  GnssMultipath message;
  detail::set_header(message.header, head);
  using NavSatFix = std::remove_reference_t<decltype(message.rec_pos)>;
  message.rec_pos = fix_message<NavSatFix>(head, epoch);
  message.num_vis_sat = message.num_block_sat = 0;
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  message.dop.assign(5, kNaN);
  if (epoch == nullptr) return message;
  const receiver::ReceiverEpoch& observed = epoch->observed;
  if (observed.fix.solved() && observed.fix.dop) {
    const positioning::Dop& dop = *observed.fix.dop;
    message.dop = {static_cast<float>(dop.pdop), static_cast<float>(dop.hdop), static_cast<float>(dop.vdop),
                   static_cast<float>(dop.tdop), static_cast<float>(dop.gdop)};
  }
  for (const receiver::SatelliteObservation& satellite : observed.satellites) {
    if (!satellite.above_mask) continue;
    const bool blocked = !satellite.measurement;
    if (blocked) message.sats_blocked.push_back(prn_number(satellite.id));
    message.range_offset.push_back(blocked ? kNaN : static_cast<float>(satellite.excess_m));
    message.noise.push_back(blocked ? kNaN : static_cast<float>(satellite.noise_m));
    ++(blocked ? message.num_block_sat : message.num_vis_sat);
  }
  return message;
}

/// canyon_msgs/GnssSatellites. @param epoch null if the truth has not come: status NO_TRUTH, no satellites.
template <class GnssSatellites>
[[nodiscard]] GnssSatellites satellites_message(const Head& head, const simulation::Epoch* epoch) {
  GnssSatellites message;
  detail::set_header(message.header, head);
  if (epoch == nullptr) {
    message.fix_status = GnssSatellites::NO_TRUTH;
    message.fix_kind = GnssSatellites::KIND_NONE;
    message.correction_age = static_cast<float>(detail::kNaN);
    message.gps_week = -1;
    message.gps_tow = message.clock_bias = message.clock_drift = detail::kNaN;
    return message;
  }
  using M = GnssSatellites;
  using Satellite = typename std::remove_reference_t<decltype(message.satellites)>::value_type;
  const receiver::ReceiverEpoch& observed = epoch->observed;
  message.fix_status =
      detail::code_of(observed.fix.status, {M::NOT_SOLVED, M::FIX, M::TOO_FEW_SATELLITES, M::SINGULAR,
                                            M::NOT_CONVERGED, M::WEAK_GEOMETRY, M::NO_SIGNAL});
  const positioning::FixKind kind = observed.fix.kind();
  message.fix_kind = detail::code_of(kind, {M::KIND_NONE, M::KIND_SINGLE, M::KIND_DIFFERENTIAL, M::KIND_FLOAT,
                                            M::KIND_FIXED, M::KIND_DEAD_RECKONING, M::KIND_COMBINED});
  message.correction_age = static_cast<float>(
      corrected(kind) ? observed.fix.correction_age_s.value_or(detail::kNaN) : detail::kNaN);
  message.gps_week = observed.time.week();
  message.gps_tow = observed.time.seconds_of_week();
  message.clock_bias = observed.clock_bias_s;
  message.clock_drift = observed.clock_drift;
  for (const std::string& fault : epoch->faults) {
    message.faults.emplace_back();
    detail::assign(message.faults.back(), fault);
  }
  message.satellites.reserve(observed.satellites.size());
  for (const receiver::SatelliteObservation& satellite : observed.satellites)
    message.satellites.push_back(detail::satellite_message<Satellite>(satellite, observed));
  return message;
}

/// sensor_msgs/LaserScan of the rays to the satellites: one range per ray, infinite without a hit
/// (REP 117). Rays of a sky have no common plane: "angles" are ray numbers, 0, 1, 2, ..., two for each
/// satellite above the horizon, direct and mirror ray, in the order of GnssSatellites.
/// @param ranges_m [m]; @param max_range_m length of the rays [m]
template <class LaserScan>
[[nodiscard]] LaserScan scan_message(const Head& head, std::span<const double> ranges_m, double max_range_m) {
  LaserScan message;
  detail::set_header(message.header, head);
  message.angle_min = 0;
  message.angle_max = ranges_m.empty() ? 0.0F : static_cast<float>(ranges_m.size() - 1);
  message.angle_increment = 1;
  message.time_increment = 0;  // all rays at once
  message.scan_time = 0;       // not known
  message.range_min = 0;
  message.range_max = static_cast<float>(max_range_m);
  message.ranges.reserve(ranges_m.size());
  for (const double range : ranges_m) message.ranges.push_back(static_cast<float>(range));
  return message;
}

}  // namespace canyon::ros_messages
