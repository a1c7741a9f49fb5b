#pragma once

#include <Eigen/Core>
#include <string>

namespace canyon::geodesy {

/// Geodetic position on the WGS 84 ellipsoid.
struct Geodetic {
  double latitude_rad = 0;   ///< geodetic, [-pi/2, pi/2]
  double longitude_rad = 0;  ///< east positive, [-pi, pi]
  double height_m = 0;       ///< above the ellipsoid

  [[nodiscard]] static Geodetic from_degrees(double latitude_deg, double longitude_deg, double height_m);
};

/// Throws InputError with field and bound unless latitude is within +-90 deg, longitude within +-180 deg and
/// height within -10 km to 100,000 km. Also rejects values in a wrong unit and NaN. `what` names the point.
void check_geodetic(const Geodetic& point, const char* what);

/// ECEF [m] on WGS 84. GeographicLib::Geocentric; error below 10 nm.
[[nodiscard]] Eigen::Vector3d ecef_from_geodetic(const Geodetic& point);
/// Geodetic of any finite ECEF position [m].
[[nodiscard]] Geodetic geodetic_from_ecef(const Eigen::Vector3d& ecef);

/// Rotation from ECEF to east, north, up axes at a point.
[[nodiscard]] Eigen::Matrix3d enu_from_ecef_rotation(const Geodetic& at);

/// A local cartesian frame: x east, y north, z up, metres, at an origin on WGS 84; the frame of cities and
/// poses (REP-103). A heading rotates its x axis from east by `heading_rad` counter-clockwise seen from above
/// (yaw, as Gazebo's `heading_deg`); z stays up.
class LocalFrame {
 public:
  LocalFrame() : LocalFrame(Geodetic{}) {}
  /// Throws InputError for an origin outside check_geodetic's bounds or a non-finite heading.
  explicit LocalFrame(const Geodetic& origin, double heading_rad = 0);

  [[nodiscard]] const Geodetic& origin() const { return origin_; }
  [[nodiscard]] double heading_rad() const { return heading_rad_; }

  [[nodiscard]] Eigen::Vector3d ecef_from_local(const Eigen::Vector3d& local) const;
  [[nodiscard]] Eigen::Vector3d local_from_ecef(const Eigen::Vector3d& ecef) const;
  [[nodiscard]] Geodetic geodetic_from_local(const Eigen::Vector3d& local) const {
    return geodetic_from_ecef(ecef_from_local(local));
  }
  [[nodiscard]] Eigen::Vector3d local_from_geodetic(const Geodetic& point) const {
    return local_from_ecef(ecef_from_geodetic(point));
  }
  /// Rotates free vectors (velocities, directions); orthonormal, det +1.
  [[nodiscard]] const Eigen::Matrix3d& ecef_from_local_rotation() const { return ecef_from_local_; }

 private:
  Geodetic origin_;
  double heading_rad_ = 0;
  Eigen::Vector3d origin_ecef_;
  Eigen::Matrix3d ecef_from_local_;
};

/// Unit ENU vector towards azimuth (from north, clockwise) and elevation, both [rad].
[[nodiscard]] Eigen::Vector3d enu_from_azimuth_elevation(double azimuth_rad, double elevation_rad);

struct AzimuthElevation {
  double azimuth_rad = 0;    ///< from north, clockwise, [0, 2 pi); 0 at the zenith
  double elevation_rad = 0;  ///< [-pi/2, pi/2]
};
/// Angles of an ENU vector of any length but zero.
[[nodiscard]] AzimuthElevation azimuth_elevation_from_enu(const Eigen::Vector3d& enu);

/// Compass azimuth (from north, clockwise, [0, 2 pi)) of an ENU yaw (from east, counter-clockwise).
[[nodiscard]] double azimuth_from_yaw(double yaw_rad);

/// Universal Transverse Mercator coordinates, for import and export only; elsewhere Canyon uses ENU.
struct Utm {
  int zone = 31;  ///< 1 to 60
  bool north = true;
  double easting_m = 500'000;
  double northing_m = 0;  ///< from the equator, with false northing 10,000 km in the south
};

/// A UTM position with the grid's convergence and scale at this position.
struct UtmPosition {
  Utm utm;
  double convergence_rad = 0;  ///< bearing of grid north, from true north, clockwise
  double scale = 1;            ///< grid length over ground length on the ellipsoid
};

/// Latitude within [-80, 84] deg, else InputError. `zone` 0 takes the standard zone (with the exceptions of
/// Norway and Svalbard); a neighbouring zone may be forced. GeographicLib::UTMUPS; error below 5 nm.
[[nodiscard]] UtmPosition utm_from_geodetic(const Geodetic& point, int zone = 0);

/// The south-west corner of a 100 km square of the Military Grid Reference System: "54SUE", without blanks,
/// in either case. Throws InputError if the text names no square, and for polar squares, which have no zone.
/// Uses GeographicLib::MGRS.
[[nodiscard]] Utm utm_of_mgrs_square(const std::string& square);

/// Normal gravity of WGS 84 [m/s^2, ECEF], with the centrifugal acceleration, at any point outside of the
/// Earth's core: the closed form of Somigliana and Pizzetti for the level ellipsoid (Heiskanen and Moritz,
/// Physical Geodesy, 2-8), by GeographicLib. @param ecef [m]
[[nodiscard]] Eigen::Vector3d normal_gravity(const Eigen::Vector3d& ecef);

/// R C R^T: rotates covariance `C` into the axes that `rotation` R maps to. Compiled once, because Eigen's
/// product takes half a second of compile time for each kind of operand.
[[nodiscard]] Eigen::Matrix3d rotated(const Eigen::Matrix3d& rotation, const Eigen::Matrix3d& covariance);

}  // namespace canyon::geodesy
