#pragma once

#include <Eigen/Core>
#include <optional>

#include "canyon/positioning/fix.hpp"
#include "canyon/positioning/fusion/dead_reckoning_options.hpp"
#include "canyon/positioning/fusion/inertial_errors.hpp"

namespace canyon::positioning {

/// The first estimate of a vehicle's attitude. At rest accelerometers give the vertical and gyroscopes their
/// biases; in motion the course of a fix gives the heading (Groves 5.6.3).
class Alignment {
 public:
  explicit Alignment(const SensorMounting& mounting) : mounting_(mounting) {}

  /// The vehicle stands. @param mean over a second
  void stand(const ImuReading& mean);
  /// The estimate at a fix, once its course tells the heading. @param mean of the sensor about now
  [[nodiscard]] std::optional<InertialEstimate> begin(const Fix& fix, const ImuReading& mean,
                                                      const DeadReckoningOptions& options) const;

 private:
  SensorMounting mounting_;
  std::optional<ImuReading> at_rest_;
};

}  // namespace canyon::positioning
