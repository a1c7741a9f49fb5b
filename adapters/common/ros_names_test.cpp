#include "adapters/common/ros_names.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "canyon/base/input_error.hpp"
#include "tests/support/refusal.hpp"

namespace canyon::adapters {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

ReceiverIdentity iris() {
  return {"city", "iris", "iris::gps0::link", "gps0", "gps", "gnss"};
}

RosTopics topics(const std::vector<std::pair<std::string, std::string>>& remappings,
                 std::vector<std::string>& notes, const std::string& base = "/iris") {
  RosSettings settings;
  settings.publish_scan = true;
  settings.remappings = remappings;
  return ros_topics(base, iris(), settings, notes);
}

std::string error_of(const std::vector<std::pair<std::string, std::string>>& remappings) {
  std::vector<std::string> notes;
  return canyon::test::refusal([&] { (void)topics(remappings, notes); });
}

TEST(RosNamespace, IsTheModelsNameWhereNobodySaysIt) {
  RosSettings settings;
  EXPECT_EQ(ros_namespace(iris(), settings), "/iris");
  ReceiverIdentity odd = iris();
  odd.model = "my car-2";
  EXPECT_EQ(ros_namespace(odd, settings), "/my_car_2");
  odd.model = "3dr";
  EXPECT_EQ(ros_namespace(odd, settings), "/m_3dr");
}

TEST(RosNamespace, IsAbsolute) {
  RosSettings settings;
  for (const auto& [given, made] :
       {std::pair{"/multipath", "/multipath"}, {"multipath", "/multipath"}, {"/a/b/", "/a/b"}, {"/", ""}}) {
    settings.ros_namespace = given;
    EXPECT_EQ(ros_namespace(iris(), settings), made) << given;
  }
}

TEST(RosNamespace, RefusesWhatIsNoName) {
  RosSettings settings;
  for (const char* bad : {"a b", "//a", "a//b", "1a", "/a/1b", "~", "a-b", " "}) {
    settings.ros_namespace = bad;
    EXPECT_THROW((void)ros_namespace(iris(), settings), InputError) << bad;
  }
}

TEST(RosTopics, HaveTheirNamesInTheNamespace) {
  std::vector<std::string> notes;
  EXPECT_THAT(topics({}, notes).all(),
              ElementsAre("/iris/fix", "/iris/fix_velocity", "/iris/gnss_multipath", "/iris/satellites",
                          "/iris/raw_observations", "/iris/scan"));
  EXPECT_EQ(topics({}, notes, "").fix, "/fix");
  RosSettings without_scan;
  EXPECT_THAT(ros_topics("/iris", iris(), without_scan, notes).all(),
              ElementsAre("/iris/fix", "/iris/fix_velocity", "/iris/gnss_multipath", "/iris/satellites",
                          "/iris/raw_observations"));
  EXPECT_THAT(notes, IsEmpty());
}

// A namespace configured twice would have services of equal names, whatever the names of topics.
TEST(RosTopics, ServicesAreClaimedAsTopicsAre) {
  std::set<std::string> taken;
  const auto claim = [&](const std::vector<std::string>& names) -> std::string {
    for (const std::string& name : names) {
      if (taken.contains(name)) return name;
    }
    taken.insert(names.begin(), names.end());
    return {};
  };
  std::vector<std::string> notes;
  RosSettings settings;
  settings.ros_namespace = "/car";
  EXPECT_EQ(claimed_ros_topics(iris(), settings, claim, notes).own, "/car/gnss");
  settings.remappings = {{"fix", "fix2"},
                         {"fix_velocity", "v2"},
                         {"gnss_multipath", "m2"},
                         {"satellites", "s2"},
                         {"raw_observations", "r2"}};
  EXPECT_THROW((void)claimed_ros_topics(iris(), settings, claim, notes), InputError);
  EXPECT_THAT(notes, IsEmpty());
}

TEST(RosTopics, AreRemappedAsRosDoes) {
  std::vector<std::string> notes;
  EXPECT_EQ(topics({{"~/out", "scan"}}, notes).scan, "/iris/scan");  // the paper's
  EXPECT_EQ(topics({{"~/out", "rays/gnss"}}, notes).scan, "/iris/rays/gnss");
  EXPECT_EQ(topics({{"scan", "rays"}}, notes).scan, "/iris/rays");
  EXPECT_EQ(topics({{"fix", "gps/fix"}}, notes).fix, "/iris/gps/fix");
  EXPECT_EQ(topics({{"~/fix", "/ublox/fix"}}, notes).fix, "/ublox/fix");
  EXPECT_EQ(topics({{"/iris/fix", "position"}}, notes).fix, "/iris/position");
  EXPECT_EQ(topics({{"/iris/gnss/fix", "position"}}, notes).fix, "/iris/position");
  EXPECT_EQ(topics({{"satellites", "~/sky"}}, notes).satellites, "/iris/gnss/sky");
  EXPECT_EQ(topics({{"satellites", "~sky"}}, notes).satellites, "/iris/gnss/sky");
  EXPECT_EQ(topics({{"raw_observations", "raw"}}, notes).raw_observations, "/iris/raw");
  EXPECT_EQ(topics({{"gnss_multipath", "m"}, {"fix_velocity", "v"}}, notes).fix_velocity, "/iris/v");
  EXPECT_EQ(topics({{"gnss_multipath", "m"}, {"fix_velocity", "v"}}, notes).gnss_multipath, "/iris/m");
  EXPECT_EQ(topics({{"fix", "position"}}, notes).fix_velocity, "/iris/fix_velocity");
  EXPECT_THAT(notes, IsEmpty());
}

TEST(RosTopics, NoteWhatRenamesNothing) {
  std::vector<std::string> notes;
  EXPECT_EQ(topics({{"fixx", "position"}}, notes).fix, "/iris/fix");
  EXPECT_THAT(notes, ElementsAre(HasSubstr("'fixx:=position' matches no topic")));
}

TEST(RosTopics, RefuseWhatIsNoName) {
  EXPECT_THAT(error_of({{"fix", ""}}), HasSubstr("'' in 'fix:=' is not a valid ROS name"));
  EXPECT_THAT(error_of({{"", "fix"}}), HasSubstr("is not a valid ROS name"));
  EXPECT_THAT(error_of({{"fix", "my fix"}}), HasSubstr("'my fix'"));
  EXPECT_THAT(error_of({{"fix", "~"}}), HasSubstr("'~'"));
  EXPECT_THAT(error_of({{"fix", "~//x"}}), HasSubstr("'~//x'"));
  EXPECT_THAT(error_of({{"fix", "a/"}}), HasSubstr("'a/'"));
  EXPECT_THAT(error_of({{"fix", "satellites"}}), HasSubstr("two topics would both be '/iris/satellites'"));
}

TEST(RosFrame, IsTheLinkWithoutScopeWhereNobodySaysIt) {
  RosSettings settings;
  EXPECT_EQ(ros_frame_id(iris(), settings), "link");
  settings.frame_id = "gnss_antenna";
  EXPECT_EQ(ros_frame_id(iris(), settings), "gnss_antenna");
}

}  // namespace
}  // namespace canyon::adapters
