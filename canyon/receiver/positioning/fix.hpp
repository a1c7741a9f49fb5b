#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/receiver/positioning/least_squares.hpp"
#include "canyon/receiver/positioning/positioning_options.hpp"
#include "canyon/sky/gnss/fix_kind.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/orbit/sky.hpp"
#include "canyon/sky/range_errors.hpp"

namespace canyon::positioning {

/// A measurement of one signal of a satellite, or of a combination of two. In a fix it refers to the signal
/// near L1: for another signal the caller subtracts the difference of group delays from the pseudorange.
struct Measurement {
  gnss::SatelliteId id;
  double pseudorange_m =
      0;  ///< c (receiver clock reading at reception - satellite clock reading at transmission)
  /// Positive when approaching; includes both clocks' drifts: -(f / c) dP/dT, P the pseudorange [m] and T the
  /// receiver's own clock.
  std::optional<double> doppler_hz;
  double carrier_frequency_hz = 0;
  double sigma_m = 1;             ///< standard deviation, for the solver's weights and covariances; > 0
  double doppler_sigma_hz = 0.1;  ///< likewise, of the Doppler; > 0
  std::optional<double> cn0_dbhz;
  /// Since the channel's lock [cycles], growing with the pseudorange (RINEX's sign); empty without a phase.
  std::optional<double> carrier_phase_cycles;
  double carrier_phase_sigma_cycles = 0;  ///< standard deviation
  /// Start of the phase's continuity; a later instant than at the previous epoch is a cycle slip.
  std::optional<geodesy::GpsTime> phase_since;
  /// The phase may be off by half a cycle: the channel has not resolved the sign of the carrier.
  bool half_cycle = false;
  /// Fraction of the ionosphere's delay at carrier_frequency_hz in the pseudorange: 1 in one signal, 0 in the
  /// ionosphere-free combination of two, between in others.
  double ionosphere_fraction = 1;
  /// Ratio of the deviation to that of the single signal with cn0_dbhz: a factor of weights without sigma_m.
  double sigma_factor = 1;
  /// Fraction of the deviation of weights and gates that remains after corrections, (0, 1]: a factor of
  /// reported covariances.
  double reported_sigma_ratio = 1;
};

enum class FixStatus : std::uint8_t {
  NotSolved,  ///< initial value
  Fix,
  TooFewSatellites,
  Singular,      ///< the satellites' geometry does not determine position and clocks
  NotConverged,  ///< no convergence, or to a height outside -10 km to 100 km
  WeakGeometry,  ///< PDOP beyond FixOptions::max_pdop, accuracy beyond PositionFilterOptions::max_sigma_m
  NoSignal,      ///< the antenna is inside a building or under the terrain
};
/// "fix" or "no fix": the words of all outputs.
[[nodiscard]] std::string_view name(FixStatus status);
/// Text for users: "too few satellites".
[[nodiscard]] std::string_view reason(FixStatus status);

using gnss::FixKind;

/// Position of a receiver's antenna relative to a base's, by their carrier phases.
struct Baseline {
  FixKind kind = FixKind::Float;                         ///< Float or Fixed
  bool moving_base = false;                              ///< the base's position is its own fix of this epoch
  Eigen::Vector3d base_ecef = Eigen::Vector3d::Zero();   ///< as reported in its corrections [m]
  Eigen::Vector3d vector_enu = Eigen::Vector3d::Zero();  ///< from base to receiver, axes at the receiver [m]
  Eigen::Matrix3d covariance_enu = Eigen::Matrix3d::Zero();  ///< [m^2]
  /// Ratio of the squared distances of the second best and the best integers from the real values, 1 or more
  /// (rtk::RtkOptions::ratio); empty if no search was made.
  std::optional<double> ratio;
  std::vector<gnss::SatelliteId> used;  ///< ascending

  [[nodiscard]] double length_m() const { return vector_enu.norm(); }
  /// Angles of the vector: from north clockwise, [0, 2 pi), and upwards [rad].
  [[nodiscard]] double heading_rad() const;
  [[nodiscard]] double pitch_rad() const;
  /// The heading's standard deviation, to first order [rad]; infinite for a length of 0.
  [[nodiscard]] double heading_sigma_rad() const;
};

/// Phases of a receiver with the vehicle's sensors (UBX-ESF-STATUS).
enum class FusionPhase : std::uint8_t {
  Initialising,  ///< waits for motion that determines the heading: the position is the satellites'
  Calibrating,   ///< the position uses the sensors; their errors are being estimated
  Navigating,    ///< the errors of the sensors are estimated
};
/// "initialising", "calibrating", "navigating".
[[nodiscard]] std::string_view name(FusionPhase phase);

/// The state, except the position, of a receiver with the vehicle's sensors (DeadReckoning).
struct Fusion {
  FusionPhase phase = FusionPhase::Initialising;
  /// Heading from north clockwise, [0, 2 pi), nose up, left side up. Undefined while initialising.
  double heading_rad = 0, pitch_rad = 0, roll_rad = 0;
  double heading_sigma_rad = 0;  ///< standard deviation
  bool is_stationary = false;
  bool imu_calibrated = false, wheels_calibrated = false;
  double imu_hz = 0, wheels_hz = 0;  ///< rates of their readings; 0: no such sensor
};

/// A position solution. Covariance, DOP and counts all belong to the system of equations of the position.
struct [[nodiscard]] Fix {
  FixStatus status = FixStatus::NotSolved;
  /// Single, Differential, Float or Fixed: the kind of solution by the satellites' measurements. kind() also
  /// covers a fix without position, or without measurements.
  FixKind solution = FixKind::Single;
  bool claimed = false;  ///< reported as measured with 0 satellites (disturbance::FixEdit)
  /// Age of the used corrections: time of this epoch minus that of the base's observations [s], 0 or more;
  /// meaningless if corrected(kind()) is false.
  std::optional<double> correction_age_s;
  /// Reference station id (RTCM DF003, 0 to 4095) of the base; likewise, and empty if unknown.
  std::optional<int> correction_station;
  /// Solution by carrier phases, if the receiver has corrections. A moving base gives no position: the fix is
  /// then Single or Differential.
  std::optional<Baseline> baseline;
  /// Only with the vehicle's sensors.
  std::optional<Fusion> fusion;
  /// NaN unless solved.
  Eigen::Vector3d position_ecef = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  geodesy::Geodetic position{std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::quiet_NaN()};
  Eigen::Matrix3d covariance_enu =
      Eigen::Matrix3d::Constant(std::numeric_limits<double>::quiet_NaN());  ///< [m^2]
  /// Empty without Doppler of at least four of the used satellites, or if these do not determine it.
  std::optional<Eigen::Vector3d> velocity_enu_mps;
  std::optional<Eigen::Matrix3d> velocity_covariance_enu;  ///< [m^2/s^2]
  std::map<gnss::System, double> clock_bias_s;  ///< receiver clock minus each system's time, of those used
  std::optional<double> clock_drift;            ///< [s/s]
  std::optional<Dop> dop;
  std::vector<gnss::SatelliteId> used;  ///< ascending; empty unless solved
  std::vector<double> residuals_m;      ///< measured minus computed, one per used
  /// Excluded by RAIM, in order, or by a position filter's gate, ascending. Of satellites that are also in
  /// `used` only the Doppler is excluded.
  std::vector<gnss::SatelliteId> excluded;
  /// RAIM's test passed on the used satellites; empty if off or without redundancy.
  std::optional<bool> consistent;
  /// Measured satellites with a state in the sky, not below the C/N0 mask and, if a position was known, above
  /// the elevation mask. Includes those left out by RAIM or as the only one of their constellation. Set also
  /// without a solution.
  int available = 0;
  int iterations = 0;
  int rank = 0;      ///< of the last design matrix; 0 if there was none
  int unknowns = 0;  ///< 3 + constellation clocks

  [[nodiscard]] bool solved() const { return status == FixStatus::Fix; }
  /// The position uses satellites of this epoch.
  [[nodiscard]] bool measured() const { return solved() && (!used.empty() || claimed); }
  /// The position uses the vehicle's sensors.
  [[nodiscard]] bool fused() const { return fusion && fusion->phase != FusionPhase::Initialising; }
  /// DeadReckoning is a prediction, of a position filter or of the vehicle's sensors.
  [[nodiscard]] FixKind kind() const {
    if (!solved()) return FixKind::None;
    if (!measured()) return FixKind::DeadReckoning;
    return fused() && solution == FixKind::Single ? FixKind::Combined : solution;
  }
};

/// Moves the position of a solved fix. @param enu_m east, north, up
void add_offset(Fix& fix, const Eigen::Vector3d& enu_m);

/// The residual of a satellite in a fix, measured minus computed [m]; empty if the satellite is not used.
[[nodiscard]] std::optional<double> residual_m(const Fix& fix, gnss::SatelliteId id);

/// Iterated weighted least squares on pseudoranges, one clock per constellation; velocity from Doppler.
///
/// Satellites are evaluated at T - P/c - (satellite clock - group delay), in which the receiver's clock
/// cancels; the Earth's rotation during the flight and the mask follow the iterated position. A constellation
/// with a single satellite is left out: it would add its own clock and no information on the position. The
/// rank is that of the weighted design matrix by QR with column pivoting, pivots above 1e-6 of the largest (a
/// PDOP of about 1e6). Noise-free measurements give the position within 0.1 mm for GDOP below 100.
///
/// @param receiver_time T, the receiver's own clock reading at reception (its bias included)
/// @param measurements any order, each satellite once; satellites that are not in the sky are left out
/// @param sky gives the satellites at transmission, as the receiver's decoded navigation messages do
/// @param klobuchar per system, GPS's as fallback; needed with correct_ionosphere
/// @param start initial guess, ECEF [m]; the Earth's centre works. If it does not converge, the ground below
/// the satellites is tried. The mask is applied at the iterated position.
///
/// With RAIM, sum (r_i / sigma_i)^2 is tested against the chi-square quantile of 1 - false_alarm with
/// (satellites used - unknowns) degrees of freedom. While it fails, the satellite with the largest normalised
/// residual is excluded. Once it passes, each exclusion except the last is reversed and tested again. If
/// fewer than two measurements are redundant (with one, all normalised residuals are equal), or the rest has
/// no solution, all exclusions are reversed: the fix of all satellites with Fix::consistent false. If
/// max_exclusions is reached, the last fix stays, with Fix::consistent false.
///
/// The status is NotSolved at first, then the reason of a failure. Throws InputError for a measurement that
/// is not a number, a satellite measured twice, bad options and missing Klobuchar coefficients.
[[nodiscard]] Fix solve_fix(geodesy::GpsTime receiver_time, const std::vector<Measurement>& measurements,
                            const orbit::Sky& sky, const FixOptions& options,
                            const std::map<gnss::System, gnss::Klobuchar>& klobuchar = {},
                            const Eigen::Vector3d& start = Eigen::Vector3d::Zero());

struct RangedSatellite;
/// The same from the result of range_satellites() with these options.
[[nodiscard]] Fix solve_fix(geodesy::GpsTime receiver_time, const std::vector<RangedSatellite>& satellites,
                            const FixOptions& options,
                            const std::map<gnss::System, gnss::Klobuchar>& klobuchar,
                            const Eigen::Vector3d& start);

/// The solve_fix() outputs at another method's position (ECEF, finite): clocks, residuals, DOP, covariance
/// and velocity of the satellites that its RAIM keeps. No fix if these do not determine a position.
[[nodiscard]] Fix fix_at(const Eigen::Vector3d& point, geodesy::GpsTime receiver_time,
                         const std::vector<Measurement>& measurements, const orbit::Sky& sky,
                         const FixOptions& options, const std::map<gnss::System, gnss::Klobuchar>& klobuchar);

}  // namespace canyon::positioning
