#include "canyon/buildings/shapes/triangulate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <optional>
#include <utility>

#include "canyon/buildings/shapes/geos.hpp"

namespace canyon::buildings {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
using Edge = std::uint64_t;  ///< directed: first corner in the upper half

Edge edge(std::uint32_t from, std::uint32_t to) {
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

bool in_closed_triangle(const Point2& a, const Point2& b, const Point2& c, const Point2& p) {
  if (p.x() < std::min({a.x(), b.x(), c.x()}) || p.x() > std::max({a.x(), b.x(), c.x()}) ||
      p.y() < std::min({a.y(), b.y(), c.y()}) || p.y() > std::max({a.y(), b.y(), c.y()})) {
    return false;
  }
  return turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0;
}

/// Whether the closed segments ab and cd have a point in common that is not an end of both.
bool meet(const Point2& a, const Point2& b, const Point2& c, const Point2& d) {
  const auto between = [](const Point2& p, const Point2& q, const Point2& x) {
    return turn(p, q, x) == 0 && x != p && x != q && (x - p).dot(x - q) < 0;
  };
  if (between(a, b, c) || between(a, b, d) || between(c, d, a) || between(c, d, b)) return true;
  return turn(a, b, c) * turn(a, b, d) < 0 && turn(c, d, a) * turn(c, d, b) < 0;
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
    for (std::size_t k = 0; k < 3; ++k) left.push_back(edge(t[k], t[(k + 1) % 3]));
  }
  right.reserve(left.size());
  for (const auto& [begin, end] : corners.rings) {
    for (std::uint32_t i = begin; i < end; ++i) {
      right.push_back(edge(corners.first[i], corners.first[i + 1 < end ? i + 1 : begin]));
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

std::optional<std::vector<Triangle>> triangulate_by_geos(const Polygon2& polygon, const Corners& corners) {
  const GEOSContextHandle_t context = geos::context();
  const geos::Geometry shape = geos::polygon(polygon.outer, polygon.holes);
  if (!shape) return std::nullopt;
  const geos::Geometry pieces(GEOSConstrainedDelaunayTriangulation_r(context, shape.get()));
  if (!pieces) return std::nullopt;
  const int count = GEOSGetNumGeometries_r(context, pieces.get());
  std::vector<Triangle> triangles;
  triangles.reserve(static_cast<std::size_t>(std::max(count, 0)));
  for (int i = 0; i < count; ++i) {
    const GEOSGeometry* ring = GEOSGetExteriorRing_r(context, GEOSGetGeometryN_r(context, pieces.get(), i));
    const GEOSCoordSequence* sequence = ring == nullptr ? nullptr : GEOSGeom_getCoordSeq_r(context, ring);
    unsigned size = 0;
    if (sequence == nullptr || GEOSCoordSeq_getSize_r(context, sequence, &size) == 0 || size != 4) {
      return std::nullopt;
    }
    std::array<double, 8> xy{};
    if (GEOSCoordSeq_copyToBuffer_r(context, sequence, xy.data(), 0, 0) == 0) return std::nullopt;
    Triangle triangle{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto index = corners.find({xy[2 * k], xy[2 * k + 1]});
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

/// Ear clipping with exact turns over one chain of corners, into which holes are bridged. Time grows with the
/// square of the corners; for what GEOS does not answer.
class EarClipper {
 public:
  explicit EarClipper(const Corners& corners) : corners_(corners) {}

  std::optional<std::vector<Triangle>> triangulate() {
    for (const auto& [begin, end] : corners_.rings) {
      const auto base = static_cast<std::uint32_t>(nodes_.size());
      const std::uint32_t n = end - begin;
      for (std::uint32_t i = 0; i < n; ++i) {
        nodes_.push_back({corners_.first[begin + i], base + (i + n - 1) % n, base + (i + 1) % n, begin == 0});
      }
    }
    std::vector<std::uint32_t> holes;  // rightmost corner of each, the rightmost first
    for (std::size_t r = 1; r < corners_.rings.size(); ++r) {
      std::uint32_t rightmost = corners_.rings[r].first;
      for (std::uint32_t i = rightmost; i < corners_.rings[r].second; ++i) {
        if (Corners::less(at(rightmost), at(i))) rightmost = i;
      }
      holes.push_back(rightmost);
    }
    std::sort(holes.begin(), holes.end(),
              [this](std::uint32_t a, std::uint32_t b) { return Corners::less(at(b), at(a)); });
    for (const std::uint32_t hole : holes) {
      if (!join(hole)) return std::nullopt;
    }
    return clip();
  }

 private:
  struct Node {
    std::uint32_t corner, previous, next;
    bool chained;  ///< part of the chain; holes not yet joined are not
  };

  [[nodiscard]] const Point2& at(std::uint32_t node) const { return corners_.points[nodes_[node].corner]; }

  /// Whether the direction from a node's corner towards p lies strictly within the polygon there.
  [[nodiscard]] bool in_cone(std::uint32_t node, const Point2& p) const {
    const Point2 &a = at(nodes_[node].previous), &b = at(node), &c = at(nodes_[node].next);
    if (turn(a, b, c) > 0) return turn(a, b, p) > 0 && turn(b, c, p) > 0;
    return !(turn(b, a, p) >= 0 && turn(c, b, p) >= 0);
  }

  /// Nothing of the rings lies on the open segment between two corners.
  [[nodiscard]] bool is_free(const Point2& a, const Point2& b) const {
    for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
      if (meet(a, b, at(i), at(nodes_[i].next))) return false;
    }
    return true;
  }

  void mark(std::uint32_t start) {
    for (std::uint32_t i = start; !nodes_[i].chained; i = nodes_[i].next) nodes_[i].chained = true;
  }

  /// Joins the ring with the node `hole` to the chain, at a corner that both have or by a bridge.
  bool join(std::uint32_t hole) {
    if (nodes_[hole].chained) return true;
    std::uint32_t h = hole;
    do {
      for (std::uint32_t p = 0; p < nodes_.size(); ++p) {
        if (!nodes_[p].chained || nodes_[p].corner != nodes_[h].corner || !in_cone(p, at(nodes_[h].next))) {
          continue;
        }
        mark(h);  // p keeps what comes before it, h gets what came after
        const std::uint32_t after = nodes_[p].next;
        std::swap(nodes_[p].next, nodes_[h].next);
        nodes_[nodes_[p].next].previous = p;
        nodes_[after].previous = h;
        return true;
      }
      h = nodes_[h].next;
    } while (h != hole);

    do {
      std::vector<std::pair<double, std::uint32_t>> near;
      for (std::uint32_t p = 0; p < nodes_.size(); ++p) {
        if (nodes_[p].chained) near.emplace_back((at(p) - at(h)).squaredNorm(), p);
      }
      std::sort(near.begin(), near.end());
      for (const auto& [distance, p] : near) {
        if (!in_cone(p, at(h)) || !in_cone(h, at(p)) || !is_free(at(p), at(h))) continue;
        mark(h);
        // p, h, around the hole, a second h, a second p, on.
        const auto p2 = static_cast<std::uint32_t>(nodes_.size()), h2 = p2 + 1;
        nodes_.push_back({nodes_[p].corner, h2, nodes_[p].next, true});
        nodes_.push_back({nodes_[h].corner, nodes_[h].previous, p2, true});
        nodes_[nodes_[p2].next].previous = p2;
        nodes_[nodes_[h2].previous].next = h2;
        nodes_[p].next = h;
        nodes_[h].previous = p;
        return true;
      }
      h = nodes_[h].next;
    } while (h != hole);
    return false;
  }

  [[nodiscard]] bool is_ear(std::uint32_t node) const {
    const std::uint32_t i = nodes_[node].previous, j = nodes_[node].next;
    const Point2 &a = at(i), &b = at(node), &c = at(j);
    if (turn(a, b, c) <= 0) return false;
    for (std::uint32_t k = nodes_[j].next; k != i; k = nodes_[k].next) {
      const std::uint32_t corner = nodes_[k].corner;
      if (corner == nodes_[i].corner || corner == nodes_[node].corner || corner == nodes_[j].corner) continue;
      if (in_closed_triangle(a, b, c, at(k))) return false;
    }
    return true;
  }

  /// Smallest height of the triangle at a node: ears flatter than the grid wait, most vanish by waiting.
  [[nodiscard]] bool is_flat(std::uint32_t node) const {
    const Point2 u = at(nodes_[node].previous) - at(node), v = at(nodes_[node].next) - at(node);
    const double longest = std::max({u.norm(), v.norm(), (u - v).norm()});
    return std::abs(u.x() * v.y() - u.y() * v.x()) < 1e-3 * longest;
  }

  void unlink(std::uint32_t node) {
    nodes_[nodes_[node].previous].next = nodes_[node].next;
    nodes_[nodes_[node].next].previous = nodes_[node].previous;
  }

  std::optional<std::vector<Triangle>> clip() {
    std::vector<Triangle> triangles;
    std::uint32_t left = 0, node = 0;
    for (std::uint32_t i = 0; left == 0 || i != 0; i = nodes_[i].next) ++left;
    for (std::uint32_t idle = 0; left > 2;) {
      const Node here = nodes_[node];
      if (nodes_[here.previous].corner == nodes_[here.next].corner) {
        unlink(node);  // both ways along a bridge
        unlink(here.next);
        left -= 2;
        node = here.previous;
        idle = 0;
      } else if ((idle >= left || !is_flat(node)) && is_ear(node)) {
        triangles.push_back({nodes_[here.previous].corner, here.corner, nodes_[here.next].corner});
        unlink(node);
        --left;
        node = nodes_[here.next].next;  // not the neighbour: fewer fans
        idle = 0;
      } else {
        node = here.next;
        if (++idle > 2 * left) return std::nullopt;
      }
    }
    if (!covers(corners_, triangles)) return std::nullopt;
    return triangles;
  }

  const Corners& corners_;
  std::vector<Node> nodes_;
};

}  // namespace

std::vector<std::array<std::uint32_t, 3>> triangulate_by_ears(const Polygon2& polygon) {
  if (polygon.outer.size() < 3) return {};
  const Corners corners(polygon);
  return EarClipper(corners).triangulate().value_or(std::vector<Triangle>{});
}

std::vector<std::array<std::uint32_t, 3>> triangulate(const Polygon2& polygon) {
  if (polygon.outer.size() < 3) return {};
  const Corners corners(polygon);
  auto triangles = triangulate_by_geos(polygon, corners);
  if (!triangles) triangles = EarClipper(corners).triangulate();
  return std::move(triangles).value_or(std::vector<Triangle>{});
}

}  // namespace canyon::buildings
