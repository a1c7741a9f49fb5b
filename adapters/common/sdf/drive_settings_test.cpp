#include "adapters/common/sdf/drive_settings.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "canyon/base/options/describe.hpp"
#include "tests/support/documented.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::adapters {
namespace {

using Eigen::Vector3d;
using geodesy::Geodetic;
using geodesy::GpsTime;
using geodesy::LocalFrame;

class DriveElementTest : public ::testing::Test {
 protected:
  [[nodiscard]] DriveSettings read(const std::string& children) const {
    const sdf::SDFPtr sdf(new sdf::SDF());
    sdf::init(sdf);
    sdf::readString(
        "<sdf version='1.6'><model name='car'><link name='l'/><plugin name='rails' filename='x'>" + children +
            "</plugin></model></sdf>",
        sdf);
    const auto plugin = sdf->Root()->GetElement("model")->GetElement("plugin");
    return read_drive_settings(plugin, "plugin 'rails'", folder_.path(), {}, LocalFrame(position_));
  }
  [[nodiscard]] std::string refusal(const std::string& children) const {
    return canyon::test::refusal([&] { (void)read(children); });
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }

  const canyon::test::TemporaryFolder folder_;
  const Geodetic position_ = Geodetic::from_degrees(22.3, 114.17, 5);
};

TEST_F(DriveElementTest, ReadsWaypoints) {
  const DriveSettings settings = read(
      "<waypoint>0 0 1</waypoint><waypoint> 8  0 1 </waypoint><waypoint>8 4 "
      "1</waypoint><speed_mps>4</speed_mps>"
      "<hold_s>1</hold_s><loop>false</loop><heading>0</heading><offset_m>0.5 0 -1</offset_m>");
  EXPECT_FALSE(settings.heading);
  EXPECT_EQ(settings.offset_m, Vector3d(0.5, 0, -1));
  EXPECT_DOUBLE_EQ(settings.drive.end_s(), 2 + 1 + 3);
  EXPECT_EQ(settings.drive.at(2).position_m, Vector3d(4, 0, 1));
  EXPECT_TRUE(settings.warnings.empty());
}

TEST_F(DriveElementTest, TakesTheFilesOwnTimesAsTheWorlds) {
  write("dated.csv",
        "time,latitude,longitude,height\n2024-05-01T10:00:00Z,22.3,114.17,5\n2024-05-01T10:00:20Z,22.301,114."
        "17,5\n");
  write("seconds.csv", "time,latitude,longitude,height\n0,22.3,114.17,5\n20,22.301,114.17,5\n");
  for (const char* name : {"dated.csv", "seconds.csv"}) {
    const DriveSettings settings = read("<trajectory>" + std::string(name) + "</trajectory>");
    EXPECT_NEAR(settings.drive.begin_s(), 0, 1e-9) << name;
    EXPECT_NEAR(settings.drive.end_s(), 20, 1e-9) << name;
    EXPECT_TRUE(settings.heading);
  }
  // 10:00:05 UTC is 5 s into the drive. 2024-05-01 is 1 May, a Wednesday: day 3 of GPS week 2312, 18 leap
  // seconds.
  const double tow = 3 * 86400 + 10 * 3600 + 5 + 18;
  for (const std::string& start :
       {std::string("<start>2024-05-01T10:00:05Z</start>"),
        "<start><week>2312</week><tow>" + std::to_string(tow) + "</tow></start>"}) {
    EXPECT_NEAR(read("<trajectory>dated.csv</trajectory>" + start).drive.begin_s(), -5, 1e-9) << start;
  }
}

TEST_F(DriveElementTest, NamesElementAndCure) {
  write("ok.csv", "time,latitude,longitude,height\n0,22.3,114.17,5\n20,22.301,114.17,5\n");
  write("broken.csv", "time,latitude,longitude,height\n0,22.3,114.17,5\n20,north,114.17,5\n");
  const std::string file = "<trajectory>ok.csv</trajectory>";
  const std::string location = "<waypoint>0 0 0</waypoint>";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "give a <trajectory> file, or at least one <waypoint>"},
      {file + location, "<waypoint>: conflicts with 'trajectory'; keep one of trajectory or waypoint"},
      {"<trajectory>none.csv</trajectory>", "there is no file 'none.csv'"},
      {"<trajectory>broken.csv</trajectory>", "broken.csv:3"},
      {file + "<format>igc</format>", "<format>"},
      {file + "<start>yesterday</start>", "<start>"},
      {file + "<start><week>2312</week></start>", "<start>: 'tow' is missing; give week and tow"},
      {file + "<speed_mps>3</speed_mps>", "applies only to waypoints"},
      {location + "<format>csv</format>", "applies only to a <trajectory>"},
      {location + "<speed_mps>fast</speed_mps>", "<speed_mps>"},
      {location + "<speed_mps>0</speed_mps>", "<speed_mps>"},
      {location + "<loop>often</loop>", "<loop>"},
      {location + "<offset_m>1 2</offset_m>", "<offset_m>: '1 2' is not three numbers"},
      {location + "<waypoint>1 two 3</waypoint>", "<waypoint>: '1 two 3' is not three numbers"},
      {location + "<waypoint>nan 0 0</waypoint>", "<waypoint>: 'nan 0 0' is not three numbers"},
  };
  for (const auto& [children, expected] : cases) {
    const std::string message = refusal(children);
    EXPECT_NE(message.find(expected), std::string::npos) << children << "\n" << message;
    if (children != "<trajectory>broken.csv</trajectory>") {
      EXPECT_NE(message.find("plugin 'rails'"), std::string::npos) << message;
    }
  }
}

TEST_F(DriveElementTest, WarnsOfUnknownElements) {
  const DriveSettings settings = read("<waypoint>0 0 0</waypoint><sped_mps>3</sped_mps>");
  ASSERT_EQ(settings.warnings.size(), 1U);
  EXPECT_NE(settings.warnings[0].find("speed_mps"), std::string::npos) << settings.warnings[0];
}

TEST(DriveKeys, DocumentationHasTheSameTable) {
  canyon::test::expect_documented("sdf.md", "elements of a drive plugin",
                                  options::markdown(drive_description().keys));
}

}  // namespace
}  // namespace canyon::adapters
