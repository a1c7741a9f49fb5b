// A complete host without SDF: settings in YAML, a world of two boxes, a clock and a car.
#include "adapters/common/host_settings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "adapters/common/testing/box_world.hpp"
#include "adapters/common/testing/street.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/outputs/encoding/ubx/frame.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/local_connection.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/rinex_sample.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::adapters {
namespace {

using Eigen::Vector3d;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

HostSettings settings_of(const std::string& yaml) {
  options::Document document;
  document.file = "host.yaml";
  HostSettings settings;
  options::read_yaml(yaml, document, "it needs a sky", settings);
  return settings;
}

const std::string kStreetSettings =
    "{profile: ideal, rate_hz: 5, origin_latitude: 22.3, origin_longitude: 114.17, lever_arm: {up_m: 0.5}, "
    "sky: {frozen: {satAzimuth: " +
    test::street_angles(&test::StreetSatellite::azimuth_deg) +
    ", satElevation: " + test::street_angles(&test::StreetSatellite::elevation_deg) + "}}, %}";

std::string street_settings(const std::string& more) {
  std::string text = kStreetSettings;
  return text.replace(text.find('%'), 1, more);
}

/// A record without its numbers.
std::string damaged() {
  std::string record = test::kG05;
  return record.replace(0, 3, "G06").replace(100, 40, 40, 'x');
}

class Collector final : public live::EpochPublisher {
 public:
  struct ObservedEpochs {
    std::int64_t sim_time_ns;
    bool epoch;
    std::string reason;
    Vector3d antenna_world_m;
    std::vector<double> ranges_m;
    std::vector<receiver::SatelliteObservation> satellites;
  };
  explicit Collector(std::vector<ObservedEpochs>& seen, int& resets) : seen_(seen), resets_(resets) {}
  void publish(const live::ReceiverReport& report) override {
    seen_.push_back({report.sim_time_ns, report.step != nullptr, report.reason, report.antenna_world_m,
                     report.scan_ranges_m,
                     report.step != nullptr ? report.step->epoch.observed.satellites
                                            : std::vector<receiver::SatelliteObservation>{}});
  }
  void reset() override { ++resets_; }

 private:
  std::vector<ObservedEpochs>& seen_;
  int& resets_;
};

/// The car of test::street_satellites() between its two walls, 30 m high.
class Host {
 public:
  explicit Host(const std::string& more = "") {
    const HostSettings settings = settings_of(street_settings(more));
    const live::WorldFrame frame = world_frame(std::nullopt, settings, lines);
    auto world = std::make_unique<test::BoxWorld>();
    world->boxes = {{1, {true, {7.5, 0, 15}, {1, 400, 30}, "east"}},
                    {2, {true, {-13.5, 0, 15}, {1, 400, 30}, "west"}}};
    ReceiverIdentity identity;
    identity.model = "car";
    identity.link = "car::roof";
    identity.plugin = "gnss";
    receiver.emplace(setup_of(settings, identity, frame,
                              geodesy::gps_from_utc(geodesy::CalendarTime{2026, 6, 1, 8, 0, 0}), 0,
                              [this](live::Severity tone, const std::string& line) {
                                lines.push_back((tone == live::Severity::Error ? "error: " : "") + line);
                              }));
    receiver->add(std::make_unique<Collector>(seen, resets));
    receiver->set_scene(std::make_shared<live::WorldScene>(std::move(world),
                                                           live::WorldScene::Options{"street", false, frame}),
                        std::nullopt);
  }
  void update(std::int64_t now_ms) {
    receiver->update(now_ms * 1'000'000, [this](std::string& reason) -> std::optional<simulation::RigidPose> {
      if (broken) throw std::runtime_error("the engine is gone");
      if (lost) {
        reason = "no pose has come";
        return std::nullopt;
      }
      simulation::RigidPose truth;
      truth.position_m = position;
      return truth;
    });
  }

  std::vector<std::string> lines;
  std::vector<Collector::ObservedEpochs> seen;
  int resets = 0;
  bool lost = false, broken = false;
  Vector3d position{0, 0, 1.5};
  std::optional<live::HostedReceiver> receiver;
};

// Options common to all hosts have one name; older names are still accepted.
TEST(HostSettings, OptionsOfAllHostsHaveOneName) {
  const HostSettings settings =
      settings_of(street_settings("frame_id: gnss, streams: \"nmea=file:a.nmea\", pose: {timeout_s: 2}"));
  EXPECT_EQ(settings.frame_id, "gnss");
  EXPECT_THAT(settings.streams, ElementsAre("nmea=file:a.nmea"));
  EXPECT_EQ(settings.pose_timeout_s, 2);
  EXPECT_EQ(settings_of(street_settings("pose_timeout_s: 3")).pose_timeout_s, 3);
}

TEST(HostSettings, AreReadFromAnyTree) {
  const HostSettings settings = settings_of(street_settings(
      "ros: {namespace: /car}, publishers: {px4: true, stream: [\"nmea=file:a.nmea\"]}, geometry: "
      "visual, name: roof"));
  EXPECT_EQ(settings.ros_namespace, "/car");
  EXPECT_TRUE(settings.publish_px4 && settings.visual_geometry && settings.named);
  EXPECT_THAT(settings.streams, ElementsAre("nmea=file:a.nmea"));
  EXPECT_NEAR(geodesy::degrees(settings.origin->latitude_rad), 22.3, 1e-12);
  EXPECT_EQ(settings.live.rate_hz, 5);
  EXPECT_EQ(settings.live.receiver().lever_arm_m.z(), 0.5);
  try {
    (void)settings_of(street_settings("geometry: solid"));
    FAIL();
  } catch (const InputError& e) {
    EXPECT_EQ(e.file(), "host.yaml");
    EXPECT_THAT(e.problem(), HasSubstr("geometry: 'solid' is unknown"));
  }
}

// Excess paths of the closed forms of test::street_satellites().
TEST(HostedReceiver, ObservesTheStreetWithoutSdf) {
  Host host("output_type: sensor_msgs/LaserScan");
  for (int ms = 0; ms <= 1000; ms += 100) host.update(ms);
  ASSERT_EQ(host.seen.size(), 6U) << "5 Hz";
  EXPECT_EQ(host.seen[1].sim_time_ns, 200'000'000);
  for (const Collector::ObservedEpochs& seen : host.seen) {
    ASSERT_TRUE(seen.epoch) << seen.reason;
    EXPECT_EQ(seen.antenna_world_m, Vector3d(0, 0, 2));
    ASSERT_EQ(seen.satellites.size(), test::street_satellites().size());
    ASSERT_EQ(seen.ranges_m.size(), 2 * seen.satellites.size());
    for (std::size_t i = 0; i < seen.satellites.size(); ++i) {
      const test::StreetSatellite& expected = test::street_satellites()[i];
      const bool blocked = expected.specular_m < 0;
      EXPECT_EQ(seen.satellites[i].visibility == propagation::Visibility::Blocked, blocked) << i;
      EXPECT_NEAR(seen.satellites[i].excess_m, blocked ? 0 : expected.specular_m, 1e-4) << i;
    }
    // Straight to the eastern wall, and back to the western one: 7 m and 13 m away on the ground.
    EXPECT_NEAR(seen.ranges_m[0], 7 / std::cos(geodesy::radians(45)), 1e-4);
    EXPECT_NEAR(seen.ranges_m[1], 13 / std::cos(geodesy::radians(45)), 1e-4);
  }
  EXPECT_EQ(host.receiver->name(), "plugin 'gnss' of model 'car'");
  EXPECT_THAT(host.lines, IsEmpty());
}

TEST(HostedReceiver, SaysWhyThereIsNoEpochAndGoesOn) {
  Host host;
  host.lost = true;
  host.update(0);
  host.lost = false;
  host.broken = true;
  host.update(200);
  host.update(400);
  host.broken = false;
  host.update(600);
  ASSERT_EQ(host.seen.size(), 4U);
  EXPECT_FALSE(host.seen[0].epoch);
  EXPECT_EQ(host.seen[0].reason, "no pose has come");
  EXPECT_EQ(host.seen[2].reason, "the engine is gone");
  EXPECT_TRUE(host.seen[3].epoch);
  EXPECT_THAT(host.lines, ElementsAre("error: plugin 'gnss' of model 'car': the engine is gone")) << "once";
}

TEST(HostedReceiver, AnOutputThatFailsEndsAlone) {
  struct Failing final : live::EpochPublisher {
    explicit Failing(int& n) : calls(n) {}
    void publish(const live::ReceiverReport&) override {
      ++calls;
      throw std::runtime_error("no ink");
    }
    int& calls;
  };
  Host host;
  int calls = 0;
  host.receiver->add(std::make_unique<Failing>(calls), "the plotter");
  for (const int ms : {0, 200, 400}) host.update(ms);
  EXPECT_EQ(calls, 1);
  EXPECT_EQ(host.seen.size(), 3U);
  EXPECT_THAT(host.lines, ElementsAre("plugin 'gnss' of model 'car': the plotter: no ink"));
}

TEST(HostedReceiver, BeginsAnewWhereTimeGoesBack) {
  Host host;
  for (const int ms : {0, 200, 400, 0}) host.update(ms);
  ASSERT_EQ(host.seen.size(), 4U);
  EXPECT_EQ(host.resets, 1);
  ASSERT_TRUE(host.seen[3].epoch);
  for (std::size_t i = 0; i < host.seen[0].satellites.size(); ++i) {
    EXPECT_EQ(host.seen[3].satellites[i].excess_m, host.seen[0].satellites[i].excess_m);
  }
}

TEST(HostedReceiver, SaysThatItWasPutElsewhere) {
  Host host;
  for (int ms = 0; ms <= 2000; ms += 100) {
    if (ms == 1000) host.position.y() = 40;
    host.update(ms);
  }
  EXPECT_THAT(host.lines, ElementsAre(AllOf(HasSubstr("plugin 'gnss' of model 'car': "),
                                            HasSubstr("jumped by 40 m at 1.0 s"))));
}

// 5 Hz on the world's grid, then 2 Hz on it from 0.7 s on.
TEST(HostedReceiver, ChangesItsRateOnTheGrid) {
  Host host;
  for (int ms = 0; ms <= 2500; ms += 50) {
    host.update(ms);
    if (ms != 700 && ms != 1200) continue;
    const live::OptionsRequest request{live::OptionsRequest::Kind::Set, "",
                                       ms == 700 ? "rate_hz: 2" : "elevation_mask_deg: 7"};
    EXPECT_THAT(live::handle_request(request, {host.receiver->receiver_handle("car")}),
                HasSubstr("set car: "));
  }
  std::vector<std::int64_t> times_ms;
  for (const Collector::ObservedEpochs& seen : host.seen) times_ms.push_back(seen.sim_time_ns / 1'000'000);
  EXPECT_THAT(times_ms, ElementsAre(0, 200, 400, 600, 1000, 1500, 2000, 2500));
}

TEST(HostedReceiver, NamesItsModelWhereAFileIsWrong) {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "sky.nav") << "no navigation file\n";
  HostSettings settings;
  settings.live.sky.nominal = false;
  settings.live.sky.navigation = {folder / "sky.nav"};
  ReceiverIdentity identity;
  identity.model = "car";
  identity.plugin = "gnss";
  try {
    const live::HostedReceiver receiver(setup_of(settings, identity, {}, geodesy::GpsTime::from_week(2300, 0),
                                                 0, [](live::Severity, const std::string&) {}));
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), AllOf(testing::StartsWith("plugin 'gnss' of model 'car': "), HasSubstr("sky.nav")));
  }
}

// The sky is shared: its deficiencies are reported once per world.
TEST(HostedReceiver, ReceiversOfAWorldSayTheSkysWarningsOnce) {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "damaged.nav") << test::kRinex3Header + test::kG05 + test::kE11 + damaged();
  HostSettings settings;
  settings.live.sky.nominal = false;
  settings.live.sky.navigation = {folder / "damaged.nav"};
  const auto shared = std::make_shared<live::SkyWarnings>();
  std::vector<std::string> lines;
  std::vector<std::unique_ptr<live::HostedReceiver>> receivers;
  for (const char* name : {"a", "b", "c"}) {
    ReceiverIdentity identity;
    identity.model = name;
    identity.plugin = "gnss";
    live::HostSetup setup =
        setup_of(settings, identity, {}, geodesy::gps_from_utc(geodesy::CalendarTime{2019, 4, 28, 12, 10, 0}),
                 0, [&](live::Severity, const std::string& line) { lines.push_back(line); });
    setup.sky_warnings = shared;
    receivers.push_back(std::make_unique<live::HostedReceiver>(std::move(setup)));
  }
  EXPECT_THAT(lines, ElementsAre(AllOf(HasSubstr("damaged.nav"), Not(HasSubstr("model")))));
}

TEST(HostedReceiver, NoStreamReplacesAFileThatWasRead) {
  const test::TemporaryFolder folder;
  const auto sky = folder / "sky.nav";
  std::ofstream(sky) << test::kRinex3Header + test::kG05 + test::kE11 + damaged();
  HostSettings settings;
  settings.live.sky.nominal = false;
  settings.live.sky.navigation = {sky};
  settings.streams = {"nmea=file:" + sky.string()};
  ReceiverIdentity identity;
  identity.plugin = "gnss";
  EXPECT_THAT(
      test::refusal([&] {
        const live::HostedReceiver receiver(setup_of(
            settings, identity, {}, geodesy::gps_from_utc(geodesy::CalendarTime{2019, 4, 28, 12, 10, 0}), 0,
            [](live::Severity, const std::string&) {}));
      }),
      HasSubstr("is an input of this run and would be replaced"));
  std::string kept;
  std::getline(std::ifstream(sky), kept);
  EXPECT_THAT(kept, testing::StartsWith("     3.04"));
}

// A receiver's settings choose its scene; receivers with the same settings share it.
TEST(HostedReceiver, ItsSettingsChooseTheScene) {
  HostSettings settings;
  const live::WorldScene::Options first = scene_options("street", settings, {});
  settings.live.seed = 2;
  EXPECT_FALSE(scene_options("street", settings, {}) == first) << "other facades";
  settings.facades.mix = city::FacadeMix::AsGiven;
  const live::WorldScene::Options plain = scene_options("street", settings, {});
  settings.live.seed = 1;
  EXPECT_TRUE(scene_options("street", settings, {}) == plain);
  EXPECT_FALSE(plain == first);
}

// A driver on the line gets its responses between two epochs, and its commands reach the receiver.
TEST(HostedReceiver, ServesADriverBetweenEpochs) {
  const int port = test::free_port();
  Host host("streams: \"ubx=tcp://127.0.0.1:" + std::to_string(port) + "\"");
  host.update(0);
  test::LocalConnection driver(port);
  host.update(200);
  std::string bytes = driver.read_some();
  EXPECT_THAT(bytes, HasSubstr(encoding::ubx::frame(0x0107, "").substr(0, 4))) << "NAV-PVT of an epoch";
  const std::string answer_begins = encoding::ubx::frame(0x0A04, "").substr(0, 4);  // MON-VER
  driver.send_text(encoding::ubx::frame(0x0A04, ""));
  for (bytes.clear(); bytes.find(answer_begins) == std::string::npos;) {
    host.receiver->serve(200'000'000);
    pollfd some{driver.handle(), POLLIN, 0};
    if (poll(&some, 1, 10) == 1) bytes += driver.read_some();
  }
  EXPECT_EQ(host.seen.size(), 2U) << "no epoch has passed";
  driver.send_text(encoding::ubx::frame(0x0604, Payload().u2(0xFFFF).u1(2).u1(0).bytes()));
  for (int ms = 250; host.lines.empty() && ms < 20'000; ms += 50) host.update(ms);
  EXPECT_THAT(host.lines, ElementsAre(HasSubstr("cold start, requested over its line: fault 'restart 1'")));
}

TEST(HostedReceiver, OneSettingServesEachModel) {
  const test::TemporaryFolder folder;
  { const Host host("streams: \"epochs_csv=file:" + (folder / "{model}.csv").string() + "\""); }
  EXPECT_TRUE(std::filesystem::exists(folder / "car.csv"));
}

TEST(HostedReceiver, WarnsOfAWorldThatLiesNowhere) {
  HostSettings settings;
  std::vector<std::string> warnings;
  const live::WorldFrame frame = world_frame(live::HostOrigin{{}, 0.5}, settings, warnings);
  EXPECT_EQ(frame.heading_rad, 0.5);
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("latitude 0, longitude 0")));
}

}  // namespace
}  // namespace canyon::adapters
