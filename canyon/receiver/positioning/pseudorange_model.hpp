#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/options/fwd.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/receiver/positioning/range_terms.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::positioning {

/// A measured satellite with its state at transmission, for fix and position filter.
/// update_satellite_geometry() and look_up() update the fields that depend on the receiver's position.
struct RangedSatellite {
  const Measurement* measured = nullptr;
  orbit::SatelliteState state;   ///< ECEF of the transmission instant
  double pseudorange_m = 0;      ///< after satellite_range(): range + terms of space + receiver clock
  double sigma_m = 1;            ///< by the weights; for elevation weights that of the last look_up()
  double doppler_sigma_mps = 1;  ///< by the weights
  double flight_time_s = 0.07;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();   ///< in the axes of reception
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< unit, receiver to satellite
  double range_m = 0;
  double space_m = 0;       ///< models of the terms of space
  double ionosphere_m = 0;  ///< part of space_m, if no corrections replace the model
  bool above_mask = true;
  bool excluded = false;  ///< by RAIM
};

/// Measurements of satellites in the sky, at or above the C/N0 mask, ascending by satellite. At most two
/// evaluations of the sky. `measurements` must outlive the result.
/// Throws InputError for a measurement that is not a number and a satellite measured twice.
/// @param satellites replaced; it keeps its capacity
void range_satellites(geodesy::GpsTime receiver_time, const std::vector<Measurement>& measurements,
                      const orbit::Sky& sky, const FixOptions& options,
                      std::vector<RangedSatellite>& satellites);

/// Correction of a signal's range by the satellite's messages, without geometry [m]: clock and group delay.
/// @param signal null: the one near L1
[[nodiscard]] receiver::CodeAndCarrier satellite_range(const orbit::SatelliteState& state,
                                                       const gnss::Signal* signal);

/// Fraction of the ionosphere's delay that remains after broadcast models (IS-GPS-200, 20.3.3.5.2.5: they
/// remove at least half of the rms).
inline constexpr double kIonosphereLeft = 0.5;

/// Columns of the design matrix for constellation clocks, after the three of the position.
struct Clocks {
  std::array<int, gnss::kSystemCount> column{};  ///< -1: without
  int count = 0;
};
/// A constellation has a clock if it has at least two satellites: a single one would determine its clock
/// only. SBAS uses GPS's (gnss::clock_system()).
/// @param satellites of each system
[[nodiscard]] Clocks clocks_of(const std::array<int, gnss::kSystemCount>& satellites);
/// FixOptions::min_satellites and one more for each clock beyond the first.
[[nodiscard]] bool enough_satellites(int satellites, int clocks, const FixOptions& options);
/// FixOptions::max_pdop. @param dop empty: the geometry is beyond all bounds
[[nodiscard]] bool strong_enough(const std::optional<Dop>& dop, const FixOptions& options);
/// Heights of receivers are from check_geodetic()'s lower bound (-10 km) to the edge of space (100 km), below
/// every mirrored root of the pseudorange equations.
[[nodiscard]] bool is_near_ground(double height_m);
/// Whether all values of a solved fix and its baseline are finite, and covariances positive semi-definite.
[[nodiscard]] bool is_sound(const Fix& fix);

/// Rotates the satellite by the Earth's rotation over the current flight time, and updates flight time, range
/// and direction from `receiver_ecef`. From a known position three successive calls converge below 1e-9 m for
/// any initial flight time: each leaves 1e-5 of the last one's error.
void update_satellite_geometry(RangedSatellite& satellite, const Eigen::Vector3d& receiver_ecef);

/// Mask, atmosphere and elevation weights at `receiver_ecef`, after update_satellite_geometry(). Throws
/// InputError if options.correct_ionosphere lacks coefficients.
/// @param looks number of earlier iterations. After three a masked satellite stays out, for convergence.
void look_up(std::span<RangedSatellite> satellites, const Eigen::Vector3d& receiver_ecef,
             geodesy::GpsTime receiver_time, const FixOptions& options,
             const std::map<gnss::System, gnss::Klobuchar>& klobuchar, int looks = 0);

/// Doppler equation. With T' = 1 + d, d the receiver clock's drift, and the derivative of the light-time
/// equation, the range rate is r' = e.(V - v) / g, g = 1 + e.(V + omega x S) / c, and
///   -lambda D = r' + (1 + lambda D / c) c d - c d_sat,
/// linear in the receiver's velocity v (ECEF) and d.
struct DopplerEquation {
  Eigen::Vector3d satellite_mps = Eigen::Vector3d::Zero();  ///< V in the axes of reception
  double g = 1;
  double measured_mps = 0;  ///< -lambda D
  double sigma_mps = 1;
};
/// @param satellite after update_satellite_geometry(), with Doppler
[[nodiscard]] DopplerEquation doppler_equation(const RangedSatellite& satellite);

enum class Smoothing : std::uint8_t {
  None,
  /// Smooths by the signal's own carrier (Hatch, The synergism of GPS code and carrier measurements, 1982):
  /// the ionosphere, which delays codes and advances carriers, leaves an error of 2 (window_s) dI/dt.
  Hatch,
  /// Smooths by a combination of two carriers that has the code's delay: no divergence. With only one
  /// continuous carrier: as Hatch.
  DivergenceFree,
};

struct SmoothingOptions {
  Smoothing smoothing = Smoothing::None;
  double window_s = 100;  ///< time constant [s], [1, 3600]; 100 of aviation receivers (RTCA DO-229)
};
void visit(options::Visitor& v, SmoothingOptions& o);

/// A part of a code's error: correlated in time by e^(-dt rate_per_s).
struct CodeNoise {
  double sigma_m = 0;
  double rate_per_s = 0;  ///< >= 0; infinite: white
};

/// A pseudorange smoothed by the carrier's range changes:
///   S_k = a P_k + (1 - a) (S_k-1 + L_k - L_k-1),  a = max(dt / window, 1 / k)
/// so that the first epochs after a slip are plain averages. Its deviation is computed exactly for codes
/// whose errors are sums of two first-order processes (CodeNoise) of constant deviation; the carrier's noise
/// is neglected.
class CodeSmoother {
 public:
  struct Smoothed {
    double pseudorange_m = 0;
    double sigma_m = 0;  ///< by CodeNoise alone
  };
  /// The smoothed pseudorange of the next epoch.
  /// @param carrier_step_m L_k - L_k-1; empty: restarts
  [[nodiscard]] Smoothed next(geodesy::GpsTime time, double pseudorange_m,
                              std::optional<double> carrier_step_m, const std::array<CodeNoise, 2>& noise,
                              const SmoothingOptions& options);

 private:
  std::optional<geodesy::GpsTime> last_;
  int count_ = 0;
  double smoothed_m_ = 0;
  // Variance of the smoothed error and its covariance with the code's, relative to each part's own.
  std::array<double, 2> variance_{}, covariance_{};
};

}  // namespace canyon::positioning
