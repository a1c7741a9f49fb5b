#include "canyon/mavlink/messages.hpp"

namespace canyon::mavlink {
namespace {

constexpr double kDegE7 = 1e-7, kMilli = 1e-3, kCenti = 1e-2;
constexpr double kMilliG = 9.80665e-3;  ///< [m/s^2]
constexpr double kNo8 = 0xFF, kNo16 = 0xFFFF;

void place(Fields& f, double& latitude_deg, double& longitude_deg) {
  f.number(Wire::I32, "lat", latitude_deg, kDegE7);
  f.number(Wire::I32, "lon", longitude_deg, kDegE7);
}

void rates(Fields& f, Eigen::Vector3d& rates_radps) {
  f.vector(Wire::F32, {"rollspeed", "pitchspeed", "yawspeed"}, rates_radps);
}

void quaternion(Fields& f, Quaternion& q) {
  f.number(Wire::F32, "q1", q[0]);
  f.number(Wire::F32, "q2", q[1]);
  f.number(Wire::F32, "q3", q[2]);
  f.number(Wire::F32, "q4", q[3]);
}

}  // namespace

void visit(Fields& f, Heartbeat& m) {
  f.whole("type", m.type);
  f.whole("autopilot", m.autopilot);
  f.whole("base_mode", m.base_mode);
  f.whole("custom_mode", m.custom_mode);
  f.whole("system_status", m.system_status);
  f.whole("mavlink_version", m.mavlink_version);
}

void visit(Fields& f, SystemTime& m) {
  f.whole("time_unix_usec", m.time_us);
  f.number(Wire::U32, "time_boot_ms", m.boot_s, kMilli);
}

void visit(Fields& f, GpsRawInt& m) {
  f.whole("time_usec", m.time_us);
  f.whole("fix_type", m.fix_type);
  place(f, m.latitude_deg, m.longitude_deg);
  f.number(Wire::I32, "alt", m.altitude_m, kMilli);
  f.number(Wire::U16, "eph", m.hdop, kCenti, kNo16);
  f.number(Wire::U16, "epv", m.vdop, kCenti, kNo16);
  f.number(Wire::U16, "vel", m.speed_mps, kCenti, kNo16);
  f.number(Wire::U16, "cog", m.course_deg, kCenti, kNo16);
  f.number(Wire::U8, "satellites_visible", m.satellites, 1, kNo8);
  f.extensions();
  f.number(Wire::I32, "alt_ellipsoid", m.ellipsoidal_height_m, kMilli);
  f.number(Wire::U32, "h_acc", m.horizontal_accuracy_m, kMilli);
  f.number(Wire::U32, "v_acc", m.vertical_accuracy_m, kMilli);
  f.number(Wire::U32, "vel_acc", m.speed_accuracy_mps, kMilli);
  f.number(Wire::U32, "hdg_acc", m.course_accuracy_deg, 1e-5);
  f.number(Wire::U16, "yaw", m.yaw_deg, kCenti, 0);
}

void visit(Fields& f, GpsStatus& m) {
  f.whole("satellites_visible", m.visible);
  f.array("satellite_prn", m.number);
  f.array("satellite_used", m.used);
  f.array("satellite_elevation", m.zenith_deg);
  f.array("satellite_azimuth", m.azimuth);
  f.array("satellite_snr", m.snr_db);
}

void visit(Fields& f, Attitude& m) {
  f.number(Wire::U32, "time_boot_ms", m.boot_s, kMilli);
  f.vector(Wire::F32, {"roll", "pitch", "yaw"}, m.roll_pitch_yaw_rad);
  rates(f, m.rates_frd_radps);
}

void visit(Fields& f, AttitudeQuaternion& m) {
  f.number(Wire::U32, "time_boot_ms", m.boot_s, kMilli);
  quaternion(f, m.ned_from_frd);
  rates(f, m.rates_frd_radps);
  f.extensions();
  f.array("repr_offset_q", m.display_offset);
}

void visit(Fields& f, LocalPositionNed& m) {
  f.number(Wire::U32, "time_boot_ms", m.boot_s, kMilli);
  f.vector(Wire::F32, {"x", "y", "z"}, m.position_ned_m);
  f.vector(Wire::F32, {"vx", "vy", "vz"}, m.velocity_ned_mps);
}

void visit(Fields& f, GlobalPositionInt& m) {
  f.number(Wire::U32, "time_boot_ms", m.boot_s, kMilli);
  place(f, m.latitude_deg, m.longitude_deg);
  f.number(Wire::I32, "alt", m.altitude_m, kMilli);
  f.number(Wire::I32, "relative_alt", m.above_home_m, kMilli);
  f.vector(Wire::I16, {"vx", "vy", "vz"}, m.velocity_ned_mps, kCenti);
  f.number(Wire::U16, "hdg", m.heading_deg, kCenti, kNo16);
}

void visit(Fields& f, HighresImu& m) {
  constexpr double kGauss = 1e-4, kHectopascal = 100;
  f.whole("time_usec", m.time_us);
  f.vector(Wire::F32, {"xacc", "yacc", "zacc"}, m.acceleration_frd_mps2);
  f.vector(Wire::F32, {"xgyro", "ygyro", "zgyro"}, m.rates_frd_radps);
  f.vector(Wire::F32, {"xmag", "ymag", "zmag"}, m.field_frd_tesla, kGauss);
  f.number(Wire::F32, "abs_pressure", m.pressure_pa, kHectopascal);
  f.number(Wire::F32, "diff_pressure", m.differential_pa, kHectopascal);
  f.number(Wire::F32, "pressure_alt", m.pressure_altitude_m);
  f.number(Wire::F32, "temperature", m.temperature_c);
  f.whole("fields_updated", m.updated);
  f.extensions();
  f.whole("id", m.sensor_id);
}

void visit(Fields& f, VisionPositionEstimate& m) {
  f.whole("usec", m.time_us);
  f.vector(Wire::F32, {"x", "y", "z"}, m.position_ned_m);
  f.vector(Wire::F32, {"roll", "pitch", "yaw"}, m.roll_pitch_yaw_rad);
  f.extensions();
  f.array("covariance", m.covariance);
  f.whole("reset_counter", m.reset_counter);
}

void visit(Fields& f, SimState& m) {
  quaternion(f, m.ned_from_frd);
  f.vector(Wire::F32, {"roll", "pitch", "yaw"}, m.roll_pitch_yaw_rad);
  f.vector(Wire::F32, {"xacc", "yacc", "zacc"}, m.acceleration_frd_mps2);
  f.vector(Wire::F32, {"xgyro", "ygyro", "zgyro"}, m.rates_frd_radps);
  f.number(Wire::F32, "lat", m.coarse_latitude_deg);
  f.number(Wire::F32, "lon", m.coarse_longitude_deg);
  f.number(Wire::F32, "alt", m.altitude_m);
  f.number(Wire::F32, "std_dev_horz", m.horizontal_sigma_m);
  f.number(Wire::F32, "std_dev_vert", m.vertical_sigma_m);
  f.vector(Wire::F32, {"vn", "ve", "vd"}, m.velocity_ned_mps);
  f.extensions();
  f.number(Wire::I32, "lat_int", m.fine_latitude_deg, kDegE7, 0);
  f.number(Wire::I32, "lon_int", m.fine_longitude_deg, kDegE7, 0);
}

void visit(Fields& f, HilGps& m) {
  f.whole("time_usec", m.time_us);
  f.whole("fix_type", m.fix_type);
  place(f, m.latitude_deg, m.longitude_deg);
  f.number(Wire::I32, "alt", m.altitude_m, kMilli);
  f.number(Wire::U16, "eph", m.horizontal_accuracy_m, kCenti, kNo16);
  f.number(Wire::U16, "epv", m.vertical_accuracy_m, kCenti, kNo16);
  f.number(Wire::U16, "vel", m.speed_mps, kCenti, kNo16);
  f.vector(Wire::I16, {"vn", "ve", "vd"}, m.velocity_ned_mps, kCenti);
  f.number(Wire::U16, "cog", m.course_deg, kCenti, kNo16);
  f.number(Wire::U8, "satellites_visible", m.satellites, 1, kNo8);
  f.extensions();
  f.whole("id", m.gps_id);
  f.number(Wire::U16, "yaw", m.yaw_deg, kCenti, 0);
}

void visit(Fields& f, GpsRtk& m) {
  f.number(Wire::U32, "time_last_baseline_ms", m.boot_s, kMilli);
  f.whole("rtk_receiver_id", m.receiver_id);
  f.whole("wn", m.week);
  f.number(Wire::U32, "tow", m.time_of_week_s, kMilli);
  f.whole("rtk_health", m.health);
  f.whole("rtk_rate", m.rate_hz);
  f.whole("nsats", m.satellites);
  f.whole("baseline_coords_type", m.frame);
  f.vector(Wire::I32, {"baseline_a_mm", "baseline_b_mm", "baseline_c_mm"}, m.baseline_m, kMilli);
  f.number(Wire::U32, "accuracy", m.accuracy_m, kMilli);
  f.number(Wire::I32, "iar_num_hypotheses", m.hypotheses_count);
}

void visit(Fields& f, HilStateQuaternion& m) {
  f.whole("time_usec", m.time_us);
  f.array("attitude_quaternion", m.ned_from_frd);
  rates(f, m.rates_frd_radps);
  place(f, m.latitude_deg, m.longitude_deg);
  f.number(Wire::I32, "alt", m.altitude_m, kMilli);
  f.vector(Wire::I16, {"vx", "vy", "vz"}, m.velocity_ned_mps, kCenti);
  f.number(Wire::U16, "ind_airspeed", m.indicated_airspeed_mps, kCenti);
  f.number(Wire::U16, "true_airspeed", m.true_airspeed_mps, kCenti);
  f.vector(Wire::I16, {"xacc", "yacc", "zacc"}, m.acceleration_frd_mps2, kMilliG);
}

void visit(Fields& f, AttPosMocap& m) {
  f.whole("time_usec", m.time_us);
  f.array("q", m.ned_from_frd);
  f.vector(Wire::F32, {"x", "y", "z"}, m.position_ned_m);
  f.extensions();
  f.array("covariance", m.covariance);
}

void visit(Fields& f, GpsInput& m) {
  f.whole("time_usec", m.time_us);
  f.whole("gps_id", m.gps_id);
  f.whole("ignore_flags", m.ignore);
  f.number(Wire::U32, "time_week_ms", m.time_of_week_s, kMilli);
  f.whole("time_week", m.week);
  f.whole("fix_type", m.fix_type);
  place(f, m.latitude_deg, m.longitude_deg);
  f.number(Wire::F32, "alt", m.altitude_m);
  f.number(Wire::F32, "hdop", m.hdop, 1, kNo16);
  f.number(Wire::F32, "vdop", m.vdop, 1, kNo16);
  f.vector(Wire::F32, {"vn", "ve", "vd"}, m.velocity_ned_mps);
  f.number(Wire::F32, "speed_accuracy", m.speed_accuracy_mps);
  f.number(Wire::F32, "horiz_accuracy", m.horizontal_accuracy_m);
  f.number(Wire::F32, "vert_accuracy", m.vertical_accuracy_m);
  f.whole("satellites_visible", m.satellites);
  f.extensions();
  f.number(Wire::U16, "yaw", m.yaw_deg, kCenti, 0);
}

void visit(Fields& f, GpsRtcmData& m) {
  f.whole("flags", m.flags);
  f.whole("len", m.length);
  f.array("data", m.data);
}

void visit(Fields& f, Odometry& m) {
  f.whole("time_usec", m.time_us);
  f.whole("frame_id", m.frame);
  f.whole("child_frame_id", m.child_frame);
  f.vector(Wire::F32, {"x", "y", "z"}, m.position_m);
  f.array("q", m.frame_from_body);
  f.vector(Wire::F32, {"vx", "vy", "vz"}, m.velocity_mps);
  rates(f, m.rates_radps);
  f.array("pose_covariance", m.pose_covariance);
  f.array("velocity_covariance", m.velocity_covariance);
  f.extensions();
  f.whole("reset_counter", m.reset_counter);
  f.whole("estimator_type", m.estimator_type);
  f.whole("quality", m.quality);
}

void visit(Fields& f, CommandLong& m) {
  f.whole("target_system", m.target_system);
  f.whole("target_component", m.target_component);
  f.whole("command", m.command);
  f.whole("confirmation", m.confirmation);
  static constexpr std::array<std::string_view, 7> kNames{"param1", "param2", "param3", "param4",
                                                          "param5", "param6", "param7"};
  for (std::size_t i = 0; i < kNames.size(); ++i) f.number(Wire::F32, kNames[i], m.parameters[i]);
}

}  // namespace canyon::mavlink
