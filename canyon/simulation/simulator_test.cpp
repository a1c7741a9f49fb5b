#include "canyon/simulation/simulator.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/orbit/nominal_constellation.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "canyon/sky/rinex/navigation_writer.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/simulation_support.hpp"
#include "tests/support/source_dir.hpp"

namespace canyon::simulation::simulator_test {
namespace {

using geodesy::Geodetic;
using geodesy::GpsTime;
using test::error_of;
using test::TemporaryFolder;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

const std::filesystem::path kSource = canyon_source_dir;

class Collector final : public EpochSink {
 public:
  void write(const Epoch& epoch) override {
    epochs.push_back(epoch);
    if (on_write) on_write(epochs.size());
  }
  void finish() override { ++finished; }
  std::vector<Epoch> epochs;
  int finished = 0;
  std::function<void(std::size_t)> on_write;
};

city::City open_field(const Geodetic& origin) {
  city::City field;
  field.name = "open field";
  field.frame = geodesy::LocalFrame(origin);
  return field;
}

city::City city_of(const Scenario& scenario) {
  if (const auto* made_up = scenario.city.as<city::SyntheticCityOptions>())
    return city::synthetic_city(*made_up);
  return open_field(*scenario.city.origin);
}

Simulation simulation_of(const std::string& text) {
  Scenario scenario = parse_scenario(text, "s.yaml");
  city::City city = city_of(scenario);
  return Simulation(std::move(scenario), std::move(city));
}

std::string fault(const std::string& text) {
  return error_of([&] { (void)simulation_of(text); }).what();
}

const std::string kOpen = "city: {open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17}}\n";
const std::string kDrive =
    "city: {synthetic: {blocks_east: 4, blocks_north: 4}}\nstart: 2026-06-01T08:00:00Z\nsky: {systems: GPS}\n"
    "trajectory: {waypoints: [{east_m: -76, north_m: -76}, {east_m: 76, north_m: -76}, {east_m: 76, north_m: "
    "76}], "
    "speed_mps: 8, height_above_terrain_m: 1.5}\n";

std::vector<Epoch> run(const Simulation& simulation, const RunOptions& options = {}) {
  Collector collector;
  const RunResult result = simulation.run({&collector}, options);
  EXPECT_EQ(result.epochs, simulation.epoch_count());
  EXPECT_FALSE(result.interrupted);
  EXPECT_EQ(collector.finished, 1);
  return collector.epochs;
}

// Bit for bit, NaN equal to NaN.
void add_bytes(std::string& bytes, double value) {
  char buffer[sizeof value];
  std::memcpy(buffer, &value, sizeof value);
  bytes.append(buffer, sizeof value);
}
std::string bytes_of(const std::vector<Epoch>& epochs) {
  std::string bytes;
  for (const Epoch& e : epochs) {
    add_bytes(bytes, static_cast<double>(e.receiver));
    for (int k = 0; k < 3; ++k) {
      add_bytes(bytes, e.truth_ecef[k]);
      add_bytes(bytes, e.truth.velocity_enu_mps[k]);
      add_bytes(bytes, e.error_enu_m[k]);
      add_bytes(bytes, e.observed.fix.position_ecef[k]);
    }
    bytes +=
        std::to_string(e.truth.time.nanoseconds()) + std::to_string(e.observed.receiver_time.nanoseconds());
    for (const auto& s : e.observed.satellites) {
      bytes += to_string(s.id) + std::to_string(static_cast<int>(s.visibility)) + (s.used ? "u" : "-");
      for (const double v : {s.azimuth_rad, s.elevation_rad, s.excess_m, s.noise_m, s.pseudorange_error_m}) {
        add_bytes(bytes, v);
      }
      if (s.measurement) {
        add_bytes(bytes, s.measurement->pseudorange_m);
        add_bytes(bytes, s.measurement->doppler_hz.value_or(-1));
      }
    }
  }
  return bytes;
}

TEST(Simulation, EpochTimesAreExact) {
  const Simulation simulation = simulation_of(kOpen +
                                              "start: 2026-06-01T08:00:00Z\nduration_s: 0.7\nrate_hz: 10\n"
                                              "trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}\n");
  ASSERT_EQ(simulation.epoch_count(), 8U) << "both ends";
  const std::vector<Epoch> epochs = run(simulation);
  const GpsTime begin = geodesy::parse_time("2026-06-01T08:00:00Z");
  ASSERT_EQ(epochs.size(), 8U);
  for (std::size_t k = 0; k < epochs.size(); ++k) {
    EXPECT_EQ(epochs[k].observed.time.nanoseconds() - begin.nanoseconds(),
              static_cast<std::int64_t>(k) * 100'000'000);
  }
}

// Closed form: without noise under an open sky, the fix equals the truth.
TEST(Simulation, OpenSkyWithoutNoiseFindsTheTruthWithinAMillimetre) {
  const Simulation simulation = simulation_of(
      kOpen +
      "start: 2026-06-01T08:00:00Z\nreceivers: [{profile: ideal}]\n"
      "trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2}, {east_m: 300, north_m: 200, up_m: 50}]}\n");
  for (const Epoch& e : run(simulation)) {
    ASSERT_TRUE(e.observed.fix.solved());
    EXPECT_LT(e.error_enu_m.norm(), 1e-3);
    ASSERT_TRUE(e.observed.fix.velocity_enu_mps);
    EXPECT_LT((*e.observed.fix.velocity_enu_mps - e.truth.velocity_enu_mps).norm(), 1e-3);
  }
}

TEST(Simulation, SameBytesOnAnyNumberOfThreadsAndTwice) {
  const Simulation simulation =
      simulation_of(kDrive + "rate_hz: 10\nreceivers: [{name: a}, {name: b, profile: paper}]\n");
  ASSERT_GT(simulation.epoch_count(), 300U) << "more than two blocks";
  RunOptions one;
  one.threads = 1;
  const std::string bytes = bytes_of(run(simulation, one));
  for (const int threads : {1, 2, 5, 0}) {
    RunOptions options;
    options.threads = threads;
    EXPECT_EQ(bytes_of(run(simulation, options)), bytes) << threads << " threads";
  }
}

TEST(Simulation, AnotherSeedAnotherNoise) {
  const auto a = run(simulation_of(kDrive + "duration_s: 3\nseed: 1\n"));
  const auto b = run(simulation_of(kDrive + "duration_s: 3\nseed: 2\n"));
  EXPECT_NE(bytes_of(a), bytes_of(b));
  EXPECT_EQ(a[0].truth_ecef, b[0].truth_ecef);
}

TEST(Simulation, ReceiversAreIndependentOfEachOther) {
  const auto alone = run(simulation_of(kDrive + "duration_s: 5\nreceivers: [{name: b}]\n"));
  const auto both =
      run(simulation_of(kDrive + "duration_s: 5\nreceivers: [{name: a, profile: paper}, {name: b}]\n"));
  ASSERT_EQ(both.size(), 2 * alone.size());
  for (std::size_t i = 0; i < alone.size(); ++i) {
    EXPECT_EQ(both[2 * i].receiver, 0U);
    EXPECT_EQ(both[2 * i + 1].receiver, 1U);
    EXPECT_EQ(both[2 * i].observed.time, both[2 * i + 1].observed.time);
    Epoch b = both[2 * i + 1];
    b.receiver = 0;
    EXPECT_EQ(bytes_of({b}), bytes_of({alone[i]}));
  }
}

TEST(Simulation, InterruptionKeepsFinishedEpochs) {
  const Simulation simulation = simulation_of(kDrive + "rate_hz: 20\n");
  RunOptions full_options;
  full_options.threads = 1;
  const std::vector<Epoch> full = run(simulation, full_options);
  for (const int threads : {1, 2}) {
    std::atomic<bool> stop{false};
    Collector collector;
    collector.on_write = [&stop](std::size_t n) { stop = n == 300; };
    RunOptions options;
    options.threads = threads;
    options.stop = &stop;
    const RunResult result = simulation.run({&collector}, options);
    EXPECT_TRUE(result.interrupted);
    EXPECT_EQ(result.epochs, 300U);
    EXPECT_EQ(result.planned, simulation.epoch_count());
    EXPECT_EQ(collector.finished, 1);
    EXPECT_EQ(bytes_of(collector.epochs), bytes_of({full.begin(), full.begin() + 300}));
  }
}

TEST(Simulation, AFailingSinkLeavesTheOthersWhole) {
  const Simulation simulation = simulation_of(kDrive + "duration_s: 10\n");
  Collector good;
  Collector bad;
  bad.on_write = [](std::size_t n) {
    if (n == 4) throw std::runtime_error("disk full");
  };
  EXPECT_THROW((void)simulation.run({&good, &bad}), std::runtime_error);
  EXPECT_EQ(good.epochs.size(), 4U);
  EXPECT_EQ(good.finished, 1);
  EXPECT_EQ(bad.finished, 0) << "what is broken does not become a file";
}

TEST(Simulation, ASinkThatCannotFinishLeavesTheOthersWhole) {
  const Simulation simulation = simulation_of(kDrive + "duration_s: 10\n");
  class Unfinished final : public EpochSink {
   public:
    void write(const Epoch&) override {}
    void finish() override { throw std::runtime_error("disk full"); }
  } unfinished;
  Collector good;
  EXPECT_THROW((void)simulation.run({&unfinished, &good}), std::runtime_error);
  EXPECT_EQ(good.epochs.size(), 11U);
  EXPECT_EQ(good.finished, 1);
}

// 3,601 epochs, of which every second is checked beforehand: the hole in the terrain is found during the run.
TEST(Simulation, AFailureOnTheWayKeepsWhatWasDone) {
  Scenario scenario = parse_scenario(
      kOpen +
          "start: 2026-06-01T08:00:00Z\nrate_hz: 10\nsky: {systems: GPS}\ntrajectory: {waypoints: [{east_m: "
          "0, "
          "north_m: 0}, {east_m: 400, north_m: 0}], speed_mps: 1, height_above_terrain_m: 2}\n",
      "s.yaml");
  city::City city = open_field(*scenario.city.origin);
  // Epoch 2501 is at 250.1 m; 250.0 and 250.2 m are checked.
  for (const auto& [west, east] : {std::pair(-10.0, 250.05), std::pair(250.15, 500.0)}) {
    city::append_object(city.mesh, "terrain", city::Surface::Terrain, city::Material::Ground,
                        {{west, -50, 0}, {east, -50, 0}, {east, 50, 0}, {west, 50, 0}},
                        {{0, 1, 2}, {0, 2, 3}});
  }
  const Simulation simulation(std::move(scenario), std::move(city));
  for (const int threads : {1, 2}) {
    RunOptions options;
    options.threads = threads;
    Collector collector;
    EXPECT_THAT(error_of([&] { (void)simulation.run({&collector}, options); }).what(),
                HasSubstr("no terrain"));
    EXPECT_EQ(collector.epochs.size(), 2501U);
    EXPECT_EQ(collector.finished, 1);
  }
}

TEST(Simulation, TellsProgress) {
  const Simulation simulation = simulation_of(kDrive + "duration_s: 20\n");
  std::vector<std::size_t> reported;
  RunOptions options;
  options.progress = [&](std::size_t done, std::size_t total) {
    reported.push_back(done);
    EXPECT_EQ(total, 21U);
  };
  Collector collector;
  const RunResult result = simulation.run({&collector}, options);
  ASSERT_FALSE(reported.empty());
  EXPECT_EQ(reported.back(), 21U);
  EXPECT_TRUE(std::is_sorted(reported.begin(), reported.end()));
  EXPECT_NEAR(result.simulated_s, 21, 1e-9);
  EXPECT_LE(reported.size(), 2 + static_cast<std::size_t>(result.wall_s * 10));
}

TEST(Simulation, LeverArmTurnsWithTheVehicle) {
  // Eastwards: forward is east, left is north. Then northwards: forward is north, left is west.
  const std::string lever = "receivers: [{name: a, lever_arm: {forward_m: 2, left_m: 1, up_m: 0.5}}]\n";
  const Simulation simulation = simulation_of(
      kOpen + "start: 2026-06-01T08:00:00Z\n" + lever +
      "trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2}, {east_m: 100, north_m: 0, up_m: 2}, "
      "{east_m: 100, north_m: 100, up_m: 2}], speed_mps: 10}\n");
  const auto& frame = simulation.environment().city().frame;
  const auto at = [&](double t) {
    return frame.local_from_geodetic(simulation.antenna_pose(0, simulation.begin() + t).position);
  };
  EXPECT_LT((at(5) - Eigen::Vector3d(52, 1, 2.5)).norm(), 2e-3);
  EXPECT_LT((at(15) - Eigen::Vector3d(99, 52, 2.5)).norm(), 2e-3);
}

TEST(Simulation, TheLeverArmMovesTooInATurn) {
  // A circle of 50 m at 10 m/s: an antenna 3 m ahead and 2 m left moves at omega times its own distance from
  // the centre, sqrt(48^2 + 3^2).
  const TemporaryFolder folder;
  const geodesy::LocalFrame frame(Geodetic::from_degrees(22.3, 114.17, 0));
  std::string csv = "time,latitude,longitude,height\n";
  for (int i = 0; i <= 60; ++i) {
    const double angle = 0.2 * i * 0.5;
    const Geodetic geodetic = frame.geodetic_from_local({50 * std::cos(angle), 50 * std::sin(angle), 2});
    char line[200];
    std::snprintf(line, sizeof line, "%.1f,%.10f,%.10f,%.5f\n", i * 0.5,
                  geodesy::degrees(geodetic.latitude_rad), geodesy::degrees(geodetic.longitude_rad),
                  geodetic.height_m);
    csv += line;
  }
  (void)folder.write("t.csv", csv);
  Scenario scenario = parse_scenario(kOpen +
                                         "start: 2026-06-01T08:00:00Z\ntrajectory: {file: t.csv}\n"
                                         "receivers: [{name: a, lever_arm: {forward_m: 3, left_m: 2}}]\n",
                                     folder / "s.yaml");
  city::City city = city_of(scenario);
  const Simulation simulation(std::move(scenario), std::move(city));
  EXPECT_EQ(simulation.interval_s(), 0.5);
  for (double t = 5; t < 25; t += 0.7) {
    const Pose pose = simulation.antenna_pose(0, simulation.begin() + t);
    EXPECT_NEAR(pose.velocity_enu_mps.norm(), 0.2 * std::hypot(48.0, 3.0), 0.05) << t;
    const Pose after = simulation.antenna_pose(0, simulation.begin() + (t + 1e-3));
    const Eigen::Vector3d slope =
        (frame.local_from_geodetic(after.position) - frame.local_from_geodetic(pose.position)) / 1e-3;
    EXPECT_LT((slope - pose.velocity_enu_mps).norm(), 0.05) << t;
  }
}

// A slope of 1 in 10 eastwards.
TEST(Simulation, ClampFollowsTheTerrainAndItsSlope) {
  Scenario scenario = parse_scenario(kOpen +
                                         "start: 2026-06-01T08:00:00Z\ntrajectory: {waypoints: [{east_m: 0, "
                                         "north_m: 0}, {east_m: 100, north_m: "
                                         "0}], height_above_terrain_m: 2}\n",
                                     "s.yaml");
  city::City city = open_field(*scenario.city.origin);
  city::append_object(city.mesh, "terrain", city::Surface::Terrain, city::Material::Ground,
                      {{-500, -500, -50}, {500, -500, 50}, {500, 500, 50}, {-500, 500, -50}},
                      {{0, 1, 2}, {0, 2, 3}});
  const Simulation simulation(std::move(scenario), std::move(city));
  const auto& frame = simulation.environment().city().frame;
  for (double t = 0; t <= 10; t += 1) {
    const Pose pose = simulation.antenna_pose(0, simulation.begin() + t);
    const Eigen::Vector3d local = frame.local_from_geodetic(pose.position);
    EXPECT_NEAR(local.z(), 0.1 * local.x() + 2, 1e-3);
    EXPECT_NEAR(pose.velocity_enu_mps.z(), 0.1 * pose.velocity_enu_mps.x(), 0.02);
  }
}

TEST(Simulation, ClampWithoutTerrainIsAnError) {
  Scenario scenario =
      parse_scenario(kOpen +
                         "start: 2026-06-01T08:00:00Z\ntrajectory: {position: {east_m: 0, north_m: 0}, "
                         "height_above_terrain_m: 2}\nduration_s: 1\n",
                     "s.yaml");
  city::City city = open_field(*scenario.city.origin);
  canyon::test::append_box(city.mesh, "house", city::Surface::Building, city::Material::Concrete, {20, 20, 0},
                           {30, 30, 9});
  EXPECT_THAT(error_of([&] { const Simulation simulation(std::move(scenario), std::move(city)); }).what(),
              AllOf(HasSubstr("s.yaml: "), HasSubstr("there is no terrain at latitude 22.300000")));
}

TEST(Simulation, SaysHowManyEpochsWereInsideABuilding) {
  const Simulation simulation = simulation_of(
      "city: {synthetic: {blocks_east: 2, blocks_north: 2}}\nstart: 2026-06-01T08:00:00Z\nsky: {systems: "
      "GPS}\n"
      "trajectory: {position: {east_m: 38, north_m: 38, up_m: 1}}\nduration_s: 11\n");
  Collector collector;
  const RunResult result = simulation.run({&collector});
  ASSERT_EQ(collector.epochs.size(), 12U);
  EXPECT_THAT(result.warnings,
              testing::ElementsAre("rover: 12 epochs with the antenna inside a building: no signal there"));
  for (const Epoch& e : collector.epochs) {
    EXPECT_EQ(e.containment, raytrace::Containment::InsideBuilding);
    EXPECT_EQ(e.observed.fix.status, positioning::FixStatus::NoSignal);
    EXPECT_TRUE(std::isnan(e.error_enu_m.x()));
  }
}

// A recorded car drives above the roofs if the map's ground is at another height.
TEST(Simulation, SaysThatARecordedPathIsFarAboveTheGround) {
  const TemporaryFolder folder;
  const auto warnings = [&](const std::string& height_m, const std::string& keys = "") {
    (void)folder.write("t.csv", "time,latitude,longitude,height\n2026-06-01T08:00:00Z,22.3,114.17," +
                                    height_m + "\n2026-06-01T08:00:09Z,22.3001,114.17," + height_m + "\n");
    Scenario scenario = parse_scenario(
        "city: {synthetic: {blocks_east: 2, blocks_north: 2}}\nsky: {systems: GPS}\n"
        "trajectory: {file: t.csv" +
            keys + "}\n",
        folder / "s.yaml");
    city::City city = city_of(scenario);
    return Simulation(std::move(scenario), std::move(city)).warnings();
  };
  const auto reported = Contains(HasSubstr("never lower than 152 m above the city's ground"));
  EXPECT_THAT(warnings("152"), reported);
  EXPECT_THAT(warnings("2"), testing::Not(reported));
  EXPECT_THAT(warnings("152", ", height_above_terrain_m: 1.5"), testing::Not(reported));
}

TEST(Simulation, RefusesAFarCityAndAnEmptyOne) {
  EXPECT_THAT(fault("city: {synthetic: {}}\nstart: 2026-06-01T08:00:00Z\nduration_s: 5\n"
                    "trajectory: {position: {latitude_deg: 22.3, longitude_deg: 113.17, height_m: 5}}\n"),
              AllOf(HasSubstr("the trajectory is 102"), HasSubstr("km away from the city"),
                    HasSubstr("check city.origin")));
  Scenario scenario = parse_scenario(kDrive, "s.yaml");
  const Geodetic origin = *scenario.city.origin;
  EXPECT_THAT(error_of([&] { Simulation s(std::move(scenario), open_field(origin)); }).what(),
              HasSubstr("is empty: it has no triangle"));
}

TEST(Simulation, NeedsAStartAndADuration) {
  EXPECT_THAT(fault(kOpen + "trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}\nduration_s: 1\n"),
              HasSubstr("'start' is missing"));
  EXPECT_THAT(
      fault(kOpen +
            "start: 2026-06-01T08:00:00Z\ntrajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}\n"),
      HasSubstr("'duration_s' is missing"));
  EXPECT_THAT(fault(kOpen + "start: 2026-06-01T08:00:00Z\nduration_s: 1e8\nrate_hz: 1000\n"
                            "trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}\n"),
              HasSubstr("epochs are too many"));
}

TEST(Simulation, StartAndDurationChooseAPartOfARecording) {
  const TemporaryFolder folder;
  (void)folder.write("t.csv",
                     "time,latitude,longitude,height\n2026-06-01T08:00:00Z,22.3,114.17,5\n2026-06-01T08:00:"
                     "01Z,22.3,114.17,5\n"
                     "2026-06-01T08:00:02Z,22.3,114.17,5\n2026-06-01T08:00:10Z,22.3,114.17,5\n");
  const auto make = [&](const std::string& keys) {
    Scenario scenario =
        parse_scenario(kOpen + "trajectory: {file: t.csv}\nsky: {systems: GPS}\n" + keys, folder / "s.yaml");
    city::City city = city_of(scenario);
    return Simulation(std::move(scenario), std::move(city));
  };
  EXPECT_EQ(make("").epoch_count(), 11U);
  EXPECT_EQ(make("start: 2026-06-01T08:00:04Z\n").epoch_count(), 7U);
  EXPECT_EQ(make("start: 2026-06-01T08:00:04Z\nduration_s: 2\nrate_hz: 2\n").epoch_count(), 5U);
  const Simulation longer = make("duration_s: 60\n");
  EXPECT_EQ(longer.epoch_count(), 11U);
  EXPECT_THAT(longer.warnings(), Contains(HasSubstr("before the duration of 60 s")));
  EXPECT_THAT(error_of([&] { (void)make("start: 2026-05-31T08:00:00Z\n"); }).what(),
              HasSubstr("is outside the trajectory (2026-06-01T08:00:18.000 GPST to"));
  EXPECT_THAT(error_of([&] { (void)make("start: 2026-06-02T08:00:00Z\n"); }).what(), HasSubstr("is outside"));
}

// --- skies
// -----------------------------------------------------------------------------------------------------

struct NavigationFile {
  // GPS ephemerides of 08:00 to 10:00, as nominal ones written to a file.
  NavigationFile() {
    const GpsTime begin = geodesy::parse_time("2026-06-01T08:00:00Z");
    path = folder / "sky.nav";
    rinex::write_rinex_navigation(path,
                                  orbit::nominal_constellation(begin, begin + 7200.0, {gnss::System::GPS}));
  }
  [[nodiscard]] Simulation simulate(const std::string& keys) const {
    Scenario scenario = parse_scenario(
        kOpen + "trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}\n" + keys, folder / "s.yaml");
    city::City city = city_of(scenario);
    return Simulation(std::move(scenario), std::move(city));
  }
  TemporaryFolder folder;
  std::filesystem::path path;
};

TEST(BuildSky, OfBroadcastOrbitsHasErrorsFromSpace) {
  const auto has_errors = [](const std::string& sky) {
    const Simulation simulation = simulation_of(kOpen + "start: 2026-06-01T08:00:00Z\nduration_s: 0\n" + sky +
                                                "trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}\n");
    return simulation.environment().errors() != nullptr;
  };
  EXPECT_TRUE(has_errors(""));
  EXPECT_TRUE(has_errors("sky: {nominal: true}\n"));
  EXPECT_FALSE(has_errors("sky: {nominal: true, errors: {enabled: false}}\n"));
  EXPECT_FALSE(
      has_errors("sky: {frozen: {satAzimuth: [0, 1.5, 3, 4.5], satElevation: [0.5, 1, 0.7, 1.2]}}\n"));
}

TEST(BuildSky, WithoutCoefficientsHasTheIonosphereOfItsYear) {
  SkyConfig config;
  const GpsTime noon = geodesy::parse_time("2024-05-01T12:00:00 GPST");
  const auto flux_sfu = [&] {
    const auto klobuchar = build_sky(config, noon, noon + 60.0, {}).navigation.klobuchar;
    return klobuchar.empty() ? 0 : klobuchar.at(gnss::System::GPS).alpha[0] / 0.1118e-9;
  };
  EXPECT_NEAR(flux_sfu(), 100, 1e-9) << "nominal satellites";
  config.errors.solar_flux_sfu = 200;
  EXPECT_NEAR(flux_sfu(), 200, 1e-9);
  config = {};
  config.sp3 = {std::filesystem::path(canyon_source_dir) / "tests/data/cases/sp3-two-days/day1.sp3"};
  EXPECT_EQ(flux_sfu(), 0) << "no errors from space";
  config.errors.enabled = true;
  EXPECT_NEAR(flux_sfu(), 191, 1e-9);
  EXPECT_THAT(build_sky(config, noon, noon + 60.0, {}).report.warnings(),
              Contains(HasSubstr("a standard one for a solar flux of 191 sfu")));
  config.errors.solar_flux_sfu = 150;
  EXPECT_NEAR(flux_sfu(), 150, 1e-9);
}

TEST(BuildSky, ATrajectoryOutsideTheEphemeridesNamesBothSpansAndTheCure) {
  const NavigationFile file;
  EXPECT_THAT(
      file.simulate("start: 2026-06-01T09:00:00Z\nduration_s: 10\nsky: {navigation: sky.nav}\n").warnings(),
      IsEmpty());
  EXPECT_THAT(
      error_of([&] {
        (void)file.simulate("start: 2026-06-03T09:00:00Z\nduration_s: 10\nsky: {navigation: sky.nav}\n");
      }).what(),
      AllOf(HasSubstr(
                "the requested time (2026-06-03T09:00:18 GPST to 2026-06-03T09:00:28 GPST) is outside the "
                "ephemerides (2026-06-01T"),
            HasSubstr("allow_stale: true")));
}

TEST(BuildSky, StaleEphemeridesAreAllowedAndSaid) {
  const NavigationFile file;
  const Simulation stale = file.simulate(
      "start: 2026-06-03T09:00:00Z\nduration_s: 10\nsky: {navigation: sky.nav, allow_stale: true}\n");
  EXPECT_THAT(stale.warnings(),
              Contains(HasSubstr("24 satellites use ephemerides older than their system allows")));
  EXPECT_FALSE(run(stale).empty());
}

TEST(BuildSky, EphemeridesThatEndOnTheWayAreAWarning) {
  const NavigationFile file;
  const Simulation partial = file.simulate(
      "start: 2026-06-01T09:00:00Z\nduration_s: 36000\nrate_hz: 0.01\nsky: {navigation: sky.nav}\n");
  EXPECT_THAT(partial.warnings(), Contains(HasSubstr("do not cover the whole run")));
  const std::vector<Epoch> epochs = run(partial);
  EXPECT_TRUE(epochs.front().observed.fix.solved());
  EXPECT_FALSE(epochs.back().observed.fix.solved());
}

TEST(BuildSky, UnhealthySatellitesInTheSkyAreSaid) {
  const GpsTime begin = geodesy::parse_time("2026-06-01T08:00:00Z");
  const Geodetic position = Geodetic::from_degrees(22.3, 114.17, 2);
  gnss::NavigationData data = orbit::nominal_constellation(begin, begin + 7200.0, {gnss::System::GPS});
  const orbit::BroadcastSky sky(data);
  std::size_t above = 0;
  for (const gnss::SatelliteId id : sky.satellites()) {
    const auto line = orbit::line_of_sight(sky, id, begin, geodesy::ecef_from_geodetic(position));
    above += line && line->elevation_rad > geodesy::radians(5) ? 1U : 0U;
  }
  // All but G01 .. G03 unhealthy: those of the rest above the horizon are listed, the others are not.
  std::size_t healthy_above = 0;
  for (auto& e : data.kepler) {
    if (e.id.number > 3) e.health = 1;
  }
  for (const gnss::SatelliteId id : sky.satellites()) {
    if (id.number > 3) continue;
    const auto line = orbit::line_of_sight(sky, id, begin, geodesy::ecef_from_geodetic(position));
    healthy_above += line && line->elevation_rad > geodesy::radians(5) ? 1U : 0U;
  }
  const TemporaryFolder folder;
  rinex::write_rinex_navigation(folder / "sky.nav", data);
  SkyConfig config;
  config.navigation = {folder / "sky.nav"};
  const BuiltSky built = build_sky(config, begin, begin + 60.0, position);
  EXPECT_THAT(
      built.report.warnings(),
      Contains(AllOf(HasSubstr(std::to_string(above - healthy_above) + " satellites above the horizon"),
                     HasSubstr("unhealthy"))));
}

// The middle of the day removed.
TEST(Sky, AGapOfPreciseOrbitsIsCalledOne) {
  std::ifstream in(std::filesystem::path(canyon_source_dir) / "tests/data/cases/sp3-two-days/day1.sp3");
  const TemporaryFolder folder;
  {
    std::ofstream out(folder / "day.sp3");
    int epochs = 0;
    for (std::string line; std::getline(in, line);) {
      epochs += line.starts_with('*') ? 1 : 0;
      if (epochs < 30 || epochs > 60 || line == "EOF") out << line << '\n';
    }
  }
  SkyConfig config;
  config.sp3 = {folder / "day.sp3"};
  const GpsTime noon = geodesy::parse_time("2024-05-01T12:00:00 GPST");
  EXPECT_THAT(error_of([&] { (void)build_sky(config, noon, noon + 60.0, {}); }).what(),
              HasSubstr("no satellite has precise orbits at 2024-05-01T12:00:00 GPST: a gap in their span"));
}

// Each satellite with its own health, not all with that of the first one.
TEST(BuildSky, UnhealthySatellitesAreSaidByTheirHealth) {
  const GpsTime begin = geodesy::parse_time("2026-06-01T08:00:00Z");
  const Geodetic position = Geodetic::from_degrees(22.3, 114.17, 2);
  gnss::NavigationData data = orbit::nominal_constellation(begin, begin + 7200.0, {gnss::System::GPS});
  for (auto& e : data.kepler) e.health = e.id.number % 2 == 0 ? 63 : 28;
  data.kepler.front().health = 0;  // one that exists
  const TemporaryFolder folder;
  rinex::write_rinex_navigation(folder / "sky.nav", data);
  SkyConfig config;
  config.navigation = {folder / "sky.nav"};
  const BuiltSky built = build_sky(config, begin, begin + 60.0, position);
  EXPECT_THAT(built.report.warnings(), Contains(AllOf(HasSubstr(": unhealthy (health 28); G"),
                                                      HasSubstr(": unhealthy (health 63))"))));
}

// The ground of an open field is level at its origin's height.
TEST(Simulation, AnOpenFieldHasGround) {
  const Simulation simulation = simulation_of(
      "city: {open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17, height_m: 40}}\n"
      "start: 2026-06-01T08:00:00Z\ntrajectory: {waypoints: [{east_m: 0, north_m: 0}, {east_m: 3000, "
      "north_m: 0}], "
      "height_above_terrain_m: 1.5}\n");
  for (const double seconds : {0.0, 100.0, 190.0}) {
    const Pose pose = simulation.antenna_pose(0, simulation.begin() + seconds);
    EXPECT_NEAR(pose.position.height_m, 41.5, 1e-9);
    EXPECT_EQ(pose.velocity_enu_mps.z(), 0);
  }
}

TEST(BuildSky, MissingSystemsAreSaid) {
  const NavigationFile file;
  EXPECT_THAT(file.simulate("start: 2026-06-01T09:00:00Z\nduration_s: 10\nsky: {navigation: sky.nav, "
                            "systems: [GPS, Galileo]}\n")
                  .warnings(),
              Contains(HasSubstr("no Galileo satellite")));
  EXPECT_THAT(
      error_of([&] {
        (void)file.simulate(
            "start: 2026-06-01T09:00:00Z\nduration_s: 10\nsky: {navigation: sky.nav, systems: BeiDou}\n");
      }).what(),
      HasSubstr("BeiDou"));
}

TEST(BuildSky, IonosphereNeedsItsCoefficients) {
  EXPECT_THAT(
      fault(kOpen + "start: 2026-06-01T08:00:00Z\nduration_s: 1\nreceivers: [{name: a, ionosphere: true}]\n"
                    "sky: {frozen: {satAzimuth: [0, 1.5, 3, 4.5], satElevation: [0.5, 1, 0.7, 1.2]}}\n"
                    "trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}\n"),
      HasSubstr("no ionosphere coefficients"));
}

TEST(BuildSky, FrozenSatellitesStandWhereTheyAreSaidTo) {
  Scenario scenario = read_scenario(kSource / "examples/frozen_sky.yaml");
  const Scenario copy = scenario;
  city::City city = city_of(scenario);
  const Simulation simulation(std::move(scenario), std::move(city));
  EXPECT_EQ(simulation.epoch_count(), 61U);
  EXPECT_TRUE(simulation.navigation().empty());
  for (const Epoch& e : run(simulation)) {
    ASSERT_EQ(e.observed.satellites.size(), 8U);
    for (std::size_t i = 0; i < 8; ++i) {
      EXPECT_NEAR(e.observed.satellites[i].azimuth_rad, copy.sky.frozen_azimuth_rad[i], 1e-5);
      EXPECT_NEAR(e.observed.satellites[i].elevation_rad, copy.sky.frozen_elevation_rad[i], 1e-5);
    }
  }
}

TEST(Examples, TheSyntheticDriveIsHardButNotHopeless) {
  Scenario scenario = read_scenario(kSource / "examples/synthetic_drive.yaml");
  city::City city = city_of(scenario);
  const Simulation simulation(std::move(scenario), std::move(city));
  EXPECT_THAT(simulation.warnings(), IsEmpty());
  EXPECT_EQ(simulation.epoch_count(), 609U);
  std::size_t fixes = 0;
  std::size_t nlos = 0;
  std::vector<double> horizontal_m;
  for (const Epoch& e : run(simulation)) {
    if (e.observed.fix.solved()) horizontal_m.push_back(e.error_enu_m.head<2>().norm());
    fixes += e.observed.fix.solved() ? 1U : 0U;
    for (const auto& s : e.observed.satellites)
      nlos += s.visibility == propagation::Visibility::NLOS ? 1U : 0U;
  }
  ASSERT_FALSE(horizontal_m.empty());
  std::sort(horizontal_m.begin(), horizontal_m.end());
  std::printf(
      "synthetic drive: %zu of 609 epochs with a fix, %zu NLOS observations, horizontal error %.1f m "
      "(median), "
      "%.1f m (95 %%)\n",
      fixes, nlos, horizontal_m[horizontal_m.size() / 2], horizontal_m[horizontal_m.size() * 95 / 100]);
  EXPECT_GT(fixes, 300U);
  EXPECT_GT(nlos, 300U);
}

// Positions with latitude and longitude exchanged, or with the wrong sign.
const std::string kOneSecond =
    "start: 2026-06-01T08:00:00Z\nduration_s: 1\nsky: {nominal: true, systems: [GPS]}\n";
const std::string kHere =
    "trajectory: {position: {latitude_deg: 22.3, longitude_deg: 114.17, height_m: 2}}\n";

TEST(Simulation, AnOpenFieldFarFromTheTrajectoryIsTold) {
  const auto at = [](double latitude_deg, const std::string& field) {
    return fmt::format(
        "{}{}trajectory: {{position: {{latitude_deg: {}, longitude_deg: 114.17, height_m: 2}}}}\n", field,
        kOneSecond, latitude_deg);
  };
  const auto reported = Contains(AllOf(HasSubstr("km away from the city"), HasSubstr("check city.origin")));
  EXPECT_THAT(simulation_of(at(22.5, kOpen)).warnings(), reported);
  EXPECT_THAT(simulation_of(at(22.38, kOpen)).warnings(), testing::Not(reported));
  // A flight may begin far away.
  const std::string flight =
      kOpen +
      "start: 2026-06-01T08:00:00Z\nsky: {nominal: true}\ntrajectory: {speed_mps: 200, waypoints: [{east_m: "
      "-40000, north_m: 0, up_m: 900}, {east_m: 0, north_m: 0, up_m: 900}]}\n";
  EXPECT_THAT(simulation_of(flight).warnings(), testing::Not(reported));
}

TEST(Simulation, AFixedReceiverBeyondTheCityIsRefused) {
  EXPECT_THAT(fault(kOpen + kOneSecond + kHere +
                    "receivers: [{name: r, profile: ideal}, {name: b, profile: survey, fixed: {latitude_deg: "
                    "-22.3, longitude_deg: -66, height_m: 0}}]\n"),
              AllOf(HasSubstr("s.yaml"), HasSubstr("receivers[1].fixed: 'b' is 12750 km from the city")));
}

// Impossible motion is reported with its number and first time; a wrong digit within the bounds is not.
TEST(Simulation, WaysThatAreNotPossibleAreTold) {
  const auto drive = [](double speed_mps, double height_m) {
    return simulation_of(
               fmt::format("{}start: 2026-06-01T08:00:00Z\nsky: {{nominal: true, systems: [GPS]}}\n"
                           "trajectory: {{speed_mps: {}, waypoints: [{{east_m: 0, north_m: 0, up_m: "
                           "{}}}, {{east_m: 3000, north_m: 0, up_m: {}}}]}}\n",
                           kOpen, speed_mps, height_m, height_m))
        .warnings();
  };
  EXPECT_THAT(drive(1500, 100), Contains(AllOf(HasSubstr("no vehicle moves at 1500 m/s"),
                                               HasSubstr("at 2026-06-01T08:00:18 GPST (the first of 3)"))));
  EXPECT_THAT(drive(300, 120e3), Contains(HasSubstr("no vehicle is at a height of 120000 m")));
  EXPECT_THAT(drive(300, 10e3), Not(Contains(HasSubstr("no vehicle"))));
}

TEST(Simulation, AReceiverWithoutASignalOfTheSkyIsRefused) {
  const std::string text =
      kOpen + kOneSecond + kHere + "receivers: [{name: r, profile: ublox-f9p, tracks: [E1";
  EXPECT_THAT(fault(text + "]}]\n"),
              AllOf(HasSubstr("s.yaml"),
                    HasSubstr("receiver 'r': it tracks E1, but the sky only has satellites of GPS")));
  EXPECT_NO_THROW((void)simulation_of(text + ", L1CA]}]\n"));
}

TEST(Simulation, NamesOfAListAreGivenOnce) {
  const std::string rest = kOneSecond + kHere;
  EXPECT_THAT(fault(kOpen + rest + "streets: {enabled: true, vehicle_fractions: [car=80, car=20]}\n"),
              HasSubstr("vehicle_fractions: 'car' is given twice"));
  EXPECT_THAT(fault("city: {synthetic: {}, facades: {shares: [concrete=1, concrete=2]}}\n" + rest),
              HasSubstr("fractions: 'concrete' is given twice"));
}

}  // namespace
}  // namespace canyon::simulation::simulator_test
