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

#include "adapters/gazebo_classic/publishers.hpp"
#include "adapters/gazebo_classic/ray_visuals.hpp"
#include "adapters/gazebo_classic/testing/in_process_server.hpp"
#include "adapters/gazebo_classic/visual_ledger.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::gazebo_classic {
namespace {

using ignition::math::Vector3d;
using propagation::PathKind;
using propagation::Visibility;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

constexpr double kDeg = std::numbers::pi / 180;

[[nodiscard]] propagation::Path reflected(const Eigen::Vector3d& point) {
  propagation::Path path;
  path.kind = PathKind::Reflected;
  path.point = point;
  return path;
}

/// A report put together by hand; what visuals do not read is left out.
struct Sky {
  simulation::LiveReceiver::Step step;
  ReceiverReport report;

  explicit Sky(const Vector3d& antenna = {}) {
    report.step = &step;
    report.antenna_world.Pos() = antenna;
  }
  Sky(const Sky&) = delete;
  Sky& operator=(const Sky&) = delete;

  Sky& add(int prn, double azimuth_deg, double elevation_deg, Visibility visibility,
           const std::vector<Eigen::Vector3d>& reflection_points_enu = {}, bool above_mask = true) {
    const gnss::SatelliteId id{gnss::System::GPS, static_cast<std::uint8_t>(prn)};
    propagation::SatelliteView view;
    view.line.id = id;
    view.line.azimuth_rad = azimuth_deg * kDeg;
    view.line.elevation_rad = elevation_deg * kDeg;
    view.paths.visibility = visibility;
    if (visibility == Visibility::LOS || visibility == Visibility::LOSMultipath) {
      view.paths.paths.emplace_back();
    }
    for (const auto& point : reflection_points_enu) view.paths.paths.push_back(reflected(point));
    step.arrival.views.push_back(view);
    receiver::SatelliteObservation seen;
    seen.id = id;
    seen.above_mask = above_mask;
    seen.visibility = visibility;
    step.epoch.observed.satellites.push_back(seen);
    return *this;
  }
  Sky& fix(double east_m, double north_m, double up_m) {
    step.epoch.observed.fix.status = positioning::FixStatus::Fix;
    step.epoch.error_enu_m = {east_m, north_m, up_m};
    return *this;
  }
  Sky& clear() {
    step = {};
    return *this;
  }
};

[[nodiscard]] std::map<std::string, VisualShape> by_name(const std::vector<VisualShape>& shapes) {
  std::map<std::string, VisualShape> named;
  for (const VisualShape& s : shapes) EXPECT_TRUE(named.emplace(s.name, s).second) << s.name;
  return named;
}
[[nodiscard]] std::vector<std::string> names(const std::vector<VisualShape>& shapes) {
  std::vector<std::string> result;
  for (const VisualShape& s : shapes) result.push_back(s.name);
  return result;
}
[[nodiscard]] Vector3d begin_of(const VisualShape& cylinder) {
  return cylinder.centre - cylinder.length / 2 * cylinder.axis;
}
[[nodiscard]] Vector3d end_of(const VisualShape& cylinder) {
  return cylinder.centre + cylinder.length / 2 * cylinder.axis;
}
void expect_near(const Vector3d& is, const Vector3d& should, double tolerance = 1e-9) {
  EXPECT_LT((is - should).Length(), tolerance) << is << " should be " << should;
}
void expect_colour(const VisualShape& shape, const drawing::Colour& colour) {
  EXPECT_EQ(std::make_tuple(shape.colour.r, shape.colour.g, shape.colour.b),
            std::make_tuple(colour.r, colour.g, colour.b))
      << shape.name;
}

TEST(RayShapes, PointToTheSatelliteInATurnedWorld) {
  // Azimuth 20 deg is yaw 70 deg in ENU; the world's x axis lies 30 deg counter-clockwise from east, so that
  // it is yaw 40 deg there.
  Sky sky({5, -7, 2});
  sky.report.world_yaw_from_enu_rad = -30 * kDeg;
  sky.add(5, 20, 50, Visibility::LOS);
  const auto shapes = by_name(ray_shapes(sky.report, 80));
  ASSERT_EQ(shapes.size(), 2U);
  const VisualShape& line = shapes.at("G05.direct");
  EXPECT_EQ(line.kind, VisualShape::Kind::Cylinder);
  EXPECT_NEAR(line.length, 80, 1e-9);
  expect_near(begin_of(line), {5, -7, 2});
  const Vector3d towards(std::cos(50 * kDeg) * std::cos(40 * kDeg), std::cos(50 * kDeg) * std::sin(40 * kDeg),
                         std::sin(50 * kDeg));
  expect_near(line.axis, towards);
  expect_near(shapes.at("G05.satellite").centre, Vector3d(5, -7, 2) + 80 * towards);
}

TEST(RayShapes, GoByWayOfTheReflectionPoint) {
  // ENU point (3, 4, 6) turned by +90 deg about the vertical is (-4, 3, 6).
  Sky sky({1, 2, 3});
  sky.report.world_yaw_from_enu_rad = 90 * kDeg;
  sky.add(7, 90, 30, Visibility::NLOS, {{3, 4, 6}});
  const auto shapes = by_name(ray_shapes(sky.report, 50));
  ASSERT_EQ(shapes.size(), 3U);
  expect_near(begin_of(shapes.at("G07.path0.in")), {1, 2, 3});
  expect_near(end_of(shapes.at("G07.path0.in")), {-4, 3, 6});
  expect_near(shapes.at("G07.path0.point").centre, {-4, 3, 6});
  EXPECT_EQ(shapes.at("G07.path0.point").kind, VisualShape::Kind::Sphere);
  expect_near(begin_of(shapes.at("G07.path0.out")), {-4, 3, 6});
  // East turned by +90 deg is north: y.
  expect_near(end_of(shapes.at("G07.path0.out")),
              {-4, 3 + 50 * std::cos(30 * kDeg), 6 + 50 * std::sin(30 * kDeg)});
}

TEST(RayShapes, AreColouredAsInAllPictures) {
  Sky sky;
  sky.add(1, 10, 40, Visibility::LOS)
      .add(2, 100, 41, Visibility::LOSMultipath, {{1, 0, 5}})
      .add(3, 200, 42, Visibility::NLOS, {{0, 1, 5}})
      .add(4, 300, 43, Visibility::Blocked);
  const auto shapes = by_name(ray_shapes(sky.report, 100));
  // Okabe and Ito's green, blue, orange; grey.
  expect_colour(shapes.at("G01.direct"), drawing::rgb(0x009E73));
  expect_colour(shapes.at("G02.direct"), drawing::rgb(0x0072B2));
  expect_colour(shapes.at("G02.path0.in"), drawing::rgb(0x0072B2));
  expect_colour(shapes.at("G03.path0.out"), drawing::rgb(0xE69F00));
  expect_colour(shapes.at("G04.direct"), drawing::rgb(0x7A7A7A));
  EXPECT_EQ(shapes.count("G03.direct"), 0U) << "nothing comes that way";
  EXPECT_EQ(shapes.count("G04.satellite"), 0U) << "it is not seen";
}

TEST(RayShapes, LeaveOutWhatIsBelowTheMaskAndNeedAnEpoch) {
  Sky sky;
  sky.add(1, 10, 4, Visibility::LOS, {}, false).add(2, 100, 41, Visibility::Blocked);
  EXPECT_THAT(names(ray_shapes(sky.report, 100)), ElementsAre("G02.direct"));
  sky.report.step = nullptr;
  EXPECT_THAT(ray_shapes(sky.report, 100), IsEmpty());
}

TEST(RayShapes, EndWhereTheScanMeetsAWall) {
  Sky sky;
  sky.add(1, 0, 45, Visibility::LOS).add(2, 90, 0, Visibility::Blocked).add(3, 180, 0, Visibility::Blocked);
  sky.report.scan_ranges_m = {HUGE_VAL, 17, 12.5, 40, 150, HUGE_VAL};
  const auto shapes = by_name(ray_shapes(sky.report, 100));
  EXPECT_NEAR(shapes.at("G01.direct").length, 100, 1e-9);
  EXPECT_NEAR(shapes.at("G02.direct").length, 12.5, 1e-9);
  EXPECT_NEAR(shapes.at("G03.direct").length, 100, 1e-9) << "never longer than asked for";
}

TEST(RayShapes, DrawTheShortestPathsOnly) {
  Sky sky;
  sky.add(9, 40, 30, Visibility::NLOS, {{1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}});
  const auto shapes = by_name(ray_shapes(sky.report, 100));
  EXPECT_EQ(shapes.size(), 3 * kMaxDrawnPaths);
  EXPECT_EQ(shapes.at("G09.path2.point").centre.X(), 3);
}

TEST(RayShapes, BendAtEdgesAndAreFaintWhereScattered) {
  Sky sky({0, 0, 2});
  sky.add(3, 90, 30, Visibility::NLOS, {{4, 0, 12}, {-6, 0, 8}}).add(4, 0, 60, Visibility::LOS, {{0, 3, 9}});
  auto& views = sky.step.arrival.views;
  views[0].paths.paths[0].kind = PathKind::Diffracted;
  views[0].paths.paths[1].kind = PathKind::Diffuse;
  views[1].paths.paths[1].kind = PathKind::Diffracted;  // beside a clear path
  const auto shapes = by_name(ray_shapes(sky.report, 100));
  EXPECT_EQ(shapes.count("G04.path0.in"), 0U);
  EXPECT_EQ(shapes.size(), 2U + 3 + 2);
  const VisualShape& bend = shapes.at("G03.path0.in");
  expect_near(begin_of(bend), {0, 0, 2});
  expect_near(end_of(bend), {4, 0, 12});
  expect_near(shapes.at("G03.path0.point").centre, {4, 0, 12});
  const VisualShape& beyond = shapes.at("G03.path0.out");
  expect_near(begin_of(beyond), {4, 0, 12});
  expect_near(beyond.axis, {std::cos(30 * kDeg), 0, std::sin(30 * kDeg)});
  EXPECT_EQ(shapes.count("G03.path1.point"), 0U);
  const VisualShape& scattered = shapes.at("G03.path1.in");
  expect_near(end_of(scattered), {-6, 0, 8});
  expect_colour(scattered, drawing::rgb(0xE69F00));
  EXPECT_LT(scattered.colour.a, bend.colour.a / 2);
  EXPECT_LT(scattered.radius, bend.radius);
}

TEST(RayShapes, AreNotDrawnWithoutAPlace) {
  Sky sky;
  sky.add(1, 0, 45, Visibility::LOS).add(3, 200, 42, Visibility::NLOS, {{NAN, 1, 5}});
  EXPECT_THAT(names(ray_shapes(sky.report, 100)), ElementsAre("G01.direct", "G01.satellite"));
  sky.report.antenna_world.Pos().X(NAN);
  EXPECT_THAT(ray_shapes(sky.report, 100), IsEmpty());
  EXPECT_THAT(bubble_shapes(sky.report, 1), IsEmpty());
}

TEST(BubbleShapes, GrowAndBrightenWithTheHorizontalError) {
  Sky sky({1, 2, 3});
  const auto bubble = [&](double east, double north, double scale) {
    sky.fix(east, north, 1000);  // heights do not count
    const auto shapes = bubble_shapes(sky.report, scale);
    EXPECT_EQ(shapes.size(), 1U);
    return shapes.at(0);
  };
  EXPECT_DOUBLE_EQ(bubble(3, 4, 1).radius, 5);
  EXPECT_DOUBLE_EQ(bubble(3, 4, 1.5).radius, 7.5);
  EXPECT_DOUBLE_EQ(bubble(0.3, 0.4, 1).radius, kBubbleSmallest_m);
  EXPECT_DOUBLE_EQ(bubble(300, 400, 1).radius, kBubbleLargest_m);
  expect_near(bubble(3, 4, 1).centre, {1, 2, 3});
  expect_colour(bubble(0, 0, 1), drawing::viridis(0));
  expect_colour(bubble(6, 8, 3), drawing::viridis(0.5));  // 10 of 20 m, whatever the size
  expect_colour(bubble(60, 80, 1), drawing::viridis(1));
  EXPECT_LT(bubble(3, 4, 1).colour.a, 1) << "translucent";
}

TEST(BubbleShapes, AreGreyWithoutAFix) {
  Sky sky;  // error NaN, not solved
  const auto shapes = bubble_shapes(sky.report, 10);
  ASSERT_EQ(shapes.size(), 1U);
  EXPECT_DOUBLE_EQ(shapes[0].radius, kBubbleNoFix_m);
  expect_colour(shapes[0], drawing::rgb(0x7A7A7A));
  sky.report.step = nullptr;
  EXPECT_THAT(bubble_shapes(sky.report, 10), IsEmpty());
}

[[nodiscard]] VisualShape ball(const std::string& name, double x, double red = 0.5) {
  VisualShape shape;
  shape.name = name;
  shape.centre.X(x);
  shape.radius = 1;
  shape.colour.r = red;
  return shape;
}
/// "+a" told whole, "~a" moved, "-a" hidden.
[[nodiscard]] std::vector<std::string> told(const std::vector<VisualLedger::Change>& changes) {
  std::vector<std::string> result;
  for (const auto& c : changes) result.push_back((!c.visible ? "-" : c.whole ? "+" : "~") + c.name);
  return result;
}

TEST(VisualLedger, TellsWhatChanged) {
  std::uint32_t next = 40;
  VisualLedger ledger([&] { return next++; });
  const auto first = ledger.update({ball("a", 1), ball("b", 2)}, false);
  EXPECT_THAT(told(first), ElementsAre("+a", "+b"));
  EXPECT_EQ(first[1].id, 41U);
  EXPECT_THAT(told(ledger.update({ball("a", 1), ball("b", 2)}, false)), IsEmpty());
  EXPECT_THAT(told(ledger.update({ball("a", 1), ball("b", 3)}, false)), ElementsAre("~b"));
  EXPECT_THAT(told(ledger.update({ball("a", 1, 0.7), ball("b", 3)}, false)), ElementsAre("+a"));
  EXPECT_THAT(told(ledger.update({ball("b", 3)}, false)), ElementsAre("-a"));
  EXPECT_THAT(told(ledger.update({ball("b", 3)}, false)), IsEmpty());
  const auto back = ledger.update({ball("a", 1, 0.7), ball("b", 3)}, false);
  EXPECT_THAT(told(back), ElementsAre("~a"));
  EXPECT_EQ(back[0].id, 40U) << "one shape, one number";
  EXPECT_THAT(told(ledger.update({ball("b", 3)}, true)), ElementsAre("+b", "-a"));
  EXPECT_THAT(ledger.clear(), UnorderedElementsAre("a", "b"));
  EXPECT_THAT(told(ledger.update({ball("b", 3)}, false)), ElementsAre("+b"));
}

TEST(RateLimit, LetsOneThroughPerInterval) {
  RateLimit limit(0.1);
  int passed = 0;
  for (int i = 0; i < 100; ++i) passed += limit.due(1000 + i * 0.004) ? 1 : 0;  // 0.4 s
  EXPECT_EQ(passed, 4);
  limit.reset();
  EXPECT_TRUE(limit.due(1000.397));
}

/// Listens as a client does.
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

  /// Waits until a visual whose name ends so is told with such a visibility, or for 10 s.
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

  /// Publishes until something new of such a visual is told: the clock on the wall limits the rate.
  static void publish_news(EpochPublisher& visuals, const ReceiverReport& report, Client& client,
                           const std::string& ending) {
    const int before = client.count_of(ending);
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    while (client.count_of(ending) == before && std::chrono::steady_clock::now() < deadline) {
      visuals.publish(report);
    }
  }

  static inline gazebo::physics::WorldPtr world_;  // one for all tests: nothing of them stays in it
  gazebo::transport::NodePtr node_;
  ReceiverIdentity identity_;
  PluginSettings settings_;
};

TEST_F(Visuals, ReachAClientAndLeaveIt) {
  Client client(world_->Name());
  auto visuals = make_visuals(node_, identity_, settings_);
  Sky sky({1, 2, 3});
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
  // The server takes such requests for models that it has not, and lives on.
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
  visuals->publish(sky.report);  // at once, whatever the rate
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

TEST_F(Visuals, RefuseSizesThatAreNone) {
  settings_.bubble_scale = 0;
  EXPECT_THROW((void)make_visuals(node_, identity_, settings_), InputError);
  settings_.bubble_scale = 1;
  settings_.ray_length_m = -3;
  EXPECT_THROW((void)make_visuals(node_, identity_, settings_), InputError);
}

}  // namespace
}  // namespace canyon::gazebo_classic
