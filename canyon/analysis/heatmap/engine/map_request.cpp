#include "canyon/analysis/heatmap/engine/map_request.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::heatmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using geodesy::GpsTime;

constexpr std::size_t kMaxTimes = 100'000;
/// Rays are exact within this distance of a city (RayScene).
constexpr double kFarFromCity_m = 10'000;
/// Width of bare terrain around the buildings that belongs to a city's map.
constexpr double kRim_m = 150;

/// A step in seconds or with a unit: "90", "90s", "15min", "2h".
double parse_step(std::string_view text) {
  std::string_view number = trim(text);
  double unit_s = 1;
  const auto ends_in = [&](std::string_view unit, double seconds) {
    if (number.size() <= unit.size() || number.substr(number.size() - unit.size()) != unit) return false;
    number.remove_suffix(unit.size());
    unit_s = seconds;
    return true;
  };
  if (!ends_in("min", 60) && !ends_in("h", 3600)) (void)ends_in("s", 1);
  const std::optional<double> value = parse_double(number);
  const double seconds = value.value_or(0) * unit_s;
  if (!value || !(seconds >= 0.001 && seconds <= 1e7)) {
    throw InputError(fmt::format("'{}' is not a valid step", text),
                     "give seconds, or a number followed by s, min or h, e.g. 15min; at least 1 ms");
  }
  return seconds;
}

GpsTime parse_moment(std::string_view text, std::optional<GpsTime> start) {
  const std::optional<double> seconds = parse_double(text);
  if (!seconds) return geodesy::parse_simulated_time(trim(text));
  if (!start) {
    throw InputError(fmt::format("'{}' counts from a start, but there is none", text),
                     "add start to the scenario, or give instants, e.g. 2026-03-01T10:00:00Z");
  }
  if (!(std::abs(*seconds) <= 1e8)) {
    throw InputError(fmt::format("'{}' is not a valid time", text),
                     "give an instant, or seconds from the start");
  }
  return *start + *seconds;
}

/// from, from + step and so on, while before `end` (or at it, if `included`).
std::vector<GpsTime> time_range(GpsTime from, GpsTime end, double step_s, bool included) {
  if (end < from) {
    throw InputError(fmt::format("the end {} is before the begin {}", geodesy::format_utc(end, 0),
                                 geodesy::format_utc(from, 0)),
                     "give START/END/STEP with START first");
  }
  // The end is included if a step is on it up to rounding.
  const double steps = (end - from) / step_s;
  const double count = included ? std::floor(steps + 1e-6) + 1 : std::max(1.0, std::ceil(steps - 1e-6));
  if (count > static_cast<double>(kMaxTimes)) {
    throw InputError(fmt::format("a step of {} s gives {:.0f} times", step_s, count),
                     fmt::format("use a longer step: at most {} times are computed in one map", kMaxTimes));
  }
  std::vector<GpsTime> times;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
    times.push_back(from + step_s * static_cast<double>(i));
  return times;
}

/// FNV-1a over whole arrays, a chunk at a time.
class Hash {
 public:
  template <class T>
  void add(const T* values, std::size_t count) {
    const char* bytes = reinterpret_cast<const char*>(values);
    std::size_t left = count * sizeof(T);
    constexpr std::size_t kChunk = 1 << 20;
    while (left > 0) {
      const std::size_t size = std::min(left, kChunk);
      std::string chunk(reinterpret_cast<const char*>(&state_), sizeof(state_));
      chunk.append(bytes, size);
      state_ = fnv1a(chunk);
      bytes += size;
      left -= size;
    }
  }
  void add(double value) { add(&value, 1); }
  [[nodiscard]] std::string text() const { return fmt::format("{:016x}", state_); }

 private:
  std::uint64_t state_ = 0;
};

}  // namespace

EnuBox enu_box(const std::array<double, 4>& degrees, const geodesy::LocalFrame& frame) {
  const auto [west, south, east, north] = degrees;
  // West above east: across the antimeridian (RFC 7946, 5.2).
  const double last = west > east ? east + 360 : east;
  if (!(west < last && (last <= 180 || last - west <= 180) && south < north)) {
    throw InputError(fmt::format("the box {},{},{},{} is reversed or empty", west, south, east, north),
                     "give WEST,SOUTH,EAST,NORTH in degrees with west below east and south below north");
  }
  // Around the corners and the middles of the sides: meridians converge, and parallels are curved.
  EnuBox result{Vector2d::Constant(1e300), Vector2d::Constant(-1e300)};
  for (const double latitude : {south, 0.5 * (south + north), north}) {
    for (const double longitude : {west, 0.5 * (west + last), last}) {
      const auto position = geodesy::Geodetic::from_degrees(
          latitude, longitude > 180 ? longitude - 360 : longitude, frame.origin().height_m);
      geodesy::check_geodetic(position, "box");
      const Vector2d enu = frame.local_from_geodetic(position).head<2>();
      result.min = result.min.cwiseMin(enu);
      result.max = result.max.cwiseMax(enu);
    }
  }
  return result;
}

std::array<double, 4> degrees_around(const EnuBox& box, const geodesy::LocalFrame& frame) {
  const double middle = geodesy::degrees(frame.origin().longitude_rad);
  Vector2d low = Vector2d::Constant(1e300), high = Vector2d::Constant(-1e300);
  for (const double north : {box.min.y(), 0.5 * (box.min.y() + box.max.y()), box.max.y()}) {
    for (const double east : {box.min.x(), 0.5 * (box.min.x() + box.max.x()), box.max.x()}) {
      const geodesy::Geodetic position = frame.geodetic_from_local({east, north, 0});
      const double longitude = geodesy::degrees(position.longitude_rad);
      const Vector2d degrees(middle + std::remainder(longitude - middle, 360),
                             geodesy::degrees(position.latitude_rad));
      low = low.cwiseMin(degrees);
      high = high.cwiseMax(degrees);
    }
  }
  return {std::remainder(low.x(), 360), low.y(), std::remainder(high.x(), 360), high.y()};
}

EnuBox built_box(const city::City& city) {
  if (city.mesh.triangles.empty()) {
    throw InputError(fmt::format("the city '{}' is an open field without bounds", city.name), "give a box");
  }
  const city::Box bounds = city.bounds();
  EnuBox all{bounds.min.head<2>(), bounds.max.head<2>()};
  EnuBox built{Vector2d::Constant(1e300), Vector2d::Constant(-1e300)};
  for (const city::Object& object : city.mesh.objects) {
    if (object.surface == city::Surface::Terrain) continue;
    for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t) {
      for (const std::uint32_t corner : city.mesh.triangles[t]) {
        built.min = built.min.cwiseMin(city.mesh.vertices[corner].head<2>());
        built.max = built.max.cwiseMax(city.mesh.vertices[corner].head<2>());
      }
    }
  }
  if (!(built.min.x() <= built.max.x())) return all;
  return {all.min.cwiseMax(built.min - Vector2d::Constant(kRim_m)),
          all.max.cwiseMin(built.max + Vector2d::Constant(kRim_m))};
}

void check_box(const EnuBox& box, const city::City& city) {
  if (!(box.min.x() < box.max.x() && box.min.y() < box.max.y())) {
    throw InputError(
        fmt::format("the box {:g},{:g},{:g},{:g} is reversed or empty", box.min.x(), box.min.y(), box.max.x(),
                    box.max.y()),
        "give west, south, east and north in metres of the city's frame, with west below east and "
        "south below north");
  }
  if (city.mesh.triangles.empty()) return;
  const city::Box bounds = city.bounds();
  const Vector2d low = bounds.min.head<2>(), high = bounds.max.head<2>();
  const std::string hint = fmt::format(
      "the city extends from east {:.0f} to {:.0f} m and from north {:.0f} to {:.0f} m about latitude "
      "{:.5f}, longitude {:.5f}",
      low.x(), high.x(), low.y(), high.y(), geodesy::degrees(city.frame.origin().latitude_rad),
      geodesy::degrees(city.frame.origin().longitude_rad));
  const double apart = (low - box.max).cwiseMax(box.min - high).maxCoeff();
  if (apart >= 0) {
    throw InputError(fmt::format("the box is outside the city '{}', {:.1f} km away", city.name, apart / 1e3),
                     hint);
  }
  const double beyond = (low - box.min).cwiseMax(box.max - high).maxCoeff();
  if (beyond > kFarFromCity_m) {
    throw InputError(fmt::format("the box extends {:.1f} km beyond the city '{}'", beyond / 1e3, city.name),
                     hint);
  }
}

AltitudeKind altitude_kind_named(const std::string& name, const char* what) {
  if (name == "terrain") return AltitudeKind::AboveTerrain;
  if (name == "ellipsoid") return AltitudeKind::Ellipsoid;
  throw InputError(fmt::format("{} '{}' is unknown", what, name), "give terrain or ellipsoid");
}

double usual_altitude_m(const simulation::Scenario& scenario, AltitudeKind kind) {
  constexpr double kUsual_m = 15;
  return kind == AltitudeKind::AboveTerrain ? scenario.trajectory.height_above_terrain_m.value_or(kUsual_m)
                                            : kUsual_m;
}

void check_altitudes(const Request& request, const city::City& city) {
  for (const double altitude : request.altitudes_m) {
    if (request.altitude_kind == AltitudeKind::AboveTerrain) {
      if (altitude < 0) {
        throw InputError(fmt::format("{} m is below the terrain", altitude),
                         "give metres above it, or give altitudes above the ellipsoid");
      }
      continue;
    }
    if (city.mesh.triangles.empty()) continue;
    const double lowest = city.frame.origin().height_m + city.bounds().min.z();
    if (altitude < lowest) {
      throw InputError(fmt::format("{} m is below the whole city", altitude),
                       fmt::format("its lowest point is {:.1f} m above the ellipsoid", lowest));
    }
  }
}

std::vector<GpsTime> parse_times(const std::string& text, std::optional<GpsTime> start) {
  if (text.empty()) return {parse_moment("0", start)};
  const std::vector<std::string_view> parts = split(text, '/');
  if (parts.size() == 1) {
    std::vector<GpsTime> times;
    for (const std::string_view piece : split(text, ',')) times.push_back(parse_moment(piece, start));
    std::sort(times.begin(), times.end());
    times.erase(std::unique(times.begin(), times.end()), times.end());
    if (times.size() > kMaxTimes) {
      throw InputError(fmt::format("{} times are too many", times.size()),
                       fmt::format("at most {} are computed in one map", kMaxTimes));
    }
    return times;
  }
  if (parts.size() == 2 && lower_case(trim(parts[0])) == "day") {
    const GpsTime from = parse_moment("0", start);
    return time_range(from, from + kSiderealDay_s, parse_step(parts[1]), false);
  }
  if (parts.size() != 3) {
    throw InputError(fmt::format("'{}' is not a list of times", text),
                     "give T,T,..., START/END/STEP or day/STEP, e.g. day/15min");
  }
  return time_range(parse_moment(parts[0], start), parse_moment(parts[1], start), parse_step(parts[2]), true);
}

double value_count(const Request& request) {
  return static_cast<double>(request.grid.cells()) *
         static_cast<double>(request.altitudes_m.size() * request.times.size() * request.layers.size());
}

std::string input_key(const simulation::Environment& environment, const std::vector<GpsTime>& times) {
  Hash city;
  const city::City& c = environment.city();
  const Vector3d origin = c.frame.ecef_from_local(Vector3d::Zero());
  city.add(origin.data(), 3);
  city.add(c.frame.heading_rad());
  for (const Vector3d& vertex : c.mesh.vertices) city.add(vertex.data(), 3);
  city.add(c.mesh.triangles.data(), c.mesh.triangles.size());
  city.add(c.mesh.materials.data(), c.mesh.materials.size());
  for (const city::Object& object : c.mesh.objects) {
    const std::array<std::uint32_t, 3> numbers{static_cast<std::uint32_t>(object.surface),
                                               object.first_triangle, object.triangle_count};
    city.add(numbers.data(), numbers.size());
  }
  Hash sky;
  for (const auto& [system, klobuchar] : environment.klobuchar()) {
    sky.add(static_cast<double>(system));
    sky.add(klobuchar.alpha.data(), klobuchar.alpha.size());
    sky.add(klobuchar.beta.data(), klobuchar.beta.size());
  }
  for (const GpsTime time : times) {
    for (const gnss::SatelliteId id : environment.sky().satellites()) {
      const auto state = environment.sky().state(id, time);
      if (!state) continue;
      const std::string name = gnss::to_string(id);
      sky.add(name.data(), name.size());
      sky.add(state->position_m.data(), 3);
      sky.add(state->velocity_mps.data(), 3);
      sky.add(state->clock_bias_s);
      sky.add(state->clock_drift);
      sky.add(state->group_delay_s);
      sky.add(state->carrier_frequency_hz);
    }
  }
  return fmt::format("city {} sky {}", city.text(), sky.text());
}

}  // namespace canyon::heatmap
