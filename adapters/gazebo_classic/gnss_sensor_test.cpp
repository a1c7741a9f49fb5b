// Receivers in a running gzserver, from their plugin elements to their messages.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "adapters/common/testing/street_message.hpp"
#include "adapters/gazebo_classic/testing/gnss_listener.hpp"
#include "adapters/gazebo_classic/testing/in_process_server.hpp"
#include "adapters/gazebo_classic/testing/street_world.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/receiver_runner.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "tests/support/append_box.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

using canyon::test::expect_street;
using msgs::GnssReceiver;
using msgs::GnssSatellite;
using test::GnssListener;
using test::InProcessServer;
using test::street_car;
using test::street_satellites;
using test::street_world;

const std::string kEmbree = "<ray_engine>embree</ray_engine>";
const std::string kPhysics = "<ray_engine>physics</ray_engine>";
const std::string kSpecular = "<propagation><model>specular</model></propagation>";
constexpr const char* kTopic = "~/car/antenna/gnss";

/// A message after some steps: every due update has been published by then.
GnssReceiver observe(const std::string& world, const std::string& topic = kTopic, unsigned steps = 20) {
  InProcessServer& server = InProcessServer::get();
  const auto loaded = server.load(world);
  GnssListener listener(loaded->Name(), topic);
  server.step(steps);
  const auto message = listener.at(0.1);
  EXPECT_TRUE(message) << "nothing came on " << topic;
  return message.value_or(GnssReceiver());
}

TEST(GnssSensor, LoadsThePapersSnippet) {
  const GnssReceiver message = observe(street_world(street_car(test::paper_elements())));
  expect_street(message, &test::StreetSatellite::mirror_m, 1e-3);
  EXPECT_EQ(message.state(), GnssReceiver::FIX);
  EXPECT_EQ(message.sim_time_ns(), 100'000'000);
  // One range per ray; satellite 0: 7 m / cos(45 deg) to the eastern wall, 13 m / cos(45 deg) to the western.
  ASSERT_EQ(message.scan_ranges_m_size(), 16);
  EXPECT_NEAR(message.scan_ranges_m(0), 7 * std::sqrt(2), 1e-3);
  EXPECT_NEAR(message.scan_ranges_m(1), 13 * std::sqrt(2), 1e-3);
  EXPECT_TRUE(std::isinf(message.scan_ranges_m(4)));
}

TEST(GnssSensor, BothEnginesGiveTheStreetsClosedForms) {
  const GnssReceiver physics = observe(street_world(street_car(test::paper_elements() + kPhysics)));
  const GnssReceiver embree = observe(street_world(street_car(test::paper_elements() + kEmbree)));
  expect_street(physics, &test::StreetSatellite::mirror_m, 1e-3);
  expect_street(embree, &test::StreetSatellite::mirror_m, 1e-4);
  expect_street(observe(street_world(street_car(test::paper_elements() + kEmbree + kSpecular))),
                &test::StreetSatellite::specular_m, 1e-4);
  EXPECT_NEAR(physics.fix().error_enu_m().east(), embree.fix().error_enu_m().east(), 5e-3);
  EXPECT_NEAR(physics.fix().error_enu_m().north(), embree.fix().error_enu_m().north(), 5e-3);
  EXPECT_NEAR(physics.fix().error_enu_m().up(), embree.fix().error_enu_m().up(), 5e-3);
}

// The engine alone, with the same boxes and position, as in `canyon trace`.
TEST(GnssSensor, GivesTheEnginesFix) {
  city::City city;
  city.frame = geodesy::LocalFrame(geodesy::Geodetic::from_degrees(22.3, 114.17, 5));
  for (const double x : {10.5, -10.5}) {
    canyon::test::append_box(city.mesh, "wall", city::Surface::Building, city::Material::Concrete,
                             {x - 0.5, -200, 0}, {x + 0.5, 200, 30});
  }
  const auto yaml = [](const std::string& angles) {
    std::string list = angles;
    for (char& c : list) c = c == ' ' ? ',' : c;
    return "[" + list + "]";
  };
  simulation::RunnerConfig config = simulation::parse_live_config(
      "sky: {frozen: {satAzimuth: " + yaml(test::street_angles(&test::StreetSatellite::azimuth_deg)) +
          ", satElevation: " + yaml(test::street_angles(&test::StreetSatellite::elevation_deg)) +
          "}}\nprofile: paper\npropagation: {model: specular}\nnoise: {enabled: false}\n",
      "street");
  simulation::ReceiverRunner engine(config, std::make_shared<simulation::CityScene>(std::move(city)),
                                    geodesy::GpsTime::from_week(2300, 0));
  const auto expected = engine.observe(0.1, {{3, 0, 2}}).epoch;

  const GnssReceiver message = observe(street_world(
      street_car(test::paper_elements() + kEmbree + kSpecular + "<start>2024-02-04T00:00:00 GPST</start>")));
  ASSERT_EQ(message.state(), GnssReceiver::FIX);
  EXPECT_GT(expected.error_enu_m.norm(), 1.0);  // the reflections have an effect
  EXPECT_NEAR(message.fix().error_enu_m().east(), expected.error_enu_m.x(), 1e-3);
  EXPECT_NEAR(message.fix().error_enu_m().north(), expected.error_enu_m.y(), 1e-3);
  EXPECT_NEAR(message.fix().error_enu_m().up(), expected.error_enu_m.z(), 1e-3);
  EXPECT_NEAR(message.antenna().latitude_deg(), geodesy::degrees(expected.truth.position.latitude_rad),
              1e-10);
  EXPECT_NEAR(message.antenna().height_m(), 7, 1e-5);
}

TEST(GnssSensor, HangsOnGpsSensorsAndOnModelsToo) {
  const std::string embree = test::paper_elements() + kEmbree;
  const GnssReceiver ray = observe(street_world(street_car(embree)));
  const GnssReceiver gps = observe(street_world(street_car(embree, "gps")));
  const GnssReceiver gps_by_physics =
      observe(street_world(street_car(test::paper_elements() + kPhysics, "gps")));
  const GnssReceiver model =
      observe(street_world(street_car(embree + "<lever_arm><up_m>2</up_m></lever_arm>", "")), "~/car/gnss");
  for (const GnssReceiver* other : {&gps, &gps_by_physics, &model}) {
    expect_street(*other, &test::StreetSatellite::mirror_m, 1e-3);
    EXPECT_NEAR(other->fix().error_enu_m().east(), ray.fix().error_enu_m().east(), 5e-3);
  }
}

TEST(GnssSensor, ABoxInTheWayBlocksOnTheNextUpdate) {
  for (const std::string& engine : {kPhysics, kEmbree}) {
    SCOPED_TRACE(engine);
    InProcessServer& server = InProcessServer::get();
    const auto world =
        server.load(street_world(street_car(test::paper_elements() + engine + "<rate_hz>100</rate_hz>") +
                                 test::box_model("bus", "3 -150 0 0 0 0", "4 2 40", false)));
    GnssListener listener(world->Name(), kTopic);
    server.step(5);
    const auto before = listener.at(0.05);
    ASSERT_TRUE(before);
    ASSERT_EQ(before->satellites(2).visibility(), GnssSatellite::LOS);
    // 20 m north of the antenna: the satellite in the north is at 30 deg elevation, the bus 20 m.
    world->ModelByName("bus")->SetWorldPose({3, 20, 0, 0, 0, 0});
    server.step(1);
    const auto after = listener.at(0.06);
    ASSERT_TRUE(after);
    EXPECT_EQ(after->sim_time_ns(), 60'000'000);
    EXPECT_NE(after->satellites(2).visibility(), GnssSatellite::LOS);
    world->ModelByName("bus")->SetWorldPose({3, -150, 0, 0, 0, 0});
    server.step(1);
    const auto again = listener.at(0.07);
    ASSERT_TRUE(again);
    EXPECT_EQ(again->satellites(2).visibility(), GnssSatellite::LOS);
  }
}

// The same street rotated: the world's y axis points 30 deg west of north, so do its walls; satellites stay.
TEST(GnssSensor, HonoursTheWorldsHeading) {
  const std::string elements = test::paper_elements() + kEmbree;
  const GnssReceiver message = observe(street_world(street_car(elements), 30));
  // The antenna (3, 0) is 3 cos 30 deg east and 3 sin 30 deg north of the origin.
  EXPECT_NEAR(
      message.antenna().longitude_deg() - 114.17,
      geodesy::degrees(3 * std::cos(geodesy::radians(30)) / (6378137 * std::cos(geodesy::radians(22.3)))),
      2e-7);
  EXPECT_NEAR(message.antenna().latitude_deg() - 22.3,
              geodesy::degrees(3 * std::sin(geodesy::radians(30)) / 6350000), 2e-7);
  // A satellite at azimuth 90 deg is seen 30 deg off the wall's normal: 13 m * 2 cos(45 deg) cos(30 deg).
  const std::string specular = elements + kSpecular;
  const GnssReceiver rotated = observe(street_world(street_car(specular), 30));
  EXPECT_EQ(rotated.satellites(0).visibility(), GnssSatellite::NLOS);
  EXPECT_NEAR(rotated.satellites(0).excess_m(),
              2 * 13 * std::cos(geodesy::radians(45)) * std::cos(geodesy::radians(30)), 1e-3);
}

// A link that moves along the world's y axis with a heading of 30 deg moves 30 deg west of north and rotates.
TEST(GnssSensor, GivesVelocityInEastNorthUp) {
  InProcessServer& server = InProcessServer::get();
  const auto world = server.load(street_world(street_car(test::paper_elements() + kEmbree +
                                                         "<rate_hz>100</rate_hz>"
                                                         "<lever_arm><forward_m>2</forward_m></lever_arm>"),
                                              30, false));
  const auto model = world->ModelByName("car");
  GnssListener listener(world->Name(), kTopic);
  model->SetLinearVel({0, 10, 0});
  model->SetAngularVel({0, 0, 0.5});
  server.step(1);
  const auto message = listener.at(0.01);
  ASSERT_TRUE(message);
  // The lever of 2 m forward (x) at 0.5 rad/s adds 1 m/s along y: 11 m/s at 120 deg from east.
  EXPECT_NEAR(message->antenna_velocity_enu_mps().east(), -11 * std::sin(geodesy::radians(30)), 0.02);
  EXPECT_NEAR(message->antenna_velocity_enu_mps().north(), 11 * std::cos(geodesy::radians(30)), 0.02);
}

TEST(GnssSensor, TwentyReceiversAtTenHertz) {
  std::string cars;
  for (int i = 0; i < 20; ++i) {
    cars += street_car(test::paper_elements(fmt::format("/car{}", i)) + kEmbree, "ray",
                       fmt::format("car{}", i), fmt::format("3 {} 0 0 0 0", 8 * i - 80));
  }
  InProcessServer& server = InProcessServer::get();
  const auto world = server.load(street_world(cars));
  std::vector<std::unique_ptr<GnssListener>> listeners;
  for (int i = 0; i < 20; ++i) {
    listeners.push_back(
        std::make_unique<GnssListener>(world->Name(), fmt::format("~/car{}/antenna/gnss", i)));
  }
  server.step(200);  // 2 s
  for (int i = 0; i < 20; ++i) {
    SCOPED_TRACE(i);
    ASSERT_TRUE(listeners[static_cast<std::size_t>(i)]->at(2.0));
    const auto all = listeners[static_cast<std::size_t>(i)]->all();
    std::set<std::int64_t> times;
    for (const GnssReceiver& message : all) times.insert(message.sim_time_ns());
    EXPECT_THAT(times, ::testing::SizeIs(::testing::AnyOf(20, 21)));  // 0.1 s to 2 s, and the first update
    expect_street(all.back(), &test::StreetSatellite::mirror_m, 1e-3);
  }
}

// One is before its base in the world's file, one after it. A base on the same vehicle gives the heading.
TEST(GnssSensor, ReceiversCorrectEachOther) {
  const std::string common =
      "<profile>ublox-f9p</profile><sky><nominal>true</nominal></sky><start>2024-02-04T00:00:00 GPST</start>"
      "<publishers><ros>false</ros></publishers>" +
      kEmbree;
  const std::string rover = common + "<rtk>true</rtk><corrections><from>tower</from></corrections>";
  const std::string heading = common + "<rtk>true</rtk><corrections><from>front</from></corrections>";
  std::string two =
      street_car("<name>front</name>" + common + "<lever_arm><forward_m>1</forward_m></lever_arm>", "gps",
                 "two", "3 90 0 0 0 0");
  const std::string end = "</link></model>";
  const std::string rear =
      "<sensor name='rear' type='gps'><pose>0 0 2 0 0 0</pose><update_rate>10</update_rate>"
      "<plugin name='rear' filename='libMultipathSensorPlugin.so'>" +
      heading + "</plugin></sensor>";
  two.insert(two.rfind(end), rear);
  InProcessServer& server = InProcessServer::get();
  const auto world =
      server.load(street_world(street_car(rover, "gps", "before", "3 0 0 0 0 0") +
                                   street_car("<name>tower</name>" + common, "gps", "base", "3 30 0 0 0 0") +
                                   street_car(rover, "gps", "after", "3 60 0 0 0 0") + two,
                               0, false));
  GnssListener before(world->Name(), "~/before/antenna/gnss"), after(world->Name(), "~/after/antenna/gnss"),
      rotated(world->Name(), "~/two/rear/gnss");
  constexpr double kEnd_s = 25;
  server.step(static_cast<unsigned>(kEnd_s * 100));
  const auto length_m = [](const GnssReceiver& message) {
    const auto& vector = message.fix().baseline().vector_enu_m();
    return std::hypot(vector.east(), vector.north());
  };
  for (GnssListener* each : {&before, &after}) {
    const auto message = each->at(kEnd_s);
    ASSERT_TRUE(message);
    EXPECT_EQ(message->fix().kind(), msgs::GnssFix::FIXED);
    EXPECT_FALSE(message->fix().baseline().moving_base());
    EXPECT_NEAR(length_m(*message), 30, 0.05);
  }
  const auto message = rotated.at(kEnd_s);
  ASSERT_TRUE(message);
  EXPECT_TRUE(message->fix().baseline().moving_base());
  EXPECT_NEAR(length_m(*message), 1, 0.03);
  // The base is 1 m ahead, in the east.
  EXPECT_NEAR(
      std::remainder(message->fix().baseline().heading_rad() - 1.5 * std::numbers::pi, 2 * std::numbers::pi),
      0, 0.03);
}

TEST(GnssSensor, ResetAndTimeJumpsBeginAnew) {
  const std::string noisy = "<satAzimuth>" + test::street_angles(&test::StreetSatellite::azimuth_deg) +
                            "</satAzimuth><satElevation>" +
                            test::street_angles(&test::StreetSatellite::elevation_deg) +
                            "</satElevation><disableNoise>0</disableNoise>" + kEmbree +
                            "<start>2024-02-04T00:00:00 GPST</start><seed>5</seed>";
  InProcessServer& server = InProcessServer::get();
  const auto world = server.load(street_world(street_car(noisy)));
  GnssListener listener(world->Name(), kTopic);
  server.step(50);
  ASSERT_TRUE(listener.at(0.5));
  const auto first = listener.at(0.3);
  listener.clear();
  world->Reset();
  server.step(50);
  ASSERT_TRUE(listener.at(0.5));
  const auto second = listener.at(0.3);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->sim_time_ns(), second->sim_time_ns());
  // Same seed, same steps, same numbers.
  EXPECT_EQ(first->satellites(0).noise_m(), second->satellites(0).noise_m());
  EXPECT_NE(first->satellites(0).noise_m(), 0);
  EXPECT_EQ(first->gps_time_of_week_ns(), second->gps_time_of_week_ns());

  listener.clear();
  world->SetSimTime(gazebo::common::Time(1000, 0));  // forward
  server.step(20);
  const auto later = listener.at(1000);
  ASSERT_TRUE(later);
  EXPECT_EQ(later->state(), GnssReceiver::FIX);
  EXPECT_NEAR(static_cast<double>(later->gps_time_of_week_ns() - first->gps_time_of_week_ns()) * 1e-9,
              static_cast<double>(later->sim_time_ns() - first->sim_time_ns()) * 1e-9, 1e-6);
}

TEST(GnssSensor, PauseBringsNothing) {
  InProcessServer& server = InProcessServer::get();
  const auto world = server.load(street_world(street_car(test::paper_elements())));
  GnssListener listener(world->Name(), kTopic);
  server.step(10);
  ASSERT_TRUE(listener.at(0.1));
  listener.clear();
  gazebo::sensors::run_once();  // sensors may run while the world is paused
  gazebo::sensors::run_once();
  EXPECT_TRUE(listener.all().empty());
}

TEST(GnssSensor, WrongValuesLeaveTheSimulationRunning) {
  for (const std::string& wrong :
       {std::string("<satAzimuth>1 2</satAzimuth><satElevation>1</satElevation>"),
        std::string("<elevation_mask_deg>ninety</elevation_mask_deg>"),
        std::string("<ray_engine>optix</ray_engine>"),
        std::string("<sky><navigation>no_such.rnx</navigation></sky>"),
        std::string("<origin_latitude>222</origin_latitude><origin_longitude>0</origin_longitude>"),
        std::string("<start>yesterday</start>"), kPhysics + kSpecular}) {
    SCOPED_TRACE(wrong);
    InProcessServer& server = InProcessServer::get();
    const auto world = server.load(street_world(street_car(wrong)));
    GnssListener listener(world->Name(), kTopic);
    server.step(20);
    EXPECT_DOUBLE_EQ(world->SimTime().Double(), 0.2);
    EXPECT_TRUE(listener.all().empty());
  }
}

TEST(GnssSensor, LeavesWithItsModel) {
  InProcessServer& server = InProcessServer::get();
  const auto world = server.load(
      street_world(street_car(test::paper_elements() + kEmbree) +
                   street_car(test::paper_elements("/other") + kPhysics, "ray", "other", "3 20 0 0 0 0")));
  GnssListener listener(world->Name(), kTopic);
  GnssListener other(world->Name(), "~/other/antenna/gnss");
  server.step(20);
  ASSERT_TRUE(listener.at(0.2));
  world->RemoveModel("car");
  server.step(40);
  EXPECT_TRUE(other.at(0.6));
  for (const GnssReceiver& message : listener.all())
    EXPECT_LE(message.sim_time_ns(), 200000000) << message.ShortDebugString();
  world->RemoveModel("other");
  server.step(20);
  EXPECT_DOUBLE_EQ(world->SimTime().Double(), 0.8);
}

}  // namespace
}  // namespace canyon::adapters::gazebo_classic
