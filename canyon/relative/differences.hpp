#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "canyon/geodesy/gps_time.hpp"
#include "canyon/gnss/signals.hpp"
#include "canyon/relative/observed_minus_computed.hpp"

namespace canyon::relative {

/// Rover minus base, of one signal.
struct Difference {
  const ObservedMinusComputed* rover = nullptr;
  double code_m = 0, phase_m = 0;
  double variance = 0;      // of the phase [m^2]; code's is that times the square of the ratio
  double age_variance = 0;  // of both [m^2]
  std::optional<geodesy::GpsTime> base_since;
  bool has_phase = false, half_cycle = false, aligned = true;
  // The filter sets these.
  std::optional<std::size_t> slot;
  bool used = false;      // phase
  bool trusted = false;   // within the gate
  double residual_m = 0;  // after the epoch

  [[nodiscard]] gnss::SatelliteId id() const { return rover->id; }
  /// Ratio of the ionosphere's delay at this carrier to that at L1.
  [[nodiscard]] double ionosphere_rate() const;
};

/// A satellite's signals are together; those of one signal, by their places among the differences.
using Groups = std::map<const gnss::Signal*, std::vector<std::size_t>>;

/// Differences of all signals that both measured; they refer to `rover`. `base` is in the order of before().
/// @param phase_sigma_m of a phase at the zenith @param age_s of the base's epoch
[[nodiscard]] std::vector<Difference> differences_of(std::span<const ObservedMinusComputed> rover,
                                                     std::span<const ObservedMinusComputed> base,
                                                     double phase_sigma_m, double age_s);
/// Without signals of one satellite, which determine nothing but their clock.
[[nodiscard]] Groups groups_of(const std::vector<Difference>& differences);

}  // namespace canyon::relative
