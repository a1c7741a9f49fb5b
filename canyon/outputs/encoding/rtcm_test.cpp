// Closed forms and the standard's own example; complete messages are checked by RTKLIB in
// tests/integration/rtcm_test.cpp.
#include "canyon/outputs/encoding/rtcm.hpp"

#include <gtest/gtest.h>

#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/outputs/encoding/stream.hpp"
#include "tests/support/sample_epochs.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::encoding {
namespace {

using broadcast::Bits;

/// Messages in a stream of contiguous frames, by number, in order.
std::vector<std::pair<int, std::string>> messages_in(const std::string& stream) {
  std::vector<std::pair<int, std::string>> messages;
  for (std::size_t at = 0; at + 6 <= stream.size();) {
    const auto byte = [&](std::size_t i) {
      return static_cast<unsigned>(static_cast<unsigned char>(stream[at + i]));
    };
    EXPECT_EQ(byte(0), 0xD3U);
    const std::size_t length = (byte(1) & 3U) << 8 | byte(2);
    messages.emplace_back(static_cast<int>(byte(3) << 4 | byte(4) >> 4), stream.substr(at, length + 6));
    at += length + 6;
  }
  return messages;
}

std::vector<int> numbers_in(const std::string& stream) {
  std::vector<int> numbers;
  for (const auto& [number, bytes] : messages_in(stream)) numbers.push_back(number);
  return numbers;
}

// RTCM 10403, 4.2: the worked example of message 1005.
TEST(Rtcm, FrameOfTheStandardsExample) {
  const std::string example(
      "\xD3\x00\x13\x3E\xD7\xD3\x02\x02\x98\x0E\xDE\xEF\x34\xB4\xBD\x62\xAC\x09\x41\x98\x6F\x33\x36"
      "\x0B\x98",
      25);
  Bits message;
  for (std::size_t i = 3; i < 22; ++i) message.put(static_cast<unsigned char>(example[i]), 8);
  EXPECT_EQ(rtcm::frame(message), example);
  // The same position: its coordinates are 38 bits each at 34, 74 and 114.
  const Bits ours = rtcm::station({1114104.5999, -4850729.7108, 3975521.4643});
  ASSERT_EQ(ours.size(), message.size());
  for (const std::size_t at : {34U, 74U, 114U}) EXPECT_EQ(ours.number(at, 38), message.number(at, 38));
}

TEST(Rtcm, EverySignalHasANumber) {
  for (const gnss::System system : gnss::kAllSystems) {
    for (const gnss::Signal& signal : gnss::signals_of(system)) {
      EXPECT_TRUE(signal.msm > 0 || !signal.only_recorded.empty())
          << gnss::name(system) << ' ' << signal.name;
    }
  }
}

ReceiverDescription description() {
  return {.name = "base", .systems = {gnss::System::GPS}, .begin = test::sample_time()};
}

TEST(Rtcm, OnlyAStationTellsItsPlace) {
  const simulation::Epoch epoch = test::sample_epoch(test::sample_time(), test::sample_point(), {1, 2, 3});
  const auto rover = format_named("rtcm").make(description());
  EXPECT_EQ(numbers_in(rover->encode(epoch)), (std::vector<int>{1033, 1077, 1087, 1097, 1117, 1127}));
  ReceiverDescription station = description();
  station.station_ecef = epoch.truth_ecef;
  const auto base = format_named("rtcm").make(station);
  EXPECT_EQ(numbers_in(base->encode(epoch)), (std::vector<int>{1005, 1033, 1077, 1087, 1097, 1117, 1127}));
  simulation::Epoch next = epoch;
  const auto go_on = [&next](double seconds) {
    next.observed.time = next.observed.time + seconds;
    next.observed.receiver_time = next.observed.receiver_time + seconds;
  };
  go_on(9.9);
  EXPECT_EQ(numbers_in(base->encode(next)).front(), 1077);
  go_on(0.1);
  EXPECT_EQ(numbers_in(base->encode(next)).front(), 1005);
}

TEST(Rtcm, EphemeridesComeAtOnceWhenNewAndEveryHalfMinute) {
  gnss::NavigationData navigation;
  gnss::KeplerEphemeris e;
  e.id = *gnss::parse_satellite("G05");
  e.toc = e.toe = e.transmission = test::sample_time() - 1000;
  navigation.kepler.push_back(e);
  e.toe = e.toc = test::sample_time() - 1000 + 7200;
  navigation.kepler.push_back(e);
  e.id = *gnss::parse_satellite("G31");  // blocked in the sample
  navigation.kepler.push_back(e);
  std::vector<int> seconds;
  rtcm::Ephemerides ephemerides;
  for (int s = 0; s < 3000; ++s) {
    simulation::Epoch epoch = test::sample_epoch(test::sample_time() + s, test::sample_point(), {0, 0, 0});
    epoch.navigation = &navigation;
    const auto due = ephemerides.due(epoch);
    if (!due.empty()) seconds.push_back(s);
    EXPECT_LE(due.size(), 1U);
  }
  // The later record is the nearer one from 2,600 s on, midway between the two.
  std::vector<int> expected;
  for (int s = 0; s < 2600; s += 30) expected.push_back(s);
  for (int s = 2600; s < 3000; s += 30) expected.push_back(s);
  EXPECT_EQ(seconds, expected);
}

TEST(Rtcm, AStreamLeavesEphemeridesOutWhereItIsTold) {
  gnss::NavigationData navigation;
  gnss::KeplerEphemeris e;
  e.id = *gnss::parse_satellite("G05");
  e.toc = e.toe = e.transmission = test::sample_time() - 1000;
  navigation.kepler.push_back(e);
  simulation::Epoch epoch = test::sample_epoch(test::sample_time(), test::sample_point(), {1, 2, 3});
  epoch.navigation = &navigation;
  const test::TemporaryFolder folder;
  const auto sent = [&](const std::string& options) {
    const std::filesystem::path file = folder / "receiver.rtcm3";
    const auto stream = open_stream(parse_stream("rtcm=file:" + file.string() + options), 0, description());
    stream->write(epoch);
    stream->finish();
    return numbers_in(test::read_bytes(file));
  };
  EXPECT_EQ(sent(""), (std::vector<int>{1033, 1019, 1077, 1087, 1097, 1117, 1127}));
  EXPECT_EQ(sent("?ephemerides=true"), sent(""));
  EXPECT_EQ(sent("?ephemerides=false"), (std::vector<int>{1033, 1077, 1087, 1097, 1117, 1127}));
}

// A fault changes the contents and keeps toe and time of transmission.
TEST(Rtcm, ChangedEphemeridesComeAtOnceAndSoDoTheOldOnes) {
  gnss::NavigationData right;
  gnss::KeplerEphemeris e;
  e.id = *gnss::parse_satellite("G05");
  e.sqrt_a = 5153.7;
  e.toc = e.toe = e.transmission = test::sample_time() - 1000;
  right.kepler.push_back(e);
  gnss::NavigationData wrong = right;
  wrong.kepler[0].af0 = 1e-6;
  std::vector<int> seconds;
  rtcm::Ephemerides ephemerides;
  for (int s = 0; s < 30; ++s) {
    simulation::Epoch epoch = test::sample_epoch(test::sample_time() + s, test::sample_point(), {0, 0, 0});
    epoch.navigation = s >= 10 && s < 17 ? &wrong : &right;
    if (!ephemerides.due(epoch).empty()) seconds.push_back(s);
  }
  EXPECT_EQ(seconds, (std::vector<int>{0, 10, 17}));
}

TEST(Rtcm, NoMessageHoldsMoreThan64Cells) {
  // Twenty satellites with four signals: two messages, of 16 and 4 satellites, and the first is marked as
  // followed by more of the epoch (DF393, bit 54).
  simulation::Epoch epoch;
  epoch.observed.time = epoch.observed.receiver_time = test::sample_time();
  const auto signals = gnss::signals_of(gnss::System::GPS);
  for (int n = 1; n <= 20; ++n) {
    auto satellite = test::sample_satellite(n < 10 ? "G0" + std::to_string(n) : "G" + std::to_string(n), 0,
                                            45, propagation::Visibility::LOS);
    satellite.signal = &signals[0];
    for (std::size_t k = 1; k < 4; ++k) {
      receiver::SignalObservation other;
      other.signal = &signals[k];
      other.measurement = satellite.measurement;
      satellite.more.push_back(other);
    }
    epoch.observed.satellites.push_back(satellite);
  }
  rtcm::Observations observations({});
  const std::vector<Bits> messages = observations.messages(epoch.observed);
  ASSERT_EQ(messages.size(), 2U);
  EXPECT_EQ(messages[0].number(54, 1), 1U);
  EXPECT_EQ(messages[1].number(54, 1), 0U);
  // Tables 3.5-78 and on: header 169 bits and the mask of cells, 36 a satellite, 80 a cell.
  EXPECT_EQ(messages[0].size(), 169U + 64 + 16 * 36 + 64 * 80);
  EXPECT_EQ(messages[1].size(), 169U + 16 + 4 * 36 + 16 * 80);
}

TEST(Rtcm, RangesThatCannotBeToldAreLeftOut) {
  simulation::Epoch epoch;
  epoch.observed.time = epoch.observed.receiver_time = test::sample_time();
  for (const char* id : {"G05", "G07"}) {
    epoch.observed.satellites.push_back(test::sample_satellite(id, 0, 45, propagation::Visibility::LOS));
  }
  epoch.observed.satellites[0].measurement->pseudorange_m = -1e6;
  epoch.observed.satellites[1].measurement->pseudorange_m = 0.2541 * 299'792'458.0;
  rtcm::Observations observations({});
  EXPECT_TRUE(observations.messages(epoch.observed).empty());
}

}  // namespace
}  // namespace canyon::encoding
