#include <gtest/gtest.h>

#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/city.hpp"
#include "canyon/outputs/drawing/views/sky_mask.hpp"
#include "tests/support/append_box.hpp"

namespace canyon::drawing {
namespace {

using geodesy::degrees;
using geodesy::kPi;
using geodesy::radians;

TEST(SkyMask, OpenFieldHidesNothing) {
  const raytrace::RayScene scene{city::Mesh{}};
  const SkyMask mask = make_sky_mask(scene, {0, 0, 2}, 36);
  EXPECT_EQ(mask.hidden_fraction(), 0);
  EXPECT_FALSE(mask.hidden(1, 0.1));
  EXPECT_FALSE(SkyMask{}.hidden(1, 0.1));
}

// A wall 10 m east, 20 m to both sides, 12 m above the antenna: towards azimuth a it is 10 / sin a away,
// its upper edge at the elevation whose tangent is 12 sin a / 10, from atan(10 / 20) before to after east.
TEST(SkyMask, WallInTheEast) {
  city::Mesh mesh;
  canyon::test::append_box(mesh, "wall", city::Surface::Building, city::Material::Unknown, {10, -20, -5},
                           {11, 20, 14});
  const raytrace::RayScene scene(mesh);
  const SkyMask mask = make_sky_mask(scene, {0, 0, 2}, 720);
  double fraction = 0;
  for (std::size_t a = 0; a < 720; ++a) {
    const double azimuth = (static_cast<double>(a) + 0.5) * 2 * kPi / 720;
    const auto& stretches = mask.azimuths[a];
    if (std::abs(azimuth - 0.5 * kPi) > std::atan(2) - 1e-9) {
      EXPECT_TRUE(stretches.empty()) << degrees(azimuth);
      continue;
    }
    ASSERT_EQ(stretches.size(), 1U) << degrees(azimuth);
    EXPECT_EQ(stretches[0].low_rad, 0);
    const double edge = std::atan(12 * std::sin(azimuth) / 10);
    EXPECT_NEAR(degrees(stretches[0].high_rad), degrees(edge), 0.01) << degrees(azimuth);
    fraction += std::sin(edge) / 720;
  }
  EXPECT_NEAR(mask.hidden_fraction(), fraction, 1e-4);
  EXPECT_TRUE(mask.hidden(radians(90), radians(40)));
  EXPECT_TRUE(mask.hidden(radians(90 - 360), radians(40)));
  EXPECT_FALSE(mask.hidden(radians(270), radians(40)));
  EXPECT_FALSE(mask.hidden(radians(90), radians(60)));
}

// A bridge leaves the sky below it open.
TEST(SkyMask, BridgeHidesAStretchOnly) {
  city::Mesh mesh;
  canyon::test::append_box(mesh, "bridge", city::Surface::Building, city::Material::Unknown, {-50, 20, 7},
                           {50, 30, 9});
  const raytrace::RayScene scene(mesh);
  const SkyMask mask = make_sky_mask(scene, {0, 0, 2}, 4 * 360);
  const auto& north = mask.azimuths[0];  // 0.125 deg
  ASSERT_EQ(north.size(), 1U);
  // Lower edge: the far side's underside, 5 m up at 30 m; upper edge: the near side's top, 7 m up at 20 m.
  EXPECT_NEAR(degrees(north[0].low_rad), degrees(std::atan(5.0 / 30)), 0.01);
  EXPECT_NEAR(degrees(north[0].high_rad), degrees(std::atan(7.0 / 20)), 0.01);
}

TEST(SkyMask, UnderARoofNothingIsOpen) {
  city::Mesh mesh;
  canyon::test::append_box(mesh, "house", city::Surface::Building, city::Material::Unknown, {-9, -9, -1},
                           {9, 9, 9});
  const raytrace::RayScene scene(mesh);
  EXPECT_NEAR(make_sky_mask(scene, {0, 0, 2}, 36).hidden_fraction(), 1, 1e-12);
}

}  // namespace
}  // namespace canyon::drawing
