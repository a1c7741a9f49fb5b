#include "canyon/city/extruded_polylines.hpp"

#include <geos_c.h>

#include <array>
#include <cstdint>
#include <memory>
#include <utility>

namespace canyon::city {
namespace {

struct DestroyContext {
  void operator()(GEOSContextHandle_HS* context) const { GEOS_finish_r(context); }
};
struct DestroyGeometry {
  GEOSContextHandle_t context = nullptr;
  void operator()(GEOSGeometry* geometry) const { GEOSGeom_destroy_r(context, geometry); }
};
using Geometry = std::unique_ptr<GEOSGeometry, DestroyGeometry>;

/// Polygons in the plane as a closed surface between two heights.
class Extrusion {
 public:
  Extrusion(GEOSContextHandle_t context, std::string name, double height)
      : context_(context), height_(height), node_{std::move(name), {}, {}, {}} {}

  /// The area within an odd number of closed paths, as polygons.
  [[nodiscard]] Geometry area(const std::vector<Polyline>& polylines) const {
    std::vector<GEOSGeometry*> lines;
    lines.reserve(polylines.size());
    for (const Polyline& polyline : polylines) lines.push_back(closed_line(polyline).release());
    const Geometry all = own(GEOSGeom_createCollection_r(context_, GEOS_MULTILINESTRING, lines.data(),
                                                         static_cast<unsigned>(lines.size())));
    if (!all) return own(nullptr);
    const Geometry crossed = own(GEOSNode_r(context_, all.get()));  // points where paths cross
    return crossed ? own(GEOSBuildArea_r(context_, crossed.get())) : own(nullptr);
  }

  void add(const GEOSGeometry* area) {
    for (int i = 0; i < GEOSGetNumGeometries_r(context_, area); ++i) {
      const GEOSGeometry* polygon = GEOSGetGeometryN_r(context_, area, i);
      if (GEOSGeomTypeId_r(context_, polygon) != GEOS_POLYGON) continue;
      add_caps(polygon);
      add_walls(GEOSGetExteriorRing_r(context_, polygon));
      for (int k = 0; k < GEOSGetNumInteriorRings_r(context_, polygon); ++k)
        add_walls(GEOSGetInteriorRingN_r(context_, polygon, k));
    }
  }

  [[nodiscard]] MeshNode take() { return std::move(node_); }

 private:
  [[nodiscard]] Geometry own(GEOSGeometry* geometry) const { return {geometry, DestroyGeometry{context_}}; }

  [[nodiscard]] Geometry closed_line(const Polyline& polyline) const {
    std::vector<double> numbers;
    for (const Eigen::Vector2d& point : polyline) numbers.insert(numbers.end(), {point.x(), point.y()});
    if (polyline.front() != polyline.back()) numbers.insert(numbers.end(), {numbers[0], numbers[1]});
    return own(GEOSGeom_createLineString_r(
        context_, GEOSCoordSeq_copyFromBuffer_r(context_, numbers.data(),
                                                static_cast<unsigned>(numbers.size() / 2), 0, 0)));
  }

  [[nodiscard]] std::vector<Eigen::Vector2d> points(const GEOSGeometry* line) const {
    const GEOSCoordSequence* sequence = GEOSGeom_getCoordSeq_r(context_, line);
    unsigned size = 0;
    if (sequence == nullptr || GEOSCoordSeq_getSize_r(context_, sequence, &size) == 0) return {};
    std::vector<Eigen::Vector2d> result(size);
    for (unsigned i = 0; i < size; ++i)
      GEOSCoordSeq_getXY_r(context_, sequence, i, &result[i].x(), &result[i].y());
    return result;
  }

  std::uint32_t vertex(const Eigen::Vector2d& at, double z) {
    node_.vertices.emplace_back(at.x(), at.y(), z);
    return static_cast<std::uint32_t>(node_.vertices.size() - 1);
  }

  void add_caps(const GEOSGeometry* polygon) {
    const Geometry triangles = own(GEOSConstrainedDelaunayTriangulation_r(context_, polygon));
    if (!triangles) return;
    for (int i = 0; i < GEOSGetNumGeometries_r(context_, triangles.get()); ++i) {
      std::vector<Eigen::Vector2d> corners =
          points(GEOSGetExteriorRing_r(context_, GEOSGetGeometryN_r(context_, triangles.get(), i)));
      if (corners.size() != 4) continue;
      const Eigen::Vector2d a = corners[1] - corners[0], b = corners[2] - corners[0];
      if (a.x() * b.y() < a.y() * b.x()) std::swap(corners[1], corners[2]);
      for (const double z : {0.0, height_}) {
        std::array<std::uint32_t, 3> at{};
        for (std::size_t k = 0; k < 3; ++k) at[k] = vertex(corners[k], z);
        if (z == 0) std::swap(at[1], at[2]);
        node_.triangles.push_back(at);
      }
    }
  }

  /// GEOS gives outlines and holes in opposite senses.
  void add_walls(const GEOSGeometry* ring) {
    const std::vector<Eigen::Vector2d> corners = points(ring);
    for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
      const std::uint32_t a = vertex(corners[i], 0), b = vertex(corners[i + 1], 0);
      const std::uint32_t c = vertex(corners[i + 1], height_), d = vertex(corners[i], height_);
      node_.triangles.push_back({a, b, c});
      node_.triangles.push_back({a, c, d});
    }
  }

  GEOSContextHandle_t context_;
  double height_;
  MeshNode node_;
};

}  // namespace

std::optional<MeshNode> extruded_polylines(const std::string& name, const std::vector<Polyline>& polylines,
                                           double height) {
  const std::unique_ptr<GEOSContextHandle_HS, DestroyContext> context(GEOS_init_r());
  Extrusion extrusion(context.get(), name, height);
  const Geometry area = extrusion.area(polylines);
  if (!area) return std::nullopt;
  extrusion.add(area.get());
  MeshNode node = extrusion.take();
  if (node.triangles.empty()) return std::nullopt;
  return node;
}

}  // namespace canyon::city
