#pragma once

#include <optional>
#include <vector>

#include "canyon/base/mavlink/messages.hpp"
#include "canyon/simulation/epoch.hpp"
#include "canyon/simulation/sensor_run.hpp"

namespace canyon::encoding {

// Messages to autopilots and ground stations about one epoch. Without a fix the type is 1 (no fix), and
// latitude and longitude, which are mandatory in MAVLink, are 0. The yaw is the heading_deg() of two
// antennas, 360 for north. Altitudes are heights above mean sea level (Epoch::altitude_m()). Satellites are
// those in the fix.

/// ArduPilot reads it with GPS1_TYPE 14. ArduPilot keeps the last velocity if a message flags it as to be
/// ignored, so a fix without velocity is sent as no fix.
[[nodiscard]] mavlink::GpsInput gps_input(const simulation::Epoch& epoch);

/// PX4 reads it from simulators (TCP 4560), and with MAV_USEHILGPS. PX4 treats the velocity of every message
/// as measured, so a fix without velocity is sent as no fix.
[[nodiscard]] mavlink::HilGps hil_gps(const simulation::Epoch& epoch);

/// Ground stations show it as the vehicle's GPS. A fix without velocity has no speed and no course.
[[nodiscard]] mavlink::GpsRawInt gps_raw_int(const simulation::Epoch& epoch);

/// The baseline vector from the base, axes north, east, down at the antenna; empty: none.
/// @param begin of the run
[[nodiscard]] std::optional<mavlink::GpsRtk> gps_rtk(const simulation::Epoch& epoch, geodesy::GpsTime begin);

/// The satellites that the receiver tracks, those in the fix first, as many as fit. Numbers are u-blox's
/// single numbers (UBX-22008968, 1.5.2, "Satellite numbering"): GPS 1 to 32, SBAS 120 to 158, Galileo 211 to
/// 246, BeiDou 159 to 163 and 33 to 64, QZSS 193 to 202, GLONASS 65 to 96; other satellites are left out.
[[nodiscard]] mavlink::GpsStatus gps_status(const simulation::Epoch& epoch);

/// The receiver's detection of jamming (interference as strong as its own noise: mitigated with a fix,
/// detected without) and of spoofing (by its checks: detected). Unknown without signal strength or checks.
[[nodiscard]] mavlink::GnssIntegrity gnss_integrity(const simulation::Epoch& epoch);

/// The samples of sensors, one message for each instant with a sample. Times are as reported by the inertial
/// sensor, UTC since 1970 [us]; the differential pressure is 0. @param last values, kept until updated
[[nodiscard]] std::vector<mavlink::HighresImu> highres_imu(const simulation::SensorBatch& batch,
                                                           mavlink::HighresImu& last);

}  // namespace canyon::encoding
