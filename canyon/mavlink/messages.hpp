#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <string_view>
#include <variant>

#include "canyon/mavlink/fields.hpp"

// The messages of MAVLink's minimal.xml and common.xml that Canyon sends or reads, in SI units and degrees;
// NaN: not known. Frames are named: NED (north, east, down), FRD (forward, right, down of the body).
// Quaternions are w, x, y, z and turn FRD into NED (or into the frame that the message names). Angular rates
// are about the body's axes. `time_us` is since 1970 (UTC), or since the sender began; `boot_s` since it
// began.

namespace canyon::mavlink {

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
using Quaternion = std::array<double, 4>;  ///< w, x, y, z
/// Upper right triangle of a 6 by 6 matrix, row by row; its first element NaN: not known.
using Covariance = std::array<double, 21>;
inline constexpr Covariance kNoCovariance{kUnknown};

struct Heartbeat {
  static constexpr std::uint32_t kId = 0;
  static constexpr std::string_view kName = "HEARTBEAT";
  std::uint8_t type = 41;      ///< MAV_TYPE; 41: a GPS
  std::uint8_t autopilot = 8;  ///< MAV_AUTOPILOT; 8: none
  std::uint8_t base_mode = 0;  ///< MAV_MODE_FLAG
  std::uint32_t custom_mode = 0;
  std::uint8_t system_status = 4;  ///< MAV_STATE; 4: active
  std::uint8_t mavlink_version = 3;
};

struct SystemTime {
  static constexpr std::uint32_t kId = 2;
  static constexpr std::string_view kName = "SYSTEM_TIME";
  std::uint64_t time_us = 0;
  double boot_s = 0;
};

struct GpsRawInt {
  static constexpr std::uint32_t kId = 24;
  static constexpr std::string_view kName = "GPS_RAW_INT";
  std::uint64_t time_us = 0;
  std::uint8_t fix_type =
      0;  ///< GPS_FIX_TYPE: 0 no GPS, 1 no fix, 2 2D, 3 3D, 4 DGPS, 5 RTK float, 6 RTK fixed
  double latitude_deg = 0, longitude_deg = 0;
  double altitude_m = 0;  ///< above mean sea level
  double hdop = kUnknown, vdop = kUnknown;
  double speed_mps = kUnknown;   ///< over ground
  double course_deg = kUnknown;  ///< from north, clockwise
  double satellites = kUnknown;
  double ellipsoidal_height_m = 0;
  double horizontal_accuracy_m = 0, vertical_accuracy_m = 0, speed_accuracy_mps = 0, course_accuracy_deg = 0;
  double yaw_deg = kUnknown;  ///< (0, 360]
};

/// GPS_STATUS, which has up to 20 satellites.
struct GpsStatus {
  static constexpr std::uint32_t kId = 25;
  static constexpr std::string_view kName = "GPS_STATUS";
  std::uint8_t visible = 0;
  std::array<std::uint8_t, 20> number{};
  std::array<std::uint8_t, 20> used{};
  std::array<std::uint8_t, 20> zenith_deg{};  ///< 0 above the receiver, 90 at the horizon
  std::array<std::uint8_t, 20> azimuth{};     ///< of 255 to the full circle
  std::array<std::uint8_t, 20> snr_db{};
};

struct Attitude {
  static constexpr std::uint32_t kId = 30;
  static constexpr std::string_view kName = "ATTITUDE";
  double boot_s = 0;
  Eigen::Vector3d roll_pitch_yaw_rad = Eigen::Vector3d::Zero();  ///< FRD to NED: yaw, then pitch, then roll
  Eigen::Vector3d rates_frd_radps = Eigen::Vector3d::Zero();
};

struct AttitudeQuaternion {
  static constexpr std::uint32_t kId = 31;
  static constexpr std::string_view kName = "ATTITUDE_QUATERNION";
  double boot_s = 0;
  Quaternion ned_from_frd{1, 0, 0, 0};
  Eigen::Vector3d rates_frd_radps = Eigen::Vector3d::Zero();
  Quaternion display_offset{};  ///< all 0: not given
};

struct LocalPositionNed {
  static constexpr std::uint32_t kId = 32;
  static constexpr std::string_view kName = "LOCAL_POSITION_NED";
  double boot_s = 0;
  Eigen::Vector3d position_ned_m = Eigen::Vector3d::Zero();  ///< from the sender's own origin
  Eigen::Vector3d velocity_ned_mps = Eigen::Vector3d::Zero();
};

struct GlobalPositionInt {
  static constexpr std::uint32_t kId = 33;
  static constexpr std::string_view kName = "GLOBAL_POSITION_INT";
  double boot_s = 0;
  double latitude_deg = 0, longitude_deg = 0;
  double altitude_m = 0;  ///< above mean sea level
  double above_home_m = 0;
  Eigen::Vector3d velocity_ned_mps = Eigen::Vector3d::Zero();
  double heading_deg = kUnknown;
};

/// Samples of inertial sensors, a magnetometer and a barometer. Values that are not updated are the last
/// ones.
struct HighresImu {
  static constexpr std::uint32_t kId = 105;
  static constexpr std::string_view kName = "HIGHRES_IMU";
  /// HIGHRES_IMU_UPDATED_FLAGS
  enum Updated : std::uint16_t {
    kAcceleration = 0x7,
    kRates = 0x38,
    kField = 0x1C0,
    kPressure = 0x200,
    kAltitude = 0x800,
    kTemperature = 0x1000,
  };
  std::uint64_t time_us = 0;
  Eigen::Vector3d acceleration_frd_mps2 = Eigen::Vector3d::Zero();  ///< specific force
  Eigen::Vector3d rates_frd_radps = Eigen::Vector3d::Zero();
  Eigen::Vector3d field_frd_tesla = Eigen::Vector3d::Zero();
  double pressure_pa = 0, differential_pa = 0;
  double pressure_altitude_m = 0;
  double temperature_c = 0;
  std::uint16_t updated = 0;  ///< Updated
  std::uint8_t sensor_id = 0;
};

struct VisionPositionEstimate {
  static constexpr std::uint32_t kId = 102;
  static constexpr std::string_view kName = "VISION_POSITION_ESTIMATE";
  std::uint64_t time_us = 0;
  Eigen::Vector3d position_ned_m = Eigen::Vector3d::Zero();      ///< in a local frame
  Eigen::Vector3d roll_pitch_yaw_rad = Eigen::Vector3d::Zero();  ///< FRD to it
  Covariance covariance = kNoCovariance;                         ///< of both
  std::uint8_t reset_counter = 0;
};

struct SimState {
  static constexpr std::uint32_t kId = 108;
  static constexpr std::string_view kName = "SIM_STATE";
  Quaternion ned_from_frd{1, 0, 0, 0};
  Eigen::Vector3d roll_pitch_yaw_rad = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration_frd_mps2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d rates_frd_radps = Eigen::Vector3d::Zero();
  double coarse_latitude_deg = 0, coarse_longitude_deg = 0;  ///< floats: to some metres
  double altitude_m = 0;
  double horizontal_sigma_m = 0, vertical_sigma_m = 0;
  Eigen::Vector3d velocity_ned_mps = Eigen::Vector3d::Zero();
  double fine_latitude_deg = kUnknown, fine_longitude_deg = kUnknown;

  [[nodiscard]] double latitude_deg() const { return known(fine_latitude_deg, coarse_latitude_deg); }
  [[nodiscard]] double longitude_deg() const { return known(fine_longitude_deg, coarse_longitude_deg); }

 private:
  [[nodiscard]] static double known(double fine, double coarse) { return fine == fine ? fine : coarse; }
};

/// Accuracies are what PX4 reads: standard deviations [m], where the definition has dilutions.
struct HilGps {
  static constexpr std::uint32_t kId = 113;
  static constexpr std::string_view kName = "HIL_GPS";
  std::uint64_t time_us = 0;
  std::uint8_t fix_type = 0;  ///< as GpsRawInt has it
  double latitude_deg = 0, longitude_deg = 0;
  double altitude_m = 0;  ///< above mean sea level
  double horizontal_accuracy_m = kUnknown, vertical_accuracy_m = kUnknown;
  double speed_mps = kUnknown;  ///< over ground
  Eigen::Vector3d velocity_ned_mps = Eigen::Vector3d::Zero();
  double course_deg = kUnknown;  ///< from north, clockwise
  double satellites = kUnknown;
  std::uint8_t gps_id = 0;
  double yaw_deg = kUnknown;  ///< (0, 360]
};

/// The baseline of an RTK receiver, from base to antenna.
struct GpsRtk {
  static constexpr std::uint32_t kId = 127;
  static constexpr std::string_view kName = "GPS_RTK";
  double boot_s = 0;  ///< of the corrections in use
  std::uint8_t receiver_id = 0;
  std::uint16_t week = 0;  ///< of GPS
  double time_of_week_s = 0;
  std::uint8_t health = 0;   ///< the receiver's own scale
  std::uint8_t rate_hz = 0;  ///< of corrections received; 0: not known
  std::uint8_t satellites = 0;
  std::uint8_t frame = 1;  ///< RTK_BASELINE_COORDINATE_SYSTEM: 0 ECEF, 1 NED
  Eigen::Vector3d baseline_m = Eigen::Vector3d::Zero();
  double accuracy_m = 0;        ///< the definition states no unit; millimetres on the wire, as the baseline
  double hypotheses_count = 0;  ///< of whole ambiguities; 1: fixed
};

struct HilStateQuaternion {
  static constexpr std::uint32_t kId = 115;
  static constexpr std::string_view kName = "HIL_STATE_QUATERNION";
  std::uint64_t time_us = 0;
  Quaternion ned_from_frd{1, 0, 0, 0};
  Eigen::Vector3d rates_frd_radps = Eigen::Vector3d::Zero();
  double latitude_deg = 0, longitude_deg = 0, altitude_m = 0;
  Eigen::Vector3d velocity_ned_mps = Eigen::Vector3d::Zero();
  double indicated_airspeed_mps = 0, true_airspeed_mps = 0;
  Eigen::Vector3d acceleration_frd_mps2 = Eigen::Vector3d::Zero();
};

struct AttPosMocap {
  static constexpr std::uint32_t kId = 138;
  static constexpr std::string_view kName = "ATT_POS_MOCAP";
  std::uint64_t time_us = 0;
  Quaternion ned_from_frd{1, 0, 0, 0};
  Eigen::Vector3d position_ned_m = Eigen::Vector3d::Zero();  ///< in the room's frame
  Covariance covariance = kNoCovariance;
};

struct GpsInput {
  static constexpr std::uint32_t kId = 232;
  static constexpr std::string_view kName = "GPS_INPUT";
  /// GPS_INPUT_IGNORE_FLAGS
  enum Ignore : std::uint16_t {
    kAltitude = 1,
    kHdop = 2,
    kVdop = 4,
    kHorizontalVelocity = 8,
    kVerticalVelocity = 16,
    kSpeedAccuracy = 32,
    kHorizontalAccuracy = 64,
    kVerticalAccuracy = 128,
  };
  std::uint64_t time_us = 0;
  std::uint8_t gps_id = 0;
  std::uint16_t ignore = 0;   ///< Ignore
  double time_of_week_s = 0;  ///< GPS time, to the millisecond
  std::uint16_t week = 0;     ///< of GPS
  std::uint8_t fix_type = 0;  ///< as GpsRawInt has it
  double latitude_deg = 0, longitude_deg = 0;
  double altitude_m = 0;  ///< above mean sea level
  double hdop = kUnknown, vdop = kUnknown;
  Eigen::Vector3d velocity_ned_mps = Eigen::Vector3d::Zero();
  double speed_accuracy_mps = 0, horizontal_accuracy_m = 0, vertical_accuracy_m = 0;
  std::uint8_t satellites = 0;
  double yaw_deg = kUnknown;  ///< (0, 360]
};

/// RTCM 3 for a vehicle's receivers, a message or a part of one; frames.hpp makes and joins parts.
struct GpsRtcmData {
  static constexpr std::uint32_t kId = 233;
  static constexpr std::string_view kName = "GPS_RTCM_DATA";
  std::uint8_t flags = 0;  ///< bit 0: a part; bits 1 and 2: its number; bits 3 to 7: number of the message
  std::uint8_t length = 0;
  std::array<std::uint8_t, 180> data{};
};

struct Odometry {
  static constexpr std::uint32_t kId = 331;
  static constexpr std::string_view kName = "ODOMETRY";
  std::uint64_t time_us = 0;
  std::uint8_t frame = 0;        ///< MAV_FRAME of position and attitude
  std::uint8_t child_frame = 0;  ///< MAV_FRAME of velocity and rates
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Quaternion frame_from_body{1, 0, 0, 0};
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d rates_radps = Eigen::Vector3d::Zero();
  Covariance pose_covariance = kNoCovariance, velocity_covariance = kNoCovariance;
  std::uint8_t reset_counter = 0;
  std::uint8_t estimator_type = 0;
  std::int8_t quality = 0;  ///< [%]; 0: not known, -1: failed
};

struct CommandLong {
  static constexpr std::uint32_t kId = 76;
  static constexpr std::string_view kName = "COMMAND_LONG";
  std::array<double, 7> parameters{};
  std::uint16_t command = 0;                             ///< MAV_CMD
  std::uint8_t target_system = 0, target_component = 0;  ///< 0: everybody
  std::uint8_t confirmation = 0;
};

/// The definition of each: names, types and order are what CRC_EXTRA and layout follow from.
void visit(Fields& f, Heartbeat& m);
void visit(Fields& f, SystemTime& m);
void visit(Fields& f, GpsRawInt& m);
void visit(Fields& f, GpsStatus& m);
void visit(Fields& f, Attitude& m);
void visit(Fields& f, AttitudeQuaternion& m);
void visit(Fields& f, LocalPositionNed& m);
void visit(Fields& f, GlobalPositionInt& m);
void visit(Fields& f, HighresImu& m);
void visit(Fields& f, VisionPositionEstimate& m);
void visit(Fields& f, SimState& m);
void visit(Fields& f, HilGps& m);
void visit(Fields& f, GpsRtk& m);
void visit(Fields& f, HilStateQuaternion& m);
void visit(Fields& f, AttPosMocap& m);
void visit(Fields& f, GpsInput& m);
void visit(Fields& f, GpsRtcmData& m);
void visit(Fields& f, Odometry& m);
void visit(Fields& f, CommandLong& m);

using Message =
    std::variant<Heartbeat, SystemTime, GpsRawInt, GpsStatus, Attitude, AttitudeQuaternion, LocalPositionNed,
                 GlobalPositionInt, HighresImu, VisionPositionEstimate, SimState, HilGps, GpsRtk,
                 HilStateQuaternion, AttPosMocap, GpsInput, GpsRtcmData, Odometry, CommandLong>;

}  // namespace canyon::mavlink
