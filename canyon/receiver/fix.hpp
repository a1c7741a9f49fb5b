#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/geodesy/frames.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/orbit/navigation_data.hpp"
#include "canyon/orbit/sky.hpp"

namespace canyon::receiver {

/// What a receiver measures of one satellite on its L1-band signal.
struct Measurement {
  orbit::SatelliteId id;
  double pseudorange_m = 0;  ///< c (receiver clock reading at reception - satellite clock reading at transmission)
  std::optional<double> doppler_hz;  ///< positive when approaching; includes both clocks' drifts
  double carrier_frequency_hz = 0;
  double sigma_m = 1;  ///< standard deviation that the solver weights and states covariances by
};

enum class FixStatus : std::uint8_t {
  NotSolved,          ///< as constructed
  Fix,
  TooFewSatellites,
  Singular,           ///< the satellites' geometry does not determine position and clocks
  NotConverged,
  NoSignal,           ///< the antenna is inside a building or under the terrain
};
/// "fix" or "no fix": the words of every output.
[[nodiscard]] std::string_view name(FixStatus status);
/// Reason for people: "too few satellites".
[[nodiscard]] std::string_view reason(FixStatus status);

/// Dilutions of precision: square roots of traces of the cofactor matrix (unit variance) in local ENU.
/// GDOP^2 = PDOP^2 + TDOP^2 where TDOP takes all clocks of the solution. (The paper prints squares of D's
/// diagonal; the root of the diagonal is meant, see Langley 1999.)
struct Dop {
  double gdop = 0, pdop = 0, hdop = 0, vdop = 0, tdop = 0;
};
/// The paper's table of DOP ratings.
enum class DopRating : std::uint8_t { Ideal, Excellent, Good, Moderate, Fair, Poor };
[[nodiscard]] std::string_view name(DopRating rating);
/// < 1 Ideal, 1 to 2 Excellent, 2 to 5 Good, 5 to 10 Moderate, 10 to 20 Fair, above Poor; a bound belongs to the
/// worse class. Rates PDOP everywhere in Canyon.
[[nodiscard]] DopRating rate_dop(double dop);

struct FixOptions {
  double elevation_mask_rad = 0.17453292519943295;  ///< 10 deg; [0, pi/2)
  /// Satellites needed, on top of one for each constellation clock beyond the first. >= 4 (the paper: 5).
  int min_satellites = 4;
  int max_iterations = 20;
  double convergence_m = 1e-6;  ///< the paper's epsilon, on |dx|
  bool correct_ionosphere = false;   ///< by the sky's Klobuchar coefficients
  bool correct_troposphere = false;  ///< by Saastamoinen
  void validate() const;
};

/// A position solution. Covariance, DOP and counts all come from the system that made the position.
struct [[nodiscard]] Fix {
  FixStatus status = FixStatus::NotSolved;
  /// NaN unless solved.
  Eigen::Vector3d position_ecef = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  geodesy::Geodetic position{std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::quiet_NaN()};
  Eigen::Matrix3d covariance_enu = Eigen::Matrix3d::Constant(std::numeric_limits<double>::quiet_NaN());  ///< [m^2]
  /// Empty without Doppler of at least as many satellites as unknowns.
  std::optional<Eigen::Vector3d> velocity_enu_mps;
  std::optional<Eigen::Matrix3d> velocity_covariance_enu;  ///< [m^2/s^2]
  std::map<orbit::System, double> clock_bias_s;  ///< receiver clock minus each system's time
  std::optional<double> clock_drift;             ///< [s/s]
  std::optional<Dop> dop;
  std::vector<orbit::SatelliteId> used;          ///< ascending
  std::vector<double> residuals_m;               ///< measured minus computed, one per used
  int iterations = 0;
  int rank = 0;      ///< of the last design matrix
  int unknowns = 0;  ///< 3 + constellation clocks

  [[nodiscard]] bool solved() const { return status == FixStatus::Fix; }
};

/// Iterated weighted least squares on pseudoranges, one clock per constellation; velocity from Doppler.
/// @param receiver_time the receiver's own clock reading at reception (its bias included)
/// @param sky answers for the satellites at transmission, as the receiver's decoded navigation messages do
/// @param klobuchar per system, GPS's as fallback; needed with correct_ionosphere
/// @param start initial guess, ECEF [m]; the Earth's centre works. The mask is applied at the iterated position.
/// The result starts as NotSolved and says why it failed.
[[nodiscard]] Fix solve_fix(geodesy::GpsTime receiver_time, const std::vector<Measurement>& measurements,
                            const orbit::Sky& sky, const FixOptions& options,
                            const std::map<orbit::System, orbit::Klobuchar>& klobuchar = {},
                            const Eigen::Vector3d& start = Eigen::Vector3d::Zero());

}  // namespace canyon::receiver
