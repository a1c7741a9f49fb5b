#include "adapters/gazebo_classic/pose_source.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <atomic>
#include <boost/make_shared.hpp>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <limits>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "adapters/gazebo_classic/ignition_types.hpp"
#include "adapters/gazebo_classic/testing/in_process_server.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

using gazebo::common::Time;
using ignition::math::Pose3d;
using ignition::math::Quaterniond;
using ignition::math::Vector3d;
using test::InProcessServer;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

void expect_near(const Vector3d& actual, const Vector3d& expected, double tolerance) {
  EXPECT_LE((actual - expected).Length(), tolerance) << actual << ", expected " << expected;
}

// The rotation angle between two attitudes [rad].
double angle_between(const Quaterniond& a, const Quaterniond& b) {
  const Quaterniond d = a.Inverse() * b;
  return 2 * std::atan2(Vector3d(d.X(), d.Y(), d.Z()).Length(), std::abs(d.W()));
}

// --- links
// -------------------------------------------------------------------------------------------------

// Three bodies without gravity or contact: "free" with a centre of mass next to its origin, "driven"
// (kinematic) and "fixed" (static), 1 ms steps.
constexpr const char* kWorld =
    R"(<?xml version="1.0"?><sdf version="1.6"><world name="w"><gravity>0 0 0</gravity>
<physics type="ode"><max_step_size>0.001</max_step_size><real_time_update_rate>0</real_time_update_rate></physics>
<model name="free"><pose>10 -5 30 0.2 -0.1 0.7</pose><link name="body"><inertial><pose>0.3 -0.2 0.1 0 0 0</pose><mass>2</mass>
<inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial></link></model>
<model name="driven"><link name="body"><kinematic>true</kinematic></link></model>
<model name="fixed"><static>true</static><link name="body"/></model>
</world></sdf>)";

gazebo::physics::LinkPtr link_of(const gazebo::physics::WorldPtr& world, const std::string& model) {
  return world->ModelByName(model)->GetLink("body");
}

// A truth in Gazebo's types.
struct Truth {
  explicit Truth(const simulation::RigidPose& from)
      : pose(ignition_from(from.position_m),
             {from.attitude.w(), from.attitude.x(), from.attitude.y(), from.attitude.z()}),
        linear_velocity(ignition_from(from.linear_velocity)),
        angular_velocity(ignition_from(from.angular_velocity)) {}
  Pose3d pose;
  Vector3d linear_velocity, angular_velocity;
};

// The truth, which must exist for the test.
Truth truth(PoseSource& source, const Time& now) {
  std::string reason;
  const auto pose = source.at(now, reason);
  if (!pose) throw std::runtime_error("no truth: " + reason);
  return Truth(*pose);
}

TEST(LinkPoseSource, FollowsASpinningBodyWithALever) {
  auto& server = InProcessServer::get();
  const auto world = server.load(kWorld);
  const auto link = link_of(world, "free");
  const Pose3d sensor({1.5, 0.4, -0.6}, Quaterniond(0.1, 0.2, 0.3));
  const auto source = make_link_pose_source(link, sensor);

  const Pose3d start({10, -5, 30}, Quaterniond(0.2, -0.1, 0.7));
  const Vector3d centre(0.3, -0.2, 0.1);
  const Vector3d velocity(2, -1, 0.5);
  const Vector3d spin(0.3, -0.4, 1.2);  // constant: the inertia is a sphere's
  link->SetLinearVel(velocity);         // of the centre of mass
  link->SetAngularVel(spin);
  for (const int steps : {1, 400, 1099}) {
    server.step(static_cast<unsigned>(steps));
    const double t = world->SimTime().Double();
    const Truth truth_now = truth(*source, world->SimTime());
    // Closed form: the centre moves straight, everything rotates about it. The engine's first-order rotations
    // of 1.3 mrad per step add up to an error below 1e-6 rad; the pose is off by at most the rounding of one
    // step.
    const Quaterniond rotated = Quaterniond(spin.Normalized(), spin.Length() * t) * start.Rot();
    const Vector3d centre_now = start.Pos() + start.Rot() * centre + velocity * t;
    const Vector3d lever = rotated * (sensor.Pos() - centre);
    expect_near(truth_now.pose.Pos(), centre_now + lever, 1e-5);
    EXPECT_LT(angle_between(truth_now.pose.Rot(), rotated * sensor.Rot()), 1e-5);
    expect_near(truth_now.linear_velocity, velocity + spin.Cross(lever), 1e-5);
    expect_near(truth_now.angular_velocity, spin, 1e-9);
  }
}

TEST(LinkPoseSource, MovedByPosesItsVelocityIsTheirDifference) {
  auto& server = InProcessServer::get();
  const auto world = server.load(kWorld);
  const Vector3d lever(0.8, -0.3, 0.5);
  for (const std::string name : {"driven", "fixed"}) {
    const auto model = world->ModelByName(name);
    const auto source = make_link_pose_source(link_of(world, name), Pose3d(lever, Quaterniond::Identity));
    const double begin = world->SimTime().Double();
    const auto position = [&](double t) {
      return Pose3d({3 * t, -2 * t, 1 + 0.5 * t}, Quaterniond(0, 0, 0.4 * t));
    };
    for (int i = 0; i < 20; ++i) {
      model->SetWorldPose(position(world->SimTime().Double() - begin));
      const Truth now = truth(*source, world->SimTime());
      const double t = world->SimTime().Double() - begin;
      const Vector3d arm = position(t).Rot() * lever;
      expect_near(now.pose.Pos(), position(t).Pos() + arm, 1e-12);
      if (i == 0) {
        EXPECT_EQ(now.linear_velocity, Vector3d::Zero) << "one pose has no velocity";
      } else {
        // The mean over the last 10 ms differs from the velocity at its end by half of w^2 r dt: 0.7 mm/s.
        expect_near(now.linear_velocity, Vector3d(3, -2, 0.5) + Vector3d(0, 0, 0.4).Cross(arm), 1e-3);
        expect_near(now.angular_velocity, {0, 0, 0.4}, 1e-9);
        // A second call at the same time returns the same.
        EXPECT_EQ(truth(*source, world->SimTime()).linear_velocity, now.linear_velocity);
      }
      server.step(10);
    }
    // Teleported, 20 m in 10 ms: at the new position, at rest, and in motion again from the next pose on.
    const double t = world->SimTime().Double() - begin;
    const Pose3d far_away(position(t).Pos() + Vector3d(0, 0, 20), position(t).Rot());
    model->SetWorldPose(far_away);
    const Truth jumped = truth(*source, world->SimTime());
    expect_near(jumped.pose.Pos(), far_away.Pos() + position(t).Rot() * lever, 1e-12);
    EXPECT_EQ(jumped.linear_velocity, Vector3d::Zero);
    EXPECT_EQ(jumped.angular_velocity, Vector3d::Zero);
    server.step(10);
    model->SetWorldPose(Pose3d(far_away.Pos() + Vector3d(0.01, 0, 0), far_away.Rot()));
    expect_near(truth(*source, world->SimTime()).linear_velocity, {1, 0, 0}, 1e-9);
    // Stationary, and after a reset: no velocity, for any distance from the previous pose.
    server.step(10);
    EXPECT_EQ(truth(*source, world->SimTime()).linear_velocity, Vector3d::Zero);
    source->reset();
    model->SetWorldPose(position(0));
    server.step(10);
    EXPECT_EQ(truth(*source, world->SimTime()).linear_velocity, Vector3d::Zero);
  }
}

TEST(LinkPoseSource, ABodyThatWasStoppedStands) {
  // It moved 20 mm since the last time, by its own velocity, which is now 0 in the engine.
  auto& server = InProcessServer::get();
  const auto world = server.load(kWorld);
  const auto link = link_of(world, "free");
  const auto source = make_link_pose_source(link, Pose3d::Zero);
  link->SetLinearVel({2, 0, 0});
  server.step(10);
  expect_near(truth(*source, world->SimTime()).linear_velocity, {2, 0, 0}, 1e-9);
  server.step(10);
  link->SetLinearVel({0, 0, 0});
  EXPECT_EQ(truth(*source, world->SimTime()).linear_velocity, Vector3d::Zero);
  server.step(10);
  EXPECT_EQ(truth(*source, world->SimTime()).linear_velocity, Vector3d::Zero);
}

TEST(LinkPoseSource, TimeThatJumpsBackBeginsAnew) {
  auto& server = InProcessServer::get();
  const auto world = server.load(kWorld);
  const auto source = make_link_pose_source(link_of(world, "driven"), Pose3d::Zero);
  (void)truth(*source, Time(5.0));
  world->ModelByName("driven")->SetWorldPose(Pose3d(1, 0, 0, 0, 0, 0));
  EXPECT_EQ(truth(*source, Time(4.9)).linear_velocity, Vector3d::Zero);
  world->ModelByName("driven")->SetWorldPose(Pose3d(1.5, 0, 0, 0, 0, 0));
  expect_near(truth(*source, Time(5.0)).linear_velocity, {5, 0, 0}, 1e-9);
}

TEST(LinkPoseSource, ALinkThatIsGoneHasNoTruth) {
  auto& server = InProcessServer::get();
  auto world = server.load(kWorld);
  const auto source = make_link_pose_source(link_of(world, "driven"), Pose3d::Zero);
  std::string reason;
  EXPECT_TRUE(source->at(world->SimTime(), reason));
  world.reset();
  server.unload();
  // The source does not keep the link of an ended world alive.
  EXPECT_FALSE(source->at(Time(1.0), reason));
  EXPECT_EQ(reason, "link driven::body no longer exists");
}

// --- topics
// ------------------------------------------------------------------------------------------------

// A source of "/mocap/car", and a publisher of it.
class TopicPoseSourceTest : public testing::Test {
 protected:
  TopicPoseSourceTest() {
    world_ = InProcessServer::get().load(kWorld);
    node_ = boost::make_shared<gazebo::transport::Node>();
    node_->Init(world_->Name());
    HostSettings settings;
    settings.pose_topic = "/mocap/car";
    settings.pose_timeout_s = 0.3;
    source_ = make_topic_pose_source(node_, settings);
    listener_ = node_->Subscribe("/mocap/car", &TopicPoseSourceTest::hear, this);
    publisher_ = node_->Advertise<gazebo::msgs::PoseStamped>("/mocap/car");
    // Messages sent before both are connected are lost.
    if (!publisher_->WaitForConnection(Time(20))) throw std::runtime_error("nobody subscribes");
  }

  void send(const Pose3d& pose, double stamp_s) {
    gazebo::msgs::PoseStamped message;
    gazebo::msgs::Set(message.mutable_time(), Time(stamp_s));
    gazebo::msgs::Set(message.mutable_pose(), pose);
    {
      const std::lock_guard lock(mutex_);
      ++sent_;
    }
    publisher_->Publish(message);
  }

  /// Waits until everything sent so far has been received, by the source before the listener: callbacks of a
  /// node are called in the order of subscription. False after 20 s.
  bool arrives() {
    std::unique_lock lock(mutex_);
    return heard_all_.wait_for(lock, std::chrono::seconds(20), [this] { return heard_ == sent_; });
  }

  std::optional<Truth> now() {
    const auto pose = source_->at(world_->SimTime(), reason_);
    return pose ? std::optional<Truth>(*pose) : std::nullopt;
  }
  static void step(unsigned steps) { InProcessServer::get().step(steps); }

  gazebo::physics::WorldPtr world_;
  gazebo::transport::NodePtr node_;
  std::unique_ptr<PoseSource> source_;
  gazebo::transport::PublisherPtr publisher_;
  std::string reason_;

 private:
  void hear(ConstPoseStampedPtr&) {
    const std::lock_guard lock(mutex_);
    ++heard_;
    heard_all_.notify_all();
  }
  std::mutex mutex_;
  std::condition_variable heard_all_;
  int sent_ = 0;
  int heard_ = 0;
  gazebo::transport::SubscriberPtr listener_;
};

TEST_F(TopicPoseSourceTest, SaysWhyThereIsNoTruth) {
  EXPECT_FALSE(now());
  EXPECT_EQ(reason_, "no pose has come on /mocap/car yet");
  step(50);
  send(Pose3d(1, 2, 3, 0, 0, 0.5), 100);
  ASSERT_TRUE(arrives());
  // 50 ms of simulated time had passed when it arrived; it is valid for 300 ms more, also if paused.
  step(300);
  EXPECT_TRUE(now());
  step(1);
  EXPECT_FALSE(now());
  EXPECT_EQ(reason_, "the last pose on /mocap/car is 0.3 s old");
  step(899);
  EXPECT_FALSE(now());
  EXPECT_EQ(reason_, "the last pose on /mocap/car is 1.2 s old");
  send(Pose3d(2, 2, 3, 0, 0, 0.5), 101.2);
  ASSERT_TRUE(arrives());
  EXPECT_EQ(now()->linear_velocity, Vector3d::Zero) << "over a time without truth";
}

TEST_F(TopicPoseSourceTest, APauseDoesNotAgeTheTruth) {
  send(Pose3d(1, 2, 3, 0, 0, 0.5), 100);
  ASSERT_TRUE(arrives());
  const auto until = std::chrono::steady_clock::now() + std::chrono::milliseconds(600);  // twice the time-out
  while (std::chrono::steady_clock::now() < until) ASSERT_TRUE(now());
}

TEST_F(TopicPoseSourceTest, VelocityIsTheDifferenceOfTheLastTwo) {
  const Quaterniond first(0.1, 0.2, 0.3);
  const Vector3d axis = Vector3d(2, 1, -1).Normalized();
  send(Pose3d({1, 2, 3}, first), 100);
  ASSERT_TRUE(arrives());
  EXPECT_EQ(now()->linear_velocity, Vector3d::Zero);
  step(100);
  // The sender's stamps are used: their interval is a tenth of the simulated one, and its clock is better.
  send(Pose3d({1.5, 1.9, 3.2}, Quaterniond(axis, 0.05) * first), 100.01);
  ASSERT_TRUE(arrives());
  expect_near(now()->linear_velocity, {50, -10, 20}, 1e-6);
  expect_near(now()->angular_velocity, axis * 5, 1e-6);
  EXPECT_LT(angle_between(now()->pose.Rot(), Quaterniond(axis, 0.05) * first), 1e-9);
  // Poses without stamps have simulated time.
  step(100);
  send(Pose3d({1.6, 2, 3}, first), 0);
  ASSERT_TRUE(arrives());
  step(200);
  send(Pose3d({2.0, 2, 3}, first), 0);
  ASSERT_TRUE(arrives());
  expect_near(now()->linear_velocity, {2, 0, 0}, 1e-9);
  // The subject was moved to another position.
  step(100);
  send(Pose3d({2002, 2, 3}, first), 0);
  ASSERT_TRUE(arrives());
  EXPECT_EQ(now()->linear_velocity, Vector3d::Zero);
}

TEST_F(TopicPoseSourceTest, DropsPosesThatAreNone) {
  send(Pose3d(1, 2, 3, 0, 0, 0.5), 100);
  ASSERT_TRUE(arrives());
  send(Pose3d({kNan, 2, 3}, Quaterniond::Identity), 100.1);
  send(Pose3d({7, 2, 3}, Quaterniond(0, 0, 0, 0)), 100.2);
  ASSERT_TRUE(arrives());
  EXPECT_EQ(now()->pose.Pos().X(), 1);
  send(Pose3d({3, 2, 3}, Quaterniond(0, 0, 0, 2)), 101);
  ASSERT_TRUE(arrives());
  EXPECT_EQ(now()->pose.Pos().X(), 3);
  EXPECT_EQ(now()->pose.Rot(), Quaterniond(0, 0, 0, 1));
  expect_near(now()->linear_velocity, {2, 0, 0}, 1e-9);  // 2 m in the second since the last good one
}

TEST_F(TopicPoseSourceTest, AResetForgets) {
  step(500);
  send(Pose3d(1, 2, 3, 0, 0, 0.5), 100);
  ASSERT_TRUE(arrives());
  source_->reset();
  world_->Reset();
  EXPECT_EQ(world_->SimTime(), Time(0));
  EXPECT_FALSE(now());
  EXPECT_EQ(reason_, "no pose has come on /mocap/car yet");
  send(Pose3d(2, 2, 3, 0, 0, 0.5), 101);
  ASSERT_TRUE(arrives());
  step(300);
  EXPECT_TRUE(now());
  step(1);
  EXPECT_FALSE(now());
}

TEST_F(TopicPoseSourceTest, TimeThatJumpsBackForgetsToo) {
  step(500);
  send(Pose3d(1, 2, 3, 0, 0, 0.5), 100);
  ASSERT_TRUE(arrives());
  world_->SetSimTime(Time(0.2));
  EXPECT_FALSE(now());
  EXPECT_EQ(reason_, "no pose has come on /mocap/car yet");
}

TEST_F(TopicPoseSourceTest, EndsWhileMessagesCome) {
  // A thread publishes continuously while sources are made and destroyed: a destroyed source must not be
  // used.
  std::atomic<bool> stop{false};
  std::thread sender([&] {
    for (int i = 0; !stop; ++i) {
      send(Pose3d(i, 0, 0, 0, 0, 0), i);
      std::this_thread::yield();
    }
  });
  HostSettings settings;
  settings.pose_topic = "/mocap/car";
  for (int i = 0; i < 200; ++i) {
    auto source = make_topic_pose_source(node_, settings);
    (void)source->at(world_->SimTime(), reason_);
    source.reset();
    step(1);
  }
  stop = true;
  sender.join();
  SUCCEED();
}

}  // namespace
}  // namespace canyon::adapters::gazebo_classic
