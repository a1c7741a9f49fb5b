#include "canyon/simulation/motion/xml_tags.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "canyon/simulation/motion/recorded_path.hpp"
#include "canyon/simulation/motion/track_file.hpp"
#include "tests/support/simulation_support.hpp"

// Tracks of recorders that lose power, and content of GPX and KML other than positions.
namespace canyon::simulation::xml_tags_test {
namespace {

using test::TemporaryFolder;
using ::testing::Contains;
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

class TrackFiles : public ::testing::Test {
 protected:
  RecordedPath read(const std::string& text, const std::string& format = "gpx") const {
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

TEST_F(TrackFiles, ReadsACutFileToItsLastWholePoint) {
  const std::string whole =
      gpx(point(0, "<ele>500</ele>") + point(1, "<ele>500</ele>") + point(2, "<ele>500</ele>"));
  const std::size_t last = whole.rfind("<ele>500") + 7;  // "<ele>50"
  const RecordedPath cut = read(whole.substr(0, last));
  ASSERT_EQ(cut.points.size(), 2U);
  EXPECT_EQ(cut.points.back().position.height_m, 500);
  EXPECT_THAT(cut.report.warnings(),
              Contains(HasSubstr("a.gpx:4: the file ends without </gpx>; read up to there")));
  EXPECT_THAT(read(whole).report.warnings(), Not(Contains(HasSubstr("ends without"))));
  const RecordedPath line = read("<kml><LineString><coordinates>11,48,500 11,48.001,500 11,48.00", "kml");
  ASSERT_EQ(line.points.size(), 2U);
}

TEST_F(TrackFiles, TimesWithoutAZoneAndBlanksBehindCommas) {
  EXPECT_THAT(read(gpx(point(0, "", "") + point(1, "", ""))).report.warnings(),
              Contains(HasSubstr("time without time zone (the first of 2); taken as UTC")));
  const RecordedPath line =
      read("<kml><LineString><coordinates>11.0, 48.0, 500\n 11.0, 48.1, 501</coordinates></LineString></kml>",
           "kml");
  ASSERT_EQ(line.points.size(), 2U);
  EXPECT_EQ(line.points[1].position.height_m, 501);
}

}  // namespace
}  // namespace canyon::simulation::xml_tags_test
