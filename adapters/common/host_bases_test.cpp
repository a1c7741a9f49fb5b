#include "canyon/outputs/live/hosted_receiver.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <deque>

#include "adapters/common/host_settings.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/outputs/encoding/epoch_values.hpp"

namespace canyon::adapters {
namespace {

using Eigen::Vector3d;
using positioning::FixKind;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Receivers in an open field at 22.3 N, 114.17 E, at 5 Hz.
class Field {
 public:
  live::HostedReceiver& add(const std::string& name, std::uint64_t vehicle, const Vector3d& point,
                            const std::string& more = "") {
    options::Document document;
    document.file = name + ".yaml";
    HostSettings settings;
    settings.live.allow_external_base = true;
    options::read_yaml(
        "{profile: ublox-f9p, rate_hz: 5, origin_latitude: 22.3, origin_longitude: 114.17, "
        "name: " +
            name + (more.empty() ? "" : ", " + more) + "}",
        document, "", settings);
    std::vector<std::string> warnings;
    const live::WorldFrame frame = world_frame(std::nullopt, settings, warnings);
    ReceiverIdentity identity;
    identity.model = "model of " + name;
    auto& receiver = receivers.emplace_back(std::make_unique<live::HostedReceiver>(
        setup_of(settings, identity, frame, geodesy::gps_from_utc(geodesy::CalendarTime{2026, 6, 1, 8, 0, 0}),
                 0, [this](live::Severity, const std::string& line) { lines.push_back(line); })));
    positions.push_back(point);
    bases.add(*receiver, vehicle);
    return *receiver;
  }
  /// Five epochs per second without motion.
  void run(double seconds) {
    for (int i = 0; i < static_cast<int>(std::lround(seconds * 5)); ++i, now_ns += 200'000'000) {
      std::vector<live::HostedReceiver*> due;
      for (std::size_t r = 0; r < receivers.size(); ++r) {
        if (!receivers[r] || !receivers[r]->due(now_ns)) continue;
        receivers[r]->begin(now_ns, [&](std::string&) {
          simulation::RigidPose truth;
          truth.position_m = positions[r];
          return std::optional(truth);
        });
        due.push_back(receivers[r].get());
      }
      bases.finish(due);
    }
  }

  live::HostBases bases;
  std::vector<std::unique_ptr<live::HostedReceiver>> receivers;
  std::vector<Vector3d> positions;
  std::vector<std::string> lines;
  std::int64_t now_ns = 0;
};

FixKind kind_of(const live::HostedReceiver& receiver) {
  return receiver.step()->epoch.observed.fix.kind();
}

// The rover is added first and its base is 300 m away: its corrections are still of the same instant.
TEST(HostBases, AStationElsewhereInTheWorldMakesFixedPositions) {
  Field field;
  live::HostedReceiver& rover = field.add("rover", 1, {0, 0, 2}, "rtk: true, corrections: {from: tower}");
  field.add("tower", 2, {300, 0, 20});
  field.run(60);
  EXPECT_THAT(field.lines, IsEmpty());
  ASSERT_EQ(kind_of(rover), FixKind::Fixed);
  const positioning::Fix& fix = rover.step()->epoch.observed.fix;
  EXPECT_NEAR(*fix.correction_age_s, 0, 1e-3);
  EXPECT_FALSE(fix.baseline->moving_base);
  EXPECT_LT(rover.step()->epoch.error_enu_m.norm(), 0.1);
}

TEST(HostBases, SettingsForAllMayNameTheBase) {
  Field field;
  const std::string all = "rtk: true, corrections: {from: tower}";
  live::HostedReceiver& rover = field.add("rover", 1, {0, 0, 2}, all);
  live::HostedReceiver& tower = field.add("tower", 2, {300, 0, 20}, all);
  field.run(60);
  EXPECT_THAT(field.lines, IsEmpty());
  EXPECT_EQ(kind_of(rover), FixKind::Fixed);
  EXPECT_EQ(kind_of(tower), FixKind::Single);
}

TEST(HostBases, ABaseOnTheSameVehicleGivesItsHeading) {
  Field field;
  live::HostedReceiver& rear = field.add("rear", 1, {0, 0, 2}, "rtk: true, corrections: {from: front}");
  field.add("front", 1, {1, 1, 2});
  field.run(60);
  EXPECT_THAT(field.lines, IsEmpty());
  const positioning::Fix& fix = rear.step()->epoch.observed.fix;
  ASSERT_TRUE(fix.baseline && fix.baseline->moving_base);
  ASSERT_TRUE(encoding::heading_deg(fix, 3));
  // From the base to the receiver: to the south-west.
  EXPECT_NEAR(*encoding::heading_deg(fix, 3), 225, 1.5);
  EXPECT_NEAR(fix.baseline->length_m(), std::sqrt(2.0), 0.05);
  EXPECT_NE(kind_of(rear), FixKind::Fixed);  // its position is computed without corrections
}

TEST(HostBases, WaitsForABaseThatComesLaterAndGoes) {
  Field field;
  live::HostedReceiver& rover = field.add("rover", 1, {0, 0, 2}, "rtk: true, corrections: {from: tower}");
  field.run(2);
  ASSERT_EQ(field.lines.size(), 1U);
  EXPECT_THAT(field.lines.front(),
              HasSubstr("corrections of receiver 'tower', which is not in this world yet"));
  EXPECT_EQ(kind_of(rover), FixKind::Single);
  live::HostedReceiver& tower = field.add("tower", 2, {300, 0, 20});
  field.run(60);
  EXPECT_EQ(kind_of(rover), FixKind::Fixed);
  field.bases.remove(tower);
  field.receivers.back().reset();
  field.run(90);  // corrections are used for a minute
  EXPECT_EQ(kind_of(rover), FixKind::Single);
  field.add("tower", 2, {300, 0, 20});
  field.run(60);
  EXPECT_EQ(kind_of(rover), FixKind::Fixed);
}

TEST(HostBases, BeginsAnewWithTheWorld) {
  Field field;
  live::HostedReceiver& rover = field.add("rover", 1, {0, 0, 2}, "rtk: true, corrections: {from: tower}");
  field.add("tower", 2, {300, 0, 20});
  field.run(60);
  const Vector3d first = rover.step()->epoch.error_enu_m;
  field.now_ns = 0;
  field.run(60);
  EXPECT_EQ(rover.step()->epoch.error_enu_m, first);
}

TEST(HostBases, SaysWhatIsWrong) {
  Field field;
  field.add("rover", 1, {0, 0, 2}, "rtk: true, corrections: {from: tower}, seed: 5");
  field.add("tower", 2, {300, 0, 20});
  field.run(0.4);
  ASSERT_EQ(field.lines.size(), 1U);
  EXPECT_THAT(field.lines.front(), HasSubstr("another seed or start"));
}

}  // namespace
}  // namespace canyon::adapters
