#pragma once

#include <array>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "canyon/orbit/sky.hpp"
#include "canyon/relative/corrections.hpp"
#include "canyon/rinex/observation_reader.hpp"

namespace canyon::relative {

/// Turns epochs of an observation file into what a rover or a base measured; remembers since when phases are
/// continuous: a phase that was missing, is of another code, or whose loss-of-lock indicator says so, begins
/// anew.
class RecordedSignals {
 public:
  /// @param sky gives the carriers of GLONASS satellites; must outlive this
  /// @param biases of the file's header
  RecordedSignals(const orbit::Sky& sky, GlonassBiases biases) : sky_(sky), biases_(std::move(biases)) {}

  /// Measurements with a pseudorange, of satellites that the sky knows. Epochs come in order of time.
  [[nodiscard]] std::vector<SignalMeasurement> next(const rinex::ObservationEpoch& epoch);

 private:
  struct Phase {
    geodesy::GpsTime since, seen;
    std::array<char, 3> code{};  // of RINEX
  };
  const orbit::Sky& sky_;
  GlonassBiases biases_;
  std::optional<geodesy::GpsTime> before_;  // the epoch before
  std::map<std::pair<gnss::SatelliteId, const gnss::Signal*>, Phase> phases_;
};

}  // namespace canyon::relative
