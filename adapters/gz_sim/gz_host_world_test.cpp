// Shapes of a running Gazebo Sim world, tested with the engine's rays.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <gz/common/Image.hh>
#include <limits>
#include <memory>
#include <vector>

#include "adapters/gz_sim/gz_host_world.hpp"
#include "adapters/gz_sim/testing/sim_server.hpp"
#include "adapters/gz_sim/testing/street_world.hpp"
#include "canyon/simulation/environment.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::adapters::gz_sim {
namespace {

using Eigen::Vector3d;
using test::shape_model;

/// The geometry of a world after its first steps.
class GzHostWorldTest : public testing::Test {
 protected:
  void load(const std::string& models, bool visual = false) {
    server_ = std::make_unique<test::SimServer>(test::empty_world(models));
    auto world = std::make_unique<GzHostWorld>(visual);
    GzHostWorld* host = world.get();
    scene_ =
        std::make_unique<live::WorldScene>(std::move(world), live::WorldScene::Options{"street", visual, {}});
    server_->hands->watch = [this, host](const test::Hands::Ecm& ecm) {
      host->update_models(ecm);
      scene_->update({});
    };
    server_->step(2);
    notes_ = scene_->take_notes();
  }
  /// Range of a ray's first hit [m]; infinite without a hit.
  double cast(const Vector3d& origin, const Vector3d& direction) const {
    const auto hit = scene_->scene()->scene.cast(
        {origin, direction.normalized(), std::numeric_limits<double>::infinity()}, 0);
    return hit ? hit->range_m : std::numeric_limits<double>::infinity();
  }

  std::unique_ptr<test::SimServer> server_;
  std::unique_ptr<live::WorldScene> scene_;
  std::vector<std::string> notes_;
};

constexpr double kNothing = std::numeric_limits<double>::infinity();

// Ten metres above each shape, straight down.
TEST_F(GzHostWorldTest, PrimitivesReachWhereTheirFormulasSay) {
  const auto at = [](double x) { return std::to_string(x) + " 0 0 0 0 0"; };
  load(shape_model("box", at(0), test::box("2 4 6")) +
       shape_model("drum", at(20), "<cylinder><radius>2</radius><length>5</length></cylinder>") +
       shape_model("ball", at(40), "<sphere><radius>3</radius></sphere>") +
       shape_model("pill", at(60), "<capsule><radius>1</radius><length>4</length></capsule>") +
       shape_model("egg", at(80), "<ellipsoid><radii>1 2 3</radii></ellipsoid>") +
       shape_model("ground", "200 0 -1 0 0 0", "<plane><normal>0 0 1</normal><size>90 80</size></plane>") +
       shape_model("lorry", at(300), test::box("2 4 6"), false));
  EXPECT_TRUE(notes_.empty()) << notes_.front();
  const double tops[][2] = {{0, 3}, {20, 2.5}, {40, 3}, {60, 3}, {80, 3}, {200, -1}, {300, 3}};
  for (const auto& [x, top] : tops) {
    // A ray through a corner of triangles may miss it: use 1 mm to the side, where round shapes are as high.
    EXPECT_NEAR(cast({x + 1e-3, 1e-3, 10}, -Vector3d::UnitZ()), 10 - top, 2e-3) << "at " << x;
  }
  EXPECT_EQ(cast({10, 0, 10}, -Vector3d::UnitZ()), kNothing);
  EXPECT_EQ(scene_->scene()->scene.posed_instances().size(), 1U) << "the lorry may move";
}

TEST_F(GzHostWorldTest, MeshesComeFromTheirFilesWithScaleAndSubmesh) {
  const canyon::test::TemporaryFolder folder;
  // Two roofs: triangles at 5 m and at 7 m, each 10 m wide; the physics requires normals.
  std::ofstream(folder / "roofs.obj") << "vn 0 0 1\no low\nv -5 -5 5\nv 5 -5 5\nv 0 5 5\nf 1//1 2//1 3//1\n"
                                         "o high\nv -5 -5 7\nv 5 -5 7\nv 0 5 7\nf 4//1 5//1 6//1\n";
  const std::string uri = "<mesh><uri>" + (folder / "roofs.obj").string() + "</uri>";
  std::ofstream(folder / "words.dae") << "no mesh";
  load(shape_model("both", "0 0 0 0 0 0", uri + "</mesh>") +
       shape_model("low", "100 0 0 0 0 0", uri + "<submesh><name>low</name></submesh></mesh>") +
       shape_model("doubled", "200 0 0 0 0 0", uri + "<scale>1 1 2</scale></mesh>") +
       shape_model("lost", "300 0 0 0 0 0",
                   "<mesh><uri>" + (folder / "words.dae").string() + "</uri></mesh>"));
  EXPECT_NEAR(cast({0.1, 0, 100}, -Vector3d::UnitZ()), 93, 1e-6);
  EXPECT_NEAR(cast({0.1, 0, -100}, Vector3d::UnitZ()), 105, 1e-6);
  EXPECT_NEAR(cast({100.1, 0, 100}, -Vector3d::UnitZ()), 95, 1e-6);
  EXPECT_NEAR(cast({200.1, 0, 100}, -Vector3d::UnitZ()), 86, 1e-6);
  EXPECT_EQ(cast({300, 0, 100}, -Vector3d::UnitZ()), kNothing);
  ASSERT_EQ(notes_.size(), 1U);
  EXPECT_NE(notes_.front().find("'lost::link::c' is left out"), std::string::npos) << notes_.front();
}

TEST_F(GzHostWorldTest, HeightmapsAreAsHighAsTheirPicturesAreBright) {
  const canyon::test::TemporaryFolder folder;
  // Grey grows eastwards by 15 per pixel.
  constexpr unsigned kPixels = 17;
  std::vector<unsigned char> pixels;
  for (unsigned i = 0; i < kPixels * kPixels; ++i) {
    pixels.push_back(static_cast<unsigned char>(15 * (i % kPixels)));
  }
  gz::common::Image image;
  image.SetFromData(pixels.data(), kPixels, kPixels, gz::common::Image::L_INT8);
  image.SavePNG((folder / "slope.png").string());
  load(shape_model("slope", "0 0 0 0 0 0",
                   "<heightmap><uri>" + (folder / "slope.png").string() +
                       "</uri><size>160 160 24</size><pos>0 0 2</pos></heightmap>"));
  for (double x = -73; x <= 73; x += 7.3) {
    EXPECT_NEAR(cast({x, 3, 100}, -Vector3d::UnitZ()), 98 - (x + 80) * 24 / 160, 1e-4) << x;
  }
}

// A block of 20 m with a yard of 10 m in it, 12 m high.
TEST_F(GzHostWorldTest, PolylinesHaveTheirHoles) {
  load(shape_model("block", "0 0 0 0 0 0",
                   "<polyline><point>-10 -10</point><point>10 -10</point><point>10 10</point>"
                   "<point>-10 10</point><height>12</height></polyline>"
                   "<polyline><point>-5 -5</point><point>5 -5</point><point>5 5</point>"
                   "<point>-5 5</point><height>12</height></polyline>"));
  EXPECT_NEAR(cast({7.3, 1, 100}, -Vector3d::UnitZ()), 88, 1e-6);
  EXPECT_EQ(cast({1, 0.3, 100}, -Vector3d::UnitZ()), kNothing);
  EXPECT_NEAR(cast({0, 0.3, 6}, Vector3d::UnitX()), 5, 1e-6) << "the yard's wall";
  EXPECT_NEAR(cast({-50, 0.3, 6}, Vector3d::UnitX()), 40, 1e-6);
}

TEST_F(GzHostWorldTest, VisualsWhereTheyAreAskedFor) {
  const std::string shape =
      "<model name='m'><static>true</static><link name='l'><visual name='v'><geometry>" + test::box("2 2 2") +
      "</geometry></visual></link></model>";
  load(shape);
  EXPECT_EQ(cast({0.1, 0.2, 10}, -Vector3d::UnitZ()), kNothing);
  load(shape, true);
  EXPECT_NEAR(cast({0.1, 0.2, 10}, -Vector3d::UnitZ()), 9, 1e-9);
}

}  // namespace
}  // namespace canyon::adapters::gz_sim
