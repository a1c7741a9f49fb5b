#include "canyon/paths/propagation/index/edges.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <random>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/link_shapes.hpp"
#include "canyon/city/mesh_file.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/paths/propagation/index/knife_edge.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/edge_reference.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon::propagation {
namespace {

using city::Material;
using city::Mesh;
using city::Surface;
using Eigen::Vector3d;
using geodesy::kPi;
using geodesy::radians;

void append(Mesh& mesh, const Vector3d& min, const Vector3d& max, double yaw_rad = 0) {
  canyon::test::append_box(mesh, "box", Surface::Building, Material::Concrete, min, max, yaw_rad);
}

void append(Mesh& mesh, const city::TriangleSet& set, Surface surface = Surface::Building) {
  city::append_object(mesh, "set", surface, Material::Concrete, set.vertices, set.triangles);
}

/// A rectangle from `corner` along `u` and `v`, front to u x v, cut into m times n pieces of two triangles.
void append_sheet(Mesh& mesh, const Vector3d& corner, const Vector3d& u, const Vector3d& v, int m = 1,
                  int n = 1, Surface surface = Surface::Building) {
  std::vector<Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (int i = 0; i <= m; ++i) {
    for (int k = 0; k <= n; ++k) vertices.emplace_back(corner + u * i / m + v * k / n);
  }
  for (int i = 0; i < m; ++i) {
    for (int k = 0; k < n; ++k) {
      const auto a = static_cast<std::uint32_t>(i * (n + 1) + k), b = a + static_cast<std::uint32_t>(n) + 1;
      triangles.push_back({a, b, b + 1});
      triangles.push_back({a, b + 1, a + 1});
    }
  }
  city::append_object(mesh, "sheet", surface, Material::Concrete, vertices, triangles);
}

double total_length(const EdgeSet& set) {
  double sum = 0;
  for (const Edge& edge : set.edges()) sum += edge.length_m;
  return sum;
}

/// Checks the properties in the comment on Edge.
void expect_consistent(const EdgeSet& set) {
  for (const Edge& e : set.edges()) {
    ASSERT_NEAR(e.direction.norm(), 1, 1e-12);
    ASSERT_NEAR(e.outward().norm(), 1, 1e-12);
    ASSERT_GT(e.length_m, 0);
    ASSERT_GT(e.exterior_rad, kPi);
    const Vector3d into_first = e.normal[0].cross(e.direction), into_second = e.direction.cross(e.normal[1]);
    // Rotation about the edge from face 0 through the air gives face 1, and half of it the outward direction.
    // Facets of merged edges differ by up to 0.5 deg.
    const Eigen::AngleAxisd half(0.5 * e.exterior_rad, e.direction), whole(e.exterior_rad, e.direction);
    ASSERT_GT((whole * into_first).dot(into_second), std::cos(radians(1)));
    ASSERT_GT((half * into_first).dot(e.outward()), std::cos(radians(1)));
    ASSERT_GE(e.outward().dot(e.normal[0]), -1e-9);
    ASSERT_GE(e.outward().dot(e.normal[1]), -1e-9);
    ASSERT_EQ(e.is_free(), e.exterior_rad > 2 * kPi - 1e-4);
  }
}

// ---- the set

TEST(EdgeSet, ABoxHasTwelve) {
  Mesh mesh;
  append(mesh, {-10, -20, 0}, {10, 20, 30}, 0.3);
  const EdgeSet set(mesh);
  ASSERT_EQ(set.edges().size(), 12u);
  expect_consistent(set);
  std::map<int, int> lengths;
  for (const Edge& e : set.edges()) {
    ++lengths[static_cast<int>(std::lround(e.length_m))];
    EXPECT_NEAR(e.exterior_rad, 1.5 * kPi, 1e-9);
    EXPECT_NEAR(e.normal[0].dot(e.normal[1]), 0, 1e-9);
    // Outwards is away from the box's middle.
    const Vector3d middle = e.start + 0.5 * e.length_m * e.direction;
    EXPECT_GT(e.outward().dot(middle - Vector3d(0, 0, 15)), 0);
  }
  EXPECT_EQ(lengths, (std::map<int, int>{{20, 4}, {30, 4}, {40, 4}}));
}

TEST(EdgeSet, PiecesOfOneEdgeAreMerged) {
  // A roof and a wall in 7 and 5 pieces along their common edge of 35 m; all other edges are free.
  Mesh mesh;
  append_sheet(mesh, {0, 0, 10}, {35, 0, 0}, {0, 20, 0}, 7, 3);
  append_sheet(mesh, {0, 0, 0}, {35, 0, 0}, {0, 0, 10}, 7, 4);
  const EdgeSet set(mesh);
  expect_consistent(set);
  // Free: the roof's three others, two sides of the wall; the wall's foot is the lowest of its object.
  ASSERT_EQ(set.edges().size(), 6u);
  const Edge& e =
      *std::find_if(set.edges().begin(), set.edges().end(), [](const Edge& edge) { return !edge.is_free(); });
  EXPECT_NEAR(e.length_m, 35, 1e-9);
  EXPECT_NEAR(e.exterior_rad, 1.5 * kPi, 1e-9);
  EXPECT_NEAR((e.start + 0.5 * e.length_m * e.direction - Vector3d(17.5, 0, 10)).norm(), 0, 1e-9);
  // Free: the roof's three others, two sides of the wall; the wall's foot is the lowest of its object.
  const EdgeSet all(mesh);
  EXPECT_EQ(all.edges().size(), 6u);
  EXPECT_NEAR(total_length(all), 35 + (35 + 2 * 20) + 2 * 10, 1e-9);
  expect_consistent(all);
}

TEST(EdgeSet, AnOtherTurnEndsAnEdge) {
  // A roof's edge that bends by 1 deg half way: two edges.
  Mesh mesh;
  city::TriangleSet prism;
  const double bend = 30 * std::tan(radians(1));
  const std::vector<Eigen::Vector2d> outline{{-30, 0}, {0, 0}, {30, bend}, {30, 20}, {-30, 20}};
  for (const double z : {0.0, 9.0}) {
    for (const auto& p : outline) prism.vertices.emplace_back(p.x(), p.y(), z);
  }
  for (std::uint32_t i = 0; i < 5; ++i) {
    const std::uint32_t k = (i + 1) % 5;
    prism.triangles.push_back({i, k, k + 5});
    prism.triangles.push_back({i, k + 5, i + 5});
  }
  for (std::uint32_t i = 1; i + 1 < 5; ++i) {
    prism.triangles.push_back({5, 5 + i, 6 + i});
    prism.triangles.push_back({0, i + 1, i});
  }
  append(mesh, prism);
  const EdgeSet set(mesh);
  expect_consistent(set);
  // Five roof edges and five at the floor; four vertical ones: the bend itself is only 1 deg.
  EXPECT_EQ(set.edges().size(), 14u);
}

TEST(EdgeSet, InnerCornersAreNone) {
  // An L as one solid: five outer corners and an inner one.
  Mesh mesh;
  city::TriangleSet solid;
  const std::vector<Eigen::Vector2d> outline{{0, 0}, {20, 0}, {20, 10}, {10, 10}, {10, 20}, {0, 20}};
  for (const double z : {0.0, 9.0}) {
    for (const auto& p : outline) solid.vertices.emplace_back(p.x(), p.y(), z);
  }
  for (std::uint32_t i = 0; i < 6; ++i) {
    const std::uint32_t k = (i + 1) % 6;
    solid.triangles.push_back({i, k, k + 6});
    solid.triangles.push_back({i, k + 6, i + 6});
  }
  for (const auto& t :
       std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}}) {
    solid.triangles.push_back({t[0] + 6, t[1] + 6, t[2] + 6});
    solid.triangles.push_back({t[0], t[2], t[1]});
  }
  append(mesh, solid);
  const EdgeSet set(mesh);
  expect_consistent(set);
  int vertical = 0;
  for (const Edge& e : set.edges()) {
    if (std::abs(e.direction.z()) < 0.9) continue;
    ++vertical;
    EXPECT_GT((e.start - Vector3d(10, 10, e.start.z())).norm(), 1);
  }
  EXPECT_EQ(vertical, 5);
  EXPECT_EQ(set.edges().size(), 5u + 12u);
}

TEST(EdgeSet, RoofsThatGoOnAndCommonWallsMakeNone) {
  // Two adjacent boxes of the same height have a common wall, each with its own copy: the edges of one box of
  // 40 m.
  Mesh mesh;
  append(mesh, {0, 0, 0}, {20, 10, 15});
  append(mesh, {20, 0, 0}, {40, 10, 15});
  const EdgeSet set(mesh);
  expect_consistent(set);
  EXPECT_EQ(set.edges().size(), 12u);
  EXPECT_NEAR(total_length(set), 4 * (40 + 10 + 15), 1e-9);
  // Corner to corner along a vertical line: both keep theirs.
  Mesh corners;
  append(corners, {0, 0, 0}, {20, 10, 15});
  append(corners, {20, 10, 0}, {40, 20, 15});
  const EdgeSet two(corners);
  expect_consistent(two);
  // Each wedge of air is a right angle there, so none diffracts: 2 x 12 - 2.
  EXPECT_EQ(two.edges().size(), 22u);
}

TEST(EdgeSet, FacesGivenTwiceCountOnce) {
  Mesh mesh;
  append(mesh, {0, 0, 0}, {20, 10, 15});
  append(mesh, {0, 0, 0}, {20, 10, 15});
  const EdgeSet set(mesh);
  expect_consistent(set);
  EXPECT_EQ(set.edges().size(), 12u);
}

TEST(EdgeSet, SheetsWithTwoSidesHaveFreeEdges) {
  Mesh mesh;
  append_sheet(mesh, {0, 0, 5}, {20, 0, 0}, {0, 0, 3});
  append_sheet(mesh, {20, 0, 5}, {-20, 0, 0}, {0, 0, 3});
  const EdgeSet set(mesh);
  expect_consistent(set);
  ASSERT_EQ(set.edges().size(), 4u);
  for (const Edge& e : set.edges()) EXPECT_TRUE(e.is_free());
}

TEST(EdgeSet, RoundWallsAreSmoothFromTheTurnAskedFor) {
  const auto vertical = [](int sides) {
    Mesh mesh;
    append(mesh, city::cylinder_mesh(10, 30, sides));
    const EdgeSet set(mesh);
    expect_consistent(set);
    return std::count_if(set.edges().begin(), set.edges().end(),
                         [](const Edge& e) { return std::abs(e.direction.z()) > 0.9; });
  };
  EXPECT_EQ(vertical(32), 32);  // 11.25 deg
  EXPECT_EQ(vertical(71), 71);  // 5.07 deg
  EXPECT_EQ(vertical(73), 0);   // 4.93 deg
}

TEST(EdgeSet, OnlyBuildingsVehiclesAndTerrainIfAsked) {
  for (const Surface surface : {Surface::Building, Surface::Terrain, Surface::Foliage, Surface::Vehicle}) {
    Mesh mesh;
    canyon::test::append_box(mesh, "box", surface, Material::Unknown, {0, 0, 0}, {1, 1, 1});
    const bool solid = surface == Surface::Building || surface == Surface::Vehicle;
    EXPECT_EQ(EdgeSet(mesh).edges().size(), solid ? 12u : 0u);
    EXPECT_EQ(EdgeSet(mesh, true).edges().size(), surface == Surface::Foliage ? 0u : 12u);
  }
  EXPECT_TRUE(EdgeSet(Mesh{}).edges().empty());
}

TEST(EdgeSet, EveryEdgeOfASphereTurnsAsItsNormalsDo) {
  Mesh mesh;
  append(mesh, city::sphere_mesh(5, 16));
  const EdgeSet set(mesh);
  expect_consistent(set);
  EXPECT_GT(set.edges().size(), 200u);
  for (const Edge& e : set.edges()) {
    EXPECT_NEAR(e.exterior_rad - kPi, std::acos(std::clamp(e.normal[0].dot(e.normal[1]), -1.0, 1.0)), 1e-9);
  }
}

TEST(EdgeSet, OfARealCityHangsTogether) {
  CANYON_SHARED_DATA(file, "hongkong/buildings.dae");
  const city::City city = city::read_mesh_city(file, {});
  const EdgeSet set(city.mesh);
  expect_consistent(set);
  EXPECT_GT(set.edges().size(), 5000u);
  // Nearly all of its edges have two faces.
  const auto free =
      std::count_if(set.edges().begin(), set.edges().end(), [](const Edge& e) { return e.is_free(); });
  std::printf("%zu edges, %ld of them free, %.0f m\n", set.edges().size(), static_cast<long>(free),
              total_length(set));
  EXPECT_LT(static_cast<double>(free), 0.05 * static_cast<double>(set.edges().size()));
}

// ---- the diffraction point

double detour(const Vector3d& antenna, const Vector3d& point, const Vector3d& s) {
  return (point - antenna).norm() - s.dot(point - antenna);
}

Edge free_edge(const Vector3d& start, const Vector3d& stop, const Vector3d& normal) {
  Edge e;
  e.start = start;
  e.length_m = (stop - start).norm();
  e.direction = (stop - start) / e.length_m;
  e.normal = {normal, -normal};
  e.exterior_rad = 2 * kPi;
  return e;
}

/// Position of the minimum of a function of one variable with one minimum, between a and b.
template <typename F>
double golden_section(const F& f, double a, double b) {
  const double ratio = 0.5 * (std::sqrt(5.0) - 1);
  double c = b - ratio * (b - a), d = a + ratio * (b - a);
  while (b - a > 1e-7) {
    if (f(c) < f(d)) {
      b = d;
    } else {
      a = c;
    }
    c = b - ratio * (b - a);
    d = a + ratio * (b - a);
  }
  return 0.5 * (a + b);
}

TEST(DiffractionPoint, IsWhereThePathIsShortest) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> coordinate(-100, 100), one(-1, 1);
  int found = 0, beyond = 0;
  for (int i = 0; i < 3000; ++i) {
    const Vector3d start(coordinate(random), coordinate(random), coordinate(random));
    const Vector3d stop(coordinate(random), coordinate(random), coordinate(random));
    const Vector3d antenna(coordinate(random), coordinate(random), coordinate(random));
    const Vector3d s = Vector3d(one(random), one(random), one(random)).normalized();
    const Vector3d u = (stop - start).normalized();
    const Edge edge = free_edge(start, stop, u.unitOrthogonal());
    const auto length = [&](double along) { return detour(antenna, start + along * u, s); };
    const double least = golden_section(length, -2000, 2000);
    const auto at = diffraction_point(edge, antenna, s);
    if (least < -1e-3 || least > edge.length_m + 1e-3) {
      beyond += std::abs(least) < 1999 ? 1 : 0;
      EXPECT_FALSE(at);
      continue;
    }
    ASSERT_TRUE(at);
    ++found;
    // A minimum's position is known to about the root of the precision of its value.
    EXPECT_NEAR((at->point - start).dot(u), least, 1e-3);
    EXPECT_NEAR((at->point - start).cross(u).norm(), 0, 1e-9);
    EXPECT_NEAR(at->excess_m, length(least), 1e-9);
    EXPECT_NEAR(at->leg_m, (at->point - antenna).norm(), 1e-9);
    // The same construction in another form.
    const auto other = test::ray_around_edge(antenna, s, start, stop);
    ASSERT_TRUE(other);
    EXPECT_NEAR((other->point - at->point).norm(), 0, 1e-9);
    EXPECT_NEAR(other->excess_m, at->excess_m, 1e-9);
    EXPECT_NEAR(other->bend_rad, at->bending_rad, 1e-7);
    // Keller's cone: the leg and the continuation make the same angle with the edge.
    const Vector3d leg = (at->point - antenna).normalized();
    EXPECT_NEAR(leg.dot(u), s.dot(u), 1e-12);
    EXPECT_NEAR(std::cos(at->bending_rad), leg.dot(s), 1e-12);
  }
  EXPECT_GT(found, 300);
  EXPECT_GT(beyond, 300);
}

TEST(DiffractionPoint, ExcessKeepsItsDigitsAtTheShadowBoundary) {
  // An edge 100 m away, bending by a millionth of a radian: leg (1 - cos) = 5e-11 m, of which the difference
  // of two lengths would keep no digit. The antenna at the origin makes the input exact.
  const Edge edge = free_edge({-50, 100, 0}, {50, 100, 0}, Vector3d::UnitY());
  const double angle = 1e-6;
  const auto at = diffraction_point(edge, Vector3d::Zero(), {0, std::cos(angle), std::sin(angle)});
  ASSERT_TRUE(at);
  EXPECT_NEAR(at->excess_m / (100 * 2 * std::pow(std::sin(angle / 2), 2)), 1, 1e-9);
}

TEST(DiffractionPoint, NeedsAntennaAndSatelliteOutsideTheWedge) {
  // The box's roof edge to the south, at height 20: wall normal -y, roof normal +z.
  Mesh mesh;
  append(mesh, {-50, 10, 0}, {50, 30, 20});
  const EdgeSet set(mesh);
  const auto roof = std::find_if(set.edges().begin(), set.edges().end(), [](const Edge& e) {
    return std::abs(e.start.z() - 20) < 1e-9 && std::abs(e.start.y() - 10) < 1e-9 &&
           std::abs(e.direction.x()) > 0.9;
  });
  ASSERT_NE(roof, set.edges().end());
  const auto north = [](double elevation_deg) {
    return geodesy::enu_from_azimuth_elevation(0, radians(elevation_deg));
  };
  const Vector3d street(0, 0, 2);
  const double grazing = geodesy::degrees(std::atan2(18, 10));
  ASSERT_TRUE(diffraction_point(*roof, street, north(grazing - 1)));
  EXPECT_TRUE(diffraction_point(*roof, street, north(grazing - 1))->shadowed);
  ASSERT_TRUE(diffraction_point(*roof, street, north(grazing + 1)));
  EXPECT_FALSE(diffraction_point(*roof, street, north(grazing + 1))->shadowed);
  EXPECT_TRUE(diffraction_point(*roof, street, north(0.1)));
  EXPECT_FALSE(diffraction_point(*roof, street, north(-0.1)));     // into the roof
  EXPECT_FALSE(diffraction_point(*roof, {0, 20, 2}, north(30)));   // inside
  EXPECT_FALSE(diffraction_point(*roof, {0, 40, 2}, north(30)));   // behind the building
  EXPECT_TRUE(diffraction_point(*roof, {0, 40, 30}, -north(30)));  // above the roof, towards the street
  EXPECT_TRUE(diffraction_point(*roof, {0, 40, 30}, -north(30))->shadowed);
  // Above the roof and in front of the wall no part of the wedge is hidden.
  const Vector3d above(0, 5, 30);
  ASSERT_TRUE(diffraction_point(*roof, above, north(5)));
  EXPECT_FALSE(diffraction_point(*roof, above, north(5))->shadowed);
  // Along the edge, and from a point on its line, there is no cone.
  EXPECT_FALSE(diffraction_point(*roof, street, {1, 0, 0}));
  EXPECT_FALSE(diffraction_point(*roof, {-80, 10, 20}, north(30)));
}

TEST(DiffractionPoint, LeavesNoGapBetweenTheEdgesOfOneLine) {
  const Vector3d middle(1.0 / 3, 10, 20);
  const Edge left = free_edge({-50, 10, 20}, middle, Vector3d::UnitY());
  const Edge right = free_edge(middle, {50, 10, 20}, Vector3d::UnitY());
  for (int i = -1000; i <= 1000; ++i) {
    // Points within a nanometre of the joint.
    const Vector3d antenna(middle.x() + i * 1e-12, 0, 2);
    EXPECT_TRUE(diffraction_point(left, antenna, {0, 1, 0}) || diffraction_point(right, antenna, {0, 1, 0}));
  }
}

// ---- the quick test

TEST(NearEdges, MarkingNeverMissesAnEdge) {
  const city::City city = city::synthetic_city({});
  const EdgeSet set(city.mesh);
  expect_consistent(set);
  ASSERT_GT(set.edges().size(), 500u);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> coordinate(-200, 200), height(1, 60), one(-1, 1);
  NearEdges near;
  std::vector<std::uint8_t> marks;
  std::size_t kept = 0, marked = 0, in_reach = 0;
  for (int i = 0; i < 40; ++i) {
    const Vector3d antenna(coordinate(random), coordinate(random), height(random));
    constexpr double kReach = 250, kClearance = 2e-3;
    set.gather(antenna, kReach, kClearance, near);
    in_reach += near.edge.size();
    ASSERT_EQ(near.low.size() % NearEdges::kLanes, 0u);
    std::vector<std::size_t> row(set.edges().size(), SIZE_MAX);
    for (std::size_t k = 0; k < near.edge.size(); ++k) row[near.edge[k]] = k;
    for (int n = 0; n < 20; ++n) {
      const Vector3d s = Vector3d(one(random), one(random), std::abs(one(random))).normalized();
      const double max_excess = n % 2 == 0 ? 8 : 0.03;
      mark_diffracting(near, s, max_excess, marks);
      ASSERT_EQ(marks.size(), near.low.size());
      for (std::size_t k = near.edge.size(); k < marks.size(); ++k) ASSERT_EQ(marks[k], 0);
      marked += static_cast<std::size_t>(std::count(marks.begin(), marks.end(), 1));
      for (std::size_t e = 0; e < set.edges().size(); ++e) {
        const Edge& edge = set.edges()[e];
        const auto at = diffraction_point(edge, antenna, s);
        if (!at || at->leg_m > kReach || at->excess_m > max_excess) continue;
        const Vector3d from = antenna - edge.start;
        if (std::max(edge.normal[0].dot(from), edge.normal[1].dot(from)) <= kClearance) continue;
        ASSERT_NE(row[e], SIZE_MAX);
        ASSERT_EQ(marks[row[e]], 1) << "excess " << at->excess_m;
        ++kept;
      }
    }
  }
  EXPECT_GT(kept, 1000u);
  EXPECT_LT(static_cast<double>(marked), 1.02 * static_cast<double>(kept) + 100);  // and rarely too many
  EXPECT_LT(in_reach, 40 * set.edges().size());
}

}  // namespace
}  // namespace canyon::propagation
