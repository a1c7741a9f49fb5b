#include "canyon/analysis/study/study.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "canyon/analysis/study/runner.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "tests/support/documented.hpp"
#include "tests/support/simulation_support.hpp"

namespace canyon::study {
namespace {

using simulation::test::error_of;
using simulation::test::TemporaryFolder;
using ::testing::HasSubstr;

constexpr const char* kScenario = R"(scenario:
  city: {open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17}}
  sky: {nominal: true, systems: [GPS]}
  start: 2026-06-01T08:00:00Z
  duration_s: 3
  trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}
  receivers: [{name: car, profile: ideal}, {name: other, profile: ideal}]
  seed: 5
)";

StudyPlan plan_of(const std::string& rest) {
  return StudyPlan::parse(kScenario + rest, "study.yaml");
}

TEST(Study, ErrorsAlongAWayNeedEpochsAndOneWay) {
  EXPECT_THAT(error_of([] { (void)plan_of("axes: [{seeds: 2}]\nalong_m: 10\n"); }).what(),
              HasSubstr("add keep: epochs"));
  EXPECT_THAT(
      error_of([] { (void)plan_of("axes: [{drives: {count: 2}}]\nalong_m: 10\nkeep: epochs\n"); }).what(),
      HasSubstr("one route for all runs"));
}

// 2 x 3 x 4 values: the number of runs is their product, each combination once, the last axis fastest.
TEST(Study, GridHasEachCombinationOnce) {
  const StudyPlan plan = plan_of(R"(axes:
  - {key: "receivers[].elevation_mask_deg", values: [5, 10]}
  - {key: "receivers[0].profile", values: [ideal, ublox-m8t, survey]}
  - {seeds: 4}
)");
  ASSERT_EQ(plan.size(), 24U);
  std::set<std::vector<std::string>> seen;
  for (std::size_t i = 0; i < plan.size(); ++i) {
    std::vector<std::string> at;
    for (const AxisValue& value : plan.run(i).at) at.push_back(value.text);
    seen.insert(at);
  }
  EXPECT_EQ(seen.size(), 24U);
  EXPECT_EQ(plan.run(1).at[2].text, "2");
  EXPECT_EQ(plan.run(23).at[0].text, "10");
  EXPECT_THAT(plan.receivers(), ::testing::ElementsAre("car", "other"));
}

// A range from 0 to 1 in steps of 0.25 has 5 values; 96 starts in a day are 900 s apart, the last 900 s
// before its end.
TEST(Study, RangesAndTimes) {
  const StudyPlan plan = plan_of(R"(axes:
  - {key: "receivers[].elevation_mask_deg", range: {from: 0, to: 1, step: 0.25}}
)" + std::string());
  EXPECT_EQ(plan.size(), 5U);
  const StudyPlan day = plan_of("axes: [{times: {from: 2026-01-01T00:00:00Z, span_s: 86400, count: 96}}]\n");
  ASSERT_EQ(day.size(), 96U);
  const auto first = day.scenario(day.run(0)).start, second = day.scenario(day.run(1)).start,
             last = day.scenario(day.run(95)).start;
  EXPECT_DOUBLE_EQ(*second - *first, 900);
  EXPECT_DOUBLE_EQ(*last - *first, 86400 - 900);
}

// Samples of unknowns are occasions: settings share them, and a setting's values narrow them.
TEST(Study, DrawsUnknowns) {
  const StudyPlan plan = StudyPlan::parse(R"(scenario:
  city: {synthetic: {}, origin: {latitude_deg: 22.3, longitude_deg: 114.17}}
  sky: {nominal: true, systems: [GPS]}
  start: 2026-06-01T08:00:00Z
  duration_s: 3
  trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}
  receivers: [{profile: ublox-m8t}]
axes:
  - {unknowns: 4}
  - {key: "receivers[0].signal.installation", values: [nominal, roof]}
)",
                                          "study.yaml");
  ASSERT_EQ(plan.size(), 8U);
  EXPECT_FALSE(plan.groups(plan.study().axes[0]));
  std::set<double> levels, skylines;
  for (std::size_t i = 0; i < plan.size(); i += 2) {
    const simulation::Scenario nominal = plan.scenario(plan.run(i)), roof = plan.scenario(plan.run(i + 1));
    EXPECT_EQ(nominal.seed, roof.seed);
    const auto& signal = nominal.receivers[0].options.signal;
    const auto& reported = roof.receivers[0].options.signal;
    EXPECT_EQ(signal.shadowing.skyline.fraction, reported.shadowing.skyline.fraction);
    EXPECT_EQ(nominal.city.facades.fractions, roof.city.facades.fractions);
    EXPECT_NE(signal.link.above_minimum_db, reported.link.above_minimum_db);
    levels.insert(signal.link.above_minimum_db);
    skylines.insert(signal.shadowing.skyline.fraction.value());
  }
  EXPECT_EQ(levels.size(), 4U);
  EXPECT_EQ(skylines.size(), 4U);
  EXPECT_THAT(error_of([] { (void)plan_of("axes: [{unknowns: 2, known: [levl]}]"); }).what(),
              HasSubstr("there is no unknown 'levl'"));
  EXPECT_THAT(
      error_of([] { (void)plan_of("axes: [{unknowns: 2, name: a}, {unknowns: 3, name: b}]"); }).what(),
      HasSubstr("two axes have unknowns"));
}

// In a sample, listed axes are sampled in equal fractions, crossed ones have every value at every point.
TEST(Study, SamplesCrossAxes) {
  const StudyPlan plan = plan_of(R"(axes:
  - {name: mask, key: "receivers[].elevation_mask_deg", range: {from: 5, to: 25}}
  - {name: profile, key: "receivers[0].profile", values: [ideal, survey], crossed: true}
design: latin_hypercube
runs: 10
)");
  ASSERT_EQ(plan.size(), 20U);
  for (std::size_t point = 0; point < 10; ++point) {
    const canyon::study::StudyRun one = plan.run(2 * point), two = plan.run(2 * point + 1);
    EXPECT_EQ(one.at[0].text, two.at[0].text);
    EXPECT_NE(one.at[1].text, two.at[1].text);
    EXPECT_EQ(plan.scenario(one).seed, plan.scenario(two).seed);
    EXPECT_NE(plan.scenario(one).seed, plan.scenario(plan.run((2 * point + 2) % 20)).seed);
  }
}

// Settings share the noise realization of a seed and a time; seeds alone are set in the scenario.
TEST(Study, SettingsShareTheirNoiseRealization) {
  const StudyPlan plan = plan_of(R"(axes:
  - {seeds: 3}
  - {key: "receivers[].elevation_mask_deg", values: [5, 10]}
)");
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(plan.scenario(plan.run(2 * k)).seed, k + 1);
    EXPECT_EQ(plan.scenario(plan.run(2 * k + 1)).seed, k + 1);
  }
  const StudyPlan times = plan_of(R"(axes:
  - {times: {from: 2026-01-01T00:00:00Z, span_s: 86400, count: 2}}
  - {key: "receivers[].elevation_mask_deg", values: [5, 10]}
)");
  EXPECT_EQ(times.scenario(times.run(0)).seed, times.scenario(times.run(1)).seed);
  EXPECT_NE(times.scenario(times.run(0)).seed, times.scenario(times.run(2)).seed);
}

TEST(Study, AxesOverSectionsAndSeveralKeys) {
  const StudyPlan plan = plan_of(R"(axes:
  - name: world
    values:
      - {duration_s: 1, "receivers[0].profile": survey}
      - {city: {synthetic: {}}, duration_s: 2}
    labels: [open, town]
)");
  EXPECT_EQ(plan.scenario(plan.run(0)).duration_s, 1);
  EXPECT_TRUE(plan.scenario(plan.run(0)).city.is<simulation::OpenField>());
  EXPECT_TRUE(plan.scenario(plan.run(1)).city.is<city::SyntheticCityOptions>());
  EXPECT_EQ(plan.run(1).at[0].label, "town");
}

// Each row of N runs has one for every shard.
TEST(Study, NoneIsNoFaultOrTheScenarioAsItIs) {
  const StudyPlan plan = plan_of(R"(axes:
  - {key: faults, values: [none, [{from_s: 1, outage: {satellites: GPS}}]]}
  - {name: world, values: [none, {seed: 7}]}
)");
  for (std::size_t i = 0; i < plan.size(); ++i) {
    EXPECT_EQ(plan.scenario(plan.run(i)).faults.size(), i / 2) << i;
    EXPECT_EQ(plan.scenario(plan.run(i)).seed, i % 2 == 0 ? 5U : 7U) << i;
  }
  EXPECT_EQ(plan.run(0).at[0].label, "none");
  EXPECT_EQ(plan.run(0).at[1].label, "none");
}

TEST(Study, ShardsArePartsOfTheWhole) {
  for (const std::size_t shards : {1U, 2U, 3U, 8U}) {
    for (std::size_t row = 0; row < 20; ++row) {
      std::set<std::size_t> taken;
      for (std::size_t i = 0; i < shards; ++i) taken.insert(shard_of(row * shards + i, shards));
      EXPECT_EQ(taken.size(), shards);
      EXPECT_LT(*taken.rbegin(), shards);
    }
  }
}

TEST(Study, KeyFollowsWhatResultsDependOn) {
  const std::string axes = "axes: [{seeds: 3}]\n";
  EXPECT_EQ(plan_of(axes).key(), plan_of(axes + "city_memory_gb: 1\n").key());
  EXPECT_NE(plan_of(axes).key(), plan_of("axes: [{seeds: 4}]\n").key());
  EXPECT_NE(plan_of(axes).key(), plan_of(axes + "keep: epochs\n").key());
  // A file counts by its contents, not by its path.
  const TemporaryFolder one, two;
  const auto study = [](const TemporaryFolder& folder, const std::string& route) {
    (void)folder.write("way.csv", route);
    return StudyPlan::parse(kScenario + std::string("axes: [{key: trajectory, values: [{file: way.csv}]}]\n"),
                            folder.path() / "study.yaml")
        .key();
  };
  const std::string route = "time,latitude,longitude,height\n0,22.3,114.17,5\n3,22.3001,114.17,5\n";
  EXPECT_EQ(study(one, route), study(two, route));
  EXPECT_NE(study(one, route),
            study(two, "time,latitude,longitude,height\n0,22.3,114.17,5\n3,22.3002,114.17,5\n"));
}

TEST(Study, DocumentationHasTheSameTable) {
  canyon::test::expect_documented("keys.md", "keys of a study", options::markdown(study_description().keys));
}

struct BadStudy {
  std::string rest, problem;
};
class BadStudies : public ::testing::TestWithParam<BadStudy> {};

TEST_P(BadStudies, AreRefused) {
  const InputError error = error_of([&] { (void)plan_of(GetParam().rest); });
  EXPECT_THAT(error.what(), HasSubstr(GetParam().problem));
  EXPECT_THAT(error.file(), HasSubstr("study.yaml"));
}

INSTANTIATE_TEST_SUITE_P(
    All, BadStudies,
    ::testing::Values(
        BadStudy{"", "axes"}, BadStudy{"axes: [{seed: 3}]\n", "seeds"},
        BadStudy{"axes: [{seeds: 0}]\n", "seeds"},
        BadStudy{"axes: [{key: \"receivers[].elevation_mask\", values: [1]}]\n", "elevation_mask_deg"},
        BadStudy{"axes: [{key: \"receivers[].elevation_mask_deg\", values: [1, 200]}]\n", "200"},
        BadStudy{"axes: [{key: \"receivers[2].elevation_mask_deg\", values: [1]}]\n", "no item 2"},
        BadStudy{"axes: [{key: rate_hz, values: [1, 1]}]\n", "twice"},
        BadStudy{"axes: [{key: rate_hz, values: [1], range: {from: 1, to: 2}}]\n", "range"},
        BadStudy{"axes: [{key: rate_hz, range: {from: 1, to: 2}}]\n", "lists no values"},
        BadStudy{"axes: [{key: rate_hz, range: {from: 2, to: 1, count: 3}}]\n", "above from"},
        BadStudy{"axes: [{key: rate_hz, values: [1], labels: [a, b]}]\n", "labels"},
        BadStudy{"axes: [{key: rate_hz, values: [1, 2], labels: [a, a]}]\n", "'a' names two values"},
        BadStudy{"axes: [{seeds: 3}, {seeds: 4}]\n", "two axes"}, BadStudy{"axes: [{values: [1]}]\n", "name"},
        BadStudy{"axes: [{times: {from: yesterday, span_s: 10, count: 2}}]\n", "yesterday"},
        BadStudy{"axes: [{seeds: 3}]\nruns: 4\n", "grid"},
        BadStudy{"axes: [{seeds: 3}]\ndesign: random\n", "runs"},
        BadStudy{"axes: [{seeds: 2000000}]\n", "max_runs"},
        // 1e6 runs of 2 receivers with 1e6 epochs of 64 bytes are 128 TB.
        BadStudy{"axes: [{seeds: 1000000}, {key: duration_s, values: [1000000]}]\nkeep: epochs\n", "GB"}));

// Of two axes that set the same key only the later one would count.
class SameKeys : public ::testing::TestWithParam<BadStudy> {};
TEST_P(SameKeys, AreRefusedWithBothNames) {
  const auto error = error_of([&] { (void)plan_of(GetParam().rest); });
  EXPECT_THAT(error.what(), HasSubstr("axes 'a' and 'b' both set '" + GetParam().problem + "'"));
  EXPECT_GT(error.line(), 0);
}
INSTANTIATE_TEST_SUITE_P(
    All, SameKeys,
    ::testing::Values(
        BadStudy{"axes: [{key: seed, name: a, values: [4, 7]}, {key: seed, name: b, values: [5, 6]}]\n",
                 "seed"},
        BadStudy{"axes: [{name: a, values: [{seed: 4}, {seed: 5}]}, {name: b, seeds: 2}]\n", "seed"},
        BadStudy{"axes: [{key: \"receivers[car].elevation_mask_deg\", name: a, values: [5, 40]}, "
                 "{key: \"receivers[0].elevation_mask_deg\", name: b, values: [15, 20]}]\n",
                 "receivers[0].elevation_mask_deg"},
        BadStudy{"axes: [{key: \"receivers[].elevation_mask_deg\", name: a, values: [5, 40]}, "
                 "{key: \"receivers[other].elevation_mask_deg\", name: b, values: [15, 20]}]\n",
                 "receivers[other].elevation_mask_deg"},
        BadStudy{"axes: [{key: city.synthetic.seed, name: a, values: [5, 6]}, "
                 "{key: city, name: b, values: [{synthetic: {seed: 1}}, {synthetic: {seed: 2}}]}]\n",
                 "city.synthetic.seed"},
        BadStudy{"axes: [{key: city, name: a, values: [{synthetic.seed: 1}, {synthetic: {seed: 2}}]}, "
                 "{key: city.synthetic.seed, name: b, values: [5, 6]}]\n",
                 "city.synthetic.seed"},
        BadStudy{
            "axes: [{key: receivers, name: a, values: [[{name: x, elevation_mask_deg: 3}], [{name: x}]]}, "
            "{key: \"receivers[x].elevation_mask_deg\", name: b, values: [5, 6]}]\n",
            "receivers[x].elevation_mask_deg"},
        BadStudy{"axes: [{key: trajectory.position.east_m, name: a, values: [1, 2]}, "
                 "{name: b, drives: {count: 2}}]\n",
                 "trajectory.position.east_m"}));

TEST(Study, KeysThatDoNotMeetAreNotTheSame) {
  EXPECT_EQ(plan_of(R"(axes:
  - {key: receivers, values: [[{name: x, profile: ideal}], [{name: x, profile: survey}]]}
  - {key: "receivers[].elevation_mask_deg", values: [5, 6]}
  - {key: "receivers[0].noise", values: [{enabled: false}, {enabled: true}]}
)")
                .size(),
            8U);
  EXPECT_EQ(plan_of(R"(axes:
  - {key: "receivers[car].elevation_mask_deg", name: a, values: [5, 6]}
  - {key: "receivers[1].elevation_mask_deg", name: b, values: [5, 6]}
)")
                .size(),
            4U);
}

}  // namespace
}  // namespace canyon::study
