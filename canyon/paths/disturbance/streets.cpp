#include "canyon/paths/disturbance/streets.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/random.hpp"
#include "canyon/base/text.hpp"

namespace canyon::disturbance {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using propagation::Path;
using propagation::PathKind;

constexpr double kWavelength_m = geodesy::kSpeedOfLight / 1575.42e6;
// The largest vehicle, and the gap of 2 m of TR 37.885 6.1.2. Up to 0.3 m more, random for each lane: else
// the travel in a cycle of lights may be a whole number of slots, and every red light has the same scene.
constexpr double kVehicleSlot_m = 15, kGap_m = 2, kMoreSlot_m = 0.3;
// Distance from the antenna to the vehicles before and behind it: half of a car and the gap.
constexpr double kOwn_m = 2.5 + kGap_m;
constexpr double kTurnover_m = 300;
constexpr double kOvertaking = 0.1;
constexpr double kLane_m = 3.3, kPavement_m = 3;
// Weaker reflections are omitted: 26 dB below those of an endless wall.
constexpr double kMinReflection = 0.05;
// Paths with less of their amplitude left are removed: 40 dB.
constexpr double kMinLeft = 0.01;
constexpr double kAntennaMargin_m = 0.3;

// Hash salts of the rows.
enum RowName : std::uint64_t {
  kLane = 1,
  kOncoming = 101,
  kTrees = 201,
  kSigns,
  kAwnings,
  kBridges,
  kAzimuth
};

std::uint64_t mixed(std::uint64_t hash, std::uint64_t word) {
  return mix64(hash + kGolden64 + mix64(word));
}
double unit(std::uint64_t hash) {
  return static_cast<double>(hash >> 11) * 0x1.0p-53;
}

}  // namespace

struct Street::Frame {
  geodesy::GpsTime time;
  double along_m;
  double ground_m;
  const Road* road;  // null: straight on
  Vector2d point, ahead;

  [[nodiscard]] Road::Point at(double along) const {
    if (road != nullptr) return road->at(along);
    return {point + (along - along_m) * ahead, ahead};
  }
};

/// Adds a row of bodies. `make` sets a body except for its pose, and returns its length along the road.
struct Street::Row {
  std::uint64_t name;
  double left_m;  // of the vehicle's lane, its middle
  double slot_m, per_km;
  double moved_m = 0;  // of the whole row along the road
  double hole_m = 0;   // slots begin at this distance from the row's zero, on both sides
  double (*make)(const Street& street, std::uint64_t draw, Body& body);
};

Street::Street(const StreetOptions& options, std::uint64_t seed)
    : options_(options), numbers_(street_numbers(options)), seed_(mixed(seed, fnv1a("streets"))) {
  options_.validate();
  vehicle_lane_ = static_cast<int>(unit(mixed(seed_, 0)) * numbers_.lanes);
  const double azimuth_rad = options_.azimuth_deg ? geodesy::radians(*options_.azimuth_deg)
                                                  : 2 * geodesy::kPi * unit(mixed(seed_, kAzimuth));
  heading_at_rest_ = {std::sin(azimuth_rad), std::cos(azimuth_rad)};
}

double Street::travelled_m(geodesy::GpsTime time, std::uint64_t direction) const {
  const double cycle = options_.cycle_s, green = cycle - options_.red_s;
  const double t = (time - geodesy::GpsTime{}) + cycle * unit(mixed(seed_, direction));
  const double cycles = std::floor(t / cycle);
  return numbers_.speed_mps * (cycles * green + std::min(t - cycles * cycle, green));
}

void Street::fill(const Frame& frame, const Row& row, std::vector<Body>& bodies) const {
  const double taken = row.per_km * row.slot_m * 1e-3;
  if (!(taken > 0)) return;
  // Both halves of a row with a hole begin at the hole.
  const double zero = frame.along_m - row.moved_m;
  const auto slot_of = [&](double x) {
    const double from_hole = row.hole_m > 0 ? (x >= 0 ? x - row.hole_m : x + row.hole_m) : x;
    return static_cast<std::int64_t>(std::floor(from_hole / row.slot_m));
  };
  for (std::int64_t i = slot_of(zero - kReach_m); i <= slot_of(zero + kReach_m); ++i) {
    const std::uint64_t hash = mixed(mixed(seed_, row.name), static_cast<std::uint64_t>(i));
    if (unit(mixed(hash, 1)) >= taken) continue;
    Body body;
    body.name = hash;
    const double length = row.make(*this, mixed(hash, 2), body);
    const double begin = static_cast<double>(i) * row.slot_m + (i < 0 ? -row.hole_m : row.hole_m);
    const double within = unit(mixed(hash, 3)) * std::max(0.0, row.slot_m - length);
    const double along = row.moved_m + begin + within + length / 2;
    if (std::abs(along - frame.along_m) > kReach_m) continue;
    const Road::Point point = frame.at(along);
    body.ahead = point.ahead;
    body.centre = point.point + row.left_m * Vector2d(-point.ahead.y(), point.ahead.x());
    body.bottom_m += frame.ground_m;
    body.top_m += frame.ground_m;
    bodies.push_back(body);
  }
}

void Street::lanes(const Frame& frame, std::vector<Body>& bodies) const {
  const auto vehicle = [](const Street& street, std::uint64_t draw, Body& body) {
    const auto& fractions = street.numbers_.weights;
    const auto sampled = std::upper_bound(fractions.begin(), fractions.end() - 1, unit(draw));
    const VehicleClass& kind = vehicle_classes()[static_cast<std::size_t>(sampled - fractions.begin())];
    body.half_length_m = kind.length_m / 2;
    body.half_width_m = kind.width_m / 2;
    body.top_m = kind.height_m;
    body.sill_m = kind.sill_m;
    return kind.length_m + kGap_m;
  };
  // The middle of the road is to the left if vehicles drive on the right.
  const double middle = numbers_.left ? -1 : 1;
  const bool moves = frame.road != nullptr;
  const auto row = [&](std::uint64_t name, double left_m, double moved_m, double hole_m) {
    const double slot_m = kVehicleSlot_m + kMoreSlot_m * unit(mixed(seed_, name));
    fill(frame, {name, left_m, slot_m, numbers_.vehicles_per_km, moved_m, hole_m, vehicle}, bodies);
  };
  for (int lane = 0; lane < numbers_.lanes; ++lane) {
    const auto index = static_cast<std::uint64_t>(lane);
    const double left_m = middle * kLane_m * (vehicle_lane_ - lane);
    if (lane != vehicle_lane_) {
      row(kLane + index, left_m,
          moves ? frame.along_m * (1 + kOvertaking * (vehicle_lane_ - lane)) : travelled_m(frame.time, kLane),
          0);
    } else if (moves) {
      const auto stretch = static_cast<std::uint64_t>(std::floor(frame.along_m / kTurnover_m));
      row(mixed(kLane + index, stretch), left_m, frame.along_m, kOwn_m);
    }
    row(kOncoming + index, middle * kLane_m * (vehicle_lane_ + 1 + lane), -travelled_m(frame.time, kOncoming),
        0);
  }
}

void Street::furniture(const Frame& frame, std::vector<Body>& bodies) const {
  const double middle = numbers_.left ? -1 : 1;
  // Kerbs: of the antenna's side, and of the other side.
  const double near_m = -middle * kLane_m * (numbers_.lanes - vehicle_lane_ - 0.5);
  const double far_m = middle * kLane_m * (numbers_.lanes + vehicle_lane_ + 0.5);
  const auto tree = [](const Street&, std::uint64_t draw, Body& body) {
    // Crowns of 4 to 7 m, from 3 m up.
    const double radius = 2 + 1.5 * unit(draw);
    body.kind = Body::Kind::Crown;
    body.half_length_m = body.half_width_m = radius;
    body.bottom_m = 3;
    body.top_m = 3 + 2 * radius;
    return 2 * radius;
  };
  const auto sign = [](const Street&, std::uint64_t draw, Body& body) {
    // A structure across the road, 2 to 4 m wide and 1 to 4 m high, 5.8 m clear of it.
    body.kind = Body::Kind::Structure;
    body.half_length_m = 0.15;
    body.half_width_m = 1 + unit(draw);
    body.bottom_m = 5.8;
    body.top_m = 5.8 + 1 + 3 * unit(mixed(draw, 1));
    body.grounded = false;
    return 0.3;
  };
  const auto awning = [](const Street&, std::uint64_t draw, Body& body) {
    // A structure over a pavement, 3 to 8 m long, at the facade.
    body.kind = Body::Kind::Structure;
    body.half_length_m = 1.5 + 2.5 * unit(draw);
    body.half_width_m = kPavement_m / 4;
    body.bottom_m = 2.8;
    body.top_m = 3.1;
    body.grounded = false;
    return 2 * body.half_length_m;
  };
  for (const double side : {-1.0, 1.0}) {
    const bool own = side == (numbers_.left ? 1 : -1);
    const double kerb = own ? near_m : far_m;
    const std::uint64_t key = own ? 0 : 1000;
    fill(frame, {kTrees + key, kerb + side * 1.0, 5, std::min(200.0, numbers_.trees_per_km), 0, 0, tree},
         bodies);
    fill(frame, {kSigns + key, kerb - side * 1.0, 5, numbers_.signs_per_km, 0, 0, sign}, bodies);
    fill(frame, {kAwnings + key, kerb + side * 0.75 * kPavement_m, 5, numbers_.awnings_per_km, 0, 0, awning},
         bodies);
  }
  const auto bridge = [](const Street& street, std::uint64_t draw, Body& body) {
    // A closed deck from facade to facade.
    body.kind = Body::Kind::Structure;
    body.half_length_m = 1.5 + unit(draw);
    body.half_width_m = kLane_m * street.numbers_.lanes + kPavement_m;
    body.bottom_m = 5.5;
    body.top_m = 8.5;
    body.grounded = false;
    return 2 * body.half_length_m;
  };
  fill(frame, {kBridges, (near_m + far_m) / 2, 50, numbers_.footbridges_per_km, 0, 0, bridge}, bodies);
}

void Street::near(geodesy::GpsTime time, const Road* road, const Vector3d& antenna, double above_point_m,
                  std::vector<Body>& bodies) const {
  bodies.clear();
  Frame frame{time,
              0,
              antenna.z() - above_point_m - numbers_.antenna_height_m,
              nullptr,
              antenna.head<2>(),
              heading_at_rest_};
  if (road != nullptr && road->leads()) {
    frame.road = road;
    frame.along_m = road->along_m(time);
  } else {
    if (road != nullptr && road->facing() && !options_.azimuth_deg) frame.ahead = *road->facing();
    // Positions along one street have a common origin.
    frame.along_m = frame.point.dot(frame.ahead);
  }
  lanes(frame, bodies);
  furniture(frame, bodies);
}

Streets::Streets(const StreetsOptions& options, std::uint64_t seed)
    : options_(options), street_(options.street, seed) {}

void Streets::pass(const Vector3d& antenna, propagation::SatelliteView& view, const Vector3d& satellite) {
  std::vector<Path>& paths = view.paths.paths;
  const bool direct =
      std::any_of(paths.begin(), paths.end(), [](const Path& path) { return path.kind == PathKind::Direct; });
  std::size_t mirrored = paths.size();
  std::vector<std::uint64_t> body_ids;  // of the paths in front of `mirrored`
  if (direct) {
    const double least = options_.strength ? kMinReflection : 0;
    for (const Body& body : bodies_) {
      if (body.kind != Body::Kind::Vehicle) continue;
      for (int side = 0; side < 4; ++side) {
        auto path = side_reflection(body, side, antenna, satellite, kWavelength_m, least);
        if (!path) continue;
        // Without signal strength, a path is kept or removed.
        if (!options_.strength && !body.holds(path->point, 1e-6)) continue;
        if (!options_.strength) path->amplitude_factor = 1;
        paths.push_back(*std::move(path));
        body_ids.push_back(body.name);
      }
    }
  }
  for (std::size_t i = 0; i < paths.size(); ++i) {
    Path& path = paths[i];
    const bool from_satellite = path.kind == PathKind::Direct;
    const double leg_m =
        from_satellite ? std::numeric_limits<double>::infinity() : (path.point - antenna).norm();
    const SightLine sight(antenna, path.arrival, leg_m);
    double left = 1, detour_m = 0;
    std::uint64_t cut_by = 0;
    for (const Body& body : bodies_) {
      if (i >= mirrored && body_ids[i - mirrored] == body.name) continue;
      if (body.kind == Body::Kind::Crown) {
        path.foliage_depth_m += crown_depth_m(body, antenna, path.arrival, leg_m);
        continue;
      }
      const Blockage shaded = blockage(body, sight, kWavelength_m);
      if (shaded.cuts && !options_.strength) left = 0;
      left *= shaded.amplitude;
      if (!shaded.cuts) continue;
      cut_by = body.name;
      detour_m = std::max(detour_m, shaded.detour_m);
    }
    if (options_.strength || left == 0) path.amplitude_factor *= left;
    if (cut_by == 0 || !from_satellite) continue;
    path.kind = PathKind::Diffracted;
    path.excess_m += detour_m;
    path.point = antenna + satellite;  // its edge is some metres away in the satellite's direction
    path.reflector = propagation::reflector_id(
        path.kind, {static_cast<std::uint32_t>(cut_by >> 32), static_cast<std::uint32_t>(cut_by)});
  }
  std::erase_if(paths, [](const Path& path) { return path.amplitude_factor < kMinLeft; });
}

void Streets::apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) {
  if (arrival.containment != raytrace::Containment::Free) return;
  const Vector3d& point = arrival.antenna_enu;
  street_.near(antenna.time, options_.road.get(), point, options_.above_point_m, bodies_);
  std::erase_if(bodies_, [&](const Body& body) {
    return body.kind != Body::Kind::Crown && body.holds(point, kAntennaMargin_m);
  });
  arrival.bodies.insert(arrival.bodies.end(), bodies_.begin(), bodies_.end());
  for (propagation::SatelliteView& view : arrival.views) {
    if (view.paths.paths.empty()) continue;
    pass(point, view, (arrival.ecef_from_enu.transpose() * view.line.direction_ecef).normalized());
  }
}

DisturbanceSource streets_source(const StreetsOptions& options) {
  return {
      "streets: " + options::exact_text(options.street),
      [options](std::uint64_t seed, const std::string&) { return std::make_unique<Streets>(options, seed); }};
}

namespace {

// The direction between closer points is jitter.
constexpr double kStep_m = 3;
// The direction is that of the chord this far to both sides.
constexpr double kChord_m = 5;

}  // namespace

void Road::add(geodesy::GpsTime time, const Eigen::Vector2d& point) {
  if (!knots_.empty() && time <= knots_.back().time) return;
  if (vertices_.empty()) vertices_.push_back({0, point});
  const Vertex& last = vertices_.back();
  const double along_m = last.along_m + (point - last.point).norm();
  if (along_m - last.along_m >= kStep_m) vertices_.push_back({along_m, point});
  // A stationary vehicle keeps its position: jitter does not move the objects around it.
  knots_.push_back({time, knots_.empty() ? along_m : std::max(along_m, knots_.back().along_m)});
}

void Road::clear() {
  vertices_.clear();
  knots_.clear();
  facing_.reset();
}

double Road::along_m(geodesy::GpsTime time) const {
  if (knots_.empty()) return 0;
  const auto after = std::lower_bound(knots_.begin(), knots_.end(), time,
                                      [](const Knot& knot, geodesy::GpsTime t) { return knot.time < t; });
  if (after == knots_.begin()) return knots_.front().along_m;
  if (after == knots_.end()) return knots_.back().along_m;
  const Knot &a = *(after - 1), &b = *after;
  return a.along_m + (b.along_m - a.along_m) * ((time - a.time) / (b.time - a.time));
}

Eigen::Vector2d Road::point_at(double along_m) const {
  auto b = std::lower_bound(vertices_.begin() + 1, vertices_.end() - 1, along_m,
                            [](const Vertex& vertex, double along) { return vertex.along_m < along; });
  const Vertex& a = *(b - 1);
  return a.point + (b->point - a.point) * ((along_m - a.along_m) / (b->along_m - a.along_m));
}

Road::Point Road::at(double along_m) const {
  assert(leads());
  Point point{point_at(along_m), {}};
  point.ahead = point_at(along_m + kChord_m) - point_at(along_m - kChord_m);
  // The vehicle made a U-turn within the chord.
  if (point.ahead.norm() < 0.1 * kChord_m) point.ahead = point_at(along_m + 0.5) - point_at(along_m - 0.5);
  const double length = point.ahead.norm();
  point.ahead = length > 0 ? Eigen::Vector2d(point.ahead / length) : Eigen::Vector2d::UnitX();
  return point;
}

}  // namespace canyon::disturbance
