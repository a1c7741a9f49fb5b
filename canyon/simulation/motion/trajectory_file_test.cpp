#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/simulation/motion/nmea_fixes.hpp"
#include "canyon/simulation/motion/track_file.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "tests/support/case_file.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/simulation_support.hpp"

namespace canyon::simulation::trajectory_file_test {
namespace {

using geodesy::degrees;
using geodesy::GpsTime;
using geodesy::parse_time;
using test::error_of;
using test::TemporaryFolder;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using namespace std::string_literals;

const GpsTime kStart = parse_time("2019-04-28T12:58:03Z");

TrajectoryFile read(const std::string& text, const std::string& format, GpsTime start = kStart) {
  const TemporaryFolder folder;
  return read_trajectory_file(folder.write("track.txt", text), format, start);
}

// what() without the folder.
std::string fault(const std::string& text, const std::string& format, GpsTime start = kStart) {
  const TemporaryFolder folder;
  const auto path = folder.write("track.txt", text);
  const std::string what = error_of([&] { (void)read_trajectory(path, format, start); }).what();
  const std::size_t at = what.find("track.txt");
  return at == std::string::npos ? what : what.substr(at);
}

TEST(TrajectoryCsv, ReadsIsoTimesWithAndWithoutHeader) {
  const std::string lines =
      "2019-04-28T12:58:03Z,22.30,114.17,5.5\n"
      "2019-04-28T12:58:04.5Z, 22.31 ,114.18,6\r\n"
      "\n# a comment\n"
      "2019-04-28T12:58:24 GPST,22.32,114.19,7\n";
  for (const std::string& header : {std::string(), std::string("time,latitude,longitude,height\n")}) {
    const TrajectoryFile file = read(header + lines, "csv", GpsTime{});
    EXPECT_TRUE(file.has_own_dates);
    EXPECT_EQ(file.trajectory.begin(), parse_time("2019-04-28T12:58:03Z"));
    EXPECT_EQ(file.trajectory.end(), parse_time("2019-04-28T12:58:06Z"));
    const Pose pose = file.trajectory.at(parse_time("2019-04-28T12:58:04.5Z"));
    EXPECT_NEAR(degrees(pose.position.latitude_rad), 22.31, 1e-12);
    EXPECT_NEAR(degrees(pose.position.longitude_rad), 114.18, 1e-12);
    EXPECT_EQ(pose.position.height_m, 6);
  }
}

TEST(TrajectoryCsv, ReadsSecondsFromTheStartAndColumnsByName) {
  const TrajectoryFile file = read(
      "speed,lon_deg,Lat_deg,alt_m,time_s\n"
      "3,114.17,22.3,5,0\n"
      "3,114.18,22.4,6,0.1\n",
      "csv");
  EXPECT_FALSE(file.has_own_dates);
  EXPECT_EQ(file.trajectory.begin(), kStart);
  EXPECT_EQ(file.trajectory.end(), kStart + 0.1);
  EXPECT_EQ(file.trajectory.sample_interval_s(), 0.1);
  EXPECT_NEAR(degrees(file.trajectory.at(kStart).position.latitude_rad), 22.3, 1e-12);
}

TEST(TrajectoryCsv, WarnsOnceOfTimesWithoutAZone) {
  const TrajectoryFile file =
      read("2019-04-28T12:58:03,22.3,114.17,5\n2019-04-28T12:58:04,22.3,114.17,5\n", "csv");
  EXPECT_THAT(file.warnings,
              ElementsAre(testing::AllOf(HasSubstr("track.txt:1: "), HasSubstr("names no zone"))));
  EXPECT_THAT(read("2019-04-28T12:58:03Z,22.3,114.17,5\n", "csv").warnings, ElementsAre());
}

TEST(TrajectoryCsv, SaysWhatIsWrongAndWhere) {
  EXPECT_THAT(fault("0,22.3,114.17,nan\n", "csv"),
              HasSubstr("track.txt:1: the height 'nan' is not a number"));
  EXPECT_THAT(fault("0,22.3,114.17,1\n1,2218.5,114.17,1\n", "csv"),
              testing::AllOf(HasSubstr("track.txt:2: the latitude 2218.5 deg is out of range"),
                             HasSubstr("ddmm.mm"), HasSubstr("22.3083333")));
  EXPECT_THAT(fault("0,223000000,114.17,1\n", "csv"), HasSubstr("1e7"));
  EXPECT_THAT(fault("0,114.17,22.3,1\n", "csv"),
              testing::AllOf(HasSubstr("out of range"), HasSubstr("look swapped"), Not(HasSubstr("NMEA"))));
  EXPECT_THAT(fault("1975-06-01T00:00:00Z,22.3,114.17,1\n", "csv"), HasSubstr("from 1980-01-06"));
  EXPECT_THAT(fault("0,22.3,11410.2,1\n", "csv"), HasSubstr("ddmm.mm"));
  EXPECT_THAT(fault("0,22.3,114.17\n", "csv"), HasSubstr("3 columns where 4 are needed"));
  EXPECT_THAT(fault("3,22.3,114.17,1\n2,22.3,114.17,1\n1,22.3,114.17,1\n", "csv"),
              HasSubstr("the times of 2 of 3 points do not follow the others; sort"));
  EXPECT_THAT(fault("0,22.3,114.17,1\n2019-04-28T12:58:05Z,22.3,114.17,1\n", "csv"),
              HasSubstr("another way"));
  EXPECT_THAT(fault("yesterday,22.3,114.17,1\n", "csv"), HasSubstr("ISO 8601"));
  EXPECT_THAT(fault("0,22.3,114.17,1\n", "csv", GpsTime{}), HasSubstr("no start"));
  EXPECT_THAT(fault("15564562,22.3,114.17,1\n", "csv"), HasSubstr("time_ms, time_us"));
  EXPECT_THAT(fault("\n", "csv"), HasSubstr("no position"));
  EXPECT_THAT(fault("time,latitude,longitude,height\n", "csv"), HasSubstr("no position"));
  EXPECT_THAT(fault("time,latitude,height\n1,2,3\n", "csv"), HasSubstr("no column 'longitude'"));
  EXPECT_THAT(fault("0,22.3,114.17,1\n", "igc"), HasSubstr("'igc' is unknown"));
  EXPECT_THAT(error_of([] { (void)read_trajectory("/nowhere/track.csv", "csv", kStart); }).what(),
              HasSubstr("/nowhere/track.csv"));
}

TEST(TrajectoryCsv, ReadsLargeFiles) {
  std::string text = "time,latitude,longitude,height\n";
  for (int i = 0; i < 200'000; ++i) {
    text += std::to_string(i) + "." + std::to_string(i % 10) + ",22." + std::to_string(300'000 + i % 7) +
            ",114.17,5\n";
  }
  const TrajectoryFile file = read(text, "csv");
  EXPECT_EQ(file.trajectory.end(), kStart + 199'999.9);
}

TEST(TrajectoryUrbanNav, ReadsAndChecks) {
  const Trajectory t =
      read("2051,46701,22.30115538,114.17900033,6.59589290\n2051,46702,22.3011,114.179,6.5\n", "urbannav",
           GpsTime{})
          .trajectory;
  EXPECT_EQ(t.begin(), GpsTime::from_week(2051, 46701));
  EXPECT_NEAR(degrees(t.at(t.begin()).position.longitude_rad), 114.17900033, 1e-12);
  EXPECT_THAT(fault("2051.5,46701,22.3,114.1,6\n", "urbannav"), HasSubstr("GPS week '2051.5'"));
  EXPECT_THAT(fault("2051,646701,22.3,114.1,6\n", "urbannav"), HasSubstr("time of week 646701 s"));
  EXPECT_THAT(fault("2051,46701,22.3,114.1\n", "urbannav"), HasSubstr("5 are needed"));
  EXPECT_THAT(fault("2051,46701,0,22.3,x\n", "urbannav"), HasSubstr("the height 'x'"));
}

// Facts of the file: 485 epochs, tow 46701 to 47185 of week 2051 (head and tail of it).
TEST(TrajectoryUrbanNav, ReadsDegreesMinutesAndSecondsBetweenBlanks) {
  const std::string line =
      "1621218775.00 2158.00000  95593.00   -22 18 04.31949  114 10 44.60559  3.472 -0.0\n";
  const Trajectory t =
      read(line + "1621218776.00 2158 95594.00 -22 18 05.4 114 10 44.6 3.4 0.0\n", "urbannav").trajectory;
  EXPECT_EQ(t.begin(), GpsTime::from_week(2158, 95593));
  EXPECT_NEAR(geodesy::degrees(t.at(t.begin()).position.latitude_rad), -(22 + 18 / 60.0 + 4.31949 / 3600),
              1e-11);
  EXPECT_NEAR(geodesy::degrees(t.at(t.begin()).position.longitude_rad), 114 + 10 / 60.0 + 44.60559 / 3600,
              1e-11);
  EXPECT_DOUBLE_EQ(t.at(t.begin()).position.height_m, 3.472);
  EXPECT_THAT(fault("1 2158 95593 22 18 64 114 10 44 3 0\n", "urbannav"), HasSubstr("'22 18 64' are not"));
}

TEST(TrajectoryUrbanNav, ReadsTheRealDrive) {
  CANYON_SHARED_DATA(path, "urbannav-tst-20190428/groundTruth_TST.csv");
  const Trajectory t = read_trajectory(path, "urbannav", GpsTime{});
  EXPECT_EQ(t.begin(), GpsTime::from_week(2051, 46701));
  EXPECT_EQ(t.end(), GpsTime::from_week(2051, 47185));
  EXPECT_EQ(t.sample_interval_s(), 1);
  EXPECT_NEAR(degrees(t.at(t.end()).position.latitude_rad), 22.29993245, 1e-12);
  EXPECT_NEAR(degrees(t.at(t.end()).position.longitude_rad), 114.17981121, 1e-12);
  EXPECT_EQ(t.at(t.end()).position.height_m, 6.77868981);
}

// $GPGGA,123519,... is the textbook sentence; its checksum 47 is printed with it everywhere.
constexpr const char* kGga = "$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\n";

std::string sentence(const std::string& body) {
  unsigned sum = 0;
  for (const char c : body) sum ^= static_cast<unsigned char>(c);
  const char* digits = "0123456789ABCDEF";
  return "$" + body + "*" + digits[sum / 16] + digits[sum % 16] + "\r\n";
}
std::string gga(const std::string& time, const std::string& quality = "1") {
  return sentence("GNGGA," + time + ",2218.06932,N,11410.74002,E," + quality + ",08,0.9,9.5,M,-2.9,M,,");
}

TEST(TrajectoryNmea, ReadsPositionAndEllipsoidalHeight) {
  const TrajectoryFile file = read(kGga, "nmea", parse_time("2019-04-28T00:00:00Z"));
  EXPECT_FALSE(file.has_own_dates);
  const Pose pose = file.trajectory.at(file.trajectory.begin());
  EXPECT_EQ(pose.time, parse_time("2019-04-28T12:35:19Z"));
  EXPECT_NEAR(degrees(pose.position.latitude_rad), 48 + 7.038 / 60, 1e-12);
  EXPECT_NEAR(degrees(pose.position.longitude_rad), 11 + 31.0 / 60, 1e-12);
  EXPECT_NEAR(pose.position.height_m, 545.4 + 46.9, 1e-9);
}

// The same places as the trajectory's, and no others.
TEST(TrajectoryNmea, FixesAreThoseOfTheLines) {
  const TemporaryFolder folder;
  const NmeaFixes own =
      read_nmea_fixes(folder.write("own.nmea", gga("120000") + gga("120001", "0") + gga("120009")), kStart);
  ASSERT_EQ(own.fixes.size(), 2U);
  EXPECT_FALSE(own.has_own_dates);
  EXPECT_THAT(own.notes.lines(), ElementsAre(HasSubstr("GGA sentence without a fix; left out")));
  EXPECT_EQ(own.fixes[1].time, parse_time("2019-04-28T12:00:09Z"));
  EXPECT_NEAR(degrees(own.fixes[1].place.latitude_rad), 22 + 18.06932 / 60, 1e-12);
  const NmeaFixes demo = read_nmea_fixes(
      folder.write("demo.nmea", gga("120000", "8") + gga("120001", "8") + gga("120002")), kStart);
  EXPECT_EQ(demo.fixes.size(), 3U);
  EXPECT_THAT(demo.notes.lines(),
              ElementsAre(HasSubstr("position is simulated (quality 8) (the first of 2); it is")));
  EXPECT_NEAR(own.fixes[1].place.height_m, 9.5 - 2.9, 1e-9);
}

TEST(TrajectoryNmea, OneGgaSentenceHasAPlace) {
  const auto place = position_of_gga(gga("120000"));
  ASSERT_TRUE(place);
  EXPECT_NEAR(degrees(place->latitude_rad), 22 + 18.06932 / 60, 1e-12);
  EXPECT_NEAR(degrees(place->longitude_rad), 114 + 10.74002 / 60, 1e-12);
  EXPECT_NEAR(place->height_m, 9.5 - 2.9, 1e-9);
  std::string damaged = gga("120000");
  damaged[20] = '9';
  for (const std::string& line :
       {damaged, gga("120000", "0"), std::string("$GNGGA,120003,22"), std::string("noise"), std::string(),
        sentence("GNGGA,120000,2278.0,N,11410.74,E,1,08,0.9,9.5,M,-2.9,M,,"),
        sentence("GNGGA,120000,nan,N,11410.74,E,1,08,0.9,9.5,M,-2.9,M,,")}) {
    EXPECT_FALSE(position_of_gga(line)) << line;
  }
}

TEST(TrajectoryNmea, TakesTheDateFromRmcOrZdaAndCrossesMidnight) {
  const std::string rmc = sentence("GNRMC,235959.00,A,2218.06932,N,11410.74002,E,0.0,,280419,,,A");
  for (const std::string& text :
       {gga("235958.50") + rmc + gga("235959.50") + gga("000000.50") + gga("000001.50"),
        sentence("GPZDA,235958.00,28,04,2019,00,00") + gga("235958.50") + gga("235959.50") +
            gga("000000.50") + gga("000001.50")}) {
    const TrajectoryFile file = read(text, "nmea", GpsTime{});
    EXPECT_TRUE(file.has_own_dates);
    EXPECT_EQ(file.trajectory.begin(), parse_time("2019-04-28T23:59:58.5Z"));
    EXPECT_EQ(file.trajectory.end(), parse_time("2019-04-29T00:00:01.5Z"));
  }
}

TEST(TrajectoryNmea, SkipsAndCountsLinesWithoutUse) {
  std::string broken = gga("120001");
  broken[10] = '9';
  const TrajectoryFile file =
      read(gga("120000") + broken + gga("120002", "0") + "$GNGGA,120003,22\nnoise\n" + gga("120004"), "nmea");
  EXPECT_EQ(file.trajectory.end() - file.trajectory.begin(), 4);
  ASSERT_EQ(file.warnings.size(), 2U);
  EXPECT_THAT(file.warnings[0],
              HasSubstr("damaged sentence (cut short, or with a wrong checksum) (the first of 2)"));
  EXPECT_THAT(file.warnings[1], HasSubstr("GGA sentence without a fix; left out"));
  const TrajectoryFile flat = read(sentence("GPGGA,120000,2218.0,N,11410.7,E,1,08,0.9,9.5,M,,,,") +
                                       sentence("GPGGA,120001,2218.0,N,11410.7,E,1,08,0.9,9.5,M,,,,"),
                                   "nmea");
  EXPECT_THAT(flat.warnings,
              ElementsAre(HasSubstr("GGA sentence without a geoid separation (the first of 2)")));
}

TEST(TrajectoryNmea, SaysWhatIsWrong) {
  EXPECT_THAT(fault(kGga, "nmea", GpsTime{}), HasSubstr("no RMC or ZDA"));
  EXPECT_THAT(fault("hello\n", "nmea"), HasSubstr("no usable GGA"));
  EXPECT_THAT(fault(gga("120000", "0"), "nmea"), HasSubstr("1 without fix"));
  EXPECT_THAT(fault(gga("250000"), "nmea"), HasSubstr("'250000' is not hhmmss.ss"));
  EXPECT_THAT(fault(sentence("GPGGA,120000,2278.0,N,11410.7,E,1,08,0.9,9.5,M,0,M,,"), "nmea"),
              HasSubstr("ddmm.mmmm"));
  EXPECT_THAT(fault(sentence("GPGGA,120000,2218.0,X,11410.7,E,1,08,0.9,9.5,M,0,M,,"), "nmea"),
              HasSubstr("neither N nor S"));
}

// --- files of other programs (tests/data/cases)
// -------------------------------------------------------------

TrajectoryFile read_case(const std::string& name, const std::string& format,
                         const HeightReading& heights = {}, GpsTime start = {}) {
  return read_trajectory_file(canyon::test::case_file(name), format, start, heights);
}
void expect_path(const TrajectoryFile& file, GpsTime begin, double duration_s, double latitude_deg,
                 double height_m) {
  EXPECT_EQ(file.trajectory.begin(), begin);
  EXPECT_NEAR(file.trajectory.end() - begin, duration_s, 1e-9);
  EXPECT_NEAR(degrees(file.trajectory.at(begin).position.latitude_rad), 48, 1e-9);
  EXPECT_NEAR(degrees(file.trajectory.at(begin).position.longitude_rad), 11, 1e-9);
  EXPECT_NEAR(degrees(file.trajectory.at(file.trajectory.end()).position.latitude_rad), latitude_deg, 1e-9);
  EXPECT_NEAR(file.trajectory.at(begin).position.height_m, height_m, 1e-6);
}
const GpsTime kCases = parse_time("2024-05-01T10:00:00Z");

TEST(TrajectoryCases, AVoidRmcSaysNoDate) {
  const TrajectoryFile good = read_case("nmea-void-date/good.nmea", "nmea");
  for (const char* name : {"day-before", "default-1980", "future", "rollover"}) {
    SCOPED_TRACE(name);
    const TrajectoryFile file = read_case(std::string("nmea-void-date/") + name + ".nmea", "nmea");
    EXPECT_EQ(file.trajectory.begin(), kCases);
    EXPECT_EQ(file.trajectory.end(), good.trajectory.end());
    EXPECT_DOUBLE_EQ(file.trajectory.end() - file.trajectory.begin(), 29);
    EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("GGA sentence without a fix (the first of 3)")));
  }
}

TEST(TrajectoryCases, NmeaOfLoggersTalkersAndTwoDimensions) {
  expect_path(read_case("nmea-gnsslogger/log.nmea", "nmea"), kCases, 4, 48.0002, 547);
  const TrajectoryFile two = read_case("nmea-two-talkers/two.nmea", "nmea");
  expect_path(two, kCases, 5, 48.00025, 547);
  EXPECT_THAT(two.warnings,
              ElementsAre(HasSubstr("point that repeats the time of another (the first of 6)")));
  const TrajectoryFile one = read_case("nmea-gga-no-altitude/one.nmea", "nmea");
  expect_path(one, kCases, 5, 48.00025, 547);
  EXPECT_THAT(one.warnings, ElementsAre(HasSubstr("GGA sentence without an altitude; left out")));
  EXPECT_THAT(
      error_of([] { (void)read_case("nmea-gga-no-altitude/all2d.nmea", "nmea"); }).what(),
      testing::AllOf(HasSubstr("none of its 6 fixes has an altitude"), HasSubstr("height_above_terrain_m")));
  expect_path(read_case("nmea-gga-no-altitude/all2d.nmea", "nmea", {false, 0}), kCases, 5, 48.00025, 0);
}

TEST(TrajectoryCases, TextOfOfficeProgramsIsRead) {
  for (const char* name : {"bom", "quoted", "semicolon"})
    expect_path(read_case(std::string("text-bom/") + name + ".csv", "csv"), kCases, 2, 48.00002, 547);
  const TrajectoryFile comma = read("time;lat;lon;height\n0;48,5;11,25;547,5\n1;48,5;11,25;547,5\n", "csv");
  EXPECT_NEAR(degrees(comma.trajectory.at(kStart).position.longitude_rad), 11.25, 1e-12);
  EXPECT_EQ(comma.trajectory.at(kStart).position.height_m, 547.5);
  EXPECT_EQ(read("time\tlat\tlon\tx\theight\n0\t48\t11\t3\t5\n", "csv").trajectory.end(), kStart);
}

// ECEF of the first line by the closed form: 35.274 deg, 137.014 deg, 100 m (as gps-sdr-sim's readme has it).
TEST(TrajectoryCases, EcefIsReadAndSaid) {
  const TrajectoryFile file = read_case("csv-ecef/motion.csv", "csv", {}, kCases);
  const Pose pose = file.trajectory.at(kCases);
  EXPECT_NEAR(degrees(pose.position.latitude_rad), 35.274, 5e-4);
  EXPECT_NEAR(degrees(pose.position.longitude_rad), 137.014, 1e-3);
  EXPECT_NEAR(pose.position.height_m, 100, 1);
  EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("ECEF")));
  const TrajectoryFile named = read("t,x,y,z\n0,-3813477.9,3554276.5,3662785.2\n", "csv");
  EXPECT_NEAR(named.trajectory.at(kStart).position.height_m, pose.position.height_m, 1e-6);
  EXPECT_THAT(named.warnings, ElementsAre());
  EXPECT_THAT(read_case("csv-ecef/as_advised.csv", "csv", {}, kCases).warnings,
              ElementsAre(HasSubstr("3663 km high")));
  EXPECT_THAT(fault("2051,46701,-3813477.9,3554276.5,3662785.2\n", "urbannav"), HasSubstr("ECEF x, y, z"));
  EXPECT_THAT(fault("time,lat,lon,h\n0,-3813477.9,3554276.5,3662785.2\n", "csv"), HasSubstr("ECEF x, y, z"));
  EXPECT_THAT(fault("t,x,y,z\n0,10,20,3\n", "csv"), HasSubstr("from the Earth's centre"));
}

TEST(TrajectoryCases, PausesAreSaidAndNotCovered) {
  const TrajectoryFile file = read_case("gpx-pause/pause.gpx", "gpx");
  EXPECT_THAT(file.warnings, testing::Contains(HasSubstr("pauses 1 time, at most 3591 s")));
  EXPECT_TRUE(file.trajectory.covers(kCases + 9));
  EXPECT_FALSE(file.trajectory.covers(kCases + 9.5));
  EXPECT_FALSE(file.trajectory.covers(kCases + 3599.9));
  EXPECT_TRUE(file.trajectory.covers(kCases + 3600));
  EXPECT_FALSE(file.trajectory.covers(kCases + 3700));
  std::string csv;
  for (int i = 0; i < 20; ++i)
    csv += std::to_string(i < 10 ? i : i + 600) + ",48.00" + std::to_string(10 + i) + ",11,5\n";
  EXPECT_THAT(read(csv, "csv").warnings, ElementsAre(HasSubstr("pauses 1 time, at most 601 s")));
}

TEST(TrajectoryCases, GpxHeightsTakeTheGeoid) {
  expect_path(read_case("gpx-geoidheight/t.gpx", "gpx"), kCases, 4, 48.00004, 547);
  EXPECT_THAT(read_case("gpx-geoidheight/t.gpx", "gpx").warnings, ElementsAre());
  const TrajectoryFile plain = read_case("gpx-pause/pause.gpx", "gpx", {true, 47});
  EXPECT_NEAR(plain.trajectory.at(kCases).position.height_m, 547, 1e-9);
  EXPECT_THAT(plain.warnings, testing::Contains(HasSubstr("geoid undulation, 47.0 m, is added")));
}

// Siblings of the cases: one wrong record among many.
TEST(TrajectoryCases, OneWrongRecordCostsOneRecord) {
  const auto lines = [](int wrong, const std::string& instead) {
    std::string csv;
    for (int i = 0; i < 20; ++i) {
      csv += i == wrong ? instead + "\n" : std::to_string(i) + ",48.00" + std::to_string(10 + i) + ",11,5\n";
    }
    return csv;
  };
  const auto sound = read(lines(-1, ""), "csv").trajectory;
  for (const char* wrong :
       {"7200,48.0017,11,5", "-3600,48.0017,11,5", "7,0,0,0", "7,49.5,11,5", "7,,,", "7,nan,nan,nan",
        "7,48.0017,11,-9999", "7,48.0017,11,1e20", "7,214.7483647,214.7483647,5", "6,48.0016,11,5",
        "7,91,11,5", "7,48.0017,x,5", "seven,48.0017,11,5", "7,48.0017", "7,48.0017,11,5,,", "7,48.0027,11,5",
        "7,48.0017,11,500", "1e9,48.0017,11,5"}) {
    SCOPED_TRACE(wrong);
    const TrajectoryFile file = read(lines(7, wrong), "csv");
    EXPECT_EQ(file.trajectory.begin(), sound.begin());
    EXPECT_EQ(file.trajectory.end(), sound.end());
    EXPECT_NEAR(file.trajectory.at(kStart + 7).position.latitude_rad,
                sound.at(kStart + 7).position.latitude_rad, 1e-9);
    EXPECT_NEAR(file.trajectory.at(kStart + 7).position.height_m, 5, 0.01);
    EXPECT_THAT(file.warnings,
                ElementsAre(testing::AllOf(HasSubstr("track.txt:8: "), HasSubstr("left out"))));
  }
  std::string ends = lines(0, "0,48.0110,11,5");
  EXPECT_EQ(read(ends, "csv").trajectory.begin(), kStart + 1);
  std::string log = "time,lat,lon,h\n2000-01-01T00:00:00Z,48.1,11,5\n";
  for (int i = 10; i < 30; ++i) log += "2024-05-01T10:00:" + std::to_string(i) + "Z,48.1,11,5\n";
  EXPECT_EQ(read(log, "csv").trajectory.begin(), kCases + 10);
  EXPECT_THAT(read(log, "csv").warnings, ElementsAre(HasSubstr("track.txt:2: point more than 100 days")));
}

TEST(TrajectoryCases, OneWrongSentenceCostsOneSentence) {
  const auto rmc = [](const std::string& time, const std::string& date, const char* status = "A") {
    return sentence("GNRMC," + time + "," + status + ",2218.06932,N,11410.74002,E,0.0,,"s + date + ",,,A");
  };
  std::string sound, wrong_date, wrong_time, joined, cut;
  for (int i = 10; i < 30; ++i) {
    const std::string time = "1200" + std::to_string(i);
    const std::string both = gga(time) + rmc(time, "280419");
    sound += both;
    wrong_date += gga(time) + rmc(time, i == 10 || i == 20 || i == 21 ? "280818" : "280419");
    wrong_time += i == 20 ? gga("154500") + rmc(time, "280419") : both;
    std::string line = both;
    line.erase(std::remove(line.begin(), line.end(), '\n'), line.end());
    line.erase(std::remove(line.begin(), line.end(), '\r'), line.end());
    joined += "12:00:" + std::to_string(i) + " [rx] " + line + " # end\n";
    cut += i == 20 ? gga(time).substr(0, 58) + "\n" + rmc(time, "280419") : both;
  }
  const GpsTime begin = parse_time("2019-04-28T12:00:10Z");
  for (const std::string& text : {sound, wrong_date, wrong_time, joined, cut}) {
    const TrajectoryFile file = read(text, "nmea", GpsTime{});
    EXPECT_EQ(file.trajectory.begin(), begin);
    EXPECT_DOUBLE_EQ(file.trajectory.end() - begin, 19);
    EXPECT_NEAR(file.trajectory.at(begin + 10).position.height_m, 9.5 - 2.9, 1e-9);
  }
  EXPECT_THAT(read(joined, "nmea", GpsTime{}).warnings, ElementsAre());
  EXPECT_THAT(read(cut, "nmea", GpsTime{}).warnings, ElementsAre(HasSubstr("damaged sentence")));
  // The clock of a receiver without a fix, by ZDA alone, and after a day.
  const auto zda = [](const std::string& time, const std::string& date) {
    return sentence("GPZDA," + time + "," + date + ",00,00");
  };
  std::string clock;
  for (int i = 0; i < 9; ++i)
    clock += gga("12000" + std::to_string(i), "0") + zda("12000" + std::to_string(i), "06,01,1980");
  for (int i = 10; i < 20; ++i)
    clock += gga("1200" + std::to_string(i)) + zda("1200" + std::to_string(i), "28,04,2019");
  EXPECT_EQ(read(clock, "nmea", GpsTime{}).trajectory.begin(), begin);
  std::string later;
  for (int i = 10; i < 30; ++i)
    later += gga("1200" + std::to_string(i)) + rmc("1200" + std::to_string(i), "300419");
  const TrajectoryFile days = read(sound + later, "nmea", GpsTime{});
  EXPECT_DOUBLE_EQ(days.trajectory.end() - begin, 2 * 86'400.0 + 19);
  EXPECT_THAT(days.warnings, ElementsAre());
}

// Headers and values give units, sides, clocks and fixes.
TEST(TrajectoryCsv, HeadersAndValuesAreUsed) {
  const std::pair<const char*, const char*> same[] = {
      {"t,lat [deg],lon [deg],altitude_ft", "0,-33.5,151.25,328.0839895"},
      {"t,latitude (rad),longitude (rad),height (km)", "0,-0.584685299418,2.639810493641,0.1"},
      {"time_ms,lat_e7,lon_e7,alt_mm", "0,-335000000,1512500000,100000"},
      {"timestampMillis,LatitudeDegrees,LongitudeDegrees,AltitudeMeters", "0,-33.5,151.25,100"},
      {"t,lat,N/S,lon,E/W,height", "0,33.5,S,151.25,E,100"},
      {"t,LATITUDE N/S,LONGITUDE E/W,height", "0,33.5S,151.25E,100"},
      {"t,lat,lon,height", "0,33\xC2\xB0 30' S,151 15.0 E,100"},
      {"t,lat_ddmm,lat_dir,lon_ddmm,lon_dir,h", "0,3330.0,S,15115.0,E,100"},
      {"t,lat,lon,alt_msl,geoid_height", "0,-33.5,151.25,78,22"},
      {"t,lat,lon,alt,ellipsoidal_height", "0,-33.5,151.25,78,100"},
      {"#height,lon,lat,time", "100,151.25,-33.5,0"},
      {"t;lat;lon;height", "0;-33,5;151,25;100,0"}};
  for (const auto& [header, line] : same) {
    SCOPED_TRACE(header);
    const TrajectoryFile file = read(std::string(header) + "\n" + line + "\n", "csv");
    const geodesy::Geodetic place = file.trajectory.at(kStart).position;
    EXPECT_EQ(file.trajectory.begin(), kStart);
    EXPECT_NEAR(degrees(place.latitude_rad), -33.5, 1e-9);
    EXPECT_NEAR(degrees(place.longitude_rad), 151.25, 1e-9);
    EXPECT_NEAR(place.height_m, 100, 1e-5);
    EXPECT_THAT(file.warnings, ElementsAre());
  }
  EXPECT_THAT(read("t,lat,lon,alt_msl\n0,48,11,5\n", "csv").warnings, ElementsAre(HasSubstr("sea level")));
  EXPECT_EQ(read("gpst,lat,lon,h\n2019-04-28T12:58:21,48,11,5\n", "csv").trajectory.begin(), kStart);
  EXPECT_EQ(read("date,time,lat,lon,h\n2019/04/28,125803,48,11,5\n", "csv").trajectory.begin(), kStart);
  EXPECT_THAT(fault("utc,lat,lon,h\n125803,48,11,5\n", "csv"),
              testing::AllOf(HasSubstr("'125803' in column 'utc'"), HasSubstr("rename the column time_s")));
  for (const char* other : {"date,time_s,lat,lon,h\n28.04.19,0,48,11,5\n",
                            "date,time,lat,lon,h\n28.04.19,2019-04-28T12:58:21 GPST,48,11,5\n"})
    EXPECT_EQ(read(other, "csv").trajectory.begin(), kStart) << other;
  EXPECT_THAT(fault("date,time,lat,lon,h\n28.04.19,125803,48,11,5\n", "csv"), HasSubstr("known forms"));
  EXPECT_THAT(fault("t,lat_rad,lon_rad,h\n0,48,11,5\n", "csv"),
              HasSubstr("48 in column 'lat_rad' is 2750.2 deg"));
  EXPECT_THAT(fault("t,lat_furlong,lon,h\n0,48,11,5\n", "csv"), HasSubstr("no column 'latitude'"));
  EXPECT_THAT(fault("t,lat,lon,height_above_ground\n0,48,11,5\n", "csv"), HasSubstr("no column 'height'"));
  EXPECT_THAT(fault("t,lat,NS,lon,h\n0,-48,N,11,5\n", "csv"), HasSubstr("'-48' with the side 'N'"));
  EXPECT_THAT(fault("t,lat,lon,h\n0,48,5,11,25,547,5\n", "csv"), HasSubstr("decimal commas"));
  EXPECT_THAT(fault("0,48,5,11,25,547,5\n", "csv"), HasSubstr("decimal commas"));
}

TEST(TrajectoryCsv, ColumnsOfFixesAreHeard) {
  for (const auto& [name, none, good] :
       {std::tuple("fix", "0", "1"), std::tuple("fix_type", "1", "3"), std::tuple("valid", "false", "true"),
        std::tuple("status", "-1", "0"), std::tuple("status", "V", "A")}) {
    std::string text = std::string("t,lat,lon,h,") + name + "\n";
    for (int i = 0; i < 9; ++i)
      text += std::to_string(i) + ",48.00" + std::to_string(10 + i) + ",11,5," + (i < 3 ? none : good) + "\n";
    const TrajectoryFile file = read(text, "csv");
    EXPECT_EQ(file.trajectory.begin(), kStart + 3) << name;
    EXPECT_THAT(
        file.warnings,
        ElementsAre(HasSubstr("track.txt:2: line without a fix, by the file's own column (the first of 3)")))
        << name;
  }
  EXPECT_THAT(fault("t,lat,lon,h,fix\n0,48,11,5,none\n", "csv"), HasSubstr("none of 1 lines has a fix"));
}

// A straight way north, one point a second: what each kind of file says of it.
constexpr int kStraight = 10;
std::string straight_line(int i, const char* pattern) {
  return fmt::format(fmt::runtime(pattern), fmt::arg("i", i), fmt::arg("lat", 48 + 1e-4 * i),
                     fmt::arg("min", 0.006 * i));
}
std::string straight(const char* pattern) {
  std::string text;
  for (int i = 0; i < kStraight; ++i) text += straight_line(i, pattern);
  return text;
}
void expect_straight(const TrajectoryFile& file, double height_m, int first = 0) {
  const Trajectory& path = file.trajectory;
  EXPECT_NEAR(path.end() - path.begin(), kStraight - 1 - first, 1e-6);
  for (int i = first; i < kStraight; ++i) {
    const geodesy::Geodetic place = path.at(path.begin() + (i - first)).position;
    EXPECT_NEAR(degrees(place.latitude_rad), 48 + 1e-4 * i, 1e-7);
    EXPECT_NEAR(degrees(place.longitude_rad), 11, 1e-7);
    EXPECT_NEAR(place.height_m, height_m, 1e-6);
  }
}

TEST(TrajectoryNmea, OtherSentencesHavePlacesWhereNoGgaHas) {
  const std::string rmc = "$GPRMC,10001{i},A,48{min:07.4f},N,01100.0000,E,22.4,0.0,010524,,,A\n";
  expect_straight(
      read(straight(("$GNGNS,10001{i},48{min:07.4f},N,01100.0000,E,AN,08,0.9,500.0,47.0,,\n" + rmc).c_str()),
           "nmea"),
      547);
  const TemporaryFolder folder;
  HeightReading flat;
  flat.needed = false;
  const TrajectoryFile file =
      read_trajectory_file(folder.write("a.nmea", straight(rmc.c_str())), "nmea", {}, flat);
  EXPECT_EQ(file.trajectory.begin(), parse_time("2024-05-01T10:00:10Z"));
  expect_straight(file, 0);
  expect_straight(read_trajectory_file(
                      folder.write("b.nmea", straight("$GPGLL,48{min:07.4f},N,01100.0000,E,10001{i},A,A\n")),
                      "nmea", kStart, flat),
                  0);
  EXPECT_THAT(fault(straight(rmc.c_str()), "nmea"), HasSubstr("none of its 10 fixes has an altitude"));
  EXPECT_THAT(fault("$GPGSV,1,1,01,02,10,100,40\n", "nmea"),
              HasSubstr("no GNS, RMC or GLL sentence with a fix"));
}

TEST(TrajectoryNmea, AVoidSentenceOfTheSameTimeIsHeard) {
  std::string text;
  for (int i = 0; i < kStraight; ++i) {
    text += straight_line(i, "$GPGGA,10001{i},48{min:07.4f},N,01100.0000,E,1,00,0.9,500.0,M,47.0,M,,\n");
    text += straight_line(i, i < 3 ? "$GPRMC,10001{i},V,48{min:07.4f},N,01100.0000,E,,,010524,,,N\n"
                                   : "$GPRMC,10001{i},A,48{min:07.4f},N,01100.0000,E,,,010524,,,A\n");
  }
  const TrajectoryFile file = read(text, "nmea");
  expect_straight(file, 547, 3);
  EXPECT_THAT(file.warnings,
              ElementsAre(HasSubstr("of an instant that RMC or GLL calls void (the first of 3)"),
                          HasSubstr("with a fix of 0 satellites (the first of 7); it is taken")));
}

TEST(TrajectoryNmea, ALeapSecondIsAnInstant) {
  std::string text = "$GPRMC,235955,A,4800.0000,N,01100.0000,E,,,311216,,,A\n";
  const char* times[] = {"235957", "235958", "235959", "235960", "000000", "000001"};
  for (const char* time : times)
    text += fmt::format("$GPGGA,{},4800.0000,N,01100.0000,E,1,10,0.9,500.0,M,47.0,M,,\n", time);
  const TrajectoryFile file = read(text, "nmea");
  EXPECT_THAT(file.warnings, ElementsAre());
  // 17 leap seconds before that one, 18 behind it.
  EXPECT_EQ(file.trajectory.begin(), parse_time("2017-01-01T00:00:14 GPST"));
  EXPECT_EQ(file.trajectory.end(), parse_time("2017-01-01T00:00:19 GPST"));
}

TEST(TrajectoryNmea, GsaSaysHowManyDimensionsAFixHas) {
  std::string text;
  for (int i = 0; i < kStraight; ++i) {
    const bool first = i < 3, flat = i == 3;
    text +=
        straight_line(i, flat ? "$GNGGA,10001{i},48{min:07.4f},N,01100.0000,E,1,08,0.9,0.0,M,47.0,M,,\n"
                              : "$GNGGA,10001{i},48{min:07.4f},N,01100.0000,E,1,08,0.9,500.0,M,47.0,M,,\n");
    // One without satellites of a system says nothing of the fix.
    text += first ? "$GNGSA,A,1,,,,,,,,,,,,,99.9,99.9,99.9\n" : "$GNGSA,A,1,,,,,,,,,,,,,1.9,0.9,1.7\n";
    if (!first) text += fmt::format("$GNGSA,A,{},01,02,03,,,,,,,,,,1.9,0.9,1.7\n", flat ? 2 : 3);
  }
  const TrajectoryFile file = read(text, "nmea");
  expect_straight(file, 547, 4);
  EXPECT_THAT(file.warnings,
              ElementsAre(HasSubstr("of an instant that GSA calls without a fix (the first of 3)"),
                          HasSubstr("GGA sentence without an altitude")));
}

TEST(TrajectoryNmea, ValuesThatStandForNone) {
  const std::string line = "$GPGGA,10001{i},48{min:07.4f},N,01100.0000,E,1,08,99.99,500.0,M,0.0,M,,\n";
  HeightReading heights;
  heights.geoid_undulation_m = 47;
  const TemporaryFolder folder;
  const TrajectoryFile file =
      read_trajectory_file(folder.write("a.nmea", straight(line.c_str())), "nmea", kStart, heights);
  EXPECT_THAT(file.warnings,
              ElementsAre(HasSubstr("dilution of precision of 50 or more (the first of 10)"),
                          HasSubstr("a geoid separation of 0 (the first of 10); its altitude is "
                                    "taken as ellipsoidal height; the city's")));
}

TEST(TrajectoryCsv, HeadersStandAnywhere) {
  const std::string line = "2024-05-01T10:00:1{i}Z,{lat:.7f},11,500\n";
  const std::string header = "time,latitude,longitude,height\n";
  expect_straight(read("My flight log\n\n" + header + straight(line.c_str()), "csv"), 500);
  expect_straight(read("// a comment\n" + header + straight(line.c_str()), "csv"), 500);
  std::string joined = header, returns = header + straight(line.c_str());
  for (int i = 0; i < kStraight; ++i) {
    if (i == 4) joined += "time,longitude,latitude,height\n";
    joined += straight_line(i, i < 4 ? line.c_str() : "2024-05-01T10:00:1{i}Z,11,{lat:.7f},500\n");
  }
  expect_straight(read(joined, "csv"), 500);
  std::replace(returns.begin(), returns.end(), '\n', '\r');
  expect_straight(read(returns, "csv"), 500);
}

TEST(TrajectoryCsv, UnixTimesAndRadiansByTheirNames) {
  const TrajectoryFile file = read(
      "unix_time_ms,latitude,longitude,height\n" + straight("171455761{i}000,{lat:.7f},11,500\n"), "csv", {});
  EXPECT_EQ(file.trajectory.begin(), parse_time("2024-05-01T10:00:10Z"));
  expect_straight(file, 500);
  EXPECT_THAT(fault("unix_time_s,latitude,longitude,height\n1714557610000,48,11,500\n", "csv"),
              HasSubstr("is not a Unix time of 1970 to 2100"));
  EXPECT_THAT(read("0,0.837,0.192,500\n1,0.837,0.192,500\n", "csv").warnings,
              ElementsAre(HasSubstr("if they are radians, name the columns latitude_rad")));
}

TEST(TrajectoryFile, LeapsAreSaid) {
  std::string text = straight("1{i},{lat:.7f},11,500\n");
  for (int i = 0; i < 4; ++i) text = fmt::format("{},48,11,0\n", 9 - i) + text;
  EXPECT_THAT(read(text, "csv").warnings, ElementsAre(HasSubstr("the path leaps 500 m in 1 s to here")));
}

TEST(TrajectoryTracks, ExtensionsPointsAndParts) {
  const auto gpx = [](const std::string& points) {
    return "<gpx><trk><trkseg>" + points + "</trkseg></trk></gpx>";
  };
  const std::string point =
      "<trkpt lat='{lat:.7f}' lon='11'><ele>500</ele><time><![CDATA[2024-05-01T10:00:1{i}Z]]></time>"
      "<extensions><ele>9</ele><time>2001-01-01T00:00:00Z</time></extensions></trkpt>";
  expect_straight(read(gpx(straight(point.c_str())), "gpx"), 500);
  const std::string placemark =
      "<Placemark><TimeStamp><when>2024-05-01T10:00:1{i}Z</when></TimeStamp>"
      "<Point><coordinates>11,{lat:.7f},500</coordinates></Point></Placemark>";
  expect_straight(read("<kml><Document>" + straight(placemark.c_str()) + "</Document></kml>", "kml"), 500);
  const TemporaryFolder folder;
  const auto path =
      folder.write("a.gpx", gpx("<trkpt lat='48' lon='11'/></trkseg><trkseg><trkpt lat='48.01' lon='11'/>"));
  EXPECT_THAT(read_track_file(path, "gpx", {}).notes.lines(),
              Contains(HasSubstr("2 segments without times: they are joined straight, over at most 1112 m")));
}

TEST(TrajectoryFile, DamagedFilesAreReadOrRefused) {
  const TemporaryFolder folder;
  const std::string csv =
      "time,latitude,longitude,height\n2019-04-28T12:58:03Z,22.30,114.17,5.5\n"
      "2019-04-28T12:58:04Z,22.31,114.17,5.5\n2019-04-28T12:58:05Z,22.32,114.17,5.5\n";
  const std::string urbannav = "2051,46701,22.30115538,114.17900033,6.59\n2051,46702,22.3,114.17,6.58\n";
  const std::string nmea = sentence("GNRMC,235959.00,A,2218.06932,N,11410.74002,E,0.0,,280419,,,A") +
                           gga("235959.50") + gga("000000.50") +
                           "$GPGGA,000001,2218.0,N,11410.7,E,1,08,0.9,9.5,M,1,M,,\n";
  const std::string alphabet = ",.-:*$NSEWMTZ0123456789 \n\r\"e\xff";
  std::uint32_t state = 7;
  const auto random = [&state](std::size_t n) {
    state = state * 1664525U + 1013904223U;
    return static_cast<std::size_t>(state >> 8) % n;
  };
  const std::pair<std::string, std::string> files[] = {{"csv", csv}, {"urbannav", urbannav}, {"nmea", nmea}};
  for (const auto& [format, original] : files) {
    for (int round = 0; round < 150; ++round) {
      std::string text = original;
      for (std::size_t k = 0; k <= random(3); ++k) {
        const std::size_t at = random(text.size());
        if (random(3) == 0) {
          text.erase(at, 1 + random(15));
        } else {
          text[at] = alphabet[random(alphabet.size())];
        }
        if (text.empty()) break;
      }
      const auto path = folder.write("t", text);
      try {
        const Trajectory t = read_trajectory(path, format, kStart);
        EXPECT_LE(t.begin(), t.end());
      } catch (const InputError& e) {
        EXPECT_FALSE(e.problem().empty());
      }
    }
  }
}

}  // namespace
}  // namespace canyon::simulation::trajectory_file_test
