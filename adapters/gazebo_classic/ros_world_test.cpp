// Receivers in a running gzserver, tested through ROS.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <future>
#include <map>
#include <sstream>

#include "adapters/gazebo_classic/testing/in_process_server.hpp"
#include "adapters/gazebo_classic/testing/ros_core.hpp"
#include "adapters/gazebo_classic/testing/street_world.hpp"
#include "canyon/base/text.hpp"
#include "tests/support/program.hpp"
#include "tests/support/source_dir.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

using canyon::test::run_program;
using test::ChildProgram;
using test::eventually;
using test::InProcessServer;
using test::RosCore;
using test::RosEnvironment;
using test::street_car;
using test::street_excess_m;
using test::street_world;
using ::testing::HasSubstr;
using ::testing::Not;
using namespace std::chrono_literals;

class RosWorld : public testing::Test {
 protected:
  void SetUp() override {
    CANYON_NEEDS_PROGRAM("roscore");
    RosEnvironment::get();
  }

  /// One message printed by `rostopic echo -p` while the world advances.
  std::map<std::string, std::string> echo(const std::string& topic) {
    auto result = std::async(std::launch::async, [&] {
      return run_program("timeout 60 rostopic echo -n 1 -p " + topic + " 2>&1");
    });
    while (result.wait_for(5ms) != std::future_status::ready) InProcessServer::get().step(10);
    std::istringstream lines(result.get().output);
    std::string names, values;
    std::getline(lines, names);
    std::getline(lines, values);
    std::map<std::string, std::string> fields;
    const auto keys = split(names, ','), texts = split(values, ',');
    for (std::size_t i = 0; i < std::min(keys.size(), texts.size()); ++i) {
      fields[std::string(keys[i])] = texts[i];
    }
    return fields;
  }
  /// The response received by a node of another process: "True added ...".
  static std::string call_service(const std::string& service, const std::string& fault) {
    const std::string call =
        "import rospy; from canyon_msgs.srv import FaultCommand; rospy.init_node('asker', anonymous=True); "
        "rospy.wait_for_service('" +
        service + "', 30); r = rospy.ServiceProxy('" + service + "', FaultCommand)('" + fault +
        "'); print(r.success, r.message)";
    return run_program("timeout 60 python3 -c \"" + call + "\" 2>&1").output;
  }
  static double number(std::map<std::string, std::string>& fields, const std::string& field) {
    EXPECT_EQ(fields.count(field), 1U) << field;
    return fields.count(field) != 0 ? std::stod(fields[field]) : NAN;
  }
};

// The street's satellites have closed forms: street_world.hpp.
TEST_F(RosWorld, ThePapersSnippetSpeaksRos) {
  const RosCore core;
  InProcessServer& server = InProcessServer::get();
  const auto world = server.load(street_world(street_car(test::paper_elements())));
  auto multipath = echo("/multipath/gnss_multipath");
  EXPECT_EQ(number(multipath, "field.num_vis_sat"), 8);
  EXPECT_EQ(number(multipath, "field.num_block_sat"), 0);
  EXPECT_NEAR(number(multipath, "field.range_offset0"), street_excess_m(13, 45), 1e-3);
  EXPECT_NEAR(number(multipath, "field.range_offset1"), street_excess_m(7, 50), 1e-3);
  EXPECT_EQ(number(multipath, "field.range_offset2"), 0);
  EXPECT_EQ(number(multipath, "field.noise0"), 0);  // disableNoise
  EXPECT_EQ(number(multipath, "field.rec_pos.status.status"), 0);
  EXPECT_EQ(multipath["field.header.frame_id"], "body");
  // Simulated time: updates at 10 Hz of it, not after now.
  const double stamp_s = number(multipath, "field.header.stamp") * 1e-9;
  EXPECT_GT(stamp_s, 0);
  EXPECT_LE(stamp_s, world->SimTime().Double());
  EXPECT_NEAR(std::remainder(stamp_s, 0.1), 0, 1e-6);

  auto scan = echo("/multipath/scan");
  EXPECT_NEAR(number(scan, "field.ranges0"), 7 * std::sqrt(2), 1e-3);
  EXPECT_NEAR(number(scan, "field.ranges1"), 13 * std::sqrt(2), 1e-3);
  EXPECT_EQ(scan["field.ranges4"], "inf");
  EXPECT_EQ(scan.count("field.ranges15"), 1U);
  EXPECT_EQ(scan.count("field.ranges16"), 0U);

  server.unload();
  EXPECT_TRUE(eventually(
      [] { return run_program("rostopic list 2>&1").output.find("/multipath/") == std::string::npos; }));
}

TEST_F(RosWorld, TruthComesFromRos) {
  const RosCore core;
  InProcessServer& server = InProcessServer::get();
  // The name differs from the previous world's: a message to that world may still be in transit.
  std::string world =
      street_world(street_car(test::paper_elements() + "<pose_topic>/mocap/car</pose_topic>"));
  const std::string name = "<world name='street'>";
  ASSERT_NE(world.find(name), std::string::npos);
  server.load(world.replace(world.find(name), name.size(), "<world name='mocap'>"));
  EXPECT_EQ(echo("/multipath/satellites")["field.fix_status"], "6");  // no truth yet
  // 3 m west of the middle: now 13 m to the eastern wall and 7 m to the western.
  const ChildProgram mocap({"rostopic", "pub", "-r", "50", "/mocap/car", "geometry_msgs/PoseStamped",
                            "{pose: {position: {x: -3, y: 0, z: 2}, orientation: {w: 1}}}"},
                           RosEnvironment::get().folder() / "mocap.log");
  std::map<std::string, std::string> satellites;
  ASSERT_TRUE(
      eventually([&] { return (satellites = echo("/multipath/satellites"))["field.fix_status"] == "1"; }));
  EXPECT_NEAR(number(satellites, "field.satellites0.excess_path"), street_excess_m(7, 45), 1e-3);
  EXPECT_NEAR(number(satellites, "field.satellites1.excess_path"), street_excess_m(13, 50), 1e-3);
  server.unload();
}

// A fault by a service called by a node of another process: the receiver loses its fix and regains it.
TEST_F(RosWorld, FaultsComeAndGoByServices) {
  InProcessServer& server = InProcessServer::get();
  const std::string open_sky =
      "<sky><nominal>true</nominal><systems>GPS</systems></sky>"
      "<start>2026-06-01T08:00:00Z</start><profile>ideal</profile>";
  std::string text = street_world(
      street_car("<ros><namespace>/car</namespace><changes>true</changes></ros>" + open_sky), 0, false);
  const std::string name = "<world name='street'>";
  ASSERT_NE(text.find(name), std::string::npos);
  server.load(text.replace(text.find(name), name.size(), "<world name='faults'>"));
  const auto request = [&](const std::string& service, const std::string& fault) {
    auto reply = std::async(std::launch::async, [&] { return call_service(service, fault); });
    while (reply.wait_for(5ms) != std::future_status::ready) server.step(10);
    return reply.get();
  };
  // Services return with a new master, like topics.
  for (int master = 0; master < 2; ++master) {
    const RosCore core;
    const std::string dark = "dark" + std::to_string(master);
    EXPECT_THAT(request("/car/gnss/get_faults", ""), Not(HasSubstr(dark)));
    EXPECT_THAT(request("/car/gnss/add_fault", "{name: " + dark + ", outage: {}}"), HasSubstr("True added "));
    EXPECT_EQ(echo("/car/fix")["field.status.status"], "-1");
    EXPECT_THAT(request("/car/gnss/get_faults", ""), HasSubstr(": " + dark + " (outage) from "));
    EXPECT_THAT(request("/car/gnss/end_fault", dark), HasSubstr("True ended "));
    EXPECT_EQ(echo("/car/fix")["field.status.status"], "0");
    EXPECT_THAT(request("/car/gnss/add_fault", "{outage: {satelites: G05}}"), HasSubstr("False refused: "));
  }
  server.unload();
}

// The settings do not mention changes.
TEST_F(RosWorld, FaultsAreRefusedUnlessTheyAreAllowed) {
  const RosCore core;
  InProcessServer& server = InProcessServer::get();
  server.load(street_world(street_car(test::paper_elements())));
  EXPECT_THAT(call_service("/multipath/gnss/add_fault", "{outage: {}}"),
              testing::AllOf(HasSubstr("False refused: "), HasSubstr("<changes>")));
  server.unload();
}

TEST_F(RosWorld, AServerWhoseRoscoreIsGoneEndsByItself) {
  CANYON_NEEDS_PROGRAM("gzserver");
  const std::filesystem::path file = RosEnvironment::get().folder() / "street.world";
  std::ofstream(file) << street_world(street_car(test::paper_elements()));
  const std::filesystem::path log = RosEnvironment::get().folder() / "gzserver.log";
  setenv("GAZEBO_PLUGIN_PATH", (std::string(canyon_build_dir) + "/lib").c_str(), 1);
  setenv("GAZEBO_IP", "127.0.0.1", 1);
  setenv("GAZEBO_MODEL_DATABASE_URI", "", 1);
  setenv("GAZEBO_MASTER_URI", ("http://127.0.0.1:" + std::to_string(canyon::test::free_port())).c_str(), 1);
  auto core = std::make_unique<RosCore>();
  ChildProgram server({"gzserver", "--verbose", file.string()}, log);
  EXPECT_TRUE(eventually([] {
    return run_program("rostopic list 2>&1").output.find("/multipath/fix\n") != std::string::npos;
  })) << canyon::test::read_bytes(log);
  core.reset();
  const auto begin = std::chrono::steady_clock::now();
  server.interrupt();
  EXPECT_EQ(server.exit_status(), 0) << canyon::test::read_bytes(log);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 15s);
  EXPECT_THAT(canyon::test::read_bytes(log), HasSubstr("publishing on ROS, master "));
}

}  // namespace
}  // namespace canyon::adapters::gazebo_classic
