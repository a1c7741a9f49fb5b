#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "canyon/analysis/calibration/calibrate.hpp"
#include "canyon/analysis/validation/comparison.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::calibration {

// Parameters estimated only from a recording, without a simulated receiver.

/// A signal at one epoch, above the elevation mask.
struct Sample {
  std::size_t epoch = 0;
  bool clear = false;    ///< the direct path is clear in the city
  bool tracked = false;  ///< has a pseudorange
  bool phase = false;    ///< and a carrier phase
  double elevation_rad = 0;
  std::optional<double> cn0_dbhz;  ///< as reported
};

/// One signal of one satellite, by epoch.
struct Series {
  gnss::SatelliteId id;
  const gnss::Signal* signal = nullptr;
  std::vector<Sample> samples;
  [[nodiscard]] bool first() const { return gnss::index_of(*signal) == 0; }
};

struct Observed {
  std::vector<geodesy::GpsTime> times;  ///< of each epoch
  double interval_s = 1;                ///< median
  std::vector<Series> series;
};

/// The recorded side of a comparison.
[[nodiscard]] Observed observed(const validation::Comparison& comparison);

/// Adds `tracks` and `exclude_signals`: recorded signals, and systems, orbits and blocks that are never
/// recorded although their satellites are high and in clear view. @param skies systems of each recording's
/// sky
void add_tracked(std::span<const Observed> recorded, std::span<const std::set<gnss::System>> skies,
                 const simulation::ReceiverConfig& receiver, Calibration& result);

/// Adds `signal.cn0_step_db`: the coarsest step of which the reported C/N0 are multiples.
void add_step(std::span<const Observed> recorded, const simulation::ReceiverConfig& receiver,
              Calibration& result);

/// Adds `signal.phase_threshold_dbhz`: the C/N0 that separates clear signals with a phase from those without.
void add_phase_threshold(std::span<const Observed> recorded, const simulation::ReceiverConfig& receiver,
                         std::span<const std::vector<std::uint16_t>> sample_count, Calibration& result);

/// Adds `signal.lock.tracking_threshold_dbhz` and `signal.lock.acquisition_threshold_dbhz`: the weakest
/// measured signals of hidden satellites, and the weakest ones reacquired after gaps.
void add_lock_thresholds(std::span<const Observed> recorded, const simulation::ReceiverConfig& receiver,
                         std::span<const std::vector<std::uint16_t>> sample_count, Calibration& result);

}  // namespace canyon::calibration
