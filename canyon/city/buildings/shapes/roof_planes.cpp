#include "canyon/city/buildings/shapes/roof_planes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>

#include "canyon/city/mesh_topology.hpp"

namespace canyon::buildings {
namespace {

using city::cross;

constexpr int kRoundStrips = 8;
constexpr double kHalfCompassPoint_rad = M_PI / 16;

Point2 left_of(const Point2& direction) {
  return {-direction.y(), direction.x()};
}

/// Convex hull, counter-clockwise, without points on its sides (Andrew's monotone chain).
std::vector<Point2> convex_hull(std::vector<Point2> points) {
  std::sort(points.begin(), points.end(), [](const Point2& a, const Point2& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  });
  std::vector<Point2> hull;
  for (int side = 0; side < 2; ++side) {
    const std::size_t begin = hull.size();
    for (const Point2& p : points) {
      while (hull.size() >= begin + 2 &&
             cross(hull.back() - hull[hull.size() - 2], p - hull[hull.size() - 2]) <= 0)
        hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();  // also begins the other side
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

RoofRectangle fit(const std::vector<Point2>& hull, const Point2& across) {
  RoofRectangle fitted;
  fitted.across = across;
  fitted.along = -left_of(across);
  std::array<double, 2> low{}, high{};
  for (const Point2& p : hull) {
    const std::array<double, 2> at{fitted.along.dot(p - hull[0]), across.dot(p - hull[0])};
    for (std::size_t k = 0; k < 2; ++k) {
      low[k] = std::min(low[k], at[k]);
      high[k] = std::max(high[k], at[k]);
    }
  }
  fitted.centre =
      hull[0] + 0.5 * (low[0] + high[0]) * fitted.along + 0.5 * (low[1] + high[1]) * fitted.across;
  fitted.half_length_m = 0.5 * (high[0] - low[0]);
  fitted.half_width_m = 0.5 * (high[1] - low[1]);
  return fitted;
}

RoofRectangle smallest_rectangle(const std::vector<Point2>& hull) {
  RoofRectangle best;
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Point2 side = (hull[(i + 1) % hull.size()] - hull[i]).normalized();
    const RoofRectangle fitted = fit(hull, left_of(side));
    const double area = fitted.half_length_m * fitted.half_width_m;
    // Opposite and adjacent sides give the same rectangle except for rounding: the first is kept.
    if (area < smallest * (1 - 1e-9)) {
      smallest = area;
      best = fitted;
    }
  }
  return best;
}

/// Both sides of the ridge (or of the middle along it), with height a + b |distance|.
void add_pair(std::vector<RoofPlane>& planes, const Point2& origin, const Point2& direction, double a,
              double b) {
  planes.push_back({origin, b * direction, a});
  planes.push_back({origin, -b * direction, a});
}

using Triangle = std::array<std::uint32_t, 3>;
using Edge = std::uint64_t;  ///< directed: first vertex in the upper half

constexpr std::uint32_t kNone = 0xffffffff;
constexpr double kNear_m = 1e-3;

Edge edge(std::uint32_t from, std::uint32_t to) {
  return (static_cast<Edge>(from) << 32) | to;
}

/// The lower envelope of planes over a plan. Planes are added one after another: each vertex stores by how
/// much the new plane is higher, edges on which this value changes its sign get one vertex, triangles are
/// split there, and triangles under which the new plane is lower get its number. Unnecessary splits are
/// joined at the end.
class Envelope {
 public:
  Envelope(const Plan& plan, const RoofPlane& first) : plan_(plan), points_(plan.corners) {
    heights_.reserve(points_.size());
    for (const Point2& p : points_) heights_.push_back(first.height_m(p));
    triangles_ = plan.triangles;
    faces_.assign(triangles_.size(), 0);
    for (std::uint32_t i = 0; i < points_.size(); ++i)
      rim_.emplace(edge(plan.first[i], plan.first[plan.next[i]]), i);
  }

  void lower(const RoofPlane& plane, std::uint32_t face) {
    std::vector<double> above(points_.size());
    for (std::size_t v = 0; v < points_.size(); ++v) {
      above[v] = plane.height_m(points_[v]) - heights_[v];
      if (std::abs(above[v]) < 1e-9) above[v] = 0;
    }
    snap(above);
    if (std::none_of(above.begin(), above.end(), [](double d) { return d < 0; })) return;

    std::unordered_map<Edge, std::uint32_t> cuts;
    const auto cut = [&](std::uint32_t from, std::uint32_t to) {
      const std::uint32_t a = std::min(from, to), b = std::max(from, to);
      const auto [at, is_new] = cuts.emplace(edge(a, b), static_cast<std::uint32_t>(points_.size()));
      if (is_new) {
        points_.push_back(points_[a] + above[a] / (above[a] - above[b]) * (points_[b] - points_[a]));
        heights_.push_back(plane.height_m(points_.back()));
        for (const Edge directed : {edge(a, b), edge(b, a)}) {
          const auto rim = rim_.find(directed);
          if (rim == rim_.end()) continue;
          const std::uint32_t begin = rim->second;
          rim_.emplace(edge(static_cast<std::uint32_t>(directed >> 32), at->second), begin);
          rim_.emplace(edge(at->second, static_cast<std::uint32_t>(directed & kNone)), begin);
        }
      }
      return at->second;
    };
    std::vector<Triangle> triangles;
    std::vector<std::uint32_t> faces;
    const auto add = [&](const Triangle& triangle, std::uint32_t of) {
      triangles.push_back(triangle);
      faces.push_back(of);
    };
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      Triangle triangle = triangles_[t];
      const auto sign = [&](std::size_t k) {
        const double d = above[triangle[k % 3]];
        return d > 0 ? 1 : d < 0 ? -1 : 0;
      };
      const auto face_of = [&](int side) { return side < 0 ? face : faces_[t]; };
      const int lowest = std::min({sign(0), sign(1), sign(2)}),
                highest = std::max({sign(0), sign(1), sign(2)});
      if (lowest >= 0 || highest <= 0) {
        add(triangle, face_of(lowest));
        continue;
      }
      // Rotates the corner that is alone on its side, or the one on the plane, to the front.
      while (sign(0) != 0 && !(sign(1) != sign(0) && sign(2) != sign(0) && sign(1) != 0 && sign(2) != 0))
        std::rotate(triangle.begin(), triangle.begin() + 1, triangle.end());
      const auto [a, b, c] = triangle;
      if (sign(0) == 0) {
        const std::uint32_t m = cut(b, c);
        add({a, b, m}, face_of(sign(1)));
        add({a, m, c}, face_of(sign(2)));
      } else {
        const std::uint32_t m = cut(a, b), n = cut(a, c);
        add({a, m, n}, face_of(sign(0)));
        add({m, b, c}, face_of(sign(1)));
        add({m, c, n}, face_of(sign(1)));
      }
    }
    for (std::size_t v = 0; v < above.size(); ++v)
      if (above[v] < 0) heights_[v] += above[v];
    triangles_ = std::move(triangles);
    faces_ = std::move(faces);
  }

  RoofSurface finish(const std::vector<RoofPlane>& planes, double highest_m) {
    if (points_.size() > plan_.corners.size()) join_faces();
    RoofSurface surface;
    std::vector<std::uint32_t> index(points_.size(), kNone);
    const auto put = [&](std::uint32_t v) {
      if (index[v] != kNone) return index[v];
      index[v] = static_cast<std::uint32_t>(surface.vertices.size());
      // Recomputed from the planes: exact at corners that cuts pass through.
      double height = highest_m;
      for (const RoofPlane& plane : planes) height = std::min(height, plane.height_m(points_[v]));
      surface.vertices.emplace_back(points_[v].x(), points_[v].y(), std::max(0.0, height));
      return index[v];
    };
    for (std::uint32_t v = 0; v < plan_.corners.size(); ++v) put(v);
    for (const Triangle& t : triangles_) surface.triangles.push_back({put(t[0]), put(t[1]), put(t[2])});

    surface.on_edge.resize(plan_.corners.size());
    std::vector<std::vector<std::pair<double, std::uint32_t>>> inserted(plan_.corners.size());
    for (const auto& [directed, begin] : rim_) {
      const auto v = static_cast<std::uint32_t>(directed >> 32);  // each added vertex begins one final edge
      if (v < plan_.corners.size() || index[v] == kNone) continue;
      inserted[begin].emplace_back((points_[v] - plan_.corners[begin]).squaredNorm(), index[v]);
    }
    for (std::size_t i = 0; i < inserted.size(); ++i) {
      std::sort(inserted[i].begin(), inserted[i].end());
      for (const auto& [distance, v] : inserted[i])
        if (surface.on_edge[i].empty() || surface.on_edge[i].back() != v) surface.on_edge[i].push_back(v);
    }
    return surface;
  }

 private:
  /// Moves the plane through vertices that it would miss by less than 1 mm along an edge, so that vertices
  /// are at least 1 mm apart there.
  void snap(std::vector<double>& above) const {
    std::vector<std::uint32_t> on_plane;
    for (const Triangle& t : triangles_) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = t[k], b = t[(k + 1) % 3];
        if (above[a] * above[b] >= 0) continue;
        const double length = (points_[b] - points_[a]).norm();
        const double fraction = above[a] / (above[a] - above[b]);
        if (fraction * length < kNear_m) on_plane.push_back(a);
        if ((1 - fraction) * length < kNear_m) on_plane.push_back(b);
      }
    }
    for (const std::uint32_t v : on_plane) above[v] = 0;
  }

  /// Joins triangles of one face and retriangulates with as few vertices as possible: added vertices stay
  /// where three faces meet and where two meet on the rim. Changes nothing if this fails.
  void join_faces() {
    const auto count = static_cast<std::uint32_t>(3 * triangles_.size());
    std::unordered_map<Edge, std::uint32_t> half_edges;  // 3 * triangle + corner
    half_edges.reserve(count);
    const auto directed = [this](std::uint32_t h) {
      return edge(triangles_[h / 3][h % 3], triangles_[h / 3][(h + 1) % 3]);
    };
    for (std::uint32_t h = 0; h < count; ++h) half_edges.emplace(directed(h), h);
    std::vector<std::uint32_t> twins(count, kNone);
    std::vector<char> is_border(count, 1);
    std::vector<std::uint32_t> leaving(points_.size(), 0);  // borders that leave each vertex
    std::vector<char> on_rim(points_.size(), 0);
    for (std::uint32_t h = 0; h < count; ++h) {
      const Edge e = directed(h);
      const auto twin = half_edges.find((e << 32) | (e >> 32));
      if (twin == half_edges.end()) {
        on_rim[triangles_[h / 3][h % 3]] = 1;
      } else {
        twins[h] = twin->second;
        is_border[h] = faces_[h / 3] != faces_[twin->second / 3] ? 1 : 0;
      }
      if (is_border[h] != 0) ++leaving[triangles_[h / 3][h % 3]];
    }
    const auto stays = [&](std::uint32_t v) {
      return v < plan_.corners.size() || leaving[v] > (on_rim[v] != 0 ? 1U : 2U);
    };

    std::vector<Triangle> triangles;
    std::vector<char> visited(triangles_.size(), 0);
    std::vector<char> walked(count, 0);
    for (std::uint32_t seed = 0; seed < triangles_.size(); ++seed) {
      if (visited[seed] != 0) continue;
      std::vector<std::uint32_t> region{seed};
      visited[seed] = 1;
      for (std::size_t i = 0; i < region.size(); ++i) {
        for (std::uint32_t h = 3 * region[i]; h < 3 * region[i] + 3; ++h) {
          if (is_border[h] != 0 || visited[twins[h] / 3] != 0) continue;
          visited[twins[h] / 3] = 1;
          region.push_back(twins[h] / 3);
        }
      }
      Polygon2 polygon;
      std::vector<std::uint32_t> outer, inner;
      for (const std::uint32_t t : region) {
        for (std::uint32_t start = 3 * t; start < 3 * t + 3; ++start) {
          if (is_border[start] == 0 || walked[start] != 0) continue;
          std::vector<std::uint32_t> loop;
          std::vector<Point2> ring;
          for (std::uint32_t h = start; walked[h] == 0;) {
            walked[h] = 1;
            const std::uint32_t v = triangles_[h / 3][h % 3];
            if (stays(v)) {
              loop.push_back(v);
              ring.push_back(points_[v]);
            }
            h = following(h);
            while (is_border[h] == 0) h = following(twins[h]);
          }
          if (ring.size() < 3) return;
          if (twice_area(ring) > 0) {
            if (!polygon.outer.empty()) return;
            polygon.outer = std::move(ring);
            outer = std::move(loop);
          } else {
            polygon.holes.push_back(std::move(ring));
            inner.insert(inner.end(), loop.begin(), loop.end());
          }
        }
      }
      if (outer.size() == 3 && inner.empty()) {
        triangles.push_back({outer[0], outer[1], outer[2]});
        continue;
      }
      outer.insert(outer.end(), inner.begin(), inner.end());
      const auto pieces = triangulate(polygon);
      if (pieces.empty()) return;
      for (const Triangle& piece : pieces)
        triangles.push_back({outer[piece[0]], outer[piece[1]], outer[piece[2]]});
    }
    triangles_ = std::move(triangles);
  }

  static std::uint32_t following(std::uint32_t half_edge) {
    return half_edge % 3 == 2 ? half_edge - 2 : half_edge + 1;
  }

  const Plan& plan_;
  std::vector<Point2> points_;
  std::vector<double> heights_;
  std::vector<Triangle> triangles_;
  std::vector<std::uint32_t> faces_;  ///< plane of each triangle
  std::unordered_map<Edge, std::uint32_t>
      rim_;  ///< corner at which the ring edge under a directed edge begins
};

/// Area and centroid about the first corner.
Point2 centroid(const std::vector<Point2>& ring, double& area) {
  Point2 sum = Point2::Zero();
  area = 0;
  for (std::size_t i = 1; i + 1 < ring.size(); ++i) {
    const Point2 a = ring[i] - ring[0], b = ring[i + 1] - ring[0];
    const double half = 0.5 * (a.x() * b.y() - a.y() * b.x());
    area += half;
    sum += half / 3 * (a + b);
  }
  return ring[0] + sum / area;
}

}  // namespace

RoofRectangle roof_rectangle(const std::vector<Point2>& outer, const Shape& shape) {
  const std::vector<Point2> hull = convex_hull(outer);
  const RoofRectangle smallest = smallest_rectangle(hull);
  if (shape.roof_direction_rad) {
    Point2 down(std::sin(*shape.roof_direction_rad), std::cos(*shape.roof_direction_rad));
    for (const Point2& side : {smallest.along, smallest.across}) {
      for (const Point2& towards : {side, Point2(-side)})
        if (towards.dot(down) >= std::cos(kHalfCompassPoint_rad)) down = towards;
    }
    return fit(hull, down);
  }
  const bool longer_is_along = smallest.half_length_m >= smallest.half_width_m;
  Point2 across = longer_is_along != shape.roof_across ? smallest.across : smallest.along;
  if (across.y() > 0 || (across.y() == 0 && across.x() > 0)) across = -across;
  return fit(hull, across);
}

bool set_roof_by_angle(Shape& shape, const std::vector<Point2>& outer) {
  if (!shape.roof_angle_rad) return true;
  const RoofRectangle rectangle = roof_rectangle(outer, shape);
  double run_m = rectangle.half_width_m;
  if (shape.roof == RoofShape::Skillion) run_m *= 2;
  if (shape.roof == RoofShape::Hipped || shape.roof == RoofShape::Mansard ||
      shape.roof == RoofShape::Pyramidal)
    run_m = std::min(run_m, rectangle.half_length_m);
  const double rise_m = run_m * std::tan(*shape.roof_angle_rad);
  const double added_m = shape.height_source == HeightSource::Levels ? rise_m - shape.roof_height_m : 0;
  if (shape.height_m + added_m - rise_m < shape.min_height_m) return false;
  shape.height_m += added_m;
  shape.roof_height_m = rise_m;
  return true;
}

std::vector<RoofPlane> roof_planes(RoofShape shape, const RoofRectangle& rectangle, double rise_m) {
  const double w = rectangle.half_width_m, l = rectangle.half_length_m, run = std::min(w, l), rise = rise_m;
  const Point2& o = rectangle.centre;
  const Point2 &along = rectangle.along, &across = rectangle.across;
  std::vector<RoofPlane> planes;
  // rise (from + slope * distance / run), with distance measured inwards from the sides.
  const auto add_slopes = [&](bool all_sides, double from, double slope) {
    const double reach = all_sides ? run : w;
    add_pair(planes, o, across, rise * (from + slope * w / reach), -rise * slope / reach);
    if (all_sides) add_pair(planes, o, along, rise * (from + slope * l / reach), -rise * slope / reach);
  };
  switch (shape) {
    case RoofShape::Skillion:
      planes.push_back({o, -rise / (2 * w) * across, 0.5 * rise});
      break;
    case RoofShape::Gabled:
      add_slopes(false, 0, 1);
      break;
    case RoofShape::Hipped:
      add_slopes(true, 0, 1);
      break;
    case RoofShape::Pyramidal:
      add_pair(planes, o, across, rise, -rise / w);
      add_pair(planes, o, along, rise, -rise / l);
      break;
    case RoofShape::Gambrel:
    case RoofShape::Mansard: {
      // 0.75 rise at half the run: 1.5 d below, 0.5 + 0.5 d above.
      const bool all_sides = shape == RoofShape::Mansard;
      add_slopes(all_sides, 0, 1.5);
      add_slopes(all_sides, 0.5, 0.5);
      break;
    }
    case RoofShape::Round:
      for (int i = 0; i < kRoundStrips; ++i) {
        const double from = M_PI * i / kRoundStrips, to = M_PI * (i + 1) / kRoundStrips;
        const double y0 = -w * std::cos(from), y1 = -w * std::cos(to);
        const double slope = rise * (std::sin(to) - std::sin(from)) / (y1 - y0);
        planes.push_back({o, slope * across, rise * std::sin(from) - slope * y0});
      }
      break;
    case RoofShape::Flat:
    case RoofShape::Dome:
    case RoofShape::Onion:
      break;
  }
  return planes;
}

Plan::Plan(const Polygon2& polygon)
    : corners(polygon.outer), triangles(triangulate(polygon)), has_holes(!polygon.holes.empty()) {
  for (const auto& hole : polygon.holes) corners.insert(corners.end(), hole.begin(), hole.end());
  const auto add_ring = [this](std::size_t size) {
    const auto begin = static_cast<std::uint32_t>(next.size());
    for (std::uint32_t i = 1; i < size; ++i) next.push_back(begin + i);
    next.push_back(begin);
  };
  add_ring(polygon.outer.size());
  for (const auto& hole : polygon.holes) add_ring(hole.size());
  first.resize(corners.size());
  for (std::uint32_t i = 0; i < first.size(); ++i) first[i] = i;
  if (!has_holes) return;  // a single ring never touches itself
  std::vector<std::uint32_t> order = first;
  std::sort(order.begin(), order.end(), [this](std::uint32_t a, std::uint32_t b) {
    const Point2 &p = corners[a], &q = corners[b];
    return p.x() != q.x() ? p.x() < q.x() : p.y() != q.y() ? p.y() < q.y() : a < b;
  });
  for (std::size_t k = 1; k < order.size(); ++k)
    if (corners[order[k]] == corners[order[k - 1]]) first[order[k]] = first[order[k - 1]];
}

RoofSurface flat_surface(const Plan& plan, double height_m) {
  RoofSurface surface;
  surface.vertices.reserve(plan.corners.size());
  for (const Point2& p : plan.corners) surface.vertices.emplace_back(p.x(), p.y(), height_m);
  surface.triangles = plan.triangles;
  surface.on_edge.resize(plan.corners.size());
  return surface;
}

RoofSurface surface_of_planes(const Plan& plan, const std::vector<RoofPlane>& planes, double highest_m) {
  Envelope envelope(plan, planes.front());
  for (std::uint32_t k = 1; k < planes.size(); ++k) envelope.lower(planes[k], k);
  return envelope.finish(planes, highest_m);
}

RoofProfile dome_profile(double rise_m) {
  constexpr int kSteps = 8;
  RoofProfile profile;
  for (int i = 0; i < kSteps; ++i) {
    const double angle = 0.5 * M_PI * i / kSteps;
    profile.emplace_back(std::cos(angle), rise_m * std::sin(angle));
  }
  profile.emplace_back(0, rise_m);
  return profile;
}

RoofProfile onion_profile(double rise_m) {
  RoofProfile profile{{1, 0},      {1.12, 0.1}, {1.18, 0.2}, {1.15, 0.3}, {1.03, 0.4}, {0.83, 0.5},
                      {0.58, 0.6}, {0.34, 0.7}, {0.17, 0.8}, {0.07, 0.9}, {0, 1}};
  for (auto& ring : profile) ring.y() *= rise_m;
  return profile;
}

RoofProfile spire_profile(double rise_m) {
  return {{1, 0}, {0, rise_m}};
}

std::optional<RoofSurface> surface_of_profile(const Plan& plan, const RoofProfile& profile) {
  if (plan.has_holes) return std::nullopt;
  const std::vector<Point2>& outline = plan.corners;
  double area = 0;
  const Point2 centre = centroid(outline, area);
  const double nearest = 0.01 * std::sqrt(area);
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Point2 a = outline[i] - centre, b = outline[plan.next[i]] - centre;
    if (!(a.x() * b.y() - a.y() * b.x() >= nearest * (b - a).norm())) return std::nullopt;
  }
  RoofSurface surface = flat_surface(plan);
  surface.triangles.clear();
  const auto n = static_cast<std::uint32_t>(outline.size());
  for (std::uint32_t ring = 1; ring < profile.size(); ++ring) {
    const bool tip = ring + 1 == profile.size();
    const std::uint32_t below = (ring - 1) * n, here = ring * n;
    for (std::uint32_t i = 0; i < (tip ? 1 : n); ++i) {
      const Point2 p = centre + profile[ring].x() * (outline[i] - centre);
      surface.vertices.emplace_back(p.x(), p.y(), profile[ring].y());
    }
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t j = plan.next[i];
      if (tip) {
        surface.triangles.push_back({below + i, below + j, here});
      } else {
        surface.triangles.push_back({below + i, below + j, here + j});
        surface.triangles.push_back({below + i, here + j, here + i});
      }
    }
  }
  return surface;
}

}  // namespace canyon::buildings
