#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

// The messages of MAVLink's minimal.xml, common.xml and development.xml that Canyon sends or reads, in SI
// units and degrees; NaN: not known. Names give the frame: NED (north, east, down), FRD (forward, right, down
// of the body). Quaternions are w, x, y, z and rotate FRD into NED (or into the frame that the message
// names). Angular rates are about the body's axes. `time_us` is since 1970 (UTC), or since the sender
// started; `boot_s` since it started.

namespace canyon::mavlink {

/// Wire types of fields, with the names that are part of CRC_EXTRA.
enum class Wire : std::uint8_t { U8, I8, U16, I16, U32, I32, U64, F32 };
[[nodiscard]] std::size_t size_of(Wire type);
[[nodiscard]] std::string_view name_of(Wire type);

/// A field of a message: its definition, and the struct member that holds its value.
struct WireField {
  std::string_view name;
  Wire type = Wire::U8;
  std::size_t count = 1;   ///< elements
  bool array = false;      ///< also if `count` is 1
  bool extension = false;  ///< MAVLink 2 only, after the others
  double unit = 1;         ///< SI value of one count
  /// Count for "not known", NaN in the struct.
  std::optional<double> unknown;
  /// The first of `count` adjacent values.
  std::variant<double*, std::uint64_t*, std::uint32_t*, std::uint16_t*, std::uint8_t*, std::int8_t*> member;
};

using Quaternion = std::array<double, 4>;  ///< w, x, y, z
inline constexpr double kDegE7 = 1e-7;     ///< [deg]

/// Collects the fields of a message in the order of its definition; the argument of a message's visit().
class WireFields {
 public:
  /// A value with a unit. NaN is written as `unknown`; without `unknown` as NaN (floats) or 0. Out-of-range
  /// values become the nearest value of the type that is not `unknown`.
  void number(Wire type, std::string_view name, double& value, double unit = 1,
              std::optional<double> unknown = std::nullopt) {
    add({name, type, 1, false, extension_, unit, unknown, &value});
  }
  void vector(Wire type, const std::array<std::string_view, 3>& names, Eigen::Vector3d& value,
              double unit = 1) {
    for (int i = 0; i < 3; ++i) number(type, names[static_cast<std::size_t>(i)], value[i], unit);
  }
  /// Floats or bytes.
  template <typename Value, std::size_t N>
  void array(std::string_view name, std::array<Value, N>& values) {
    add({name, wire_of(values[0]), N, true, extension_, 1, std::nullopt, values.data()});
  }
  /// Counts, flags, words, unscaled on the wire. The arguments alternate between name and value.
  template <typename Whole, typename... Rest>
  void whole(std::string_view name, Whole& value, Rest&&... rest) {
    add({name, wire_of(value), 1, false, extension_, 1, std::nullopt, &value});
    if constexpr (sizeof...(rest) > 0) whole(rest...);
  }
  void put_lat_lon(double& latitude_deg, double& longitude_deg) {
    number(Wire::I32, "lat", latitude_deg, kDegE7);
    number(Wire::I32, "lon", longitude_deg, kDegE7);
  }
  void rates(Eigen::Vector3d& rates_radps) {
    vector(Wire::F32, {"rollspeed", "pitchspeed", "yawspeed"}, rates_radps);
  }
  void quaternion(Quaternion& q) {
    static constexpr std::array<std::string_view, 4> kNames{"q1", "q2", "q3", "q4"};
    for (std::size_t i = 0; i < kNames.size(); ++i) number(Wire::F32, kNames[i], q[i]);
  }
  /// The following fields are extensions.
  void extensions() { extension_ = true; }

  [[nodiscard]] std::span<const WireField> all() const { return fields_; }

 private:
  static Wire wire_of(double) { return Wire::F32; }
  static Wire wire_of(std::uint64_t) { return Wire::U64; }
  static Wire wire_of(std::uint32_t) { return Wire::U32; }
  static Wire wire_of(std::uint16_t) { return Wire::U16; }
  static Wire wire_of(std::uint8_t) { return Wire::U8; }
  static Wire wire_of(std::int8_t) { return Wire::I8; }
  void add(WireField field) { fields_.push_back(field); }

  bool extension_ = false;
  std::vector<WireField> fields_;
};

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
/// Upper right triangle of a 6 by 6 matrix, row by row; its first element NaN: not known.
using CovarianceTriangle = std::array<double, 21>;
inline constexpr CovarianceTriangle kNoCovariance{kUnknown};
// Units, and counts that mean "not known".
inline constexpr double kMilli = 1e-3, kCenti = 1e-2, kNo8 = 0xFF, kNo16 = 0xFFFF;

struct Heartbeat {
  static constexpr std::uint32_t kId = 0;
  static constexpr std::string_view kName = "HEARTBEAT";
  std::uint8_t type = 41;      ///< MAV_TYPE; 41: a GPS
  std::uint8_t autopilot = 8;  ///< MAV_AUTOPILOT; 8: none
  std::uint8_t base_mode = 0;  ///< MAV_MODE_FLAG
  std::uint32_t custom_mode = 0;
  std::uint8_t system_status = 4;  ///< MAV_STATE; 4: active
  std::uint8_t mavlink_version = 3;
  void visit(WireFields& f) {
    f.whole("type", type, "autopilot", autopilot, "base_mode", base_mode, "custom_mode", custom_mode);
    f.whole("system_status", system_status, "mavlink_version", mavlink_version);
  }
};

struct SystemTime {
  static constexpr std::uint32_t kId = 2;
  static constexpr std::string_view kName = "SYSTEM_TIME";
  std::uint64_t time_us = 0;
  double boot_s = 0;
  void visit(WireFields& f) {
    f.whole("time_unix_usec", time_us);
    f.number(Wire::U32, "time_boot_ms", boot_s, kMilli);
  }
};

struct GpsRawInt {
  static constexpr std::uint32_t kId = 24;
  static constexpr std::string_view kName = "GPS_RAW_INT";
  std::uint64_t time_us = 0;
  std::uint8_t fix_type = 0;  ///< GPS_FIX_TYPE, from 0: no GPS, no fix, 2D, 3D, DGPS, RTK float, RTK fixed
  double latitude_deg = 0, longitude_deg = 0;
  double altitude_m = 0;  ///< above mean sea level
  double hdop = kUnknown, vdop = kUnknown;
  double speed_mps = kUnknown;   ///< over ground
  double course_deg = kUnknown;  ///< from north, clockwise
  double satellites = kUnknown;
  double ellipsoidal_height_m = 0;
  double horizontal_accuracy_m = 0, vertical_accuracy_m = 0, speed_accuracy_mps = 0, course_accuracy_deg = 0;
  double yaw_deg = kUnknown;  ///< (0, 360]
  void visit(WireFields& f) {
    f.whole("time_usec", time_us, "fix_type", fix_type);
    f.put_lat_lon(latitude_deg, longitude_deg);
    f.number(Wire::I32, "alt", altitude_m, kMilli);
    f.number(Wire::U16, "eph", hdop, kCenti, kNo16);
    f.number(Wire::U16, "epv", vdop, kCenti, kNo16);
    f.number(Wire::U16, "vel", speed_mps, kCenti, kNo16);
    f.number(Wire::U16, "cog", course_deg, kCenti, kNo16);
    f.number(Wire::U8, "satellites_visible", satellites, 1, kNo8);
    f.extensions();
    f.number(Wire::I32, "alt_ellipsoid", ellipsoidal_height_m, kMilli);
    f.number(Wire::U32, "h_acc", horizontal_accuracy_m, kMilli);
    f.number(Wire::U32, "v_acc", vertical_accuracy_m, kMilli);
    f.number(Wire::U32, "vel_acc", speed_accuracy_mps, kMilli);
    f.number(Wire::U32, "hdg_acc", course_accuracy_deg, 1e-5);
    f.number(Wire::U16, "yaw", yaw_deg, kCenti, 0);
  }
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
  void visit(WireFields& f) {
    f.whole("satellites_visible", visible);
    f.array("satellite_prn", number);
    f.array("satellite_used", used);
    f.array("satellite_elevation", zenith_deg);
    f.array("satellite_azimuth", azimuth);
    f.array("satellite_snr", snr_db);
  }
};

struct AttitudeEuler {
  static constexpr std::uint32_t kId = 30;
  static constexpr std::string_view kName = "ATTITUDE";
  double boot_s = 0;
  Eigen::Vector3d roll_pitch_yaw_rad = Eigen::Vector3d::Zero();  ///< FRD to NED: yaw, then pitch, then roll
  Eigen::Vector3d rates_frd_radps = Eigen::Vector3d::Zero();
  void visit(WireFields& f) {
    f.number(Wire::U32, "time_boot_ms", boot_s, kMilli);
    f.vector(Wire::F32, {"roll", "pitch", "yaw"}, roll_pitch_yaw_rad);
    f.rates(rates_frd_radps);
  }
};

struct AttitudeQuaternion {
  static constexpr std::uint32_t kId = 31;
  static constexpr std::string_view kName = "ATTITUDE_QUATERNION";
  double boot_s = 0;
  Quaternion ned_from_frd{1, 0, 0, 0};
  Eigen::Vector3d rates_frd_radps = Eigen::Vector3d::Zero();
  Quaternion display_offset{};  ///< all 0: not given
  void visit(WireFields& f) {
    f.number(Wire::U32, "time_boot_ms", boot_s, kMilli);
    f.quaternion(ned_from_frd);
    f.rates(rates_frd_radps);
    f.extensions();
    f.array("repr_offset_q", display_offset);
  }
};

struct LocalPositionNed {
  static constexpr std::uint32_t kId = 32;
  static constexpr std::string_view kName = "LOCAL_POSITION_NED";
  double boot_s = 0;
  Eigen::Vector3d position_ned_m = Eigen::Vector3d::Zero();  ///< from the sender's own origin
  Eigen::Vector3d velocity_ned_mps = Eigen::Vector3d::Zero();
  void visit(WireFields& f) {
    f.number(Wire::U32, "time_boot_ms", boot_s, kMilli);
    f.vector(Wire::F32, {"x", "y", "z"}, position_ned_m);
    f.vector(Wire::F32, {"vx", "vy", "vz"}, velocity_ned_mps);
  }
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
  void visit(WireFields& f) {
    f.number(Wire::U32, "time_boot_ms", boot_s, kMilli);
    f.put_lat_lon(latitude_deg, longitude_deg);
    f.number(Wire::I32, "alt", altitude_m, kMilli);
    f.number(Wire::I32, "relative_alt", above_home_m, kMilli);
    f.vector(Wire::I16, {"vx", "vy", "vz"}, velocity_ned_mps, kCenti);
    f.number(Wire::U16, "hdg", heading_deg, kCenti, kNo16);
  }
};

/// Samples of inertial sensors, a magnetometer and a barometer. Values not flagged in `updated` are old.
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
  void visit(WireFields& f) {
    constexpr double kGauss = 1e-4, kHectopascal = 100;
    f.whole("time_usec", time_us);
    f.vector(Wire::F32, {"xacc", "yacc", "zacc"}, acceleration_frd_mps2);
    f.vector(Wire::F32, {"xgyro", "ygyro", "zgyro"}, rates_frd_radps);
    f.vector(Wire::F32, {"xmag", "ymag", "zmag"}, field_frd_tesla, kGauss);
    f.number(Wire::F32, "abs_pressure", pressure_pa, kHectopascal);
    f.number(Wire::F32, "diff_pressure", differential_pa, kHectopascal);
    f.number(Wire::F32, "pressure_alt", pressure_altitude_m);
    f.number(Wire::F32, "temperature", temperature_c);
    f.whole("fields_updated", updated);
    f.extensions();
    f.whole("id", sensor_id);
  }
};

struct VisionPositionEstimate {
  static constexpr std::uint32_t kId = 102;
  static constexpr std::string_view kName = "VISION_POSITION_ESTIMATE";
  std::uint64_t time_us = 0;
  Eigen::Vector3d position_ned_m = Eigen::Vector3d::Zero();      ///< in a local frame
  Eigen::Vector3d roll_pitch_yaw_rad = Eigen::Vector3d::Zero();  ///< FRD to this frame
  CovarianceTriangle covariance = kNoCovariance;                 ///< of both
  std::uint8_t reset_counter = 0;
  void visit(WireFields& f) {
    f.whole("usec", time_us);
    f.vector(Wire::F32, {"x", "y", "z"}, position_ned_m);
    f.vector(Wire::F32, {"roll", "pitch", "yaw"}, roll_pitch_yaw_rad);
    f.extensions();
    f.array("covariance", covariance);
    f.whole("reset_counter", reset_counter);
  }
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
  void visit(WireFields& f) {
    f.quaternion(ned_from_frd);
    f.vector(Wire::F32, {"roll", "pitch", "yaw"}, roll_pitch_yaw_rad);
    f.vector(Wire::F32, {"xacc", "yacc", "zacc"}, acceleration_frd_mps2);
    f.vector(Wire::F32, {"xgyro", "ygyro", "zgyro"}, rates_frd_radps);
    f.number(Wire::F32, "lat", coarse_latitude_deg);
    f.number(Wire::F32, "lon", coarse_longitude_deg);
    f.number(Wire::F32, "alt", altitude_m);
    f.number(Wire::F32, "std_dev_horz", horizontal_sigma_m);
    f.number(Wire::F32, "std_dev_vert", vertical_sigma_m);
    f.vector(Wire::F32, {"vn", "ve", "vd"}, velocity_ned_mps);
    f.extensions();
    f.number(Wire::I32, "lat_int", fine_latitude_deg, kDegE7, 0);
    f.number(Wire::I32, "lon_int", fine_longitude_deg, kDegE7, 0);
  }

 private:
  [[nodiscard]] static double known(double fine, double coarse) { return fine == fine ? fine : coarse; }
};

/// Accuracies are as PX4 reads them: standard deviations [m]; in the definition they are dilutions.
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
  void visit(WireFields& f) {
    f.whole("time_usec", time_us, "fix_type", fix_type);
    f.put_lat_lon(latitude_deg, longitude_deg);
    f.number(Wire::I32, "alt", altitude_m, kMilli);
    f.number(Wire::U16, "eph", horizontal_accuracy_m, kCenti, kNo16);
    f.number(Wire::U16, "epv", vertical_accuracy_m, kCenti, kNo16);
    f.number(Wire::U16, "vel", speed_mps, kCenti, kNo16);
    f.vector(Wire::I16, {"vn", "ve", "vd"}, velocity_ned_mps, kCenti);
    f.number(Wire::U16, "cog", course_deg, kCenti, kNo16);
    f.number(Wire::U8, "satellites_visible", satellites, 1, kNo8);
    f.extensions();
    f.whole("id", gps_id);
    f.number(Wire::U16, "yaw", yaw_deg, kCenti, 0);
  }
};

/// The baseline of an RTK receiver, from base to antenna.
struct GpsRtk {
  static constexpr std::uint32_t kId = 127;
  static constexpr std::string_view kName = "GPS_RTK";
  double boot_s = 0;  ///< time of the corrections in use
  std::uint8_t receiver_id = 0;
  std::uint16_t week = 0;  ///< of GPS
  double time_of_week_s = 0;
  std::uint8_t health = 0;   ///< the receiver's own scale
  std::uint8_t rate_hz = 0;  ///< of corrections received; 0: not known
  std::uint8_t satellites = 0;
  std::uint8_t frame = 1;  ///< RTK_BASELINE_COORDINATE_SYSTEM: 0 ECEF, 1 NED
  Eigen::Vector3d baseline_m = Eigen::Vector3d::Zero();
  double accuracy_m = 0;        ///< the definition has no unit; millimetres on the wire, like the baseline
  double hypotheses_count = 0;  ///< of integer ambiguities; 1: fixed
  void visit(WireFields& f) {
    f.number(Wire::U32, "time_last_baseline_ms", boot_s, kMilli);
    f.whole("rtk_receiver_id", receiver_id, "wn", week);
    f.number(Wire::U32, "tow", time_of_week_s, kMilli);
    f.whole("rtk_health", health, "rtk_rate", rate_hz, "nsats", satellites);
    f.whole("baseline_coords_type", frame);
    f.vector(Wire::I32, {"baseline_a_mm", "baseline_b_mm", "baseline_c_mm"}, baseline_m, kMilli);
    f.number(Wire::U32, "accuracy", accuracy_m, kMilli);
    f.number(Wire::I32, "iar_num_hypotheses", hypotheses_count);
  }
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
  void visit(WireFields& f) {
    constexpr double kMilliG = 9.80665e-3;  // [m/s^2]
    f.whole("time_usec", time_us);
    f.array("attitude_quaternion", ned_from_frd);
    f.rates(rates_frd_radps);
    f.put_lat_lon(latitude_deg, longitude_deg);
    f.number(Wire::I32, "alt", altitude_m, kMilli);
    f.vector(Wire::I16, {"vx", "vy", "vz"}, velocity_ned_mps, kCenti);
    f.number(Wire::U16, "ind_airspeed", indicated_airspeed_mps, kCenti);
    f.number(Wire::U16, "true_airspeed", true_airspeed_mps, kCenti);
    f.vector(Wire::I16, {"xacc", "yacc", "zacc"}, acceleration_frd_mps2, kMilliG);
  }
};

struct AttPosMocap {
  static constexpr std::uint32_t kId = 138;
  static constexpr std::string_view kName = "ATT_POS_MOCAP";
  std::uint64_t time_us = 0;
  Quaternion ned_from_frd{1, 0, 0, 0};
  Eigen::Vector3d position_ned_m = Eigen::Vector3d::Zero();  ///< in the room's frame
  CovarianceTriangle covariance = kNoCovariance;
  void visit(WireFields& f) {
    f.whole("time_usec", time_us);
    f.array("q", ned_from_frd);
    f.vector(Wire::F32, {"x", "y", "z"}, position_ned_m);
    f.extensions();
    f.array("covariance", covariance);
  }
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
  void visit(WireFields& f) {
    f.whole("time_usec", time_us, "gps_id", gps_id, "ignore_flags", ignore);
    f.number(Wire::U32, "time_week_ms", time_of_week_s, kMilli);
    f.whole("time_week", week, "fix_type", fix_type);
    f.put_lat_lon(latitude_deg, longitude_deg);
    f.number(Wire::F32, "alt", altitude_m);
    f.number(Wire::F32, "hdop", hdop, 1, kNo16);
    f.number(Wire::F32, "vdop", vdop, 1, kNo16);
    f.vector(Wire::F32, {"vn", "ve", "vd"}, velocity_ned_mps);
    f.number(Wire::F32, "speed_accuracy", speed_accuracy_mps);
    f.number(Wire::F32, "horiz_accuracy", horizontal_accuracy_m);
    f.number(Wire::F32, "vert_accuracy", vertical_accuracy_m);
    f.whole("satellites_visible", satellites);
    f.extensions();
    f.number(Wire::U16, "yaw", yaw_deg, kCenti, 0);
  }
};

/// RTCM 3 for a vehicle's receivers, a whole message or a part; frames.hpp makes and joins parts.
struct GpsRtcmData {
  static constexpr std::uint32_t kId = 233;
  static constexpr std::string_view kName = "GPS_RTCM_DATA";
  std::uint8_t flags = 0;  ///< bit 0: a part; bits 1 and 2: its number; bits 3 to 7: number of the message
  std::uint8_t length = 0;
  std::array<std::uint8_t, 180> data{};
  void visit(WireFields& f) {
    f.whole("flags", flags, "len", length);
    f.array("data", data);
  }
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
  CovarianceTriangle pose_covariance = kNoCovariance, velocity_covariance = kNoCovariance;
  std::uint8_t reset_counter = 0;
  std::uint8_t estimator_type = 0;
  std::int8_t quality = 0;  ///< [%]; 0: not known, -1: failed
  void visit(WireFields& f) {
    f.whole("time_usec", time_us, "frame_id", frame, "child_frame_id", child_frame);
    f.vector(Wire::F32, {"x", "y", "z"}, position_m);
    f.array("q", frame_from_body);
    f.vector(Wire::F32, {"vx", "vy", "vz"}, velocity_mps);
    f.rates(rates_radps);
    f.array("pose_covariance", pose_covariance);
    f.array("velocity_covariance", velocity_covariance);
    f.extensions();
    f.whole("reset_counter", reset_counter, "estimator_type", estimator_type, "quality", quality);
  }
};

struct CommandLong {
  static constexpr std::uint32_t kId = 76;
  static constexpr std::string_view kName = "COMMAND_LONG";
  std::array<double, 7> parameters{};
  std::uint16_t command = 0;                             ///< MAV_CMD
  std::uint8_t target_system = 0, target_component = 0;  ///< 0: all
  std::uint8_t confirmation = 0;
  void visit(WireFields& f) {
    f.whole("target_system", target_system, "target_component", target_component, "command", command);
    f.whole("confirmation", confirmation);
    static constexpr std::array<std::string_view, 7> kNames{"param1", "param2", "param3", "param4",
                                                            "param5", "param6", "param7"};
    for (std::size_t i = 0; i < kNames.size(); ++i) f.number(Wire::F32, kNames[i], parameters[i]);
  }
};

/// Of development.xml. States: 0 not known; jamming and spoofing 1 none, 2 mitigated, 3 detected.
struct GnssIntegrity {
  static constexpr std::uint32_t kId = 441;
  static constexpr std::string_view kName = "GNSS_INTEGRITY";
  std::uint8_t receiver_id = 0;
  std::uint32_t system_errors = 0;  ///< GPS_SYSTEM_ERROR_FLAGS
  std::uint8_t authentication_state = 0, jamming_state = 0, spoofing_state = 0, raim_state = 0;
  double raim_horizontal_m = kUnknown, raim_vertical_m = kUnknown;  ///< expected accuracies
  /// Of corrections, receiver, signals, postprocessing: 0 to 10, 255 not known.
  std::array<std::uint8_t, 4> quality{255, 255, 255, 255};
  void visit(WireFields& f) {
    f.whole("id", receiver_id, "system_errors", system_errors);
    f.whole("authentication_state", authentication_state, "jamming_state", jamming_state);
    f.whole("spoofing_state", spoofing_state, "raim_state", raim_state);
    f.number(Wire::U16, "raim_hfom", raim_horizontal_m, kCenti, kNo16);
    f.number(Wire::U16, "raim_vfom", raim_vertical_m, kCenti, kNo16);
    f.whole("corrections_quality", quality[0], "system_status_summary", quality[1]);
    f.whole("gnss_signal_quality", quality[2], "post_processing_quality", quality[3]);
  }
};

using Message = std::variant<Heartbeat, SystemTime, GpsRawInt, GpsStatus, AttitudeEuler, AttitudeQuaternion,
                             LocalPositionNed, GlobalPositionInt, HighresImu, VisionPositionEstimate,
                             SimState, HilGps, GpsRtk, HilStateQuaternion, AttPosMocap, GpsInput, GpsRtcmData,
                             Odometry, CommandLong, GnssIntegrity>;

}  // namespace canyon::mavlink
