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
  double yaw_rad = 0;  ///< ENU yaw of the direction of travel; the last moving one at standstill
};

/// A path through time. Samples are interpolated so that position and velocity are continuous (cubic Hermite on
/// ENU positions about the first sample, velocities by central differences); between samples more than
/// `kMaxCubicGap_s` apart the path is straight. Immutable, thread-safe.
class Trajectory {
 public:
  static constexpr double kMaxCubicGap_s = 5;

  /// At least one sample; times strictly increasing, all finite (InputError).
  explicit Trajectory(std::vector<std::pair<geodesy::GpsTime, geodesy::Geodetic>> samples);

  /// Straight legs at constant speed [m/s, > 0]; `hold_s` seconds of standstill at each waypoint.
  [[nodiscard]] static Trajectory from_waypoints(geodesy::GpsTime start,
                                                 const std::vector<geodesy::Geodetic>& waypoints,
                                                 double speed_mps, double hold_s = 0);
  /// One place for `duration_s`.
  [[nodiscard]] static Trajectory fixed(geodesy::GpsTime start, const geodesy::Geodetic& place, double duration_s);

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
/// date, else the date of `start`. Throws InputError with file and line for text that is not a number, latitudes
/// in the wrong unit, times that go backwards, or no usable line.
[[nodiscard]] Trajectory read_trajectory(const std::filesystem::path& path, const std::string& format,
                                         geodesy::GpsTime start);

}  // namespace canyon::simulation
