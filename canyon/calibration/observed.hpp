#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "canyon/gnss/satellite_id.hpp"
#include "canyon/gnss/signals.hpp"
#include "canyon/validation/comparison.hpp"

// What one receiver, recorded or simulated, made of its signals over time. Private to canyon/calibration.

namespace canyon::calibration {

/// A signal at one epoch, above the elevation mask.
struct Sample {
  std::size_t epoch = 0;
  bool clear = false;    ///< the city says that the direct path is
  bool tracked = false;  ///< has a pseudorange
  bool phase = false;    ///< and a carrier phase
  double elevation_rad = 0;
  std::optional<double> cn0_dbhz;  ///< as stated
  std::optional<double> error_m;   ///< of the pseudorange
};

/// One signal of one satellite, by epoch.
struct Series {
  gnss::SatelliteId id;
  const gnss::Signal* signal = nullptr;
  std::vector<Sample> samples;
  [[nodiscard]] bool first() const { return gnss::index_of(*signal) == 0; }
};

struct Observed {
  std::vector<double> time_s;  ///< of each epoch, from the first
  std::vector<double> step_m;  ///< the antenna's way since the epoch before; 0 at the first
  std::vector<geodesy::GpsTime> times;
  double interval_s = 1;  ///< median
  std::vector<Series> series;
};

enum class Side : std::uint8_t { Recorded, Simulated };
/// Of both sides of one comparison the series are alike in number, order and epochs.
[[nodiscard]] Observed observed(const validation::Comparison& comparison, Side side);

}  // namespace canyon::calibration
