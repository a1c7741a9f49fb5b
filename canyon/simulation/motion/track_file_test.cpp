#include "canyon/simulation/motion/recorded_path.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/simulation/motion/track_file.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "tests/support/simulation_support.hpp"

namespace canyon::simulation {
namespace {

using test::error_of;
using test::TemporaryFolder;
using ::testing::HasSubstr;
using namespace std::string_literals;

// A track as in the GPX 1.1 schema (topografix.com/GPX/1/1), with surrounding content to be skipped.
constexpr const char* kGpx = R"(<?xml version="1.0"?>
<gpx version="1.1" creator="x > y" xmlns="http://www.topografix.com/GPX/1/1">
  <!-- <trkpt lat="1" lon="1"/> -->
  <wpt lat="0" lon="0"><ele>1</ele></wpt>
  <trk><name>way</name><trkseg>
    <trkpt lat="22.3" lon='114.17'><ele>5.5</ele><time>2026-06-01T08:00:00Z</time></trkpt>
    <trkpt lon="114.171" lat="22.3"><ele>6.5</ele><time>2026-06-01T08:00:10.5Z</time>
      <extensions><x:speed xmlns:x="y">10</x:speed></extensions></trkpt>
    <trkpt lat="22.3" lon="114.171"><ele>6.5</ele><time>2026-06-01T08:00:10.5Z</time></trkpt>
  </trkseg></trk>
</gpx>
)";
constexpr const char* kKmlTrack = R"(<kml xmlns:gx="http://www.google.com/kml/ext/2.2"><Placemark><gx:Track>
  <when>2026-06-01T08:00:00Z</when><when>2026-06-01T08:00:05Z</when>
  <gx:coord>114.17 22.3 5.5</gx:coord><gx:coord>114.171 22.3 6.5</gx:coord>
</gx:Track></Placemark></kml>)";
constexpr const char* kKmlLine = R"(<kml><Placemark><Point><coordinates>0,0</coordinates></Point></Placemark>
<Placemark><LineString><coordinates>
  114.17,22.3,5.5 114.171,22.3
</coordinates></LineString></Placemark></kml>)";

TEST(TrackFile, ReadsGpxTracks) {
  const TemporaryFolder folder;
  const RecordedPath track = read_track_file(folder.write("a.gpx", kGpx), "gpx");
  ASSERT_EQ(track.points.size(), 3U);
  EXPECT_NEAR(geodesy::degrees(track.points[1].position.longitude_rad), 114.171, 1e-12);
  EXPECT_EQ(track.points[1].position.height_m, 6.5);
  EXPECT_DOUBLE_EQ(track.points[1].time - track.points[0].time, 10.5);
  EXPECT_THAT(track.report.warnings(), ::testing::ElementsAre(HasSubstr("sea level")));
  const TrajectoryFile drive = read_trajectory_file(folder.path() / "a.gpx", "gpx", {});
  EXPECT_DOUBLE_EQ(drive.trajectory.end() - drive.trajectory.begin(), 10.5);
  EXPECT_THAT(drive.report.lines(),
              ::testing::Contains(HasSubstr("point that repeats the time of the previous one")));
}

TEST(TrackFile, ReadsKml) {
  const TemporaryFolder folder;
  const RecordedPath track = read_track_file(folder.write("a.kml", kKmlTrack), "kml");
  ASSERT_EQ(track.points.size(), 2U);
  EXPECT_DOUBLE_EQ(track.points[1].time - track.points[0].time, 5);
  EXPECT_EQ(track.points[0].position.height_m, 5.5);
  const RecordedPath line = read_track_file(folder.write("b.kml", kKmlLine), "kml");
  ASSERT_EQ(line.points.size(), 2U);
  EXPECT_FALSE(line.timed);
  EXPECT_NEAR(geodesy::degrees(line.points[0].position.latitude_rad), 22.3, 1e-12);
  EXPECT_THAT(line.report.warnings(), ::testing::Contains(HasSubstr("point without a height; ")));
}

TEST(TrackFile, RefusesWhatIsNone) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& text, const std::string& format) {
    const auto path = folder.write("bad", text);
    return std::string(error_of([&] { (void)read_track_file(path, format); }).what());
  };
  EXPECT_THAT(refused("", "gpx"), HasSubstr("no track point"));
  EXPECT_THAT(refused("a,b,c", "kml"), HasSubstr("no gx:Track"));
  EXPECT_THAT(refused("<trkpt lat=\"95\" lon=\"0\"/>", "gpx"), HasSubstr("latitude 95 deg"));
  EXPECT_THAT(refused("\n<trkpt lat=\"x\" lon=\"0\"/>", "gpx"), HasSubstr("bad:2: the latitude 'x'"));
  EXPECT_THAT(refused("<trkpt lat=\"9\"/>", "gpx"), HasSubstr("longitude ''"));
  EXPECT_THAT(refused("<trkpt lat=\"9\" lon=\"0\"", "gpx"), HasSubstr("no track point"));
  EXPECT_THAT(refused("<trkpt lat=\"9\" lon=\"0\"><time>then</time></trkpt>", "gpx"), HasSubstr("then"));
  EXPECT_THAT(refused("<trkpt lat=\"9\" lon=\"0\"><time>2026-01-01T00:00:00Z</time></trkpt>"
                      "<trkpt lat=\"9\" lon=\"0\"></trkpt>",
                      "gpx"),
              HasSubstr("1 of 2 points have no time"));
  EXPECT_THAT(refused("<gx:Track><gx:coord>1 2</gx:coord></gx:Track>", "kml"),
              HasSubstr("0 times for 1 positions"));
  const auto line = folder.write("b.kml", kKmlLine);
  EXPECT_THAT(error_of([&] { (void)read_trajectory_file(line, "kml", {}); }).what(), HasSubstr("no times"));
}

TEST(TrackFile, SegmentsComeInOrderOfTime) {
  const TemporaryFolder folder;
  const auto point = [](const char* latitude, const char* second, const std::string& more = {}) {
    return std::string("<trkpt lat=\"") + latitude + "\" lon=\"11\"><time>2026-06-01T08:00:" + second +
           "Z</time>" + more + "</trkpt>";
  };
  const std::string newer = "<trk><trkseg>" + point("48.1", "30") + point("48.1", "31") + "</trkseg></trk>";
  const std::string older = "<trk><trkseg>" + point("48", "00", "<fix>none</fix>") +
                            point("48", "01", "<ele>500</ele>") + point("48", "02") +
                            "<trkpt lat=\"48\" lon=\"11\"></trkpt></trkseg></trk>";
  const RecordedPath track = read_track_file(folder.write("a.gpx", newer + older), "gpx");
  ASSERT_EQ(track.points.size(), 4U);
  EXPECT_DOUBLE_EQ(track.points[3].time - track.points[0].time, 30);
  EXPECT_EQ(track.points[1].position.height_m, 500);
  EXPECT_THAT(track.report.warnings(), ::testing::Contains(HasSubstr("point without a fix")));
  EXPECT_THAT(track.report.warnings(), ::testing::Contains(HasSubstr("point without a time")));
  EXPECT_THAT(track.report.warnings(),
              ::testing::Contains(HasSubstr("point without a height (the first of 3)")));
}

TEST(TrackFile, OneWrongValueCostsOnePoint) {
  const TemporaryFolder folder;
  const auto read = [&](const std::string& wrong, const std::string& format) {
    std::string text;
    for (int i = 10; i < 16; ++i) {
      const std::string n = std::to_string(i);
      if (i == 12) {
        text += wrong;
      } else if (format == "gpx") {
        text += "<trkpt lat=\"48.00" + n + "\" lon=\"11\"><ele>5</ele><time>2026-06-01T08:00:" + n +
                "Z</time></trkpt>\n";
      } else {
        text += "<when>2026-06-01T08:00:" + n + "Z</when><gx:coord>11 48.00" + n + " 5</gx:coord>\n";
      }
    }
    if (format == "kml") text = "<gx:Track>" + text + "</gx:Track>";
    return read_trajectory_file(folder.write("a", text), format, {});
  };
  const std::string time = "<time>2026-06-01T08:00:12Z</time>";
  const std::string when = "<when>2026-06-01T08:00:12Z</when>";
  for (const auto& [wrong, format] :
       {std::pair("<trkpt lat=\"91\" lon=\"11\">" + time + "</trkpt>", "gpx"),
        std::pair("<trkpt lat=\"48\" lo=\"11\">" + time + "</trkpt>", "gpx"),
        std::pair("<trkpt lat=\"48\" lon=\"11\"><time>noon</time></trkpt>"s, "gpx"),
        std::pair("<trkpt lat=\"48\" lon=\"11\"><ele>x</ele>" + time + "</trkpt>", "gpx"),
        std::pair(when + "<gx:coord>11 91 5</gx:coord>", "kml"),
        std::pair("<when>noon</when><gx:coord>11 48 5</gx:coord>"s, "kml")}) {
    const TrajectoryFile file = read(wrong, format);
    EXPECT_DOUBLE_EQ(file.trajectory.end() - file.trajectory.begin(), 5) << wrong;
    EXPECT_THAT(file.report.warnings(),
                ::testing::Contains(::testing::AllOf(HasSubstr("a:3: "), HasSubstr("; left out"))))
        << wrong;
  }
  EXPECT_THAT(error_of([&] { (void)read(when, "kml"); }).what(), HasSubstr("6 times for 5 positions"));
}

TEST(TrackFile, KmlTracksAndModesOfHeight) {
  const TemporaryFolder folder;
  const auto track_of = [](const char* mode, const char* minute) {
    return std::string("<gx:Track><altitudeMode>") + mode + "</altitudeMode><when>2026-06-01T08:" + minute +
           ":00Z</when><gx:coord>11 48 500</gx:coord><when>2026-06-01T08:" + minute +
           ":01Z</when><gx:coord/></gx:Track>";
  };
  const auto read = [&](const char* mode) {
    return read_track_file(folder.write("a.kml", "<gx:MultiTrack>" + track_of(mode, "00") +
                                                     track_of(mode, "30") + "</gx:MultiTrack>"),
                           "kml", {true, 47});
  };
  const RecordedPath absolute = read("absolute");
  ASSERT_EQ(absolute.points.size(), 2U);
  EXPECT_DOUBLE_EQ(absolute.points[1].time - absolute.points[0].time, 1800);
  EXPECT_DOUBLE_EQ(absolute.points[0].position.height_m, 547);
  EXPECT_DOUBLE_EQ(read("clampToGround").points[0].position.height_m, 500);
  EXPECT_THAT(read("relativeToGround").report.warnings(),
              ::testing::Contains(HasSubstr("height by the altitudeMode relativeToGround")));
  const RecordedPath lines =
      read_track_file(folder.write("b.kml", std::string(kKmlLine) +
                                                "<LineString><coordinates>1,2,3</coordinates></LineString>"),
                      "kml");
  EXPECT_EQ(lines.points.size(), 2U);
  EXPECT_EQ(lines.report.entries().front().first, ReadReport::Level::Loss);
  EXPECT_THAT(lines.report.warnings(), ::testing::Contains(HasSubstr("another LineString")));
}

// Trackers write a Placemark with TimeStamp and Point for each fix, and the trail as LineStrings of two
// points.
std::string kml_fix(const std::string& when, const std::string& latitude, const std::string& prefix = {}) {
  const auto tag = [&](const std::string& name) { return "<" + prefix + name + ">"; };
  const auto end = [&](const std::string& name) { return "</" + prefix + name + ">"; };
  return tag("Placemark") + tag("LookAt") + tag("gx:TimeStamp") + "<when>1999-01-01</when></gx:TimeStamp>" +
         end("LookAt") + tag("Point") + tag("altitudeMode") + "absolute" + end("altitudeMode") +
         tag("coordinates") + "11.5," + latitude + ",525" + end("coordinates") + end("Point") + when +
         end("Placemark") + "\n";
}
std::string kml_time(int second, const std::string& prefix = {}) {
  return "<" + prefix + "TimeStamp><" + prefix + "when>2026-06-01T12:00:" + std::to_string(second) + "Z</" +
         prefix + "when></" + prefix + "TimeStamp>";
}
constexpr const char* kTrail =
    "<Placemark><LineString><coordinates>11.5,48.1 11.5,48.2</coordinates></LineString>"
    "</Placemark><LineString><coordinates>11.5,48.2 11.5,48.3</coordinates></LineString>";

TEST(TrackFile, KmlPointsWithTimesAreATrack) {
  const TemporaryFolder folder;
  const auto read = [&](const std::string& text) {
    return read_track_file(folder.write("a.kml", "<kml><Document>" + text + "</Document></kml>"), "kml");
  };
  for (const std::string& prefix : {std::string(), std::string("kml:")}) {
    // Newest first, as in feeds.
    const RecordedPath path =
        read(kml_fix(kml_time(30, prefix), "48.3", prefix) + kml_fix(kml_time(20, prefix), "48.2", prefix) +
             kTrail + kml_fix(kml_time(10, prefix), "48.1", prefix));
    ASSERT_EQ(path.points.size(), 3U);
    EXPECT_TRUE(path.timed);
    EXPECT_DOUBLE_EQ(path.points[2].time - path.points[0].time, 20);
    EXPECT_NEAR(geodesy::degrees(path.points[0].position.latitude_rad), 48.1, 1e-12);
    EXPECT_EQ(path.points[0].position.height_m, 525);
  }
  const std::string span =
      "<TimeSpan><begin>2026-06-01T12:00:40Z</begin><end>2026-06-01T12:00:50Z</end></TimeSpan>";
  const RecordedPath path =
      read(kml_fix(kml_time(10), "48.1") + kml_fix(kml_time(20), "48.2") + kml_fix(span, "48.3") +
           kml_fix("", "48.4") + kml_fix("", "48.5") + kml_fix("", "48.6") + kml_fix("", "48.7") +
           kml_fix("<TimeStamp><when>noon</when></TimeStamp>", "48.8"));
  ASSERT_EQ(path.points.size(), 3U);
  EXPECT_DOUBLE_EQ(path.points[2].time - path.points[0].time, 30);
  EXPECT_THAT(
      path.report.lines(ReadReport::Level::Loss),
      ::testing::UnorderedElementsAre(HasSubstr("noon"), HasSubstr("Point without a time (the first of 4)")));
  EXPECT_THAT(path.report.warnings(), ::testing::Contains(HasSubstr("TimeSpan of a Point; its begin")));
}

TEST(TrackFile, KmlTimesThatAreNotReadAreLosses) {
  const TemporaryFolder folder;
  const auto read = [&](const std::string& text) {
    return read_track_file(folder.write("a.kml", "<kml>" + text + "</kml>"), "kml");
  };
  const auto losses = [](const RecordedPath& path) { return path.report.lines(ReadReport::Level::Loss); };
  const RecordedPath trail = read(kTrail);
  EXPECT_EQ(trail.points.size(), 3U) << "a LineString that begins where the one before ends continues it";
  EXPECT_THAT(losses(trail), ::testing::ElementsAre());
  const RecordedPath marked = read(kTrail + kml_fix(kml_time(10), "48.1"));
  EXPECT_EQ(marked.points.size(), 3U);
  EXPECT_FALSE(marked.timed);
  EXPECT_THAT(losses(marked), ::testing::ElementsAre(HasSubstr("Point with a time; not read")));
  EXPECT_THAT(
      losses(read("<Placemark>" + kml_time(10) + "<LineString><coordinates>11,48 11,49</coordinates>" +
                  "</LineString></Placemark>")),
      ::testing::ElementsAre(HasSubstr("time of a LineString; not read")));
  const RecordedPath track = read(kKmlTrack + kml_fix(kml_time(10), "48.1"));
  EXPECT_EQ(track.points.size(), 2U);
  EXPECT_THAT(losses(track), ::testing::ElementsAre(HasSubstr("Point with a time; not read: gx:Track")));
}

}  // namespace
}  // namespace canyon::simulation
