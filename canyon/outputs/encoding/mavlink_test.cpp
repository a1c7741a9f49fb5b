#include "canyon/outputs/encoding/mavlink.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "canyon/base/mavlink/frames.hpp"
#include "canyon/outputs/encoding/encoder.hpp"
#include "tests/support/node_mavlink.hpp"
#include "tests/support/rtcm_parts.hpp"
#include "tests/support/sample_signals.hpp"

namespace canyon::encoding {
namespace {

std::string hex(const std::string& bytes) {
  std::string text;
  for (const char c : bytes) text += fmt::format("{:02x}", static_cast<unsigned char>(c));
  return text;
}

/// 2019-04-28 12:58:03.25 UTC; 22.29825 N, 114.17875 E, 12.3456 m; sigma 2.5 m (of 4 and 2.25 m^2) and 3 m;
/// 0.5 m/s of 0.04, 0.09 and 0.12 m^2/s^2; velocity 3.1, -4.2, 0.4 m/s (ENU).
simulation::Epoch epoch(bool fix = true) {
  simulation::Epoch epoch =
      test::sample_epoch(test::sample_time() + 0.25, test::sample_point(), {0, 0, 0}, fix);
  if (!fix) return epoch;
  epoch.observed.fix.position = geodesy::Geodetic::from_degrees(22.29825, 114.17875, 12.3456);
  epoch.observed.fix.velocity_covariance_enu = Eigen::Vector3d(0.04, 0.09, 0.12).asDiagonal();
  return epoch;
}

simulation::Epoch without_velocity() {
  simulation::Epoch still = epoch();
  still.observed.fix.velocity_enu_mps.reset();
  still.observed.fix.velocity_covariance_enu.reset();
  return still;
}

ReceiverDescription rover() {
  ReceiverDescription description;
  description.name = "rover";
  description.begin = test::sample_time();
  return description;
}

// Expected frames: the same fields packed by pymavlink 2.4.43 (dialect ardupilotmega), system 1, component
// 220.
TEST(Mavlink, GpsInput) {
  EXPECT_EQ(
      hex(mavlink::encode(gps_input(epoch()), 7)),
      "fd3f00000701dce80000501ddfb796870500c29ac80264714a0d6c4b0e44948745410000a03f0000d83f666686c066664640"
      "cdccccbe0000003f00002040000040400000030800030931b4");
}

TEST(Mavlink, HilGps) {
  EXPECT_EQ(
      hex(mavlink::encode(hil_gps(epoch()), 255)),
      "fd240000ff01dc710000501ddfb79687050064714a0d6c4b0e443a300000fa002c010a025cfe3601d8ff1538030997f6");
}

// common.xml: GPS_INPUT.alt, HIL_GPS.alt and GPS_RAW_INT.alt are above mean sea level, alt_ellipsoid is not.
TEST(Mavlink, AltitudesAreAboveMeanSeaLevel) {
  simulation::Epoch now = epoch();
  now.geoid_undulation_m = -2.375;
  EXPECT_DOUBLE_EQ(gps_input(now).altitude_m, 12.3456 + 2.375);
  EXPECT_DOUBLE_EQ(hil_gps(now).altitude_m, 12.3456 + 2.375);
  EXPECT_DOUBLE_EQ(gps_raw_int(now).altitude_m, 12.3456 + 2.375);
  EXPECT_DOUBLE_EQ(gps_raw_int(now).ellipsoidal_height_m, 12.3456);
}

TEST(Mavlink, WithoutAFixThereIsNoPosition) {
  for (const simulation::Epoch& lost : {epoch(false), without_velocity()}) {
    const mavlink::GpsInput input = gps_input(lost);
    EXPECT_EQ(input.fix_type, 1);
    EXPECT_EQ(input.ignore, 0xFF);
    EXPECT_EQ(input.latitude_deg, 0);
    EXPECT_EQ(input.longitude_deg, 0);
    EXPECT_EQ(input.week, 2051);
    EXPECT_EQ(input.time_of_week_s, 46701.25);
    const mavlink::HilGps hil = hil_gps(lost);
    EXPECT_EQ(hil.fix_type, 1);
    EXPECT_EQ(hil.latitude_deg, 0);
    EXPECT_TRUE(std::isnan(hil.horizontal_accuracy_m));
    EXPECT_TRUE(std::isnan(hil.speed_mps));
  }
  EXPECT_EQ(gps_input(epoch(false)).satellites, 0);
  const mavlink::GpsRawInt raw = gps_raw_int(epoch(false));
  EXPECT_EQ(raw.fix_type, 1);
  EXPECT_EQ(raw.latitude_deg, 0);
  EXPECT_TRUE(std::isnan(raw.hdop));
  EXPECT_EQ(gps_raw_int(without_velocity()).fix_type, 3) << "its speed and course alone are unknown";
  EXPECT_TRUE(std::isnan(gps_raw_int(without_velocity()).course_deg));
}

// PX4's and ArduPilot's drivers treat u-blox's fix type 1 like this.
TEST(Mavlink, APredictionIsNoFix) {
  const simulation::Epoch now = test::predicted(epoch());
  ASSERT_EQ(now.observed.fix.kind(), positioning::FixKind::DeadReckoning);
  EXPECT_EQ(gps_input(now).fix_type, 1);
  EXPECT_EQ(gps_input(now).latitude_deg, 0);
  EXPECT_EQ(hil_gps(now).fix_type, 1);
  EXPECT_EQ(gps_raw_int(now).fix_type, 1);
  EXPECT_EQ(gps_raw_int(now).satellites, 0);
}

// GPS_FIX_TYPE of common.xml: 3 3D, 4 DGPS, 5 RTK float, 6 RTK fixed.
TEST(Mavlink, SaysWhatTheCorrectionsMadeOfTheFix) {
  using positioning::FixKind;
  for (const auto& [kind, type] : {std::pair{FixKind::Single, 3}, std::pair{FixKind::Differential, 4},
                                   std::pair{FixKind::Float, 5}, std::pair{FixKind::Fixed, 6}}) {
    const simulation::Epoch now = test::corrected(epoch(), kind);
    EXPECT_EQ(gps_input(now).fix_type, type);
    EXPECT_EQ(hil_gps(now).fix_type, type);
    EXPECT_EQ(gps_raw_int(now).fix_type, type);
  }
  EXPECT_EQ(gps_raw_int(test::corrected(epoch(false), FixKind::Fixed)).fix_type, 1);
}

// GPS_INPUT, HIL_GPS and GPS_RAW_INT: yaw 0 is "not known", 360 is north.
TEST(Mavlink, YawIsTheFixedHeadingOfTwoAntennas) {
  using positioning::FixKind;
  const auto yaw = [](FixKind kind, bool moving_base, const Eigen::Vector3d& vector_enu) {
    const simulation::Epoch now = test::with_baseline(epoch(), kind, moving_base, vector_enu);
    const double yaw_deg = gps_raw_int(now).yaw_deg;
    EXPECT_THAT(gps_input(now).yaw_deg, testing::NanSensitiveDoubleEq(yaw_deg));
    EXPECT_THAT(hil_gps(now).yaw_deg, testing::NanSensitiveDoubleEq(yaw_deg));
    EXPECT_EQ(gps_raw_int(now).fix_type, 3);
    return yaw_deg;
  };
  EXPECT_NEAR(yaw(FixKind::Fixed, true, {-0.6, 0.8, 0.1}), 323.1301, 1e-4);
  EXPECT_EQ(yaw(FixKind::Fixed, true, {0, 1, 0}), 360);
  EXPECT_EQ(yaw(FixKind::Fixed, true, {5e-5, 1, 0}), 360);  // 0.0029 deg
  EXPECT_TRUE(std::isnan(yaw(FixKind::Float, true, {-0.6, 0.8, 0.1})));
  EXPECT_TRUE(std::isnan(yaw(FixKind::Fixed, false, {-0.6, 0.8, 0.1})));
}

TEST(Mavlink, GpsRtkHasTheBaseline) {
  EXPECT_FALSE(gps_rtk(epoch(), test::sample_time()));
  simulation::Epoch now = test::corrected(epoch(), positioning::FixKind::Fixed);
  now = test::with_baseline(now, positioning::FixKind::Fixed, false, {300, -400, 12});
  const auto rtk = gps_rtk(now, test::sample_time() - 10);
  ASSERT_TRUE(rtk);
  EXPECT_NEAR(rtk->boot_s, 10.25 - 1.6, 1e-9);
  EXPECT_EQ(rtk->week, 2051);
  EXPECT_EQ(rtk->time_of_week_s, 46701.25);
  EXPECT_EQ(rtk->satellites, 9);
  EXPECT_EQ(rtk->frame, 1);
  EXPECT_EQ(rtk->baseline_m, Eigen::Vector3d(-400, 300, -12));
  EXPECT_NEAR(rtk->accuracy_m, std::sqrt(4e-6 + 9e-6 + 2.5e-5), 1e-12);
  EXPECT_EQ(rtk->hypotheses_count, 1);
}

/// Epochs with measurements of many signals, so that messages of RTCM are longer than 180 bytes.
std::string rtcm_data_stream(Encoder& encoder) {
  std::string bytes;
  for (int second = 0; second < 3; ++second) {
    bytes += encoder.encode(test::sample_signal_epoch(test::sample_time() + second, test::sample_time()));
  }
  return bytes;
}

TEST(Mavlink, RtcmOfABaseArrivesWhole) {
  const auto plain = format_named("rtcm").make(rover()), data = format_named("gps_rtcm_data").make(rover());
  const std::string bytes = rtcm_data_stream(*data);
  mavlink::RtcmParts parts;
  std::string joined;
  std::size_t frames = 0;
  for (std::string_view rest = bytes; !rest.empty();) {
    // Each datagram is a frame of its own.
    const std::size_t size = data->datagram(rest);
    mavlink::MavlinkParser().receive(rest.substr(0, size), [&](const mavlink::Frame& frame) {
      EXPECT_EQ(frame.sequence, frames++ % 256);
      const auto* const part = std::get_if<mavlink::GpsRtcmData>(&frame.message);
      if (part != nullptr) joined += parts.receive(*part);
    });
    rest.remove_prefix(size);
  }
  EXPECT_GT(frames, 12U);
  EXPECT_EQ(joined, rtcm_data_stream(*plain));
}

TEST(Mavlink, AnotherDecoderReadsRtcmAndTheBaseline) {
  CANYON_NEEDS_NODE_MAVLINK();
  const auto data = format_named("gps_rtcm_data").make(rover()), plain = format_named("rtcm").make(rover());
  std::string joined;
  for (const auto& message : test::judge_mavlink(rtcm_data_stream(*data)).messages) {
    if (message.name != "GPS_RTCM_DATA") continue;
    const auto& counts = message.fields.at("data");
    for (std::size_t i = 0; i < static_cast<std::size_t>(message.count("len")); ++i) {
      joined += static_cast<char>(static_cast<unsigned char>(counts.at(i)));
    }
  }
  EXPECT_EQ(joined, rtcm_data_stream(*plain));

  simulation::Epoch now = test::with_baseline(epoch(), positioning::FixKind::Fixed, true);
  const auto messages = test::judge_mavlink(format_named("gps_raw_int").make(rover())->encode(now)).messages;
  ASSERT_EQ(messages.size(), 6U);
  EXPECT_EQ(messages[4].name, "GPS_RAW_INT");
  EXPECT_EQ(messages[5].name, "GPS_RTK");
  EXPECT_EQ(messages[5].count("baseline_a_mm"), 805);
  EXPECT_EQ(messages[5].count("baseline_b_mm"), -601);
  EXPECT_EQ(messages[5].count("baseline_c_mm"), 123);
  EXPECT_EQ(messages[5].count("baseline_coords_type"), 1);
  EXPECT_EQ(messages[5].count("accuracy"), 6);
  EXPECT_EQ(messages[5].count("tow"), 46701250);
}

/// An inertial sample 10 ms before the epoch and one at it, with the magnetometer's; a pressure between them.
simulation::SensorBatch samples_of(const simulation::Epoch& epoch) {
  simulation::SensorBatch batch;
  batch.magnetometer_axes = inertial::ImuAxes::Frd;
  for (const double t_s : {-0.01, 0.0}) {
    simulation::InertialSample& imu = batch.imu.emplace_back();
    imu.time = imu.reported = epoch.truth.time + t_s;
    imu.sample = inertial::ImuSample{0, {{1.5, -2, 9.75}, {0.25, 0.5, -0.125}}};
  }
  batch.magnetometer.push_back({epoch.truth.time, {2e-5, -1e-6, 4e-5}, Eigen::Vector3d::Zero()});
  simulation::BarometerSample& air = batch.barometer.emplace_back();
  air.time = epoch.truth.time + -0.004;
  air.pressure.measured_pa = 100'000;
  air.pressure.sensor_temperature_k = 298.15;
  return batch;
}

TEST(Mavlink, SamplesOfSensorsInTheirOrder) {
  using mavlink::HighresImu;
  mavlink::HighresImu last;
  const auto messages = highres_imu(samples_of(epoch()), last);
  ASSERT_EQ(messages.size(), 3U);
  EXPECT_EQ(messages[0].updated, HighresImu::kAcceleration | HighresImu::kRates);
  EXPECT_EQ(messages[1].updated, HighresImu::kPressure | HighresImu::kAltitude | HighresImu::kTemperature);
  EXPECT_EQ(messages[2].updated, HighresImu::kAcceleration | HighresImu::kRates | HighresImu::kField);
  EXPECT_EQ(messages[2].acceleration_frd_mps2, Eigen::Vector3d(1.5, 2, -9.75));
  EXPECT_EQ(messages[2].rates_frd_radps, Eigen::Vector3d(0.25, -0.5, 0.125));
  EXPECT_EQ(messages[2].field_frd_tesla, Eigen::Vector3d(2e-5, -1e-6, 4e-5));
  EXPECT_EQ(messages[2].pressure_pa, 100'000);  // the last one
  EXPECT_EQ(messages[2].time_us - messages[0].time_us, 10'000U);
  EXPECT_NEAR(messages[1].pressure_altitude_m, 110.9, 0.1);
}

TEST(Mavlink, AnotherDecoderReadsHighresImu) {
  CANYON_NEEDS_NODE_MAVLINK();
  simulation::Epoch now = epoch();
  const simulation::SensorBatch batch = samples_of(now);
  now.sensors = &batch;
  ReceiverDescription car = rover();
  car.sensors.imu.emplace();
  const auto messages = test::judge_mavlink(format_named("highres_imu").make(car)->encode(now)).messages;
  ASSERT_EQ(messages.size(), 4U);
  EXPECT_EQ(messages[3].name, "HIGHRES_IMU");
  EXPECT_EQ(messages[3].count("xacc"), 1.5);
  EXPECT_EQ(messages[3].count("zacc"), -9.75);
  EXPECT_EQ(messages[3].count("ygyro"), -0.5);
  EXPECT_NEAR(messages[3].count("zmag"), 0.4, 1e-7);  // gauss
  EXPECT_EQ(messages[3].count("abs_pressure"), 1000);
  EXPECT_EQ(messages[3].count("temperature"), 25);
  EXPECT_EQ(messages[3].count("fields_updated"), 0x1FF);
}

TEST(Mavlink, CourseAccuracyIsThatAcrossTheWay) {
  simulation::Epoch north = epoch();
  north.observed.fix.velocity_enu_mps = Eigen::Vector3d(0, 10, 0);
  EXPECT_NEAR(gps_raw_int(north).course_accuracy_deg, 0.2 / 10 * 180 / M_PI, 1e-9);  // 0.2 m/s eastwards
  north.observed.fix.velocity_enu_mps = Eigen::Vector3d(0, 1e-6, 0);
  EXPECT_EQ(gps_raw_int(north).course_accuracy_deg, 180);
}

TEST(Mavlink, StreamsCountTheirFramesAndBeatOnceASecond) {
  const auto encoder = format_named("gps_raw_int").make(rover());
  std::vector<mavlink::Frame> frames;
  mavlink::MavlinkParser parser;
  for (int k = 0; k < 25; ++k) {  // 2.5 s at 10 Hz
    simulation::Epoch now = epoch();
    now.observed.time = test::sample_time() + 0.1 * k;
    parser.receive(encoder->encode(now), [&](const mavlink::Frame& f) { frames.push_back(f); });
  }
  std::array<int, std::variant_size_v<mavlink::Message>> counts{};
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(frames[i].sequence, i % 256);
    ++counts[frames[i].message.index()];
  }
  EXPECT_EQ(counts[mavlink::Message(mavlink::Heartbeat()).index()], 3);
  EXPECT_EQ(counts[mavlink::Message(mavlink::GpsStatus()).index()], 3);
  EXPECT_EQ(counts[mavlink::Message(mavlink::SystemTime()).index()], 3);
  EXPECT_EQ(counts[mavlink::Message(mavlink::GpsRawInt()).index()], 25);
}

TEST(Mavlink, GnssIntegritySaysWhatTheReceiverNotices) {
  simulation::Epoch now = epoch();
  EXPECT_EQ(gnss_integrity(now).jamming_state, 0);
  EXPECT_EQ(gnss_integrity(now).spoofing_state, 0);
  now.observed.bands = {{1575.42e6, 0.5, 0}, {1176.45e6, 0.25, 0}};
  now.observed.spoofing = receiver::SpoofingState::None;
  EXPECT_EQ(gnss_integrity(now).jamming_state, 1);
  EXPECT_EQ(gnss_integrity(now).spoofing_state, 1);
  now.observed.bands[1].interference_ratio = 2;
  now.observed.spoofing = receiver::SpoofingState::Indicated;
  EXPECT_EQ(gnss_integrity(now).jamming_state, 2);
  EXPECT_EQ(gnss_integrity(now).spoofing_state, 3);
  now = epoch(false);
  now.observed.bands = {{1575.42e6, 100, 0}};
  EXPECT_EQ(gnss_integrity(now).jamming_state, 3);
}

TEST(Mavlink, AnotherDecoderReadsTheStreams) {
  CANYON_NEEDS_NODE_MAVLINK();
  std::string bytes;
  simulation::Epoch seen = epoch();
  seen.geoid_undulation_m = -2.375;
  for (const char* format : {"gps_input", "hil_gps", "gps_raw_int"}) {
    const auto encoder = format_named(format).make(rover());
    bytes += encoder->encode(seen);
    bytes += encoder->encode(epoch(false));
  }
  std::vector<std::string> names;
  std::map<std::string, std::vector<test::JudgedMessage>> by_name;
  for (const auto& message : test::judge_mavlink(bytes).messages) {
    names.push_back(message.name);
    by_name[message.name].push_back(message);
  }
  EXPECT_EQ(names, (std::vector<std::string>{"HEARTBEAT", "GPS_INPUT", "GPS_INPUT", "HEARTBEAT", "HIL_GPS",
                                             "HIL_GPS", "HEARTBEAT", "SYSTEM_TIME", "GPS_STATUS",
                                             "GNSS_INTEGRITY", "GPS_RAW_INT", "GPS_RAW_INT"}));
  const auto& beat = by_name["HEARTBEAT"][0];
  EXPECT_EQ(beat.system, 1);
  EXPECT_EQ(beat.component, 220);
  EXPECT_EQ(beat.count("autopilot"), 8);
  // date -u -d '2019-04-28 12:58:03' +%s
  EXPECT_EQ(by_name["SYSTEM_TIME"][0].count("time_unix_usec"), 1556456283.25e6);
  EXPECT_EQ(by_name["SYSTEM_TIME"][0].count("time_boot_ms"), 250);

  const auto& input = by_name["GPS_INPUT"];
  EXPECT_EQ(input[0].count("lat"), 222982500);
  EXPECT_EQ(input[0].count("lon"), 1141787500);
  EXPECT_FLOAT_EQ(static_cast<float>(input[0].count("vd")), -0.4F);
  EXPECT_EQ(input[0].count("horiz_accuracy"), 2.5);
  EXPECT_EQ(input[0].count("ignore_flags"), 0);
  EXPECT_EQ(input[1].count("ignore_flags"), 255);
  EXPECT_EQ(input[1].count("fix_type"), 1);
  EXPECT_EQ(input[1].count("hdop"), 65535);

  const auto& raw = by_name["GPS_RAW_INT"];
  EXPECT_EQ(raw[0].count("time_usec"), 1556456283.25e6);
  EXPECT_EQ(raw[0].count("fix_type"), 3);
  EXPECT_EQ(raw[0].count("lat"), 222982500);
  EXPECT_EQ(raw[0].count("alt"), 14721);
  EXPECT_EQ(raw[0].count("alt_ellipsoid"), 12346);
  EXPECT_EQ(raw[0].count("eph"), 125);
  EXPECT_EQ(raw[0].count("epv"), 169);
  EXPECT_EQ(raw[0].count("vel"), 522);    // sqrt(3.1^2 + 4.2^2) m/s
  EXPECT_EQ(raw[0].count("cog"), 14357);  // atan2(3.1, -4.2)
  EXPECT_EQ(raw[0].count("h_acc"), 2500);
  EXPECT_EQ(raw[0].count("v_acc"), 3000);
  EXPECT_EQ(raw[0].count("vel_acc"), 500);
  EXPECT_EQ(raw[1].count("fix_type"), 1);
  EXPECT_EQ(raw[1].count("lat"), 0);
  EXPECT_EQ(raw[1].count("eph"), 65535);
  EXPECT_EQ(raw[1].count("cog"), 65535);

  // Tracked: 10 of the 12 satellites, one of them not in the fix. R01 65, R24 88, E11 221, E36 246, C03 161,
  // C30 57, J02 194 (UBX-22008968, 1.5.2).
  const auto& status = by_name["GPS_STATUS"][0];
  const auto numbers = status.fields.at("satellite_prn");
  EXPECT_EQ(std::vector<double>(numbers.begin(), numbers.begin() + 11),
            (std::vector<double>{5, 12, 17, 65, 88, 221, 161, 57, 194, 246, 0}));
  const auto used = status.fields.at("satellite_used");
  EXPECT_EQ(std::vector<double>(used.begin(), used.begin() + 11),
            (std::vector<double>{1, 1, 1, 1, 1, 1, 1, 1, 1, 0, 0}));
  EXPECT_EQ(status.fields.at("satellite_elevation")[0], 30);  // 60.2 deg above the horizon
  EXPECT_EQ(status.fields.at("satellite_azimuth")[0], 32);    // 45.5 of 360, of 255
}

}  // namespace
}  // namespace canyon::encoding
