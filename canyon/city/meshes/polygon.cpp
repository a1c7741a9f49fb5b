#include "canyon/city/meshes/polygon.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <set>
#include <utility>

#include "canyon/city/meshes/geos.hpp"

namespace canyon::meshes {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
using Edge = std::uint64_t;  ///< directed: first corner in the upper half

Edge sorted_edge(std::uint32_t from, std::uint32_t to) {
  return (static_cast<Edge>(from) << 32) | to;
}

/// Orientation of a, b, c: +1 for a left turn, exact. The filter is Shewchuk's ccwerrboundA (1997, "Adaptive
/// precision floating-point arithmetic", section 4.3); undecided cases are computed by GEOS in double-double.
int orientation(const Point2& a, const Point2& b, const Point2& c) {
  const double left = (a.x() - c.x()) * (b.y() - c.y());
  const double right = (a.y() - c.y()) * (b.x() - c.x());
  const double determinant = left - right;
  constexpr double kBound = 3.3306690738754716e-16;
  if (std::abs(determinant) > kBound * (std::abs(left) + std::abs(right))) return determinant > 0 ? 1 : -1;
  return GEOSOrientationIndex_r(geos::context(), a.x(), a.y(), b.x(), b.y(), c.x(), c.y());
}

/// Corners of a polygon in the order of the indices from triangulate(); repeated positions (rings that touch)
/// use their first index.
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
    for (std::size_t k = 0; k < order.size(); ++k)
      first[order[k]] = k > 0 && points[order[k]] == points[order[k - 1]] ? first[order[k - 1]] : order[k];
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

/// Whether triangles cover the polygon exactly: all are counter-clockwise, and after shared edges cancel,
/// exactly the rings' edges are left. (The triangles' winding numbers then add up to the rings'.)
bool covers(const Corners& corners, const std::vector<Triangle>& triangles) {
  std::vector<Edge> left, right;
  left.reserve(3 * triangles.size());
  for (const Triangle& t : triangles) {
    if (orientation(corners.points[t[0]], corners.points[t[1]], corners.points[t[2]]) <= 0) return false;
    for (std::size_t k = 0; k < 3; ++k) left.push_back(sorted_edge(t[k], t[(k + 1) % 3]));
  }
  right.reserve(left.size());
  for (const auto& [begin, end] : corners.rings)
    for (std::uint32_t i = begin; i < end; ++i)
      right.push_back(sorted_edge(corners.first[i], corners.first[i + 1 < end ? i + 1 : begin]));
  // Directed triangle edges must be the ring edges plus pairs of opposites.
  std::sort(left.begin(), left.end());
  std::sort(right.begin(), right.end());
  std::vector<Edge> inner;
  inner.reserve(left.size());
  std::set_difference(left.begin(), left.end(), right.begin(), right.end(), std::back_inserter(inner));
  if (inner.size() + right.size() != left.size()) return false;  // a ring edge without a triangle
  std::vector<Edge> opposite(inner.size());
  std::transform(inner.begin(), inner.end(), opposite.begin(), [](Edge e) { return (e << 32) | (e >> 32); });
  std::sort(opposite.begin(), opposite.end());
  return inner == opposite;
}

/// Triangles of a polygon in n log n steps: diagonals of a sweep along x cut it into monotone pieces, and a
/// stack cuts these (de Berg et al., Computational Geometry, 3.2 and 3.3). For rings that cross or touch the
/// result is arbitrary: see covers().
class Sweep {
 public:
  explicit Sweep(const Corners& corners)
      : at_(corners.points), order_(corners.order), next_(at_.size()), before_(next_), rank_(next_) {
    for (const auto& [begin, end] : corners.rings) {
      for (std::uint32_t i = begin; i < end; ++i) {
        next_[i] = i + 1 < end ? i + 1 : begin;
        before_[next_[i]] = i;
      }
    }
    for (std::uint32_t k = 0; k < order_.size(); ++k) rank_[order_[k]] = k;
  }

  std::vector<Triangle> triangles() {
    if (!find_diagonals()) return {};
    const std::size_t rings = at_.size(), sides = rings + diagonals_.size();
    // The side that follows a side around the piece on its left.
    std::vector<std::size_t> follow(sides);
    std::vector<std::vector<std::size_t>> leave(rings);
    for (std::size_t d = rings; d < sides; ++d) leave[start_of(d)].push_back(d);
    for (std::uint32_t v = 0; v < rings; ++v) {
      const auto sector = [&](std::size_t d) { return -orientation(at_[v], at_[next_[v]], at_[end_of(d)]); };
      std::sort(leave[v].begin(), leave[v].end(), [&](std::size_t a, std::size_t b) {
        const int left = sector(a), right = sector(b);
        return left != right ? left < right : orientation(at_[v], at_[end_of(a)], at_[end_of(b)]) > 0;
      });
      std::size_t clockwise = v;
      for (const std::size_t d : leave[v]) follow[twin_of(d)] = std::exchange(clockwise, d);
      follow[before_[v]] = clockwise;
    }
    std::vector<bool> done(sides, false);
    for (std::size_t first = 0; first < sides; ++first) {
      std::vector<std::uint32_t> piece;
      for (std::size_t side = first; !done[side]; side = follow[side]) {
        done[side] = true;
        piece.push_back(start_of(side));
      }
      if (piece.size() > 2) cut(std::move(piece));
    }
    return std::move(triangles_);
  }

 private:
  /// A side of a ring by its first corner; ordered from below.
  struct Below {
    using is_transparent = void;
    const Sweep* of;
    bool operator()(std::uint32_t a, std::uint32_t b) const {
      if (of->rank_[a] > of->rank_[b]) return a != b && !(*this)(b, a);
      const int start = of->side(a, b);
      return a != b && (start != 0 ? start : of->side(a, of->next_[b])) > 0;
    }
    bool operator()(std::uint32_t a, const Point2& p) const {
      return orientation(of->at_[a], of->at_[of->next_[a]], p) > 0;
    }
  };
  [[nodiscard]] int side(std::uint32_t a, std::uint32_t corner) const {
    return orientation(at_[a], at_[next_[a]], at_[corner]);
  }

  bool find_diagonals() {
    std::set<std::uint32_t, Below> sides(Below{this});  // with the inside above them
    std::vector<std::set<std::uint32_t, Below>::iterator> index(at_.size(), sides.end());
    std::vector<std::uint32_t> helper(at_.size());
    std::vector<bool> merges(at_.size(), false);
    for (const std::uint32_t v : order_) {
      const std::uint32_t from = before_[v];
      const bool from_left = rank_[from] < rank_[v], to_right = rank_[v] < rank_[next_[v]];
      const bool convex = orientation(at_[from], at_[v], at_[next_[v]]) > 0;
      if (from_left) {
        if (merges[helper[from]]) join(v, helper[from]);
        if (index[from] != sides.end()) sides.erase(index[from]);
      }
      if (from_left != to_right ? !convex : !from_left) {
        auto below = sides.lower_bound(at_[v]);
        if (below == sides.begin()) return false;
        std::uint32_t& last = helper[*--below];
        if (to_right || merges[last]) join(v, last);
        last = v;
      }
      if (to_right) {
        const auto [found, fresh] = sides.insert(v);
        if (!fresh) return false;
        index[v] = found;
        helper[v] = v;
      }
      merges[v] = from_left && !to_right && !convex;
    }
    return true;
  }

  void join(std::uint32_t a, std::uint32_t b) {
    diagonals_.push_back(a);
    diagonals_.push_back(b);
  }
  [[nodiscard]] std::size_t twin_of(std::size_t diagonal) const {
    return at_.size() + ((diagonal - at_.size()) ^ 1);
  }
  [[nodiscard]] std::uint32_t start_of(std::size_t side) const {
    return side < at_.size() ? static_cast<std::uint32_t>(side) : diagonals_[side - at_.size()];
  }
  [[nodiscard]] std::uint32_t end_of(std::size_t diagonal) const { return start_of(twin_of(diagonal)); }

  void add(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    triangles_.push_back({a, b, c});
    if (orientation(at_[a], at_[b], at_[c]) < 0) std::swap(triangles_.back()[1], triangles_.back()[2]);
  }

  /// Cuts a piece, counter-clockwise, that no vertical line crosses more than twice.
  void cut(std::vector<std::uint32_t> piece) {
    const auto is_left = [this](std::uint32_t a, std::uint32_t b) { return rank_[a] < rank_[b]; };
    std::rotate(piece.begin(), std::min_element(piece.begin(), piece.end(), is_left), piece.end());
    const auto right = std::max_element(piece.begin(), piece.end(), is_left);
    std::vector<std::pair<std::uint32_t, bool>> all, open;  // with a flag for the upper chain
    for (auto corner = piece.begin(); corner != piece.end(); ++corner)
      all.emplace_back(*corner, corner > right);
    std::sort(all.begin(), all.end(),
              [&](const auto& a, const auto& b) { return is_left(a.first, b.first); });
    for (std::size_t i = 0; i < all.size(); ++i) {
      const auto& [v, upper] = all[i];
      const bool across = i + 1 == all.size() || (i > 0 && open.back().second != upper);
      for (std::size_t k = open.size(); k > 1; --k) {
        const std::uint32_t a = open[k - 2].first, b = open[k - 1].first;
        if (!across && (upper ? -1 : 1) * orientation(at_[a], at_[b], at_[v]) <= 0) break;
        add(a, b, v);
        if (!across) open.pop_back();
      }
      if (across && i + 1 < all.size()) open.assign(1, all[i - 1]);
      open.push_back(all[i]);
    }
  }

  const std::vector<Point2>& at_;
  const std::vector<std::uint32_t>& order_;
  std::vector<std::uint32_t> next_, before_, rank_;
  std::vector<std::uint32_t> diagonals_;  ///< both directions, one after the other
  std::vector<Triangle> triangles_;
};

/// A view of the plane, which is its own inverse.
using View = Point2 (*)(const Point2&);

/// GEOS's triangulation of the polygon transformed by `view`; empty if it does not cover the polygon exactly.
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
    if (orientation(corners.points[triangle[0]], corners.points[triangle[1]], corners.points[triangle[2]]) <
        0)
      std::swap(triangle[1], triangle[2]);
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

/// Converts a ring with two-way edges (bridges) to its holes into an outline with holes; keeps other rings.
/// @param order gets the index in the ring of each corner of the polygon
Polygon2 without_bridges(const std::vector<Point2>& ring, std::vector<std::uint32_t>& order) {
  constexpr std::size_t kMax = 500;  // the cost is quadratic, for each bridge
  std::vector<std::vector<std::uint32_t>> waiting(1), rings;
  for (std::uint32_t i = 0; i < ring.size(); ++i) waiting[0].push_back(i);
  order = waiting[0];
  if (ring.size() > kMax) return {ring, {}};
  while (!waiting.empty()) {
    const std::vector<std::uint32_t> part = std::move(waiting.back());
    waiting.pop_back();
    const std::size_t n = part.size();
    const auto at = [&](std::size_t i) -> const Point2& { return ring[part[i % n]]; };
    // The edges from i to i + 1 and from j to j + 1 are the two directions of a bridge.
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

TriangleList triangulate(const Polygon2& polygon) {
  if (polygon.outer.size() < 3) return {};
  const Corners corners(polygon);
  // GEOS is quadratic in the corners: 5 s for a spiral of 4,000.
  constexpr std::size_t kMaxInSquare = 1000;
  if (corners.points.size() > kMaxInSquare) {
    std::vector<Triangle> triangles = Sweep(corners).triangles();
    for (Triangle& triangle : triangles)
      for (std::uint32_t& corner : triangle) corner = corners.first[corner];
    if (covers(corners, triangles)) return triangles;
    const geos::Geometry shape = geos::polygon(polygon.outer, polygon.holes);
    const bool touches = shape && GEOSisValid_r(geos::context(), shape.get()) == 1;
    if (!touches || corners.points.size() > 4 * kMaxInSquare) return {};
  }
  // GEOS joins holes to the outline from one side: if rings touch, this may work from another side only.
  const View kViews[]{[](const Point2& p) { return p; },
                      [](const Point2& p) { return Point2(-p.x(), p.y()); },
                      [](const Point2& p) { return Point2(p.y(), p.x()); },
                      [](const Point2& p) { return Point2(-p.y(), -p.x()); }};
  for (const View view : kViews)
    if (auto triangles = triangulate_seen(polygon, corners, view)) return std::move(*triangles);
  return {};
}

bool add_face(const std::vector<Eigen::Vector3d>& vertices, const std::vector<std::uint32_t>& corners,
              TriangleList& triangles) {
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
  const double rotated_away = -1e-9 * normal.norm();
  normal.normalize();
  constexpr std::size_t kMaxFans = 8;
  for (std::size_t from = 0; from < std::min(n, kMaxFans); ++from) {
    bool covers_face = true;
    for (std::size_t i = 1; i + 1 < n && covers_face; ++i)
      covers_face = !(cross(from, from + i, from + i + 1).dot(normal) < rotated_away);
    if (covers_face) return fan(from);
  }
  const std::vector<Point2> ring = flat(vertices, corners, normal);
  std::vector<std::uint32_t> order;  // of corners in the polygon
  const TriangleList pieces = triangulate(without_bridges(ring, order));
  for (const auto& [a, b, c] : pieces)
    triangles.push_back({corners[order[a]], corners[order[b]], corners[order[c]]});
  if (pieces.empty()) fan(0);
  return !pieces.empty();
}

}  // namespace canyon::meshes
