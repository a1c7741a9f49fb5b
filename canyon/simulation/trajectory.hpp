#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "canyon/geodesy/frames.hpp"
#include "canyon/geodesy/gps_time.hpp"

namespace canyon::simulation {

/// A vehicle's reference point at an instant.
struct Pose {
  geodesy::GpsTime time;
  geodesy::Geodetic position;
  Eigen::Vector3d velocity_enu_mps = Eigen::Vector3d::Zero();
  double yaw_rad = 0;         ///< ENU yaw of the direction of travel; the last moving one at standstill
  double yaw_rate_radps = 0;  ///< counter-clockwise; 0 at standstill and at corners of straight legs
};

/// A path through time. Samples are interpolated so that position and velocity are continuous (cubic Hermite
/// on ENU positions about the first sample, velocities from the parabola through three samples: central
/// differences where they are evenly spaced); between samples more than `kMaxCubicGap_s` apart the path is
/// straight and its height above the ellipsoid linear. It passes through every sample exactly. Error of the
/// cubic for a path with bounded third derivative j and spacing h: below 0.05 j h^3. Immutable, thread-safe.
class Trajectory {
 public:
  static constexpr double kMaxCubicGap_s = 5;
  /// Below this speed [m/s] a vehicle stands: its yaw is held.
  static constexpr double kStandstill_mps = 0.1;

  /// At least one sample; times strictly increasing, all finite (InputError).
  explicit Trajectory(std::vector<std::pair<geodesy::GpsTime, geodesy::Geodetic>> samples);

  /// Straight legs at constant speed [m/s, > 0]; `hold_s` seconds of standstill at each waypoint.
  [[nodiscard]] static Trajectory from_waypoints(geodesy::GpsTime start,
                                                 const std::vector<geodesy::Geodetic>& waypoints,
                                                 double speed_mps, double hold_s = 0);
  /// One place for `duration_s`.
  [[nodiscard]] static Trajectory fixed(geodesy::GpsTime start, const geodesy::Geodetic& place,
                                        double duration_s);

  [[nodiscard]] geodesy::GpsTime begin() const;
  [[nodiscard]] geodesy::GpsTime end() const;
  /// Median spacing of the samples [s]; 1 for a fixed place or waypoints.
  [[nodiscard]] double sample_interval_s() const;
  /// Clamped to [begin, end].
  [[nodiscard]] Pose at(geodesy::GpsTime t) const;
  [[nodiscard]] double length_m() const;

 private:
  struct Track;
  std::shared_ptr<const Track> track_;
};

/// "csv": header or not; columns time, latitude, longitude, height. Time is ISO 8601, or seconds from the
/// scenario's start. "urbannav": week, tow, latitude, longitude, height. "nmea": GGA with RMC or ZDA for the
/// date, else the date of `start`. Throws InputError with file and line for text that is not a number,
/// latitudes in the wrong unit, times that go backwards, or no usable line. A `start` of GpsTime{} means that
/// none is known: files that need one are refused.
[[nodiscard]] Trajectory read_trajectory(const std::filesystem::path& path, const std::string& format,
                                         geodesy::GpsTime start);

/// The same with what there is to say about the file.
struct TrajectoryFile {
  Trajectory trajectory;
  bool has_own_dates = true;          ///< false: its times hang on `start`
  std::vector<std::string> warnings;  ///< skipped lines, counted by reason
};
[[nodiscard]] TrajectoryFile read_trajectory_file(const std::filesystem::path& path,
                                                  const std::string& format, geodesy::GpsTime start);

/// The formats that read_trajectory knows.
[[nodiscard]] const std::vector<std::string>& trajectory_formats();

}  // namespace canyon::simulation
