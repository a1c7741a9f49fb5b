#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>

#include "canyon/inertial/magnetometer.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/sensors/sample_times.hpp"

namespace canyon::simulation {

struct MagnetometerSample {
  geodesy::GpsTime time;
  Eigen::Vector3d measured_t, true_t;  ///< in the sensor's axes [T]; true: the Earth's field alone, at `time`
};

/// A magnetometer along a run.
class MagnetometerRun {
 public:
  /// @param vehicle its pose at any instant of the run
  /// @param begin the first sample is one interval later
  MagnetometerRun(const inertial::MagnetometerOptions& options, std::uint64_t seed, geodesy::GpsTime begin,
                  std::function<Pose(geodesy::GpsTime)> vehicle);

  /// The next sample, if it is due at `until`.
  [[nodiscard]] std::optional<MagnetometerSample> next(geodesy::GpsTime until);
  /// Leaves out the samples whose intervals end until `time`.
  void skip(geodesy::GpsTime time) { times_.skip(time); }

 private:
  inertial::MagnetometerOptions options_;
  Eigen::Matrix3d body_from_sensor_;
  SampleTimes times_;
  std::function<Pose(geodesy::GpsTime)> vehicle_;
  inertial::Magnetometer magnetometer_;
};

}  // namespace canyon::simulation
