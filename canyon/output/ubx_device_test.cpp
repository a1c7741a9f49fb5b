// The device of formats ubx and ubx_m8: what it sends of an epoch, and what it answers. Fields are read at
// the offsets of UBX-22008968 (F9 HPG 1.32) and UBX-13003221 (M8); gpsd and RTKLIB judge whole files in
// tests/integration/ubx_files_test.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>

#include "canyon/output/formats.hpp"
#include "canyon/output/ubx/configuration.hpp"
#include "canyon/output/ubx/frame.hpp"
#include "tests/support/sample_signals.hpp"

namespace canyon::output {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using ubx::MessageId;
using ubx::Payload;

constexpr MessageId kAck = 0x0501, kNak = 0x0500;

struct Message {
  MessageId id = 0;
  std::string payload;

  [[nodiscard]] std::uint64_t u(std::size_t offset, std::size_t size) const {
    return ubx::number_at(payload, offset, size);
  }
  [[nodiscard]] std::int64_t i4(std::size_t offset) const { return static_cast<std::int32_t>(u(offset, 4)); }
  friend bool operator==(const Message&, const Message&) = default;
};

std::vector<Message> split_frames(const std::string& bytes) {
  std::vector<Message> messages;
  std::size_t framed = 0;
  ubx::Parser parser;
  // Longer payloads than commands have: by their length.
  for (std::string_view rest = bytes; rest.size() >= 8;) {
    const std::size_t length = ubx::number_at(rest, 4, 2);
    const auto id = static_cast<MessageId>(ubx::number_at(rest, 2, 1) << 8 | ubx::number_at(rest, 3, 1));
    messages.push_back({id, std::string(rest.substr(6, length))});
    EXPECT_EQ(ubx::frame(id, messages.back().payload), rest.substr(0, length + 8));
    framed += length + 8;
    rest.remove_prefix(length + 8);
  }
  EXPECT_EQ(framed, bytes.size());
  return messages;
}

std::vector<MessageId> ids(const std::vector<Message>& messages) {
  std::vector<MessageId> found;
  for (const Message& message : messages) found.push_back(message.id);
  return found;
}

class Device {
 public:
  explicit Device(std::unique_ptr<Encoder> (*make)(const ReceiverDescription&), double interval_s = 0.1) {
    ReceiverDescription receiver{"rover"};
    receiver.interval_s = interval_s;
    receiver.begin = test::sample_time();
    receiver.systems = {gnss::System::GPS, gnss::System::Galileo};
    receiver.glonass_channels = {{*gnss::parse_satellite("R01"), 1}, {*gnss::parse_satellite("R24"), -7}};
    encoder_ = make(receiver);
  }
  std::vector<Message> encode(const simulation::Epoch& epoch) {
    return split_frames(encoder_->encode(epoch));
  }
  std::vector<Message> hear(const std::string& bytes) { return split_frames(encoder_->hear(0, bytes)); }
  std::vector<Message> send(MessageId id, const std::string& payload = {}) {
    return hear(ubx::frame(id, payload));
  }
  /// Sends a CFG message; whether it was acknowledged, by exactly that, behind `answers` other messages.
  bool accepts(MessageId id, const std::string& payload, std::size_t answers = 0) {
    const auto reply = send(id, payload);
    EXPECT_EQ(reply.size(), answers + 1) << std::hex << id;
    if (reply.empty()) return false;
    EXPECT_EQ(reply.back().u(0, 2), static_cast<std::uint64_t>((id & 0xFF) << 8 | id >> 8)) << std::hex << id;
    return reply.back().id == kAck;
  }
  std::optional<int> take_baud() { return encoder_->take_baud(); }
  /// How often each message comes in `count` epochs of the device's interval.
  std::map<MessageId, int> counts(int count, double interval_s = 0.1) {
    std::map<MessageId, int> found;
    for (int i = 0; i < count; ++i) {
      for (const Message& m : encode(test::sample_signal_epoch(test::sample_time() + interval_s * ++epochs_,
                                                               test::sample_time()))) {
        ++found[m.id];
      }
    }
    return found;
  }

 private:
  std::unique_ptr<Encoder> encoder_;
  int epochs_ = -1;
};

const Message& find(const std::vector<Message>& messages, MessageId id) {
  static const Message none;
  for (const Message& message : messages) {
    if (message.id == id) return message;
  }
  ADD_FAILURE() << "no message " << std::hex << id;
  return none;
}

simulation::Epoch epoch() {
  simulation::Epoch e = test::sample_signal_epoch(test::sample_time() + 0.125, test::sample_time());
  e.observed.fix.velocity_covariance_enu = Eigen::Vector3d(0.01, 0.04, 0.09).asDiagonal();
  return e;
}

TEST(UbxDevice, SendsTheMessagesOfItsGeneration) {
  EXPECT_THAT(
      ids(Device(encode_ubx).encode(epoch())),
      ElementsAre(0x0107, 0x0103, 0x0104, 0x0120, 0x0136, 0x0135, 0x0143, 0x0161, 0x0215, 0x0A38, 0x2709));
  EXPECT_THAT(ids(Device(encode_ubx_m8).encode(epoch())),
              ElementsAre(0x0107, 0x0103, 0x0104, 0x0120, 0x0135, 0x0161, 0x0215, 0x0A09));
}

TEST(UbxDevice, TellsTheFix) {
  const auto e = epoch();
  const auto messages = Device(encode_ubx).encode(e);
  const Message& pvt = find(messages, 0x0107);
  ASSERT_EQ(pvt.payload.size(), 92U);
  EXPECT_EQ(pvt.u(0, 4), 46701125U);
  EXPECT_EQ(pvt.u(4, 2), 2019U);
  EXPECT_EQ(pvt.u(6, 1), 4U);
  EXPECT_EQ(pvt.u(7, 1), 28U);
  EXPECT_EQ(pvt.u(8, 1), 12U);
  EXPECT_EQ(pvt.u(9, 1), 58U);
  EXPECT_EQ(pvt.u(10, 1), 3U);  // 18 leap seconds
  EXPECT_EQ(pvt.u(11, 1) & 7, 7U);
  EXPECT_EQ(pvt.i4(16), 125'000'000);
  EXPECT_EQ(pvt.u(20, 1), 3U);
  EXPECT_EQ(pvt.u(21, 1) & 1, 1U);
  EXPECT_EQ(pvt.u(23, 1), e.observed.fix.used.size());
  EXPECT_NEAR(static_cast<double>(pvt.i4(24)) * 1e-7, geodesy::degrees(e.observed.fix.position.longitude_rad),
              0.5e-7);
  EXPECT_NEAR(static_cast<double>(pvt.i4(28)) * 1e-7, geodesy::degrees(e.observed.fix.position.latitude_rad),
              0.5e-7);
  EXPECT_NEAR(static_cast<double>(pvt.i4(32)) * 1e-3, e.observed.fix.position.height_m, 0.5e-3);
  // Variances 4, 2.25 and 9 m^2 east, north and up.
  EXPECT_EQ(pvt.u(40, 4), 2500U);
  EXPECT_EQ(pvt.u(44, 4), 3000U);
  EXPECT_EQ(pvt.i4(48), -4200);
  EXPECT_EQ(pvt.i4(52), 3100);
  EXPECT_EQ(pvt.i4(56), -400);
  EXPECT_NEAR(static_cast<double>(pvt.i4(60)), 5220.2, 0.5);  // hypot(3.1, 4.2)
  EXPECT_NEAR(static_cast<double>(pvt.i4(64)) * 1e-5, 143.569, 1e-3);
  EXPECT_NEAR(static_cast<double>(pvt.u(68, 4)), 1e3 * std::sqrt(0.14), 0.5);
  EXPECT_EQ(pvt.u(76, 2), 210U);

  const Message& dop = find(messages, 0x0104);
  ASSERT_EQ(dop.payload.size(), 18U);
  EXPECT_EQ(dop.u(4, 2), 250U);
  EXPECT_EQ(dop.u(6, 2), 210U);
  EXPECT_EQ(dop.u(8, 2), 136U);
  EXPECT_EQ(dop.u(10, 2), 169U);
  EXPECT_EQ(dop.u(12, 2), 125U);
  EXPECT_EQ(dop.u(14, 2), 75U);   // 1.25 of 1.5 / 2.5
  EXPECT_EQ(dop.u(16, 2), 100U);  // and 2 / 2.5

  const Message& cov = find(messages, 0x0136);
  ASSERT_EQ(cov.payload.size(), 64U);
  const auto r4 = [&](std::size_t offset) {
    return std::bit_cast<float>(static_cast<std::uint32_t>(cov.u(offset, 4)));
  };
  EXPECT_EQ(r4(16), 2.25F);
  EXPECT_EQ(r4(20), 1.5F);
  EXPECT_EQ(r4(24), -0.1F);
  EXPECT_EQ(r4(28), 4.0F);
  EXPECT_EQ(r4(32), -0.2F);
  EXPECT_EQ(r4(36), 9.0F);
  EXPECT_EQ(r4(40), 0.04F);

  const Message& status = find(messages, 0x0103);
  EXPECT_EQ(status.u(4, 1), 3U);
  EXPECT_EQ(status.u(5, 1), 0b1101U);
  const Message& time = find(messages, 0x0120);
  EXPECT_EQ(time.u(8, 2), 2051U);
  EXPECT_EQ(time.u(10, 1), 18U);
  EXPECT_EQ(time.u(11, 1), 7U);
}

TEST(UbxDevice, HasNoPositionWithoutAFix) {
  Device device(encode_ubx);
  (void)device.encode(epoch());
  const auto messages =
      device.encode(test::sample_epoch(test::sample_time() + 1, test::sample_place(), {0, 0, 0}, false));
  const Message& pvt = find(messages, 0x0107);
  EXPECT_EQ(pvt.u(20, 1), 0U);
  EXPECT_EQ(pvt.u(21, 1), 0U);
  EXPECT_EQ(pvt.u(23, 1), 0U);
  EXPECT_EQ(pvt.u(24, 8), 0U);
  EXPECT_EQ(pvt.u(32, 8), 0U);
  EXPECT_EQ(pvt.u(40, 4), 0xFFFFFFFFU);
  EXPECT_EQ(pvt.u(76, 2), 9999U);
  EXPECT_EQ(pvt.u(11, 1) & 7, 7U) << "the time goes on";
  EXPECT_EQ(find(messages, 0x0103).u(4, 2), 0b1100U << 8);
  EXPECT_EQ(find(messages, 0x0136).u(5, 1), 0U);

  Device never(encode_ubx);
  const auto first =
      never.encode(test::sample_epoch(test::sample_time(), test::sample_place(), {0, 0, 0}, false));
  EXPECT_EQ(find(first, 0x0107).u(11, 1), 0U) << "nor a time before the first fix";
}

TEST(UbxDevice, TellsSatellitesAndRawMeasurements) {
  const auto e = epoch();
  Device device(encode_ubx);
  const auto messages = device.encode(e);
  const Message& sat = find(messages, 0x0135);
  ASSERT_EQ(sat.payload.size(), 8U + 12 * e.observed.satellites.size());
  // G05: 60.2 deg, 45.5 deg, 46.3 dB-Hz, residual 0.5 m, used, code and carrier locked.
  EXPECT_EQ(sat.u(8, 1), 0U);
  EXPECT_EQ(sat.u(9, 1), 5U);
  EXPECT_EQ(sat.u(10, 1), 46U);
  EXPECT_EQ(sat.u(11, 1), 60U);
  EXPECT_EQ(sat.u(12, 2), 46U);
  EXPECT_EQ(sat.u(14, 2), 5U);
  EXPECT_EQ(sat.u(16, 4) & 0xF, 0b1111U);
  EXPECT_EQ(sat.u(8 + 12 + 4, 2), 0U) << "359.7 deg";
  EXPECT_EQ(sat.u(8 + 4 * 12 + 8, 4), 1U) << "G31 is searched for";

  const Message& raw = find(messages, 0x0215);
  const std::size_t measured =
      static_cast<std::size_t>(std::count_if(e.observed.satellites.begin(), e.observed.satellites.end(),
                                             [](const auto& s) { return s.measurement.has_value(); }));
  ASSERT_EQ(raw.payload.size(), 16 + 32 * measured);
  const auto r8 = [&](std::size_t offset) { return std::bit_cast<double>(raw.u(offset, 8)); };
  // The clock's reading, 123457 ns ahead, rounded to 100 ns; the range moves by c times the rounding.
  EXPECT_NEAR(r8(0), 46701.125 + 123.5e-6, 1e-11);
  EXPECT_EQ(raw.u(8, 2), 2051U);
  EXPECT_EQ(raw.u(10, 1), 18U);
  EXPECT_EQ(raw.u(11, 1), measured);
  EXPECT_EQ(raw.u(13, 1), 1U);
  EXPECT_NEAR(r8(16), e.observed.satellites[0].measurement->pseudorange_m + 299792458.0 * 43e-9, 1e-6);
  EXPECT_EQ(raw.u(16 + 24, 2), 0U) << "its first phase";
  EXPECT_EQ(raw.u(16 + 26, 1), 46U);
  EXPECT_EQ(raw.u(16 + 28, 1), 3U);  // 0.01 cycles in steps of 0.004
  EXPECT_EQ(raw.u(16 + 30, 1), 7U);
  EXPECT_EQ(raw.u(16 + 32 + 30, 1), 1U) << "G12 has no phase";
  // The time of lock counts from the first phase on, and anew behind a slip.
  auto later = e;
  later.observed.time = e.observed.time + 0.5;
  later.observed.receiver_time = e.observed.receiver_time + 0.5;
  EXPECT_EQ(find(device.encode(later), 0x0215).u(16 + 24, 2), 500U);
  later.observed.time = e.observed.time + 1;
  later.observed.satellites[0].measurement->phase_since = e.observed.time + 0.9;
  EXPECT_EQ(find(device.encode(later), 0x0215).u(16 + 24, 2), 0U);
  // R24 has channel -7.
  const std::size_t r24 = 16 + 32 * 4;
  EXPECT_EQ(raw.u(r24 + 20, 2), 24U << 8 | 6U);
  EXPECT_EQ(raw.u(r24 + 23, 1), 0U);
}

TEST(UbxDevice, TellsJammingAndSpoofing) {
  Device f9(encode_ubx), m8(encode_ubx_m8);
  auto e = epoch();
  EXPECT_EQ(find(f9.encode(e), 0x0A38).u(5, 1), 0U) << "not known";
  e.observed.time = e.observed.time + 1;
  e.observed.bands = {{1575.42e6, 3, 3}, {1176.45e6, 0, 0}};
  e.observed.spoofing = receiver::SpoofingState::Indicated;
  const auto messages = f9.encode(e);
  const Message& rf = find(messages, 0x0A38);
  ASSERT_EQ(rf.payload.size(), 4U + 2 * 24);
  EXPECT_EQ(rf.u(1, 1), 2U);
  EXPECT_EQ(rf.u(5, 1), 2U) << "seen, the fix goes on";
  EXPECT_EQ(rf.u(16, 2), 180U);   // 90 times the root of 1 + 3
  EXPECT_EQ(rf.u(18, 2), 4096U);  // half the gain
  EXPECT_EQ(rf.u(20, 1), 51U);    // 6.02 of 30 dB
  EXPECT_EQ(rf.u(4 + 24 + 1, 1), 1U);
  EXPECT_EQ(rf.u(4 + 24 + 14, 2), 8191U);
  EXPECT_EQ(find(messages, 0x0103).u(7, 1), 2U << 3);
  EXPECT_EQ(find(messages, 0x2709).u(4, 1), 1U | 2U << 1);
  EXPECT_EQ(find(messages, 0x2709).u(8, 1), 1U | 2U << 1);
  const Message hardware = find(m8.encode(e), 0x0A09);
  ASSERT_EQ(hardware.payload.size(), 60U);
  EXPECT_EQ(hardware.u(16, 2), 180U);
  EXPECT_EQ(hardware.u(18, 2), 4096U);
  EXPECT_EQ(hardware.u(22, 1) >> 2 & 3, 2U);
  EXPECT_EQ(hardware.u(45, 1), 51U);
  // Without the monitor nothing is said.
  EXPECT_TRUE(f9.accepts(0x068A, Payload().u1(0).u1(1).u2(0).u4(ubx::kJammingMonitor).u1(0).bytes()));
  e.observed.time = e.observed.time + 1;
  EXPECT_EQ(find(f9.encode(e), 0x0A38).u(5, 1), 0U);
}

std::string values(int layers, std::initializer_list<std::pair<std::uint32_t, std::uint64_t>> pairs) {
  Payload p;
  p.u1(0).u1(static_cast<std::uint64_t>(layers)).u2(0);
  for (const auto& [key, value] : pairs) {
    p.u4(key);
    for (int i = 0; i < ubx::value_size(key); ++i) p.u1(value >> (8 * i) & 0xFF);
  }
  return p.bytes();
}

// What PX4's driver sends to a receiver that takes CFG-VALSET, in its order.
TEST(UbxDevice, IsConfiguredByPx4AsAnF9) {
  Device device(encode_ubx);
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
  // Ten seconds of epochs at 10 Hz: solutions at the 5 Hz that it asked for, satellites at every tenth.
  auto counts = device.counts(100);
  EXPECT_EQ(counts[0x0107], 50);
  EXPECT_EQ(counts[0x0114], 50);
  EXPECT_EQ(counts[0x0104], 50);
  EXPECT_EQ(counts[0x0A38], 50);
  EXPECT_EQ(counts[0x0135], 5);
  EXPECT_EQ(counts[0x013C] + counts[0x0232], 0);
}

// To one that does not.
TEST(UbxDevice, IsConfiguredByPx4AsAnM8) {
  Device device(encode_ubx_m8);
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

// What ArduPilot's driver sends: first its commands at each rate, then a walk over what it finds set
// otherwise than it wants, by polls.
TEST(UbxDevice, IsConfiguredByArduPilot) {
  for (const bool f9 : {true, false}) {
    Device device(f9 ? encode_ubx : encode_ubx_m8);
    const auto first = device.hear(ubx::frame(0x0601, Payload().u1(1).u1(6).u1(1).bytes()) +
                                   "$PUBX,41,1,0023,0001,230400,0*1E\r\n");
    EXPECT_THAT(ids(first), ElementsAre(f9 ? kNak : kAck)) << "an F9 has no NAV-SOL";
    EXPECT_EQ(device.take_baud(), 230400);
    const auto port = device.send(0x0600);
    ASSERT_THAT(ids(port), ElementsAre(0x0600, kAck));
    EXPECT_EQ(port[0].u(0, 1), 1U);
    EXPECT_EQ(port[0].u(8, 4), 230400U);
    EXPECT_EQ(port[0].u(12, 4), 0x00010023U);
    // Six rates, of which it reads that of the port.
    const auto poll = [&](MessageId id) {
      return device.send(0x0601, Payload().u1(id >> 8).u1(id & 0xFF).bytes());
    };
    for (const MessageId id : {0x0107, 0x0120, 0x0102, 0x0103, 0x0112, 0x0104, 0x0A09, 0x0A0B, 0x0215}) {
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
    // Settings come back as they were, but for what it changes.
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
    engine[12] = 9;  // an elevation that the mask does not name
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
      (void)device.encode(epoch());
      const auto info = device.send(0x0130);
      ASSERT_THAT(ids(info), ElementsAre(0x0130));
      EXPECT_EQ(info[0].u(5, 1) & 7, 4U) << "u-blox 8";
    }
    EXPECT_TRUE(device.accepts(0x0609, Payload().u4(0).u4(0x1F1F).u4(0).u1(0x17).bytes()));
  }
}

TEST(UbxDevice, RefusesWhatItCannotDo) {
  Device device(encode_ubx);
  EXPECT_FALSE(device.accepts(0x0601, Payload().u1(0x77).u1(1).u1(1).bytes()));
  EXPECT_FALSE(device.accepts(0x0601, "x"));
  EXPECT_FALSE(device.accepts(0x0608, Payload().u2(0).u2(1).u2(0).bytes()));
  EXPECT_FALSE(device.accepts(0x0677, ""));
  EXPECT_FALSE(device.accepts(0x068A, values(1, {{0x209102be, 1}}))) << "RTCM";
  EXPECT_TRUE(device.accepts(0x068A, values(1, {{0x209102be, 0}})));
  // All or nothing.
  EXPECT_FALSE(device.accepts(0x068A, values(1, {{0x30210001, 500}, {0x20990001, 1}})));
  EXPECT_EQ(device.send(0x0608)[0].u(0, 2), 100U);
  EXPECT_FALSE(device.accepts(0x068A, values(1, {{0x30210001, 500}}).substr(0, 9))) << "half a value";
  EXPECT_FALSE(device.accepts(0x068A, values(1, {{0x20030001, 1}}))) << "no base station";
  // Messages that are none of CFG have no acknowledgement.
  EXPECT_THAT(device.send(0x0130), IsEmpty());
  EXPECT_THAT(device.send(0x7777), IsEmpty());
}

TEST(UbxDevice, KeepsWhatIsSavedOverARestart) {
  Device device(encode_ubx);
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
}

TEST(UbxDevice, ListsItsKeysInPieces) {
  Device device(encode_ubx);
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
  Device device(encode_ubx);
  EXPECT_TRUE(device.accepts(0x0608, Payload().u2(25).u2(1).u2(0).bytes()));
  EXPECT_EQ(device.counts(50)[0x0107], 50);
  EXPECT_TRUE(device.accepts(0x0608, Payload().u2(143).u2(1).u2(0).bytes()));
  EXPECT_NEAR(device.counts(100)[0x0107], 70, 1);
}

TEST(UbxDevice, SpeaksNmeaWhereItIsAsked) {
  ReceiverDescription receiver{"rover"};
  const auto device = encode_ubx(receiver);
  (void)device->hear(0, ubx::frame(0x0601, Payload().u1(0xF0).u1(0).u1(1).bytes()) +
                            ubx::frame(0x068A, values(1, {{ubx::kOutputUbx, 0}})));
  const std::string text = device->encode(epoch());
  EXPECT_THAT(text, testing::StartsWith("$GNGGA,125803.125,"));
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1);
}

TEST(UbxDevice, TellsItsReadersApart) {
  const auto device = encode_ubx({"rover"});
  const std::string poll = ubx::frame(0x0A04, "");
  for (std::uint64_t reader = 0; reader < 1000; ++reader)
    EXPECT_EQ(device->hear(reader, poll.substr(0, 5)), "");
  EXPECT_EQ(device->hear(5000, poll.substr(5)), "");
  EXPECT_NE(device->hear(999, poll.substr(5)), "");
  // A flood of polls in one piece is answered as far as a buffer goes.
  std::string flood;
  for (int i = 0; i < 10'000; ++i) flood += poll;
  EXPECT_LT(device->hear(1, flood).size(), std::size_t{100} << 10);
}

}  // namespace
}  // namespace canyon::output
