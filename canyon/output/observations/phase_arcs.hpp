#pragma once

#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "canyon/geodesy/constants.hpp"
#include "canyon/positioning/fix.hpp"

namespace canyon::output {

/// Follows from epoch to epoch where one receiver's carrier phases are continuous.
class PhaseArcs {
 public:
  /// The link of a phase to the satellite's earlier ones.
  struct Link {
    /// The phase is not continuous with the satellite's phase before: cycles were lost in between. False for
    /// the satellite's first phase.
    bool slip = false;
    bool begins = false;  ///< of an arc this is the first phase
    /// Whole cycles that bring the arc's first phase nearest to its pseudorange over the wavelength, the same
    /// along the arc.
    double alignment_cycles = 0;
  };

  /// Link of a measurement that has a phase and the instant since which it is continuous; else empty. Give a
  /// satellite's measurements in order of time.
  /// @param signal index_of() it: each signal of a satellite has arcs of its own
  std::optional<Link> next(const positioning::Measurement& measurement, std::size_t signal = 0) {
    if (!measurement.carrier_phase_cycles || !measurement.phase_since) return std::nullopt;
    const auto [at, first] = arcs_.try_emplace({measurement.id, signal});
    Arc& arc = at->second;
    const bool begins = first || arc.since != *measurement.phase_since;
    if (begins) {
      const double range_cycles =
          measurement.pseudorange_m * measurement.carrier_frequency_hz / geodesy::kSpeedOfLight;
      arc = {*measurement.phase_since, std::round(range_cycles - *measurement.carrier_phase_cycles)};
    }
    return Link{begins && !first, begins, arc.alignment_cycles};
  }

 private:
  struct Arc {
    geodesy::GpsTime since;
    double alignment_cycles = 0;
  };
  std::map<std::pair<gnss::SatelliteId, std::size_t>, Arc> arcs_;
};

}  // namespace canyon::output
