#include "canyon/city/tiles/tile_mesh.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>

namespace canyon::tiles {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::SizeIs;

/// A height field with posts 0.5 m apart over 80 m x 80 m: sloping ground, a house of 20 m x 16 m whose roof
/// is 12 m above it, and a rough crown of 4 m radius; 3 cm of noise.
class Heights {
 public:
  static constexpr int kPosts = 161;
  static constexpr double kStep_m = 0.5;

  [[nodiscard]] static double ground(double x, double y) { return 0.05 * x + 0.02 * y; }
  [[nodiscard]] static bool in_house(double x, double y) { return x > 20 && x < 40 && y > 30 && y < 46; }
  [[nodiscard]] static bool in_crown(double x, double y) { return std::hypot(x - 60, y - 60) < 4; }

  static PhotoMesh skin() {
    PhotoMesh out;
    std::uint32_t state = 1;
    const auto noise = [&state] {
      state = state * 1664525U + 1013904223U;
      return (static_cast<double>(state >> 8) / (1U << 24) - 0.5) * 2;
    };
    for (int row = 0; row < kPosts; ++row) {
      for (int column = 0; column < kPosts; ++column) {
        const double x = column * kStep_m, y = row * kStep_m;
        double z = ground(x, y) + 0.03 * noise();
        if (in_house(x, y)) z = ground(30, 38) + 12 + 0.03 * noise();
        if (in_crown(x, y)) z = ground(x, y) + 7 + 1.5 * noise();
        out.vertices.emplace_back(x, y, z);
      }
    }
    for (std::uint32_t row = 0; row + 1 < kPosts; ++row) {
      for (std::uint32_t column = 0; column + 1 < kPosts; ++column) {
        const std::uint32_t a = row * kPosts + column, b = a + 1, c = a + kPosts, d = c + 1;
        out.triangles.push_back({a, b, d});
        out.triangles.push_back({a, d, c});
      }
    }
    return out;
  }
};

double area_seen_from_above(const city::Mesh& mesh, city::Surface surface) {
  double area = 0;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (mesh.surface_of(t) != surface) continue;
    const auto& [a, b, c] = mesh.triangles[t];
    area += (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).z() / 2;
  }
  return area;
}

TEST(SkinSurfaces, TellsGroundHousesAndTreesApart) {
  city::Mesh mesh;
  EXPECT_THAT(append_skin(Heights::skin(), mesh), Contains(HasSubstr("51200 triangles became")));
  EXPECT_LT(mesh.triangles.size(), 3'000U);
  // The roof has 20 m x 16 m; posts inside the walls make it 19 m x 15 m, tilted walls extend to the rest.
  EXPECT_NEAR(area_seen_from_above(mesh, city::Surface::Building), 20 * 16, 30);
  // pi * 4 m^2, with half a post of rim.
  EXPECT_NEAR(area_seen_from_above(mesh, city::Surface::Foliage), 50, 12);
  EXPECT_NEAR(area_seen_from_above(mesh, city::Surface::Terrain), 80 * 80 - 320 - 50, 60);
  city::check_mesh(mesh, "skin");
  double highest = 0;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (mesh.surface_of(t) != city::Surface::Building) continue;
    for (const std::uint32_t v : mesh.triangles[t]) highest = std::max(highest, mesh.vertices[v].z());
  }
  EXPECT_NEAR(highest, Heights::ground(30, 38) + 12, 0.1);
}

TEST(SkinSurfaces, OneTriangleIsASkinToo) {
  PhotoMesh skin;
  skin.vertices = {{0, 0, 0}, {5, 0, 0}, {0, 5, 0}};
  skin.triangles = {{0, 1, 2}};
  city::Mesh mesh;
  (void)append_skin(skin, mesh);
  EXPECT_THAT(mesh.triangles, SizeIs(1));
}

}  // namespace
}  // namespace canyon::tiles
