#include "canyon/base/file_kind.hpp"

#include <gmock/gmock.h>

#include <fstream>
#include <string>
#include <utility>

#include "tests/support/temporary_folder.hpp"

namespace canyon {
namespace {

using namespace std::string_view_literals;

TEST(FileKind, ByTheFirstBytes) {
  const std::pair<std::string_view, FileKind> heads[] = {
      {"     3.04           OBSERVATION DATA    M                   RINEX VERSION / TYPE\n",
       FileKind::RinexObservation},
      {"3.0                 COMPACT RINEX FORMAT                    CRINEX VERS   / TYPE\n",
       FileKind::RinexObservation},
      {"     2.11           NAVIGATION DATA                         RINEX VERSION / TYPE\n",
       FileKind::RinexNavigation},
      {"#dP2024  2 29  0  0  0.00000000      96 ORBIT IGS20\n", FileKind::Sp3},
      {"# Header\n#\n# Fix,Provider,LatitudeDegrees\n", FileKind::GnssLogger},
      {"Raw,utcTimeMillis,TimeNanos\n", FileKind::GnssLogger},
      {"<?xml version=\"1.0\"?>\n<gpx version=\"1.1\">", FileKind::Gpx},
      {"<kml xmlns:gx=\"http://www.google.com/kml/ext/2.2\">", FileKind::Kml},
      {"\xB5\x62\x01\x07\xD3\x01", FileKind::Foreign},
      {"\xB5\x62\x01\x07\xD3\x01$GNGGA,123519,4807.038,N\r\n", FileKind::Nmea},
      {"\xD3\x00\x13\x3E\xD7"sv, FileKind::Rtcm},
      {"noise\xD3\x01\x13"sv, FileKind::Rtcm},
      {"\xD3\x01\x13\x20\x20$GNGGA,123519,4807.038,N\r\n", FileKind::Nmea},
      {"[12:00] $GPGGA,123519,4807.038,N\n", FileKind::Nmea},
      {"$PUBX,00,1\n", FileKind::Nmea},
      {"time,lat,lon,height\n0,22.3,114.17,5\n", FileKind::Columns},
      {"# a comment, of a table\n1;2;3\n", FileKind::Columns},
      {"%  GPST  latitude(deg)\n2024/05/01 10:00:00.000  48.1  11.5  500.0  5  12\n", FileKind::Columns},
      {"a story of 3 bears and 2 men\n", FileKind::Other},
      {"<?xml version=\"1.0\"?>\n<TrainingCenterDatabase a=\"b, c\">", FileKind::Other},
      {"{\"a\": 1, \"b\": 2}", FileKind::Other},
      {"it costs $5\n", FileKind::Other},
      {"     3.00           C                                       RINEX VERSION / TYPE\n",
       FileKind::Foreign},
      {" # 1991  2  3  0  0  0.00000000  96 900.00000000 48290 0.0 23 1 ITR\n", FileKind::Foreign},
      {"<osmChange version=\"0.6\">", FileKind::Foreign},
      {"ULog\x01\x12\x35\x01$GPGGA,1,2", FileKind::Foreign},
      {"\xA3\x95\x80\x80YFMT\xD3\x01\x13"sv, FileKind::Foreign},
      {"\x00\x06\x53\x2C\x94\xC7\x00\x00\xFD\x09\x00"sv, FileKind::Foreign},
      {"\x00\x06\x53\x2C\x94\xC7\x00\x00\xFE\x09\x00"sv, FileKind::Foreign},
      {"#ROSBAG V2.0\n", FileKind::Foreign},
      {"\x89MCAP0\r\n", FileKind::Foreign},
      {"SQLite format 3\0"sv, FileKind::Foreign},
      {"rosbag2_bagfile_information:\n  version: 5\n", FileKind::Foreign},
      {"9\n$ACADVER\n1\n", FileKind::Other},
      {"\0,1"sv, FileKind::Other},
      {"", FileKind::Other}};
  for (const auto& [head, kind] : heads) EXPECT_EQ(kind_of_head(head), kind) << head;
}

TEST(FileKind, OfTrajectories) {
  EXPECT_EQ(trajectory_format(FileKind::Gpx), "gpx");
  EXPECT_EQ(trajectory_format(FileKind::Sp3), "");
  EXPECT_EQ(trajectory_format(FileKind::Other), "");
  EXPECT_EQ(kind_of_trajectory("gnsslogger"), FileKind::GnssLogger);
  EXPECT_EQ(kind_of_trajectory("csv"), FileKind::Columns);
  EXPECT_EQ(kind_of_trajectory("urbannav"), FileKind::Columns);
}

TEST(FileKind, ReadersSayWhatAFileIsInstead) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "track";
  const auto message = [&](FileKind wanted) -> std::string {
    try {
      read_as(wanted, path, [&]() -> int { throw InputError(path, 3, "is bad"); });
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  };
  std::ofstream(path) << "<gpx></gpx>";
  EXPECT_EQ(message(FileKind::Sp3),
            path.string() + ": is a GPX file, not an SP3 file; use it as a trajectory of format gpx");
  EXPECT_EQ(message(FileKind::Gpx), path.string() + ":3: is bad");
  std::ofstream(path) << "1,2,3\n";
  EXPECT_EQ(message(FileKind::Sp3), path.string() + ":3: is bad") << "columns may be anything";
  // A log with lines of both kinds has the requested kind.
  std::ofstream(path) << "# Raw,TimeNanos\nNMEA,$GPGGA,123519\n";
  EXPECT_EQ(message(FileKind::Nmea), path.string() + ":3: is bad");
  EXPECT_EQ(read_as(FileKind::Sp3, path, [] { return 7; }), 7);
  std::filesystem::remove(path);
  EXPECT_EQ(message(FileKind::Sp3), path.string() + ":3: is bad");
  std::filesystem::create_directory(path);
  std::ofstream(path / "metadata.yaml") << "rosbag2_bagfile_information:\n";
  EXPECT_THAT(message(FileKind::Columns), testing::HasSubstr("is a bag of ROS 2, not a text of columns"));
}

}  // namespace
}  // namespace canyon
