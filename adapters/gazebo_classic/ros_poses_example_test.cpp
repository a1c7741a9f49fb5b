// examples/ros1_poses.py between a ROS 1 publisher and the decoder of `canyon live`.
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <optional>

#include "adapters/gazebo_classic/testing/ros_core.hpp"
#include "canyon/base/transport/transport.hpp"
#include "canyon/outputs/live/pose_source.hpp"
#include "tests/support/program.hpp"
#include "tests/support/source_dir.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

using test::ChildProgram;
using test::eventually;
using test::RosCore;
using test::RosEnvironment;

// A pose without symmetry: canyon live receives the published pose.
void expect_to_arrive(const std::string& type, const std::string& message,
                      const std::vector<std::string>& options) {
  const RosCore core;
  const std::filesystem::path& folder = RosEnvironment::get().folder();
  const auto decoder = live::make_decoder({});
  std::optional<live::PoseReport> last;
  const std::string port = std::to_string(canyon::test::free_port());
  const auto link = transport::open_transport("udp-listen://127.0.0.1:" + port);
  const std::string example = std::string(canyon_source_dir) + "/examples/ros1_poses.py";
  std::vector<std::string> words{"python3",           example, "/mocap/rover", "--to",
                                 "127.0.0.1:" + port, "--id",  "rover"};
  words.insert(words.end(), options.begin(), options.end());
  const ChildProgram script(words, folder / "script.log");
  const ChildProgram publisher({"rostopic", "pub", "-r", "50", "/mocap/rover", type, message},
                               folder / "pub.log");
  EXPECT_TRUE(eventually([&] {
    link->serve();
    for (const transport::Received& received : link->take_received()) {
      decoder->receive(received, [&](const live::PoseReport& report) { last = report; });
    }
    return last.has_value();
  })) << canyon::test::read_bytes(folder / "script.log")
      << canyon::test::read_bytes(folder / "pub.log");
  ASSERT_TRUE(last);
  EXPECT_EQ(last->id, "rover");
  EXPECT_EQ(last->stamp_s, 1234.5);
  EXPECT_EQ(last->position_m, Eigen::Vector3d(1.5, -2.5, 3.25));
  ASSERT_TRUE(last->attitude);
  EXPECT_LT(last->attitude->angularDistance(Eigen::Quaterniond(-0.1, 0.7, -0.5, 0.5)), 1e-9);
  EXPECT_FALSE(last->velocity_mps);
}

class RosPosesExample : public testing::Test {
 protected:
  void SetUp() override {
    CANYON_NEEDS_PROGRAM("roscore");
    RosEnvironment::get();
  }
};

const std::string kHeader = "header: {stamp: {secs: 1234, nsecs: 500000000}, frame_id: map}";
const std::string kPose =
    "pose: {position: {x: 1.5, y: -2.5, z: 3.25}, orientation: {w: -0.1, x: 0.7, y: -0.5, z: 0.5}}";

TEST_F(RosPosesExample, SendsPoseStamped) {
  expect_to_arrive("geometry_msgs/PoseStamped", "{" + kHeader + ", " + kPose + "}", {});
}

TEST_F(RosPosesExample, SendsThePoseOfOdometry) {
  if (canyon::test::run_program("python3 -c 'import nav_msgs' 2>&1").status != 0) {
    GTEST_SKIP() << "SKIPPED: nav_msgs of ROS 1 is not installed here";
  }
  expect_to_arrive(
      "nav_msgs/Odometry",
      "{" + kHeader + ", child_frame_id: base_link, pose: {" + kPose + "}, twist: {twist: {linear: {x: 9}}}}",
      {"--odometry"});
}

}  // namespace
}  // namespace canyon::adapters::gazebo_classic
