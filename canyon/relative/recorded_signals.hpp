#pragma once

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "canyon/orbit/sky.hpp"
#include "canyon/relative/corrections.hpp"
#include "canyon/rinex/observation_reader.hpp"

namespace canyon::relative {

/// Turns epochs of an observation file into what a rover or a base measured; remembers since when phases are
/// continuous: a phase that was missing, or whose loss-of-lock indicator says so, begins anew.
class RecordedSignals {
 public:
  /// @param sky gives the carriers of GLONASS satellites; must outlive this
  explicit RecordedSignals(const orbit::Sky& sky) : sky_(sky) {}

  /// Epochs in order of time. Of signals with a pseudorange, of satellites that the sky knows.
  [[nodiscard]] std::vector<SignalMeasurement> next(const rinex::ObservationEpoch& epoch);
  /// The same as a base at `place` [ECEF, m] gives them.
  [[nodiscard]] Corrections next_of_base(const rinex::ObservationEpoch& epoch, const Eigen::Vector3d& place);

 private:
  struct Phase {
    geodesy::GpsTime since, seen;
  };
  const orbit::Sky& sky_;
  std::optional<geodesy::GpsTime> before_;  // the epoch before
  std::map<std::pair<gnss::SatelliteId, const gnss::Signal*>, Phase> phases_;
};

}  // namespace canyon::relative
