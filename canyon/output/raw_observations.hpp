#pragma once

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "canyon/output/phase_arcs.hpp"
#include "canyon/receiver/receiver.hpp"

namespace canyon::output {

/// Tags of observations are the receiver's clock to 100 ns: RINEX has no more decimals, and UBX goes along.
inline constexpr std::int64_t kTagStep_ns = 100;

/// One signal's observables as files of measurements have them, for the epoch's tag.
struct RawObservation {
  gnss::SatelliteId id;
  const gnss::Signal* signal = nullptr;                   ///< of gnss::signals_of()
  const positioning::Measurement* measurement = nullptr;  ///< points into the epoch
  double pseudorange_m = 0;
  /// Arcs begin within half a cycle of the pseudorange over the wavelength, as receivers have it, and never
  /// at 0, which readers take for a missing value.
  std::optional<double> carrier_phase_cycles = std::nullopt;
  bool slip = false;    ///< not continuous with the signal's phase before
  double locked_s = 0;  ///< since the first phase of its arc
};

struct RawEpoch {
  geodesy::GpsTime tag;                      ///< the clock's reading, rounded
  std::vector<RawObservation> observations;  ///< by satellite, then in the order of gnss::signals_of()
};

/// Measurements of one receiver, epoch by epoch. Time, range and phase are moved together to the rounded tag
/// (RINEX 3.04, 3.3 and table 1), or range and tag would disagree by up to c times half its step.
class RawObservations {
 public:
  explicit RawObservations(std::int64_t tag_step_ns) : step_ns_(tag_step_ns) {}
  [[nodiscard]] RawEpoch next(const receiver::ReceiverEpoch& seen);

 private:
  std::int64_t step_ns_;
  PhaseArcs arcs_;
  std::map<std::pair<gnss::SatelliteId, std::size_t>, geodesy::GpsTime> begun_;  ///< arcs of signals
};

}  // namespace canyon::output
