#pragma once

#include <cstdint>
#include <limits>
#include <string_view>

#include "canyon/base/options/fwd.hpp"
#include "canyon/base/options/switch.hpp"

namespace canyon::positioning {

struct Measurement;

/// Weights of pseudoranges in a solver.
enum class Weighting : std::uint8_t {
  Sigma,      ///< 1 / sigma^2 of Measurement::sigma_m
  Equal,      ///< equal, at the rms of Measurement::sigma_m of the satellites used
  Elevation,  ///< sigma^2 = a^2 + b^2 / sin(elevation)^2, satellites below 5 deg as at 5 deg
  Cn0,        ///< sigma^2 = c + d 10^(-C/N0 / 10); a signal without C/N0 counts as 30 dB-Hz
};
/// "sigma", "equal", "elevation", "cn0": the words of scenarios.
[[nodiscard]] std::string_view name(Weighting weighting);

/// C/N0 of a measurement without one.
inline constexpr double kUnknownCn0_dbhz = 30;

struct WeightOptions {
  Weighting weighting = Weighting::Sigma;
  /// a and b [m], (0, 1e6]. Defaults: RTKLIB 2.4.3's stats-errphase and stats-errphaseel, 0.003 m each, times
  /// stats-eratio1, 100. The square of the sine is that of its relative positioning (varerr() of rtkpos.c);
  /// its single point positioning (pntpos.c) has b^2 / sin(elevation), and adds orbit and atmosphere.
  double elevation_a_m = 0.3, elevation_b_m = 0.3;
  /// Standard deviation of a pseudorange's weight [m]. For Equal the measurement's own: the solver takes the
  /// rms over the used satellites.
  /// @param elevation_rad of the satellite; used by Elevation only
  [[nodiscard]] double sigma_m(const Measurement& measurement, double elevation_rad) const;
  /// Standard deviation of a Doppler's weight, as a range rate [m/s]: the measurement's own. For Cn0 with an
  /// additional variance of 0.001 m^2/s^2 + 40 m^2/s^2 Hz 10^(-C/N0 / 10), since the Doppler of an echo
  /// belongs to another direction.
  [[nodiscard]] double doppler_sigma_mps(const Measurement& measurement) const;
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
void visit(options::Visitor& v, WeightOptions& o);

/// Receiver autonomous integrity monitoring: fault detection and exclusion on the residuals of one fix.
struct RaimOptions {
  bool enabled = false;
  /// Probability of detecting a fault in a fix without faults, (0, 0.5]: the level of the chi-square test.
  /// RTKLIB tests its single point positions at 0.001 (chisqr[], pntpos.c).
  double false_alarm = 1e-3;
  /// Largest number of satellites excluded from one fix. [1, 30].
  int max_exclusions = 3;
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
void visit(options::Visitor& v, RaimOptions& o);

struct FixOptions {
  double elevation_mask_rad = 0.17453292519943295;  ///< 10 deg; [0, pi/2)
  /// Required satellites, plus one for each constellation clock beyond the first. >= 4 (the paper: 5).
  int min_satellites = 4;
  int max_iterations = 20;      ///< 5 to 1000; from the Earth's centre 6 to 8 are needed
  double convergence_m = 1e-6;  ///< the paper's epsilon, on |dx| (position and clocks); [1e-9, 1]
  /// Models: the sky's Klobuchar coefficients, and Saastamoinen. Default: as the errors in space are in the
  /// signals (receiver::ReceiverOptions::decide()).
  options::Switch correct_ionosphere = false, correct_troposphere = false;
  /// Satellites below this C/N0 are not used [dB-Hz]; those without C/N0 are. 0: no mask. [0, 60].
  double cn0_mask_dbhz = 0;
  WeightOptions weights;
  RaimOptions raim;
  /// The reported covariance is that of the weights times excess_variance() of the residuals: signals in a
  /// canyon scatter by more than their noise. Without redundancy the factor is 1. With correct_ionosphere it
  /// also includes the model's possible residual, half of the delay on all satellites, which moves the height
  /// without residuals.
  bool covariance_by_residuals = false;
  /// Solutions with a larger PDOP are rejected [1]; > 0, infinite: none is.
  double max_pdop = std::numeric_limits<double>::infinity();
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
void visit(options::Visitor& v, FixOptions& o);

/// Errors in space in a receiver's signals, and corrections of its fix.
struct RangeOptions {
  FixOptions fix;
  /// Delays are in the signal (the fix corrects them if FixOptions has the models), and errors of broadcast
  /// orbits and clocks. Default: as in the environment.
  options::Switch ionosphere = false, troposphere = false, orbit_errors = false;
};

/// Extended Kalman filter over pseudoranges and Doppler, as in receivers for vehicles: position and velocity
/// with white acceleration, one oscillator's drift, and a clock for each constellation that follows the
/// oscillator (equivalent to one clock and an inter-system bias for each further constellation).
struct PositionFilterOptions {
  bool enabled = false;
  /// Roots of the spectral densities of the white accelerations, horizontal and vertical [m/s^2/sqrt(Hz)],
  /// (0, 100]: over dt the velocity gains N(0, density^2 dt). Horizontal: sqrt(10 m^2/s^3), of a car (Groves,
  /// Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems, 2nd ed., accel_PSD of the
  /// software's car drive GNSS_Demo_4). Vertical: that times 15/100, u-blox's limits of vertical and
  /// horizontal speed in the dynamic model "automotive" (MAX-M10M integration manual, table 8).
  double acceleration_horizontal = 3.16;
  double acceleration_vertical = 0.5;
  /// Oscillator: spectral density of white frequency, h0 / 2 [s^2/s], and of random-walk frequency, 2 pi^2
  /// h-2 [(s/s)^2/s], each (0, 1e-6]. Defaults: TCXO of low quality, h0 = 2e-19 s, h-2 = 2e-20 1/s (Brown &
  /// Hwang, Introduction to Random Signals and Applied Kalman Filtering, 4th ed., 9.3, p. 327).
  double clock_frequency_density = 1e-19;
  double clock_drift_density = 4e-19;
  /// Restart after this time without an accepted measurement, or with most failing the gate [s], (0, 3600].
  double coast_s = 5;
  /// Positions with a larger standard deviation (root of the sum of the three variances) [m] are rejected,
  /// also as a start; > 0, infinite: none is.
  double max_sigma_m = std::numeric_limits<double>::infinity();
  /// Time constant of the errors of pseudoranges [s], [0, 3600]; 0: white ones. The filter's gains are those
  /// of white errors; the reported covariance is that of its estimate if each satellite's error is correlated
  /// by exp(-dt / error_correlation_s) (report_accuracy()). With FixOptions::covariance_by_residuals the
  /// errors' variance is that of the weights times excess_variance() of the epoch's innovations, of all
  /// satellites above the masks, also those that failed the gate, each with at most twice the gate.
  double error_correlation_s = 0;
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
void visit(options::Visitor& v, PositionFilterOptions& o);

}  // namespace canyon::positioning
