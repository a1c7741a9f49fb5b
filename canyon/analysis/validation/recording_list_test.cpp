#include <fmt/format.h>
#include <gtest/gtest.h>

#include <gmock/gmock.h>

#include "canyon/analysis/validation/recorded_scene.hpp"
#include "canyon/base/options/describe.hpp"
#include "tests/support/documented.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/simulation_support.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::validation {
namespace {

using simulation::test::error_of;
using ::testing::AllOf;
using ::testing::HasSubstr;

struct RecordingListTest : ::testing::Test {
  RecordingListTest() {
    for (const char* name : {"a.yaml", "a.obs", "a.csv", "a.nmea", "mine.yaml"})
      (void)folder.write(name, "x\n");
  }
  RecordingList read(const std::string& text) { return read_recording_list(folder.write("list.yaml", text)); }
  std::string fault(const std::string& text) {
    return error_of([&] { (void)read(text); }).what();
  }
  simulation::test::TemporaryFolder folder;
};

TEST_F(RecordingListTest, FilesLieBesideTheList) {
  const RecordingList list = read(
      "recordings:\n"
      "  - {name: a, class: mass market, scenario: a.yaml, obs: a.obs, truth: a.csv, truth_format: csv,\n"
      "     profile: ublox-m8t, nmea: a.nmea, align: true, align_heading: true, split: 0.4}\n"
      "  - {name: b, scenario: a.yaml, obs: a.obs, profile: ./mine.yaml}\n");
  ASSERT_EQ(list.recordings.size(), 2U);
  const ListedRecording& a = list.recordings[0];
  EXPECT_EQ(a.name, "a");
  EXPECT_EQ(a.receiver_class, "mass market");
  EXPECT_EQ(*a.scenario, folder.path() / "a.yaml");
  EXPECT_EQ(*a.obs, folder.path() / "a.obs");
  EXPECT_EQ(*a.truth, folder.path() / "a.csv");
  EXPECT_EQ(*a.nmea, folder.path() / "a.nmea");
  EXPECT_EQ(a.truth_format, "csv");
  EXPECT_EQ(a.profile, "ublox-m8t");
  EXPECT_TRUE(a.align && a.align_heading);
  EXPECT_EQ(a.split, 0.4);
  const ListedRecording& b = list.recordings[1];
  EXPECT_TRUE(b.receiver_class.empty() && b.truth_format.empty());
  EXPECT_FALSE(b.truth || b.nmea || b.split || b.align || b.align_heading);
  // A scenario's reader resolves paths from its own folder: the list's path is reported in full.
  EXPECT_TRUE(std::filesystem::equivalent(b.profile, folder.path() / "mine.yaml"));
  EXPECT_TRUE(std::filesystem::path(b.profile).is_absolute());
}

TEST_F(RecordingListTest, SaysWhatIsWrongAndWhere) {
  const std::string rest = ", obs: a.obs}\n";
  EXPECT_THAT(fault("recordings:\n  - {name: a, scenaro: a.yaml" + rest),
              AllOf(HasSubstr("list.yaml:2"), HasSubstr("scenaro"), HasSubstr("'scenario'")));
  EXPECT_THAT(fault("recordings:\n  - {name: a, obs: a.obs}\n"),
              AllOf(HasSubstr("list.yaml:2"), HasSubstr("'scenario' is missing")));
  EXPECT_THAT(fault("recordings:\n  - {name: a/b, scenario: a.yaml" + rest), HasSubstr("a/b"));
  EXPECT_THAT(fault("recordings:\n  - {name: a, scenario: none.yaml" + rest), HasSubstr("none.yaml"));
  EXPECT_THAT(fault("recordings:\n  - {name: a, scenario: a.yaml, profile: ublox" + rest),
              AllOf(HasSubstr("list.yaml:2"), HasSubstr("profile"), HasSubstr("ublox-")));
  EXPECT_THAT(fault("recordings:\n  - {name: a, scenario: a.yaml, split: 1" + rest), HasSubstr("split"));
  EXPECT_THAT(fault("recordings:\n  - {name: a, scenario: a.yaml, truth_format: igc" + rest),
              AllOf(HasSubstr("igc"), HasSubstr("urbannav")));
  EXPECT_THAT(fault("recordings:\n  - {name: a, scenario: a.yaml, align_heading: true" + rest),
              HasSubstr("align: true"));
  const std::string one = "  - {name: a, scenario: a.yaml" + rest;
  EXPECT_THAT(fault("recordings:\n" + one + one),
              AllOf(HasSubstr("list.yaml:3"), HasSubstr("'a' names two")));
  EXPECT_THAT(fault("recordings: []\n"), HasSubstr("empty"));
  EXPECT_THAT(fault("recordings:\n" + one + "seed: 3\n"), AllOf(HasSubstr("list.yaml:3"), HasSubstr("seed")));
  std::string many = "recordings:\n";
  for (int i = 0; i < 51; ++i) many += fmt::format("  - {{name: a{}, scenario: a.yaml{}", i, rest);
  EXPECT_THAT(fault(many), AllOf(HasSubstr("51"), HasSubstr("50")));
}

TEST_F(RecordingListTest, IsNoScenario) {
  EXPECT_TRUE(is_recording_list(folder.write("list.yaml", "recordings: 3\n")));
  EXPECT_FALSE(is_recording_list(folder.write("scenario.yaml", "city: {open: true}\n")));
  EXPECT_FALSE(is_recording_list(folder.write("broken.yaml", "a: [\n")));
  EXPECT_THAT(canyon::test::refusal([&] { (void)is_recording_list(folder.path() / "none.yaml"); }),
              AllOf(HasSubstr("none.yaml"), HasSubstr("no such file")));
}

TEST(RecordingList, DocumentationHasTheSameTable) {
  canyon::test::expect_documented("keys.md", "keys of a list of recordings",
                                  options::markdown(options::describe<RecordingList>().keys));
}

}  // namespace
}  // namespace canyon::validation
