#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "canyon/inertial/barometer.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/sensors/sample_times.hpp"

namespace canyon::simulation {

struct BarometerSample {
  geodesy::GpsTime time;
  double height_m = 0;          ///< of the barometer above mean sea level
  inertial::Pressure pressure;  ///< true_pa: at `time`
};

/// A barometer along a run.
class BarometerRun {
 public:
  /// @param vehicle its pose at any instant of the run
  /// @param begin the first sample is one interval later
  /// @param geoid_undulation_m mean sea level above the ellipsoid, along the whole run
  BarometerRun(const inertial::BarometerOptions& options, std::uint64_t seed, geodesy::GpsTime begin,
               std::function<Pose(geodesy::GpsTime)> vehicle, double geoid_undulation_m);

  /// The next sample, if it is due at `until`.
  [[nodiscard]] std::optional<BarometerSample> next(geodesy::GpsTime until);
  /// Leaves out the samples whose intervals end until `time`.
  void skip(geodesy::GpsTime time) { times_.skip(time); }

 private:
  inertial::BarometerOptions options_;
  SampleTimes times_;
  std::function<Pose(geodesy::GpsTime)> vehicle_;
  double geoid_undulation_m_;
  inertial::Barometer barometer_;
};

}  // namespace canyon::simulation
