#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/gnss/signals.hpp"
#include "canyon/positioning/fix.hpp"

namespace canyon::relative {

/// A receiver's measurement of one signal.
struct SignalMeasurement {
  const gnss::Signal* signal = nullptr;  ///< of gnss::signals_of()
  positioning::Measurement measurement;
  /// The phase refers to the instant of the code. GLONASS phases of receivers of different makers are off by
  /// up to some 100 m here, which becomes a part of a cycle for each step of the channel's number. True for
  /// systems whose satellites share a carrier.
  bool aligned = true;
};

/// Bias to add to GLONASS phases [m] so that they refer to the instant of the codes, by RINEX code
/// ("1C", "1P", "2C", "2P"): RTCM message 1230, header record GLONASS COD/PHS/BIS. Without an entry it is not
/// known.
using GlonassBiases = std::map<std::string, double, std::less<>>;

/// Adds the bias of a GLONASS signal of this code to its phase; where there is none the phase is not aligned.
inline void align(SignalMeasurement& seen, std::string_view code, const GlonassBiases& biases) {
  positioning::Measurement& m = seen.measurement;
  if (m.id.system != gnss::System::GLONASS) return;
  const auto bias_m = biases.find(code);
  seen.aligned = bias_m != biases.end();
  if (!seen.aligned || !m.carrier_phase_cycles) return;
  *m.carrier_phase_cycles += bias_m->second * m.carrier_frequency_hz / geodesy::kSpeedOfLight;
}

/// Input of a receiver from a reference station, beside the signals at its own antenna: one epoch of the
/// station as RTCM 3 has it (messages 1005 and MSM).
struct Corrections {
  int station = 0;  ///< its identification, [0, 4095]; 0 is what the RTCM of a run says
  Eigen::Vector3d station_ecef = Eigen::Vector3d::Zero();  ///< its antenna, as the station states it [m]
  /// The station moves: its place is its own fix of this epoch.
  bool moving = false;
  /// Reading of the station's clock; the pseudoranges hold its error.
  geodesy::GpsTime receiver_time;
  /// Those of a satellite stand together.
  std::vector<SignalMeasurement> observations;
  /// Names by the station (messages 1007, 1008, 1033); empty: not known.
  std::string antenna_name = {}, receiver_name = {};
};

}  // namespace canyon::relative
