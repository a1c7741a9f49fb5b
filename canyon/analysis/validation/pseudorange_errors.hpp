#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/orbit/sky.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"

// The error of each recorded pseudorange at known receiver positions. With docs/receiver.md's equation
//
//   P = r + c (b - (dts - tgd)) + I + S + isb + error,
//
// step one removes all but the receiver clock b, the inter-system bias and the error; step two estimates
// clock and biases from satellites in clear view. The steps are separate because the second depends on a
// city, and is repeated during the alignment of a city.

namespace canyon::validation {

/// A measured pseudorange without the terms of geometry, satellite and atmosphere.
struct PseudorangeResidual {
  std::size_t epoch = 0;  ///< index into PseudorangeResiduals::epochs
  gnss::SatelliteId id;
  const gnss::Signal* signal = nullptr;  ///< of gnss::signals_of()
  double pseudorange_m = 0;              ///< as recorded
  double residual_m = 0;                 ///< c b + isb + error
  /// Carrier phase [m] minus these terms, the ionosphere's sign reversed: c b + isb + ambiguity + error.
  std::optional<double> phase_residual_m;
  /// The receiver reports a loss of lock since the previous epoch (loss-of-lock indicator, power failure).
  bool lost_lock = false;
  std::optional<double> cn0_dbhz;
  double azimuth_rad = 0;    ///< of the satellite at the antenna, from north, clockwise, [0, 2 pi)
  double elevation_rad = 0;  ///< above 0
  Eigen::Vector3d direction_ecef = Eigen::Vector3d::Zero();  ///< unit, antenna to satellite
};

/// An epoch with the true position of its antenna.
struct ResidualEpoch {
  std::size_t recorded = 0;        ///< index into the given epochs
  geodesy::GpsTime receiver_time;  ///< the time tag
  geodesy::GpsTime reception;      ///< true time, within a microsecond
  Eigen::Vector3d antenna_ecef = Eigen::Vector3d::Zero();
  geodesy::Geodetic antenna;
  std::size_t first = 0, count = 0;            ///< of PseudorangeResiduals::observations
  std::size_t first_further = 0, further = 0;  ///< of PseudorangeResiduals::further
};

struct PseudorangeResiduals {
  std::vector<ResidualEpoch> epochs;              ///< with at least one observation, in the order given
  std::vector<PseudorangeResidual> observations;  ///< of satellites' first signals, by epoch
  /// Observations of the other signals, by epoch: with the delays of their own carriers and group delays, but
  /// with the receiver's constant for each signal (its inter-frequency bias). They do not contribute to the
  /// clock.
  std::vector<PseudorangeResidual> further;
  // Numbers of observations that were left out:
  std::size_t epochs_outside_truth = 0;
  std::size_t without_pseudorange = 0;
  std::size_t below_horizon = 0;
  std::map<gnss::SatelliteId, std::size_t> without_ephemeris;

  [[nodiscard]] std::span<const PseudorangeResidual> of(const ResidualEpoch& epoch) const {
    return std::span<const PseudorangeResidual>(observations).subspan(epoch.first, epoch.count);
  }
  /// One line for each of these numbers that is not 0.
  [[nodiscard]] std::vector<std::string> warnings() const;
};

struct ResidualOptions {
  bool ionosphere = true;   ///< corrects by the broadcast model (sky::klobuchar_delay_m)
  bool troposphere = true;  ///< corrects by sky::saastamoinen_delay_m
  /// The antenna's phase centre relative to the point of the truth: forward, left, up [m], by the truth's
  /// yaw. The third includes a RINEX antenna height over a mark.
  Eigen::Vector3d lever_arm_m = Eigen::Vector3d::Zero();
};

/// Step one. Satellite positions are at the transmit time by tag and pseudorange, so that clock bias,
/// steering and millisecond jumps of the receiver do not matter; the truth is at the true reception time, the
/// tag minus the epoch's median clock. Compared with the fix of `positioning::solve_fix` on Canyon's own
/// pseudoranges: within 0.01 mm. Left out are epochs whose reception is outside the truth's span, and
/// pseudoranges that are missing, below the horizon, or without a valid ephemeris. @param klobuchar of the
/// navigation files; a system without its own uses GPS's. Throws InputError if the ionosphere is enabled and
/// both are missing.
[[nodiscard]] PseudorangeResiduals pseudorange_residuals(
    std::span<const rinex::ObservationEpoch> epochs, const simulation::Trajectory& truth,
    const orbit::Sky& sky, const std::map<gnss::System, gnss::Klobuchar>& klobuchar,
    const ResidualOptions& options = {});

}  // namespace canyon::validation
