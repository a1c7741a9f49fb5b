// The recorded drive through Tsim Sha Tsui, end to end.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "canyon/base/text_file.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/receiver_surroundings.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/loaded_city.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/simulation_support.hpp"
#include "tests/support/source_dir.hpp"

namespace canyon::simulation::simulator_real_test {
namespace {

using geodesy::GpsTime;

class Collector final : public EpochSink {
 public:
  void write(const Epoch& epoch) override { epochs.push_back(epoch); }
  void finish() override {}
  std::vector<Epoch> epochs;
};

const char* const kExample = "examples/urbannav_tst.yaml";

// The example as if it were next to the data that it names.
Scenario example(const std::string& keys = {}) {
  const TextFile file(std::filesystem::path(canyon_source_dir) / kExample);
  return parse_scenario(std::string(file.text()) + keys, canyon::test::shared_data("urbannav_tst.yaml"));
}

TEST(UrbanNavDrive, StreetsAreDenseByTheMap) {
  CANYON_SHARED_DATA(data, "hongkong/buildings.dae");
  const city::City city = canyon::test::loaded_city(example().city);
  ReceiverConfig receiver;
  receiver.options.signal.shadowing.enabled = true;
  receiver.options.signal.shadowing.environment = disturbance::ShadowingEnvironment::Auto;
  EXPECT_EQ(with_surroundings(receiver, raytrace::RayScene(city.mesh), city, 1).signal.shadowing.environment,
            disturbance::ShadowingEnvironment::Dense);
}

TEST(UrbanNavDrive, RunsEndToEnd) {
  CANYON_SHARED_DATA(data, "hongkong/buildings.dae");
  Scenario scenario = example();
  city::City city = canyon::test::loaded_city(scenario.city);
  const Simulation simulation(std::move(scenario), std::move(city));
  for (const std::string& warning : simulation.warnings()) std::printf("warning: %s\n", warning.c_str());

  // 485 epochs, tow 46701 to 47185 of week 2051: the data's own README.
  ASSERT_EQ(simulation.epoch_count(), 485U);
  EXPECT_EQ(simulation.interval_s(), 1);
  Collector collector;
  RunOptions options;
  options.threads = 1;
  const RunResult result = simulation.run({&collector}, options);
  EXPECT_EQ(result.epochs, 485U);
  EXPECT_FALSE(result.interrupted);
  ASSERT_EQ(collector.epochs.size(), 485U);
  for (std::size_t i = 0; i < 485; ++i) {
    EXPECT_EQ(collector.epochs[i].observed.time, GpsTime::from_week(2051, 46701 + static_cast<double>(i)));
  }

  const auto& frame = simulation.environment().city().frame;
  std::size_t fixes = 0;
  std::size_t visibilities[4] = {};
  std::vector<double> horizontal_m;
  for (const Epoch& e : collector.epochs) {
    // The mesh's ground is flat at z = 0, the antenna two metres above it.
    EXPECT_NEAR(frame.local_from_ecef(e.truth_ecef).z(), 2, 1e-3);
    for (const auto& s : e.observed.satellites) {
      if (s.above_mask) ++visibilities[static_cast<int>(s.visibility)];
      EXPECT_TRUE(s.id.system == gnss::System::GPS || s.id.system == gnss::System::BeiDou);
    }
    if (!e.observed.fix.solved()) continue;
    ++fixes;
    horizontal_m.push_back(e.error_enu_m.head<2>().norm());
  }
  std::sort(horizontal_m.begin(), horizontal_m.end());
  ASSERT_FALSE(horizontal_m.empty());
  std::printf(
      "%zu of 485 epochs with a fix; LOS %zu, LOS+multipath %zu, NLOS %zu, blocked %zu; horizontal error "
      "%.1f m "
      "(median), %.1f m (95 %%); %.0f times real time on one thread\n",
      fixes, visibilities[0], visibilities[1], visibilities[2], visibilities[3],
      horizontal_m[horizontal_m.size() / 2], horizontal_m[horizontal_m.size() * 95 / 100],
      result.simulated_s / result.wall_s);
  for (const std::string& warning : result.warnings) std::printf("warning: %s\n", warning.c_str());
  EXPECT_GT(fixes, 300U);
  EXPECT_GT(visibilities[2], 200U) << "a street canyon has NLOS satellites";
  EXPECT_GT(visibilities[3], 1000U);
}

TEST(UrbanNavDrive, EphemeridesOfAnotherDayAreRefused) {
  CANYON_SHARED_DATA(data, "hongkong/buildings.dae");
  CANYON_SHARED_DATA(other, "orbits/brdc3050.12n");
  Scenario scenario = example();
  scenario.sky.navigation = {other};
  city::City city = canyon::test::loaded_city(scenario.city);
  const std::string what =
      test::error_of([&] { const Simulation s(std::move(scenario), std::move(city)); }).what();
  EXPECT_THAT(what, testing::AllOf(testing::HasSubstr("2019-04-28T12:58:21 GPST to 2019-04-28T13:06:25 GPST"),
                                   testing::HasSubstr("is outside the ephemerides (2012-"),
                                   testing::HasSubstr("allow_stale")));
}

TEST(UrbanNavDrive, AnotherOriginIsRefused) {
  CANYON_SHARED_DATA(data, "hongkong/buildings.dae");
  Scenario scenario = example();
  scenario.city.origin = geodesy::Geodetic::from_degrees(22.298251, 114.378761, 0);
  city::City city = canyon::test::loaded_city(scenario.city);
  const std::string what =
      test::error_of([&] { const Simulation s(std::move(scenario), std::move(city)); }).what();
  EXPECT_THAT(what, testing::HasSubstr("the trajectory is 20."));
}

TEST(UrbanNavDrive, PreciseOrbitsOfAnotherDayAreRefused) {
  CANYON_SHARED_DATA(data, "hongkong/buildings.dae");
  CANYON_SHARED_DATA(sp3, "orbits/GRG0MGXFIN_20201770000_01D_15M_ORB.SP3.gz");
  SkyConfig config;
  config.sp3 = {sp3};
  const GpsTime drive = GpsTime::from_week(2051, 46701);
  const geodesy::Geodetic position = geodesy::Geodetic::from_degrees(22.3, 114.17, 5);
  EXPECT_THAT(test::error_of([&] { (void)build_sky(config, drive, drive + 60.0, position); }).what(),
              testing::HasSubstr("is outside the precise orbits (2020-06-25T00:00:00 GPST"));
  const GpsTime day = GpsTime::from_week(2111, 4 * 86400.0 + 43200);
  const BuiltSky built = build_sky(config, day, day + 60.0, position);
  EXPECT_GT(built.sky->satellites().size(), 60U);
}

}  // namespace
}  // namespace canyon::simulation::simulator_real_test
