#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "canyon/analysis/heatmap/engine/map_source.hpp"
#include "canyon/analysis/heatmap/files/netcdf_writer.hpp"
#include "canyon/base/input_error.hpp"
#include "tests/support/program.hpp"
#include "tests/support/sample_map.hpp"
#include "tests/support/small_disk.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::heatmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// Debian's Python, which finds Debian's packages, even if another Python is first in the path.
constexpr const char* kPython = "/usr/bin/python3";

/// Two times, two altitudes, 40 x 21 cells (3 x 2 tiles).
test::SampleMap varied() {
  test::SampleMap map(40, 21);
  map.request.altitudes_m = {1.5, 15};
  map.request.times.push_back(map.request.times[0] + 0.5);
  return map;
}

std::string text_of(const std::filesystem::path& script, const std::filesystem::path& file) {
  return test::run_program(std::string(kPython) + " '" + script.string() + "' '" + file.string() + "' 2>&1")
      .output;
}

TEST(NetcdfWriter, NcdumpReadsHeaderAndCoordinates) {
  CANYON_NEEDS_PROGRAM("ncdump");
  const test::TemporaryFolder folder;
  const test::SampleMap map = varied();
  write_netcdf(folder / "map.nc", map.source());
  const std::string header = test::run_program("ncdump -s -h '" + (folder / "map.nc").string() + "'").output;
  EXPECT_THAT(header, AllOf(HasSubstr("time = 2 ;"), HasSubstr("altitude = 2 ;"), HasSubstr("y = 21 ;"),
                            HasSubstr("x = 40 ;")));
  EXPECT_THAT(
      header,
      AllOf(HasSubstr("float horizontal_error(time, altitude, y, x) ;"),
            HasSubstr("horizontal_error:_FillValue = NaNf ;"), HasSubstr("horizontal_error:units = \"m\" ;"),
            HasSubstr("horizontal_error:grid_mapping = \"crs\" ;"),
            HasSubstr("horizontal_error:coordinates = \"lat lon\" ;"), HasSubstr("hdop:units = \"1\" ;")));
  EXPECT_THAT(header, AllOf(HasSubstr("horizontal_error:_ChunkSizes = 1, 1, 16, 16 ;"),
                            HasSubstr("horizontal_error:_DeflateLevel = 4 ;"),
                            HasSubstr("horizontal_error:_Shuffle = \"true\" ;")));
  EXPECT_THAT(header, AllOf(HasSubstr("byte cell_state(altitude, y, x) ;"),
                            HasSubstr("cell_state:_FillValue = -1b ;"),
                            HasSubstr("cell_state:flag_values = 0b, 1b, 2b, 3b, 4b ;"),
                            HasSubstr("cell_state:flag_meanings = \"computed inside_building under_terrain "
                                      "outside_area no_terrain\" ;")));
  EXPECT_THAT(header, AllOf(HasSubstr("crs:grid_mapping_name = \"transverse_mercator\" ;"),
                            HasSubstr("crs:longitude_of_central_meridian = 114.17 ;"),
                            HasSubstr("crs:latitude_of_projection_origin = 22.3 ;"),
                            HasSubstr("crs:crs_wkt = \"PROJCRS[\\\"Canyon city plane\\\"")));
  EXPECT_THAT(header,
              AllOf(HasSubstr(":Conventions = \"CF-1.10\" ;"), HasSubstr(":title = \"Sample\" ;"),
                    HasSubstr(":model = \"mirror\" ;"), HasSubstr("altitude:standard_name = \"height\" ;"),
                    HasSubstr("altitude:positive = \"up\" ;"), HasSubstr("x:bounds = \"x_bnds\" ;"),
                    HasSubstr("time:comment = \"UTC, leap seconds not counted; GPS time is 18 s ahead "
                              "of it\" ;")));

  const std::string axes =
      test::run_program("ncdump -p 9,17 -v time,altitude,x_bnds,y '" + (folder / "map.nc").string() + "'")
          .output;
  // date -u -d 2019-04-28T12:58:03Z +%s
  EXPECT_THAT(axes, AllOf(HasSubstr("time = 1556456283, 1556456283.5 ;"), HasSubstr("altitude = 1.5, 15 ;")));
  EXPECT_THAT(axes, AllOf(HasSubstr("x_bnds =\n  -100, -99,\n  -99, -98,"), HasSubstr("y = -49.5, -48.5,")));
  EXPECT_THAT(test::run_program("ncdump -v gps_time '" + (folder / "map.nc").string() + "'").output,
              // 2051 weeks of 604,800 s, then 46,701 s of Sunday with 18 leap seconds.
              HasSubstr("gps_time = 1240491501000000000, 1240491501500000000 ;"));
}

TEST(NetcdfWriter, XarrayReadsEveryValue) {
  if (test::run_program(std::string(kPython) + " -c 'import xarray, netCDF4' 2>/dev/null").status != 0) {
    GTEST_SKIP() << "SKIPPED: the judge python3-xarray is not installed here";
  }
  const test::TemporaryFolder folder;
  const test::SampleMap map = varied();
  write_netcdf(folder / "map.nc", map.source());
  std::ofstream(folder / "read.py") << R"(
import sys, xarray as xr, numpy as np
d = xr.open_dataset(sys.argv[1])
print(str(d.time.values[0]), str(d.time.values[1]), d.altitude.values.tolist(), d.sizes['y'], d.sizes['x'])
t, a, y, x = np.meshgrid(range(2), range(2), range(21), range(40), indexing='ij')
inside = (x + 2 * y + a) % 7 == 3
for k, name in enumerate(['horizontal_error', 'hdop']):
    want = np.where(inside, np.nan, x + 1000 * y + (4 * k + 2 * t + a) / 16)
    assert d[name].dims == ('time', 'altitude', 'y', 'x')
    np.testing.assert_array_equal(d[name].values, want.astype('float32'))
np.testing.assert_array_equal(d.cell_state.values, inside[0].astype(float))
print('equal', float(d.lat.sel(x=-60.5, y=-49.5)), set(d.hdop.coords) >= {'lat', 'lon'})
)";
  const std::string text = text_of(folder / "read.py", folder / "map.nc");
  EXPECT_THAT(text,
              HasSubstr("2019-04-28T12:58:03.000000000 2019-04-28T12:58:03.500000000 [1.5, 15.0] 21 40"));
  // 49.5 m south of 22.3 deg: a degree of latitude is 110,735 m there (WGS 84).
  EXPECT_THAT(text, HasSubstr("equal 22.29955"));
  EXPECT_THAT(text, HasSubstr("True"));
}

TEST(NetcdfWriter, GdalSeesTheGeoreference) {
  CANYON_NEEDS_PROGRAM("gdalinfo");
  const test::TemporaryFolder folder;
  const test::SampleMap map = varied();
  write_netcdf(folder / "map.nc", map.source());
  const std::string text =
      test::run_program("gdalinfo 'NETCDF:\"" + (folder / "map.nc").string() + "\":hdop' 2>&1").output;
  EXPECT_THAT(text, AllOf(HasSubstr("Size is 40, 21"), HasSubstr("Origin = (-100.000000000000000,-29.0000"),
                          HasSubstr("Pixel Size = (1.000000000000000,-1.0000"),
                          HasSubstr("Transverse Mercator"), HasSubstr("Band 4 "), Not(HasSubstr("Band 5 "))));
}

TEST(NetcdfWriter, PlaceOfEachCellIsTheFrames) {
  CANYON_NEEDS_PROGRAM("ncdump");
  const test::TemporaryFolder folder;
  test::SampleMap map(2, 1);
  map.request.grid.spacing_m = 10'000;
  map.request.grid.west_m = -10'000;
  map.request.grid.south_m = -5000;
  write_netcdf(folder / "map.nc", map.source());
  const std::string text =
      test::run_program("ncdump -p 9,17 -v lat,lon '" + (folder / "map.nc").string() + "'").output;
  // cct +proj=pipeline +step +inv +proj=tmerc is within 1 cm; here the closed form: east-west symmetric about
  // 114.17 deg, 5 km of the parallel's circle of radius N cos(latitude) (Snyder 1987, eq. 4-20).
  const std::size_t lon = text.find("lon =\n");
  ASSERT_NE(lon, std::string::npos) << text;
  double west = 0, east = 0;
  ASSERT_EQ(std::sscanf(text.c_str() + lon, "lon =\n %lf, %lf", &west, &east), 2) << text.substr(lon);
  EXPECT_NEAR(west + east, 2 * 114.17, 1e-8);
  const double sine = 0.379456, e2 = 0.00669437999;  // sin 22.3 deg
  const double circle =
      (6378137 / std::sqrt(1 - e2 * sine * sine) + 3.2) * std::cos(22.3 * 3.14159265358979 / 180);
  EXPECT_NEAR(east - 114.17, std::atan(5000 / circle) * 180 / 3.14159265358979, 1e-8);
}

TEST(NetcdfWriter, SameMapSameBytesAtAnotherSecond) {
  const test::TemporaryFolder folder;
  const test::SampleMap map = varied();
  write_netcdf(folder / "a.nc", map.source());
  // Objects of HDF5 may contain the second of their creation.
  const std::time_t made = std::time(nullptr);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  while (std::time(nullptr) == made && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
  ASSERT_NE(std::time(nullptr), made);
  write_netcdf(folder / "b.nc", map.source());
  EXPECT_TRUE(test::read_bytes(folder / "a.nc") == test::read_bytes(folder / "b.nc"));
}

TEST(NetcdfWriter, TilesThatWereNotComputedAreMissing) {
  CANYON_NEEDS_PROGRAM("ncdump");
  const test::TemporaryFolder folder;
  test::SampleMap map(17, 1);
  map.request.layers = {Layer::Hdop};
  MapSource source = map.source();
  source.slice = [&map](std::size_t tile, std::size_t time) -> std::optional<MapSource::Slice> {
    if (tile == 1) return std::nullopt;
    return map.slice(tile, time);
  };
  write_netcdf(folder / "map.nc", source);
  const std::string text =
      test::run_program("ncdump -v cell_state,hdop '" + (folder / "map.nc").string() + "' | tr -d ' \\n'")
          .output;
  EXPECT_THAT(text, HasSubstr("cell_state=0,0,0,1,0,0,0,0,0,0,1,0,0,0,0,0,_;"));
  EXPECT_THAT(text, HasSubstr("hdop=0,1,2,_,4,5,6,7,8,9,_,11,12,13,14,15,_;"));
}

TEST(NetcdfWriter, OneCellWithoutAnyValue) {
  CANYON_NEEDS_PROGRAM("ncdump");
  const test::TemporaryFolder folder;
  test::SampleMap map(1, 1);
  MapSource source = map.source();
  source.slice = [](std::size_t, std::size_t) {
    MapSource::Slice slice;
    slice.values.assign(2, std::numeric_limits<float>::quiet_NaN());
    slice.state = {CellState::UnderTerrain};
    return std::optional(slice);
  };
  map.request.altitude_kind = AltitudeKind::Ellipsoid;
  write_netcdf(folder / "map.nc", source);
  const std::string text = test::run_program("ncdump '" + (folder / "map.nc").string() + "'").output;
  EXPECT_THAT(text,
              AllOf(HasSubstr("hdop =\n  _ ;"), HasSubstr("cell_state =\n  2 ;"), HasSubstr(" x = -99.5 ;"),
                    HasSubstr("standard_name = \"height_above_reference_ellipsoid\"")));
}

TEST(NetcdfWriter, LargeMapsGoWithoutLatitudeAndLongitude) {
  CANYON_NEEDS_PROGRAM("ncdump");
  const test::TemporaryFolder folder;
  test::SampleMap map(4001, 1000);
  map.request.grid.tile_size = 1024;
  MapSource source = map.source();
  source.slice = [](std::size_t, std::size_t) { return std::nullopt; };
  write_netcdf(folder / "map.nc", source);
  const std::string header = test::run_program("ncdump -h '" + (folder / "map.nc").string() + "'").output;
  EXPECT_THAT(header, AllOf(HasSubstr("x = 4001 ;"), Not(HasSubstr(" lat(")), Not(HasSubstr("coordinates"))));
}

TEST(NetcdfWriter, ProgressEndsAtItsEnd) {
  const test::TemporaryFolder folder;
  const test::SampleMap map = varied();
  MapSource source = map.source();
  std::vector<std::size_t> seen;
  std::size_t all = 0;
  source.progress = [&](std::size_t done, std::size_t total) {
    seen.push_back(done);
    all = total;
  };
  write_netcdf(folder / "map.nc", source);
  ASSERT_EQ(seen.size(), 18u) << "6 tiles: their places and two times";
  for (std::size_t i = 0; i < seen.size(); ++i) EXPECT_EQ(seen[i], i + 1);
  EXPECT_EQ(all, 18u);
}

TEST(NetcdfWriter, FullDiskLeavesTheOlderFile) {
  const test::TemporaryFolder folder;
  test::SampleMap map(60, 60);
  map.request.layers.push_back(Layer::Pdop);
  const std::filesystem::path path = folder / "map.nc";
  write_netcdf(path, map.source());
  const std::string whole = test::read_bytes(path);
  ASSERT_GT(whole.size(), 50'000u);
  std::ofstream(path) << "older";
  for (std::size_t limit = 0; limit < whole.size(); limit += 7001) {
    std::string message;
    {
      const test::SmallDisk disk(limit);
      try {
        write_netcdf(path, map.source());
      } catch (const OutputError& error) {
        message = error.what();
      }
    }
    EXPECT_THAT(message, HasSubstr("map.nc: cannot be written: ")) << limit;
    EXPECT_EQ(test::read_bytes(path), "older") << limit;
  }
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1)
      << "nothing half written";
  write_netcdf(path, map.source());
  EXPECT_TRUE(test::read_bytes(path) == whole) << "the library is as before";
}

TEST(NetcdfWriterDeathTest, ProgramEndsWellAfterAFullDisk) {
  ::testing::FLAGS_gtest_death_test_style = "threadsafe";
  const test::TemporaryFolder folder;
  EXPECT_EXIT(
      {
        const test::SampleMap map(60, 60);
        for (std::size_t limit = 0; limit < 50'000; limit += 7001) {
          const test::SmallDisk disk(limit);
          try {
            write_netcdf(folder / "map.nc", map.source());
            std::exit(1);
          } catch (const OutputError&) {
          }
        }
        std::exit(42);
      },
      ::testing::ExitedWithCode(42), "");
}

TEST(NetcdfWriter, FolderThatIsNotThere) {
  const test::SampleMap map(2, 2);
  EXPECT_THROW(write_netcdf("/nowhere/at/all/map.nc", map.source()), InputError);
}

TEST(NetcdfWriter, WhatTheSourceThrowsPassesThrough) {
  const test::TemporaryFolder folder;
  const test::SampleMap map(40, 2);
  MapSource source = map.source();
  source.slice = [&map](std::size_t tile, std::size_t time) {
    if (tile == 2) throw InputError("tile 2 is damaged");
    return std::optional(map.slice(tile, time));
  };
  EXPECT_THROW(write_netcdf(folder / "map.nc", source), InputError);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace canyon::heatmap
