#pragma once

#include <Eigen/Core>
#include <map>
#include <set>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/read_report.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"

namespace canyon::orbit {

/// One position-and-clock record.
struct Sp3Record {
  geodesy::GpsTime t;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< ECEF of the instant
  double clock_bias_s = 0;                               ///< without the periodic relativity
  bool good_position = true;
  bool good_clock = true;
  /// Events since the record before, or at this one (flags M and E).
  bool maneuver = false, clock_event = false;
  int line = 0;
};

/// An SP3-c or SP3-d file ("The Extended Standard Product 3 Orbit Format", IGS 2016) as it is written.
struct Sp3File {
  std::vector<geodesy::GpsTime> epochs;                         ///< ascending
  std::map<gnss::SatelliteId, std::vector<Sp3Record>> records;  ///< ascending in time
  double step_s = 0;                                            ///< the most frequent one between epochs
  ReadReport report;
};

/// Reads the P records of `systems`. An epoch that does not follow the one before is left out, and told in
/// `report`, as damaged lines are. Throws InputError as PreciseSky says.
[[nodiscard]] Sp3File read_sp3(TextFile& file, const std::set<gnss::System>& systems);

/// A Kepler orbit with the secular rates of J2, for subtracting the bulk of a motion from tabulated
/// positions: what is left is kilometres instead of the orbit's size, and interpolates better by as much.
/// Axes do not rotate and have the Earth's pole as z.
class ReferenceOrbit {
 public:
  struct State {
    Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
    double true_anomaly_rad = 0;   ///< counted through revolutions; grows with time
    double true_anomaly_rate = 0;  ///< [rad/s]
  };

  /// Position and velocity are zero everywhere: it subtracts nothing. The anomaly is the time [h].
  ReferenceOrbit() = default;
  /// The orbit through a position [m] and velocity [m/s] at `epoch`; the default one where they give no
  /// ellipse with e < 0.9 above the Earth.
  ReferenceOrbit(geodesy::GpsTime epoch, const Eigen::Vector3d& position, const Eigen::Vector3d& velocity);

  [[nodiscard]] State at(geodesy::GpsTime t) const;

  /// Changes the mean motion by a factor, keeping the position at the epoch.
  void scale_mean_motion(double factor) { mean_motion_ *= factor; }

 private:
  geodesy::GpsTime epoch_;
  double semi_major_axis_ = 0;
  double eccentricity_ = 0;
  double mean_anomaly_ = 0;                             ///< at the epoch
  double mean_motion_ = 0;                              ///< [rad/s]
  double node_rate_ = 0;                                ///< [rad/s]
  double perigee_rate_ = 0;                             ///< [rad/s]
  Eigen::Matrix3d axes_ = Eigen::Matrix3d::Identity();  ///< perigee, along, normal at the epoch, as columns
};

}  // namespace canyon::orbit
