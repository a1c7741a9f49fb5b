#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <future>

#include "adapters/gazebo_classic/publishers.hpp"
#include "adapters/gazebo_classic/testing/child_process.hpp"
#include "adapters/gazebo_classic/testing/local_connection.hpp"
#include "adapters/gazebo_classic/testing/sample_report.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/output/nmea.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/program.hpp"

namespace canyon::gazebo_classic {
namespace {

using canyon::test::free_port;
using test::sample_identity;
using test::SampleReport;
using ::testing::HasSubstr;

class NmeaPublisher : public ::testing::Test {
 protected:
  NmeaPublisher() { settings.nmea_port = free_port(); }
  SampleReport sample;
  PluginSettings settings;
};

TEST_F(NmeaPublisher, SendsEachEpochAsNmea) {
  const auto publisher = make_nmea_publisher(sample_identity(), settings);
  publisher->publish(sample.report);  // nobody there
  test::LocalConnection client(settings.nmea_port);
  ReceiverReport no_truth = sample.report;
  no_truth.step = nullptr;
  publisher->publish(no_truth);
  const SampleReport no_fix(false);
  publisher->publish(no_fix.report);
  publisher->reset();
  publisher->publish(sample.report);
  const std::string expected = output::nmea_epoch(no_fix.step.epoch) + output::nmea_epoch(sample.step.epoch);
  EXPECT_EQ(client.read(expected.size()), expected);
}

TEST_F(NmeaPublisher, SaysWhichPortIsTaken) {
  const auto first = make_nmea_publisher(sample_identity(), settings);
  try {
    const auto second = make_nmea_publisher(sample_identity(), settings);
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.problem(), HasSubstr("nmea_port: port " + std::to_string(settings.nmea_port)));
    EXPECT_THAT(e.problem(), HasSubstr("in use"));
    EXPECT_THAT(e.cure(), HasSubstr("a port of its own"));
  }
}

TEST_F(NmeaPublisher, FeedsGpsd) {
  CANYON_NEEDS_PROGRAM("gpsd");
  CANYON_NEEDS_PROGRAM("gpspipe");
  const auto publisher = make_nmea_publisher(sample_identity(), settings);
  const std::string gpsd_port = std::to_string(free_port());
  const test::ChildProcess gpsd(
      {"gpsd", "-N", "-n", "-S", gpsd_port, "tcp://127.0.0.1:" + std::to_string(settings.nmea_port)});
  // gpspipe says reports of positions until it has one with a height.
  auto judge = std::async(std::launch::async, [&] {
    return canyon::test::run_program("timeout 60 sh -c 'until gpspipe -w -n 40 127.0.0.1:" + gpsd_port +
                                     " 2>/dev/null | grep -m 1 \"TPV.*\\\"mode\\\":3\"; do :; done'");
  });
  auto& epoch = sample.step.epoch;
  while (judge.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready) {
    publisher->publish(sample.report);
    epoch.truth.time = epoch.observed.time = epoch.observed.time + 0.1;
    epoch.observed.receiver_time = epoch.observed.receiver_time + 0.1;
  }
  const std::string report = judge.get().output;
  // The fix of SampleReport: 1.25 m east and 2.5 m south of 22.298251, 114.178761, at 12.345 + 3.75 m.
  EXPECT_THAT(report, HasSubstr("\"device\":\"tcp://127.0.0.1:" + std::to_string(settings.nmea_port)));
  EXPECT_THAT(report, HasSubstr("\"time\":\"2019-04-28T12:5"));
  EXPECT_THAT(report, HasSubstr("\"lat\":22.29822"));
  EXPECT_THAT(report, HasSubstr("\"lon\":114.17877"));
}

}  // namespace
}  // namespace canyon::gazebo_classic
