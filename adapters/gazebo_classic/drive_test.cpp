// The drive plugin in a running world.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>

#include "adapters/gazebo_classic/testing/in_process_server.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

using gazebo::physics::ModelPtr;
using ignition::math::Pose3d;
using Vector = ignition::math::Vector3d;

constexpr double kStep_s = 0.01;

std::string world_of(const std::string& models, const std::string& location = "") {
  return fmt::format(R"(<?xml version="1.0"?><sdf version="1.6"><world name="w">{}
<physics type="ode"><max_step_size>{}</max_step_size><real_time_update_rate>0</real_time_update_rate></physics>
<model name="ground"><static>true</static><link name="l"><collision name="c"><geometry><plane><normal>0 0 1</normal></plane></geometry></collision></link></model>
{}</world></sdf>)",
                     location, kStep_s, models);
}

std::string car(const std::string& elements, const std::string& pose = "0 0 0 0 0 0") {
  return fmt::format(R"(<model name="car"><pose>{}</pose><link name="body"><collision name="c"><geometry>
<box><size>4 2 1</size></box></geometry></collision></link><link name="antenna"><pose>-1 0.5 1 0 0 0</pose></link>
<joint name="mast" type="fixed"><parent>body</parent><child>antenna</child></joint>
<plugin name="rails" filename="libCanyonDrivePlugin.so">{}</plugin></model>)",
                     pose, elements);
}

// The state read by a receiver at the end of each update.
class DrivePluginTest : public ::testing::Test {
 protected:
  struct State {
    double time_s;
    Pose3d pose;
    Vector velocity, antenna, antenna_velocity, rotation_rate;
  };
  static test::InProcessServer& server() { return test::InProcessServer::get(); }
  void load(const std::string& sdf) {
    world_ = server().load(sdf);
    car_ = world_->ModelByName("car");
    server().step();  // the world's thread loads plugins of models before its first step
    connection_ = gazebo::event::Events::ConnectWorldUpdateEnd([this] {
      const auto link = car_->GetLink("antenna");
      states_.push_back({world_->SimTime().Double(), car_->WorldPose(), car_->WorldLinearVel(),
                         link->WorldPose().Pos(), link->WorldLinearVel(), link->WorldAngularVel()});
    });
  }
  void TearDown() override {
    connection_.reset();
    car_.reset();
    world_.reset();
    server().unload();
  }

  gazebo::physics::WorldPtr world_;
  ModelPtr car_;
  gazebo::event::ConnectionPtr connection_;
  std::vector<State> states_;
};

TEST_F(DrivePluginTest, IsWhereTheWaypointsSayAtTheEndOfEachUpdate) {
  load(
      world_of(car("<waypoint>10 0 0.5</waypoint><waypoint>10 30 0.5</waypoint><speed_mps>20</speed_mps>"
                   "<offset_m>0 0 0.25</offset_m>")));
  server().step(200);
  ASSERT_EQ(states_.size(), 200U);
  for (const State& state : states_) {
    const bool moves = state.time_s < 1.5 - 1e-9;
    const double y = std::min(20 * state.time_s, 30.0);
    EXPECT_LT((state.pose.Pos() - Vector(10, y, 0.75)).Length(), 1e-9) << state.time_s;
    EXPECT_NEAR(state.pose.Rot().Yaw(), M_PI / 2, 1e-9);
    EXPECT_LT((state.velocity - Vector(0, moves ? 20 : 0, 0)).Length(), 1e-9) << state.time_s;
    // With heading north the antenna is half a metre to the west and one metre to the rear.
    EXPECT_LT((state.antenna - Vector(9.5, y - 1, 1.75)).Length(), 1e-9);
  }
}

TEST_F(DrivePluginTest, PushesWhatIsInTheWayAndStaysOnItsRails) {
  load(world_of(
      car("<waypoint>0 0 0.5</waypoint><waypoint>40 0 0.5</waypoint><speed_mps>8</speed_mps>") +
      R"(<model name="crate"><pose>6 0.3 0.5 0 0 0</pose><link name="l"><collision name="c"><geometry>
<box><size>1 1 1</size></box></geometry></collision></link></model>)"));
  server().step(300);
  for (const State& state : states_) {
    EXPECT_LT((state.pose.Pos() - Vector(8 * state.time_s, 0, 0.5)).Length(), 1e-9) << state.time_s;
    EXPECT_LT((state.velocity - Vector(8, 0, 0)).Length(), 1e-9) << state.time_s;
  }
  EXPECT_GT(world_->ModelByName("crate")->WorldPose().Pos().X(), 10);
}

TEST_F(DrivePluginTest, BeginsAnewAfterAReset) {
  load(world_of(car("<waypoint>0 0 0.5</waypoint><waypoint>40 0 0.5</waypoint><speed_mps>8</speed_mps>")));
  server().step(50);
  world_->Reset();
  EXPECT_LT((car_->WorldPose().Pos() - Vector(0, 0, 0.5)).Length(),
            1e-9);  // not where SDF had it, on the ground
  server().step(50);
  const std::size_t half = states_.size() / 2;
  ASSERT_GE(half, 50U);
  EXPECT_NEAR(states_.back().time_s, 0.5, 1e-9);
  for (const State& state : states_) {
    EXPECT_LT((state.pose.Pos() - Vector(8 * state.time_s, 0, 0.5)).Length(), 1e-9) << state.time_s;
  }
}

TEST_F(DrivePluginTest, DrivesTheSimulationsDrive) {
  const canyon::test::TemporaryFolder folder;
  // A bend with climb, one sample per second, as decimal degrees.
  std::string csv = "time,latitude,longitude,height\n";
  for (int i = 0; i <= 8; ++i) {
    csv += fmt::format("2024-05-01T10:00:0{}Z,{:.9f},{:.9f},{:.3f}\n", i, 22.3 + 4e-5 * i + 3e-6 * i * i,
                       114.17 + 9e-5 * i - 5e-6 * i * i, 10 + 0.3 * i);
  }
  std::ofstream(folder / "drive.csv") << csv;
  const simulation::Scenario scenario = simulation::parse_scenario(R"(
city: {open: true, origin: {latitude_deg: 22.299, longitude_deg: 114.171, height_m: 3}}
trajectory: {file: drive.csv}
start: 2024-05-01T10:00:00Z
)",
                                                                   folder / "scenario.yaml");
  city::City city;
  const double heading = 40 * M_PI / 180;
  city.frame = geodesy::LocalFrame(geodesy::Geodetic::from_degrees(22.299, 114.171, 3));
  const simulation::Simulation simulation(scenario, city);

  load(world_of(
      car(fmt::format("<trajectory>{}</trajectory>", (folder / "drive.csv").string())),
      "<spherical_coordinates><surface_model>EARTH_WGS84</surface_model><latitude_deg>22.299</latitude_deg>"
      "<longitude_deg>114.171</longitude_deg><elevation>3</elevation><heading_deg>40</heading_deg>"
      "</spherical_coordinates>"));
  server().step(799);
  ASSERT_EQ(states_.size(), 799U);
  const Eigen::Matrix3d world_from_enu =
      Eigen::AngleAxisd(-heading, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  for (std::size_t i = 0; i + 1 < states_.size(); i += 7) {
    const State& state = states_[i];
    const auto truth = simulation.antenna_pose(0, simulation.begin() + state.time_s);
    const Eigen::Vector3d point = world_from_enu * city.frame.local_from_geodetic(truth.position);
    EXPECT_LT((state.pose.Pos() - Vector(point.x(), point.y(), point.z())).Length(), 1e-4) << state.time_s;
    const Eigen::Vector3d velocity = world_from_enu * truth.velocity_enu_mps;
    EXPECT_LT((state.velocity - Vector(velocity.x(), velocity.y(), velocity.z())).Length(), 1e-3);
    const double yaw_error = std::remainder(state.pose.Rot().Yaw() - (truth.yaw_rad - heading), 2 * M_PI);
    EXPECT_NEAR(yaw_error, 0, 1e-5);
  }
  // The antenna on its arm moves by the difference of its positions, also in the bend.
  int bends = 0;
  for (std::size_t i = 1; i + 2 < states_.size(); ++i) {
    const Vector moved = (states_[i + 1].antenna - states_[i - 1].antenna) / (2 * kStep_s);
    // Half a step's change of acceleration where two cubics meet.
    EXPECT_LT((moved - states_[i].antenna_velocity).Length(), 0.01) << states_[i].time_s;
    if (std::abs(states_[i].rotation_rate.Z()) > 0.01) ++bends;
  }
  EXPECT_GT(bends, 300);
}

TEST_F(DrivePluginTest, AWrongElementLeavesTheModelWhereItIs) {
  load(world_of(car("<waypoint>10 0 0.5</waypoint><speed_mps>fast</speed_mps>", "1 2 0.5 0 0 0.3")));
  server().step(20);
  ASSERT_EQ(states_.size(), 20U);
  EXPECT_LT((states_.back().pose.Pos() - Vector(1, 2, 0.5)).Length(), 1e-3);
  EXPECT_NEAR(states_.back().pose.Rot().Yaw(), 0.3, 1e-3);
}

}  // namespace
}  // namespace canyon::adapters::gazebo_classic
