#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <condition_variable>
#include <gazebo/msgs/msgs.hh>
#include <gazebo/transport/transport.hh>
#include <map>
#include <mutex>
#include <numbers>
#include <set>

#include "adapters/common/ray_visuals.hpp"
#include "adapters/common/testing/hand_made_sky.hpp"
#include "adapters/gazebo_classic/publishers.hpp"
#include "adapters/gazebo_classic/testing/in_process_server.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

using canyon::test::Sky;
using ignition::math::Vector3d;
using propagation::Visibility;

constexpr double kDeg = std::numbers::pi / 180;

void expect_near(const Vector3d& is, const Vector3d& should, double tolerance = 1e-9) {
  EXPECT_LT((is - should).Length(), tolerance) << is << " should be " << should;
}

/// Subscribes like a client.
class Client {
 public:
  explicit Client(const std::string& world) : node_(new gazebo::transport::Node()) {
    node_->Init(world);
    visuals_ = node_->Subscribe("~/visual", &Client::on_visual, this);
    requests_ = node_->Subscribe("~/request", &Client::on_request, this);
  }
  ~Client() { node_->Fini(); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Waits, at most 10 s, for a visual with this end of its name and this visibility.
  bool sees(const std::string& ending, bool visible = true) {
    return wait([&] {
      const auto found = find(ending);
      return found != last_.end() && found->second.visible() == visible;
    });
  }
  bool sees_removal_of(const std::string& name) {
    return wait([&] { return removed_.count(name) == 1; });
  }
  [[nodiscard]] gazebo::msgs::Visual whole(const std::string& ending) {
    const std::lock_guard lock(mutex_);
    for (const auto& [name, message] : whole_) {
      if (name.ends_with(ending)) return message;
    }
    return {};
  }
  [[nodiscard]] std::vector<std::string> all_names() {
    const std::lock_guard lock(mutex_);
    std::vector<std::string> result;
    for (const auto& entry : last_) result.push_back(entry.first);
    return result;
  }
  [[nodiscard]] int count_of(const std::string& ending) {
    const std::lock_guard lock(mutex_);
    int n = 0;
    for (const auto& [name, count] : count_) n += name.ends_with(ending) ? count : 0;
    return n;
  }

 private:
  template <typename Condition>
  bool wait(Condition condition) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(10), condition);
  }
  std::map<std::string, gazebo::msgs::Visual>::const_iterator find(const std::string& ending) const {
    auto at = last_.begin();
    while (at != last_.end() && !at->first.ends_with(ending)) ++at;
    return at;
  }
  void on_visual(ConstVisualPtr& message) {
    const std::lock_guard lock(mutex_);
    last_[message->name()] = *message;
    if (message->has_material()) whole_[message->name()] = *message;
    ++count_[message->name()];
    changed_.notify_all();
  }
  void on_request(ConstRequestPtr& message) {
    const std::lock_guard lock(mutex_);
    if (message->request() == "entity_delete") removed_.insert(message->data());
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, gazebo::msgs::Visual> last_, whole_;
  std::map<std::string, int> count_;
  std::set<std::string> removed_;
  gazebo::transport::NodePtr node_;
  gazebo::transport::SubscriberPtr visuals_, requests_;
};

class Visuals : public testing::Test {
 protected:
  Visuals() : node_(new gazebo::transport::Node()) {
    node_->Init(world_->Name());
    identity_.world = world_->Name();
    identity_.model = "car";
    settings_.show_rays = settings_.show_bubble = true;
  }
  ~Visuals() override { node_->Fini(); }

  static void SetUpTestSuite() {
    world_ = test::InProcessServer::get().load(
        R"(<sdf version="1.6"><world name="visuals"><model name="car"><link name="body"/></model></world></sdf>)");
  }
  static void TearDownTestSuite() {
    world_.reset();
    test::InProcessServer::get().unload();
  }

  /// Publishes until a new message of this visual arrives: the rate is limited in wall time.
  static void publish_news(live::EpochPublisher& visuals, const live::ReceiverReport& report, Client& client,
                           const std::string& ending) {
    const int before = client.count_of(ending);
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    while (client.count_of(ending) == before && std::chrono::steady_clock::now() < deadline) {
      visuals.publish(report);
    }
  }

  static inline gazebo::physics::WorldPtr world_;  // shared by all tests, which leave nothing in it
  gazebo::transport::NodePtr node_;
  ReceiverIdentity identity_;
  HostSettings settings_;
};

TEST_F(Visuals, ReachAClientAndLeaveIt) {
  Client client(world_->Name());
  auto visuals = make_visuals(node_, identity_, settings_);
  Sky sky(Eigen::Vector3d{1, 2, 3});
  sky.add(5, 90, 30, Visibility::LOS).add(7, 0, 60, Visibility::NLOS, {{0, 8, 9}}).fix(3, 4, 0);
  visuals->publish(sky.report);
  ASSERT_TRUE(client.sees("G05.direct"));
  ASSERT_TRUE(client.sees("G05.satellite"));
  ASSERT_TRUE(client.sees("G07.path0.in"));
  ASSERT_TRUE(client.sees("G07.path0.point"));
  ASSERT_TRUE(client.sees("G07.path0.out"));
  ASSERT_TRUE(client.sees("bubble"));

  const gazebo::msgs::Visual line = client.whole("G05.direct");
  EXPECT_EQ(line.parent_name(), "visuals") << "hangs on the world";
  EXPECT_TRUE(line.has_cast_shadows() && !line.cast_shadows());
  EXPECT_NEAR(line.geometry().cylinder().length(), settings_.ray_length_m, 1e-9);
  const ignition::math::Pose3d pose = gazebo::msgs::ConvertIgn(line.pose());
  // East, 30 deg up.
  expect_near(pose.Rot().RotateVector(Vector3d::UnitZ), {std::cos(30 * kDeg), 0, 0.5}, 1e-9);
  expect_near(pose.Pos(),
              Vector3d(1, 2, 3) + settings_.ray_length_m / 2 * Vector3d(std::cos(30 * kDeg), 0, 0.5), 1e-6);
  EXPECT_NEAR(line.material().emissive().g(), 0x9E / 255.0, 1e-6);
  const gazebo::msgs::Visual bubble = client.whole("bubble");
  EXPECT_NEAR(bubble.geometry().sphere().radius(), 5, 1e-9);
  EXPECT_GT(bubble.transparency(), 0.3);

  // A satellite sets.
  sky.clear().add(7, 0, 60, Visibility::NLOS, {{0, 8, 9}}).fix(3, 4, 0);
  publish_news(*visuals, sky.report, client, "G05.direct");
  ASSERT_TRUE(client.sees("G05.direct", false));
  ASSERT_TRUE(client.sees("G05.satellite", false));
  EXPECT_TRUE(client.sees("G07.path0.in"));

  const auto all = client.all_names();
  EXPECT_EQ(all.size(), 6U);
  visuals.reset();
  for (const std::string& name : all) {
    EXPECT_TRUE(client.sees(name, false)) << name;
    EXPECT_TRUE(client.sees_removal_of(name)) << name;
  }
  // The server accepts such requests for missing models, and continues.
  test::InProcessServer::get().step(3);
  EXPECT_TRUE(world_->ModelByName("car"));
}

TEST_F(Visuals, VanishOnResetAndComeBack) {
  Client client(world_->Name());
  const auto visuals = make_visuals(node_, identity_, settings_);
  Sky sky;
  sky.add(5, 90, 30, Visibility::LOS).fix(1, 1, 1);
  visuals->publish(sky.report);
  ASSERT_TRUE(client.sees("G05.direct"));
  visuals->reset();
  ASSERT_TRUE(client.sees("G05.direct", false));
  ASSERT_TRUE(client.sees("bubble", false));
  visuals->publish(sky.report);  // at once, independent of the rate
  EXPECT_TRUE(client.sees("G05.direct"));
}

TEST_F(Visuals, VanishWithoutTruth) {
  Client client(world_->Name());
  const auto visuals = make_visuals(node_, identity_, settings_);
  Sky sky;
  sky.add(5, 90, 30, Visibility::LOS).fix(1, 1, 1);
  visuals->publish(sky.report);
  ASSERT_TRUE(client.sees("bubble"));
  sky.report.step = nullptr;
  publish_news(*visuals, sky.report, client, "bubble");
  EXPECT_TRUE(client.sees("bubble", false));
  EXPECT_TRUE(client.sees("G05.direct", false));
}

TEST_F(Visuals, AreSwitchedOneByOne) {
  Client client(world_->Name());
  Sky sky;
  sky.add(5, 90, 30, Visibility::LOS).fix(1, 1, 1);
  settings_.show_rays = false;
  make_visuals(node_, identity_, settings_)->publish(sky.report);
  ASSERT_TRUE(client.sees("bubble", false)) << "made and removed";
  EXPECT_EQ(client.count_of("G05.direct"), 0);
}

TEST_F(Visuals, KeepTheirRate) {
  Client client(world_->Name());
  const auto visuals = make_visuals(node_, identity_, settings_);
  Sky sky;
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 20000; ++i) {
    sky.clear().add(5, i % 360, 30, Visibility::LOS).fix(1, 1, 1);
    visuals->publish(sky.report);
  }
  const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  ASSERT_TRUE(client.sees("G05.direct"));
  EXPECT_LE(client.count_of("G05.direct"), 1 + took_s / 0.1);
}

}  // namespace
}  // namespace canyon::adapters::gazebo_classic
