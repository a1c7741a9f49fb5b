#include "canyon/city/buildings/shapes/footprint.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/city/meshes/geos.hpp"

namespace canyon::buildings {
namespace geos = meshes::geos;

namespace {

constexpr double kGrid_m = 1e-3;
/// Rounds as GEOS does with a grid of 1 mm: to the nearest of the numbers k / 1000, so that points snapped
/// here and in GEOS are the same doubles.
constexpr double kGridsPerMetre = 1000;
constexpr double kSliver_m2 = 0.01;
/// Mean width (twice the area over the perimeter) below which what an overlay leaves is a seam between two
/// outlines that were meant to share an edge.
constexpr double kSeam_m = 0.02;
/// A vertex is the tip of a spike when the ring turns back on itself there and the sides are this close.
constexpr double kSpike_m = 2e-3;
/// The bound of check_mesh(); on the grid such coordinates are integers of 30 bits.
constexpr double kFarthestPoint_m = 1e6;

/// The ring from a to b to c turns back at b, and its sides there are closer than kSpike_m where the shorter
/// one ends.
bool is_spike(const Point2& a, const Point2& b, const Point2& c) {
  const Point2 u = a - b, v = c - b;
  if (u.dot(v) <= 0) return false;
  const double cross = std::abs(u.x() * v.y() - u.y() * v.x());
  return cross < kSpike_m * std::max(u.norm(), v.norm());
}

struct CleanedRing {
  std::vector<Point2> ring;
  bool repeated = false;
  bool spiked = false;
};

/// Snaps to the grid, drops the closing point, repeated points and spikes. Fewer than three points may stay.
CleanedRing clean(const std::vector<Point2>& raw) {
  CleanedRing cleaned;
  std::vector<Point2>& ring = cleaned.ring;
  for (const Point2& p : raw) {
    const Point2 snapped(std::round(p.x() * kGridsPerMetre) / kGridsPerMetre,
                         std::round(p.y() * kGridsPerMetre) / kGridsPerMetre);
    if (!ring.empty() && ring.back() == snapped) {
      cleaned.repeated = true;
    } else {
      ring.push_back(snapped);
    }
  }
  while (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
  // A spike's removal may lay bare another one (or a repeated point) beside it: go back by one.
  for (std::size_t i = 0, quiet = 0; ring.size() >= 3 && quiet < ring.size();) {
    const std::size_t n = ring.size();
    i %= n;
    const Point2& a = ring[(i + n - 1) % n];
    const Point2& b = ring[i];
    const Point2& c = ring[(i + 1) % n];
    if (a == b || is_spike(a, b, c)) {
      (a == b ? cleaned.repeated : cleaned.spiked) = true;
      ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(i));
      i = i == 0 ? ring.size() - 1 : i - 1;
      quiet = 0;
    } else {
      ++i;
      ++quiet;
    }
  }
  return cleaned;
}

bool is_placed(const std::vector<Point2>& ring) {
  return std::all_of(ring.begin(), ring.end(), [](const Point2& p) {
    return std::abs(p.x()) <= kFarthestPoint_m && std::abs(p.y()) <= kFarthestPoint_m;  // false for NaN
  });
}

constexpr std::size_t kMostHoles = 3000;  // GEOS's triangulation takes the square of them

void note(std::vector<std::string>& notes, std::string_view text) {
  if (std::find(notes.begin(), notes.end(), text) == notes.end()) notes.emplace_back(text);
}

bool is_valid(const GEOSGeometry* geometry) {
  return geometry != nullptr && GEOSisValid_r(geos::context(), geometry) == 1;
}

/// The area that a ring means. A ring that crosses itself bounds all its lobes, however it winds about them:
/// GEOS's structure method, where the other one takes out what is enclosed twice.
geos::Geometry shape_of(const std::vector<Point2>& ring, bool& crossing) {
  geos::Geometry shell = geos::polygon(ring);
  crossing = shell && !is_valid(shell.get());
  if (!crossing) return shell;
  const std::unique_ptr<GEOSMakeValidParams, geos::Destroy> params(
      GEOSMakeValidParams_create_r(geos::context()));
  if (!params) return nullptr;
  GEOSMakeValidParams_setMethod_r(geos::context(), params.get(), GEOS_MAKE_VALID_STRUCTURE);
  return geos::Geometry(GEOSMakeValidWithParams_r(geos::context(), shell.get(), params.get()));
}

/// The union on the grid; snap rounding makes a vertex wherever a ring passes another's vertex.
geos::Geometry union_on_grid(std::vector<geos::Geometry> shapes) {
  const geos::Geometry all = geos::collection(std::move(shapes));
  if (!all) return nullptr;
  return geos::Geometry(GEOSUnaryUnionPrec_r(geos::context(), all.get(), kGrid_m));
}

/// Drops what is too small, and spikes that the overlay left where the polygon stays valid without them.
std::vector<Polygon2> tidy(std::vector<Polygon2> polygons, double narrowest_m) {
  std::vector<Polygon2> result;
  for (Polygon2& polygon : polygons) {
    Polygon2 tidied;
    bool changed = false;
    CleanedRing outer = clean(polygon.outer);
    changed = outer.ring.size() != polygon.outer.size();
    tidied.outer = std::move(outer.ring);
    for (const auto& hole : polygon.holes) {
      CleanedRing inner = clean(hole);
      changed = changed || inner.ring.size() != hole.size();
      if (inner.ring.size() >= 3 && -twice_area(inner.ring) >= 2 * kSliver_m2) {
        tidied.holes.push_back(std::move(inner.ring));
      }
    }
    if (tidied.outer.size() < 3) continue;
    if (changed && !is_valid(geos::polygon(tidied.outer, tidied.holes).get())) tidied = std::move(polygon);
    const double size = area(tidied);
    if (size < kSliver_m2 || 2 * size < narrowest_m * perimeter(tidied.outer)) continue;
    result.push_back(std::move(tidied));
  }
  return result;
}

/// Polygons of repair() as one valid geometry.
geos::Geometry from_repaired(const std::vector<Polygon2>& polygons) {
  std::vector<geos::Geometry> parts;
  for (const Polygon2& polygon : polygons) parts.push_back(geos::polygon(polygon.outer, polygon.holes));
  if (parts.size() == 1) return std::move(parts[0]);
  return union_on_grid(std::move(parts));
}

}  // namespace

double perimeter(const std::vector<Point2>& ring) {
  double sum = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) sum += (ring[(i + 1) % ring.size()] - ring[i]).norm();
  return sum;
}

double area(const Polygon2& polygon) {
  double twice = std::abs(twice_area(polygon.outer));
  for (const auto& hole : polygon.holes) twice -= std::abs(twice_area(hole));
  return 0.5 * twice;
}

bool is_tangled(const PolygonLists& polygons, std::size_t most) {
  std::vector<std::vector<Point2>> rings;
  const auto add = [&](const std::vector<Point2>& ring) {
    if (is_placed(ring)) rings.push_back(ring);
  };
  for (const std::vector<Polygon2>* list : polygons) {
    for (const Polygon2& polygon : *list) {
      if (polygon.holes.size() > kMostHoles) return true;
      add(polygon.outer);
      std::for_each(polygon.holes.begin(), polygon.holes.end(), add);
    }
  }
  return geos::is_tangled(rings, most);
}

std::vector<Polygon2> repair(const std::vector<Polygon2>& raw, std::vector<std::string>& notes) {
  if (is_tangled({&raw}, kMostCrossings)) {
    note(notes, "rings that cross thousands of times, or thousands of inner rings");
    return {};
  }
  std::vector<geos::Geometry> shapes;
  double area_apart = 0;
  for (const Polygon2& polygon : raw) {
    if (!is_placed(polygon.outer) || !std::all_of(polygon.holes.begin(), polygon.holes.end(),
                                                  [](const auto& hole) { return is_placed(hole); })) {
      note(notes, "outline is not within 1,000 km of the origin");
      continue;
    }
    CleanedRing outer = clean(polygon.outer);
    if (outer.repeated) note(notes, "repeated points");
    if (outer.ring.size() < 3 ||
        (outer.ring.size() == 3 && std::abs(twice_area(outer.ring)) < 2 * kSliver_m2)) {
      note(notes, "outline without area");
      continue;
    }
    if (outer.spiked) note(notes, "spikes");
    bool crossing = false;
    geos::Geometry shape = shape_of(outer.ring, crossing);
    if (crossing) note(notes, "self-crossing outline");
    if (raw.size() == 1 && polygon.holes.empty() && !crossing && shape) {
      // Nothing for GEOS to do: by far the most frequent case.
      if (twice_area(outer.ring) < 0) std::reverse(outer.ring.begin(), outer.ring.end());
      if (twice_area(outer.ring) < 2 * kSliver_m2) {
        note(notes, "outline without area");
        return {};
      }
      return {{std::move(outer.ring), {}}};
    }
    if (!shape) {
      note(notes, "outline cannot be repaired");
      continue;
    }
    std::vector<std::vector<Point2>> rings;
    std::vector<geos::Geometry> holes;
    for (const auto& hole : polygon.holes) {
      CleanedRing inner = clean(hole);
      if (inner.repeated) note(notes, "repeated points");
      if (inner.ring.size() < 3) {
        note(notes, "inner ring without area");
        continue;
      }
      if (inner.spiked) note(notes, "spikes");
      bool inner_crossing = false;
      holes.push_back(shape_of(inner.ring, inner_crossing));
      if (inner_crossing) {
        note(notes, "self-crossing inner ring");
      } else {
        rings.push_back(std::move(inner.ring));
      }
    }
    if (!holes.empty()) {
      if (!crossing && !is_valid(geos::polygon(outer.ring, rings).get())) {
        note(notes, "inner rings that meet each other or the outline");
      }
      std::vector<geos::Geometry> shells;
      shells.push_back(std::move(shape));
      const geos::Geometry solid = union_on_grid(std::move(shells));
      const geos::Geometry open = union_on_grid(std::move(holes));
      shape.reset(solid && open ? GEOSDifferencePrec_r(geos::context(), solid.get(), open.get(), kGrid_m)
                                : nullptr);
      if (!shape) {
        note(notes, "inner rings cannot be repaired");
        continue;
      }
    }
    double shape_area = 0;
    GEOSArea_r(geos::context(), shape.get(), &shape_area);
    area_apart += shape_area;
    shapes.push_back(std::move(shape));
  }
  if (shapes.empty()) {
    if (notes.empty()) notes.emplace_back("no outline");
    return {};
  }
  const std::size_t outlines = shapes.size();
  const geos::Geometry whole = union_on_grid(std::move(shapes));
  if (!whole) {
    note(notes, "outline cannot be repaired");
    return {};
  }
  std::vector<Polygon2> result = tidy(geos::polygons(whole.get()), 0);
  if (result.empty()) {
    note(notes, "outline without area");
  } else if (outlines > 1 && total_area(result) < area_apart - std::max(kSliver_m2, 1e-3 * area_apart)) {
    note(notes, "overlapping outlines");
  }
  return result;
}

namespace {

void check_overlay(const PolygonLists& polygons) {
  if (is_tangled(polygons)) throw InputError("outlines cross each other thousands of times");
}

template <typename Operation>
std::vector<Polygon2> overlay(const std::vector<Polygon2>& a, const std::vector<Polygon2>& b,
                              const Operation& operation) {
  check_overlay({&a, &b});
  const geos::Geometry first = from_repaired(a), second = from_repaired(b);
  if (!first || !second) return {};
  const geos::Geometry result(operation(geos::context(), first.get(), second.get(), kGrid_m));
  return tidy(geos::polygons(result.get()), kSeam_m);
}

}  // namespace

std::vector<Polygon2> subtract(const std::vector<Polygon2>& a, const std::vector<Polygon2>& b) {
  return a.empty() || b.empty() ? a : overlay(a, b, GEOSDifferencePrec_r);
}

std::vector<Polygon2> intersect(const std::vector<Polygon2>& a, const std::vector<Polygon2>& b) {
  return a.empty() || b.empty() ? std::vector<Polygon2>() : overlay(a, b, GEOSIntersectionPrec_r);
}

std::vector<Polygon2> unite(const std::vector<Polygon2>& a) {
  if (a.empty()) return {};
  check_overlay({&a});
  std::vector<geos::Geometry> parts;
  for (const Polygon2& polygon : a) parts.push_back(geos::polygon(polygon.outer, polygon.holes));
  const geos::Geometry whole = union_on_grid(std::move(parts));
  return tidy(geos::polygons(whole.get()), 0);
}

std::vector<Polygon2> ribbon(const std::vector<Point2>& line, double half_width_m) {
  const std::vector<Polygon2> closed{{line, {}}};
  if (line.size() < 2 || is_tangled({&closed}, kMostCrossings)) return {};
  const geos::Geometry string = geos::line(line);
  if (!string) return {};
  constexpr int kQuadrantSegments = 4;
  constexpr double kMitreLimit = 2;
  const geos::Geometry band(GEOSBufferWithStyle_r(geos::context(), string.get(), half_width_m,
                                                  kQuadrantSegments, GEOSBUF_CAP_FLAT, GEOSBUF_JOIN_MITRE,
                                                  kMitreLimit));
  std::vector<std::string> ignored;
  return repair(geos::polygons(band.get()), ignored);
}

}  // namespace canyon::buildings
