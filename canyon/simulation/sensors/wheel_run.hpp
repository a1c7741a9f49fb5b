#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "canyon/inertial/wheels.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/sensors/sample_times.hpp"

namespace canyon::simulation {

/// A sample of a vehicle's wheels, and what is true of them.
struct WheelsAtWork {
  geodesy::GpsTime time;  ///< end of the sample's interval
  double dt_s = 0;        ///< its length
  inertial::WheelSample sample;
  inertial::WheelPair true_mps{};  ///< mean speeds over the interval
};

/// The samples of a vehicle's wheels, in order. The same seed gives the same errors.
class WheelRun {
 public:
  /// @param vehicle its pose at any instant of the run; `begin`: the first sample ends one interval later
  WheelRun(const inertial::WheelOptions& options, std::uint64_t seed, geodesy::GpsTime begin,
           std::function<Pose(geodesy::GpsTime)> vehicle);

  /// The next sample, if its interval has ended at `until`.
  [[nodiscard]] std::optional<WheelsAtWork> next(geodesy::GpsTime until);
  /// Leaves out the samples whose intervals end until `time`.
  void skip(geodesy::GpsTime time);

 private:
  /// Forward speeds of the wheels' points at an instant.
  [[nodiscard]] inertial::WheelPair speeds(geodesy::GpsTime t) const;

  inertial::WheelOptions options_;
  SampleTimes times_;
  std::function<Pose(geodesy::GpsTime)> vehicle_;
  inertial::Wheels wheels_;
  inertial::WheelPair last_;  // speeds at the end of the last sample
};

}  // namespace canyon::simulation
