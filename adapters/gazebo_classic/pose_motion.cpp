#include "adapters/gazebo_classic/pose_motion.hpp"

#include <cmath>

namespace canyon::gazebo_classic {

using ignition::math::Pose3d;
using ignition::math::Quaterniond;
using ignition::math::Vector3d;

TruePose motion_between(const Pose3d& from, const Pose3d& to, double seconds) {
  TruePose motion{to, Vector3d::Zero, Vector3d::Zero};
  const Vector3d way = to.Pos() - from.Pos();
  if (!(way.Length() <= kTeleport_mps * seconds)) return motion;
  motion.linear_velocity = way / seconds;
  Quaterniond turn = to.Rot() * from.Rot().Inverse();
  if (turn.W() < 0) turn = -turn;  // the same turn, the shorter way
  const Vector3d axis(turn.X(), turn.Y(), turn.Z());
  const double sine = axis.Length();
  if (sine > 0) motion.angular_velocity = axis * (2 * std::atan2(sine, turn.W()) / sine / seconds);
  return motion;
}

std::optional<Pose3d> proper_pose(const Pose3d& pose) {
  const Quaterniond& q = pose.Rot();
  const double norm = std::sqrt(q.W() * q.W() + q.X() * q.X() + q.Y() * q.Y() + q.Z() * q.Z());
  // Not IsFinite(), whose checks of a pose leave the quaternion's length open.
  const bool finite = std::isfinite(norm) && std::isfinite(pose.Pos().X()) && std::isfinite(pose.Pos().Y()) &&
                      std::isfinite(pose.Pos().Z());
  if (!finite || norm < 1e-6) return std::nullopt;
  return Pose3d(pose.Pos(), Quaterniond(q.W() / norm, q.X() / norm, q.Y() / norm, q.Z() / norm));
}

}  // namespace canyon::gazebo_classic
