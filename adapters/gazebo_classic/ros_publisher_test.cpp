#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <ros/init.h>

#include <fstream>
#include <future>
#include <map>
#include <sstream>

#include "adapters/common/testing/sample_report.hpp"
#include "adapters/gazebo_classic/publishers.hpp"
#include "adapters/gazebo_classic/testing/ros_core.hpp"
#include "adapters/ros/raw_conversions.hpp"
#include "adapters/ros/ros1_types.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "tests/support/program.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

using canyon::test::ProgramResult;
using canyon::test::run_program;
using canyon::test::sample_identity;
using canyon::test::SampleReport;
using test::ChildProgram;
using test::eventually;
using test::RosCore;
using test::RosEnvironment;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

HostSettings settings_in(const std::string& name_space) {
  HostSettings settings;
  settings.ros_namespace = name_space;
  settings.publish_scan = true;
  settings.frame_id = "antenna";
  return settings;
}

class RosPublisher : public testing::Test {
 protected:
  void SetUp() override {
    CANYON_NEEDS_PROGRAM("roscore");
    RosEnvironment::get();
  }

  /// Publishes the report at 50 Hz until `command` has ended.
  ProgramResult publish_while(const std::string& command, live::EpochPublisher& publisher,
                              const live::ReceiverReport& report) {
    auto result = std::async(std::launch::async, [&] { return run_program("timeout 60 " + command); });
    while (result.wait_for(20ms) != std::future_status::ready) publisher.publish(report);
    return result.get();
  }

  /// `rostopic echo -p`: a line of names and one of values.
  std::map<std::string, std::string> echo(const std::string& topic, live::EpochPublisher& publisher,
                                          const live::ReceiverReport& report) {
    const ProgramResult result = publish_while("rostopic echo -n 1 -p " + topic + " 2>&1", publisher, report);
    std::istringstream lines(result.output);
    std::string names, values;
    std::getline(lines, names);
    std::getline(lines, values);
    std::map<std::string, std::string> fields;
    const auto keys = split(names, ','), texts = split(values, ',');
    EXPECT_EQ(keys.size(), texts.size()) << result.output;
    for (std::size_t i = 0; i < std::min(keys.size(), texts.size()); ++i) {
      fields[std::string(keys[i])] = texts[i];
    }
    return fields;
  }
};

TEST_F(RosPublisher, WithoutMasterNothingWaits) {
  const SampleReport sample;
  const auto begin = Clock::now();
  auto publisher = make_ros_publisher(sample_identity(), settings_in("/alone"), {});
  for (int i = 0; i < 1000; ++i) publisher->publish(sample.report);
  publisher->reset();
  EXPECT_LT(Clock::now() - begin, 1s);
  const auto end = Clock::now();
  publisher.reset();
  EXPECT_LT(Clock::now() - end, 1500ms);  // less than the 2 s after which a thread is abandoned
}

TEST_F(RosPublisher, ComesWithAMasterThatComesLater) {
  const SampleReport sample;
  const auto publisher = make_ros_publisher(sample_identity(), settings_in("/late"), {});
  publisher->publish(sample.report);
  const RosCore core;
  EXPECT_TRUE(eventually(
      [] { return run_program("rostopic list 2>&1").output.find("/late/fix\n") != std::string::npos; }));
  EXPECT_EQ(run_program("rostopic type /late/fix").output, "sensor_msgs/NavSatFix\n");
  EXPECT_EQ(run_program("rostopic type /late/fix_velocity").output,
            "geometry_msgs/TwistWithCovarianceStamped\n");
  EXPECT_EQ(run_program("rostopic type /late/gnss_multipath").output, "canyon_msgs/GnssMultipath\n");
  EXPECT_EQ(run_program("rostopic type /late/satellites").output, "canyon_msgs/GnssSatellites\n");
  EXPECT_EQ(run_program("rostopic type /late/raw_observations").output, "canyon_msgs/GnssRawObservations\n");
  EXPECT_EQ(run_program("rostopic type /late/scan").output, "sensor_msgs/LaserScan\n");
  EXPECT_EQ(echo("/late/fix", *publisher, sample.report)["field.status.status"], "0");
}

// Expected numbers are those of SampleReport and tests/support/sample_epochs.hpp.
TEST_F(RosPublisher, EchoesWhatWasPublished) {
  const RosCore core;
  const SampleReport sample;
  const positioning::Fix& fix = sample.step.epoch.observed.fix;
  const auto publisher = make_ros_publisher(sample_identity(), settings_in("/echo"), {});

  auto navsat = echo("/echo/fix", *publisher, sample.report);
  EXPECT_EQ(navsat["field.header.stamp"], "12345678901");
  EXPECT_EQ(navsat["field.header.frame_id"], "antenna");
  EXPECT_EQ(navsat["field.status.status"], "0");
  EXPECT_EQ(navsat["field.status.service"], "15");
  EXPECT_NEAR(std::stod(navsat["field.latitude"]), geodesy::degrees(fix.position.latitude_rad), 1e-11);
  EXPECT_NEAR(std::stod(navsat["field.longitude"]), geodesy::degrees(fix.position.longitude_rad), 1e-11);
  EXPECT_NEAR(std::stod(navsat["field.altitude"]), fix.position.height_m, 1e-9);
  EXPECT_EQ(navsat["field.position_covariance1"], "1.5");
  EXPECT_EQ(navsat["field.position_covariance8"], "9.0");
  EXPECT_EQ(navsat["field.position_covariance_type"], "3");

  auto velocity = echo("/echo/fix_velocity", *publisher, sample.report);
  EXPECT_EQ(velocity["field.twist.twist.linear.x"], "3.1");
  EXPECT_EQ(velocity["field.twist.twist.linear.y"], "-4.2");
  EXPECT_EQ(velocity["field.twist.twist.linear.z"], "0.4");
  EXPECT_EQ(velocity["field.twist.covariance7"], "0.02");
  EXPECT_EQ(velocity["field.twist.covariance21"], "-1.0");

  auto multipath = echo("/echo/gnss_multipath", *publisher, sample.report);
  EXPECT_EQ(multipath["field.header.stamp"], "12345678901");
  EXPECT_EQ(multipath["field.rec_pos.status.status"], "0");
  EXPECT_EQ(std::stof(multipath["field.dop0"]), 2.1F);  // PDOP
  EXPECT_EQ(multipath["field.dop1"], "1.25");
  EXPECT_EQ(multipath["field.dop4"], "2.5");
  EXPECT_EQ(multipath["field.range_offset2"], "35.25");
  EXPECT_EQ(multipath["field.range_offset3"], "nan");
  EXPECT_EQ(multipath["field.sats_blocked0"], "31");
  EXPECT_EQ(multipath["field.num_vis_sat"], "10");
  EXPECT_EQ(multipath["field.num_block_sat"], "1");
  EXPECT_EQ(multipath["field.noise0"], "0.25");

  auto satellites = echo("/echo/satellites", *publisher, sample.report);
  EXPECT_EQ(satellites["field.fix_status"], "1");
  EXPECT_EQ(satellites["field.gps_week"], "2051");
  EXPECT_EQ(satellites["field.gps_tow"], "46701.0");
  EXPECT_EQ(satellites["field.satellites2.id"], "G17");
  EXPECT_EQ(satellites["field.satellites2.excess_path"], "35.25");
  EXPECT_EQ(satellites["field.satellites8.prn"], "336");

  auto scan = echo("/echo/scan", *publisher, sample.report);
  EXPECT_EQ(scan["field.ranges0"], "0.5");
  EXPECT_EQ(scan["field.ranges1"], "inf");
  EXPECT_EQ(scan["field.ranges23"], "23.5");
  EXPECT_EQ(scan["field.range_max"], "150.0");
}

TEST_F(RosPublisher, SaysThatThereIsNoFixAndNoTruth) {
  const RosCore core;
  const auto publisher = make_ros_publisher(sample_identity(), settings_in("/nofix"), {});
  const SampleReport without_fix(false);
  auto navsat = echo("/nofix/fix", *publisher, without_fix.report);
  EXPECT_EQ(navsat["field.status.status"], "-1");
  EXPECT_EQ(navsat["field.latitude"], "nan");
  live::ReceiverReport without_truth;
  without_truth.sim_time_ns = 7'250'000'000;
  without_truth.reason = "no pose has come";
  auto satellites = echo("/nofix/satellites", *publisher, without_truth);
  EXPECT_EQ(satellites["field.header.stamp"], "7250000000");
  EXPECT_EQ(satellites["field.fix_status"], "6");
  auto multipath = echo("/nofix/gnss_multipath", *publisher, without_truth);
  EXPECT_EQ(multipath["field.rec_pos.status.status"], "-1");
  EXPECT_EQ(multipath["field.num_vis_sat"], "0");
}

TEST_F(RosPublisher, KeepsTheRate) {
  const RosCore core;
  const SampleReport sample;
  const auto publisher = make_ros_publisher(sample_identity(), settings_in("/rate"), {});
  auto result = std::async(std::launch::async, [] {
    // rostopic hz ends by Ctrl-C only.
    return run_program("PYTHONUNBUFFERED=1 timeout --signal=INT 12 rostopic hz -w 30 /rate/satellites 2>&1");
  });
  auto due = Clock::now();
  while (result.wait_until(due) != std::future_status::ready) {
    publisher->publish(sample.report);
    due += 100ms;
  }
  const std::string output = result.get().output;
  const std::string words = "average rate: ";
  const std::size_t at = output.rfind(words);
  ASSERT_NE(at, std::string::npos) << output;
  EXPECT_NEAR(std::stod(output.substr(at + words.size())), 10, 1) << output;
}

template <class Message>
std::string wire_hex(const Message& message) {
  std::vector<std::uint8_t> bytes(ros::serialization::serializationLength(message));
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, message);
  std::string hex;
  for (std::size_t i = 4; i < bytes.size(); ++i) hex += fmt::format("{:02x}", bytes[i]);  // seq is the node's
  return hex;
}

TEST_F(RosPublisher, ABagGivesBackTheSameBytes) {
  CANYON_NEEDS_PROGRAM("rosbag");
  const RosCore core;
  const SampleReport sample;
  const auto publisher = make_ros_publisher(sample_identity(), settings_in("/bag"), {});
  const std::string bag = (RosEnvironment::get().folder() / "receiver.bag").string();
  const std::string topics =
      "/bag/fix /bag/fix_velocity /bag/gnss_multipath /bag/satellites /bag/raw_observations /bag/scan";
  publish_while("rosbag record -l 3 -O " + bag + " " + topics + " 2>&1", *publisher, sample.report);
  ASSERT_TRUE(std::filesystem::exists(bag));

  const std::filesystem::path script = RosEnvironment::get().folder() / "read.py";
  std::ofstream(script) << "import rosbag, sys\n"
                           "for topic, raw, time in rosbag.Bag(sys.argv[1]).read_messages(raw=True):\n"
                           "    print(topic, raw[0], raw[1][4:].hex())\n";
  const ProgramResult read = run_program("python3 " + script.string() + " " + bag + " 2>&1");
  std::map<std::string, std::vector<std::string>> messages;
  std::istringstream lines(read.output);
  for (std::string topic, type, hex; lines >> topic >> type >> hex;)
    messages[topic + ' ' + type].push_back(hex);

  namespace ros1 = ros_messages::ros1;
  const ros_messages::Head head{{12, 345'678'901}, "antenna"};
  const simulation::Epoch* epoch = &sample.step.epoch;
  const auto three = [](const std::string& hex) { return ElementsAre(hex, hex, hex); };
  EXPECT_THAT(messages["/bag/fix sensor_msgs/NavSatFix"],
              three(wire_hex(ros_messages::fix_message<ros1::NavSatFix>(head, epoch))));
  EXPECT_THAT(messages["/bag/fix_velocity geometry_msgs/TwistWithCovarianceStamped"],
              three(wire_hex(ros_messages::velocity_message<ros1::TwistWithCovarianceStamped>(head, epoch))));
  EXPECT_THAT(messages["/bag/gnss_multipath canyon_msgs/GnssMultipath"],
              three(wire_hex(ros_messages::multipath_message<ros1::GnssMultipath>(head, epoch))));
  EXPECT_THAT(messages["/bag/satellites canyon_msgs/GnssSatellites"],
              three(wire_hex(ros_messages::satellites_message<ros1::GnssSatellites>(head, epoch))));
  ros_messages::RawObservations raw;
  EXPECT_THAT(messages["/bag/raw_observations canyon_msgs/GnssRawObservations"],
              three(wire_hex(raw.message<ros1::GnssRawObservations>(head, epoch))));
  EXPECT_THAT(messages["/bag/scan sensor_msgs/LaserScan"],
              three(wire_hex(ros_messages::scan_message<ros1::LaserScan>(head, sample.report.scan_ranges_m,
                                                                         sample.report.scan_max_range_m))));
  EXPECT_EQ(messages.size(), 6U) << read.output;
}

TEST_F(RosPublisher, OutlivesAMasterAndFindsTheNext) {
  const SampleReport sample;
  std::unique_ptr<live::EpochPublisher> publisher;
  // A subscriber during the whole test.
  std::unique_ptr<ChildProgram> listener;
  const std::filesystem::path received = RosEnvironment::get().folder() / "heard.csv";
  std::ofstream(received).flush();
  const auto receives_more = [&] {
    const std::uintmax_t size = std::filesystem::file_size(received);
    return eventually([&] {
      publisher->publish(sample.report);
      return std::filesystem::file_size(received) > size;
    });
  };
  {
    const RosCore first;
    publisher = make_ros_publisher(sample_identity(), settings_in("/again"), {});
    EXPECT_EQ(echo("/again/fix", *publisher, sample.report)["field.status.status"], "0");
    listener = std::make_unique<ChildProgram>(
        std::vector<std::string>{"rostopic", "echo", "-p", "/again/satellites/gps_week"}, received);
    EXPECT_TRUE(receives_more());
  }
  const auto begin = Clock::now();
  for (int i = 0; i < 1000; ++i) publisher->publish(sample.report);
  EXPECT_LT(Clock::now() - begin, 1s);
  {
    const RosCore second;
    EXPECT_TRUE(eventually(
        [] { return run_program("rostopic list 2>&1").output.find("/again/scan\n") != std::string::npos; }));
    EXPECT_EQ(echo("/again/fix", *publisher, sample.report)["field.status.status"], "0");
    EXPECT_TRUE(receives_more());
    listener.reset();
  }
  const auto end = Clock::now();
  publisher.reset();
  EXPECT_LT(Clock::now() - end, 1900ms);  // roscore has ended, and no thread was abandoned
  EXPECT_FALSE(ros::ok());
}

TEST_F(RosPublisher, LeavesAMasterThatHangsBehind) {
  ChildProgram master({"rosmaster", "--core", "-p", std::to_string(RosEnvironment::get().master().port)},
                      RosEnvironment::get().folder() / "rosmaster.log");
  const SampleReport sample;
  auto publisher = make_ros_publisher(sample_identity(), settings_in("/hangs"), {});
  EXPECT_TRUE(eventually(
      [] { return run_program("rostopic list 2>&1").output.find("/hangs/fix\n") != std::string::npos; }));
  master.signal(SIGSTOP);
  auto begin = Clock::now();
  for (int i = 0; i < 1000; ++i) publisher->publish(sample.report);
  EXPECT_LT(Clock::now() - begin, 1s);
  begin = Clock::now();
  publisher.reset();
  EXPECT_LT(Clock::now() - begin, 3s);
  // The next receiver does not wait either, and is published when the master is there.
  begin = Clock::now();
  publisher = make_ros_publisher(sample_identity(), settings_in("/next"), {});
  publisher->publish(sample.report);
  EXPECT_LT(Clock::now() - begin, 1s);
  master.signal(SIGCONT);
  EXPECT_TRUE(eventually(
      [] { return run_program("rostopic list 2>&1").output.find("/next/fix\n") != std::string::npos; }));
}

TEST_F(RosPublisher, TakesItsTopicsAwayWithIt) {
  const RosCore core;
  const SampleReport sample;
  auto stays = make_ros_publisher(sample_identity(), settings_in("/stays"), {});
  auto goes = make_ros_publisher(sample_identity(), settings_in("/goes"), {});
  const auto listed = [](const std::string& topic) {
    return run_program("rostopic list 2>&1").output.find(topic + "\n") != std::string::npos;
  };
  EXPECT_TRUE(eventually([&] { return listed("/goes/fix") && listed("/stays/fix"); }));
  goes.reset();
  EXPECT_TRUE(eventually([&] { return !listed("/goes/fix"); }));
  EXPECT_TRUE(listed("/stays/fix"));
  EXPECT_EQ(echo("/stays/fix", *stays, sample.report)["field.status.status"], "0");
}

TEST_F(RosPublisher, GivesReceiversOfAModelTopicsOfTheirOwn) {
  const RosCore core;
  HostSettings settings;
  const auto first = make_ros_publisher(sample_identity(), settings, {});
  const auto second = make_ros_publisher(sample_identity(), settings, {});  // the model's name is in use
  std::string listed;
  EXPECT_TRUE(eventually([&] {
    listed = run_program("rostopic list 2>&1").output;
    return listed.find("/iris/gps0/link/gps/fix\n") != std::string::npos;
  })) << listed;
  EXPECT_THAT(listed, HasSubstr("/iris/fix\n"));
  EXPECT_EQ(listed.find("/scan\n"), std::string::npos);  // not requested by output_type
  EXPECT_THROW((void)make_ros_publisher(sample_identity(), settings, {}), InputError);
  const auto third = make_ros_publisher(sample_identity(), settings_in("/own"), {});
  EXPECT_THROW((void)make_ros_publisher(sample_identity(), settings_in("/own"), {}), InputError);
}

TEST_F(RosPublisher, RefusesNamesThatAreNone) {
  EXPECT_THROW((void)make_ros_publisher(sample_identity(), settings_in("no name"), {}), InputError);
  HostSettings settings = settings_in("/ok");
  settings.remappings = {{"fix", "a b"}};
  EXPECT_THROW((void)make_ros_publisher(sample_identity(), settings, {}), InputError);
}

}  // namespace
}  // namespace canyon::adapters::gazebo_classic
