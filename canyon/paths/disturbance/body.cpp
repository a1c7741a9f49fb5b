#include "canyon/paths/disturbance/body.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/mesh_topology.hpp"
#include "canyon/paths/propagation/index/knife_edge.hpp"

namespace canyon::disturbance {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Complex = std::complex<double>;
using city::cross;

// Farther outside the shadow than this an edge adds less than 0.6 dB of ripple: 1 / (pi sqrt(2) nu).
constexpr double kClear_nu = 3;

/// Outline of a screen: its leftmost and rightmost points, in coordinates ahead and to the left of the ray,
/// and the section of the ray over it.
struct Outline {
  Vector2d right, left;  // (ahead, to the left)
  double near, far;      // ahead
  double bottom, top;    // height
  bool grounded;
};

/// Around an edge that crosses the ray at `t` ahead.
double over_excess(const SightLine& ray, double t, double height) {
  const double h = height - ray.from.z();
  return std::max(0.0, std::hypot(t, h) - (t * ray.cosine + h * ray.sine));
}

/// 1 - F - F of a screen between two edges [1]; F is 0 if there is no edge.
struct Span {
  bool covers;      // the ray passes between the edges
  double excess_m;  // of the shorter detour
  Complex value;
};

/// Returns false if the edges are so far from the ray that they have no effect.
bool span(double low_excess, bool over_low, double high_excess, bool under_high, bool one_edge,
          double wavelength, Span& result) {
  result.covers = over_low && under_high;
  const double low_nu = propagation::signed_knife_edge_nu(low_excess, wavelength, over_low);
  const double high_nu = propagation::signed_knife_edge_nu(high_excess, wavelength, under_high);
  if ((!one_edge && low_nu < -kClear_nu) || high_nu < -kClear_nu) return false;
  result.excess_m = one_edge ? high_excess : std::min(low_excess, high_excess);
  result.value = 1.0 - edge_field(high_nu);
  if (!one_edge) result.value -= edge_field(low_nu);
  return true;
}

struct Cover {
  Complex fraction;
  bool covers;
  double excess_m;
};

/// X Y of a screen; empty if the screen has no effect.
std::optional<Cover> cover(const SightLine& ray, const Outline& o, double wavelength) {
  const double begin = ray.height(std::max(0.0, o.near)), end = ray.height(o.far);
  const double lowest = std::min(begin, end), highest = std::max(begin, end);
  Span up{}, across{};
  // A rising ray is closest to the top at the near end, and to the bottom at the far end.
  const bool rises = ray.sine >= 0;
  if (!span(o.grounded ? 0 : over_excess(ray, rises ? o.far : o.near, o.bottom), highest > o.bottom,
            over_excess(ray, rises ? o.near : o.far, o.top), lowest < o.top, o.grounded, wavelength, up))
    return std::nullopt;
  // Slant distance to a vertical edge, if the ray is at the height of the body.
  const double up_to_m =
      ray.sine > 0 ? std::max(0.0, (o.grounded ? 0 : o.bottom - ray.from.z()) / ray.sine) : 0;
  const auto neighbour_excess = [&](const Vector2d& edge) {
    const double r = std::max(edge.x() / ray.cosine, up_to_m);
    return std::hypot(r, edge.y()) - r;
  };
  if (!span(neighbour_excess(o.right), o.right.y() < 0, neighbour_excess(o.left), o.left.y() > 0, false,
            wavelength, across))
    return std::nullopt;
  return Cover{up.value * across.value, up.covers && across.covers, std::min(up.excess_m, across.excess_m)};
}

/// Section of a horizontal line over a box.
void clip(const Body& body, const Vector2d& origin, const Vector2d& along, double& near, double& far) {
  const Vector2d from = origin - body.centre;
  const std::array<double, 2> o{from.dot(body.ahead), cross(body.ahead, from)};
  const std::array<double, 2> d{along.dot(body.ahead), cross(body.ahead, along)};
  const std::array<double, 2> half{body.half_length_m, body.half_width_m};
  near = -1e9, far = 1e9;
  for (std::size_t i = 0; i < 2; ++i) {
    if (std::abs(d.at(i)) < 1e-9) continue;
    const double a = (-half.at(i) - o.at(i)) / d.at(i), b = (half.at(i) - o.at(i)) / d.at(i);
    near = std::max(near, std::min(a, b));
    far = std::min(far, std::max(a, b));
  }
}

}  // namespace

Complex edge_field(double nu) {
  constexpr double kStep = 0.02;
  constexpr std::size_t kSteps = 600;
  static const std::array<Complex, kSteps + 2> steady = [] {
    std::array<Complex, kSteps + 2> table;
    for (std::size_t i = 0; i < table.size(); ++i) {
      const double x = kStep * static_cast<double>(i);
      table.at(i) = propagation::knife_edge_field(x) * std::polar(1.0, geodesy::kPi / 2 * x * x);
    }
    return table;
  }();
  const double x = std::abs(nu);
  const double cycles = x * x / 4;
  Complex field = std::polar(1.0, -2 * geodesy::kPi * (cycles - std::floor(cycles)));
  if (x < kStep * kSteps) {
    const auto i = static_cast<std::size_t>(x / kStep);
    field *= steady[i] + (steady[i + 1] - steady[i]) * (x / kStep - static_cast<double>(i));
  } else {
    field *= steady[kSteps] * (kStep * kSteps / x);
  }
  return nu < 0 ? 1.0 - field : field;
}

SightLine::SightLine(const Vector3d& antenna, const Vector3d& arrival, double leg_m) : from(antenna) {
  const double horizontal = arrival.head<2>().norm();
  along = horizontal > 0 ? Vector2d(arrival.head<2>() / horizontal) : Vector2d::UnitX();
  cosine = std::max(horizontal, 1e-9);
  sine = arrival.z();
  slope = sine / cosine;
  ahead_m = leg_m * cosine;
}

Blockage blockage(const Body& body, const SightLine& ray, double wavelength_m) {
  if (body.kind == Body::Kind::Crown) return {};
  // Most bodies are far from most rays: nu^2 = 2 w^2 / (lambda r) of an edge w off a ray at the range r.
  const Vector2d to_centre = body.centre - ray.from.head<2>();
  const double ahead = to_centre.dot(ray.along), neighbour = std::abs(cross(ray.along, to_centre));
  const double radius = body.half_length_m + body.half_width_m;
  if (ahead < -radius || ahead - radius > ray.ahead_m) return {};
  const double clear_square = kClear_nu * kClear_nu / 2 * wavelength_m * (ahead + radius) / ray.cosine;
  const auto clear = [clear_square](double w) { return w > 0 && w * w > clear_square; };
  if (clear(neighbour - radius)) return {};
  if (ray.sine > 0) {
    if (clear((ray.height(std::max(0.0, ahead - radius)) - body.top_m) * ray.cosine)) return {};
    if (!body.grounded && clear((body.bottom_m - ray.height(ahead + radius)) * ray.cosine)) return {};
  }

  Outline outline{{0, 1e9}, {0, -1e9}, 0, 0, body.bottom_m, body.top_m, body.grounded};
  const Vector2d aside(-body.ahead.y(), body.ahead.x());
  for (const double l : {-body.half_length_m, body.half_length_m}) {
    for (const double w : {-body.half_width_m, body.half_width_m}) {
      const Vector2d corner = to_centre + l * body.ahead + w * aside;
      const Vector2d seen(corner.dot(ray.along), cross(ray.along, corner));
      if (seen.y() < outline.right.y()) outline.right = seen;
      if (seen.y() > outline.left.y()) outline.left = seen;
    }
  }
  // The height of a ray that misses the box is taken at the corner.
  const double inset = 1e-6 * (outline.left.y() - outline.right.y());
  const double offset = std::clamp(0.0, outline.right.y() + inset, outline.left.y() - inset);
  const Vector2d line = ray.from.head<2>() + offset * Vector2d(-ray.along.y(), ray.along.x());
  clip(body, line, ray.along, outline.near, outline.far);
  if (outline.far <= 0 || outline.near > ray.ahead_m) return {};
  const auto seen = cover(ray, outline, wavelength_m);
  if (!seen) return {};
  return {std::abs(1.0 - seen->fraction), seen->covers, seen->covers ? seen->excess_m : 0};
}

double crown_depth_m(const Body& body, const Vector3d& antenna, const Vector3d& arrival, double leg_m) {
  const Vector3d centre(body.centre.x(), body.centre.y(), (body.bottom_m + body.top_m) / 2);
  const Vector3d to_centre = centre - antenna;
  const double ahead = to_centre.dot(arrival);
  const double square = body.half_width_m * body.half_width_m - (to_centre.squaredNorm() - ahead * ahead);
  if (square <= 0) return 0;
  const double half = std::sqrt(square);
  return std::max(0.0, std::min(leg_m, ahead + half) - std::max(0.0, ahead - half));
}

std::optional<propagation::Path> side_reflection(const Body& body, int side, const Vector3d& antenna,
                                                 const Vector3d& satellite, double wavelength_m,
                                                 double least) {
  const Vector2d aside(-body.ahead.y(), body.ahead.x());
  const double sign = side % 2 == 0 ? 1 : -1;
  const Vector2d normal = sign * (side < 2 ? aside : body.ahead);
  const double depth = side < 2 ? body.half_width_m : body.half_length_m;
  const double half = side < 2 ? body.half_length_m : body.half_width_m;
  // Closer to grazing the reflection point moves towards infinity.
  const double cosine = satellite.head<2>().dot(normal);
  if (cosine < 0.02) return std::nullopt;
  const double distance = (antenna.head<2>() - body.centre).dot(normal) - depth;
  if (distance <= 0) return std::nullopt;
  const double leg = distance / cosine;
  Vector3d arrival = satellite;
  arrival.head<2>() -= 2 * cosine * normal;
  const Vector3d point = antenna + leg * arrival;
  const double clear_square = kClear_nu * kClear_nu / 2 * wavelength_m * leg;
  const auto clear = [clear_square](double w) { return w > 0 && w * w > clear_square; };
  const double level = satellite.head<2>().norm();
  if (clear((point.z() - body.top_m) * level) || clear((body.bottom_m - point.z()) * level))
    return std::nullopt;
  const double off = std::abs(cross(normal, point.head<2>() - body.centre)) - half;
  if (clear(off * cosine / level)) return std::nullopt;

  Vector3d image = antenna;
  image.head<2>() -= 2 * distance * normal;
  const SightLine ray(image, satellite);
  const Vector2d middle = body.centre + depth * normal - image.head<2>();
  const Vector2d across = half * Vector2d(-normal.y(), normal.x());
  const auto seen = [&](const Vector2d& corner) {
    return Vector2d(corner.dot(ray.along), cross(ray.along, corner));
  };
  const double passes = leg * ray.cosine;
  const auto covered = cover(
      ray, {seen(middle - across), seen(middle + across), passes, passes, body.bottom_m, body.top_m, false},
      wavelength_m);
  if (!covered) return std::nullopt;
  const double factor = std::abs(covered->fraction);
  if (factor < least) return std::nullopt;

  propagation::Path path;
  path.kind = propagation::PathKind::Reflected;
  path.order = 1;
  path.point = point;
  path.arrival = arrival;
  path.reflector = propagation::reflector_id(
      path.kind, {static_cast<std::uint32_t>(body.name >> 32), static_cast<std::uint32_t>(body.name),
                  static_cast<std::uint32_t>(side)});
  path.amplitude_factor = factor;
  path.excess_m = 2 * distance * cosine;
  path.arrival_elevation_rad = std::asin(std::clamp(arrival.z(), -1.0, 1.0));
  path.incidence_count = 1;
  path.incidences[0].incidence_rad = std::acos(std::min(1.0, cosine));
  path.incidences[0].material =
      point.z() < body.bottom_m + body.sill_m ? city::Material::Metal : city::Material::Glass;
  return path;
}

}  // namespace canyon::disturbance
