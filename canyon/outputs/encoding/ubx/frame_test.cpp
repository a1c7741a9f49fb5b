#include "canyon/outputs/encoding/ubx/frame.hpp"

#include <gtest/gtest.h>

#include <chrono>

namespace canyon::encoding::ubx {
namespace {

std::string bytes(std::initializer_list<unsigned> values) {
  std::string text;
  for (const unsigned value : values) text += static_cast<char>(value);
  return text;
}

struct Received {
  std::vector<std::pair<MessageId, std::string>> frames;
  std::vector<std::string> lines;
  UbxParser parser;
  void receive(std::string_view text) {
    parser.receive(text, {[&](MessageId id, std::string_view payload) { frames.emplace_back(id, payload); },
                          [&](std::string_view line) { lines.emplace_back(line); }});
  }
};

// Published frames: u-blox's poll of MON-VER, and a rate of NAV-SOL with its checksum 12 4F.
TEST(Frame, IsThatOfTheProtocol) {
  EXPECT_EQ(frame(0x0A04, ""), bytes({0xB5, 0x62, 0x0A, 0x04, 0, 0, 0x0E, 0x34}));
  EXPECT_EQ(frame(0x0601, bytes({1, 6, 1})), bytes({0xB5, 0x62, 6, 1, 3, 0, 1, 6, 1, 0x12, 0x4F}));
}

TEST(Payload, IsLittleEndianAndStaysInRange) {
  EXPECT_EQ(Payload().u1(0x1FF).u2(0x1234).u4(0x89ABCDEF).bytes(),
            bytes({0xFF, 0x34, 0x12, 0xEF, 0xCD, 0xAB, 0x89}));
  EXPECT_EQ(Payload().signed_field(-1.26, 0.1, 2).bytes(), bytes({0xF3, 0xFF}));  // -13
  EXPECT_EQ(Payload().signed_field(1e9, 0.1, 2).bytes(), bytes({0xFF, 0x7F}));
  EXPECT_EQ(Payload().unsigned_field(1e99, 0.1, 2).bytes(), bytes({0xFF, 0xFF}));
  EXPECT_EQ(Payload().unsigned_field(-1, 0.1, 2).bytes(), bytes({0, 0}));
  EXPECT_EQ(Payload().r4(1.0F).bytes(), bytes({0, 0, 0x80, 0x3F}));  // IEEE 754
  EXPECT_EQ(Payload().text("abc", 5).text("abcdef", 2).bytes(), std::string("abc\0\0ab", 7));
}

TEST(UbxParser, FindsFramesAndLinesHoweverTheyAreCut) {
  // One flight controller's driver sends first a frame, followed by u-blox's NMEA command.
  const std::string text = "noise\xB5" + frame(0x0601, bytes({1, 6, 1})) +
                           "$PUBX,41,1,0023,0001,115200,0*1C\r\n" + frame(0x0A04, "") + "\xB5\x62";
  for (std::size_t size = 1; size <= text.size(); ++size) {
    Received received;
    for (std::size_t at = 0; at < text.size(); at += size)
      received.receive(std::string_view(text).substr(at, size));
    ASSERT_EQ(received.frames.size(), 2U) << size;
    EXPECT_EQ(received.frames[0].first, 0x0601);
    EXPECT_EQ(received.frames[0].second, bytes({1, 6, 1}));
    EXPECT_EQ(received.frames[1].first, 0x0A04);
    ASSERT_EQ(received.lines.size(), 1U);
    EXPECT_EQ(received.lines[0], "PUBX,41,1,0023,0001,115200,0");
  }
}

TEST(UbxParser, GoesOnBehindWhatIsDamaged) {
  Received received;
  std::string damaged = frame(0x0608, bytes({100, 0, 1, 0, 0, 0}));
  damaged[7] ^= 1;
  const std::string good = frame(0x0A04, "");
  received.receive(damaged + good);
  received.receive("$PUBX,41,1,0023,0001,115200,0*1D\r\n" + good);  // wrong checksum
  received.receive(bytes({0xB5, 0x62, 6, 1, 0xFF, 0xFF}) + good);   // too long
  received.receive(good.substr(0, 6) + good);                       // cut off
  EXPECT_EQ(received.frames.size(), 4U);
  EXPECT_TRUE(received.lines.empty());
}

TEST(UbxParser, HoldsLittleAndIsQuickWhateverComes) {
  Received received;
  std::string hostile;
  while (hostile.size() < 1'000'000) hostile += bytes({0xB5, 0x62, 6, 1, 0, 4, '$', 0xB5});
  const auto begin = std::chrono::steady_clock::now();
  received.receive(hostile);
  EXPECT_LT(std::chrono::steady_clock::now() - begin,
            std::chrono::seconds(20));  // 0.2 s on the author's machine
  EXPECT_LE(received.parser.held(), UbxParser::kMaxBytes);
  EXPECT_TRUE(received.frames.empty());
  received.receive(std::string(UbxParser::kMaxBytes, '\0') + frame(0x0A04, ""));
  EXPECT_EQ(received.frames.size(), 1U);
}

}  // namespace
}  // namespace canyon::encoding::ubx
