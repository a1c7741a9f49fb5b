#pragma once

#include <geos_c.h>

#include <memory>
#include <vector>

#include "canyon/city/meshes/polygon.hpp"

namespace canyon::meshes::geos {

/// The calling thread's context of GEOS's reentrant functions; created at its first use, freed with the
/// thread. Messages of GEOS are dropped: callers check the results.
[[nodiscard]] GEOSContextHandle_t context();

struct Destroy {
  void operator()(GEOSGeometry* geometry) const { GEOSGeom_destroy_r(context(), geometry); }
  void operator()(GEOSCoordSequence* sequence) const { GEOSCoordSeq_destroy_r(context(), sequence); }
  void operator()(GEOSMakeValidParams* params) const { GEOSMakeValidParams_destroy_r(context(), params); }
};
/// Owned geometry; null if a GEOS operation failed. Must be destroyed on the thread that created it.
using Geometry = std::unique_ptr<GEOSGeometry, Destroy>;

/// A polygon of rings (at least 3 points each, not closed), valid or not. Null for fewer points.
[[nodiscard]] Geometry polygon(const std::vector<Point2>& outer,
                               const std::vector<std::vector<Point2>>& holes = {});
/// A line through points, or the point if there is one. Null for none.
[[nodiscard]] Geometry line(const std::vector<Point2>& points);
/// A collection of polygons, valid or not.
[[nodiscard]] Geometry collection(std::vector<Geometry> polygons);
/// The polygons within a geometry of any type, rings oriented as in Polygon2 and not closed; empty for null.
[[nodiscard]] std::vector<Polygon2> polygons(const GEOSGeometry* geometry);
/// Whether sides of closed rings meet away from their ends more than `maximum` times plus 10 times per side,
/// or are so close to each other that counting takes too long. The cost in GEOS would be disproportionate.
[[nodiscard]] bool is_tangled(const std::vector<std::vector<Point2>>& rings, std::size_t maximum = 1000);
/// Points of a ring or line string, in order.
[[nodiscard]] std::vector<Point2> points(const GEOSGeometry* line);

}  // namespace canyon::meshes::geos
