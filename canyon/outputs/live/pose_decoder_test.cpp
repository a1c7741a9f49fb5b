#include "canyon/outputs/live/pose_source.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>
#include <Eigen/Geometry>

#include <cmath>
#include <cstring>
#include <random>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/mavlink/frames.hpp"

namespace canyon::live {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using simulation::BodyAxes;
using simulation::PoseFormat;
using simulation::PoseSourceOptions;
using simulation::WorldAxes;
using ::testing::AllOf;
using ::testing::HasSubstr;

PoseSourceOptions options(PoseFormat format, WorldAxes axes = WorldAxes::ENU, BodyAxes body = BodyAxes::FLU) {
  PoseSourceOptions o;
  o.format = format;
  o.axes = axes;
  o.body = body;
  return o;
}

std::vector<PoseReport> received(PoseDecoder& decoder, std::string_view bytes, std::size_t step = 1 << 20,
                                 std::uint64_t reader = 0) {
  std::vector<PoseReport> reports;
  for (; !bytes.empty(); bytes.remove_prefix(std::min(step, bytes.size()))) {
    decoder.receive({reader, std::string(bytes.substr(0, step))},
                    [&](const PoseReport& r) { reports.push_back(r); });
  }
  return reports;
}

void expect_near(const Vector3d& actual, const Vector3d& expected, double tolerance = 1e-6) {
  EXPECT_LE((actual - expected).norm(), tolerance)
      << actual.transpose() << ", expected " << expected.transpose();
}

// A vehicle whose forward axis points along (3, 2, 1) of the given axes, rolled by 0.4: no symmetry. Tests
// compare its axes in the world.
Quaterniond skew() {
  return Quaterniond(AngleAxisd(0.6, Vector3d::UnitZ()) * AngleAxisd(-0.3, Vector3d::UnitY()) *
                     AngleAxisd(0.4, Vector3d::UnitX()));
}

std::string json(const Quaterniond& q) {
  return fmt::format(
      R"({{"time_s": 2.5, "id": "uav", "position_m": [1, 2, -3], "attitude": [{}, {}, {}, {}], )"
      R"("velocity_mps": [4, 5, -6], "rates_radps": [0.1, 0.2, 0.3]}})"
      "\n",
      q.w(), q.x(), q.y(), q.z());
}

TEST(JsonPoses, AreTakenAsTheyAreInEnuAndFlu) {
  const auto decoder = make_decoder(options(PoseFormat::Json));
  const auto reports = received(*decoder, json(skew()), 7);
  ASSERT_EQ(reports.size(), 1U);
  const PoseReport& r = reports.front();
  EXPECT_EQ(r.id, "uav");
  EXPECT_EQ(r.stamp_s, 2.5);
  EXPECT_EQ(*r.position_m, Vector3d(1, 2, -3));
  EXPECT_EQ(*r.velocity_mps, Vector3d(4, 5, -6));
  EXPECT_EQ(*r.rates_body_radps, Vector3d(0.1, 0.2, 0.3));
  expect_near(*r.attitude * Vector3d::UnitX(), skew() * Vector3d::UnitX());
  EXPECT_EQ(decoder->take_decode_errors(), "");
}

TEST(JsonPoses, AreTurnedFromNedAndFrd) {
  const auto decoder = make_decoder(options(PoseFormat::Json, WorldAxes::NED, BodyAxes::FRD));
  const auto reports = received(*decoder, json(skew()));
  ASSERT_EQ(reports.size(), 1U);
  const PoseReport& r = reports.front();
  // North, east, down = 1, 2, -3.
  EXPECT_EQ(*r.position_m, Vector3d(2, 1, 3));
  EXPECT_EQ(*r.velocity_mps, Vector3d(5, 4, 6));
  EXPECT_EQ(*r.rates_body_radps, Vector3d(0.1, -0.2, -0.3));
  // Forward, left and up of the body: forward is the first FRD axis, left the negative second, up the
  // negative third; NED's first component is ENU's second.
  const auto enu = [](const Vector3d& ned) { return Vector3d(ned.y(), ned.x(), -ned.z()); };
  expect_near(*r.attitude * Vector3d::UnitX(), enu(skew() * Vector3d::UnitX()));
  expect_near(*r.attitude * Vector3d::UnitY(), enu(skew() * -Vector3d::UnitY()));
  expect_near(*r.attitude * Vector3d::UnitZ(), enu(skew() * -Vector3d::UnitZ()));
}

TEST(JsonPoses, YawIsFromTheFirstAxisOfTheTold) {
  const std::string line = R"({"position_m": [0, 0, 0], "yaw_deg": 30})";
  const auto enu = received(*make_decoder(options(PoseFormat::Json)), line);
  const auto ned = received(*make_decoder(options(PoseFormat::Json, WorldAxes::NED)), line);
  const double c = std::cos(geodesy::radians(30)), s = std::sin(geodesy::radians(30));
  expect_near(*enu.at(0).attitude * Vector3d::UnitX(), {c, s, 0});
  expect_near(*ned.at(0).attitude * Vector3d::UnitX(), {s, c, 0});  // 30 degrees east of north
  expect_near(*ned.at(0).attitude * Vector3d::UnitZ(), {0, 0, 1});
}

TEST(JsonPoses, MayBeOnTheEarth) {
  const auto reports = received(*make_decoder(options(PoseFormat::Json)),
                                "{\"latitude_deg\": 22.3, \"longitude_deg\": 114.2, \"height_m\": 12.5}");
  ASSERT_EQ(reports.size(), 1U);
  EXPECT_NEAR(geodesy::degrees(reports[0].position->latitude_rad), 22.3, 1e-12);
  EXPECT_EQ(reports[0].position->height_m, 12.5);
  EXPECT_FALSE(reports[0].stamp_s);
}

TEST(JsonPoses, SayWhatIsNone) {
  const auto decoder = make_decoder(options(PoseFormat::Json));
  for (const auto& [line, problem] : std::vector<std::pair<std::string, std::string>>{
           {"hello\n", "not a JSON object"},
           {"[1, 2]\n", "not a JSON object"},
           {"{\"time_s\": 1}\n", "neither 'position_m'"},
           {"{\"position_m\": [1, 2]}\n", "'position_m' is not a list of 3 numbers"},
           {"{\"position_m\": [1, 2, \"x\"]}\n", "'position_m' is not a list of 3 numbers"},
           {"{\"position_m\": [1, 2, 3], \"attitude\": [0, 0, 0, 0]}\n", "no direction"},
           {"{\"position_m\": [1, NaN, 3]}\n", "'position_m' has a value that is not finite"},
           {"{\"position_m\": [1, 2, 3], \"time_s\": Infinity}\n", "'time_s' has a value that is not finite"},
           {"{\"position_m\": [1, 2, 3], \"time_s\": null}\n", "'time_s' has a value that is not finite"},
           {"{\"position_m\": [1, 2, 3], \"yaw_deg\": NaN}\n", "'yaw_deg' has a value that is not finite"},
           {"{\"position_m\": [1, 2, null]}\n", "'position_m' has a value that is not finite"},
           {"{\"position_m\": [1, 2, 3], \"velocity_mps\": [-nan, inf, 0]}\n",
            "'velocity_mps' has a value that is not finite"},
           {"{\"latitude_deg\": 48, \"longitude_deg\": nan, \"height_m\": 0}\n",
            "'longitude_deg' has a value that is not finite"},
           {"{\"latitude_deg\": 91, \"longitude_deg\": 0, \"height_m\": 0}\n", "out of range"},
           {std::string(10'000, '[') + "\n", "more than 4096 bytes"}}) {
    EXPECT_TRUE(received(*decoder, line).empty()) << line.substr(0, 50);
    EXPECT_THAT(decoder->take_decode_errors(), HasSubstr(problem)) << line.substr(0, 50);
  }
  // The next one is accepted.
  EXPECT_EQ(received(*decoder, "{\"position_m\": [1, 2, 3]}\n").size(), 1U);
  EXPECT_EQ(decoder->take_decode_errors(), "");
  // Two senders do not break each other's lines.
  decoder->receive({1, "{\"position_m\": [1,"}, [](const PoseReport&) { ADD_FAILURE(); });
  EXPECT_EQ(received(*decoder, "{\"position_m\": [4, 5, 6]}\n", 100, 2).size(), 1U);
  EXPECT_EQ(received(*decoder, " 2, 3]}\n", 100, 1).size(), 1U);
}

// A misspelt key loses no pose, but is reported.
TEST(JsonPoses, SayWhatIsNotUsed) {
  const auto decoder = make_decoder(options(PoseFormat::Json));
  const std::string pose =
      "{\"position_m\": [1, 2, 3], \"velocity\": [1, 0, 0], \"Attitude\": [0, 0, 0, 1], \"battery\": 5}\n";
  EXPECT_EQ(received(*decoder, pose + pose).size(), 2U);
  EXPECT_EQ(decoder->take_decode_errors(), "");
  const std::string unused = decoder->take_unused();
  EXPECT_THAT(unused, HasSubstr("'velocity' is not used: did you mean 'velocity_mps'?"));
  EXPECT_THAT(unused, HasSubstr("'Attitude' is not used: did you mean 'attitude'?"));
  EXPECT_THAT(unused, HasSubstr("'battery' is not used: a pose has time_s, id"));
  // Reported once only.
  (void)received(*decoder, pose);
  EXPECT_EQ(decoder->take_unused(), "");
  for (const auto& [line, key] : std::vector<std::pair<std::string, std::string>>{
           {R"({"position_m": [1, 2, 3], "latitude_deg": 1, "longitude_deg": 2, "height_m": 3})",
            "position_m"},
           {R"({"position_m": [1, 2, 3], "latitude_deg": 1, "longitude_deg": 2})", "latitude_deg"},
           {R"({"position_m": [1, 2, 3], "attitude": [1, 0, 0, 0], "yaw_deg": 2})", "yaw_deg"}}) {
    const auto other = make_decoder(options(PoseFormat::Json));
    EXPECT_EQ(received(*other, line + "\n").size(), 1U);
    EXPECT_THAT(other->take_unused(), HasSubstr("'" + key + "' is not used"));
  }
  const auto good = make_decoder(options(PoseFormat::Json));
  EXPECT_EQ(received(*good, json(skew())).size(), 1U);
  EXPECT_EQ(good->take_unused(), "");
}

/// The binary form by its table.
std::string binary(std::uint16_t flags, const std::array<double, 3>& position, std::uint32_t id = 7) {
  std::string b(kBinarySize, '\0');
  const auto put = [&b](std::size_t at, auto value) { std::memcpy(b.data() + at, &value, sizeof value); };
  std::memcpy(b.data(), "CNY1", 4);
  put(4, flags);
  put(8, id);
  put(12, 2.5);
  for (std::size_t i = 0; i < 3; ++i) put(20 + 8 * i, position[i]);
  const Quaterniond q = skew();
  put(44, static_cast<float>(q.w()));
  put(48, static_cast<float>(q.x()));
  put(52, static_cast<float>(q.y()));
  put(56, static_cast<float>(q.z()));
  for (std::size_t i = 0; i < 3; ++i) put(60 + 4 * i, 4.0F + static_cast<float>(i));
  for (std::size_t i = 0; i < 3; ++i) put(72 + 4 * i, 0.5F + static_cast<float>(i));
  put(84, static_cast<std::uint32_t>(crc32(0, reinterpret_cast<const Bytef*>(b.data()), 84)));
  return b;
}

TEST(BinaryPoses, AreReadByTheirTable) {
  const auto decoder = make_decoder(options(PoseFormat::Binary, WorldAxes::NED, BodyAxes::FRD));
  const auto reports = received(*decoder, binary(3, {1, 2, -3}) + binary(4 | 8 | 16, {22.3, 114.2, 5}), 5);
  ASSERT_EQ(reports.size(), 2U);
  EXPECT_EQ(reports[0].id, "7");
  EXPECT_EQ(reports[0].stamp_s, 2.5);
  EXPECT_EQ(*reports[0].position_m, Vector3d(2, 1, 3));
  EXPECT_EQ(*reports[0].velocity_mps, Vector3d(5, 4, -6));
  EXPECT_EQ(*reports[0].rates_body_radps, Vector3d(0.5, -1.5, -2.5));
  const Vector3d forward = skew() * Vector3d::UnitX();
  expect_near(*reports[0].attitude * Vector3d::UnitX(), {forward.y(), forward.x(), -forward.z()});
  EXPECT_NEAR(geodesy::degrees(reports[1].position->longitude_rad), 114.2, 1e-12);
  EXPECT_FALSE(reports[1].stamp_s || reports[1].attitude || reports[1].velocity_mps);
}

// Invalid bytes do not affect the next pose.
TEST(Poses, ADatagramEndsWhatItSays) {
  const std::string good = "{\"position_m\": [4, 5, 6]}";
  for (const auto& [format, bad, next] : std::vector<std::tuple<PoseFormat, std::string, std::string>>{
           {PoseFormat::Json, "{\"position_m\": [1, 2, x]}", good},
           {PoseFormat::Json, "{\"position_m\": [1,", good},
           {PoseFormat::Binary, binary(0, {1, 2, 3}).substr(0, 60), binary(0, {4, 5, 6})}}) {
    const auto decoder = make_decoder(options(format));
    int poses = 0;
    const auto count = [&](const PoseReport& report) {
      ++poses;
      EXPECT_EQ(*report.position_m, Vector3d(4, 5, 6));
    };
    for (int i = 0; i < 3; ++i) {
      decoder->receive({7, bad, true}, count);
      EXPECT_THAT(decoder->take_decode_errors(), HasSubstr("1 message was not a pose")) << bad;
      decoder->receive({7, next, true}, count);
      EXPECT_EQ(decoder->take_decode_errors(), "") << bad;
    }
    EXPECT_EQ(poses, 3) << bad;
  }
}

// Each reason is counted separately.
TEST(Poses, ComplaintsCountByReason) {
  const auto json = make_decoder(options(PoseFormat::Json));
  (void)received(*json, "rubbish\n{\"position_m\": 1}\nrubbish\n{}\n");
  EXPECT_EQ(json->take_decode_errors(),
            "4 messages were not poses: 2 not a JSON object; 1 'position_m' is not a list of 3 numbers; 1 "
            "neither 'position_m' nor 'latitude_deg', 'longitude_deg', 'height_m'");
  (void)received(*json, "rubbish\nrubbish\n");
  EXPECT_EQ(json->take_decode_errors(), "2 messages were not poses: not a JSON object");
  DecodeErrors many;
  for (int i = 0; i < 1000; ++i) many.add("reason " + std::to_string(i));
  EXPECT_THAT(many.take(), AllOf(HasSubstr("1000 messages were not poses: 1 reason 0; 1 reason 1; "),
                                 HasSubstr("; 1 reason 7; 992 for other reasons")));
}

TEST(BinaryPoses, AreFoundAmongRubbish) {
  const auto decoder = make_decoder(options(PoseFormat::Binary));
  std::string broken = binary(0, {9, 9, 9});
  broken[30] ^= 1;
  const std::string bytes = "CNCNY" + broken + "CNY1" + binary(0, {1, 2, 3}) + "xyz" + binary(0, {4, 5, 6});
  for (const std::size_t step : {1, 13, 1000}) {
    const auto reports = received(*decoder, bytes + std::string(200, 'C'), step);
    ASSERT_EQ(reports.size(), 2U) << step;
    EXPECT_EQ(*reports[0].position_m, Vector3d(1, 2, 3));
    EXPECT_THAT(decoder->take_decode_errors(), HasSubstr("not poses"));
  }
}

std::string frame(const mavlink::Message& message, std::uint8_t system = 1) {
  return mavlink::encode(message, 0, {system, 1});
}

mavlink::Quaternion to_mavlink(const Quaterniond& q) {
  return {q.w(), q.x(), q.y(), q.z()};
}

TEST(MavlinkPoses, ComeInTheirOwnFrames) {
  const auto decoder = make_decoder(options(PoseFormat::MAVLink));
  mavlink::SimState sim;
  sim.ned_from_frd = to_mavlink(skew());
  sim.fine_latitude_deg = 22.3;
  sim.fine_longitude_deg = 114.2;
  sim.altitude_m = 30;
  sim.velocity_ned_mps = {4, 5, -6};
  sim.rates_frd_radps = {0.1, 0.2, 0.3};
  mavlink::AttPosMocap mocap;
  mocap.time_us = 5'000'000;
  mocap.ned_from_frd = to_mavlink(skew());
  mocap.position_ned_m = {1, 2, -3};
  mavlink::VisionPositionEstimate vision;
  vision.position_ned_m = {1, 2, -3};
  vision.roll_pitch_yaw_rad = {0.4, -0.3, 0.6};  // skew()
  const auto reports =
      received(*decoder, frame(sim, 3) + frame(mocap) + frame(vision) + frame(mavlink::Heartbeat{}));
  ASSERT_EQ(reports.size(), 3U);
  const auto enu = [](const Vector3d& ned) { return Vector3d(ned.y(), ned.x(), -ned.z()); };
  for (const PoseReport& r : reports) {
    expect_near(*r.attitude * Vector3d::UnitX(), enu(skew() * Vector3d::UnitX()));
    expect_near(*r.attitude * Vector3d::UnitY(), enu(skew() * -Vector3d::UnitY()));
  }
  EXPECT_EQ(reports[0].id, "3");
  EXPECT_NEAR(geodesy::degrees(reports[0].position->latitude_rad), 22.3, 1e-6);
  EXPECT_FALSE(reports[0].stamp_s);  // SIM_STATE has none
  expect_near(*reports[0].velocity_mps, {5, 4, 6});
  expect_near(*reports[0].rates_body_radps, {0.1, -0.2, -0.3});
  EXPECT_EQ(reports[1].stamp_s, 5);
  expect_near(*reports[1].position_m, {2, 1, 3});
  EXPECT_FALSE(reports[2].stamp_s);  // a time of 0 means none, as in PX4's HIL_STATE_QUATERNION
  expect_near(*reports[2].position_m, {2, 1, 3});
}

// MAVLink's altitudes are above mean sea level; heights of other poses are above the ellipsoid.
TEST(MavlinkPoses, AltitudesAreAboveMeanSeaLevel) {
  const geodesy::LocalFrame frame_of_city(geodesy::Geodetic::from_degrees(52.5, 13.4, 74.5));
  mavlink::HilStateQuaternion state;
  state.time_us = 1;
  state.ned_from_frd = to_mavlink(skew());
  state.latitude_deg = 52.5;
  state.longitude_deg = 13.4;
  state.altitude_m = 37;
  PoseSource source(options(PoseFormat::MAVLink), frame_of_city, 39.5);
  source.receive({0, frame(state)}, 0);
  std::string reason;
  const auto at = source.track().at(0, reason);
  ASSERT_TRUE(at) << reason;
  EXPECT_NEAR(at->position_m.z(), 2, 1e-3);
  PoseSource json(options(PoseFormat::Json), frame_of_city, 39.5);
  json.receive({0, "{\"latitude_deg\": 52.5, \"longitude_deg\": 13.4, \"height_m\": 76.5}\n"}, 0);
  const auto other = json.track().at(0, reason);
  ASSERT_TRUE(other) << reason;
  EXPECT_NEAR(other->position_m.z(), 2, 1e-3);
}

// A stationary vehicle as sent by PX4 and ArduPilot: without times, several messages read at once.
TEST(MavlinkPoses, WithoutTimesAVehicleMayStand) {
  const geodesy::LocalFrame frame_of_city(geodesy::Geodetic::from_degrees(22.3, 114.2, 0));
  PoseSource source(options(PoseFormat::MAVLink), frame_of_city);
  mavlink::HilStateQuaternion state;
  state.ned_from_frd = to_mavlink(skew());
  state.latitude_deg = 22.3;
  state.longitude_deg = 114.2;
  std::string reason;
  for (std::int64_t i = 0; i < 10; ++i) {
    const std::int64_t now_ns = 40'000'000 * i;
    source.receive({0, frame(state) + frame(state)}, now_ns);
    EXPECT_TRUE(source.track().at(now_ns, reason)) << reason;
  }
  EXPECT_GE(source.count(), 10U);
  EXPECT_TRUE(source.take_notes().empty());
}

TEST(MavlinkPoses, PlacesBeforeAFixAreNone) {
  const auto decoder = make_decoder(options(PoseFormat::MAVLink));
  mavlink::HilStateQuaternion state;
  state.ned_from_frd = to_mavlink(skew());
  state.altitude_m = 37;
  for (const PoseReport& report : received(*decoder, frame(state))) EXPECT_FALSE(report.position);
  EXPECT_THAT(decoder->take_decode_errors(), HasSubstr("was not a pose: HIL_STATE_QUATERNION at latitude 0"));
}

TEST(MavlinkPoses, OdometrySaysItsFrames) {
  const auto decoder = make_decoder(options(PoseFormat::MAVLink));
  mavlink::Odometry m;
  m.position_m = {1, 2, -3};
  m.frame_from_body = to_mavlink(skew());
  m.velocity_mps = {4, 5, -6};
  m.rates_radps = {0.1, 0.2, 0.3};
  const auto enu = [](const Vector3d& ned) { return Vector3d(ned.y(), ned.x(), -ned.z()); };
  m.frame = 1;        // LOCAL_NED
  m.child_frame = 8;  // BODY_NED, which is FRD
  PoseReport r = received(*decoder, frame(m)).at(0);
  expect_near(*r.position_m, {2, 1, 3});
  expect_near(*r.velocity_mps, enu(skew() * Vector3d(4, 5, -6)));
  m.frame = 21;        // LOCAL_FLU
  m.child_frame = 13;  // BODY_FLU
  r = received(*decoder, frame(m)).at(0);
  expect_near(*r.position_m, {1, 2, -3});
  expect_near(*r.velocity_mps, skew() * Vector3d(4, 5, -6));
  expect_near(*r.rates_body_radps, {0.1, 0.2, 0.3});
  m.frame = 0;  // GLOBAL: not for metres
  EXPECT_TRUE(received(*decoder, frame(m)).empty());
  EXPECT_THAT(decoder->take_decode_errors(), HasSubstr("MAV_FRAME 0"));
}

TEST(MavlinkPoses, EstimatesAreTakenOnlyWhereTheyAreNamed) {
  mavlink::AttitudeQuaternion attitude;
  attitude.ned_from_frd = to_mavlink(skew());
  mavlink::LocalPositionNed position;
  position.boot_s = 12.5;
  position.position_ned_m = {1, 2, -3};
  position.velocity_ned_mps = {4, 5, -6};
  const std::string bytes = frame(attitude) + frame(position);
  EXPECT_TRUE(received(*make_decoder(options(PoseFormat::MAVLink)), bytes).empty());
  PoseSourceOptions named = options(PoseFormat::MAVLink);
  named.messages = {"LOCAL_POSITION_NED"};
  const auto decoder = make_decoder(named);
  const auto reports = received(*decoder, bytes);
  ASSERT_EQ(reports.size(), 1U);
  EXPECT_EQ(reports[0].stamp_s, 12.5);
  expect_near(*reports[0].velocity_mps, {5, 4, 6});
  ASSERT_TRUE(reports[0].attitude);
  EXPECT_FALSE(decoder->request().empty());
  named.messages = {"SIM_STAT"};
  EXPECT_THROW((void)make_decoder(named), InputError);
}

// A pose that is impossible for an antenna is dropped without ending the run, in every format.
TEST(Poses, OfNoAntennaAreDroppedAndCounted) {
  const geodesy::LocalFrame frame_of_city(geodesy::Geodetic::from_degrees(48, 11, 0));
  mavlink::HilStateQuaternion state;
  state.ned_from_frd = to_mavlink(skew());
  state.latitude_deg = -48;
  state.longitude_deg = -169;
  const std::string far_json =
      "{\"time_s\": 1, \"latitude_deg\": -48, \"longitude_deg\": -169, \"height_m\": 2}\n";
  for (const auto& [format, bytes] : std::vector<std::pair<PoseFormat, std::string>>{
           {PoseFormat::Json, far_json},
           {PoseFormat::Json,
            "{\"time_s\": 1, \"latitude_deg\": 48, \"longitude_deg\": 11, \"height_m\": 1e30}\n"},
           {PoseFormat::Json, "{\"time_s\": 1, \"position_m\": [0, 0, 2], \"velocity_mps\": [1e7, 0, 0]}\n"},
           {PoseFormat::Json, "{\"time_s\": 1, \"position_m\": [0, 2e7, 2]}\n"},
           {PoseFormat::Binary, binary(4, {-48, -169, 2})},
           {PoseFormat::Binary, binary(0, {0, 0, 1e30})},
           {PoseFormat::MAVLink, frame(state)}}) {
    PoseSource source(options(format), frame_of_city);
    source.receive({0, bytes}, 0);
    EXPECT_EQ(source.count(), 0U) << bytes;
    const auto notes = source.take_notes();
    ASSERT_EQ(notes.size(), 1U) << bytes;
    EXPECT_THAT(notes.front(), HasSubstr("1 pose was dropped: not finite")) << bytes;
  }
  // The heading is the direction of motion, computed without the dropped pose.
  PoseSource source(options(PoseFormat::Json), frame_of_city);
  source.receive({0,
                  "{\"time_s\": 0, \"position_m\": [0, 0, 2]}\n{\"time_s\": 1, \"position_m\": [0, 2e7, 2]}\n"
                  "{\"time_s\": 2, \"position_m\": [10, 0, 2]}\n"},
                 0);
  std::string reason;
  const auto at = source.track().at(0, reason);
  ASSERT_TRUE(at) << reason;
  EXPECT_NEAR((at->attitude * Eigen::Vector3d::UnitX()).y(), 0, 1e-9);
}

// Stamps in milliseconds instead of seconds make the vehicle appear stationary: reported once.
TEST(Poses, StampsInAnotherUnitAreTold) {
  const geodesy::LocalFrame frame_of_city(geodesy::Geodetic::from_degrees(22.3, 114.2, 0));
  for (const double unit : {1.0, 1000.0}) {
    PoseSource source(options(PoseFormat::Json), frame_of_city);
    std::size_t reported = 0;
    for (int i = 0; i < 60; ++i) {
      const double now_s = 0.1 * i;
      source.receive(
          {0, fmt::format("{{\"time_s\": {}, \"position_m\": [{}, 0, 2]}}\n", 7 + unit * now_s, 5 * now_s)},
          std::llround(now_s * 1e9));
      for (const std::string& note : source.take_notes())
        reported += note.find("timestamps advance 1000 s per second") != std::string::npos ? 1 : 0;
    }
    EXPECT_EQ(reported, unit == 1 ? 0U : 1U);
  }
}

TEST(Poses, HostileBytesAreNoneAndCostNothing) {
  std::mt19937 random(1);
  for (const PoseFormat format : {PoseFormat::Json, PoseFormat::Binary, PoseFormat::MAVLink}) {
    const auto decoder = make_decoder(options(format));
    for (int i = 0; i < 200; ++i) {
      std::string bytes(1 + random() % 3000, '\0');
      for (char& c : bytes) c = static_cast<char>(random());
      EXPECT_TRUE(received(*decoder, bytes, bytes.size(), random() % 1000).empty());
    }
  }
}

}  // namespace
}  // namespace canyon::live
