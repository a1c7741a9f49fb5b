#pragma once

#include "canyon/output/encoder.hpp"

// The encoders behind formats(), one function each.

namespace canyon::output {

[[nodiscard]] std::unique_ptr<Encoder> encode_epochs_csv(const ReceiverDescription& receiver);
[[nodiscard]] std::unique_ptr<Encoder> encode_satellites_csv(const ReceiverDescription& receiver);
/// One row for each tracked signal of each satellite.
[[nodiscard]] std::unique_ptr<Encoder> encode_signals_csv(const ReceiverDescription& receiver);
/// One row for each path of each satellite that the receiver tracks, as it arrives: Epoch::arrival.
[[nodiscard]] std::unique_ptr<Encoder> encode_paths_csv(const ReceiverDescription& receiver);
/// NMEA 0183 v4.11: RMC, GGA, GSA, GST, GSV each epoch.
[[nodiscard]] std::unique_ptr<Encoder> encode_nmea(const ReceiverDescription& receiver);
/// MAVLink 2, HEARTBEAT every second and each epoch GPS_INPUT; HIL_GPS; GPS_RAW_INT, with GPS_STATUS and
/// SYSTEM_TIME every second (canyon/output/mavlink.hpp).
[[nodiscard]] std::unique_ptr<Encoder> encode_gps_input(const ReceiverDescription& receiver);
[[nodiscard]] std::unique_ptr<Encoder> encode_hil_gps(const ReceiverDescription& receiver);
[[nodiscard]] std::unique_ptr<Encoder> encode_gps_raw_int(const ReceiverDescription& receiver);
/// RTCM 10403.3: MSM7 each epoch, ephemerides, of a station its place (canyon/output/rtcm.hpp).
[[nodiscard]] std::unique_ptr<Encoder> encode_rtcm(const ReceiverDescription& receiver);
/// RINEX 3.04 observation file; of each tracked signal its code C1C and Doppler D1C, with the receiver's
/// signal model C1C L1C D1C S1C, by gnss::Signal::code. Epoch tags are the receiver's clock, rounded to 100
/// ns; pseudoranges and phases follow the rounded tag. Epochs without any measurement are left out.
[[nodiscard]] std::unique_ptr<Encoder> encode_rinex_observation(const ReceiverDescription& receiver);
/// The same as RINEX 4.00.
[[nodiscard]] std::unique_ptr<Encoder> encode_rinex4_observation(const ReceiverDescription& receiver);
/// UBX of a u-blox F9 (HPG 1.32, protocol 27.31) and of an M8 (protocol 18.00): a device that answers what it
/// hears, and sends what it is told to.
[[nodiscard]] std::unique_ptr<Encoder> encode_ubx(const ReceiverDescription& receiver);
[[nodiscard]] std::unique_ptr<Encoder> encode_ubx_m8(const ReceiverDescription& receiver);
/// Messages of the viewer, a JSON object a line (docs/view-format.md, Messages). Epochs that come without
/// `arrival` are left out.
[[nodiscard]] std::unique_ptr<Encoder> encode_view(const ReceiverDescription& receiver);
/// KML 2.2 and GeoJSON (RFC 7946): true track, fixes by horizontal error, places without fix. They hold the
/// track in memory, about 200 bytes an epoch.
[[nodiscard]] std::unique_ptr<Encoder> encode_kml(const ReceiverDescription& receiver);
[[nodiscard]] std::unique_ptr<Encoder> encode_geojson(const ReceiverDescription& receiver);

}  // namespace canyon::output
