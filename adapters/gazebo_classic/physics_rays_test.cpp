#include "adapters/gazebo_classic/physics_rays.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <gazebo/common/Image.hh>
#include <gazebo/physics/ode/ODEPhysics.hh>
#include <limits>
#include <random>

#include "adapters/gazebo_classic/testing/in_process_server.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

using Eigen::Vector3d;
using gazebo::physics::ModelPtr;

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kDegree = M_PI / 180;

std::string world_of(const std::string& models, const std::string& engine = "ode") {
  return R"(<?xml version="1.0"?><sdf version="1.6"><world name="w"><gravity>0 0 0</gravity><physics type=")" +
         engine +
         R"("><max_step_size>0.01</max_step_size><real_time_update_rate>0</real_time_update_rate></physics>)" +
         models + "</world></sdf>";
}

std::string model(const std::string& name, const std::string& pose, const std::string& geometry,
                  bool is_static = true, const std::string& in_link = "") {
  return fmt::format(R"(<model name="{}"><static>{}</static><pose>{}</pose><link name="link">
<collision name="c"><geometry>{}</geometry></collision>{}</link></model>)",
                     name, is_static, pose, geometry, in_link);
}
std::string box(double x, double y, double z) {
  return fmt::format("<box><size>{} {} {}</size></box>", x, y, z);
}

// 20 m wide, its face at x = 50 m.
const std::string kWall = model("wall", "50.5 0 5 0 0 0", box(1, 20, 10));
// A small box far below, so that it blocks no ray.
const std::string kVehicle = model("vehicle", "0 0 -50 0 0 0", box(0.2, 0.2, 0.2), false);

Vector3d towards(double azimuth_deg, double elevation_deg) {
  return geodesy::enu_from_azimuth_elevation(azimuth_deg * kDegree, elevation_deg * kDegree);
}

class PhysicsRaysTest : public ::testing::Test {
 protected:
  static test::InProcessServer& server() { return test::InProcessServer::get(); }
  void load(const std::string& models, const std::string& engine = "ode") {
    world_ = server().load(world_of(models, engine));
    server().step();
  }
  void TearDown() override {
    rays_.reset();
    world_.reset();
    server().unload();
  }
  [[nodiscard]] gazebo::physics::LinkPtr vehicle_link() const {
    return world_->ModelByName("vehicle")->GetLink("link");
  }
  std::vector<double> cast(const std::vector<PhysicsRay>& rays, const ModelPtr& left_out = nullptr) {
    if (!rays_) rays_ = std::make_unique<PhysicsRays>(vehicle_link(), nullptr, "receiver 'r'");
    std::vector<double> ranges(rays.size(), -1);
    rays_->cast(rays, left_out, ranges);
    return ranges;
  }
  double cast_one(const Vector3d& origin, const Vector3d& direction, double max_range_m = 1e4) {
    return cast({{origin, direction.normalized(), max_range_m}}).front();
  }

  gazebo::physics::WorldPtr world_;
  std::unique_ptr<PhysicsRays> rays_;
};

// First: Gazebo makes the sensors of the first world of a process only.
TEST_F(PhysicsRaysTest, ASensorsRaysRestAndShowWhatWasCast) {
  const std::string sensor =
      R"(<sensor name="gnss" type="ray"><always_on>1</always_on><update_rate>5</update_rate>
<pose>0.1 0.2 0.3 0.4 0.5 0.6</pose><ray><scan><horizontal><samples>3</samples><min_angle>0</min_angle>
<max_angle>1</max_angle></horizontal></scan><range><min>0.1</min><max>50</max></range></ray></sensor>)";
  load(kWall + model("vehicle", "0 0 -50 0.3 -0.7 2.1", box(0.2, 0.2, 0.2), false, sensor));
  const auto ray_sensor =
      std::dynamic_pointer_cast<gazebo::sensors::RaySensor>(gazebo::sensors::get_sensor("gnss"));
  ASSERT_TRUE(ray_sensor);
  ASSERT_TRUE(ray_sensor->IsActive());
  const std::vector<PhysicsRay> rays = {{{0, 0, 2}, towards(90, 3)},
                                        {{0, 0, 2}, towards(270, 3), 600},
                                        {{1, 0, 2}, towards(95, 1)},
                                        {{1, 0, 2}, towards(88, 2)}};
  std::vector<double> ranges(rays.size());
  {
    PhysicsRays physics_rays(vehicle_link(), ray_sensor, "receiver 'r'");
    EXPECT_FALSE(ray_sensor->IsActive());
    physics_rays.cast(rays, nullptr, ranges);
    EXPECT_NEAR(ranges[0], 50 / std::cos(3 * kDegree), 1e-9);
    EXPECT_EQ(ranges[1], kInfinite);
    EXPECT_NEAR(ranges[3], 49 / (std::cos(2 * kDegree) * std::sin(88 * kDegree)), 1e-9);
    const auto shape = ray_sensor->LaserShape();
    ASSERT_EQ(shape->RayCount(), 3U);
    const double shown[] = {ranges[0], 600, ranges[2]};
    for (unsigned i = 0; i < 3; ++i) {
      // The same ray in the world's frame: from the origin, along the direction, as long as the range.
      const auto pose = vehicle_link()->WorldPose();
      const auto start = pose.CoordPositionAdd(shape->Ray(i)->Start());
      const auto end = pose.CoordPositionAdd(shape->Ray(i)->End());
      const Vector3d expected = rays[i].origin + rays[i].direction * shown[i];
      EXPECT_NEAR((start - ignition::math::Vector3d(rays[i].origin.x(), 0, 2)).Length(), 0, 1e-9);
      EXPECT_NEAR((end - ignition::math::Vector3d(expected.x(), expected.y(), expected.z())).Length(), 0,
                  1e-9);
      EXPECT_NEAR(shape->Ray(i)->GetLength(), shown[i], 1e-9);
    }
  }
  EXPECT_TRUE(ray_sensor->IsActive());
}

TEST_F(PhysicsRaysTest, AWallIsAsFarAsGeometrySays) {
  load(kWall + kVehicle);
  EXPECT_NEAR(cast_one({0, 0, 2}, Vector3d::UnitX()), 50, 1e-9);
  for (const double azimuth_deg : {90.0, 82.0, 97.5}) {
    for (const double elevation_deg : {0.0, 3.0, 8.5}) {
      // The ray's x grows by cos(elevation) sin(azimuth) for each metre.
      const double expected = 50 / (std::cos(elevation_deg * kDegree) * std::sin(azimuth_deg * kDegree));
      EXPECT_NEAR(cast_one({0, 0, 2}, towards(azimuth_deg, elevation_deg)), expected, 1e-9);
    }
  }
  EXPECT_EQ(cast_one({0, 0, 2}, towards(90, 9.2)), kInfinite);  // atan(8 / 50) is 9.09 deg
  EXPECT_EQ(cast_one({0, 0, 2}, towards(78.5, 0)), kInfinite);  // atan(10 / 50) is 11.31 deg
  EXPECT_EQ(cast_one({0, 0, 2}, -Vector3d::UnitX()), kInfinite);
  EXPECT_EQ(cast_one({0, 0, 2}, Vector3d::UnitX(), 49.999), kInfinite);
  EXPECT_NEAR(cast_one({0, 0, 2}, Vector3d::UnitX(), 50.001), 50, 1e-9);
}

TEST_F(PhysicsRaysTest, RaysAreInTheWorldWhateverTheVehiclesAttitude) {
  load(kWall + kVehicle);
  const auto vehicle = world_->ModelByName("vehicle");
  for (const auto& pose : {ignition::math::Pose3d(3, -7, -40, 0.3, -0.7, 2.1),
                           ignition::math::Pose3d(-120, 4, -90, -2.5, 1.2, -0.4)}) {
    vehicle->SetWorldPose(pose);
    server().step();
    EXPECT_NEAR(cast_one({0, 1, 2}, towards(85, 4)), 50 / (std::cos(4 * kDegree) * std::sin(85 * kDegree)),
                1e-9);
  }
}

TEST_F(PhysicsRaysTest, TheNumberOfRaysMayChangeAtEveryCall) {
  load(kVehicle + model("ground", "0 0 0 0 0 0", "<plane><normal>0 0 1</normal></plane>"));
  std::mt19937 random(7);
  std::uniform_real_distribution<double> azimuth(0, 360);
  std::uniform_real_distribution<double> elevation(-80, 80);
  for (const std::size_t count : {2U, 62U, 8U, 0U, 200U}) {
    std::vector<PhysicsRay> rays;
    for (std::size_t i = 0; i < count; ++i) {
      rays.push_back({{0, 0, 5}, towards(azimuth(random), elevation(random)), 1e4});
    }
    const std::vector<double> ranges = cast(rays);
    for (std::size_t i = 0; i < count; ++i) {
      const double down = -rays[i].direction.z();
      const double expected = down > 0 ? 5 / down : kInfinite;
      if (std::isinf(expected)) {
        EXPECT_EQ(ranges[i], kInfinite) << i;
      } else {
        EXPECT_NEAR(ranges[i], expected, 1e-9 * expected) << i;
      }
    }
  }
}

TEST_F(PhysicsRaysTest, SeesABoxWhereItIsNow) {
  load(kVehicle + model("lorry", "30 0 1 0 0 0", box(2, 2, 2), false) +
       model("hoarding", "40 0 1 0 0 0", box(2, 2, 2), true));
  EXPECT_NEAR(cast_one({0, 0, 1}, Vector3d::UnitX()), 29, 1e-9);
  // Moved aside by the test, then by its own velocity; a static one also by the test.
  const auto lorry = world_->ModelByName("lorry");
  lorry->SetWorldPose({30, 9, 1, 0, 0, 0});
  server().step();
  EXPECT_NEAR(cast_one({0, 0, 1}, Vector3d::UnitX()), 39, 1e-9);
  world_->ModelByName("hoarding")->SetWorldPose({60, 0, 1, 0, 0, M_PI / 4});
  server().step();
  EXPECT_NEAR(cast_one({0, 0, 1}, Vector3d::UnitX()), 60 - std::sqrt(2), 1e-9);
  lorry->SetWorldPose({30, 0, 1, 0, 0, 0});
  lorry->SetLinearVel({-4, 0, 0});
  for (int i = 0; i < 5; ++i) {
    server().step();
    EXPECT_NEAR(cast_one({0, 0, 1}, Vector3d::UnitX()), lorry->WorldPose().Pos().X() - 1, 1e-9);
  }
  EXPECT_LT(lorry->WorldPose().Pos().X(), 29.9);
}

TEST_F(PhysicsRaysTest, SeesWhatAppearsAndNotWhatVanished) {
  load(kVehicle + kWall);
  EXPECT_NEAR(cast_one({0, 0, 2}, Vector3d::UnitX()), 50, 1e-9);
  world_->RemoveModel("wall");
  server().step();
  EXPECT_EQ(cast_one({0, 0, 2}, Vector3d::UnitX()), kInfinite);
  world_->InsertModelString("<sdf version='1.6'>" + model("new", "20 0 2 0 0 0", box(2, 2, 2)) + "</sdf>");
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!world_->ModelByName("new") && std::chrono::steady_clock::now() < deadline) server().step();
  server().step();
  EXPECT_NEAR(cast_one({0, 0, 2}, Vector3d::UnitX()), 19, 1e-9);
}

TEST_F(PhysicsRaysTest, FarWallsBlock) {
  load(kVehicle + model("tower", "3005 0 50 0 0 0", box(10, 60, 400)));
  EXPECT_NEAR(cast_one({0, 0, 2}, towards(90, 3)), 3000 / std::cos(3 * kDegree), 1e-8);
}

TEST_F(PhysicsRaysTest, GoesThroughTheModelLeftOut) {
  // The antenna is inside the roof; a nested model has a box in the path.
  const std::string nested = R"(<model name="vehicle"><pose>0 0 2 0 0 0.4</pose><link name="link">
<collision name="c"><geometry><box><size>4 2 1</size></box></geometry></collision>
<collision name="d"><pose>0 0 5 0 0 0</pose><geometry><sphere><radius>2</radius></sphere></geometry></collision></link>
<model name="trailer"><pose>3 0 0 0 0 0</pose><link name="link">
<collision name="c"><geometry><box><size>1 6 1</size></box></geometry></collision></link></model></model>)";
  load(kWall + nested);
  const std::vector<PhysicsRay> rays = {
      {{0, 0, 2}, Vector3d::UnitX()}, {{0, 0, 2}, Vector3d::UnitZ()}, {{-20, 0, 2}, Vector3d::UnitX()}};
  const auto through = cast(rays, world_->ModelByName("vehicle"));
  EXPECT_NEAR(through[0], 50, 1e-9);
  EXPECT_EQ(through[1], kInfinite);
  EXPECT_NEAR(through[2], 70, 1e-9);
  // From inside the box, rotated by 0.4 rad: its long side is hit at 1 m / sin(0.4), the roof at 0.5 m.
  const auto blocked = cast(rays);
  EXPECT_NEAR(blocked[0], std::min(2 / std::cos(0.4), 1 / std::sin(0.4)), 1e-9);
  EXPECT_NEAR(blocked[1], 0.5, 1e-9);
  EXPECT_NEAR(blocked[2], 20 - 2 / std::cos(0.4), 1e-9);
  // A model that was left out once is hit again, and other models are not left out with it.
  EXPECT_EQ(cast(rays, world_->ModelByName("wall"))[0], blocked[0]);
}

TEST_F(PhysicsRaysTest, MeetsRoundShapes) {
  load(kVehicle + model("ball", "20 0 10 0.3 0.2 0.1", "<sphere><radius>3</radius></sphere>") +
       model("tank", "0 30 5 0 0 0.7", "<cylinder><radius>4</radius><length>10</length></cylinder>"));
  EXPECT_NEAR(cast_one({0, 0, 10}, Vector3d::UnitX()), 17, 1e-9);
  // A chord 2 m above the centre.
  EXPECT_NEAR(cast_one({0, 0, 12}, Vector3d::UnitX()), 20 - std::sqrt(9.0 - 4), 1e-9);
  EXPECT_NEAR(cast_one({20, 0, 10}, towards(33, 21)), 3, 1e-9);  // from inside
  EXPECT_NEAR(cast_one({0, 0, 5}, Vector3d::UnitY()), 26, 1e-9);
  EXPECT_NEAR(cast_one({1, 0, 5}, Vector3d::UnitY()), 30 - std::sqrt(16.0 - 1), 1e-9);
  EXPECT_NEAR(cast_one({0, 30, 40}, -Vector3d::UnitZ()), 30, 1e-9);
}

TEST_F(PhysicsRaysTest, MeetsMeshesFromBothSides) {
  const canyon::test::TemporaryFolder folder;
  // A roof: two slopes of 45 deg that meet in a ridge at z = 10, over x = 20 to 40.
  std::ofstream(folder / "roof.obj") << R"(v 20 -10 0
v 20 10 0
v 30 -10 10
v 30 10 10
v 40 -10 0
v 40 10 0
vn -0.7071 0 0.7071
vn 0.7071 0 0.7071
f 1//1 3//1 2//1
f 2//1 3//1 4//1
f 3//2 5//2 4//2
f 4//2 5//2 6//2
)";
  load(kVehicle + model("roof", "0 0 0 0 0 0",
                        fmt::format("<mesh><uri>file://{}</uri></mesh>", (folder / "roof.obj").string())));
  EXPECT_NEAR(cast_one({0, 1, 4}, Vector3d::UnitX()), 24, 1e-4);
  EXPECT_NEAR(cast_one({30, 1, 4}, Vector3d::UnitX()), 6, 1e-4);  // from under the roof
  EXPECT_NEAR(cast_one({30, 1, 4}, -Vector3d::UnitX()), 6, 1e-4);
  EXPECT_NEAR(cast_one({100, -3, 7}, -Vector3d::UnitX()), 67, 1e-4);
  EXPECT_EQ(cast_one({0, 1, 11}, Vector3d::UnitX()), kInfinite);
  EXPECT_NEAR(cast_one({-3000, 2, 4}, Vector3d::UnitX()), 3024, 1e-3);
}

TEST_F(PhysicsRaysTest, MeetsHeightmaps) {
  const canyon::test::TemporaryFolder folder;
  // Gray grows eastwards by 15 per pixel.
  constexpr unsigned kPixels = 17;
  std::vector<unsigned char> pixels;
  for (unsigned row = 0; row < kPixels; ++row) {
    for (unsigned column = 0; column < kPixels; ++column)
      pixels.push_back(static_cast<unsigned char>(15 * column));
  }
  gazebo::common::Image image;
  image.SetFromData(pixels.data(), kPixels, kPixels, gazebo::common::Image::L_INT8);
  image.SavePNG((folder / "slope.png").string());
  load(kVehicle +
       model("slope", "0 0 0 0 0 0",
             fmt::format("<heightmap><uri>file://{}</uri><size>160 160 24</size><pos>0 0 0</pos></heightmap>",
                         (folder / "slope.png").string())));
  // The brightest pixel is 24 m high, the darkest 0 m, over 160 m.
  const auto height = [](double x) { return (x + 80) * 24 / 160; };
  for (double x = -73; x <= 73; x += 7.3) {
    EXPECT_NEAR(cast_one({x, 3, 100}, -Vector3d::UnitZ()), 100 - height(x), 1e-4) << x;
  }
  // Level rays hit the slope at a height of 6.3 m, at x = -38.
  EXPECT_NEAR(cast_one({-70, 3, 6.3}, Vector3d::UnitX()), 32, 1e-4);
  EXPECT_NEAR(cast_one({-70, 3, 6.3}, {1, 0.3, 0}), 32 * std::hypot(1, 0.3), 1e-4);
  EXPECT_NEAR(cast_one({-2070, 3, 6.3}, Vector3d::UnitX()), 2032, 1e-4);
  EXPECT_EQ(cast_one({-70, 3, 25}, Vector3d::UnitX()), kInfinite);
}

TEST_F(PhysicsRaysTest, TheNearestOfManyHillsCounts) {
  const canyon::test::TemporaryFolder folder;
  // Ridges along y, 24 m high at every second of 17 columns, 10 m apart, valleys at 0 m.
  constexpr unsigned kPixels = 17;
  std::vector<unsigned char> pixels;
  for (unsigned i = 0; i < kPixels * kPixels; ++i) pixels.push_back(i % kPixels % 2 == 1 ? 240 : 0);
  gazebo::common::Image image;
  image.SetFromData(pixels.data(), kPixels, kPixels, gazebo::common::Image::L_INT8);
  image.SavePNG((folder / "ridges.png").string());
  load(kVehicle +
       model("ridges", "0 0 0 0 0 0",
             fmt::format("<heightmap><uri>file://{}</uri><size>160 160 24</size><pos>0 0 0</pos></heightmap>",
                         (folder / "ridges.png").string())));
  // The first slope rises from x = -80 by 2.4 m per metre; from above a valley each side is as near.
  for (const double z : {1.7, 11.3, 23.1}) {
    EXPECT_NEAR(cast_one({-100, 3, z}, Vector3d::UnitX()), 20 + z / 2.4, 1e-4) << z;
    EXPECT_NEAR(cast_one({100, -7, z}, -Vector3d::UnitX()), 20 + z / 2.4, 1e-4) << z;
    EXPECT_NEAR(cast_one({0, 13, z}, Vector3d::UnitX()), z / 2.4, 1e-4) << z;
    EXPECT_NEAR(cast_one({-20, 13, z}, -Vector3d::UnitX()), z / 2.4, 1e-4) << z;
  }
}

TEST_F(PhysicsRaysTest, LeavesNoTraceInTheWorld) {
  load(kVehicle + kWall + model("lorry", "30 0 1 0 0 0", box(2, 2, 2), false));
  const auto engine = boost::dynamic_pointer_cast<gazebo::physics::ODEPhysics>(world_->Physics());
  const int geometries = dSpaceGetNumGeoms(engine->GetSpaceId());
  const auto lorry = world_->ModelByName("lorry");
  EXPECT_NEAR(cast_one({0, 0, 1}, Vector3d::UnitX()), 29, 1e-9);
  server().step(100);
  EXPECT_EQ(dSpaceGetNumGeoms(engine->GetSpaceId()), geometries);
  EXPECT_EQ(vehicle_link()->GetCollisions().size(), 1U);
  EXPECT_EQ(vehicle_link()->GetChildCount(), 1U);
  EXPECT_EQ(engine->GetContactManager()->GetContactCount(), 0U);
  // Rays exert no force: without gravity it does not move.
  EXPECT_EQ(lorry->WorldPose().Pos(), ignition::math::Vector3d(30, 0, 1));
  EXPECT_EQ(lorry->WorldLinearVel(), ignition::math::Vector3d::Zero);
}

TEST_F(PhysicsRaysTest, RefusesWhatIsNoRay) {
  load(kVehicle + kWall);
  PhysicsRays rays(vehicle_link(), nullptr, "receiver 'r'");
  std::vector<double> ranges(1, -1);
  const auto refusal = [&](const PhysicsRay& ray) {
    return canyon::test::refusal([&] { rays.cast({&ray, 1}, nullptr, ranges); });
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refusal({{nan, 0, 0}, Vector3d::UnitX()}).find("receiver 'r': ray 0 is not finite"),
            std::string::npos);
  EXPECT_NE(refusal({{0, 0, 0}, {0, nan, 0}}).find("unit length"), std::string::npos);
  EXPECT_NE(refusal({{0, 0, 0}, {0, 0, 0}}).find("unit length"), std::string::npos);
  EXPECT_NE(refusal({{0, 0, 0}, {1, 1, 0}}).find("unit length"), std::string::npos);
  EXPECT_NE(refusal({{0, 0, 0}, Vector3d::UnitX(), kInfinite}).find("max_range_m of ray 0 is inf"),
            std::string::npos);
  EXPECT_NE(refusal({{0, 0, 0}, Vector3d::UnitX(), 0}).find("above 0"), std::string::npos);
  const std::vector<PhysicsRay> two(2, {{0, 0, 0}, Vector3d::UnitX()});
  EXPECT_NE(canyon::test::refusal([&] { rays.cast(two, nullptr, ranges); }).find("2 rays, but 1 ranges"),
            std::string::npos);
  EXPECT_EQ(ranges[0], -1);
}

TEST_F(PhysicsRaysTest, NamesTheCureForOtherEngines) {
  for (const std::string engine : {"bullet", "simbody", "dart"}) {
    load(kVehicle, engine);
    if (world_->Physics()->GetType() != engine) continue;  // not built in
    const std::string message =
        canyon::test::refusal([&] { PhysicsRays rays(vehicle_link(), nullptr, "receiver 'r'"); });
    EXPECT_NE(message.find("'" + engine + "'"), std::string::npos) << message;
    EXPECT_NE(message.find("<ray_engine>embree</ray_engine>"), std::string::npos) << message;
  }
}

// 31 satellites' direct and mirror rays from a street of a town of 500 boxes, 30 m apart.
std::vector<PhysicsRay> paper_rays() {
  std::vector<PhysicsRay> aims;
  for (int i = 0; i < 31; ++i) {
    const double elevation_deg = 10 + 2.5 * i;
    aims.push_back({{14.3, 4, 2}, towards(i * 137.5, elevation_deg), 1e4});
    aims.push_back({{14.3, 4, 2}, towards(i * 137.5 + 180, elevation_deg), 1e4});
  }
  return aims;
}
constexpr int kTown = 500;
Vector3d point_in_town(int i) {
  return {30.0 * (i % 25) - 375, 30.0 * (i / 25) - 285, 0};
}
double height_in_town(int i) {
  return 30 + i % 7 * 10;
}

std::string town_of_boxes() {
  std::string models;
  for (int i = 0; i < kTown; ++i) {
    const Vector3d point = point_in_town(i);
    const double height = height_in_town(i);
    models += model(fmt::format("b{}", i), fmt::format("{} {} {} 0 0 0", point.x(), point.y(), height / 2),
                    box(20, 20, height));
  }
  return models;
}

void write_town_mesh(const std::filesystem::path& file) {
  std::ofstream out(file);
  for (int i = 0; i < kTown; ++i) {
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3d at =
          point_in_town(i) + Vector3d((corner & 1) != 0 ? 10 : -10, (corner & 2) != 0 ? 10 : -10,
                                      (corner & 4) != 0 ? height_in_town(i) : 0);
      out << fmt::format("v {} {} {}\n", at.x(), at.y(), at.z());
    }
  }
  out << "vn 0 0 1\n";
  constexpr int kFaces[6][4] = {{1, 3, 4, 2}, {5, 6, 8, 7}, {1, 2, 6, 5},
                                {3, 7, 8, 4}, {1, 5, 7, 3}, {2, 4, 8, 6}};
  for (int i = 0; i < kTown; ++i) {
    for (const auto& face : kFaces) {
      const auto corner = [&](int k) { return 8 * i + face[k]; };
      out << fmt::format("f {}//1 {}//1 {}//1\n", corner(0), corner(1), corner(2));
      out << fmt::format("f {}//1 {}//1 {}//1\n", corner(0), corner(2), corner(3));
    }
  }
}

// Nearest box by the slab method.
double range_in_town(const PhysicsRay& ray) {
  double nearest = kInfinite;
  for (int i = 0; i < kTown; ++i) {
    const Vector3d low = point_in_town(i) - Vector3d(10, 10, 0);
    const Vector3d high = point_in_town(i) + Vector3d(10, 10, height_in_town(i));
    const Eigen::Array3d a = (low - ray.origin).array() / ray.direction.array();
    const Eigen::Array3d b = (high - ray.origin).array() / ray.direction.array();
    const double enter = a.min(b).maxCoeff();
    if (enter <= a.max(b).minCoeff() && enter > 0) nearest = std::min(nearest, enter);
  }
  return nearest;
}

// Prints the cost; the bound detects only gross errors.
void measure(const char* what, const std::function<void()>& cast) {
  cast();
  constexpr int kRounds = 100;
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < kRounds; ++i) cast();
  const std::chrono::duration<double, std::micro> each = (std::chrono::steady_clock::now() - begin) / kRounds;
  std::cout << fmt::format("62 rays through {}: {:.0f} us\n", what, each.count());
  EXPECT_LT(each.count(), 1e6);
}

TEST_F(PhysicsRaysTest, ATownOfBoxesAndItsMeshGiveTheRangesOfGeometry) {
  const std::vector<PhysicsRay> rays = paper_rays();
  const canyon::test::TemporaryFolder folder;
  write_town_mesh(folder / "town.obj");
  const std::string mesh =
      model("town", "0 0 0 0 0 0",
            fmt::format("<mesh><uri>file://{}</uri></mesh>", (folder / "town.obj").string()));
  for (const bool as_mesh : {false, true}) {
    rays_.reset();
    load(kVehicle + (as_mesh ? mesh : town_of_boxes()));
    const std::vector<double> ranges = cast(rays);
    int hits = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const double expected = range_in_town(rays[i]);
      if (std::isinf(expected)) {
        EXPECT_EQ(ranges[i], kInfinite) << i;
      } else {
        ++hits;
        EXPECT_NEAR(ranges[i], expected, as_mesh ? 1e-3 : 1e-9) << i;
      }
    }
    EXPECT_GT(hits, 30);
    EXPECT_LT(hits, 62);
    const ModelPtr vehicle = world_->ModelByName("vehicle");
    measure(as_mesh ? "a mesh of 6000 triangles" : "500 boxes", [&] { (void)cast(rays, vehicle); });
  }
}

}  // namespace
}  // namespace canyon::adapters::gazebo_classic
