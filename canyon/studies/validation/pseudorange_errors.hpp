#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/run/motion/trajectory.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/orbit/sky.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"

// The error of each recorded pseudorange, the receiver's place being known. With docs/receiver.md's equation
//
//   P = r + c (b - (dts - tgd)) + I + S + isb + error,
//
// step one removes all but the receiver clock b, the inter-system bias and the error; step two estimates
// clock and biases from satellites in clear view. The steps are apart because the second depends on a city,
// and is repeated while a city is being aligned.

namespace canyon::validation {

/// A measured pseudorange without what geometry, satellite and atmosphere put into it.
struct PseudorangeResidual {
  std::size_t epoch = 0;  ///< index into PseudorangeResiduals::epochs
  gnss::SatelliteId id;
  const gnss::Signal* signal = nullptr;  ///< of gnss::signals_of()
  double pseudorange_m = 0;              ///< as recorded
  double residual_m = 0;                 ///< c b + isb + error
  /// Carrier phase [m] less the same, which the ionosphere advances: c b + isb + ambiguity + error.
  std::optional<double> phase_residual_m;
  /// The receiver says that lock was lost since the epoch before (loss-of-lock indicator, power failure).
  bool lost_lock = false;
  std::optional<double> cn0_dbhz;
  double azimuth_rad = 0;    ///< of the satellite at the antenna, from north, clockwise, [0, 2 pi)
  double elevation_rad = 0;  ///< above 0
  Eigen::Vector3d direction_ecef = Eigen::Vector3d::Zero();  ///< unit, antenna to satellite
};

/// An epoch with the true place of its antenna.
struct ResidualEpoch {
  std::size_t recorded = 0;        ///< index into the epochs that were given
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
  /// a constant that the receiver adds to each signal (its inter-frequency bias). No clock is estimated from
  /// them.
  std::vector<PseudorangeResidual> further;
  // Observations that were left out:
  std::size_t epochs_outside_truth = 0;
  std::size_t without_pseudorange = 0;
  std::size_t below_horizon = 0;
  std::map<gnss::SatelliteId, std::size_t> without_ephemeris;

  [[nodiscard]] std::span<const PseudorangeResidual> of(const ResidualEpoch& epoch) const {
    return std::span<const PseudorangeResidual>(observations).subspan(epoch.first, epoch.count);
  }
  /// One line for each of these that is not 0.
  [[nodiscard]] std::vector<std::string> warnings() const;
};

struct ResidualOptions {
  bool ionosphere = true;   ///< corrects by the broadcast model (errors::klobuchar_delay_m)
  bool troposphere = true;  ///< corrects by errors::saastamoinen_delay_m
  /// The antenna's phase centre from the point whose truth is given: forward, left, up [m], by the truth's
  /// yaw. A RINEX antenna height over a mark goes into the third.
  Eigen::Vector3d lever_arm_m = Eigen::Vector3d::Zero();
};

/// Step one. Satellites are taken at the transmit time that tag and pseudorange give, so that clock bias,
/// steering and millisecond jumps of the receiver do not matter; truth is taken at the true reception time,
/// the tag less the epoch's median clock. Against the fix of `positioning::solve_fix` on Canyon's own
/// pseudoranges: within 0.01 mm. Epochs whose reception is outside the truth's span are left out, as are
/// pseudoranges that are missing, below the horizon, or without a valid ephemeris.
/// @param klobuchar of the navigation files; a system without its own takes GPS's. Throws InputError where
/// ionosphere is asked for and neither is there.
[[nodiscard]] PseudorangeResiduals pseudorange_residuals(
    std::span<const rinex::ObservationEpoch> epochs, const simulation::Trajectory& truth,
    const orbit::Sky& sky, const std::map<gnss::System, gnss::Klobuchar>& klobuchar,
    const ResidualOptions& options = {});

/// Whether the city says that a satellite stands in clear view of the antenna. Called once for each
/// observation in order.
using ClearView = std::function<bool(const PseudorangeResidual&, const ResidualEpoch&)>;

struct ClockOptions {
  /// Fewer satellites in clear view than this, above `elevation_mask_rad`: the epoch's clock is taken from
  /// all satellites. [1, 50].
  int min_clear = 1;
  /// Satellites below do not contribute to the clock [rad]. [0, pi/2).
  double elevation_mask_rad = 0.17453292519943295;  // 10 deg
  /// Relative weights, 1 / variance with variance = a + b 10^(-C/N0 / 10) (Kuusniemi, User-level reliability
  /// and quality monitoring in satellite-based personal navigation, Tampere University of Technology 2005: a
  /// = 10 m^2, b = 150^2 m^2 Hz where signals are lightly degraded). Signals without C/N0 count as 30 dB-Hz.
  /// > 0,
  /// >= 0.
  double variance_floor_m2 = 10;
  double variance_scale_m2_hz = 22'500;
  /// Huber's constant, in standard deviations: residuals beyond weigh as 1 / |residual| (Huber, Robust
  /// Statistics, 1981; 1.345 keeps 95 % efficiency on normal errors). [0.5, 10].
  double huber = 1.345;
  /// Farther than this from the median of their epoch [m], pseudoranges are no measurements (a wrong
  /// millisecond is 299,792 m): marked gross, not used for the clock. [1000, 100,000].
  double gross_m = 10'000;
};

struct PseudorangeError {
  /// Pseudorange error [m]: residual less clock and inter-system bias. Positive: measured too long.
  double error_m = 0;
  bool clear = false;  ///< by ClearView
  bool gross = false;  ///< ClockOptions::gross_m
};

enum class ClockSource : std::uint8_t {
  Clear,  ///< satellites in clear view
  All,    ///< too few of these: all satellites, and errors that they share are hidden in the clock
  None,   ///< nothing but gross ones: errors are about their median
};

struct EpochClock {
  double bias_m = 0;  ///< c times the receiver's time tag minus GPS time, of the reference system
  ClockSource source = ClockSource::None;
  int clear = 0;  ///< satellites in clear view that it can be estimated from
};

struct PseudorangeErrors {
  std::vector<PseudorangeError> observations;  ///< one for each of PseudorangeResiduals::observations
  std::vector<EpochClock> clocks;              ///< one for each of PseudorangeResiduals::epochs
  gnss::System reference =
      gnss::System::GPS;  ///< whose bias is 0: the one with most satellites in clear view
  std::map<gnss::System, double> inter_system_bias_m;  ///< of all systems observed
  double scatter = 0;  ///< robust deviation of clear errors over what the weights' variance says (1.4826 MAD)
};

/// Step two: one clock for each epoch and one constant bias for each system over the run, minimising Huber's
/// function of the weighted errors of all satellites in clear view jointly (iteratively reweighted least
/// squares from medians; epochs' clocks eliminated), so that an epoch with a single satellite in clear view,
/// of whatever system, has a clock. Gaps, changing sets of satellites and jumps of the clock are no matter:
/// nothing but the biases ties epochs. GLONASS's inter-frequency biases are left in its errors.
[[nodiscard]] PseudorangeErrors remove_receiver_clock(const PseudorangeResiduals& residuals,
                                                      const ClearView& clear_view,
                                                      const ClockOptions& options = {});

}  // namespace canyon::validation
