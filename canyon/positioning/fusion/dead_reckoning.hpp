#pragma once

#include <Eigen/Core>
#include <memory>

#include "canyon/geodesy/gps_time.hpp"
#include "canyon/positioning/fix.hpp"
#include "canyon/positioning/fusion/dead_reckoning_options.hpp"
#include "canyon/positioning/fusion/sensor_readings.hpp"

namespace canyon::positioning {

/// Fixes and the vehicle's sensors together: an error-state Kalman filter of 17 states about a strapdown
/// mechanisation in ECEF, loosely coupled (Groves, Principles of GNSS, Inertial, and Multisensor Integrated
/// Navigation Systems, 2nd ed., 14.2 and 14.3; wheels and constraints 16.3 and 15.2).
///
/// It waits for a motion that tells the heading (FusionPhase::Initialising: the fixes are answered as they
/// are), then answers its own position of the antenna. Fixes count by their stated covariance, and those
/// beyond the gate are left out. Errors of fixes last: each one counts as the new part that it has since the
/// one before, by time and way. Between fixes and without them the position goes on, and its stated
/// covariance grows. One receiver's filter; same inputs, same answers.
class DeadReckoning {
 public:
  DeadReckoning(const DeadReckoningOptions& options, const SensorMounting& mounting);
  ~DeadReckoning();
  DeadReckoning(DeadReckoning&&) noexcept;
  DeadReckoning& operator=(DeadReckoning&&) noexcept;

  /// An epoch's answer. Times must not run backwards.
  /// @param readings that ended since the epoch before, in order
  /// @param fix of the epoch's satellites, as the receiver would state it without sensors
  [[nodiscard]] Fix update(geodesy::GpsTime time, const SensorReadings& readings, const Fix& fix);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace canyon::positioning
