// The only file of this program that counts allocations.

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "canyon/analysis/heatmap/kernels/shadows.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "tests/support/count_allocations.hpp"

namespace canyon::heatmap {
namespace {

TEST(ShadowCasterAllocation, TheSteadyStateAllocatesNothing) {
#ifdef CANYON_COUNTS_ALLOCATIONS
  const ShadowCaster caster(city::synthetic_city({}).mesh);
  const CellPlane plane{{-100, -100}, 1, 200, 200, 2};
  std::vector<std::uint8_t> blocked(200 * 200);
  std::vector<float> ranges(200 * 200);
  const auto all = [&] {
    for (int i = 0; i < 12; ++i) {
      const Eigen::Vector3d direction =
          geodesy::enu_from_azimuth_elevation(0.5 * i, geodesy::radians(5 + 7 * i));
      caster.shadows(plane, direction, blocked);
      caster.ranges(plane, direction, 100, ranges);
    }
  };
  all();
  const long before = test::allocations;
  all();
  EXPECT_EQ(test::allocations - before, 0);
  const std::vector<int> one(1);
  EXPECT_GT(test::allocations - before, 0) << "the counter counts";
#else
  GTEST_SKIP() << "SKIPPED: sanitizers bring their own allocator";
#endif
}

}  // namespace
}  // namespace canyon::heatmap
