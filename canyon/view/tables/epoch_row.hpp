#pragma once

#include <Eigen/Core>
#include <limits>

#include "canyon/positioning/dop.hpp"
#include "canyon/positioning/fix.hpp"
#include "canyon/raytrace/ray_scene.hpp"
#include "canyon/view/tables/chunk.hpp"

namespace canyon::view {

/// A row of the table "epochs" (docs/view-format.md); NaN is unknown. Places and the fix are in the city's
/// frame.
struct EpochRow {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  double time_s = 0;
  Eigen::Vector3d antenna_m = Eigen::Vector3d::Zero();
  double yaw_deg = 0, roll_deg = 0, pitch_deg = 0;
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
  positioning::FixStatus status = positioning::FixStatus::NotSolved;
  raytrace::Placement placement = raytrace::Placement::Free;
  Eigen::Vector3d fix_m = Eigen::Vector3d::Constant(kNone), error_m = fix_m;
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Constant(kNone);
  positioning::Dop dop{kNone, kNone, kNone, kNone, kNone};
  int used = 0, visible = 0, blocked = 0;
  int skyline = -1;

  /// @param epochs rows of that table
  void add_to(Rows& epochs) const;
};

}  // namespace canyon::view
