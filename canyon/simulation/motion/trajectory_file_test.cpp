#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/simulation/motion/nmea_fixes.hpp"
#include "canyon/simulation/motion/recorded_path.hpp"
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
const GpsTime kCases = parse_time("2024-05-01T10:00:00Z");

TrajectoryFile read(const std::string& text, const std::string& format, GpsTime start = kStart) {
  const TemporaryFolder folder;
  return read_trajectory_file(folder.write("track.txt", text), format, start);
}

// what() without the folder.
std::string fault(const std::string& text, const std::string& format, GpsTime start = kStart) {
  const TemporaryFolder folder;
  const auto path = folder.write("track.txt", text);
  const std::string what = error_of([&] { (void)read_trajectory_file(path, format, start); }).what();
  const std::size_t at = what.find("track.txt");
  return at == std::string::npos ? what : what.substr(at);
}

constexpr const char* kHeader = "time,latitude,longitude,height\n";

TEST(TrajectoryCsv, ReadsDatesOfAnyZone) {
  const TrajectoryFile file = read(
      "time,latitude,longitude,height\n"
      "2019-04-28T12:58:03Z,22.30,114.17,5.5\n"
      "2019-04-28T12:58:04.5Z, 22.31 ,114.18,6\r\n"
      "\n# a comment\n"
      "2019-04-28T12:58:24 GPST,22.32,114.19,7\n",
      "csv", GpsTime{});
  EXPECT_TRUE(file.is_dated);
  EXPECT_EQ(file.trajectory.begin(), parse_time("2019-04-28T12:58:03Z"));
  EXPECT_EQ(file.trajectory.end(), parse_time("2019-04-28T12:58:06Z"));
  const Pose pose = file.trajectory.at(parse_time("2019-04-28T12:58:04.5Z"));
  EXPECT_NEAR(degrees(pose.position.latitude_rad), 22.31, 1e-12);
  EXPECT_NEAR(degrees(pose.position.longitude_rad), 114.18, 1e-12);
  EXPECT_EQ(pose.position.height_m, 6);
  EXPECT_THAT(file.report.lines(), ElementsAre());
  EXPECT_THAT(read(std::string(kHeader) + "2019-04-28T12:58:03,22.3,114.17,5\n", "csv").report.warnings(),
              ElementsAre(HasSubstr("track.txt:2: time without time zone; taken as UTC")));
}

// 33.5 S, 151.25 E, 100 m in each unit that a name may have.
TEST(TrajectoryCsv, NamesOfColumnsHaveUnits) {
  for (const auto& [header, line] : std::initializer_list<std::pair<const char*, const char*>>{
           {"speed,lon_deg,Lat_deg,height_m,time_s", "3,151.25,-33.5,100,0"},
           {"time [ms],lat [deg],lon [deg],height (ft)", "0,-33.5,151.25,328.0839895"},
           {"time_us,latitude (rad),longitude (rad),height (km)", "0,-0.584685299418,2.639810493641,0.1"},
           {"time_ns,lat_e7,lon_e7,height_mm", "0,-335000000,1512500000,100000"},
           {"time;lat;lon;height", "0;-33,5;151,25;100,0"},
           {"time\tlat\tlon\tx\theight", "0\t-33.5\t151.25\t3\t100"},
           {"\"time\",\"lat\",\"lon\",\"height\"", "\"0\",-33.5,151.25,\"100\","}}) {
    SCOPED_TRACE(header);
    const TrajectoryFile file = read(std::string(header) + "\n" + line + "\n", "csv");
    const geodesy::Geodetic geodetic = file.trajectory.at(kStart).position;
    EXPECT_FALSE(file.is_dated);
    EXPECT_EQ(file.trajectory.begin(), kStart);
    EXPECT_NEAR(degrees(geodetic.latitude_rad), -33.5, 1e-9);
    EXPECT_NEAR(degrees(geodetic.longitude_rad), 151.25, 1e-9);
    EXPECT_NEAR(geodetic.height_m, 100, 1e-5);
    EXPECT_THAT(file.report.lines(), ElementsAre());
  }
  EXPECT_THAT(read("time,lat,lon,height_msl\n0,48,11,5\n", "csv").report.warnings(),
              ElementsAre(HasSubstr("height above sea level by its column; taken as ellipsoidal")));
}

// Canyon's own table: the path is the true one, also at epochs without a fix.
TEST(TrajectoryCsv, ReadsEpochsOfARun) {
  const TrajectoryFile file = read(
      "gps_week,gps_tow,fix_latitude_deg,fix_longitude_deg,fix_height_m,status,true_latitude_deg,"
      "true_longitude_deg,true_height_m\n"
      "2312,295200,48.1,11.5,560,none,48.2,11.6,547\n2312,295201,48.1,11.5,560,1,48.2,11.6,547\n",
      "");
  EXPECT_EQ(file.trajectory.begin(), parse_time("2024-05-01T10:00:00 GPST"));
  EXPECT_NEAR(degrees(file.trajectory.at(file.trajectory.begin()).position.latitude_rad), 48.2, 1e-12);
}

TEST(TrajectoryCsv, ColumnsOfOtherNamesAreNamed) {
  const auto with = [](const TrajectoryColumns& columns, const std::string& text) {
    const TemporaryFolder folder;
    return read_trajectory_file(folder.write("track.txt", text), "csv", kStart, {}, columns).trajectory;
  };
  const auto refused = [&](const TrajectoryColumns& columns, const std::string& text) {
    return std::string(error_of([&] { (void)with(columns, text); }).what());
  };
  const std::string odd = "stamp,N,E,alt_mm\n250,0.8377580409572782,0.1919862177193762,547000\n";
  const TrajectoryColumns columns{
      {"time", "stamp [ms]"}, {"latitude", "N [rad]"}, {"longitude", "E [rad]"}, {"height", "alt_mm"}};
  const Pose pose = with(columns, odd).at(kStart);
  EXPECT_EQ(with(columns, odd).begin(), kStart + 0.25);
  EXPECT_NEAR(degrees(pose.position.latitude_rad), 48, 1e-9);
  EXPECT_NEAR(pose.position.height_m, 547, 1e-9);
  // Motion files of gps-sdr-sim have no header.
  EXPECT_NEAR(with({{"time", "1 [s]"}, {"x", "2 [m]"}, {"y", "3 [m]"}, {"z", "4 [m]"}},
                   "0,-3813477.9,3554276.5,3662785.2\n")
                  .at(kStart)
                  .position.height_m,
              100, 1);
  TrajectoryColumns wrong = columns;
  wrong["latitude"] = "N";
  EXPECT_THAT(refused(wrong, odd),
              testing::AllOf(HasSubstr("trajectory.columns.latitude: the unit of 'N' is missing"),
                             HasSubstr("'N [deg]', or rad, e7")));
  wrong["latitude"] = "lat [rad]";
  EXPECT_THAT(refused(wrong, odd), HasSubstr("no column 'lat [rad]'; there are 'stamp', 'N', 'E', 'alt_mm'"));
  wrong = columns;
  wrong["time"] = "stamp";
  EXPECT_THAT(refused(wrong, odd), HasSubstr("the unit of the time '250' is missing"));
  wrong.erase("longitude");
  EXPECT_THAT(refused(wrong, odd), HasSubstr("no column 'longitude'"));
}

// As written by simulators: texts above the header, weeks in cycles of 1,024, radians next to ECEF.
TEST(TrajectoryCsv, ReadsTablesOfSimulators) {
  const std::string ecef = "-481819.3135,5507219.9538,3170373.7354", rad = "0.523598775598,1.658062789395,0";
  for (const std::string& text : std::initializer_list<std::string>{
           {"# Motion\ntime,x,y,z,lat,lon,height\n0," + ecef + "," + rad + "\n"},
           {"Motion log\nTime_ms,Pos_X,Pos_Y,Pos_Z,Lat,Long,Height\n0," + ecef + "," + rad + "\n"},
           {"Motion, of a vehicle\n\nVersion 2\ntime,lat_rad,lon_rad,height\n0," + rad + "\n"},
           {"Time [s],GpsCycle,GpsWeek,GpsTow [s],Latitude [deg],Longitude [deg],Height [m]\n"
            "0,2,196,36000,30,95,0\n"}}) {
    SCOPED_TRACE(text);
    const TrajectoryFile file = read(text, "csv", parse_time("2023-01-08T10:00:00 GPST"));
    EXPECT_EQ(file.trajectory.begin(), parse_time("2023-01-08T10:00:00 GPST"));
    const Pose pose = file.trajectory.at(file.trajectory.begin());
    EXPECT_NEAR(degrees(pose.position.latitude_rad), 30, 1e-5);
    EXPECT_NEAR(degrees(pose.position.longitude_rad), 95, 1e-5);
    EXPECT_THAT(file.report.warnings(), ElementsAre());
  }
  EXPECT_THAT(read("time,lat,lon,height\n0," + rad + "\n", "csv").report.warnings(),
              ElementsAre(HasSubstr("may be radians; taken as degrees")));
  EXPECT_THAT(fault("gps_week,gps_tow,lat,lon,height\n196,1,48,11,500\n", "csv"), HasSubstr("gps_cycle"));
  EXPECT_THAT(fault("timestamp,lat,lng,altitude\n12.5," + rad + "\n", "csv"), HasSubstr("\"lng [rad]\""));
  EXPECT_THAT(fault("timestamp,lat,Longitude [deg],altitude\n12.5,48,11,500\n", "csv"),
              HasSubstr("trajectory.columns: {time: \"timestamp [s]\", latitude: \"lat [deg]\", longitude: "
                        "\"Longitude [deg]\", height: \"altitude [m]\"}"));
}

TEST(TrajectoryCsv, SaysWhatIsWrongAndWhere) {
  const std::string header = kHeader;
  EXPECT_THAT(fault(header + "0,22.3,114.17,x\n", "csv"),
              HasSubstr("track.txt:2: the height 'x' is not a number"));
  EXPECT_THAT(fault(header + "0,22.3,114.17,1\n1,2218.5,114.17,1\n", "csv"),
              HasSubstr("track.txt:3: the latitude 2218.5 deg is out of range"));
  EXPECT_THAT(
      fault("0,22.3,114.17,1\n", "csv"),
      testing::AllOf(HasSubstr("track.txt:1: has no header: its first line is the numbers '0', '22.3'"),
                     HasSubstr("trajectory.columns: {time: \"1 [s]\", latitude:")));
  EXPECT_THAT(fault("0,-3813477.9,3554276.5,3662785.2\n", "csv"),
              testing::AllOf(HasSubstr("look like ECEF x, y, z in metres"), HasSubstr("x: \"2 [m]\"")));
  EXPECT_THAT(fault("time,x,y,z\n0,-3813.4779,3554.2765,3662.7852\n", "csv"), HasSubstr("are 6371.15 m"));
  EXPECT_THAT(fault("time,latitude,height\n1,2,3\n", "csv"), HasSubstr("no column 'longitude'"));
  EXPECT_THAT(fault("time,latitude,lat_rad,longitude,height\n", "csv"),
              HasSubstr("the columns 'latitude' and 'lat_rad' are both the latitude"));
  EXPECT_THAT(fault("time,latitude,longitude,height\ns,rad,rad,m\n0,0.8,0.2,5\n1,0.8,0.2,5\n", "csv"),
              testing::AllOf(HasSubstr("track.txt:2: 'rad' below the header is not a number"),
                             HasSubstr("latitude_rad")));
  EXPECT_THAT(fault(header + "1975-06-01T00:00:00Z,22.3,114.17,1\n", "csv"), HasSubstr("no line has a time"));
  EXPECT_THAT(fault(header + "0,22.3,114.17\n", "csv"), HasSubstr("3 columns, but the first line has 4"));
  EXPECT_THAT(fault(header + "3,22.3,114.17,1\n2,22.3,114.17,1\n1,22.3,114.17,1\n", "csv"),
              HasSubstr("the times of 2 of 3 points are out of order; sort the points by time"));
  EXPECT_THAT(fault(header + "0,22.3,114.17,1\n2019-04-28T12:58:05Z,22.3,114.17,1\n", "csv"),
              HasSubstr("another format"));
  EXPECT_THAT(fault(header + "yesterday,22.3,114.17,1\n", "csv"), HasSubstr("'yesterday' is not a time"));
  EXPECT_THAT(fault(header + "0,22.3,114.17,1\n", "csv", GpsTime{}), HasSubstr("no start"));
  EXPECT_THAT(fault(header + "15564562,22.3,114.17,1\n", "csv"), HasSubstr("unix_time_ms"));
  EXPECT_THAT(fault("unix_time_s,lat,lon,height\n1714557610000,48,11,500\n", "csv"),
              HasSubstr("is not a Unix time"));
  EXPECT_THAT(fault("gps_week,gps_tow,lat,lon,height\n2312.5,1,48,11,500\n", "csv"),
              HasSubstr("GPS week '2312.5'"));
  EXPECT_THAT(fault("time,x,y,z\n0,10,20,3\n", "csv"), HasSubstr("from the Earth's centre"));
  EXPECT_THAT(fault("\n", "csv"), HasSubstr("no position"));
  EXPECT_THAT(fault(header, "csv"), HasSubstr("no line has a time, a position and a height"));
  EXPECT_THAT(fault(header + "0,22.3,114.17,1\n", "igc"), HasSubstr("'igc' is unknown"));
  EXPECT_THAT(error_of([] { (void)read_trajectory_file("/nowhere/track.csv", "csv", kStart); }).what(),
              HasSubstr("/nowhere/track.csv"));
}

// A record without values is skipped; a damaged one is lost and reported.
TEST(TrajectoryCsv, OneWrongRecordCostsOneRecord) {
  for (const auto& [wrong, configured] :
       std::initializer_list<std::pair<const char*, bool>>{{"7,,,", true},
                                                           {"7,nan,nan,nan", true},
                                                           {"7,91,11,5", true},
                                                           {"7,48.0017,x,5", true},
                                                           {"seven,48.0017,11,5", true},
                                                           {"7,48.0017", true},
                                                           {"5,48.0017,11,5", true},
                                                           {"6,48.0017,11,5", true},
                                                           {"6,48.0016,11,5", false}}) {
    SCOPED_TRACE(wrong);
    std::string text = kHeader;
    for (int i = 0; i < 20; ++i)
      text += i == 7 ? wrong + "\n"s : std::to_string(i) + ",48.00" + std::to_string(10 + i) + ",11,5\n";
    const TrajectoryFile file = read(text, "csv");
    EXPECT_EQ(file.trajectory.end(), kStart + 19);
    EXPECT_NEAR(degrees(file.trajectory.at(kStart + 7).position.latitude_rad), 48.0017, 1e-9);
    EXPECT_THAT(file.report.lines(),
                ElementsAre(testing::AllOf(HasSubstr("track.txt:9: "), HasSubstr("left out"))));
    EXPECT_EQ(file.report.warnings().size(), configured ? 1U : 0U);
  }
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
  const Trajectory t = read_trajectory_file(path, "urbannav", GpsTime{}).trajectory;
  EXPECT_EQ(t.begin(), GpsTime::from_week(2051, 46701));
  EXPECT_EQ(t.end(), GpsTime::from_week(2051, 47185));
  EXPECT_EQ(t.sample_interval_s(), 1);
  EXPECT_NEAR(degrees(t.at(t.end()).position.latitude_rad), 22.29993245, 1e-12);
  EXPECT_NEAR(degrees(t.at(t.end()).position.longitude_rad), 114.17981121, 1e-12);
  EXPECT_EQ(t.at(t.end()).position.height_m, 6.77868981);
}

// RTKLIB's solution files (manual 2.4.2, appendix B).
TEST(TrajectoryRtklib, ReadsItsDialects) {
  const std::string header =
      "% program   : RTKPOST ver.2.4.3\n"
      "% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=# of "
      "satellites)\n";
  const std::string degrees_header = "latitude(deg) longitude(deg)  height(m)   Q  ns\n";
  for (const std::string& text :
       {header + "%  GPST  " + degrees_header + "2024/05/01 10:00:18.000  -48.125 11.51  547.0  5  8\n",
        header + "%  UTC   " + degrees_header + "2024/05/01 10:00:00.000  -48.125 11.51  547.0  5  8\n",
        header + "%  JST   " + degrees_header + "2024/05/01 19:00:00.000  -48.125 11.51  547.0  5  8\n",
        header + "%  GPST  " + degrees_header + "2312 295218.000  -48.125 11.51  547.0  5  8\n",
        header + "%  UTC,latitude(deg),longitude(deg),height(m),Q,ns\n"
                 "2024/05/01 10:00:00.000,-48.125,11.51,547.0,5,8\n",
        header + "%  GPST  latitude(d'\")   longitude(d'\")  height(m)   Q  ns\n"
                 "2024/05/01 10:00:18.000  -48 07 30.00000  11 30 36.00000  547.0  5  8\n"}) {
    SCOPED_TRACE(text);
    const TrajectoryFile file = read(text, "", {});
    EXPECT_EQ(file.trajectory.begin(), kCases);
    const geodesy::Geodetic geodetic = file.trajectory.at(kCases).position;
    EXPECT_NEAR(degrees(geodetic.latitude_rad), -48.125, 1e-11);
    EXPECT_NEAR(degrees(geodetic.longitude_rad), 11.51, 1e-11);
    EXPECT_NEAR(geodetic.height_m, 547, 1e-9);
    EXPECT_THAT(file.report.lines(), ElementsAre());
  }
  EXPECT_THAT(read("% (lat/lon/height=WGS84/geodetic,Q=1:fix)\n%  GPST  " + degrees_header +
                       "2312 295218.000  -48.125 11.51  547.0  5  8\n",
                   "rtklib", {})
                  .report.warnings(),
              ElementsAre(HasSubstr("height above sea level by the header")));
  EXPECT_THAT(fault("%  GPST  e-baseline(m)  n-baseline(m)  u-baseline(m)   Q  ns\n"
                    "2024/05/01 10:00:00.000  10.0000  20.0000  1.0000  1  10\n",
                    "rtklib"),
              HasSubstr("is a baseline"));
}
TEST(TrajectoryRtklib, ReadsTheRealDrive) {
  CANYON_SHARED_DATA(path, "ubx-longmont-20250828/gnss_1730_sf.pos");
  const TrajectoryFile file = read_trajectory_file(path, "", {});
  EXPECT_EQ(file.trajectory.begin(), parse_time("2025-08-28T17:30:39.749 GPST"));
  EXPECT_THAT(file.report.lines(), ElementsAre());
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
  EXPECT_FALSE(file.is_dated);
  const Pose pose = file.trajectory.at(file.trajectory.begin());
  EXPECT_EQ(pose.time, parse_time("2019-04-28T12:35:19Z"));
  EXPECT_NEAR(degrees(pose.position.latitude_rad), 48 + 7.038 / 60, 1e-12);
  EXPECT_NEAR(degrees(pose.position.longitude_rad), 11 + 31.0 / 60, 1e-12);
  EXPECT_NEAR(pose.position.height_m, 545.4 + 46.9, 1e-9);
}

// Only the positions of the trajectory.
TEST(TrajectoryNmea, FixesAreThoseOfTheLines) {
  const TemporaryFolder folder;
  const RecordedPath own =
      read_nmea(folder.write("own.nmea", gga("120000") + gga("120001", "0") + gga("120009")), kStart);
  ASSERT_EQ(own.points.size(), 2U);
  EXPECT_FALSE(own.is_dated);
  EXPECT_THAT(own.report.lines(), ElementsAre(HasSubstr("GGA sentence without a fix; left out")));
  EXPECT_EQ(own.points[1].time, parse_time("2019-04-28T12:00:09Z"));
  EXPECT_NEAR(degrees(own.points[1].position.latitude_rad), 22 + 18.06932 / 60, 1e-12);
  EXPECT_NEAR(own.points[1].position.height_m, 9.5 - 2.9, 1e-9);
}

TEST(TrajectoryNmea, NamesTheObservationsOfUbxBesideIt) {
  const TrajectoryFile file =
      read(gga("120000") + "\xB5\x62\x02\x15\n" + gga("120001"), "nmea", parse_time("2019-04-28T00:00:00Z"));
  EXPECT_THAT(file.report.lines(), ElementsAre(HasSubstr("convbin -r ubx")));
}

TEST(TrajectoryNmea, OneGgaSentenceHasAPlace) {
  const auto position = position_of_gga(gga("120000"));
  ASSERT_TRUE(position);
  EXPECT_NEAR(degrees(position->latitude_rad), 22 + 18.06932 / 60, 1e-12);
  EXPECT_NEAR(degrees(position->longitude_rad), 114 + 10.74002 / 60, 1e-12);
  EXPECT_NEAR(position->height_m, 9.5 - 2.9, 1e-9);
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
    EXPECT_TRUE(file.is_dated);
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
  EXPECT_THAT(
      file.report.lines(),
      ElementsAre(HasSubstr("damaged sentence (cut short, or with a wrong checksum) (the first of 2)"),
                  HasSubstr("GGA sentence without a fix; left out")));
  EXPECT_EQ(file.report.warnings().size(), 1U);
  const TrajectoryFile flat = read(sentence("GPGGA,120000,2218.0,N,11410.7,E,1,08,0.9,9.5,M,,,,") +
                                       sentence("GPGGA,120001,2218.0,N,11410.7,E,1,08,0.9,9.5,M,,,,"),
                                   "nmea");
  EXPECT_THAT(flat.report.warnings(),
              ElementsAre(HasSubstr("altitude without a geoid separation (the first of 2)")));
}

TEST(TrajectoryNmea, SaysWhatIsWrong) {
  EXPECT_THAT(fault(kGga, "nmea", GpsTime{}), HasSubstr("no RMC or ZDA"));
  EXPECT_THAT(fault("hello\n", "nmea"), HasSubstr("no GGA, GNS, RMC or GLL sentence with a fix"));
  EXPECT_THAT(fault(gga("120000", "0"), "nmea"), HasSubstr("with a fix"));
  EXPECT_THAT(fault(gga("250000"), "nmea"), HasSubstr("'250000' is not hhmmss.ss"));
  EXPECT_THAT(fault(sentence("GPGGA,120000,2278.0,N,11410.7,E,1,08,0.9,9.5,M,0,M,,"), "nmea"),
              HasSubstr("ddmm.mmmm"));
  EXPECT_THAT(fault(sentence("GPGGA,120000,2218.0,X,11410.7,E,1,08,0.9,9.5,M,0,M,,"), "nmea"),
              HasSubstr("neither N nor S"));
  EXPECT_THAT(fault("$GPGGA,100000,48.10000,N,011.10000,E,1,08,1.0,500.0,M,47.0,M,,\n", "nmea"),
              HasSubstr("the latitude '48.10000' is not ddmm.mmmm"));
  EXPECT_THAT(fault("$GPGGA,100000,4806.0,N,01130.0,E,1,08,1.0,1640.4,f,154.2,f,,\n", "nmea"),
              HasSubstr("the unit 'f' of a height is not M"));
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

TEST(TrajectoryCases, AVoidRmcSaysNoDate) {
  const TrajectoryFile good = read_case("nmea-void-date/good.nmea", "nmea");
  for (const char* name : {"day-before", "default-1980", "future", "rollover"}) {
    SCOPED_TRACE(name);
    const TrajectoryFile file = read_case(std::string("nmea-void-date/") + name + ".nmea", "nmea");
    EXPECT_EQ(file.trajectory.begin(), kCases);
    EXPECT_EQ(file.trajectory.end(), good.trajectory.end());
    EXPECT_DOUBLE_EQ(file.trajectory.end() - file.trajectory.begin(), 29);
    EXPECT_THAT(file.report.lines(), ElementsAre(HasSubstr("GGA sentence without a fix (the first of 3)")));
  }
}

TEST(TrajectoryCases, NmeaOfLoggersTalkersAndTwoDimensions) {
  expect_path(read_case("nmea-gnsslogger/log.nmea", "nmea"), kCases, 4, 48.0002, 547);
  const TrajectoryFile two = read_case("nmea-two-talkers/two.nmea", "nmea");
  expect_path(two, kCases, 5, 48.00025, 547);
  EXPECT_THAT(two.report.lines(),
              ElementsAre(HasSubstr("point that repeats the time of the previous one (the first of 6)")));
  const TrajectoryFile one = read_case("nmea-gga-no-altitude/one.nmea", "nmea");
  expect_path(one, kCases, 5, 48.00025, 547);
  EXPECT_THAT(one.report.warnings(), ElementsAre(HasSubstr("fix without an altitude; left out")));
  EXPECT_THAT(
      error_of([] { (void)read_case("nmea-gga-no-altitude/all2d.nmea", "nmea"); }).what(),
      testing::AllOf(HasSubstr("none of its 6 fixes has an altitude"), HasSubstr("height_above_terrain_m")));
  expect_path(read_case("nmea-gga-no-altitude/all2d.nmea", "nmea", {false, 0}), kCases, 5, 48.00025, 0);
}

TEST(TrajectoryCases, TextOfOfficeProgramsIsRead) {
  for (const char* name : {"bom", "quoted", "semicolon"})
    expect_path(read_case(std::string("text-bom/") + name + ".csv", "csv"), kCases, 2, 48.00002, 547);
}

// Motion files of gps-sdr-sim have no header that defines their columns.
TEST(TrajectoryCases, EcefWithoutAHeaderIsRefused) {
  EXPECT_THAT(error_of([] { (void)read_case("csv-ecef/motion.csv", "csv", {}, kCases); }).what(),
              testing::AllOf(HasSubstr("motion.csv:1: has no header"), HasSubstr("trajectory.columns")));
}

TEST(TrajectoryCases, PausesAreSaidAndNotCovered) {
  const TrajectoryFile file = read_case("gpx-pause/pause.gpx", "gpx");
  EXPECT_THAT(file.report.warnings(), testing::Contains(HasSubstr("has 1 pause, the longest of 3591 s")));
  EXPECT_TRUE(file.trajectory.covers(kCases + 9));
  EXPECT_FALSE(file.trajectory.covers(kCases + 9.5));
  EXPECT_FALSE(file.trajectory.covers(kCases + 3599.9));
  EXPECT_TRUE(file.trajectory.covers(kCases + 3600));
  EXPECT_FALSE(file.trajectory.covers(kCases + 3700));
}

TEST(TrajectoryCases, GpxHeightsTakeTheGeoid) {
  expect_path(read_case("gpx-geoidheight/t.gpx", "gpx"), kCases, 4, 48.00004, 547);
  EXPECT_THAT(read_case("gpx-geoidheight/t.gpx", "gpx").report.lines(), ElementsAre());
  const TrajectoryFile plain = read_case("gpx-pause/pause.gpx", "gpx", {true, 47});
  EXPECT_NEAR(plain.trajectory.at(kCases).position.height_m, 547, 1e-9);
  EXPECT_THAT(plain.report.warnings(), testing::Contains(HasSubstr("geoid undulation, 47.0 m, is added")));
}

// A straight path north, one point a second: the report of each kind of file.
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
    const geodesy::Geodetic geodetic = path.at(path.begin() + (i - first)).position;
    EXPECT_NEAR(degrees(geodetic.latitude_rad), 48 + 1e-4 * i, 1e-7);
    EXPECT_NEAR(degrees(geodetic.longitude_rad), 11, 1e-7);
    EXPECT_NEAR(geodetic.height_m, height_m, 1e-6);
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
              HasSubstr("no GGA, GNS, RMC or GLL sentence with a fix"));
}

/// A record of each format: 48 + 1e-4 i deg N, 11 deg E, 547 m at 10:00:1i.
struct Format {
  const char *name, *head, *record, *tail;
};
constexpr const char* kFixColumns =
    "# Fix,Provider,LatitudeDegrees,LongitudeDegrees,AltitudeMeters,UnixTimeMillis\n";
const Format kFormats[] = {
    {"csv", "time,latitude,longitude,height\n", "{time},{lat:.7f},{lon},{height}\n", ""},
    {"urbannav", "", "{week},{tow},{lat:.7f},{lon},{height}\n", ""},
    {"rtklib", "%  GPST  latitude(deg) longitude(deg)  height(m)   Q  ns\n",
     "{week} {tow} {lat:.7f} {lon} {height} 5 8\n", ""},
    {"gpx", "<gpx><trk><trkseg>",
     "<trkpt lat='{lat:.7f}' lon='{lon}'><ele>{height}</ele><time>{time}</time></trkpt>\n",
     "</trkseg></trk></gpx>"},
    {"kml", "<kml><gx:Track><altitudeMode>relativeToGround</altitudeMode>",
     "<when>{time}</when><gx:coord>{lon} {lat:.7f} {height}</gx:coord>\n", "</gx:Track></kml>"},
    {"gnsslogger", kFixColumns, "Fix,GPS,{lat:.7f},{lon},{height},{ms}\n", ""},
    {"nmea", "",
     "$GPRMC,{hms},A,{ddmm:09.4f},N,{dddmm:010.4f},E,,,{ddmmyy},,,A\n"
     "$GPGGA,{hms},{ddmm:09.4f},N,{dddmm:010.4f},E,1,08,0.9,{height},M,0,M,,\n",
     ""},
};
struct Sample {
  double latitude_deg, longitude_deg;
  const char* height = "547";
  std::string time = {};  ///< ISO 8601; empty: from its number
};
std::string written(const Format& format, int i, const Sample& of) {
  const std::string time = of.time.empty() ? fmt::format("2024-05-01T10:00:1{}Z", i) : of.time;
  // parse_time() has no 1970.
  const bool unix = time.starts_with("1970");
  const GpsTime t = unix ? GpsTime{} : parse_time(time);
  const auto ms = unix ? 0 : (t - parse_time("2024-05-01T10:00:00Z")) * 1000 + 1714557600000.0;
  const double ddmm =
      100 * std::floor(of.latitude_deg) + 60 * (of.latitude_deg - std::floor(of.latitude_deg));
  return fmt::format(fmt::runtime(format.record), fmt::arg("time", time), fmt::arg("lat", of.latitude_deg),
                     fmt::arg("lon", of.longitude_deg), fmt::arg("height", of.height),
                     fmt::arg("week", t.week()), fmt::arg("tow", t.seconds_of_week()),
                     fmt::arg("ms", std::llround(ms)),
                     fmt::arg("hms", time.substr(11, 2) + time.substr(14, 2) + time.substr(17, 2)),
                     fmt::arg("ddmm", ddmm), fmt::arg("dddmm", 100 * of.longitude_deg),
                     fmt::arg("ddmmyy", time.substr(8, 2) + time.substr(5, 2) + time.substr(2, 2)));
}

TEST(TrajectoryFile, ValuesThatStandForNoneCostThemselvesAlone) {
  const std::pair<Sample, const char*> kNone[] = {
      {{0, 0, "0"}, "latitude 0, longitude 0, as before a fix"},
      {{48, 11, "547", "1970-01-01T00:00:00Z"}, "time before 1981"},
      {{48, 11, "547", "1980-01-06T00:00:07Z"}, "time before 1981"},
      {{48, 11, "-9999"}, ""},
      {{48, 11, "-32768.0"}, ""},
      // A clock that is wrong once, at the start, in the middle or at the end.
      {{48, 11, "547", "2031-05-01T10:00:00Z"}, "time is out of order"},
      {{48, 11, "547", "1999-08-22T00:00:00Z"}, "time is out of order"}};
  for (const Format& format : kFormats) {
    for (const auto& [none, configured] : kNone) {
      for (const int at : {0, 4, 9}) {
        SCOPED_TRACE(
            fmt::format("{} {} {} {} at {}", format.name, none.latitude_deg, none.height, none.time, at));
        std::string text = format.head;
        for (int i = 0; i < kStraight; ++i) {
          Sample own = none;
          if (own.latitude_deg != 0) own.latitude_deg = 48 + 1e-4 * i;
          if (i == at) text += written(format, i, own);
          text += written(format, i, {48 + 1e-4 * i, 11});
        }
        const TrajectoryFile file = read(text + format.tail, format.name);
        expect_straight(file, 547);
        EXPECT_THAT(file.report.warnings(), Contains(HasSubstr(configured)));
      }
    }
    // Most of a log may be from the time before the first fix.
    std::string text = format.head;
    for (int i = 0; i < 15; ++i) text += written(format, i % 10, {0, 0});
    for (int i = 0; i < kStraight; ++i) text += written(format, i, {48 + 1e-4 * i, 11});
    const TrajectoryFile file = read(text + format.tail, format.name);
    expect_straight(file, 547);
    EXPECT_THAT(file.report.warnings(), Contains(HasSubstr("as before a fix (the first of "))) << format.name;
  }
}

TEST(TrajectoryCsv, AnotherHeaderHoldsFromThere) {
  std::string text = "time,latitude,longitude,height\n";
  for (int i = 0; i < kStraight; ++i) {
    if (i == 3) text += "time,latitude,longitude,height\n";
    if (i == 6) text += "# time,height,longitude,latitude,speed\ntime,height,longitude,latitude,speed\n";
    text += i < 6 ? fmt::format("{},{:.7f},11,547\n", i, 48 + 1e-4 * i)
                  : fmt::format("{},547,11,{:.7f},3\n", i, 48 + 1e-4 * i);
  }
  const TrajectoryFile file = read(text, "");
  expect_straight(file, 547);
  EXPECT_THAT(file.report.lines(),
              ElementsAre(HasSubstr("track.txt:5: another header (the first of 2); its columns apply from")));
}

// As Matlab, numpy.savetxt and rostopic echo -p write tables.
TEST(TrajectoryCsv, AHeaderMayBeAComment) {
  for (const auto& [head, record] : std::initializer_list<std::pair<const char*, const char*>>{
           {"%time,latitude,longitude,height\n", "{i},{lat:.7f},11,547\n"},
           {"% exported by Matlab\n%\n% time, lat, lon, height\n", "{i} {lat:.7f}  11 547\n"},
           {"# time lat lon height\n", "  {i}  {lat:.7f} 11 547\n"},
           {"% time(s) lat(deg) lon[deg] height(m)\n", "{i}\t{lat:.7f}\t11\t547\n"},
           {"% UTC time, latitude(deg), longitude(deg), height(m), time(s)\n", "9,{lat:.7f},11,547,{i}\n"},
           {"% exported\ntime,latitude,longitude,height\n", "{i},{lat:.7f},11,547\n% a comment\n"}}) {
    SCOPED_TRACE(head);
    expect_straight(read(head + straight(record), ""), 547);
  }
  const TemporaryFolder folder;
  const auto ros = folder.write("ros.csv", "%time,field.latitude,field.longitude,field.altitude\n" +
                                               straight("171455761{i}000000000,{lat:.7f},11,547\n"));
  EXPECT_THAT(error_of([&] { (void)read_trajectory_file(ros, "", {}); }).what(),
              testing::AllOf(HasSubstr("no column 'latitude'; there are 'time', 'field.latitude'"),
                             HasSubstr("trajectory.columns")));
  for (const char* time : {"time [ns]", "%time [ns]"}) {
    expect_straight(read_trajectory_file(ros, "", {}, {},
                                         {{"unix_time", time},
                                          {"latitude", "field.latitude [deg]"},
                                          {"longitude", "field.longitude [deg]"},
                                          {"height", "field.altitude [m]"}}),
                    547);
  }
}

TEST(TrajectoryNmea, ALeapSecondIsAnInstant) {
  std::string text = "$GPRMC,235955,A,4800.0000,N,01100.0000,E,,,311216,,,A\n";
  const char* times[] = {"235957", "235958", "235959", "235960", "000000", "000001"};
  for (const char* time : times)
    text += fmt::format("$GPGGA,{},4800.0000,N,01100.0000,E,1,10,0.9,500.0,M,47.0,M,,\n", time);
  const TrajectoryFile file = read(text, "nmea");
  EXPECT_THAT(file.report.lines(), ElementsAre());
  // 17 leap seconds before that one, 18 after it.
  EXPECT_EQ(file.trajectory.begin(), parse_time("2017-01-01T00:00:14 GPST"));
  EXPECT_EQ(file.trajectory.end(), parse_time("2017-01-01T00:00:19 GPST"));
}

TEST(TrajectoryTracks, ExtensionsPointsAndParts) {
  const auto gpx = [](const std::string& points) {
    return "<gpx><trk><trkseg>" + points + "</trkseg></trk></gpx>";
  };
  const std::string point =
      "<trkpt lat='{lat:.7f}' lon='11'><ele>500</ele><time><![CDATA[2024-05-01T10:00:1{i}Z]]></time>"
      "<extensions><ele>9</ele><time>2001-01-01T00:00:00Z</time></extensions></trkpt>";
  expect_straight(read(gpx(straight(point.c_str())), "gpx"), 500);
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
        const Trajectory t = read_trajectory_file(path, format, kStart).trajectory;
        EXPECT_LE(t.begin(), t.end());
      } catch (const InputError& e) {
        EXPECT_FALSE(e.problem().empty());
      }
    }
  }
}

}  // namespace
}  // namespace canyon::simulation::trajectory_file_test
