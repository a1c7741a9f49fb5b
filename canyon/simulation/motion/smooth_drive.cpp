#include "canyon/simulation/motion/smooth_drive.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::simulation {
namespace {

using Eigen::Vector3d;
using geodesy::Geodetic;
using geodesy::GpsTime;

constexpr double kFractionOfLeg = 0.45;
constexpr double kReversal_rad = 170.0 / 180 * geodesy::kPi;
constexpr std::size_t kMaxPoints = 10'000'000;
constexpr double kLevel = 1e-3;         // directions with a smaller horizontal part have no heading
constexpr double kOnTheSpot_radps = 1;  // rotation rate at rest
constexpr double kEarthRadius_m = 6.371e6;

/// East, north and height above the ellipsoid, so that level legs stay level however long they are.
class FlatFrame {
 public:
  explicit FlatFrame(const Geodetic& origin) : frame_(origin) {}

  [[nodiscard]] Vector3d flat(const Geodetic& position) const {
    const Vector3d local = frame_.local_from_geodetic(position);
    return {local.x(), local.y(), position.height_m};
  }
  /// In the local frame of the origin.
  [[nodiscard]] Vector3d local(const Vector3d& flat) const {
    const double dip_m = flat.head<2>().squaredNorm() / (2 * kEarthRadius_m);
    Geodetic position =
        frame_.geodetic_from_local({flat.x(), flat.y(), flat.z() - frame_.origin().height_m - dip_m});
    position.height_m = flat.z();
    return frame_.local_from_geodetic(position);
  }

 private:
  geodesy::LocalFrame frame_;
};

struct Stop {
  Vector3d at;
  double speed_mps;  // on the leg to it
  double hold_s;
};

/// How a drive passes a stop: it rests there, or continues on an arc that touches both legs.
struct Corner {
  bool rest = false;
  double speed_mps = 0;            // constant on the arc; an upper bound until set_speeds() has run
  double cut_m = 0, radius_m = 0;  // on each leg, of the arc; 0: straight on
  double rotation_rad = 0;
  Vector3d inward = Vector3d::Zero();  // towards the arc's centre, unit
};

/// A line at a changing speed, or an arc at a constant one.
struct Piece {
  Vector3d from, direction;            // direction of travel at its start, unit
  Vector3d inward = Vector3d::Zero();  // towards the arc's centre, unit
  double radius_m = 0, length_m = 0;
  // Accelerates to `top_mps`, holds it, brakes.
  double begin_mps = 0, top_mps = 0, end_mps = 0, acceleration = 1;
  double begin_s = 0;  // since the start of its ride
  double begin_yaw_rad = 0;

  [[nodiscard]] double up_s() const { return (top_mps - begin_mps) / acceleration; }
  [[nodiscard]] double down_s() const { return (top_mps - end_mps) / acceleration; }
  [[nodiscard]] double cruise_s() const {
    const double up_m = (begin_mps + top_mps) / 2 * up_s(), down_m = (top_mps + end_mps) / 2 * down_s();
    return std::max(0.0, length_m - up_m - down_m) / top_mps;
  }
  [[nodiscard]] double duration_s() const { return up_s() + cruise_s() + down_s(); }
  /// Distance travelled after `t` seconds [m].
  [[nodiscard]] double travelled_m(double t) const {
    if (t < up_s()) return (begin_mps + acceleration * t / 2) * t;
    const double up_m = (begin_mps + top_mps) / 2 * up_s(), cruising = t - up_s();
    if (cruising < cruise_s()) return up_m + top_mps * cruising;
    const double down = std::min(t, duration_s()) - up_s() - cruise_s();
    return up_m + top_mps * cruise_s() + (top_mps - acceleration * down / 2) * down;
  }
  [[nodiscard]] Vector3d at(double s) const {
    if (radius_m == 0) return from + s * direction;
    const double angle = s / radius_m;
    return from + radius_m * (std::sin(angle) * direction + (1 - std::cos(angle)) * inward);
  }
  [[nodiscard]] double yaw_rad(double s) const {
    const double angle = radius_m > 0 ? s / radius_m : 0;
    return heading(std::cos(angle) * direction + std::sin(angle) * inward, begin_yaw_rad);
  }
  /// The heading of a direction, within half a turn of `near`; `near` itself if it has none.
  [[nodiscard]] static double heading(const Vector3d& direction, double near) {
    if (direction.head<2>().norm() < kLevel) return near;
    return near + std::remainder(std::atan2(direction.y(), direction.x()) - near, 2 * geodesy::kPi);
  }
};

/// Pieces between two rests.
struct Ride {
  std::vector<Piece> pieces;
  double begin_yaw_rad = 0;  // it first rotates at rest
  double hold_s = 0;         // rest after it

  [[nodiscard]] double duration_s() const { return pieces.back().begin_s + pieces.back().duration_s(); }
  [[nodiscard]] MotionKnot at(double t) const {
    const Piece& first = pieces.front();
    if (t < first.begin_s) {
      const double rotated = std::max(0.0, t / first.begin_s);
      return {first.from, begin_yaw_rad + rotated * (first.begin_yaw_rad - begin_yaw_rad)};
    }
    const auto after = std::upper_bound(pieces.begin(), pieces.end(), t,
                                        [](double s, const Piece& piece) { return s < piece.begin_s; });
    const Piece& piece = *std::prev(after);
    const double travelled_m = piece.travelled_m(t - piece.begin_s);
    return {piece.at(travelled_m), piece.yaw_rad(travelled_m)};
  }
};

std::vector<Corner> make_corners(const std::vector<Stop>& stops, double acceleration) {
  std::vector<Corner> corners(stops.size());
  corners.front().rest = corners.back().rest = true;
  for (std::size_t i = 1; i + 1 < stops.size(); ++i) {
    Corner& corner = corners[i];
    const Vector3d leg = stops[i].at - stops[i - 1].at, next = stops[i + 1].at - stops[i].at;
    const Vector3d along = leg.normalized(), away = next.normalized();
    corner.rotation_rad = std::atan2(along.cross(away).norm(), along.dot(away));
    corner.rest = stops[i].hold_s > 0 || corner.rotation_rad > kReversal_rad;
    if (corner.rest) continue;
    corner.speed_mps = std::min(stops[i].speed_mps, stops[i + 1].speed_mps);
    if (corner.rotation_rad < 1e-9) continue;
    const double half = std::tan(corner.rotation_rad / 2);
    corner.cut_m = std::min(corner.speed_mps * corner.speed_mps / acceleration * half,
                            kFractionOfLeg * std::min(leg.norm(), next.norm()));
    corner.radius_m = corner.cut_m / half;
    corner.inward = (away - away.dot(along) * along).normalized();
    corner.speed_mps = std::min(corner.speed_mps, std::sqrt(acceleration * corner.radius_m));
  }
  return corners;
}

/// Length of the line to a stop, without the parts replaced by arcs at both ends [m].
double line_m(const std::vector<Stop>& stops, const std::vector<Corner>& corners, std::size_t to) {
  return (stops[to].at - stops[to - 1].at).norm() - corners[to - 1].cut_m - corners[to].cut_m;
}

/// The fastest speeds at the corners that limits and acceleration allow.
void set_speeds(const std::vector<Stop>& stops, std::vector<Corner>& corners, double acceleration) {
  const auto reach = [&](double speed, std::size_t to) {
    return std::sqrt(speed * speed + 2 * acceleration * line_m(stops, corners, to));
  };
  for (std::size_t i = 1; i < corners.size(); ++i)
    corners[i].speed_mps = std::min(corners[i].speed_mps, reach(corners[i - 1].speed_mps, i));
  for (std::size_t i = corners.size() - 1; i-- > 0;)
    corners[i].speed_mps = std::min(corners[i].speed_mps, reach(corners[i + 1].speed_mps, i + 1));
}

std::vector<Ride> make_rides(const std::vector<Stop>& stops, double acceleration) {
  std::vector<Corner> corners = make_corners(stops, acceleration);
  set_speeds(stops, corners, acceleration);
  std::vector<Ride> rides;
  bool begins = true;
  double yaw = 0;
  for (std::size_t i = 1; i < stops.size(); ++i) {
    const Corner &before = corners[i - 1], &corner = corners[i];
    const Vector3d along = (stops[i].at - stops[i - 1].at).normalized();
    Piece line{stops[i - 1].at + before.cut_m * along, along};
    line.length_m = line_m(stops, corners, i);
    line.acceleration = acceleration;
    line.begin_mps = before.speed_mps;
    line.end_mps = corner.speed_mps;
    line.top_mps = std::min(stops[i].speed_mps,
                            std::sqrt(acceleration * line.length_m +
                                      (line.begin_mps * line.begin_mps + line.end_mps * line.end_mps) / 2));
    line.begin_yaw_rad = Piece::heading(along, yaw);
    if (begins) {
      if (rides.empty()) yaw = line.begin_yaw_rad;
      line.begin_s = std::abs(line.begin_yaw_rad - yaw) / kOnTheSpot_radps;
      rides.emplace_back().begin_yaw_rad = yaw;
    } else {
      line.begin_s = rides.back().duration_s();
    }
    yaw = line.begin_yaw_rad;
    std::vector<Piece>& pieces = rides.back().pieces;
    pieces.push_back(line);
    if (corner.radius_m > 0) {
      Piece arc{stops[i].at - corner.cut_m * along, along, corner.inward, corner.radius_m};
      arc.length_m = corner.radius_m * corner.rotation_rad;
      arc.begin_mps = arc.top_mps = arc.end_mps = corner.speed_mps;
      arc.begin_s = rides.back().duration_s();
      arc.begin_yaw_rad = yaw;
      pieces.push_back(arc);
      yaw = arc.yaw_rad(arc.length_m);
    }
    begins = corner.rest;
    if (corner.rest) rides.back().hold_s = stops[i].hold_s;
  }
  return rides;
}

std::vector<Stop> join(const std::vector<Waypoint>& waypoints, const FlatFrame& frame) {
  std::vector<Stop> stops;
  for (const Waypoint& waypoint : waypoints) {
    const Vector3d at = frame.flat(waypoint.position);
    if (!stops.empty() && (at - stops.back().at).norm() < 1e-6)
      stops.back().hold_s += waypoint.hold_s;
    else
      stops.push_back({at, waypoint.speed_mps, waypoint.hold_s});
  }
  return stops;
}

}  // namespace

SmoothDrive smooth_drive(const std::vector<Waypoint>& waypoints, double acceleration_mps2) {
  if (!(acceleration_mps2 > 0) || !(acceleration_mps2 <= 100)) {
    throw InputError(fmt::format("acceleration_mps2: {} m/s^2 is out of range", acceleration_mps2),
                     "give a value above 0, at most 100 m/s^2");
  }
  const FlatFrame frame(waypoints.front().position);
  const std::vector<Stop> stops = join(waypoints, frame);
  SmoothDrive drive;
  drive.duration_s = stops.front().hold_s;
  for (const Ride& ride : make_rides(stops, acceleration_mps2)) {
    const double duration_s = ride.duration_s();
    constexpr double kMax_s = static_cast<double>(kMaxPoints) * SmoothMotion::kStep_s;
    if (!(duration_s < kMax_s - static_cast<double>(drive.motion.points()) * SmoothMotion::kStep_s)) {
      throw InputError(fmt::format("the drive is too long: it moves for more than {:.0f} s", kMax_s),
                       "leave acceleration_mps2 out, or shorten the drive");
    }
    drive.motion.add(drive.duration_s, duration_s, [&](double t) {
      MotionKnot knot = ride.at(t);
      knot.position = frame.local(knot.position);
      return knot;
    });
    drive.duration_s = drive.motion.end_s() + ride.hold_s;
    for (const Piece& piece : ride.pieces) drive.length_m += piece.length_m;
  }
  return drive;
}

}  // namespace canyon::simulation
