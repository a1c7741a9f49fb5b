#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/geodesy/gps_time.hpp"

namespace canyon::simulation {

/// A vehicle's reference point, or an antenna on it, at an instant: input of a run, and truth of an epoch.
struct Pose {
  geodesy::GpsTime time;
  geodesy::Geodetic position;
  Eigen::Vector3d velocity_enu_mps = Eigen::Vector3d::Zero();
  /// The second derivative of the position in Earth-fixed axes, rotated to ENU [m/s^2]; 0 on straight legs.
  Eigen::Vector3d acceleration_enu_mps2 = Eigen::Vector3d::Zero();
  double yaw_rad = 0;  ///< ENU yaw of the direction of travel; the last moving one is held at standstill
  double yaw_rate_radps = 0;  ///< counter-clockwise; 0 at standstill and at corners of straight legs
  double roll_rad = 0;  ///< about the forward axis, the left side up; 0 unless the trajectory has an attitude
  double pitch_rad = 0;  ///< nose up; likewise

  /// The vehicle's forward and up axes in ENU: x and z rotated by roll, pitch and yaw; unit vectors.
  [[nodiscard]] Eigen::Vector3d forward_enu() const;
  [[nodiscard]] Eigen::Vector3d up_enu() const;
};

/// Whether a pose is finite, within 10,000 km of the city's origin, at most 1000 km/s; others are rejected.
[[nodiscard]] bool is_possible(const Pose& pose, const geodesy::LocalFrame& city);
/// If no real vehicle can have this height above the ellipsoid [m] and this speed [m/s], the reason with the
/// number: below -1 km, above 100 km, or faster than 1,000 m/s. Else empty.
[[nodiscard]] std::string impossible_motion(double height_m, const Eigen::Vector3d& velocity_mps);

/// A vehicle as a rigid body in ECEF. Its own axes are forward, left, up.
struct EcefPose {
  Eigen::Vector3d position_m, velocity_mps, acceleration_mps2;  ///< and its derivatives
  Eigen::Matrix3d ecef_from_body;
};

/// From the vehicle's axes (forward, left, up) to east, north, up at its position, by yaw, pitch and roll.
[[nodiscard]] Eigen::Matrix3d enu_from_body(const Pose& pose);

/// The same pose in ECEF.
[[nodiscard]] EcefPose body_state(const Pose& pose);

/// A body in the frame of a host's world.
struct RigidPose {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Quaterniond attitude = Eigen::Quaterniond::Identity();  ///< world from body
  Eigen::Vector3d linear_velocity = Eigen::Vector3d::Zero();     ///< of the pose's origin [m/s]
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();    ///< [rad/s]
};
/// Whether positions and quaternions differ by 1e-6 or less in each component.
[[nodiscard]] bool same_pose(const RigidPose& a, const RigidPose& b);
/// `pose` with a unit quaternion. Empty if it is not finite or its quaternion is zero.
[[nodiscard]] std::optional<RigidPose> proper_pose(const RigidPose& pose);

/// Two poses that need a higher speed are a jump.
constexpr double kTeleport_mps = 1000;
/// `to`, with the velocities that lead to it from another pose in `seconds` > 0, in the frame of the poses:
/// along a straight line, about one axis, by the smaller angle. Zero for jumps faster than kTeleport_mps.
[[nodiscard]] RigidPose motion_between(const RigidPose& from, const RigidPose& to, double seconds);
/// A body `seconds` later (or earlier, if negative) with the same velocities.
[[nodiscard]] RigidPose moved_on(const RigidPose& body, double seconds);

/// The position of a host's world on the Earth, or of the frame of its poses in a city.
struct WorldFrame {
  geodesy::LocalFrame enu;  ///< of the city
  double heading_rad = 0;   ///< of the world's x axis, counter-clockwise from east
  /// The world's origin in the city [m]; 0 for a world whose geometry is read (live::HostWorld).
  Eigen::Vector3d origin_enu_m = Eigen::Vector3d::Zero();

  /// Rotation about the vertical.
  [[nodiscard]] Eigen::Matrix3d enu_from_world() const;
  friend bool operator==(const WorldFrame& a, const WorldFrame& b);
};

/// A body of a host's world as a pose on the Earth; conversions between both happen here only. Its
/// acceleration is 0.
/// @param lever_arm_m from the body's origin to the point whose pose is returned (forward, left, up)
[[nodiscard]] Pose pose_of(const RigidPose& body, const WorldFrame& world, geodesy::GpsTime time,
                           const Eigen::Vector3d& lever_arm_m = Eigen::Vector3d::Zero());

}  // namespace canyon::simulation
