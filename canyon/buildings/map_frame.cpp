#include "canyon/buildings/map_frame.hpp"

#include "canyon/geodesy/constants.hpp"

namespace canyon::buildings {
namespace {

using geodesy::Geodetic;

constexpr double kFalseNorthing_m = 10e6;  // of UTM in the south

// Counted from the equator in both hemispheres, so that a city on it stays in one piece.
double northing_from_equator(const geodesy::Utm& utm) {
  return utm.northing_m - (utm.north ? 0 : kFalseNorthing_m);
}

}  // namespace

MapFrame::MapFrame(const Geodetic& origin, Grid grid, const Terrain* terrain)
    : frame_(origin), grid_(grid), terrain_(terrain) {
  if (grid_ == Grid::Utm) {
    const geodesy::Utm utm = geodesy::utm_from_geodetic(origin).utm;
    zone_ = utm.zone;
    easting_m_ = utm.easting_m;
    northing_m_ = northing_from_equator(utm);
  }
}

Eigen::Vector3d MapFrame::mesh_from_map(const LonLat& place, double height_m) const {
  const Geodetic point = Geodetic::from_degrees(place.y(), place.x(), height_m);
  if (grid_ == Grid::Enu) return frame_.local_from_geodetic(point);
  const geodesy::Utm utm = geodesy::utm_from_geodetic(point, zone_).utm;
  return {utm.easting_m - easting_m_, northing_from_equator(utm) - northing_m_,
          height_m - frame_.origin().height_m};
}

Eigen::Vector3d MapFrame::map_from_mesh(const Eigen::Vector3d& point) const {
  Geodetic place;
  if (grid_ == Grid::Enu) {
    place = frame_.geodetic_from_local(point);
  } else {
    geodesy::Utm utm;
    utm.zone = zone_;
    utm.easting_m = point.x() + easting_m_;
    utm.northing_m = point.y() + northing_m_;
    utm.north = utm.northing_m >= 0;
    if (!utm.north) utm.northing_m += kFalseNorthing_m;
    place = geodesy::geodetic_from_utm(utm, point.z() + frame_.origin().height_m);
  }
  return {geodesy::degrees(place.longitude_rad), geodesy::degrees(place.latitude_rad), place.height_m};
}

Eigen::Vector3d MapFrame::mesh_from_enu(const Eigen::Vector3d& enu) const {
  if (grid_ == Grid::Enu) return enu;
  const Geodetic place = frame_.geodetic_from_local(enu);
  return mesh_from_map({geodesy::degrees(place.longitude_rad), geodesy::degrees(place.latitude_rad)},
                       place.height_m);
}

std::optional<double> MapFrame::ground_height_m(const LonLat& place) const {
  if (terrain_ == nullptr) return frame_.origin().height_m;
  return terrain_->height_m(place);
}

std::optional<Eigen::Vector3d> MapFrame::ground(const LonLat& place) const {
  const std::optional<double> height = ground_height_m(place);
  if (!height) return std::nullopt;
  return mesh_from_map(place, *height);
}

}  // namespace canyon::buildings
