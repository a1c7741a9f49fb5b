#pragma once

#include <Eigen/Core>
#include <map>
#include <span>
#include <vector>

#include "canyon/geodesy/gps_time.hpp"
#include "canyon/gnss/navigation_data.hpp"
#include "canyon/orbit/sky.hpp"
#include "canyon/positioning/fix.hpp"

namespace canyon::positioning {

/// A measured satellite with its state at transmission, as fix and position filter need it. What depends on
/// the receiver's place is renewed by place_satellite() and look_up().
struct RangedSatellite {
  const Measurement* measured = nullptr;
  orbit::SatelliteState state;  ///< ECEF of the transmission instant
  double pseudorange_m = 0;     ///< cleaned of the satellite's clock: range + atmosphere + receiver clock
  double sigma_m = 1;           ///< by the weights; for elevation weights that of the last look_up()
  double flight_time_s = 0.07;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();   ///< in the axes of reception
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< unit, receiver to satellite
  double range_m = 0;
  double atmosphere_m = 0;
  bool above_mask = true;
  bool excluded = false;  ///< by RAIM
  bool active = false;    ///< above the mask, not excluded, not alone in its constellation
};

/// Measurements whose satellites the sky knows, at or above the C/N0 mask, ascending by satellite. Two
/// evaluations of the sky at most. `measurements` must outlive the result.
/// Throws InputError for a measurement that is not a number and a satellite measured twice.
[[nodiscard]] std::vector<RangedSatellite> ranged_satellites(geodesy::GpsTime receiver_time,
                                                             const std::vector<Measurement>& measurements,
                                                             const orbit::Sky& sky,
                                                             const FixOptions& options);

/// Turns the satellite by the Earth's rotation over the flight time so far, and renews flight time, range and
/// direction from `receiver_ecef`. From a known place three calls in a row settle below 1e-9 m, whatever the
/// flight time was: each leaves 1e-5 of the last one's error.
void place_satellite(RangedSatellite& satellite, const Eigen::Vector3d& receiver_ecef);

/// Mask, atmosphere and elevation weights at `receiver_ecef`, of satellites that have been placed.
/// @param looks how often the iteration has looked before. So that no edge keeps it from settling, after
/// three a satellite that was below the mask stays out, and after eight the troposphere beyond the heights
/// that saastamoinen_delay_m() knows (-100 m to 10 km, 0 elsewhere) is that of the nearest.
///
/// Throws InputError where options.correct_ionosphere finds no coefficients.
void look_up(std::span<RangedSatellite> satellites, const Eigen::Vector3d& receiver_ecef,
             geodesy::GpsTime receiver_time, const FixOptions& options,
             const std::map<gnss::System, gnss::Klobuchar>& klobuchar, int looks = 0);

/// Doppler as an equation. With T' = 1 + d, d the receiver clock's drift, and the light-time equation derived
/// once, the range rate is r' = e.(V - v) / g, g = 1 + e.(V + omega x S) / c, and
///   -lambda D = r' + (1 + lambda D / c) c d - c d_sat,
/// linear in the receiver's velocity v (ECEF) and d.
struct DopplerEquation {
  Eigen::Vector3d satellite_mps = Eigen::Vector3d::Zero();  ///< V in the axes of reception
  double g = 1;
  double measured_mps = 0;  ///< -lambda D
  double sigma_mps = 1;
};
/// @param satellite placed, with Doppler
[[nodiscard]] DopplerEquation doppler_equation(const RangedSatellite& satellite);

/// Where receivers may be [m above the ellipsoid]: check_geodetic()'s lower bound, and the edge of space,
/// below every mirrored root of the pseudorange equations.
inline constexpr double kLowest_m = -1e4;
inline constexpr double kHighest_m = 1e5;

}  // namespace canyon::positioning
