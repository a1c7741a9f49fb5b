#include "canyon/buildings/shapes/ribbon.hpp"

#include <string>

#include "canyon/meshes/geos.hpp"

namespace canyon::buildings {

namespace geos = meshes::geos;

std::vector<Polygon2> ribbon(const std::vector<Point2>& line, double half_width_m) {
  if (line.size() < 2) return {};
  GEOSCoordSequence* sequence = GEOSCoordSeq_create_r(geos::context(), static_cast<unsigned>(line.size()), 2);
  if (sequence == nullptr) return {};
  for (std::size_t i = 0; i < line.size(); ++i) {
    GEOSCoordSeq_setXY_r(geos::context(), sequence, static_cast<unsigned>(i), line[i].x(), line[i].y());
  }
  const geos::Geometry string(GEOSGeom_createLineString_r(geos::context(), sequence));
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
