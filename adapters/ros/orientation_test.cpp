#include "adapters/ros/orientation.hpp"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "adapters/ros/testing/stand_ins.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "tests/support/sample_epochs.hpp"

#ifdef CANYON_WITH_AUTOWARE
#include <autoware_sensing_msgs/msg/gnss_ins_orientation_stamped.hpp>
#endif

namespace canyon::ros_messages {
namespace {

#ifdef CANYON_WITH_AUTOWARE
using Stamped = autoware_sensing_msgs::msg::GnssInsOrientationStamped;
#else
struct Stamped {
  test::messages::Header header;
  struct {
    test::messages::Quaternion orientation;
    float rmse_rotation_x = 7, rmse_rotation_y = 7, rmse_rotation_z = 7;
  } orientation;
};
#endif

simulation::Epoch epoch() {
  return test::sample_epoch(test::sample_time(), test::sample_point(), {0, 0, 0});
}

Eigen::Quaterniond rotation_vector_of(const Stamped& message) {
  const auto& q = message.orientation.orientation;
  return {q.w, q.x, q.y, q.z};
}

TEST(Orientation, IsOfTwoAntennas) {
  simulation::Epoch e = epoch();
  EXPECT_FALSE(orientation_message<Stamped>({{3, 4}, "gnss"}, &e));
  EXPECT_FALSE(orientation_message<Stamped>({{3, 4}, "gnss"}, nullptr));
  positioning::Baseline baseline;
  baseline.kind = positioning::FixKind::Fixed;
  baseline.moving_base = true;
  baseline.vector_enu = {0, -2, 0.5};  // southwards, upwards
  baseline.covariance_enu = Eigen::Matrix3d::Identity() * 1e-4;
  e.observed.fix.baseline = baseline;
  const auto m = orientation_message<Stamped>({{3, 4}, "gnss"}, &e);
  ASSERT_TRUE(m);
  EXPECT_EQ(m->header.frame_id, "gnss");
  EXPECT_NEAR((rotation_vector_of(*m) * Eigen::Vector3d::UnitX() - baseline.vector_enu.normalized()).norm(),
              0, 1e-12);
  EXPECT_NEAR((rotation_vector_of(*m) * Eigen::Vector3d::UnitY()).x(), 1, 1e-12);  // left is east
  EXPECT_NEAR(m->orientation.rmse_rotation_z, 0.005, 1e-6);
  EXPECT_NEAR(m->orientation.rmse_rotation_y, 0.01 / std::hypot(2, 0.5), 1e-6);
  EXPECT_EQ(m->orientation.rmse_rotation_x, 1);
}

TEST(Orientation, IsOfTheVehiclesSensors) {
  simulation::Epoch e = epoch();
  positioning::Fusion fusion;
  fusion.phase = positioning::FusionPhase::Navigating;
  fusion.heading_rad = geodesy::radians(90);
  fusion.pitch_rad = geodesy::radians(10);  // nose up
  fusion.roll_rad = geodesy::radians(5);    // left side up
  fusion.heading_sigma_rad = 0.02;
  e.observed.fix.fusion = fusion;
  const auto m = orientation_message<Stamped>({{3, 4}, "gnss"}, &e);
  ASSERT_TRUE(m);
  const Eigen::Vector3d forward = rotation_vector_of(*m) * Eigen::Vector3d::UnitX();
  EXPECT_NEAR(forward.x(), std::cos(geodesy::radians(10)), 1e-12);
  EXPECT_NEAR(forward.z(), std::sin(geodesy::radians(10)), 1e-12);
  EXPECT_GT((rotation_vector_of(*m) * Eigen::Vector3d::UnitY()).z(), 0.08);
  EXPECT_NEAR(m->orientation.rmse_rotation_z, 0.02, 1e-8);
  EXPECT_EQ(m->orientation.rmse_rotation_y, 1);
}

}  // namespace
}  // namespace canyon::ros_messages
