#include "canyon/outputs/drawing/views/sky_render.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "canyon/base/geodesy/constants.hpp"

namespace canyon::drawing {
namespace {

using geodesy::kPi;
using geodesy::radians;

// Azimuth 90, elevation 45: at half the radius (equidistant), at tan(22.5 deg) = sqrt(2) - 1 of it
// (stereographic).
TEST(SkyLens, EastIsRightOnAMapAndLeftLookingUp) {
  SkyLens lens{{100, 200}, 80, SkyProjection::Equidistant, false};
  Point p = lens.point(radians(90), radians(45));
  EXPECT_NEAR(p.x, 140, 1e-12);
  EXPECT_NEAR(p.y, 200, 1e-12);
  lens.looking_up = true;
  p = lens.point(radians(90), radians(45));
  EXPECT_NEAR(p.x, 60, 1e-12);
  EXPECT_NEAR(p.y, 200, 1e-12);
  lens.projection = SkyProjection::Stereographic;
  p = lens.point(radians(90), radians(45));
  EXPECT_NEAR(p.x, 100 - 80 * (std::sqrt(2) - 1), 1e-12);
  // North is up and south is down in both views.
  EXPECT_NEAR(lens.point(0, 0).y, 120, 1e-12);
  EXPECT_NEAR(lens.point(kPi, 0).y, 280, 1e-12);
}

TEST(SkyLens, ZenithInTheMiddleHorizonOnTheRim) {
  for (const SkyProjection projection : {SkyProjection::Equidistant, SkyProjection::Stereographic}) {
    const SkyLens lens{{0, 0}, 10, projection, true};
    EXPECT_NEAR(lens.reach(0.5 * kPi), 0, 1e-12);
    EXPECT_NEAR(lens.reach(0), 1, 1e-12);
    EXPECT_GT(lens.reach(-0.1), 1);
    ASSERT_TRUE(lens.direction({0, 0}));
    EXPECT_NEAR(lens.direction({0, 0})->elevation_rad, 0.5 * kPi, 1e-12);
    EXPECT_FALSE(lens.direction({0, 10.001}));
    EXPECT_FALSE(lens.direction({-8, 8}));
  }
}

// A small square on the sky near the horizon stays square in the stereographic projection: |dr| / (r dA) is
// 1 / sin z there, the square's own proportion; equidistant stretches it along the rim by z / sin z.
TEST(SkyLens, StereographicKeepsSmallShapes) {
  const double z = radians(80), step = 1e-5;
  const auto proportion = [&](SkyProjection projection) {
    const SkyLens lens{{0, 0}, 1, projection, false};
    const double radial = lens.reach(0.5 * kPi - z - step) - lens.reach(0.5 * kPi - z + step);
    const double across = lens.reach(0.5 * kPi - z) * 2 * step / std::sin(z);  // equal angle on the sky
    return across / radial;
  };
  EXPECT_NEAR(proportion(SkyProjection::Stereographic), 1, 1e-6);
  EXPECT_NEAR(proportion(SkyProjection::Equidistant), z / std::sin(z), 1e-6);
}

TEST(SkyLens, DirectionIsTheInverseOfPoint) {
  for (const SkyProjection projection : {SkyProjection::Equidistant, SkyProjection::Stereographic}) {
    for (const bool looking_up : {false, true}) {
      const SkyLens lens{{410, 456}, 340, projection, looking_up};
      for (int azimuth_deg = 3; azimuth_deg < 360; azimuth_deg += 17) {
        for (int elevation_deg = 1; elevation_deg < 90; elevation_deg += 11) {
          const auto back = lens.direction(lens.point(radians(azimuth_deg), radians(elevation_deg)));
          ASSERT_TRUE(back);
          EXPECT_NEAR(back->azimuth_rad, radians(azimuth_deg), 1e-12);
          EXPECT_NEAR(back->elevation_rad, radians(elevation_deg), 1e-12);
        }
      }
    }
  }
}

}  // namespace
}  // namespace canyon::drawing
