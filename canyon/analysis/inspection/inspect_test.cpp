#include "canyon/analysis/inspection/inspect.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <string>

#include "canyon/analysis/heatmap/files/netcdf_file.hpp"
#include "canyon/analysis/heatmap/files/netcdf_writer.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/city_file.hpp"
#include "canyon/city/mesh_export.hpp"
#include "canyon/outputs/encoding/encoder.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/case_file.hpp"
#include "tests/support/observation_text.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/rinex_sample.hpp"
#include "tests/support/sample_map.hpp"
#include "tests/support/sample_signals.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::inspection {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

class Inspect : public ::testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path file(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }
  [[nodiscard]] FileReport report(const std::string& name, const std::string& bytes) const {
    return inspect_file(file(name, bytes));
  }
  [[nodiscard]] std::string fault(const std::string& name, const std::string& bytes) const {
    try {
      (void)report(name, bytes);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  }
  /// The text of the line of a report with this name.
  static std::string value(const FileReport& report, const std::string& name) {
    const auto at = std::find_if(report.contents.begin(), report.contents.end(),
                                 [&](const auto& line) { return line.first == name; });
    return at == report.contents.end() ? "nothing of " + name : at->second;
  }

  test::TemporaryFolder temporary_;
  std::filesystem::path folder_ = temporary_.path();
};

TEST_F(Inspect, Observations) {
  const std::string good = "G05" + test::field(20604864.859) + test::field(1.1e8) + "\n";
  const std::string text = test::observations3() + "> 2019 04 28 12 44 34.0000000  0  2\n" + good + "R07" +
                           test::field(2.1e7) + "\n> 2019 04 28 12 44 36.0000000  0  2\n" + good + "@12\n";
  const FileReport seen = report("some.obs", text);
  EXPECT_EQ(seen.kind, "RINEX 3.04 observations");
  EXPECT_EQ(value(seen, "time"), "2019-04-28T12:44:34 GPST to 2019-04-28T12:44:36 GPST (2 s)");
  EXPECT_EQ(value(seen, "epochs"), "2");
  EXPECT_EQ(value(seen, "satellites"), "GPS 1, GLONASS 1");
  EXPECT_EQ(value(seen, "signals"), "GLONASS 1C, GPS 1C");
  EXPECT_EQ(value(seen, "receiver"), "M8T");
  EXPECT_THAT(value(seen, "position"), HasSubstr("22.30"));
  EXPECT_THAT(seen.notes.lines(), Contains(HasSubstr("some.obs:26: '@12' is not a satellite; left out")));
  EXPECT_THAT(seen.uses, Contains(HasSubstr("--obs FILE")));
}

TEST_F(Inspect, NavigationWithRecordsOfOneTime) {
  // The same time of ephemeris, sent again with another issue.
  const std::string again = test::replaced(test::kG05, "6.080000000000e+02", "6.090000000000e+02");
  EXPECT_THAT(
      report("again", test::kRinex3Header + test::kG05 + again).notes.lines(),
      Contains(HasSubstr("1 records are replaced by later messages for the same satellite and time")));
}

TEST_F(Inspect, Navigation) {
  const FileReport seen = report("without_ending", test::kRinex3Header + test::kG05 + test::kR07);
  EXPECT_THAT(seen.kind, HasSubstr("RINEX navigation"));
  EXPECT_EQ(value(seen, "records"), "2");
  EXPECT_EQ(value(seen, "satellites"), "GPS 1, GLONASS 1");
  EXPECT_EQ(value(seen, "ionosphere"), "Klobuchar coefficients");
  EXPECT_THAT(seen.notes.lines(), Contains(HasSubstr("coefficients of NeQuick-G are only kept for writing")));
  EXPECT_THAT(value(seen, "ephemerides"), HasSubstr("2019-04-28"));
}

TEST_F(Inspect, PreciseOrbits) {
  const FileReport seen = inspect_file(test::case_file("sp3-two-days/day1.sp3"));
  EXPECT_EQ(seen.kind, "SP3 precise orbits");
  EXPECT_THAT(value(seen, "satellites"), HasSubstr("GPS "));
  EXPECT_THAT(seen.uses, Contains(HasSubstr("sp3: [FILE]")));
}

TEST_F(Inspect, Corrections) {
  const simulation::Epoch epoch = test::sample_signal_epoch(test::sample_time(), test::sample_time() - 9);
  encoding::ReceiverDescription base{.name = "base", .begin = test::sample_time()};
  base.station_ecef = epoch.truth_ecef;
  const std::string stream = encoding::format_named("rtcm").make(base)->encode(epoch);
  const FileReport seen = report("base.log", "noise" + stream);
  EXPECT_EQ(seen.kind, "RTCM 3");
  EXPECT_EQ(value(seen, "epochs"), "1 (the file has no date)");
  EXPECT_THAT(value(seen, "messages"), HasSubstr("1005 (1), 1033 (1), 1077 (1)"));
  EXPECT_THAT(value(seen, "station"), HasSubstr("deg"));
  EXPECT_THAT(seen.notes.lines(), Contains("5 bytes outside frames"));
}

TEST_F(Inspect, RecordedPaths) {
  const FileReport gpx = inspect_file(test::case_file("gpx-pause/pause.gpx"));
  EXPECT_EQ(gpx.kind, "recorded path (gpx)");
  EXPECT_THAT(gpx.notes.lines(), Contains(HasSubstr("has 1 pause")));
  EXPECT_THAT(gpx.uses, Contains(HasSubstr("format: gpx")));
  const FileReport nmea = inspect_file(test::case_file("nmea-gga-no-altitude/all2d.nmea"));
  EXPECT_EQ(nmea.kind, "recorded path (nmea)");
  EXPECT_THAT(nmea.notes.lines(), Contains("it has no heights: give trajectory.height_above_terrain_m"));
  const FileReport csv = report(
      "a.txt", "time,latitude,longitude,height\n0,22.3,114.17,5\n1,22.3001,114.17,5\n2,22.3002,114.17,5\n");
  EXPECT_EQ(csv.kind, "recorded path (csv)");
  EXPECT_EQ(value(csv, "time"), "2 s, without a date");
  EXPECT_EQ(value(csv, "length"), "22 m");
  EXPECT_EQ(value(csv, "first point"), "22.300000, 114.170000 deg, 5.0 m");
  const FileReport urbannav = report("b.txt", "2051,46701.5,22.3,114.17,5\n2051,46702.5,22.3001,114.17,5\n");
  EXPECT_EQ(urbannav.kind, "recorded path (urbannav)");
}

TEST_F(Inspect, LogsOfAndroid) {
  const std::string columns =
      "# Raw,TimeNanos,FullBiasNanos,Svid,State,ReceivedSvTimeNanos,Cn0DbHz,ConstellationType\n"
      "# Fix,Provider,LatitudeDegrees,LongitudeDegrees,AltitudeMeters,UnixTimeMillis\n";
  const std::string raw = "Raw,100000000000,-1398498900000000000,5,16399,201399925000000,41.5,1\n";
  const std::string fixes = "Fix,GPS,48.0,11.0,547,1714474782000\nFix,GPS,48.0001,11.0,547,1714474783000\n";
  const FileReport both = report("log.txt", columns + raw + fixes);
  EXPECT_EQ(both.kind, "Android GnssLogger observations");
  EXPECT_EQ(value(both, "lines"), "Fix 2, Raw 1");
  EXPECT_THAT(both.uses, Contains(HasSubstr("format: gnsslogger")));
  EXPECT_EQ(report("log.txt", columns + fixes).kind, "recorded path (gnsslogger)");
}

TEST_F(Inspect, ScenariosAndCities) {
  const FileReport scenario =
      report("drive.yml",
             "city: {open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17}}\n"
             "sky: {nominal: true}\nstart: 2026-06-01T12:00:00Z\nduration_s: 9\n"
             "trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}\n"
             "receivers: [{name: rover, profile: ideal}]\n");
  EXPECT_EQ(scenario.kind, "scenario");
  EXPECT_EQ(value(scenario, "receivers"), "rover");
  EXPECT_EQ(value(scenario, "faults"), "0");
  city::City city;
  city.name = "houses";
  canyon::test::append_box(city.mesh, "a", city::Surface::Building, city::Material::Glass, {0, 0, 0},
                           {10, 20, 30});
  city::write_city_file(folder_ / "some.canyon", city);
  const FileReport built = inspect_file(folder_ / "some.canyon");
  EXPECT_EQ(built.kind, "city");
  EXPECT_EQ(value(built, "buildings"), "1");
  EXPECT_EQ(value(built, "extent"), "10 m east-west, 20 m north-south, 0.0 to 30.0 m high");
  EXPECT_EQ(value(built, "highest roof"), "30.0 m");
  city::write_mesh(folder_ / "some.obj", city);
  const FileReport mesh = inspect_file(folder_ / "some.obj");
  EXPECT_EQ(mesh.kind, "city (mesh)");
  EXPECT_EQ(value(mesh, "origin"), "not in the file: city.origin");
  EXPECT_THAT(inspect_file(test::case_file("obj-y-up/y_up.obj")).notes.lines(),
              Contains(HasSubstr("is upright")));
}

TEST_F(Inspect, HeightRasters) {
  const std::string grid = "ncols 3\nnrows 2\nxllcorner 11\nyllcorner 48\ncellsize 0.01\nNODATA_value -1\n";
  (void)file("hill.prj",
             "GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS "
             "84\",6378137,298.257223563]],PRIMEM[\"Greenwich\",0],"
             "UNIT[\"degree\",0.0174532925199433]]");
  const FileReport seen = report("hill.asc", grid + "500 510 520\n500 -1 20000\n");
  EXPECT_EQ(seen.kind, "height raster");
  EXPECT_THAT(value(seen, "posts"), HasSubstr("3 x 2, "));
  EXPECT_EQ(value(seen, "heights"), "500.0 to 520.0 m, as in the file");
  EXPECT_EQ(value(seen, "middle"), "48.010000, 11.015000 deg");
  EXPECT_THAT(seen.notes.lines(), Contains(HasSubstr("33.3 % of the posts have no height")));
  EXPECT_THAT(fault("hill.asc", grid + "-1 -1 -1\n-1 -1 -1\n"), HasSubstr("has no height"));
  EXPECT_THAT(fault("a.tif", "II*"), HasSubstr("not a raster that GDAL can read"));
}

TEST_F(Inspect, HeatMapsAndStudies) {
  const test::SampleMap map(4, 3);
  heatmap::write_netcdf(folder_ / "map.nc", map.source());
  EXPECT_EQ(inspect_file(folder_ / "map.nc").kind, "heat map of Canyon");
  heatmap::NetcdfFile study = heatmap::NetcdfFile::create(folder_ / "study.nc", folder_ / "study.nc");
  study.put_text(NC_GLOBAL, "title", "receivers");
  study.put_text(NC_GLOBAL, "canyon_study_key", "1");
  study.define_dimension("run", 12);
  study.define_dimension("receiver", 2);
  study.end_definitions();
  study.close();
  const FileReport seen = inspect_file(folder_ / "study.nc");
  EXPECT_EQ(seen.kind, "results of a study of Canyon");
  EXPECT_EQ(value(seen, "title"), "receivers");
  EXPECT_EQ(value(seen, "runs"), "12");
  EXPECT_THAT(fault("other.nc", "CDF"), HasSubstr("other.nc"));
}

TEST_F(Inspect, RefusesWhatNoReaderTakes) {
  EXPECT_THAT(fault("a.ubx", "\xB5\x62\x01\x07"), HasSubstr("to RINEX observations with RTKLIB"));
  EXPECT_THAT(fault("a", "what is this"), HasSubstr("a: is not a known kind of file; known are"));
  EXPECT_THAT(fault("a", "what, is this"), HasSubstr("no column 'latitude'"));
  EXPECT_THAT(fault("a", ""), HasSubstr("a: is empty"));
  EXPECT_THAT(fault("a.n", "version https://git-lfs.github.com/spec/v1\noid sha256:4d\n"),
              HasSubstr("is a pointer of Git LFS, not the data"));
  try {
    (void)inspect_file(folder_);
    ADD_FAILURE() << "a folder";
  } catch (const InputError& error) {
    EXPECT_EQ(error.problem(), "is a folder, not a file");
  }
  EXPECT_THAT(fault("a.html", "<!DOCTYPE html><html>"), HasSubstr("is a web page (HTML), not data"));
  EXPECT_THROW((void)inspect_file(folder_ / "nowhere"), InputError);
}

}  // namespace
}  // namespace canyon::inspection
