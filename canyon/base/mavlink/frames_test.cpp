#include "canyon/base/mavlink/frames.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace canyon::mavlink {
namespace {

std::vector<Frame> received(MavlinkParser& parser, std::string_view bytes, std::size_t step = 1 << 20) {
  std::vector<Frame> frames;
  for (; !bytes.empty(); bytes.remove_prefix(std::min(step, bytes.size()))) {
    parser.receive(bytes.substr(0, step), [&](const Frame& f) { frames.push_back(f); });
  }
  return frames;
}

AttPosMocap mocap() {
  AttPosMocap m;
  m.time_us = 1'556'456'283'250'000;
  m.ned_from_frd = {0.5, -0.5, 0.5, 0.5};
  m.position_ned_m = {1.25, -2.5, -3.75};
  return m;
}

// CRC_EXTRA and sizes from the generated headers of the MAVLink project (common.h, MAVLINK_MESSAGE_CRCS): id,
// CRC_EXTRA, minimum and maximum payload.
TEST(MavlinkFrames, LayoutsAreThePublishedOnes) {
  struct Published {
    std::uint32_t id;
    int crc_extra;
    std::size_t base_bytes, bytes;
  };
  const std::vector<Published> published{
      {0, 50, 9, 9},      {2, 137, 12, 12},    {24, 24, 30, 52},    {25, 23, 101, 101}, {30, 39, 28, 28},
      {31, 246, 32, 48},  {32, 185, 28, 28},   {33, 104, 28, 28},   {105, 93, 62, 63},  {102, 158, 32, 117},
      {108, 32, 84, 92},  {113, 124, 36, 39},  {127, 25, 35, 35},   {115, 4, 64, 64},   {138, 109, 36, 120},
      {232, 151, 63, 65}, {233, 35, 182, 182}, {331, 91, 230, 233}, {76, 152, 33, 33},  {441, 169, 17, 17},
  };
  ASSERT_EQ(published.size(), layouts().size());
  for (std::size_t i = 0; i < published.size(); ++i) {
    const FrameLayout& layout = layouts()[i];
    EXPECT_EQ(layout.id, published[i].id);
    EXPECT_EQ(layout.crc_extra, published[i].crc_extra) << layout.name;
    EXPECT_EQ(layout.base_bytes, published[i].base_bytes) << layout.name;
    EXPECT_EQ(layout.bytes, published[i].bytes) << layout.name;
  }
}

// The check value of CRC-16/MCRF4XX in the catalogue of parametrised CRC algorithms.
TEST(MavlinkFrames, Crc) {
  EXPECT_EQ(crc16("123456789"), 0x6F91);
}

TEST(MavlinkFrames, GoThereAndBackInBothVersions) {
  for (const Version version : {Version::V1, Version::V2}) {
    MavlinkParser parser;
    const auto frames = received(parser, encode(mocap(), 7, {12, 34}, version), 1);
    ASSERT_EQ(frames.size(), 1U);
    EXPECT_EQ(frames[0].version, version);
    EXPECT_EQ(frames[0].sequence, 7);
    EXPECT_EQ(frames[0].sender.system, 12);
    EXPECT_EQ(frames[0].sender.component, 34);
    const auto& m = std::get<AttPosMocap>(frames[0].message);
    EXPECT_EQ(m.time_us, mocap().time_us);
    EXPECT_EQ(m.ned_from_frd, mocap().ned_from_frd);
    EXPECT_EQ(m.position_ned_m, mocap().position_ned_m);
    // MAVLink 1 has no extensions: they read as zeros.
    EXPECT_EQ(std::isnan(m.covariance[0]), version == Version::V2);
    EXPECT_EQ(parser.passed_over(), 0U);
  }
}

TEST(MavlinkFrames, UnknownAndOutOfRangeValues) {
  HilGps m;
  m.latitude_deg = -22.2982517;
  m.horizontal_accuracy_m = 1e9;
  m.velocity_ned_mps = {-400, 1.005, 400};
  m.altitude_m = kUnknown;
  MavlinkParser parser;
  const auto back = std::get<HilGps>(received(parser, encode(m, 0)).at(0).message);
  EXPECT_NEAR(back.latitude_deg, m.latitude_deg, 1e-12);
  EXPECT_DOUBLE_EQ(back.horizontal_accuracy_m, 655.34) << "the greatest that does not read as unknown";
  EXPECT_TRUE(std::isnan(back.vertical_accuracy_m));
  EXPECT_DOUBLE_EQ(back.velocity_ned_mps.x(), -327.68);
  EXPECT_NEAR(back.velocity_ned_mps.y(), 1.005, 0.00501);
  EXPECT_DOUBLE_EQ(back.velocity_ned_mps.z(), 327.67);
  EXPECT_EQ(back.altitude_m, 0) << "the field has no value for unknown";
  EXPECT_TRUE(std::isnan(back.yaw_deg));
}

TEST(MavlinkFrames, TrailingZerosAreCutAndFilledIn) {
  const std::string frame = encode(SystemTime{}, 0);
  EXPECT_EQ(frame.size(), 10U + 1 + 2) << "one byte of payload stays";
  MavlinkParser parser;
  EXPECT_EQ(std::get<SystemTime>(received(parser, frame).at(0).message).time_us, 0U);
}

TEST(MavlinkFrames, ResynchronisesBehindGarbageAndBrokenFrames) {
  const std::string good = encode(mocap(), 1), other = encode(SystemTime{5, 2}, 2, {}, Version::V1);
  std::string broken = good;
  broken[20] = static_cast<char>(broken[20] ^ 1);
  const std::string cut = good.substr(0, 30);
  const std::string stream = "noise\xFD\xFE" + broken + good + cut + other + good + std::string(300, '\xFD') +
                             other + std::string(20, '\0');
  for (const std::size_t step : {std::size_t{1}, std::size_t{7}, stream.size()}) {
    MavlinkParser parser;
    const auto frames = received(parser, stream, step);
    ASSERT_EQ(frames.size(), 4U) << step;
    EXPECT_EQ(frames[0].sequence, 1);
    EXPECT_EQ(frames[1].sequence, 2);
    EXPECT_EQ(frames[3].sequence, 2);
    EXPECT_EQ(parser.passed_over(), stream.size() - 2 * (good.size() + other.size()));
  }
}

TEST(MavlinkFrames, PassesOverWhatItDoesNotKnow) {
  std::string unknown = encode(mocap(), 1);
  unknown[7] = 77;  // COMMAND_ACK
  std::string future = encode(mocap(), 1);
  future[2] = 2;  // an incompatibility flag
  MavlinkParser parser;
  const auto frames = received(parser, unknown + future + encode(mocap(), 9));
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].sequence, 9);
}

/// The frame with another payload and a new checksum.
std::string reframed(const std::string& payload, std::uint32_t id, std::uint8_t crc_extra,
                     unsigned char flags) {
  std::string frame = "\xFD";
  frame += static_cast<char>(payload.size());
  frame += static_cast<char>(flags);
  frame += std::string("\0\0\1\1", 4);
  for (int i = 0; i < 3; ++i) frame += static_cast<char>(id >> (8 * i));
  frame += payload;
  const std::uint16_t crc = crc16(std::string(1, static_cast<char>(crc_extra)), crc16(frame.substr(1)));
  frame += static_cast<char>(crc & 0xFF);
  frame += static_cast<char>(crc >> 8);
  return frame;
}

TEST(MavlinkFrames, LongerMessagesOfNewerDefinitionsAndSignedOnesAreRead) {
  const std::string payload("\5\0\0\0\0\0\0\0\1\2\0\0new", 15);
  MavlinkParser parser;
  const std::string stream = reframed(payload, 2, 137, 0) + reframed(payload, 2, 137, 1) +
                             std::string("signature\0\0\0\0", 13) + encode(mocap(), 3);
  const auto frames = received(parser, stream, 3);
  ASSERT_EQ(frames.size(), 3U);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(std::get<SystemTime>(frames[i].message).time_us, 5U);
    EXPECT_DOUBLE_EQ(std::get<SystemTime>(frames[i].message).boot_s, 0.513);
  }
  EXPECT_EQ(parser.passed_over(), 0U);
}

TEST(MavlinkFrames, RandomBytesGiveNoFrameAndCostNoneBehindThem) {
  std::mt19937 random(3);
  std::string noise(100'000, '\0');
  for (char& c : noise) {
    const auto draw = random();
    c = draw % 4 == 0 ? "\xFD\xFE"[draw / 4 % 2] : static_cast<char>(draw >> 8);  // many magic bytes
  }
  MavlinkParser parser;
  EXPECT_LE(received(parser, noise, 33).size(), 2U) << "16 bits of checksum let few pass";
  // A false start of a frame in the noise ends within one frame's length.
  const std::string good = encode(mocap(), 9);
  std::string stream = std::string(280, '\0');
  for (int i = 0; i < 10; ++i) stream += good;
  EXPECT_EQ(received(parser, stream).size(), 10U);
}

TEST(MavlinkFrames, SimulatorsPlaceIsTheFinerOne) {
  SimState m;
  m.coarse_latitude_deg = 47.25;
  m.coarse_longitude_deg = 8.5;
  MavlinkParser parser;
  auto back = std::get<SimState>(received(parser, encode(m, 0)).at(0).message);
  EXPECT_EQ(back.latitude_deg(), 47.25);
  m.fine_latitude_deg = 47.2500001;
  m.fine_longitude_deg = -8.5000002;
  back = std::get<SimState>(received(parser, encode(m, 0)).at(0).message);
  EXPECT_DOUBLE_EQ(back.latitude_deg(), 47.2500001);
  EXPECT_DOUBLE_EQ(back.longitude_deg(), -8.5000002);
}

}  // namespace
}  // namespace canyon::mavlink
