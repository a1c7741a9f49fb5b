#include "adapters/ros2/rtcm_topic.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <random>

#include "adapters/ros2/testing/rtcm_base.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "tests/support/refusal.hpp"

namespace canyon::adapters::ros2 {
namespace {

using geodesy::GpsTime;
using positioning::FixKind;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::int64_t kSecond = 1'000'000'000;

TEST(TopicAddress, NamesATopicAsRosDoes) {
  for (const char* name : {"rtcm", "/rtcm", "/ntrip_client/rtcm", "~/rtcm", "_a/b2"}) {
    EXPECT_EQ(topic_of(std::string("topic:") + name), name);
  }
  EXPECT_EQ(topic_of("tcp://127.0.0.1:2102"), std::nullopt);
  for (const char* name : {"", "/", "rt cm", "2rtcm", "a//b", "rtcm/", "a__b", "~rtcm", "rtcm?"}) {
    EXPECT_THAT(canyon::test::refusal([&] { (void)topic_of(std::string("topic:") + name); }),
                HasSubstr("topic:rtcm"))
        << name;
  }
}

TEST(TopicAddress, CarriesRtcmAlone) {
  EXPECT_EQ(topic_of_stream("base/rtcm=topic:/base/rtcm?ephemerides=false&rate_hz=1"), "/base/rtcm");
  EXPECT_EQ(topic_of_stream("nmea=tcp://127.0.0.1:10110"), std::nullopt);
  EXPECT_THAT(canyon::test::refusal([] { (void)topic_of_stream("nmea=topic:nmea"); }),
              HasSubstr("carries only RTCM 3"));
  EXPECT_THAT(canyon::test::refusal([] { (void)topic_of_stream("rtcm=topic:rtcm?virtual_station=true"); }),
              HasSubstr("virtual_station"));
}

// A frame is a preamble, 6 + 10 bits of length, that many bytes and a checksum of 3.
TEST(SplitFrames, GivesOneByOne) {
  const std::string one(
      "\xD3\x00\x02"
      "abCRC",
      8),
      other(
          "\xD3\x00\x01"
          "aCRC",
          7);
  EXPECT_THAT(split_frames(one + other), ElementsAre(one, other));
  EXPECT_THAT(split_frames(""), IsEmpty());
  test::Base base;
  const std::string epoch = base.bytes(0);
  std::string again;
  for (const std::string_view frame : split_frames(epoch)) {
    EXPECT_EQ(frame.front(), '\xD3');
    again += frame;
  }
  EXPECT_EQ(again, epoch);
  EXPECT_GT(split_frames(epoch).size(), 6U);  // 1005, 1033, four systems' MSM7, and ephemerides
}

class Topic : public testing::Test {
 protected:
  Topic()
      : settings_(test::open_field(
            {{"pose.source", "pose"}, {"rtk.enabled", true}, {"corrections.from", "topic:rtcm"}})) {}

  [[nodiscard]] GpsTime at(double seconds) const { return *settings_.live.start + seconds; }
  [[nodiscard]] const receiver::ReceiverOptions& options() const {
    return settings_.live.receivers.front().options;
  }

  NodeSettings settings_;
  live::RtcmInput topic_{settings_.live.receivers.front().options, 1};
};

TEST_F(Topic, SaysOnceWhatIsNoRtcm) {
  std::mt19937 random(1);
  std::string garbage(3000, '\0');
  std::generate(garbage.begin(), garbage.end(), [&] { return static_cast<char>(random()); });
  for (int i = 0; i < 5; ++i) {
    topic_.receive("", at(i));
    topic_.receive(garbage, at(i));
    topic_.receive(std::string(3'000'000, '\xD3'), at(i));
  }
  EXPECT_THAT(topic_.take_warnings(),
              ElementsAre(HasSubstr("has no bytes"), HasSubstr("are not a valid RTCM 3 frame"),
                          HasSubstr("3000000 bytes and is not read")));
  test::Base base;
  topic_.receive(base.bytes(kSecond), at(1));  // complete frames after it are read
  EXPECT_THAT(topic_.take_warnings(), IsEmpty());
}

TEST_F(Topic, TakesFramesCutAnywhere) {
  test::Base base;
  std::string stream;
  for (int i = 0; i < 4; ++i) stream += base.bytes(i * kSecond);
  std::mt19937 random(2);
  for (std::string_view rest = stream; !rest.empty();) {
    const std::size_t size = std::min<std::size_t>(rest.size(), 1 + random() % 300);
    topic_.receive(rest.substr(0, size), at(3));
    rest.remove_prefix(size);
  }
  EXPECT_THAT(topic_.take_warnings(), IsEmpty());
}

TEST_F(Topic, SaysThatAnotherStationBegan) {
  test::Base base, other;
  for (int i = 0; i < 4; ++i) {
    topic_.receive(base.bytes(i * kSecond), at(i));
    const std::string epoch = other.bytes(i * kSecond);
    for (const std::string_view frame : split_frames(epoch)) {
      // The same from station 7: bits 12 to 23 of a message.
      broadcast::Bits message, other_bits;
      for (const char c : frame.substr(3, frame.size() - 6)) message.put(static_cast<unsigned char>(c), 8);
      other_bits.put(message.number(0, 12), 12).put(7, 12);
      for (std::size_t bit = 24; bit < message.size(); ++bit) other_bits.put(message.number(bit, 1), 1);
      topic_.receive(rtcm::frame(other_bits), at(i));
    }
  }
  EXPECT_THAT(topic_.take_warnings(), ElementsAre(HasSubstr("station 7 follows station 0, 0 m apart")));
}

// All stations of Canyon have the same number.
TEST_F(Topic, SaysThatAnotherPlaceBegan) {
  test::Base base, other({{"fixed.east_m", -100.0}});
  for (int i = 0; i < 4; ++i) {
    topic_.receive(base.bytes(i * kSecond), at(i));
    topic_.receive(other.bytes(i * kSecond + kSecond / 2), at(i + 0.5));
  }
  EXPECT_THAT(topic_.take_warnings(), ElementsAre(HasSubstr("station 0 follows station 0, 1000 m apart")));
}

TEST_F(Topic, SaysThatCorrectionsAreOfAnotherTime) {
  test::Base base;
  for (int i = 0; i < 5; ++i) topic_.receive(base.bytes(i * kSecond), at(i + 7200));
  EXPECT_THAT(topic_.take_warnings(), ElementsAre(HasSubstr("2.0 h later: they are not used")));
  live::RtcmInput early(options(), 1);
  test::Base other;
  for (int i = 0; i < 5; ++i) early.receive(other.bytes((i + 100) * kSecond), at(i));
  EXPECT_THAT(early.take_warnings(), ElementsAre(HasSubstr("100 s earlier")));
}

TEST_F(Topic, SaysThatThePlaceIsMissing) {
  test::Base base;
  for (int i = 0; i < 90; ++i) {
    const std::string epoch = base.bytes(i * kSecond);
    for (const std::string_view frame : split_frames(epoch)) {
      const bool is_located = frame.at(3) == '\x3E' && (static_cast<unsigned char>(frame.at(4)) >> 4) == 0xD;
      if (!is_located) topic_.receive(frame, at(i));
    }
  }
  EXPECT_THAT(topic_.take_warnings(), ElementsAre(HasSubstr("without message 1005 or 1006")));
}

// A rover in an open field 950 m from the base (docs/rtk.md) is fixed within seconds and within centimetres.
TEST_F(Topic, RoverIsFixedWhileCorrectionsCome) {
  settings_ = test::open_field({{"pose.source", "pose"},
                                {"rtk.enabled", true},
                                {"corrections.from", "topic:rtcm"},
                                {"corrections.max_age_s", 5.0}});
  test::Base base;
  const auto rover = test::make_receiver(settings_, "/rover");
  std::string reason;
  const auto observe = [&](std::int64_t now_ns) {
    EXPECT_THAT(rover->add({{0, 0, 2}, Eigen::Quaterniond::Identity()}, 0, now_ns), IsEmpty());
    return rover->observe(now_ns, reason).value().epoch;
  };
  std::int64_t now_ns = 0;
  int fixed = 0;
  for (int i = 0; i < 30; ++i, now_ns += kSecond) {
    const std::string epoch = base.bytes(now_ns);
    for (const std::string_view frame : split_frames(epoch))
      rover->receive_rtcm(frame, now_ns + kSecond / 50);
    const auto seen = observe(now_ns + kSecond / 10);
    if (seen.observed.fix.kind() != FixKind::Fixed) continue;
    ++fixed;
    EXPECT_LT(seen.error_enu_m.head<2>().norm(), 0.05);
    EXPECT_NEAR(seen.observed.fix.correction_age_s.value(), 0.1, 0.01);
  }
  EXPECT_GT(fixed, 20);
  EXPECT_EQ(observe(now_ns).observed.fix.kind(), FixKind::Fixed);
  EXPECT_EQ(observe(now_ns + 10 * kSecond).observed.fix.kind(), FixKind::Single);
  // Time goes back: base and rover restart.
  test::Base again;
  FixKind last = FixKind::None;
  for (int i = 0; i < 20; ++i) {
    rover->receive_rtcm(again.bytes(i * kSecond), i * kSecond);
    last = observe(i * kSecond + kSecond / 10).observed.fix.kind();
  }
  EXPECT_EQ(last, FixKind::Fixed);
  EXPECT_THAT(rover->take_warnings(), IsEmpty());
}

}  // namespace
}  // namespace canyon::adapters::ros2
