// The fuzz targets as ordinary tests: reads seeds and replays former findings.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "canyon/base/input_error.hpp"
#include "tests/fuzz/targets.hpp"
#include "tests/support/source_dir.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::fuzz {
namespace {

class Fuzz : public testing::TestWithParam<Target> {};

TEST_P(Fuzz, SeedsAreRead) {
  const test::TemporaryFolder folder;
  ASSERT_FALSE(GetParam().seeds.empty());
  for (const std::string& seed : GetParam().seeds) {
    const std::filesystem::path path = folder / GetParam().file_name;
    std::ofstream(path, std::ios::binary) << seed;
    EXPECT_NO_THROW(GetParam().read(path)) << seed.substr(0, 200);
  }
}

TEST_P(Fuzz, FindingsArePast) {
  const std::filesystem::path folder =
      std::filesystem::path(canyon_source_dir) / "tests/fuzz/findings" / GetParam().name;
  if (!std::filesystem::exists(folder)) return;  // no findings so far
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    SCOPED_TRACE(entry.path().string());
    EXPECT_NO_THROW(read_bytes(GetParam(), test::read_bytes(entry.path())));
  }
}

INSTANTIATE_TEST_SUITE_P(All, Fuzz, testing::ValuesIn(targets()),
                         [](const auto& each) { return each.param.name; });

// Folders with other names would not be read.
TEST(FuzzFindings, EveryFolderHasItsTarget) {
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(canyon_source_dir) /
                                                               "tests/fuzz/findings")) {
    if (!entry.is_directory()) continue;
    const std::string name = entry.path().filename().string();
    EXPECT_TRUE(std::any_of(targets().begin(), targets().end(), [&](const Target& t) {
      return t.name == name;
    })) << name;
  }
}

}  // namespace
}  // namespace canyon::fuzz
