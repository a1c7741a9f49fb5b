#include "adapters/ros2/node_settings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "canyon/base/options/describe.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "tests/support/documented.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::adapters::ros2 {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Key;
using testing::Not;

constexpr const char* kScenario = R"(
city:
  synthetic: {seed: 7}
  origin: {latitude_deg: 22.3, longitude_deg: 114.17}
start: 2026-06-01T08:00:00Z
duration_s: 10
trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}
receivers:
  - {name: first, profile: paper, elevation_mask_deg: 12}
  - {name: second, profile: ideal}
)";

class Settings : public testing::Test {
 protected:
  Settings() { std::ofstream(file_) << kScenario; }

  static std::string fault_of(const Parameters& given) {
    return canyon::test::refusal([&] { (void)read_settings(given); });
  }

  test::TemporaryFolder folder_;
  std::string file_ = (folder_.path() / "drive.yaml").string();
};

TEST_F(Settings, AFileAloneIsTheScenarioOfItsFirstReceiver) {
  const NodeSettings settings = read_settings({{"scenario", file_}});
  const simulation::Scenario alone = simulation::read_scenario(file_);
  EXPECT_EQ(options::exact_text(settings.live.sky), options::exact_text(alone.sky));
  ASSERT_EQ(settings.live.receivers.size(), 1U);
  EXPECT_EQ(options::exact_text(settings.live.receivers[0]), options::exact_text(alone.receivers[0]));
  EXPECT_TRUE(settings.named);
}

TEST_F(Settings, ReceiverChoosesAndOthersGo) {
  const NodeSettings settings = read_settings({{"scenario", file_}, {"receiver", "second"}});
  ASSERT_EQ(settings.live.receivers.size(), 1U);
  EXPECT_EQ(settings.live.receivers[0].options.name, "second");
  EXPECT_THAT(fault_of({{"scenario", file_}, {"receiver", "third"}}), HasSubstr("it has first, second"));
}

// A receiver that uses corrections keeps its base, from the file or from a parameter.
TEST_F(Settings, ABaseStaysBesideItsReceiver) {
  std::ofstream(file_)
      << kScenario
      << R"(  - {name: base, profile: survey, independent_noise: true, fixed: {east_m: 1, north_m: 2, up_m: 99}}
faults:
  - {receivers: [base, second], outage: {}}
  - {receivers: [second], outage: {}}
)";
  const Parameters given{{"scenario", file_}, {"corrections.from", "base"}};
  const NodeSettings settings = read_settings(given);
  ASSERT_EQ(settings.live.receivers.size(), 2U);
  EXPECT_EQ(settings.live.receivers[0].options.name, "first");
  ASSERT_EQ(settings.live.faults.size(), 1U);
  EXPECT_EQ(settings.live.faults[0].receivers, std::vector<std::string>{"base"});
  const simulation::RunnerConfig live = driven_config(settings, "/first");
  ASSERT_NE(live.base(), nullptr);
  EXPECT_EQ(live.base()->options.name, "base");
  EXPECT_EQ(std::get<double>(parameters_of(settings).at("elevation_mask_deg")), 12);
  EXPECT_EQ(driven_config(read_settings({{"scenario", file_}}), "/first").base(), nullptr);
  EXPECT_THAT(fault_of({{"scenario", file_}, {"corrections.from", "bass"}}),
              AllOf(HasSubstr("parameter 'corrections.from'"), HasSubstr("'bass'")));
  EXPECT_THAT(fault_of({{"scenario", file_}, {"corrections.from", "ntrip://127.0.0.1:2101/BASE"}}),
              AllOf(HasSubstr("parameter 'corrections.from'"), HasSubstr("is a stream")));
}

TEST_F(Settings, CorrectionsComeByATopic) {
  const NodeSettings settings = read_settings({{"scenario", file_}, {"corrections.from", "topic:rtcm"}});
  EXPECT_EQ(settings.corrections_topic(), "rtcm");
  EXPECT_EQ(simulated_world(settings).receivers.front().options.corrections.from, "");
  EXPECT_EQ(driven_config(settings, "/first").receiver().options.corrections.from, "topic:rtcm");
  EXPECT_EQ(read_settings({{"scenario", file_}}).corrections_topic(), "");
  EXPECT_EQ(NodeSettings{}.corrections_topic(), "");  // before a node is configured
  EXPECT_THAT(fault_of({{"scenario", file_}, {"corrections.from", "topic:rt cm"}}),
              AllOf(HasSubstr("parameter 'corrections.from'"), HasSubstr("does not name a topic")));
  EXPECT_THAT(fault_of({{"scenario", file_}, {"streams", std::vector<std::string>{"nmea=topic:nmea"}}}),
              AllOf(HasSubstr("parameter 'streams'"), HasSubstr("carries only RTCM 3")));
}

TEST_F(Settings, AFixedReceiverNeedsNoPoses) {
  const Parameters base{{"city.open", true},
                        {"city.origin.latitude_deg", 22.3},
                        {"city.origin.longitude_deg", 114.17},
                        {"pose.source", "fixed"},
                        {"fixed.east_m", 1.0},
                        {"fixed.north_m", 2.0},
                        {"fixed.up_m", 3.0}};
  EXPECT_TRUE(read_settings(base).is_pose_driven());
  EXPECT_TRUE(read_settings(base).live.sky.errors.enabled);  // as those of its rovers
  Parameters moved = base;
  moved["pose.source"] = "pose";
  EXPECT_THAT(fault_of(moved), AllOf(HasSubstr("parameter 'pose.source'"), HasSubstr("pose.source: fixed")));
  EXPECT_THAT(fault_of({{"scenario", file_}, {"pose.source", "fixed"}}),
              AllOf(HasSubstr("parameter 'pose.source'"), HasSubstr("no fixed position")));
}

TEST_F(Settings, ParametersStandOverTheFile) {
  const NodeSettings settings = read_settings({{"scenario", file_},
                                               {"elevation_mask_deg", 5.0},
                                               {"noise.enabled", false},
                                               {"seed", std::int64_t{42}},
                                               {"start", "2026-06-01T09:00:00Z"},
                                               {"sky.systems", std::vector<std::string>{"GPS", "Galileo"}},
                                               {"max_pdop", "none"},
                                               {"profile", ""}});
  EXPECT_NEAR(settings.live.receivers[0].options.fix.elevation_mask_rad, 5 * M_PI / 180, 1e-15);
  EXPECT_FALSE(settings.live.receivers[0].options.noise.enabled);
  EXPECT_EQ(settings.live.seed, 42U);
  EXPECT_EQ(settings.live.sky.systems.size(), 2U);
  EXPECT_EQ(*settings.live.start - *read_settings({{"scenario", file_}}).live.start, 3600);
}

TEST_F(Settings, NoFileIsNeeded) {
  const NodeSettings settings = read_settings({{"city.open", true},
                                               {"city.origin.latitude_deg", 22.3},
                                               {"city.origin.longitude_deg", 114.17},
                                               {"pose.source", "odometry"}});
  EXPECT_TRUE(settings.is_pose_driven());
  EXPECT_FALSE(settings.named);
  EXPECT_TRUE(settings.live.city.is<simulation::OpenField>());
  const simulation::RunnerConfig live = driven_config(settings, "/car/receiver");
  EXPECT_EQ(live.receiver().options.name, "/car/receiver");
  EXPECT_TRUE(live.receiver().options.independent_noise);
}

// The engine's messages, with the parameter's name.
TEST_F(Settings, FaultsNameTheParameterOrTheLine) {
  EXPECT_THAT(fault_of({{"scenario", file_}, {"elevation_mask_deg", 95.0}}),
              AllOf(HasSubstr("parameter 'elevation_mask_deg'"), HasSubstr("95"),
                    HasSubstr("at least 0 and below 90")));
  EXPECT_THAT(fault_of({{"scenario", file_}, {"pose.source", "gps"}}), HasSubstr("parameter 'pose.source'"));
  EXPECT_THAT(fault_of({{"scenario", file_}, {"elevation_mask", 9.0}}),
              HasSubstr("did you mean 'elevation_mask_deg'?"));
  EXPECT_THAT(fault_of({{"scenario", file_}, {"streams", std::vector<std::string>{"wav=tcp://1:2"}}}),
              HasSubstr("parameter 'streams'"));
  EXPECT_THAT(fault_of({{"scenario", file_}, {"drive_clock", true}, {"pose.source", "pose"}}),
              HasSubstr("drive_clock"));
  EXPECT_THAT(fault_of({{"scenario", (folder_.path() / "none.yaml").string()}}), HasSubstr("none.yaml"));
  EXPECT_THAT(fault_of({}), HasSubstr("city"));
  std::ofstream(file_) << "city: {synthetic: {}}\ntrajectory: {speed: 3}\n";
  EXPECT_THAT(fault_of({{"scenario", file_}}), HasSubstr(file_ + ":2"));
}

TEST_F(Settings, ParametersReadBackTheSame) {
  const NodeSettings settings = read_settings({{"scenario", file_}, {"pose.heading_deg", 30.0}});
  Parameters shown = parameters_of(settings);
  EXPECT_EQ(std::get<double>(shown.at("elevation_mask_deg")), 12);
  EXPECT_EQ(std::get<double>(shown.at("pose.heading_deg")), 30);
  EXPECT_EQ(std::get<std::int64_t>(shown.at("seed")), 1);
  EXPECT_EQ(std::get<std::string>(shown.at("pose.source")), "trajectory");
  EXPECT_THAT(shown, Not(Contains(Key("profile"))));
  // Set one by one as parameters, they equal the file's values.
  for (const auto& [name, value] : shown) {
    // The file has other values of these.
    if (name.rfind("trajectory.", 0) == 0 || name.rfind("city.", 0) == 0) continue;
    const NodeSettings again =
        read_settings({{"scenario", file_}, {"pose.heading_deg", 30.0}, {name, value}});
    EXPECT_EQ(options::yaml(again), options::yaml(settings)) << name;
  }
}

TEST_F(Settings, EveryKeyOfTheScenarioIsAParameterOrTheFilesOwn) {
  std::set<std::string> names;
  for (const options::Key& key : parameter_keys()) {
    EXPECT_TRUE(names.insert(key.path).second) << key.path;
    EXPECT_EQ(find_parameter(key.path), &key);
    EXPECT_FALSE(key.meaning.empty()) << key.path;
  }
  std::vector<std::string> missing;
  for (std::string path : simulation::scenario_description().paths()) {
    if (path.rfind("receivers[].", 0) == 0) path.erase(0, 12);
    if (!names.contains(path) && path.rfind("outputs", 0) != 0) missing.push_back(path);
  }
  EXPECT_THAT(missing,
              testing::Each(testing::AnyOf(HasSubstr("[]"), HasSubstr("_rows"), HasSubstr("windows"))));
  EXPECT_TRUE(is_receivers("elevation_mask_deg") && is_receivers("clock.bias_s"));
  EXPECT_FALSE(is_receivers("seed") || is_receivers("city.open") || is_receivers("pose.source"));
}

TEST(NodeKeys, DocumentationHasTheSameTable) {
  test::expect_documented("keys.md", "parameters of the node of ROS 2", options::markdown(node_keys()));
}

}  // namespace
}  // namespace canyon::adapters::ros2
