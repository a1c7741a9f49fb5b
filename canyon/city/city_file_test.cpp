#include "canyon/city/city_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <random>

#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/mesh_file.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::city {
namespace {

using canyon::test::read_bytes;
using canyon::test::TemporaryFolder;
using ::testing::HasSubstr;

constexpr std::size_t kFirstBlock = 12;
constexpr std::size_t kBlockHeader = 24;

City small_city() {
  City city;
  city.name = "two houses \xC3\xA4";
  city.frame = geodesy::LocalFrame(geodesy::Geodetic::from_degrees(55.82, 37.61, 150.25), 0.1);
  canyon::test::append_box(city.mesh, "a", Surface::Building, Material::Glass, {0, 0, 0}, {10.1, 20.2, 30.3},
                           0.3);
  canyon::test::append_box(city.mesh, "", Surface::Foliage, Material::Wood, {30, 0, -1}, {31, 2, 5});
  append_object(city.mesh, "terrain", Surface::Terrain, Material::Ground,
                {{-99, -99, 0}, {99, 0, 0}, {0, 99, 1}}, {{0, 1, 2}});
  city.notes.add_line(ReadReport::Level::Remark,
                      std::vector<std::string>{"first", "", "third; with \n line"});
  city.notes.add_line(ReadReport::Level::Loss, "a tower is left out");
  city.notes.add_line(ReadReport::Level::Guess, "its height");
  return city;
}

void expect_equal(const City& a, const City& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.notes.entries(), b.notes.entries());
  EXPECT_EQ(a.frame.origin().latitude_rad, b.frame.origin().latitude_rad);
  EXPECT_EQ(a.frame.origin().longitude_rad, b.frame.origin().longitude_rad);
  EXPECT_EQ(a.frame.origin().height_m, b.frame.origin().height_m);
  EXPECT_EQ(a.frame.heading_rad(), b.frame.heading_rad());
  EXPECT_EQ(a.geoid_undulation_m, b.geoid_undulation_m);
  EXPECT_TRUE(a.mesh.vertices == b.mesh.vertices);
  EXPECT_TRUE(a.mesh.triangles == b.mesh.triangles);
  EXPECT_TRUE(a.mesh.materials == b.mesh.materials);
  ASSERT_EQ(a.mesh.objects.size(), b.mesh.objects.size());
  for (std::size_t i = 0; i < a.mesh.objects.size(); ++i) {
    EXPECT_EQ(a.mesh.objects[i].name, b.mesh.objects[i].name);
    EXPECT_EQ(a.mesh.objects[i].surface, b.mesh.objects[i].surface);
    EXPECT_EQ(a.mesh.objects[i].first_triangle, b.mesh.objects[i].first_triangle);
    EXPECT_EQ(a.mesh.objects[i].triangle_count, b.mesh.objects[i].triangle_count);
  }
}

void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

/// The InputError's text; "" if the file is read.
std::string error_of(const std::filesystem::path& path, const std::string& bytes) {
  write_bytes(path, bytes);
  try {
    (void)read_city_file(path);
  } catch (const InputError& error) {
    EXPECT_EQ(error.file(), path.string());
    return error.what();
  }
  return "";
}

std::uint64_t number_at(const std::string& bytes, std::size_t at, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = size; i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

std::string number(std::uint64_t value, std::size_t size) {
  std::string text;
  for (std::size_t i = 0; i < size; ++i) text += static_cast<char>(value >> (8 * i) & 0xFF);
  return text;
}

/// The file with block number `index` unpacked, changed and repacked with a valid checksum.
template <typename Change>
std::string with_block(const std::string& bytes, int index, const Change& change) {
  std::size_t at = kFirstBlock;
  for (int i = 0; i < index; ++i) at += kBlockHeader + number_at(bytes, at + 12, 8);
  const std::size_t packed_size = number_at(bytes, at + 12, 8);
  std::string raw(number_at(bytes, at + 4, 8), '\0');
  uLongf size = raw.size();
  EXPECT_EQ(uncompress(reinterpret_cast<Bytef*>(raw.data()), &size,
                       reinterpret_cast<const Bytef*>(bytes.data()) + at + kBlockHeader, packed_size),
            Z_OK);
  change(raw);
  uLongf new_size = compressBound(raw.size());
  std::string packed(new_size, '\0');
  compress(reinterpret_cast<Bytef*>(packed.data()), &new_size, reinterpret_cast<const Bytef*>(raw.data()),
           raw.size());
  packed.resize(new_size);
  const std::string head = bytes.substr(at, 4) + number(raw.size(), 8) + number(packed.size(), 8);
  const std::string all = head + packed;
  const auto crc = crc32(0, reinterpret_cast<const Bytef*>(all.data()), static_cast<uInt>(all.size()));
  return bytes.substr(0, at) + head + number(crc, 4) + packed + bytes.substr(at + kBlockHeader + packed_size);
}

TEST(CityFile, GivesBackExactlyWhatWasWritten) {
  const TemporaryFolder folder;
  const City city = small_city();
  write_city_file(folder / "c.canyon", city);
  expect_equal(city, read_city_file(folder / "c.canyon"));
}

// The version is the oldest that can represent the city.
TEST(CityFile, HoldsTheGeoidUndulation) {
  const TemporaryFolder folder;
  City city = small_city();
  write_city_file(folder / "a.canyon", city);
  EXPECT_EQ(read_bytes(folder / "a.canyon")[8], 1);
  city.geoid_undulation_m = -2.375;
  write_city_file(folder / "b.canyon", city);
  EXPECT_EQ(read_bytes(folder / "b.canyon")[8], 2);
  expect_equal(city, read_city_file(folder / "b.canyon"));
  city.geoid_undulation_m = std::nan("");
  write_city_file(folder / "c.canyon", city);
  EXPECT_THAT(error_of(folder / "d.canyon", read_bytes(folder / "c.canyon")), HasSubstr("undulation"));
}

// Cities without facade data from a map remain files that an older Canyon reads.
TEST(CityFile, VersionTwoHoldsWhatAMapSaysOfFacades) {
  const TemporaryFolder folder;
  City city = small_city();
  write_city_file(folder / "one.canyon", city);
  EXPECT_EQ(read_bytes(folder / "one.canyon")[8], 1);
  city.mesh.objects.back().facades = FacadeMix::Traditional;
  write_city_file(folder / "two.canyon", city);
  EXPECT_EQ(read_bytes(folder / "two.canyon")[8], 2);
  const City again = read_city_file(folder / "two.canyon");
  expect_equal(city, again);
  EXPECT_EQ(again.mesh.objects.back().facades, FacadeMix::Traditional);
  EXPECT_EQ(again.mesh.objects.front().facades, FacadeMix::ByBuilding);
  const std::string wrong =
      with_block(read_bytes(folder / "two.canyon"), 0, [](std::string& raw) { raw.back() = 99; });
  EXPECT_THAT(error_of(folder / "n.canyon", wrong), HasSubstr("has facades 99"));
}

TEST(CityFile, HoldsAnEmptyCity) {
  const TemporaryFolder folder;
  write_city_file(folder / "c.canyon", City{});
  expect_equal(City{}, read_city_file(folder / "c.canyon"));
}

TEST(CityFile, IsTheSameBytesEachTime) {
  const TemporaryFolder folder;
  write_city_file(folder / "a.canyon", small_city());
  write_city_file(folder / "b.canyon", read_city_file(folder / "a.canyon"));
  EXPECT_EQ(read_bytes(folder / "a.canyon"), read_bytes(folder / "b.canyon"));
}

TEST(CityFile, GivesBackADistrictFromAThirdOfItsMeshFile) {
  CANYON_SHARED_DATA(dae, "hongkong/buildings.dae");
  MeshImportOptions options;
  options.origin = geodesy::Geodetic::from_degrees(22.298251, 114.178761, 0);
  options.offset_m = {0, 8, 0};
  const City city = read_mesh_city(dae, options);
  const TemporaryFolder folder;
  write_city_file(folder / "hk.canyon", city);
  ASSERT_GT(city.mesh.triangles.size(), 20'000U);
  expect_equal(city, read_city_file(folder / "hk.canyon"));
  EXPECT_LT(std::filesystem::file_size(folder / "hk.canyon"), std::filesystem::file_size(dae) / 3);
}

TEST(CityFile, RefusesANewerVersionWithTheCure) {
  const TemporaryFolder folder;
  write_city_file(folder / "c.canyon", small_city());
  std::string bytes = read_bytes(folder / "c.canyon");
  bytes[8] = 4;
  EXPECT_THAT(error_of(folder / "n.canyon", bytes),
              HasSubstr("version 4, this Canyon reads up to 3; update"));
  bytes[8] = 0;
  EXPECT_THAT(error_of(folder / "n.canyon", bytes), HasSubstr("version 0"));
}

TEST(CityFile, SaysWhatIsNotACity) {
  const TemporaryFolder folder;
  EXPECT_THROW((void)read_city_file(folder / "missing.canyon"), InputError);
  EXPECT_THROW((void)read_city_file(folder.path()), InputError);
  EXPECT_THAT(error_of(folder / "x.canyon", ""), HasSubstr("not a Canyon city"));
  EXPECT_THAT(error_of(folder / "x.canyon", "solid cube"), HasSubstr("not a Canyon city"));
  EXPECT_THROW(write_city_file(folder / "no" / "c.canyon", small_city()), InputError);
}

TEST(CityFile, NamesTheDamagedBlock) {
  const TemporaryFolder folder;
  write_city_file(folder / "c.canyon", small_city());
  const std::string bytes = read_bytes(folder / "c.canyon");
  std::size_t at = kFirstBlock;
  for (const char* name : {"'header'", "'vertices'", "'triangles'", "'materials'"}) {
    const std::size_t packed = number_at(bytes, at + 12, 8);
    std::string bad = bytes;
    bad[at + kBlockHeader + packed / 2] ^= 1;
    EXPECT_THAT(error_of(folder / "b.canyon", bad), HasSubstr(name));
    EXPECT_THAT(error_of(folder / "b.canyon", bytes.substr(0, at + kBlockHeader + packed / 2)),
                HasSubstr(name));
    EXPECT_THAT(error_of(folder / "b.canyon", bytes.substr(0, at + 3)), HasSubstr(name));
    at += kBlockHeader + packed;
  }
  EXPECT_EQ(at, bytes.size());
  EXPECT_THAT(error_of(folder / "b.canyon", bytes + "x"), HasSubstr("1 bytes after its last block"));
}

TEST(CityFile, ChecksWhatAGoodChecksumHides) {
  const TemporaryFolder folder;
  write_city_file(folder / "c.canyon", small_city());
  const std::string bytes = read_bytes(folder / "c.canyon");
  const auto error = [&](int block, auto change) {
    return error_of(folder / "b.canyon", with_block(bytes, block, change));
  };
  EXPECT_EQ(error(0, [](std::string&) {}), "");
  EXPECT_THAT(error(0, [](std::string& raw) { raw[0] = 99; }), HasSubstr("'vertices' is damaged"));
  EXPECT_THAT(error(0, [](std::string& raw) { raw[15] = 1; }), HasSubstr("do not cover"));
  EXPECT_THAT(error(0, [](std::string& raw) { raw.resize(30); }), HasSubstr("ends early"));
  EXPECT_THAT(error(0, [](std::string& raw) { raw[48 + 3] = 0x7F; }), HasSubstr("a text is longer"));
  EXPECT_THAT(error(0, [](std::string& raw) { raw[23] = 0x7F; }), HasSubstr("latitude"));
  EXPECT_THAT(error(0, [](std::string& raw) { raw += "x"; }), HasSubstr("data follow its end"));
  EXPECT_THAT(error(1, [](std::string& raw) { raw.pop_back(); }), HasSubstr("'vertices' is damaged"));
  EXPECT_THAT(error(1,
                    [](std::string& raw) {
                      raw.replace(raw.size() / 8 * 6, raw.size() / 4, raw.size() / 4, '\x7F');
                    }),
              HasSubstr("vertex"));
  EXPECT_THAT(error(2, [](std::string& raw) { raw[5] = 77; }), HasSubstr("uses vertex"));
  EXPECT_THAT(error(3, [](std::string& raw) { raw[5] = 77; }), HasSubstr("material 77"));
}

TEST(CityFile, RefusesImpossibleSizesBeforeAllocating) {
  const TemporaryFolder folder;
  write_city_file(folder / "c.canyon", small_city());
  std::string bytes = read_bytes(folder / "c.canyon");
  const std::size_t packed = number_at(bytes, kFirstBlock + 12, 8);
  bytes.replace(kFirstBlock + 4, 8, number(std::uint64_t{1} << 50, 8));
  const std::string all = bytes.substr(kFirstBlock, 20) + bytes.substr(kFirstBlock + kBlockHeader, packed);
  bytes.replace(
      kFirstBlock + 20, 4,
      number(crc32(0, reinterpret_cast<const Bytef*>(all.data()), static_cast<uInt>(all.size())), 4));
  EXPECT_THAT(error_of(folder / "b.canyon", bytes), HasSubstr("impossible"));
}

TEST(CityFile, NeverReadsADamagedFileAsAnother) {
  const TemporaryFolder folder;
  const City city = small_city();
  write_city_file(folder / "c.canyon", city);
  const std::string bytes = read_bytes(folder / "c.canyon");
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    ASSERT_NE(error_of(folder / "f.canyon", bytes.substr(0, size)), "") << size;
  }
  std::mt19937_64 random(20260101);
  for (int round = 0; round < 500; ++round) {
    std::string bad = bytes;
    for (std::uint64_t n = 1 + random() % 4; n > 0; --n)
      bad[random() % bad.size()] = static_cast<char>(random());
    if (bad == bytes) continue;
    ASSERT_NE(error_of(folder / "f.canyon", bad), "") << round;
  }
  // A change with valid checksums may give another city; this city must be valid.
  for (int round = 0; round < 500; ++round) {
    const std::string bad = with_block(bytes, static_cast<int>(random() % 4), [&](std::string& raw) {
      for (std::uint64_t n = 1 + random() % 3; n > 0 && !raw.empty(); --n) {
        raw[random() % raw.size()] = static_cast<char>(random());
      }
      if (random() % 4 == 0) raw.resize(random() % (raw.size() + 1));
    });
    write_bytes(folder / "f.canyon", bad);
    try {
      check_mesh(read_city_file(folder / "f.canyon").mesh, "fuzzed");
    } catch (const InputError&) {
    }
  }
}

TEST(KeepWithin, KeepsWholeBuildingsAndTheGroundThatTouch) {
  Mesh mesh;
  canyon::test::append_box(mesh, "near", Surface::Building, Material::Brick, {5, 5, 0}, {15, 15, 9});
  canyon::test::append_box(mesh, "far", Surface::Building, Material::Glass, {50, 50, 0}, {60, 60, 9});
  append_object(mesh, "terrain", Surface::Terrain, Material::Ground,
                {{0, 0, 0}, {100, 0, 0}, {0, 100, 0}, {100, 100, 0}, {40, 100, 0}}, {{0, 1, 2}, {1, 3, 4}});
  canyon::test::append_box(mesh, "touching", Surface::Building, Material::Metal, {-9, 0, 0}, {0, 9, 3});
  EXPECT_EQ(crop(mesh, {Eigen::Vector2d(0, 0), Eigen::Vector2d(10, 10)}), 1U);
  check_mesh(mesh, "kept");
  ASSERT_EQ(mesh.objects.size(), 3U);
  EXPECT_EQ(mesh.objects[0].name, "near");
  EXPECT_EQ(mesh.objects[1].triangle_count, 1U);
  EXPECT_EQ(mesh.objects[2].name, "touching");
  EXPECT_EQ(mesh.vertices.size(), 8U + 3U + 8U);
  EXPECT_EQ(mesh.materials.back(), Material::Metal);
  EXPECT_EQ(mesh.vertices[mesh.triangles.back()[0]].x(), 0);  // east side of the last box
}

}  // namespace
}  // namespace canyon::city
