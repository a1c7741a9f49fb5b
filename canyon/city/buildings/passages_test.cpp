#include "canyon/city/buildings/builder_steps.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/buildings/city_builder.hpp"
#include "canyon/city/buildings/shapes/footprint.hpp"
#include "canyon/city/buildings/sources/osm_reader.hpp"
#include "canyon/city/city.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::buildings {
namespace {

using Eigen::Vector3d;

/// Whether a ray meets a triangle of the mesh, by Moeller and Trumbore.
bool meets(const city::Mesh& mesh, const Vector3d& from, const Vector3d& direction) {
  for (const auto& triangle : mesh.triangles) {
    const Vector3d a = mesh.vertices[triangle[0]];
    const Vector3d ab = mesh.vertices[triangle[1]] - a;
    const Vector3d ac = mesh.vertices[triangle[2]] - a;
    const Vector3d p = direction.cross(ac);
    const double det = ab.dot(p);
    if (std::abs(det) < 1e-12) continue;
    const Vector3d s = from - a;
    const double u = s.dot(p) / det, v = direction.dot(s.cross(ab)) / det, t = ac.dot(s.cross(ab)) / det;
    if (u >= 0 && v >= 0 && u + v <= 1 && t > 0) return true;
  }
  return false;
}

const std::vector<Vector3d> kRoute{{0, 0, 3}, {100, 0, 3}, {160, 80, 3}};

TEST(Passages, ATunnelHidesAllButItsMouths) {
  city::Mesh mesh;
  ASSERT_TRUE(append_passage(mesh, "way/1", {{"highway", "primary"}, {"tunnel", "yes"}, {"lanes", "2"}},
                             kRoute, true));
  const Vector3d inside(50, 0, 4.8);
  for (int azimuth = 0; azimuth < 360; azimuth += 5) {
    for (const int elevation : {1, 10, 40, 80}) {
      const double a = azimuth * geodesy::kPi / 180, e = elevation * geodesy::kPi / 180;
      const Vector3d towards(std::sin(a) * std::cos(e), std::cos(a) * std::cos(e), std::sin(e));
      // Below 3.2 / 50 of height the western opening is visible.
      const bool mouth = elevation == 1 && std::abs(azimuth - 270) <= 3;
      EXPECT_EQ(meets(mesh, inside, towards), !mouth) << azimuth << " " << elevation;
    }
  }
  EXPECT_FALSE(meets(mesh, {-20, 0, 4.8}, Vector3d::UnitZ()));
  EXPECT_FALSE(meets(mesh, {50, 6, 4.8}, Vector3d::UnitZ())) << "beside it";
  EXPECT_TRUE(meets(mesh, {130, 40, 4.8}, Vector3d::UnitZ())) << "behind the bend";
}

TEST(Passages, ACoveredWayIsOpenAtItsSidesAndABridgeBelow) {
  city::Mesh covered, bridge;
  ASSERT_TRUE(append_passage(covered, "way/1", {{"highway", "footway"}, {"covered", "yes"}}, kRoute, true));
  EXPECT_TRUE(meets(covered, {50, 1, 4}, Vector3d::UnitZ()));
  EXPECT_FALSE(meets(covered, {50, 0, 4}, Vector3d::UnitY()));
  ASSERT_TRUE(append_passage(bridge, "way/2", {{"highway", "primary"}, {"bridge", "yes"}, {"layer", "2"}},
                             kRoute, true));
  EXPECT_TRUE(meets(bridge, {50, 0, 4}, Vector3d::UnitZ()));
  EXPECT_TRUE(meets(bridge, {50, 0, 3 + 11.9}, Vector3d::UnitZ()));
  EXPECT_FALSE(meets(bridge, {50, 0, 3 + 13.1}, Vector3d::UnitZ())) << "on the deck";
}

// On a terrain it follows the slope of the road.
TEST(Passages, FollowTheGround) {
  city::Mesh mesh;
  ASSERT_TRUE(append_passage(mesh, "way/1", {{"highway", "primary"}, {"tunnel", "yes"}},
                             {{0, 0, 0}, {200, 0, 20}}, false));
  for (double x = 1; x < 200; x += 7.3) {
    EXPECT_TRUE(meets(mesh, {x, 0, x / 10 + 1.8}, Vector3d::UnitZ())) << x;
    EXPECT_TRUE(meets(mesh, {x, 0, x / 10 + 1.8}, Vector3d::UnitY())) << x;
  }
}

TEST(Passages, ARibbonHasItsWidth) {
  const auto band = ribbon({{0, 0}, {100, 0}}, 4);
  ASSERT_EQ(band.size(), 1U);
  EXPECT_NEAR(area(band[0]), 800, 1e-6);
  EXPECT_TRUE(ribbon({{0, 0}}, 4).empty());
}

class PassageMap : public ::testing::Test {
 protected:
  BuiltCity build(bool tunnels, bool bridges) {
    const std::string text =
        "<osm version=\"0.6\">"
        "<node id=\"1\" version=\"1\" lat=\"50\" lon=\"8\"/><node id=\"2\" version=\"1\" lat=\"50\" "
        "lon=\"8.001\"/>"
        "<node id=\"3\" version=\"1\" lat=\"50.001\" lon=\"8\"/><node id=\"4\" version=\"1\" lat=\"50.001\" "
        "lon=\"8.001\"/>"
        "<node id=\"5\" version=\"1\" lat=\"50.002\" lon=\"8\"/><node id=\"6\" version=\"1\" lat=\"50.002\" "
        "lon=\"8.001\"/>"
        "<way id=\"10\" version=\"1\"><nd ref=\"3\"/><nd ref=\"4\"/><nd ref=\"6\"/><nd ref=\"5\"/><nd "
        "ref=\"3\"/>"
        "<tag k=\"building\" v=\"yes\"/></way>"
        "<way id=\"11\" version=\"1\"><nd ref=\"1\"/><nd ref=\"2\"/><tag k=\"highway\" v=\"primary\"/><tag "
        "k=\"tunnel\" v=\"yes\"/></way>"
        "<way id=\"12\" version=\"1\"><nd ref=\"1\"/><nd ref=\"3\"/><tag k=\"highway\" v=\"primary\"/><tag "
        "k=\"bridge\" v=\"viaduct\"/></way>"
        "<way id=\"13\" version=\"1\"><nd ref=\"1\"/><nd ref=\"3\"/><tag k=\"highway\" v=\"primary\"/><tag "
        "k=\"tunnel\" v=\"building_passage\"/></way>"
        "<way id=\"14\" version=\"1\"><nd ref=\"1\"/><nd ref=\"3\"/><tag k=\"waterway\" v=\"stream\"/><tag "
        "k=\"tunnel\" v=\"culvert\"/></way>"
        "<way id=\"15\" version=\"1\"><nd ref=\"1\"/><nd ref=\"99\"/><tag k=\"railway\" v=\"rail\"/><tag "
        "k=\"tunnel\" v=\"yes\"/></way>"
        "<way id=\"16\" version=\"1\"><nd ref=\"1\"/><nd ref=\"3\"/><tag k=\"highway\" v=\"primary\"/><tag "
        "k=\"bridge\" v=\"no\"/></way>"
        "</osm>";
    std::ofstream(folder_.path() / "map.osm") << text;
    const MapData map = read_osm({folder_.path() / "map.osm"});
    EXPECT_EQ(map.passages.size(), 2U);
    EXPECT_EQ(map.features.size(), 1U);
    BuildOptions options;
    options.tunnels = tunnels;
    options.bridges = bridges;
    return build_city(map, nullptr, options);
  }
  static std::vector<std::string> names(const BuiltCity& built) {
    std::vector<std::string> result;
    for (const auto& object : built.city.mesh.objects)
      if (object.surface == city::Surface::Building) result.push_back(object.name);
    return result;
  }

  test::TemporaryFolder folder_;
};

TEST_F(PassageMap, IsBuiltWhereItIsAskedFor) {
  const BuiltCity plain = build(false, false);
  EXPECT_THAT(names(plain), ::testing::ElementsAre("way/10"));
  const BuiltCity all = build(true, true);
  EXPECT_THAT(names(all), ::testing::ElementsAre("way/10", "way/11", "way/11#2", "way/11#3", "way/12"));
  EXPECT_EQ(all.report.tunnels, 1U);
  EXPECT_EQ(all.report.bridges, 1U);
  EXPECT_THAT(names(build(false, true)), ::testing::ElementsAre("way/10", "way/12"));
}

}  // namespace
}  // namespace canyon::buildings
