#include <dlfcn.h>
#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <gazebo/transport/transport.hh>
#include <mutex>
#include <vector>

#include "adapters/common/testing/sample_report.hpp"
#include "adapters/gazebo_classic/publishers.hpp"
#include "adapters/gazebo_classic/sitl_gps.hpp"
#include "adapters/gazebo_classic/testing/in_process_server.hpp"
#include "adapters/gazebo_classic/testing/px4_mock/px4_mock.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/source_dir.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

using canyon::test::sample_identity;
using canyon::test::SampleReport;
using ::testing::HasSubstr;

const std::string kMock = std::string(canyon_build_dir) + "/lib/libgazebo_px4_mock.so";
constexpr const char* kEmptyWorld = R"(<?xml version="1.0"?><sdf version="1.6"><world name="city"/></sdf>)";

bool stand_in_loaded() {
  return google::protobuf::DescriptorPool::generated_pool()->FindMessageTypeByName(kSitlGpsType) != nullptr;
}

/// Loads PX4's class into the process, as Gazebo does with a plugin.
const test::Px4Mock& load_mock() {
  void* const library = dlopen(kMock.c_str(), RTLD_LAZY | RTLD_GLOBAL);
  if (library == nullptr) throw std::runtime_error(dlerror());
  return *static_cast<const test::Px4Mock*>(dlsym(library, "px4_mock"));
}

TEST(SitlGps, TakesFixAndItsAccuracy) {
  const SampleReport sample;
  const auto gps = sitl_gps_of(sample.report);
  ASSERT_TRUE(gps);
  EXPECT_EQ(gps->time_usec, 12'345'678U);
  // 2019-04-28 12:58:03 UTC: date -u -d '2019-04-28 12:58:03' +%s
  EXPECT_EQ(gps->time_utc_usec, 1'556'456'283'000'000U);
  const auto& fix = sample.step.epoch.observed.fix;
  EXPECT_DOUBLE_EQ(gps->latitude_deg, geodesy::degrees(fix.position.latitude_rad));
  EXPECT_DOUBLE_EQ(gps->longitude_deg, geodesy::degrees(fix.position.longitude_rad));
  EXPECT_DOUBLE_EQ(gps->altitude_m, fix.position.height_m);
  EXPECT_NEAR(gps->altitude_m, 12.345 + 3.75, 1e-5);  // the truth's height and the error up
  SampleReport hong_kong;
  hong_kong.step.epoch.geoid_undulation_m = -2.5;
  EXPECT_DOUBLE_EQ(sitl_gps_of(hong_kong.report)->altitude_m, fix.position.height_m + 2.5);
  EXPECT_DOUBLE_EQ(gps->eph_m, 2.5);  // sqrt(4 + 2.25)
  EXPECT_DOUBLE_EQ(gps->epv_m, 3);    // sqrt(9)
  EXPECT_DOUBLE_EQ(gps->velocity_mps, std::sqrt(3.1 * 3.1 + 4.2 * 4.2));
  EXPECT_EQ(gps->velocity_east_mps, 3.1);
  EXPECT_EQ(gps->velocity_north_mps, -4.2);
  EXPECT_EQ(gps->velocity_up_mps, 0.4);
}

TEST(SitlGps, IsEmptyWithoutTruthFixOrVelocity) {
  EXPECT_FALSE(sitl_gps_of(SampleReport(false).report));
  SampleReport sample;
  sample.step.epoch.observed.fix.velocity_enu_mps.reset();
  EXPECT_FALSE(sitl_gps_of(sample.report));
  live::ReceiverReport no_truth = sample.report;
  no_truth.step = nullptr;
  EXPECT_FALSE(sitl_gps_of(no_truth));
}

SitlGps distinct() {
  return {1'500'000, 1'556'456'283'000'001, 22.25, -114.125, 16.5, 2.5, 3.5, 5.25, 3.125, -4.75, 0.375};
}

// Wire format (developers.google.com/protocol-buffers/docs/encoding): key = number << 3 | type, type 0 varint
// (least significant group of 7 bits first), type 1 double, little-endian.
std::string wire_bytes(const SitlGps& gps) {
  std::string bytes;
  const auto varint = [&](int number, std::uint64_t value) {
    bytes.push_back(static_cast<char>(number << 3));
    for (; value >= 0x80; value >>= 7) bytes.push_back(static_cast<char>((value & 0x7f) | 0x80));
    bytes.push_back(static_cast<char>(value));
  };
  varint(1, gps.time_usec);
  varint(2, gps.time_utc_usec);
  int number = 3;
  for (const double value :
       {gps.latitude_deg, gps.longitude_deg, gps.altitude_m, gps.eph_m, gps.epv_m, gps.velocity_mps,
        gps.velocity_east_mps, gps.velocity_north_mps, gps.velocity_up_mps}) {
    bytes.push_back(static_cast<char>(number++ << 3 | 1));
    std::array<char, sizeof value> raw;
    std::memcpy(raw.data(), &value, sizeof value);
    bytes.append(raw.data(), raw.size());
  }
  return bytes;
}

TEST(SitlGpsMessage, IsTheSameOnTheWireWithAndWithoutPx4sClass) {
  SitlGpsMessage message;
  if (!stand_in_loaded()) {
    const auto* dynamic = message.fill(distinct());
    ASSERT_NE(dynamic, nullptr);
    EXPECT_FALSE(message.generated());
    EXPECT_EQ(dynamic->GetTypeName(), kSitlGpsType);
    EXPECT_EQ(dynamic->SerializeAsString(), wire_bytes(distinct()));
  }
  load_mock();
  const auto* generated = message.fill(distinct());
  ASSERT_NE(generated, nullptr);
  EXPECT_TRUE(message.generated());
  EXPECT_EQ(generated->SerializeAsString(), wire_bytes(distinct()));
  EXPECT_EQ(message.problem(), "");
}

class Px4Publisher : public ::testing::Test {
 public:
  void hear(const std::string& bytes) {
    const std::lock_guard lock(mutex);
    raw.push_back(bytes);
    heard.notify_all();
  }

 protected:
  Px4Publisher() {
    // Loaded once: the tests need only the name of a world.
    [[maybe_unused]] static const bool loaded = test::InProcessServer::get().load(kEmptyWorld) != nullptr;
    node->Init("city");
  }
  ~Px4Publisher() override { node->Fini(); }

  /// Publishes until `done`, for at most 60 s.
  template <typename Done>
  bool publish_until(live::EpochPublisher& publisher, const Done& done) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    std::unique_lock lock(mutex);
    while (!done() && std::chrono::steady_clock::now() < deadline) {
      lock.unlock();
      publisher.publish(sample.report);
      lock.lock();
      heard.wait_for(lock, std::chrono::milliseconds(10));
    }
    return done();
  }

  std::mutex mutex;
  std::condition_variable heard;
  std::vector<std::string> raw;
  SampleReport sample;
  gazebo::transport::NodePtr node{new gazebo::transport::Node};
};

TEST_F(Px4Publisher, HandsPx4sClassToSubscribersInTheProcessAlsoWhenItIsLoadedLater) {
  const auto publisher = make_px4_publisher(node, sample_identity(), HostSettings());
  const auto subscriber =
      node->Subscribe("/gazebo/city/iris/link/gps0", &Px4Publisher::hear, static_cast<Px4Publisher*>(this));
  ASSERT_TRUE(publish_until(*publisher, [&] { return !raw.empty(); }));
  EXPECT_EQ(raw.front(), wire_bytes(*sitl_gps_of(sample.report)));

  const auto& px4 = load_mock();
  px4.subscribe("~/iris/link/gps0");
  EXPECT_TRUE(publish_until(*publisher, [&] { return px4.received() >= 3; }));
  EXPECT_EQ(px4.foreign(), 0);
  std::array<char, 4096> text{};
  px4.last(text.data(), static_cast<int>(text.size()));
  EXPECT_THAT(text.data(), HasSubstr("time_usec: 12345678\ntime_utc_usec: 1556456283000000\n"));
  EXPECT_THAT(text.data(), HasSubstr("eph: 2.5\nepv: 3\n"));
  EXPECT_THAT(text.data(), HasSubstr("velocity_east: 3.1\nvelocity_north: -4.2\nvelocity_up: 0.4\n"));
  px4.unsubscribe();
}

TEST_F(Px4Publisher, HandsPx4sClassToSubscribersWhenItWasThereBefore) {
  const auto& px4 = load_mock();
  px4.subscribe("~/iris/link/my_gps");
  HostSettings settings;
  settings.px4_topic = "my_gps";
  const auto publisher = make_px4_publisher(node, sample_identity(), settings);
  EXPECT_TRUE(publish_until(*publisher, [&] { return px4.received() >= 3; }));
  EXPECT_EQ(px4.foreign(), 0);
  px4.unsubscribe();
}

TEST_F(Px4Publisher, IsReadByAnotherProcess) {
  ReceiverIdentity identity = sample_identity();
  identity.model = "typhoon";  // a topic not used by other tests in this process
  const auto publisher = make_px4_publisher(node, identity, HostSettings());
  const canyon::test::TemporaryFolder folder;
  const canyon::test::ChildProcess gz(
      {"env", "LD_PRELOAD=" + kMock, "gz", "topic", "-e", "/gazebo/city/typhoon/link/gps0"}, folder / "echo");
  std::string output;
  EXPECT_TRUE(publish_until(*publisher, [&] {
    if (std::filesystem::exists(folder / "echo")) output = canyon::test::read_bytes(folder / "echo");
    return output.find("velocity_up: 0.4\n") != std::string::npos;
  }));
  EXPECT_THAT(output, HasSubstr("time_usec: 12345678\ntime_utc_usec: 1556456283000000\n"));
  EXPECT_THAT(output, HasSubstr("eph: 2.5\nepv: 3\n"));
}

TEST_F(Px4Publisher, SendsNothingWithoutAFix) {
  const auto publisher = make_px4_publisher(node, sample_identity(), HostSettings());
  const auto subscriber =
      node->Subscribe("/gazebo/city/iris/link/gps0", &Px4Publisher::hear, static_cast<Px4Publisher*>(this));
  ASSERT_TRUE(publish_until(*publisher, [&] { return !raw.empty(); }));

  SampleReport no_fix(false);
  no_fix.report.sim_time_ns = 55'000'000'000;
  live::ReceiverReport no_truth = no_fix.report;
  no_truth.step = nullptr;
  publisher->publish(no_fix.report);
  publisher->publish(no_truth);
  // Messages arrive in order: after this one, all earlier ones have arrived.
  sample.report.sim_time_ns = 77'000'000'000;
  ASSERT_TRUE(
      publish_until(*publisher, [&] { return raw.back() == wire_bytes(*sitl_gps_of(sample.report)); }));
  SitlGps at_55;
  at_55.time_usec = 55'000'000;
  const std::string start = wire_bytes(at_55).substr(0, 5);  // key and varint of time_usec
  for (const std::string& bytes : raw) EXPECT_NE(bytes.substr(0, 5), start);
}

}  // namespace
}  // namespace canyon::adapters::gazebo_classic
