#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <fstream>
#include <limits>
#include <string>

#include "canyon/analysis/heatmap/engine/engine.hpp"
#include "canyon/base/input_error.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::heatmap {
namespace {

namespace fs = std::filesystem;
using test::read_bytes;
using test::TemporaryFolder;

TileValues values_of(std::size_t first_time, std::size_t count = 1000) {
  TileValues values;
  values.first_time = first_time;
  values.times = 3;
  for (std::size_t i = 0; i < count; ++i) {
    values.values.push_back(i % 7 == 0 ? std::numeric_limits<float>::quiet_NaN()
                                       : 0.37F * static_cast<float>(i) - 3.0F);
  }
  for (std::size_t i = 0; i < count / 10; ++i) values.state.push_back(static_cast<CellState>(i % 5));
  return values;
}

/// NaNs too.
bool same(const TileValues& a, const TileValues& b) {
  return a.first_time == b.first_time && a.times == b.times && a.state == b.state &&
         a.values.size() == b.values.size() &&
         (a.values.empty() ||
          std::memcmp(a.values.data(), b.values.data(), a.values.size() * sizeof(float)) == 0);
}

fs::path unit_file(const fs::path& folder, std::size_t unit) {
  std::string number = std::to_string(unit);
  return folder / ("unit-" + std::string(9 - number.size(), '0') + number + ".tile");
}

void write_bytes(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

template <class Expected = InputError, class Call>
Expected error_of(const Call& call) {
  try {
    call();
  } catch (const Expected& error) {
    return error;
  }
  ADD_FAILURE() << "no such error";
  return Expected("none");
}

TEST(TileStore, GivesBackWhatWasSaved) {
  const TemporaryFolder folder;
  const fs::path path = folder / "a/tiles";
  {
    TileStore store(path, "key 1", "a map");
    EXPECT_FALSE(store.has(7));
    EXPECT_FALSE(store.load(7));
    store.save(7, values_of(4));
    store.save(123456, values_of(9, 0));
  }
  const TileStore store(path, "key 1", "a map");
  EXPECT_TRUE(store.has(7));
  EXPECT_FALSE(store.has(8));
  EXPECT_TRUE(same(store.load(7).value(), values_of(4)));
  EXPECT_TRUE(same(store.load(123456).value(), values_of(9, 0)));
}

TEST(TileStore, RefusesAnotherMapsFolder) {
  const TemporaryFolder folder;
  const fs::path path = folder / "tiles";
  { TileStore(path, "key 1", "Hong Kong at 15 m").save(0, values_of(0)); }
  const InputError other = error_of([&] { TileStore(path, "key 2", "Hong Kong at 20 m"); });
  EXPECT_NE(std::string(other.what()).find(path.string()), std::string::npos);
  EXPECT_EQ(other.problem(),
            "the tiles here are of another map (Hong Kong at 15 m), not of this one (Hong Kong at 20 m)");
  EXPECT_NE(other.hint().find("another output folder"), std::string::npos);
  EXPECT_TRUE(TileStore(path, "key 1", "").has(0));  // untouched

  write_bytes(path / "manifest.json", "{\"format\": \"canyon heat");
  EXPECT_THROW(TileStore(path, "key 1", ""), InputError);
  write_bytes(path / "manifest.json", "[1, 2]");
  EXPECT_THROW(TileStore(path, "key 1", ""), InputError);
  write_bytes(path / "manifest.json",
              R"({"format": "canyon heat map tiles", "version": 99, "key": "key 1", "description": ""})");
  EXPECT_NE(std::string(error_of([&] { TileStore(path, "key 1", ""); }).what()).find("version (99"),
            std::string::npos);
  fs::remove(path / "manifest.json");
  EXPECT_THROW(TileStore(path, "key 1", ""), InputError);

  const TemporaryFolder full;
  write_bytes(full / "holiday.jpg", "x");
  EXPECT_NE(std::string(error_of([&] { TileStore(full.path(), "key", ""); }).what()).find("holiday.jpg"),
            std::string::npos);
  write_bytes(folder / "file", "x");
  EXPECT_THROW(TileStore(folder / "file", "key", ""), InputError);
}

TEST(TileStore, NamesDamagedFiles) {
  const TemporaryFolder folder;
  TileStore store(folder / "tiles", "key", "a map");
  store.save(3, values_of(2));
  const fs::path file = unit_file(folder / "tiles", 3);
  const std::string good = read_bytes(file);
  const auto expect_damaged = [&](const std::string& bytes, bool by_head) {
    write_bytes(file, bytes);
    const InputError error = error_of([&] { (void)store.load(3); });
    EXPECT_EQ(error.file(), file.string());
    EXPECT_NE(error.problem().find("damaged"), std::string::npos) << error.what();
    EXPECT_NE(error.hint().find("delete this file"), std::string::npos);
    if (by_head) {
      EXPECT_THROW((void)store.has(3), InputError);
    } else {
      EXPECT_TRUE(store.has(3));
    }
  };
  // Any byte of the header, and some of the values.
  for (std::size_t i = 0; i < 80; ++i) {
    std::string bytes = good;
    bytes[i] = static_cast<char>(bytes[i] ^ 0x10);
    expect_damaged(bytes, true);
  }
  for (const std::size_t i : {std::size_t{80}, std::size_t{2000}, good.size() - 1}) {
    std::string bytes = good;
    bytes[i] = static_cast<char>(bytes[i] ^ 1);
    expect_damaged(bytes, false);
  }
  for (const std::size_t size : {std::size_t{0}, std::size_t{79}, std::size_t{80}, good.size() - 1}) {
    expect_damaged(good.substr(0, size), true);
  }
  expect_damaged(good + "x", true);
  write_bytes(file, good);
  EXPECT_TRUE(same(store.load(3).value(), values_of(2)));
  // Another unit's file with this one's name, another store's file.
  fs::copy_file(file, unit_file(folder / "tiles", 4));
  EXPECT_THROW((void)store.has(4), InputError);
  TileStore other(folder / "others", "key of another", "another map");
  other.save(3, values_of(2));
  fs::copy_file(unit_file(folder / "others", 3), file, fs::copy_options::overwrite_existing);
  EXPECT_THROW((void)store.has(3), InputError);
}

TEST(TileStore, SweepsWhatKilledRunsLeft) {
  const TemporaryFolder folder;
  const fs::path path = folder / "tiles";
  fs::create_directory(path);
  const fs::path old = unit_file(path, 1).string() + ".part-0123456789ab", foreign = path / "notes.part12";
  write_bytes(old, "half");
  TileStore(path, "key", "").save(0, values_of(0));
  write_bytes(foreign, "mine");
  const TileStore store(path, "key", "");
  EXPECT_FALSE(fs::exists(old));
  EXPECT_TRUE(fs::exists(foreign));
  EXPECT_FALSE(store.has(1));
  EXPECT_TRUE(store.has(0));
}

TEST(TileStore, RemovesItselfAndNothingElse) {
  const TemporaryFolder folder;
  for (const bool visited : {false, true}) {
    const fs::path path = folder / (visited ? "visited" : "own");
    TileStore store(path, "key", "");
    store.save(0, values_of(0));
    if (visited) write_bytes(path / "notes.txt", "mine");
    store.remove();
    EXPECT_EQ(fs::exists(path), visited);
    if (visited) {
      EXPECT_EQ(std::distance(fs::directory_iterator(path), fs::directory_iterator()), 1);
    }
  }
}

/// A full disk: existing files are kept, a unit that does not fit is an error and leaves no file.
void expect_full(TileStore& store, const fs::path& path, const char* reason) {
  const auto error = error_of<OutputError>([&] { store.save(1, values_of(1, 1'000'000)); });
  EXPECT_NE(std::string(error.what()).find(reason), std::string::npos) << error.what();
  EXPECT_FALSE(store.has(1));
  EXPECT_TRUE(same(store.load(0).value(), values_of(0)));
  for (const auto& entry : fs::directory_iterator(path)) {
    EXPECT_EQ(entry.path().string().find(".part"), std::string::npos) << entry.path();
  }
}

TEST(TileStore, FilesThatDoNotFitAreAnErrorAndOthersStay) {
  const TemporaryFolder folder;
  TileStore store(folder / "tiles", "key", "");
  store.save(0, values_of(0));
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &limit), 0);
  const rlimit old = limit;
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  limit.rlim_cur = 1'000'000;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
  expect_full(store, folder / "tiles", "File too large");
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &old), 0);
  std::signal(SIGXFSZ, handler);
  store.save(1, values_of(1, 1'000'000));
  EXPECT_TRUE(store.has(1));
}

TEST(TileStore, AFullDiskIsAnErrorAndOthersStay) {
  const TemporaryFolder folder;
  const fs::path disk = folder / "disk";
  fs::create_directory(disk);
  if (mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=1m") != 0) {
    GTEST_SKIP() << "SKIPPED: a small disk cannot be mounted here (" << std::strerror(errno) << ")";
  }
  {
    TileStore store(disk / "tiles", "key", "");
    store.save(0, values_of(0));
    expect_full(store, disk / "tiles", "No space left on device; free disk space");
  }
  EXPECT_EQ(umount(disk.c_str()), 0);
}

}  // namespace
}  // namespace canyon::heatmap
