#include "canyon/city/buildings/shapes/footprint.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"

namespace canyon::buildings {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using Ring = std::vector<Point2>;

Ring box(double x0, double y0, double x1, double y1) {
  return {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
}
Ring reversed(Ring ring) {
  std::reverse(ring.begin(), ring.end());
  return ring;
}

double twice_area(const Ring& ring) {
  double sum = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Point2 &a = ring[i], &b = ring[(i + 1) % ring.size()];
    sum += a.x() * b.y() - a.y() * b.x();
  }
  return sum;
}

double total_area(const std::vector<Polygon2>& polygons) {
  return std::accumulate(polygons.begin(), polygons.end(), 0.0,
                         [](double sum, const Polygon2& p) { return sum + area(p); });
}

/// Checks the guarantees of the header for polygons of repair() and the overlays.
void expect_clean(const std::vector<Polygon2>& polygons) {
  for (const Polygon2& polygon : polygons) {
    EXPECT_GT(twice_area(polygon.outer), 0);
    EXPECT_GE(area(polygon), 0.01);
    for (const Ring& hole : polygon.holes) EXPECT_LT(twice_area(hole), 0);
    std::vector<Ring> rings = polygon.holes;
    rings.push_back(polygon.outer);
    for (const Ring& ring : rings) {
      EXPECT_GE(ring.size(), 3U);
      for (std::size_t i = 0; i < ring.size(); ++i) {
        EXPECT_NE(ring[i], ring[(i + 1) % ring.size()]);
        for (const double v : {ring[i].x(), ring[i].y()}) EXPECT_EQ(v, std::round(v * 1000) / 1000);
      }
    }
  }
}

/// Checks a triangulation independently: areas add up, every ring edge belongs to one triangle, every other
/// edge to two. Corners are identified by position, because rings may touch.
void expect_covers(const Polygon2& polygon, const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  std::vector<Point2> points = polygon.outer;
  using Coordinates = std::pair<double, double>;
  std::map<std::pair<Coordinates, Coordinates>, int> edges;
  const auto point = [](const Point2& p) { return Coordinates(p.x(), p.y()); };
  const auto close = [&](const Ring& ring) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      --edges[{point(ring[i]), point(ring[(i + 1) % ring.size()])}];
    }
  };
  close(polygon.outer);
  for (const Ring& hole : polygon.holes) {
    points.insert(points.end(), hole.begin(), hole.end());
    close(hole);
  }
  double sum = 0;
  for (const auto& t : triangles) {
    ASSERT_LT(*std::max_element(t.begin(), t.end()), points.size());
    const double twice = twice_area({points[t[0]], points[t[1]], points[t[2]]});
    sum += 0.5 * twice;
    for (std::size_t k = 0; k < 3; ++k) ++edges[{point(points[t[k]]), point(points[t[(k + 1) % 3]])}];
  }
  for (const auto& [ends, count] : edges) {
    const auto back = edges.find({ends.second, ends.first});
    EXPECT_EQ(count, back == edges.end() ? 0 : back->second);
  }
  EXPECT_NEAR(sum, area(polygon), 1e-9 * area(polygon) + 1e-9);
}

std::vector<Polygon2> repaired(const std::vector<Polygon2>& raw, std::vector<std::string>& notes) {
  std::vector<Polygon2> result = repair(raw, notes);
  expect_clean(result);
  for (const Polygon2& polygon : result) {
    expect_covers(polygon, triangulate(polygon));
  }
  return result;
}

/// Simple by construction: seen from (x, y), angles ascend.
Ring star(std::mt19937_64& random, double x, double y, int corners, double inner, double outer) {
  std::uniform_real_distribution<double> radius(inner, outer), step(0.2, 1);
  std::vector<double> angles;
  double sum = 0;
  for (int i = 0; i < corners; ++i) angles.push_back(sum += step(random));
  Ring ring;
  for (const double a : angles) {
    const double r = radius(random), rotation = 2 * M_PI * a / sum;
    ring.emplace_back(x + r * std::cos(rotation), y + r * std::sin(rotation));
  }
  return ring;
}

TEST(Footprint, KeepsAGoodOutlineAndTurnsItCounterClockwise) {
  std::vector<std::string> notes;
  for (const Ring& ring : {box(0, 0, 10, 5), reversed(box(0, 0, 10, 5))}) {
    const auto polygons = repaired({{ring, {}}}, notes);
    ASSERT_EQ(polygons.size(), 1U);
    EXPECT_EQ(area(polygons[0]), 50);
  }
  Ring closed = box(0, 0, 10, 5);
  closed.push_back(closed.front());
  EXPECT_EQ(repaired({{closed, {}}}, notes).at(0).outer.size(), 4U);
  EXPECT_THAT(notes, IsEmpty());
}

TEST(Footprint, SnapsToMillimetres) {
  std::vector<std::string> notes;
  const auto polygons =
      repaired({{{{0.0001, 0}, {10.00049, -0.0003}, {10.0002, 5}, {10.0001, 5.0003}, {0, 5}}, {}}}, notes);
  ASSERT_EQ(polygons.size(), 1U);
  EXPECT_EQ(polygons[0].outer.size(), 4U);
  EXPECT_EQ(area(polygons[0]), 50);
  EXPECT_THAT(notes, ElementsAre("repeated points"));
}

TEST(Footprint, RemovesSpikes) {
  std::vector<std::string> notes;
  // The last one is tilted: its sides are less than 2 mm apart over 5 m.
  for (const Ring& ring : {Ring{{0, 0}, {10, 0}, {15, 0}, {10, 0}, {10, 5}, {0, 5}},
                           Ring{{0, 0}, {10, 0}, {10, 5}, {10, 9}, {10, 4}, {10, 5}, {0, 5}},
                           Ring{{0, 0}, {10, 0}, {10, 2}, {14, 5}, {10, 2.001}, {10, 5}, {0, 5}}}) {
    notes.clear();
    const auto polygons = repaired({{ring, {}}}, notes);
    ASSERT_EQ(polygons.size(), 1U);
    EXPECT_NEAR(area(polygons[0]), 50, 1e-9);
    EXPECT_THAT(notes, testing::Contains("spikes"));
  }
}

TEST(Footprint, ABowTieBecomesItsTwoLobes) {
  std::vector<std::string> notes;
  const auto polygons = repaired({{{{0, 0}, {10, 10}, {10, 0}, {0, 10}}, {}}}, notes);
  EXPECT_EQ(polygons.size(), 2U);
  EXPECT_NEAR(total_area(polygons), 50, 1e-9);
  EXPECT_THAT(notes, ElementsAre("self-crossing outline"));
}

TEST(Footprint, WhatARingEnclosesTwiceStaysInside) {
  // A loop whose ends overlap: boxes of 20 x 4 and 4 x 20 m in one ring, the corner twice.
  std::vector<std::string> notes;
  const auto polygons =
      repaired({{{{0, 0}, {20, 0}, {20, 4}, {0, 4}, {0, 0}, {4, 0}, {4, 20}, {0, 20}}, {}}}, notes);
  EXPECT_NEAR(total_area(polygons), 20 * 4 + 4 * 20 - 4 * 4, 1e-9);
}

TEST(Footprint, InnerRingsThatMeetTheOutline) {
  struct Case {
    std::vector<Ring> holes;
    double area_m2;
  };
  const std::vector<Case> cases = {
      {{box(5, 5, 10, 10)}, 375},                                   // well inside
      {{reversed(box(5, 5, 10, 10))}, 375},                         // either orientation
      {{box(0, 5, 10, 10)}, 350},                                   // along an edge
      {{box(-5, 5, 10, 10)}, 350},                                  // across the outline
      {{box(-5, 5, 25, 10)}, 300},                                  // across the whole outline: two polygons
      {{box(30, 30, 40, 40)}, 400},                                 // outside
      {{{{0, 10}, {5, 5}, {5, 15}}}, 375},                          // touching an edge with a corner
      {{{{0, 0}, {5, 2}, {2, 5}}}, 400 - 10.5},                     // touching a corner
      {{box(5, 5, 10, 10), box(10, 10, 15, 15)}, 350},              // touching each other
      {{box(5, 5, 10, 10), box(8, 8, 15, 15)}, 400 - 25 - 49 + 4},  // overlapping
      {{box(5, 5, 10, 10), box(10, 5, 15, 10)}, 350},               // sharing an edge
      {{{{5, 5}, {10, 5}}}, 400},                                   // no area
      {{box(0, 0, 20, 20)}, 0},
  };
  for (const Case& c : cases) {
    std::vector<std::string> notes;
    const auto polygons = repaired({{box(0, 0, 20, 20), c.holes}}, notes);
    EXPECT_NEAR(total_area(polygons), c.area_m2, 1e-9);
    EXPECT_EQ(polygons.empty(), c.area_m2 == 0);
  }
}

TEST(Footprint, UnitesOverlappingOutersAndFillsNothingBetweenApartOnes) {
  std::vector<std::string> notes;
  auto polygons = repaired({{box(0, 0, 10, 10), {}}, {box(20, 0, 30, 10), {}}}, notes);
  EXPECT_EQ(polygons.size(), 2U);
  EXPECT_NEAR(total_area(polygons), 200, 1e-9);
  EXPECT_THAT(notes, IsEmpty());
  polygons = repaired({{box(0, 0, 10, 10), {}}, {box(5, 5, 15, 15), {}}}, notes);
  EXPECT_EQ(polygons.size(), 1U);
  EXPECT_NEAR(total_area(polygons), 175, 1e-9);
  EXPECT_THAT(notes, ElementsAre("overlapping outlines"));
}

TEST(Footprint, SaysWhyNothingIsLeft) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::pair<std::vector<Polygon2>, std::string>> cases = {
      {{}, "no outline"},
      {{{{}, {}}}, "without area"},
      {{{{{1, 1}}, {}}}, "without area"},
      {{{{{1, 1}, {2, 2}}, {}}}, "without area"},
      {{{{{1, 1}, {2, 2}, {3, 3}}, {}}}, "without area"},
      {{{{{1, 1}, {1, 1}, {1, 1}, {1, 1}}, {}}}, "without area"},
      {{{box(0, 0, 0.05, 0.05), {}}}, "without area"},
      {{{{{0, 0}, {nan, 0}, {1, 1}}, {}}}, "1,000 km"},
      {{{{{0, 0}, {1e300, 0}, {1, 1}}, {}}}, "1,000 km"},
      {{{{{0, 0}, {std::numeric_limits<double>::infinity(), 0}, {1, 1}}, {}}}, "1,000 km"},
  };
  for (const auto& [raw, why] : cases) {
    std::vector<std::string> notes;
    EXPECT_THAT(repaired(raw, notes), IsEmpty());
    ASSERT_FALSE(notes.empty()) << why;
    EXPECT_THAT(notes.back(), HasSubstr(why));
  }
}

TEST(Footprint, WorksFarFromTheOrigin) {
  std::vector<std::string> notes;
  Ring ring = box(0, 0, 10, 5);
  for (Point2& p : ring) p += Point2(9e5, -9e5);
  const auto polygons = repaired({{ring, {}}}, notes);
  ASSERT_EQ(polygons.size(), 1U);
  EXPECT_NEAR(area(polygons[0]), 50, 1e-6);
}

TEST(Footprint, Overlays) {
  const std::vector<Polygon2> a{{box(0, 0, 10, 10), {}}}, b{{box(5, 5, 15, 15), {}}};
  for (const auto& [polygons, expected] :
       std::vector<std::pair<std::vector<Polygon2>, double>>{{subtract(a, b), 75},
                                                             {intersect(a, b), 25},
                                                             {unite({a[0], b[0]}), 175},
                                                             {subtract(a, {{box(2, 2, 4, 4), {}}}), 96},
                                                             {subtract(a, a), 0},
                                                             {subtract(a, {}), 100},
                                                             {subtract({}, a), 0},
                                                             {intersect(a, {}), 0},
                                                             {unite({}), 0}}) {
    expect_clean(polygons);
    EXPECT_NEAR(total_area(polygons), expected, 1e-9);
  }
  // A gap of 5 mm along a side is no building.
  EXPECT_THAT(subtract(a, {{box(0, 0, 9.995, 10), {}}}), IsEmpty());
}

TEST(Footprint, TriangulatesWithTouchingHolesAndCollinearPoints) {
  const std::vector<Polygon2> polygons = {
      {{{0, 0}, {5, 0}, {10, 0}, {10, 5}, {10, 10}, {5, 10}, {0, 10}, {0, 5}}, {}},
      {{{0, 0}, {1, 0}, {2, 0}, {3, 0}, {1.5, 4}}, {}},
      {box(0, 0, 20, 20), {reversed(box(5, 5, 10, 10)), reversed(box(10, 10, 15, 15))}},
      {{{0, 0}, {20, 0}, {20, 20}, {0, 20}, {0, 10}}, {{{0, 10}, {5, 15}, {5, 5}}}},
      {box(0, 0, 20, 20), {{{0, 0}, {2, 5}, {5, 2}}}},
      // Four diamonds in a ring, each touching the next one and the last one the outline.
      {{{0, 0}, {20, 0}, {20, 10}, {20, 20}, {0, 20}},
       {{{4, 10}, {6, 12}, {8, 10}, {6, 8}},
        {{8, 10}, {10, 12}, {12, 10}, {10, 8}},
        {{12, 10}, {14, 12}, {16, 10}, {14, 8}},
        {{16, 10}, {18, 12}, {20, 10}, {18, 8}}}},
  };
  for (const Polygon2& polygon : polygons) {
    const auto triangles = triangulate(polygon);
    ASSERT_FALSE(triangles.empty());
    expect_covers(polygon, triangles);
  }
}

TEST(Footprint, TriangulatesRandomPolygonsWithHoles) {
  std::mt19937_64 random(7);
  for (int trial = 0; trial < 300; ++trial) {
    Polygon2 raw{star(random, 3, -5, 3 + trial % 40, 10, 40), {}};
    for (int h = 0; h < trial % 5; ++h) {
      raw.holes.push_back(star(random, 3 + 9 * std::cos(1.5 * h), -5 + 9 * std::sin(1.5 * h), 3 + h, 2, 8));
    }
    std::vector<std::string> notes;
    const auto polygons = repaired({raw}, notes);
    EXPECT_FALSE(polygons.empty());
  }
}

TEST(Footprint, NeverTriangulatesCrossingRings) {
  for (const Polygon2& polygon : {Polygon2{{{0, 0}, {10, 10}, {10, 0}, {0, 10}}, {}}, Polygon2{{}, {}},
                                  Polygon2{box(0, 0, 10, 10), {reversed(box(5, 5, 15, 8))}},
                                  Polygon2{reversed(box(0, 0, 10, 10)), {}}}) {
    EXPECT_THAT(triangulate(polygon), IsEmpty());
  }
}

TEST(Footprint, AnyRingIsSurvived) {
  // Random walks over a few points cross, touch and repeat themselves in every possible way.
  std::mt19937_64 random(11);
  for (int trial = 0; trial < 500; ++trial) {
    std::uniform_int_distribution<int> coordinate(0, 3 + trial % 5), size(3, 14);
    const auto walk = [&] {
      Ring ring(static_cast<std::size_t>(size(random)));
      for (Point2& p : ring) p = {coordinate(random), coordinate(random)};
      return ring;
    };
    std::vector<Polygon2> raw(static_cast<std::size_t>(1 + trial % 2));
    for (Polygon2& polygon : raw) polygon = {walk(), {walk()}};
    std::vector<std::string> notes;
    const auto polygons = repaired(raw, notes);
    EXPECT_TRUE(!polygons.empty() || !notes.empty());
  }
}

// Crossings grow with the square of the corners: 2,000 random points, OSM's limit, have 460,000.
TEST(Footprint, TangledRingsAreToldAndCostNothing) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> coordinate(0, 100);
  Polygon2 knot, comb;
  for (int i = 0; i < 2000; ++i) knot.outer.emplace_back(coordinate(random), coordinate(random));
  for (int i = 0; i < 490; ++i)
    for (const Point2& p : {Point2(0, 100), Point2(0.1, 100), Point2(0.1, 0), Point2(0.2, 0)})
      comb.outer.emplace_back(p + Point2(0.2 * i, 0));
  comb.outer.emplace_back(98, -5);
  comb.outer.emplace_back(0, -5);
  Polygon2 rotated = comb;
  for (Point2& p : rotated.outer) std::swap(p.x(), p.y());
  std::vector<std::string> notes;
  EXPECT_TRUE(repair({knot}, notes).empty());
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_NE(notes[0].find("thousands of times"), std::string::npos);
  EXPECT_TRUE(repair({comb, rotated}, notes).empty());
  const std::vector<Polygon2> one = repair({comb}, notes), other = repair({rotated}, notes);
  ASSERT_EQ(one.size(), 1U);
  ASSERT_EQ(other.size(), 1U);
  EXPECT_TRUE(is_tangled({&one, &other}));
  EXPECT_FALSE(is_tangled({&one, &one}));
  EXPECT_THROW((void)intersect(one, other), InputError);

  // 36 storeys of 12 corners, each rotated by a degree: 15,000 crossings that may occur in a map.
  std::vector<Polygon2> storeys(36);
  for (std::size_t k = 0; k < storeys.size(); ++k)
    for (int i = 0; i < 12; ++i)
      storeys[k].outer.push_back(Eigen::Rotation2Dd(M_PI / 180 * static_cast<double>(k) + M_PI / 6 * i) *
                                 Point2(20, 0));
  EXPECT_FALSE(is_tangled({&storeys}));

  Polygon2 sieve{{{0, 0}, {400, 0}, {400, 400}, {0, 400}}, {}};
  for (int i = 0; i < 3001; ++i) {
    const Point2 at(4.0 * (i % 90) + 1, 4.0 * (i / 90) + 1);
    sieve.holes.push_back({at, at + Point2(2, 0), at + Point2(2, 2), at + Point2(0, 2)});
  }
  notes.clear();
  EXPECT_TRUE(repair({sieve}, notes).empty());
  EXPECT_EQ(notes.size(), 1U);
}

TEST(Footprint, ThreadsDoNotShareGeos) {
  std::vector<double> areas(4);
  std::vector<std::thread> threads;
  for (double& result : areas) {
    threads.emplace_back([&result] {
      for (int i = 0; i < 200; ++i) {
        std::vector<std::string> notes;
        result += total_area(repair({{box(0, 0, 20, 20), {box(-5, 5, 10, 10)}}}, notes));
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_THAT(areas, testing::Each(testing::DoubleNear(200 * 350, 1e-6)));
}

}  // namespace
}  // namespace canyon::buildings
