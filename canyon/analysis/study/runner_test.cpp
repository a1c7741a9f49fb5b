#include "canyon/analysis/study/runner.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <numeric>

#include "canyon/analysis/study/along.hpp"
#include "canyon/analysis/study/compare.hpp"
#include "canyon/analysis/study/netcdf.hpp"
#include "canyon/analysis/study/pictures.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/osm_text.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/simulation_support.hpp"

namespace canyon::study {
namespace {

using simulation::test::error_of;
using simulation::test::TemporaryFolder;
using ::testing::HasSubstr;

constexpr const char* kStudy = R"(scenario:
  city: {synthetic: {blocks_east: 2, blocks_north: 2}, origin: {latitude_deg: 22.3, longitude_deg: 114.17}}
  sky: {nominal: true, systems: [GPS]}
  start: 2026-06-01T08:00:00Z
  duration_s: 4
  trajectory: {position: {east_m: 0, north_m: 10}, height_above_terrain_m: 2}
  receivers: [{name: car}, {name: plain, profile: ideal}]
axes:
  - {seeds: 3}
  - {key: "receivers[].elevation_mask_deg", values: [5, 20]}
keep: epochs
)";

constexpr int kTellFile = 9;

StudyPlan make_plan() {
  return StudyPlan::parse(kStudy, "study.yaml");
}

std::vector<std::size_t> numbers(std::size_t n) {
  std::vector<std::size_t> all(n);
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

/// Runs the missing runs, writes the results and returns their bytes.
std::string finish(const StudyPlan& plan, const std::filesystem::path& folder, int threads) {
  const Manifest manifest = manifest_of(plan);
  {
    RunStore store(folder, manifest);
    std::vector<std::size_t> todo;
    const auto there = read_records(folder, plan.size());
    for (const std::size_t i : numbers(plan.size())) {
      if (!there[i]) todo.push_back(i);
    }
    run_all(RunMaker(plan), store, todo, {threads, nullptr, {}, {}});
  }
  auto records = read_records(folder, plan.size());
  write_study_netcdf(folder / "study.nc", manifest, records, folder);
  return test::read_bytes(folder / "study.nc") + comparison_csv(compare(manifest, records));
}

// The metrics are those of `canyon simulate` with the run's scenario.
TEST(StudyRuns, HaveTheFiguresOfASimulation) {
  const StudyPlan plan = make_plan();
  const RunMaker maker(plan);
  const auto record = maker.make(3, 1);
  ASSERT_TRUE(record);
  EXPECT_EQ(record->problem, "");
  const simulation::Scenario scenario =
      simulation::parse_scenario(simulation::scenario_yaml(maker.scenario(3)), "run.yaml");
  const simulation::Simulation simulation(scenario, simulation::load_city(scenario));
  encoding::SummarySink sink({"car", "plain"});
  (void)simulation.run({&sink});
  const auto summaries = sink.summaries();
  for (std::size_t r = 0; r < 2; ++r) {
    for (std::size_t k = 0; k < metrics().size(); ++k) {
      const double expected = metrics()[k]->value(summaries[r]), value = record->receivers[r].metrics[k];
      EXPECT_TRUE(expected == value || (std::isnan(expected) && std::isnan(value))) << metrics()[k]->kept;
    }
  }
}

// The map is read once for all runs: its caution appears once, also for runs of another process.
TEST(StudyRuns, KeepTheCautionsOfTheirCities) {
  const TemporaryFolder folder;
  test::OsmText()
      .node(1, 114.17, 22.3)
      .node(2, 114.1702, 22.3)
      .node(3, 114.1702, 22.3002)
      .osm_way(1, {1, 2, 3, 1}, {{"building", "yes"}})
      .write(folder / "map.osm");
  std::string text = kStudy;
  const auto from = text.find("{synthetic"), to = text.find('\n', from);
  text.replace(from, to - from, "{osm: map.osm}");
  const StudyPlan plan = StudyPlan::parse(text, folder / "study.yaml");
  for (const std::vector<std::size_t>& runs : {std::vector<std::size_t>{0, 2}, {2, 1}, {4}}) {
    RunStore store(folder / "out", manifest_of(plan));
    run_all(RunMaker(plan), store, runs, {1, nullptr, {}, {}});
    const auto records = read_records(folder / "out", plan.size());
    EXPECT_THAT(report_of(records).warnings(),
                ::testing::ElementsAre(HasSubstr("1 of 1 heights are guesses")));
    EXPECT_EQ(records[2]->notes.size(), runs.front() == 0 ? 0U : 1U) << "once a process";
  }
}

/// Fraction of the directions 15 deg above the horizon that is hidden along a drive.
double hidden_fraction(const simulation::CityScene& scene, const simulation::TrajectoryConfig& trajectory) {
  constexpr double kUp_rad = geodesy::kPi / 12;
  int hidden = 0, all = 0;
  for (std::size_t i = 1; i < trajectory.waypoints.size(); ++i) {
    const Eigen::Vector3d from = scene.city.frame.local_from_geodetic(trajectory.waypoints[i - 1]);
    const Eigen::Vector3d leg = scene.city.frame.local_from_geodetic(trajectory.waypoints[i]) - from;
    for (double m = 2; m < leg.norm(); m += 5) {
      for (int azimuth = 0; azimuth < 12; ++azimuth, ++all) {
        const double at = azimuth * geodesy::kPi / 6;
        const Eigen::Vector3d to(std::cos(kUp_rad) * std::cos(at), std::cos(kUp_rad) * std::sin(at),
                                 std::sin(kUp_rad));
        hidden += scene.scene.occluded({from + m / leg.norm() * leg, to}) ? 1 : 0;
      }
    }
  }
  return static_cast<double>(hidden) / all;
}

/// Number of 20 drives whose hidden_fraction() is above `fraction`.
int among_houses(const simulation::CityScene& scene, const DriveOptions& options, std::uint64_t seed,
                 double fraction = 0.5) {
  int count = 0;
  for (int i = 0; i < 20; ++i) {
    const auto route = random_drive(scene, options, seed, std::to_string(i));
    double length_m = 0;
    for (std::size_t k = 1; k < route.waypoints.size(); ++k)
      length_m += (geodesy::ecef_from_geodetic(route.waypoints[k]) -
                   geodesy::ecef_from_geodetic(route.waypoints[k - 1]))
                      .norm();
    EXPECT_NEAR(length_m, options.length_m, 0.5);
    count += hidden_fraction(scene, route) > fraction ? 1 : 0;
  }
  return count;
}

constexpr DriveOptions kDrive{20, 400};

// The fractions of satellites without direct view were 5 % for drives anywhere, and 55 % for those between
// houses (17 of 20 were in the surrounding fields).
TEST(StudyDrives, OfTheExampleAreAmongHouses) {
  const auto plan =
      StudyPlan::read(std::filesystem::path(canyon_source_dir) / "examples/studies/receivers.yaml");
  const RunMaker maker(plan);
  int among = 0;
  double sum = 0;
  for (std::size_t drive = 0; drive < 20; ++drive) {
    simulation::Scenario scenario = maker.scenario(4 * drive);
    scenario.receivers.resize(1);
    encoding::SummarySink sink({"module"});
    (void)simulation::Simulation(scenario, simulation::load_city(scenario)).run({&sink});
    const double fraction = sink.summaries().front().nlos_fraction;
    among += fraction > 0.25 ? 1 : 0;
    sum += fraction;
  }
  EXPECT_GE(among, 18);
  EXPECT_GT(sum / 20, 0.4);
}

TEST(StudyDrives, OfOtherSeedsAndCitiesAreAmongHouses) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    city::SyntheticCityOptions options;
    options.seed = seed;
    options.street_width_m = 8 + 8 * static_cast<double>(seed);
    EXPECT_GE(among_houses(simulation::CityScene(city::synthetic_city(options)), kDrive, seed), 18) << seed;
  }
}

// Streets of Ostankino are wide, and its houses are low.
class StudyDrivesOfMaps : public ::testing::TestWithParam<std::tuple<const char*, const char*, double>> {};
TEST_P(StudyDrivesOfMaps, AreAmongHouses) {
  const auto& [name, city, fraction] = GetParam();
  CANYON_SHARED_DATA(file, name);
  const simulation::Scenario scenario = simulation::parse_scenario(
      fmt::format("city: {{{}: {}}}\nsky: {{nominal: true}}\nstart: 2026-06-01T00:00:00Z\n"
                  "trajectory: {{position: {{east_m: 0, north_m: 0, up_m: 9}}}}\n",
                  city, file.string()),
      "city.yaml");
  EXPECT_GE(among_houses(simulation::CityScene(simulation::load_city(scenario)), kDrive, 1, fraction), 18);
}
INSTANTIATE_TEST_SUITE_P(
    Real, StudyDrivesOfMaps,
    ::testing::Values(std::tuple("osm/moscow.osm.gz", "osm", 0.2),
                      std::tuple("hongkong/buildings.dae",
                                 "origin: {latitude_deg: 22.298251, longitude_deg: 114.178761}, mesh", 0.5)));

TEST(StudyDrives, NeedStreets) {
  city::SyntheticCityOptions one;
  one.blocks_east = one.blocks_north = 1;
  const simulation::CityScene scene(city::synthetic_city(one));
  const auto error = error_of([&] { (void)random_drive(scene, kDrive, 1, "0"); });
  EXPECT_THAT(error.what(), HasSubstr("no drive of 400 m"));
  EXPECT_THAT(error.what(), HasSubstr("houses within 40 m on both sides"));
}

TEST(StudyRuns, RecordsReadBack) {
  const auto record = RunMaker(make_plan()).make(0, 1);
  ASSERT_TRUE(record);
  EXPECT_EQ(to_line(from_line(to_line(*record))), to_line(*record));
  EXPECT_THAT(error_of([] { (void)from_line("{\"run\": 1}"); }).what(), HasSubstr("is not a record"));
}

TEST(StudyRuns, BytesDoNotDependOnThreadsOrShards) {
  const StudyPlan plan = make_plan();
  const TemporaryFolder one, two, shards;
  const std::string expected = finish(plan, one.path() / "out", 1);
  EXPECT_GT(expected.size(), 1000U);
  EXPECT_EQ(finish(plan, two.path() / "out", 3), expected);
  for (const std::size_t shard : {1U, 0U}) {
    RunStore store(shards.path() / "out", manifest_of(plan));
    std::vector<std::size_t> todo;
    for (const std::size_t i : numbers(plan.size())) {
      if (shard_of(i, 2) == shard) todo.push_back(i);
    }
    EXPECT_EQ(todo.size(), plan.size() / 2);
    run_all(RunMaker(plan), store, todo, {1, nullptr, {}, {}});
  }
  EXPECT_EQ(finish(plan, shards.path() / "out", 1), expected);
}

// The process that the next test kills: it prints each finished run, and waits after the second. A separate
// program, since threads do not survive a fork.
TEST(StudyRuns, DISABLED_Child) {
  const StudyPlan plan = make_plan();
  const char* folder = std::getenv("CANYON_STUDY_FOLDER");
  ASSERT_NE(folder, nullptr);
  RunStore store(folder, manifest_of(plan));
  RunnerOptions options;
  options.threads = 1;
  options.progress = [&](std::size_t done) {
    const char one = 'x';
    if (write(kTellFile, &one, 1) != 1 || done == 2) pause();
  };
  run_all(RunMaker(plan), store, numbers(plan.size()), options);
}

// A process that is killed during a study loses no finished run, and continuing gives the same bytes.
TEST(StudyRuns, KilledProcessLosesNothingFinished) {
  const StudyPlan plan = make_plan();
  const TemporaryFolder whole, cut;
  const std::string expected = finish(plan, whole.path() / "out", 1);
  const auto folder = cut.path() / "out";
  std::array<int, 2> finished{};
  ASSERT_EQ(pipe(finished.data()), 0);
  const std::string variable = "CANYON_STUDY_FOLDER=" + folder.string();
  const pid_t child = fork();
  if (child == 0) {
    dup2(finished[1], kTellFile);
    std::array<char*, 2> environment{const_cast<char*>(variable.c_str()), nullptr};
    execle("/proc/self/exe", "test_study", "--gtest_filter=StudyRuns.DISABLED_Child",
           "--gtest_also_run_disabled_tests", nullptr, environment.data());
    _exit(1);
  }
  close(finished[1]);
  char one = 0;
  for (int i = 0; i < 2; ++i) ASSERT_EQ(read(finished[0], &one, 1), 1);
  kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status));
  close(finished[0]);
  // Half a line, as left by a process that dies while writing.
  for (const auto& entry : std::filesystem::directory_iterator(folder / "runs")) {
    if (entry.path().extension() == ".jsonl")
      std::ofstream(entry.path(), std::ios::app) << "00000000 {\"run\": 4";
  }
  const auto kept = read_records(folder, plan.size());
  EXPECT_EQ(std::count_if(kept.begin(), kept.end(), [](const auto& record) { return record.has_value(); }),
            2);
  EXPECT_EQ(finish(plan, folder, 2), expected);
}

TEST(StudyStore, RefusesOtherStudiesAndDamage) {
  const StudyPlan plan = make_plan();
  const TemporaryFolder folder;
  const auto out = folder.path() / "out";
  RunStore store(out, manifest_of(plan));
  Manifest other = manifest_of(plan);
  other.key += "x";
  EXPECT_THAT(error_of([&] { const RunStore wrong(out, other); }).what(), HasSubstr("another study"));
  EXPECT_THAT(error_of([&] { (void)read_manifest(folder.path()); }).what(), HasSubstr("contains no study"));
  run_all(RunMaker(plan), store, {0, 1}, {1, nullptr, {}, {}});
  for (const auto& entry : std::filesystem::directory_iterator(out / "runs")) {
    if (entry.path().extension() != ".jsonl") continue;
    std::string text = test::read_bytes(entry.path());
    text[text.find("figures")] = 'F';
    std::ofstream(entry.path(), std::ios::binary) << text;
  }
  const InputError error = error_of([&] { (void)read_records(out, plan.size()); });
  EXPECT_THAT(error.what(), HasSubstr("damaged"));
  EXPECT_EQ(error.line(), 1);
}

// An invalid scenario is reported in its record; the others continue.
TEST(StudyRuns, ProblemsStayWithTheirRuns) {
  const StudyPlan plan = StudyPlan::parse(R"(scenario:
  city: {open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17}}
  sky: {nominal: true}
  start: 2026-06-01T08:00:00Z
  duration_s: 1
  trajectory: {position: {east_m: 3000, north_m: 0, up_m: 2}}
axes:
  - {key: trajectory.height_above_terrain_m, values: [1]}
  - {key: city, values: [{synthetic: {}, origin: {latitude_deg: 22.3, longitude_deg: 114.17}}, {open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17}}]}
)",
                                          "study.yaml");
  const RunMaker maker(plan);
  EXPECT_THAT(maker.make(0, 1)->problem, HasSubstr("no terrain"));
  EXPECT_EQ(maker.make(1, 1)->problem, "");
}

RunRecord made_up(std::size_t number, const std::string& seed, const std::string& mask, double p95_m) {
  RunRecord record;
  record.number = number;
  record.at = {seed, mask};
  ReceiverRecord receiver;
  receiver.name = "car";
  receiver.metrics.assign(metrics().size(), 1);
  receiver.metrics[metric("horizontal_error_p95")] = p95_m;
  receiver.epochs[3] = 10;
  receiver.available[3] = 5;
  record.receivers.push_back(receiver);
  return record;
}

// Closed form: values 1..n and the same plus 2. The difference is 2 under every resample, so its interval is
// [2, 2]; the mean's is about 1.96 standard errors wide at each side.
TEST(StudyComparison, PairsUnderTheSameLuck) {
  constexpr int kN = 400;
  Manifest manifest;
  manifest.axes = {{"seed", "seed", Manifest::Coordinate::Kind::Number, false, {}, {}},
                   {"mask", "mask", Manifest::Coordinate::Kind::Number, true, {}, {}}};
  manifest.receivers = {"car"};
  manifest.bootstrap = 4000;
  std::vector<std::optional<RunRecord>> records;
  for (int i = 0; i < kN; ++i) {
    for (const bool high : {false, true}) {
      records.push_back(
          made_up(records.size(), std::to_string(i), high ? "10" : "5", i + 1 + (high ? 2 : 0)));
    }
  }
  const GroupComparison comparison = compare(manifest, records);
  ASSERT_EQ(comparison.groups.size(), 2U);
  const MeanEstimate mean = *comparison.groups[0].estimates[2],
                     difference = *comparison.groups[1].differences[2];
  EXPECT_DOUBLE_EQ(mean.mean, (kN + 1) / 2.0);
  const double standard_error = std::sqrt((kN * kN - 1) / 12.0 / kN);
  EXPECT_NEAR(mean.high - mean.low, 2 * 1.96 * standard_error, 0.1 * 2 * 1.96 * standard_error);
  EXPECT_NEAR(difference.low, 2, 1e-9);
  EXPECT_NEAR(difference.high, 2, 1e-9);
  EXPECT_DOUBLE_EQ(comparison.groups[0].estimates[0]->mean, 50);
  EXPECT_THAT(comparison_csv(comparison), HasSubstr("10,car,400,horizontal_error_p95,m,202.5,"));
  const TemporaryFolder folder;
  EXPECT_EQ(write_study_pictures(folder.path(), manifest, comparison).size(), 6U);
}

// Closed form: run i of 20 has an error of i + 1 metres on the first ten metres and 100 more on the next,
// where every other epoch has no fix. Median and 95 % by definition 7: ranks 9.5 and 18.05. The interval of
// the median contains it, and is within the runs.
TEST(StudyAlong, StretchesHaveTheErrorsOfAllRuns) {
  Manifest manifest;
  manifest.key = "k";
  manifest.runs = 20;
  manifest.axes = {{"seed", "seed", Manifest::Coordinate::Kind::Number, false, {}, {}}};
  manifest.receivers = {"car"};
  manifest.epochs = true;
  manifest.along_m = 10;
  const TemporaryFolder folder;
  {
    RunStore store(folder.path() / "s", manifest);
    for (std::size_t i = 0; i < manifest.runs; ++i) {
      RunRecord record = made_up(i, std::to_string(i), "", 1);
      record.at.resize(1);
      for (int epoch = 0; epoch < 4; ++epoch) {
        StoredEpochs& kept = record.receivers.front().kept;
        kept.columns.resize(stored_columns().size());
        kept.time_s.push_back(epoch);
        kept.travelled_m.push_back(5.0F * static_cast<float>(epoch));
        for (std::vector<float>& column : kept.columns) column.push_back(0);
        kept.columns[kept_column("error_north")].back() =
            epoch == 3 ? NAN : static_cast<float>(i + 1) + (epoch >= 2 ? 100.0F : 0.0F);
      }
      store.add(record);
    }
  }
  EXPECT_EQ(read_manifest(folder.path() / "s").along_m, 10);
  auto records = read_records(folder.path() / "s", manifest.runs);
  const GroupComparison comparison = compare(manifest, records);
  const auto along = errors_along(manifest, comparison, records, folder.path() / "s");
  ASSERT_EQ(along.size(), 1U);
  ASSERT_EQ(along[0].size(), 2U);
  for (const int k : {0, 1}) {
    const Stretch& stretch = along[0][static_cast<std::size_t>(k)];
    EXPECT_EQ(stretch.epochs, 40U);
    EXPECT_DOUBLE_EQ(stretch.available, k == 0 ? 1 : 0.5);
    // The first segment has each error twice: ranks 19.5 and 37.05 of 40 are between the same two.
    EXPECT_NEAR(stretch.median->mean, 10.5 + 100 * k, 1e-5);
    EXPECT_NEAR(stretch.p95->mean, 19.05 + 100 * k, 1e-5);
    EXPECT_LT(stretch.median->low, stretch.median->mean);
    EXPECT_GT(stretch.median->high, stretch.median->mean);
    EXPECT_GE(stretch.median->low, 1 + 100 * k);
    EXPECT_LE(stretch.p95->high, 20 + 100 * k);
  }
  EXPECT_THAT(along_csv(comparison, along), HasSubstr("\ncar,10,20,40,0.5,110.5,"));
  EXPECT_EQ(write_along_pictures(folder.path(), manifest, comparison, along).size(), 2U);
}

TEST(StudyRecords, ErrorBinsHoldTheirEdges) {
  for (const std::size_t bin : {0U, 1U, 60U, 159U}) {
    EXPECT_EQ(error_bin(error_edge_m(bin) * 1.0001), bin);
    EXPECT_EQ(error_bin(error_edge_m(bin + 1) * 0.9999), bin);
  }
  EXPECT_EQ(error_bin(0), 0U);
  EXPECT_EQ(error_bin(1e9), kErrorBins - 1);
}

}  // namespace
}  // namespace canyon::study
