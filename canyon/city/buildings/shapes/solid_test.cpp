#include "canyon/city/buildings/shapes/solid.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/mesh_topology.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/solid_check.hpp"

namespace canyon::buildings::solid_test {
namespace {

using city::Material;
using city::Mesh;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

using Ring = std::vector<Point2>;

constexpr RoofShape kShapes[] = {
    RoofShape::Flat, RoofShape::Gabled, RoofShape::Hipped, RoofShape::Pyramidal, RoofShape::Skillion,
    RoofShape::Dome, RoofShape::Onion,  RoofShape::Round,  RoofShape::Gambrel,   RoofShape::Mansard};

Ring box(double x0, double y0, double x1, double y1) {
  return {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
}

Ring rotated(Ring ring, double angle_deg, const Point2& shift = Point2::Zero()) {
  const Eigen::Rotation2Dd rotation(geodesy::radians(angle_deg));
  for (Point2& p : ring) p = rotation * p + shift;
  return ring;
}

Ring regular(int corners, double radius) {
  Ring ring;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * M_PI * i / corners;
    ring.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  return ring;
}

/// Simple by construction: seen from (x, y), angles ascend.
Ring random_star(std::mt19937_64& random, int corners, double inner, double outer) {
  std::uniform_real_distribution<double> radius(inner, outer), step(0.2, 1);
  std::vector<double> angles;
  double sum = 0;
  for (int i = 0; i < corners; ++i) angles.push_back(sum += step(random));
  Ring ring;
  for (const double a : angles) {
    const double r = radius(random), angle = 2 * M_PI * a / sum;
    ring.emplace_back(r * std::cos(angle), r * std::sin(angle));
  }
  return ring;
}

/// A union of boxes with corners on a grid of half metres.
std::vector<Polygon2> random_blocks(std::mt19937_64& random, int boxes) {
  std::uniform_int_distribution<int> coordinate(-20, 20), size(4, 24);
  std::vector<Polygon2> parts;
  for (int i = 0; i < boxes; ++i) {
    const double x = 0.5 * coordinate(random), y = 0.5 * coordinate(random);
    parts.push_back({box(x, y, x + 0.5 * size(random), y + 0.5 * size(random)), {}});
  }
  return unite(parts);
}

std::vector<Polygon2> cleaned(const std::vector<Polygon2>& raw) {
  std::vector<std::string> notes;
  return repair(raw, notes);
}

struct Named {
  std::string name;
  Polygon2 polygon;
};

std::vector<Named> footprints() {
  const Ring rectangle = box(-10, -4, 10, 4);
  const Ring ell{{0, 0}, {20, 0}, {20, 8}, {9, 8}, {9, 18}, {0, 18}};
  const Ring cup{{0, 0}, {24, 0}, {24, 20}, {17, 20}, {17, 7}, {8, 7}, {8, 20}, {0, 20}};
  const Ring tee{{0, 10}, {8, 10}, {8, 0}, {14, 0}, {14, 10}, {22, 10}, {22, 17}, {0, 17}};
  const Ring plus{{5, 0},   {10, 0}, {10, 5}, {15, 5}, {15, 10}, {10, 10},
                  {10, 15}, {5, 15}, {5, 10}, {0, 10}, {0, 5},   {5, 5}};
  Ring star;
  for (int i = 0; i < 14; ++i) {
    const double r = i % 2 == 0 ? 15 : 6, angle = M_PI * i / 7;
    star.emplace_back(r * std::cos(angle), r * std::sin(angle));
  }
  Ring hole = box(4, 5, 11, 12);
  std::reverse(hole.begin(), hole.end());
  const std::vector<std::pair<std::string, Polygon2>> raw = {
      {"rectangle", {rectangle, {}}},
      {"square", {box(0, 0, 12, 12), {}}},
      {"turned rectangle", {rotated(rectangle, 33, {100, -50}), {}}},
      {"far rectangle", {rotated(rectangle, 12, {25000.3, -31000.7}), {}}},
      {"split sides", {{{0, 0}, {3, 0}, {7, 0}, {20, 0}, {20, 4}, {20, 8}, {10, 8}, {0, 8}}, {}}},
      {"L", {ell, {}}},
      {"turned L", {rotated(ell, 71), {}}},
      {"U", {cup, {}}},
      {"turned U", {rotated(cup, -20), {}}},
      {"T", {tee, {}}},
      {"plus", {plus, {}}},
      {"circle", {regular(64, 11), {}}},
      {"hexagon", {rotated(regular(6, 9), 7), {}}},
      {"star", {star, {}}},
      {"triangle", {{{0, 0}, {14, 1}, {3, 9}}, {}}},
      {"needle", {{{0, 0}, {40, 0.3}, {0.1, 0.5}}, {}}},
      {"courtyard", {box(0, 0, 18, 20), {hole}}},
      {"turned courtyard", {rotated(box(0, 0, 18, 20), 26), {rotated(hole, 26)}}},
      {"hole at a corner", {box(0, 0, 18, 20), {{{0, 0}, {4, 9}, {9, 4}}}}},
      {"hole at a side", {box(0, 0, 18, 20), {{{0, 10}, {6, 15}, {6, 5}}}}},
      {"thin", {box(0, 0, 30, 0.2), {}}},
      {"thinner", {rotated(box(0, 0, 30, 0.11), 41), {}}},
      {"thinnest", {rotated(box(0, 0, 30, 0.002), 17), {}}},
      {"notched",
       {{{0, 0}, {20, 0}, {20, 4.999}, {19.998, 5}, {20, 5.001}, {20, 10}, {0, 10}, {0, 5.002}}, {}}},
  };
  std::vector<Named> result;
  for (const auto& [name, polygon] : raw) {
    for (const Polygon2& piece : cleaned({polygon})) result.push_back({name, piece});
  }
  return result;
}

Shape shape_with(RoofShape roof, double height_m, double roof_height_m) {
  Shape shape;
  shape.roof = roof;
  shape.height_m = height_m;
  shape.roof_height_m = roof == RoofShape::Flat ? 0 : roof_height_m;
  shape.facade = Material::Brick;
  shape.roof_material = Material::Metal;
  return shape;
}

struct Built {
  Mesh mesh;
  test::SolidCheck check;
  std::vector<std::string> notes;
};

Built build(const Polygon2& polygon, const Shape& shape, double base_m = 0, double bottom_m = 0) {
  Built built;
  append_solid(built.mesh, "house", city::Surface::Building, polygon, shape, base_m, bottom_m, built.notes);
  city::check_mesh(built.mesh, "test");
  EXPECT_THAT(built.mesh.objects, SizeIs(1));
  if (!built.mesh.objects.empty()) built.check = test::check_solid(built.mesh, built.mesh.objects[0]);
  return built;
}

/// Roofs face up, floors down, walls are upright; materials follow; z stays between bottom and top. An onion
/// overhangs.
void expect_sound(const Built& built, const Polygon2& polygon, const Shape& shape, double bottom_m,
                  double top_m) {
  EXPECT_TRUE(built.check.watertight);
  double roof = 0, floor = 0;
  for (std::size_t t = 0; t < built.mesh.triangles.size(); ++t) {
    const auto& corners = built.mesh.triangles[t];
    const Eigen::Vector3d &a = built.mesh.vertices[corners[0]], &b = built.mesh.vertices[corners[1]],
                          &c = built.mesh.vertices[corners[2]];
    EXPECT_FALSE(city::is_degenerate(a, b, c));
    const double up = 0.5 * (b - a).cross(c - a).z();
    for (const double z : {a.z(), b.z(), c.z()}) {
      EXPECT_GE(z, bottom_m - 1e-9);
      EXPECT_LE(z, top_m + 1e-9);
    }
    if (built.mesh.materials[t] == shape.roof_material) {
      roof += up;
      if (shape.roof != RoofShape::Onion) {
        EXPECT_GT(up, -1e-9);
      }
    } else {
      EXPECT_EQ(built.mesh.materials[t], shape.facade);
      EXPECT_LE(up, 1e-9);
      floor -= up;
    }
  }
  const double expected = area(polygon);
  EXPECT_NEAR(roof, expected, 1e-6 * expected);
  EXPECT_NEAR(floor, expected, 1e-6 * expected);
}

TEST(Solid, PrismsHaveTheirVolume) {
  for (const Named& footprint : footprints()) {
    SCOPED_TRACE(footprint.name);
    const Shape shape = shape_with(RoofShape::Flat, 17.25, 0);
    const Built built = build(footprint.polygon, shape, 3, 3);
    expect_sound(built, footprint.polygon, shape, 3, 20.25);
    const double volume = area(footprint.polygon) * 17.25;
    EXPECT_NEAR(built.check.volume_m3, volume, 1e-9 * volume);
    EXPECT_THAT(built.notes, IsEmpty());
  }
}

TEST(Solid, APrismHasNoMoreTrianglesThanItNeeds) {
  // n - 2 for floor and roof each, 2 n for the walls.
  EXPECT_THAT(build({box(0, 0, 10, 5), {}}, shape_with(RoofShape::Flat, 5, 0)).mesh.triangles, SizeIs(12));
  const Built gabled = build({box(0, 0, 10, 5), {}}, shape_with(RoofShape::Gabled, 5, 2));
  // Floor 2, slopes 2 each, eaves walls 2 each, gables 3 each.
  EXPECT_THAT(gabled.mesh.triangles, SizeIs(2 + 4 + 4 + 6));
  EXPECT_THAT(gabled.mesh.vertices, SizeIs(10));
  // Hipped: two trapezoids, two triangles; four walls of 2.
  EXPECT_THAT(build({box(0, 0, 10, 5), {}}, shape_with(RoofShape::Hipped, 5, 2)).mesh.triangles,
              SizeIs(2 + 6 + 8));
  EXPECT_THAT(build({box(0, 0, 10, 5), {}}, shape_with(RoofShape::Mansard, 5, 2)).mesh.triangles,
              SizeIs(2 + 8 + 6 + 8));
}

/// Volumes over a rectangle of length l and width w, eaves e, rise r: sections and frusta in closed form.
TEST(Solid, RoofsOverARectangleHaveTheirVolume) {
  const double l = 20, w = 8, e = 6, r = 3;
  double round_section = 0;  // of 8 chords over half an ellipse: the polygon's area
  for (int i = 0; i < 8; ++i) {
    round_section += 0.5 * (w / 2) * r * std::sin(M_PI / 8);  // triangle from the centre
  }
  // Hipped: prism of length l - w between two half pyramids over w x w.
  const auto hipped = [](double length, double width, double rise) {
    return 0.5 * width * rise * (length - width) + width * width * rise / 3;
  };
  // Mansard: level sections shrink by d on each side; the lower half is a prismatoid (Simpson's rule is
  // exact).
  const auto rectangle_at = [&](double d) { return (l - 2 * d) * (w - 2 * d); };
  const double mansard = 0.75 * r / 6 * (rectangle_at(0) + 4 * rectangle_at(1) + rectangle_at(2)) +
                         hipped(l - 4, w - 4, 0.25 * r);
  // Frusta of similar sections, (1 + kk' + ...) / 3 each, from the dome's 8 steps.
  double dome = 0;
  for (int i = 0; i < 8; ++i) {
    const double a = M_PI * i / 16, b = M_PI * (i + 1) / 16;
    const double k = std::cos(a), m = i == 7 ? 0 : std::cos(b);
    dome += (std::sin(b) - std::sin(a)) * (k * k + k * m + m * m) / 3;
  }
  EXPECT_NEAR(dome, 2.0 / 3, 0.01);  // the half ellipsoid, except for the steps
  const std::vector<std::pair<RoofShape, double>> cases = {
      {RoofShape::Gabled, l * w * r / 2},
      {RoofShape::Skillion, l * w * r / 2},
      {RoofShape::Hipped, hipped(l, w, r)},
      {RoofShape::Pyramidal, l * w * r / 3},
      // Section: a trapezoid below, a triangle above.
      {RoofShape::Gambrel, l * (0.75 * r * (w + w / 2) / 2 + 0.25 * r * (w / 2) / 2)},
      {RoofShape::Mansard, mansard},
      {RoofShape::Round, l * round_section},
      {RoofShape::Dome, l * w * r * dome},
  };
  for (const auto& [roof, volume] : cases) {
    SCOPED_TRACE(name(roof));
    const Shape shape = shape_with(roof, e + r, r);
    const Polygon2 straight{box(-10, -4, 10, 4), {}};
    Built built = build(straight, shape);
    expect_sound(built, straight, shape, 0, e + r);
    EXPECT_NEAR(built.check.volume_m3, l * w * e + volume, 1e-9 * l * w * e);
    // After rotation, corners are off by up to 0.7 mm.
    const Polygon2 leaning = cleaned({{rotated(straight.outer, 33, {1000, 2000}), {}}}).at(0);
    built = build(leaning, shape);
    expect_sound(built, leaning, shape, 0, e + r);
    EXPECT_NEAR(built.check.volume_m3, l * w * e + volume, 5e-4 * l * w * e);
    double highest = 0;
    for (const auto& v : built.mesh.vertices) highest = std::max(highest, v.z());
    EXPECT_NEAR(highest, e + r, 1e-9 + (roof == RoofShape::Skillion ? 1e-3 : 0));
  }
}

TEST(Solid, EveryRoofOverEveryFootprintIsClosed) {
  for (const Named& footprint : footprints()) {
    for (const RoofShape roof : kShapes) {
      for (const double eaves : {0.0, 6.0}) {
        for (const double rise : {0.5, 5.0, 40.0}) {
          SCOPED_TRACE(footprint.name + ", " + std::string(name(roof)));
          const Shape shape = shape_with(roof, eaves + rise, rise);
          const Built built = build(footprint.polygon, shape, 2, 2);
          expect_sound(built, footprint.polygon, shape, 2, 2 + eaves + rise);
          EXPECT_GT(built.check.volume_m3, area(footprint.polygon) * eaves * (1 - 1e-9));
          EXPECT_LT(built.check.volume_m3, area(footprint.polygon) * (eaves + rise) * (1 + 1e-9));
        }
      }
    }
  }
}

TEST(Solid, EveryRoofOverRandomFootprintsIsClosed) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> angle(0, 2 * M_PI), metres(0.3, 20);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<Polygon2> pieces;
    switch (trial % 4) {
      case 0:
        pieces = cleaned({{random_star(random, 3 + trial % 23, 2, 15), {}}});
        break;
      case 1:
        pieces = random_blocks(random, 1 + trial % 7);
        break;
      case 2:
        for (const Polygon2& block : random_blocks(random, 1 + trial % 7)) {
          Polygon2 leaning{rotated(block.outer, 57.0 * trial), {}};
          for (const Ring& hole : block.holes) leaning.holes.push_back(rotated(hole, 57.0 * trial));
          for (Polygon2& piece : cleaned({leaning})) pieces.push_back(std::move(piece));
        }
        break;
      default:
        pieces = cleaned(
            {{random_star(random, 5 + trial % 13, 9, 15), {random_star(random, 3 + trial % 9, 3, 12)}}});
    }
    for (const Polygon2& polygon : pieces) {
      for (const RoofShape roof : kShapes) {
        SCOPED_TRACE("trial " + std::to_string(trial) + ", " + std::string(name(roof)));
        const double eaves = trial % 3 == 0 ? 0 : metres(random), rise = metres(random);
        Shape shape = shape_with(roof, eaves + rise, rise);
        if (trial % 5 < 2) shape.roof_direction_rad = angle(random);
        shape.roof_across = trial % 2 == 1;
        const Built built = build(polygon, shape, -1, -1);
        expect_sound(built, polygon, shape, -1, -1 + eaves + rise);
        EXPECT_GT(built.check.volume_m3, area(polygon) * eaves * (1 - 1e-9));
        EXPECT_LT(built.check.volume_m3, area(polygon) * (eaves + rise) * (1 + 1e-9));
      }
    }
  }
}

TEST(Solid, CutsGoThroughCornersThatTheyWouldMissByAHair) {
  // The ridge is at y = 4.9995, a corner of the gable at 5.
  const Polygon2 polygon{{{0, 0}, {20, 0}, {20, 5}, {20, 9.999}, {0, 9.999}}, {}};
  const Shape shape = shape_with(RoofShape::Gabled, 8, 3);
  const Built built = build(polygon, shape);
  expect_sound(built, polygon, shape, 0, 8);
  EXPECT_THAT(built.mesh.vertices, SizeIs(5 + 5 + 1));  // only the ridge's other end
  EXPECT_NEAR(built.check.volume_m3, 20 * 9.999 * 6.5, 1e-3 * 20 * 9.999);
}

/// Height of the roof above a position.
double roof_at(const Built& built, const Point2& point) {
  double highest = -1e9;
  for (const auto& t : built.mesh.triangles) {
    const Eigen::Vector3d &a = built.mesh.vertices[t[0]], &b = built.mesh.vertices[t[1]],
                          &c = built.mesh.vertices[t[2]];
    Eigen::Matrix3d m;
    m << a.x(), b.x(), c.x(), a.y(), b.y(), c.y(), 1, 1, 1;
    if (std::abs(m.determinant()) < 1e-9) continue;
    const Eigen::Vector3d fractions = m.inverse() * Eigen::Vector3d(point.x(), point.y(), 1);
    if (fractions.minCoeff() > -1e-9)
      highest = std::max(highest, fractions.dot(Eigen::Vector3d(a.z(), b.z(), c.z())));
  }
  return highest;
}

TEST(Solid, RidgesRunAsTheMapSays) {
  const Polygon2 long_east{box(-10, -4, 10, 4), {}};
  Shape shape = shape_with(RoofShape::Gabled, 8, 4);
  // Ridge along the longer side, at y = 0.
  Built built = build(long_east, shape);
  EXPECT_NEAR(roof_at(built, {9, 0}), 8, 1e-9);
  EXPECT_NEAR(roof_at(built, {0, 3}), 5, 1e-9);
  shape.roof_across = true;
  built = build(long_east, shape);
  EXPECT_NEAR(roof_at(built, {0, 3}), 8, 1e-9);
  EXPECT_NEAR(roof_at(built, {5, 1}), 6, 1e-9);
  shape.roof_across = false;
  shape.roof_direction_rad = geodesy::radians(90);  // slopes down towards east: ridge north-south
  EXPECT_NEAR(roof_at(build(long_east, shape), {0, 3}), 8, 1e-9);
  shape.roof_direction_rad = geodesy::radians(97);  // within half a compass point of the side
  EXPECT_NEAR(roof_at(build(long_east, shape), {0, 3}), 8, 1e-9);
  shape.roof_direction_rad = geodesy::radians(60);
  built = build(long_east, shape);
  EXPECT_NEAR(roof_at(built, 3 * Point2(-std::cos(geodesy::radians(60)), std::sin(geodesy::radians(60)))), 8,
              1e-9);
}

TEST(Solid, ASkillionSlopesDownTowardsItsDirection) {
  const Polygon2 polygon{box(-10, -4, 10, 4), {}};
  Shape shape = shape_with(RoofShape::Skillion, 8, 4);
  shape.roof_direction_rad = geodesy::radians(90);
  Built built = build(polygon, shape);
  EXPECT_NEAR(roof_at(built, {10, 1}), 4, 1e-9);
  EXPECT_NEAR(roof_at(built, {-10, 1}), 8, 1e-9);
  EXPECT_NEAR(roof_at(built, {-5, 1}), 7, 1e-9);
  shape.roof_direction_rad = geodesy::radians(180);
  built = build(polygon, shape);
  EXPECT_NEAR(roof_at(built, {3, -4}), 4, 1e-9);
  EXPECT_NEAR(roof_at(built, {3, 4}), 8, 1e-9);
  shape.roof_direction_rad.reset();  // across the longer side, towards the south
  EXPECT_NEAR(roof_at(build(polygon, shape), {3, -4}), 4, 1e-9);
}

TEST(Solid, ADomeOverARoundFootprintIsSmooth) {
  const Polygon2 polygon = cleaned({{regular(64, 10), {}}}).at(0);
  const Built built = build(polygon, shape_with(RoofShape::Dome, 15, 10));
  // The maximum distance inside the half sphere is that of the steps' chords: r (1 - cos(5.625 deg)) = 0.048
  // m, and 0.012 m for the 64 corners.
  for (double x = 0.5; x < 10; x += 0.7) {
    const double distance = Eigen::Vector3d(x, 0, roof_at(built, {x, 0}) - 5).norm();
    EXPECT_LT(distance, 10.001);
    EXPECT_GT(distance, 10 - 0.065);
  }
}

TEST(Solid, ATowersSpireHasLevelEaves) {
  const Polygon2 polygon = cleaned({{regular(6, 5), {}}}).at(0);
  const Shape shape = shape_with(RoofShape::Pyramidal, 30, 12);
  const Built built = build(polygon, shape);
  EXPECT_NEAR(built.check.volume_m3, area(polygon) * (18 + 12 / 3.0), 1e-9 * 22 * area(polygon));
  EXPECT_THAT(built.mesh.triangles, SizeIs(4 + 12 + 6));
}

TEST(Solid, WhatADomeCannotCoverIsFlatAndSaidSo) {
  const Polygon2 cup{{{0, 0}, {24, 0}, {24, 20}, {17, 20}, {17, 7}, {8, 7}, {8, 20}, {0, 20}}, {}};
  const Built built = build(cup, shape_with(RoofShape::Dome, 10, 4));
  EXPECT_NEAR(built.check.volume_m3, area(cup) * 8, 1e-6);
  ASSERT_THAT(built.notes, SizeIs(1));
  EXPECT_THAT(built.notes[0], HasSubstr("dome"));
}

TEST(Solid, StandsOnTheSlopeOrFloatsAboveIt) {
  const Polygon2 polygon{box(0, 0, 10, 5), {}};
  Shape shape = shape_with(RoofShape::Gabled, 9, 3);
  Built built = build(polygon, shape, 100, 98.5);  // the ground descends by 1.5 m
  expect_sound(built, polygon, shape, 98.5, 109);
  EXPECT_NEAR(built.check.volume_m3, 50 * (1.5 + 6 + 1.5), 1e-9);
  shape.min_height_m = 4;
  built = build(polygon, shape, 100, 98.5);
  expect_sound(built, polygon, shape, 104, 109);
  EXPECT_NEAR(built.check.volume_m3, 50 * (2 + 1.5), 1e-9);
  shape.min_height_m = 6;  // all roof
  built = build(polygon, shape, 100, 98.5);
  expect_sound(built, polygon, shape, 106, 109);
  EXPECT_NEAR(built.check.volume_m3, 50 * 1.5, 1e-9);
}

TEST(Solid, ObjectsFollowOneAnother) {
  Mesh mesh;
  std::vector<std::string> notes;
  append_solid(mesh, "a", city::Surface::Building, {box(0, 0, 10, 5), {}},
               shape_with(RoofShape::Hipped, 8, 2), 0, 0, notes);
  append_tree(mesh, "b", {20, 3}, 2, 9, 5);
  append_solid(mesh, "c", city::Surface::Foliage, {box(10, 0, 20, 5), {}}, shape_with(RoofShape::Flat, 8, 0),
               0, 0, notes);
  city::check_mesh(mesh, "three");
  ASSERT_THAT(mesh.objects, SizeIs(3));
  for (const auto& object : mesh.objects) EXPECT_TRUE(test::check_solid(mesh, object).watertight);
  EXPECT_NEAR(test::check_solid(mesh, mesh.objects[2]).volume_m3, 400, 1e-9);
  EXPECT_EQ(mesh.objects[2].surface, city::Surface::Foliage);
}

TEST(Solid, ATreeIsATrunkAndACrown) {
  Mesh mesh;
  append_tree(mesh, "oak", {1000, 2000}, 50, 12, 6);
  ASSERT_THAT(mesh.objects, SizeIs(1));
  EXPECT_EQ(mesh.objects[0].surface, city::Surface::Foliage);
  const test::SolidCheck check = test::check_solid(mesh, mesh.objects[0]);
  EXPECT_TRUE(check.watertight);
  // The crown is inscribed in an ellipsoid of half axes 3, 3 and 4.5 m.
  const double ellipsoid = 4 * M_PI / 3 * 3 * 3 * 4.5;
  EXPECT_GT(check.volume_m3, 0.7 * ellipsoid);
  EXPECT_LT(check.volume_m3, 1.02 * ellipsoid);
  Eigen::AlignedBox3d bounds;
  for (const auto& v : mesh.vertices) bounds.extend(v);
  EXPECT_TRUE(bounds.min().isApprox(Eigen::Vector3d(997, 1997, 50), 1e-9));
  EXPECT_TRUE(bounds.max().isApprox(Eigen::Vector3d(1003, 2003, 62), 1e-9));
}

TEST(SolidCheck, SeesHolesAndTurnedTriangles) {
  Mesh mesh;
  canyon::test::append_box(mesh, "box", city::Surface::Building, Material::Concrete, {0, 0, 0}, {2, 3, 4});
  EXPECT_TRUE(test::check_solid(mesh, mesh.objects[0]).watertight);
  EXPECT_NEAR(test::check_solid(mesh, mesh.objects[0]).volume_m3, 24, 1e-12);
  Mesh flipped_triangle = mesh;
  std::swap(flipped_triangle.triangles[3][0], flipped_triangle.triangles[3][1]);
  EXPECT_FALSE(test::check_solid(flipped_triangle, mesh.objects[0]).watertight);
  Mesh moved = mesh;  // one corner of one triangle, by a minimal distance
  moved.vertices.push_back(moved.vertices[moved.triangles[5][0]] + Eigen::Vector3d(0, 0, 1e-12));
  moved.triangles[5][0] = static_cast<std::uint32_t>(moved.vertices.size() - 1);
  EXPECT_FALSE(test::check_solid(moved, mesh.objects[0]).watertight);
  --mesh.objects[0].triangle_count;
  EXPECT_FALSE(test::check_solid(mesh, mesh.objects[0]).watertight);
  EXPECT_FALSE(test::check_solid(mesh, {"none", city::Surface::Building, 0, 0}).watertight);
}

}  // namespace
}  // namespace canyon::buildings::solid_test
