#include "canyon/simulation/motion/smooth_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"

namespace canyon::simulation {
namespace {

using Eigen::Vector3d;
using geodesy::Geodetic;
using geodesy::GpsTime;

constexpr double kShareOfLeg = 0.45;
constexpr double kTurnBack_rad = 170.0 / 180 * geodesy::kPi;
constexpr std::size_t kMostSamples = 10'000'000;
constexpr double kEarthRadius_m = 6.371e6;

/// East, north and height above the ellipsoid, so that level legs stay level however long they are.
class FlatFrame {
 public:
  explicit FlatFrame(const Geodetic& origin) : frame_(origin) {}

  [[nodiscard]] Vector3d flat(const Geodetic& place) const {
    const Vector3d local = frame_.local_from_geodetic(place);
    return {local.x(), local.y(), place.height_m};
  }
  [[nodiscard]] Geodetic place(const Vector3d& flat) const {
    const double dip_m = flat.head<2>().squaredNorm() / (2 * kEarthRadius_m);
    Geodetic place =
        frame_.geodetic_from_local({flat.x(), flat.y(), flat.z() - frame_.origin().height_m - dip_m});
    place.height_m = flat.z();
    return place;
  }

 private:
  geodesy::LocalFrame frame_;
};

/// A line (radius 0) or an arc with its speed limit.
struct Piece {
  Vector3d from, direction;            // direction: of travel at its beginning, unit
  Vector3d inward = Vector3d::Zero();  // towards the arc's middle, unit
  double radius_m = 0, length_m = 0;
  double limit_mps = 0;
  double begin_mps = 0, end_mps = 0;  // upper bounds until the passes have run
  double hold_s = 0;                  // at its end
  bool rest = false;                  // at its end

  [[nodiscard]] Vector3d at(double s) const {
    if (radius_m == 0) return from + s * direction;
    const double angle = s / radius_m;
    return from + radius_m * (std::sin(angle) * direction + (1 - std::cos(angle)) * inward);
  }
};

struct Stop {
  Vector3d at;
  double speed_mps;  // on the leg to it
  double hold_s;
};

/// Lines and arcs through the stops; neighbours at one place have been joined.
std::vector<Piece> make_pieces(const std::vector<Stop>& stops, double acceleration) {
  std::vector<Piece> pieces;
  Vector3d begin = stops.front().at;
  for (std::size_t i = 1; i < stops.size(); ++i) {
    const Vector3d leg = stops[i].at - stops[i - 1].at;
    const double length = leg.norm();
    const Vector3d along = leg / length;
    Piece line{begin, along};
    line.limit_mps = stops[i].speed_mps;
    line.hold_s = stops[i].hold_s;
    line.rest = stops[i].hold_s > 0 || i + 1 == stops.size();
    Piece arc;
    if (!line.rest) {
      const Vector3d next = stops[i + 1].at - stops[i].at;
      const Vector3d away = next.normalized();
      const double turn = std::atan2(along.cross(away).norm(), along.dot(away));
      if (turn > kTurnBack_rad) {
        line.rest = true;
      } else if (turn > 1e-9) {
        const double speed = std::min(stops[i].speed_mps, stops[i + 1].speed_mps);
        const double half = std::tan(turn / 2);
        const double cut =
            std::min(speed * speed / acceleration * half, kShareOfLeg * std::min(length, next.norm()));
        arc.radius_m = cut / half;
        arc.from = stops[i].at - cut * along;
        arc.direction = along;
        arc.inward = (away - away.dot(along) * along).normalized();
        arc.length_m = arc.radius_m * turn;
        arc.limit_mps = std::min(speed, std::sqrt(acceleration * arc.radius_m));
      }
    }
    const Vector3d end = arc.radius_m > 0 ? arc.from : stops[i].at;
    line.length_m = (end - begin).norm();
    pieces.push_back(line);
    begin = stops[i].at;
    if (arc.radius_m > 0) {
      begin = arc.at(arc.length_m);
      pieces.push_back(arc);
    }
  }
  return pieces;
}

/// The fastest speeds at the joints that limits and acceleration allow.
void set_speeds(std::vector<Piece>& pieces, double acceleration) {
  const auto reach = [acceleration](double speed, double way) {
    return std::sqrt(speed * speed + 2 * acceleration * way);
  };
  double speed = 0;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    Piece& p = pieces[i];
    p.begin_mps = speed;
    p.end_mps = i + 1 < pieces.size() ? std::min(p.limit_mps, pieces[i + 1].limit_mps) : 0;
    if (p.rest) p.end_mps = 0;
    p.end_mps = speed = std::min(p.end_mps, reach(p.begin_mps, p.length_m));
  }
  for (std::size_t i = pieces.size(); i-- > 0;) {
    Piece& p = pieces[i];
    if (i + 1 < pieces.size()) p.end_mps = std::min(p.end_mps, pieces[i + 1].begin_mps);
    p.begin_mps = std::min(p.begin_mps, reach(p.end_mps, p.length_m));
  }
}

/// Speeding up, holding, slowing down over one piece.
struct Profile {
  Profile(const Piece& piece, double acceleration) : a(acceleration), v0(piece.begin_mps) {
    const double v1 = piece.end_mps;
    top = std::min(piece.limit_mps, std::sqrt(a * piece.length_m + (v0 * v0 + v1 * v1) / 2));
    up_s = (top - v0) / a;
    up_m = (top * top - v0 * v0) / (2 * a);
    const double down_m = (top * top - v1 * v1) / (2 * a);
    cruise_s = std::max(0.0, piece.length_m - up_m - down_m) / top;
    total_s = up_s + cruise_s + (top - v1) / a;
  }
  [[nodiscard]] double way(double t) const {
    if (t < up_s) return (v0 + a * t / 2) * t;
    if (t < up_s + cruise_s) return up_m + top * (t - up_s);
    const double down = t - up_s - cruise_s;
    return up_m + top * cruise_s + (top - a * down / 2) * down;
  }

  double a, v0, top = 0, up_s = 0, up_m = 0, cruise_s = 0, total_s = 0;
};

std::vector<Stop> join(const std::vector<Waypoint>& waypoints, const FlatFrame& frame) {
  std::vector<Stop> stops;
  for (const Waypoint& waypoint : waypoints) {
    const Vector3d at = frame.flat(waypoint.place);
    if (!stops.empty() && (at - stops.back().at).norm() < 1e-6) {
      stops.back().hold_s += waypoint.hold_s;
    } else {
      stops.push_back({at, waypoint.speed_mps, waypoint.hold_s});
    }
  }
  return stops;
}

}  // namespace

std::vector<std::pair<GpsTime, Geodetic>> smooth_samples(GpsTime start,
                                                         const std::vector<Waypoint>& waypoints,
                                                         double acceleration_mps2) {
  if (!(acceleration_mps2 > 0) || !(acceleration_mps2 <= 100)) {
    throw InputError(fmt::format("acceleration_mps2: {} m/s^2 is out of range", acceleration_mps2),
                     "it is above 0 and at most 100 m/s^2");
  }
  const FlatFrame frame(waypoints.front().place);
  const std::vector<Stop> stops = join(waypoints, frame);
  std::vector<Piece> pieces = make_pieces(stops, acceleration_mps2);
  set_speeds(pieces, acceleration_mps2);

  std::vector<std::pair<GpsTime, Geodetic>> samples{{start, waypoints.front().place}};
  const auto add = [&](GpsTime t, const Vector3d& flat) {
    if (t <= samples.back().first) return;
    if (samples.size() == kMostSamples) {
      throw InputError(fmt::format("the drive is too long: more than {} samples", kMostSamples),
                       "leave acceleration_mps2 out, or cut the drive");
    }
    samples.emplace_back(t, frame.place(flat));
  };
  GpsTime begin = start + stops.front().hold_s;
  add(begin, stops.front().at);
  for (const Piece& piece : pieces) {
    const Profile profile(piece, acceleration_mps2);
    const auto steps = static_cast<std::int64_t>(std::ceil(profile.total_s / Trajectory::kSmooth_s));
    for (std::int64_t k = 1; k <= steps; ++k) {
      const double t = profile.total_s * static_cast<double>(k) / static_cast<double>(steps);
      add(begin + t, piece.at(k == steps ? piece.length_m : profile.way(t)));
    }
    begin = begin + profile.total_s;
    if (piece.hold_s == 0) continue;
    begin = begin + piece.hold_s;
    add(begin, piece.at(piece.length_m));
  }
  return samples;
}

}  // namespace canyon::simulation
