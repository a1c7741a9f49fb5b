#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "canyon/simulation/simulator.hpp"

namespace canyon::output {

/// What the header of a RINEX observation file says beyond its epochs.
struct RinexObservationHeader {
  std::string marker;                                 ///< MARKER NAME, up to 60 characters
  std::set<gnss::System> systems;                     ///< that may occur; at least those of the epochs
  std::map<gnss::SatelliteId, int> glonass_channels;  ///< frequency numbers, GLONASS SLOT / FRQ #
  double interval_s = 1;
  bool signals = false;    ///< carrier phases and signal strengths as well (tracking::SignalOptions::enabled)
  geodesy::GpsTime begin;  ///< TIME OF FIRST OBS where no satellite is ever received
};

/// The indicator of signal strength (RINEX 3.04, 5.7 and table 12): min(max(int(C/N0 / 6), 1), 9).
[[nodiscard]] int signal_strength_indicator(double cn0_dbhz);

/// The sink behind make_rinex_observation(path, receiver, simulation), for hosts without a Simulation.
[[nodiscard]] std::unique_ptr<simulation::EpochSink> make_rinex_observation(const std::filesystem::path& path,
                                                                            std::size_t receiver,
                                                                            RinexObservationHeader header);

/// Systems, GLONASS channels, interval and begin of a simulation; its receiver's name as marker; signals
/// where its model of them is on.
[[nodiscard]] RinexObservationHeader rinex_observation_header(const simulation::Simulation& simulation,
                                                              std::size_t receiver);

}  // namespace canyon::output
