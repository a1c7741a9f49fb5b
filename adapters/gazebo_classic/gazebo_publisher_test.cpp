#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <gazebo/transport/transport.hh>
#include <mutex>
#include <optional>

#include "adapters/common/msgs/gnss_message.hpp"
#include "adapters/common/testing/sample_report.hpp"
#include "adapters/gazebo_classic/publishers.hpp"
#include "adapters/gazebo_classic/testing/in_process_server.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/source_dir.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

using canyon::test::sample_identity;
using canyon::test::SampleReport;
using ::testing::HasSubstr;

constexpr const char* kEmptyWorld = R"(<?xml version="1.0"?><sdf version="1.6"><world name="city"/></sdf>)";

/// Stores the messages of one topic.
class Listener {
 public:
  Listener(const gazebo::transport::NodePtr& node, const std::string& topic, bool latching = false)
      : subscriber_(node->Subscribe(topic, &Listener::hear, this, latching)) {}

  /// Publishes until a message is received; empty after 20 s.
  std::optional<msgs::GnssReceiver> hear_from(live::EpochPublisher& publisher,
                                              const live::ReceiverReport& report) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    std::unique_lock lock(mutex_);
    while (!last_ && std::chrono::steady_clock::now() < deadline) {
      lock.unlock();
      publisher.publish(report);
      lock.lock();
      heard_.wait_for(lock, std::chrono::milliseconds(20), [&] { return last_.has_value(); });
    }
    return last_;
  }

 private:
  void hear(const boost::shared_ptr<const msgs::GnssReceiver>& message) {
    const std::lock_guard lock(mutex_);
    if (message) last_ = *message;
    heard_.notify_all();
  }
  std::mutex mutex_;
  std::condition_variable heard_;
  std::optional<msgs::GnssReceiver> last_;
  gazebo::transport::SubscriberPtr subscriber_;
};

class GazeboPublisher : public ::testing::Test {
 protected:
  GazeboPublisher() {
    // Loaded once: the tests need only the name of a world.
    [[maybe_unused]] static const bool loaded = test::InProcessServer::get().load(kEmptyWorld) != nullptr;
    node->Init("city");
  }
  ~GazeboPublisher() override { node->Fini(); }

  std::mutex mutex;
  std::condition_variable tick;  ///< never set: paces publishing
  SampleReport sample;
  gazebo::transport::NodePtr node{new gazebo::transport::Node};
};

TEST_F(GazeboPublisher, PublishesUnderModelAndSensor) {
  const auto publisher = make_gazebo_publisher(node, sample_identity());
  ReceiverIdentity bare = sample_identity();
  bare.sensor.clear();
  bare.model = "car";
  const auto model_entry = make_gazebo_publisher(node, bare);
  Listener with_sensor(node, "/gazebo/city/iris/gps/gnss");
  Listener car_messages(node, "~/car/gnss");

  const auto heard = with_sensor.hear_from(*publisher, sample.report);
  ASSERT_TRUE(heard);
  msgs::GnssReceiver expected;
  fill_gnss_message(sample_identity(), sample.report, expected);
  EXPECT_EQ(heard->SerializeAsString(), expected.SerializeAsString());
  const auto car = car_messages.hear_from(*model_entry, sample.report);
  ASSERT_TRUE(car);
  EXPECT_EQ(car->model(), "car");
}

TEST_F(GazeboPublisher, IsReadByAnotherProcess) {
  ReceiverIdentity identity = sample_identity();
  identity.model = "boat";  // a topic not used by other tests in this process
  const auto publisher = make_gazebo_publisher(node, identity);
  const canyon::test::TemporaryFolder folder;
  const canyon::test::ChildProcess gz(
      {"env", std::string("LD_PRELOAD=") + canyon_build_dir + "/lib/libcanyon_gazebo.so", "gz", "topic", "-e",
       "/gazebo/city/boat/gps/gnss"},
      folder / "echo");
  std::string output;
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (output.find("scan_max_range_m") == std::string::npos &&
         std::chrono::steady_clock::now() < deadline) {
    publisher->publish(sample.report);
    std::unique_lock lock(mutex);
    tick.wait_for(lock, std::chrono::milliseconds(20));
    if (std::filesystem::exists(folder / "echo")) output = canyon::test::read_bytes(folder / "echo");
  }
  EXPECT_THAT(output, HasSubstr("sim_time_ns: 12345678901"));
  EXPECT_THAT(output, HasSubstr("link: \"iris::gps0::link\""));
  EXPECT_THAT(output, HasSubstr("id: \"J02\""));
}

TEST_F(GazeboPublisher, SendsNothingWhileNobodyListens) {
  ReceiverIdentity identity = sample_identity();
  identity.model = "plane";  // a topic not used by other tests in this process
  const auto publisher = make_gazebo_publisher(node, identity);
  publisher->publish(sample.report);
  // A latching subscriber would get the previous message; only the next one arrives.
  Listener late(node, "~/plane/gps/gnss", true);
  sample.report.sim_time_ns = 99'000'000'000;
  const auto heard = late.hear_from(*publisher, sample.report);
  ASSERT_TRUE(heard);
  EXPECT_EQ(heard->sim_time_ns(), 99'000'000'000);
}

TEST_F(GazeboPublisher, LeavesNothingBehindWhenItsNodeHasEnded) {
  ReceiverIdentity identity = sample_identity();
  identity.model = "rover";
  gazebo::transport::NodePtr own(new gazebo::transport::Node);
  own->Init("city");
  const boost::weak_ptr<gazebo::transport::Node> left = own;
  auto publisher = make_gazebo_publisher(own, identity);
  const auto advertised = [] {
    const auto topics = gazebo::transport::getAdvertisedTopics("canyon.msgs.GnssReceiver");
    return std::find(topics.begin(), topics.end(), "/gazebo/city/rover/gps/gnss") != topics.end();
  };
  const auto becomes = [&](bool wanted) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (advertised() != wanted && std::chrono::steady_clock::now() < deadline) {
      std::unique_lock lock(mutex);
      tick.wait_for(lock, std::chrono::milliseconds(10));
    }
    return advertised() == wanted;
  };
  EXPECT_TRUE(becomes(true));
  publisher.reset();
  own->Fini();
  own.reset();
  EXPECT_TRUE(left.expired());
  EXPECT_TRUE(becomes(false));
}

}  // namespace
}  // namespace canyon::adapters::gazebo_classic
