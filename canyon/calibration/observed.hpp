#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "canyon/gnss/satellite_id.hpp"
#include "canyon/gnss/signals.hpp"
#include "canyon/validation/comparison.hpp"

// The recorded receiver's signals over time. Private to canyon/calibration.

namespace canyon::calibration {

/// A signal at one epoch, above the elevation mask.
struct Sample {
  std::size_t epoch = 0;
  bool clear = false;    ///< the city says that the direct path is
  bool tracked = false;  ///< has a pseudorange
  bool phase = false;    ///< and a carrier phase
  double elevation_rad = 0;
  std::optional<double> cn0_dbhz;  ///< as stated
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

}  // namespace canyon::calibration
