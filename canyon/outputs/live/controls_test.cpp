#include "canyon/outputs/live/controls.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <future>
#include <thread>

#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::live::controls_test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;
using Kind = OptionsRequest::Kind;

simulation::ReceiverRunner receiver(const std::string& more = "") {
  const auto config = simulation::parse_live_config(
      "sky: {nominal: true, systems: [GPS]}\nstart: 2026-06-01T08:00:00Z\nprofile: "
      "ideal\nelevation_mask_deg: 5\n" +
          more,
      "test");
  return {config, std::make_shared<simulation::CityScene>(city::City{}), *config.start};
}

// Requests for options arrive over ports and services, not from the author of the scenario.
TEST(RunningOptions, ShowNoPasswordAndAreTakenBack) {
  simulation::RunnerConfig config = receiver().config();
  for (const char* from : {"ntrip://me:SECRET@h:1/M", "ntrip://me@example.com:SECRET@h:1/M"}) {
    config.receiver().options.corrections.from = from;
    const std::string text = simulation::running_options(config);
    EXPECT_THAT(text, AllOf(Not(HasSubstr("SECRET")), Not(HasSubstr("example"))));
    EXPECT_EQ(simulation::changed_live_config(config, text, "").receiver().options.corrections.from, from);
  }
}

TEST(RunningOptions, ARequestNamesNoFileButProfilesBesideTheScenario) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directory(folder / "sub");
  for (const char* file : {"mine.yaml", "sub/other.yaml"}) {
    std::ofstream(folder / file) << "description: mine\nelevation_mask_deg: 33\n";
  }
  std::filesystem::create_symlink(folder / "sub/other.yaml", folder / "link.yaml");
  const auto options_with = [&](const std::string& profile, const std::filesystem::path& name) {
    return simulation::running_options(
        simulation::changed_live_config(receiver().config(), "profile: " + profile, name));
  };
  const std::filesystem::path scenario = folder / "scenario.yaml";
  EXPECT_THAT(options_with("mine.yaml", scenario), HasSubstr("elevation_mask_deg: 33"));
  EXPECT_THAT(options_with("./mine.yaml", scenario), HasSubstr("elevation_mask_deg: 33"));
  EXPECT_NO_THROW((void)options_with("survey", scenario));
  EXPECT_NO_THROW((void)options_with("survey", "request"));
  for (const std::string& profile :
       {std::string("/etc/passwd"), (folder / "mine.yaml").string(), std::string("sub/other.yaml"),
        std::string("link.yaml"), std::string("sub/../../x.yaml"), std::string("none.yaml")}) {
    EXPECT_THROW((void)options_with(profile, scenario), InputError) << profile;
  }
  EXPECT_THROW((void)options_with("mine.yaml", "request"), InputError);
}

class OptionsDeskTest : public testing::Test {
 protected:
  std::string submit(Kind kind, const std::string& name, const std::string& text) {
    return handle_request({kind, name, text}, both_);
  }
  simulation::ReceiverRunner car_ = receiver(), drone_ = receiver();
  int changed_ = 0;
  std::vector<ReceiverHandle> both_{{"car", &car_, [this] { ++changed_; }}, {"drone", &drone_}};
};

TEST_F(OptionsDeskTest, GetsAKeyASectionOrEverything) {
  EXPECT_EQ(submit(Kind::Get, "car", "elevation_mask_deg"), "elevation_mask_deg: 5");
  EXPECT_EQ(submit(Kind::Get, "", " elevation_mask_deg "),
            "car:\n  elevation_mask_deg: 5\ndrone:\n  elevation_mask_deg: 5");
  EXPECT_THAT(submit(Kind::Get, "drone", "clock"),
              AllOf(HasSubstr("clock.bias_s: 0"), Not(HasSubstr("elevation"))));
  EXPECT_THAT(submit(Kind::Get, "drone", ""),
              AllOf(HasSubstr("clock.bias_s: 0"), HasSubstr("elevation_mask_deg: 5")));
  EXPECT_THAT(submit(Kind::Get, "car", "elevation_mask"),
              AllOf(StartsWith("refused: "), HasSubstr("did you mean 'elevation_mask_deg'?")));
  EXPECT_THAT(submit(Kind::Get, "boat", ""), AllOf(StartsWith("refused: "), HasSubstr("car, drone")));
  EXPECT_THAT(handle_request({Kind::Get, "", ""}, {}), HasSubstr("there is no receiver"));
}

TEST_F(OptionsDeskTest, SetsWhatItIsToldAndSaysWhatChanged) {
  EXPECT_EQ(submit(Kind::Set, "car", "elevation_mask_deg: 25"), "set car: elevation_mask_deg: 5 -> 25");
  EXPECT_EQ(changed_, 1);
  EXPECT_EQ(submit(Kind::Get, "", "elevation_mask_deg"),
            "car:\n  elevation_mask_deg: 25\ndrone:\n  elevation_mask_deg: 5");
  EXPECT_EQ(submit(Kind::Set, "", "elevation_mask_deg: 25"), "set drone: elevation_mask_deg: 5 -> 25");
  EXPECT_THAT(submit(Kind::Set, "", "{clock: {bias_s: 1.0e-3}, elevation_mask_deg: 25}"),
              AllOf(HasSubstr("set car: clock.bias_s: 0 -> 0.001"), HasSubstr("set drone: clock.bias_s")));
  EXPECT_THAT(submit(Kind::Set, "car", "elevation_mask_deg: 25"), StartsWith("unchanged"));
  EXPECT_EQ(changed_, 2);
}

TEST_F(OptionsDeskTest, PutsFaultsOnTheTimelineAndEndsThem) {
  EXPECT_EQ(submit(Kind::Faults, "", ""), "none");
  EXPECT_EQ(submit(Kind::AddFault, "car", "{name: dark, duration_s: 5, outage: {}}"), "added car: dark");
  EXPECT_EQ(submit(Kind::Faults, "", ""), "car: dark (outage) from 0 s until 5 s, at work");
  const simulation::RigidPose at{{0, 0, 2}};
  EXPECT_FALSE(car_.observe(1, at).epoch.observed.fix.solved());
  EXPECT_EQ(submit(Kind::EndFault, "", " dark "), "ended car: dark");
  EXPECT_TRUE(car_.observe(2, at).epoch.observed.fix.solved());
  EXPECT_THAT(submit(Kind::EndFault, "", "dark"), StartsWith("refused: "));
  EXPECT_THAT(submit(Kind::AddFault, "", "{outage: {satelites: [G05]}}"), StartsWith("refused: "));
  // Times of epochs are sums that end in 20.700000000000003.
  (void)car_.observe(207 * 0.1, at);
  submit(Kind::AddFault, "car", "{name: late, duration_s: 5, outage: {}}");
  EXPECT_THAT(submit(Kind::Faults, "car", ""), HasSubstr("late (outage) from 20.7 s until 25.7 s"));
  EXPECT_EQ(changed_, 0);
}

TEST_F(OptionsDeskTest, RefusesWhatCannotBeAndChangesNothing) {
  for (const char* wrong : {"elevation_mask_deg: 100", "elevation_mask_deg: high", "no_such_key: 1",
                            "sky: {systems: [GPS]}", "start: 2026-06-02T08:00:00Z", "name: other", "- a\n- b",
                            "elevation_mask_deg: 30\nclock: {bias_s: .nan}"}) {
    EXPECT_THAT(submit(Kind::Set, "", wrong), StartsWith("refused: ")) << wrong;
  }
  EXPECT_EQ(changed_, 0);
  EXPECT_EQ(submit(Kind::Get, "", "elevation_mask_deg"),
            "car:\n  elevation_mask_deg: 5\ndrone:\n  elevation_mask_deg: 5");
}

// A receiver with new options equals one that was built with them.
TEST_F(OptionsDeskTest, AChangedReceiverIsThatOfItsOptions) {
  const std::string text = "noise: {enabled: true}\nclock: {bias_s: 1.0e-4}";
  simulation::ReceiverRunner built = receiver(text);
  const simulation::RigidPose at{{0, 0, 2}};
  int compared = 0;
  (void)car_.observe(0, at);
  ASSERT_THAT(submit(Kind::Set, "car", text), StartsWith("set car: "));
  for (int i = 1; i <= 3; ++i) {
    const auto changed = car_.observe(i, at), expected = built.observe(i, at);
    ASSERT_FALSE(expected.epoch.observed.satellites.empty());
    ASSERT_EQ(changed.epoch.observed.satellites.size(), expected.epoch.observed.satellites.size());
    for (std::size_t s = 0; s < expected.epoch.observed.satellites.size(); ++s) {
      const auto &ours = changed.epoch.observed.satellites[s],
                 &theirs = expected.epoch.observed.satellites[s];
      ASSERT_EQ(ours.measurement.has_value(), theirs.measurement.has_value());
      if (!ours.measurement) continue;
      EXPECT_EQ(ours.measurement->pseudorange_m, theirs.measurement->pseudorange_m);
      ++compared;
    }
  }
  EXPECT_GT(compared, 10);
}

// The receiver's epochs are at other times, and nothing else has changed.
TEST_F(OptionsDeskTest, AnotherRateAloneLeavesTheReceiverAsItIs) {
  const std::string text = "noise: {enabled: true}\nclock: {bias_s: 1.0e-4}";
  simulation::ReceiverRunner kept = receiver(text), other = receiver(text);
  const simulation::RigidPose at{{0, 0, 2}};
  const std::vector<ReceiverHandle> one{{"car", &other, [this] { ++changed_; }}};
  (void)kept.observe(0, at);
  (void)other.observe(0, at);
  EXPECT_EQ(handle_request({Kind::Set, "", "rate_hz: 7"}, one), "set car: rate_hz: (none) -> 7");
  EXPECT_EQ(changed_, 1);
  EXPECT_EQ(other.config().rate_hz, 7);
  const auto a = kept.observe(1, at).epoch.observed.satellites,
             b = other.observe(1, at).epoch.observed.satellites;
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i].noise_m, b[i].noise_m);
}

TEST_F(OptionsDeskTest, AnswersFromTheHostsThread) {
  RequestQueue desk;
  auto requested = std::async(std::launch::async, [&] {
    return desk.submit({Kind::Set, "car", "elevation_mask_deg: 12"}, std::chrono::seconds(20));
  });
  int looked = 0;
  while (requested.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready) {
    desk.serve([&] {
      ++looked;
      return both_;
    });
  }
  EXPECT_EQ(requested.get(), "set car: elevation_mask_deg: 5 -> 12");
  EXPECT_EQ(looked, 1) << "receivers are gathered for requests alone";
}

TEST_F(OptionsDeskTest, NobodyWaitsForAHostThatDoesNotServe) {
  RequestQueue desk;
  EXPECT_THAT(desk.submit({Kind::Get, "", ""}, std::chrono::milliseconds(5)),
              HasSubstr("the simulation made no update within 5 ms; nothing has changed"));
  auto waiting = std::async(std::launch::async, [&] {
    return desk.submit({Kind::Get, "", ""}, std::chrono::seconds(60));
  });
  desk.close();
  EXPECT_EQ(waiting.get(), "refused: the world has ended");
  EXPECT_EQ(desk.submit({Kind::Get, "", ""}, std::chrono::seconds(60)), "refused: the world has ended");
}

}  // namespace
}  // namespace canyon::live::controls_test
