#include "canyon/simulation/motion/csv_times.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "tests/support/simulation_support.hpp"

// Columns and times as programs of other people write them.
namespace canyon::simulation::csv_times_test {
namespace {

using geodesy::GpsTime;
using geodesy::parse_time;
using test::TemporaryFolder;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const GpsTime kStart = parse_time("2024-05-01T08:00:00Z");
/// Week 2312 began on 2024-04-28; 295,218 s behind that are 3 days, 10 h and 18 s.
const GpsTime kFirst = parse_time("2024-05-01T10:00:18 GPST");

/// A header and ten lines, 10 m and 1 s apart. "{i}" stands for 0 to 9, "{lat}" for the latitude.
std::string ten(const std::string& header, const std::string& line) {
  std::string text = header + "\n";
  for (int i = 0; i < 10; ++i) {
    std::string filled = line;
    for (std::size_t at = filled.find("{i}"); at != std::string::npos; at = filled.find("{i}"))
      filled.replace(at, 3, std::to_string(i));
    filled.replace(filled.find("{lat}"), 5, fmt::format("{:.7f}", 48 + 9e-5 * i));
    text += filled + "\n";
  }
  return text;
}

TrajectoryFile read(const std::string& text, GpsTime start = kStart) {
  const TemporaryFolder folder;
  return read_trajectory_file(folder.write("a.csv", text), "csv", start);
}
std::string refused(const std::string& text) {
  return test::error_of([&] { (void)read(text); }).what();
}

void expect_ten(const TrajectoryFile& file, double height_m, int first = 0) {
  EXPECT_EQ(file.trajectory.begin(), kFirst + first);
  EXPECT_EQ(file.trajectory.end(), kFirst + 9);
  const auto place = file.trajectory.at(kFirst + 5).position;
  EXPECT_NEAR(geodesy::degrees(place.latitude_rad), 48.00045, 1e-7);
  EXPECT_NEAR(geodesy::degrees(place.longitude_rad), 11, 1e-7);
  EXPECT_NEAR(place.height_m, height_m, 1e-3);
}

TEST(CsvTimes, WeeksAndTheirSeconds) {
  for (const auto& [header, line] : std::initializer_list<std::pair<const char*, const char*>>{
           {"week,tow,lat,lon,height", "2312,29521{i}.000,{lat},11,547"},
           {"lat,lon,height,GPS_Week,GPS_Seconds", "{lat},11,547,2312,29521{i}"},
           {"iTOW,week,lat,lon,height", "29521{i}000,2312,{lat},11,547"},
           {"week;time;lat;lon;height", "2312;29521{i};{lat};11;547"},
           {"%  GPST  latitude(deg) longitude(deg)  height(m)   Q  ns",
            "2312 29521{i}.000   {lat}   11.0   547.0   1  12"}}) {
    const TrajectoryFile file = read(ten(header, line), {});
    EXPECT_TRUE(file.has_own_dates) << header;
    EXPECT_EQ(file.trajectory.begin(), kFirst + -8) << header;
    EXPECT_EQ(file.trajectory.end(), kFirst + 1) << header;
    EXPECT_THAT(file.warnings, IsEmpty()) << header;
  }
  EXPECT_THAT(refused(ten("week,tow,lat,lon,height", "264,29521{i},{lat},11,547")),
              HasSubstr("the GPS week 264 is before 1999; it seems to be counted modulo 1,024; write full "
                        "weeks: 2312 is in 2019 to 2038"));
}

TEST(CsvTimes, UnixTimesBySize) {
  for (const auto& [unit, zeros] :
       std::initializer_list<std::pair<const char*, const char*>>{{"seconds", ""},
                                                                  {"milliseconds", "000"},
                                                                  {"microseconds", "000000"},
                                                                  {"nanoseconds", "000000000"}}) {
    const TrajectoryFile file =
        read(ten("timestamp,lat,lon,height", fmt::format("171455760{{i}}{},{{lat}},11,547", zeros)), {});
    expect_ten(file, 547);
    EXPECT_THAT(
        file.warnings,
        ElementsAre(HasSubstr(fmt::format("1714557600{} are taken as Unix times in {}", zeros, unit))));
  }
  // The unit by the name and the size by the value contradict.
  EXPECT_THAT(refused(ten("time_s,lat,lon,height", "171455760{i}000,{lat},11,547")),
              HasSubstr("out of range"));
}

TEST(CsvTimes, DoubtsAboutSecondsFromTheStart) {
  EXPECT_THAT(read(ten("time,lat,lon,height", "29521{i},{lat},11,547")).warnings,
              ElementsAre(HasSubstr("the first is 295210 s; seconds of the GPS week need a column 'week'")));
  EXPECT_THAT(read(ten("time,lat,lon,height", "{i}000,{lat},11,547")).warnings,
              ElementsAre(HasSubstr("never moves faster than 0.01 m/s, in 9000 s: are its times in milli")));
  EXPECT_THAT(read(ten("time_ms,lat,lon,height", "{i}000,{lat},11,547")).warnings, IsEmpty());
  // Metres as degrees, days as seconds.
  EXPECT_THAT(refused("0,10.5,20.3,1.5\n1,11.7,21.0,1.5\n2,12.9,21.7,1.5\n"),
              HasSubstr("faster than anything moves: half of them by 15"));
  EXPECT_THAT(refused(ten("time,lat,lon,height", "45413.41666{i},{lat},11,547")), HasSubstr("not days"));
}

TEST(CsvTimes, FilesOfRtklib) {
  const std::string header =
      "% program   : RTKPOST ver.2.4.3\n% obs start : 2024/05/01 10:00:18.0 GPST\n"
      "%  UTC                   latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)";
  expect_ten(
      read(ten(header, "2024/05/01 10:00:0{i}.000   {lat}   11.000000000   547.0000   1  12   0.0100"), {}),
      547);
  const TrajectoryFile geodetic = read(ten("% (lat/lon/height=WGS84/geodetic,Q=1:fix)\n" + header,
                                           "2024/05/01 10:00:0{i}.000  {lat} 11 500 1 12 0"),
                                       {});
  EXPECT_THAT(geodetic.warnings, ElementsAre(HasSubstr("heights are above sea level by the header")));
  const std::string commas = "%  UTC,latitude(deg),longitude(deg),height(m),Q,ns,sdn(m)";
  expect_ten(read(ten(commas, "2024/05/01 10:00:0{i}.000,{lat},11.000000000,547.0000,1,12,0.0100"), {}), 547);
}

TEST(CsvColumns, FilesOfOtherPrograms) {
  // ArduPilot: status 1 is no fix. ROS: -1, times in ns, names with "field.".
  EXPECT_THAT(
      read(ten("timestamp,Status,GWk,Lat,Lng,Alt", "171455760{i},{i},2312,{lat},11,547"), {}).warnings,
      Contains(HasSubstr("line without a fix, by the file's own column (the first of 2)")));
  expect_ten(read(ten("timestamp,TimeUS,Status,GWk,NSats,HDop,Lat,Lng,Alt",
                      "171455760{i},1000,3,2312,9,1.2,{lat},11,547"),
                  {}),
             547);
  std::string rosbag =
      ten("%time,field.header.seq,field.status.status,field.latitude,field.longitude,field.altitude",
          "171455760{i}000000000,{i},0,{lat},11,547");
  for (std::size_t at = 0, i = 0; i < 3; ++i) {
    at = rosbag.find(",0,48", at);
    rosbag.replace(at, 2, ",-1");
  }
  expect_ten(read(rosbag, {}), 547, 3);
  // The height above the ellipsoid is the one that is asked for.
  expect_ten(read(ten("time,lat,lon,alt_msl,alt_hae", "2024-05-01T10:00:0{i}Z,{lat},11,500,547")), 547);
  // Positions of the network are none of a receiver.
  std::string phone = ten("time,lat,lon,elevation,satellites,provider,geoidheight",
                          "2024-05-01T10:00:0{i}Z,{lat},11,500,9,gps,47");
  phone.insert(phone.find("2024-05-01T10:00:05Z"), "2024-05-01T10:00:04.5Z,48.5,11,500,0,network,47\n");
  expect_ten(read(phone), 547);
  // "ns" is the number of satellites without a column of east and west.
  expect_ten(read(ten("time,lat,lon,height,ns", "2024-05-01T10:00:0{i}Z,{lat},11,547,12")), 547);
  expect_ten(read(ten("time,lat,ns,lon,ew,height", "2024-05-01T10:00:0{i}Z,{lat},N,11,E,547")), 547);
  const TrajectoryFile none = read(ten("time,lat,lon,height,nsats", "2024-05-01T10:00:0{i}Z,{lat},11,547,0"));
  EXPECT_THAT(none.warnings, ElementsAre(HasSubstr("line with 0 satellites, by the file's own column (the "
                                                   "first of 10); it is taken")));
  // Inertial Explorer: a title of many lines, units below the names.
  const TrajectoryFile post = read(ten("Project:     drive\nProgram:     Inertial Explorer Version "
                                       "8.80\nDatum:       WGS84, (processing datum)\n\n"
                                       "  Week   GPSTime       Latitude      Longitude        H-Ell\n"
                                       " (weeks)  (sec)          (Deg)          (Deg)          (m)",
                                       " 2312 29521{i}.000  {lat}  11.0000000  547.000"),
                                   {});
  EXPECT_EQ(post.trajectory.begin(), kFirst + -8);
  EXPECT_NEAR(post.trajectory.at(kFirst).position.height_m, 547, 1e-3);
  EXPECT_THAT(post.warnings, IsEmpty());
  expect_ten(read(ten("# time lat lon height", "171455760{i} {lat} 11 547"), {}), 547);
  EXPECT_THAT(refused("24 47 4e 47 47 41\n24 47 4e 47 47 41\n"),
              HasSubstr("blanks stand between the columns, and no header names them"));
  // A title is no line of columns.
  expect_ten(read(ten("My flight of 1 May 2024\ntime,lat,lon,height", "2024-05-01T10:00:0{i}Z,{lat},11,547")),
             547);
  // A header in a comment, with another separator than the data.
  expect_ten(read(ten("# time lat lon height", "2024-05-01T10:00:0{i}Z,{lat},11,547")), 547);
}

TEST(CsvColumns, FillValuesOfHeights) {
  for (const char* fill : {"9999", "-999.0", "99999", "-9999", "999999"}) {
    std::string text = ten("time,lat,lon,height", "2024-05-01T10:00:0{i}Z,{lat},11,547");
    for (int i = 0; i < 3; ++i) text.replace(text.find("547", text.find(":03Z")), 3, fill);
    const TrajectoryFile file = read(text);
    expect_ten(file, 547);
    EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("(the first of 3); left out"))) << fill;
  }
}

}  // namespace
}  // namespace canyon::simulation::csv_times_test
