#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "canyon/geodesy/frames.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/options/fwd.hpp"

namespace canyon::disturbance {

/// A place, by latitude, longitude and ellipsoidal height, or by east, north and up of the city's origin.
struct PlaceOptions {
  std::optional<double> latitude_deg, longitude_deg, height_m;
  std::optional<double> east_m, north_m, up_m;

  [[nodiscard]] bool given() const { return latitude_deg || east_m; }
  /// Position in the city's frame [m]. @param frame of the city
  [[nodiscard]] Eigen::Vector3d enu(const geodesy::LocalFrame& frame) const;
  /// Throws InputError where it is neither or both, or half of one.
  void validate() const;
};
void visit(options::Visitor& v, PlaceOptions& o);

/// Place or drive of an object, as trajectories are written: one place, or straight legs at one speed.
struct CourseOptions {
  PlaceOptions position;
  std::vector<PlaceOptions> waypoints;  ///< instead of a position
  double speed_mps = 10;                ///< between waypoints, (0, 1e4]

  [[nodiscard]] bool given() const { return position.given() || !waypoints.empty(); }
  void validate() const;
};
void visit(options::Visitor& v, CourseOptions& o);

/// A course in the city's frame. It begins at an instant, and ends where its last leg does.
class Course {
 public:
  /// @param options that are given(); @param frame of the city
  Course(const CourseOptions& options, const geodesy::LocalFrame& frame, geodesy::GpsTime begin);

  /// [m] in the city's frame.
  [[nodiscard]] Eigen::Vector3d at(geodesy::GpsTime time) const;

 private:
  std::vector<Eigen::Vector3d> points_;
  double speed_mps_;
  geodesy::GpsTime begin_;
};

}  // namespace canyon::disturbance
