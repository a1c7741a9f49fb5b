#include "canyon/paths/propagation/index/beam_index.hpp"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"

namespace canyon::propagation {
namespace {

using city::Mesh;
using Eigen::Vector3d;

TEST(Beam, IsTheConeAboutTheWindow) {
  Facet facet;
  facet.normal = Vector3d::UnitX();
  facet.offset = 10;
  facet.min = {10, -3, -4};
  facet.max = {10, 3, 4};
  // A sphere of radius 5, 10 m from the apex: half-angle asin(1/2) = 30 deg.
  const Beam beam = make_beam(facet, Vector3d::Zero(), 10, 300);
  EXPECT_TRUE(beam.axis.isApprox(Vector3d::UnitX(), 1e-12));
  EXPECT_NEAR(beam.sine, 0.5, 1e-12);
  EXPECT_NEAR(beam.cosine, std::sqrt(0.75), 1e-12);
  EXPECT_EQ(beam.window_m, 10);
  // From inside that sphere: everything in front of the apex.
  const Beam wide = make_beam(facet, {8, 0, 0}, 2, 300);
  EXPECT_EQ(wide.sine, 1);
  EXPECT_EQ(wide.cosine, 0);
  EXPECT_TRUE(wide.axis.isApprox(facet.normal));
}

TEST(Beam, HasTheSidesOfTheWindowAndTheRangeOfZ) {
  Facet facet;  // vertical, rotated by 30 deg
  facet.normal = Vector3d(std::sqrt(0.75), 0.5, 0);
  facet.offset = 10;
  const Vector3d along(-0.5, std::sqrt(0.75), 0),
      left = 10 * facet.normal - 4 * along - 2 * Vector3d::UnitZ(),
      right = left + 12 * along + 6 * Vector3d::UnitZ();
  facet.min = left.cwiseMin(right);
  facet.max = left.cwiseMax(right);
  const Beam beam = make_beam(facet, Vector3d::Zero(), 10, 300);
  EXPECT_NEAR(beam.low_z, -2 / std::sqrt(100 + 4), 1e-3);
  EXPECT_NEAR(beam.high_z, 4 / std::sqrt(100 + 16), 1e-3);
  const auto inside = [&](const Vector3d& point) {
    return std::all_of(beam.side.begin(), beam.side.end(),
                       [&](const Vector3d& side) { return side.dot(point) >= 0; });
  };
  for (const double u : {-4.1, -3.9, 7.9, 8.1}) {
    for (const double z : {-2.1, -1.9, 3.9, 4.1})
      EXPECT_EQ(inside(20 * facet.normal + 2 * u * along + 2 * z * Vector3d::UnitZ()),
                u > -4 && u < 8 && z > -2 && z < 4);
  }
}

TEST(BeamIndex, OfNothingFindsNothing) {
  const BeamIndex index{FacetSet{}};
  BeamIndex::Blocks blocks;
  index.gather(Vector3d::Zero(), 100, blocks);
  std::vector<BeamIndex::Match> found(1);
  DirectionBins bins;
  const Vector3d up = Vector3d::UnitZ();
  bins.build({&up, 1});
  Facet window;
  window.normal = Vector3d::UnitX();
  window.offset = 1;
  window.min = {1, -1, -1};
  window.max = {1, 1, 1};
  index.find(make_beam(window, Vector3d::Zero(), 1, 100), blocks, bins, nullptr, found);
  EXPECT_TRUE(found.empty());
  EXPECT_EQ(index.radius(), 0);
}

// Random rays of the beam: every facet that one passes from its front, in reach and beyond the window, is
// found with the direction into which it reflects the ray. Also far from the origin and with directions in
// another frame; and most facets are excluded.
TEST(BeamIndex, FindsEveryFacetThatReflectsIntoTheBeam) {
  city::SyntheticCityOptions options;
  options.blocks_east = options.blocks_north = 6;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.rotate(Eigen::AngleAxisd(1.1, Vector3d(0.3, 0.5, -0.8).normalized()));
  pose.pretranslate(Vector3d(5, 6, 7));
  for (const double away : {0.0, 8'000.0}) {
    Mesh mesh = city::synthetic_city(options).mesh;
    for (Vector3d& v : mesh.vertices) v += Vector3d(away, -away, 0);
    const FacetSet set(mesh, false);
    const BeamIndex index(set);
    const Eigen::Isometry3d* outer_from_set = away > 0 ? &pose : nullptr;
    std::mt19937_64 random(81);
    std::uniform_real_distribution<double> at(-150, 150), part(0, 1);
    std::uniform_int_distribution<std::size_t> any(0, set.facets().size() - 1);
    std::size_t found_in_all = 0, possible = 0, passed = 0, beams = 0;
    BeamIndex::Blocks blocks;
    std::vector<BeamIndex::Match> found;
    DirectionBins bins;
    while (beams < 400) {
      const Vector3d antenna =
          Vector3d(at(random), at(random), 2 + 60 * part(random)) + Vector3d(away, -away, 0);
      const Facet& window = set.facets()[any(random)];
      const double height = window.normal.dot(antenna) - window.offset;
      if (height < 0.1) continue;
      ++beams;
      constexpr double kReach = 200;
      const Beam beam = make_beam(window, antenna - 2 * height * window.normal, height, kReach);
      std::vector<std::uint32_t> facets;
      std::vector<Vector3d> directions;
      for (int ray = 0; ray < 20; ++ray) {
        const Vector3d through =
            window.min +
            Vector3d(part(random), part(random), part(random)).cwiseProduct(window.max - window.min);
        const Vector3d d = (through - beam.apex).normalized();
        if (d.dot(window.normal) <= 0) continue;
        for (std::uint32_t i = 0; i < set.facets().size(); ++i) {
          const Facet& facet = set.facets()[i];
          const double approach = -facet.normal.dot(d), over = facet.normal.dot(beam.apex) - facet.offset;
          if (approach < 1e-6 || over <= 0) continue;
          const double range = over / approach;
          const Vector3d point = beam.apex + range * d;
          if (range > kReach || (point - antenna).norm() > kReach ||
              window.normal.dot(point) < window.offset || !set.triangle_at(facet, point)) {
            continue;
          }
          const Vector3d s = d + 2 * approach * facet.normal;
          facets.push_back(i);
          directions.push_back(outer_from_set != nullptr ? Vector3d(pose.linear() * s) : s);
        }
      }
      bins.build(directions);
      index.gather(antenna, kReach, blocks);
      index.find(beam, blocks, bins, outer_from_set, found);
      for (std::size_t k = 0; k < facets.size(); ++k) {
        EXPECT_TRUE(std::any_of(found.begin(), found.end(), [&](const BeamIndex::Match& match) {
          return match.facet == facets[k] && match.group == k / 64 && (match.directions >> (k % 64) & 1) != 0;
        }));
      }
      passed += facets.size();
      possible += set.facets().size() * directions.size();
      for (const BeamIndex::Match& match : found) {
        EXPECT_NE(match.directions, 0u);
        found_in_all += static_cast<std::size_t>(__builtin_popcountll(match.directions));
      }
    }
    EXPECT_GT(passed, 1'000u);
    EXPECT_LT(found_in_all, possible / 20);
  }
}

}  // namespace
}  // namespace canyon::propagation
