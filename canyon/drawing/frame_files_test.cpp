#include "canyon/drawing/frame_files.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <stdexcept>
#include <string>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::drawing {
namespace {

std::vector<std::string> names_in(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::string content(std::size_t i) {
  return "frame " + std::to_string(i);
}

TEST(Frames, NumberedFromOneInOrderOnAnyNumberOfThreads) {
  EXPECT_EQ(frame_name(0), "frame_000001.png");
  EXPECT_EQ(frame_name(999'998), "frame_999999.png");
  for (const int threads : {1, 2, 0}) {
    const test::TemporaryFolder folder;
    std::vector<std::size_t> done;
    FrameOptions options;
    options.threads = threads;
    options.progress = [&done](std::size_t n, std::size_t total) {
      EXPECT_EQ(total, 7U);
      done.push_back(n);
    };
    EXPECT_EQ(write_frames(folder / "new", 7, content, options), 7U);
    EXPECT_EQ(names_in(folder / "new").size(), 7U);
    for (std::size_t i = 0; i < 7; ++i) {
      EXPECT_EQ(test::read_bytes(folder / "new" / frame_name(i)), content(i));
    }
    EXPECT_TRUE(std::is_sorted(done.begin(), done.end()));
    EXPECT_EQ(done.back(), 7U);
  }
}

TEST(Frames, AfterAStopThereIsNoGapAndNoHalfFile) {
  const test::TemporaryFolder folder;
  std::atomic<bool> stop{false};
  FrameOptions options;
  options.stop = &stop;
  const std::size_t written = write_frames(
      folder.path(), 1000,
      [&stop](std::size_t i) {
        if (i >= 20) stop = true;
        return content(i);
      },
      options);
  EXPECT_GE(written, 21U);
  EXPECT_LT(written, 1000U);
  const std::vector<std::string> names = names_in(folder.path());
  ASSERT_EQ(names.size(), written);
  for (std::size_t i = 0; i < written; ++i) EXPECT_EQ(names[i], frame_name(i));
}

TEST(Frames, WhatAFrameThrowsGoesOnAfterThoseBeforeIt) {
  const test::TemporaryFolder folder;
  const auto draw = [](std::size_t i) {
    if (i == 5) throw std::runtime_error("no terrain");
    return content(i);
  };
  EXPECT_THROW(write_frames(folder.path(), 10, draw), std::runtime_error);
  EXPECT_EQ(names_in(folder.path()).size(), 5U);
}

TEST(Frames, BadInput) {
  const test::TemporaryFolder folder;
  EXPECT_THROW(write_frames(folder.path(), kMostFrames + 1, content), InputError);
  EXPECT_THROW(write_frames("/proc/nowhere", 1, content), InputError);
  EXPECT_EQ(write_frames(folder.path(), 0, content), 0U);
}

}  // namespace
}  // namespace canyon::drawing
