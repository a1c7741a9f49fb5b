#include "canyon/geodesy/normal_gravity.hpp"

#include <GeographicLib/NormalGravity.hpp>

namespace canyon::geodesy {

Eigen::Vector3d normal_gravity(const Eigen::Vector3d& ecef) {
  Eigen::Vector3d gravity;
  (void)GeographicLib::NormalGravity::WGS84().U(ecef.x(), ecef.y(), ecef.z(), gravity.x(), gravity.y(),
                                                gravity.z());
  return gravity;
}

}  // namespace canyon::geodesy
