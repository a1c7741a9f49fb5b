// The scene of a world, with a manually made world.
#include "canyon/outputs/live/world_scene.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "adapters/common/testing/box_world.hpp"
#include "canyon/city/gazebo_export.hpp"
#include "canyon/simulation/environment.hpp"

namespace canyon::adapters {
namespace {

using Eigen::Vector3d;
using test::BoxWorld;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kNothing = std::numeric_limits<double>::infinity();

class WorldSceneTest : public ::testing::Test {
 protected:
  WorldSceneTest() {
    auto made = std::make_unique<BoxWorld>();
    world = made.get();
    scene =
        std::make_unique<live::WorldScene>(std::move(made), live::WorldScene::Options{"street", false, {}});
  }
  /// Range of the first object in a direction; infinite without one.
  [[nodiscard]] double range(const Vector3d& origin, const Vector3d& towards) const {
    const auto hit = scene->scene()->scene.cast({origin, towards.normalized()});
    return hit ? hit->range_m : kNothing;
  }

  BoxWorld* world = nullptr;
  std::unique_ptr<live::WorldScene> scene;
};

TEST_F(WorldSceneTest, StaticOnceMovingAsInstances) {
  world->boxes = {{1, {true, {10, 0, 0}}}, {2, {false, {0, 20, 0}}}};
  scene->update({});
  EXPECT_DOUBLE_EQ(range({0, 0, 0}, {1, 0, 0}), 9);
  EXPECT_DOUBLE_EQ(range({0, 0, 0}, {0, 1, 0}), 19);
  EXPECT_EQ(scene->scene()->city.mesh.triangles.size(), 12U) << "the moving one is no part of the city";
  const auto generation = scene->generation();
  world->boxes[2].centre = {0, 30, 0};
  scene->update({});
  EXPECT_DOUBLE_EQ(range({0, 0, 0}, {0, 1, 0}), 29);
  EXPECT_EQ(scene->generation(), generation) << "nothing static was built anew";
  EXPECT_THAT(scene->take_notes(), IsEmpty());
}

TEST_F(WorldSceneTest, LatecomersAndThoseWhoGo) {
  world->boxes = {{1, {true, {10, 0, 0}}}};
  scene->update({});
  const auto generation = scene->generation();
  world->boxes[2] = {true, {0, 10, 0}};
  scene->update({});
  EXPECT_DOUBLE_EQ(range({0, 0, 0}, {0, 1, 0}), 9);
  EXPECT_EQ(scene->generation(), generation) << "a latecomer is an instance";
  world->boxes.erase(2);
  scene->update({});
  EXPECT_EQ(range({0, 0, 0}, {0, 1, 0}), kNothing);
  world->boxes.erase(1);
  scene->update({});
  EXPECT_EQ(range({0, 0, 0}, {1, 0, 0}), kNothing);
  EXPECT_THAT(scene->take_notes(), ElementsAre(HasSubstr("has no collision geometry")));
}

TEST_F(WorldSceneTest, ResizedBoxesAreRead) {
  world->boxes = {{1, {true, {10, 0, 0}}}, {2, {false, {0, 10, 0}}}};
  scene->update({});
  world->boxes[1].size = {4, 4, 4};
  world->boxes[2].size = {6, 6, 6};
  scene->update({});
  EXPECT_DOUBLE_EQ(range({0, 0, 0}, {1, 0, 0}), 8);
  EXPECT_DOUBLE_EQ(range({0, 0, 0}, {0, 1, 0}), 7);
  world->boxes[2].size = {0, 6, 6};
  scene->update({});
  EXPECT_EQ(range({0, 0, 0}, {0, 1, 0}), kNothing);
  EXPECT_THAT(scene->take_notes(), ElementsAre(HasSubstr("without extent")));
  scene->update({});
  EXPECT_THAT(scene->take_notes(), IsEmpty()) << "said once";
}

TEST_F(WorldSceneTest, StaticThingsThatAreMovedAreFollowedWhereTheHostSaysSo) {
  for (live::HostWorld::Id id = 1; id <= 40; ++id) {
    world->boxes[id] = {true, {100.0 + 10 * static_cast<double>(id), 0, 0}};
  }
  scene->update({});
  world->statics_move = false;
  scene->update({});
  world->boxes[30].centre = {0, 10, 0};
  world->statics_move = true;
  scene->update({});
  EXPECT_DOUBLE_EQ(range({0, 0, 0}, {0, 1, 0}), 9);
  // Without notice from the host, changes are found by checking 16 models in each step.
  world->statics_move = false;
  world->boxes[31].centre = {0, -10, 0};
  for (int step = 0; step < 3; ++step) scene->update({});
  EXPECT_DOUBLE_EQ(range({0, 0, 0}, {0, -1, 0}), 9);
}

TEST_F(WorldSceneTest, TheReceiversOwnModelIsNotSeen) {
  world->boxes = {{1, {true, {10, 0, 0}}}, {2, {false, {0, 10, 0}}}};
  scene->update(2);
  EXPECT_EQ(range({0, 0, 0}, {0, 1, 0}), kNothing);
  scene->update(1);
  EXPECT_DOUBLE_EQ(range({0, 0, 0}, {0, 1, 0}), 9);
  EXPECT_EQ(range({0, 0, 0}, {1, 0, 0}), kNothing) << "a static one as well";
  scene->update({});
  EXPECT_DOUBLE_EQ(range({0, 0, 0}, {1, 0, 0}), 9);
}

TEST_F(WorldSceneTest, NoFinitePoseAndTheGroundOfAnExportedCity) {
  world->boxes = {{1, {false, {0, 10, 0}}},
                  {2, {true, {10, 0, 0}, {2, 2, 2}, std::string(city::kGroundPlaneModel)}}};
  scene->update({});
  EXPECT_EQ(range({0, 0, 0}, {1, 0, 0}), kNothing);
  EXPECT_THAT(scene->take_notes(), ElementsAre(HasSubstr("is not part of the city")));
  world->boxes[1].centre.x() = std::nan("");
  scene->update({});
  EXPECT_EQ(range({0, 0, 0}, {0, 1, 0}), kNothing);
  EXPECT_THAT(scene->take_notes(), ElementsAre(HasSubstr("or its position is not finite")));
  world->boxes[1].centre.x() = 0;
  scene->update({});
  EXPECT_DOUBLE_EQ(range({0, 0, 0}, {0, 1, 0}), 9);
}

TEST_F(WorldSceneTest, TurnsWithTheWorldsHeading) {
  auto made = std::make_unique<BoxWorld>();
  made->boxes = {{1, {true, {10, 0, 0}}}};
  live::WorldScene::Options options{"street", false, {}};
  options.frame.heading_rad = M_PI / 2;  // the world's x axis points north
  scene = std::make_unique<live::WorldScene>(std::move(made), options);
  scene->update({});
  EXPECT_NEAR(range({0, 0, 0}, {0, 1, 0}), 9, 1e-9);
  EXPECT_EQ(range({0, 0, 0}, {1, 0, 0}), kNothing);
}

/// The mesh of a world's city by its facade materials.
city::Mesh rendered(const std::vector<BoxWorld::Box>& boxes, const city::FacadeOptions& facades) {
  auto made = std::make_unique<BoxWorld>();
  for (std::size_t i = 0; i < boxes.size(); ++i) made->boxes[i + 1] = boxes[i];
  live::WorldScene::Options options{"street", false, {}};
  options.facades = facades;
  live::WorldScene scene(std::move(made), options);
  scene.update({});
  return scene.scene()->city.mesh;
}

// Low, middle and tall buildings, and a car that moves.
std::vector<BoxWorld::Box> district() {
  std::vector<BoxWorld::Box> boxes;
  for (int i = 0; i < 30; ++i) {
    const double height_m = 10 + 20 * (i % 3);
    boxes.push_back({true, {40.0 * i, 0, height_m / 2}, {20, 20, height_m}, fmt::format("house {}", i)});
  }
  boxes.push_back({false, {0, 40, 1}, {4, 2, 2}, "car"});
  return boxes;
}

// The same facades as of the same city read from a file.
TEST(WorldScene, DrawsFacadesAsCanyonSimulateDoes) {
  city::FacadeOptions as_given;
  as_given.mix = city::FacadeMix::AsGiven;
  const city::Mesh plain = rendered(district(), as_given);
  ASSERT_EQ(plain.triangles.size(), 30U * 12U);
  EXPECT_THAT(plain.materials, Each(city::Material::Unknown));
  city::City city;
  city.mesh = plain;
  (void)city::assign_facades(city, {}, false, 1);
  const city::Mesh dressed = rendered(district(), {});
  EXPECT_EQ(dressed.materials, city.mesh.materials);
  EXPECT_THAT(dressed.materials, AllOf(Contains(city::Material::Metal), Contains(city::Material::Glass)));
}

// A moved model and a model added later are instances.
TEST(WorldScene, BuildingsThatBecomeInstancesKeepTheirFacades) {
  auto made = std::make_unique<BoxWorld>();
  BoxWorld* world = made.get();
  live::WorldScene::Options options{"street", false, {}};
  options.facades.fractions = {{"coated_glass", 1}};
  live::WorldScene scene(std::move(made), options);
  world->boxes = {{1, {true, {10, 0, 0}}}, {2, {true, {30, 0, 0}}}};
  scene.update({});
  world->boxes[1].centre = {0, 10, 0};
  world->boxes[3] = {true, {0, -10, 0}};
  scene.update({});
  EXPECT_EQ(scene.scene()->city.mesh.triangles.size(), 12U);
  const auto& posed = scene.scene()->scene.posed_instances();
  ASSERT_EQ(posed.size(), 2U);
  for (const raytrace::PosedInstance& each : posed) {
    EXPECT_EQ(std::count(each.mesh->materials.begin(), each.mesh->materials.end(), city::Material::Metal), 8)
        << "four walls";
  }
}

TEST(WorldScene, IsSharedByWorldAndOptions) {
  int world = 0, other = 0;
  const live::WorldScene::Options options{"street", false, {}};
  const auto make = [] { return std::make_unique<BoxWorld>(); };
  const auto first = live::WorldScene::of(&world, options, make);
  EXPECT_EQ(live::WorldScene::of(&world, options, make), first);
  EXPECT_NE(live::WorldScene::of(&other, options, make), first);
  live::WorldScene::Options visual = options;
  visual.visual = true;
  EXPECT_NE(live::WorldScene::of(&world, visual, make), first);
}

}  // namespace
}  // namespace canyon::adapters
