#include "canyon/outputs/encoding/view_tables.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "tests/support/sample_epochs.hpp"

namespace canyon::encoding {
namespace {

/// A little-endian value as the machine has it: these tests run on such machines.
template <typename T>
T at(const std::string& bytes, std::size_t offset) {
  T value{};
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

TEST(Chunk, LayoutIsTheDocumentedOne) {
  ViewRows paths(kViewPaths);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  paths.add({1, 2, 12.5, 6.25, 10, 20, 30, nan, nan, nan});
  paths.add({0, 0, 0, 0, nan, nan, nan, nan, nan, nan});
  ViewRows skylines(kViewSkylines);
  skylines.add_bytes(std::string(kSkylineSectors, '\x5A'));
  const std::string bytes = encode_chunk({&skylines, &paths});

  // docs/view-format.md: magic, tables, reserved, then index and rows of each.
  EXPECT_EQ(bytes.substr(0, 8), "canyonV1");
  EXPECT_EQ(at<std::uint32_t>(bytes, 8), 2U);
  EXPECT_EQ(at<std::uint32_t>(bytes, 12), 0U);
  EXPECT_EQ(at<std::uint32_t>(bytes, 16), 1U);  // skylines
  EXPECT_EQ(at<std::uint32_t>(bytes, 20), 1U);
  EXPECT_EQ(at<std::uint32_t>(bytes, 24), 3U);  // paths
  EXPECT_EQ(at<std::uint32_t>(bytes, 28), 2U);
  // 32: 120 bytes of the skyline; 152: kind (2 bytes, padded to 8); 160: order; 168: excess.
  EXPECT_EQ(bytes.substr(32, 120), std::string(120, '\x5A'));
  EXPECT_EQ(bytes[152], 1);
  EXPECT_EQ(bytes[153], 0);
  EXPECT_EQ(bytes[160], 2);
  EXPECT_EQ(at<float>(bytes, 168), 12.5F);
  EXPECT_EQ(at<float>(bytes, 172), 0.0F);
  EXPECT_EQ(at<float>(bytes, 176), 6.25F);
  EXPECT_TRUE(std::isnan(at<float>(bytes, 208)));  // far_east_m
  EXPECT_EQ(bytes.size(), 152U + 10 * 8);
}

TEST(Chunk, NegativeAndLargeWholeNumbersKeepTheirBits) {
  ViewRows rows(kViewEpochs);
  ViewWords words;
  simulation::Epoch epoch = test::sample_epoch(test::sample_time(), test::sample_point(), {13, 14, 15});
  epoch.observed.visible = 65535;
  epoch.faults = {"jammer", "outage 2"};
  // The viewer-only columns; the last is the skyline.
  rows.add({0.5, 1, 2, 3, 4, 40, 41, 1, 8, 9, 10, 16, 17, 18, -1}, {epoch}, words);
  const std::string bytes = encode_chunk({&rows});
  // One row: every column takes 8 bytes with its padding, from 24 on.
  const auto offset = [](std::string_view name) {
    const auto columns = view_tables()[kViewEpochs].columns;
    const auto named = [&](const ViewColumn& c) { return c.name == name; };
    return 24 + 8 * static_cast<std::size_t>(std::find_if(columns.begin(), columns.end(), named) -
                                             columns.begin());
  };
  EXPECT_EQ(at<double>(bytes, offset("time_s")), 0.5);
  EXPECT_EQ(at<std::int32_t>(bytes, offset("skyline")), -1);
  EXPECT_EQ(at<double>(bytes, offset("error_up_m")), 15);
  EXPECT_EQ(at<std::uint16_t>(bytes, offset("tracked")), 65535U);
  EXPECT_EQ(at<std::uint16_t>(bytes, offset("faults")), 1U);
  EXPECT_EQ(words.lists().at("faults"), (std::vector<std::string>{"", "jammer; outage 2"}));
}

TEST(Chunk, GzipUnpacksToTheSameBytes) {
  std::string text;
  for (int i = 0; i < 10'000; ++i) text += std::to_string(i * i);
  const std::string packed = gzip(text);
  EXPECT_LT(packed.size(), text.size());
  EXPECT_EQ(packed.substr(0, 2), "\x1F\x8B");  // RFC 1952, 2.3.1
  std::string unpacked(text.size() + 1, '\0');
  z_stream stream{};
  ASSERT_EQ(inflateInit2(&stream, 15 + 16), Z_OK);
  std::string input = packed;
  stream.next_in = reinterpret_cast<Bytef*>(input.data());
  stream.avail_in = static_cast<uInt>(input.size());
  stream.next_out = reinterpret_cast<Bytef*>(unpacked.data());
  stream.avail_out = static_cast<uInt>(unpacked.size());
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  unpacked.resize(stream.total_out);
  inflateEnd(&stream);
  EXPECT_EQ(unpacked, text);
}

}  // namespace
}  // namespace canyon::encoding
