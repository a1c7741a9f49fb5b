#include "canyon/outputs/live/session.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/transport/transport.hpp"
#include "canyon/outputs/encoding/stream.hpp"
#include "canyon/outputs/encoding/ubx/frame.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/local_connection.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::live {
namespace {

using simulation::Epoch;
using simulation::Scenario;
using ::testing::HasSubstr;

/// Stores epochs without the data they point to.
class EpochRecorder final : public simulation::EpochSink {
 public:
  void write(const Epoch& epoch) override {
    epochs.push_back(epoch);
    epochs.back().arrival = nullptr;
    if (each) each(epoch);
  }
  void finish() override { ++finished; }
  std::vector<Epoch> epochs;
  std::function<void(const Epoch&)> each;
  int finished = 0;
};

std::shared_ptr<simulation::CityScene> city_of(const Scenario& scenario) {
  return std::make_shared<simulation::CityScene>(simulation::load_city(scenario));
}

Scenario scenario(const std::string& live, const std::string& rest = "rate_hz: 10\n",
                  const std::string& receivers = "receivers: [{name: rover, profile: ublox-m8t}]\n") {
  return simulation::parse_scenario(
      "city: {synthetic: {seed: 3}}\nsky: {nominal: true, systems: [GPS]}\n"
      "start: 2026-06-01T12:00:00Z\n" +
          rest + receivers + live,
      "test.yaml", {false});
}

SessionMetrics run(const Scenario& s, EpochRecorder& kept, std::vector<std::string>* notes = nullptr,
                   const std::atomic<bool>* stop = nullptr) {
  Session session(s, city_of(s));
  SessionOptions options;
  options.stop = stop;
  options.note = [&](const std::string& line) {
    if (notes != nullptr) notes->push_back(line);
  };
  return session.run({&kept}, options);
}

const std::string kDrive =
    "rate_hz: 10\nduration_s: 2\n"
    "trajectory: {waypoints: [{east_m: -40, north_m: 1, up_m: 2}, {east_m: 60, north_m: 3, up_m: 2}]}\n";

// Both use the same code; only the input of the poses could differ.
TEST(Session, TrajectoryGivesTheNumbersOfSimulate) {
  const Scenario s = scenario("live: {speed: 20}\n", kDrive);
  EpochRecorder live, offline;
  const SessionMetrics metrics = run(s, live);
  const simulation::Simulation simulation(s, city_of(s));
  (void)simulation.run({&offline}, {});
  ASSERT_EQ(live.epochs.size(), 21U);
  ASSERT_EQ(offline.epochs.size(), 21U);
  EXPECT_EQ(metrics.epochs, 21U);
  EXPECT_EQ(metrics.missed, 0U);
  EXPECT_EQ(live.finished, 1);
  for (std::size_t i = 0; i < live.epochs.size(); ++i) {
    const Epoch &a = live.epochs[i], &b = offline.epochs[i];
    EXPECT_EQ(a.observed.time, b.observed.time);
    EXPECT_EQ(a.observed.visible, b.observed.visible);
    EXPECT_LE((a.truth_ecef - b.truth_ecef).norm(), 1e-6);
    ASSERT_EQ(a.observed.fix.solved(), b.observed.fix.solved());
    if (a.observed.fix.solved()) {
      EXPECT_LE((a.error_enu_m - b.error_enu_m).norm(), 1e-5);
    }
  }
}

// The vehicle's sensors are those of simulate, too.
TEST(Session, DeadReckoningAlongTheTrajectory) {
  const Scenario s = scenario(
      "live: {speed: 100}\n",
      "rate_hz: 5\nduration_s: 30\nsensors: {imu: {profile: automotive, rate_hz: 100}, wheels: {}}\n"
      "trajectory: {acceleration_mps2: 2, attitude: car, waypoints: [{east_m: -200, north_m: 1, up_m: 2}, "
      "{east_m: 200, north_m: 3, up_m: 2}]}\n",
      // GPS alone determines heights here to a hundred metres.
      "receivers: [{name: rover, profile: ublox-f9r, position_filter: {max_sigma_m: 500}, "
      "dead_reckoning: {max_sigma_m: 500}}]\n");
  EpochRecorder live, offline;
  (void)run(s, live);
  const simulation::Simulation simulation(s, city_of(s));
  (void)simulation.run({&offline}, {});
  ASSERT_EQ(live.epochs.size(), offline.epochs.size());
  std::size_t fused = 0;
  for (std::size_t i = 0; i < live.epochs.size(); ++i) {
    const positioning::Fix &a = live.epochs[i].observed.fix, &b = offline.epochs[i].observed.fix;
    ASSERT_EQ(a.kind(), b.kind()) << i;
    if (!a.solved()) continue;
    EXPECT_LE((a.position_ecef - b.position_ecef).norm(), 1e-3) << i;
    fused += a.fused() ? 1 : 0;
  }
  EXPECT_GT(fused, 50U);
}

TEST(Session, DeadReckoningNeedsSensors) {
  const Scenario s = scenario("live: {poses: [{from: 'udp-listen://127.0.0.1:0'}]}\n",
                              "sensors: {wheels: {}}\n", "receivers: [{name: rover, profile: ublox-f9r}]\n");
  EXPECT_THAT(test::refusal([&] { const Session session(s, city_of(s)); }),
              HasSubstr("the vehicle has no inertial sensor"));
}

TEST(Session, TakesAsMuchRealTimeAsItsSpeedSays) {
  const auto begin = std::chrono::steady_clock::now();
  EpochRecorder kept;
  (void)run(scenario("live: {speed: 4}\n", kDrive), kept);
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(500));
}

std::string pose_line(double t, double east) {
  return nlohmann::json{{"time_s", t}, {"position_m", {east, 1, 2}}, {"yaw_deg", 0}}.dump() + "\n";
}

TEST(Session, LogPosesComeAtTheirStampsAndGoIntoTheCity) {
  const test::TemporaryFolder folder;
  const std::string log = (folder / "log.jsonl").string();
  {
    std::ofstream file(log);
    for (int i = 0; i <= 100; ++i) file << pose_line(1000 + 0.01 * i, 0.05 * i);
  }
  // 5 m/s along the room's x axis, which is north in the city, twice as large there.
  EpochRecorder kept;
  const Scenario s = scenario("live: {clock: stamps, poses: [{from: 'file:" + log +
                              "', east_m: 10, north_m: 20, up_m: 1, heading_deg: 90, scale: 2}]}\n");
  const SessionMetrics metrics = run(s, kept);
  ASSERT_EQ(kept.epochs.size(), 11U);
  EXPECT_EQ(metrics.poses, 101U);
  EXPECT_NEAR(metrics.host_s, 1, 1e-9);
  const auto scene = city_of(s);
  for (std::size_t k = 0; k < kept.epochs.size(); ++k) {
    const double distance = 2 * 0.5 * static_cast<double>(k);
    const Eigen::Vector3d at = scene->city.frame.local_from_geodetic(kept.epochs[k].truth.position);
    EXPECT_LE((at - Eigen::Vector3d(10 - 2, 20 + distance, 1 + 4)).norm(), 1e-6) << k;
    if (k > 0) {
      EXPECT_NEAR(kept.epochs[k].truth.velocity_enu_mps.y(), 10, 1e-3) << k;
    }
    // Yaw is from east at its own position, where the meridian differs from the city's.
    EXPECT_NEAR(kept.epochs[k].truth.yaw_rad, M_PI / 2, 1e-6);
  }
}

/// A log of poses at 10 Hz, 5 m/s to the east, from each first to its last stamp [s].
std::string log_of(const test::TemporaryFolder& folder, const std::vector<std::pair<double, double>>& pieces,
                   const std::string& name = "pieces.jsonl", const std::string& also = "}") {
  const std::string path = (folder / name).string();
  std::ofstream file(path);
  for (const auto& [first_s, last_s] : pieces) {
    const auto add = [&file](double t_s) { file << pose_line(t_s, std::fmod(5 * t_s, 1000)); };
    for (int i = 0; first_s + 0.1 * i < last_s + 0.05; ++i) add(first_s + 0.1 * i);
    add(last_s + 0.01);
  }
  return "live: {clock: stamps, poses: [{from: 'file:" + path + "'" + also + "]}\n";
}

bool has_truth(const Epoch& epoch) {
  return std::isfinite(epoch.truth.position.latitude_rad);
}

TEST(Session, APauseInALogLosesNoPoseBehindIt) {
  const test::TemporaryFolder folder;
  // Both receivers of the vehicle have all instants.
  const Scenario s = scenario(log_of(folder, {{0, 3}, {23, 26.9}}), "rate_hz: 10\n",
                              "receivers: [{name: a, profile: ideal}, {name: b, profile: ideal}]\n");
  EpochRecorder kept;
  const SessionMetrics metrics = run(s, kept);
  ASSERT_EQ(kept.epochs.size(), 2 * 270U);
  EXPECT_EQ(metrics.no_truth, 2 * 194U);  // 3.6 to 22.9 s
  for (std::size_t i = 0; i < kept.epochs.size(); ++i) {
    const std::size_t k = i / 2;
    EXPECT_EQ(kept.epochs[i].receiver, i % 2);
    EXPECT_EQ(has_truth(kept.epochs[i]), k <= 35 || k >= 230) << k;
  }
}

TEST(Session, APauseOfPosesByStampsDoesNotEndTheFixes) {
  const int port = test::free_port();
  const Scenario s =
      scenario("live: {clock: stamps, poses: [{from: 'tcp://127.0.0.1:" + std::to_string(port) + "'}]}\n",
               "rate_hz: 10\nduration_s: 40\n");
  EpochRecorder kept;
  Session session(s, city_of(s));
  std::thread sender([&] {
    const test::LocalConnection poses(port);
    for (int i = 0; i <= 410; ++i)
      if (i <= 100 || i > 106) poses.send_text(pose_line(7000 + 0.1 * i, 0.1 * i));
  });
  (void)session.run({&kept}, {});
  sender.join();
  ASSERT_EQ(kept.epochs.size(), 401U);
  EXPECT_TRUE(std::all_of(kept.epochs.begin(), kept.epochs.end(), has_truth));
}

// A restarted simulator, or a log of two runs.
TEST(Session, StampsOfAnotherClockBeginTheRunAnew) {
  const test::TemporaryFolder folder;
  {
    const Scenario s = scenario(log_of(folder, {{500, 505}, {20, 22}, {20, 22}, {3e8, 3e8 + 1}}),
                                "rate_hz: 10\n", "receivers: [{name: rover, profile: ideal}]\n");
    EpochRecorder kept;
    std::vector<std::string> notes;
    (void)run(s, kept, &notes);
    ASSERT_EQ(kept.epochs.size(), 51U + 21 + 21 + 11);
    EXPECT_TRUE(std::all_of(kept.epochs.begin(), kept.epochs.end(), has_truth));
    for (std::size_t k = 0; k < 21; ++k) {
      const Epoch &a = kept.epochs[51 + k], &b = kept.epochs[72 + k];
      EXPECT_EQ(a.observed.time, kept.epochs[k].observed.time);
      EXPECT_EQ(a.observed.time, b.observed.time);
      ASSERT_EQ(a.observed.fix.solved(), b.observed.fix.solved());
      if (a.observed.fix.solved()) {
        EXPECT_EQ(a.observed.fix.position_ecef, b.observed.fix.position_ecef) << "as constructed";
      }
    }
    EXPECT_EQ(std::count_if(notes.begin(), notes.end(),
                            [](const std::string& note) {
                              return note.find("restarting the run at 2026-06-01") != std::string::npos;
                            }),
              1);
  }
}

// If other vehicles move, the run cannot follow a log whose clock jumps back.
TEST(Session, PosesOfAnotherClockAmongSeveralLogsAreTold) {
  const test::TemporaryFolder folder;
  const std::string first = (folder / "first.jsonl").string();
  (void)log_of(folder, {{500, 503}}, "first.jsonl");
  const Scenario s =
      scenario(log_of(folder, {{500, 502}, {20, 21}}, "pieces.jsonl",
                      ", receivers: [b]}, {from: 'file:" + first + "', receivers: [a]}"),
               "rate_hz: 10\n", "receivers: [{name: a, profile: ideal}, {name: b, profile: ideal}]\n");
  Session session(s, city_of(s));
  std::vector<std::string> warnings;
  SessionOptions options;
  options.warn = [&](const std::string& line) { warnings.push_back(line); };
  EpochRecorder kept;
  (void)session.run({&kept}, options);
  EXPECT_EQ(std::count_if(kept.epochs.begin(), kept.epochs.end(),
                          [](const Epoch& epoch) { return epoch.receiver == 0; }),
            31);
  ASSERT_THAT(warnings, ::testing::Contains(HasSubstr("12 poses were dropped: their timestamps jump")));
  EXPECT_EQ(std::count_if(warnings.begin(), warnings.end(),
                          [](const std::string& line) { return line.find("dropped") != std::string::npos; }),
            1);
}

// A stamp far ahead makes a million epochs without truth, block by block: memory is bounded, and the run
// can be ended.
TEST(Session, AStampFarAheadHoldsNobody) {
  const test::TemporaryFolder folder;
  const Scenario s =
      scenario(log_of(folder, {{0, 3}, {80'000, 80'003}}), "rate_hz: 100\nsensors: {imu: {}, wheels: {}}\n",
               "receivers: [{name: rover, profile: ublox-f9r}]\n");
  EpochRecorder kept;
  std::atomic<bool> stop{false};
  std::optional<std::chrono::steady_clock::time_point> stopped;
  kept.each = [&](const Epoch& epoch) {
    kept.epochs.pop_back();
    if (!has_truth(epoch) && !stop.exchange(true)) stopped = std::chrono::steady_clock::now();
  };
  (void)run(s, kept, nullptr, &stop);
  ASSERT_TRUE(stopped);
  EXPECT_LE(std::chrono::steady_clock::now() - *stopped, std::chrono::seconds(2));
}

TEST(Session, StandardFormsOfPosesByUdpMoveTheReceiver) {
  const int port = test::free_port();
  const std::string address = "udp-listen://127.0.0.1:" + std::to_string(port);
  const Scenario s = scenario("live: {wait_s: 0.2, poses: [{from: '" + address + "', timeout_s: 0.3}]}\n",
                              "rate_hz: 20\nduration_s: 2\n", "receivers: [{name: rover, profile: ideal}]\n");
  EpochRecorder kept;
  std::atomic<bool> over{false};
  std::thread driver([&] {
    const auto out = transport::open_transport("udp://127.0.0.1:" + std::to_string(port));
    // Poses for a second, then silence.
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; !over; ++i) {
      const double t = 0.01 * i;
      if (t > 1) break;
      std::this_thread::sleep_until(begin + std::chrono::milliseconds(10 * i));
      out->send(pose_line(t, 5 * t));
      if (i % 10 == 0) out->send("rubbish\n");
    }
  });
  std::vector<std::string> notes;
  const SessionMetrics metrics = run(s, kept, &notes);
  over = true;
  driver.join();
  EXPECT_EQ(metrics.epochs, 41U);
  EXPECT_GT(metrics.poses, 50U);
  EXPECT_GT(metrics.fixes, 0U);
  EXPECT_GT(metrics.no_truth, 5U);
  EXPECT_THAT(notes, ::testing::Contains(HasSubstr("not a JSON object")));
  // Silence does not freeze the fix.
  const Epoch& last = kept.epochs.back();
  EXPECT_FALSE(last.observed.fix.solved());
  EXPECT_TRUE(std::isnan(last.truth.position.latitude_rad));
  EXPECT_EQ(last.containment, raytrace::Containment::Unknown);
}

TEST(Session, SendsStreamsAndTakesCommands) {
  const int nmea = test::free_port(), control = test::free_port();
  const Scenario s = scenario(
      "live: {changes: true, control: 'tcp://127.0.0.1:" + std::to_string(control) +
          "', streams: [{format: nmea, to: 'tcp://127.0.0.1:" + std::to_string(nmea) + "', rate_hz: 5}]}\n",
      "rate_hz: 10\nduration_s: 1000\ntrajectory: {position: {east_m: 0, north_m: 0, up_m: 30}}\n");
  Session session(s, city_of(s));
  EpochRecorder kept;
  SessionMetrics metrics;
  std::thread server([&] { metrics = session.run({&kept}, {}); });
  {
    test::LocalConnection reader(nmea), commands(control);
    EXPECT_THAT(reader.read(200), HasSubstr("RMC,"));
    const auto response = [&](const std::string& line) {
      commands.send_text(line + "\n");
      std::string text;
      while (text.find('\n') == std::string::npos) {
        const std::string more = commands.read_some();
        if (more.empty()) break;
        text += more;
      }
      return nlohmann::json::parse(text, nullptr, false);
    };
    const auto status = response(R"({"command": "status"})");
    EXPECT_EQ(status["ok"], true) << status;
    EXPECT_EQ(status["receivers"][0]["name"], "rover");
    EXPECT_EQ(response("{]")["ok"], false);
    EXPECT_THAT(response(R"({"command": "statu"})")["cure"].get<std::string>(), HasSubstr("'status'"));
    EXPECT_EQ(response(R"({"command": "set", "options": {"clock.bias_s": 0.001}})")["ok"], true);
    EXPECT_THAT(response(R"({"command": "options"})")["options"].get<std::string>(),
                HasSubstr("clock.bias_s: 0.001"));
    EXPECT_EQ(response(R"({"command": "set", "options": {"clock.bias_s": "x"}})")["ok"], false);
    EXPECT_THAT(response(R"({"command": "set", "options": {"profile": "/etc/passwd"}})").dump(),
                HasSubstr("'/etc/passwd' is not in the scenario's folder"));
    // All receivers of a session share its schedule of epochs.
    EXPECT_THAT(response(R"({"command": "set", "options": {"rate_hz": 5}})").dump(),
                HasSubstr("rate_hz: cannot change while the session runs"));
    EXPECT_EQ(response(R"({"command": "stop"})")["ok"], true);
  }
  server.join();
  EXPECT_EQ(kept.finished, 1);
  EXPECT_EQ(metrics.epochs, kept.epochs.size());
}

// CFG-RST, a cold start: ephemerides are read again, which takes at least four strings of GLONASS and at most
// little more than a frame after the search (EphemerisAcquisition).
TEST(Session, UbxRestartsTheReceiver) {
  const int ubx = test::free_port();
  const Scenario s = scenario(
      "live: {speed: 20, streams: [{format: ubx, to: 'tcp://127.0.0.1:" + std::to_string(ubx) + "'}]}\n",
      "rate_hz: 10\nduration_s: 1000\ntrajectory: {position: {east_m: 0, north_m: 0, up_m: 300}}\n");
  Session session(s, city_of(s));
  EpochRecorder kept;
  std::atomic<bool> stop{false};
  std::atomic<std::size_t> epochs{0};
  kept.each = [&](const Epoch&) { ++epochs; };
  std::vector<std::string> notes;
  std::thread server([&] {
    SessionOptions options;
    options.stop = &stop;
    options.note = [&](const std::string& line) { notes.push_back(line); };
    (void)session.run({&kept}, options);
  });
  {
    test::LocalConnection driver(ubx);
    const auto read_until = [&](std::size_t count) {
      while (epochs < count && !driver.read_some().empty()) {
      }
    };
    read_until(50);
    driver.send_text(encoding::ubx::frame(0x0604, Payload().u2(0xFFFF).u1(2).u1(0).bytes()));
    read_until(epochs + 650);
  }
  stop = true;
  server.join();
  EXPECT_THAT(notes, testing::Contains(HasSubstr("rover: cold start")));
  const auto hit = std::find_if(kept.epochs.begin(), kept.epochs.end(),
                                [](const Epoch& epoch) { return !epoch.faults.empty(); });
  ASSERT_NE(hit, kept.epochs.end());
  EXPECT_EQ(hit->faults, std::vector<std::string>{"restart 1"});
  EXPECT_FALSE(hit->observed.fix.solved());
  const auto again =
      std::find_if(hit, kept.epochs.end(), [](const Epoch& epoch) { return epoch.observed.fix.solved(); });
  ASSERT_NE(again, kept.epochs.end());
  EXPECT_GE(again->observed.time - hit->observed.time, 8);
  EXPECT_LE(again->observed.time - hit->observed.time, 55);
}

TEST(Session, CommandsThatChangeNeedToBeSwitchedOn) {
  const int control = test::free_port();
  const Scenario s =
      scenario("live: {control: 'tcp://127.0.0.1:" + std::to_string(control) + "'}\n",
               "rate_hz: 10\nduration_s: 1000\ntrajectory: {position: {east_m: 0, north_m: 0, up_m: 30}}\n");
  Session session(s, city_of(s));
  std::atomic<bool> stop{false};
  std::thread server([&] {
    SessionOptions options;
    options.stop = &stop;
    (void)session.run({}, options);
  });
  test::LocalConnection commands(control);
  commands.send_text("{\"command\": \"stop\"}\n");
  EXPECT_THAT(commands.read_some(), HasSubstr("live.changes: true"));
  stop = true;
  server.join();
}

TEST(Session, RefusesSourcesThatDoNotFit) {
  const auto problem =
      [](const std::string& live, const std::string& rest = "rate_hz: 10\n",
         const std::string& receivers =
             "receivers: [{name: a, profile: ideal}, {name: b, profile: ideal}]\n") -> std::string {
    return test::refusal([&] {
      const Scenario s = scenario(live, rest, receivers);
      const Session session(s, city_of(s));
    });
  };
  EXPECT_THAT(problem("live: {poses: [{from: 'stdin:', receivers: [c]}]}\n"), HasSubstr("no receiver 'c'"));
  EXPECT_THAT(problem("live: {poses: [{from: 'stdin:', receivers: [a]}]}\n"),
              HasSubstr("no source moves receiver 'b'"));
  EXPECT_THAT(
      problem("live: {poses: [{from: 'stdin:', receivers: [a, b]}, {from: 'stdin:', receivers: [a]}]}\n"),
      HasSubstr("both move receiver 'a'"));
  EXPECT_THAT(problem("live: {speed: 2, poses: [{from: 'stdin:'}]}\n"),
              HasSubstr("poses arrive in real time"));
  EXPECT_THAT(problem("live: {poses: [{from: 'stdin:'}], streams: [{format: nmea, to: 'pty:'}]}\n"),
              HasSubstr("does not name its receiver"));
  EXPECT_THAT(problem("live: {poses: [{from: 'file:/nowhere'}]}\n"), HasSubstr("/nowhere"));
  EXPECT_THAT(problem("live: {poses: [{from: 'elsewhere'}]}\n"), HasSubstr("is not an address"));
}

TEST(Session, RefusesSpeedsThatLeadNowhere) {
  for (const double speed : {-3.0, 0.0, std::nan("")}) {
    Scenario s = scenario("", kDrive);
    s.live.emplace().speed = speed;
    EXPECT_THAT(test::refusal([&] { const Session session(s, city_of(s)); }), HasSubstr("live.speed"))
        << speed;
  }
}

TEST(Session, RefusesPosesFromWhereNoneCome) {
  const auto problem = [](const std::string& live) -> std::string {
    return test::refusal([&] {
      const Scenario s = scenario(live);
      const Session session(s, city_of(s));
    });
  };
  EXPECT_THAT(problem("live: {poses: [{from: 'udp://127.0.0.1:9001'}]}\n"),
              HasSubstr("an address to send to"));
  // An autopilot is queried over such an address and responds, like the receiver of a stream there.
  const std::string port = std::to_string(test::free_port());
  const auto opens = [](const std::string& live) {
    const Scenario s = scenario(live);
    const Session session(s, city_of(s));
  };
  EXPECT_NO_THROW(opens("live: {poses: [{from: 'udp://127.0.0.1:" + port + "', format: mavlink}]}\n"));
  EXPECT_NO_THROW(opens("live: {poses: [{from: 'udp://127.0.0.1:" + port +
                        "'}], streams: [{format: nmea, to: 'udp://127.0.0.1:" + port + "'}]}\n"));
}

TEST(Session, SaysThatNoPoseHasComeAndWhyThereIsNoFix) {
  const int control = test::free_port();
  const Scenario s = scenario(
      "live: {control: 'tcp://127.0.0.1:" + std::to_string(control) +
          "', poses: [{from: 'udp-listen://127.0.0.1:" + std::to_string(test::free_port()) + "'}]}\n",
      "rate_hz: 10\nduration_s: 5.5\n");
  EpochRecorder kept;
  std::vector<std::string> notes;
  SessionMetrics metrics;
  Session session(s, city_of(s));
  std::thread server([&] {
    SessionOptions options;
    options.note = [&](const std::string& line) { notes.push_back(line); };
    metrics = session.run({&kept}, options);
  });
  {
    test::LocalConnection commands(control);
    // Each kind of invalid command gets its own error.
    for (const auto& [line, what] : {std::pair("{", "is not JSON"), std::pair("[1]", "is not a JSON object"),
                                     std::pair("{\"comand\": \"status\"}", "has no key 'command'"),
                                     std::pair("{\"command\": 3}", "'command' is not a string")}) {
      commands.send_text(std::string(line) + "\n");
      EXPECT_THAT(commands.read_some(), HasSubstr(what)) << line;
    }
    std::string status;
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(5);
    while (status.find("reason") == std::string::npos && std::chrono::steady_clock::now() < deadline) {
      commands.send_text("{\"command\": \"status\"}\n");
      status = commands.read_some();
    }
    EXPECT_THAT(status, HasSubstr("\"reason\":\"no pose: the antenna's position is not known\""));
  }
  server.join();
  EXPECT_THAT(notes, ::testing::Contains(HasSubstr("none received yet")));
  EXPECT_EQ(metrics.no_fix, "rover: no pose: the antenna's position is not known");
}

TEST(Session, SaysThatPosesLieFarFromTheCity) {
  const test::TemporaryFolder folder;
  const std::string log = (folder / "log.jsonl").string();
  {
    std::ofstream file(log);
    for (int i = 0; i <= 20; ++i) {
      file << nlohmann::json{{"time_s", 0.01 * i},
                             {"latitude_deg", 47.4},
                             {"longitude_deg", 8.55},
                             {"height_m", 500}}
                  .dump()
           << "\n";
    }
  }
  EpochRecorder kept;
  std::vector<std::string> notes;
  (void)run(scenario("live: {clock: stamps, poses: [{from: 'file:" + log + "'}]}\n"), kept, &notes);
  EXPECT_THAT(notes, ::testing::Contains(HasSubstr("km from the city's origin")));
}

std::size_t lines_of(const std::string& path) {
  std::ifstream file(path);
  std::size_t lines = 0;
  for (std::string line; std::getline(file, line);) ++lines;
  return lines;
}

/// A log of 21 poses, 0.1 s apart, whose eleventh is `bad`.
std::string log_with(const std::string& path, const std::string& bad) {
  std::ofstream file(path);
  for (int i = 0; i <= 20; ++i) {
    file << (i == 10 ? bad : fmt::format("{{\"time_s\": {:.1f}, \"position_m\": [{}, 1, 2]}}", 0.1 * i, i))
         << "\n";
  }
  return path;
}

TEST(Session, APoseOfNoAntennaDoesNotEndTheRun) {
  const test::TemporaryFolder folder;
  for (const char* bad :
       {"{\"time_s\": 1, \"position_m\": [1, 1, 2], \"velocity_mps\": [1e7, 0, 0]}",
        "{\"time_s\": 1, \"position_m\": [1, 1, 1e30]}",
        "{\"time_s\": 1, \"position_m\": [1, 1, 2], \"rates_radps\": [1e30, 1e30, 1e30]}"}) {
    const std::string log = log_with((folder / "log.jsonl").string(), bad);
    const std::string csv = (folder / "epochs.csv").string();
    EpochRecorder kept;
    (void)run(
        scenario(
            fmt::format("live: {{poses: [{{from: 'file:{}'}}], speed: 100, streams: [{{format: epochs_csv, "
                        "to: 'file:{}'}}]}}\n",
                        log, csv),
            "rate_hz: 10\n", "receivers: [{name: rover, profile: ideal, lever_arm: {forward_m: 1}}]\n"),
        kept);
    EXPECT_EQ(kept.epochs.size(), 21U) << bad;
    EXPECT_EQ(lines_of(csv), 22U) << bad;
  }
}

TEST(Session, EpochsUntilAFailureAreInTheFiles) {
  const test::TemporaryFolder folder;
  const std::string csv = (folder / "epochs.csv").string();
  EpochRecorder kept;
  kept.each = [&](const Epoch&) {
    if (kept.epochs.size() == 11) throw InputError("something failed");
  };
  EXPECT_THROW(
      (void)run(
          scenario("live: {speed: 100, streams: [{format: epochs_csv, to: 'file:" + csv + "'}]}\n", kDrive),
          kept),
      InputError);
  EXPECT_EQ(kept.finished, 1);
  EXPECT_EQ(lines_of(csv), 12U);
}

// A restarted run continues in time with a vehicle that continues its flight.
TEST(Session, ResumesAtThePosesStamp) {
  const int port = test::free_port();
  const Scenario s = scenario(
      "live: {resume: true, poses: [{from: 'udp-listen://127.0.0.1:" + std::to_string(port) + "'}]}\n",
      "rate_hz: 10\nduration_s: 1.5\n");
  EpochRecorder kept;
  std::vector<std::string> notes;
  std::atomic<bool> over{false};
  std::thread driver([&] {
    const auto out = transport::open_transport("udp://127.0.0.1:" + std::to_string(port));
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; !over; ++i) {
      out->send(pose_line(1000 + 0.01 * i, 1));
      std::this_thread::sleep_until(begin + std::chrono::milliseconds(10 * (i + 1)));
    }
  });
  (void)run(s, kept, &notes);
  over = true;
  driver.join();
  const geodesy::GpsTime start = geodesy::parse_time("2026-06-01T12:00:00Z");
  EXPECT_GE(kept.epochs.size(), 10U);
  EXPECT_GE(kept.epochs.back().observed.time - start, 1000);
  EXPECT_LT(kept.epochs.back().observed.time - start, 1002);
  EXPECT_THAT(notes, ::testing::Contains(HasSubstr("from the first pose's timestamp")));
  EXPECT_FALSE(std::isnan(kept.epochs.back().truth.position.latitude_rad));
}

TEST(Session, StaggeredReceiversHaveInstantsOfTheirOwn) {
  const Scenario s = scenario("live: {speed: 20, stagger: true}\n", kDrive,
                              "receivers: [{name: a, profile: ideal}, {name: b, profile: ideal}]\n");
  EpochRecorder kept;
  (void)run(s, kept);
  ASSERT_EQ(kept.epochs.size(), 42U);
  for (const Epoch& epoch : kept.epochs) {
    const double tenths = (epoch.observed.time - kept.epochs.front().observed.time) * 10;
    EXPECT_NEAR(tenths - std::floor(tenths + 1e-6), epoch.receiver == 0 ? 0 : 0.5, 1e-6);
  }
}

const std::string kRoverAndBase =
    "receivers:\n"
    "  - {name: rover, profile: ideal, independent_noise: true, corrections: {from: base}}\n"
    "  - {name: base, profile: ideal, independent_noise: true, fixed: {east_m: 0, north_m: 0, up_m: 220}}\n";

// The base's epoch of an instant is before the rover's, in any order of vehicles.
TEST(Session, CorrectionsAreThoseOfTheSameInstant) {
  const Scenario s = scenario("live: {speed: 20}\n", kDrive, kRoverAndBase);
  EpochRecorder live, offline;
  (void)run(s, live);
  const simulation::Simulation simulation(s, city_of(s));
  (void)simulation.run({&offline}, {});
  int differential = 0;
  for (const std::size_t receiver : {0U, 1U}) {
    for (EpochRecorder* kept : {&live, &offline}) {
      ASSERT_EQ(std::count_if(kept->epochs.begin(), kept->epochs.end(),
                              [&](const Epoch& epoch) { return epoch.receiver == receiver; }),
                21);
    }
  }
  for (const Epoch& a : live.epochs) {
    const auto b = std::find_if(offline.epochs.begin(), offline.epochs.end(), [&](const Epoch& epoch) {
      return epoch.receiver == a.receiver && epoch.observed.time == a.observed.time;
    });
    ASSERT_NE(b, offline.epochs.end());
    EXPECT_EQ(a.observed.fix.kind(), b->observed.fix.kind());
    ASSERT_EQ(a.observed.fix.solved(), b->observed.fix.solved());
    if (!a.observed.fix.solved()) continue;
    EXPECT_LE((a.error_enu_m - b->error_enu_m).norm(), 1e-5);
    if (a.observed.fix.kind() != positioning::FixKind::Differential) continue;
    ++differential;
    EXPECT_LT(*a.observed.fix.correction_age_s, 1e-3);
  }
  EXPECT_GE(differential, 5);
}

/// A rover and a base in an open field, whose RTCM goes to a port.
Scenario rtk_field(int port, const std::string& rover, const std::string& streams) {
  return simulation::parse_scenario(
      "city: {open: true, origin: {latitude_deg: 48, longitude_deg: 11, height_m: 500}}\n"
      "sky: {nominal: true, systems: [GPS, Galileo]}\nstart: 2026-06-01T12:00:00Z\nrate_hz: 5\nduration_s: "
      "18\n"
      "trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2}, {east_m: 200, north_m: 3, up_m: 2}]}\n"
      "receivers:\n  - {name: rover, profile: ublox-f9p, rtk: true" +
          rover +
          "}\n  - {name: base, profile: survey, fixed: {east_m: 400, north_m: 300, up_m: 2}}\n"
          "live: {speed: 4, streams: [{receiver: base, format: rtcm, to: 'tcp://127.0.0.1:" +
          std::to_string(port) + "'}" + streams + "]}\n",
      "test.yaml", {false});
}

int fixed_epochs(const EpochRecorder& kept) {
  return static_cast<int>(std::count_if(kept.epochs.begin(), kept.epochs.end(), [](const Epoch& epoch) {
    return epoch.receiver == 0 && epoch.observed.fix.kind() == positioning::FixKind::Fixed;
  }));
}

// Corrections by an address: the rover reads the port of the base's RTCM, with the base's position every 10
// s.
TEST(Session, ARoverReadsAStreamOfRtcm) {
  const int port = canyon::test::free_port();
  EpochRecorder kept;
  (void)run(
      rtk_field(port, ", corrections: {from: 'tcp-connect://127.0.0.1:" + std::to_string(port) + "'}", ""),
      kept);
  EXPECT_GE(fixed_epochs(kept), 10);
}

// Unusable input, here bytes of another format, is reported once with the password hidden.
TEST(Session, AStreamThatIsNotRtcmIsTold) {
  const int port = canyon::test::free_port();
  Scenario s = rtk_field(
      port, ", corrections: {from: 'ntrip://me:SECRET@127.0.0.1:" + std::to_string(port) + "/M'}", "");
  s.live->streams.front() =
      encoding::parse_stream("base/nmea=ntrip-caster://127.0.0.1:" + std::to_string(port) + "/M");
  s.duration_s = 4;
  std::vector<std::string> warned;
  Session session(s, city_of(s));
  SessionOptions options;
  options.warn = [&](const std::string& line) { warned.push_back(line); };
  (void)session.run({}, options);
  EXPECT_THAT(warned, Contains(AllOf(HasSubstr("rover: "), HasSubstr("are not a valid RTCM 3 frame"),
                                     Not(HasSubstr("SECRET")))));
}

// The base is 30 km away. The caster computes a station at the position in the rover's GGA sentence.
TEST(Session, ACasterServesAVirtualStationAtTheRoversPlace) {
  const int port = canyon::test::free_port(), vrs_port = canyon::test::free_port();
  const std::string caster = "127.0.0.1:" + std::to_string(vrs_port) + "/VRS";
  Scenario s = rtk_field(
      port, ", corrections: {from: 'ntrip://" + caster + "'}",
      ", {receiver: base, format: rtcm, to: 'ntrip-caster://" + caster + "', virtual_station: true}");
  s.receivers[1].fixed->local_m->x() = 30e3;
  EpochRecorder kept;
  (void)run(s, kept);
  EXPECT_GE(fixed_epochs(kept), 10);
  for (const Epoch& epoch : kept.epochs) {
    if (!epoch.observed.fix.baseline) continue;
    EXPECT_LT(epoch.observed.fix.baseline->length_m(), 220);
    EXPECT_LT(epoch.error_enu_m.head<2>().norm(), 0.5);
  }
}

// A flight stack forwards the base's RTCM to its receiver's UBX line: without it no RTK.
TEST(Session, RtcmComesOverTheUbxLine) {
  const int port = canyon::test::free_port(), ubx_port = canyon::test::free_port();
  const std::string ubx =
      ", {receiver: rover, format: ubx, to: 'tcp://127.0.0.1:" + std::to_string(ubx_port) + "'}";
  EpochRecorder without;
  (void)run(rtk_field(port, "", ubx), without);
  EXPECT_EQ(fixed_epochs(without), 0);
  EpochRecorder kept;
  std::atomic<bool> over = false;
  std::thread stack([&] {
    const auto from = transport::open_transport("tcp-connect://127.0.0.1:" + std::to_string(port));
    const auto to = transport::open_transport("tcp-connect://127.0.0.1:" + std::to_string(ubx_port));
    while (!over) {
      from->serve();
      to->serve();
      for (const transport::Received& received : from->take_received()) to->send(received.bytes);
      std::this_thread::yield();
    }
  });
  (void)run(rtk_field(port, "", ubx), kept);
  over = true;
  stack.join();
  EXPECT_GE(fixed_epochs(kept), 8);
}

// With stamps a base advances with the poses, and no further.
TEST(Session, ByStampsABaseGoesAlongWithThePoses) {
  const test::TemporaryFolder folder;
  const std::string log = (folder / "log.jsonl").string();
  {
    std::ofstream file(log);
    for (int i = 0; i <= 100; ++i) file << pose_line(1000 + 0.01 * i, 0.05 * i);
  }
  EpochRecorder kept;
  (void)run(scenario("live: {clock: stamps, poses: [{from: 'file:" + log + "'}]}\n", "rate_hz: 10\n",
                     kRoverAndBase),
            kept);
  ASSERT_EQ(kept.epochs.size(), 22U);
  for (std::size_t i = 0; i < kept.epochs.size(); ++i) {
    EXPECT_EQ(kept.epochs[i].receiver, i % 2 == 0 ? 1U : 0U);
    EXPECT_EQ(kept.epochs[i].observed.time, kept.epochs[i - i % 2].observed.time);
  }
}

}  // namespace
}  // namespace canyon::live
