#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "canyon/geodesy/gps_time.hpp"
#include "canyon/gnss/signals.hpp"
#include "canyon/positioning/fix.hpp"

namespace canyon::relative {

/// What a receiver measured of one signal.
struct SignalMeasurement {
  const gnss::Signal* signal = nullptr;  ///< of gnss::signals_of()
  positioning::Measurement measurement;
};

/// What a receiver is given of a reference station, beside what arrives at its own antenna: one epoch of the
/// station as RTCM 3 has it (messages 1005 and MSM).
struct Corrections {
  int station = 0;  ///< its identification, [0, 4095]; 0 is what the RTCM of a run says
  Eigen::Vector3d station_ecef = Eigen::Vector3d::Zero();  ///< its antenna, as the station states it [m]
  /// The station moves: its place is its own fix of this epoch.
  bool moving = false;
  /// What the station's clock showed; the pseudoranges hold its error.
  geodesy::GpsTime receiver_time;
  /// Those of a satellite stand together.
  std::vector<SignalMeasurement> observations;
  /// What has to be added to GLONASS phases of L1 C/A, L1 P, L2 C/A, L2 P [m] so that they refer to the
  /// instant of the codes (message 1230); NaN: not stated for this signal. Empty: not stated.
  std::optional<std::array<double, 4>> glonass_bias_m = std::nullopt;
  /// As the station names them (messages 1007, 1008, 1033); empty: not known.
  std::string antenna_name = {}, receiver_name = {};
};

}  // namespace canyon::relative
