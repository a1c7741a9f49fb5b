// Declared in canyon/city/buildings/shapes/footprint.hpp.
#include "canyon/city/buildings/shapes/footprint.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <unordered_map>

#include "canyon/base/input_error.hpp"

namespace canyon::buildings {

namespace {

using geodesy::Geodetic;

constexpr std::size_t kMostTreesOfARow = 10'000;

Eigen::AlignedBox2d bounds_of(const MapData& map, bool foliage) {
  Eigen::AlignedBox2d bounds;
  for (const MapFeature& feature : map.features) {
    if (!foliage && feature.kind != FeatureKind::Building && feature.kind != FeatureKind::Part) continue;
    bounds.extend(feature.bounds());
  }
  return bounds;
}

// Half of the features with surfaces of their own reach below it: single cellars do not pull it down.
std::optional<double> surveyed_ground_m(const MapData& map) {
  std::vector<double> lowest = lowest_heights_m(map);
  if (lowest.empty()) return std::nullopt;
  const auto middle = lowest.begin() + static_cast<std::ptrdiff_t>(lowest.size() / 2);
  std::nth_element(lowest.begin(), middle, lowest.end());
  return *middle;
}

}  // namespace

std::vector<double> lowest_heights_m(const MapData& map) {
  std::vector<double> lowest;
  for (const MapFeature& feature : map.features) {
    double low = std::numeric_limits<double>::infinity();
    for (const MapSurface& surface : feature.surfaces) {
      for (const Eigen::Vector3d& corner : surface.outer) low = std::min(low, corner.z());
    }
    if (std::isfinite(low)) lowest.push_back(low);
  }
  return lowest;
}

Geodetic choose_origin(const MapData& map, const Terrain* terrain, const std::optional<Geodetic>& wanted) {
  const Eigen::AlignedBox2d bounds = bounds_of(map, true);
  if (bounds.isEmpty()) {
    throw InputError(fmt::format("{}: there is nothing to build", map.source), "give a map with buildings");
  }
  // Trees and woods do not move the origin: with and without them a city stays in place.
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
    const LonLat place((corner & 1) != 0 ? bounds.max().x() : bounds.min().x(),
                       (corner & 2) != 0 ? bounds.max().y() : bounds.min().y());
    const double away =
        frame.local_from_geodetic(Geodetic::from_degrees(place.y(), place.x(), origin.height_m)).norm();
    if (away > kFarthest_m) {
      throw InputError(
          fmt::format("{}: a corner of the map is {:.0f} km from the origin", map.source, away / 1e3),
          "a city reaches at most 200 km: choose a part of the map with --bbox, or another origin");
    }
  }
  return origin;
}

std::optional<std::size_t> SameOutlines::add(std::size_t item, const std::vector<Polygon2>& polygons,
                                             double min_height_m) {
  Seen next{item, total_area(polygons), min_height_m, {}};
  const auto collect = [&next](const std::vector<Point2>& ring) {
    for (const Point2& p : ring) {
      next.corners.emplace_back(std::llround(p.x() * 1e3), std::llround(p.y() * 1e3));
    }
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
  std::vector<Seen>& alike = by_hash_[static_cast<std::size_t>(hash)];
  for (const Seen& seen : alike) {
    if (seen.corners == next.corners && std::abs(seen.area_m2 - next.area_m2) < 0.1 &&
        seen.min_height_m == min_height_m) {
      return seen.item;
    }
  }
  alike.push_back(std::move(next));
  return std::nullopt;
}

std::vector<LonLat> tree_places(const MapFeature& feature) {
  std::vector<LonLat> places;
  if (feature.line.empty()) return places;
  if (feature.kind == FeatureKind::Tree || feature.line.size() < 2) return {feature.line.front()};
  double left_m = 0;  // along the line to the next tree
  for (std::size_t k = 0; k + 1 < feature.line.size(); ++k) {
    const LonLat &a = feature.line[k], &b = feature.line[k + 1];
    const double length_m = (geodesy::ecef_from_geodetic(Geodetic::from_degrees(b.y(), b.x(), 0)) -
                             geodesy::ecef_from_geodetic(Geodetic::from_degrees(a.y(), a.x(), 0)))
                                .norm();
    for (; left_m <= length_m && places.size() < kMostTreesOfARow; left_m += kTreeSpacing_m) {
      places.push_back(length_m > 0 ? LonLat(a + (b - a) * (left_m / length_m)) : a);
    }
    left_m -= length_m;
  }
  return places;
}

namespace {

using Box2 = Eigen::AlignedBox2d;

Box2 bounds(const std::vector<Polygon2>& polygons) {
  Box2 box;
  for (const Polygon2& polygon : polygons) {
    for (const Point2& point : polygon.outer) box.extend(point);
  }
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
    for (std::int32_t j = cell(box.min().y()); j <= cell(box.max().y()); ++j) {
      for (std::int32_t i = cell(box.min().x()); i <= cell(box.max().x()); ++i) {
        act(static_cast<std::uint64_t>(static_cast<std::uint32_t>(i)) << 32U | static_cast<std::uint32_t>(j));
      }
    }
  }

  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

}  // namespace

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
    if (building && shared >= kPartInsideShare * total_area(polygons)) assigned[p] = building;
  }
  return assigned;
}

std::vector<Polygon2> uncovered(const std::vector<Polygon2>& outline, const std::vector<Polygon2>& parts) {
  std::vector<Polygon2> left = subtract(outline, parts);
  const auto negligible = [](const Polygon2& piece) {
    double around = perimeter(piece.outer);
    for (const std::vector<Point2>& hole : piece.holes) around += perimeter(hole);
    const double size = area(piece);
    return size < kLeastPiece_m2 || 2 * size < kLeastPieceWidth_m * around;
  };
  left.erase(std::remove_if(left.begin(), left.end(), negligible), left.end());
  return left;
}

}  // namespace canyon::buildings
