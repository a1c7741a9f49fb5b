#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/read_report.hpp"
#include "canyon/simulation/motion/pose.hpp"

namespace canyon::simulation {

/// How a vehicle tilts as it moves.
enum class Attitude : std::uint8_t {
  Level,     ///< roll and pitch 0
  Aircraft,  ///< nose along the flight path, banked so that a turn is coordinated: tan(roll) = v yaw rate / g
  Multirotor,  ///< its thrust makes the acceleration: up along acceleration plus gravity
  Car          ///< nose along the direction of travel, on slopes as well; level across
};

/// A corner of a drive.
struct Waypoint {
  geodesy::Geodetic position;
  double speed_mps = 10;  ///< on the leg that ends here; above 0
  double hold_s = 0;      ///< standstill here
};

/// A path over time. Samples are interpolated so that position and velocity are continuous (cubic Hermite on
/// ENU positions about the first sample, velocities from the parabola through three samples: central
/// differences if they are evenly spaced); between samples more than `kMaxCubicGap_s` apart the path is
/// straight and its height above the ellipsoid linear. It passes through every sample exactly. Error of the
/// cubic for a path with bounded third derivative j and spacing h: below 0.05 j h^3. A smooth path
/// (from_waypoints() with an acceleration, smoothed()) is a SmoothMotion. Immutable, thread-safe.
class Trajectory {
 public:
  static constexpr double kMaxCubicGap_s = 5;
  /// Below this speed [m/s] a vehicle is stationary: its yaw is held.
  static constexpr double kStandstill_mps = 0.1;

  /// At least one sample; times strictly increasing, all finite (InputError).
  explicit Trajectory(std::vector<std::pair<geodesy::GpsTime, geodesy::Geodetic>> samples);

  /// Straight legs at constant speeds, with standstill at waypoints. With an acceleration [m/s^2, (0, 100]]
  /// the drive is smooth (SmoothMotion): it begins and ends at rest and rests for each hold; neither speeds
  /// nor the acceleration, along and across together, are exceeded, and its jerk is at most twice the
  /// acceleration over SmoothMotion::kBox_s. Corners without a hold are rounded by arcs at constant speed, as
  /// wide as the legs' speed requires and at most 45 % of the shorter leg; if that is too little, the speed
  /// is reduced. At turns of more than 170 deg the vehicle stops. At rest it rotates on the spot by 1 rad/s
  /// towards its next leg.
  [[nodiscard]] static Trajectory from_waypoints(geodesy::GpsTime start,
                                                 const std::vector<Waypoint>& waypoints,
                                                 std::optional<double> acceleration_mps2);
  /// One position for `duration_s`.
  [[nodiscard]] static Trajectory fixed(geodesy::GpsTime start, const geodesy::Geodetic& position,
                                        double duration_s);

  [[nodiscard]] geodesy::GpsTime begin() const;
  [[nodiscard]] geodesy::GpsTime end() const;
  /// Median spacing of the samples [s]; 1 for a fixed position or waypoints.
  [[nodiscard]] double sample_interval_s() const;
  /// Clamped to [begin, end].
  [[nodiscard]] Pose at(geodesy::GpsTime t) const;
  /// at() in ECEF; of a SmoothMotion in a third of the time.
  [[nodiscard]] EcefPose ecef_pose(geodesy::GpsTime t) const;
  [[nodiscard]] double length_m() const;
  /// Begin and end of the pauses of a recording: spacings above ten times the median and `kMaxCubicGap_s`
  /// between samples more than 1 m apart. Empty for waypoints.
  [[nodiscard]] std::vector<std::pair<geodesy::GpsTime, geodesy::GpsTime>> pauses() const;
  /// Whether an instant is in [begin, end] and not inside a pause.
  [[nodiscard]] bool covers(geodesy::GpsTime t) const;
  /// The same path with Pose::roll_rad and pitch_rad of this vehicle kind; yaw stays the direction of travel.
  [[nodiscard]] Trajectory with_attitude(Attitude attitude) const;
  /// Whether it is a SmoothMotion, or at rest: its acceleration is continuous.
  [[nodiscard]] bool smooth() const;
  /// Smooth poses over the same span: a SmoothMotion of `pose`, sampled every SmoothMotion::kStep_s. Headings
  /// below 1 m/s are held. The path differs from that of the poses by up to SmoothMotion::kVariance_s2 / 2
  /// times their acceleration.
  [[nodiscard]] Trajectory smoothed(const std::function<Pose(geodesy::GpsTime)>& pose) const;

 private:
  struct Track;
  std::shared_ptr<const Track> track_;
  Attitude attitude_ = Attitude::Level;
};

/// A recorded path, and its reader's report.
struct TrajectoryFile {
  Trajectory trajectory;
  bool is_dated = true;  ///< false: its times are relative to `start`
  ReadReport report;     ///< records left out, assumptions, and pauses
};
/// How to interpret heights of a file.
struct HeightReading {
  bool needed = true;  ///< false: terrain heights will replace them, and positions without a height are kept
  /// Added to heights above sea level if the file has no undulation [m]; 0: unknown, heights are ellipsoidal.
  double geoid_undulation_m = 0;
};
/// Maps a quantity of a path to its column's name in a CSV file, with its unit (csv_quantities()).
using TrajectoryColumns = std::map<std::string, std::string>;
/// A recorded path with times. `format`: one of trajectory_formats(); empty: detected from the file's content
/// (csv if it is none of the others). Readers of all formats: recorded_path.hpp. A record that is not valid
/// is left out, with a warning. Throws InputError with file and line if half of the records or more are not
/// valid, times mostly go backwards, or no line is usable. GpsTime{} as `start` means that none is known.
[[nodiscard]] TrajectoryFile read_trajectory_file(const std::filesystem::path& path,
                                                  const std::string& format, geodesy::GpsTime start,
                                                  const HeightReading& heights = {},
                                                  const TrajectoryColumns& columns = {});

/// The formats that read_trajectory_file() supports.
[[nodiscard]] const std::vector<std::string>& trajectory_formats();
/// The format of a file by its content. Throws InputError as GzipFile does.
[[nodiscard]] std::string trajectory_format_of(const std::filesystem::path& path);

}  // namespace canyon::simulation
