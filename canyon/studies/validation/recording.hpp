#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/run/environment.hpp"
#include "canyon/run/scenario/fwd.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"
#include "canyon/studies/validation/pseudorange_errors.hpp"

namespace canyon::validation {

/// A rigid horizontal move of the city: a point p of its map lies at turn(p - pivot) + pivot + offset.
struct Registration {
  double east_m = 0, north_m = 0;
  double heading_rad = 0;                           ///< counter-clockwise about the pivot, as yaw
  Eigen::Vector2d pivot = Eigen::Vector2d::Zero();  ///< east, north of the city's frame

  /// Where an antenna or a direction of the true world (the city's frame, city in place) stands in the
  /// unmoved map, that rays are cast in: turn^-1(p - pivot - offset) + pivot, turn^-1(d). Heights stay.
  [[nodiscard]] Eigen::Vector3d place_in_city(const Eigen::Vector3d& enu) const;
  [[nodiscard]] Eigen::Vector3d direction_in_city(const Eigen::Vector3d& enu) const;
  /// The map moved once more: turned by `heading_rad` about `pivot` and shifted by (east, north).
  [[nodiscard]] Registration then(double east_m, double north_m, double heading_rad,
                                  const Eigen::Vector2d& pivot) const;
};

/// The part that all comparisons of one recording share.
struct Recording {
  PseudorangeResiduals residuals;  ///< by epoch, all satellites above the horizon
  /// Antenna of residuals.epochs in the city's ENU frame and its velocity, height as the scenario says: above
  /// the terrain of the unmoved city, or as recorded. Rays start from there; ranges to satellites always
  /// belong to the true place, residuals.epochs[].antenna_ecef.
  struct Place {
    Eigen::Vector3d enu_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d velocity_enu_mps = Eigen::Vector3d::Zero();
  };
  std::vector<Place> places;
  /// The scenario's height above terrain plus the lever arm's [m]: places are put there again where the city
  /// moves. Empty: heights as recorded.
  std::optional<double> antenna_above_terrain_m;
  bool ionosphere = true, troposphere = true;  ///< in the recorded pseudoranges: measured fixes correct them
  /// Measured fixes are solved from these: all recorded first signals of satellites with ephemerides and
  /// above the horizon, sigma 1 m, one for each of the epoch's residuals and in their order.
  std::vector<std::vector<positioning::Measurement>> measurements;  ///< one list for each of residuals.epochs
  /// Positions that the recorded receiver reported, and their errors (RecordingOptions::nmea).
  struct OwnFix {
    geodesy::GpsTime time;
    Eigen::Vector3d error_enu_m = Eigen::Vector3d::Zero();
  };
  std::vector<OwnFix> own_fixes;  ///< within the truth's span, by time
  std::vector<std::string> warnings;

  /// The antenna of an epoch in the unmoved map while the city is moved: where its rays start [m].
  [[nodiscard]] Eigen::Vector3d place_in_city(const raytrace::RayScene& scene, const Registration& moved,
                                              std::size_t epoch) const;
};

struct RecordingOptions {
  /// The recorded pseudoranges hold these delays, as those of real receivers do; both are then corrected
  /// (ResidualOptions). Simulated recordings may be without.
  bool ionosphere = true, troposphere = true;
  std::optional<std::filesystem::path> nmea;  ///< the recorded receiver's own fixes: Recording::own_fixes
};
/// Reads recording and truth and brings them to the scenario's sky and city. `obs` RINEX, `truth` of
/// `truth_format` (simulation::read_trajectory; empty: the scenario's one position; dates that the file
/// leaves open are those of the scenario's `start`, in NMEA else of the recording). The scenario gives
/// systems and height above terrain, its first receiver the lever arm. `environment` has the scenario's city,
/// and a sky of the recording's day. Throws InputError where files are unreadable, nothing of the recording
/// is in the truth, no recorded satellite has an ephemeris, or the ionosphere's coefficients are missing.
[[nodiscard]] Recording read_recording(const simulation::Scenario& scenario,
                                       const simulation::Environment& environment,
                                       const std::filesystem::path& obs, const std::filesystem::path& truth,
                                       const std::string& truth_format, const RecordingOptions& options = {});
/// The same of observations that were read already; `obs` names their file in messages.
[[nodiscard]] Recording join_recording(const simulation::Scenario& scenario,
                                       const simulation::Environment& environment,
                                       const std::filesystem::path& obs, rinex::RinexObservations recorded,
                                       const std::filesystem::path& truth, const std::string& truth_format,
                                       const RecordingOptions& options = {});

}  // namespace canyon::validation
