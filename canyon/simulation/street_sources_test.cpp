// Streets through Simulation and ReceiverRunner.
#include "canyon/simulation/receiver_surroundings.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/receiver_runner.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/simulation_support.hpp"

namespace canyon::simulation::street_sources_test {
namespace {

class Collector final : public EpochSink {
 public:
  void write(const Epoch& epoch) override { epochs.push_back(epoch); }
  void finish() override {}
  std::vector<Epoch> epochs;
};

Scenario street(bool enabled,
                const char* receivers = "[{name: car, signal: {enabled: true, lock: {warm_start: true}}}]") {
  return parse_scenario(fmt::format(R"(
city: {{synthetic: {{}}}}
sky: {{nominal: true, systems: [GPS, Galileo]}}
start: 2026-06-01T08:00:00Z
trajectory:
  waypoints: [{{east_m: -30, north_m: 0, up_m: 1.5}}, {{east_m: 90, north_m: 0, up_m: 1.5}}]
  speed_mps: 6
rate_hz: 1
receivers: {}
streets: {{enabled: {}, region: east_asia, vehicles_per_km: 45, antenna_height_m: 1.5}}
seed: 9
)",
                                    receivers, enabled),
                        "scenario.yaml");
}

std::vector<Epoch> simulated(const Scenario& scenario) {
  Collector collector;
  (void)Simulation(scenario, city::synthetic_city({})).run({&collector});
  return collector.epochs;
}

std::vector<std::optional<double>> levels(const std::vector<Epoch>& epochs, std::size_t receiver = 0) {
  std::vector<std::optional<double>> result;
  for (const Epoch& epoch : epochs) {
    if (epoch.receiver != receiver) continue;
    for (const auto& satellite : epoch.observed.satellites) result.push_back(satellite.cn0_dbhz);
  }
  return result;
}

TEST(Streets, TakeLevelFromSatellitesAndAreTheSameForEveryRun) {
  const auto without = levels(simulated(street(false)));
  const auto with = levels(simulated(street(true)));
  EXPECT_EQ(levels(simulated(street(true))), with);
  ASSERT_EQ(with.size(), without.size());
  int weaker = 0, same = 0;
  for (std::size_t i = 0; i < with.size(); ++i) {
    if (!without[i]) continue;
    weaker += !with[i] || *with[i] < *without[i] - 3;
    same += with[i] && std::abs(*with[i] - *without[i]) < 1;
  }
  EXPECT_GT(weaker, 5);
  EXPECT_GT(same, 5);
  // The streets depend on the seed.
  Scenario other = street(true);
  other.seed = 10;
  EXPECT_NE(levels(simulated(other)), with);
}

TEST(Streets, AreTheSameForAllReceiversOfARun) {
  const char* two =
      "[{name: a, signal: {enabled: true, shadowing: {enabled: false}, lock: {tracking_threshold_dbhz: 0, "
      "warm_start: true}}}, {name: b, independent_noise: true, signal: {enabled: true, satellite_sigma_db: "
      "0, "
      "shadowing: {enabled: false}, lock: {tracking_threshold_dbhz: 0, warm_start: true}}}]";
  const std::vector<Epoch> epochs = simulated(street(true, two));
  // Random numbers of the receivers differ, their blocked satellites do not.
  int cut = 0;
  for (std::size_t k = 0; k + 1 < epochs.size(); k += 2) {
    const auto &a = epochs[k].observed.satellites, &b = epochs[k + 1].observed.satellites;
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
      // Levels differ by receiver, and a signal too weak for one of them is blocked.
      if (a[i].cn0_dbhz.value_or(0) < 3 || b[i].cn0_dbhz.value_or(0) < 3) continue;
      EXPECT_EQ(a[i].visibility, b[i].visibility);
      cut += a[i].visibility == propagation::Visibility::NLOS;
    }
  }
  EXPECT_GT(cut, 0);
}

TEST(Streets, AreThoseOfASimulationInAHostOnAStraightRoad) {
  const Scenario scenario = street(true);
  const Simulation simulation(scenario, city::synthetic_city({}));
  Collector offline;
  (void)simulation.run({&offline});

  ReceiverRunner live(RunnerConfig(scenario), std::make_shared<CityScene>(city::synthetic_city({})),
                      simulation.begin());
  const auto drive = [&] {
    std::vector<Epoch> epochs;
    for (std::size_t k = 0; k < simulation.epoch_count(); ++k) {
      RigidPose antenna;
      antenna.position_m =
          simulation.environment().city().frame.local_from_geodetic(offline.epochs[k].truth.position);
      antenna.linear_velocity = {6, 0, 0};
      epochs.push_back(live.observe(static_cast<double>(k), antenna).epoch);
    }
    return epochs;
  };
  const std::vector<Epoch> online = drive();
  // The first position alone does not give the road's direction.
  for (std::size_t k = 1; k < online.size(); ++k) {
    const auto &a = offline.epochs[k].observed.satellites, &b = online[k].observed.satellites;
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i].visibility, b[i].visibility) << k;
  }
  // A world that was reset gives the same numbers again.
  EXPECT_EQ(levels(drive()), levels(online));
}

TEST(Streets, LeaveTreesToAMapThatHasThem) {
  ReceiverConfig receiver;
  EXPECT_FALSE(streets_of(receiver, city::synthetic_city({}), nullptr));
  EXPECT_TRUE(with_streets(receiver, city::synthetic_city({}), nullptr).empty());
  receiver.streets.enabled = true;
  city::City city = city::synthetic_city({});
  EXPECT_FALSE(streets_of(receiver, city, nullptr)->street.trees_per_km);
  canyon::test::append_box(city.mesh, "tree", city::Surface::Foliage, city::Material::Foliage, {0, 0, 3},
                           {4, 4, 8});
  EXPECT_EQ(streets_of(receiver, city, nullptr)->street.trees_per_km, 0);
  receiver.streets.trees_per_km = 5;
  EXPECT_EQ(streets_of(receiver, city, nullptr)->street.trees_per_km, 5);
}

TEST(Streets, TakeTheAntennasHeightFromTheTrajectory) {
  const Scenario scenario = parse_scenario(R"(
city: {open: true, origin: {latitude_deg: 1, longitude_deg: 2}}
start: 2026-06-01T08:00:00Z
trajectory: {position: {east_m: 1, north_m: 2}, height_above_terrain_m: 2.4}
receivers: [{name: a}, {name: b}]
streets: {enabled: true}
)",
                                           "scenario.yaml");
  for (const ReceiverConfig& receiver : scenario.receivers) {
    EXPECT_TRUE(receiver.streets.enabled);
    EXPECT_EQ(receiver.streets.antenna_height_m, 2.4);
  }
}

}  // namespace
// Two long walls of 30 m, 30 m apart, an antenna in their middle at 0 m: at an azimuth a from across the
// street they hide elevations below atan(30 cos(a) / 15).
TEST(Surroundings, AreThoseOfTheCityAboutTheAntenna) {
  city::City city;
  for (const double west : {-25.0, 15.0}) {
    canyon::test::append_box(city.mesh, "wall", city::Surface::Building, city::Material::Concrete,
                             {west, -5000, -10}, {west + 10, 5000, 30});
  }
  const raytrace::RayScene scene(city.mesh);
  int hidden = 0;
  for (const double elevation_deg : {15, 30, 45, 60}) {
    for (int k = 0; k < 16; ++k) {
      hidden += std::tan(elevation_deg * M_PI / 180) < 2 * std::abs(std::sin(2 * M_PI * k / 16)) - 1e-9;
    }
  }
  const std::vector<Eigen::Vector3d> street{{0, 0, 0}, {0, 7, 0}}, above{{0, 0, 40}};
  EXPECT_DOUBLE_EQ(closed_sky(scene, street), hidden / 64.0);
  EXPECT_EQ(closed_sky(scene, above), 0);
  EXPECT_EQ(closed_sky(scene, {}), 0);

  using disturbance::ShadowingEnvironment;
  ReceiverConfig receiver;
  disturbance::ShadowingOptions& shadowing = receiver.options.signal.shadowing;
  shadowing.enabled = true;
  std::optional<std::uint64_t> seed;
  const auto made = [&](const raytrace::RayScene& rays, const city::City& about) {
    return with_surroundings(receiver, rays, about, seed).signal.shadowing;
  };
  shadowing.environment = ShadowingEnvironment::Auto;
  EXPECT_EQ(made(scene, city).environment, ShadowingEnvironment::Dense);
  const city::City field;
  EXPECT_EQ(made(raytrace::RayScene(field.mesh), field).environment, ShadowingEnvironment::Open);

  // The fraction of obstacles depends on the seed if it is not given.
  EXPECT_EQ(made(scene, city).skyline.fraction, std::nullopt);
  EXPECT_DOUBLE_EQ(*skyline_numbers(made(scene, city)).fraction, 0.5);
  double sum = 0;
  std::vector<double> fractions;
  for (seed = 0; *seed < 200; ++*seed) sum += fractions.emplace_back(*made(scene, city).skyline.fraction);
  EXPECT_NEAR(sum / 200, 0.5, 0.04);
  EXPECT_THAT(fractions, testing::Each(testing::AllOf(testing::Ge(0.25), testing::Le(0.75))));
  seed = 7;
  EXPECT_EQ(*made(scene, city).skyline.fraction, fractions[7]);
  shadowing.skyline.fraction = 0.3;
  EXPECT_EQ(made(scene, city).skyline.fraction, 0.3);
  shadowing.skyline.fraction.reset();
  shadowing.environment = ShadowingEnvironment::Dense;
  EXPECT_EQ(made(scene, city).skyline.fraction, std::nullopt);
}

TEST(Shadowing, SaysWhatReplacedBlockages) {
  const std::string refused = canyon::test::refusal(
      [] { (void)street(true, "[{name: car, signal: {shadowing: {blockage: {share: 0.2}}}}]"); });
  EXPECT_THAT(refused, testing::HasSubstr("unknown key 'blockage'"));
  EXPECT_THAT(refused, testing::HasSubstr("skyline: {share: S}"));
}

}  // namespace canyon::simulation::street_sources_test
