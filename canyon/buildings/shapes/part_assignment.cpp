#include "canyon/buildings/shapes/part_assignment.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>

namespace canyon::buildings {
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
        if (boxes[b].intersection(box).isEmpty()) continue;
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
