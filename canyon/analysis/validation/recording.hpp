#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "canyon/analysis/validation/pseudorange_errors.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/fwd.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"

namespace canyon::validation {

/// A rigid horizontal move of the city: a point p of its map moves to R(p - pivot) + pivot + offset.
struct Registration {
  double east_m = 0, north_m = 0;
  double heading_rad = 0;                           ///< counter-clockwise about the pivot, as yaw
  Eigen::Vector2d pivot = Eigen::Vector2d::Zero();  ///< east, north of the city's frame

  /// The point or direction in the unmoved map, in which rays are cast, of an antenna or direction of the
  /// true world (the city's frame, with the city moved): R^-1(p - pivot - offset) + pivot, R^-1(d). Heights
  /// do not change.
  [[nodiscard]] Eigen::Vector3d point_in_map(const Eigen::Vector3d& enu) const;
  [[nodiscard]] Eigen::Vector3d direction_in_city(const Eigen::Vector3d& enu) const;
  /// The map moved once more: rotated by `heading_rad` about `pivot` and shifted by (east, north).
  [[nodiscard]] Registration then(double east_m, double north_m, double heading_rad,
                                  const Eigen::Vector2d& pivot) const;
};

/// The data common to all comparisons of one recording.
struct Recording {
  PseudorangeResiduals residuals;  ///< by epoch, all satellites above the horizon
  /// Antenna of residuals.epochs in the city's ENU frame and its velocity, with the scenario's height: above
  /// the terrain of the unmoved city, or as recorded. Rays start from there; ranges to satellites always
  /// refer to the true position, residuals.epochs[].antenna_ecef.
  struct AntennaTrack {
    Eigen::Vector3d enu_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d velocity_enu_mps = Eigen::Vector3d::Zero();
  };
  std::vector<AntennaTrack> antennas;
  /// The scenario's height above terrain plus the lever arm's [m], also in a moved city. Empty: as recorded.
  std::optional<double> antenna_above_terrain_m;
  bool ionosphere = true, troposphere = true;  ///< in the recorded pseudoranges: corrected in measured fixes
  /// Input of the measured fixes: all recorded first signals of satellites with ephemerides and above the
  /// horizon, sigma 1 m, one for each of the epoch's residuals and in their order.
  std::vector<std::vector<positioning::Measurement>> measurements;  ///< one list for each of residuals.epochs
  /// Positions that the recorded receiver reported, and their errors (RecordingOptions::nmea).
  struct ReportedFix {
    geodesy::GpsTime time;
    Eigen::Vector3d error_enu_m = Eigen::Vector3d::Zero();
  };
  std::vector<ReportedFix> reported_fixes;  ///< within the truth's span, by time
  std::vector<std::string> warnings;

  /// The antenna of an epoch in the unmoved map if the city is moved: the start of its rays [m].
  [[nodiscard]] Eigen::Vector3d point_in_map(const raytrace::RayScene& scene, const Registration& moved,
                                             std::size_t epoch) const;
};

struct RecordingOptions {
  /// The recorded pseudoranges contain these delays, as those of real receivers do; both are then corrected
  /// (ResidualOptions). Simulated recordings may lack them.
  bool ionosphere = true, troposphere = true;
  std::optional<std::filesystem::path> nmea;  ///< the recorded receiver's fixes: Recording::reported_fixes
};
/// Reads recording and truth in the scenario's sky and city. `obs` RINEX, `truth` of `truth_format`
/// (simulation::read_trajectory_file(); empty: the scenario's one position; missing dates of the file are
/// those of the scenario's `start`, in NMEA else of the recording). The scenario has systems and height above
/// terrain, its first receiver the lever arm. `environment` has the scenario's city, and a sky of the
/// recording's day. Throws InputError if files are unreadable, the recording does not overlap the truth, no
/// recorded satellite has an ephemeris, or the ionosphere's coefficients are missing.
[[nodiscard]] Recording read_recording(const simulation::Scenario& scenario,
                                       const simulation::Environment& environment,
                                       const std::filesystem::path& obs, const std::filesystem::path& truth,
                                       const std::string& truth_format, const RecordingOptions& options = {});
/// The same for observations that were already read; `obs` names their file in messages.
[[nodiscard]] Recording join_recording(const simulation::Scenario& scenario,
                                       const simulation::Environment& environment,
                                       const std::filesystem::path& obs, rinex::RinexObservations recorded,
                                       const std::filesystem::path& truth, const std::string& truth_format,
                                       const RecordingOptions& options = {});

}  // namespace canyon::validation
