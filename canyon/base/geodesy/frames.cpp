#include "canyon/base/geodesy/frames.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>
#include <GeographicLib/Geocentric.hpp>
#include <GeographicLib/MGRS.hpp>
#include <GeographicLib/NormalGravity.hpp>
#include <GeographicLib/UTMUPS.hpp>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::geodesy {

Geodetic Geodetic::from_degrees(double latitude_deg, double longitude_deg, double height_m) {
  return {radians(latitude_deg), radians(longitude_deg), height_m};
}

void check_geodetic(const Geodetic& point, const char* what) {
  const auto check = [what](const char* field, double value, double low, double high, const char* unit) {
    // The condition is negated to reject NaN; a small rounding error is allowed at the poles.
    if (!(value >= low - 1e-9 && value <= high + 1e-9))
      throw InputError(fmt::format("{}: {} {} {} is out of range", what, field, value, unit),
                       fmt::format("it runs from {} to {} {}", low, high, unit));
  };
  check("latitude", degrees(point.latitude_rad), -90, 90, "deg");
  check("longitude", degrees(point.longitude_rad), -180, 180, "deg");
  check("height", point.height_m, -10e3, 100e6, "m");
}

Eigen::Vector3d ecef_from_geodetic(const Geodetic& point) {
  Eigen::Vector3d ecef;
  GeographicLib::Geocentric::WGS84().Forward(degrees(point.latitude_rad), degrees(point.longitude_rad),
                                             point.height_m, ecef.x(), ecef.y(), ecef.z());
  return ecef;
}

Geodetic geodetic_from_ecef(const Eigen::Vector3d& ecef) {
  double latitude_deg = 0;
  double longitude_deg = 0;
  double height_m = 0;
  GeographicLib::Geocentric::WGS84().Reverse(ecef.x(), ecef.y(), ecef.z(), latitude_deg, longitude_deg,
                                             height_m);
  return Geodetic::from_degrees(latitude_deg, longitude_deg, height_m);
}

Eigen::Matrix3d enu_from_ecef_rotation(const Geodetic& at) {
  const double sin_lat = std::sin(at.latitude_rad);
  const double cos_lat = std::cos(at.latitude_rad);
  const double sin_lon = std::sin(at.longitude_rad);
  const double cos_lon = std::cos(at.longitude_rad);
  Eigen::Matrix3d r;
  r << -sin_lon, cos_lon, 0,                            //
      -sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat,  //
      cos_lat * cos_lon, cos_lat * sin_lon, sin_lat;
  return r;
}

LocalFrame::LocalFrame(const Geodetic& origin, double heading_rad)
    : origin_(origin), heading_rad_(heading_rad) {
  check_geodetic(origin, "origin");
  if (!std::isfinite(heading_rad)) throw InputError("origin: heading is not a finite number");
  origin_ecef_ = ecef_from_geodetic(origin);
  const Eigen::Matrix3d enu_from_local =
      Eigen::AngleAxisd(heading_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  ecef_from_local_ = enu_from_ecef_rotation(origin).transpose() * enu_from_local;
}

Eigen::Vector3d LocalFrame::ecef_from_local(const Eigen::Vector3d& local) const {
  return origin_ecef_ + ecef_from_local_ * local;
}

Eigen::Vector3d LocalFrame::local_from_ecef(const Eigen::Vector3d& ecef) const {
  return ecef_from_local_.transpose() * (ecef - origin_ecef_);
}

Eigen::Vector3d enu_from_azimuth_elevation(double azimuth_rad, double elevation_rad) {
  const double horizontal = std::cos(elevation_rad);
  return {horizontal * std::sin(azimuth_rad), horizontal * std::cos(azimuth_rad), std::sin(elevation_rad)};
}

AzimuthElevation azimuth_elevation_from_enu(const Eigen::Vector3d& enu) {
  const double horizontal = enu.head<2>().norm();
  AzimuthElevation result;
  result.elevation_rad = std::atan2(enu.z(), horizontal);
  if (horizontal > 0) {
    double azimuth = std::atan2(enu.x(), enu.y());
    if (azimuth < 0) azimuth += 2 * kPi;
    // A tiny negative angle rounds up to exactly 2 pi.
    result.azimuth_rad = azimuth >= 2 * kPi ? 0 : azimuth;
  }
  return result;
}

double azimuth_from_yaw(double yaw_rad) {
  const double azimuth = std::remainder(kPi / 2 - yaw_rad, 2 * kPi);
  const double wrapped = azimuth < 0 ? azimuth + 2 * kPi : azimuth;
  return wrapped >= 2 * kPi ? 0 : wrapped;
}

UtmPosition utm_from_geodetic(const Geodetic& point, int zone) {
  check_geodetic(point, "position");
  const double latitude_deg = degrees(point.latitude_rad);
  if (latitude_deg < -80 || latitude_deg > 84) {
    throw InputError(fmt::format("latitude {} deg has no UTM coordinates", latitude_deg),
                     "UTM covers 80 S to 84 N");
  }
  UtmPosition result;
  double convergence_deg = 0;
  try {
    GeographicLib::UTMUPS::Forward(
        latitude_deg, degrees(point.longitude_rad), result.utm.zone, result.utm.north, result.utm.easting_m,
        result.utm.northing_m, convergence_deg, result.scale, zone == 0 ? GeographicLib::UTMUPS::UTM : zone);
  } catch (const std::exception& e) {
    throw InputError(fmt::format("no UTM coordinates in zone {}: {}", zone, e.what()));
  }
  result.convergence_rad = radians(convergence_deg);
  return result;
}

Utm utm_of_mgrs_square(const std::string& square) {
  const auto fault = [&square](std::string_view reason) {
    return InputError(fmt::format("'{}' is not an MGRS square: {}", square, reason),
                      "write zone, band and the two letters of the 100 km square, such as 54SUE");
  };
  Utm corner;
  int precision = 0;
  try {
    GeographicLib::MGRS::Reverse(square, corner.zone, corner.north, corner.easting_m, corner.northing_m,
                                 precision, false);
  } catch (const GeographicLib::GeographicErr& e) {
    throw fault(e.what());
  }
  if (precision != 0) throw fault("it must consist of zone, band and two letters");
  if (corner.zone < 1) throw fault("the poles have no UTM zone");
  return corner;
}

Eigen::Vector3d normal_gravity(const Eigen::Vector3d& ecef) {
  Eigen::Vector3d gravity;
  (void)GeographicLib::NormalGravity::WGS84().U(ecef.x(), ecef.y(), ecef.z(), gravity.x(), gravity.y(),
                                                gravity.z());
  return gravity;
}

Eigen::Matrix3d rotated(const Eigen::Matrix3d& rotation, const Eigen::Matrix3d& covariance) {
  return rotation * covariance * rotation.transpose();
}

}  // namespace canyon::geodesy
