
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "canyon/city/buildings/sources/terrain.hpp"
#include "canyon/city/city.hpp"

namespace canyon::buildings {
namespace {

/// The plane z = 100 + 1e4 (lon - 10) + 2e4 (lat - 50) over n x n squares of 0.001 deg; the square `gap` is
/// missing.
std::vector<MapSurface> sheet(int n, int gap = -1) {
  const auto at = [](int i, int j) {
    return Eigen::Vector3d(10 + 0.001 * i, 50 + 0.001 * j, 100 + 10 * i + 20 * j);
  };
  std::vector<MapSurface> surfaces;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      if (j * n + i == gap) continue;
      MapSurface low, high;
      low.outer = {at(i, j), at(i + 1, j), at(i + 1, j + 1)};
      high.outer = {at(i, j), at(i, j + 1), at(i + 1, j + 1)};  // faces down
      surfaces.push_back(low);
      surfaces.push_back(high);
    }
  }
  return surfaces;
}

TEST(Tin, HeightsAreLinearInTriangles) {
  const Tin tin(sheet(7));
  EXPECT_EQ(tin.size(), 98U);
  for (const LonLat& position :
       {LonLat(10.00051, 50.0032), LonLat(10.0069, 50.0001), LonLat(10.003, 50.003)}) {
    EXPECT_NEAR(tin.height_m(position).value_or(0),
                100 + 1e4 * (position.x() - 10) + 2e4 * (position.y() - 50), 1e-6);
  }
  EXPECT_FALSE(tin.height_m({9.999, 50.003}));
  EXPECT_NEAR(tin.height_m({10.003 + 360, 50.003}).value_or(0), 190, 1e-6);
}

TEST(Tin, GapsHaveTheHeightOfTheNearestCorner) {
  const Tin tin(sheet(5, 12));
  EXPECT_NEAR(tin.height_m({10.0021, 50.0022}).value_or(0), 160, 1e-9);
}

TEST(Tin, TerrainOfAReliefHasItsTrianglesFrontSidesUp) {
  const Terrain terrain = Terrain::from_relief(sheet(3));
  city::Mesh mesh;
  const geodesy::LocalFrame frame(geodesy::Geodetic::from_degrees(50.0015, 10.0015, 100));
  terrain.append(mesh, frame, {-1000, -1000}, {1000, 1000}, 20);
  ASSERT_EQ(mesh.triangles.size(), 18U);
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d p = mesh.vertices[a], q = mesh.vertices[b], r = mesh.vertices[c];
    EXPECT_GT((q - p).cross(r - p).z(), 0);
  }
  EXPECT_EQ(mesh.objects.at(0).surface, city::Surface::Terrain);
}

}  // namespace
}  // namespace canyon::buildings
