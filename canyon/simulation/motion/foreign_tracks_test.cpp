// Tracks as programs and receivers of others write them, with made-up values.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/simulation/motion/track_file.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::simulation {
namespace {

using geodesy::parse_time;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class ForeignTracks : public ::testing::Test {
 protected:
  TrajectoryFile read(const std::string& text, const std::string& format = "csv") {
    std::ofstream(folder_ / "path", std::ios::binary) << text;
    return read_trajectory_file(folder_ / "path", format, parse_time("2024-05-01T10:00:00Z"));
  }
  std::string refusal(const std::string& text, const std::string& format = "csv") {
    return canyon::test::refusal([&] { (void)read(text, format); });
  }
  static double latitude_deg(const Trajectory& path) {
    return geodesy::degrees(path.at(path.begin()).position.latitude_rad);
  }
  static double longitude_deg(const Trajectory& path) {
    return geodesy::degrees(path.at(path.begin()).position.longitude_rad);
  }
  static double height_m(const Trajectory& path) { return path.at(path.begin()).position.height_m; }

  canyon::test::TemporaryFolder folder_;
};

// A table of truth and estimate beside each other, as Canyon's own epochs.csv: the path is the true one, also
// where there was no fix.
TEST_F(ForeignTracks, TrueColumnsBeatThoseOfFixes) {
  const TrajectoryFile file = read(
      "gps_week,gps_tow,fix_latitude_deg,fix_longitude_deg,fix_height_m,status,true_latitude_deg,"
      "true_longitude_deg,true_height_m\n"
      "2312,295200,48.1,11.5,560,none,48.2,11.6,547\n2312,295201,48.1,11.5,560,1,48.2,11.6,547\n");
  EXPECT_NEAR(latitude_deg(file.trajectory), 48.2, 1e-12);
  EXPECT_NEAR(longitude_deg(file.trajectory), 11.6, 1e-12);
  EXPECT_NEAR(height_m(file.trajectory), 547, 1e-6);
  EXPECT_EQ(file.trajectory.begin(), parse_time("2024-05-01T10:00:00 GPST"));
  const TrajectoryFile others = read(
      "time,lat,lon,alt,gt_lat,gt_lon,gt_alt\n"
      "2024-05-01T10:00:00Z,48.1,11.5,560,48.2,11.6,547\n2024-05-01T10:00:01Z,48.1,11.5,560,48.2,11.6,547\n");
  EXPECT_NEAR(latitude_deg(others.trajectory), 48.2, 1e-12);
}

// Whole degrees alone would stand still.
TEST_F(ForeignTracks, MinutesInColumnsOfTheirOwnAreRefused) {
  const std::string rows =
      "2024-05-01T10:00:00Z,48,7.5,11,30.6,547\n2024-05-01T10:00:01Z,48,7.6,11,30.6,547\n";
  EXPECT_THAT(refusal("time,lat_deg,lat_min,lon_deg,lon_min,height\n" + rows),
              HasSubstr("minutes or seconds of an angle in a column of their own, 'lon_min'"));
  EXPECT_THAT(
      refusal("time,latitude_degrees,latitude_minutes,longitude_degrees,longitude_minutes,alt_m\n" + rows),
      HasSubstr("'longitude_minutes'"));
  // Limits of a box are no minutes.
  const TrajectoryFile box = read(
      "time,lat,lon,height,lat_min,lat_max\n2024-05-01T10:00:00Z,48.1,11.5,547,48,49\n"
      "2024-05-01T10:00:01Z,48.2,11.5,547,48,49\n");
  EXPECT_NEAR(latitude_deg(box.trajectory), 48.1, 1e-12);
}

// RTKLIB's solution files (manual 2.4.2, appendix B).
TEST_F(ForeignTracks, RtklibInDegreesMinutesAndSeconds) {
  const std::string header =
      "% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=# of satellites)\n"
      "%  GPST                  latitude(d'\")   longitude(d'\")  height(m)   Q  ns\n";
  const TrajectoryFile file = read(header +
                                   "2024/05/01 10:00:00.000  -48 07 30.00000  11 30 36.00000  547.0  5  8\n"
                                   "2024/05/01 10:00:01.000  -48 07 30.20000  11 30 36.00000  547.0  5  8\n");
  EXPECT_NEAR(latitude_deg(file.trajectory), -48.125, 1e-12);
  EXPECT_NEAR(longitude_deg(file.trajectory), 11.51, 1e-12);
  EXPECT_NEAR(height_m(file.trajectory), 547, 1e-6);
  EXPECT_EQ(file.trajectory.begin(), parse_time("2024-05-01T10:00:00 GPST"));
  const TrajectoryFile weeks = read(header +
                                    "2312 295200.000  -48 07 30.0  11 30 36.0  547.0  5  8\n2312 295201.000  "
                                    "-48 07 30.2  11 30 36.0  547.0  5  8\n");
  EXPECT_EQ(weeks.trajectory.begin(), parse_time("2024-05-01T10:00:00 GPST"));
  EXPECT_NEAR(height_m(weeks.trajectory), 547, 1e-6);
}

TEST_F(ForeignTracks, RtklibInJapanStandardTime) {
  const TrajectoryFile file = read(
      "%  JST                   latitude(deg)  longitude(deg)  height(m)   Q  ns\n"
      "2024/05/01 19:00:00.000  48.0  11.0  547.0  5  8\n2024/05/01 19:00:01.000  48.0  11.0  547.0  5  8\n");
  EXPECT_EQ(file.trajectory.begin(), parse_time("2024-05-01T10:00:00Z"));
}

// A baseline of 10 m east and 20 m north is not longitude 20, latitude 10.
TEST_F(ForeignTracks, ColumnsThatACommentNamesOtherwiseAreRefused) {
  EXPECT_THAT(refusal("%  GPST                  e-baseline(m)  n-baseline(m)  u-baseline(m)   Q  ns\n"
                      "2024/05/01 10:00:00.000  10.0000  20.0000  1.0000  1  10\n"
                      "2024/05/01 10:00:01.000  10.0000  20.0000  1.0000  1  10\n"),
              HasSubstr("path:2: the comment above names columns without a latitude"));
  EXPECT_THAT(refusal("# timestamp,tx,ty,tz\n0,1,2,3\n1,1,2,3\n"),
              HasSubstr("names columns without a latitude"));
  // Comments that name no columns.
  EXPECT_THAT(read("# GPS time and position\n0,48,11,500\n1,48,11,500\n").warnings, IsEmpty());
}

TEST_F(ForeignTracks, UnitsBelowTheHeaderAreHeard) {
  for (const char* units : {"[s],[rad],[rad],[m]", "s,rad,rad,m", "(s),(rad),(rad),(m)"}) {
    const TrajectoryFile file = read("time,latitude,longitude,height\n" + std::string(units) +
                                     "\n0,0.8377580409572782,0.1919862177193762,500\n"
                                     "1,0.8377580409572782,0.1919862177193762,500\n");
    EXPECT_NEAR(latitude_deg(file.trajectory), 48, 1e-9) << units;
    EXPECT_NEAR(longitude_deg(file.trajectory), 11, 1e-9) << units;
    EXPECT_THAT(file.warnings, IsEmpty()) << units;
  }
  const TrajectoryFile feet = read(
      "time;latitude;longitude;height;speed\ns;deg;deg;ft;m/s\n0;48,0;11,0;1000;0\n1;48,0;11,0;1000;0\n");
  EXPECT_NEAR(height_m(feet.trajectory), 304.8, 1e-9);
}

TEST_F(ForeignTracks, SeparatorsOfThousands) {
  const TrajectoryFile english =
      read("time,latitude,longitude,height\n0,48.1,11.1,\"1,500\"\n1,48.1,11.1,\"1,500.5\"\n");
  EXPECT_NEAR(height_m(english.trajectory), 1500, 1e-9);
  EXPECT_THAT(english.warnings, Contains(HasSubstr("separators of thousands (the first of 2)")));
  const TrajectoryFile german =
      read("time;latitude;longitude;height\n0;48,1;11,1;1.500,5\n1;48,1;11,1;1.500,5\n");
  EXPECT_NEAR(height_m(german.trajectory), 1500.5, 1e-9);
  // A decimal comma beside decimal points, and the other way.
  EXPECT_NEAR(
      height_m(read("time;latitude;longitude;height\n0;48.1;11.1;500,5\n1;48.1;11.1;500,5\n").trajectory),
      500.5, 1e-9);
  EXPECT_NEAR(
      height_m(read("time;latitude;longitude;height\n0;48,1;11,1;500.5\n1;48,1;11,1;500.5\n").trajectory),
      500.5, 1e-9);
}

// Garmin's FIT: 2^31 semicircles are 180 deg, seconds count from 1989-12-31.
TEST_F(ForeignTracks, Semicircles) {
  const TrajectoryFile file = read(
      "timestamp,position_lat[semicircles],position_long[semicircles],altitude[m]\n"
      "1083492000,572662306,131235112,500\n1083492001,572662306,131235112,500\n");
  EXPECT_NEAR(latitude_deg(file.trajectory), 48, 1e-7);
  EXPECT_NEAR(longitude_deg(file.trajectory), 11, 1e-7);
  EXPECT_EQ(file.trajectory.begin(), parse_time("2024-05-01T10:00:00Z"));
  EXPECT_THAT(
      refusal("time,latitude,longitude,height\n0,572662306,131235112,500\n1,572662306,131235112,500\n"),
      HasSubstr("name the column latitude_e7, or latitude_semicircles"));
}

// mavlogdump.py --types GPS: its Alt is above sea level.
TEST_F(ForeignTracks, ArduPilotsAltitudes) {
  const TrajectoryFile file = read(
      "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt\n100000000,0,3,295200000,2312,10,0.9,48.0,11.0,500\n"
      "100200000,0,3,295200200,2312,10,0.9,48.0,11.0,500\n");
  EXPECT_THAT(file.warnings, Contains(HasSubstr("heights are above sea level by the header")));
}

TEST_F(ForeignTracks, BasicFormatOfIso8601) {
  const TrajectoryFile file =
      read("time,lat,lon,alt\n20240501T100000Z,48,11,500\n20240501T100001.5Z,48,11,500\n");
  EXPECT_EQ(file.trajectory.begin(), parse_time("2024-05-01T10:00:00Z"));
  EXPECT_EQ(file.trajectory.end() - file.trajectory.begin(), 1.5);
}

std::string track(const std::string& points) {
  return "<?xml version='1.0'?>\n<gpx version='1.1'><trk><trkseg>" + points + "</trkseg></trk></gpx>";
}
std::string point(int second, const std::string& more = {}) {
  return "<trkpt lat='48' lon='11'><ele>500</ele><time>2024-05-01T10:00:0" + std::to_string(second) +
         "Z</time>" + more + "</trkpt>\n";
}

TEST_F(ForeignTracks, GpxWithAPrefixKeepsItsLastPoint) {
  const std::string file =
      "<g:gpx xmlns:g='http://www.topografix.com/GPX/1/1'><g:trk><g:trkseg>"
      "<g:trkpt lat='48' lon='11'><g:ele>500</g:ele><g:time>2024-05-01T10:00:00Z</g:time>"
      "<g:extensions><ele>1</ele></g:extensions></g:trkpt>"
      "<g:trkpt lat='48' lon='11'><g:extensions><ele>1</ele></g:extensions><g:ele>500</g:ele>"
      "<g:time>2024-05-01T10:00:02Z</g:time></g:trkpt></g:trkseg></g:trk></g:gpx>";
  const TrajectoryFile read_back = read(file, "gpx");
  EXPECT_EQ(read_back.trajectory.end() - read_back.trajectory.begin(), 2);
  EXPECT_NEAR(read_back.trajectory.at(read_back.trajectory.end()).position.height_m, 500, 1e-9);
}

TEST_F(ForeignTracks, GpxSaysHowGoodAPointIs) {
  const TrajectoryFile file =
      read(track(point(0) + point(1, "<fix>None</fix>") + point(2, "<src>network</src>") +
                 point(3, "<hdop>99.99</hdop>") + point(4)),
           "gpx");
  EXPECT_THAT(file.warnings, Contains(HasSubstr("point without a fix (the first of 2); left out")));
  EXPECT_THAT(file.warnings, Contains(HasSubstr("dilution of precision of 50 or more; it is taken")));
  EXPECT_THAT(refusal(track(point(0, "<src>network</src>")), "gpx"),
              HasSubstr("none of its points has a fix"));
}

TEST_F(ForeignTracks, GpxPointsInTextAndRoutesAreNoTrack) {
  const TrajectoryFile file = read(
      "<gpx><rte><rtept lat='47' lon='11'/></rte><trk><name><![CDATA[<trkpt lat='1' "
      "lon='1'>]]></name><trkseg>" +
          point(0) + point(1) + "</trkseg></trk></gpx>",
      "gpx");
  EXPECT_THAT(file.warnings, Contains(HasSubstr("point of a route; not read: the track is the path")));
  EXPECT_THAT(file.warnings, Not(Contains(HasSubstr("without a time"))));
}

// Garmin's BaseCamp.
TEST_F(ForeignTracks, GpxRoutesHaveTheWayBetweenTheirPoints) {
  std::ofstream(folder_ / "route.gpx")
      << "<gpx><rte><rtept lat='48' lon='11'><ele>500</ele><extensions><gpxx:RoutePointExtension>"
         "<gpxx:rpt lat='48.001' lon='11'/><gpxx:rpt lat='48.001' lon='11.001'/>"
         "</gpxx:RoutePointExtension></extensions></rtept><rtept lat='48' "
         "lon='11.001'><ele>510</ele></rtept></rte></gpx>";
  const TrackFile route = read_track_file(folder_ / "route.gpx", "gpx", {});
  ASSERT_EQ(route.places.size(), 4U);
  EXPECT_NEAR(geodesy::degrees(route.places[2].latitude_rad), 48.001, 1e-12);
  EXPECT_NEAR(geodesy::degrees(route.places[2].longitude_rad), 11.001, 1e-12);
  EXPECT_NEAR(route.places[3].height_m, 510, 1e-12);
}

TEST_F(ForeignTracks, TwoColumnsOfOneName) {
  EXPECT_THAT(refusal("time,latitude,longitude,height,latitude\n0,48,11,500,0\n1,48,11,500,0\n"),
              HasSubstr("the header names two columns 'latitude'"));
}

TEST_F(ForeignTracks, NmeaInDegreesOrWithDecimalCommas) {
  EXPECT_THAT(refusal("$GPGGA,100000,48.10000,N,011.10000,E,1,08,1.0,500.0,M,47.0,M,,\n", "nmea"),
              HasSubstr("the latitude '48.10000' is not ddmm.mmmm"));
  EXPECT_THAT(refusal("$GPGGA,100000,4800,0000,N,01100,0000,E,1,08,1,0,500,0,M,47,0,M,,\n", "nmea"),
              HasSubstr("a decimal comma makes two fields of one"));
  EXPECT_THAT(refusal("$GPGGA,100000,4800.0,N,01100.0,E,DGNSS fix,8,1,500,M,47,M,,\n", "nmea"),
              HasSubstr("the quality 'DGNSS fix' is not a number"));
  const TrajectoryFile degrees = read("$GPGGA,100000,4806.0,N,11.5,E,1,08,1.0,500.0,M,47.0,M,,\n", "nmea");
  EXPECT_THAT(degrees.warnings, testing::Contains(HasSubstr("three digits or fewer before its point")));
  EXPECT_THAT(refusal("$GPRMC,100000,A,4806.0,N,01130.0,E,0,0,010524,,,A\n"
                      "$GPGGA,100000,4806.0,N,01130.0,E,1,08,1.0,1640.4,f,154.2,f,,\n",
                      "nmea"),
              HasSubstr("the unit 'f' of a height is not M"));
  // Near the equator, and a void sentence with empty fields.
  const TrajectoryFile near = read(
      "$GPGGA,095959,,,,,0,,,,,,,,\n$GPGGA,100000,0048.1,N,00012.0,E,1,08,1.0,500.0,M,47.0,M,,\n"
      "$GPGGA,100001,0048.1,N,00012.0,E,1,08,1.0,500.0,M,47.0,M,,\n",
      "nmea");
  EXPECT_NEAR(latitude_deg(near.trajectory), 48.1 / 60, 1e-12);
}

TEST_F(ForeignTracks, DatesOfReceiversThatKnowNone) {
  const auto dated = [&](const std::string& year) {
    return read("time,latitude,longitude,height\n" + year + "-09-15T10:00:00Z,48,11,500\n" + year +
                "-09-15T10:00:01Z,48,11,500\n")
        .warnings;
  };
  EXPECT_THAT(dated("1980"), Contains(HasSubstr("the path is of 1980-09-15, before GPS was complete")));
  EXPECT_THAT(dated("2004"),
              Contains(HasSubstr("a receiver whose GPS week has rolled over means 2024-05-01")));
  EXPECT_THAT(dated("2012"), IsEmpty());
  EXPECT_THAT(dated("1997"), IsEmpty());
}

// Columns of Google's decimetre challenge, of OxTS's NAVgraph, and words for no fix.
TEST_F(ForeignTracks, OtherNamesOfTimesAndFixes) {
  const TrajectoryFile google = read(
      "phone,millisSinceGpsEpoch,latDeg,lngDeg,heightAboveWgs84EllipsoidM\n"
      "Pixel4,1398592818000,48,11,547\nPixel4,1398592819500,48,11,547\n");
  EXPECT_EQ(google.trajectory.begin(), parse_time("2024-05-01T10:00:18 GPST"));
  EXPECT_EQ(google.trajectory.end() - google.trajectory.begin(), 1.5);
  const TrajectoryFile oxts = read(
      "Date (GPS),Time (GPS),Latitude (deg),Longitude (deg),Altitude (m)\n"
      "2024-05-01,10:00:18.000,48,11,547\n2024-05-01,10:00:19.000,48,11,547\n");
  EXPECT_EQ(oxts.trajectory.begin(), parse_time("2024-05-01T10:00:18 GPST"));
  const TrajectoryFile words = read(
      "time,latitude,longitude,height,fix\n0,48,11,5,No position\n1,48,11,5,normal\n2,48,11,5,RTK fixed\n");
  EXPECT_EQ(words.trajectory.end() - words.trajectory.begin(), 1);
}

// A digit that the first or last time has lost.
TEST_F(ForeignTracks, LoneTimesFarFromAllOthers) {
  const auto lines = [](const std::string& first) {
    std::string text = "2312," + first + ",48,11,500\n";
    for (int i = 1; i < 20; ++i) text += "2312," + std::to_string(295200 + i) + ",48,11,500\n";
    return text;
  };
  const TrajectoryFile file = read(lines("29520"), "urbannav");
  EXPECT_EQ(file.trajectory.end() - file.trajectory.begin(), 18);
  EXPECT_THAT(file.warnings,
              Contains(HasSubstr("path:1: point more than 10 minutes from all others; left out")));
  EXPECT_THAT(read(lines("295200"), "urbannav").warnings, IsEmpty());
  std::string hourly;
  for (int i = 0; i < 20; ++i) hourly += "2312," + std::to_string(295200 + 3600 * i) + ",48,11,500\n";
  EXPECT_EQ(read(hourly, "urbannav").trajectory.end() - read(hourly, "urbannav").trajectory.begin(),
            19 * 3600);
}

TEST_F(ForeignTracks, Utf16OfSpreadsheets) {
  const std::string text = "time\tlatitude\tlongitude\theight\r\n0\t48\t11\t500\r\n1\t48\t11\t500\r\n";
  std::string wide = "\xff\xfe";
  for (const char c : text) wide += {c, '\0'};
  const TrajectoryFile file = read(wide);
  EXPECT_NEAR(latitude_deg(file.trajectory), 48, 1e-12);
  EXPECT_THAT(file.warnings, IsEmpty());
}

// phyphox: "Latitude (\xC2\xB0)".
TEST_F(ForeignTracks, UnitsBehindABlank) {
  const TrajectoryFile file = read(
      "\"Time (s)\",\"Latitude (\xC2\xB0)\",\"Longitude (\xC2\xB0)\",\"Height (m)\",\"Velocity (m/s)\"\n"
      "0,4.81E1,1.15E1,500,1\n1,4.81E1,1.15E1,500,1\n");
  EXPECT_NEAR(latitude_deg(file.trajectory), 48.1, 1e-12);
  EXPECT_NEAR(longitude_deg(file.trajectory), 11.5, 1e-12);
}

TEST_F(ForeignTracks, SidesInNames) {
  const TrajectoryFile file = read("time,lat (S),lon (W),height\n0,33.5,122.5,20\n1,33.5,-122.5,20\n");
  EXPECT_NEAR(latitude_deg(file.trajectory), -33.5, 1e-12);
  EXPECT_NEAR(longitude_deg(file.trajectory), -122.5, 1e-12);
  EXPECT_NEAR(file.trajectory.length_m(), 0, 1e-6) << "the sign may stand there, too";
  EXPECT_NEAR(
      longitude_deg(read("time,lat N/S,lon E/W,height\n0,33.5,122.5,20\n1,33.5,122.5,20\n").trajectory),
      122.5, 1e-12);
}

TEST_F(ForeignTracks, FieldsOfMavlink) {
  const TrajectoryFile file = read(
      "timestamp,GPS_RAW_INT.fix_type,GPS_RAW_INT.lat,GPS_RAW_INT.lon,GPS_RAW_INT.alt\n"
      "1714557600,0,0,0,0\n1714557601,3,481000000,115000000,500000\n1714557602,3,481000000,115000000,"
      "500000\n");
  EXPECT_EQ(file.trajectory.begin(), parse_time("2024-05-01T10:00:01Z"));
  EXPECT_NEAR(latitude_deg(file.trajectory), 48.1, 1e-9);
  EXPECT_NEAR(height_m(file.trajectory), 500, 1e-6);
  EXPECT_THAT(file.warnings, Contains(HasSubstr("above sea level by the header")));
}

TEST_F(ForeignTracks, AccuraciesAndModesOfReceiversWithoutAFix) {
  for (const std::string column :
       {"hAcc,4294967295", "horizontal accuracy,4294967.295", "mode,NO FIX", "lat_lon_valid,0"}) {
    const auto comma = column.find(',');
    const std::string good = column.starts_with("mode") ? "3D" : "1";
    const TrajectoryFile file =
        read(fmt::format("time,lat,lon,height,{}\n0,47,11,500,{}\n1,48,11.5,500,{}\n2,48,11.5,500,{}\n",
                         column.substr(0, comma), column.substr(comma + 1), good, good));
    EXPECT_NEAR(latitude_deg(file.trajectory), 48, 1e-12) << column;
    EXPECT_THAT(file.warnings, Contains(HasSubstr("path:2: line without a fix"))) << column;
  }
  // Numbers of a column 'mode' may mean anything.
  EXPECT_NEAR(latitude_deg(read("time,lat,lon,height,mode\n0,48,11.5,5,0\n1,48,11.5,5,0\n").trajectory), 48,
              1e-12);
}

TEST_F(ForeignTracks, DigitsThatASpreadsheetTookAway) {
  std::string whole = "time,lat,lon,height\n";
  for (int i = 0; i < 9; ++i) whole += std::to_string(i) + ",48,12,500\n";
  EXPECT_THAT(read(whole).warnings, Contains(HasSubstr("whole degrees; were they rounded?")));
  EXPECT_THAT(refusal("time,lat,lon,height\n2024-05-01 10:00,48.1,12,5\n2024-05-01 10:00,48.10001,12,5\n"
                      "2024-05-01 10:00,48.10002,12,5\n"),
              HasSubstr("path:2: all 3 points have one time; export the times with their seconds"));
}

// Microseconds since a start, as PX4 has them, in a column without a unit.
TEST_F(ForeignTracks, TimesThatAreNoSeconds) {
  EXPECT_THAT(refusal("timestamp,lat,lon,height\n0,48.1,12,5\n100000,48.1,12,5\n200000,48.1,12,5\n"),
              HasSubstr("points are 1e+05 s apart on average; name the column by the unit that it has"));
  EXPECT_THAT(read("time_s,lat,lon,height\n0,48.1,12,5\n100000,48.1,12,5\n200000,48.1,12,5\n").warnings,
              IsEmpty());
}

TEST_F(ForeignTracks, LinesOfOtherThingsAboveTheHeader) {
  const TrajectoryFile file = read(
      "This file is created using RaceChrono v7\nFormat,3\nCreated,01/05/2024,10:00\n\n"
      "timestamp,latitude,longitude,altitude\n1714557600,48.1,11.5,500\n1714557601,48.1,11.5,500\n");
  EXPECT_EQ(file.trajectory.begin(), parse_time("2024-05-01T10:00:00Z"));
}

TEST_F(ForeignTracks, BlanksWithoutAHeader) {
  EXPECT_THAT(refusal("48.1 11.5 500 0 0\n48.1 11.5 500 0 0\n"),
              HasSubstr("path:1: blanks stand between the columns, and no header names them"));
}

TEST_F(ForeignTracks, AGeoidInAColumnOfItsOwnIsNamed) {
  EXPECT_THAT(read("time,lat,lon,elevation,geoidheight\n0,48.1,11.5,500,47\n1,48.1,11.5,500,47\n").warnings,
              Contains(HasSubstr("heights are 'elevation' plus the column of the geoid")));
}

// Some modems write GNS each second and GGA each minute.
TEST_F(ForeignTracks, NmeaOfSentencesWithOtherRates) {
  const std::string gga = "$GPGGA,100000.00,4806.00,N,01130.00,E,1,09,0.9,500.0,M,47.0,M,,\n";
  const std::string gns = "$GNGNS,1000%.00,4806.00,N,01130.00,E,AA,09,0.9,500.0,47.0,,\n";
  const std::string rmc = "$GNRMC,1000%.00,A,4806.00,N,01130.00,E,0.0,,010524,,,A\n";
  const auto at = [](std::string sentence, int second) {
    return sentence.replace(sentence.find('%'), 1,
                            second < 10 ? "0" + std::to_string(second) : std::to_string(second));
  };
  std::string both = gga, mixed = gga;
  for (int second = 0; second < 10; ++second) {
    both += at(gns, second) + at(rmc, second);
    mixed += at(rmc, second);
  }
  const TrajectoryFile file = read(both, "nmea");
  EXPECT_EQ(file.trajectory.end() - file.trajectory.begin(), 9);
  EXPECT_NEAR(height_m(file.trajectory), 547, 1e-6);
  EXPECT_THAT(file.warnings, IsEmpty());
  // RMC has no heights: that it knows more is said.
  EXPECT_THAT(
      read(mixed, "nmea").warnings,
      Contains(HasSubstr("path:3: RMC position at an instant without GGA (the first of 9); not read")));
}

}  // namespace
}  // namespace canyon::simulation
