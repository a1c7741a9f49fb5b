#include "canyon/drawing/apng.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "tests/support/apng_frames.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::drawing {
namespace {

using test::ApngFrames;
using ::testing::HasSubstr;

RgbImage plain(int width, int height, std::uint32_t colour) {
  return {width, height, std::vector<std::uint32_t>(static_cast<std::size_t>(width * height), colour)};
}

std::uint32_t& at(RgbImage& image, int x, int y) {
  return image.pixels[static_cast<std::size_t>(y * image.width + x)];
}

TEST(Png, PixelsComeBack) {
  RgbImage image = plain(7, 3, 0x123456);
  at(image, 6, 2) = 0xFFFFFF;
  at(image, 0, 1) = 0x000000;
  const RgbImage back = decode_png(encode_png(image));
  EXPECT_EQ(back.width, 7);
  EXPECT_EQ(back.height, 3);
  EXPECT_EQ(back.pixels, image.pixels);
  EXPECT_THROW((void)decode_png("no picture"), std::runtime_error);
  EXPECT_THROW((void)decode_png(encode_png(image).substr(0, 40)), std::runtime_error);
}

// Read back by libpng (through Cairo) and a parser that checks every CRC and sequence number.
TEST(AnimatedPng, FramesComeBack) {
  std::vector<RgbImage> images(4, plain(40, 30, 0xF0F0F0));
  at(images[0], 3, 4) = 0x00FF00;
  at(images[1], 10, 5) = 0xFF0000;
  at(images[1], 12, 20) = 0x0000FF;
  images[2] = images[1];  // nothing changes
  images[3] = plain(40, 30, 0x010203);
  const test::TemporaryFolder folder;
  AnimatedPng animation(folder / "a.png", 4, 0.25);
  for (const RgbImage& image : images) animation.add(encode_png(image));
  EXPECT_FALSE(std::filesystem::exists(folder / "a.png"));
  animation.commit();

  const std::string bytes = test::read_bytes(folder / "a.png");
  const ApngFrames frames(bytes);
  EXPECT_EQ(frames.plays(), 0U);
  ASSERT_EQ(frames.frames().size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(frames.frames()[i].pixels, images[i].pixels) << i;
    EXPECT_DOUBLE_EQ(frames.controls()[i].delay_s, 0.25);
  }
  // The change reaches from (3, 4) to (12, 20): the first frame's dot goes as well.
  EXPECT_EQ(frames.controls()[1].x, 3U);
  EXPECT_EQ(frames.controls()[1].y, 4U);
  EXPECT_EQ(frames.controls()[1].width, 10U);
  EXPECT_EQ(frames.controls()[1].height, 17U);
  EXPECT_EQ(frames.controls()[2].width * frames.controls()[2].height, 1U);
  EXPECT_EQ(frames.controls()[3].width * frames.controls()[3].height, 1200U);
  // Readers that know no animation see the first frame.
  EXPECT_EQ(decode_png(bytes).pixels, images[0].pixels);
}

TEST(AnimatedPng, OneFrameIsOneToo) {
  const test::TemporaryFolder folder;
  AnimatedPng animation(folder / "a.png", 1, 65);
  animation.add(encode_png(plain(1, 1, 0xABCDEF)));
  animation.commit();
  const ApngFrames frames(test::read_bytes(folder / "a.png"));
  ASSERT_EQ(frames.frames().size(), 1U);
  EXPECT_EQ(frames.frames()[0].pixels, std::vector<std::uint32_t>{0xABCDEF});
}

TEST(AnimatedPng, FramesOfManyChunks) {
  // Noise does not compress: libpng writes IDATs of 8 KiB.
  RgbImage first = plain(150, 100, 0), second = first;
  std::uint32_t state = 1;
  for (RgbImage* image : {&first, &second}) {
    for (std::uint32_t& pixel : image->pixels) {
      state = state * 1664525U + 1013904223U;  // Knuth, The Art of Computer Programming 2, 3.3.4
      pixel = state >> 8;
    }
  }
  const test::TemporaryFolder folder;
  AnimatedPng animation(folder / "a.png", 2, 0.5);
  animation.add(encode_png(first));
  animation.add(encode_png(second));
  animation.commit();
  const ApngFrames frames(test::read_bytes(folder / "a.png"));
  ASSERT_EQ(frames.frames().size(), 2U);
  EXPECT_EQ(frames.frames()[0].pixels, first.pixels);
  EXPECT_EQ(frames.frames()[1].pixels, second.pixels);
  EXPECT_GT(frames.data_chunks(), 4U);
}

TEST(AnimatedPng, NothingIsLeftOfAnUnfinishedOne) {
  const test::TemporaryFolder folder;
  {
    AnimatedPng animation(folder / "a.png", 2, 0.5);
    animation.add(encode_png(plain(2, 2, 0)));
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  EXPECT_THROW(AnimatedPng(folder / "missing" / "a.png", 1, 0.5), InputError);
}

}  // namespace
}  // namespace canyon::drawing
