#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "tests/support/simulation_support.hpp"

namespace canyon::simulation {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* kFixHeader =
    "# Fix,Provider,LatitudeDegrees,LongitudeDegrees,AltitudeMeters,SpeedMps,AccuracyMeters,BearingDegrees,"
    "UnixTimeMillis\n";

TrajectoryFile read_log(const std::string& text, bool heights_needed = true) {
  test::TemporaryFolder folder;
  std::ofstream(folder / "gnss_log.txt", std::ios::binary) << text;
  return read_trajectory_file(folder / "gnss_log.txt", "gnsslogger", {}, {heights_needed, 0});
}

TEST(AndroidFixes, AreThoseOfGps) {
  const TrajectoryFile file = read_log(std::string("Raw,1,2,3\n") + kFixHeader +
                                       "Fix,NLP,48.5,11.5,500.0,0,20,0,1714557600000\n"
                                       "Fix,GPS,48.000,11.000,547.25,1.0,3,0,1714557600000\n"
                                       "Fix,FLP,48.6,11.0,500.0,1.0,3,0,1714557600500\n"
                                       "Fix,GPS,48.001,11.000,548.25,1.0,3,0,1714557610000\n"
                                       "Fix,GPS,91.001,11.000,548.25,1.0,3,0,1714557611000\n"
                                       "Fix,GPS,48.001,11.000\n");
  const Trajectory& path = file.trajectory;
  EXPECT_TRUE(file.is_dated);
  // date -u -d @1714557600: 2024-05-01T10:00:00Z
  EXPECT_EQ(path.begin(), geodesy::parse_time("2024-05-01T10:00:00Z"));
  EXPECT_EQ(path.end(), geodesy::parse_time("2024-05-01T10:00:10Z"));
  EXPECT_NEAR(geodesy::degrees(path.at(path.begin()).position.latitude_rad), 48, 1e-9);
  EXPECT_NEAR(path.at(path.begin()).position.height_m, 547.25, 1e-6);
  EXPECT_THAT(
      file.report.warnings(),
      ElementsAre(HasSubstr("gnss_log.txt:7: the latitude 91.001 deg is out of range; left out"),
                  HasSubstr("gnss_log.txt:8: a fix without a time, latitude, longitude or altitude")));
}

TEST(AndroidFixes, MayBeOfAnotherProviderAndAnOldApp) {
  const TrajectoryFile file = read_log(
      "# Fix,Provider,Latitude,Longitude,Altitude,Speed,Accuracy,(UTC)TimeInMs\n"
      "Fix,network,48.5,11.5,500.0,0,20,1714557600000\n"
      "Fix,fused,48.0,11.0,,0,20,1714557600000\n"
      "Fix,fused,48.0,11.001,,0,20,1714557601000\n",
      false);
  EXPECT_NEAR(geodesy::degrees(file.trajectory.at(file.trajectory.begin()).position.latitude_rad), 48, 1e-9);
  EXPECT_THAT(file.report.warnings(), testing::Contains(HasSubstr("no fix of GPS; those of fused are used")));
}

TEST(AndroidFixes, SayWhatALogWithoutThemHas) {
  EXPECT_THAT(test::error_of([] { (void)read_log("# Raw,utcTimeMillis,TimeNanos\nRaw,1,2\n"); }).what(),
              HasSubstr("has no usable line of 'Fix' (it has Raw 1)"));
}

}  // namespace
}  // namespace canyon::simulation
