#include "adapters/ros2/map_projection.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <GeographicLib/Constants.hpp>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/base/text_file.hpp"

namespace canyon::adapters::ros2 {
namespace {

constexpr std::size_t kMaxBytes = 64 << 10;
constexpr const char* kNeeds = "give projector_type, and mgrs_grid or map_origin";
constexpr std::string_view kMgrs = "MGRS", kUtm = "LocalCartesianUTM", kTangential = "LocalCartesian",
                           kMercator = "TransverseMercator";

GeographicLib::TransverseMercator mercator(double scale) {
  return {GeographicLib::Constants::WGS84_a(), GeographicLib::Constants::WGS84_f(), scale};
}

}  // namespace

void visit(options::Visitor& v, MapProjectorInfo& info) {
  v.require("projector_type", kNeeds);
  v.text({"projector_type", "", "MGRS, LocalCartesianUTM, LocalCartesian or TransverseMercator"},
         info.projector_type);
  v.text({"vertical_datum", "", "of heights: WGS84 or EGM2008"}, info.vertical_datum);
  v.text({"mgrs_grid", "", "square of 100 km: 54SUE"}, info.mgrs_grid);
  v.section("map_origin", [&] {
    v.number({"latitude", "deg", "of the origin"}, info.latitude_deg, {-90, 90});
    v.number({"longitude", "deg", "of the origin"}, info.longitude_deg, {-180, 180});
    double altitude_m = 0;
    v.number({"altitude", "m", "not used (as in Autoware)"}, altitude_m, {-10e3, 100e3});
  });
  v.number({"scale_factor", "", "on the meridian of the origin, with TransverseMercator"}, info.scale_factor,
           {0, 10, true});
  if (!v.reads()) return;
  const std::string& type = info.projector_type;
  if (type != kMgrs && type != kUtm && type != kTangential && type != kMercator) {
    throw v.fault(
        "projector_type", fmt::format("'{}' is not supported", type),
        "use MGRS, LocalCartesianUTM, LocalCartesian or TransverseMercator, or define the map's frame "
        "with pose.east_m, pose.north_m and pose.heading_deg");
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
  const TextFile file(path, kMaxBytes);
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
    begin_at(geodesy::utm_of_mgrs_square(info.mgrs_grid));
    return;
  }
  const geodesy::Geodetic origin =
      geodesy::Geodetic::from_degrees(*info.latitude_deg, *info.longitude_deg, height_m_);
  if (info.projector_type == kTangential) {
    tangential_.emplace(origin);
  } else if (info.projector_type == kUtm) {
    begin_at(geodesy::utm_from_geodetic(origin).utm);
  } else {
    grid_ = mercator(info.scale_factor);
    meridian_deg_ = *info.longitude_deg;
    double east_m = 0;
    grid_->Forward(meridian_deg_, *info.latitude_deg, meridian_deg_, east_m, begin_.y());
  }
}

void MapProjection::begin_at(const geodesy::Utm& utm) {
  constexpr double kFalseEast_m = 500'000, kFalseNorth_m = 10'000'000;
  grid_ = mercator(kUtmScale);
  meridian_deg_ = 6 * utm.zone - 183;
  begin_ = {utm.easting_m - kFalseEast_m, utm.northing_m - (utm.north ? 0 : kFalseNorth_m)};
}

simulation::RigidPose MapProjection::in_city(const simulation::RigidPose& pose) const {
  const Eigen::Matrix3d city_from_ecef = city_.ecef_from_local_rotation().transpose();
  const Eigen::Vector3d& p = pose.position_m;
  if (tangential_) {
    const Eigen::Matrix3d city_from_map = city_from_ecef * tangential_->ecef_from_local_rotation();
    return {city_.local_from_geodetic(tangential_->geodetic_from_local(p)),
            Eigen::Quaterniond(city_from_map) * pose.attitude};
  }
  double latitude_deg = 0, longitude_deg = 0, convergence_deg = 0, scale = 1;
  grid_->Reverse(meridian_deg_, begin_.x() + p.x(), begin_.y() + p.y(), latitude_deg, longitude_deg,
                 convergence_deg, scale);
  const auto position = geodesy::Geodetic::from_degrees(latitude_deg, longitude_deg, height_m_ + p.z());
  const Eigen::AngleAxisd true_from_grid(-geodesy::radians(convergence_deg), Eigen::Vector3d::UnitZ());
  const Eigen::Matrix3d city_from_map = city_from_ecef *
                                        geodesy::enu_from_ecef_rotation(position).transpose() *
                                        true_from_grid.toRotationMatrix();
  return {city_.local_from_geodetic(position), Eigen::Quaterniond(city_from_map) * pose.attitude};
}

}  // namespace canyon::adapters::ros2
