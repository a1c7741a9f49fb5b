#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>

#include "canyon/analysis/heatmap/engine/map_source.hpp"
#include "canyon/analysis/heatmap/files/geotiff_writer.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "tests/support/program.hpp"
#include "tests/support/sample_map.hpp"
#include "tests/support/small_disk.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::heatmap {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

std::string gdalinfo(const std::filesystem::path& path) {
  return test::run_program("gdalinfo '" + path.string() + "' 2>&1").output;
}

/// A number or "nan" in a program's output; infinite if there is neither.
float number(const std::string& text) {
  float value = std::numeric_limits<float>::infinity();
  std::sscanf(text.c_str(), "%f", &value);
  return value;
}

/// The values that gdallocationinfo reads at WGS 84 positions.
std::vector<float> values_at(const std::filesystem::path& path,
                             const std::vector<geodesy::Geodetic>& positions, const char* options = "") {
  const test::TemporaryFolder folder;
  {
    std::ofstream out(folder / "places");
    for (const geodesy::Geodetic& position : positions) {
      out << fmt::format("{:.12f} {:.12f}\n", geodesy::degrees(position.longitude_rad),
                         geodesy::degrees(position.latitude_rad));
    }
  }
  const std::string text =
      test::run_program(fmt::format("gdallocationinfo -valonly {} -wgs84 '{}' < '{}' 2>&1", options,
                                    path.string(), (folder / "places").string()))
          .output;
  std::vector<float> values;
  for (const std::string_view line : split(trim(text), '\n')) values.push_back(number(std::string(line)));
  return values;
}

bool same(float a, float b) {
  return a == b || (std::isnan(a) && std::isnan(b));
}

TEST(GeotiffWriter, GdalinfoSeesSizePlaceAndWords) {
  CANYON_NEEDS_PROGRAM("gdalinfo");
  const test::TemporaryFolder folder;
  const test::SampleMap map(40, 21);
  EXPECT_THAT(write_geotiffs(folder / "maps", map.source()), ElementsAre("horizontal_error.tif", "hdop.tif"));
  const std::string text = gdalinfo(folder / "maps/horizontal_error.tif");
  EXPECT_THAT(text, AllOf(HasSubstr("Size is 40, 21"), HasSubstr("Origin = (-100.000000000000000,-29.0000"),
                          HasSubstr("Pixel Size = (1.000000000000000,-1.0000"), HasSubstr("Type=Float32"),
                          HasSubstr("NoData Value=nan"), HasSubstr("Unit Type: m"),
                          HasSubstr("Description = " + std::string(info(Layer::HorizontalError).long_name))));
  EXPECT_THAT(text, AllOf(HasSubstr("PROJCRS[\"Canyon city plane\""), HasSubstr("Transverse Mercator"),
                          HasSubstr("COMPRESSION=DEFLATE"), HasSubstr("LAYOUT=COG"), HasSubstr("PREDICTOR=3"),
                          HasSubstr("AREA_OR_POINT=Area"), HasSubstr("model=mirror"),
                          HasSubstr("time=2019-04-28T12:58:03Z"), HasSubstr("altitude_m=15"),
                          HasSubstr("title=Sample")))
      << text;
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / "maps"), {}), 2)
      << "nothing else is left";
}

/// 12 km x 10.6 km.
test::SampleMap wide() {
  test::SampleMap map(600, 530);
  map.request.grid.tile_size = 100;
  map.request.grid.west_m = -6000;
  map.request.grid.south_m = -4000;
  map.request.grid.spacing_m = 20;
  return map;
}

/// Positions by GeographicLib's Geocentric and the ENU rotation, 5 cm inside the cells' corners: up to 9 km
/// from the origin the projection is within 1 cm.
void expect_points(const test::SampleMap& map, const std::filesystem::path& hdop) {
  std::vector<geodesy::Geodetic> positions;
  std::vector<float> wanted;
  for (const std::uint32_t column : {0U, 99U, 100U, 317U, 599U}) {
    for (const std::uint32_t row : {0U, 1U, 299U, 529U}) {
      const Eigen::Vector2d centre = map.request.grid.centre(column, row);
      for (const int corner : {0, 1, 2, 3}) {
        const double x = centre.x() + (corner % 2 == 0 ? -9.95 : 9.95);
        const double y = centre.y() + (corner < 2 ? -9.95 : 9.95);
        positions.push_back(map.frame.geodetic_from_local({x, y, 0}));
        wanted.push_back(test::SampleMap::value(1, 0, 0, column, row));
      }
    }
  }
  const std::vector<float> found = values_at(hdop, positions);
  ASSERT_EQ(found.size(), 80u);
  for (std::size_t i = 0; i < 80; ++i) EXPECT_TRUE(same(found[i], wanted[i])) << i << ' ' << found[i];
}

TEST(GeotiffWriter, EveryPixelLiesWhereItsCellDoes) {
  CANYON_NEEDS_PROGRAM("gdallocationinfo");
  const test::TemporaryFolder folder;
  const test::SampleMap map = wide();
  write_geotiffs(folder.path(), map.source());
  expect_points(map, folder / "hdop.tif");
}

TEST(GeotiffWriter, PixelsOfATurnedFrameToo) {
  CANYON_NEEDS_PROGRAM("gdallocationinfo");
  const test::TemporaryFolder folder;
  test::SampleMap map = wide();
  map.frame = geodesy::LocalFrame(map.frame.origin(), geodesy::radians(-120));
  write_geotiffs(folder.path(), map.source());
  expect_points(map, folder / "hdop.tif");
}

TEST(GeotiffWriter, OverviewsAreMeansOfWhatIsThere) {
  CANYON_NEEDS_PROGRAM("gdallocationinfo");
  const test::TemporaryFolder folder;
  test::SampleMap map(600, 600);
  map.request.layers = {Layer::Hdop};
  write_geotiffs(folder.path(), map.source());
  EXPECT_THAT(gdalinfo(folder / "hdop.tif"), HasSubstr("Overviews: 300x300"));
  // Columns 100, 101 and rows 200, 201: (c + 2 r) mod 7 is 3, 4, 5, 6, so that the first is missing.
  ASSERT_TRUE(std::isnan(test::SampleMap::value(0, 0, 0, 100, 200)));
  // gdallocationinfo 3.6 rounds half a line up: line 398 of 600 (row 201) is in line 199 of 300.
  const Eigen::Vector2d centre = map.request.grid.centre(100, 201);
  EXPECT_THAT(values_at(folder / "hdop.tif", {map.frame.geodetic_from_local({centre.x(), centre.y(), 0})},
                        "-overview 1"),
              ElementsAre(static_cast<float>((200101.0 + 201100.0 + 201101.0) / 3)));
}

TEST(GeotiffWriter, ValidatorOfCogFindsNoFault) {
  const std::string validator = "/usr/bin/python3 -m osgeo_utils.samples.validate_cloud_optimized_geotiff ";
  if (test::run_program("/usr/bin/python3 -c 'import osgeo_utils.samples.validate_cloud_optimized_geotiff' "
                        "2>/dev/null")
          .status != 0) {
    GTEST_SKIP() << "SKIPPED: the judge python3-gdal is not installed here";
  }
  const test::TemporaryFolder folder;
  test::SampleMap map(1100, 700);
  map.request.grid.tile_size = 256;
  for (const std::string& name : write_geotiffs(folder.path(), map.source())) {
    const test::ProgramResult checked =
        test::run_program(validator + "'" + (folder / name).string() + "' 2>&1");
    EXPECT_EQ(checked.status, 0) << checked.output;
    EXPECT_THAT(checked.output, HasSubstr("is a valid cloud optimized GeoTIFF"));
  }
}

TEST(GeotiffWriter, NamesTellWhatVaries) {
  const test::TemporaryFolder folder;
  test::SampleMap map(3, 2);
  map.request.layers = {Layer::Hdop};
  map.request.altitudes_m = {1.5, 15};
  EXPECT_THAT(write_geotiffs(folder.path(), map.source()), ElementsAre("hdop_a1.5m.tif", "hdop_a15m.tif"));
  map.request.times.push_back(map.request.times[0] + 60);
  EXPECT_THAT(write_geotiffs(folder.path(), map.source()),
              ElementsAre("hdop_a1.5m_t20190428T125803Z.tif", "hdop_a15m_t20190428T125803Z.tif",
                          "hdop_a1.5m_t20190428T125903Z.tif", "hdop_a15m_t20190428T125903Z.tif"));
  map.request.altitudes_m = {15};
  map.request.times[1] = map.request.times[0] + 0.25;
  EXPECT_THAT(write_geotiffs(folder.path(), map.source()),
              ElementsAre("hdop_t20190428T125803Z.tif", "hdop_t20190428T125803.25Z.tif"));
}

TEST(GeotiffWriter, EachFileHasItsOwnLayerAltitudeAndTime) {
  CANYON_NEEDS_PROGRAM("gdallocationinfo");
  const test::TemporaryFolder folder;
  test::SampleMap map(40, 21);
  map.request.altitudes_m = {1.5, 15};
  map.request.times.push_back(map.request.times[0] + 60);
  const std::vector<std::string> names = write_geotiffs(folder.path(), map.source());
  ASSERT_EQ(names.size(), 8u);
  std::size_t i = 0;
  for (std::size_t time = 0; time < 2; ++time) {
    for (std::size_t layer = 0; layer < 2; ++layer) {
      for (std::size_t altitude = 0; altitude < 2; ++altitude, ++i) {
        // Row 20 is the northernmost, line 0 of the picture.
        const std::string read =
            test::run_program("gdallocationinfo -valonly '" + (folder / names[i]).string() + "' 38 0").output;
        EXPECT_EQ(number(read), test::SampleMap::value(layer, time, altitude, 38, 20)) << names[i];
      }
    }
  }
}

TEST(GeotiffWriter, OneCellAndNothingInIt) {
  CANYON_NEEDS_PROGRAM("gdalinfo");
  const test::TemporaryFolder folder;
  test::SampleMap map(1, 1);
  map.request.layers = {Layer::Hdop};
  MapSource source = map.source();
  source.slice = [](std::size_t, std::size_t) { return std::nullopt; };
  write_geotiffs(folder.path(), source);
  EXPECT_THAT(gdalinfo(folder / "hdop.tif"), AllOf(HasSubstr("Size is 1, 1"), Not(HasSubstr("ERROR"))));
  const std::vector<float> found =
      values_at(folder / "hdop.tif", {map.frame.geodetic_from_local({-99.5, -49.5, 0})});
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(std::isnan(found[0]));
}

TEST(GeotiffWriter, SameMapSameBytes) {
  const test::TemporaryFolder folder;
  const test::SampleMap map(600, 530);
  write_geotiffs(folder / "a", map.source());
  write_geotiffs(folder / "b", map.source());
  EXPECT_TRUE(test::read_bytes(folder / "a/hdop.tif") == test::read_bytes(folder / "b/hdop.tif"));
}

TEST(GeotiffWriter, ProgressEndsAtItsEnd) {
  const test::TemporaryFolder folder;
  const test::SampleMap map(40, 21);
  MapSource source = map.source();
  std::vector<std::size_t> seen;
  std::size_t all = 0;
  source.progress = [&](std::size_t done, std::size_t total) {
    seen.push_back(done);
    all = total;
  };
  write_geotiffs(folder.path(), source);
  EXPECT_THAT(seen, ElementsAre(1, 2, 3, 4, 5, 6, 7, 8)) << "six tiles, two files";
  EXPECT_EQ(all, 8u);
}

TEST(GeotiffWriter, FullDiskLeavesTheOlderFiles) {
  const test::TemporaryFolder folder;
  test::SampleMap map(300, 200);
  const std::filesystem::path path = folder / "hdop.tif";
  write_geotiffs(folder.path(), map.source());
  const std::string whole = test::read_bytes(path);
  std::filesystem::remove(folder / "horizontal_error.tif");
  std::ofstream(path) << "older";
  // The largest file is that of the gathered values, 2 x 300 x 200 floats and more: a COG that does not fit
  // is tested below.
  for (std::size_t limit = 0; limit < 480'000; limit += 30'011) {
    std::string message;
    {
      const test::SmallDisk disk(limit);
      try {
        write_geotiffs(folder.path(), map.source());
      } catch (const OutputError& error) {
        message = error.what();
      }
    }
    EXPECT_THAT(message, HasSubstr("cannot be written: ")) << limit;
    EXPECT_EQ(test::read_bytes(path), "older") << limit;
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1)
        << "nothing half written";
  }
  write_geotiffs(folder.path(), map.source());
  EXPECT_TRUE(test::read_bytes(path) == whole) << "the library is as before";
}

TEST(GeotiffWriter, FullDiskAtTheLastStep) {
  const test::TemporaryFolder folder;
  test::SampleMap map(300, 200);
  write_geotiffs(folder / "whole", map.source());
  const std::size_t size = std::filesystem::file_size(folder / "whole/hdop.tif");
  // Values are gathered and the first file is written with free space; the disk is full for the second one.
  MapSource source = map.source();
  std::optional<test::SmallDisk> disk;
  for (const double fraction : {0.0, 0.01, 0.3, 0.7, 0.99, 0.999}) {
    const auto limit = static_cast<std::size_t>(fraction * static_cast<double>(size));
    source.progress = [&](std::size_t done, std::size_t total) {
      if (done + 1 == total) disk.emplace(limit);
    };
    std::string message;
    try {
      write_geotiffs(folder / "maps", source);
    } catch (const OutputError& error) {
      message = error.what();
    }
    disk.reset();
    EXPECT_THAT(message, HasSubstr("hdop.tif: cannot be written: ")) << limit;
    EXPECT_TRUE(std::filesystem::is_empty(folder / "maps")) << "nothing half written";
  }
}

TEST(GeotiffWriter, FolderThatCannotBeMade) {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "taken") << "a file";
  const test::SampleMap map(2, 2);
  EXPECT_THROW(write_geotiffs(folder / "taken", map.source()), InputError);
}

}  // namespace
}  // namespace canyon::heatmap
