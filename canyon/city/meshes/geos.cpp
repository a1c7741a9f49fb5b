#include "canyon/city/meshes/geos.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

namespace canyon::meshes::geos {
namespace {

/// Makes a geometry of points with a GEOS function of their sequence.
template <typename Make>
Geometry geometry_of_points(std::vector<Point2> points, const Make& make) {
  GEOSCoordSequence* sequence =
      GEOSCoordSeq_copyFromBuffer_r(context(), points[0].data(), static_cast<unsigned>(points.size()),
                                    /*hasZ=*/0, /*hasM=*/0);
  return Geometry(sequence == nullptr ? nullptr : make(context(), sequence));
}

Geometry linear_ring(std::vector<Point2> ring) {
  if (ring.size() < 3) return nullptr;
  ring.push_back(ring[0]);
  return geometry_of_points(std::move(ring), GEOSGeom_createLinearRing_r);
}

std::vector<Point2> open_ring(const GEOSGeometry* ring, bool counter_clockwise) {
  std::vector<Point2> open = points(ring);
  if (!open.empty()) open.pop_back();
  if ((twice_area(open) > 0) != counter_clockwise) std::reverse(open.begin(), open.end());
  return open;
}

using Side = std::pair<Point2, Point2>;

bool meet(const Side& s, const Side& t) {
  const auto box = [](const Side& side) {
    return Eigen::AlignedBox2d(side.first.cwiseMin(side.second), side.first.cwiseMax(side.second));
  };
  if (!box(s).intersects(box(t))) return false;
  if (s.first == t.first || s.first == t.second || s.second == t.first || s.second == t.second) return false;
  const auto apart = [](const Side& line, const Side& other) {
    const Point2 along = line.second - line.first;
    const auto side = [&](const Point2& p) {
      return along.x() * (p.y() - line.first.y()) - along.y() * (p.x() - line.first.x());
    };
    return side(other.first) * side(other.second) > 0;
  };
  return !apart(s, t) && !apart(t, s);
}

}  // namespace

GEOSContextHandle_t context() {
  struct Context {
    GEOSContextHandle_t handle = GEOS_init_r();
    Context() = default;
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;
    ~Context() { GEOS_finish_r(handle); }
  };
  thread_local const Context context;
  return context.handle;
}

Geometry polygon(const std::vector<Point2>& outer, const std::vector<std::vector<Point2>>& holes) {
  Geometry shell = linear_ring(outer);
  if (!shell) return nullptr;
  std::vector<Geometry> rings;
  for (const auto& hole : holes) {
    rings.push_back(linear_ring(hole));
    if (!rings.back()) return nullptr;
  }
  std::vector<GEOSGeometry*> raw;
  for (Geometry& ring : rings) raw.push_back(ring.release());
  return Geometry(
      GEOSGeom_createPolygon_r(context(), shell.release(), raw.data(), static_cast<unsigned>(raw.size())));
}

Geometry line(const std::vector<Point2>& points) {
  if (points.empty()) return nullptr;
  return geometry_of_points(points,
                            points.size() == 1 ? GEOSGeom_createPoint_r : GEOSGeom_createLineString_r);
}

Geometry collection(std::vector<Geometry> polygons) {
  std::vector<GEOSGeometry*> raw;
  for (Geometry& geometry : polygons)
    if (geometry) raw.push_back(geometry.release());
  return Geometry(GEOSGeom_createCollection_r(context(), GEOS_GEOMETRYCOLLECTION, raw.data(),
                                              static_cast<unsigned>(raw.size())));
}

bool is_tangled(const std::vector<std::vector<Point2>>& rings, std::size_t maximum) {
  std::vector<Side> sides;
  Point2 lengths = Point2::Zero();
  for (const auto& ring : rings) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      sides.emplace_back(ring[i], ring[(i + 1) % ring.size()]);
      lengths += (sides.back().second - sides.back().first).cwiseAbs();
    }
  }
  maximum += 10 * sides.size();
  if (sides.size() * sides.size() <= 2 * maximum) return false;
  // A sweep along the axis on which sides are shorter.
  const int axis = lengths.x() <= lengths.y() ? 0 : 1;
  for (auto& [from, to] : sides)
    if (to[axis] < from[axis]) std::swap(from, to);
  std::sort(sides.begin(), sides.end(),
            [axis](const Side& a, const Side& b) { return a.first[axis] < b.first[axis]; });
  const std::size_t max_pairs = 10'000'000 + 1000 * sides.size();
  std::size_t pairs = 0, found = 0;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    for (std::size_t j = i + 1; j < sides.size() && sides[j].first[axis] <= sides[i].second[axis]; ++j) {
      if (meet(sides[i], sides[j])) ++found;
      if (++pairs > max_pairs || found > maximum) return true;
    }
  }
  return false;
}

std::vector<Point2> points(const GEOSGeometry* line) {
  const GEOSCoordSequence* sequence = GEOSGeom_getCoordSeq_r(context(), line);
  unsigned size = 0;
  if (sequence == nullptr || GEOSCoordSeq_getSize_r(context(), sequence, &size) == 0) return {};
  std::vector<double> buffer(2 * static_cast<std::size_t>(size));
  if (GEOSCoordSeq_copyToBuffer_r(context(), sequence, buffer.data(), 0, 0) == 0) return {};
  std::vector<Point2> result(size);
  for (std::size_t i = 0; i < size; ++i) result[i] = {buffer[2 * i], buffer[2 * i + 1]};
  return result;
}

std::vector<Polygon2> polygons(const GEOSGeometry* geometry) {
  std::vector<Polygon2> result;
  if (geometry == nullptr || GEOSisEmpty_r(context(), geometry) != 0) return result;
  const int type = GEOSGeomTypeId_r(context(), geometry);
  if (type == GEOS_POLYGON) {
    Polygon2 polygon;
    polygon.outer = open_ring(GEOSGetExteriorRing_r(context(), geometry), true);
    const int holes = GEOSGetNumInteriorRings_r(context(), geometry);
    for (int i = 0; i < holes; ++i)
      polygon.holes.push_back(open_ring(GEOSGetInteriorRingN_r(context(), geometry, i), false));
    result.push_back(std::move(polygon));
  } else if (type == GEOS_MULTIPOLYGON || type == GEOS_GEOMETRYCOLLECTION) {
    const int parts = GEOSGetNumGeometries_r(context(), geometry);
    for (int i = 0; i < parts; ++i)
      for (Polygon2& part : polygons(GEOSGetGeometryN_r(context(), geometry, i)))
        result.push_back(std::move(part));
  }
  return result;
}

}  // namespace canyon::meshes::geos
