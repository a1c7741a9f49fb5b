// Autopilots fly with Canyon as their only GPS: ArduPilot's SITL if CANYON_ARDUCOPTER names its program
// (.../build/sitl/bin/arducopter), PX4's if CANYON_PX4 names its build folder (.../build/px4_sitl_default).
// docs/autopilots.md. Else skipped with a message.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <variant>

#include "canyon/base/mavlink/frames.hpp"
#include "canyon/base/transport/transport.hpp"
#include "canyon/outputs/live/session.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/load_city.hpp"
#include "tests/support/autopilots.hpp"
#include "tests/support/program.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon {
namespace {

using std::chrono::seconds;
using ::testing::HasSubstr;

std::optional<std::string> from_environment(const char* name) {
  const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe)
  if (value == nullptr || !std::filesystem::exists(value)) return std::nullopt;
  return std::string(value);
}

/// The height of the true vehicle over the city's ground.
class Height final : public simulation::EpochSink {
 public:
  void write(const simulation::Epoch& epoch) override {
    if (std::isfinite(epoch.truth.position.height_m)) now_m = epoch.truth.position.height_m;
  }
  void finish() override {}
  std::atomic<double> now_m{0};
};

/// `canyon live` in this process: a receiver under an open sky about 22.296875 N, 114.171875 E.
class Live {
 public:
  explicit Live(const std::string& live) {
    const auto scenario = simulation::parse_scenario(
        "city: {open: true, origin: {latitude_deg: 22.296875, longitude_deg: 114.171875, height_m: 0}}\n"
        "sky: {nominal: true}\nstart: 2026-06-01T08:00:00Z\nrate_hz: 10\n"
        "receivers: [{name: gps, lever_arm: {up_m: 0.1}}]\nlive:\n" +
            live,
        "autopilots_test.yaml", {false});
    session_ = std::make_unique<live::Session>(
        scenario, std::make_shared<simulation::CityScene>(simulation::load_city(scenario)));
    thread_ = std::thread([this] {
      live::SessionOptions options;
      options.stop = &stop_;
      metrics_ = session_->run({&height_}, options);
    });
  }
  ~Live() { end(); }
  Live(const Live&) = delete;
  Live& operator=(const Live&) = delete;
  live::SessionMetrics end() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
    return metrics_;
  }
  [[nodiscard]] double height_m() const { return height_.now_m; }

 private:
  std::unique_ptr<live::Session> session_;
  std::atomic<bool> stop_{false};
  live::SessionMetrics metrics_;
  Height height_;
  std::thread thread_;
};

/// Calls `each` ten times per second until it returns true. Returns whether it did in time.
bool within(seconds limit, const std::function<bool()>& each) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (std::chrono::steady_clock::now() < end) {
    if (each()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return false;
}

/// A ground station on a port of the autopilot.
class Station {
 public:
  explicit Station(const std::string& address) : link_(transport::open_transport(address)) {}
  void command(std::uint16_t id, const std::array<double, 7>& parameters) {
    mavlink::CommandLong m;
    m.command = id;
    m.target_system = m.target_component = 1;
    m.parameters = parameters;
    const mavlink::Sender self{255, 190};
    link_->send(mavlink::encode(mavlink::Heartbeat{}, sequence_++, self));
    link_->send(mavlink::encode(m, sequence_++, self));
  }
  /// The last GPS_RAW_INT.
  const mavlink::GpsRawInt& gps() {
    link_->serve();
    for (const auto& received : link_->take_received()) {
      parser_.receive(received.bytes, [&](const mavlink::Frame& frame) {
        if (const auto* m = std::get_if<mavlink::GpsRawInt>(&frame.message)) gps_ = *m;
      });
    }
    return gps_;
  }

 private:
  std::unique_ptr<transport::Transport> link_;
  mavlink::MavlinkParser parser_;
  mavlink::GpsRawInt gps_;
  std::uint8_t sequence_ = 0;
};

constexpr std::uint16_t kSetMode = 176, kArm = 400, kTakeOff = 22, kMessageInterval = 511;

/// ArduCopter hovers five metres up.
void fly_arducopter(const std::string& parameters, const std::string& stream, const std::string& serial) {
  const auto program = from_environment("CANYON_ARDUCOPTER");
  if (!program) GTEST_SKIP() << "SKIPPED: CANYON_ARDUCOPTER names no ArduCopter for SITL";
  if (!test::isolated_network()) GTEST_SKIP() << "SKIPPED: no network of its own here";
  const test::TemporaryFolder folder;
  const std::string terminal = (folder / "gps").string();
  const auto put = [&](std::string text) {
    if (const auto at = text.find("TERMINAL"); at != std::string::npos) text.replace(at, 8, terminal);
    return text;
  };
  Live live("  poses: [{from: 'tcp-connect://127.0.0.1:5762', format: mavlink}]\n  streams: [" + put(stream) +
            "]\n");
  const auto defaults =
      std::filesystem::path(*program).parent_path() / "../../../Tools/autotest/default_params/copter.parm";
  const std::string own = (folder / "canyon.parm").string();
  std::ofstream(own) << "FRAME_CLASS 1\nFRAME_TYPE 1\nSIM_GPS1_ENABLE 0\n" << parameters;
  std::vector<std::string> command{*program, "--model", "quad", "--home", "22.296875,114.171875,0,0",
                                   "--wipe"};
  command.insert(command.end(), {"--defaults", defaults.string() + "," + own, "--serial0", "tcp:0"});
  if (!serial.empty()) command.insert(command.end(), {"--serial3", put(serial)});
  test::Companion copter(command, folder.path().string());
  Station station("tcp-connect://127.0.0.1:5760");
  EXPECT_TRUE(within(seconds(60), [&] {
    station.command(kMessageInterval, {24, 2e5});
    return station.gps().fix_type >= 3;
  }));
  EXPECT_GE(station.gps().satellites, 10);
  EXPECT_NEAR(station.gps().latitude_deg, 22.296875, 1e-4);
  EXPECT_NEAR(station.gps().longitude_deg, 114.171875, 1e-4);
  // It arms when its estimator accepts the GPS.
  EXPECT_TRUE(within(seconds(120),
                     [&] {
                       (void)station.gps();
                       station.command(kSetMode, {1, 4});  // GUIDED
                       station.command(kArm, {1});
                       station.command(kTakeOff, {0, 0, 0, 0, 0, 0, 5});
                       return live.height_m() > 4;
                     }))
      << "height " << live.height_m();
  EXPECT_TRUE(copter.running());
  const live::SessionMetrics metrics = live.end();
  EXPECT_GT(metrics.poses, 500U);
  EXPECT_EQ(metrics.missed, 0U);
}

TEST(Autopilots, ArduCopterFliesWithUbx) {
  fly_arducopter("GPS1_TYPE 2\n", "{format: ubx, to: 'pty:TERMINAL', latency_s: 0.1}", "uart:TERMINAL");
}

TEST(Autopilots, ArduCopterFliesWithGpsInput) {
  fly_arducopter("GPS1_TYPE 14\n",
                 "{format: gps_input, to: 'tcp-connect://127.0.0.1:5762', rate_hz: 5, latency_s: 0.1}", "");
}

TEST(Autopilots, Px4FliesWithItsUbloxDriver) {
  const auto build = from_environment("CANYON_PX4");
  if (!build) GTEST_SKIP() << "SKIPPED: CANYON_PX4 names no build of PX4's SITL";
  CANYON_NEEDS_PROGRAM("setpriv");
  if (!test::isolated_network()) GTEST_SKIP() << "SKIPPED: no network of its own here";
  const test::TemporaryFolder folder;
  // PX4 accepts at most 19 characters.
  const std::string terminal = "/tmp/gps" + std::to_string(getpid());
  // PX4's sockets and locks are machine-wide files, one set for each instance.
  const int instance = 100 + static_cast<int>(getpid() % 100);
  Live live("  poses: [{from: 'udp-listen://127.0.0.1:" + std::to_string(19410 + instance) +
            "', format: mavlink}]\n  streams: [{format: ubx, to: 'pty:" + terminal + "', latency_s: 0.1}]\n");
  // SIH's airframe without its own GPS.
  const std::string etc = (folder / "etc").string();
  std::filesystem::copy(*build + "/etc", etc, std::filesystem::copy_options::recursive);
  std::ofstream(etc + "/init.d-posix/airframes/22000_canyon_quadx")
      << ". ${R}etc/init.d-posix/airframes/10040_sihsim_quadx\nparam set-default SENS_EN_GPSSIM 0\n";
  std::ofstream(etc + "/init.d-posix/airframes/22000_canyon_quadx.post")
      << "gps start -d " << terminal << " -p ubx\n";
  // Its driver sets the machine's clock if permitted.
  test::Companion px4(
      {"setpriv", "--bounding-set", "-sys_time", "--inh-caps", "-sys_time", *build + "/bin/px4", "-i",
       std::to_string(instance), "-d", etc},
      folder.path().string(),
      {"PX4_SIM_MODEL=canyon_quadx", "PX4_HOME_LAT=22.296875", "PX4_HOME_LON=114.171875", "PX4_HOME_ALT=0"});
  const auto request = [&](const std::string& module, const std::string& words) {
    return test::run_program("timeout 10 " + *build + "/bin/px4-" + module + " --instance " +
                             std::to_string(instance) + " " + words + " 2>&1")
        .output;
  };
  EXPECT_TRUE(within(seconds(60), [&] {
    return request("gps", "status").find("status: OK") != std::string::npos;
  })) << request("gps", "status");
  // In newer PX4 the topic is sensor_gnss.
  const auto heard = [&] {
    return request("listener", "sensor_gps -n 1") + request("listener", "sensor_gnss -n 1");
  };
  EXPECT_TRUE(within(seconds(60), [&] { return heard().find("fix_type: 3") != std::string::npos; }))
      << heard();
  EXPECT_TRUE(within(seconds(120),
                     [&] {
                       (void)request("commander", "takeoff");
                       std::this_thread::sleep_for(seconds(1));
                       return live.height_m() > 2;
                     }))
      << "height " << live.height_m() << "\n"
      << request("commander", "check") << heard();
  EXPECT_TRUE(px4.running());
  EXPECT_EQ(live.end().missed, 0U);
}

}  // namespace
}  // namespace canyon
