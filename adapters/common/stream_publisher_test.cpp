#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <future>

#include "adapters/common/testing/sample_report.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/outputs/encoding/nmea.hpp"
#include "canyon/outputs/live/epoch_publisher.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/local_connection.hpp"
#include "tests/support/program.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::adapters {
namespace {

using canyon::test::free_port;
using canyon::test::SampleReport;
using ::testing::HasSubstr;

class StreamPublisher : public ::testing::Test {
 protected:
  std::unique_ptr<live::EpochPublisher> make() {
    return live::make_stream_publisher("nmea_port", "nmea=tcp://127.0.0.1:" + std::to_string(port), {{}});
  }
  SampleReport sample;
  const int port = free_port();
};

TEST_F(StreamPublisher, SendsEachEpochAsNmea) {
  const auto publisher = make();
  publisher->publish(sample.report);  // no client
  canyon::test::LocalConnection client(port);
  live::ReceiverReport no_truth = sample.report;
  no_truth.step = nullptr;
  publisher->publish(no_truth);
  const SampleReport no_fix(false);
  publisher->publish(no_fix.report);
  publisher->reset();
  publisher->publish(sample.report);
  const std::string expected =
      encoding::nmea_epoch(no_fix.step.epoch) + encoding::nmea_epoch(sample.step.epoch);
  EXPECT_EQ(client.read(expected.size()), expected);
}

TEST_F(StreamPublisher, SendsTheBasesEpochs) {
  simulation::ReceiverRunner::Step base_measurements = sample.step;
  base_measurements.epoch.receiver = 1;
  sample.report.step = &sample.step;
  sample.report.base = &base_measurements;
  const canyon::test::TemporaryFolder folder;
  encoding::ReceiverDescription rover{"car"}, base{"base"};
  base.station_ecef = base_measurements.epoch.truth_ecef;
  live::make_stream_publisher("stream", "base/rtcm=file:" + (folder / "base.rtcm").string(), {rover, base})
      ->publish(sample.report);
  live::make_stream_publisher("stream", "rtcm=file:" + (folder / "car.rtcm").string(), {rover, base})
      ->publish(sample.report);
  const std::string both_files[] = {canyon::test::read_bytes(folder / "base.rtcm"),
                                    canyon::test::read_bytes(folder / "car.rtcm")};
  // Message 1005 (24 bits of frame, then 12 of its number) is sent only by a base, and first.
  EXPECT_EQ(static_cast<unsigned char>(both_files[0].at(3)) << 4 |
                static_cast<unsigned char>(both_files[0].at(4)) >> 4,
            1005);
  EXPECT_LT(both_files[1].size(), both_files[0].size());
  try {
    (void)live::make_stream_publisher("stream", "bass/rtcm=file:" + (folder / "x").string(), {rover, base});
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.hint(), HasSubstr("receivers: car, base"));
  }
}

TEST_F(StreamPublisher, HostsOpenAddressesOfTheirOwn) {
  struct AppendedBytes final : transport::Transport {
    explicit AppendedBytes(std::string& into) : bytes(into) {}
    void send(std::string_view more) override { bytes += more; }
    void finish(const std::optional<transport::Correction>& /*correction*/) override {}
    std::string& bytes;
  };
  std::string bytes;
  const auto open = [&](const encoding::StreamRequest& request) -> std::shared_ptr<transport::Link> {
    if (request.address != "topic:nmea") return nullptr;
    return std::make_shared<transport::Link>(std::make_unique<AppendedBytes>(bytes));
  };
  live::make_stream_publisher("streams", "nmea=topic:nmea", {{}}, open)->publish(sample.report);
  EXPECT_EQ(bytes, encoding::nmea_epoch(sample.step.epoch));
  const canyon::test::TemporaryFolder folder;
  const auto file = folder / "car.nmea";
  live::make_stream_publisher("streams", "nmea=file:" + file.string(), {{}}, open)->publish(sample.report);
  EXPECT_EQ(canyon::test::read_bytes(file), bytes);
}

// A simulator may be slower than real time, faster, or paused.
TEST_F(StreamPublisher, LatencyPassesByTheHostsClock) {
  const auto publisher = live::make_stream_publisher(
      "streams", "nmea=tcp://127.0.0.1:" + std::to_string(port) + "?latency_s=10", {{}});
  canyon::test::LocalConnection client(port);
  const std::string sentences = encoding::nmea_epoch(sample.step.epoch);
  constexpr std::int64_t kLatency_ns = 10'000'000'000;
  sample.report.sim_time_ns = 0;
  publisher->publish(sample.report);
  publisher->serve(kLatency_ns - 1);
  sample.report.step = nullptr;
  publisher->serve(kLatency_ns);
  EXPECT_EQ(client.read(sentences.size()), sentences);
  sample.report.step = &sample.step;
  sample.report.sim_time_ns = 2 * kLatency_ns;
  publisher->publish(sample.report);
  publisher->reset();  // the world restarts: delayed bytes arrive now
  EXPECT_EQ(client.read(sentences.size()), sentences);
}

TEST(StreamOfModel, FillsInTheNameOfTheModel) {
  EXPECT_EQ(live::stream_of_model("streams", "ubx=pty:/tmp/gps-{model}", "x500_1"),
            "ubx=pty:/tmp/gps-x500_1");
  EXPECT_EQ(live::stream_of_model("streams", "nmea=udp://127.0.0.1:9000", "x500_1"),
            "nmea=udp://127.0.0.1:9000");
  EXPECT_EQ(live::stream_of_model("streams", "nmea=file:{model}/{model}.nmea", "a"), "nmea=file:a/a.nmea");
  const std::string numbered = "view=tcp://127.0.0.1:295{number}";
  EXPECT_EQ(live::stream_of_model("streams", numbered, "x500_12"), "view=tcp://127.0.0.1:29512");
  EXPECT_EQ(live::stream_of_model("streams", numbered, "500"), "view=tcp://127.0.0.1:295500");
  EXPECT_EQ(live::stream_of_model("streams", numbered, "rover"), "view=tcp://127.0.0.1:2950");
  for (const char* wrong : {"ubx=pty:/tmp/{link}", "ubx=pty:/tmp/{model"}) {
    try {
      (void)live::stream_of_model("streams", wrong, "x500_1");
      FAIL() << wrong;
    } catch (const InputError& e) {
      EXPECT_THAT(e.problem(), HasSubstr("streams: '{"));
      EXPECT_THAT(e.hint(), HasSubstr("{model}"));
    }
  }
}

TEST_F(StreamPublisher, SaysWhichPortIsTaken) {
  const auto first = make();
  try {
    const auto second = make();
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.problem(), HasSubstr("nmea_port: port " + std::to_string(port)));
    EXPECT_THAT(e.problem(), HasSubstr("in use"));
    EXPECT_THAT(e.hint(), HasSubstr("a different port"));
  }
}

TEST_F(StreamPublisher, FeedsGpsd) {
  CANYON_NEEDS_PROGRAM("gpsd");
  CANYON_NEEDS_PROGRAM("gpspipe");
  const auto publisher = make();
  const std::string gpsd_port = std::to_string(free_port());
  const canyon::test::ChildProcess gpsd(
      {"gpsd", "-N", "-n", "-S", gpsd_port, "tcp://127.0.0.1:" + std::to_string(port)});
  // gpspipe prints reports of positions until it has one with a height.
  auto gpspipe = std::async(std::launch::async, [&] {
    return canyon::test::run_program("timeout 60 sh -c 'until gpspipe -w -n 40 127.0.0.1:" + gpsd_port +
                                     " 2>/dev/null | grep -m 1 \"TPV.*\\\"mode\\\":3\"; do :; done'");
  });
  auto& epoch = sample.step.epoch;
  while (gpspipe.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready) {
    publisher->publish(sample.report);
    epoch.truth.time = epoch.observed.time = epoch.observed.time + 0.1;
    epoch.observed.receiver_time = epoch.observed.receiver_time + 0.1;
  }
  const std::string report = gpspipe.get().output;
  // The fix of SampleReport: 1.25 m east and 2.5 m south of 22.298251, 114.178761, at 12.345 + 3.75 m.
  EXPECT_THAT(report, HasSubstr("\"device\":\"tcp://127.0.0.1:" + std::to_string(port)));
  EXPECT_THAT(report, HasSubstr("\"time\":\"2019-04-28T12:5"));
  EXPECT_THAT(report, HasSubstr("\"lat\":22.29822"));
  EXPECT_THAT(report, HasSubstr("\"lon\":114.17877"));
}

TEST_F(StreamPublisher, WritesAnyFormatToAFileThatIsWholeAtTheEnd) {
  const canyon::test::TemporaryFolder folder;
  const auto file = folder / "epochs.csv";
  auto publisher = live::make_stream_publisher("stream", "epochs_csv=file:" + file.string(), {{}});
  publisher->publish(sample.report);
  publisher->publish(sample.report);
  EXPECT_FALSE(std::filesystem::exists(file));
  publisher.reset();
  const std::string text = canyon::test::read_bytes(file);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 3);  // a header and two epochs
}

TEST_F(StreamPublisher, BringsThePathsBehindAnEpoch) {
  const canyon::test::TemporaryFolder folder;
  const auto file = folder / "paths.csv";
  sample.step.epoch.arrival = &sample.step.arrival;
  live::make_stream_publisher("stream", "paths_csv=file:" + file.string(), {{}})->publish(sample.report);
  const std::string text = canyon::test::read_bytes(file);
  // The reflection of G17 is its only path.
  EXPECT_THAT(text, HasSubstr(",G17,0,reflected,2,35.2500,,,"));
  EXPECT_THAT(text, HasSubstr(",12.000,-34.000,5.600,"));
}

}  // namespace
}  // namespace canyon::adapters
