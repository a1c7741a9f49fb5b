#pragma once

#include <array>
#include <cstdint>

#include "canyon/receiver/positioning/fix.hpp"

namespace canyon::encoding {

/// Codes of a kind of fix in the formats (docs/outputs.md, "Kinds of fix").
struct FixCodes {
  // NMEA 0183 v4.11; position fix flags as in UBX-22008968, "Position fix flags in NMEA".
  int gga_quality;   ///< GGA, quality indicator
  char nmea_status;  ///< RMC, status
  char nmea_mode;    ///< RMC, mode indicator
  int gsa_mode;      ///< GSA, 1 no fix, 2 2D, 3 3D
  // UBX-22008968, 3.15.13. A prediction is valid too: gnssFixOK means that the accuracy is within the limits.
  std::uint8_t ubx_type;   ///< NAV-PVT fixType; NAV-STATUS, NAV-SOL gpsFix
  std::uint8_t ubx_flags;  ///< NAV-PVT flags: kUbxFixOk, kUbxDifferential, carrSoln in bits 7 and 6
  /// GPS_FIX_TYPE of MAVLink's common.xml. It has no type for dead reckoning, which is sent as no fix:
  /// autopilots' drivers map u-blox's fix type 1 to no fix and continue with their own sensors, which are
  /// better than the receiver's prediction.
  std::uint8_t mavlink_type;
  /// PVT mode of SBF (4.2.9). It has none for a prediction: a receiver without inertial sensors reports no
  /// position then.
  int sbf_mode;
  std::int8_t navsat_status;  ///< status of ROS' sensor_msgs/NavSatStatus; a prediction is NO_FIX
  std::int16_t gps_status;    ///< likewise of gps_msgs/GPSStatus, which has codes for RTK
  int rtklib_quality;         ///< Q of RTKLIB's solutions
};

inline constexpr std::uint8_t kUbxFixOk = 1, kUbxDifferential = 2, kUbxFloat = 0x40, kUbxFixed = 0x80;

[[nodiscard]] inline const FixCodes& codes_of(positioning::FixKind kind) {
  static constexpr std::array<FixCodes, 7> kCodes{{
      {0, 'V', 'N', 1, 0, 0, 1, 0, -1, -1, 0},                                        // None
      {1, 'A', 'A', 3, 3, kUbxFixOk, 3, 1, 0, 0, 5},                                  // Single
      {2, 'A', 'D', 3, 3, kUbxFixOk | kUbxDifferential, 4, 2, 2, 18, 4},              // Differential
      {5, 'A', 'F', 3, 3, kUbxFixOk | kUbxDifferential | kUbxFloat, 5, 5, 2, 20, 2},  // Float
      {4, 'A', 'R', 3, 3, kUbxFixOk | kUbxDifferential | kUbxFixed, 6, 4, 2, 19, 1},  // Fixed
      {6, 'A', 'E', 2, 1, kUbxFixOk, 1, 0, -1, -1, 5},                                // DeadReckoning
      {1, 'A', 'A', 3, 4, kUbxFixOk, 3, 1, 0, 0, 5},                                  // Combined
  }};
  return kCodes.at(static_cast<std::size_t>(kind));
}

/// fixType of NAV-PVT: 4, GNSS and dead reckoning, of any kind of fix with the vehicle's sensors.
[[nodiscard]] inline std::uint8_t ubx_type_of(const positioning::Fix& fix) {
  const positioning::FixKind kind =
      fix.measured() && fix.fused() ? positioning::FixKind::Combined : fix.kind();
  return codes_of(kind).ubx_type;
}

/// UBX's jammingState and MAVLink's GPS_JAMMING_STATE of a band: 1 none, 2 detected, still a fix, 3 detected,
/// no fix. Detected: as strong as the front end's own noise.
[[nodiscard]] inline std::uint8_t jamming_state(double interference_ratio, const positioning::Fix& fix) {
  if (interference_ratio < 1) return 1;
  return fix.measured() ? 2 : 3;
}

}  // namespace canyon::encoding
