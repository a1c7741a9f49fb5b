// Responses of the device of format ubx to the initial commands of flight controllers' drivers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/ubx_device.hpp"

namespace canyon::encoding {
namespace {

using test::find;
using test::ids;
using test::kAck;
using test::kNak;
using test::ubx_epoch;
using test::values;
using testing::ElementsAre;
using testing::IsEmpty;
using ubx::Generation;
using ubx::MessageId;
using Device = test::UbxDevice;

// Commands of PX4's driver to a receiver with CFG-VALSET, in the driver's order.
TEST(UbxDevice, IsConfiguredByPx4AsAnF9) {
  Device device;
  EXPECT_TRUE(device.accepts(0x068A, values(1, {{0x20520002, 1},
                                                {0x20520003, 0},
                                                {0x20520004, 0},
                                                {0x10730001, 1},
                                                {0x10730002, 0},
                                                {0x10740001, 1},
                                                {0x10740002, 0}})));
  EXPECT_TRUE(device.accepts(0x068A, values(1, {{0x40520001, 115200}})));
  EXPECT_EQ(device.take_baud(), 115200);
  EXPECT_EQ(device.take_baud(), std::nullopt);
  const auto version = device.send(0x0A04);
  ASSERT_THAT(ids(version), ElementsAre(0x0A04));
  EXPECT_EQ(version[0].payload.substr(30, 8), "00190000");
  EXPECT_EQ(version[0].payload.size() % 30, 10U);
  EXPECT_NE(version[0].payload.find("MOD=ZED-F9P"), std::string::npos);
  EXPECT_TRUE(device.accepts(0x068A, values(1, {{0x10730004, 1},
                                                {0x10770001, 1},
                                                {0x10770004, 1},
                                                {0x10770002, 0},
                                                {0x10780001, 1},
                                                {0x10780002, 0}})));
  EXPECT_TRUE(device.accepts(0x068A, values(1, {{0x20110011, 3},
                                                {0x2011001c, 3},
                                                {0x20110021, 7},
                                                {0x10220001, 0},
                                                {0x10220002, 0},
                                                {0x10220003, 0},
                                                {0x10220004, 0},
                                                {0x30210001, 200},
                                                {0x30210002, 1},
                                                {0x20210003, 0}})));
  EXPECT_TRUE(device.accepts(0x068A, values(1, {{0x20140011, 3}})));
  EXPECT_TRUE(device.accepts(0x068A, values(1, {{0x1041000d, 1}})));
  EXPECT_TRUE(device.accepts(0x068A, values(1, {{0x1031001f, 1},
                                                {0x10310024, 1},
                                                {0x10310003, 1},
                                                {0x10310021, 1},
                                                {0x1031000a, 1},
                                                {0x10310022, 1},
                                                {0x1031000e, 1},
                                                {0x10310025, 1}})));
  EXPECT_TRUE(device.accepts(0x068A, values(1, {{0x10310020, 1}, {0x10310005, 1}})));
  // Rates on UART1 and USB: PVT, HPPOSLLH, RELPOSNED, DOP, SAT, STATUS, MON-RF, RXM-RTCM.
  EXPECT_TRUE(device.accepts(0x068A, values(1, {{0x20910007, 1},
                                                {0x20910009, 1},
                                                {0x20910034, 1},
                                                {0x20910036, 1},
                                                {0x2091008e, 0},
                                                {0x20910090, 0},
                                                {0x20910039, 1},
                                                {0x2091003b, 1},
                                                {0x20910016, 10},
                                                {0x20910018, 10},
                                                {0x2091001b, 1},
                                                {0x2091001d, 1},
                                                {0x2091035a, 1},
                                                {0x2091035c, 1},
                                                {0x20910269, 1},
                                                {0x2091026b, 1}})));
  EXPECT_TRUE(device.accepts(0x068A, values(1, {{0x10710001, 0},
                                                {0x10710002, 0},
                                                {0x10710004, 0},
                                                {0x10720001, 0},
                                                {0x10720002, 0},
                                                {0x10720004, 0}})));
  // Ten seconds of epochs at 10 Hz: solutions at the requested 5 Hz, satellites at every tenth.
  auto counts = device.counts(100);
  EXPECT_EQ(counts[0x0107], 50);
  EXPECT_EQ(counts[0x0114], 50);
  EXPECT_EQ(counts[0x0104], 50);
  EXPECT_EQ(counts[0x0A38], 50);
  EXPECT_EQ(counts[0x0135], 5);
  EXPECT_EQ(counts[0x013C] + counts[0x0232], 0);
}

// To a receiver without CFG-VALSET.
TEST(UbxDevice, IsConfiguredByPx4AsAnM8) {
  Device device(Generation::M8);
  EXPECT_FALSE(device.accepts(0x068A, values(1, {{0x10730001, 1}})));
  const auto port = [](std::uint64_t id, std::uint64_t baud) {
    return Payload().u1(id).u1(0).u2(0).u4(0x8D0).u4(baud).u2(1).u2(1).u2(0).u2(0).bytes();
  };
  EXPECT_TRUE(device.accepts(0x0600, port(1, 9600) + port(3, 9600)));
  EXPECT_EQ(device.take_baud(), std::nullopt);
  EXPECT_TRUE(device.accepts(0x0600, port(1, 115200) + port(3, 115200)));
  EXPECT_EQ(device.take_baud(), 115200);
  const auto version = device.send(0x0A04);
  ASSERT_THAT(ids(version), ElementsAre(0x0A04));
  EXPECT_EQ(version[0].payload.substr(30, 8), "00080000");
  EXPECT_TRUE(device.accepts(0x0608, Payload().u2(200).u2(1).u2(0).bytes()));
  EXPECT_TRUE(device.accepts(0x0624, Payload().u2(5).u1(7).u1(3).zeros(32).bytes()));
  Payload systems;
  systems.u1(0).u1(0).u1(0xFF).u1(7);
  for (int i = 0; i < 7; ++i) systems.u1(static_cast<std::uint64_t>(i)).u1(8).u1(16).u1(0).u4(0x10001);
  EXPECT_TRUE(device.accepts(0x063E, systems.bytes()));
  const auto rate = [&](MessageId id, int every) {
    return device.accepts(0x0601,
                          Payload().u1(id >> 8).u1(id & 0xFF).u1(static_cast<std::uint64_t>(every)).bytes());
  };
  EXPECT_TRUE(rate(0x0107, 1));
  EXPECT_TRUE(rate(0x0103, 1));
  EXPECT_TRUE(rate(0x0104, 1));
  EXPECT_TRUE(rate(0x0130, 5));
  EXPECT_TRUE(rate(0x0A09, 1));
  auto counts = device.counts(100);
  EXPECT_EQ(counts[0x0107], 50);
  EXPECT_EQ(counts[0x0103], 50);
  EXPECT_EQ(counts[0x0130], 10);
  EXPECT_EQ(counts[0x0A09], 50);
}

// Commands of ArduPilot's driver: first its commands at each rate, then polls of settings and corrections of
// those that differ.
TEST(UbxDevice, IsConfiguredByArduPilot) {
  for (const bool f9 : {true, false}) {
    Device device(f9 ? Generation::F9 : Generation::M8);
    const auto first = device.receive(ubx::frame(0x0601, Payload().u1(1).u1(6).u1(1).bytes()) +
                                      "$PUBX,41,1,0023,0001,230400,0*1E\r\n");
    EXPECT_THAT(ids(first), ElementsAre(f9 ? kNak : kAck)) << "an F9 has no NAV-SOL";
    EXPECT_EQ(device.take_baud(), 230400);
    const auto port = device.send(0x0600);
    ASSERT_THAT(ids(port), ElementsAre(0x0600, kAck));
    EXPECT_EQ(port[0].u(0, 1), 1U);
    EXPECT_EQ(port[0].u(8, 4), 230400U);
    EXPECT_EQ(port[0].u(12, 4), 0x00010023U);
    // Six rates; the driver reads the port's rate.
    const auto poll = [&](MessageId id) {
      return device.send(0x0601, Payload().u1(id >> 8).u1(id & 0xFF).bytes());
    };
    for (const MessageId id :
         {0x0107, 0x0120, 0x0102, 0x0103, 0x0112, 0x0104, 0x0A09, 0x0A0B, 0x0215, 0x0D03}) {
      const auto reply = poll(id);
      ASSERT_THAT(ids(reply), ElementsAre(0x0601, kAck)) << std::hex << id;
      EXPECT_EQ(reply[0].payload.size(), 8U);
    }
    EXPECT_THAT(ids(poll(0x0210)), ElementsAre(kNak)) << "RXM-RAW";
    EXPECT_TRUE(device.accepts(0x0601, Payload().u1(1).u1(0x20).u1(5).bytes()));
    EXPECT_EQ(poll(0x0120)[0].u(3, 1), 5U);
    const auto rates = device.send(0x0608);
    ASSERT_THAT(ids(rates), ElementsAre(0x0608, kAck));
    EXPECT_EQ(rates[0].u(0, 2), 100U);
    EXPECT_TRUE(device.accepts(0x0608, Payload().u2(200).u2(1).u2(0).bytes()));
    EXPECT_EQ(device.send(0x0608)[0].payload, Payload().u2(200).u2(1).u2(0).bytes());
    // Settings are returned unchanged, except for its changes.
    for (const MessageId id : {0x0624, 0x0616, 0x063E}) {
      const auto reply = device.send(id);
      ASSERT_THAT(ids(reply), ElementsAre(id, kAck));
      EXPECT_TRUE(device.accepts(id, reply[0].payload));
      EXPECT_EQ(device.send(id)[0].payload, reply[0].payload);
    }
    std::string engine = device.send(0x0624)[0].payload;
    engine[0] = 1;
    engine[1] = 0;
    engine[2] = 8;   // dynModel: airborne below 4 g
    engine[12] = 9;  // an elevation not selected by the mask
    EXPECT_TRUE(device.accepts(0x0624, engine));
    EXPECT_EQ(device.send(0x0624)[0].u(2, 1), 8U);
    EXPECT_EQ(device.send(0x0624)[0].u(12, 1), 5U);
    if (f9) {
      const auto mode = device.send(0x068B, Payload().u1(0).u1(0).u2(0).u4(0x20030001).bytes());
      ASSERT_THAT(ids(mode), ElementsAre(0x068B, kAck));
      EXPECT_EQ(mode[0].payload, Payload().u1(1).u1(0).u2(0).u4(0x20030001).u1(0).bytes());
      // Several keys at once, to memory and battery.
      EXPECT_TRUE(device.accepts(0x068A, values(3, {{0x1031001f, 1}, {0x10310025, 0}})));
      const auto read =
          device.send(0x068B, Payload().u1(0).u1(1).u2(0).u4(0x1031001f).u4(0x10310025).bytes());
      EXPECT_EQ(find(read, 0x068B).payload,
                Payload().u1(1).u1(1).u2(0).u4(0x1031001f).u1(1).u4(0x10310025).u1(0).bytes());
    } else {
      EXPECT_THAT(device.send(0x0130), IsEmpty()) << "nothing to tell before the first epoch";
      (void)device.encode(ubx_epoch());
      const auto info = device.send(0x0130);
      ASSERT_THAT(ids(info), ElementsAre(0x0130));
      EXPECT_EQ(info[0].u(5, 1) & 7, 4U) << "u-blox 8";
    }
    EXPECT_TRUE(device.accepts(0x0609, Payload().u4(0).u4(0x1F1F).u4(0).u1(0x17).bytes()));
  }
}

TEST(UbxDevice, RefusesWhatItCannotDo) {
  Device device;
  EXPECT_FALSE(device.accepts(0x0601, Payload().u1(0x77).u1(1).u1(1).bytes()));
  EXPECT_FALSE(device.accepts(0x0601, "x"));
  EXPECT_FALSE(device.accepts(0x0608, Payload().u2(0).u2(1).u2(0).bytes()));
  EXPECT_FALSE(device.accepts(0x0677, ""));
  EXPECT_FALSE(device.accepts(0x068A, values(1, {{0x209102ff, 1}}))) << "RTCM 4072.0";
  EXPECT_TRUE(device.accepts(0x068A, values(1, {{0x209102ff, 0}})));
  // All or nothing.
  EXPECT_FALSE(device.accepts(0x068A, values(1, {{0x30210001, 500}, {0x20990001, 1}})));
  EXPECT_EQ(device.send(0x0608)[0].u(0, 2), 100U);
  EXPECT_FALSE(device.accepts(0x068A, values(1, {{0x30210001, 500}}).substr(0, 9))) << "half a value";
  EXPECT_FALSE(device.accepts(0x068A, values(1, {{0x20030001, 1}}))) << "a survey-in";
  EXPECT_FALSE(device.accepts(0x068A, values(1, {{0x20030001, 2}}))) << "a base that may move";
  // Messages other than CFG have no acknowledgement.
  EXPECT_THAT(device.send(0x0130), IsEmpty());
  EXPECT_THAT(device.send(0x7777), IsEmpty());
}

TEST(UbxDevice, KeepsWhatIsSavedOverARestart) {
  Device device;
  EXPECT_TRUE(device.accepts(0x068A, values(1, {{0x30210001, 250}})));
  EXPECT_TRUE(device.accepts(0x068A, values(4, {{0x20910007, 2}})));
  EXPECT_EQ(device.send(0x0608)[0].u(0, 2), 250U);
  EXPECT_THAT(device.send(0x0604, Payload().u2(0).u1(1).u1(0).bytes()), IsEmpty()) << "is not acknowledged";
  EXPECT_EQ(device.send(0x0608)[0].u(0, 2), 100U);
  EXPECT_EQ(device.send(0x0601, Payload().u1(1).u1(7).bytes())[0].u(3, 1), 2U);
  EXPECT_TRUE(device.accepts(0x068C, Payload().u1(0).u1(4).u2(0).u4(0x20910007).bytes()));
  (void)device.send(0x0604, Payload().u2(0).u1(1).u1(0).bytes());
  EXPECT_EQ(device.send(0x0601, Payload().u1(1).u1(7).bytes())[0].u(3, 1), 1U);
  // Controlled stop and start.
  (void)device.send(0x0604, Payload().u2(0).u1(8).u1(0).bytes());
  EXPECT_THAT(device.counts(5), IsEmpty());
  (void)device.send(0x0604, Payload().u2(0).u1(9).u1(0).bytes());
  EXPECT_EQ(device.counts(5)[0x0107], 5);
  // GNSS only: settings are kept.
  EXPECT_TRUE(device.accepts(0x068A, values(1, {{0x30210001, 250}})));
  (void)device.send(0x0604, Payload().u2(0).u1(2).u1(0).bytes());
  EXPECT_EQ(device.send(0x0608)[0].u(0, 2), 250U);
}

// Masks 0, 1 and 0xFFFF are the hot, warm and cold start of UBX-13003221 (CFG-RST).
TEST(UbxDevice, AsksTheReceiverToRestart) {
  using disturbance::RestartKind;
  const auto encoder = encode_ubx(ReceiverDescription{"rover"});
  const auto requested = [&](std::uint64_t forgotten, std::uint64_t mode) {
    EXPECT_EQ(
        encoder->device()->receive(0, ubx::frame(0x0604, Payload().u2(forgotten).u1(mode).u1(0).bytes())),
        "");
    const auto kind = encoder->device()->take_restart();
    EXPECT_FALSE(encoder->device()->take_restart()) << "told once";
    return kind;
  };
  EXPECT_EQ(requested(0, 0), RestartKind::Hot);
  EXPECT_EQ(requested(1, 1), RestartKind::Warm);
  EXPECT_EQ(requested(0xFFFF, 2), RestartKind::Cold);
  EXPECT_EQ(requested(0xFFFF, 8), std::nullopt) << "a controlled stop";
  EXPECT_EQ(requested(0xFFFF, 9), RestartKind::Cold) << "and start";
}

TEST(UbxDevice, ListsItsKeysInPieces) {
  Device device;
  std::set<std::uint32_t> keys;
  for (std::uint64_t position = 0; position < 1000; position += 64) {
    const auto reply = device.send(0x068B, Payload().u1(0).u1(0).u2(position).u4(0x0FFFFFFF).bytes());
    ASSERT_THAT(ids(reply), ElementsAre(0x068B, kAck));
    std::size_t found = 0;
    for (std::size_t at = 4; at < reply[0].payload.size(); ++found) {
      const auto key = static_cast<std::uint32_t>(reply[0].u(at, 4));
      EXPECT_TRUE(keys.insert(key).second) << std::hex << key;
      at += 4 + static_cast<std::size_t>(ubx::value_size(key));
    }
    if (found == 0) break;
    EXPECT_LE(found, 64U);
  }
  EXPECT_GT(keys.size(), 200U);
  EXPECT_EQ(keys.count(ubx::kRateMeasurement), 1U);
}

TEST(UbxDevice, NeverComesFasterThanItsEpochs) {
  Device device;
  EXPECT_TRUE(device.accepts(0x0608, Payload().u2(25).u2(1).u2(0).bytes()));
  EXPECT_EQ(device.counts(50)[0x0107], 50);
  EXPECT_TRUE(device.accepts(0x0608, Payload().u2(143).u2(1).u2(0).bytes()));
  EXPECT_NEAR(device.counts(100)[0x0107], 70, 1);
}

TEST(UbxDevice, SpeaksNmeaWhereItIsAsked) {
  ReceiverDescription receiver{"rover"};
  const auto encoder = encode_ubx(receiver);
  (void)encoder->device()->receive(0, ubx::frame(0x0601, Payload().u1(0xF0).u1(0).u1(1).bytes()) +
                                          ubx::frame(0x068A, values(1, {{ubx::kOutputUbx, 0}})));
  const std::string text = encoder->encode(ubx_epoch());
  EXPECT_THAT(text, testing::StartsWith("$GNGGA,125803.125,"));
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1);
}

// A receiver's settings belong to a port (UBX-22008968, 6.9.14), and each connection is one.
TEST(UbxDevice, AConnectionSetsWhatItAloneGets) {
  const auto encoder = encode_ubx({"rover"});
  auto* const device = encoder->device();
  const std::string before = encoder->encode(ubx_epoch());
  (void)device->receive(1, ubx::frame(0x0601, Payload().u1(1).u1(7).bytes()));
  EXPECT_FALSE(device->encode_for_reader(1)) << "a poll sets nothing";
  EXPECT_EQ(device->take_setup_command(), "");
  (void)device->receive(1, ubx::frame(0x068A, values(1, {{ubx::kOutputUbx, 0}})));
  EXPECT_EQ(device->take_setup_command(), "CFG 0x8A");
  (void)device->receive(1, ubx::frame(0x068A, values(1, {{0x20910007, 0}})));
  EXPECT_EQ(device->take_setup_command(), "") << "told once";
  (void)device->receive(2, ubx::frame(0x0601, Payload().u1(1).u1(7).u1(0).bytes()));
  simulation::Epoch later = ubx_epoch();
  later.observed.time = later.observed.time + 1;
  const auto all = test::split_frames(encoder->encode(later));
  EXPECT_THAT(ids(all), testing::Contains(MessageId{0x0107})) << "for those who set nothing";
  EXPECT_EQ(device->encode_for_reader(1), "");
  const auto second = device->encode_for_reader(2);
  ASSERT_TRUE(second);
  EXPECT_THAT(ids(test::split_frames(*second)), testing::Not(testing::Contains(MessageId{0x0107})));
  EXPECT_EQ(test::split_frames(*second).size(), all.size() - 1);
  EXPECT_FALSE(device->encode_for_reader(3));
}

TEST(UbxDevice, TellsItsReadersApart) {
  const auto encoder = encode_ubx({"rover"});
  auto* const device = encoder->device();
  const std::string poll = ubx::frame(0x0A04, "");
  for (std::uint64_t reader = 0; reader < 1000; ++reader)
    EXPECT_EQ(device->receive(reader, poll.substr(0, 5)), "");
  EXPECT_EQ(device->receive(5000, poll.substr(5)), "");
  EXPECT_NE(device->receive(999, poll.substr(5)), "");
  // A flood of polls in one piece is answered up to the size of a buffer.
  std::string flood;
  for (int i = 0; i < 10'000; ++i) flood += poll;
  EXPECT_LT(device->receive(1, flood).size(), std::size_t{100} << 10);
}

}  // namespace
}  // namespace canyon::encoding
