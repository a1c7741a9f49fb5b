#include "canyon/base/mavlink/frames.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/rtcm_parts.hpp"

namespace canyon::mavlink {
namespace {

std::string message(std::size_t size) {
  std::string bytes;
  for (std::size_t i = 0; i < size; ++i) bytes += static_cast<char>(i * 7 + 1);
  return bytes;
}

// common.xml, GPS_RTCM_DATA: bit 0 of the flags marks a part, bits 1 and 2 are its number, bits 3 to 7 the
// number of the message.
TEST(RtcmData, PartsAreNumbered) {
  const auto parts = rtcm_data(message(400), 37);
  ASSERT_EQ(parts.size(), 3U);
  EXPECT_EQ(parts[0].flags, 5 << 3 | 1);
  EXPECT_EQ(parts[1].flags, 5 << 3 | 1 << 1 | 1);
  EXPECT_EQ(parts[2].flags, 5 << 3 | 2 << 1 | 1);
  EXPECT_EQ(parts[1].length, 180);
  EXPECT_EQ(parts[2].length, 40);
  const auto whole = rtcm_data(message(180), 2);
  ASSERT_EQ(whole.size(), 1U);
  EXPECT_EQ(whole[0].flags, 2 << 3);
}

TEST(RtcmData, PartsAreJoinedInAnyOrder) {
  RtcmParts joined;
  std::uint8_t number = 0;
  for (const std::size_t size : {1, 179, 180, 181, 360, 400, 540, 541, 720, 721, 1029}) {
    for (const bool backwards : {false, true}) {
      auto parts = rtcm_data(message(size), number++);
      if (backwards && size <= 720) std::reverse(parts.begin(), parts.end());
      std::string bytes;
      for (std::size_t i = 0; i < parts.size(); ++i) {
        const std::string ready = joined.receive(parts[i]);
        EXPECT_EQ(ready.empty(), size <= 720 && i + 1 < parts.size()) << size;
        bytes += ready;
      }
      EXPECT_EQ(bytes, message(size));
    }
  }
}

TEST(RtcmData, AMessageWithALostPartIsLostAlone) {
  RtcmParts joined;
  const auto first = rtcm_data(message(400), 1), second = rtcm_data(message(300), 2);
  EXPECT_EQ(joined.receive(first[0]), "");
  EXPECT_EQ(joined.receive(first[2]), "");
  EXPECT_EQ(joined.receive(second[0]), "");
  EXPECT_EQ(joined.receive(second[1]), message(300));
  GpsRtcmData hostile;
  hostile.length = 255;
  EXPECT_EQ(joined.receive(hostile).size(), 180U);
}

}  // namespace
}  // namespace canyon::mavlink
