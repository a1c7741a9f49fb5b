#include "canyon/disturbance/course.hpp"

#include <algorithm>

#include "canyon/base/input_error.hpp"
#include "canyon/options/values.hpp"

namespace canyon::disturbance {

Eigen::Vector3d PlaceOptions::enu(const geodesy::LocalFrame& frame) const {
  if (east_m) return {*east_m, *north_m, *up_m};
  return frame.local_from_geodetic(geodesy::Geodetic::from_degrees(*latitude_deg, *longitude_deg, *height_m));
}

void PlaceOptions::validate() const {
  const int global = latitude_deg.has_value() + longitude_deg.has_value() + height_m.has_value();
  const int local = east_m.has_value() + north_m.has_value() + up_m.has_value();
  if ((global == 3 && local == 0) || (global == 0 && local == 3)) return;
  throw InputError("a place lacks coordinates",
                   "give latitude_deg, longitude_deg and height_m, or east_m, north_m and up_m");
}

void visit(options::Visitor& v, PlaceOptions& o) {
  if (v.wants(v.reads() || o.latitude_deg)) {
    v.number({"latitude_deg", "deg", "geodetic latitude (WGS 84)", "by east_m"}, o.latitude_deg, {-90, 90});
    v.number({"longitude_deg", "deg", "longitude, east positive", "by east_m"}, o.longitude_deg, {-180, 360});
    v.number({"height_m", "m", "ellipsoidal height", "by up_m"}, o.height_m, {-1000, 1e5});
  }
  if (v.wants(v.reads() || o.east_m)) {
    v.number(
        {"east_m", "m", "east of the city's origin, instead of latitude and longitude", "by latitude_deg"},
        o.east_m, {-1e6, 1e6});
    v.number({"north_m", "m", "north of the city's origin", "by latitude_deg"}, o.north_m, {-1e6, 1e6});
    v.number({"up_m", "m", "above the city's origin", "by latitude_deg"}, o.up_m, {-1e5, 1e5});
  }
}

void CourseOptions::validate() const {
  options::check(*this, "course");
  if (position.given() && !waypoints.empty()) {
    throw InputError("position and waypoints are both given", "give one of them");
  }
  if (position.given()) position.validate();
  for (const PlaceOptions& each : waypoints) each.validate();
}

void visit(options::Visitor& v, CourseOptions& o) {
  v.one_of({"position", "waypoints"});
  if (v.wants(v.reads() || o.position.given())) v.part("position", o.position);
  if (!v.wants(v.reads() || !o.waypoints.empty())) return;
  v.list("waypoints", o.waypoints, [&](PlaceOptions& each) {
    visit(v, each);
    v.validate(each);
  });
  v.number({"speed_mps", "m/s", "speed between waypoints"}, o.speed_mps, {0, 1e4, true});
}

Course::Course(const CourseOptions& options, const geodesy::LocalFrame& frame, geodesy::GpsTime begin)
    : speed_mps_(options.speed_mps), begin_(begin) {
  options.validate();
  if (!options.given()) throw InputError("a place is missing", "give position or waypoints");
  if (options.position.given()) points_.push_back(options.position.enu(frame));
  for (const PlaceOptions& each : options.waypoints) points_.push_back(each.enu(frame));
}

Eigen::Vector3d Course::at(geodesy::GpsTime time) const {
  double left_m = std::max(0.0, time - begin_) * speed_mps_;
  for (std::size_t i = 1; i < points_.size(); ++i) {
    const double leg_m = (points_[i] - points_[i - 1]).norm();
    if (left_m < leg_m) return points_[i - 1] + left_m / leg_m * (points_[i] - points_[i - 1]);
    left_m -= leg_m;
  }
  return points_.back();
}

}  // namespace canyon::disturbance
