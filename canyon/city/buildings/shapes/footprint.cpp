#include "canyon/city/buildings/shapes/footprint.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include "canyon/base/input_error.hpp"
#include "canyon/city/meshes/geos.hpp"

namespace canyon::buildings {
namespace {

namespace geos = meshes::geos;
using geodesy::Geodetic;

constexpr std::size_t kMaxTreesOfARow = 10'000;

Eigen::AlignedBox2d bounds_of(const MapData& map, bool foliage) {
  Eigen::AlignedBox2d bounds;
  for (const MapFeature& feature : map.features) {
    if (!foliage && feature.kind != FeatureKind::Building && feature.kind != FeatureKind::Part) continue;
    bounds.extend(feature.bounds());
  }
  return bounds;
}

// The median of the lowest heights: a single cellar does not lower it.
std::optional<double> surveyed_ground_m(const MapData& map) {
  std::vector<double> lowest = lowest_heights_m(map);
  if (lowest.empty()) return std::nullopt;
  const auto middle = lowest.begin() + static_cast<std::ptrdiff_t>(lowest.size() / 2);
  std::nth_element(lowest.begin(), middle, lowest.end());
  return *middle;
}

constexpr double kGrid_m = 1e-3;
/// Rounds as GEOS does with a grid of 1 mm, to the nearest k / 1000, so that both snap to the same doubles.
constexpr double kGridsPerMetre = 1000;
constexpr double kSliver_m2 = 0.01;
/// Mean width (twice the area over the perimeter) below which a piece of an overlay is a gap between two
/// outlines that should share an edge.
constexpr double kSeam_m = 0.02;
/// A vertex is the tip of a spike if the ring turns back there and the sides are this close.
constexpr double kSpike_m = 2e-3;
/// The limit of check_mesh(); on the grid such coordinates are integers of 30 bits.
constexpr double kFarthestPoint_m = 1e6;

/// The ring from a to b to c turns back at b, and at the end of the shorter side the sides are closer than
/// kSpike_m.
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

/// Snaps to the grid, drops the closing point, repeated points and spikes. May leave less than three points.
CleanedRing clean(const std::vector<Point2>& raw) {
  CleanedRing cleaned;
  std::vector<Point2>& ring = cleaned.ring;
  for (const Point2& p : raw) {
    const Point2 snapped(std::round(p.x() * kGridsPerMetre) / kGridsPerMetre,
                         std::round(p.y() * kGridsPerMetre) / kGridsPerMetre);
    if (!ring.empty() && ring.back() == snapped)
      cleaned.repeated = true;
    else
      ring.push_back(snapped);
  }
  while (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
  // Removing a spike may expose another one (or a repeated point) next to it: go back by one.
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

bool is_located(const std::vector<Point2>& ring) {
  return std::all_of(ring.begin(), ring.end(), [](const Point2& p) {
    return std::abs(p.x()) <= kFarthestPoint_m && std::abs(p.y()) <= kFarthestPoint_m;  // false for NaN
  });
}

constexpr std::size_t kMaxHoles = 3000;  // GEOS's triangulation takes the square of them

void note(std::vector<std::string>& notes, std::string_view text) {
  if (std::find(notes.begin(), notes.end(), text) == notes.end()) notes.emplace_back(text);
}

bool is_valid(const GEOSGeometry* geometry) {
  return geometry != nullptr && GEOSisValid_r(geos::context(), geometry) == 1;
}

/// The area inside a ring. A ring that crosses itself bounds all its lobes, whatever their winding (GEOS's
/// structure method); the other method subtracts areas enclosed twice.
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

/// The union on the grid; snap rounding adds a vertex if a ring passes another's vertex.
geos::Geometry union_on_grid(std::vector<geos::Geometry> shapes) {
  const geos::Geometry all = geos::collection(std::move(shapes));
  if (!all) return nullptr;
  return geos::Geometry(GEOSUnaryUnionPrec_r(geos::context(), all.get(), kGrid_m));
}

/// Drops small pieces, and spikes left by the overlay if the polygon stays valid without them.
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
      if (inner.ring.size() >= 3 && -twice_area(inner.ring) >= 2 * kSliver_m2)
        tidied.holes.push_back(std::move(inner.ring));
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

using Box2 = Eigen::AlignedBox2d;

Box2 bounds(const std::vector<Polygon2>& polygons) {
  Box2 box;
  for (const Polygon2& polygon : polygons)
    for (const Point2& point : polygon.outer) box.extend(point);
  return box;
}

// Buildings by the cells of a square grid that their bounds touch.
class Grid2 {
 public:
  void add(std::uint32_t index, const Box2& box) {
    for_cells(box, [&](std::uint64_t cell) { cells_[cell].push_back(index); });
  }
  // Indices in ascending order, each once.
  [[nodiscard]] std::vector<std::uint32_t> near(const Box2& box) const {
    std::vector<std::uint32_t> found;
    for_cells(box, [&](std::uint64_t cell) {
      const auto it = cells_.find(cell);
      if (it != cells_.end()) found.insert(found.end(), it->second.begin(), it->second.end());
    });
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  }

 private:
  static constexpr double kCell_m = 100;

  template <typename Do>
  static void for_cells(const Box2& box, const Do& act) {
    if (box.isEmpty()) return;
    const auto cell = [](double x) { return static_cast<std::int32_t>(std::floor(x / kCell_m)); };
    for (std::int32_t j = cell(box.min().y()); j <= cell(box.max().y()); ++j)
      for (std::int32_t i = cell(box.min().x()); i <= cell(box.max().x()); ++i)
        act(static_cast<std::uint64_t>(static_cast<std::uint32_t>(i)) << 32U | static_cast<std::uint32_t>(j));
  }

  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

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

bool is_tangled(const PolygonLists& polygons, std::size_t maximum) {
  std::vector<std::vector<Point2>> rings;
  const auto add = [&](const std::vector<Point2>& ring) {
    if (is_located(ring)) rings.push_back(ring);
  };
  for (const std::vector<Polygon2>* list : polygons) {
    for (const Polygon2& polygon : *list) {
      if (polygon.holes.size() > kMaxHoles) return true;
      add(polygon.outer);
      std::for_each(polygon.holes.begin(), polygon.holes.end(), add);
    }
  }
  return geos::is_tangled(rings, maximum);
}

std::vector<Polygon2> repair(const std::vector<Polygon2>& raw, std::vector<std::string>& notes) {
  if (is_tangled({&raw}, kMaxCrossings)) {
    note(notes, "rings that cross thousands of times, or thousands of inner rings");
    return {};
  }
  std::vector<geos::Geometry> shapes;
  double area_apart = 0;
  for (const Polygon2& polygon : raw) {
    if (!is_located(polygon.outer) || !std::all_of(polygon.holes.begin(), polygon.holes.end(),
                                                   [](const auto& hole) { return is_located(hole); })) {
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
      // Nothing to do for GEOS: by far the most frequent case.
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
      if (inner_crossing)
        note(notes, "self-crossing inner ring");
      else
        rings.push_back(std::move(inner.ring));
    }
    if (!holes.empty()) {
      if (!crossing && !is_valid(geos::polygon(outer.ring, rings).get()))
        note(notes, "inner rings that meet each other or the outline");
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
  if (result.empty())
    note(notes, "outline without area");
  else if (outlines > 1 && total_area(result) < area_apart - std::max(kSliver_m2, 1e-3 * area_apart))
    note(notes, "overlapping outlines");
  return result;
}

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
  if (line.size() < 2 || is_tangled({&closed}, kMaxCrossings)) return {};
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

std::vector<double> lowest_heights_m(const MapData& map) {
  std::vector<double> lowest;
  for (const MapFeature& feature : map.features) {
    double low = std::numeric_limits<double>::infinity();
    for (const MapSurface& surface : feature.surfaces)
      for (const Eigen::Vector3d& corner : surface.outer) low = std::min(low, corner.z());
    if (std::isfinite(low)) lowest.push_back(low);
  }
  return lowest;
}

Geodetic choose_origin(const MapData& map, const Terrain* terrain, const std::optional<Geodetic>& wanted) {
  const Eigen::AlignedBox2d bounds = bounds_of(map, true);
  if (bounds.isEmpty())
    throw InputError(fmt::format("{}: nothing to build", map.source), "give a map with buildings");
  // Trees and woods do not move the origin, so that a city keeps its position with and without them.
  const Eigen::AlignedBox2d built = bounds_of(map, false);
  const LonLat middle = (built.isEmpty() ? bounds : built).center();
  Geodetic origin;
  if (wanted) {
    origin = *wanted;
  } else {
    origin = Geodetic::from_degrees(middle.y(), longitude_near(middle.x(), 0), 0);
    if (terrain == nullptr) {
      origin.height_m = surveyed_ground_m(map).value_or(0);
    } else if (const std::optional<double> height = terrain->height_m(middle)) {
      origin.height_m = *height;
    } else if (const std::optional<double> surveyed = surveyed_ground_m(map)) {
      origin.height_m = *surveyed;
    } else {
      std::string why;  // fill values, another unit
      for (const std::string& caution : terrain->notes().lines(ReadReport::Level::Loss))
        why += "; " + caution;
      throw InputError(fmt::format("the terrain has no height at the middle of the map ({:.6f}, {:.6f}){}",
                                   middle.y(), middle.x(), why),
                       "give rasters that cover the buildings, or an origin with its height");
    }
  }
  const geodesy::LocalFrame frame(origin);
  for (int corner = 0; corner < 4; ++corner) {
    const LonLat point((corner & 1) != 0 ? bounds.max().x() : bounds.min().x(),
                       (corner & 2) != 0 ? bounds.max().y() : bounds.min().y());
    const double away =
        frame.local_from_geodetic(Geodetic::from_degrees(point.y(), point.x(), origin.height_m)).norm();
    if (away > kFarthest_m) {
      throw InputError(
          fmt::format("{}: a corner of the map is {:.0f} km from the origin", map.source, away / 1e3),
          "the limit is 200 km: choose a part of the map with --bbox, or another origin");
    }
  }
  return origin;
}

std::optional<std::size_t> SameOutlines::add(std::size_t item, const std::vector<Polygon2>& polygons,
                                             double min_height_m) {
  VisitedPoint next{item, total_area(polygons), min_height_m, {}};
  const auto collect = [&next](const std::vector<Point2>& ring) {
    for (const Point2& p : ring)
      next.corners.emplace_back(std::llround(p.x() * 1e3), std::llround(p.y() * 1e3));
  };
  for (const Polygon2& polygon : polygons) {
    collect(polygon.outer);
    for (const auto& hole : polygon.holes) collect(hole);
  }
  std::sort(next.corners.begin(), next.corners.end());
  std::uint64_t hash = next.corners.size();
  for (const auto& [x, y] : next.corners) {
    hash =
        (hash ^ static_cast<std::uint64_t>(x) * 73'856'093U ^ static_cast<std::uint64_t>(y) * 19'349'663U) *
        0x9E3779B97F4A7C15ULL;
  }
  std::vector<VisitedPoint>& alike = by_hash_[static_cast<std::size_t>(hash)];
  for (const VisitedPoint& seen : alike)
    if (seen.corners == next.corners && std::abs(seen.area_m2 - next.area_m2) < 0.1 &&
        seen.min_height_m == min_height_m)
      return seen.item;
  alike.push_back(std::move(next));
  return std::nullopt;
}

std::vector<LonLat> tree_positions(const MapFeature& feature) {
  std::vector<LonLat> positions;
  if (feature.line.empty()) return positions;
  if (feature.kind == FeatureKind::Tree || feature.line.size() < 2) return {feature.line.front()};
  double left_m = 0;  // along the line to the next tree
  for (std::size_t k = 0; k + 1 < feature.line.size(); ++k) {
    const LonLat &a = feature.line[k], &b = feature.line[k + 1];
    const double length_m = (geodesy::ecef_from_geodetic(Geodetic::from_degrees(b.y(), b.x(), 0)) -
                             geodesy::ecef_from_geodetic(Geodetic::from_degrees(a.y(), a.x(), 0)))
                                .norm();
    for (; left_m <= length_m && positions.size() < kMaxTreesOfARow; left_m += kTreeSpacing_m)
      positions.push_back(length_m > 0 ? LonLat(a + (b - a) * (left_m / length_m)) : a);
    left_m -= length_m;
  }
  return positions;
}

double total_area(const std::vector<Polygon2>& polygons) {
  double sum = 0;
  for (const Polygon2& polygon : polygons) sum += area(polygon);
  return sum;
}

std::vector<std::optional<std::size_t>> assign_parts(const std::vector<Outline>& buildings,
                                                     const std::vector<Outline>& parts) {
  std::vector<std::optional<std::size_t>> assigned(parts.size());
  if (parts.empty() || buildings.empty()) return assigned;
  std::unordered_map<std::string, std::vector<std::uint32_t>> by_name;
  std::vector<Box2> boxes(buildings.size());
  Grid2 grid;
  for (std::uint32_t b = 0; b < buildings.size(); ++b) {
    boxes[b] = bounds(*buildings[b].polygons);
    grid.add(b, boxes[b]);
    by_name[*buildings[b].id].push_back(b);
    if (!buildings[b].belongs_to->empty()) by_name[*buildings[b].belongs_to].push_back(b);
  }
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const std::vector<Polygon2>& polygons = *parts[p].polygons;
    const Box2 box = bounds(polygons);
    const auto largest = [&](const std::vector<std::uint32_t>& candidates) {
      std::pair<double, std::optional<std::size_t>> best{0, std::nullopt};
      for (const std::uint32_t b : candidates) {
        if (boxes[b].intersection(box).isEmpty() || is_tangled({buildings[b].polygons, &polygons})) continue;
        const double shared = total_area(intersect(*buildings[b].polygons, polygons));
        if (shared > best.first) best = {shared, b};
      }
      return best;
    };
    if (!parts[p].belongs_to->empty()) {
      const auto named = by_name.find(*parts[p].belongs_to);
      if (named != by_name.end()) {
        assigned[p] = named->second.size() == 1 ? named->second.front() : largest(named->second).second;
        if (!assigned[p]) assigned[p] = named->second.front();
        continue;
      }
    }
    const auto [shared, building] = largest(grid.near(box));
    if (building && shared >= kPartInsideFraction * total_area(polygons)) assigned[p] = building;
  }
  return assigned;
}

std::vector<Polygon2> uncovered(const std::vector<Polygon2>& outline, const std::vector<Polygon2>& parts) {
  std::vector<Polygon2> left = subtract(outline, parts);
  const auto negligible = [](const Polygon2& piece) {
    double around = perimeter(piece.outer);
    for (const std::vector<Point2>& hole : piece.holes) around += perimeter(hole);
    const double size = area(piece);
    return size < kMinPiece_m2 || 2 * size < kMinPieceWidth_m * around;
  };
  left.erase(std::remove_if(left.begin(), left.end(), negligible), left.end());
  return left;
}

}  // namespace canyon::buildings
