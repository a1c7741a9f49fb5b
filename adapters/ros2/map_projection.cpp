#include "adapters/ros2/map_projection.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/geodesy/mgrs.hpp"
#include "canyon/options/read.hpp"

namespace canyon::adapters::ros2 {
namespace {

constexpr std::size_t kMostBytes = 64 << 10;
constexpr const char* kNeeds = "it needs projector_type, and mgrs_grid or map_origin";
constexpr std::string_view kMgrs = "MGRS", kUtm = "LocalCartesianUTM", kTangential = "LocalCartesian";

}  // namespace

void visit(options::Visitor& v, MapProjectorInfo& info) {
  v.require("projector_type", kNeeds);
  v.text({"projector_type", "", "MGRS, LocalCartesianUTM or LocalCartesian"}, info.projector_type);
  v.text({"vertical_datum", "", "of heights: WGS84 or EGM2008"}, info.vertical_datum);
  v.text({"mgrs_grid", "", "square of 100 km: 54SUE"}, info.mgrs_grid);
  v.section("map_origin", [&] {
    v.number({"latitude", "deg", "of the origin"}, info.latitude_deg, {-90, 90});
    v.number({"longitude", "deg", "of the origin"}, info.longitude_deg, {-180, 180});
    v.number({"altitude", "m", "of the origin"}, info.altitude_m, {-10e3, 100e3});
    // Nodes of Autoware write it where the projector does not use it either.
    double scale_factor = 1;
    v.number({"scale_factor", "", "not used by these projectors"}, scale_factor, {0, 10});
  });
  if (!v.reads()) return;
  const std::string& type = info.projector_type;
  if (type != kMgrs && type != kUtm && type != kTangential) {
    throw v.fault("projector_type", fmt::format("'{}' is not supported", type),
                  "use MGRS, LocalCartesianUTM or LocalCartesian, or place the map by pose.east_m, "
                  "pose.north_m and pose.heading_deg");
  }
  if (info.vertical_datum != "WGS84" && info.vertical_datum != "EGM2008") {
    throw v.fault("vertical_datum", fmt::format("'{}' is not supported", info.vertical_datum),
                  "use WGS84 or EGM2008");
  }
  if (type == kMgrs) {
    v.require("mgrs_grid", "add mgrs_grid: 54SUE, with the square of the map");
  } else if (!info.latitude_deg || !info.longitude_deg) {
    throw v.fault("projector_type", fmt::format("{} needs an origin", type),
                  "add map_origin: {latitude: ..., longitude: ...}");
  }
}

MapProjectorInfo read_map_projector_info(const std::filesystem::path& path) {
  const TextFile file(path, kMostBytes);
  options::Document document;
  document.file = path;
  MapProjectorInfo info;
  options::read_yaml(std::string(file.text()), document, kNeeds, info);
  return info;
}

MapProjection::MapProjection(const MapProjectorInfo& info, const geodesy::LocalFrame& city,
                             double geoid_undulation_m)
    : city_(city) {
  if (info.vertical_datum != "WGS84") height_m_ = geoid_undulation_m;
  if (info.projector_type == kMgrs) {
    corner_ = geodesy::utm_of_mgrs_square(info.mgrs_grid);
    return;
  }
  const geodesy::Geodetic origin =
      geodesy::Geodetic::from_degrees(*info.latitude_deg, *info.longitude_deg, info.altitude_m + height_m_);
  if (info.projector_type == kTangential) {
    tangential_.emplace(origin);
  } else {
    corner_ = geodesy::utm_from_geodetic(origin).utm;
    height_m_ += info.altitude_m;
  }
}

geodesy::Geodetic MapProjection::geodetic(const Eigen::Vector3d& map) const {
  if (tangential_) return tangential_->geodetic_from_local(map);
  geodesy::Utm utm = corner_;
  utm.easting_m += map.x();
  utm.northing_m += map.y();
  return geodesy::geodetic_from_utm(utm, height_m_ + map.z());
}

simulation::RigidPose MapProjection::in_city(const simulation::RigidPose& pose) const {
  const geodesy::Geodetic place = geodetic(pose.position_m);
  const Eigen::Matrix3d city_from_ecef = city_.ecef_from_local_rotation().transpose();
  Eigen::Matrix3d city_from_map;
  if (tangential_) {
    city_from_map = city_from_ecef * tangential_->ecef_from_local_rotation();
  } else {
    const double convergence = geodesy::utm_from_geodetic(place, corner_.zone).convergence_rad;
    city_from_map = city_from_ecef * geodesy::enu_from_ecef_rotation(place).transpose() *
                    Eigen::AngleAxisd(-convergence, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  }
  return {city_.local_from_geodetic(place), Eigen::Quaterniond(city_from_map) * pose.attitude};
}

}  // namespace canyon::adapters::ros2
