#include "canyon/view/tables/epoch_row.hpp"

namespace canyon::view {

void EpochRow::add_to(Rows& epochs) const {
  const Eigen::Vector3d &at = antenna_m, &v = velocity_mps, &fix = fix_m, &error = error_m;
  const Eigen::Matrix3d& p = covariance_m2;
  epochs.add({time_s,
              at.x(),
              at.y(),
              at.z(),
              yaw_deg,
              roll_deg,
              pitch_deg,
              v.x(),
              v.y(),
              v.z(),
              static_cast<double>(status),
              static_cast<double>(placement),
              fix.x(),
              fix.y(),
              fix.z(),
              error.x(),
              error.y(),
              error.z(),
              p(0, 0),
              p(1, 1),
              p(2, 2),
              p(0, 1),
              p(0, 2),
              p(1, 2),
              dop.gdop,
              dop.pdop,
              dop.hdop,
              dop.vdop,
              dop.tdop,
              static_cast<double>(used),
              static_cast<double>(visible),
              static_cast<double>(blocked),
              static_cast<double>(skyline)});
}

}  // namespace canyon::view
