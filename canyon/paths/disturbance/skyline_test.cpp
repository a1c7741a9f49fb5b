#include "canyon/paths/disturbance/skyline.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/paths/propagation/index/knife_edge.hpp"
#include "canyon/paths/signal/radio_materials.hpp"
#include "tests/support/spoiled_options.hpp"

namespace canyon::disturbance {
namespace {

using geodesy::radians;

constexpr double kDistance_m = 8, kHeight_m = 12, kShare = 0.4;
const geodesy::GpsTime kBegin = geodesy::GpsTime::from_week(2300, 1000);

/// Obstacles at one distance that do not move.
ShadowingOptions still() {
  ShadowingOptions options;
  options.enabled = true;
  options.skyline.share = kShare;
  options.skyline.height_m = kHeight_m;
  options.skyline.distance_m = kDistance_m;
  options.skyline.distance_sigma = 0;
  options.skyline.foliage_share = 0;
  options.skyline.length_m = 20;
  options.skyline.moving_share = 0;
  return options;
}

/// Tangents of the tops' elevations in all azimuths about many places; 0 without an obstacle.
std::vector<double> slopes(Skyline& skyline, double height_m) {
  std::vector<double> result;
  for (int i = 0; i < 3000; ++i) {
    skyline.go_to({37.0 * i, -11.0 * i}, height_m, kBegin);
    for (int k = 0; k < 4; ++k) result.push_back(std::tan(skyline.top_rad(radians(7 + 90 * k))));
  }
  return result;
}
double share_above(const std::vector<double>& values, double limit) {
  double count = 0;
  for (const double value : values) count += value > limit;
  return count / static_cast<double>(values.size());
}
/// For obstacles whose heights have a gamma distribution of shape 2: p (1 + x) e^-x.
double expected_above(double slope, double height_m) {
  const double x = 2 * (slope * kDistance_m + height_m - SkylineOptions::kBase_m) / kHeight_m;
  return kShare * (1 + x) * std::exp(-x);
}

TEST(Skyline, HasTheDistributionOfHeightsThatItIsGiven) {
  Skyline skyline(still(), 1);
  const std::vector<double> at_roof = slopes(skyline, SkylineOptions::kBase_m);
  for (const double slope : {0.0, 0.4, 1.0, 2.0}) {
    EXPECT_NEAR(share_above(at_roof, slope), expected_above(slope, 2), 0.02) << slope;
  }
}

TEST(Skyline, SinksAsTheAntennaRises) {
  Skyline skyline(still(), 2);
  for (const double height_m : {10.0, 20.0}) {
    const std::vector<double> above = slopes(skyline, height_m);
    for (const double slope : {0.0, 0.5}) {
      EXPECT_NEAR(share_above(above, slope), expected_above(slope, height_m), 0.02) << height_m;
    }
  }
  EXPECT_EQ(share_above(slopes(skyline, 120), 0), 0);
}

TEST(Skyline, IsFixedInTheWorld) {
  Skyline one(still(), 3), other(still(), 3), stranger(still(), 4);
  int same = 0;
  for (int i = 0; i < 200; ++i) {
    other.go_to({3.0 * i, 900}, 2, kBegin + i);  // elsewhere, on another way
    one.go_to({5.0 * i, 40}, 2, kBegin);
    other.go_to({5.0 * i, 40}, 2, kBegin + 3600);
    stranger.go_to({5.0 * i, 40}, 2, kBegin);
    EXPECT_EQ(one.top_rad(1), other.top_rad(1));
    same += one.top_rad(1) == stranger.top_rad(1);
  }
  EXPECT_LT(same, 150);  // both without an obstacle
}

/// Share of pairs of which both or none has an obstacle.
template <typename Second>
double alike(Skyline& skyline, const Second& second) {
  int same = 0;
  constexpr int kPairs = 4000;
  for (int i = 0; i < kPairs; ++i) {
    const Eigen::Vector2d place(61.0 * i, 17.0 * i);
    skyline.go_to(place, 2, kBegin);
    const bool before = skyline.top_rad(0.5) > 0;
    same += before == (second(place) > 0);
  }
  return same / double{kPairs};
}

TEST(Skyline, IsAlikeNearby) {
  Skyline skyline(still(), 5);
  const double unlike = kShare * kShare + (1 - kShare) * (1 - kShare);
  const auto moved = [&](double east_m) {
    return alike(skyline, [&, east_m](const Eigen::Vector2d& place) {
      skyline.go_to(place + Eigen::Vector2d(east_m, 0), 2, kBegin);
      return skyline.top_rad(0.5);
    });
  };
  const auto turned = [&](double degrees) {
    return alike(skyline,
                 [&, degrees](const Eigen::Vector2d&) { return skyline.top_rad(0.5 + radians(degrees)); });
  };
  EXPECT_GT(moved(1), 0.95);
  EXPECT_GT(moved(5), 0.75);
  EXPECT_NEAR(moved(60), unlike, 0.03);
  EXPECT_GT(turned(2), 0.93);
  EXPECT_GT(turned(10), 0.7);
  EXPECT_NEAR(turned(90), unlike, 0.03);
}

TEST(Skyline, ChangesInPartWithTime) {
  ShadowingOptions options = still();
  options.skyline.moving_share = 0.3;
  options.skyline.moving_s = 10;
  Skyline skyline(options, 6);
  const auto later = [&](double seconds) {
    return alike(skyline, [&, seconds](const Eigen::Vector2d& place) {
      skyline.go_to(place, 2, kBegin + seconds);
      return skyline.top_rad(0.5);
    });
  };
  EXPECT_GT(later(0.5), 0.97);
  // Two normal numbers with a correlation of 0.7 lie on one side of this share's limit in 0.75 of draws.
  EXPECT_NEAR(later(300), 0.75, 0.03);
}

TEST(Skyline, EdgesWeakenAsTheDiffractionOverThem) {
  Skyline skyline(still(), 7);
  constexpr double kWavelength_m = geodesy::kSpeedOfLight / 1575.42e6;
  int behind = 0;
  for (int i = 0; i < 300; ++i) {
    skyline.go_to({45.0 * i, 0}, 2, kBegin);
    const Eigen::Vector3d from = geodesy::enu_from_azimuth_elevation(2, radians(25));
    const double above = radians(15), below = skyline.top_rad(2) - above;
    const double level_db = skyline.level_db(from, above);
    EXPECT_EQ(skyline.level_db({from.x(), from.y(), -from.z()}, above), level_db);  // by way of the ground
    if (skyline.top_rad(2) == 0) {
      EXPECT_EQ(level_db, 0);
      continue;
    }
    // P.526-15, 4.1, with the edge's detour of an angle theta over the distance d: nu = theta sqrt(2 d /
    // lambda).
    const double nu = below * std::sqrt(2 * kDistance_m / kWavelength_m);
    const double round_db =
        below > 0 ? propagation::rounded_edge_loss_db(1, kDistance_m, below, kWavelength_m) : 0;
    EXPECT_NEAR(level_db, -propagation::approximate_knife_edge_loss_db(nu) - round_db, 1e-9);
    behind += below > 0;
  }
  EXPECT_GT(behind, 60);
}

TEST(Skyline, CrownsWeakenByTheirDepth) {
  ShadowingOptions options = still();
  options.skyline.foliage_share = 1;
  Skyline skyline(options, 8);
  const double elevation = radians(20);
  int behind = 0;
  for (int i = 0; i < 300; ++i) {
    skyline.go_to({45.0 * i, 0}, 2, kBegin);
    const double above = radians(12);
    const double level_db = skyline.level_db(geodesy::enu_from_azimuth_elevation(2, elevation), above);
    const double below_m = kDistance_m * (std::tan(skyline.top_rad(2)) - std::tan(above));
    if (below_m <= 0) {
      EXPECT_EQ(level_db, 0);
      continue;
    }
    ++behind;
    const double depth_m = std::min(below_m / std::sin(elevation), 5 / std::cos(elevation));
    EXPECT_NEAR(level_db,
                -signal::foliage_loss_db(signal::FoliageModel::SlantPath, depth_m, 1575.42e6, elevation),
                1e-9);
  }
  EXPECT_GT(behind, 60);
}

TEST(Skyline, IsEmptyWhereTheSurroundingsHaveNone) {
  ShadowingOptions options;
  EXPECT_TRUE(Skyline(options, 1).empty());
  options.environment = ShadowingEnvironment::Dense;
  EXPECT_FALSE(Skyline(options, 1).empty());
  options.skyline.share = 0;
  Skyline none(options, 1);
  none.go_to({1, 2}, 3, kBegin);
  EXPECT_EQ(none.top_rad(1), 0);
  EXPECT_EQ(none.level_db({0, 1, 0}, 0), 0);
}

// A wall 20 m high, 20 m to the north: its top is at 45 deg seen from the ground.
TEST(Skyline, StandsOnThatOfTheMap) {
  city::Mesh mesh;
  city::append_box(mesh, "wall", city::Surface::Building, city::Material::Concrete, {-200, 20, 0},
                   {200, 25, 20});
  const raytrace::RayScene scene(mesh);
  const Eigen::Vector3d antenna(0, 0, 0.01);
  const auto above_deg = [&](double azimuth_deg, double elevation_deg) {
    const Eigen::Vector3d from =
        geodesy::enu_from_azimuth_elevation(radians(azimuth_deg), radians(elevation_deg));
    return geodesy::degrees(above_skyline_rad(&scene, antenna, from));
  };
  EXPECT_NEAR(above_deg(0, 60), 15, 1);
  EXPECT_NEAR(above_deg(0, 46), 1, 0.8);
  EXPECT_NEAR(above_deg(45, 60), 60 - geodesy::degrees(std::atan(std::sqrt(0.5))), 1);
  EXPECT_NEAR(above_deg(0, 30), 0, 1e-9);  // hidden
  EXPECT_NEAR(above_deg(180, 30), 30, 1e-9);
  EXPECT_NEAR(above_deg(180, -30), 30, 1e-9);  // by way of the ground
  EXPECT_NEAR(above_skyline_rad(nullptr, antenna, {0, 0.6, 0.8}), std::asin(0.8), 1e-12);
}

TEST(Skyline, IsInTheWayOfAllButFacades) {
  const auto meets = [](propagation::PathKind kind, double up) {
    propagation::Path path;
    path.kind = kind;
    path.arrival = {0, 0.6, up};
    return meets_obstacles(path);
  };
  using propagation::PathKind;
  EXPECT_TRUE(meets(PathKind::Direct, 0.8));
  EXPECT_TRUE(meets(PathKind::Diffracted, 0.8));
  EXPECT_TRUE(meets(PathKind::Reflected, -0.8));  // by the ground
  EXPECT_FALSE(meets(PathKind::Reflected, 0.8));
  EXPECT_FALSE(meets(PathKind::Diffuse, 0.8));
}

TEST(SkylineOptions, NameTheFieldThatIsOutOfRange) {
  const test::SpoiledOptions<SkylineOptions> message;
  using O = SkylineOptions;
  using testing::HasSubstr;
  EXPECT_EQ(message([](O&) {}), "");
  EXPECT_THAT(message([](O& o) { o.share = 1.1; }), HasSubstr("share"));
  EXPECT_THAT(message([](O& o) { o.height_m = 0; }), HasSubstr("height_m"));
  EXPECT_THAT(message([](O& o) { o.distance_m = NAN; }), HasSubstr("distance_m"));
  EXPECT_THAT(message([](O& o) { o.length_m = 0; }), HasSubstr("length_m"));
  EXPECT_THAT(message([](O& o) { o.moving_s = 0; }), HasSubstr("moving_s"));
}

}  // namespace
}  // namespace canyon::disturbance
