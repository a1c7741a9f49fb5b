#include "canyon/meshes/polygon.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <optional>
#include <utility>

#include "canyon/meshes/geos.hpp"

namespace canyon::meshes {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
using Edge = std::uint64_t;  ///< directed: first corner in the upper half

Edge sorted_edge(std::uint32_t from, std::uint32_t to) {
  return (static_cast<Edge>(from) << 32) | to;
}

/// Sign of the turn a, b, c: +1 to the left, exactly. The filter is Shewchuk's ccwerrboundA (1997, "Adaptive
/// precision floating-point arithmetic", section 4.3); what it leaves open, GEOS decides in double-double.
int turn(const Point2& a, const Point2& b, const Point2& c) {
  const double left = (a.x() - c.x()) * (b.y() - c.y());
  const double right = (a.y() - c.y()) * (b.x() - c.x());
  const double determinant = left - right;
  constexpr double kBound = 3.3306690738754716e-16;
  if (std::abs(determinant) > kBound * (std::abs(left) + std::abs(right))) return determinant > 0 ? 1 : -1;
  return GEOSOrientationIndex_r(geos::context(), a.x(), a.y(), b.x(), b.y(), c.x(), c.y());
}

/// Corners of a polygon in the order of the indices that triangulate() gives, positions that occur twice
/// (rings that touch) known by their first index.
struct Corners {
  explicit Corners(const Polygon2& polygon) {
    const auto add = [this](const std::vector<Point2>& ring) {
      const auto begin = static_cast<std::uint32_t>(points.size());
      points.insert(points.end(), ring.begin(), ring.end());
      rings.emplace_back(begin, static_cast<std::uint32_t>(points.size()));
    };
    add(polygon.outer);
    for (const auto& hole : polygon.holes) add(hole);
    order.resize(points.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [this](std::uint32_t a, std::uint32_t b) {
      return less(points[a], points[b]) || (points[a] == points[b] && a < b);
    });
    first.resize(points.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
      first[order[k]] = k > 0 && points[order[k]] == points[order[k - 1]] ? first[order[k - 1]] : order[k];
    }
  }

  static bool less(const Point2& a, const Point2& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  }
  [[nodiscard]] std::optional<std::uint32_t> find(const Point2& p) const {
    const auto at = std::lower_bound(order.begin(), order.end(), p,
                                     [this](std::uint32_t i, const Point2& q) { return less(points[i], q); });
    if (at == order.end() || points[*at] != p) return std::nullopt;
    return *at;
  }

  std::vector<Point2> points;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> rings;  ///< [begin, end)
  std::vector<std::uint32_t> order;                            ///< indices by position
  std::vector<std::uint32_t> first;                            ///< lowest index with the same position
};

/// Whether triangles cover the polygon exactly: all turn left, and once edges that two of them share cancel,
/// the rings' edges are left. (The triangles' winding numbers then add up to the rings'.)
bool covers(const Corners& corners, const std::vector<Triangle>& triangles) {
  std::vector<Edge> left, right;
  left.reserve(3 * triangles.size());
  for (const Triangle& t : triangles) {
    if (turn(corners.points[t[0]], corners.points[t[1]], corners.points[t[2]]) <= 0) return false;
    for (std::size_t k = 0; k < 3; ++k) left.push_back(sorted_edge(t[k], t[(k + 1) % 3]));
  }
  right.reserve(left.size());
  for (const auto& [begin, end] : corners.rings) {
    for (std::uint32_t i = begin; i < end; ++i) {
      right.push_back(sorted_edge(corners.first[i], corners.first[i + 1 < end ? i + 1 : begin]));
    }
  }
  // Directed triangle edges must be the ring edges and, beside them, pairs of opposites.
  std::sort(left.begin(), left.end());
  std::sort(right.begin(), right.end());
  std::vector<Edge> inner;
  inner.reserve(left.size());
  std::set_difference(left.begin(), left.end(), right.begin(), right.end(), std::back_inserter(inner));
  if (inner.size() + right.size() != left.size()) return false;  // a ring edge that no triangle has
  std::vector<Edge> opposite(inner.size());
  std::transform(inner.begin(), inner.end(), opposite.begin(), [](Edge e) { return (e << 32) | (e >> 32); });
  std::sort(opposite.begin(), opposite.end());
  return inner == opposite;
}

/// A view of the plane, its own inverse.
using View = Point2 (*)(const Point2&);

/// GEOS's triangulation of the polygon as seen by `view`; empty where it does not cover the polygon exactly.
std::optional<std::vector<Triangle>> triangulate_seen(const Polygon2& polygon, const Corners& corners,
                                                      View view) {
  Polygon2 seen = polygon;
  std::transform(seen.outer.begin(), seen.outer.end(), seen.outer.begin(), view);
  for (auto& hole : seen.holes) std::transform(hole.begin(), hole.end(), hole.begin(), view);
  const geos::Geometry shape = geos::polygon(seen.outer, seen.holes);
  if (!shape) return std::nullopt;
  const GEOSContextHandle_t context = geos::context();
  const geos::Geometry pieces(GEOSConstrainedDelaunayTriangulation_r(context, shape.get()));
  if (!pieces) return std::nullopt;
  std::vector<Triangle> triangles;
  for (int i = 0; i < GEOSGetNumGeometries_r(context, pieces.get()); ++i) {
    const GEOSGeometry* piece = GEOSGetGeometryN_r(context, pieces.get(), i);
    const std::vector<Point2> ring = geos::points(GEOSGetExteriorRing_r(context, piece));
    if (ring.size() != 4) return std::nullopt;
    Triangle triangle{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto index = corners.find(view(ring[k]));
      if (!index) return std::nullopt;
      triangle[k] = *index;
    }
    if (turn(corners.points[triangle[0]], corners.points[triangle[1]], corners.points[triangle[2]]) < 0) {
      std::swap(triangle[1], triangle[2]);
    }
    triangles.push_back(triangle);
  }
  if (!covers(corners, triangles)) return std::nullopt;
  return triangles;
}

/// Corners of a face, counter-clockwise on the plane of its normal.
std::vector<Point2> flat(const std::vector<Eigen::Vector3d>& vertices,
                         const std::vector<std::uint32_t>& corners, const Eigen::Vector3d& normal) {
  const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
  std::vector<Point2> ring;
  ring.reserve(corners.size());
  for (const std::uint32_t c : corners) {
    const Eigen::Vector3d from_first = vertices[c] - vertices[corners[0]];
    ring.emplace_back(u.dot(from_first), v.dot(from_first));
  }
  return ring;
}

/// A ring that goes to its holes and back on the same edges, as an outline with holes; any other as it is.
/// @param order takes the number in the ring of each corner of the polygon
Polygon2 without_bridges(const std::vector<Point2>& ring, std::vector<std::uint32_t>& order) {
  constexpr std::size_t kLongest = 500;  // the search takes the square of it, for each bridge
  std::vector<std::vector<std::uint32_t>> waiting(1), rings;
  for (std::uint32_t i = 0; i < ring.size(); ++i) waiting[0].push_back(i);
  order = waiting[0];
  if (ring.size() > kLongest) return {ring, {}};
  while (!waiting.empty()) {
    const std::vector<std::uint32_t> part = std::move(waiting.back());
    waiting.pop_back();
    const std::size_t n = part.size();
    const auto at = [&](std::size_t i) -> const Point2& { return ring[part[i % n]]; };
    // The edges from i to i + 1 and from j to j + 1 are the two ways of a bridge.
    std::optional<std::pair<std::size_t, std::size_t>> bridge;
    for (std::size_t i = 0; i < n && !bridge; ++i) {
      for (std::size_t j = i + 1; j < n && !bridge; ++j)
        if (at(i) == at(j + 1) && at(i + 1) == at(j)) bridge.emplace(i, j);
    }
    if (!bridge) {
      if (n > 2) rings.push_back(part);
      continue;
    }
    std::vector<std::uint32_t> between, rest;
    for (std::size_t k = bridge->first + 1; k < bridge->second; ++k) between.push_back(part[k]);
    for (std::size_t k = bridge->second + 1; k % n != bridge->first; ++k) rest.push_back(part[k % n]);
    waiting.push_back(std::move(between));
    waiting.push_back(std::move(rest));
  }
  const auto points = [&ring](const std::vector<std::uint32_t>& of) {
    std::vector<Point2> all;
    for (const std::uint32_t i : of) all.push_back(ring[i]);
    return all;
  };
  const auto is_outline = [&](const auto& one) { return twice_area(points(one)) > 0; };
  const auto outline = std::find_if(rings.begin(), rings.end(), is_outline);
  if (outline == rings.end() || std::count_if(rings.begin(), rings.end(), is_outline) != 1) return {ring, {}};
  std::iter_swap(rings.begin(), outline);
  Polygon2 polygon;
  order.clear();
  for (const auto& one : rings) {
    order.insert(order.end(), one.begin(), one.end());
    (&one == &rings[0] ? polygon.outer : polygon.holes.emplace_back()) = points(one);
  }
  return polygon;
}

}  // namespace

double twice_area(const std::vector<Point2>& ring) {
  double sum = 0;
  for (std::size_t i = 1; i + 1 < ring.size(); ++i) {
    const Point2 a = ring[i] - ring[0], b = ring[i + 1] - ring[0];
    sum += a.x() * b.y() - a.y() * b.x();
  }
  return sum;
}

TriangleIndices triangulate(const Polygon2& polygon) {
  if (polygon.outer.size() < 3) return {};
  const Corners corners(polygon);
  // GEOS joins holes to the outline from one side: where rings touch, it may fail there and not from another.
  const View kViews[]{[](const Point2& p) { return p; },
                      [](const Point2& p) { return Point2(-p.x(), p.y()); },
                      [](const Point2& p) { return Point2(p.y(), p.x()); },
                      [](const Point2& p) { return Point2(-p.y(), -p.x()); }};
  for (const View view : kViews) {
    if (auto triangles = triangulate_seen(polygon, corners, view)) return std::move(*triangles);
  }
  return {};
}

bool add_face(const std::vector<Eigen::Vector3d>& vertices, const std::vector<std::uint32_t>& corners,
              TriangleIndices& triangles) {
  const std::size_t n = corners.size();
  const auto fan = [&](std::size_t from) {
    for (std::size_t i = 1; i + 1 < n; ++i)
      triangles.push_back({corners[from], corners[(from + i) % n], corners[(from + i + 1) % n]});
    return true;
  };
  if (n == 3) return fan(0);
  const auto cross = [&](std::size_t a, std::size_t b, std::size_t c) -> Eigen::Vector3d {
    const Eigen::Vector3d& at = vertices[corners[a % n]];
    return (vertices[corners[b % n]] - at).cross(vertices[corners[c % n]] - at);
  };
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (std::size_t i = 1; i + 1 < n; ++i) normal += cross(0, i, i + 1);
  const double turned_away = -1e-9 * normal.norm();
  normal.normalize();
  constexpr std::size_t kMostFans = 8;
  for (std::size_t from = 0; from < std::min(n, kMostFans); ++from) {
    bool covers_face = true;
    for (std::size_t i = 1; i + 1 < n && covers_face; ++i)
      covers_face = !(cross(from, from + i, from + i + 1).dot(normal) < turned_away);
    if (covers_face) return fan(from);
  }
  const std::vector<Point2> ring = flat(vertices, corners, normal);
  std::vector<std::uint32_t> order;  // of corners in the polygon
  const TriangleIndices pieces = triangulate(without_bridges(ring, order));
  for (const auto& [a, b, c] : pieces)
    triangles.push_back({corners[order[a]], corners[order[b]], corners[order[c]]});
  if (pieces.empty()) fan(0);
  return !pieces.empty();
}

}  // namespace canyon::meshes
