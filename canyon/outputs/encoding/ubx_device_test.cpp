// The device of format ubx: its messages of an epoch, and its responses. Fields are read at
// the offsets of UBX-22008968 (F9 HPG 1.32) and UBX-13003221 (M8); gpsd and RTKLIB check whole files in
// tests/integration/ubx_files_test.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tuple>

#include "canyon/outputs/encoding/ubx/messages.hpp"
#include "canyon/simulation/sensor_run.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/ubx_device.hpp"

namespace canyon::encoding::ubx_device_test {
namespace {

using test::find;
using test::ids;
using test::kAck;
using test::kNak;
using test::Message;
using test::ubx_epoch;
using testing::Contains;
using testing::ElementsAre;
using testing::Not;
using ubx::Generation;
using ubx::MessageId;
using Device = test::UbxDevice;

TEST(UbxDevice, SendsTheMessagesOfItsGeneration) {
  EXPECT_THAT(ids(Device().encode(ubx_epoch())), ElementsAre(0x0107, 0x0103, 0x0104, 0x0120, 0x0136, 0x0135,
                                                             0x0143, 0x0161, 0x0215, 0x0A38, 0x2709));
  EXPECT_THAT(ids(Device(Generation::M8).encode(ubx_epoch())),
              ElementsAre(0x0107, 0x0103, 0x0104, 0x0120, 0x0135, 0x0161, 0x0215, 0x0A09));
}

// height and hMSL of NAV-PVT, NAV-POSLLH and NAV-HPPOSLLH (followed by tenths of a millimetre).
TEST(UbxDevice, HeightsAreAboveTheEllipsoidAndAboveMeanSeaLevel) {
  auto e = ubx_epoch();
  e.observed.fix.position.height_m = 12.3456;
  e.geoid_undulation_m = 39.625;
  Device device;
  const auto messages = device.encode(e);
  EXPECT_EQ(find(messages, 0x0107).i4(32), 12346);
  EXPECT_EQ(find(messages, 0x0107).i4(36), -27279);
  const auto low = device.send(0x0102), high = device.send(0x0114);
  EXPECT_EQ(find(low, 0x0102).i4(12), 12346);
  EXPECT_EQ(find(low, 0x0102).i4(16), -27279);
  const Message& precise = find(high, 0x0114);
  EXPECT_EQ(precise.i4(16) * 10 + static_cast<std::int8_t>(precise.u(26, 1)), 123456);
  EXPECT_EQ(precise.i4(20) * 10 + static_cast<std::int8_t>(precise.u(27, 1)), -272794);
  e.observed.fix.status = positioning::FixStatus::NoSignal;
  EXPECT_EQ(find(Device().encode(e), 0x0107).i4(36), 0);
}

// A NEO-F9P on a laboratory's simulator reports 0.08 m, 0.004 cycles and 0.064 Hz with the noise given here
// (L1 C/A at 43 and L5 at 47 dB-Hz).
TEST(UbxDevice, StatesDeviationsAsARealReceiver) {
  for (const auto& [code_m, phase_cycles, doppler_hz] :
       {std::tuple(0.142, 0.0052, 0.117), std::tuple(0.053, 0.0033, 0.075)}) {
    auto e = ubx_epoch();
    positioning::Measurement& m = *e.observed.satellites[0].measurement;
    m.sigma_m = code_m;
    m.carrier_phase_sigma_cycles = phase_cycles;
    m.doppler_sigma_hz = doppler_hz;
    const auto messages = Device().encode(e);
    const Message& raw = find(messages, 0x0215);
    EXPECT_EQ(raw.u(16 + 27, 1), 3U);
    EXPECT_EQ(raw.u(16 + 28, 1), 1U);
    EXPECT_EQ(raw.u(16 + 29, 1), 5U);
  }
}

TEST(UbxDevice, TellsTheFix) {
  const auto e = ubx_epoch();
  const auto messages = Device().encode(e);
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
  EXPECT_EQ(cov.r4(16), 2.25F);
  EXPECT_EQ(cov.r4(20), 1.5F);
  EXPECT_EQ(cov.r4(24), -0.1F);
  EXPECT_EQ(cov.r4(28), 4.0F);
  EXPECT_EQ(cov.r4(32), -0.2F);
  EXPECT_EQ(cov.r4(36), 9.0F);
  EXPECT_EQ(cov.r4(40), 0.04F);

  const Message& status = find(messages, 0x0103);
  EXPECT_EQ(status.u(4, 1), 3U);
  EXPECT_EQ(status.u(5, 1), 0b1101U);
  const Message& time = find(messages, 0x0120);
  EXPECT_EQ(time.u(8, 2), 2051U);
  EXPECT_EQ(time.u(10, 1), 18U);
  EXPECT_EQ(time.u(11, 1), 7U);
}

// Fix type 1 is dead reckoning only, valid with gnssFixOK (UBX-22008968 3.15.13, 3.15.18).
TEST(UbxDevice, APredictionIsDeadReckoning) {
  const auto e = test::predicted(ubx_epoch());
  const auto messages = Device().encode(e);
  const Message& pvt = find(messages, 0x0107);
  EXPECT_EQ(pvt.u(20, 1), 1U);
  EXPECT_EQ(pvt.u(21, 1) & 1, 1U);
  EXPECT_EQ(pvt.u(23, 1), 0U);
  EXPECT_NEAR(static_cast<double>(pvt.i4(28)) * 1e-7, geodesy::degrees(e.observed.fix.position.latitude_rad),
              0.5e-7);
  EXPECT_EQ(pvt.u(40, 4), 2500U);
  EXPECT_EQ(pvt.u(76, 2), 9999U);
  EXPECT_EQ(find(messages, 0x0103).u(4, 2), 0b1101U << 8 | 1);
}

positioning::Fusion navigating() {
  positioning::Fusion fusion;
  fusion.phase = positioning::FusionPhase::Navigating;
  fusion.heading_rad = geodesy::radians(123.5);
  fusion.imu_calibrated = true;
  fusion.imu_hz = 100;
  fusion.wheels_hz = 10;
  return fusion;
}

// Fix type 4 is GNSS and dead reckoning combined; headVeh is valid by flag 5 (UBX-22008968 3.15.13).
TEST(UbxDevice, SensorsMakeACombinedFix) {
  auto e = ubx_epoch();
  const auto type = [&] { return find(Device().encode(e), 0x0107).u(20, 1); };
  EXPECT_EQ(type(), 3U);
  e.observed.fix.fusion = positioning::Fusion();  // initialising: the satellites' fix
  EXPECT_EQ(type(), 3U);
  e.observed.fix.fusion = navigating();
  EXPECT_EQ(type(), 4U);
  const Message pvt = find(Device().encode(e), 0x0107);
  EXPECT_EQ(pvt.u(21, 1), 0b100001U);
  EXPECT_EQ(pvt.i4(84), 12'350'000);
  e.observed.fix.solution = positioning::FixKind::Fixed;
  EXPECT_EQ(type(), 4U);
  EXPECT_EQ(find(Device().encode(e), 0x0107).u(21, 1) >> 6, 2U);  // carrier phases, fixed
  e.observed.fix.used.clear();
  EXPECT_EQ(type(), 1U);
}

// ESF-STATUS: only of receivers with dead reckoning.
TEST(UbxDevice, StatesTheFusion) {
  auto e = ubx_epoch();
  EXPECT_THAT(ids(Device().encode(e)), testing::Not(testing::Contains(0x1010)));
  const auto status = [&] { return find(Device(Generation::F9, 0.1, false, true).encode(e), 0x1010); };
  EXPECT_EQ(status().u(12, 1), 3U);  // disabled
  EXPECT_EQ(status().u(15, 1), 0U);
  e.observed.fix.fusion = navigating();
  Message message = status();
  ASSERT_EQ(message.payload.size(), 16U + 8 * 4);
  EXPECT_EQ(message.u(4, 1), 2U);
  EXPECT_EQ(message.u(5, 2), 0b0000'0010'0100'1010U);
  EXPECT_EQ(message.u(12, 1), 1U);
  EXPECT_EQ(message.u(15, 1), 8U);
  EXPECT_EQ(message.u(16, 1), 0xC0U | 5);  // gyroscope about z, used and ready
  EXPECT_EQ(message.u(17, 1) & 3, 2U);     // calibrated
  EXPECT_EQ(message.u(18, 1), 100U);
  EXPECT_EQ(message.u(16 + 6 * 4, 1), 0xC0U | 8);  // ticks of the left rear wheel
  EXPECT_EQ(message.u(17 + 6 * 4, 1) & 3, 1U);     // calibrating
  e.observed.fix.fusion->phase = positioning::FusionPhase::Initialising;
  message = status();
  EXPECT_EQ(message.u(12, 1), 0U);
  EXPECT_EQ(message.u(5, 1), 0b0010'1001U);
}

// ESF-MEAS: samples since the previous epoch, in order; scales of UBX-13003221.
TEST(UbxDevice, SendsTheSamplesOfTheSensors) {
  auto e = ubx_epoch();
  simulation::SensorBatch batch;
  simulation::InertialSample imu;
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  imu.truth.sensor = {none, none, none, Eigen::Matrix3d::Identity()};
  imu.time = e.truth.time;
  imu.sample = inertial::ImuSample{0, {{1.5, -2, 9.75}, {0, 0, geodesy::radians(-10)}}};
  batch.imu = {imu};
  simulation::WheelsAtWork wheels;
  wheels.time = e.truth.time + -0.05;
  wheels.sample.ticks = {70, -3};
  batch.wheels = {wheels};
  e.sensors = &batch;
  EXPECT_THAT(ids(Device().encode(e)), testing::Not(testing::Contains(0x1002)));
  std::vector<Message> samples;
  for (const Message& message : Device(Generation::F9, 0.1, false, true).encode(e))
    if (message.id == 0x1002) samples.push_back(message);
  ASSERT_EQ(samples.size(), 2U);
  EXPECT_EQ(samples[0].u(4, 2) >> 11, 2U);
  EXPECT_EQ(samples[0].u(8, 4), 8U << 24 | 70);
  EXPECT_EQ(samples[0].u(12, 4), 9U << 24 | 1U << 23 | 3);
  ASSERT_EQ(samples[1].payload.size(), 8U + 6 * 4);
  EXPECT_EQ(samples[1].u(4, 2) >> 11, 6U);
  EXPECT_EQ(samples[1].u(16, 4), 5U << 24 | (0x1000000U - 10 * 4096));
  EXPECT_EQ(samples[1].u(20, 4), 16U << 24 | 1536U);
  EXPECT_EQ(samples[1].u(24, 4), 17U << 24 | (0x1000000U - 2048));
  EXPECT_EQ(samples[1].u(28, 4), 18U << 24 | 9984U);
}

// ESF-RAW after a request: ten samples in a message, each value with the time of its sample.
TEST(UbxDevice, SendsRawSamplesOnRequest) {
  auto e = ubx_epoch();
  simulation::SensorBatch batch;
  for (int k = 0; k < 14; ++k) {
    simulation::InertialSample& imu = batch.imu.emplace_back();
    imu.time = e.truth.time + 0.01 * k;
    imu.sample = inertial::ImuSample{0, {{1.5, -2, 9.75}, {0, 0, geodesy::radians(-10)}}};
  }
  batch.imu[3].sample.reset();  // lost
  e.sensors = &batch;
  Device device(Generation::F9, 0.1, false, true);
  EXPECT_THAT(ids(device.encode(e)), testing::Not(testing::Contains(0x1003)));
  EXPECT_TRUE(device.accepts(0x0601, std::string("\x10\x03\x01", 3)));  // CFG-MSG
  std::vector<Message> samples;
  for (const Message& message : device.encode(e))
    if (message.id == 0x1003) samples.push_back(message);
  ASSERT_EQ(samples.size(), 2U);
  ASSERT_EQ(samples[0].payload.size(), 4U + 10 * 6 * 8);
  ASSERT_EQ(samples[1].payload.size(), 4U + 3 * 6 * 8);
  EXPECT_EQ(samples[0].u(0, 4), 0U);
  EXPECT_EQ(samples[0].u(4 + 2 * 8, 4), 5U << 24 | (0x1000000U - 10 * 4096));
  EXPECT_EQ(samples[0].u(4 + 3 * 8, 4), 16U << 24 | 1536U);
  EXPECT_EQ(samples[0].u(4 + 6 * 8 + 4, 4) - samples[0].u(8, 4), 10U);
  EXPECT_EQ(samples[1].u(8, 4) - samples[0].u(8, 4), 110U);
}

// UBX-22008968: NAV-PVT flags and flags3 (3.15.13), NAV-STATUS (3.15.18), NAV-SAT (3.15.16), NAV-SIG
// (3.15.17).
TEST(UbxDevice, SaysWhatTheCorrectionsMadeOfTheFix) {
  const auto expect = [](positioning::FixKind kind, std::uint64_t pvt_flags, std::uint64_t status,
                         std::uint64_t satellite, std::uint64_t signal) {
    const auto e = test::corrected(ubx_epoch(), kind);
    const auto messages = Device().encode(e);
    const Message& pvt = find(messages, 0x0107);
    EXPECT_EQ(pvt.u(20, 1), 3U);
    EXPECT_EQ(pvt.u(21, 1), pvt_flags);
    EXPECT_EQ(pvt.u(78, 2), 2U << 1) << "1 s to 2 s";
    EXPECT_EQ(find(messages, 0x0103).u(4, 4) & 0xC0FFFFFFU, status);
    const Message& satellites = find(messages, 0x0135);
    const Message& signals = find(messages, 0x0143);
    int used = 0;
    for (std::size_t i = 0; i < satellites.u(5, 1); ++i) {
      const std::uint64_t flags = satellites.u(8 + 12 * i + 8, 4);
      const bool is_used = (flags >> 3 & 1) != 0;
      used += is_used ? 1 : 0;
      EXPECT_EQ(flags & 0x007F0040U, is_used ? satellite : 0);
    }
    EXPECT_EQ(used, 9);
    for (std::size_t i = 0; i < signals.u(5, 1); ++i) {
      const bool is_used = (signals.u(8 + 16 * i + 10, 2) >> 3 & 1) != 0;
      EXPECT_EQ(signals.u(8 + 16 * i + 8, 1), is_used && satellite != 0 ? 4U : 0U);
      EXPECT_EQ(signals.u(8 + 16 * i + 10, 2) & 0x1C0U, is_used ? signal : 0);
    }
  };
  using positioning::FixKind;
  constexpr std::uint64_t kCode = 1 << 6 | 1 << 17 | 1 << 20, kPhase = kCode | 1 << 21;
  expect(FixKind::Differential, 3, 0x00010F03, kCode, 1 << 6);
  expect(FixKind::Float, 67, 0x40030F03, kPhase, 3 << 6);
  expect(FixKind::Fixed, 131, 0x80030F03, kPhase, 3 << 6);
}

// A walk with a real F9 and a base (ubx-longmont-20250828) has the same NAV-PVT as Canyon: fix type, flags,
// confirmed times and the age of corrections.
TEST(UbxDevice, SaysOfCorrectionsWhatARealReceiverSays) {
  CANYON_SHARED_DATA(path, "ubx-longmont-20250828/gnss_1730.ubx");
  std::map<std::uint64_t, int> epochs;
  const auto compare = [&](ubx::MessageId id, std::string_view payload) {
    if (id != 0x0107) return;
    const Message real{id, std::string(payload)};
    ++epochs[real.u(21, 1)];
    const auto kind = real.u(21, 1) == 131 ? positioning::FixKind::Fixed : positioning::FixKind::Float;
    const auto messages = Device().encode(test::corrected(ubx_epoch(), kind));
    const Message& ours = find(messages, 0x0107);
    EXPECT_EQ(real.u(20, 2), ours.u(20, 2));
    EXPECT_EQ(real.u(11, 1) & 7, ours.u(11, 1) & 7);
    EXPECT_EQ(real.u(22, 1) & 0xE0, ours.u(22, 1));
    EXPECT_LE(real.u(78, 2), ours.u(78, 2)) << "ages below 2 s: codes 1 and 2";
    EXPECT_GE(real.u(40, 4), 14U) << "10 mm on each axis, float or fixed";
    EXPECT_GE(real.u(44, 4), 10U);
  };
  ubx::UbxParser().receive(test::read_bytes(path), {compare, [](std::string_view) {}});
  EXPECT_EQ(epochs, (std::map<std::uint64_t, int>{{67, 187}, {131, 349}}));
}

/// NAV-RELPOSNED of an epoch; offsets as in UBX-22008968, 3.15.15.
Message relative_position(const simulation::Epoch& epoch) {
  const auto messages = Device(Generation::F9, 0.1, true).encode(epoch);
  const Message& message = find(messages, 0x013C);
  EXPECT_EQ(message.payload.size(), 64U);
  EXPECT_EQ(message.u(0, 1), 1U);
  return message;
}

TEST(UbxDevice, StatesTheVectorBetweenTwoAntennas) {
  const auto e = test::with_baseline(ubx_epoch(), positioning::FixKind::Fixed, true);
  const Message m = relative_position(e);
  const auto i1 = [&](std::size_t offset) {
    return static_cast<int>(static_cast<std::int8_t>(m.u(offset, 1)));
  };
  EXPECT_EQ(m.u(4, 4), 46701125U);
  EXPECT_EQ(m.i4(8), 80);  // 0.80456 m north
  EXPECT_EQ(i1(32), 46);
  EXPECT_EQ(m.i4(12), -60);  // -0.6012 m east
  EXPECT_EQ(i1(33), -12);
  EXPECT_EQ(m.i4(16), 12);  // 0.1234 m down
  EXPECT_EQ(i1(34), 34);
  EXPECT_EQ(m.i4(20) * 100 + i1(35), std::lround(std::hypot(0.80456, 0.6012, 0.1234) * 1e4));
  EXPECT_NEAR(static_cast<double>(m.i4(24)) * 1e-5, 360 - 36.7686, 1e-4);  // atan(0.6012 / 0.80456)
  EXPECT_EQ(m.u(36, 4), 30U);
  EXPECT_EQ(m.u(40, 4), 20U);
  EXPECT_EQ(m.u(44, 4), 50U);
  // Along: 3 mm of 0.80456, 2 mm of 0.6012 and 5 mm of 0.1234, over the length. Across: the axes swapped.
  EXPECT_EQ(m.u(48, 4), std::lround(10 * std::hypot(3 * 0.80456, 2 * 0.6012, 5 * 0.1234) / 1.01193));
  const double level = std::hypot(0.80456, 0.6012);
  EXPECT_NEAR(static_cast<double>(m.u(52, 4)) * 1e-5,
              geodesy::degrees(std::hypot(2e-3 * 0.80456, 3e-3 * 0.6012) / level / level), 1e-5);
  // gnssFixOK, diffSoln, relPosValid, fixed, isMoving, relPosHeadingValid: as required by ArduPilot's driver.
  EXPECT_EQ(m.u(60, 4), 0x137U);

  const auto messages = Device(Generation::F9, 0.1, true).encode(e);
  EXPECT_THAT(ids(messages), ElementsAre(0x0107, 0x0103, 0x0104, 0x0120, 0x0136, 0x0135, 0x0143, 0x013C,
                                         0x0161, 0x0215, 0x0A38, 0x2709));
  EXPECT_EQ(find(messages, 0x0107).u(20, 2), 131U << 8 | 3) << "though the position is single";
  EXPECT_EQ(find(messages, 0x0103).u(4, 4) & 0xC0FFFFFFU, 0x80030F03U);
}

TEST(UbxDevice, StatesTheVectorFromABase) {
  // 50 km away the axes of base and rover differ by half a degree.
  auto e = test::corrected(ubx_epoch(), positioning::FixKind::Float);
  e = test::with_baseline(e, positioning::FixKind::Float, false, {30'000, 40'000, 20});
  const Eigen::Vector3d base = e.observed.fix.baseline->base_ecef;
  const geodesy::LocalFrame frame(geodesy::geodetic_from_ecef(base));
  const Eigen::Vector3d rover = frame.local_from_geodetic(e.observed.fix.position);
  const Message m = relative_position(e);
  EXPECT_EQ(m.u(2, 2), 7U);
  EXPECT_NEAR(static_cast<double>(m.i4(8)), 100 * rover.y(), 1);
  EXPECT_NEAR(static_cast<double>(m.i4(12)), 100 * rover.x(), 1);
  EXPECT_NEAR(static_cast<double>(m.i4(16)), -100 * rover.z(), 1);
  EXPECT_LT(rover.z(), -150);
  EXPECT_EQ(m.u(60, 4), 0x10FU);
  // A heading with a deviation of 20 degrees is not valid.
  e = test::with_baseline(e, positioning::FixKind::Float, false);
  e.observed.fix.baseline->covariance_enu.setIdentity() *= 0.36 * 0.36;
  EXPECT_EQ(relative_position(e).u(60, 4), 0x00FU);
  const Message none = relative_position(ubx_epoch());
  EXPECT_EQ(none.u(60, 4), 1U);
  EXPECT_EQ(none.u(8, 8) + none.u(16, 8) + none.u(24, 8) + none.u(32, 8) + none.u(40, 8) + none.u(48, 8), 0U);
}

// UBX-22008968, 3.17.6: bit 0 of the flags crcFailed, bits 1 and 2 msgUsed (1 not used, 2 used).
TEST(UbxDevice, AcknowledgesRtcm) {
  EXPECT_EQ(ubx::rtcm_payload({1077, false, true, 7}), std::string("\2\4\0\0\7\0\x35\4", 8));
  EXPECT_EQ(ubx::rtcm_payload({1230, true, std::nullopt, std::nullopt}),
            std::string("\2\1\0\0\xFF\xFF\xCE\4", 8));
  EXPECT_EQ(ubx::rtcm_payload({1005, false, false, 4095}), std::string("\2\2\0\0\xFF\x0F\xED\3", 8));
}

// RXM-COR of RTCM 3: protocol 1, bit 5 error-free (bit 6 erroneous), bits 7 and 8 as above, the station in
// bits 9 to 24, bit 25 the type is there, bit 28 in clear.
TEST(UbxDevice, AcknowledgesCorrections) {
  const auto reported = [](const ubx::ReceivedRtcm& received) {
    return Message{0x0234, ubx::correction_payload(received)};
  };
  const Message used = reported({1077, false, true, 7});
  ASSERT_EQ(used.payload.size(), 12U);
  EXPECT_EQ(used.u(0, 1), 1U);
  EXPECT_EQ(used.u(4, 4), 1U | 1U << 5 | 2U << 7 | 7U << 9 | 1U << 25 | 1U << 28);
  EXPECT_EQ(used.u(8, 2), 1077U);
  EXPECT_EQ(reported({0, true, std::nullopt, std::nullopt}).u(4, 4), 1U | 2U << 5 | 0xFFFFU << 9 | 1U << 28);
}

// The last leap second was inserted at the end of 2016-12-31, a Saturday, day 7 of week 1929.
TEST(UbxDevice, TellsTheLeapSecond) {
  Device device;
  const auto e = ubx_epoch();
  (void)device.encode(e);
  const auto answers = device.send(0x0126);
  const Message& m = find(answers, 0x0126);
  ASSERT_EQ(m.payload.size(), 24U);
  EXPECT_EQ(m.u(8, 1), 2U) << "GPS states it";
  EXPECT_EQ(m.u(9, 1), 18U);
  EXPECT_EQ(m.u(11, 1), 0U);
  const auto utc = geodesy::gps_from_utc({2017, 1, 1});
  EXPECT_EQ(m.i4(12), static_cast<std::int64_t>(std::floor(utc - e.observed.time)));
  EXPECT_EQ(m.u(16, 2), 1929U);
  EXPECT_EQ(m.u(18, 2), 7U);
  EXPECT_EQ(m.u(23, 1), 3U);
}

// Variances 4, 2.25 and 9 m^2 east, north and up; velocities 0.05, 0.09 and ...: 1.96 standard deviations.
TEST(UbxDevice, BoundsTheErrors) {
  auto e = ubx_epoch();
  Device device;
  (void)device.encode(e);
  const auto answers = device.send(0x0162);
  const Message& m = find(answers, 0x0162);
  ASSERT_EQ(m.payload.size(), 52U);
  EXPECT_EQ(m.u(0, 1), 1U);
  EXPECT_EQ(m.u(1, 1), 5U) << "per cent";
  EXPECT_EQ(m.u(3, 1), 1U);
  EXPECT_EQ(m.u(4, 1), 1U) << "north, east, down";
  EXPECT_EQ(m.u(16, 4), 2940U);
  EXPECT_EQ(m.u(20, 4), 3920U);
  EXPECT_EQ(m.u(24, 4), 5880U);
  const auto& velocity = *e.observed.fix.velocity_covariance_enu;
  EXPECT_NEAR(static_cast<double>(m.u(28, 4)), 1960 * std::sqrt(velocity(1, 1)), 1);
  EXPECT_NEAR(static_cast<double>(m.u(36, 4)), 1960 * std::sqrt(velocity(2, 2)), 1);
  e.observed.time = e.observed.time + 1;
  e.observed.fix.status = positioning::FixStatus::NoSignal;
  (void)device.encode(e);
  const auto none = device.send(0x0162);
  EXPECT_EQ(find(none, 0x0162).u(3, 1), 0U);
  EXPECT_EQ(find(none, 0x0162).u(16, 4), 0U);
}

// Events of SEC-SIGLOG, the latest first: detectionType 3 abrupt change, 4 broadband and 5 narrowband
// jamming.
TEST(UbxDevice, KeepsALogOfAttacks) {
  Device device;
  auto e = ubx_epoch();
  const auto at = [&](double seconds, double interference, double tone, receiver::SpoofingState spoofing) {
    e.observed.time = ubx_epoch().observed.time + seconds;
    e.observed.bands = {{1575.42e6, interference, tone}};
    e.observed.spoofing = spoofing;
    (void)device.encode(e);
    const auto answers = device.send(0x2710);
    const Message log = find(answers, 0x2710);
    std::vector<std::array<std::uint64_t, 3>> events;
    for (std::size_t i = 0; i < log.u(1, 1); ++i) {
      events.push_back({log.u(8 + 8 * i, 4), log.u(12 + 8 * i, 1), log.u(13 + 8 * i, 1)});
    }
    EXPECT_EQ(log.payload.size(), 8 + 8 * events.size());
    return events;
  };
  using Events = std::vector<std::array<std::uint64_t, 3>>;
  constexpr auto kNone = receiver::SpoofingState::None;
  EXPECT_EQ(at(0, 0, 0, kNone), Events());
  EXPECT_EQ(at(1, 3, 3, kNone), (Events{{0, 5, 0}}));
  EXPECT_EQ(at(4, 3, 0, kNone), (Events{{3, 5, 0}})) << "still the same jammer";
  EXPECT_EQ(at(6, 0, 0, receiver::SpoofingState::Multiple), (Events{{0, 3, 0}, {0, 5, 1}, {5, 5, 0}}));
  EXPECT_EQ(at(10, 5, 0, kNone), (Events{{0, 3, 1}, {0, 4, 0}, {4, 3, 0}, {4, 5, 1}, {9, 5, 0}}));
  for (int i = 0; i < 20; ++i) (void)at(11 + i, i % 2 == 0 ? 0 : 5, 0, kNone);
  EXPECT_EQ(at(40, 0, 0, kNone).size(), 16U);
}

// SEC-SIG of newer firmware, read by the fields in drivers of ROS, Arduino and pyubx2: versions 2 and 3 are
// equal, with a flag for each centre frequency. MON-RF does not report jamming there.
TEST(UbxDevice, NewerFirmwareStatesJammingInSecSigAlone) {
  const std::tuple<Generation, unsigned, std::string> kDevices[]{{Generation::M10, 2, "PROTVER=34.30"},
                                                                 {Generation::X20, 3, "PROTVER=50.11"}};
  for (const auto& [generation, version, protocol] : kDevices) {
    Device device(generation);
    auto e = ubx_epoch();
    e.observed.bands = {{1575.42e6, 2, 0}, {1227.6e6, 0.5, 0}};
    e.observed.spoofing = receiver::SpoofingState::Indicated;
    const auto messages = device.encode(e);
    const Message sig = find(messages, 0x2709);
    ASSERT_EQ(sig.payload.size(), 12U);
    EXPECT_EQ(sig.u(0, 1), version);
    EXPECT_EQ(sig.u(1, 1), 1U | 2U << 1 | 1U << 3 | 2U << 4);  // jamming seen, spoofing indicated
    EXPECT_EQ(sig.u(3, 1), 2U);
    EXPECT_EQ(sig.u(4, 4), 1'575'420U | 1U << 24);
    EXPECT_EQ(sig.u(8, 4), 1'227'600U);
    const Message rf = find(messages, 0x0A38);
    EXPECT_EQ(rf.u(1, 1), 2U);
    EXPECT_EQ(rf.u(5, 1), 0U);
    EXPECT_NE(device.send(0x0A04)[0].payload.find(protocol), std::string::npos);
  }
}

// A real X20 rejects CFG-PRT; the M10's and the X20's settings are only keys.
TEST(UbxDevice, M10AndX20HaveNoOlderCommands) {
  for (const Generation generation : {Generation::M10, Generation::X20}) {
    Device device(generation);
    for (const MessageId id : {0x0600, 0x0601, 0x0608, 0x0624, 0x063E, 0x0639}) {
      EXPECT_THAT(ids(device.send(id)), ElementsAre(kNak)) << std::hex << id;
    }
    // CFG-VALSET in RAM: CFG-RATE-MEAS 200 ms.
    EXPECT_TRUE(device.accepts(0x068A, Payload().u1(0).u1(1).u2(0).u4(0x30210001).u2(200).bytes()));
  }
  EXPECT_THAT(ids(Device().send(0x0608)), ElementsAre(0x0608, kAck));
}

TEST(UbxDevice, M10HasNoRawMeasurementsOrRtk) {
  const auto sent = ids(Device(Generation::M10).encode(ubx_epoch()));
  EXPECT_THAT(sent, Not(Contains(0x0215)));
  EXPECT_THAT(sent, Contains(0x0107));
  EXPECT_THAT(sent, Contains(0x0143));
  EXPECT_THAT(ids(Device(Generation::X20).encode(ubx_epoch())), Contains(0x0215));
  // Its key is rejected.
  EXPECT_FALSE(
      Device(Generation::M10).accepts(0x068A, Payload().u1(0).u1(1).u2(0).u4(0x209102a5).u1(1).bytes()));
}

TEST(UbxDevice, AgeOfCorrections) {
  const auto code = [](std::optional<double> age_s, positioning::FixKind kind) {
    auto e = test::corrected(ubx_epoch(), kind);
    e.observed.fix.correction_age_s = age_s;
    return find(Device().encode(e), 0x0107).u(78, 2) >> 1;
  };
  constexpr auto kFixed = positioning::FixKind::Fixed;
  EXPECT_EQ(code(std::nullopt, kFixed), 0U);
  EXPECT_EQ(code(7, positioning::FixKind::Single), 0U);
  EXPECT_EQ(code(0, kFixed), 1U);
  EXPECT_EQ(code(1, kFixed), 2U);
  EXPECT_EQ(code(4.9, kFixed), 3U);
  EXPECT_EQ(code(5, kFixed), 4U);
  EXPECT_EQ(code(44, kFixed), 8U);
  EXPECT_EQ(code(119.9, kFixed), 11U);
  EXPECT_EQ(code(120, kFixed), 12U);
  EXPECT_EQ(code(1e6, kFixed), 12U);
}

TEST(UbxDevice, HasNoPositionWithoutAFix) {
  Device device;
  (void)device.encode(ubx_epoch());
  const auto messages =
      device.encode(test::sample_epoch(test::sample_time() + 1, test::sample_point(), {0, 0, 0}, false));
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

  Device never;
  const auto first =
      never.encode(test::sample_epoch(test::sample_time(), test::sample_point(), {0, 0, 0}, false));
  EXPECT_EQ(find(first, 0x0107).u(11, 1), 0U) << "nor a time before the first fix";
}

TEST(UbxDevice, TellsSatellitesAndRawMeasurements) {
  const auto e = ubx_epoch();
  Device device;
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
  // The clock's reading, 123457 ns ahead.
  EXPECT_NEAR(raw.r8(0), 46701.125 + 123.457e-6, 1e-11);
  EXPECT_EQ(raw.u(8, 2), 2051U);
  EXPECT_EQ(raw.u(10, 1), 18U);
  EXPECT_EQ(raw.u(11, 1), measured);
  EXPECT_EQ(raw.u(13, 1), 1U);
  EXPECT_EQ(raw.r8(16), e.observed.satellites[0].measurement->pseudorange_m);
  EXPECT_EQ(raw.u(16 + 24, 2), 0U) << "its first phase";
  EXPECT_EQ(raw.u(16 + 26, 1), 46U);
  EXPECT_EQ(raw.u(16 + 28, 1), 2U);  // 0.01 cycles in steps of 0.004
  EXPECT_EQ(raw.u(16 + 30, 1), 7U);
  EXPECT_EQ(raw.u(16 + 32 + 30, 1), 1U) << "G12 has no phase";
  // The time of lock counts from the first phase, and restarts after a slip.
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

// UBX-22008968 3.15.18: ttff and msss count from startup or reset.
TEST(UbxDevice, CountsFromTheReceiversRestart) {
  Device device;
  (void)device.encode(ubx_epoch());
  const disturbance::Restart restart{test::sample_time() + 5};
  auto e = test::sample_epoch(test::sample_time() + 6, test::sample_point(), {0, 0, 0}, false);
  e.observed.events.restart = restart;
  const auto lost = find(device.encode(e), 0x0103);
  EXPECT_EQ(lost.u(8, 4), 0U);
  EXPECT_EQ(lost.u(12, 4), 1000U);
  e = test::sample_epoch(test::sample_time() + 31, test::sample_point(), {0, 0, 0});
  e.observed.events.restart = restart;
  const auto found = find(device.encode(e), 0x0103);
  EXPECT_EQ(found.u(8, 4), 26000U);
  EXPECT_EQ(found.u(12, 4), 26000U);
}

TEST(UbxDevice, RawMeasurementsAreOfTheDayThatItBelieves) {
  auto e = ubx_epoch();
  e.observed.events.weeks_off = -1024;
  const auto messages = Device().encode(e);
  EXPECT_EQ(find(messages, 0x0215).u(8, 2), 2051U - 1024);
  EXPECT_EQ(find(messages, 0x0215).u(10, 1), 18U) << "satellites tell the leap seconds of today";
  EXPECT_EQ(find(messages, 0x0120).u(8, 2), 2051U - 1024);
  EXPECT_EQ(find(messages, 0x0120).u(10, 1), 18U);
}

TEST(UbxDevice, TellsJammingAndSpoofing) {
  Device f9, m8(Generation::M8);
  auto e = ubx_epoch();
  const auto quiet = f9.encode(e);
  EXPECT_EQ(find(quiet, 0x0A38).u(5, 1), 0U) << "not known";
  EXPECT_EQ(find(quiet, 0x0A38).u(18, 2), 8191U) << "the gain of a receiver that nothing disturbs";
  EXPECT_EQ(find(quiet, 0x0A38).u(20, 1), 0U);
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
  // Two signs of spoofing are "multiple indications", and "affirmed".
  e.observed.time = e.observed.time + 1;
  e.observed.spoofing = receiver::SpoofingState::Multiple;
  const auto both = f9.encode(e);
  EXPECT_EQ(find(both, 0x0103).u(7, 1), 3U << 3);
  EXPECT_EQ(find(both, 0x2709).u(8, 1), 1U | 3U << 1);
  // Without the monitor nothing is reported.
  EXPECT_TRUE(f9.accepts(0x068A, Payload().u1(0).u1(1).u2(0).u4(ubx::kJammingMonitor).u1(0).bytes()));
  e.observed.time = e.observed.time + 1;
  EXPECT_EQ(find(f9.encode(e), 0x0A38).u(5, 1), 0U);
}

}  // namespace
}  // namespace canyon::encoding::ubx_device_test
