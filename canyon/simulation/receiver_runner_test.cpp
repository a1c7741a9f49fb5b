#include "canyon/simulation/receiver_runner.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>
#include <limits>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/simulation_support.hpp"

namespace canyon::simulation::live_receiver_test {
namespace {

using geodesy::GpsTime;
using ::testing::HasSubstr;

class Collector final : public EpochSink {
 public:
  void write(const Epoch& epoch) override { epochs.push_back(epoch); }
  void finish() override {}
  std::vector<Epoch> epochs;
};

constexpr const char* kLive = R"(
sky: {nominal: true, systems: [GPS, Galileo]}
start: 2026-06-01T08:00:00Z
name: car
seed: 9
)";

template <typename Call>
std::string error_text(const Call& call) {
  return test::error_of(call).what();
}

RunnerConfig live_config() {
  return parse_live_config(kLive, "plugin");
}

std::shared_ptr<CityScene> downtown() {
  return std::make_shared<CityScene>(city::synthetic_city({}));
}

/// A wall 20 m east of the origin, 100 m high and 400 m long.
std::shared_ptr<CityScene> wall() {
  city::City city;
  city.frame = geodesy::LocalFrame(geodesy::Geodetic::from_degrees(22.3, 114.17, 0));
  canyon::test::append_box(city.mesh, "wall", city::Surface::Building, city::Material::Concrete,
                           {20, -200, 0}, {25, 200, 100});
  return std::make_shared<CityScene>(std::move(city));
}

void expect_same(const Epoch& a, const Epoch& b) {
  EXPECT_EQ(a.truth.time, b.truth.time);
  EXPECT_EQ(a.containment, b.containment);
  EXPECT_EQ(a.observed.fix.status, b.observed.fix.status);
  if (a.observed.fix.solved()) {
    EXPECT_LT((a.observed.fix.position_ecef - b.observed.fix.position_ecef).norm(), 1e-6);
  }
  ASSERT_EQ(a.observed.satellites.size(), b.observed.satellites.size());
  for (std::size_t i = 0; i < a.observed.satellites.size(); ++i) {
    EXPECT_EQ(a.observed.satellites[i].id, b.observed.satellites[i].id);
    EXPECT_EQ(a.observed.satellites[i].visibility, b.observed.satellites[i].visibility);
    EXPECT_NEAR(a.observed.satellites[i].excess_m, b.observed.satellites[i].excess_m, 1e-6);
    EXPECT_NEAR(a.observed.satellites[i].pseudorange_error_m, b.observed.satellites[i].pseudorange_error_m,
                1e-6);
  }
}

// The batch run and the stepped receiver are one model: same drive, same numbers.
TEST(ReceiverRunner, GivesWhatTheSimulationGives) {
  Scenario scenario = parse_scenario(R"(
city: {synthetic: {}}
sky: {nominal: true, systems: [GPS, Galileo]}
start: 2026-06-01T08:00:00Z
trajectory:
  waypoints: [{east_m: -60, north_m: 0, up_m: 1.5}, {east_m: 60, north_m: 0, up_m: 1.5}]
  speed_mps: 6
rate_hz: 2
receivers: [{name: car, independent_noise: true}]
seed: 9
)",
                                     "scenario.yaml");
  const Simulation simulation(scenario, city::synthetic_city({}));
  Collector batch;
  (void)simulation.run({&batch});

  ReceiverRunner live(live_config(), downtown(), *live_config().start);
  const geodesy::LocalFrame& frame = simulation.environment().city().frame;
  ASSERT_EQ(batch.epochs.size(), 41U);  // 120 m at 6 m/s, twice a second, both ends
  for (const Epoch& expected : batch.epochs) {
    const Pose pose = simulation.antenna_pose(0, expected.truth.time);
    RigidPose antenna;
    antenna.position_m = frame.local_from_geodetic(pose.position);
    antenna.linear_velocity =
        frame.ecef_from_local_rotation().transpose() *
        (geodesy::enu_from_ecef_rotation(pose.position).transpose() * pose.velocity_enu_mps);
    antenna.attitude = Eigen::AngleAxisd(pose.yaw_rad, Eigen::Vector3d::UnitZ());
    const auto step = live.observe(expected.truth.time - *live_config().start, antenna);
    expect_same(expected, step.epoch);
    EXPECT_EQ(step.arrival.views.size(), step.epoch.observed.satellites.size());
    EXPECT_LT((step.epoch.truth.velocity_enu_mps - pose.velocity_enu_mps).norm(), 1e-9);
  }
}

// The host's configuration decides, else the city. A run of a scenario does the same.
TEST(ReceiverRunner, EpochsSayWhereMeanSeaLevelIs) {
  const auto scene = downtown();
  scene->city.geoid_undulation_m = -2.375;
  RigidPose antenna;
  antenna.position_m = {0, 0, 200};
  RunnerConfig config = live_config();
  const Epoch city_epoch = ReceiverRunner(config, scene, *config.start).observe(0, antenna).epoch;
  EXPECT_EQ(city_epoch.geoid_undulation_m, -2.375);
  EXPECT_EQ(city_epoch.altitude_m(), city_epoch.observed.fix.position.height_m + 2.375);
  config.city.sea_level.geoid_undulation_m = 39.6;
  EXPECT_EQ(ReceiverRunner(config, scene, *config.start).observe(0, antenna).epoch.geoid_undulation_m, 39.6);
  const Simulation simulation(
      parse_scenario("city: {synthetic: {}}\nstart: 2026-06-01T08:00:00Z\nduration_s: 0\ntrajectory: "
                     "{position: {east_m: "
                     "0, north_m: 0, up_m: 200}}\n",
                     "scenario.yaml"),
      scene);
  Collector batch;
  (void)simulation.run({&batch});
  EXPECT_EQ(batch.epochs.at(0).geoid_undulation_m, -2.375);
}

TEST(ReceiverRunner, BeginsAnewWhenTimeJumpsBack) {
  ReceiverRunner live(live_config(), downtown(), *live_config().start);
  const RigidPose antenna{{0, 0, 1.5}};
  std::vector<Epoch> first;
  first.reserve(5);
  for (int k = 0; k < 5; ++k) first.push_back(live.observe(0.1 * k, antenna).epoch);
  for (int k = 0; k < 5; ++k)
    expect_same(first[static_cast<std::size_t>(k)], live.observe(0.1 * k, antenna).epoch);
}

/// A receiver with a navigation filter in the open, twice a second, which jumps by 60 m at 60 s.
struct Jump {
  explicit Jump(bool continuous) {
    live.emplace(parse_live_config(std::string(kLive) + "profile: ublox-m10\n", "plugin"), wall(),
                 *live_config().start);
    antenna.position_m = {-500, 0, 2};
    inputs.continuous = continuous;
  }
  receiver::ReceiverEpoch to(double seconds) {
    if (seconds == 60) antenna.position_m.y() += 60;
    const geodesy::LocalFrame& frame = live->environment().city().frame;
    Epoch epoch = live->observe(pose_of(antenna, {frame}, live->at(seconds)), inputs).epoch;
    error_m = epoch.error_enu_m.head<2>().norm();
    return epoch.observed;
  }
  std::optional<ReceiverRunner> live;
  RigidPose antenna;
  StepInputs inputs;
  double error_m = 0;
};

TEST(ReceiverRunner, BeginsAnewWhereItsHostPutsItElsewhere) {
  Jump jump(false);
  for (double t = 0; t < 60; t += 0.5) (void)jump.to(t);
  EXPECT_TRUE(jump.live->take_warnings().empty());
  int without = 0, with = 0;
  for (double t = 60; t < 70; t += 0.5) {
    const positioning::Fix fix = jump.to(t).fix;
    ++(fix.solved() ? with : without);
    EXPECT_TRUE(fix.solved() == (with > 0)) << t;
    if (!fix.solved()) continue;
    EXPECT_LT(jump.error_m, 15) << t;
  }
  EXPECT_GE(without, 2) << "a second of search";
  EXPECT_LE(without, 6);
  EXPECT_THAT(jump.live->take_warnings(), testing::ElementsAre(HasSubstr("jumped by 60 m at 60.0 s")));

  // Along a trajectory there is no warning: the filter handles its measurements itself.
  Jump untold(true);
  for (double t = 0; t <= 61; t += 0.5) (void)untold.to(t);
  EXPECT_GT(untold.error_m, 40);
  EXPECT_TRUE(untold.live->take_warnings().empty());
}

TEST(ReceiverRunner, WhatARestartTookIsStillMissingBehindAJump) {
  Jump jump(false);
  for (double t = 0; t < 50; t += 0.5) (void)jump.to(t);
  jump.live->add_fault("restart: {kind: cold}");
  for (double t = 50; t < 80; t += 0.5) EXPECT_FALSE(jump.to(t).fix.solved()) << t;
  double first = 80;
  while (first < 120 && !jump.to(first).fix.solved()) first += 0.5;
  EXPECT_NEAR(first, 86, 4);
}

// From standstill to 100 m/s within an epoch, poses 3 m off the route, a gap of a minute.
TEST(ReceiverRunner, TakesNoVehicleForAJump) {
  ReceiverRunner live(live_config(), wall(), *live_config().start);
  RigidPose antenna;
  antenna.position_m = {-500, 0, 2};
  double t = 0;
  const auto step = [&](double dt, const Eigen::Vector3d& by) {
    t += dt;
    antenna.position_m += by;
    (void)live.observe(t, antenna);
  };
  for (int k = 0; k < 5; ++k) step(0.1, {0, 0, 0});
  for (int k = 0; k < 20; ++k) step(0.1, {k == 0 ? 3.0 : k % 2 == 0 ? 6.0 : -6.0, 10, 0});
  (void)live.observe_without_pose(live.at(t + 60));
  step(61, {1500, 0, 0});
  for (int k = 0; k < 5; ++k) step(1, {0, 30, 0});
  EXPECT_TRUE(live.take_warnings().empty());
  step(0.1, {0, 90, 0});
  EXPECT_EQ(live.take_warnings().size(), 1U);
}

// Hosts create receivers before their world is known.
TEST(ReceiverRunner, IsMadeForTheSceneOfItsFirstStep) {
  const RunnerConfig config = parse_live_config(std::string(kLive) + "profile: ublox-m10\n", "plugin");
  city::City field;
  field.frame = downtown()->city.frame;
  ReceiverRunner late(config, std::make_shared<CityScene>(field), *live_config().start);
  late.set_scene(downtown());
  ReceiverRunner made(config, downtown(), *live_config().start);
  RigidPose antenna;
  antenna.position_m = {0, 0, 1.5};
  for (double t = 0; t < 40; t += 1) {
    antenna.position_m.x() = t;
    expect_same(made.observe(t, antenna).epoch, late.observe(t, antenna).epoch);
  }
}

TEST(ReceiverRunner, HasNominalOrbitsAnyTimeOn) {
  ReceiverRunner live(live_config(), wall(), *live_config().start);
  const RigidPose antenna{{-500, 0, 150}};
  for (const double day : {0.0, 0.5, 3.0, 400.0}) {
    EXPECT_GT(live.observe(day * 86400, antenna).arrival.views.size(), 10U) << day;
  }
  EXPECT_TRUE(live.take_warnings().empty());
}

// 30 deg high in the east, behind the wall; the mirror ray of range 12 m gives 2 * 12 * cos^2(30 deg) = 18 m.
// Beyond the day of the nominal orbits each continues with its own sky.
TEST(ReceiverRunner, ReceiversMayShareTheirSky) {
  const GpsTime start = *live_config().start;
  const auto scene = downtown();
  ReceiverRunner first(live_config(), scene, start);
  ReceiverRunner second(live_config(), scene, start, first.shared_sky());
  EXPECT_EQ(second.shared_sky(), first.shared_sky());
  RigidPose antenna;
  antenna.position_m = {0, 0, 1.5};
  for (const double seconds : {0.0, 1.0, 100'000.0}) {
    expect_same(first.observe(seconds, antenna).epoch, second.observe(seconds, antenna).epoch);
  }
  EXPECT_NE(second.shared_sky(), first.shared_sky());
}

TEST(ReceiverRunner, TakesTheHostsRays) {
  RunnerConfig config = parse_live_config(R"(
sky: {frozen: {satAzimuth: [1.5707963, 4.7123890], satElevation: [0.5235988, 0.5235988]}}
profile: ideal
)",
                                          "plugin");
  ReceiverRunner live(config, wall(), GpsTime::from_week(2300, 0));
  live.set_tracer([](const Eigen::Vector3d& antenna, std::span<const Eigen::Vector3d> directions,
                     std::span<propagation::SatellitePaths> result) {
    for (std::size_t i = 0; i < directions.size(); ++i) {
      const bool east = directions[i].x() > 0;
      result[i] =
          propagation::mirror_paths(antenna, directions[i], east, east ? std::optional(12.0) : std::nullopt);
    }
  });
  const auto step = live.observe(0, {{0, 0, 1}});
  const auto& satellites = step.epoch.observed.satellites;
  ASSERT_EQ(satellites.size(), 2U);
  EXPECT_EQ(satellites[0].visibility, propagation::Visibility::NLOS);
  EXPECT_NEAR(satellites[0].excess_m, 18, 1e-4);
  EXPECT_EQ(satellites[1].visibility, propagation::Visibility::LOS);
  // The reflection point: 12 m towards the west, 30 deg up.
  const Eigen::Vector3d point = step.arrival.views[0].paths.paths[0].point;
  EXPECT_LT((point - Eigen::Vector3d(-12 * std::cos(geodesy::kPi / 6), 0, 1 + 6)).norm(), 1e-4);
}

// Doppler is the rate of the pseudorange, also for signals via two walls. Between two epochs 0.2 s apart the
// chord deviates from the rate by d^3P/dt^3 dt^2 / 6, below 1e-4 m/s here.
TEST(ReceiverRunner, DopplerOfTwoReflectionsIsTheRateOfTheRange) {
  city::City city;
  city.frame = geodesy::LocalFrame(geodesy::Geodetic::from_degrees(22.3, 114.17, 0));
  for (const double x : {8.0, -9.0}) {
    canyon::test::append_box(city.mesh, "wall", city::Surface::Building, city::Material::Concrete,
                             {x, -2000, 0}, {x + 1, 2000, 60});
  }
  RunnerConfig config = parse_live_config(std::string(kLive) + "profile: ideal\n", "plugin");
  config.receiver().propagation.reflection_order = 2;
  config.receiver().propagation.max_range_m = 500;
  ReceiverRunner live(config, std::make_shared<CityScene>(std::move(city)), *config.start);
  const Eigen::Vector3d velocity(0.3, 7, 0.1);
  int seen = 0;
  for (int k = 0; k < 60; ++k) {
    std::vector<ReceiverRunner::Step> steps;
    for (const double dt : {-0.1, 0.0, 0.1}) {
      RigidPose antenna;
      antenna.position_m = Eigen::Vector3d(3, 0, 2) + dt * velocity;
      antenna.linear_velocity = velocity;
      steps.push_back(live.observe(600.0 * k + 1 + dt, antenna));
    }
    const auto& now = steps[1].epoch.observed.satellites;
    for (std::size_t i = 0; i < now.size(); ++i) {
      const auto& paths = steps[1].arrival.views[i].paths.paths;
      if (paths.empty() || paths.front().order != 2 || !now[i].measurement) continue;
      const auto find = [&](const ReceiverRunner::Step& step) -> std::optional<double> {
        const auto& all = step.epoch.observed.satellites;
        for (std::size_t m = 0; m < all.size(); ++m) {
          const auto& its = step.arrival.views[m].paths.paths;
          if (all[m].id == now[i].id && all[m].measurement && its.front().order == 2 &&
              its.front().far_triangle == paths.front().far_triangle) {
            return all[m].measurement->pseudorange_m;
          }
        }
        return std::nullopt;
      };
      const auto before = find(steps[0]);
      const auto after = find(steps[2]);
      if (!before || !after) continue;
      ++seen;
      const double rate = (*after - *before) / 0.2;
      EXPECT_NEAR(*now[i].measurement->doppler_hz * 299792458.0 / now[i].measurement->carrier_frequency_hz,
                  -rate, 3e-4)
          << to_string(now[i].id);
    }
  }
  EXPECT_GT(seen, 20);
}

TEST(ReceiverRunner, FollowsMovedInstancesAndNewScenes) {
  RunnerConfig config = parse_live_config(
      "sky: {frozen: {satAzimuth: [1.5707963], satElevation: [0.5235988]}}\nprofile: ideal\n", "plugin");
  auto empty = std::make_shared<CityScene>(city::City{});
  city::Mesh box;
  canyon::test::append_box(box, "bus", city::Surface::Vehicle, city::Material::Metal, {-1, -5, 0},
                           {1, 5, 30});
  const auto bus = empty->scene.add_instance(box);
  ReceiverRunner live(config, empty, GpsTime::from_week(2300, 0));
  const RigidPose antenna{{0, 0, 1}};
  const auto visibility = [&](double t) {
    return live.observe(t, antenna).epoch.observed.satellites.at(0).visibility;
  };
  EXPECT_EQ(visibility(0), propagation::Visibility::LOS);
  empty->scene.set_pose(bus, Eigen::Isometry3d(Eigen::Translation3d(10, 0, 0)));
  empty->scene.commit();
  EXPECT_EQ(visibility(0.1), propagation::Visibility::Blocked);
  // Viewers get the enclosing upright box, rotated by 30 deg and tilted by 90 deg about its own x.
  empty->scene.set_pose(bus,
                        Eigen::Isometry3d(Eigen::Translation3d(20, 10, 40) *
                                          Eigen::AngleAxisd(geodesy::radians(30), Eigen::Vector3d::UnitZ()) *
                                          Eigen::AngleAxisd(geodesy::radians(90), Eigen::Vector3d::UnitX())));
  empty->scene.commit();
  const std::vector<propagation::Body> near = live.observe(0.15, antenna).arrival.bodies;
  ASSERT_EQ(near.size(), 1U);
  // Its 30 m of height are along its right side now: its middle is 15 m to the right of (20, 10).
  EXPECT_NEAR(near[0].centre.x(), 20 + 15 * 0.5, 1e-9);
  EXPECT_NEAR(near[0].centre.y(), 10 - 15 * std::sqrt(0.75), 1e-9);
  EXPECT_NEAR(near[0].half_length_m, 1, 1e-9);
  EXPECT_NEAR(near[0].half_width_m, 15, 1e-9);
  EXPECT_NEAR(near[0].bottom_m, 35, 1e-9);
  EXPECT_NEAR(near[0].top_m, 45, 1e-9);
  EXPECT_NEAR(std::atan2(near[0].ahead.y(), near[0].ahead.x()), geodesy::radians(30), 1e-9);
  EXPECT_EQ(near[0].name, bus);
  empty->scene.set_pose(bus, Eigen::Isometry3d(Eigen::Translation3d(400, 0, 0)));
  empty->scene.commit();
  EXPECT_TRUE(live.observe(0.17, antenna).arrival.bodies.empty()) << "far away";
  live.set_scene(std::make_shared<CityScene>(city::City{}));
  EXPECT_EQ(visibility(0.2), propagation::Visibility::LOS);
}

TEST(ReceiverRunner, RefusesWhatIsNoPlaceOrTime) {
  ReceiverRunner live(live_config(), wall(), *live_config().start);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double position : {nan, 1e300}) {
    EXPECT_THAT(error_text([&] {
                  (void)live.observe(0, {{position, 0, 0}});
                }),
                HasSubstr("is not finite, or more than 10000 km away"));
    EXPECT_THAT(error_text([&] {
                  (void)live.observe(0, {.position_m = {0, 0, 50}, .linear_velocity = {0, position, 0}});
                }),
                HasSubstr("velocity"));
  }
  EXPECT_THAT(error_text([&] { (void)live.observe(nan, {}); }), HasSubstr("out of range"));
  // A rejected call changes nothing.
  EXPECT_TRUE(live.observe(0, {{-500, 0, 150}}).epoch.observed.fix.solved());
}

TEST(ReceiverRunner, NeedsIonosphereCoefficientsWhereAskedFor) {
  RunnerConfig config = live_config();
  config.receiver().options.ionosphere = true;
  // Nominal satellites have standard coefficients.
  EXPECT_NO_THROW(ReceiverRunner(config, wall(), *config.start));
  config.sky = {};
  config.sky.frozen_azimuth_rad = {0, 1.5, 3, 4.5};
  config.sky.frozen_elevation_rad = {0.5, 1, 0.7, 1.2};
  EXPECT_THAT(error_text([&] { ReceiverRunner(config, wall(), *config.start); }),
              HasSubstr("ionosphere coefficients"));
}

TEST(RunnerConfig, HasAReceiversKeysAtTheTop) {
  const RunnerConfig config = parse_live_config(R"(
sky: {nominal: true, systems: [BeiDou]}
start: {week: 2051, tow: 46701}
rate_hz: 5
seed: 42
geoid_undulation_m: -2.5
name: left
profile: paper
elevation_mask_deg: 12
lever_arm: {forward_m: 0.1, left_m: 0.2, up_m: 0.3}
propagation: {model: specular, max_range_m: 99}
noise: {sigma_m_per_sqrt_s: 0.7}
)",
                                                "plugin");
  EXPECT_EQ(config.sky.systems, std::set<gnss::System>{gnss::System::BeiDou});
  EXPECT_EQ(config.start, GpsTime::from_week(2051, 46701));
  EXPECT_EQ(config.rate_hz, 5.0);
  EXPECT_EQ(config.seed, 42U);
  EXPECT_EQ(config.city.sea_level.geoid_undulation_m, -2.5);
  EXPECT_EQ(config.receiver().options.name, "left");
  EXPECT_NEAR(config.receiver().options.fix.elevation_mask_rad, geodesy::radians(12), 1e-12);
  EXPECT_EQ(config.receiver().options.fix.min_satellites, 5);  // the paper's
  EXPECT_EQ(config.receiver().lever_arm_m, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(config.receiver().propagation.model, propagation::Model::Specular);
  EXPECT_EQ(config.receiver().propagation.max_range_m, 99);
  EXPECT_EQ(config.receiver().options.noise.ou.sigma_m_per_sqrt_s, 0.7);
}

TEST(RunnerConfig, WarnsOfNoiseThatErrorsFromSpaceReplace) {
  constexpr const char* kWarning = "noise has no effect, because range errors (sky.errors) replace it";
  const RunnerConfig config = parse_live_config(std::string(kLive) + "noise: {mu_m: 1}\n", "plugin");
  EXPECT_THAT(config.warnings, ::testing::ElementsAre(HasSubstr(kWarning)));
  ReceiverRunner receiver(config, downtown(), *config.start);
  EXPECT_THAT(receiver.take_warnings(), ::testing::ElementsAre(HasSubstr(kWarning)));
  // It does not while the receiver runs either.
  receiver.set_config(changed_live_config(config, "noise.mu_m: 2", "request"));
  EXPECT_THAT(receiver.take_warnings(), ::testing::ElementsAre(HasSubstr(kWarning)));
  receiver.set_config(changed_live_config(config, "seed: 3", "request"));
  EXPECT_THAT(receiver.take_warnings(), ::testing::IsEmpty());

  const auto warnings = [](const std::string& more) {
    return parse_live_config("start: 2026-06-01T08:00:00Z\n" + more, "plugin").warnings;
  };
  EXPECT_THAT(warnings("noise: {enabled: true, mu_m: 1}\n"), ::testing::IsEmpty());
  EXPECT_THAT(warnings("noise: {mu_m: 1}\nsky: {errors: {enabled: false}}\n"), ::testing::IsEmpty());
  EXPECT_THAT(warnings("noise: {mu_m: 1}\nsky: {frozen: {satAzimuth: [1], satElevation: [1]}}\n"),
              ::testing::IsEmpty());
  EXPECT_THAT(parse_live_config("start: 2026-06-01T08:00:00\n", "plugin").warnings,
              ::testing::ElementsAre(HasSubstr("has no time zone")));
}

TEST(RunnerConfig, TakesNothingOfCityAndTrajectory) {
  EXPECT_THAT(error_text([] { (void)parse_live_config("city: {open: true}\n", "plugin"); }),
              HasSubstr("city"));
  EXPECT_THAT(error_text([] { (void)parse_live_config("noise: {sigma: 1}\n", "plugin"); }),
              HasSubstr("sigma"));
  const options::Description description = options::describe<RunnerConfig>();
  for (const ScenarioKey& key : description.keys)
    EXPECT_EQ(key.path.find("[]"), std::string::npos) << key.path;
}

}  // namespace
}  // namespace canyon::simulation::live_receiver_test
