// KML, GeoJSON and GPX.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/text.hpp"
#include "canyon/outputs/encoding/number.hpp"
#include "canyon/outputs/encoding/stream.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "tests/support/program.hpp"
#include "tests/support/sample_epochs.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::encoding::tracks_test {
namespace {

using testing::HasSubstr;

/// Eight epochs; without fix at 3, 4 and 6; horizontal errors i^2 metres east.
std::vector<simulation::Epoch> sample_run() {
  std::vector<simulation::Epoch> epochs;
  for (int i = 0; i < 8; ++i) {
    geodesy::Geodetic position = test::sample_point();
    position.latitude_rad += 1e-6 * i;
    epochs.push_back(test::sample_epoch(test::sample_time() + i, position, {1.0 * i * i, 0, -1},
                                        i != 3 && i != 4 && i != 6));
  }
  return epochs;
}

void feed(simulation::EpochSink& sink, const std::vector<simulation::Epoch>& epochs) {
  for (const auto& epoch : epochs) sink.write(epoch);
  sink.finish();
}

std::size_t occurrences(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++n;
  return n;
}

TEST(Kml, IsWellFormedAndHoldsEveryEpoch) {
  CANYON_NEEDS_PROGRAM("xmllint");
  const test::TemporaryFolder folder;
  const auto path = folder / "track.kml";
  feed(*open_file("kml", path, 0, {"rover <1> & \"co\""}), sample_run());
  EXPECT_EQ(test::run_program("xmllint --noout '" + path.string() + "'").status, 0);
  const auto query = [&](const std::string& xpath) {
    return std::string(
        trim(test::run_program("xmllint --xpath '" + xpath + "' '" + path.string() + "'").output));
  };
  const std::string placemark = "//*[local-name()=\"Placemark\"]";
  EXPECT_EQ(query("string(//*[local-name()=\"Document\"]/*[local-name()=\"name\"])"), "rover <1> & \"co\"");
  // Truth; outages; fixes connected; errors 0 and 1, 4, 25, 49 in four classes.
  EXPECT_EQ(query("count(" + placemark + ")"), "7");
  const auto of = [&](const std::string& style) {
    return placemark + "[*[local-name()=\"styleUrl\"]=\"#" + style + "\"]//*[local-name()=";
  };
  EXPECT_EQ(query("count(" + of("truth") + "\"LineString\"])"), "1");
  EXPECT_EQ(query("count(" + of("outage") + "\"LineString\"])"), "1");  // seconds 3 and 4
  EXPECT_EQ(query("count(" + of("outage") + "\"Point\"])"), "1");       // second 6
  EXPECT_EQ(query("count(" + of("fix") + "\"LineString\"])"), "1");     // 0 to 2
  EXPECT_EQ(query("count(" + of("fix") + "\"Point\"])"), "2");          // 5, 7
  EXPECT_EQ(query("count(" + of("error_0_2") + "\"Point\"])"), "2");
  EXPECT_EQ(query("count(" + of("error_2_5") + "\"Point\"])"), "1");
  EXPECT_EQ(query("count(" + of("error_10_30") + "\"Point\"])"), "1");
  EXPECT_EQ(query("count(" + of("error_30") + "\"Point\"])"), "1");
  // Every style named in a placemark is defined.
  EXPECT_EQ(query("count(" + placemark +
                  "[not(substring(*[local-name()=\"styleUrl\"],2)=//*[local-name()=" + "\"Style\"]/@id)])"),
            "0");
}

TEST(Kml, CoordinatesAreLongitudeLatitudeHeight) {
  const test::TemporaryFolder folder;
  feed(*open_file("kml", folder / "track.kml", 0, {"rover"}), sample_run());
  const std::string text = test::read_bytes(folder / "track.kml");
  EXPECT_THAT(text, HasSubstr("114.178761000,22.298251000,12.345\n"));
  EXPECT_THAT(text,
              HasSubstr("<description>2019-04-28T12:58:03.000Z to 2019-04-28T12:58:10.000Z: 8 epochs, 5 with "
                        "fix, 3 without</description>"));
  EXPECT_EQ(occurrences(text, "<coordinates>"), occurrences(text, "</coordinates>"));
  EXPECT_EQ(text.find("nan"), std::string::npos);
}

// A line of another kind begins at the end of the previous line, but after an outage at the fix itself.
TEST(Kml, ColoursFixesByTheirKind) {
  using positioning::FixKind;
  const test::TemporaryFolder folder;
  auto epochs = sample_run();
  for (const std::size_t i : {1, 2}) epochs[i] = test::corrected(epochs[i], FixKind::Fixed);
  epochs[5] = test::corrected(epochs[5], FixKind::Float);
  feed(*open_file("kml", folder / "track.kml", 0, {"rover"}), epochs);
  const std::string text = test::read_bytes(folder / "track.kml");
  const auto positions = [&](const std::string& name) {
    const std::size_t from = text.find("<name>" + name + "</name>");
    return occurrences(text.substr(from, text.find("</Placemark>", from) - from), ",11.345\n");
  };
  EXPECT_EQ(positions("Fixes, connected"), 2U) << "seconds 0 and 7";
  EXPECT_EQ(positions("Fixes, connected: fixed"), 3U) << "0 to 2";
  EXPECT_EQ(positions("Fixes, connected: float"), 1U) << "5";
  EXPECT_EQ(occurrences(text, "<Style id=\"fix_fixed\">"), 1U);
  EXPECT_EQ(occurrences(text, "<styleUrl>#fix_float</styleUrl>"), 1U);
  EXPECT_EQ(occurrences(text, "fix_differential"), 0U);
}

/// Three epochs across the antimeridian, on the equator, 22 m apart; the middle one 5 m short of it.
std::vector<simulation::Epoch> run_across_the_antimeridian() {
  std::vector<simulation::Epoch> epochs;
  for (const double longitude : {179.99975, 179.99995, -179.99985}) {
    epochs.push_back(test::sample_epoch(test::sample_time() + static_cast<double>(epochs.size()),
                                        geodesy::Geodetic::from_degrees(0, longitude, 10), {0, 0, 0}, true));
  }
  return epochs;
}

TEST(Kml, IsCutAtTheAntimeridian) {
  const test::TemporaryFolder folder;
  feed(*open_file("kml", folder / "track.kml", 0, {"rover"}), run_across_the_antimeridian());
  const std::string text = test::read_bytes(folder / "track.kml");
  EXPECT_THAT(text, HasSubstr("\n179.999950000,0.000000000,10.000\n180.000000000,0.000000000,10.000\n"
                              "</coordinates></LineString>"));
  EXPECT_THAT(text, HasSubstr("<coordinates>\n-180.000000000,0.000000000,10.000\n"
                              "-179.999850000,0.000000000,10.000\n</coordinates></LineString>"));
}

// RFC 7946, 3.1.9.
TEST(GeoJson, IsCutAtTheAntimeridian) {
  const test::TemporaryFolder folder;
  feed(*open_file("geojson", folder / "track.geojson", 0, {"rover"}), run_across_the_antimeridian());
  const auto truth =
      nlohmann::json::parse(test::read_bytes(folder / "track.geojson")).at("features").at(3).at("geometry");
  EXPECT_EQ(truth, nlohmann::json::parse(R"({"type":"MultiLineString","coordinates":[
    [[179.99975,0,10],[179.99995,0,10],[180,0,10]],[[-180,0,10],[-179.99985,0,10]]]})"));
}

TEST(Kml, EmptyRun) {
  const test::TemporaryFolder folder;
  feed(*open_file("kml", folder / "track.kml", 0, {"rover"}), {});
  EXPECT_THAT(test::read_bytes(folder / "track.kml"), HasSubstr("</kml>"));
}

TEST(GeoJson, HoldsTruthFixesAndOutages) {
  const test::TemporaryFolder folder;
  const auto epochs = sample_run();
  feed(*open_file("geojson", folder / "track.geojson", 0, {"rover \"\xFF\""}), epochs);
  const auto file = nlohmann::json::parse(test::read_bytes(folder / "track.geojson"));
  EXPECT_EQ(file.at("type"), "FeatureCollection");
  ASSERT_EQ(file.at("features").size(), 9U);
  for (std::size_t i = 0; i < 8; ++i) {
    const auto& feature = file.at("features")[i];
    const auto& properties = feature.at("properties");
    const auto& fix = epochs[i].observed.fix;
    EXPECT_EQ(feature.at("geometry").at("type"), "Point");
    EXPECT_EQ(properties.at("kind"), fix.solved() ? "fix" : "outage");
    EXPECT_EQ(properties.at("status"), fix.solved() ? "fix" : "no fix");
    EXPECT_EQ(properties.contains("error_horizontal_m"), fix.solved());
    const auto& shown = fix.solved() ? fix.position : epochs[i].truth.position;
    const auto& c = feature.at("geometry").at("coordinates");
    EXPECT_NEAR(c[0].get<double>(), geodesy::degrees(shown.longitude_rad), 1e-9);
    EXPECT_NEAR(c[1].get<double>(), geodesy::degrees(shown.latitude_rad), 1e-9);
    EXPECT_NEAR(c[2].get<double>(), shown.height_m, 1e-3);
  }
  const auto& last_fix = file.at("features")[7].at("properties");
  EXPECT_EQ(last_fix.at("time"), "2019-04-28T12:58:10.000Z");
  EXPECT_EQ(last_fix.at("error_horizontal_m"), 49);
  EXPECT_EQ(last_fix.at("error_up_m"), -1);
  EXPECT_EQ(last_fix.at("used"), 9);
  EXPECT_EQ(file.at("features")[3].at("properties").at("reason"), "too few satellites");
  const auto& truth = file.at("features")[8];
  EXPECT_EQ(truth.at("properties").at("kind"), "truth");
  EXPECT_EQ(truth.at("geometry").at("type"), "LineString");
  EXPECT_EQ(truth.at("geometry").at("coordinates").size(), 8U);
}

TEST(Tracks, NameFaults) {
  const test::TemporaryFolder folder;
  auto epochs = sample_run();
  for (const std::size_t i : {1, 2, 5}) epochs[i].faults = {"a <jammer>"};
  feed(*open_file("geojson", folder / "track.geojson", 0, {"rover"}), epochs);
  feed(*open_file("kml", folder / "track.kml", 0, {"rover"}), epochs);
  const auto file = nlohmann::json::parse(test::read_bytes(folder / "track.geojson"));
  EXPECT_EQ(file.at("features")[1].at("properties").at("faults"), nlohmann::json::array({"a <jammer>"}));
  EXPECT_FALSE(file.at("features")[0].at("properties").contains("faults"));
  const std::string kml = test::read_bytes(folder / "track.kml");
  EXPECT_EQ(occurrences(kml, "Fault a &lt;jammer&gt; (true place)"), 1U);
  const std::string placemark = kml.substr(kml.find("Fault a"), kml.find("Fixes by") - kml.find("Fault a"));
  EXPECT_EQ(occurrences(placemark, "<LineString>"), 1U) << "seconds 1 and 2";
  EXPECT_EQ(occurrences(placemark, "<Point>"), 1U) << "second 5";
}

TEST(GeoJson, OneEpochAndNone) {
  const test::TemporaryFolder folder;
  feed(*open_file("geojson", folder / "one.geojson", 0, {"rover"}), {sample_run().front()});
  const auto one = nlohmann::json::parse(test::read_bytes(folder / "one.geojson"));
  ASSERT_EQ(one.at("features").size(), 2U);
  EXPECT_EQ(one.at("features")[1].at("geometry").at("type"), "Point");
  feed(*open_file("geojson", folder / "none.geojson", 0, {"rover"}), {});
  EXPECT_TRUE(nlohmann::json::parse(test::read_bytes(folder / "none.geojson")).at("features").empty());
}

TEST(GeoJson, GdalReadsIt) {
  CANYON_NEEDS_PROGRAM("ogrinfo");
  const test::TemporaryFolder folder;
  feed(*open_file("geojson", folder / "track.geojson", 0, {"rover"}), sample_run());
  const auto result = test::run_program("ogrinfo -al '" + (folder / "track.geojson").string() + "' 2>&1");
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.output, HasSubstr("Feature Count: 9"));
  EXPECT_THAT(result.output, HasSubstr("LINESTRING Z (114.178761 22.298251 12.345,"));
  EXPECT_EQ(occurrences(result.output, "status (String) = no fix"), 3U);
  EXPECT_EQ(occurrences(result.output, "status (String) = fix"), 5U);
  EXPECT_THAT(result.output, HasSubstr("time (DateTime) = 2019/04/28 12:58:10"));
  EXPECT_THAT(result.output, HasSubstr("WGS 84"));
}

// Fixes at seconds 0 to 2, 5 and 7: a segment for each interval.
TEST(Gpx, HoldsFixesAndASegmentForEachStretch) {
  CANYON_NEEDS_PROGRAM("xmllint");
  const test::TemporaryFolder folder;
  const auto path = folder / "track.gpx";
  const auto epochs = sample_run();
  feed(*open_file("gpx", path, 0, {"rover <1> & \"co\""}), epochs);
  const auto query = [&](const std::string& xpath) {
    return std::string(
        trim(test::run_program("xmllint --xpath '" + xpath + "' '" + path.string() + "'").output));
  };
  EXPECT_EQ(query("string(/*[local-name()=\"gpx\"]/@version)"), "1.1");
  EXPECT_EQ(query("namespace-uri(/*)"), "http://www.topografix.com/GPX/1/1");
  EXPECT_EQ(query("string(//*[local-name()=\"name\"])"), "rover <1> & \"co\"");
  EXPECT_EQ(query("count(//*[local-name()=\"trkseg\"])"), "3");
  EXPECT_EQ(query("count(//*[local-name()=\"trkseg\"][1]/*)"), "3");
  // wptType, elements in the order of the schema.
  const geodesy::Geodetic& geodetic = epochs[0].observed.fix.position;
  EXPECT_THAT(test::read_bytes(path),
              HasSubstr("<trkpt lat=\"" + fixed(geodesy::degrees(geodetic.latitude_rad), 9) + "\" lon=\"" +
                        fixed(geodesy::degrees(geodetic.longitude_rad), 9) + "\"><ele>" +
                        fixed(geodetic.height_m, 3) +
                        "</ele><time>2019-04-28T12:58:03.000Z</time><fix>3d</fix><sat>9</sat>"
                        "<hdop>1.250</hdop><vdop>1.688</vdop><pdop>2.100</pdop></trkpt>\n"));
  EXPECT_NEAR(geodesy::degrees(geodetic.longitude_rad), 114.178761, 1e-9);
}

// GPX 1.1: geoidheight is the height of the geoid above the ellipsoid, and is after the time.
TEST(Gpx, SaysWhereMeanSeaLevelIs) {
  simulation::Epoch epoch = sample_run().front();
  epoch.observed.fix.position.height_m = 12.3456;
  epoch.geoid_undulation_m = -2.375;
  EXPECT_THAT(format_named("gpx").make({"rover"})->encode(epoch),
              HasSubstr("<ele>14.721</ele><time>2019-04-28T12:58:03.000Z</time>"
                        "<geoidheight>-2.375</geoidheight><fix>"));
}

TEST(Gpx, GdalReadsIt) {
  CANYON_NEEDS_PROGRAM("ogrinfo");
  const test::TemporaryFolder folder;
  feed(*open_file("gpx", folder / "track.gpx", 0, {"rover"}), sample_run());
  const auto result =
      test::run_program("ogrinfo -al '" + (folder / "track.gpx").string() + "' track_points 2>&1");
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.output, HasSubstr("Feature Count: 5"));
  EXPECT_THAT(result.output, HasSubstr("time (DateTime) = 2019/04/28 12:58:10"));
  EXPECT_EQ(occurrences(result.output, "fix (String) = 3d"), 5U);
  EXPECT_EQ(occurrences(result.output, "sat (Integer) = 9"), 5U);
  EXPECT_THAT(result.output, HasSubstr("track_seg_id (Integer) = 2"));
}

TEST(Gpx, EmptyRunAndAPrediction) {
  const test::TemporaryFolder folder;
  feed(*open_file("gpx", folder / "none.gpx", 0, {"rover"}), {});
  EXPECT_THAT(test::read_bytes(folder / "none.gpx"), HasSubstr("<name>rover</name>\n</trk>\n</gpx>\n"));
  feed(*open_file("gpx", folder / "one.gpx", 0, {"rover"}), {test::predicted(sample_run().front())});
  EXPECT_THAT(test::read_bytes(folder / "one.gpx"), HasSubstr("<fix>none</fix><sat>0</sat></trkpt>"));
}

TEST(Kml, GdalReadsIt) {
  CANYON_NEEDS_PROGRAM("ogrinfo");
  const test::TemporaryFolder folder;
  feed(*open_file("kml", folder / "track.kml", 0, {"rover"}), sample_run());
  const auto result = test::run_program("ogrinfo -al '" + (folder / "track.kml").string() + "' 2>&1");
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.output, HasSubstr("114.178761 22.298251 12.345,"));
}

}  // namespace
}  // namespace canyon::encoding::tracks_test
