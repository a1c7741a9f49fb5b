// Receivers in a running Gazebo Sim server, from their elements to their messages.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <gz/msgs/boolean.pb.h>
#include <gz/msgs/entity_factory.pb.h>
#include <gz/msgs/log_playback_control.pb.h>
#include <gz/msgs/navsat.pb.h>
#include <gz/msgs/pose.pb.h>
#include <gz/msgs/spherical_coordinates.pb.h>
#include <gz/msgs/stringmsg.pb.h>
#include <gz/msgs/world_control.pb.h>
#include <cmath>
#include <gz/sim/Util.hh>
#include <gz/sim/components/Collision.hh>
#include <gz/sim/components/Geometry.hh>
#include <gz/sim/components/Model.hh>
#include <gz/sim/components/Name.hh>
#include <gz/sim/components/ParentEntity.hh>
#include <gz/sim/components/PoseCmd.hh>
#include <numbers>
#include <sdf/Box.hh>
#include <sdf/Geometry.hh>
#include <set>

#include "adapters/common/testing/street_message.hpp"
#include "adapters/gz_sim/testing/sim_server.hpp"
#include "adapters/gz_sim/testing/street_world.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/local_connection.hpp"

namespace canyon::adapters::gz_sim {
namespace {

using canyon::test::expect_street;
using gz::sim::Entity;
using msgs::GnssReceiver;
using msgs::GnssSatellite;
using test::Hands;
using test::navsat;
using test::paper_elements;
using test::SimServer;
using test::street_car;
using test::street_world;
using test::StreetSatellite;
using test::topic_of;
namespace components = gz::sim::components;

const std::string kSpecular = "<propagation><model>specular</model></propagation>";
const std::string kStart = "<start>2024-02-04T00:00:00 GPST</start>";
/// The street's satellites with the paper's noise.
const std::string kNoisy = "<satAzimuth>" + test::street_angles(&StreetSatellite::azimuth_deg) +
                           "</satAzimuth><satElevation>" +
                           test::street_angles(&StreetSatellite::elevation_deg) +
                           "</satElevation><disableNoise>0</disableNoise><seed>5</seed>" + kStart;

/// A listener with its server; the listener exists before the first step.
struct StreetRun {
  explicit StreetRun(const std::string& world, const std::string& topic = topic_of())
      : server(world), listener(topic) {}
  SimServer server;
  test::GnssListener listener;

  GnssReceiver after(unsigned steps, double sim_time_s) {
    server.step(steps);
    const auto message = listener.at(sim_time_s);
    EXPECT_TRUE(message) << "nothing came";
    return message.value_or(GnssReceiver());
  }
};

Entity model_named(const std::string& name, const Hands::Ecm& ecm) {
  return ecm.EntityByComponents(components::Model(), components::Name(name));
}

void put(StreetRun& run, const std::string& model, const gz::math::Pose3d& pose) {
  run.server.hands->next = [=](Hands::Ecm& ecm) {
    ecm.CreateComponent(model_named(model, ecm), components::WorldPoseCmd(pose));
  };
}

template <typename Reply, typename Request>
Reply request(const std::string& service, const Request& request) {
  gz::transport::Node node;
  Reply reply;
  bool result = false;
  EXPECT_TRUE(node.Request(service, request, 5000, reply, result)) << service;
  EXPECT_TRUE(result) << service;
  return reply;
}

TEST(GnssWorld, GivesTheStreetsClosedForms) {
  StreetRun mirror(street_world(street_car(navsat(paper_elements()))));
  const GnssReceiver message = mirror.after(20, 0.1);
  expect_street(message, &StreetSatellite::mirror_m, 1e-3);
  EXPECT_EQ(message.state(), GnssReceiver::FIX);
  EXPECT_EQ(message.sim_time_ns(), 100'000'000);
  EXPECT_EQ(message.model(), "car");
  EXPECT_EQ(message.link(), "car::body");
  EXPECT_NEAR(message.antenna().height_m(), 7, 1e-5);
}

TEST(GnssWorld, GivesTheStreetsClosedFormsBySpecularReflection) {
  StreetRun run(street_world(street_car(navsat(paper_elements() + kSpecular))));
  expect_street(run.after(20, 0.1), &StreetSatellite::specular_m, 1e-3);
}

TEST(GnssWorld, ServesCustomSensorsAndAllNavsatSensorsWhereAsked) {
  // The system's own elements are the defaults of its receivers.
  const std::string system = "<plugin filename='CanyonGnssSystem' name='canyon::GnssSystem'>" +
                             paper_elements() +
                             "<publishers><ros>false</ros></publishers><serve>all</serve></plugin>";
  const std::string custom =
      "<sensor name='antenna' type='custom' gz:type='gnss'><pose>0 0 2 0 0 0</pose>"
      "<update_rate>10</update_rate></sensor>";
  const std::string plain =
      "<sensor name='antenna' type='navsat'><pose>0 0 2 0 0 0</pose><update_rate>10</update_rate></sensor>";
  StreetRun run(
      street_world(street_car(custom) + street_car(plain, "other", "3 20 0 0 0 0"), 0, true, system));
  test::GnssListener other(topic_of("other"));
  expect_street(run.after(20, 0.1), &StreetSatellite::mirror_m, 1e-3);
  const auto second = other.at(0.1);
  ASSERT_TRUE(second);
  expect_street(*second, &StreetSatellite::mirror_m, 1e-3);
}

TEST(GnssWorld, HangsOnAModelAndServesThatAlone) {
  const std::string plugin =
      "<plugin filename='CanyonGnssSystem' name='canyon::GnssSystem'>" + paper_elements() + "</plugin>";
  StreetRun run(street_world(street_car(navsat("<seed>2</seed>"), "car", "3 0 0 0 0 0", plugin) +
                                 street_car(navsat(paper_elements()), "other", "3 20 0 0 0 0"),
                             0, true, ""));
  test::GnssListener other(topic_of("other"));
  expect_street(run.after(20, 0.1), &StreetSatellite::mirror_m, 1e-3);
  EXPECT_TRUE(other.all().empty());
}

// Gazebo's own NavSat system would publish the truth on the same topic.
TEST(GnssWorld, NavSatIsTheReceiversFixAndNothingElse) {
  const std::string ideal = "<plugin filename='gz-sim-navsat-system' name='gz::sim::systems::NavSat'/>";
  StreetRun run(street_world(ideal + street_car(navsat(paper_elements() + kSpecular)) +
                             "<model name='plain'><pose>3 40 0 0 0 0</pose><link name='body'>"
                             "<gravity>false</gravity><sensor name='antenna' type='navsat'>"
                             "<update_rate>10</update_rate></sensor></link></model>"));
  std::mutex mutex;
  std::vector<gz::msgs::NavSat> fixes, truths;
  gz::transport::Node node;
  std::function<void(const gz::msgs::NavSat&)> take = [&](const gz::msgs::NavSat& message) {
    const std::lock_guard lock(mutex);
    fixes.push_back(message);
  };
  std::function<void(const gz::msgs::NavSat&)> take_truth = [&](const gz::msgs::NavSat& message) {
    const std::lock_guard lock(mutex);
    truths.push_back(message);
  };
  ASSERT_TRUE(node.Subscribe(topic_of("car", "navsat"), take));
  ASSERT_TRUE(node.Subscribe(topic_of("plain", "navsat"), take_truth));
  const GnssReceiver last = run.after(100, 1.0);
  ASSERT_TRUE(last.has_fix());
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  const auto count = [&] {
    const std::lock_guard lock(mutex);
    return std::min(fixes.size(), truths.size());
  };
  while (count() < 10 && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  const std::lock_guard lock(mutex);
  ASSERT_GE(fixes.size(), 10U);
  EXPECT_LE(fixes.size(), 11U) << "somebody else publishes as well";
  ASSERT_GE(truths.size(), 10U) << "sensors without <canyon> stay Gazebo's";
  EXPECT_NEAR(truths.back().latitude_deg() - 22.3, geodesy::degrees(40.0 / 6'350'000), 2e-6);
  const GnssReceiver::State state = last.state();
  EXPECT_EQ(state, GnssReceiver::FIX);
  EXPECT_DOUBLE_EQ(fixes.back().latitude_deg(), last.fix().position().latitude_deg());
  EXPECT_DOUBLE_EQ(fixes.back().longitude_deg(), last.fix().position().longitude_deg());
  EXPECT_DOUBLE_EQ(fixes.back().altitude(), last.fix().position().height_m());
  EXPECT_GT(std::abs(last.fix().error_enu_m().east()) + std::abs(last.fix().error_enu_m().up()), 1.0)
      << "the reflections show";
}

TEST(GnssWorld, ABoxInTheWayBlocksOnTheNextUpdate) {
  StreetRun run(street_world(street_car(navsat(paper_elements() + "<rate_hz>100</rate_hz>")) +
                             test::shape_model("bus", "3 -150 0 0 0 0", test::box("4 2 40"), false)));
  const GnssReceiver before = run.after(5, 0.05);
  ASSERT_EQ(before.satellites(2).visibility(), GnssSatellite::LOS);
  // 20 m north of the antenna: the satellite in the north is at 30 deg elevation, the bus 20 m.
  put(run, "bus", {3, 20, 0, 0, 0, 0});
  const GnssReceiver after = run.after(1, 0.06);
  EXPECT_EQ(after.sim_time_ns(), 60'000'000);
  EXPECT_NE(after.satellites(2).visibility(), GnssSatellite::LOS);
  put(run, "bus", {3, -150, 0, 0, 0, 0});
  EXPECT_EQ(run.after(1, 0.07).satellites(2).visibility(), GnssSatellite::LOS);
}

TEST(GnssWorld, ThingsThatComeAreMovedResizedAndGo) {
  StreetRun run(street_world(street_car(navsat(paper_elements() + "<rate_hz>100</rate_hz>"))));
  ASSERT_EQ(run.after(5, 0.05).satellites(2).visibility(), GnssSatellite::LOS);
  // Spawned static, by the service used by all tools.
  gz::msgs::EntityFactory request;
  request.set_sdf("<?xml version='1.0'?><sdf version='1.9'>" +
                  test::shape_model("tower", "3 20 0 0 0 0", test::box("4 2 40")) + "</sdf>");
  EXPECT_TRUE((request<gz::msgs::Boolean>("/world/street/create", request)).data());
  EXPECT_NE(run.after(3, 0.08).satellites(2).visibility(), GnssSatellite::LOS);
  // Moved away by set_pose.
  gz::msgs::Pose pose;
  pose.set_name("tower");
  pose.mutable_position()->set_x(3);
  pose.mutable_position()->set_y(-150);
  pose.mutable_orientation()->set_w(1);
  EXPECT_TRUE((request<gz::msgs::Boolean>("/world/street/set_pose", pose)).data());
  EXPECT_EQ(run.after(3, 0.11).satellites(2).visibility(), GnssSatellite::LOS);
  // The box is as long as the street, and blocks the path again.
  run.server.hands->next = [](Hands::Ecm& ecm) {
    const Entity tower = model_named("tower", ecm);
    for (const Entity shape : ecm.Descendants(tower)) {
      if (ecm.Component<components::Collision>(shape) == nullptr) continue;
      sdf::Box box;
      box.SetSize({4, 400, 40});
      sdf::Geometry geometry;
      geometry.SetType(sdf::GeometryType::BOX);
      geometry.SetBoxShape(box);
      ecm.SetComponentData<components::Geometry>(shape, geometry);
      ecm.SetChanged(shape, components::Geometry::typeId, gz::sim::ComponentState::OneTimeChange);
    }
  };
  EXPECT_NE(run.after(2, 0.13).satellites(2).visibility(), GnssSatellite::LOS);
  run.server.hands->next = [](Hands::Ecm& ecm) { ecm.RequestRemoveEntity(model_named("tower", ecm)); };
  EXPECT_EQ(run.after(3, 0.16).satellites(2).visibility(), GnssSatellite::LOS);
}

// The same street rotated: the world's y axis points 30 deg west of north, so do its walls; satellites stay.
TEST(GnssWorld, HonoursTheWorldsHeading) {
  StreetRun run(street_world(street_car(navsat(paper_elements() + kSpecular)), 30));
  const GnssReceiver message = run.after(20, 0.1);
  // The antenna (3, 0) is 3 cos 30 deg east and 3 sin 30 deg north of the origin.
  EXPECT_NEAR(
      message.antenna().longitude_deg() - 114.17,
      geodesy::degrees(3 * std::cos(geodesy::radians(30)) / (6378137 * std::cos(geodesy::radians(22.3)))),
      2e-7);
  EXPECT_NEAR(message.antenna().latitude_deg() - 22.3,
              geodesy::degrees(3 * std::sin(geodesy::radians(30)) / 6350000), 2e-7);
  // A satellite at azimuth 90 deg is seen 30 deg off the wall's normal: 13 m * 2 cos(45 deg) cos(30 deg).
  EXPECT_EQ(message.satellites(0).visibility(), GnssSatellite::NLOS);
  EXPECT_NEAR(message.satellites(0).excess_m(),
              2 * 13 * std::cos(geodesy::radians(45)) * std::cos(geodesy::radians(30)), 1e-3);
}

// The world's position changes while it runs: the next epoch is at the new position, rotated.
TEST(GnssWorld, FollowsSetSphericalCoordinates) {
  StreetRun run(street_world(street_car(navsat(paper_elements() + kSpecular))));
  ASSERT_NEAR(run.after(20, 0.1).antenna().latitude_deg(), 22.3, 1e-4);
  gz::msgs::SphericalCoordinates there;
  there.set_surface_model(gz::msgs::SphericalCoordinates::EARTH_WGS84);
  there.set_latitude_deg(47.4);
  there.set_longitude_deg(8.5);
  there.set_elevation(500);
  there.set_heading_deg(30);
  EXPECT_TRUE((request<gz::msgs::Boolean>("/world/street/set_spherical_coordinates", there)).data());
  const GnssReceiver message = run.after(20, 0.4);
  EXPECT_NEAR(message.antenna().latitude_deg(), 47.4, 1e-4);
  EXPECT_NEAR(message.antenna().longitude_deg(), 8.5, 1e-4);
  EXPECT_NEAR(message.antenna().height_m(), 502, 1e-3);
  EXPECT_NEAR(message.satellites(0).excess_m(),
              2 * 13 * std::cos(geodesy::radians(45)) * std::cos(geodesy::radians(30)), 1e-2);
}

// A link that moves along the world's y axis with a heading of 30 deg moves 30 deg west of north and rotates.
TEST(GnssWorld, GivesVelocityInEastNorthUp) {
  const std::string push =
      "<plugin filename='gz-sim-velocity-control-system' name='gz::sim::systems::VelocityControl'>"
      "<initial_linear>0 10 0</initial_linear><initial_angular>0 0 0.5</initial_angular></plugin>";
  const std::string sensor =
      navsat(paper_elements() + "<rate_hz>100</rate_hz><lever_arm><forward_m>2</forward_m></lever_arm>");
  StreetRun run(street_world(street_car(sensor, "car", "3 0 0 0 0 0", push), 30, false));
  const GnssReceiver message = run.after(3, 0.02);
  // Velocities are in the body's frame, rotated by 0.5 rad/s for 20 or 30 ms. The lever of 2 m forward (x) at
  // 0.5 rad/s adds 1 m/s along y: 11 m/s at 120 deg from east.
  EXPECT_NEAR(message.antenna_velocity_enu_mps().east(), -11 * std::sin(geodesy::radians(30)), 0.2);
  EXPECT_NEAR(message.antenna_velocity_enu_mps().north(), 11 * std::cos(geodesy::radians(30)), 0.2);
  EXPECT_NEAR(
      std::hypot(message.antenna_velocity_enu_mps().east(), message.antenna_velocity_enu_mps().north()), 11,
      1e-3);
}

TEST(GnssWorld, TwentyReceiversAtTenHertz) {
  std::string cars;
  for (int i = 0; i < 20; ++i) {
    cars += street_car(navsat(paper_elements()), fmt::format("car{}", i),
                       fmt::format("3 {} 0 0 0 0", 8 * i - 80));
  }
  SimServer server(street_world(cars));
  std::vector<std::unique_ptr<test::GnssListener>> listeners;
  for (int i = 0; i < 20; ++i) {
    listeners.push_back(std::make_unique<test::GnssListener>(topic_of(fmt::format("car{}", i))));
  }
  server.step(200);  // 2 s
  for (int i = 0; i < 20; ++i) {
    SCOPED_TRACE(i);
    ASSERT_TRUE(listeners[static_cast<std::size_t>(i)]->at(2.0));
    const auto all = listeners[static_cast<std::size_t>(i)]->all();
    std::set<std::int64_t> times;
    for (const GnssReceiver& message : all) times.insert(message.sim_time_ns());
    EXPECT_THAT(times, ::testing::SizeIs(::testing::AnyOf(20, 21)));  // 0.1 s to 2 s, and the first update
    expect_street(all.back(), &StreetSatellite::mirror_m, 1e-3);
  }
}

TEST(GnssWorld, AResetRepeatsTheRun) {
  StreetRun run(street_world(street_car(navsat(kNoisy))));
  const GnssReceiver first = [&] {
    run.server.step(50);
    EXPECT_TRUE(run.listener.at(0.5));
    return run.listener.at(0.3).value_or(GnssReceiver());
  }();
  run.listener.clear();
  gz::msgs::WorldControl control;
  control.mutable_reset()->set_all(true);
  EXPECT_TRUE((request<gz::msgs::Boolean>("/world/street/control", control)).data());
  run.server.step(60);
  ASSERT_TRUE(run.listener.at(0.5));
  const auto second = run.listener.at(0.3);
  ASSERT_TRUE(second);
  EXPECT_LT(run.listener.all().front().sim_time_ns(), 100'000'000) << "time begins anew";
  EXPECT_EQ(first.sim_time_ns(), second->sim_time_ns());
  EXPECT_NE(first.satellites(0).noise_m(), 0);
  EXPECT_EQ(first.satellites(0).noise_m(), second->satellites(0).noise_m()) << "same seed, same numbers";
  EXPECT_EQ(first.gps_time_of_week_ns(), second->gps_time_of_week_ns());
}

TEST(GnssWorld, RewindRepeatsTheRunAndSeekGoesOn) {
  StreetRun run(street_world(street_car(navsat(kNoisy))));
  run.server.step(50);
  ASSERT_TRUE(run.listener.at(0.5));
  const auto first = run.listener.at(0.3);
  run.listener.clear();
  gz::msgs::WorldControl control;
  control.mutable_reset()->set_time_only(true);
  EXPECT_TRUE((request<gz::msgs::Boolean>("/world/street/control", control)).data());
  run.server.step(60);
  ASSERT_TRUE(run.listener.at(0.5));
  const auto second = run.listener.at(0.3);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->satellites(0).noise_m(), second->satellites(0).noise_m());

  run.listener.clear();
  gz::msgs::LogPlaybackControl seek;
  seek.mutable_seek()->set_sec(1000);
  EXPECT_TRUE((request<gz::msgs::Boolean>("/world/street/playback/control", seek)).data());
  run.server.step(20);
  const auto later = run.listener.at(1000);
  ASSERT_TRUE(later);
  EXPECT_EQ(later->state(), GnssReceiver::FIX);
  EXPECT_NEAR(static_cast<double>(later->gps_time_of_week_ns() - first->gps_time_of_week_ns()) * 1e-9,
              static_cast<double>(later->sim_time_ns() - first->sim_time_ns()) * 1e-9, 1e-6);
}

TEST(GnssWorld, PauseBringsNothing) {
  StreetRun run(street_world(street_car(navsat(paper_elements()))));
  run.after(10, 0.1);
  run.listener.clear();
  for (int i = 0; i < 20; ++i) run.server.step_paused();
  EXPECT_TRUE(run.listener.all().empty());
}

// A driver on the receiver's line gets responses also while the world is paused. {number} is the model's.
TEST(GnssWorld, AnswersADriverBetweenEpochs) {
  constexpr int kPorts = 10;  // the last digit of the port is the model's number
  int port = 0;
  while (port % kPorts != 7) port = canyon::test::free_port();
  const std::string stream =
      "<streams>ubx=tcp://127.0.0.1:" + std::to_string(port / kPorts) + "{number}</streams>";
  SimServer server(street_world(street_car(navsat(paper_elements() + stream), "car_7")));
  server.step(20);
  canyon::test::LocalConnection driver(port);
  server.step(50);
  driver.send_text(std::string("\xB5\x62\x0A\x04\x00\x00\x0E\x34", 8));  // a poll of MON-VER
  std::string response;
  for (int i = 0; i < 1000 && response.find("(Canyon)") == std::string::npos; ++i) {
    server.step_paused();
    pollfd some{driver.handle(), POLLIN, 0};
    if (poll(&some, 1, 5) == 1) response += driver.read_some();
  }
  EXPECT_NE(response.find("(Canyon)"), std::string::npos);
}

// One is before its base in the world's file, one after it. A base on the same vehicle gives the heading.
TEST(GnssWorld, ReceiversCorrectEachOther) {
  const std::string common = "<profile>ublox-f9p</profile><sky><nominal>true</nominal></sky>" + kStart;
  const std::string rover = common + "<rtk>true</rtk><corrections><from>tower</from></corrections>";
  const std::string front =
      "<sensor name='front' type='navsat'><pose>0 1 2 0 0 "
      "0</pose><update_rate>10</update_rate><canyon><name>front"
      "</name>" +
      common + "<publishers><ros>false</ros></publishers></canyon></sensor>";
  const std::string heading = common + "<rtk>true</rtk><corrections><from>front</from></corrections>";
  StreetRun run(street_world(street_car(navsat(rover), "before", "3 0 0 0 0 0") +
                                 street_car(navsat("<name>tower</name>" + common), "base", "3 30 0 0 0 0") +
                                 street_car(navsat(rover), "after", "3 60 0 0 0 0") +
                                 street_car(front + navsat(heading), "two", "3 90 0 0 0 0"),
                             0, false),
                topic_of("before"));
  test::GnssListener after(topic_of("after")), two(topic_of("two"));
  constexpr double kEnd_s = 25;
  const GnssReceiver first = run.after(static_cast<unsigned>(kEnd_s * 100) + 2, kEnd_s);
  EXPECT_EQ(first.fix().kind(), msgs::GnssFix::FIXED);
  EXPECT_FALSE(first.fix().baseline().moving_base());
  const auto length_m = [](const GnssReceiver& message) {
    const auto& vector = message.fix().baseline().vector_enu_m();
    return std::hypot(vector.east(), vector.north());
  };
  EXPECT_NEAR(length_m(first), 30, 0.05);
  const auto second = after.at(kEnd_s), third = two.at(kEnd_s);
  ASSERT_TRUE(second && third);
  EXPECT_EQ(second->fix().kind(), msgs::GnssFix::FIXED);
  EXPECT_TRUE(third->fix().baseline().moving_base());
  EXPECT_NEAR(length_m(*third), 1, 0.03);
  // From the base at the front to the other antenna.
  EXPECT_NEAR(std::remainder(third->fix().baseline().heading_rad() - std::numbers::pi, 2 * std::numbers::pi),
              0, 0.03);
}

TEST(GnssWorld, WrongValuesLeaveTheSimulationRunning) {
  for (const std::string& wrong :
       {std::string("<satAzimuth>1 2</satAzimuth><satElevation>1</satElevation>"),
        std::string("<elevation_mask_deg>ninety</elevation_mask_deg>"),
        std::string(
            "<ray_engine>physics</ray_engine><satAzimuth>1</satAzimuth><satElevation>1</satElevation>"),
        std::string("<sky><navigation>no_such.rnx</navigation></sky>"),
        std::string("<origin_latitude>222</origin_latitude><origin_longitude>0</origin_longitude>"),
        std::string("<start>yesterday</start>")}) {
    SCOPED_TRACE(wrong);
    StreetRun run(street_world(street_car(navsat(wrong)) +
                               street_car(navsat(paper_elements()), "other", "3 20 0 0 0 0")));
    test::GnssListener other(topic_of("other"));
    run.server.step(20);
    EXPECT_TRUE(other.at(0.1)) << "the others are served";
    EXPECT_TRUE(run.listener.all().empty());
    EXPECT_EQ(run.server.hands->sim_time, std::chrono::milliseconds(200));
  }
}

TEST(GnssWorld, LeavesWithItsModelAndComesWithANewOne) {
  StreetRun run(street_world(street_car(navsat(paper_elements())) +
                             street_car(navsat(paper_elements()), "other", "3 20 0 0 0 0")));
  test::GnssListener other(topic_of("other"));
  run.after(20, 0.2);
  run.server.hands->next = [](Hands::Ecm& ecm) { ecm.RequestRemoveEntity(model_named("car", ecm)); };
  run.server.step(40);
  EXPECT_TRUE(other.at(0.6));
  for (const GnssReceiver& message : run.listener.all()) EXPECT_LE(message.sim_time_ns(), 210'000'000);
  gz::msgs::EntityFactory request;
  request.set_sdf("<?xml version='1.0'?><sdf version='1.9'>" + street_car(navsat(paper_elements()), "late") +
                  "</sdf>");
  test::GnssListener late(topic_of("late"));
  EXPECT_TRUE((request<gz::msgs::Boolean>("/world/street/create", request)).data());
  run.server.step(30);
  const auto message = late.at(0.7);
  ASSERT_TRUE(message);
  expect_street(*message, &StreetSatellite::mirror_m, 1e-3);
}

// server.config may list the system anywhere, also before the system that adds models to the world.
TEST(GnssWorld, SeesModelsOfSystemsThatComeAfterIt) {
  std::string world = street_world(street_car(navsat(paper_elements())), 0, true, "");
  world.insert(world.find("<plugin filename='gz-sim-user-commands-system'"), test::kGnssSystem);
  StreetRun run(world);
  run.after(10, 0.1);
  gz::msgs::EntityFactory request;
  request.set_sdf("<?xml version='1.0'?><sdf version='1.9'>" +
                  street_car(navsat(paper_elements()), "late", "3 20 0 0 0 0") + "</sdf>");
  test::GnssListener late(topic_of("late"));
  EXPECT_TRUE((request<gz::msgs::Boolean>("/world/street/create", request)).data());
  run.server.step(30);
  const auto message = late.at(0.3);
  ASSERT_TRUE(message);
  expect_street(*message, &StreetSatellite::mirror_m, 1e-3);
}

TEST(GnssWorld, TruthFromATopic) {
  StreetRun run(street_world(street_car(navsat(paper_elements() + "<pose_topic>/mocap</pose_topic>"))));
  const GnssReceiver without = run.after(20, 0.1);
  EXPECT_EQ(without.state(), GnssReceiver::NO_TRUTH);
  gz::transport::Node node;
  auto publisher = node.Advertise<gz::msgs::Pose>("/mocap");
  gz::msgs::Pose pose;
  pose.mutable_position()->set_x(3);
  pose.mutable_position()->set_z(2);
  pose.mutable_orientation()->set_w(1);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  GnssReceiver message;
  while (message.state() != GnssReceiver::FIX && std::chrono::steady_clock::now() < deadline) {
    publisher.Publish(pose);
    run.server.step(10);
    if (const auto all = run.listener.all(); !all.empty()) message = all.back();
  }
  ASSERT_EQ(message.state(), GnssReceiver::FIX);
  expect_street(message, &StreetSatellite::mirror_m, 1e-3);
  // Silence does not freeze a good fix: too old after 0.5 s of simulated time.
  run.server.step(100);
  const auto all = run.listener.all();
  EXPECT_EQ(all.back().state(), GnssReceiver::NO_TRUTH);
}

TEST(GnssWorld, OptionsAtRunTime) {
  StreetRun run(street_world(street_car(navsat(paper_elements()))));
  run.after(20, 0.1);
  std::thread stepper;
  std::atomic<bool> done{false};
  stepper = std::thread([&] {
    while (!done) run.server.step(1);
  });
  gz::msgs::StringMsg request;
  request.set_data("elevation_mask_deg");
  const std::string before = request<gz::msgs::StringMsg>("/world/street/canyon/get_options", request).data();
  EXPECT_THAT(before, ::testing::HasSubstr("15")) << "the paper's mask";
  request.set_data("elevation_mask_deg: 33");
  const std::string set = request<gz::msgs::StringMsg>("/world/street/canyon/set_options", request).data();
  EXPECT_THAT(set, ::testing::HasSubstr("33"));
  request.set_data("elevation_mask_deg: 133");
  const std::string refused =
      request<gz::msgs::StringMsg>("/world/street/canyon/set_options", request).data();
  EXPECT_THAT(refused, ::testing::StartsWith("refused: "));
  done = true;
  stepper.join();
  run.listener.clear();
  run.server.step(20);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (run.listener.all().empty() && std::chrono::steady_clock::now() < deadline) run.server.step(10);
  ASSERT_FALSE(run.listener.all().empty());
  // Satellites at 20, 30 deg are below the new mask.
  EXPECT_FALSE(run.listener.all().back().satellites(5).above_mask());
  EXPECT_FALSE(run.listener.all().back().satellites(2).above_mask());
}

// A reset removes a model added by a service, and its receiver; the same model may be added again.
TEST(GnssWorld, SpawnedModelsGoWithAResetAndComeAgain) {
  StreetRun run(street_world("", 0, true));
  const auto create = [] {
    gz::msgs::EntityFactory request;
    request.set_sdf("<?xml version='1.0'?><sdf version='1.9'>" + street_car(navsat(paper_elements())) +
                    "</sdf>");
    EXPECT_TRUE((request<gz::msgs::Boolean>("/world/street/create", request)).data());
  };
  for (int round = 0; round < 2; ++round) {
    create();
    expect_street(run.after(30, 0.1), &StreetSatellite::mirror_m, 1e-3);
    gz::msgs::WorldControl control;
    control.mutable_reset()->set_all(true);
    EXPECT_TRUE((request<gz::msgs::Boolean>("/world/street/control", control)).data());
    run.server.step(2);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    run.listener.clear();
    run.server.step(50);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    EXPECT_TRUE(run.listener.all().empty()) << "a receiver without a vehicle";
    run.listener.clear();
  }
}

// Two servers with worlds of one name in one process, as several do on one machine.
TEST(GnssWorld, WorldsOfTwoServersAreApart) {
  SimServer first(street_world(street_car(navsat(paper_elements()))));
  SimServer second(street_world(street_car(navsat(paper_elements()), "lorry"), 0, false));
  test::GnssListener in_street(topic_of()), in_the_open(topic_of("lorry"));
  first.step(20);
  second.step(20);
  const auto street = in_street.at(0.1), open = in_the_open.at(0.1);
  ASSERT_TRUE(street && open);
  expect_street(*street, &StreetSatellite::mirror_m, 1e-3);
  for (const GnssSatellite& satellite : open->satellites()) {
    EXPECT_EQ(satellite.visibility(), GnssSatellite::LOS);
  }
}

}  // namespace
}  // namespace canyon::adapters::gz_sim
