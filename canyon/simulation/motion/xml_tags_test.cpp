#include "canyon/simulation/motion/xml_tags.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "canyon/geodesy/time_scales.hpp"
#include "canyon/simulation/motion/track_file.hpp"
#include "tests/support/simulation_support.hpp"

// Tracks of recorders that lose power, and what GPX and KML say beside places.
namespace canyon::simulation::xml_tags_test {
namespace {

using test::TemporaryFolder;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(XmlTags, NamesAttributesAndText) {
  const TextFile file =
      TextFile::from_string("<?xml?><a:b c = 'd'>\n<!-- <e> --> text <f/></a:b><g>h", "a.xml");
  XmlTags tags(file);
  ASSERT_TRUE(tags.next());
  EXPECT_EQ(tags.name, "b");
  EXPECT_EQ(tags.attribute("c"), "d");
  EXPECT_EQ(tags.attribute("e"), "");
  ASSERT_TRUE(tags.next());
  EXPECT_EQ(tags.name, "f");
  EXPECT_EQ(tags.line(), 2);
  ASSERT_TRUE(tags.next() && tags.next());
  EXPECT_EQ(tags.content, "h");
  EXPECT_FALSE(tags.next());
}

TEST(XmlTags, CutTexts) {
  EXPECT_FALSE(ends_early("<gpx><trkpt/></gpx>\n", "gpx"));
  EXPECT_FALSE(ends_early("<g:gpx></g:gpx >", "gpx"));
  EXPECT_FALSE(ends_early("<trkpt/>", "gpx")) << "a fragment";
  for (const char* cut : {"<gpx>", "<gpx><trkpt></trkpt>", "<gpx></gpx", "<gpx></trk><tr"})
    EXPECT_TRUE(ends_early(cut, "gpx")) << cut;
}

class TrackReader : public ::testing::Test {
 protected:
  TrackFile read(const std::string& text, const std::string& format = "gpx") const {
    return read_track_file(folder_.write("a." + format, text), format, {});
  }
  TemporaryFolder folder_;
};

std::string point(int second, const std::string& more, const std::string& zone = "Z") {
  return fmt::format("<trkpt lat='48' lon='11'>{}<time>2024-05-01T10:00:{:02d}{}</time></trkpt>\n", more,
                     second, zone);
}
std::string gpx(const std::string& points) {
  return "<gpx><trk><trkseg>\n" + points + "</trkseg></trk></gpx>";
}

TEST_F(TrackReader, ReadsACutFileToItsLastWholePoint) {
  const std::string whole =
      gpx(point(0, "<ele>500</ele>") + point(1, "<ele>500</ele>") + point(2, "<ele>500</ele>"));
  const std::size_t last = whole.rfind("<ele>500") + 7;  // "<ele>50"
  const TrackFile cut = read(whole.substr(0, last));
  ASSERT_EQ(cut.places.size(), 2U);
  EXPECT_EQ(cut.places.back().height_m, 500);
  EXPECT_THAT(cut.notes.lines(),
              Contains(HasSubstr("a.gpx:4: the file ends without </gpx>; read up to there")));
  EXPECT_THAT(read(whole).notes.lines(), Not(Contains(HasSubstr("ends without"))));
  const TrackFile line = read("<kml><LineString><coordinates>11,48,500 11,48.001,500 11,48.00", "kml");
  ASSERT_EQ(line.places.size(), 2U);
}

TEST_F(TrackReader, GpxSaysWhatItsValuesAreWorth) {
  EXPECT_THAT(read(gpx(point(0, "", "") + point(1, "", ""))).notes.lines(),
              Contains(HasSubstr("time without a zone (the first of 2); taken as UTC")));
  EXPECT_THAT(read(gpx(point(0, "<sat>0</sat>") + point(1, "<sat>7</sat>"))).notes.lines(),
              Contains(HasSubstr("point of a fix with 0 satellites; it is taken")));
  // Two dimensions: no height was measured.
  const TrackFile flat =
      read(gpx(point(0, "<ele>0</ele><fix>2d</fix>") + point(1, "<fix>2d</fix><ele>0.0</ele>") +
               point(2, "<ele>500</ele><fix>3d</fix>")));
  for (const auto& place : flat.places) EXPECT_EQ(place.height_m, 500);
  const TrackFile geoid = read(gpx(point(0, "<ele>500</ele><geoidheight>47</geoidheight>") +
                                   point(1, "<ele>500</ele>") + point(2, "<ele>500</ele>")));
  for (const auto& place : geoid.places) EXPECT_EQ(place.height_m, 547);
  EXPECT_THAT(geoid.notes.lines(), ElementsAre(HasSubstr("point without a geoidheight (the first of 2)")));
}

TEST_F(TrackReader, KmlOffsetsSpansAndBlanks) {
  const std::string track =
      "<kml><Placemark><gx:Track><altitudeMode>absolute</altitudeMode><gx:altitudeOffset>47</"
      "gx:altitudeOffset>"
      "<when>2024-05-01T10:00:00Z</when><when>2024-05-01T10:00:01Z</when>"
      "<gx:coord>11 48 500</gx:coord><gx:coord>11 48 501</gx:coord></gx:Track></Placemark></kml>";
  EXPECT_EQ(read(track, "kml").places[1].height_m, 548);
  const std::string span =
      "<kml><Placemark><TimeSpan><begin>2024-05-01T10:00:00Z</begin><end>2024-05-01T11:00:00Z</end></"
      "TimeSpan>"
      "<Point><coordinates>11,48,500</coordinates></Point></Placemark></kml>";
  EXPECT_EQ(read(span, "kml").times.at(0), geodesy::parse_time("2024-05-01T10:00:00Z"));
  const TrackFile line =
      read("<kml><LineString><coordinates>11.0, 48.0, 500\n 11.0, 48.1, 501</coordinates></LineString></kml>",
           "kml");
  ASSERT_EQ(line.places.size(), 2U);
  EXPECT_EQ(line.places[1].height_m, 501);
}

}  // namespace
}  // namespace canyon::simulation::xml_tags_test
