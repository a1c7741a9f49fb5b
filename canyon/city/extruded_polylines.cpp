#include "canyon/city/extruded_polylines.hpp"

#include <cstdint>

#include "canyon/meshes/geos.hpp"

namespace canyon::city {
namespace {

namespace geos = meshes::geos;

geos::Geometry closed_line(const Polyline& polyline) {
  std::vector<double> numbers;
  for (const Eigen::Vector2d& point : polyline) numbers.insert(numbers.end(), {point.x(), point.y()});
  if (polyline.front() != polyline.back()) numbers.insert(numbers.end(), {numbers[0], numbers[1]});
  return geos::Geometry(GEOSGeom_createLineString_r(
      geos::context(), GEOSCoordSeq_copyFromBuffer_r(geos::context(), numbers.data(),
                                                     static_cast<unsigned>(numbers.size() / 2), 0, 0)));
}

/// The area within an odd number of closed paths.
std::vector<meshes::Polygon2> area_within(const std::vector<Polyline>& polylines) {
  std::vector<geos::Geometry> lines;
  for (const Polyline& polyline : polylines) lines.push_back(closed_line(polyline));
  const geos::Geometry all = geos::collection(std::move(lines));
  if (!all) return {};
  const geos::Geometry crossed(GEOSNode_r(geos::context(), all.get()));  // points where paths cross
  if (!crossed) return {};
  return geos::polygons(geos::Geometry(GEOSBuildArea_r(geos::context(), crossed.get())).get());
}

/// Adds the closed surface between the plane and a height over it.
void add_extrusion(const meshes::Polygon2& polygon, double height, MeshNode& node) {
  const auto first = static_cast<std::uint32_t>(node.vertices.size());
  const auto add_ring = [&](const std::vector<meshes::Point2>& ring) {
    const auto begin = static_cast<std::uint32_t>(node.vertices.size());
    const auto size = static_cast<std::uint32_t>(ring.size());
    for (const meshes::Point2& at : ring) {
      node.vertices.emplace_back(at.x(), at.y(), 0);
      node.vertices.emplace_back(at.x(), at.y(), height);
    }
    for (std::uint32_t i = 0; i < size; ++i) {
      const std::uint32_t a = begin + 2 * i, b = begin + 2 * ((i + 1) % size);
      node.triangles.push_back({a, b, b + 1});
      node.triangles.push_back({a, b + 1, a + 1});
    }
  };
  add_ring(polygon.outer);
  for (const auto& hole : polygon.holes) add_ring(hole);
  for (const auto& [a, b, c] : meshes::triangulate(polygon)) {
    node.triangles.push_back({first + 2 * a, first + 2 * c, first + 2 * b});
    node.triangles.push_back({first + 2 * a + 1, first + 2 * b + 1, first + 2 * c + 1});
  }
}

}  // namespace

std::optional<MeshNode> extruded_polylines(const std::string& name, const std::vector<Polyline>& polylines,
                                           double height) {
  MeshNode node{name, {}, {}, {}};
  for (const meshes::Polygon2& polygon : area_within(polylines)) add_extrusion(polygon, height, node);
  if (node.triangles.empty()) return std::nullopt;
  return node;
}

}  // namespace canyon::city
