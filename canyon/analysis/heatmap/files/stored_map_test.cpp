#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <random>
#include <thread>

#include "canyon/analysis/heatmap/engine/map_source.hpp"
#include "canyon/analysis/heatmap/files/netcdf_file.hpp"
#include "canyon/analysis/heatmap/files/netcdf_writer.hpp"
#include "canyon/analysis/heatmap/files/stored_map.hpp"
#include "canyon/base/input_error.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/sample_map.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::heatmap::stored_map_test {
namespace {

using ::testing::HasSubstr;

test::SampleMap varied() {
  test::SampleMap map(40, 21);
  map.request.altitudes_m = {1.5, 15};
  map.request.times.push_back(map.request.times[0] + 60);
  return map;
}

bool same(float a, float b) {
  return a == b || (std::isnan(a) && std::isnan(b));
}

std::string problem(const std::filesystem::path& path) {
  return test::refusal([&] { const StoredMap map(path); });
}

TEST(StoredMap, GivesBackWhatWasWritten) {
  const test::TemporaryFolder folder;
  test::SampleMap map = varied();
  map.frame = geodesy::LocalFrame(geodesy::Geodetic::from_degrees(22.298718652, 114.1701234567, 3.21), 0.4);
  map.request.grid.west_m = -100.1;
  map.request.grid.spacing_m = 0.7;
  map.request.altitude_kind = AltitudeKind::Ellipsoid;
  map.request.times[0] = map.request.times[0] + 1e-9;
  write_netcdf(folder / "map.nc", map.source());
  const StoredMap stored(folder / "map.nc");
  EXPECT_TRUE(stored.grid() == map.request.grid);
  EXPECT_EQ(stored.times(), map.request.times);
  EXPECT_EQ(stored.altitudes_m(), map.request.altitudes_m);
  EXPECT_EQ(stored.altitude_kind(), AltitudeKind::Ellipsoid);
  EXPECT_EQ(stored.layers(), map.request.layers);
  const Eigen::Vector3d point(300, -200, 10);
  EXPECT_LT((stored.frame().ecef_from_local(point) - map.frame.ecef_from_local(point)).norm(), 1e-8);

  const Grid& grid = map.request.grid;
  for (std::size_t time = 0; time < 2; ++time) {
    for (std::size_t altitude = 0; altitude < 2; ++altitude) {
      for (std::uint32_t row = 0; row < grid.rows; ++row) {
        for (std::uint32_t column = 0; column < grid.columns; ++column) {
          const auto result =
              stored.at(grid.centre(column, row), map.request.altitudes_m[altitude], map.request.times[time]);
          ASSERT_TRUE(result);
          EXPECT_EQ(result->state, test::SampleMap::state(altitude, column, row));
          EXPECT_EQ(result->altitude_m, map.request.altitudes_m[altitude]);
          EXPECT_EQ(result->time, map.request.times[time]);
          for (std::size_t k = 0; k < 2; ++k) {
            ASSERT_TRUE(same(result->values[k], test::SampleMap::value(k, time, altitude, column, row)))
                << column << ' ' << row;
          }
        }
      }
    }
  }
}

TEST(StoredMap, NearestAltitudeAndTimeWithinHalfAStep) {
  const test::TemporaryFolder folder;
  test::SampleMap map = varied();
  map.request.times.push_back(map.request.times[0] + 100);
  write_netcdf(folder / "map.nc", map.source());
  const StoredMap stored(folder / "map.nc");
  const Eigen::Vector2d point(-90, -40);
  const geodesy::GpsTime first = map.request.times[0];
  const auto time_for = [&](double seconds) { return stored.at(point, 15, first + seconds)->time - first; };
  EXPECT_EQ(time_for(-30), 0);
  EXPECT_FALSE(stored.at(point, 15, first + -30.001));
  EXPECT_EQ(time_for(30), 0) << "of two as near the earlier";
  EXPECT_EQ(time_for(30.001), 60);
  EXPECT_EQ(time_for(79), 60);
  EXPECT_EQ(time_for(81), 100);
  EXPECT_EQ(time_for(120), 100);
  EXPECT_FALSE(stored.at(point, 15, first + 120.001)) << "half of the last step, 40 s";
  const auto altitude_for = [&](double altitude) { return stored.at(point, altitude, first)->altitude_m; };
  EXPECT_EQ(altitude_for(-1000), 1.5);
  EXPECT_EQ(altitude_for(8.25), 1.5) << "of two as near the lower";
  EXPECT_EQ(altitude_for(8.3), 15);
  EXPECT_EQ(altitude_for(1e6), 15);
  EXPECT_FALSE(stored.at(point, std::nan(""), first));
}

TEST(StoredMap, SingleTimeReachesAQuarterOfAnHour) {
  const test::TemporaryFolder folder;
  const test::SampleMap map(3, 2);
  write_netcdf(folder / "map.nc", map.source());
  const StoredMap stored(folder / "map.nc");
  const geodesy::GpsTime time = map.request.times[0];
  EXPECT_TRUE(stored.at({-99, -49}, 15, time + 900));
  EXPECT_TRUE(stored.at({-99, -49}, 15, time + -900));
  EXPECT_FALSE(stored.at({-99, -49}, 15, time + 900.001));
  EXPECT_FALSE(stored.at({-99, -49}, 15, time + -900.001));
}

TEST(StoredMap, SidesOfCells) {
  const test::TemporaryFolder folder;
  const test::SampleMap map(40, 21);
  write_netcdf(folder / "map.nc", map.source());
  const StoredMap stored(folder / "map.nc");
  const auto value = [&](double east, double north) -> std::optional<float> {
    const auto result = stored.at({east, north}, 15, map.request.times[0]);
    if (!result) return std::nullopt;
    return result->values[0];
  };
  EXPECT_EQ(value(-100, -50), 0) << "the south-western corner";
  EXPECT_EQ(value(-99.001, -50), 0);
  EXPECT_EQ(value(-99, -50), 1) << "a side belongs to the cell east of it";
  EXPECT_EQ(value(-100, -48), 2000) << "and north of it";
  EXPECT_EQ(value(-60, -29), 20039) << "the outermost sides to the grid";
  EXPECT_FALSE(value(-100.001, -50));
  EXPECT_FALSE(value(-59.999, -29));
  EXPECT_FALSE(value(-99, -28.999));
  EXPECT_FALSE(value(std::nan(""), -50));
}

TEST(StoredMap, CellsThatWereNotComputed) {
  const test::TemporaryFolder folder;
  test::SampleMap map(17, 1);
  MapSource source = map.source();
  source.slice = [&map](std::size_t tile, std::size_t time) -> std::optional<MapSource::Slice> {
    if (tile == 1) return std::nullopt;
    return map.slice(tile, time);
  };
  write_netcdf(folder / "map.nc", source);
  const StoredMap stored(folder / "map.nc");
  const auto result = stored.at({-83.5, -49.5}, 15, map.request.times[0]);
  ASSERT_TRUE(result);
  EXPECT_TRUE(std::isnan(result->values[0]));
  EXPECT_EQ(result->state, CellState::Computed);
}

TEST(StoredMap, ManyThreadsAsk) {
  const test::TemporaryFolder folder;
  const test::SampleMap map(400, 300);
  write_netcdf(folder / "map.nc", map.source());
  const StoredMap stored(folder / "map.nc");
  std::vector<std::thread> threads;
  std::atomic<int> wrong{0};
  for (unsigned seed = 0; seed < 4; ++seed) {
    threads.emplace_back([&, seed] {
      std::mt19937 random(seed);
      for (int i = 0; i < 500; ++i) {
        const std::uint32_t column = random() % 400, row = random() % 300;
        const auto result = stored.at(map.request.grid.centre(column, row), 15, map.request.times[0]);
        if (!result || !same(result->values[1], test::SampleMap::value(1, 0, 0, column, row))) ++wrong;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

TEST(StoredMap, RefusesWhatIsNoMap) {
  const test::TemporaryFolder folder;
  EXPECT_THAT(problem(folder / "none.nc"), HasSubstr("no such file"));
  EXPECT_THAT(problem(folder.path()), HasSubstr("is a folder"));
  std::ofstream(folder / "text.nc") << "some text that is no NetCDF file";
  EXPECT_THAT(problem(folder / "text.nc"), HasSubstr("text.nc: cannot be read: NetCDF: Unknown file format"));
  {
    NetcdfFile foreign = NetcdfFile::create(folder / "foreign.nc", folder / "foreign.nc");
    foreign.put_text(NC_GLOBAL, "title", "of another tool");
    foreign.end_definitions();
    foreign.close();
  }
  EXPECT_THAT(problem(folder / "foreign.nc"),
              HasSubstr("foreign.nc: is not a heat map of Canyon: its attribute canyon_map is missing"));
  {
    NetcdfFile later = NetcdfFile::create(folder / "later.nc", folder / "later.nc");
    later.put_integer(NC_GLOBAL, "canyon_map", 2);
    later.end_definitions();
    later.close();
  }
  EXPECT_THAT(problem(folder / "later.nc"), HasSubstr("is of version 2, this Canyon reads up to 1"));
}

/// The bytes of a map of 60 x 60 cells without the final checksum, as other programs write them.
std::string bytes_without_checksum(const test::TemporaryFolder& folder) {
  write_netcdf(folder / "map.nc", test::SampleMap(60, 60).source());
  const std::string bytes = test::read_bytes(folder / "map.nc");
  return bytes.substr(0, bytes.rfind("\ncanyon-crc32 "));
}

// HDF5 1.10 reads a global heap with such objects beyond its end, or endlessly.
TEST(StoredMap, DamagedHeapsAreSaid) {
  const test::TemporaryFolder folder;
  const std::string whole = bytes_without_checksum(folder);
  const std::size_t heap = whole.find("GCOL");
  ASSERT_NE(heap, std::string::npos);
  for (const std::uint64_t size : {5000ULL, 1ULL << 40, ~0ULL - 20}) {
    for (const bool free : {false, true}) {
      std::string bytes = whole;
      if (free) bytes.replace(heap + 16, 2, 2, '\0');
      std::memcpy(&bytes[heap + 24], &size, sizeof size);
      std::ofstream(folder / "hurt.nc", std::ios::binary) << bytes;
      const auto begin = std::chrono::steady_clock::now();
      EXPECT_THAT(problem(folder / "hurt.nc"), HasSubstr("hurt.nc: ")) << size << free;
      EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(25));
    }
  }
}

// Of 120 such files 22 crashed the program: HDF5 1.10 frees text of the file as a pointer.
TEST(StoredMap, FilesThatCrashHdf5AreRefused) {
  const test::TemporaryFolder folder;
  const std::string whole = bytes_without_checksum(folder);
  std::mt19937 random(7);
  int refused = 0;
  for (int i = 0; i < 60; ++i) {
    std::string bytes = whole;
    bytes.insert(random() % bytes.size(), 1, static_cast<char>(random() % 256));
    std::ofstream(folder / "hurt.nc", std::ios::binary) << bytes;
    const std::string logged = test::refusal([&] {
      (void)StoredMap(folder / "hurt.nc").at({-99, -49}, 15, test::SampleMap(1, 1).request.times[0]);
    });
    if (logged.empty()) continue;
    EXPECT_THAT(logged, HasSubstr("hurt.nc: "));
    ++refused;
  }
  EXPECT_GT(refused, 20);
}

TEST(StoredMap, AnyBitOfAWrittenMapCounts) {
  const test::TemporaryFolder folder;
  const std::size_t counted = bytes_without_checksum(folder).size();
  std::mt19937 random(3);
  for (int i = 0; i < 40; ++i) {
    std::string bytes = test::read_bytes(folder / "map.nc");
    bytes[random() % counted] ^= static_cast<char>(1U << (random() % 8));
    std::ofstream(folder / "hurt.nc", std::ios::binary) << bytes;
    EXPECT_THAT(problem(folder / "hurt.nc"), HasSubstr("hurt.nc: is damaged"));
  }
}

TEST(StoredMap, OtherProgramsMayEditTheFile) {
  const test::TemporaryFolder folder;
  const std::string whole = bytes_without_checksum(folder);
  int id = 0;
  ASSERT_EQ(nc_open((folder / "map.nc").c_str(), NC_WRITE, &id), NC_NOERR);
  ASSERT_EQ(nc_put_att_text(id, NC_GLOBAL, "title", 4, "mine"), NC_NOERR);
  ASSERT_EQ(nc_close(id), NC_NOERR);
  EXPECT_EQ(test::read_bytes(folder / "map.nc").find("canyon-crc32"), std::string::npos)
      << "HDF5 cuts off what stands behind its end";
  const auto result =
      StoredMap(folder / "map.nc").at({-99.5, -49.5}, 15, test::SampleMap(1, 1).request.times[0]);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->values[0], test::SampleMap::value(0, 0, 0, 0, 0));
}

TEST(StoredMap, DamageIsSaidOrHarmless) {
  const test::TemporaryFolder folder;
  const test::SampleMap map(60, 60);
  write_netcdf(folder / "map.nc", map.source());
  const std::string whole = test::read_bytes(folder / "map.nc");
  for (const double fraction : {0.02, 0.5, 0.9, 0.999}) {
    std::ofstream(folder / "cut.nc", std::ios::binary)
        << whole.substr(0, static_cast<std::size_t>(fraction * static_cast<double>(whole.size())));
    EXPECT_THAT(problem(folder / "cut.nc"), HasSubstr("cut.nc: ")) << fraction;
  }
  // Compressed chunks (zlib's checksum) are at the file's end.
  std::mt19937 random(1);
  int reported = 0;
  for (int i = 0; i < 40; ++i) {
    std::string bytes = whole;
    bytes[bytes.size() / 2 + random() % (bytes.size() / 2)] ^= static_cast<char>(1U << (random() % 8));
    std::ofstream(folder / "hurt.nc", std::ios::binary) << bytes;
    try {
      const StoredMap stored(folder / "hurt.nc");
      for (std::uint32_t row = 0; row < 60; row += 8) {
        for (std::uint32_t column = 0; column < 60; column += 8) {
          const auto result = stored.at(map.request.grid.centre(column, row), 15, map.request.times[0]);
          ASSERT_TRUE(result);
          for (std::size_t k = 0; k < 2; ++k) {
            EXPECT_TRUE(same(result->values[k], test::SampleMap::value(k, 0, 0, column, row)));
          }
        }
      }
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("hurt.nc: "));
      ++reported;
    }
  }
  EXPECT_GT(reported, 10);
}

}  // namespace
}  // namespace canyon::heatmap::stored_map_test
