#include "adapters/common/ray_visuals.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "adapters/common/testing/hand_made_sky.hpp"

namespace canyon::adapters {
namespace {

using canyon::test::Sky;
using Eigen::Vector3d;
using propagation::PathKind;
using propagation::Visibility;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

constexpr double kDeg = std::numbers::pi / 180;

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
  EXPECT_LT((is - should).norm(), tolerance) << is.transpose() << " should be " << should.transpose();
}
void expect_colour(const VisualShape& shape, const drawing::Colour& colour) {
  EXPECT_EQ(std::make_tuple(shape.colour.r, shape.colour.g, shape.colour.b),
            std::make_tuple(colour.r, colour.g, colour.b))
      << shape.name;
}

TEST(RayShapes, WhatTheReceiverCannotTrackIsNotDrawn) {
  Sky sky(Vector3d{0, 0, 2});
  sky.add(5, 20, 50, Visibility::NLOS, {{10, 0, 4}});
  EXPECT_EQ(by_name(ray_shapes(sky.report, 80)).count("G05.path0.point"), 1U);
  sky.step.epoch.observed.satellites[0].visibility =
      Visibility::Blocked;  // its paths arrive but are too weak
  const auto shapes = by_name(ray_shapes(sky.report, 80));
  ASSERT_EQ(shapes.size(), 1U);
  expect_colour(shapes.at("G05.direct"), drawing::colour_of(Visibility::Blocked));
}

TEST(RayShapes, PointToTheSatelliteInATurnedWorld) {
  // Azimuth 20 deg is yaw 70 deg in ENU; the world's x axis is 30 deg counter-clockwise from east, so that
  // it is yaw 40 deg there.
  Sky sky(Vector3d{5, -7, 2});
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
  // ENU point (3, 4, 6) rotated by +90 deg about the vertical is (-4, 3, 6).
  Sky sky(Vector3d{1, 2, 3});
  sky.report.world_yaw_from_enu_rad = 90 * kDeg;
  sky.add(7, 90, 30, Visibility::NLOS, {{3, 4, 6}});
  const auto shapes = by_name(ray_shapes(sky.report, 50));
  ASSERT_EQ(shapes.size(), 3U);
  expect_near(begin_of(shapes.at("G07.path0.in")), {1, 2, 3});
  expect_near(end_of(shapes.at("G07.path0.in")), {-4, 3, 6});
  expect_near(shapes.at("G07.path0.point").centre, {-4, 3, 6});
  EXPECT_EQ(shapes.at("G07.path0.point").kind, VisualShape::Kind::Sphere);
  expect_near(begin_of(shapes.at("G07.path0.out")), {-4, 3, 6});
  // East rotated by +90 deg is north: y.
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
  EXPECT_EQ(shapes.size(), 3 * kMaxRenderedPaths);
  EXPECT_EQ(shapes.at("G09.path2.point").centre.x(), 3);
}

TEST(RayShapes, BendAtEdgesAndAreFaintWhereScattered) {
  Sky sky(Vector3d{0, 0, 2});
  sky.add(3, 90, 30, Visibility::NLOS, {{4, 0, 12}, {-6, 0, 8}}).add(4, 0, 60, Visibility::LOS, {{0, 3, 9}});
  auto& views = sky.step.arrival.views;
  views[0].paths.paths[0].kind = PathKind::Diffracted;
  views[0].paths.paths[1].kind = PathKind::Diffuse;
  views[1].paths.paths[1].kind = PathKind::Diffracted;  // next to a clear path
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
  sky.report.antenna_world_m.x() = NAN;
  EXPECT_THAT(ray_shapes(sky.report, 100), IsEmpty());
  EXPECT_THAT(bubble_shapes(sky.report, 1), IsEmpty());
}

TEST(BubbleShapes, GrowAndBrightenWithTheHorizontalError) {
  Sky sky(Vector3d{1, 2, 3});
  const auto bubble = [&](double east, double north, double scale) {
    sky.fix(east, north, 1000);  // heights are ignored
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
  expect_colour(bubble(6, 8, 3), drawing::viridis(0.5));  // 10 of 20 m, for any size
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
  shape.centre.x() = x;
  shape.radius = 1;
  shape.colour.r = red;
  return shape;
}
/// "+a" sent whole, "~a" moved, "-a" hidden.
[[nodiscard]] std::vector<std::string> described(const std::vector<VisualLedger::Change>& changes) {
  std::vector<std::string> result;
  for (const auto& c : changes) result.push_back((!c.visible ? "-" : c.whole ? "+" : "~") + c.name);
  return result;
}

TEST(VisualLedger, TellsWhatChanged) {
  std::uint32_t next = 40;
  VisualLedger ledger([&] { return next++; });
  const auto first = ledger.update({ball("a", 1), ball("b", 2)}, false);
  EXPECT_THAT(described(first), ElementsAre("+a", "+b"));
  EXPECT_EQ(first[1].id, 41U);
  EXPECT_THAT(described(ledger.update({ball("a", 1), ball("b", 2)}, false)), IsEmpty());
  EXPECT_THAT(described(ledger.update({ball("a", 1), ball("b", 3)}, false)), ElementsAre("~b"));
  EXPECT_THAT(described(ledger.update({ball("a", 1, 0.7), ball("b", 3)}, false)), ElementsAre("+a"));
  EXPECT_THAT(described(ledger.update({ball("b", 3)}, false)), ElementsAre("-a"));
  EXPECT_THAT(described(ledger.update({ball("b", 3)}, false)), IsEmpty());
  const auto back = ledger.update({ball("a", 1, 0.7), ball("b", 3)}, false);
  EXPECT_THAT(described(back), ElementsAre("~a"));
  EXPECT_EQ(back[0].id, 40U) << "one shape, one number";
  EXPECT_THAT(described(ledger.update({ball("b", 3)}, true)), ElementsAre("+b", "-a"));
  EXPECT_THAT(ledger.clear(), UnorderedElementsAre("a", "b"));
  EXPECT_THAT(described(ledger.update({ball("b", 3)}, false)), ElementsAre("+b"));
}

TEST(VisualShapes, AreWhatIsAskedFor) {
  Sky sky(Vector3d(1, 2, 3));
  sky.add(5, 90, 30, Visibility::LOS).fix(3, 4, 0);
  EXPECT_TRUE(visual_shapes(sky.report, {}).empty());
  EXPECT_EQ(visual_shapes(sky.report, {false, true, 2, 100}), bubble_shapes(sky.report, 2));
  std::vector<VisualShape> both = ray_shapes(sky.report, 50);
  both.push_back(bubble_shapes(sky.report, 2).front());
  EXPECT_EQ(visual_shapes(sky.report, {true, true, 2, 50}), both);
}

// A message's material, as Gazebo's two generations have it.
TEST(VisualShapes, ShineByThemselvesUnlessLit) {
  struct Colour {
    float r = 9, g = 9, b = 9, a = 9;
    void set_r(float v) { r = v; }
    void set_g(float v) { g = v; }
    void set_b(float v) { b = v; }
    void set_a(float v) { a = v; }
    bool operator==(const Colour&) const = default;
  };
  struct {
    Colour ambient, diffuse, specular, emissive;
    bool lighting = false;
    Colour* mutable_ambient() { return &ambient; }
    Colour* mutable_diffuse() { return &diffuse; }
    Colour* mutable_specular() { return &specular; }
    Colour* mutable_emissive() { return &emissive; }
    void set_lighting(bool on) { lighting = on; }
  } material;
  VisualShape shape;
  shape.colour = {1, 0.5, 0, 0.25};
  set_material(material, shape);
  EXPECT_EQ(material.ambient, (Colour{0, 0, 0, 0.25F}));
  EXPECT_EQ(material.emissive, (Colour{1, 0.5F, 0, 0.25F}));
  shape.lit = true;
  set_material(material, shape);
  EXPECT_EQ(material.diffuse, (Colour{0.7F, 0.35F, 0, 0.25F}));
  EXPECT_EQ(material.specular, (Colour{0, 0, 0, 0.25F}));
  EXPECT_TRUE(material.lighting);
}

TEST(RateLimit, LetsOneThroughPerInterval) {
  RateLimit limit(0.1);
  int passed = 0;
  for (int i = 0; i < 100; ++i) passed += limit.due(1000 + i * 0.004) ? 1 : 0;  // 0.4 s
  EXPECT_EQ(passed, 4);
  limit.reset();
  EXPECT_TRUE(limit.due(1000.397));
}

}  // namespace
}  // namespace canyon::adapters
