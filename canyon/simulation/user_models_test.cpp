// Weights and positions of a calling program, and traces of many points, compared with the engine's own.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/simulation/trace_points.hpp"

namespace canyon::simulation::user_models_test {
namespace {

using ::testing::HasSubstr;

class Collector final : public EpochSink {
 public:
  void write(const Epoch& epoch) override { epochs.push_back(epoch); }
  void finish() override {}
  std::vector<Epoch> epochs;
};

std::vector<Epoch> simulated(const receiver::ModelSource& models,
                             const std::string& receiver = "profile: paper, weights: {weighting: sigma}") {
  Scenario scenario = parse_scenario(R"(
city: {synthetic: {}}
sky: {nominal: true, systems: [GPS, Galileo]}
start: 2026-06-01T08:00:00Z
trajectory: {position: {east_m: 0, north_m: 0, up_m: 200}}
duration_s: 3
receivers: [{name: car, )" + receiver + "}]\n",
                                     "scenario.yaml");
  scenario.receivers.front().models = models;
  Collector collector;
  (void)Simulation(std::move(scenario), city::synthetic_city({})).run({&collector});
  return collector.epochs;
}

// Equal weights of any value give the fix of `weighting: equal`.
TEST(UserModels, WeightsReplaceTheOptions) {
  const auto own = simulated([](std::uint64_t, const std::string&) {
    receiver::UserModels models;
    models.sigma_m = [](const positioning::Measurement&, double) { return 7.0; };
    return models;
  });
  const auto equal = simulated({}, "profile: paper, weights: {weighting: equal}");
  ASSERT_EQ(own.size(), 4U);
  for (std::size_t i = 0; i < own.size(); ++i) {
    ASSERT_TRUE(own[i].observed.fix.solved());
    EXPECT_LT((own[i].error_enu_m - equal[i].error_enu_m).norm(), 1e-6);
  }
}

TEST(UserModels, AWeightOfNothingIsRefused) {
  try {
    (void)simulated([](std::uint64_t, const std::string&) {
      receiver::UserModels models;
      models.sigma_m = [](const positioning::Measurement&, double) { return 0.0; };
      return models;
    });
    FAIL() << "it was taken";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("the weighting returns 0 m for G"));
  }
}

// A model that calls solve_fix() gives the result of the receiver without it; it is made again for each run.
TEST(UserModels, ASolverReplacesTheFix) {
  int made = 0, solved = 0;
  const receiver::ModelSource source = [&](std::uint64_t seed, const std::string&) {
    EXPECT_EQ(seed, 1U);
    ++made;
    receiver::UserModels models;
    models.solve = [&solved](geodesy::GpsTime time, const auto& measurements, const orbit::Sky& sky,
                             const auto& options, const auto& klobuchar) {
      ++solved;
      return positioning::solve_fix(time, measurements, sky, options, klobuchar);
    };
    return models;
  };
  const auto own = simulated(source), plain = simulated({});
  EXPECT_EQ(made, 1);
  EXPECT_EQ(solved, 4);
  // Its own starts at the Earth's centre, the other at the previous fix.
  for (std::size_t i = 0; i < own.size(); ++i)
    EXPECT_LT((own[i].error_enu_m - plain[i].error_enu_m).norm(), 1e-6);
}

// A model that finds the engine's position reports the engine's accuracy, with and without a filter after it.
TEST(UserModels, ASolversFixStatesItsAccuracyAndIsFiltered) {
  const receiver::ModelSource same = [](std::uint64_t, const std::string&) {
    receiver::UserModels models;
    models.solve = [](geodesy::GpsTime time, const auto& measurements, const orbit::Sky& sky,
                      const auto& options, const auto& klobuchar) {
      const auto own = positioning::solve_fix(time, measurements, sky, options, klobuchar);
      return positioning::fix_at(own.position_ecef, time, measurements, sky, options, klobuchar);
    };
    return models;
  };
  double sigma_m = 0;
  for (const char* filter : {"false", "true"}) {
    const std::string receiver = fmt::format("profile: ublox-m8t, position_filter: {{enabled: {}}}", filter);
    const auto own = simulated(same, receiver), plain = simulated({}, receiver);
    for (std::size_t i = 0; i < own.size(); ++i) {
      const positioning::Fix &a = own[i].observed.fix, &b = plain[i].observed.fix;
      ASSERT_TRUE(a.solved() && b.solved());
      EXPECT_LT((a.position_ecef - b.position_ecef).norm(), 1e-5);
      EXPECT_LT((a.covariance_enu - b.covariance_enu).norm(), 1e-5 * b.covariance_enu.norm());
      EXPECT_LT((*a.velocity_enu_mps - *b.velocity_enu_mps).norm(), 1e-5);
      EXPECT_EQ(a.used, b.used);
      EXPECT_EQ(a.excluded, b.excluded);
    }
    const double last_m = std::sqrt(own.back().observed.fix.covariance_enu.trace());
    EXPECT_NE(last_m, sigma_m);  // the filter uses the previous epochs
    sigma_m = last_m;
  }
}

class TracePoints : public ::testing::Test {
 protected:
  const geodesy::GpsTime noon = geodesy::parse_time("2026-06-01T12:00:00Z");
  std::shared_ptr<CityScene> scene = std::make_shared<CityScene>(city::synthetic_city({}));
  SkyConfig config = [] {
    SkyConfig made;
    made.nominal = true;
    return made;
  }();
  BuiltSky sky = build_sky(config, noon, noon, scene->city.frame.origin());
  Environment environment{scene, sky.sky};
  propagation::Propagator propagator = environment.make_propagator({});
  std::vector<gnss::SatelliteId> satellites = sky.sky->satellites();
  std::vector<Eigen::Vector3d> positions = [] {
    std::vector<Eigen::Vector3d> all;
    all.reserve(40);
    for (int i = 0; i < 40; ++i) all.emplace_back(5.0 * i - 100, 3.0 * i - 60, 2);  // streets, indoors
    return all;
  }();
};

// Point by point, the result of Environment::arrival().
TEST_F(TracePoints, AreArrivals) {
  std::vector<TracedSatellite> rows(positions.size() * satellites.size());
  std::vector<TracedPath> paths;
  TracePointsOptions options;
  options.paths = &paths;
  trace_points(environment, propagator, std::vector{noon}, positions, satellites, rows, options);
  std::size_t received = 0, path = 0, inside = 0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const propagation::Arrival arrival = environment.arrival(noon, positions[i], propagator);
    inside += arrival.containment == raytrace::Containment::InsideBuilding ? 1 : 0;
    std::size_t above = 0;
    for (std::size_t k = 0; k < satellites.size(); ++k) {
      const TracedSatellite& row = rows[i * satellites.size() + k];
      EXPECT_EQ(row.containment, arrival.containment);
      if (!row.above_horizon) continue;
      const propagation::SatelliteView& view = arrival.views.at(above++);
      ASSERT_EQ(view.line.id, satellites[k]);
      EXPECT_EQ(row.visibility, view.paths.visibility);
      EXPECT_EQ(row.elevation_rad, view.line.elevation_rad);
      if (!view.paths.received()) continue;
      ++received;
      EXPECT_EQ(row.excess_m, view.paths.tracked_excess_m());
      for (const propagation::Path& each : view.paths.paths) {
        ASSERT_LT(path, paths.size());
        EXPECT_EQ(paths[path].point_index, i);
        EXPECT_EQ(paths[path].satellite, k);
        EXPECT_EQ(paths[path++].path.excess_m, each.excess_m);
      }
    }
    EXPECT_EQ(above, arrival.views.size());
  }
  EXPECT_EQ(path, paths.size());
  EXPECT_GT(received, 100U);
  EXPECT_GT(inside, 0U);
}

TEST_F(TracePoints, DoNotDependOnThreadsOrOrder) {
  std::vector<TracedSatellite> one(positions.size() * satellites.size()), backwards = one;
  TracePointsOptions options;
  options.threads = 1;
  trace_points(environment, propagator, std::vector{noon}, positions, satellites, one, options);
  const std::vector<gnss::SatelliteId> reversed(satellites.rbegin(), satellites.rend());
  trace_points(environment, propagator, std::vector{noon}, positions, reversed, backwards);
  for (std::size_t i = 0; i < positions.size(); ++i) {
    for (std::size_t k = 0; k < satellites.size(); ++k) {
      const TracedSatellite& a = one[i * satellites.size() + k];
      const TracedSatellite& b = backwards[(i + 1) * satellites.size() - 1 - k];
      EXPECT_EQ(a.visibility, b.visibility);
      EXPECT_EQ(a.paths, b.paths);
    }
  }
}

TEST_F(TracePoints, RefuseWhatDoesNotFit) {
  std::vector<TracedSatellite> rows(positions.size() * satellites.size());
  const std::vector<geodesy::GpsTime> three(3, noon);
  EXPECT_THROW(trace_points(environment, propagator, three, positions, satellites, rows), InputError);
  EXPECT_THROW(trace_points(environment, propagator, std::vector{noon}, positions, satellites, {}),
               InputError);
  positions[7].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(trace_points(environment, propagator, std::vector{noon}, positions, satellites, rows),
               InputError);
}

}  // namespace
}  // namespace canyon::simulation::user_models_test
